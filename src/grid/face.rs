//! `[G]` of Ghost eq. 23: the jump of the normal derivative of the basis across an interior face.
//!
//! Only the scalar jump dN/dn is kept, because J_G is the same for every component. The normal
//! is constant in sign over the face and points from the lower to the upper cell; reversing it
//! changes the sign of the whole jump and leaves J_G alone.

use std::f64::consts::TAU;

use crate::error::{Error, Result};

use super::element;
use super::lattice::CELL_CORNERS;
use super::{FacePair, Grid, Lattice, Mesh};
use crate::deck::model::Element;

/// What the face matrix needs of one interior face.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceJump {
    /// Nodes of both cells, ascending, shared ones once.
    pub nodes: Vec<usize>,
    /// Quadrature points: weight (m^(D-1), it sums to the face's measure) and, per entry of
    /// `nodes`, dN/dn in the upper cell minus dN/dn in the lower one, 1/m. Between simplices that
    /// share no face: one per axis, with the whole measure and the jump of dN along the axis.
    pub points: Vec<(f64, Vec<f64>)>,
    /// x of each quadrature point, m: the radius with axisymmetry.
    pub radii: Vec<f64>,
    /// h of Ghost eq. 16, m: the face's length (2D) or the square root of its area (3D).
    pub size: f64,
    /// Mean extent of the two cells along the face's normal, m.
    pub cell_size: f64,
}

/// Abscissae of the two-point Gauss rule on [0, 1]; both weights are 1/2.
const GAUSS_UNIT: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

impl FaceJump {
    /// Makes it a face of a body of revolution about the axis x = 0: measures become those of the whole
    /// turn, m^D.
    pub fn make_ring(&mut self) {
        for ((weight, _), radius) in self.points.iter_mut().zip(&self.radii) {
            *weight *= TAU * radius;
        }
    }
}

impl<const D: usize> Grid<D> {
    /// Geometry of an interior face. Quadrature with two points per axis of the face, which is
    /// exact for products of jumps on lattices and simplices. Two simplices that share a node but
    /// no face are treated as if they did: see [`node_jump`].
    ///
    /// Error: the two cells share no face (two simplices: no node).
    pub fn face_jump(&self, pair: FacePair) -> Result<FaceJump> {
        match self {
            Grid::Lattice(lattice) => lattice_jump(lattice, pair),
            Grid::Mesh(mesh) => mesh_jump(mesh, pair),
        }
    }
}

fn no_common_face(pair: FacePair) -> Error {
    Error::Run(format!("cells {} and {} share no face of the grid", pair.lower, pair.upper))
}

/// On equal boxes the jump has a closed form: with N_f the basis on the face, nodes on the face
/// carry -2 N_f / h_n and the nodes opposite to them, on either side, N_f / h_n.
fn lattice_jump<const D: usize>(lattice: &Lattice<D>, pair: FacePair) -> Result<FaceJump> {
    if pair.upper >= lattice.cell_count() {
        return Err(no_common_face(pair));
    }
    let (low, high) = (lattice.cell_index(pair.lower), lattice.cell_index(pair.upper));
    let axis = (0..D)
        .find(|&n| (0..D).all(|a| high[a] == low[a] + usize::from(a == n)))
        .ok_or_else(|| no_common_face(pair))?;
    let tangents = (0..D).filter(|&a| a != axis);
    let area: f64 = tangents.clone().map(|a| lattice.spacing[a]).product();

    // (node, offset along the normal, offsets in the cell), ascending by node.
    let mut stencil: Vec<(usize, usize, [usize; 3])> = Vec::with_capacity(3 << (D - 1));
    for corner in CELL_CORNERS.iter().take(1 << D).filter(|corner| corner[axis] == 0) {
        for layer in 0..3 {
            let index = std::array::from_fn(|a| low[a] + if a == axis { layer } else { corner[a] });
            stencil.push((lattice.node_at(index), layer, *corner));
        }
    }
    stencil.sort_unstable_by_key(|entry| entry.0);

    let count = 1 << (D - 1);
    let mut points = Vec::with_capacity(count);
    let mut radii = Vec::with_capacity(count);
    for gauss in 0..count {
        let along = if axis == 0 { 1.0 } else { GAUSS_UNIT[gauss & 1] };
        radii.push(lattice.origin[0] + lattice.spacing[0] * (low[0] as f64 + along));
        let jump = stencil.iter().map(|&(_, layer, corner)| {
            let on_face: f64 = tangents
                .clone()
                .enumerate()
                .map(|(bit, a)| {
                    let t = GAUSS_UNIT[gauss >> bit & 1];
                    if corner[a] == 1 { t } else { 1.0 - t }
                })
                .product();
            let coefficient = if layer == 1 { -2.0 } else { 1.0 };
            coefficient * on_face / lattice.spacing[axis]
        });
        points.push((area / count as f64, jump.collect()));
    }
    Ok(FaceJump {
        nodes: stencil.iter().map(|entry| entry.0).collect(),
        points,
        radii,
        size: if D == 3 { area.sqrt() } else { area },
        cell_size: lattice.spacing[axis],
    })
}

/// On a mesh both cells' gradients are taken at the same places of the face; a face point has
/// its reference coordinates in either cell by interpolation between the face's nodes.
fn mesh_jump<const D: usize>(mesh: &Mesh<D>, pair: FacePair) -> Result<FaceJump> {
    if pair.lower >= mesh.cell_count() || pair.upper >= mesh.cell_count() {
        return Err(no_common_face(pair));
    }
    let face = mesh.across(pair.lower).position(|other| other == Some(pair.upper));
    let face = match face {
        Some(face) => face,
        None if mesh.element.is_simplex() => return node_jump(mesh, pair),
        None => return Err(no_common_face(pair)),
    };
    let element = mesh.element;
    let face = element.faces()[face];
    let cells = [pair.lower, pair.upper];
    let nodes = cells.map(|cell| mesh.nodes_of(cell));
    let positions = cells.map(|cell| mesh.cell_positions(cell));
    let x: Vec<[f64; D]> = face.iter().map(|&a| positions[0][a]).collect();
    // Where the lower cell's face nodes are among the upper cell's.
    let mut local = [face.to_vec(), Vec::with_capacity(face.len())];
    for &a in face {
        let found = nodes[1].iter().position(|&n| n == nodes[0][a]);
        local[1].push(found.ok_or_else(|| no_common_face(pair))?);
    }
    let mut union: Vec<u32> = nodes.concat();
    union.sort_unstable();
    union.dedup();

    let rule = face_rule(element);
    let mut points = Vec::with_capacity(rule.len());
    let radii = rule.iter().map(|(shape, ..)| shape.iter().zip(&x).map(|(n, x)| n * x[0]).sum());
    let radii = radii.collect();
    let mut area = 0.0;
    let mut mean_normal = [0.0; D];
    for (shape, slopes, weight) in &rule {
        let area_vector = area_vector(&x, slopes);
        let measure = area_vector.iter().map(|n| n * n).sum::<f64>().sqrt();
        let normal = area_vector.map(|n| n / measure);
        area += weight * measure;
        for (mean, n) in mean_normal.iter_mut().zip(&area_vector) {
            *mean += weight * n;
        }
        let mut jump = vec![0.0; union.len()];
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let mut xi = [0.0; D];
            for (n, &a) in shape.iter().zip(&local[side]) {
                let node: [f64; D] = element.reference_node(a);
                for (xi, node) in xi.iter_mut().zip(&node) {
                    *xi += n * node;
                }
            }
            let own = &positions[side][..element.node_count()];
            let (gradients, _) = element::gradients(element, own, &xi).ok_or_else(|| {
                Error::Run(format!("cell {} of the mesh is flat at a face", cells[side]))
            })?;
            for (&node, g) in nodes[side].iter().zip(&gradients) {
                let slot = union.partition_point(|&n| n < node);
                jump[slot] += sign * g.iter().zip(&normal).map(|(g, n)| g * n).sum::<f64>();
            }
        }
        points.push((weight * measure, jump));
    }
    let length = mean_normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    let normal = mean_normal.map(|n| n / length);
    let extent = positions.map(|x| {
        let along = x[..element.node_count()]
            .iter()
            .map(|x| x.iter().zip(&normal).map(|(x, n)| x * n).sum::<f64>());
        let (low, high) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(t), h.max(t)));
        high - low
    });
    Ok(FaceJump {
        nodes: union.iter().map(|&n| n as usize).collect(),
        points,
        radii,
        size: if D == 3 { area.sqrt() } else { area },
        cell_size: 0.5 * (extent[0] + extent[1]),
    })
}

/// The jump of the whole gradient between two linear simplices with a common node, one "quadrature
/// point" an axis. With a common face only the normal part of it differs from zero, so its square
/// is that of the normal jump. Measures are those of a right-angled simplex of their mean volume.
fn node_jump<const D: usize>(mesh: &Mesh<D>, pair: FacePair) -> Result<FaceJump> {
    let cells = [pair.lower, pair.upper];
    let nodes = cells.map(|cell| mesh.nodes_of(cell));
    if nodes[0].iter().all(|node| !nodes[1].contains(node)) {
        return Err(no_common_face(pair));
    }
    let mut union: Vec<u32> = nodes.concat();
    union.sort_unstable();
    union.dedup();
    let mut jumps = vec![vec![0.0; union.len()]; D];
    // Of a right-angled simplex with legs h: det J = h^D.
    let (mut determinant, mut radius) = (0.0, 0.0);
    for (side, sign) in [(0, -1.0), (1, 1.0)] {
        let x = mesh.cell_positions(cells[side]);
        let centre = mesh.element.reference_centre();
        let (gradients, det) = element::gradients(mesh.element, &x[..=D], &centre)
            .ok_or_else(|| Error::Run(format!("cell {} of the mesh is flat", cells[side])))?;
        determinant += 0.5 * det;
        radius += x[..=D].iter().map(|x| x[0]).sum::<f64>() / (2 * D + 2) as f64;
        for (&node, g) in nodes[side].iter().zip(&gradients) {
            let slot = union.partition_point(|&n| n < node);
            for (jump, g) in jumps.iter_mut().zip(g) {
                jump[slot] += sign * g;
            }
        }
    }
    let leg = determinant.powf(1.0 / D as f64);
    let area = if D == 3 { 0.5 * leg * leg } else { leg };
    Ok(FaceJump {
        nodes: union.iter().map(|&n| n as usize).collect(),
        points: jumps.into_iter().map(|jump| (area, jump)).collect(),
        radii: vec![radius; D],
        size: if D == 3 { area.sqrt() } else { area },
        cell_size: leg,
    })
}

/// Per quadrature point of a face: basis of its nodes, derivatives along its one or two
/// parameters, and weight. Edges: two Gauss points on [0, 1]. Triangles: three points.
/// Quadrilaterals: 2 x 2 on the unit square.
fn face_rule(element: Element) -> Vec<(Vec<f64>, Vec<[f64; 2]>, f64)> {
    match element {
        Element::Tri3 | Element::Quad4 => GAUSS_UNIT
            .iter()
            .map(|&t| (vec![1.0 - t, t], vec![[-1.0, 0.0], [1.0, 0.0]], 0.5))
            .collect(),
        Element::Tet4 => (0..3)
            .map(|corner| {
                let shape = (0..3).map(|a| if a == corner { 2.0 / 3.0 } else { 1.0 / 6.0 });
                (shape.collect(), vec![[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]], 1.0 / 6.0)
            })
            .collect(),
        Element::Hex8 => (0..4)
            .map(|g| {
                let (s, t) = (GAUSS_UNIT[g % 2], GAUSS_UNIT[g / 2]);
                (
                    vec![(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t],
                    vec![[t - 1.0, s - 1.0], [1.0 - t, -s], [t, s], [-t, 1.0 - s]],
                    0.25,
                )
            })
            .collect(),
    }
}

/// Outward normal of the cell that owns the face, times the face's measure per parameter area.
fn area_vector<const D: usize>(x: &[[f64; D]], slopes: &[[f64; 2]]) -> [f64; D] {
    let mut tangents = [[0.0; D]; 2];
    for (x, slope) in x.iter().zip(slopes) {
        for (tangent, s) in tangents.iter_mut().zip(slope) {
            for (t, x) in tangent.iter_mut().zip(x) {
                *t += s * x;
            }
        }
    }
    let [u, v] = tangents;
    if D == 2 {
        std::array::from_fn(|a| if a == 0 { u[1] } else { -u[0] })
    } else {
        std::array::from_fn(|a| {
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            u[b] * v[c] - u[c] * v[b]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faces<const D: usize>(grid: &Grid<D>) -> Vec<FacePair> {
        let mut pairs = Vec::new();
        let mut neighbours = Vec::new();
        for lower in 0..grid.cell_count() {
            neighbours.clear();
            grid.face_neighbours(lower, &mut neighbours);
            let above = neighbours.iter().filter(|&&upper| upper > lower);
            pairs.extend(above.map(|&upper| FacePair { lower, upper }));
        }
        pairs
    }

    /// Sum over nodes of jump times f(x): the jump of the normal derivative of f's interpolant.
    fn jump_of<const D: usize>(
        grid: &Grid<D>,
        jump: &FaceJump,
        f: impl Fn([f64; D]) -> f64,
    ) -> Vec<f64> {
        let values: Vec<f64> = jump.nodes.iter().map(|&n| f(grid.node_position(n))).collect();
        jump.points.iter().map(|(_, j)| j.iter().zip(&values).map(|(a, b)| a * b).sum()).collect()
    }

    #[test]
    fn lattice_jump_of_linear_fields_vanishes_and_of_a_kink_is_its_height() {
        let grid = Grid::Lattice(Lattice {
            origin: [-1.0, 2.0, 0.5],
            spacing: [0.5, 0.25, 2.0],
            cells: [3, 3, 2],
        });
        for pair in faces(&grid) {
            let jump = grid.face_jump(pair).unwrap();
            assert!(jump.nodes.is_sorted_by(|a, b| a < b));
            assert_eq!((jump.nodes.len(), jump.points.len()), (12, 4));
            for value in jump_of(&grid, &jump, |x| 3.0 + x[0] - 2.0 * x[1] + 0.3 * x[2]) {
                assert!(value.abs() < 1e-13, "{value}");
            }
        }
        // |x| has slope -1 below and +1 above the face x = 0.
        let pair = FacePair { lower: 1, upper: 2 };
        let jump = grid.face_jump(pair).unwrap();
        for value in jump_of(&grid, &jump, |x| x[0].abs()) {
            assert!((value - 2.0).abs() < 1e-13);
        }
        let area: f64 = jump.points.iter().map(|p| p.0).sum();
        assert!((area - 0.5).abs() < 1e-15);
        assert!((jump.size - 0.5f64.sqrt()).abs() < 1e-15);
        assert_eq!(jump.cell_size, 0.5);
    }

    #[test]
    fn lattice_jump_integrates_products_exactly() {
        // The slope of f = (x - 1)^2 (1 + 2y), interpolated, jumps by 2h (1 + 2y) across x = 1;
        // the integral of its square over y in [0, h] is 4 h^2 ((1 + 2h)^3 - 1) / 6.
        let h = 0.5;
        let grid = Grid::Lattice(Lattice { origin: [0.0; 2], spacing: [h; 2], cells: [4, 4] });
        let jump = grid.face_jump(FacePair { lower: 1, upper: 2 }).unwrap();
        let values = jump_of(&grid, &jump, |x| (x[0] - 1.0).powi(2) * (1.0 + 2.0 * x[1]));
        let integral: f64 = jump.points.iter().zip(values).map(|(p, v)| p.0 * v * v).sum();
        let exact = 4.0 * h * h * ((1.0 + 2.0 * h).powi(3) - 1.0) / 6.0;
        assert!((integral - exact).abs() < 1e-13, "{integral} {exact}");
    }

    #[test]
    fn cells_without_a_common_face_are_refused() {
        let grid = Grid::Lattice(Lattice { origin: [0.0; 2], spacing: [1.0; 2], cells: [3, 3] });
        for (lower, upper) in [(0, 4), (0, 2), (2, 3), (0, 9)] {
            let error = grid.face_jump(FacePair { lower, upper }).unwrap_err();
            assert!(error.to_string().contains("share no face"));
        }
    }
}
