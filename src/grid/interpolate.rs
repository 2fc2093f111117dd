//! The grid's own basis S_i(x) and its gradient at a place, on either grid (Ghost §2.5).

use super::bins::{EDGE_TOLERANCE, REACH};
use super::element;
use super::inverse_map::{inverse_map, inverse_map_from};
use super::lattice::{CELL_CORNERS, LINE_TOLERANCE};
use super::{Grid, Lattice, Mesh};

/// The basis's values at one place: a cell and its nodes in cell order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeFunctions {
    /// The cell whose functions these are.
    pub cell: usize,
    /// How many entries of the arrays count.
    pub count: usize,
    /// Global node numbers.
    pub nodes: [usize; 8],
    /// N_a(x)
    pub weights: [f64; 8],
}

/// The basis at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpolation<const D: usize> {
    /// N_a(x) and their nodes.
    pub values: ShapeFunctions,
    /// dN_a/dx, 1/m
    pub gradients: [[f64; D]; 8],
}

impl<const D: usize> Grid<D> {
    /// The basis at `x`; `None` outside the grid (beyond a relative 5e-10 of a cell, which
    /// round-off of a point on the edge stays below). An `allowance` > 0 extends the outer
    /// cells' own functions by that fraction of their extent (at most [`REACH`]); linear fields
    /// stay exact there. A `hint` is the cell `x` is likely to be in; it never changes the
    /// answer.
    pub fn interpolate(
        &self,
        x: &[f64; D],
        allowance: f64,
        hint: Option<usize>,
    ) -> Option<Interpolation<D>> {
        match self {
            Grid::Lattice(lattice) => {
                let low = lattice_cell(lattice, x, allowance)?;
                Some(basis_on_lattice(lattice, low, &within(lattice, low, x)))
            }
            Grid::Mesh(mesh) => {
                let (cell, xi) = mesh.locate_near(x, allowance, hint)?;
                let positions = mesh.cell_positions(cell);
                let nodes = &positions[..mesh.element.node_count()];
                let (gradients, _) = element::gradients(mesh.element, nodes, &xi)?;
                Some(Interpolation { values: values_on_mesh(mesh, cell, &xi), gradients })
            }
        }
    }

    /// The basis at `x` in a `cell` that holds it, on its rim at most up to the round-off by which
    /// [`Self::cells_at`] takes a place to lie on a face: that is removed, so that the functions of
    /// nodes off the face are exactly zero on a lattice, and nowhere below zero. `None` for a cell
    /// of a mesh without volume.
    pub fn interpolate_in(&self, cell: usize, x: &[f64; D]) -> Option<Interpolation<D>> {
        match self {
            Grid::Lattice(lattice) => {
                let low = lattice.cell_index(cell);
                Some(basis_on_lattice(lattice, low, &on_lines(within(lattice, low, x))))
            }
            Grid::Mesh(mesh) => {
                let positions = mesh.cell_positions(cell);
                let nodes = &positions[..mesh.element.node_count()];
                let xi = on_faces(mesh.element, inverse_map(mesh.element, nodes, x)?);
                let (gradients, _) = element::gradients(mesh.element, nodes, &xi)?;
                Some(Interpolation { values: values_on_mesh(mesh, cell, &xi), gradients })
            }
        }
    }

    /// Appends all cells that hold `x`: several where it lies on a face, an edge or a node, up to
    /// round-off. The one that [`Self::locate`] names comes first, the others in a fixed order.
    pub fn cells_at(&self, x: &[f64; D], out: &mut Vec<usize>) {
        match self {
            Grid::Lattice(lattice) => {
                let Some(upper) = lattice.cell_of(x) else { return };
                let on_line: [bool; D] = std::array::from_fn(|a| {
                    let t = lattice.scaled(a, x[a]);
                    upper[a] > 0 && (t - upper[a] as f64).abs() <= LINE_TOLERANCE
                });
                for lower in 0..1usize << D {
                    let down = |a: usize| lower >> a & 1;
                    if (0..D).all(|a| down(a) == 0 || on_line[a]) {
                        out.push(lattice.cell_at(std::array::from_fn(|a| upper[a] - down(a))));
                    }
                }
            }
            Grid::Mesh(mesh) => mesh.cells_holding(x, out),
        }
    }

    /// The values of [`Self::interpolate`] for a place on the rim of a region about `centre`: on a
    /// face of the grid, up to round-off, the cell on the side of `centre` is taken, so that a
    /// region which fills its cells does not reach into those it merely touches.
    pub fn values_towards(
        &self,
        x: &[f64; D],
        centre: &[f64; D],
        allowance: f64,
        hint: Option<usize>,
    ) -> Option<ShapeFunctions> {
        match self {
            Grid::Lattice(lattice) => {
                let low = cell_towards(lattice, x, centre, allowance)?;
                Some(values_on_lattice(lattice, low, &on_lines(within(lattice, low, x))))
            }
            Grid::Mesh(mesh) => {
                const NUDGE: f64 = 1e-6;
                let inner = std::array::from_fn(|a| x[a] + NUDGE * (centre[a] - x[a]));
                let (cell, near) = mesh.locate_near(&inner, allowance, hint)?;
                let positions = mesh.cell_positions(cell);
                let nodes = &positions[..mesh.element.node_count()];
                let xi = inverse_map_from(mesh.element, nodes, x, near)?;
                if mesh.element.outside(&xi) > EDGE_TOLERANCE
                    && let Some((own, xi)) = mesh.locate_near(x, 0.0, Some(cell))
                {
                    // The nudge has brought it over a face that it is truly beyond.
                    return Some(values_on_mesh(mesh, own, &on_faces(mesh.element, xi)));
                }
                Some(values_on_mesh(mesh, cell, &on_faces(mesh.element, xi)))
            }
        }
    }

    /// The values at `x`, which may lie beyond its cell, by the functions of the cell that
    /// [`Self::values_towards`] takes for a place `near` it.
    pub fn values_continued(
        &self,
        x: &[f64; D],
        near: &[f64; D],
        centre: &[f64; D],
        allowance: f64,
    ) -> Option<ShapeFunctions> {
        match self {
            Grid::Lattice(lattice) => {
                let low = cell_towards(lattice, near, centre, allowance)?;
                Some(values_on_lattice(lattice, low, &on_lines(within(lattice, low, x))))
            }
            Grid::Mesh(_) => {
                let values = self.values_towards(near, centre, allowance, None)?;
                self.interpolate_in(values.cell, x).map(|at| at.values)
            }
        }
    }
}

/// [`lattice_cell`], where `x` lies on a line the cell on the side of `centre`.
fn cell_towards<const D: usize>(
    lattice: &Lattice<D>,
    x: &[f64; D],
    centre: &[f64; D],
    allowance: f64,
) -> Option<[usize; D]> {
    let mut low = lattice_cell(lattice, x, allowance)?;
    for a in 0..D {
        let t = lattice.scaled(a, x[a]);
        let line = t.round();
        if (t - line).abs() <= LINE_TOLERANCE {
            let below = line > 0.0 && lattice.scaled(a, centre[a]) < line;
            low[a] = (line as usize - usize::from(below)).min(lattice.cells[a] - 1);
        }
    }
    Some(low)
}

/// Coordinates within a cell of a lattice, those next to a face put onto it.
fn on_lines<const D: usize>(local: [f64; D]) -> [f64; D] {
    local.map(|t| if (t - t.round()).abs() <= LINE_TOLERANCE { t.round() } else { t })
}

/// Reference coordinates, those of a box next to a face put onto it.
fn on_faces<const D: usize>(element: element::Element, xi: [f64; D]) -> [f64; D] {
    if element.is_simplex() {
        return xi;
    }
    xi.map(|xi| if (xi.abs() - 1.0).abs() <= 2.0 * EDGE_TOLERANCE { xi.signum() } else { xi })
}

/// Index of the cell that holds `x`, or of the outer one within reach.
fn lattice_cell<const D: usize>(
    lattice: &Lattice<D>,
    x: &[f64; D],
    allowance: f64,
) -> Option<[usize; D]> {
    let reach = allowance.clamp(EDGE_TOLERANCE, REACH);
    let mut low = [0; D];
    for axis in 0..D {
        let t = lattice.scaled(axis, x[axis]);
        let n = lattice.cells[axis];
        if !(t >= -reach && t <= n as f64 + reach) {
            return None;
        }
        low[axis] = (t.max(0.0) as usize).min(n - 1);
    }
    Some(low)
}

fn basis_on_lattice<const D: usize>(
    lattice: &Lattice<D>,
    low: [usize; D],
    local: &[f64; D],
) -> Interpolation<D> {
    let mut gradients = [[0.0; D]; 8];
    for (gradient, corner) in gradients.iter_mut().zip(&CELL_CORNERS).take(1 << D) {
        *gradient = std::array::from_fn(|axis| {
            let others = (0..D).filter(|&b| b != axis).map(|b| share(corner[b], local[b]));
            let slope = if corner[axis] == 1 { 1.0 } else { -1.0 };
            slope * others.product::<f64>() / lattice.spacing[axis]
        });
    }
    Interpolation { values: values_on_lattice(lattice, low, local), gradients }
}

/// `x` in units of the cell with index `low`, from its lower corner.
fn within<const D: usize>(lattice: &Lattice<D>, low: [usize; D], x: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|a| lattice.scaled(a, x[a]) - low[a] as f64)
}

/// Along one axis: the function of the upper or lower end.
fn share(upper: usize, local: f64) -> f64 {
    if upper == 1 { local } else { 1.0 - local }
}

fn values_on_lattice<const D: usize>(
    lattice: &Lattice<D>,
    low: [usize; D],
    local: &[f64; D],
) -> ShapeFunctions {
    let cell = lattice.cell_at(low);
    let mut values = ShapeFunctions { cell, count: 1 << D, nodes: [0; 8], weights: [0.0; 8] };
    for (a, corner) in CELL_CORNERS.iter().enumerate().take(1 << D) {
        values.nodes[a] = lattice.node_at(std::array::from_fn(|axis| low[axis] + corner[axis]));
        values.weights[a] = (0..D).map(|axis| share(corner[axis], local[axis])).product();
    }
    values
}

fn values_on_mesh<const D: usize>(mesh: &Mesh<D>, cell: usize, xi: &[f64; D]) -> ShapeFunctions {
    let mut nodes = [0; 8];
    for (out, &node) in nodes.iter_mut().zip(mesh.nodes_of(cell)) {
        *out = node as usize;
    }
    ShapeFunctions {
        cell,
        count: mesh.element.node_count(),
        nodes,
        weights: mesh.element.shape(xi),
    }
}
