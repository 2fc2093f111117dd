//! The assembled system on one to four ranks: tiled against plain, and against its own parts.

mod common;

use std::path::Path;

use common::on_ranks;
use mpi::environment::Universe;
use mpi::traits::*;
use mpm_par::analysis::discretise::{Discretisation, Model};
use mpm_par::analysis::setup;
use mpm_par::assembly::internal::{self, StepPoints};
use mpm_par::assembly::{BlockMatrix, plain};
use mpm_par::deck;
use mpm_par::deck::model::Frame;
use mpm_par::error::Result;
use mpm_par::parallel::{World, migrate};

/// A block of material whose points lie off the middles of the cells, `per_cell` of them a side.
fn deck_text(dimension: usize, basis: &str, per_cell: usize, plastic: bool) -> String {
    let list = |value: f64| format!("{:?}", vec![value; dimension]);
    let model = if plastic { "\"von-mises\"\nyield = 2e4" } else { "\"hencky\"" };
    let cells = if dimension == 2 { 6.0 } else { 3.0 };
    format!(
        "title = \"block\"\n[analysis]\ntype = \"quasi-static\"\nsteps = 1\n\
         [method]\nbasis = \"{basis}\"\n[ghost]\nstiffness_factor = 1.0\n\
         [grid]\ntype = \"lattice\"\norigin = {}\nsize = {}\nh = 1.0\n\
         [material.m]\nmodel = {model}\nyoung = 1e6\npoisson = 0.3\n\
         [[body]]\nname = \"block\"\nmaterial = \"m\"\ndensity = 1.0\n\
         shape = {{ box = {{ min = {}, max = {} }} }}\npoints_per_cell = {:?}\n\
         [[boundary]]\nname = \"low\"\nwhere = {{ box = {{ min = {}, max = {} }} }}\nfix = {}\n\
         [[load]]\ngravity = {}\n[output]\nevery = 1\nfields = [\"stress\"]\n",
        list(-1.0),
        list(cells + 3.0),
        list(0.0),
        list(cells),
        vec![per_cell; dimension],
        list(-2.0),
        list(1.0),
        if dimension == 2 { "[\"x\", \"y\"]" } else { "[\"x\", \"y\", \"z\"]" },
        list(-1.0),
    )
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / size.max(f64::MIN_POSITIVE)
}

fn compare<const D: usize>(
    world: &World,
    basis: &str,
    per_cell: usize,
    plastic: bool,
) -> Result<()> {
    let text = deck_text(D, basis, per_cell, plastic);
    let deck = deck::read(Path::new("block.toml"), &text, &[])?;
    let (model, mut points): (Model<D>, _) = setup::prepare(world, deck)?;
    for x in &mut points.position {
        for (axis, x) in x.iter_mut().enumerate() {
            *x += 0.11 + 0.05 * axis as f64;
        }
    }
    migrate(world, &model.partition, &model.grid, &mut points)?;
    let mesh = Discretisation::new(world, &model, &points)?;
    let numbering = &mesh.numbering;
    let displacement: Vec<f64> = numbering
        .nodes
        .iter()
        .flat_map(|&node| {
            let x = model.grid.node_position(node);
            std::array::from_fn::<f64, D, _>(|i| 0.04 * x[i] + 0.03 * (x[(i + 1) % D]).sin())
        })
        .collect();
    let step = StepPoints {
        points: &points,
        materials: &model.materials,
        influences: &mesh.influences,
        groups: &mesh.groups,
        group_nodes: &mesh.group_nodes,
    };
    for frame in [Frame::Previous, Frame::Updated, Frame::Total] {
        let zeros = vec![0.0; numbering.len() * D];
        let (mut fast, mut slow) = (zeros.clone(), zeros);
        let mut tiled = BlockMatrix::<D>::zeros(&mesh.pattern);
        let mut formulas = tiled.clone();
        let health = internal::assemble(
            step,
            frame,
            numbering,
            &mesh.pattern,
            &displacement,
            &mut fast,
            Some(&mut tiled),
        )?;
        assert!(health.is_sound() && health.inverted.is_none());
        plain::assemble(
            step,
            frame,
            numbering,
            &mesh.pattern,
            &displacement,
            &mut slow,
            &mut formulas,
        );
        assert!(difference(&fast, &slow) < 1e-13, "{basis} {D}D: forces");
        assert!(difference(&tiled.values, &formulas.values) < 1e-13, "{basis} {D}D: stiffness");
        // Bit by bit the same on a repeat, with or without the tangent.
        let mut again = vec![0.0; numbering.len() * D];
        internal::assemble(step, frame, numbering, &mesh.pattern, &displacement, &mut again, None)?;
        assert_eq!(again, fast);
        // A rigid translation costs nothing: each row of K sums to zero over the columns.
        tiled.reduce(world, &mesh.pattern)?;
        let scale = tiled.values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for row in 0..numbering.owned {
            let (start, end) = (mesh.pattern.offsets[row], mesh.pattern.offsets[row + 1]);
            let width = (end - start) * D;
            for i in 0..D {
                let line = &tiled.values[D * D * start + i * width..][..width];
                for k in 0..D {
                    let sum: f64 = line.iter().skip(k).step_by(D).sum();
                    assert!(sum.abs() < 1e-12 * scale, "row {row}: {sum:e} of {scale:e}");
                }
            }
        }
    }
    Ok(())
}

fn all_cases(universe: &Universe) {
    let world = World::new(universe.world().duplicate());
    for (basis, per_cell) in [("mpm", 2), ("gimp", 1), ("gimp", 2), ("gimp", 5)] {
        for plastic in [false, true] {
            compare::<2>(&world, basis, per_cell, plastic).expect("2D runs");
            if per_cell < 5 {
                compare::<3>(&world, basis, per_cell, plastic).expect("3D runs");
            }
        }
    }
}

#[test]
fn tiled_and_plain_assembly_agree() {
    on_ranks("tiled_and_plain_assembly_agree", &[1, 2, 3, 4], all_cases);
}
