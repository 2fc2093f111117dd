//! T a: what a point's own stress transmits over an area that it carries, and its derivatives by the
//! nodes' increments. Nitsche's method puts it in place of what holds the area.

use crate::deck::model::Frame;
use crate::tensor::dense::{self, Square};

use crate::system::cell_rows::{Now, rows_now};

use super::point_response::{respond, respond_averaged};
use super::term::Health;
use crate::mechanics::displacement_gradient;
use crate::system::step_points::StepPoints;

/// T_ij a_j, N, with P~ of the previous frame and the area a at the step's start, m2; and where
/// `wanted` d(T a)_i/du_bk of each node b of the point, N/m. Zero where the stress is not finite, which
/// the stress term reports.
pub fn on_area<const D: usize>(
    step: StepPoints<'_, D>,
    p: usize,
    area: &[f64; D],
    nodes: &[u32],
    displacement: &[f64],
    wanted: bool,
) -> ([f64; D], Vec<Square<D>>) {
    let row = step.influences.row(p);
    let gradients = &step.influences.gradients[row];
    let moved =
        |a: usize| -> [f64; D] { std::array::from_fn(|i| displacement[nodes[a] as usize * D + i]) };
    let increment = displacement_gradient(gradients, moved);
    let mut health = Health::default();
    let (found, expansion) = if step.influences.centre_gradients.is_empty() {
        (respond(step, Frame::Previous, p, &increment, &mut health), Vec::new())
    } else {
        let mut cells = Vec::new();
        let common = rows_now(step.influences, p, moved, &mut cells);
        match respond_averaged(step, Frame::Previous, p, &increment, common, &mut health) {
            None => (None, Vec::new()),
            Some((contribution, dilation)) => {
                let rate = dense::apply(&dilation.moduli.rate, area);
                let of_node = |(g, cells): (&[f64; D], &Now<D>)| -> Square<D> {
                    let row = dilation.swelling(&dilation.own((g, 0.0)), cells);
                    std::array::from_fn(|i| row.map(|r| rate[i] * r))
                };
                (Some(contribution), gradients.iter().zip(&cells).map(of_node).collect())
            }
        }
    };
    let Some(found) = found else {
        return ([0.0; D], vec![[[0.0; D]; D]; if wanted { nodes.len() } else { 0 }]);
    };
    let traction = dense::apply(&found.stress, area);
    if !wanted {
        return (traction, Vec::new());
    }
    let mut slopes: Vec<Square<D>> = Vec::with_capacity(nodes.len());
    for (b, g) in gradients.iter().enumerate() {
        let mut slope = expansion.get(b).copied().unwrap_or([[0.0; D]; D]);
        for i in 0..D {
            for j in 0..D {
                for k in 0..D {
                    for l in 0..D {
                        slope[i][k] += found.tangent[i][j][k][l] * area[j] * g[l];
                    }
                }
            }
        }
        slopes.push(slope);
    }
    (traction, slopes)
}
