//! f_ai = Σ_p T_ij g_aj V and K_aibk = Σ_p g_aj A_ijkl g_bl V (Lagrangian eq. 20-23, 27, 28), one
//! point after the other as the formulas read: what [`crate::system::terms::stress::assemble`] is compared
//! with.

use crate::deck::model::Frame;

use super::numbering::Numbering;
use super::pattern::Pattern;
use super::scatter::BlockMatrix;
use super::terms::stress::{StepPoints, displacement_gradient, respond};
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
        let gradients = &step.influences.gradients[step.influences.row(p)];
        let increment = displacement_gradient(gradients, |a| {
            std::array::from_fn(|i| displacement[nodes[a] as usize * D + i])
        });
        let Some(made) = respond(step, frame, p, &increment, &mut health) else { continue };
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
