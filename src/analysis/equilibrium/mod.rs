//! f_int(u) + K_G u = f_ext, solved by Newton's method (Lagrangian eq. 26-30, Ghost eq. 25-27).
//!
//! The bookkeeping is the papers': reactions are accumulated from the linear solves, start at
//! zero in each step, and the error is |f_ext - f_int + f_react| / |f_ext + f_react| over all
//! degrees of freedom (Lagrangian eq. 40). Iteration 0 evaluates at zero displacement.

mod error;
mod iteration;
pub mod motion;
mod ties;

use crate::amg::{Levels, MatrixKind};
use crate::deck::model::InvertedIterates;
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::World;
use crate::petsc::matrix::Matrix;
use crate::points::Points;
use crate::system::conditions::Conditions;
use crate::system::held::Held;
use crate::system::in_place::{InPlace, RowAddresses};
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::system::scatter::{self, BlockRows};
use crate::system::step_system::Discretisation;
use crate::system::terms::Term;
use crate::system::terms::following::Follow;
use crate::system::terms::term::{At, Health, Part};
use crate::system::unknowns::Unknowns;
use std::time::Instant;

/// Limits and choices of the iteration.
#[derive(Debug, Clone, Copy)]
pub struct NewtonSettings {
    /// Largest normalised residual of a converged step (Lagrangian eq. 40).
    pub tolerance: f64,
    /// Evaluations, the one at zero displacement included.
    pub max_evaluations: usize,
    /// What happens to an iterate with det dF <= 0.
    pub inverted: InvertedIterates,
    /// The iteration ends where its errors stay, for a narrower line search to begin again.
    pub ends_where_stalled: bool,
}

/// What a step's equations of `N` unknowns per node consist of.
pub struct StepEquations<'a, const N: usize> {
    /// What they are.
    pub unknowns: Unknowns<N>,
    /// What boundaries prescribe.
    pub conditions: &'a Conditions,
    /// Local nodes that carry no equation of their own (`drop_below`).
    pub left_out: &'a [bool],
    /// Right-hand side of the owned degrees of freedom, N.
    pub external_owned: Vec<f64>,
    /// What is summed, in this order ([`motion::terms`] for displacements). Where a tangent is unsymmetric one of
    /// them says so, be it that of the forces that follow the motion.
    pub terms: Vec<Box<dyn Term<N> + 'a>>,
    /// External forces that follow the motion, and their share at the step's end: 1 + alpha of the HHT method,
    /// else 1.
    pub following: Option<(Box<dyn Follow<N> + 'a>, f64)>,
}

/// One step's equations: `N` unknowns at each node of a grid in `D` dimensions. Vectors named `*_owned` hold the owned degrees of freedom, the others the
/// local ones (owned, then ghosts).
pub struct Equilibrium<'a, const D: usize, const N: usize = D> {
    world: &'a World,
    grid: &'a Grid<D>,
    numbering: &'a Numbering,
    pattern: &'a Pattern,
    settings: NewtonSettings,
    unknowns: Unknowns<N>,
    /// Fixed by a condition, or left out (`drop_below`).
    held: Held,
    increment: Vec<f64>,
    /// All external forces of the last evaluation.
    external_owned: Vec<f64>,
    external_previous: Vec<f64>,
    following: Option<Followed<'a, N>>,
    /// What is summed, in this order.
    terms: Vec<Box<dyn Term<N> + 'a>>,
    addresses: RowAddresses<N>,
    /// Rows that the solver's array cannot take whole.
    beside: Vec<f64>,
    /// What the matrix holds.
    tangent: Tangent,
    /// Multigrid's, where it is the preconditioner.
    levels: Levels,
    displacement: Vec<f64>,
    previous_owned: Vec<f64>,
    internal_owned: Vec<f64>,
    internal_previous: Vec<f64>,
    internal_start: Vec<f64>,
    reaction_owned: Vec<f64>,
    diagonal_scale: f64,
    /// Largest free diagonal entry of the step's first tangent, N/m.
    diagonal_largest: f64,
    /// Normalised error of each evaluation that was accepted.
    pub errors: Vec<f64>,
    /// Numerator of the last, N.
    residual_norm: f64,
    /// Its denominator, N.
    actions_norm: f64,
    /// The step ends above the tolerance, at the round-off of its equations.
    pub at_round_off: bool,
    /// The last solve ended because its iterates came no closer. The same on all ranks.
    pub stalled: bool,
    /// Health of the last evaluation on this rank.
    pub health: Health,
    /// Wall time of all evaluations, s.
    pub assembly_seconds: f64,
}

/// External forces that follow the motion.
struct Followed<'a, const N: usize> {
    loads: Box<dyn Follow<N> + 'a>,
    /// Share of the forces of a step's end in its equations: 1 + alpha of the HHT method.
    share: f64,
    /// What acts besides, owned.
    dead: Vec<f64>,
    /// Of the last evaluation, owned.
    force: Vec<f64>,
}

impl<const N: usize> Followed<'_, N> {
    /// external = dead + share force, from this rank's shares of `force` at its local nodes.
    /// Collective.
    fn join(
        &mut self,
        world: &World,
        numbering: &Numbering,
        mut force: Vec<f64>,
        external: &mut [f64],
    ) -> Result<()> {
        numbering.halo.reverse_add(world, &mut force, N)?;
        force.truncate(numbering.owned * N);
        for ((total, dead), f) in external.iter_mut().zip(&self.dead).zip(&force) {
            *total = dead + self.share * f;
        }
        self.force = force;
        Ok(())
    }
}

/// What the values of the matrix are, compared with the last evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tangent {
    /// Those of another iterate.
    Stale,
    /// Its tangent.
    Assembled,
    /// The same with the conditions in it: ready for the solver.
    Constrained,
}

impl<'a, const D: usize, const N: usize> Equilibrium<'a, D, N> {
    /// The equations of one step, before any iterate.
    pub fn new(
        world: &'a World,
        grid: &'a Grid<D>,
        mesh: &'a Discretisation<D>,
        equations: StepEquations<'a, N>,
        settings: NewtonSettings,
    ) -> Self {
        let StepEquations { unknowns, conditions, left_out, external_owned, terms, following } =
            equations;
        let (numbering, pattern) = (&mesh.numbering, &mesh.pattern);
        let mut held = conditions.fixed.clone();
        let increment = conditions.increment.clone();
        for (local, _) in left_out.iter().enumerate().filter(|(_, out)| **out) {
            // A prescribed motion stays: the gradient may see a node whose weight vanishes.
            held[local * N..(local + 1) * N].fill(true);
        }
        let owned = numbering.owned * N;
        let addresses = RowAddresses::<N>::new(numbering, pattern);
        let held =
            Held::new::<N>(numbering, pattern, held, &conditions.fixed, |row| addresses.start(row));
        let beside = vec![0.0; addresses.len_beside()];
        let following = following.map(|(loads, share)| {
            let (dead, force) = (external_owned.clone(), Vec::new());
            Followed { loads, share, dead, force }
        });
        Equilibrium {
            world,
            grid,
            numbering,
            pattern,
            settings,
            unknowns,
            held,
            increment,
            external_previous: external_owned.clone(),
            external_owned,
            following,
            terms,
            addresses,
            beside,
            tangent: Tangent::Stale,
            levels: Levels::default(),
            displacement: vec![0.0; numbering.len() * N],
            previous_owned: vec![0.0; owned],
            internal_owned: vec![0.0; owned],
            internal_previous: vec![0.0; owned],
            internal_start: Vec::new(),
            assembly_seconds: 0.0,
            reaction_owned: vec![0.0; owned],
            diagonal_scale: 0.0,
            diagonal_largest: 0.0,
            errors: Vec::new(),
            residual_norm: 0.0,
            actions_norm: 0.0,
            at_round_off: false,
            stalled: false,
            health: Health::default(),
        }
    }

    /// Forces of the last evaluation that follow the motion, N, owned nodes; empty without any.
    pub fn following_force(&self) -> &[f64] {
        self.following.as_ref().map_or(&[], |followed| &followed.force)
    }

    /// Limits and choices of the iteration.
    pub fn settings(&self) -> &NewtonSettings {
        &self.settings
    }

    /// Forgets all iterates: the next evaluation is the step's first.
    pub fn restart(&mut self) {
        for values in [
            &mut self.previous_owned,
            &mut self.internal_previous,
            &mut self.reaction_owned,
            &mut self.internal_owned,
        ] {
            values.fill(0.0);
        }
        self.diagonal_scale = 0.0;
        self.errors.clear();
        self.stalled = false;
    }

    /// Increments of the unknowns at the last evaluation, local nodes.
    pub fn displacement(&self) -> &[f64] {
        &self.displacement
    }

    /// f_int + K_G u of the last evaluation, owned nodes.
    pub fn internal_force(&self) -> &[f64] {
        &self.internal_owned
    }

    /// The same at zero displacement.
    pub fn internal_force_at_start(&self) -> &[f64] {
        &self.internal_start
    }

    /// The point that made the last evaluation unusable, if this rank has one.
    pub fn refused_point(&self, points: &Points<D>) -> Option<String> {
        let name = |p: usize| format!("point {} at {:?}", points.id[p], points.position[p]);
        match (self.health.not_finite, self.health.inverted, self.settings.inverted) {
            (Some(p), _, _) => Some(format!("{} has a stress that is not finite", name(p))),
            (None, Some(p), InvertedIterates::Reject) => Some(format!(
                "{} is turned inside out; smaller steps, Ghost stiffness or \
                 analysis.inverted_iterates = \"allow\" may help",
                name(p)
            )),
            _ => None,
        }
    }

    /// Energy that the terms hold and the points do not: u K_G u / 2 of the Ghost faces, this rank's
    /// share, J.
    pub fn ghost_energy(&self) -> f64 {
        self.terms.iter().map(|term| term.energy(self.at())).sum()
    }

    /// Whether the tangents of all terms equal their transposed.
    pub fn symmetric(&self) -> bool {
        self.terms.iter().all(|term| term.symmetric())
    }

    /// What multigrid may expect of the tangent.
    pub(super) fn kind(&self) -> MatrixKind {
        match self.symmetric() {
            true => MatrixKind::Symmetric,
            false if self.terms.iter().any(|term| term.flows_unassociated()) => MatrixKind::Flowing,
            false => MatrixKind::Unsymmetric,
        }
    }

    /// The last iterate.
    fn at(&self) -> At<'_> {
        At { pattern: self.pattern, displacement: &self.displacement }
    }

    fn load_displacement(&mut self, x: &[f64]) -> Result<()> {
        self.displacement[..x.len()].copy_from_slice(x);
        self.numbering.halo.forward(self.world, &mut self.displacement, N)
    }

    /// Evaluates the force at the loaded displacement, and the tangent where `matrix` is given;
    /// false if it must be refused.
    fn evaluate(&mut self, matrix: Option<&mut Matrix>) -> Result<bool> {
        let numbering = self.numbering;
        let mut force = vec![0.0; numbering.len() * N];
        let mut storage = matrix.map(Matrix::storage).transpose()?;
        let base = self.terms.iter().find_map(|term| term.first_in_rows());
        let mut rows = match &mut storage {
            Some((main, _)) => Some(InPlace::new(&self.addresses, main, &mut self.beside, base)?),
            None => None,
        };
        self.tangent = Tangent::Stale;
        let (world, pattern, terms) = (self.world, self.pattern, &self.terms);
        let at = At { pattern, displacement: &self.displacement };
        let following = self.following.as_ref();
        let mut pushed = vec![0.0; following.map_or(0, |_| numbering.len() * N)];
        let mut add = |part: Part, force: &mut [f64], mut rows: Option<&mut InPlace<'_, N>>| {
            let health = terms.iter().fold(Health::default(), |health, term| {
                health.and(term.add_shares(part, at, force, rows.as_deref_mut()))
            });
            if let Some(all) = following {
                all.loads.add_shares(part, at, &mut pushed, rows);
            }
            health
        };
        // What other ranks wait for comes first, and travels while the rest is added up.
        let reaching = add(Part::Reaching, &mut force, rows.as_mut());
        if let Some(rows) = &mut rows {
            rows.finish(pattern, numbering.owned);
        }
        let inner = numbering.halo.reverse_add_while(world, [&mut force[..]], N, |[force]| {
            let Some(rows) = &mut rows else { return add(Part::Inner, force, None) };
            scatter::reduce_while(world, pattern, rows, |rows| {
                let health = add(Part::Inner, force, Some(&mut *rows));
                rows.finish(pattern, 0);
                health
            })
        });
        self.health = reaching.and(inner);
        let refuse = !self.health.is_sound()
            || (self.settings.inverted == InvertedIterates::Reject
                && self.health.inverted.is_some());
        if world.any(refuse) {
            return Ok(false);
        }
        force.truncate(numbering.owned * N);
        for term in terms {
            term.add_force(at, &mut force);
        }
        self.internal_owned = force;
        if let Some(all) = &mut self.following {
            all.join(world, numbering, pushed, &mut self.external_owned)?;
        }
        let Some(mut rows) = rows else { return Ok(true) };
        for term in terms {
            term.add_tangent(pattern, numbering.owned, &mut rows);
        }
        if self.diagonal_scale == 0.0 {
            (self.diagonal_scale, self.diagonal_largest) = free_diagonal(
                self.world,
                numbering.owned,
                self.pattern,
                |dof| !self.held.holds(dof),
                &mut rows,
            );
        }
        self.tangent = Tangent::Assembled;
        Ok(true)
    }

    /// The residual of the last evaluation.
    fn write_residual(&self, x: &[f64], f: &mut [f64]) {
        for dof in 0..f.len() {
            f[dof] = if self.held.holds(dof) {
                self.diagonal_scale * (x[dof] - self.increment[dof])
            } else {
                self.internal_owned[dof] - self.external_owned[dof]
            };
        }
    }

    /// The residual at `x` into `f`, and the tangent where `matrix` is given; false if `x` must be
    /// refused. The first evaluation of a step needs the matrix, for the scale of held rows.
    pub fn evaluate_at(
        &mut self,
        x: &[f64],
        f: &mut [f64],
        matrix: Option<&mut Matrix>,
    ) -> Result<bool> {
        let begin = Instant::now();
        self.load_displacement(x)?;
        let usable = self.evaluate(matrix)?;
        self.assembly_seconds += begin.elapsed().as_secs_f64();
        if usable {
            self.write_residual(x, f);
        }
        Ok(usable)
    }
}

/// Mean and largest size of the free diagonal entries over all ranks; 1 where there are none.
/// Collective.
fn free_diagonal<const N: usize, R: BlockRows<N>>(
    world: &World,
    owned: usize,
    pattern: &Pattern,
    free: impl Fn(usize) -> bool,
    rows: &mut R,
) -> (f64, f64) {
    let (mut sum, mut count, mut largest) = (0.0, 0usize, 0.0f64);
    for row in 0..owned {
        let range = pattern.offsets[row]..pattern.offsets[row + 1];
        let Some(position) = pattern.diagonal(row) else { continue };
        let start = rows.start(pattern, row) + (position - range.start) * N;
        for i in (0..N).filter(|i| free(row * N + i)) {
            let entry = rows.values(start + i * (range.len() * N + 1), 1)[0].abs();
            sum += entry;
            largest = largest.max(entry);
            count += 1;
        }
    }
    let (sum, count) = (world.sum(sum), world.sum_usize(count));
    if count > 0 && sum > 0.0 { (sum / count as f64, world.max(largest)) } else { (1.0, 1.0) }
}
