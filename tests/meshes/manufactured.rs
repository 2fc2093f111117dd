//! Manufactured solutions: Lagrangian §7.4 (Figure 19), and the same in two and three dimensions.

use crate::common::run::Run;

pub fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

/// Each halving of h brings at least `least` orders.
#[track_caller]
fn assert_order(errors: &[f64], least: f64) {
    for pair in errors.windows(2) {
        assert!(order(pair[0], pair[1]) >= least, "{errors:?}");
    }
}

fn error(run: Run) -> f64 {
    run.results().verify("displacement_error")
}

/// `[n, n]` or `[n, n, n]` for `--set`.
fn all(n: usize, dimension: usize) -> String {
    format!("[{}]", vec![n.to_string(); dimension].join(", "))
}

/// §7.4 on rings of triangles, `around` of them.
fn ring(radial: usize, around: usize, per_edge: usize) -> Run {
    Run::of("annulus-mms")
        .set(format!("grid.generate.annulus.radial={radial}"))
        .set(format!("grid.generate.annulus.around={around}"))
        .set(format!("body.0.points_per_cell={}", all(per_edge, 2)))
}

/// §7.4 on the unstructured mesh `k`.
fn unstructured(k: usize, per_edge: usize) -> f64 {
    let mesh = crate::common::run::input("annulus-unstructured")
        .with_file_name(format!("annulus-{k}.msh"));
    error(
        Run::of("annulus-unstructured")
            .set(format!("grid.file={:?}", mesh.display().to_string()))
            .set(format!("body.0.points_per_cell={}", all(per_edge, 2))),
    )
}

#[test]
fn the_annulus_converges_at_second_order() {
    let errors = [(4, 36), (8, 72), (16, 144)].map(|(r, a)| error(ring(r, a, 2)));
    assert_order(&errors, 1.7);
    assert!(order(errors[1], errors[2]) > 1.95, "{errors:?}");
}

#[test]
#[ignore = "long: make validate"]
fn the_annulus_converges_on_five_meshes() {
    let meshes = [(2, 18), (4, 36), (8, 72), (16, 144), (32, 288)];
    let mut finest = Vec::new();
    for per_edge in [1, 2, 3, 4] {
        let errors = meshes.map(|(r, a)| error(ring(r, a, per_edge)));
        assert!(order(errors[0], errors[4]) / 4.0 > 1.6, "{per_edge}: {errors:?}");
        assert!(order(errors[3], errors[4]) > 1.9, "{per_edge}: {errors:?}");
        finest.push(errors[4]);
    }
    assert!(finest.windows(2).all(|pair| pair[1] < pair[0]), "more points help: {finest:?}");
}

/// Where elements lose and win points irregularly, one point per element is not enough.
#[test]
fn one_point_fails_on_unstructured_meshes() {
    let errors = [1, 2, 3].map(|k| unstructured(k, 1));
    assert!(errors[2] > 2.0 * errors[1], "the line turns up again: {errors:?}");
}

#[test]
fn enough_points_converge_on_unstructured_meshes() {
    let errors = [1, 2, 3].map(|k| unstructured(k, 4));
    assert_order(&errors, 1.3);
    assert!(order(errors[1], errors[2]) > 1.9, "{errors:?}");
}

/// A unit square (cube) on a lattice.
fn on_lattice(dimension: usize, cells: usize, basis: &str, per_axis: usize) -> Run {
    Run::of(&format!("mms-{dimension}d"))
        .set(format!("grid.h={:?}", 1.0 / cells as f64))
        .set(format!("method.basis=\"{basis}\""))
        .set(format!("body.0.points_per_cell={}", all(per_axis, dimension)))
}

fn on_mesh(dimension: usize, cells: usize, basis: &str, per_axis: usize) -> Run {
    Run::of(&format!("mms-{dimension}d-mesh"))
        .set(format!("grid.generate.box.cells={}", all(cells, dimension)))
        .set(format!("method.basis=\"{basis}\""))
        .set(format!("body.0.points_per_cell={}", all(per_axis, dimension)))
}

#[test]
fn the_plane_converges_at_second_order() {
    let gimp = [4, 8, 16].map(|n| error(on_lattice(2, n, "gimp", 4)));
    assert_order(&gimp, 1.95);
    let mpm = [4, 8, 16].map(|n| error(on_lattice(2, n, "mpm", 16)));
    assert_order(&mpm, 1.95);
    let mesh = [4, 8, 16].map(|n| error(on_mesh(2, n, "mpm", 16)));
    for (a, b) in mpm.iter().zip(&mesh) {
        assert!((a / b - 1.0).abs() < 1e-8, "a mesh of squares is a lattice: {mpm:?} {mesh:?}");
    }
    let cpdi2 = [4, 8, 16].map(|n| error(on_mesh(2, n, "cpdi2", 4)));
    assert_order(&cpdi2, 1.95);
}

#[test]
fn triangles_and_tetrahedra_converge_too() {
    let triangles = [4, 8, 16]
        .map(|n| error(on_mesh(2, n, "mpm", 4).set("grid.generate.box.element=\"tri3\"")));
    assert_order(&triangles, 1.8);
    let tetrahedra =
        [4, 8].map(|n| error(on_mesh(3, n, "mpm", 2).set("grid.generate.box.element=\"tet4\"")));
    assert_order(&tetrahedra, 1.6);
}

#[test]
#[ignore = "long: make validate"]
fn space_converges_at_second_order() {
    let gimp = [2, 4, 8].map(|n| error(on_lattice(3, n, "gimp", 3)));
    assert_order(&gimp, 1.95);
    let mpm = [2, 4, 8].map(|n| error(on_lattice(3, n, "mpm", 6)));
    assert_order(&mpm, 1.9);
    let mesh = error(on_mesh(3, 4, "mpm", 6));
    assert!((mesh / mpm[1] - 1.0).abs() < 1e-8, "{mesh} {mpm:?}");
    let cpdi2 = [4, 8].map(|n| error(on_mesh(3, n, "cpdi2", 3)));
    assert_order(&cpdi2, 1.95);
}

/// Displacement and stress are compared without being asked; stress converges at first order.
#[test]
fn errors_are_reported_for_displacement_and_stress() {
    let results = [8, 16].map(|n| on_mesh(2, n, "cpdi2", 4).results());
    let [coarse, fine] = &results;
    let figure = |results: &crate::common::run::Results, name: &str| results.verify(name);
    let name = "manufactured_displacement";
    assert!(order(figure(coarse, name), figure(fine, name)) > 1.95);
    let name = "manufactured_stress";
    assert!(order(figure(coarse, name), figure(fine, name)) > 0.9);
}
