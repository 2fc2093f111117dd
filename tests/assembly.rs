//! The assembled system on one to four ranks: tiled against plain, against its own parts, and what
//! the solver multiplies with against the plain sums with the conditions put in.

mod common;

use std::path::Path;

use common::on_ranks;
use mpi::environment::Universe;
use mpi::traits::*;
use mpm_par::analysis::equilibrium::{Equilibrium, NewtonSettings, StepEquations, motion};
use mpm_par::analysis::solver;
use mpm_par::deck;
use mpm_par::deck::model::Frame;
use mpm_par::error::Result;
use mpm_par::parallel::{World, migrate};
use mpm_par::petsc::Session;
use mpm_par::petsc::snes::NewtonProblem;
use mpm_par::points::Points;
use mpm_par::run::setup;
use mpm_par::system::conditions::{Conditions, StepSpan};
use mpm_par::system::model::Model;
use mpm_par::system::plain;
use mpm_par::system::scatter::{self, BlockMatrix};
use mpm_par::system::step_system::Discretisation;
use mpm_par::system::terms::declaration::Context;
use mpm_par::system::terms::ghost::ghost_matrix;
use mpm_par::system::terms::stress;
use mpm_par::system::unknowns::Unknowns;

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

/// The block with its points off the middles of the cells.
fn block<const D: usize>(
    world: &World,
    basis: &str,
    per_cell: usize,
    plastic: bool,
) -> Result<(Model<D>, Points<D>)> {
    let text = deck_text(D, basis, per_cell, plastic);
    let deck = deck::read(Path::new("block.toml"), &text, &[])?;
    let (model, mut points): (Model<D>, _) = setup::prepare(world, deck)?;
    for x in &mut points.position {
        for (axis, x) in x.iter_mut().enumerate() {
            *x += 0.11 + 0.05 * axis as f64;
        }
    }
    migrate(world, &model.partition, &model.grid, &mut points)?;
    Ok((model, points))
}

/// Smooth displacements of the local nodes.
fn field<const D: usize>(model: &Model<D>, mesh: &Discretisation<D>) -> Vec<f64> {
    mesh.numbering
        .nodes
        .iter()
        .flat_map(|&node| {
            let x = model.grid.node_position(node);
            std::array::from_fn::<f64, D, _>(|i| 0.04 * x[i] + 0.03 * (x[(i + 1) % D]).sin())
        })
        .collect()
}

fn compare<const D: usize>(
    world: &World,
    basis: &str,
    per_cell: usize,
    plastic: bool,
) -> Result<()> {
    let (model, points) = block::<D>(world, basis, per_cell, plastic)?;
    let mesh = Discretisation::new(world, &model, &points)?;
    let numbering = &mesh.numbering;
    let displacement = field(&model, &mesh);
    let step = mesh.step_points(&points, &model.materials);
    for frame in [Frame::Previous, Frame::Updated, Frame::Total] {
        let zeros = vec![0.0; numbering.len() * D];
        let (mut fast, mut slow) = (zeros.clone(), zeros);
        let mut tiled = BlockMatrix::<D>::zeros(&mesh.pattern);
        let mut formulas = tiled.clone();
        let health = stress::assemble(
            step,
            frame,
            numbering,
            &mesh.pattern,
            &displacement,
            &mut fast,
            Some(&mut tiled),
        );
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
        let none = None::<&mut BlockMatrix<D>>;
        stress::assemble(step, frame, numbering, &mesh.pattern, &displacement, &mut again, none);
        assert_eq!(again, fast);
        // A rigid translation costs nothing: each row of K sums to zero over the columns.
        tiled.reduce(world, &mesh.pattern);
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

/// What the solver's matrix makes of a vector, against plain sums into whole rows, Ghost stiffness
/// and conditions included.
fn in_place<const D: usize>(world: &World, basis: &str) -> Result<()> {
    let (model, points) = block::<D>(world, basis, 2, false)?;
    let span =
        StepSpan { stage: 0, factor_start: 0.0, factor_end: 1.0, time_start: 0.0, time_end: 0.0 };
    let mesh = Discretisation::new(world, &model, &points)?;
    let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
    let deck = &model.deck;
    let boundaries = (&deck.boundaries[..], Unknowns::<D>::displacements());
    let basis_of = deck.method.basis;
    let conditions =
        Conditions::evaluate(world, &model.grid, basis_of, numbering, &points, boundaries, span)?;
    let left_out = mesh.nodes_left_out(world, 1e-2);
    let held: Vec<bool> =
        (0..numbering.len() * D).map(|dof| conditions.fixed[dof] || left_out[dof / D]).collect();
    assert!(world.any(held.contains(&true)) && world.any(held.contains(&false)));
    let displacement = field(&model, &mesh);
    let frame = Frame::Previous;
    let step = mesh.step_points(&points, &model.materials);

    let mut rows = BlockMatrix::<D>::zeros(pattern);
    let mut force = vec![0.0; numbering.len() * D];
    plain::assemble(step, frame, numbering, pattern, &displacement, &mut force, &mut rows);
    rows.reduce(world, pattern);
    let ghost = ghost_matrix(world, &mesh, |face| face.stiffness)?.expect("faces are stabilised");
    scatter::add_scalar(&ghost, pattern, &mut rows);
    // A vector that tells columns apart, and the rows times it.
    let probe: Vec<f64> = numbering
        .global
        .iter()
        .flat_map(|&node| {
            std::array::from_fn::<f64, D, _>(|i| (node as f64 + 0.3 * i as f64).sin())
        })
        .collect();
    let owned = numbering.owned * D;
    let (mut products, mut diagonals, mut free) = (vec![0.0; owned], 0.0, 0);
    for dof in (0..owned).filter(|&dof| !held[dof]) {
        let range = pattern.offsets[dof / D]..pattern.offsets[dof / D + 1];
        let start = D * D * range.start + dof % D * range.len() * D;
        for (position, &node) in pattern.columns[range].iter().enumerate() {
            for k in 0..D {
                let (column, value) =
                    (node as usize * D + k, rows.values[start + position * D + k]);
                if column == dof {
                    diagonals += value.abs();
                    free += 1;
                }
                if !held[column] {
                    products[dof] += value * probe[column];
                }
            }
        }
    }
    let scale = world.sum(diagonals) / world.sum_usize(free) as f64;
    for dof in (0..owned).filter(|&dof| held[dof]) {
        products[dof] = scale * probe[dof];
    }

    let settings = NewtonSettings {
        tolerance: 1e-9,
        max_evaluations: 10,
        inverted: deck.analysis.inverted_iterates,
        ends_where_stalled: false,
    };
    let external = vec![0.0; owned];
    let grid = &model.grid;
    let unknowns = Unknowns::displacements();
    let of = Context::new(world, &model, (&mesh, &points), span);
    let equations = StepEquations {
        unknowns,
        conditions: &conditions,
        left_out: &left_out,
        external_owned: external,
        terms: motion::terms(of, (frame, true), Vec::new())?,
        following: None,
    };
    let mut problem = Equilibrium::<D>::new(world, grid, &mesh, equations, settings);
    let mut matrix = solver::matrix(world, grid, (numbering, pattern), unknowns, true)?;
    let (mut x, mut y) = (matrix.vector()?, matrix.vector()?);
    x.values_mut()?.copy_from_slice(&probe[..owned]);
    let iterate = &displacement[..owned];
    let mut residual = vec![0.0; owned];
    assert!(problem.residual(iterate, &mut residual, &mut matrix)?);
    problem.jacobian(iterate, &mut matrix)?;
    matrix.mult(&x, &mut y)?;
    let first = y.values()?.to_vec();
    let largest = world.max(products.iter().fold(0.0, |m: f64, v| m.max(v.abs())));
    for (dof, (made, wanted)) in first.iter().zip(&products).enumerate() {
        assert!((made - wanted).abs() < 1e-13 * largest, "{dof}: {made:e}, {wanted:e}");
    }

    // The tangent made after the residual is the same to the last bit, and so is a repeat.
    let mut alone = vec![0.0; owned];
    for _ in 0..2 {
        assert!(problem.evaluate_at(iterate, &mut alone, None)?);
        assert_eq!(alone, residual);
        problem.jacobian(iterate, &mut matrix)?;
        matrix.mult(&x, &mut y)?;
        assert_eq!(y.values()?.to_vec(), first);
    }
    Ok(())
}

fn all_in_place(universe: &Universe) {
    let _session = Session::start(universe, &[], &[]).expect("PETSc starts");
    let world = World::new(universe.world().duplicate());
    for basis in ["mpm", "gimp"] {
        in_place::<2>(&world, basis).expect("2D runs");
        in_place::<3>(&world, basis).expect("3D runs");
    }
}

#[test]
fn the_solver_multiplies_with_the_plain_sums() {
    on_ranks("the_solver_multiplies_with_the_plain_sums", &[1, 2, 3, 4], all_in_place);
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
