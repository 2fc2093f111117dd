//! One step's equations handed to Newton's method, and what comes back: the part that implicit
//! analyses share.

use crate::deck::model::Basis;
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::{World, traffic};
use crate::petsc::log::Phase;
use crate::petsc::snes::NewtonOutcome;
use crate::petsc::{Matrix, Vector};
use crate::points::Points;
use crate::system::conditions::StepSpan;
use crate::system::terms::following::Following;

use super::equilibrium::{Equilibrium, NewtonSettings, StepEquations};
use super::solver::{self, Linear, Trials};
use super::time_loop::Next;
use crate::record::context::Run;
use crate::system::model::Model;
use crate::system::step_system::Discretisation;
use crate::transfer::mesh_motion;
use crate::transfer::refusal::{Cause, Halt, Refusal};
use crate::transfer::update::{self, Increments};

/// A converged step. Vectors hold the owned degrees of freedom unless said otherwise.
pub struct Converged {
    /// Nodal increments of local nodes, m.
    pub displacement: Vec<f64>,
    /// f_int + K_G u (and the share of inertia that moves with u), N.
    pub internal: Vec<f64>,
    /// The same at zero displacement.
    pub internal_start: Vec<f64>,
    /// Forces at the end that follow the motion, N; empty without any.
    pub following: Vec<f64>,
    /// u K_G u / 2 over all ranks, J.
    pub ghost_energy: f64,
    /// Normalised residual at the end.
    pub residual: f64,
    pub evaluations: usize,
    pub linear_iterations: usize,
}

/// What the deck says about the iteration.
pub fn settings<const D: usize>(model: &Model<D>) -> NewtonSettings {
    let deck = &model.deck;
    NewtonSettings {
        tolerance: deck.analysis.tolerance,
        max_evaluations: deck.analysis.max_iterations,
        frame: deck.method.frame,
        inverted: deck.analysis.inverted_iterates,
        symmetric: model.symmetric(),
    }
}

/// Solves the equations of a step and reports the iterations. Collective.
pub fn solve<const D: usize>(
    run: &mut Run<D>,
    mesh: &Discretisation<D>,
    equations: StepEquations<'_, D>,
    trials: &mut Trials,
    Next { span, number }: Next,
) -> std::result::Result<Converged, Halt> {
    let Run { world, model, points, recorder, clock } = run;
    let numbering = &mesh.numbering;
    let step = mesh.step_points(points, &model.materials);
    let mut problem = clock.time(Phase::Assemble, || {
        let following = Following::new(model, mesh, points, span.end());
        let problem = Equilibrium::new(world, &model.grid, mesh, step, equations, settings(model));
        Ok(problem?.with_following(following, 1.0 + model.deck.analysis.hht_alpha))
    })?;
    let mut matrix =
        clock.time(Phase::Assemble, || solver::matrix(world, model, numbering, &mesh.pattern))?;
    let mut solution = matrix.vector()?;
    let (before, waited) = (clock.elapsed(), traffic::so_far().waited);
    let stabilised = model.stabilised();
    let size = Size {
        shape: solver::Shape::of(model, problem.symmetric()),
        equations: numbering.total * D,
        stabilised,
        // A cell may have more nodes than corners of domains: some motions of the nodes then move no corner.
        null_pivots: !stabilised && matches!(model.deck.method.basis, Basis::Cpdi1 | Basis::Cpdi2),
    };
    let (outcome, used) =
        solve_robustly(world, &mut problem, size, trials, &mut matrix, &mut solution)?;
    if let Some(solver) = used {
        recorder.log.say(&format!("step {number}: multigrid failed; solved again with {solver}"));
    }
    let assembled = problem.assembly_seconds;
    clock.add(Phase::Assemble, assembled);
    // What the program waited for other ranks while the solver ran is time of the assembly, not busy. PETSc counts its
    // own waiting.
    clock.add_busy(assembled - (traffic::so_far().waited - waited));
    clock.add(Phase::Solve, clock.elapsed() - before - assembled);

    recorder.iterations(world, number, &problem.errors)?;
    if !outcome.converged {
        let point = problem.refused_point(points);
        let detail = world.first_message(point).map_or(String::new(), |text| format!(": {text}"));
        let what = format!("Newton's method failed ({}){detail}", outcome.reason);
        return Err(Refusal { cause: Cause::NotConverged, what }.into());
    }
    let residual = problem.errors.last().copied().unwrap_or(0.0);
    if problem.at_round_off {
        let detail = format!("(residual {residual:.1e})");
        recorder.log.warn_of_step(number, AT_ROUND_OFF, &detail);
    }
    recorder.newton.add(problem.errors.len());
    recorder.linear.add(outcome.linear_iterations_total);
    Ok(Converged {
        displacement: problem.displacement().to_vec(),
        internal: problem.internal_force().to_vec(),
        internal_start: problem.internal_force_at_start().to_vec(),
        following: problem.following_force().to_vec(),
        ghost_energy: world.sum(problem.ghost_energy()),
        residual,
        evaluations: problem.errors.len(),
        linear_iterations: outcome.linear_iterations_total,
    })
}

const AT_ROUND_OFF: &str = "the residual is above analysis.tolerance and all of it round-off: it is at \
     most what rounding leaves of the forces it is the difference of. The step counts as converged";

/// What a converged step does to points and grid, not yet applied.
pub struct Carried<const D: usize> {
    pub made: Increments<D>,
    /// `None` where the grid does not move.
    pub moved_grid: Option<Grid<D>>,
}

/// What the step's nodal `displacement` (local nodes, m) makes of points and grid. Refused, on every
/// rank alike: a cell that would turn over, an unsound point, an unsound domain. Collective.
pub fn carried<const D: usize>(
    world: &World,
    model: &Model<D>,
    mesh: &Discretisation<D>,
    points: &Points<D>,
    displacement: &[f64],
    span: StepSpan,
) -> std::result::Result<Carried<D>, Halt> {
    let (deck, grid, numbering) = (&model.deck, &model.grid, &mesh.numbering);
    let mut made = update::increments(mesh.step_points(points, &model.materials), displacement);
    let moved_grid = mesh_motion::moved(world, deck, grid, numbering, displacement, span)?;
    let after = moved_grid.as_ref().unwrap_or(grid);
    let basis = deck.method.basis;
    update::require_sound(world, after, &deck.boundaries, points, &made)?;
    let grids = [grid, after];
    update::require_sound_domains(world, grids, basis, numbering, displacement, points, &mut made)?;
    Ok(Carried { made, moved_grid })
}

/// What decides which linear solver is chosen.
#[derive(Clone, Copy)]
struct Size {
    shape: solver::Shape,
    /// Over all ranks.
    equations: usize,
    stabilised: bool,
    /// The factors may meet pivots that vanish.
    null_pivots: bool,
}

/// Newton's method with the default solver; where that fails, once more from the start with the
/// next stronger one, which is named. Collective.
fn solve_robustly<const D: usize>(
    world: &World,
    problem: &mut Equilibrium<'_, D>,
    size: Size,
    trials: &mut Trials,
    matrix: &mut Matrix,
    solution: &mut Vector,
) -> Result<(NewtonOutcome, Option<String>)> {
    let Size { shape, equations, stabilised, null_pivots } = size;
    let linear = Linear::of::<D>(equations, stabilised, trials)?;
    let most = problem.settings().max_evaluations;
    let mut snes = solver::newton(world, linear, shape, null_pivots, most)?;
    let outcome = snes.solve(problem, matrix, solution)?;
    trials.note(linear, !outcome.converged);
    let stronger = linear.stronger::<D>(equations, outcome.linear_failure);
    let Some(stronger) = stronger.filter(|_| !outcome.converged) else {
        return Ok((outcome, None));
    };
    let before = snes.ksp().describe()?;
    let mut snes = solver::newton(world, stronger, shape, null_pivots, most)?;
    let after = snes.ksp().describe()?;
    if before == after {
        // The user's options chose both.
        return Ok((outcome, None));
    }
    problem.restart();
    solution.values_mut()?.fill(0.0);
    Ok((snes.solve(problem, matrix, solution)?, Some(after)))
}
