//! f_ai = Σ_p T_ij g_aj V and K_aibk = Σ_p g_aj A_ijkl g_bl V (Lagrangian eq. 20-23, 27, 28), one
//! point after the other as the formulas read: what [`crate::system::terms::stress::assemble`] is compared
//! with.

use crate::deck::model::Frame;
use crate::mechanics::Increment;
use crate::mechanics::dilation::{Dilation, Rows};
use crate::tensor::dense;

use super::numbering::Numbering;
use super::pattern::Pattern;
use super::scatter::BlockMatrix;
use super::terms::stress::{
    StepPoints, displacement_gradient, hoop_increment, respond, respond_averaged, respond_ring,
};
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
        let centres = step.influences.centre_gradients.get(row.clone()).unwrap_or_default();
        if !step.influences.hoop.is_empty() {
            let block = ring(step, frame, p, nodes, displacement, force, &mut health);
            if let Some(block) = block {
                stiffness.add(numbering, pattern, nodes, &block);
            }
            continue;
        }
        let made = if centres.is_empty() {
            respond(step, frame, p, &increment, &mut health).map(|made| (made, None))
        } else {
            let centre = displacement_gradient(centres, nodal);
            respond_averaged(step, frame, p, [&increment, &centre], &mut health)
                .map(|(made, dilation)| (made, Some(dilation)))
        };
        let Some((made, dilation)) = made else { continue };
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
        if let Some(dilation) = &dilation {
            let frame = |a: usize| (mapped[a], 0.0);
            let rows = |a: usize| dilation.rows((&gradients[a], 0.0), (&centres[a], 0.0));
            dilate(dilation, made.volume, (nodes, frame, rows), force, &mut block);
        }
        stiffness.add(numbering, pattern, nodes, &block);
    }
    health
}

/// What F-bar adds to force and block ([`mechanics::dilation`](crate::mechanics::dilation)), term by term.
fn dilate<const D: usize>(
    dilation: &Dilation<D>,
    volume: f64,
    (nodes, frame, rows): (&[u32], impl Fn(usize) -> ([f64; D], f64), impl Fn(usize) -> Rows<D>),
    force: &mut [f64],
    block: &mut [f64],
) {
    let (moduli, count) = (&dilation.moduli, nodes.len());
    let pressure = moduli.trace * dilation.share;
    for a in 0..count {
        let (in_frame, of_a) = (frame(a), rows(a));
        for i in 0..D {
            force[nodes[a] as usize * D + i] += volume * moduli.trace * of_a.swelling[i];
        }
        for b in 0..count {
            let (frame_b, of_b) = (frame(b), rows(b));
            let change = dilation.change_of_trace((&frame_b.0, frame_b.1), &of_b.swelling);
            for i in 0..D {
                let hoop_force = if i == 0 { in_frame.1 * moduli.hoop_rate } else { 0.0 };
                let stress = dense::dot(&moduli.rate[i], &in_frame.0) + hoop_force;
                for k in 0..D {
                    let turn = |of: &dyn Fn(&Rows<D>) -> ([f64; D], f64)| {
                        let ((g_a, h_a), (g_b, h_b)) = (of(&of_a), of(&of_b));
                        g_b[i] * g_a[k] + if i == 0 && k == 0 { h_a * h_b } else { 0.0 }
                    };
                    let turned = turn(&|rows| rows.own) - turn(&|rows| rows.common);
                    block[((a * D + i) * count + b) * D + k] += volume
                        * (stress * of_b.swelling[k]
                            + of_a.swelling[i] * change[k]
                            + pressure * turned);
                }
            }
        }
    }
}

/// A ring's force and dense block, entry (a, i, b, k), by B = (g_0, g_1, s): dF = Σ_b B_b u_b with the hoop
/// as a third direction along which only u_0 counts.
fn ring<const D: usize>(
    step: StepPoints<'_, D>,
    frame: Frame,
    p: usize,
    nodes: &[u32],
    displacement: &[f64],
    force: &mut [f64],
    health: &mut Health,
) -> Option<Vec<f64>> {
    let row = step.influences.row(p);
    let nodal =
        |a: usize| -> [f64; D] { std::array::from_fn(|i| displacement[nodes[a] as usize * D + i]) };
    let increment = |gradients: &[[f64; D]], hoops: &[f64]| {
        (displacement_gradient(gradients, nodal), hoop_increment(hoops, nodal))
    };
    let (gradients, hoops) =
        (&step.influences.gradients[row.clone()], &step.influences.hoop[row.clone()]);
    let (block, hoop) = increment(gradients, hoops);
    let centres = step.influences.centre_gradients.get(row.clone());
    let centre_hoops = step.influences.centre_hoop.get(row).unwrap_or_default();
    let middle = centres.map(|centres| increment(centres, centre_hoops));
    let own = Increment { block: &block, hoop };
    let middle = middle.as_ref().map(|(block, hoop)| Increment { block, hoop: *hoop });
    let (made, ring) = respond_ring(step, frame, p, own, middle, health)?;
    let mapped = |a: usize, j: usize| -> f64 {
        (0..D).map(|i| gradients[a][i] * made.gradient_map[i][j]).sum()
    };
    let (count, volume) = (nodes.len(), made.volume);
    let mut block = vec![0.0; (count * D) * (count * D)];
    for a in 0..count {
        let s_a = hoops[a] * ring.map;
        force[nodes[a] as usize * D] += ring.stress * s_a * volume;
        for i in 0..D {
            for j in 0..D {
                force[nodes[a] as usize * D + i] += made.stress[i][j] * mapped(a, j) * volume;
            }
            for b in 0..count {
                let s_b = hoops[b] * ring.map;
                for k in 0..D {
                    let mut sum = 0.0;
                    for j in 0..D {
                        for l in 0..D {
                            sum += mapped(a, j) * made.tangent[i][j][k][l] * mapped(b, l);
                        }
                        if k == 0 {
                            sum += mapped(a, j) * ring.from[i][j] * s_b;
                        }
                        if i == 0 {
                            sum += s_a * ring.onto[k][j] * mapped(b, j);
                        }
                    }
                    if i == 0 && k == 0 {
                        sum += s_a * ring.own * s_b;
                    }
                    block[((a * D + i) * count + b) * D + k] += sum * volume;
                }
            }
        }
    }
    if let (Some(dilation), Some(centres)) = (&ring.dilation, centres) {
        let frame = |a: usize| (std::array::from_fn(|j| mapped(a, j)), hoops[a] * ring.map);
        let rows =
            |a: usize| dilation.rows((&gradients[a], hoops[a]), (&centres[a], centre_hoops[a]));
        dilate(dilation, volume, (nodes, frame, rows), force, &mut block);
    }
    Some(block)
}
