//! Linear iterations of conjugate gradients with algebraic multigrid on a curved body that lies
//! anyhow on the grid: Ghost stiffness off and in its three scalings, over the mesh size.
//!
//! `cargo bench --bench iterations [-- WORDS]`: the cases that hold all of the words, such as
//! `2d`, `3d`, `scale-free`, `large`. All of them, without words, make docs/figures/iterations.csv
//! and .svg; a selection writes the same two files to `iterations` in cargo's scratch folder.
//!
//! The body is a disc or ball of radius 1 m, seeded by a rotated lattice of points. It swells as
//! u = A (1 - c r²) r, c such that its surface is free of traction: the body force and the motion
//! of a cap that hold it there are known, and so is the stress.

mod disc;
mod svg;

use std::fmt::Write as _;
use std::path::Path;

use disc::{Case, Outcome};
use svg::{Panel, Series};

const SCALINGS: [&str; 4] = ["off", "published", "literal", "scale-free"];
const COLOURS: [&str; 4] = ["#777777", "#d95f02", "#7570b3", "#1b9e77"];
/// Places of the body on the grid, in cells along each axis.
const OFFSETS: [[f64; 3]; 4] =
    [[0.0, 0.0, 0.0], [0.25, 0.4, 0.6], [0.5, 0.15, 0.3], [0.77, 0.6, 0.9]];
/// Cells per radius.
const SIZES_2D: [usize; 4] = [8, 16, 32, 64];
const SIZES_3D: [usize; 4] = [3, 6, 12, 24];

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (dimension, sizes) in [(2, SIZES_2D), (3, SIZES_3D)] {
        for scaling in SCALINGS {
            for cells in sizes {
                for (place, offset) in OFFSETS.into_iter().enumerate() {
                    // The largest balls take minutes each: the default scaling only.
                    if dimension == 3 && cells == 24 && scaling != "scale-free" {
                        continue;
                    }
                    cases.push(Case { dimension, scaling, cells, place, offset, large: false });
                }
            }
        }
    }
    for cells in [16, 32, 64] {
        for (place, offset) in OFFSETS.into_iter().enumerate() {
            let scaling = "scale-free";
            cases.push(Case { dimension: 2, scaling, cells, place, offset, large: true });
        }
    }
    cases
}

fn main() {
    let words: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let mut table = String::from(
        "dimension,deformation,ghost,cells_per_radius,place,points,iterations_per_solve,\
         newton_evaluations,stress_error_l2,stress_error_max\n",
    );
    print!("{table}");
    let mut results = Vec::new();
    for case in cases() {
        let name = case.name();
        if !words.iter().all(|word| name.split(' ').any(|part| part == word)) {
            continue;
        }
        let outcome = case.run();
        let row = row(&case, outcome.as_ref());
        print!("{row}");
        table.push_str(&row);
        results.push((case, outcome));
    }
    let folder = match words.is_empty() {
        true => Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/figures"),
        false => Path::new(env!("CARGO_TARGET_TMPDIR")).join("iterations"),
    };
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    std::fs::write(folder.join("iterations.csv"), table).expect("the table can be written");
    let panels = [panel(2, &SIZES_2D, &results), panel(3, &SIZES_3D, &results)];
    let text = svg::figure(
        "Iterations of CG + multigrid per solve, over four places of the body on the grid",
        &panels,
    );
    std::fs::write(folder.join("iterations.svg"), text).expect("the figure can be written");
}

fn row(case: &Case, outcome: Option<&Outcome>) -> String {
    let mut row = format!(
        "{},{},{},{},{}",
        case.dimension,
        if case.large { "large" } else { "small" },
        case.scaling,
        case.cells,
        case.place
    );
    match outcome {
        Some(o) => {
            let _ = write!(row, ",{},{:.1},{}", o.points, o.iterations, o.evaluations);
            let _ = match case.large {
                false => write!(row, ",{:.3e},{:.3e}", o.stress_mean, o.stress_largest),
                true => write!(row, ",,"),
            };
        }
        None => row.push_str(",,failed,,,"),
    }
    row.push('\n');
    row
}

fn panel(dimension: usize, sizes: &[usize], results: &[(Case, Option<Outcome>)]) -> Panel {
    let series = SCALINGS
        .into_iter()
        .zip(COLOURS)
        .map(|(scaling, colour)| {
            let points = sizes
                .iter()
                .map(|&cells| {
                    let at: Vec<Option<f64>> = results
                        .iter()
                        .filter(|(case, _)| {
                            case.dimension == dimension
                                && case.cells == cells
                                && case.scaling == scaling
                                && !case.large
                        })
                        .map(|(_, outcome)| outcome.as_ref().map(|o| o.iterations))
                        .collect();
                    (cells as f64, at)
                })
                .collect();
            let name = if scaling == "off" { "without Ghost" } else { scaling };
            Series { name: name.into(), colour: colour.into(), points }
        })
        .collect();
    let body = if dimension == 2 { "2D: disc" } else { "3D: ball" };
    Panel { title: body.into(), across: "cells per radius".into(), series }
}
