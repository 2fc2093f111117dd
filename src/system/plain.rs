//! f_ai = Σ_p T_ij g_aj V and K_aibk = Σ_p g_aj A_ijkl g_bl V (Lagrangian eq. 20-23, 27, 28), one
//! point after the other as the formulas read: what [`crate::system::terms::stress::assemble`] is compared
//! with.

use crate::deck::model::Frame;

use super::numbering::Numbering;
use super::pattern::Pattern;
use super::scatter::BlockMatrix;
use super::terms::stress::{StepPoints, displacement_gradient, respond, respond_averaged};
use super::terms::term::Health;

/// As [`crate::system::terms::stress::assemble`], to rounding.
pub fn assemble<const D: usize>(
    step: StepPoints<'_, D>,
    frame: Frame,
    numbering: &Numbering,
    pattern: &Pattern,
    displacement: &[f64],
    force: &mut [f64],
    stiffness: &mut BlockMatrix<D>,
) -> Health {
    let mut health = Health::default();
    for p in 0..step.points.len() {
        let group = step.groups.group_of_point[p];
        let range = step.groups.node_offsets[group]..step.groups.node_offsets[group + 1];
        let nodes = &step.group_nodes[range];
        let row = step.influences.row(p);
        let gradients = &step.influences.gradients[row.clone()];
        let nodal = |a: usize| -> [f64; D] {
            std::array::from_fn(|i| displacement[nodes[a] as usize * D + i])
        };
        let increment = displacement_gradient(gradients, nodal);
        let centres = step.influences.centre_gradients.get(row).unwrap_or_default();
        let made = if centres.is_empty() {
            respond(step, frame, p, &increment, &mut health).map(|made| (made, None))
        } else {
            let centre = displacement_gradient(centres, nodal);
            respond_averaged(step, frame, p, [&increment, &centre], &mut health)
                .map(|(made, dilation)| (made, Some(dilation)))
        };
        let Some((made, dilation)) = made else { continue };
        let dilate = |b: usize| dilation.map(|d| (d.rate, d.row(&gradients[b], &centres[b])));
        let products: Vec<_> = (0..gradients.len()).map(dilate).collect();
        let mapped: Vec<[f64; D]> = gradients
            .iter()
            .map(|g| std::array::from_fn(|j| (0..D).map(|i| g[i] * made.gradient_map[i][j]).sum()))
            .collect();
        let count = nodes.len();
        let mut block = vec![0.0; (count * D) * (count * D)];
        for a in 0..count {
            for i in 0..D {
                for j in 0..D {
                    force[nodes[a] as usize * D + i] +=
                        made.stress[i][j] * mapped[a][j] * made.volume;
                    for b in 0..count {
                        for k in 0..D {
                            if let Some((rate, row)) = &products[b] {
                                block[((a * D + i) * count + b) * D + k] +=
                                    mapped[a][j] * rate[i][j] * row[k] * made.volume;
                            }
                            for l in 0..D {
                                block[((a * D + i) * count + b) * D + k] += mapped[a][j]
                                    * made.tangent[i][j][k][l]
                                    * mapped[b][l]
                                    * made.volume;
                            }
                        }
                    }
                }
            }
        }
        stiffness.add(numbering, pattern, nodes, &block);
    }
    health
}
