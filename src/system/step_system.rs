//! The grid side of a step: influences, populated cells, Ghost faces, equations, sparsity.

use super::border::Border;
use super::carried;
use super::conditions::{Conditions, StepSpan};
use super::face_points;
use super::facing::{self, Couple};
use super::model::Model;
use super::numbering::Numbering;
use super::numbering::Touched;
use super::pattern::{self, Pattern};
use super::populated::{GROUP, Populated};
use super::rim::Rim;
use super::step_points::StepPoints;
use super::unknowns::Unknowns;
use crate::basis::centre::{Moments, RowNodes};
use crate::basis::contract::Basis;
use crate::basis::{self, Groups, Influences, radial};
use crate::contact::fields::Fields;
use crate::deck::model::{Locking, PointVolume, Symmetry};
use crate::error::{Error, Result};
use crate::ghost::{FaceStencil, boundary_faces, face_stencils};
use crate::grid::{FacePair, Grid};
use crate::material::Material;
use crate::parallel::World;
use crate::points::Points;

/// Everything a step needs that depends on where the points are at its start.
pub struct Discretisation<const D: usize> {
    /// Basis functions of the points.
    pub influences: Influences<D>,
    /// Points that touch the same nodes.
    pub groups: Groups,
    /// Local node of each entry of `groups.nodes`.
    pub group_nodes: Vec<u32>,
    /// Points that touch ghosts, and the others.
    pub border: Border,
    /// The same of groups.
    pub group_border: Border,
    /// Cells with material.
    pub populated: Populated,
    /// Faces owned here.
    pub faces: Vec<FaceStencil>,
    /// Equation numbers of the nodes.
    pub numbering: Numbering,
    /// Sparsity of the equations.
    pub pattern: Pattern,
    /// How firmly each local node holds material: the weight, and for `mpm` the size of the
    /// gradients too, which is finite where a point on a cell's edge has no weight.
    pub node_coupling: Vec<f64>,
    /// Local nodes that a Ghost face stabilises.
    pub on_face: Vec<bool>,
    /// Elements of this rank's points that face another body, in implicit steps; their supports in the
    /// pattern follow those of the groups and the faces.
    pub facing: Vec<Couple<D>>,
    /// Cells of the faces owned here.
    pub ghost_cells: Vec<usize>,
    /// Points that carry elements of surfaces on which something acts.
    pub carriers: Vec<usize>,
    /// What stresses are integrated over.
    pub point_volume: PointVolume,
}

/// Whether the step's equations couple nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coupling {
    /// Faces and sparsity are found.
    Matrix,
    /// The same for a mass: what [`Discretisation::nodes_left_out`] reads is not.
    Mass,
    /// A diagonal system: neither faces nor sparsity (both stay empty).
    Diagonal,
}

impl<const D: usize> Discretisation<D> {
    /// Maps the points onto the grid and numbers the equations. Collective.
    pub fn new(world: &World, model: &Model<D>, points: &Points<D>) -> Result<Self> {
        Self::with_coupling(world, model, points, Coupling::Matrix)
    }

    /// The grid side of a step together with what the boundaries prescribe in it. Collective.
    pub fn with_conditions(
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        coupling: Coupling,
        span: StepSpan,
    ) -> Result<(Self, Conditions)> {
        let mesh = Self::with_coupling(world, model, points, coupling)?;
        let mut conditions = Conditions::evaluate(
            world,
            &model.grid,
            model.deck.method.basis,
            &mesh.numbering,
            points,
            (&model.deck.boundaries, Unknowns::<D>::displacements()),
            span,
        )?;
        if model.deck.analysis.symmetry == Symmetry::Axisymmetric {
            conditions.hold_axis::<D, D>(world, &model.grid, &mesh.numbering)?;
        }
        Ok((mesh, conditions))
    }

    /// As [`Self::new`]. Collective.
    pub fn with_coupling(
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        coupling: Coupling,
    ) -> Result<Self> {
        let method = &model.deck.method;
        let basis = basis::of_deck(method.basis, method.gimp_edge);
        Self::with_basis(world, model, points, coupling, &*basis)
    }

    /// [`Self::with_coupling`] with basis functions of choice. Collective.
    pub fn with_basis(
        world: &World,
        model: &Model<D>,
        points: &Points<D>,
        coupling: Coupling,
        basis: &dyn Basis<D>,
    ) -> Result<Self> {
        let (grid, partition) = (&model.grid, &model.partition);
        let mut influences = world.fail_together(basis.map_points(grid, points))?;
        if basis.of_one_cell() && coupling != Coupling::Matrix {
            face_points::choose_cells(world, grid, partition, points, &mut influences)?;
        }
        if model.deck.analysis.symmetry == Symmetry::Axisymmetric {
            let turned = radial::make_rings(grid, basis, points, &mut influences);
            world.fail_together(turned)?;
        }
        let fields = &model.contacts.fields;
        let groups = match fields.is_single() {
            true => Groups::new(&influences),
            false => Groups::renamed(&influences, |p, n| fields.node(points.body[p] as usize, n)),
        };
        let kinds = (basis, model.deck.bodies.len());
        let populated = Populated::find(world, grid, partition, kinds, points, Some(&influences))?;
        let (faces, ghost_cells) = match coupling {
            Coupling::Matrix | Coupling::Mass => {
                let rim = match basis.of_one_cell() || model.deck.ghost.is_none() {
                    true => Rim::default(),
                    false => Rim::of(grid, points),
                };
                let (faces, cells) = find_faces(world, model, (&populated, &rim), fields)?;
                require_first_jumps(world, basis, &faces)?;
                (faces, cells)
            }
            Coupling::Diagonal => Default::default(),
        };

        let facing = match coupling {
            Coupling::Matrix => facing::find(world, model, points, &influences)?,
            Coupling::Mass | Coupling::Diagonal => Vec::new(),
        };

        // What holds the rows' nodes: where they are those of the populated cells, these are fewer.
        let mut reached: Vec<usize> =
            faces.iter().flat_map(|face| face.nodes.iter().copied()).collect();
        if fields.is_single() {
            append_nodes(world, grid, &populated, &mut reached);
        } else {
            append_nodes_of_fields(grid, &populated, fields, &mut reached);
        }
        if !basis.within_cells() || !fields.is_single() {
            reached.extend_from_slice(&groups.nodes);
        }
        reached.extend(facing.iter().flat_map(|couple| couple.nodes.iter().copied()));
        let owner_of = |node| partition.owner_of_node(grid, fields.place(node));
        let touched = Touched::assign_by(world, owner_of, reached)?;
        let supports = (0..groups.len())
            .map(|g| groups.nodes(g))
            .chain(faces.iter().map(|face| face.nodes.as_slice()))
            .chain(facing.iter().map(|couple| couple.nodes.as_slice()));
        let (numbering, pattern) = match coupling {
            Coupling::Matrix | Coupling::Mass => {
                pattern::build(world, touched, owner_of, supports)?
            }
            Coupling::Diagonal => {
                (Numbering::build(world, touched.owned, &touched.foreign)?, Pattern::default())
            }
        };

        let numbering = numbering.in_fields(fields);
        let group_nodes = world.fail_together(locals(&numbering, &groups.nodes))?;
        if model.deck.method.locking == Locking::FBar {
            let rows = RowNodes { groups: &groups, nodes: &group_nodes, count: numbering.len() };
            fill_cell_rows(world, grid, basis, points, &mut influences, (rows, &numbering))?;
        }
        let group_reaches: Vec<bool> = groups
            .node_offsets
            .windows(2)
            .map(|range| {
                group_nodes[range[0]..range[1]].iter().any(|&n| n as usize >= numbering.owned)
            })
            .collect();
        let border = Border::new(groups.group_of_point.iter().map(|&group| group_reaches[group]));
        let group_border = Border::new(group_reaches.into_iter());
        let mut node_coupling = vec![0.0; numbering.len()];
        if coupling == Coupling::Matrix {
            let reach = if basis.of_one_cell() { grid.cell_size() } else { 0.0 };
            for (p, &group) in groups.group_of_point.iter().enumerate() {
                let nodes =
                    &group_nodes[groups.node_offsets[group]..groups.node_offsets[group + 1]];
                for (&node, entry) in nodes.iter().zip(influences.row(p)) {
                    let slope = influences.gradients[entry].iter().map(|g| g * g).sum::<f64>();
                    node_coupling[node as usize] +=
                        influences.weights[entry].abs() + reach * slope.sqrt();
                }
            }
        }
        let mut on_face = vec![0.0; numbering.len()];
        if coupling == Coupling::Matrix {
            for face in &faces {
                for node in face.nodes.iter().filter_map(|&node| numbering.local(node)) {
                    on_face[node] = 1.0;
                }
            }
            for field in [&mut node_coupling, &mut on_face] {
                numbering.halo.reverse_add(world, field, 1)?;
                numbering.halo.forward(world, field, 1)?;
            }
        }
        Ok(Discretisation {
            influences,
            groups,
            group_nodes,
            border,
            group_border,
            populated,
            faces,
            numbering,
            pattern,
            node_coupling,
            facing,
            on_face: on_face.into_iter().map(|mark| mark > 0.0).collect(),
            ghost_cells,
            carriers: carried::carriers(model, points),
            point_volume: model.deck.method.point_volume,
        })
    }

    /// The points as the equations see them.
    pub fn step_points<'a>(
        &'a self,
        points: &'a Points<D>,
        materials: &'a [Material],
    ) -> StepPoints<'a, D> {
        StepPoints {
            points,
            materials,
            influences: &self.influences,
            groups: &self.groups,
            group_nodes: &self.group_nodes,
            border: &self.group_border,
            volume: self.point_volume,
        }
    }

    /// Sum of basis weights at each local node, over all ranks. Collective.
    pub fn node_weights(&self, world: &World) -> Result<Vec<f64>> {
        let mut sums = vec![0.0; self.numbering.len()];
        let (groups, influences) = (&self.groups, &self.influences);
        for (p, &group) in groups.group_of_point.iter().enumerate() {
            let nodes = groups.node_offsets[group]..groups.node_offsets[group + 1];
            let weights = &influences.weights[influences.row(p)];
            for (&node, weight) in self.group_nodes[nodes].iter().zip(weights) {
                sums[node as usize] += weight;
            }
        }
        self.numbering.halo.reverse_add(world, &mut sums, 1)?;
        self.numbering.halo.forward(world, &mut sums, 1)?;
        Ok(sums)
    }

    /// Local nodes that carry no equation of their own: their coupling on the material is at most
    /// `threshold` times the largest one, and no Ghost face holds them. Collective.
    pub fn nodes_left_out(&self, world: &World, threshold: f64) -> Vec<bool> {
        let largest = world.max(self.node_coupling.iter().copied().fold(0.0, f64::max));
        self.node_coupling
            .iter()
            .zip(&self.on_face)
            .map(|(&coupling, &on_face)| !on_face && coupling <= threshold * largest)
            .collect()
    }
}

/// The rows of F-bar: means over the material of all ranks in each cell. Collective.
fn fill_cell_rows<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    basis: &dyn Basis<D>,
    points: &Points<D>,
    influences: &mut Influences<D>,
    (rows, numbering): (RowNodes<'_>, &Numbering),
) -> Result<()> {
    let mut sums = world.fail_together(basis.cell_moments(grid, points, influences, rows))?;
    if !sums.is_empty() {
        const COUNT: usize = size_of::<Moments>() / size_of::<f64>();
        numbering.halo.reverse_add(world, sums.as_flattened_mut(), COUNT)?;
        numbering.halo.forward(world, sums.as_flattened_mut(), COUNT)?;
    }
    world.fail_together(basis.fill_cell_rows(grid, points, influences, rows, &sums))
}

/// The populated cells and the nodes at them, numbered: all that is known of a step's system before
/// it is built. Collective.
pub fn active<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Result<(Populated, Numbering)> {
    let (grid, partition) = (&model.grid, &model.partition);
    let method = &model.deck.method;
    let basis = basis::of_deck(method.basis, method.gimp_edge);
    let kinds = (&*basis, model.deck.bodies.len());
    let populated = Populated::find(world, grid, partition, kinds, points, None)?;
    let mut reached = Vec::new();
    append_nodes(world, grid, &populated, &mut reached);
    if !basis.within_cells() {
        reached.extend(world.fail_together(basis.map_points(grid, points))?.nodes);
    }
    let touched = Touched::assign(world, grid, partition, reached)?;
    Ok((populated, Numbering::build(world, touched.owned, &touched.foreign)?))
}

/// The local nodes. Error: one has no number, which a basis is to blame for.
fn locals(numbering: &Numbering, nodes: &[usize]) -> Result<Vec<u32>> {
    let local = |&node: &usize| {
        numbering.local(node).map(|local| local as u32).ok_or_else(|| {
            Error::Environment(format!(
                "the grid node {node} is in the row of a point and not in the populated cells, \
                 while the basis says that it stays within them (Basis::within_cells)"
            ))
        })
    };
    nodes.iter().map(local).collect()
}

/// Error: Ghost faces, and functions whose first derivatives do not jump. Collective.
fn require_first_jumps<const D: usize>(
    world: &World,
    basis: &dyn Basis<D>,
    faces: &[FaceStencil],
) -> Result<()> {
    if basis.jump_order() == 1 || !world.any(!faces.is_empty()) {
        return Ok(());
    }
    Err(Error::Input(format!(
        "Ghost faces penalise jumps of first derivatives, and the first derivative of this basis \
         that jumps is of order {}: set ghost = \"off\"",
        basis.jump_order()
    )))
}

/// Appends the nodes of the populated cells owned or reached here.
fn append_nodes<const D: usize>(
    world: &World,
    grid: &Grid<D>,
    populated: &Populated,
    nodes: &mut Vec<usize>,
) {
    let of_others = populated.reached.iter().filter(|&&cell| {
        world.size() > 1 && populated.owned.binary_search_by_key(&cell, |own| own.0).is_err()
    });
    for &cell in populated.owned.iter().map(|(cell, _)| cell).chain(of_others) {
        grid.cell_nodes(cell, nodes);
    }
}

/// Appends the nodes of the populated cells owned here, in each field that populates them.
fn append_nodes_of_fields<const D: usize>(
    grid: &Grid<D>,
    populated: &Populated,
    fields: &Fields,
    nodes: &mut Vec<usize>,
) {
    let mut below = Vec::new();
    for (cell, field) in populated.in_fields(fields) {
        below.clear();
        grid.cell_nodes(cell, &mut below);
        nodes.extend(below.iter().map(|&node| fields.at(field, node)));
    }
}

/// The Ghost faces owned here, of the nodes of each of the `fields`, and the cells beside them.
pub(crate) fn find_faces<const D: usize>(
    world: &World,
    model: &Model<D>,
    (populated, rim): (&Populated, &Rim),
    fields: &Fields,
) -> Result<(Vec<FaceStencil>, Vec<usize>)> {
    if fields.is_single() {
        return faces_of_bodies(world, model, populated, rim);
    }
    let (mut faces, mut cells) = (Vec::new(), Vec::new());
    for field in 0..fields.count() {
        let own = populated.of_field(fields, field);
        let (mut found, beside) = faces_of_bodies(world, model, &own, rim)?;
        let nodes = found.iter_mut().flat_map(|face| &mut face.nodes);
        nodes.for_each(|node| *node = fields.at(field, *node));
        faces.append(&mut found);
        cells.extend(beside);
    }
    Ok((faces, cells))
}

/// The faces of all bodies in `populated`, of the grid's nodes.
fn faces_of_bodies<const D: usize>(
    world: &World,
    model: &Model<D>,
    populated: &Populated,
    rim: &Rim,
) -> Result<(Vec<FaceStencil>, Vec<usize>)> {
    let Some(ghost) = &model.deck.ghost else { return Ok((Vec::new(), Vec::new())) };
    let kind = (ghost.scaling, model.deck.analysis.symmetry);
    let groups = std::iter::once(&populated.owned).chain(&populated.further);
    let mut found: Vec<(FacePair, FaceStencil)> = Vec::new();
    for (group, (cells, penalties)) in groups.zip(model.penalties.chunks(GROUP)).enumerate() {
        let held = |cell| rim.held(group, cell);
        let faces = boundary_faces(world, &model.grid, &model.partition, cells, held)?;
        let stencils = face_stencils(&model.grid, &faces, kind, penalties);
        let stencils = world.fail_together(stencils)?;
        found.extend(faces.iter().map(|face| face.pair).zip(stencils));
    }
    if !populated.further.is_empty() {
        // A face of bodies in several groups takes the largest penalty among them, too.
        found.sort_by_key(|(pair, _)| (pair.lower, pair.upper));
        found.dedup_by(|(next, other), (pair, kept)| {
            let same = (next.lower, next.upper) == (pair.lower, pair.upper);
            if same {
                kept.stiffness = kept.stiffness.max(other.stiffness);
                kept.mass = kept.mass.max(other.mass);
            }
            same
        });
    }
    let cells = found.iter().flat_map(|(pair, _)| [pair.lower, pair.upper]).collect();
    Ok((found.into_iter().map(|(_, stencil)| stencil).collect(), cells))
}
