//! κ of M, M~, M lumped, K and K~, the CFL number 1/(h sqrt(λ_max)) and the error of mapped
//! velocity (Ghost §2.6, 3.5, 5.1.1) while the bodies move rigidly through the grid. Nothing is
//! solved for; points keep their shape and carry no stress.

use crate::deck::model::Frame;
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::mass::inverse::MassInverse;
use crate::mass::matrix;
use crate::mass::solver::MassSolver;
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::{Conditioning, HistoryRow};
use crate::parallel::World;
use crate::petsc::log::Phase;
use crate::points::Points;
use crate::system::conditions::{Conditions, StepSpan};
use crate::system::scatter::{self, BlockMatrix};
use crate::system::step_points::StepPoints;
use crate::system::terms::stress;

use super::extremes::{Extremes, Reduced};
use crate::record::clock::Clock;
use crate::record::context::Run;
use crate::record::reactions::reactions;
use crate::record::recorder::Ending;
use crate::record::step::{Moment, grid_side};
use crate::system::model::Model;
use crate::system::step_system::{Coupling, Discretisation};
use crate::system::terms::ghost::ghost_matrix;
use crate::transfer::mapping;

/// Moves the bodies in equal increments and records one row for each position.
pub fn run<const D: usize>(run: &mut Run<D>) -> Result<Ending> {
    let model = &run.model;
    let steps = model.deck.analysis.steps.unwrap_or(1);
    let total = model.deck.conditioning_displacement.clone().unwrap_or_else(|| vec![0.0; D]);
    let done = match run.recorder.resumed() {
        Some(state) => state.count("conditioning.done")? as usize,
        None => {
            run.frame(0, 0.0)?;
            0
        }
    };
    for number in done + 1..=steps {
        for x in &mut run.points.position {
            for (x, total) in x.iter_mut().zip(&total) {
                *x += total / steps as f64;
            }
        }
        run.migrate_and_balance()?;
        let Run { world, model, points, recorder, clock } = &mut *run;
        let span = StepSpan {
            stage: 0,
            factor_start: (number - 1) as f64 / steps as f64,
            factor_end: number as f64 / steps as f64,
            time_start: 0.0,
            time_end: 0.0,
        };
        let mut row = study(world, model, points, clock, span)?;
        row.step = number;
        row.wall_seconds = clock.elapsed();
        recorder.steps_completed = number;
        let moment = if number == steps { Moment::End } else { Moment::Step };
        clock.time(Phase::Output, || {
            recorder.step(world, points, &row, false, moment)?;
            if recorder.wants_frame(number, span.factor_end, number == steps) {
                recorder.frame(world, number, span.factor_end, points)?;
            }
            Ok(())
        })?;
        let mut state = RunState::new();
        state.set_count("conditioning.done", number as u64);
        if let Some(ending) = recorder.end_step(world, model, points, moment, state)? {
            return Ok(ending);
        }
    }
    Ok(Ending::completed())
}

/// The numbers of one position. Collective.
fn study<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
    clock: &mut Clock,
    span: StepSpan,
) -> Result<HistoryRow> {
    let deck = &model.deck;
    let (mesh, conditions) = clock.time(Phase::Locate, || {
        Discretisation::with_conditions(world, model, points, Coupling::Matrix, span)
    })?;
    let system = clock.time(Phase::Assemble, || System::assemble(world, model, &mesh, points))?;
    let free: Vec<bool> =
        conditions.fixed[..mesh.numbering.owned * D].iter().map(|fixed| !fixed).collect();
    let numbers = clock
        .time(Phase::Solve, || system.numbers(world, model, &mesh, points, &conditions, &free))?;
    let none = vec![0.0; mesh.numbering.owned * D];
    Ok(HistoryRow {
        load_factor: span.factor_end,
        reactions: reactions(
            world,
            &model.grid,
            &mesh,
            points,
            &deck.boundaries,
            &conditions,
            &none,
        ),
        conditioning: numbers,
        ..grid_side(world, &mesh, points)
    })
}

/// The matrices of one position.
struct System<const D: usize> {
    mass: BlockMatrix<1>,
    mass_ghost: BlockMatrix<1>,
    lumped: Vec<f64>,
    stiffness: BlockMatrix<D>,
    stiffness_ghost: BlockMatrix<D>,
}

impl<const D: usize> System<D> {
    fn assemble(
        world: &World,
        model: &Model<D>,
        mesh: &Discretisation<D>,
        points: &Points<D>,
    ) -> Result<Self> {
        let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
        let step = mesh.step_points(points, &model.materials);
        let mass =
            matrix::consistent(world, step, pattern, (&mesh.numbering.halo, mesh.numbering.len()))?;
        let mut mass_ghost = mass.clone();
        if let Some(share) = ghost_matrix(world, mesh, |face| face.mass)? {
            add(&mut mass_ghost.values, &share.values);
        }
        let mut lumped = matrix::lumped(step, numbering.len());
        numbering.halo.reverse_add(world, &mut lumped, 1)?;

        // The tangent of unstrained points is the small-strain stiffness, in any frame.
        let mut stiffness = BlockMatrix::zeros(pattern);
        let still = vec![0.0; numbering.len() * D];
        let mut force = still.clone();
        stress::assemble(
            step,
            Frame::Previous,
            numbering,
            pattern,
            &still,
            &mut force,
            Some(&mut stiffness),
        );
        stiffness.reduce(world, pattern);
        let mut stiffness_ghost = stiffness.clone();
        if let Some(share) = ghost_matrix(world, mesh, |face| face.stiffness)? {
            scatter::add_scalar(&share, pattern, &mut stiffness_ghost);
        }
        Ok(System { mass, mass_ghost, lumped, stiffness, stiffness_ghost })
    }

    fn numbers(
        &self,
        world: &World,
        model: &Model<D>,
        mesh: &Discretisation<D>,
        points: &Points<D>,
        conditions: &Conditions,
        free: &[bool],
    ) -> Result<Conditioning> {
        let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
        let of_stiffness = |matrix: &BlockMatrix<D>| {
            Reduced { world, numbering, pattern, matrix, free }.extremes().map(Extremes::ratio)
        };
        let masses = [&self.mass, &self.mass_ghost];
        let stiffnesses = [&self.stiffness, &self.stiffness_ghost];
        let mut solver = MassSolver::default();
        let mut cfl = [0.0; 2];
        let mut error = [0.0; 2];
        for (k, matrix) in masses.into_iter().enumerate() {
            let inverse = MassInverse::<D>::new(
                world,
                &model.grid,
                numbering,
                pattern,
                matrix,
                &conditions.fixed,
                &mut solver,
            );
            cfl[k] = or_beyond(
                0.0,
                inverse.and_then(|mut inverse| {
                    let matrix = stiffnesses[k];
                    let reduced = Reduced { world, numbering, pattern, matrix, free };
                    let largest = reduced.largest_generalised(&mut inverse)?;
                    Ok(1.0 / (model.grid.cell_size() * largest.sqrt()))
                }),
            )?;
            let step = mesh.step_points(points, &model.materials);
            error[k] = or_beyond(
                f64::INFINITY,
                self.velocity_error(world, &model.grid, mesh, matrix, step),
            )?;
        }
        Ok(Conditioning {
            kappa_mass: self.kappa_of_mass(world, mesh, &self.mass, free)?,
            kappa_mass_ghost: self.kappa_of_mass(world, mesh, &self.mass_ghost, free)?,
            kappa_mass_lumped: self.kappa_lumped(world, free),
            kappa_stiffness: of_stiffness(&self.stiffness)?,
            kappa_stiffness_ghost: of_stiffness(&self.stiffness_ghost)?,
            cfl: cfl[0],
            cfl_ghost: cfl[1],
            velocity_error: error[0],
            velocity_error_ghost: error[1],
        })
    }

    /// M ⊗ 1 has the eigenvalues of M, but each component has its own held nodes.
    fn kappa_of_mass(
        &self,
        world: &World,
        mesh: &Discretisation<D>,
        matrix: &BlockMatrix<1>,
        free: &[bool],
    ) -> Result<f64> {
        let mut all = Extremes::NONE;
        let mut before: Vec<Vec<bool>> = Vec::new();
        for k in 0..D {
            let mask: Vec<bool> = free.iter().skip(k).step_by(D).copied().collect();
            let known = before.contains(&mask);
            if world.any(!known) {
                let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
                let reduced = Reduced { world, numbering, pattern, matrix, free: &mask };
                all = all.united(reduced.extremes()?);
            }
            before.push(mask);
        }
        Ok(all.ratio())
    }

    fn kappa_lumped(&self, world: &World, free: &[bool]) -> f64 {
        let masses = || {
            let some_free = |node: &usize| (0..D).any(|i| free[node * D + i]);
            (0..free.len() / D).filter(some_free).map(|node| self.lumped[node])
        };
        let smallest = world.min(masses().fold(f64::INFINITY, f64::min));
        let largest = world.max(masses().fold(f64::NEG_INFINITY, f64::max));
        Extremes { smallest, largest }.ratio()
    }

    /// Largest |v - 1| over the nodes that have mass when all points move with v = 1 (Ghost
    /// Figure 10); no node is held.
    fn velocity_error(
        &self,
        world: &World,
        grid: &Grid<D>,
        mesh: &Discretisation<D>,
        matrix: &BlockMatrix<1>,
        step: StepPoints<'_, D>,
    ) -> Result<f64> {
        let numbering = &mesh.numbering;
        let (free, solver) = (vec![false; numbering.len() * D], &mut MassSolver::default());
        let mut inverse =
            MassInverse::<D>::new(world, grid, numbering, &mesh.pattern, matrix, &free, solver)?;
        let unit = vec![[1.0; D]; step.points.len()];
        let mut sums = mapping::momentum(step, &unit, numbering.len());
        numbering.halo.reverse_add(world, sums.as_flattened_mut(), D)?;
        let owned = numbering.owned * D;
        // From zero: the usual first guess is the solution here, and would hide what the solve loses.
        let zero = vec![0.0; numbering.len() * D];
        let velocity = inverse.solve_from(&sums.as_flattened()[..owned], &zero, Some(&zero))?;
        let worst = (0..owned)
            .filter(|dof| self.lumped[dof / D] > 0.0)
            .map(|dof| (velocity[dof] - 1.0).abs())
            .fold(0.0, f64::max);
        Ok(world.max(worst))
    }
}

fn add(values: &mut [f64], shares: &[f64]) {
    for (value, share) in values.iter_mut().zip(shares) {
        *value += share;
    }
}

/// A mass that cannot be inverted in double precision is a finding here, not a fault.
fn or_beyond(limit: f64, outcome: Result<f64>) -> Result<f64> {
    match outcome {
        Err(Error::Run(_)) => Ok(limit),
        other => other,
    }
}
