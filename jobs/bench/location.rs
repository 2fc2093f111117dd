//! Nanoseconds of processor time to find points and corners of domains on meshes, beside
//! lattices, as grids grow.
//!
//! `cargo bench --bench location [-- WORDS]`: the grids whose names hold one of the words.
//!
//! Every grid covers the unit square (cube) with n cells a side, triangles and tetrahedra by
//! cutting those; meshes are bent by a tenth of a cell, so that no cell is a parallelogram. The
//! points are the same on all of them: 2 per side of a square, 0.13 h off the middle of their
//! sub-cells, so that domains of half a cell's width cross faces as they do after some steps.

mod report;

use std::hint::black_box;

use mpm_par::basis;
use mpm_par::deck::model::{Basis, Element};
use mpm_par::grid::generate::box_mesh;
use mpm_par::grid::{Grid, Lattice};
use mpm_par::points::Points;
use report::{machine, sample};

/// Cells per side.
const PLANE: [usize; 4] = [32, 64, 128, 256];
const SPACE: [usize; 3] = [8, 16, 32];

/// Two points per side of each of n^D equal cells, cell after cell.
fn points<const D: usize>(n: usize) -> Points<D> {
    let h = 1.0 / n as f64;
    let split = |mut flat: usize, count: usize| -> [usize; D] {
        std::array::from_fn(|_| {
            let index = flat % count;
            flat /= count;
            index
        })
    };
    let mut points = Points::default();
    for cell in 0..n.pow(D as u32) {
        let low = split(cell, n);
        // Domains of the outermost cells would leave the grid.
        if low.iter().any(|&i| i == 0 || i == n - 1) {
            continue;
        }
        for sub in 0..1 << D {
            let part = split(sub, 2);
            let x =
                std::array::from_fn(|a| h * (low[a] as f64 + 0.25 + 0.5 * part[a] as f64 + 0.13));
            let id = points.len() as u64;
            points.push_unstrained(id, 0, x, (0.5 * h).powi(D as i32), 1.0, [0.25 * h; D]);
        }
    }
    points
}

/// Multiplicative stride through all points: consecutive queries are far apart.
fn scattered(count: usize) -> Vec<usize> {
    let mut stride = (count as f64 * 0.618) as usize | 1;
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    while gcd(stride, count) > 1 {
        stride += 2;
    }
    (0..count).map(|k| k * stride % count).collect()
}

fn grid<const D: usize>(element: Option<Element>, n: usize) -> Grid<D> {
    let h = 1.0 / n as f64;
    let Some(element) = element else {
        return Grid::Lattice(Lattice { origin: [0.0; D], spacing: [h; D], cells: [n; D] });
    };
    let mut mesh = box_mesh([0.0; D], [1.0; D], [n; D], element).expect("a box");
    mesh.set_positions(bent(&mesh, h)).expect("bent a little");
    Grid::Mesh(mesh)
}

/// Nodes inside moved by up to a tenth of a cell.
fn bent<const D: usize>(mesh: &mpm_par::grid::Mesh<D>, h: f64) -> Vec<[f64; D]> {
    (0..mesh.node_count())
        .map(|node| {
            let x = mesh.node_position_initial(node);
            let inside = x.iter().all(|x| *x > 0.5 * h && *x < 1.0 - 0.5 * h);
            std::array::from_fn(|a| {
                let wave = (x[(a + 1) % D] * 2.1 / h).sin();
                x[a] + if inside { 0.1 * h * wave } else { 0.0 }
            })
        })
        .collect()
}

fn measure<const D: usize>(name: &str, element: Option<Element>, sizes: &[usize]) {
    for &n in sizes {
        let mut grid = grid::<D>(element, n);
        let points = points::<D>(n);
        let count = points.len();
        let sorted = sample(count, || {
            for x in &points.position {
                black_box(grid.locate(x));
            }
        });
        let order = scattered(count);
        let random = sample(count, || {
            for &p in &order {
                black_box(grid.locate(&points.position[p]));
            }
        });
        let row = |basis: Basis, per_point: usize| {
            sample(count * per_point, || {
                black_box(basis::map_points(&grid, basis, &points).expect("all inside"));
            })
        };
        let (mpm, cpdi1, cpdi2) =
            (row(Basis::Mpm, 1), row(Basis::Cpdi1, 1 << D), row(Basis::Cpdi2, 1 << D));
        let cells = grid.cell_count();
        let moved = match &mut grid {
            Grid::Lattice(_) => "-".to_string(),
            Grid::Mesh(mesh) => {
                let positions = bent(mesh, 1.0 / n as f64);
                let time = sample(cells, || {
                    mesh.set_positions(positions.clone()).expect("as before");
                });
                time.to_string()
            }
        };
        println!(
            "| {name} | {cells} | {count} | {sorted} | {random} | {mpm} | {cpdi1} | {cpdi2} | \
             {moved} |"
        );
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|w| !w.starts_with('-')).collect();
    let wanted = |name: &str| words.is_empty() || words.iter().any(|w| name.contains(w.as_str()));
    println!("{}\n", machine());
    println!("ns of processor time, median of {} (least)\n", report::RUNS);
    println!(
        "| grid | cells | points | locate, points in cell order | locate, scattered | mpm row, \
         per point | cpdi1 row, per corner | cpdi2 row, per corner | after motion, per cell |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, element) in
        [("lattice-2d", None), ("quad4", Some(Element::Quad4)), ("tri3", Some(Element::Tri3))]
    {
        if wanted(name) {
            measure::<2>(name, element, &PLANE);
        }
    }
    for (name, element) in
        [("lattice-3d", None), ("hex8", Some(Element::Hex8)), ("tet4", Some(Element::Tet4))]
    {
        if wanted(name) {
            measure::<3>(name, element, &SPACE);
        }
    }
}
