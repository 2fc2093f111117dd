//! f_I = -Σ_p V (p ∇S_I + S_I ∇p): pressures on the bodies' surfaces by virtual stress
//! ([`crate::loads::pressure`]), at the current state of an iteration.
//!
//! With g = ∇S at the current state, V = J V0, q = ∇p and H = ∇∇p at the current place x + S u,
//! the tangent of -f is
//! K_aibk = V [p (g_ai g_bk - g_ak g_bi) + g_ai q_k S_b + S_a q_i g_bk + S_a H_ik S_b].
//! Rings have the hoop row s in the trace, f_a0 -= V p s_a, and J their hoop: with θ_ai = g_ai + s_a δ_i0 it is
//! K_aibk = V [p (θ_ai θ_bk - g_ak g_bi - s_a s_b δ_i0 δ_k0) + θ_ai q_k S_b + S_a q_i θ_bk + S_a H_ik S_b].
//! It equals its transposed: -f is the gradient of Σ V p. All state is that of the iterate, so that
//! the frame in which stresses are written does not matter.

use crate::deck::When;
use crate::loads::pressure::{Pressure, PressureAt};
use crate::loads::{Moment, shares_of_bodies};
use crate::system::model::Model;
use crate::system::pattern::Pattern;
use crate::system::scatter::{BlockMatrix, BlockRows};
use crate::tensor::dense;

use super::block::add_block;
use super::point_response::start_volume;
use super::term::{At, Part};
use crate::mechanics::{displacement_gradient, hoop_increment};
use crate::system::step_points::StepPoints;

/// The pressures of a deck at one moment.
pub struct PressureTerm<'a> {
    pressures: Vec<Pressing<'a>>,
}

/// A pressure as it is at the moment.
struct Pressing<'a> {
    pressure: &'a Pressure,
    at: Moment,
    /// What each body takes of it; `None`: all.
    shares: Option<Vec<f64>>,
}

impl<'a> PressureTerm<'a> {
    /// `None` where no pressure acts.
    pub fn new<const D: usize>(model: &'a Model<D>, when: When) -> Option<Self> {
        let deck = &model.deck;
        let loads = model.loads.iter().zip(&deck.load_presence);
        let pressing = loads.filter_map(|(load, &presence)| {
            let pressure = load.pressure().filter(|_| presence.is_in(when.stage))?;
            let at = Moment::new(deck.analysis.kind, presence, when);
            Some(Pressing { pressure, at, shares: shares_of_bodies(deck, presence, when) })
        });
        let pressures: Vec<_> = pressing.collect();
        (!pressures.is_empty()).then_some(PressureTerm { pressures })
    }

    /// Adds this rank's shares of the force at an iterate, and the tangent of its negative where there
    /// are `rows`.
    pub fn add_shares<const D: usize, R: BlockRows<D>>(
        &self,
        step: StepPoints<'_, D>,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        mut rows: Option<&mut R>,
    ) {
        let mut block = Vec::new();
        for group in step.groups_of(part) {
            let nodes = step.nodes_of_group(group);
            block.clear();
            if rows.is_some() {
                block.resize(nodes.len() * nodes.len() * D * D, 0.0);
            }
            let mut acts = false;
            for &p in step.groups.points(group) {
                acts |= self.add_point(step, p, nodes, at.displacement, force, &mut block);
            }
            if let Some(rows) = rows.as_deref_mut().filter(|_| acts) {
                add_block(at.pattern, group, nodes, &block, rows);
            }
        }
    }

    /// False if nothing acts on the point.
    fn add_point<const D: usize>(
        &self,
        step: StepPoints<'_, D>,
        p: usize,
        nodes: &[u32],
        displacement: &[f64],
        force: &mut [f64],
        block: &mut [f64],
    ) -> bool {
        let points = step.points;
        let row = step.influences.row(p);
        let weights = &step.influences.weights[row.clone()];
        let moved = |a: usize| -> [f64; D] {
            std::array::from_fn(|i| displacement[nodes[a] as usize * D + i])
        };
        let mut x = points.position[p];
        for (a, weight) in weights.iter().enumerate() {
            let u = moved(a);
            for i in 0..D {
                x[i] += weight * u[i];
            }
        }
        let mut found = PressureAt::<D>::default();
        for Pressing { pressure, at, shares } in &self.pressures {
            let body = shares.as_ref().map_or(1.0, |shares| shares[points.body[p] as usize]);
            pressure.add_at(&x, &points.half_length[p], (*at, body), &mut found);
        }
        if found.is_zero() {
            return false;
        }
        let increment = displacement_gradient(&step.influences.gradients[row.clone()], moved);
        let (inverse, determinant) = dense::inverse(&dense::plus_unit(&increment));
        let gradients: Vec<[f64; D]> = step.influences.gradients[row.clone()]
            .iter()
            .map(|g| std::array::from_fn(|i| (0..D).map(|j| g[j] * inverse[j][i]).sum()))
            .collect();
        let rows = step.influences.hoop.get(row).unwrap_or_default();
        let turned = 1.0 + hoop_increment(rows, moved);
        // Rows of the trace: the gradients, and those of rings with the hoop.
        let mut traces = gradients.clone();
        traces.iter_mut().zip(rows).for_each(|(trace, hoop)| trace[0] += hoop / turned);
        let volume = determinant
            * turned
            * points.deformation_gradient[p].determinant()
            * start_volume(step, p);
        let (value, slope) = (volume * found.value, found.first.map(|q| volume * q));
        for (a, (weight, trace)) in weights.iter().zip(&traces).enumerate() {
            for i in 0..D {
                force[nodes[a] as usize * D + i] -= value * trace[i] + weight * slope[i];
            }
        }
        if block.is_empty() {
            return true;
        }
        let curvature = found.second.map(|line| line.map(|h| volume * h));
        let count = nodes.len();
        for (a, (of_a, g)) in weights.iter().zip(&gradients).enumerate() {
            for i in 0..D {
                let line = &mut block[(a * D + i) * count * D..(a * D + i + 1) * count * D];
                for (b, (of_b, h)) in weights.iter().zip(&gradients).enumerate() {
                    let (t, u) = (&traces[a], &traces[b]);
                    for k in 0..D {
                        line[b * D + k] += value * (t[i] * u[k] - g[k] * h[i])
                            + t[i] * slope[k] * of_b
                            + of_a * slope[i] * u[k]
                            + of_a * curvature[i][k] * of_b;
                    }
                    if i == 0 {
                        line[b * D] -= value * (t[0] - g[0]) * (u[0] - h[0]);
                    }
                }
            }
        }
        true
    }

    /// This rank's share of the force at the local nodes at the step's start, N.
    pub fn at_start<const D: usize>(
        &self,
        step: StepPoints<'_, D>,
        pattern: &Pattern,
        nodes: usize,
    ) -> Vec<f64> {
        let (still, mut force) = (vec![0.0; nodes * D], vec![0.0; nodes * D]);
        for part in [Part::Reaching, Part::Inner] {
            let at = At { pattern, displacement: &still };
            self.add_shares(step, part, at, &mut force, None::<&mut BlockMatrix<D>>);
        }
        force
    }
}
