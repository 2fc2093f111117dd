//! CPDI on lattices: Lagrangian §7.1 to 7.5, Tables 4 and 7, and the FEM column of Table 4.

use crate::common::run::{Results, Run, assert_prints};

#[test]
fn the_column_converges() {
    for basis in ["cpdi1", "cpdi2"] {
        let errors = [4, 5, 6, 7, 8].map(|k| {
            let h = 50.0 / f64::from(1 << k);
            Run::of("column")
                .set(format!("method.basis=\"{basis}\""))
                .set(format!("grid.h={h:?}"))
                .set(format!("grid.size=[{h:?}, 50.0]"))
                .results()
                .verify("stress_error")
        });
        let rate = (errors[0] / errors[4]).log2() / 4.0;
        assert!((1.0..=2.0).contains(&rate), "{basis}: {errors:?}");
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{basis}: {errors:?}");
    }
}

#[test]
fn simple_shear_is_exact() {
    for basis in ["cpdi1", "cpdi2"] {
        let results = Run::of("shear").set(format!("method.basis=\"{basis}\"")).results();
        for name in ["shear_stress", "normal_stress"] {
            assert!(results.verify(name) < 1e-11, "{basis} {name}");
        }
    }
}

/// The beam of Table 4 by CPDI2.
pub fn beam(h: f64, ranks: usize) -> Run {
    Run::of("beam-lagrangian")
        .ranks(ranks)
        .set("method.basis=\"cpdi2\"")
        .set("analysis.tolerance=1e-6")
        .set(format!("grid.h={h:?}"))
}

/// Newton evaluations.
fn total(run: &Run) -> f64 {
    run.results().number("newton_iterations.total")
}

#[test]
fn the_beam_takes_the_iterations_of_table_4() {
    for (h, printed) in [(0.5, 205.0), (0.25, 202.0)] {
        let total = total(&beam(h, 1));
        assert!((total / printed - 1.0f64).abs() < 0.02, "h = {h}: {total} {printed}");
    }
}

/// The solver looks for null pivots: nodes of tiny weight do no harm and need not be dropped.
#[test]
fn the_beam_does_not_depend_on_what_is_dropped() {
    for drop_below in ["0.0", "1e-12", "1e-5"] {
        let run = beam(0.5, 1).set(format!("method.drop_below={drop_below}"));
        assert_eq!(total(&run), 205.0, "{drop_below}");
    }
}

#[test]
#[ignore = "long: make validate"]
fn the_fine_beam_takes_the_iterations_of_table_4() {
    assert_eq!(total(&beam(0.125, 1)), 202.0);
}

fn finite_elements(along: usize) -> f64 {
    let total = Run::of("beam-fem")
        .set(format!("grid.generate.box.cells=[{along}, {}]", along / 10))
        .results()
        .number("newton_iterations.total");
    // The printed numbers leave out the evaluation at zero displacement of each of 50 steps.
    total - 50.0
}

#[test]
fn the_finite_element_beam_takes_the_iterations_of_table_4() {
    assert_eq!([20, 40].map(finite_elements), [157.0, 155.0]);
}

#[test]
#[ignore = "long: make validate"]
fn the_fine_finite_element_beam_takes_the_iterations_of_table_4() {
    assert_eq!(finite_elements(80), 154.0);
}

/// The collapse of Table 7 by CPDI2.
pub fn collapse(ranks: usize) -> Run {
    Run::of("collapse").ranks(ranks).set("method.basis=\"cpdi2\"")
}

/// Table 7, column CPDI2: extent 13.780, height 6.292.
#[test]
fn the_collapse_has_the_size_of_table_7() {
    let results = collapse(1).results();
    assert_prints(results.number("bodies.block.extent_max.0"), "13.780");
    // 6.2927 here: the last printed digit seems to be cut off, not rounded.
    let height = results.number("bodies.block.extent_max.1");
    assert!((height - 6.292).abs() < 1e-3, "{height}");
}

/// Corners of the sub-domains after a step, in the order of the points' identities.
fn shown<const C: usize>(results: &Results, step: usize) -> Vec<[[f64; 3]; C]> {
    let name = format!("points-{step:06}.h5");
    let kind = if C == 4 { "Quadrilateral" } else { "Hexahedron" };
    let description = results.text("domains.xdmf");
    for word in [kind, &format!("{name}:/domain_corners"), &format!("{name}:/stress")] {
        assert!(description.contains(word), "no {word} in domains.xdmf");
    }
    let file = hdf5::File::open(results.directory.join(&name)).expect("a points file");
    let read = |name: &str| file.dataset(name).expect("a dataset");
    let corners: Vec<f64> = read("domain_corners").read_raw().expect("numbers");
    let numbers: Vec<i64> = read("domain_corner_numbers").read_raw().expect("numbers");
    let id: Vec<i64> = read("id").read_raw().expect("numbers");
    let mut order: Vec<usize> = (0..id.len()).collect();
    order.sort_by_key(|&row| id[row]);
    let corner = |row: usize, c: usize| {
        let at = numbers[row * C + c] as usize * 3;
        [corners[at], corners[at + 1], corners[at + 2]]
    };
    order.into_iter().map(|row| std::array::from_fn(|c| corner(row, c))).collect()
}

const SHOWN: &str = "output.fields=[\"position\", \"volume\", \"stress\"]";

/// In ParaView: quadrilaterals that cover the ring (cpdi2), parallelograms about their points
/// (cpdi1), each with its point's area.
#[test]
fn sub_domains_of_the_plane_are_shown() {
    for basis in ["cpdi1", "cpdi2"] {
        let run = Run::of("doughnut-10").set(format!("method.basis=\"{basis}\"")).set(SHOWN);
        let results = run.ranks(2).results();
        let (points, corners) = (results.points(2), shown::<4>(&results, 2));
        let (volume, position) = (points.field("volume"), points.field("position"));
        assert_eq!(corners.len(), volume.len());
        let mut total = 0.0;
        for (p, x) in corners.iter().enumerate() {
            assert!(x.iter().all(|x| x[2] == 0.0));
            let across = |a: usize, b: usize, i: usize| x[b][i] - x[a][i];
            let area =
                0.5 * (across(0, 2, 0) * across(1, 3, 1) - across(1, 3, 0) * across(0, 2, 1));
            assert!((area / volume[p] - 1.0).abs() < 1e-9, "{basis} {p}: {area} {}", volume[p]);
            if basis == "cpdi1" {
                for i in 0..2 {
                    let middle = 0.25 * x.iter().map(|x| x[i]).sum::<f64>();
                    assert!((middle - position[3 * p + i]).abs() < 1e-12);
                    assert!(
                        (x[0][i] - x[1][i] + x[2][i] - x[3][i]).abs() < 1e-12,
                        "a parallelogram"
                    );
                }
            }
            // The sampling points come last and cover nothing of their own.
            if p < 4 * 720 {
                total += area;
            }
        }
        if basis == "cpdi2" {
            // 72 chords outside and inside; both circles only turn.
            let ring = 36.0 * 5f64.to_radians().sin() * (10.0 * 10.0 - 5.0 * 5.0);
            assert!((total / ring - 1.0).abs() < 1e-10, "{total} {ring}");
        }
    }
}

/// The same in space, where both bases run too: hexahedra of the points' volumes.
#[test]
fn sub_domains_of_space_are_shown() {
    for basis in ["cpdi1", "cpdi2"] {
        let results = Run::of("mms-3d-mesh")
            .set(format!("method.basis=\"{basis}\""))
            .set("body.0.points_per_cell=2")
            .set(SHOWN)
            .results();
        assert!(results.verify("displacement_error") < 0.02);
        let (points, corners) = (results.points(2), shown::<8>(&results, 2));
        let (volume, position) = (points.field("volume"), points.field("position"));
        assert_eq!(corners.len(), 512);
        let mut total = 0.0;
        for (p, x) in corners.iter().enumerate() {
            let own = mpm_par::basis::cpdi2::volume::<3>(x);
            total += own;
            let tolerance = if basis == "cpdi1" { 1e-9 } else { 1e-2 };
            assert!((own / volume[p] - 1.0).abs() < tolerance, "{basis} {p}: {own} {}", volume[p]);
            for i in 0..3 {
                let middle = 0.5 * (x[0][i] + x[6][i]);
                let off = (middle - position[3 * p + i]).abs();
                assert!(off < if basis == "cpdi1" { 1e-12 } else { 0.01 }, "{basis} {p}: {off}");
            }
        }
        if basis == "cpdi2" {
            assert!((total - 1.0).abs() < 1e-12, "the domains fill the cube: {total}");
        }
    }
}
