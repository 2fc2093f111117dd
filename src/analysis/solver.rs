//! Which linear solver a system gets by default: direct while that is cheap, multigrid beyond.
//! The user's PETSc options with the prefix `-qs_` win over all of it.
//!
//! The limits come from measurements (docs/evidence/performance.md). Ghost stiffness bounds the condition
//! number, and multigrid wins early. Without it multigrid may fail at any size, and no number known beforehand says
//! when: it is tried, gives up early, and is not tried again for some steps ([`Trials`]). A parallel
//! direct solver sums in the order in which messages arrive; on one rank it repeats bit by bit, and
//! is faster at these sizes too.

use crate::amg;
use crate::deck::model::{AnalysisType, Locking, Tangent};
use crate::error::Result;
use crate::grid::Grid;
use crate::mass::solver as mass;
use crate::output::restart::run_state::RunState;
use crate::parallel::World;
use crate::petsc::matrix::Matrix;
use crate::petsc::snes::Snes;
use crate::petsc::{Index, factors, options};
use crate::system::numbering::Numbering;
use crate::system::pattern::Pattern;
use crate::system::unknowns::Unknowns;

use super::extremes;
use super::rehearsal::Rehearsal;
use crate::system::model::Model;

/// Equations up to which the direct solver is the default in 2D and 3D: multigrid is faster from
/// about a thousand on, but small studies like their residuals exact.
const DIRECT: [usize; 2] = [10_000, 3_000];
/// Iterations of a trial per solve; where multigrid converges without Ghost, it takes 10 to 70.
const TRIAL: usize = 100;
/// Steps after a failed trial that start with the direct solver.
const PAUSE: u64 = 10;
/// Directions that FGMRES keeps, two vectors each: more than multigrid needs.
const RESTART: &str = "100";
/// Backtracking accepts |F'|^2 <= |F|^2 (1 - 2 alpha): the residual may grow fourteenfold in an
/// iteration. A search that lets it grow not at all fails on bends and collapses that full steps
/// solve (docs/evidence/unsymmetric.md).
const GROWTH: &str = "-100";
/// Up to here the direct solver runs on one rank.
const ONE_RANK: [usize; 2] = [150_000, 30_000];

/// The built-in solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Linear {
    /// Factors on one of the ranks: MUMPS's, or PETSc's own where MUMPS is missing.
    DirectOnOne,
    /// MUMPS on all ranks; where it is missing, as `DirectOnOne`.
    Direct,
    /// Conjugate gradients, or FGMRES where the tangent is unsymmetric, with smoothed aggregation
    /// and the rigid-body modes.
    Multigrid,
    /// The same if it converges quickly.
    Trial,
}

/// What trials have come to.
#[derive(Debug, Default)]
pub struct Trials {
    /// Steps to come that do without one.
    pause: u64,
}

impl Trials {
    /// After a step that began with `linear`; `failed`: another had to end it.
    pub fn note(&mut self, linear: Linear, failed: bool) {
        self.pause = match linear {
            Linear::Trial if failed => PAUSE,
            _ => self.pause.saturating_sub(1),
        };
    }

    /// Puts the pause into a checkpoint.
    pub fn save(&self, state: &mut RunState) {
        state.set_count("solver.pause", self.pause);
    }

    /// Checkpoints of earlier versions know nothing of trials.
    pub fn restore(&mut self, state: &RunState) {
        self.pause = state.count("solver.pause").unwrap_or(0);
    }
}

impl Linear {
    /// The default for a system of `equations` in `D` dimensions; `stabilised`: every body has
    /// Ghost stiffness. A solver that the user has chosen is not on trial.
    pub fn of<const D: usize>(equations: usize, stabilised: bool, trials: &Trials) -> Result<Self> {
        let direct = Self::direct::<D>(equations);
        if equations <= DIRECT[usize::from(D == 3)] {
            return Ok(direct);
        }
        let (method, preconditioner) = ("qs_ksp_type", "qs_pc_type");
        let own_levels = options::is_users(preconditioner)?
            && options::get(preconditioner)?.as_deref() == Some("mg");
        Ok(if stabilised || own_levels {
            Linear::Multigrid
        } else if trials.pause > 0
            || options::is_users(method)?
            || options::is_users(preconditioner)?
        {
            direct
        } else {
            Linear::Trial
        })
    }

    /// What to try when a step could not be solved with this one, be it that a linear solve failed
    /// (`linear_failure`) or Newton's method; `None` if there is nothing better.
    pub fn stronger<const D: usize>(self, equations: usize, linear_failure: bool) -> Option<Self> {
        match self {
            Linear::Multigrid if !linear_failure => None,
            Linear::Multigrid | Linear::Trial => Some(Self::direct::<D>(equations)),
            Linear::Direct | Linear::DirectOnOne => None,
        }
    }

    fn direct<const D: usize>(equations: usize) -> Self {
        let one = equations <= ONE_RANK[usize::from(D == 3)];
        if one { Linear::DirectOnOne } else { Linear::Direct }
    }

    /// One of several ranks solves for all.
    fn gathers(self, ranks: usize) -> bool {
        let on_one = match self {
            Linear::DirectOnOne => true,
            // PETSc's own factors are those of one rank.
            Linear::Direct => factors::package() == factors::OWN,
            Linear::Multigrid | Linear::Trial => false,
        };
        on_one && ranks > 1
    }

    /// Options without the prefix, on `ranks` ranks.
    pub fn options(self, ranks: usize, symmetric: bool) -> Vec<(&'static str, String)> {
        let package = factors::package();
        let list: &[(&str, &str)] = match self {
            Linear::DirectOnOne | Linear::Direct if self.gathers(ranks) => &[
                ("ksp_type", "preonly"),
                ("ksp_rtol", "1e-8"),
                ("pc_type", "telescope"),
                ("telescope_ksp_type", "preonly"),
                ("telescope_pc_type", "lu"),
                ("telescope_pc_factor_mat_solver_type", package),
                ("telescope_pc_factor_zeropivot", factors::ZERO_PIVOT.1),
                ("snes_lag_preconditioner", "1"),
            ],
            Linear::DirectOnOne | Linear::Direct => &[
                ("ksp_type", "preonly"),
                // Of a method that the user puts in its place.
                ("ksp_rtol", "1e-8"),
                ("pc_type", "lu"),
                ("pc_factor_mat_solver_type", package),
                factors::ZERO_PIVOT,
                ("snes_lag_preconditioner", "1"),
            ],
            // The first iterate's hierarchy serves the whole step, unless it has become slow.
            Linear::Multigrid | Linear::Trial => &[
                ("ksp_type", if symmetric { "cg" } else { "fgmres" }),
                ("ksp_rtol", "1e-8"),
                ("ksp_gmres_restart", RESTART),
                ("pc_type", "mg"),
                ("snes_lag_preconditioner", "1000"),
            ],
        };
        let mut options: Vec<_> =
            list.iter().map(|(name, value)| (*name, (*value).to_string())).collect();
        match self {
            Linear::Multigrid => options.push(("ksp_max_it", "1000".into())),
            Linear::Trial => options.push(("ksp_max_it", TRIAL.to_string())),
            Linear::Direct | Linear::DirectOnOne => {}
        }
        if self.gathers(ranks) {
            options.push(("pc_telescope_reduction_factor", ranks.to_string()));
        }
        options
    }
}

/// What the unknowns and the tangent ask of Newton's method.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// The program's multigrid has levels for the unknowns ([`amg::serves`]). PETSc's takes its place otherwise.
    pub levels: bool,
    /// The tangent equals its transposed.
    pub symmetric: bool,
    /// How far each of its iterations goes.
    pub search: Search,
}

/// How far an iteration goes along its direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Search {
    /// To its end.
    None,
    /// Back from where the residual grows beyond measure.
    Wide,
    /// To where the residual has no share along the direction, by one secant.
    Root,
    /// Back until the residual falls.
    Falling,
}

impl Search {
    /// How to solve a step once more whose iterates came no closer with this one.
    pub fn narrower(self) -> Option<Self> {
        match self {
            Search::None | Search::Wide => Some(Search::Root),
            Search::Root => Some(Search::Falling),
            Search::Falling => None,
        }
    }

    /// In the words of a log.
    pub fn words(self) -> &'static str {
        match self {
            Search::None => "full steps",
            Search::Wide => "a wide line search",
            Search::Root => "steps to the root along each direction",
            Search::Falling => "steps along which the residual falls",
        }
    }

    fn options(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Search::None => &[],
            Search::Wide => &[("snes_linesearch_type", "bt"), ("snes_linesearch_alpha", GROWTH)],
            // Forces along the direction have no scale that PETSc knows.
            Search::Root => &[("snes_linesearch_type", "cp"), ("snes_linesearch_atol", "0")],
            Search::Falling => &[("snes_linesearch_type", "bt"), ("snes_linesearch_alpha", "1e-4")],
        }
    }
}

impl Shape {
    /// Of `unknowns`; `symmetric`: all terms of the equations are.
    pub fn of<const D: usize, const N: usize>(
        model: &Model<D>,
        unknowns: Unknowns<N>,
        symmetric: bool,
    ) -> Self {
        let deck = &model.deck;
        let mild = deck.method.locking == Locking::FBar
            && deck.analysis.tangent == Tangent::Auto
            && model.symmetric;
        // Not for F-bar alone: the volume of an iterate is off by the square of its rotation, a bulk modulus times
        // which may be a hundred times the loads, and full steps are past that in one iteration.
        let search = if symmetric || mild { Search::None } else { Search::Wide };
        Shape { levels: amg::serves(&unknowns), symmetric, search }
    }
}

/// Of the options of the equilibrium solver.
const PREFIX: &str = "qs_";

/// Preconditioners that need an iteration around them, at any size.
const APPROXIMATE: [&str; 11] =
    ["mg", "gamg", "hypre", "jacobi", "pbjacobi", "bjacobi", "asm", "ilu", "icc", "sor", "none"];

/// Newton's method with a built-in linear solver. `null_pivots`: the system may be singular and
/// consistent, and a direct solver has to look for zero pivots.
pub fn newton(
    world: &World,
    linear: Linear,
    shape: Shape,
    null_pivots: bool,
    max_evaluations: usize,
) -> Result<Snes> {
    newton_under(PREFIX, world, linear, shape, null_pivots, max_evaluations)
}

/// The same with options of another prefix.
fn newton_under(
    prefix: &str,
    world: &World,
    linear: Linear,
    shape: Shape,
    null_pivots: bool,
    max_evaluations: usize,
) -> Result<Snes> {
    let mut snes = Snes::new(world.comm(), prefix, max_evaluations.saturating_sub(1).max(1))?;
    let mut defaults = linear.options(world.size(), shape.symmetric);
    if !shape.levels && matches!(linear, Linear::Multigrid | Linear::Trial) {
        set(&mut defaults, "pc_type", "gamg");
        set(&mut defaults, "snes_lag_preconditioner", "1");
    }
    let search = shape.search.options().iter();
    defaults.extend(search.map(|(name, value)| (*name, (*value).to_string())));
    if !factors(prefix)? {
        // MUMPS has no others than those of LU and Cholesky.
        defaults.retain(|(name, _)| *name != "pc_factor_mat_solver_type");
    } else if matches!(linear, Linear::Multigrid | Linear::Trial) && chosen(prefix)?.is_some() {
        // Factors of an earlier matrix would make Newton's method a slow one.
        set(&mut defaults, "snes_lag_preconditioner", "1");
    }
    if chosen(prefix)?.is_some_and(|chosen| APPROXIMATE.contains(&chosen.as_str())) {
        set(&mut defaults, "ksp_type", if shape.symmetric { "cg" } else { "fgmres" });
    }
    snes.set_defaults(&defaults)?;
    if null_pivots && matches!(linear, Linear::Direct | Linear::DirectOnOne) {
        let inner = if linear.gathers(world.size()) { "telescope_" } else { "" };
        let (name, value) = match factors::package() {
            factors::MUMPS => ("mat_mumps_icntl_24", "1"),
            _ => ("pc_factor_shift_type", "nonzero"),
        };
        snes.set_defaults(&[(&format!("{inner}{name}"), value)])?;
    }
    snes.set_from_options()?;
    Ok(snes)
}

/// Whether the preconditioner is, for all the user says, a complete factorisation.
fn factors(prefix: &str) -> Result<bool> {
    Ok(chosen(prefix)?.is_none_or(|chosen| ["lu", "cholesky"].contains(&chosen.as_str())))
}

/// The preconditioner that the user asks for.
fn chosen(prefix: &str) -> Result<Option<String>> {
    let name = format!("{prefix}pc_type");
    if options::is_users(&name)? { options::get(&name) } else { Ok(None) }
}

/// Another value for one of the defaults.
fn set(defaults: &mut [(&str, String)], name: &str, value: &str) {
    for (_, default) in defaults.iter_mut().filter(|(known, _)| *known == name) {
        *default = value.into();
    }
}

/// Tries the user's options on a small system, before anything is written. `equations`: of the
/// first step. Collective. Error: PETSc cannot work with them.
pub fn rehearse<const D: usize>(world: &World, model: &Model<D>, equations: usize) -> Result<()> {
    let comm = world.comm();
    if let Some(rehearsal) = Rehearsal::new(mass::PREFIX)? {
        // The program's own preconditioner needs a mass.
        rehearsal.linear::<1>(comm, |prefix| {
            mass::petsc_solver(world, prefix, "jacobi", mass::Way::Iterate)
        })?;
    }
    if let Some(rehearsal) = Rehearsal::new(extremes::PREFIX)? {
        rehearsal.linear::<D>(comm, |prefix| extremes::petsc_solver(world, prefix))?;
    }
    if !matches!(
        model.deck.analysis.kind,
        AnalysisType::QuasiStatic | AnalysisType::StrengthReduction | AnalysisType::ImplicitDynamic
    ) {
        return Ok(());
    }
    let Some(rehearsal) = Rehearsal::new(PREFIX)? else { return Ok(()) };
    let linear = Linear::of::<D>(equations, model.stabilised(), &Trials::default())?;
    let shape = Shape::of(model, Unknowns::<D>::displacements(), model.symmetric());
    rehearsal.newton::<D>(comm, |prefix| newton_under(prefix, world, linear, shape, false, 3))
}

/// A matrix of `N` unknowns per node, still zero. Collective.
pub fn block_matrix<const N: usize>(
    world: &World,
    numbering: &Numbering,
    pattern: &Pattern,
) -> Result<Matrix> {
    let rows = numbering.owned * N;
    let mut offsets = Vec::with_capacity(rows + 1);
    let mut columns = Vec::with_capacity(pattern.ghost_start * N * N);
    offsets.push(0);
    for row in 0..numbering.owned {
        let nodes = &pattern.columns[pattern.offsets[row]..pattern.offsets[row + 1]];
        for _ in 0..N {
            for &node in nodes {
                let first = numbering.global[node as usize] * N as Index;
                columns.extend((0..N as Index).map(|k| first + k));
            }
            offsets.push(columns.len() as Index);
        }
    }
    Matrix::zeros(world.comm(), N, rows, &offsets, &columns)
}

/// The system's matrix, still zero, with its block size and, for displacements, rigid motions as its near-null
/// space. `symmetric`: it will equal its transposed. Collective.
pub fn matrix<const D: usize, const N: usize>(
    world: &World,
    grid: &Grid<D>,
    (numbering, pattern): (&Numbering, &Pattern),
    unknowns: Unknowns<N>,
    symmetric: bool,
) -> Result<Matrix> {
    let mut matrix = block_matrix::<N>(world, numbering, pattern)?;
    matrix.set_symmetric(symmetric)?;
    if unknowns.displacements {
        let owned = &numbering.nodes[..numbering.owned];
        let coordinates: Vec<f64> =
            owned.iter().flat_map(|&node| grid.node_position(node)).collect();
        matrix.set_rigid_body_near_null_space(&coordinates)?;
    }
    Ok(matrix)
}
