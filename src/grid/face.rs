//! [G] of Ghost eq. 23: the jump of the normal derivative of the basis across an interior face.
//!
//! Only the scalar jump dN/dn is kept, because J_G is the same for every component. The normal
//! is constant in sign over the face and points from the lower to the upper cell; reversing it
//! changes the sign of the whole jump and leaves J_G alone.

use crate::error::{Error, Result};

use super::lattice::CELL_CORNERS;
use super::{FacePair, Grid, Lattice};

/// What the face matrix needs of one interior face.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceJump {
    /// Nodes of both cells, ascending, shared ones once.
    pub nodes: Vec<usize>,
    /// Quadrature points: weight (m^(D-1), it sums to the face's measure) and, per entry of
    /// `nodes`, dN/dn in the upper cell minus dN/dn in the lower one, 1/m.
    pub points: Vec<(f64, Vec<f64>)>,
    /// h of Ghost eq. 16, m: the face's length (2D) or the square root of its area (3D).
    pub size: f64,
    /// Mean extent of the two cells along the face's normal, m.
    pub cell_size: f64,
}

/// Abscissae of the two-point Gauss rule on [0, 1]; both weights are 1/2.
pub(super) const GAUSS_UNIT: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

impl<const D: usize> Grid<D> {
    /// Geometry of an interior face. Quadrature with two points per axis of the face, which is
    /// exact for products of jumps on lattices and simplices.
    ///
    /// Error: the two cells share no face.
    pub fn face_jump(&self, pair: FacePair) -> Result<FaceJump> {
        match self {
            Grid::Lattice(lattice) => lattice_jump(lattice, pair),
        }
    }
}

pub(super) fn no_common_face(pair: FacePair) -> Error {
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
    for gauss in 0..count {
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
        size: if D == 3 { area.sqrt() } else { area },
        cell_size: lattice.spacing[axis],
    })
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
