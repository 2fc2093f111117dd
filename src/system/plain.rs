//! f_ai = Σ_p T_ij g_aj V and K_aibk = Σ_p g_aj A_ijkl g_bl V (Lagrangian eq. 20-23, 27, 28), one
//! point after the other as the formulas read: what [`crate::system::terms::stress::assemble`] is compared
//! with.

use crate::basis::Influences;
use crate::deck::model::Frame;
use crate::mechanics::dilation::{self, Dilation};
use crate::mechanics::{Increment, displacement_gradient, hoop_increment};
use crate::tensor::dense;

use super::numbering::Numbering;
use super::pattern::Pattern;
use super::scatter::BlockMatrix;
use super::step_points::StepPoints;
use super::terms::point_response::{respond, respond_averaged, respond_ring};
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
        if !step.influences.hoop.is_empty() {
            let block = ring(step, frame, p, nodes, displacement, force, &mut health);
            if let Some(block) = block {
                stiffness.add(numbering, pattern, nodes, &block);
            }
            continue;
        }
        let cells = cells(step.influences, p, nodal);
        let made = if cells.is_empty() {
            respond(step, frame, p, &increment, &mut health).map(|made| (made, None))
        } else {
            respond_averaged(step, frame, p, &increment, change_of(&cells), &mut health)
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
            let own = |a: usize| dilation.own((&gradients[a], 0.0));
            dilate(dilation, made.volume, (nodes, frame, own, &cells), force, &mut block);
        }
        stiffness.add(numbering, pattern, nodes, &block);
    }
    health
}

/// A cell of a point in the current state.
struct Cell<const D: usize> {
    /// w_c
    share: f64,
    /// det dF_c, with the hoop's
    growth: f64,
    /// g_c of each node of the point's row, and the hoop's; zero away from the cell
    rows: Vec<([f64; D], f64)>,
}

/// The cells of point `p`; none without F-bar.
fn cells<const D: usize>(
    influences: &Influences<D>,
    p: usize,
    nodal: impl Fn(usize) -> [f64; D],
) -> Vec<Cell<D>> {
    let row = influences.row(p);
    let Some(means) = influences.centre_gradients.get(row.clone()) else { return Vec::new() };
    let hoops = influences.centre_hoop.get(row.clone()).unwrap_or_default();
    let of_rows = |share: f64, gradients: &[[f64; D]], hoops: &[f64]| {
        let block = displacement_gradient(gradients, &nodal);
        let hoop = hoop_increment(hoops, &nodal);
        let back = dilation::inverse(Increment { block: &block, hoop });
        let growth = dense::determinant(&dense::plus_unit(&block)) * (1.0 + hoop);
        let now = |a: usize| {
            dilation::mapped((&gradients[a], hoops.get(a).copied().unwrap_or(0.0)), &back)
        };
        Cell { share, growth, rows: (0..gradients.len()).map(now).collect() }
    };
    let parts = influences.parts.of(p);
    if parts.is_empty() {
        return vec![of_rows(1.0, means, hoops)];
    }
    let of_part = |part: &crate::basis::CellPart<D>| {
        let (mut gradients, mut hoops) = (vec![[0.0; D]; row.len()], vec![0.0; row.len()]);
        for (place, gradient, hoop) in part.nodes() {
            (gradients[place], hoops[place]) = (*gradient, hoop);
        }
        of_rows(part.share, &gradients, &hoops)
    };
    parts.iter().map(of_part).collect()
}

/// det dF_0 - 1
fn change_of<const D: usize>(cells: &[Cell<D>]) -> f64 {
    cells.iter().map(|cell| cell.share * cell.growth).sum::<f64>() - 1.0
}

/// What F-bar adds to force and block ([`mechanics::dilation`](crate::mechanics::dilation)), term by term.
fn dilate<const D: usize>(
    dilation: &Dilation<D>,
    volume: f64,
    (nodes, frame, own, cells): (
        &[u32],
        impl Fn(usize) -> ([f64; D], f64),
        impl Fn(usize) -> ([f64; D], f64),
        &[Cell<D>],
    ),
    force: &mut [f64],
    block: &mut [f64],
) {
    let (moduli, count) = (&dilation.moduli, nodes.len());
    let pressure = moduli.trace * dilation.share;
    let whole = 1.0 + change_of(cells);
    let share = |cell: &Cell<D>| cell.share * cell.growth / whole;
    let common = |a: usize| {
        let mut common = ([0.0; D], 0.0);
        for cell in cells {
            for j in 0..D {
                common.0[j] += share(cell) * cell.rows[a].0[j];
            }
            common.1 += share(cell) * cell.rows[a].1;
        }
        common
    };
    let swelling = |a: usize| dilation.swelling(&own(a), &common(a));
    let along = |(g, h): ([f64; D], f64), i: usize| if i == 0 { g[0] + h } else { g[i] };
    for a in 0..count {
        let (in_frame, of_a) = (frame(a), swelling(a));
        for i in 0..D {
            force[nodes[a] as usize * D + i] += volume * moduli.trace * of_a[i];
        }
        for b in 0..count {
            let (frame_b, of_b) = (frame(b), swelling(b));
            let change = dilation.change_of_trace((&frame_b.0, frame_b.1), &of_b);
            for i in 0..D {
                let hoop_force = if i == 0 { in_frame.1 * moduli.hoop_rate } else { 0.0 };
                let stress = dense::dot(&moduli.rate[i], &in_frame.0) + hoop_force;
                for k in 0..D {
                    let turn = |(g_a, h_a): ([f64; D], f64), (g_b, h_b): ([f64; D], f64)| {
                        g_b[i] * g_a[k] + if i == 0 && k == 0 { h_a * h_b } else { 0.0 }
                    };
                    let both = |a, b| along(a, i) * along(b, k);
                    let second: f64 = cells
                        .iter()
                        .map(|cell| (cell, cell.rows[a], cell.rows[b]))
                        .map(|(cell, a, b)| share(cell) * (both(a, b) - turn(a, b)))
                        .sum();
                    let turned = turn(own(a), own(b)) + second - both(common(a), common(b));
                    block[((a * D + i) * count + b) * D + k] +=
                        volume * (stress * of_b[k] + of_a[i] * change[k] + pressure * turned);
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
    let (gradients, hoops) = (&step.influences.gradients[row.clone()], &step.influences.hoop[row]);
    let block = displacement_gradient(gradients, nodal);
    let cells = cells(step.influences, p, nodal);
    let common = (!cells.is_empty()).then(|| change_of(&cells));
    let own = Increment { block: &block, hoop: hoop_increment(hoops, nodal) };
    let (made, ring) = respond_ring(step, frame, p, own, common, health)?;
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
    if let Some(dilation) = &ring.dilation {
        let frame = |a: usize| (std::array::from_fn(|j| mapped(a, j)), hoops[a] * ring.map);
        let own = |a: usize| dilation.own((&gradients[a], hoops[a]));
        dilate(dilation, volume, (nodes, frame, own, &cells), force, &mut block);
    }
    Some(block)
}
