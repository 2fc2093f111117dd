//! S_v = prod_a B((x_a - x_va) / h_a) with the quadratic B-spline B(s) = 3/4 - s^2 for |s| <= 1/2 and
//! (3/2 - |s|)^2 / 2 up to 3/2 (Steffen, Kirby, Berzins, IJNME 76 (2008) 922-948): functions of a
//! lattice whose first derivatives are continuous.
//!
//! A point has three nodes along each axis, one of them beyond its cell. In the outer half cells of
//! the grid the third lies outside; its share goes to the outer two as 2 and -1, which continues
//! linear fields: S sums to one and reproduces them everywhere.

use crate::basis::contract::Basis;
use crate::basis::{Declaration, Domain, Influences};
use crate::deck::model::GimpEdge;
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::points::Points;

/// Quadratic B-splines.
pub struct Spline;

/// The functions of an axis at a point: first node, weights, slopes per cell; two or three nodes.
type Line = (usize, Vec<[f64; 2]>);

/// At `t`, in cells from the axis's first node, of `cells` cells.
fn line(t: f64, cells: usize) -> Line {
    let middle = (t + 0.5).floor().clamp(0.0, cells as f64);
    let (s, node) = (t - middle, middle as usize);
    let [below, at, above] = [
        [0.5 * (0.5 - s) * (0.5 - s), s - 0.5],
        [0.75 - s * s, -2.0 * s],
        [0.5 * (0.5 + s) * (0.5 + s), s + 0.5],
    ];
    let plus = |a: [f64; 2], share: f64, b: [f64; 2]| [a[0] + share * b[0], a[1] + share * b[1]];
    if node == 0 {
        (0, vec![plus(at, 2.0, below), plus(above, -1.0, below)])
    } else if node == cells {
        (node - 1, vec![plus(below, -1.0, above), plus(at, 2.0, above)])
    } else {
        (node - 1, vec![below, at, above])
    }
}

impl Declaration for Spline {
    const WORD: &'static str = "spline";
    const DOC: &'static str = "points without domains, quadratic B-splines of a lattice";
    const DOMAIN: Domain = Domain::None;
    const NODES: [(usize, usize); 2] = [(9, 25), (27, 125)];

    fn of_deck(_edge: GimpEdge) -> Self {
        Spline
    }
}

impl<const D: usize> Basis<D> for Spline {
    fn map_points(&self, grid: &Grid<D>, points: &Points<D>) -> Result<Influences<D>> {
        let Grid::Lattice(lattice) = grid else {
            return Err(Error::Input("basis spline needs a lattice".into()));
        };
        let mut influences = Influences::with_capacity(points.len(), 3usize.pow(D as u32));
        for (p, x) in points.position.iter().enumerate() {
            if lattice.cell_of(x).is_none() {
                let id = points.id[p];
                return Err(Error::Run(format!("point {id} at {x:?} m is outside the grid")));
            }
            let lines: [Line; D] =
                std::array::from_fn(|a| line(lattice.scaled(a, x[a]), lattice.cells[a]));
            let total: usize = lines.iter().map(|(_, values)| values.len()).product();
            // First axis fastest, so that nodes ascend.
            for mut rest in 0..total {
                let index: [usize; D] = std::array::from_fn(|a| {
                    let count = lines[a].1.len();
                    let at = rest % count;
                    rest /= count;
                    at
                });
                let node = lattice.node_at(std::array::from_fn(|a| lines[a].0 + index[a]));
                let product = |slope: Option<usize>| -> f64 {
                    (0..D).map(|a| lines[a].1[index[a]][usize::from(slope == Some(a))]).product()
                };
                let gradient = std::array::from_fn(|a| product(Some(a)) / lattice.spacing[a]);
                influences.push(node, product(None), gradient);
            }
            influences.close_row();
        }
        Ok(influences)
    }

    fn populated_cells(
        &self,
        grid: &Grid<D>,
        points: &Points<D>,
        p: usize,
        hint: Option<usize>,
        out: &mut Vec<usize>,
    ) -> Result<()> {
        let x = &points.position[p];
        let outside = || Error::Run(format!("point {} at {x:?} m is outside", points.id[p]));
        out.push(grid.locate_near(x, hint).ok_or_else(outside)?);
        Ok(())
    }

    fn within_cells(&self) -> bool {
        false
    }

    fn jump_order(&self) -> usize {
        2
    }
}
