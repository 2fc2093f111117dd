//! Multigrid by smoothed aggregation for systems of nodal displacements and of other fields: the hierarchy of levels
//! that the solver's cycle runs on (Vanek, Mandel and Brezina, Computing 56 (1996) 179).
//!
//! | step | file |
//! |---|---|
//! | which nodes move together | `strength.rs` |
//! | groups of nodes that become one | `aggregate.rs` |
//! | smooth modes of a coarse node | `rigid.rs` |
//! | largest eigenvalue, for damping and smoother | `spectrum.rs` |
//! | transfer between levels | `prolongator.rs` |
//! | whose nodes they are | `owners.rs` |
//! | coarse operator | `galerkin.rs` |
//! | nodes and rows of a level | `level.rs` |
//! | levels under a solver | `cycle.rs` |
//! | symmetric part of an unsymmetric system | `symmetric_part.rs` |
//! | nodes that penalties tie | `tied.rs` |
//! | nodes that flow | `flow.rs` |
//! | the smoother of both | `block_smoother.rs` |
//!
//! The levels are those of a symmetric matrix. Under an unsymmetric A they are made from
//! (A + A^T) / 2; the iteration outside and the smoother of the finest level multiply by A, and the latter solves few
//! nodes that flow together. Where penalties
//! tie nodes, that smoother multiplies by the symmetric part, too.
//!
//! Whole blocks of a node are the unit throughout, each rank works on its own rows, and nothing
//! depends on how nodes are dealt out to ranks but the order of sums: iterations are the same on
//! any number of them.

pub(crate) mod aggregate;
pub(crate) mod block_smoother;
pub(crate) mod cycle;
pub mod flow;
pub(crate) mod galerkin;
pub mod level;
pub(crate) mod owners;
pub(crate) mod prolongator;
pub(crate) mod rigid;
pub(crate) mod spectrum;
pub(crate) mod strength;
pub mod symmetric_part;
pub mod tied;

use crate::petsc::{Index, Product};
use level::{Assembled, BlockCsr, Nodes, Rows, diagonal, inverted};
use symmetric_part::symmetric_part;

use crate::blocks::{BlockProduct, Stored};
use crate::error::Result;
use crate::grid::Grid;
use crate::parallel::World;
use crate::system::numbering::Numbering;
use crate::system::unknowns::Unknowns;

pub use block_smoother::BlockSmoother;
pub use cycle::{CoarsestRows, Hierarchy, Levelled, Levels, Smoothed};

use aggregate::Aggregates;
use block_smoother::Cause;
use flow::Flow;
use galerkin::Coarse;
use prolongator::{Lengths, Parts, Prolongator};
use rigid::Modes;
use strength::Strong;
use tied::Ties;

/// Degrees of freedom that are few enough to be solved directly.
const COARSEST: usize = 600;
const MOST_LEVELS: usize = 12;
/// Couplings below this share are weak.
const THRESHOLD: f64 = 0.03;
/// Of the prolongator's smoothing, over the largest eigenvalue.
const DAMPING: f64 = 1.5;

/// How a level is coarsened.
#[derive(Debug, Clone, Copy)]
struct Coarsening {
    /// Strong couplings between two roots, at least one more than these.
    distance: usize,
    /// A next level with a larger share of the nodes is not worth having.
    most_left: f64,
}

/// A second ring around the roots costs a few iterations, and halves a set-up that is dear on the
/// finest level alone.
const FINEST: Coarsening = Coarsening { distance: 2, most_left: 1.0 };
const COARSER: Coarsening = Coarsening { distance: 1, most_left: 0.8 };

/// What is known of a matrix before it is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatrixKind {
    /// It equals its transposed.
    Symmetric,
    /// It does not: friction, flow, or the deck's wish.
    Unsymmetric,
    /// It does not, and plastic flow that is not associated is among the reasons.
    Flowing,
}

/// The hierarchy under an assembled system; `ties`: what penalties do to it. Fields
/// that are no displacements are smooth where each is constant. `None` for one of these, of which there are no
/// products by blocks, and for more than four ([`serves`]). Collective.
pub fn of_system<const D: usize, const N: usize>(
    world: &World,
    grid: &Grid<D>,
    numbering: &Numbering,
    rows: &Assembled,
    ties: &Ties<N>,
    (unknowns, kind): (Unknowns<N>, MatrixKind),
) -> Result<Option<Hierarchy>> {
    let modes = if unknowns.displacements { Modes::RigidMotions } else { Modes::Constants };
    let nodes = Nodes {
        position: numbering.nodes.iter().map(|&node| padded(grid.node_position(node))).collect(),
        key: numbering.nodes.iter().map(|&node| key(node as u64)).collect(),
        modes,
        ..nodes_of(numbering)
    };
    let flows = kind == MatrixKind::Flowing;
    match (modes, N, kind == MatrixKind::Symmetric) {
        (Modes::RigidMotions, 2, true) | (Modes::Constants, 3, true) => {
            build::<N, 3>(world, &nodes, rows, ties)
        }
        (Modes::RigidMotions, 2, false) | (Modes::Constants, 3, false) => {
            build_unsymmetric::<N, 3>(world, &nodes, rows, ties, flows)
        }
        (Modes::RigidMotions, _, true) => build::<N, 6>(world, &nodes, rows, ties),
        (Modes::RigidMotions, _, false) => {
            build_unsymmetric::<N, 6>(world, &nodes, rows, ties, flows)
        }
        (Modes::Constants, 2, true) => build::<N, 2>(world, &nodes, rows, ties),
        (Modes::Constants, 2, false) => build_unsymmetric::<N, 2>(world, &nodes, rows, ties, flows),
        (Modes::Constants, 4, true) => build::<N, 4>(world, &nodes, rows, ties),
        (Modes::Constants, 4, false) => build_unsymmetric::<N, 4>(world, &nodes, rows, ties, flows),
        (Modes::Constants, ..) => Ok(None),
    }
}

/// Whether [`of_system`] has levels for such unknowns.
pub fn serves<const N: usize>(unknowns: &Unknowns<N>) -> bool {
    unknowns.displacements || (2..=4).contains(&N)
}

/// Nodes of the finest level without what groups are made by.
fn nodes_of(numbering: &Numbering) -> Nodes {
    Nodes {
        owned: numbering.owned,
        global: numbering.global.clone(),
        halo: numbering.halo.clone(),
        ..Nodes::default()
    }
}

/// The symmetric part of an unsymmetric system, with the corrections of `ties`. Collective.
pub fn surrogate<const D: usize>(
    world: &World,
    numbering: &Numbering,
    rows: &impl Rows<D>,
    ties: &Ties<D>,
) -> Result<BlockCsr<D>> {
    surrogate_of(world, &nodes_of(numbering), rows, ties)
}

fn surrogate_of<const K: usize>(
    world: &World,
    nodes: &Nodes,
    rows: &impl Rows<K>,
    ties: &Ties<K>,
) -> Result<BlockCsr<K>> {
    let mut part = symmetric_part(world, nodes.owned, &nodes.global, &nodes.halo, rows)?;
    ties.correct(world, nodes, &mut part)?;
    Ok(part)
}

fn padded<const D: usize>(position: [f64; D]) -> [f64; 3] {
    std::array::from_fn(|k| position.get(k).copied().unwrap_or(0.0))
}

/// A number between 0 and 1 that looks random (SplitMix64).
fn key(node: u64) -> f64 {
    let mut z = node.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 + f64::MIN_POSITIVE
}

/// The hierarchy under the symmetric matrix `rows` of `K` displacements per node; `C`: rigid-body
/// modes, 3 in the plane and 6 in space; `ties`: what penalties do to it. `None` where no node is coupled to another. Collective.
pub fn build<const K: usize, const C: usize>(
    world: &World,
    nodes: &Nodes,
    rows: &impl Rows<K>,
    ties: &Ties<K>,
) -> Result<Option<Hierarchy>> {
    let (ghosts, count) = (nodes.global[nodes.owned..].to_vec(), count(nodes, rows));
    let mut exact = BlockProduct::symmetric::<K>(nodes.owned, ghosts.clone(), count);
    fill(rows, &mut exact);
    let mut rounded = BlockProduct::symmetric::<K>(nodes.owned, ghosts, count);
    exact.round_into(&mut rounded);
    levels::<K, C>(world, (nodes, rows, &ties.nodes), exact, rounded)
}

/// As [`build`], under a matrix that need not be symmetric but has a symmetric pattern; where it `flows`, few nodes that
/// do are solved together ([`mod@flow`]). Collective.
pub fn build_unsymmetric<const K: usize, const C: usize>(
    world: &World,
    nodes: &Nodes,
    rows: &impl Rows<K>,
    ties: &Ties<K>,
    flows: bool,
) -> Result<Option<Hierarchy>> {
    let (ghosts, count) = (nodes.global[nodes.owned..].to_vec(), count(nodes, rows));
    let mut exact = BlockProduct::unsymmetric::<K>(nodes.owned, ghosts.clone(), count);
    fill(rows, &mut exact);
    let symmetric = surrogate_of(world, nodes, rows, ties)?;
    // Where penalties tie nodes, A has no definite symmetric part before it is corrected.
    if ties.are_there(world) {
        let rounded = product(nodes, &symmetric);
        return levels::<K, C>(world, (nodes, &symmetric, &ties.nodes), exact, rounded);
    }
    let mut rounded = BlockProduct::unsymmetric::<K>(nodes.owned, ghosts, count);
    fill(rows, &mut rounded);
    let made = levels::<K, C>(world, (nodes, &symmetric, &[]), exact, rounded)?;
    let Some(mut made) = made else { return Ok(None) };
    if !flows {
        return Ok(Some(made));
    }
    let flow = Flow::of(world, nodes, rows, &symmetric);
    // Its block leaves the largest eigenvalue where it is: of the block alone it is 1.
    made.levels[0].smoother = Some(flow.smoother(world, nodes, rows)?);
    made.flow = Some(flow.share);
    Ok(Some(made))
}

/// The hierarchy with `exact` outside and `rounded` on the finest level; groups, transfers and coarse levels are those of the
/// symmetric `rows`.
fn levels<const K: usize, const C: usize>(
    world: &World,
    (nodes, rows, tied): (&Nodes, &impl Rows<K>, &[bool]),
    exact: BlockProduct<f64>,
    rounded: BlockProduct<f32>,
) -> Result<Option<Hierarchy>> {
    let mut levels = Vec::new();
    let first = coarsen::<K, C>(world, (nodes, rows, tied), rounded, 1.0, FINEST)?;
    let Some((level, mut coarse, mut length)) = first else { return Ok(None) };
    levels.push(level);
    while levels.len() < MOST_LEVELS && world.sum_usize(coarse.nodes.owned) * C > COARSEST {
        let (nodes, rows) = (&coarse.nodes, &coarse.rows);
        let product = product(nodes, rows);
        let next = coarsen::<C, C>(world, (nodes, rows, &[]), product, length, COARSER)?;
        let Some((level, coarser, coarser_length)) = next else { break };
        levels.push(level);
        (coarse, length) = (coarser, coarser_length);
    }
    Ok(Some(Hierarchy { exact, levels, coarsest: coarsest(&coarse), flow: None }))
}

/// One level, the next, and the latter's length of rotations (m). `None` where the next has too many
/// nodes to be worth having, or none.
fn coarsen<const K: usize, const C: usize>(
    world: &World,
    (nodes, rows, tied): (&Nodes, &impl Rows<K>, &[bool]),
    product: BlockProduct<f32>,
    length: f64,
    how: Coarsening,
) -> Result<Option<(Smoothed, Coarse<C>, f64)>> {
    let strong = Strong::of(world, nodes, rows, THRESHOLD)?;
    let aggregates = Aggregates::find(world, nodes, &strong, how.distance)?;
    let all = world.sum_usize(nodes.owned);
    if aggregates.total == 0 || aggregates.total as f64 > how.most_left * all as f64 {
        return Ok(None);
    }
    let inverse = inverted(product.diagonal());
    let largest = spectrum::largest::<K>(world, nodes, &product, &inverse)?;
    let lengths = Lengths::measured(world, nodes, &aggregates, length);
    let damping = if largest > 0.0 { DAMPING / largest } else { 0.0 };
    let parts = Parts {
        nodes,
        strong: &strong,
        aggregates: &aggregates,
        lengths,
        inverse: &inverse,
        damping,
    };
    let prolongator = Prolongator::<K, C>::smoothed(world, rows, &parts)?;
    let coarse = galerkin::coarse_operator(world, nodes, rows, &prolongator, &aggregates)?;
    let transfer = transfer(nodes, &prolongator, &coarse.nodes);
    let mut level = Smoothed { product, largest, transfer, smoother: None };
    if let Some(block) = tied::block_of(world, nodes, rows, tied, Cause::Ties)? {
        let mut smoother = BlockSmoother::new(world.comm(), inverse, Some(&block))?;
        let largest = spectrum::largest_smoothed::<K>(world, nodes, &level.product, &mut smoother)?;
        if let Some(largest) = largest {
            (level.largest, level.smoother) = (largest, Some(smoother));
        }
    }
    Ok(Some((level, coarse, lengths.coarse)))
}

/// Gives a smoother's block of tied nodes the values of the symmetric `rows`. Collective.
pub fn tie<const D: usize>(
    world: &World,
    numbering: &Numbering,
    rows: &impl Rows<D>,
    tied: &[bool],
    smoother: &mut BlockSmoother,
) -> Result<()> {
    let nodes = nodes_of(numbering);
    let block = tied::block_of(world, &nodes, rows, tied, Cause::Ties)?;
    // Rounded as in the level's own product.
    let rounded = diagonal(rows, nodes.owned).into_iter().map(|value| f64::from(value as f32));
    smoother.renew(inverted(rounded), block.as_ref())
}

/// The nodes that flow under the unsymmetric `rows`. Collective.
pub fn flow<const K: usize>(
    world: &World,
    numbering: &Numbering,
    rows: &impl Rows<K>,
) -> Result<Flow> {
    let nodes = nodes_of(numbering);
    let symmetric = symmetric_part(world, nodes.owned, &nodes.global, &nodes.halo, rows)?;
    Ok(Flow::of(world, &nodes, rows, &symmetric))
}

/// Gives a smoother the values of the unsymmetric `rows`, and the block of the nodes that flow. Collective.
pub fn follow_flow<const K: usize>(
    world: &World,
    numbering: &Numbering,
    rows: &impl Rows<K>,
    flow: &Flow,
    smoother: &mut BlockSmoother,
) -> Result<()> {
    *smoother = flow.smoother(world, &nodes_of(numbering), rows)?;
    Ok(())
}

/// A level's matrix for the cycle.
fn product<const K: usize>(nodes: &Nodes, rows: &impl Rows<K>) -> BlockProduct<f32> {
    let ghosts = nodes.global[nodes.owned..].to_vec();
    let mut product = BlockProduct::symmetric::<K>(nodes.owned, ghosts, count(nodes, rows));
    fill(rows, &mut product);
    product
}

/// Blocks in the owned rows.
fn count<const K: usize>(nodes: &Nodes, rows: &impl Rows<K>) -> usize {
    (0..nodes.owned).map(|row| rows.columns(row).len()).sum()
}

/// The values of `rows` into a product with them.
pub fn fill<T: Stored, const K: usize>(rows: &impl Rows<K>, product: &mut BlockProduct<T>) {
    product.fill::<K>(|row, blocks| {
        rows.visit(row, |column, block| blocks.push((column, *block)));
    });
}

/// The transfer for the cycle: the owned rows, by local coarse nodes.
fn transfer<const K: usize, const C: usize>(
    fine: &Nodes,
    prolongator: &Prolongator<K, C>,
    coarse: &Nodes,
) -> BlockProduct<f32> {
    let (ghosts, count) = (coarse.global[coarse.owned..].to_vec(), prolongator.offsets[fine.owned]);
    BlockProduct::collect::<K, C>(fine.owned, coarse.owned, ghosts, count, |row, blocks| {
        let (columns, values) = prolongator.row(row);
        let places = columns.iter().map(|&number| coarse.place(number));
        blocks.extend(places.zip(values.iter().copied()));
    })
}

/// The last level in compressed rows. A motion that no node of the finer level takes part in has
/// none of its own stiffness: a trace of its neighbours' keeps the matrix regular.
fn coarsest<const C: usize>(coarse: &Coarse<C>) -> CoarsestRows {
    const TRACE: f64 = 1e-9;
    let (nodes, rows) = (&coarse.nodes, &coarse.rows);
    let mut result = CoarsestRows { block: C, offsets: vec![0], ..CoarsestRows::default() };
    for row in 0..nodes.owned {
        let range = rows.offsets[row]..rows.offsets[row + 1];
        let mut entries: Vec<_> = range
            .map(|k| (nodes.global[rows.columns[k] as usize], rows.columns[k], rows.values[k]))
            .collect();
        entries.sort_unstable_by_key(|entry| entry.0);
        for r in 0..C {
            for (number, column, block) in &entries {
                let own = *column as usize == row;
                let scale = (0..C).map(|k| block[k][k]).fold(f64::MIN_POSITIVE, f64::max);
                result.columns.extend((0..C as Index).map(|c| number * C as Index + c));
                let trace = |c: usize| if own && c == r { TRACE * scale } else { 0.0 };
                result.values.extend((0..C).map(|c| block[r][c] + trace(c)));
            }
            result.offsets.push(result.columns.len() as Index);
        }
    }
    result
}
