//! Newton's method on the equations of one step, with the default linear solvers: the part that implicit analyses
//! share.

use std::time::Instant;

use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::{World, traffic};
use crate::petsc::log::Phase;
use crate::petsc::snes::NewtonOutcome;
use crate::petsc::{Matrix, Vector};
use crate::points::Points;
use crate::system::conditions::StepSpan;

use super::equilibrium::{Equilibrium, NewtonSettings, StepEquations};
use super::solver::{self, Linear, Trials};
use crate::record::clock::Clock;
use crate::record::recorder::Recorder;
use crate::system::model::Model;
use crate::system::step_system::Discretisation;
use crate::transfer::mesh_motion;
use crate::transfer::refusal::{Cause, Halt, Refusal};
use crate::transfer::soundness;
use crate::transfer::update::{self, Increments};

/// A converged step. Vectors hold the owned degrees of freedom unless said otherwise.
pub struct Converged {
    /// Increments of the unknowns at the local nodes, m for displacements.
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
    /// Of the residual.
    pub evaluations: usize,
    /// Of all linear solves.
    pub linear_iterations: usize,
}

/// What the deck says about the iteration.
pub(crate) fn settings<const D: usize>(model: &Model<D>) -> NewtonSettings {
    let analysis = &model.deck.analysis;
    NewtonSettings {
        tolerance: analysis.tolerance,
        max_evaluations: analysis.max_iterations,
        inverted: analysis.inverted_iterates,
        ends_where_stalled: !model.contacts.is_empty() || !model.facing.is_empty(),
    }
}

/// A step's equations of `N` unknowns per node, and the matrix of their tangents.
pub struct System<'a, const D: usize, const N: usize = D> {
    equations: Equilibrium<'a, D, N>,
    matrix: Matrix,
    size: Size,
}

impl<'a, const D: usize, const N: usize> System<'a, D, N> {
    /// Before the first iterate. Collective.
    pub fn new(
        world: &'a World,
        model: &'a Model<D>,
        mesh: &'a Discretisation<D>,
        equations: StepEquations<'a, N>,
    ) -> Result<Self> {
        let (grid, unknowns) = (&model.grid, equations.unknowns);
        let equations = Equilibrium::new(world, grid, mesh, equations, settings(model));
        let (of, symmetric) = ((&mesh.numbering, &mesh.pattern), equations.symmetric());
        let matrix = solver::matrix(world, grid, of, unknowns, symmetric)?;
        let stabilised = model.stabilised();
        // A cell may have more nodes than corners of domains: some motions of the nodes then move no corner.
        let by_corners = model.deck.method.basis.domain().has_corners();
        let size = Size {
            shape: solver::Shape::of(model, unknowns, symmetric),
            equations: mesh.numbering.total * N,
            stabilised,
            null_pivots: !stabilised && by_corners,
        };
        Ok(System { equations, matrix, size })
    }

    /// Solves for the increments of the step; `points`: those of the equations. Collective.
    pub fn solve(self, world: &World, points: &Points<D>, trials: &mut Trials) -> Result<Attempt> {
        let System { mut equations, mut matrix, size } = self;
        let mut solution = matrix.vector()?;
        let (begin, waited) = (Instant::now(), traffic::so_far().waited);
        let (outcome, used) =
            solve_robustly(world, &mut equations, size, trials, &mut matrix, &mut solution)?;
        let (seconds, waited) = (begin.elapsed().as_secs_f64(), traffic::so_far().waited - waited);
        let end = if outcome.converged {
            Ok(Converged {
                displacement: equations.displacement().to_vec(),
                internal: equations.internal_force().to_vec(),
                internal_start: equations.internal_force_at_start().to_vec(),
                following: equations.following_force().to_vec(),
                ghost_energy: world.sum(equations.ghost_energy()),
                residual: equations.errors.last().copied().unwrap_or(0.0),
                evaluations: equations.errors.len(),
                linear_iterations: outcome.linear_iterations_total,
            })
        } else {
            let point = world.first_message(equations.refused_point(points));
            let detail = point.map_or(String::new(), |text| format!(": {text}"));
            Err(format!("Newton's method failed ({}){detail}", outcome.reason))
        };
        Ok(Attempt {
            end,
            used: used.filter(|_| outcome.converged),
            most_linear_iterations: outcome.linear_iterations_max,
            at_round_off: equations.at_round_off,
            seconds,
            assembly_seconds: equations.assembly_seconds,
            waited,
            errors: equations.errors,
        })
    }
}

/// How Newton's method ended.
pub struct Attempt {
    /// A solution, or why there is none.
    pub end: std::result::Result<Converged, String>,
    /// Normalised residual of each iterate.
    pub errors: Vec<f64>,
    /// Most iterations of one linear solve.
    pub most_linear_iterations: usize,
    /// What solved the step where the first way did not, and why that did not.
    used: Option<String>,
    /// The last residual is above the tolerance, and all of it round-off.
    at_round_off: bool,
    /// Wall time of all, of the evaluations in it, and of waiting for other ranks outside PETSc, s.
    seconds: f64,
    assembly_seconds: f64,
    waited: f64,
}

impl Attempt {
    /// Tells the run's records of it, as step `number`. Refused where there is no solution. Collective.
    pub(crate) fn report(
        self,
        world: &World,
        recorder: &mut Recorder,
        clock: &mut Clock,
        number: usize,
    ) -> std::result::Result<Converged, Halt> {
        if let Some(used) = self.used {
            recorder.log.say(&format!("step {number}: {used}"));
        }
        clock.add(Phase::Assemble, self.assembly_seconds);
        // What the program waited for other ranks while the solver ran is time of the assembly, not busy. PETSc
        // counts its own waiting.
        clock.add_busy(self.assembly_seconds - self.waited);
        clock.add(Phase::Solve, self.seconds - self.assembly_seconds);
        recorder.iterations(world, number, &self.errors)?;
        let solved = self.end.map_err(|what| Refusal { cause: Cause::NotConverged, what })?;
        if self.at_round_off {
            let detail = format!("(residual {:.1e})", solved.residual);
            recorder.log.warn_of_step(number, AT_ROUND_OFF, &detail);
        }
        recorder.newton.add(solved.evaluations);
        recorder.linear.add(solved.linear_iterations);
        Ok(solved)
    }
}

const AT_ROUND_OFF: &str = "the residual is above analysis.tolerance and all of it round-off: it is at \
     most what rounding leaves of the forces it is the difference of. The step counts as converged";

/// What a converged step does to points and grid, not yet applied.
pub(crate) struct Carried<const D: usize> {
    pub made: Increments<D>,
    /// `None` where the grid does not move.
    pub moved_grid: Option<Grid<D>>,
}

/// What the step's nodal `displacement` (local nodes, m) makes of points and grid. Refused, on every
/// rank alike: a cell that would turn over, an unsound point, an unsound domain. Collective.
pub(crate) fn carried<const D: usize>(
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
    soundness::require_sound(world, after, &deck.boundaries, points, &made)?;
    let grids = [grid, after];
    soundness::require_sound_domains(
        world,
        grids,
        basis,
        numbering,
        displacement,
        points,
        &mut made,
    )?;
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

/// Newton's method with the default solver; where its iterates come no closer, again from the start with narrower
/// line searches; where the linear solver fails, once more with the next stronger one. What solved a step at last is
/// named. Collective.
fn solve_robustly<const D: usize, const N: usize>(
    world: &World,
    problem: &mut Equilibrium<'_, D, N>,
    size: Size,
    trials: &mut Trials,
    matrix: &mut Matrix,
    solution: &mut Vector,
) -> Result<(NewtonOutcome, Option<String>)> {
    let Size { mut shape, equations, stabilised, null_pivots } = size;
    let linear = Linear::of::<D>(equations, stabilised, trials)?;
    let most = problem.settings().max_evaluations;
    let mut snes = solver::newton(world, linear, shape, null_pivots, most)?;
    let mut outcome = snes.solve(problem, matrix, solution)?;
    trials.note(linear, !outcome.converged && !problem.stalled);
    if problem.stalled {
        while let Some(narrower) = shape.search.narrower().filter(|_| !outcome.converged) {
            shape.search = narrower;
            snes = solver::newton(world, linear, shape, null_pivots, most)?;
            problem.restart();
            solution.values_mut()?.fill(0.0);
            outcome = snes.solve(problem, matrix, solution)?;
        }
        let words =
            format!("the iterates came no closer; solved again with {}", shape.search.words());
        return Ok((outcome, Some(words)));
    }
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
    let used = format!("multigrid failed; solved again with {after}");
    Ok((snes.solve(problem, matrix, solution)?, Some(used)))
}
