//! What acts on elements of bodies' surfaces ([`crate::surface`]), at the current state of an
//! iteration: tractions, pressures, and penalties that hold.
//!
//! With the weights w_a = S_a + ∇S_a·(x_s - x_p) of the step's start an element moves to
//! x_s + Σ w_a u_a, and a force f on it gives w_a f to the nodes. The tangent of -f is
//!
//! | | f | K_aibk |
//! |---|---|---|
//! | traction | t A0 | 0 |
//! | pressure | -p a, a = det dF dF^-T a_start | w_a [a_i q_k w_b + p (a_i g_bk - g_bi a_k)], q = ∇p, g = ∇S dF^-1 |
//! | pressure on a ring | as before, a times r_s / r_start | as before, and w_a p a_i δ_k0 w_b / r_s |
//! | penalty | -β A0 P (x_s - X_s - ū) | β A0 P_ik w_a w_b |
//! | Nitsche, besides | P T a | -w_a P_im d(T a)_m/du_bk |
//!
//! For `gimp`, whose stress is integrated over its domains exactly, what is spread over a surface goes to
//! the nodes by the grid's own functions at the element instead, where the carrier reaches their nodes.

use crate::basis::Domain;
use crate::deck::When;
use crate::deck::expression::Expression;
use crate::grid::Grid;
use crate::loads::pressure::{Pressure, PressureAt};
use crate::loads::{Moment, OnSurface, shares_of_bodies};
use crate::surface::{Carried, Element, norm};
use crate::system::carried::{area_of, carried_area, grid_weights, place_of};
use crate::system::holds;
use crate::system::model::Model;
use crate::system::pattern::Pattern;
use crate::system::scatter::BlockRows;
use crate::system::supports::Support;
use crate::tensor::dense;

use super::block::add_block;
use super::own_traction;
use super::term::{At, Part};
use crate::mechanics::displacement_gradient;
use crate::system::step_points::StepPoints;

/// Everything that acts on surfaces at one moment, as this rank's points carry it.
pub struct SurfaceTerm<'a, const D: usize> {
    acts: Vec<Act<'a, D>>,
    /// How many acts come first because their groups touch nodes of other ranks.
    reaching: usize,
    weights: Vec<f64>,
}

/// One action on one element.
struct Act<'a, const D: usize> {
    point: usize,
    group: usize,
    /// First of its weights.
    weights: usize,
    /// x_s at the step's start, m.
    place: [f64; D],
    /// J F^-T A then, m2.
    area: [f64; D],
    element: &'a Element<D>,
    kind: Kind<'a, D>,
    at: Moment,
}

#[derive(Clone, Copy)]
enum Kind<'a, const D: usize> {
    Traction(&'a [Expression]),
    Pressure(&'a Pressure),
    /// With β, Pa/m, and where it is held.
    Held(&'a Support<D>, f64, Element<D>),
}

/// What a support bears, this rank's share: force, sum of magnitudes, torque about z through the
/// origin, and volume of the points that carry it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Borne {
    /// N
    pub force: [f64; 3],
    /// Sum of the magnitudes, N.
    pub sum_abs: f64,
    /// N m
    pub torque: f64,
    /// m3
    pub held: f64,
}

impl Borne {
    /// (1 - share) of this and `share` of another.
    pub fn mixed(&self, other: &Borne, share: f64) -> Borne {
        let mix = |a: f64, b: f64| (1.0 - share) * a + share * b;
        Borne {
            force: std::array::from_fn(|i| mix(self.force[i], other.force[i])),
            sum_abs: mix(self.sum_abs, other.sum_abs),
            torque: mix(self.torque, other.torque),
            held: self.held,
        }
    }
}

impl<'a, const D: usize> SurfaceTerm<'a, D> {
    /// `None` where nothing of the deck acts on a surface. `carriers`: this rank's points that carry
    /// elements ([`crate::system::carried::carriers`]).
    pub fn new(
        model: &'a Model<D>,
        step: StepPoints<'_, D>,
        carriers: &[usize],
        when: When,
    ) -> Option<Self> {
        if !model.acts_on_surfaces() {
            return None;
        }
        let deck = &model.deck;
        let points = step.points;
        let mut term = SurfaceTerm { acts: Vec::new(), reaching: 0, weights: Vec::new() };
        let loads = model.loads.iter().zip(&deck.load_presence).filter_map(|(load, &presence)| {
            let load = load.on_surface().filter(|_| presence.is_in(when.stage))?;
            let at = Moment::new(deck.analysis.kind, presence, when);
            Some((load, at, shares_of_bodies(deck, presence, when)))
        });
        let loads: Vec<_> = loads.collect();
        let supports = model.supports.iter();
        let supports: Vec<_> =
            supports.map(|support| (support, holds::first_word(model, points, support))).collect();
        for &p in carriers {
            let id = points.id[p];
            for (load, at, shares) in &loads {
                let mut at = *at;
                let body = points.body[p] as usize;
                at.share *= shares.as_ref().map_or(1.0, |shares| shares[body]);
                let (surface, kind) = match *load {
                    OnSurface::Traction { surface, value } => (surface, Kind::Traction(value)),
                    OnSurface::Pressure { surface, pressure } => {
                        (surface, Kind::Pressure(pressure))
                    }
                };
                for own in surface.carried_by(id) {
                    term.push(step, p, own, (kind, at));
                    if model.deck.method.basis.domain() == Domain::Box
                        && step.influences.hoop.is_empty()
                    {
                        term.weigh_by_grid(&model.grid, step);
                    }
                }
            }
            for &(support, first) in &supports {
                let presence = deck.boundaries[support.boundary].presence;
                if !presence.holds_in(when.stage) {
                    continue;
                }
                let at = Moment::new(deck.analysis.kind, presence, when);
                let stiffness = support.penalty * model.stiffness[points.body[p] as usize];
                for (element, own) in support.surface.carried_by(id).iter().enumerate() {
                    let place = place_of(points, p, own);
                    if support.within.as_ref().is_none_or(|sheet| sheet.holds(&place)) {
                        let held = holds::held(points, p, own, (first, element));
                        term.push(step, p, own, (Kind::Held(support, stiffness, held), at));
                    }
                }
            }
        }
        let mut reaches = vec![false; step.groups.len()];
        step.border.reaching.iter().cloned().flatten().for_each(|group| reaches[group] = true);
        term.acts.sort_by_key(|act| (!reaches[act.group], act.group));
        term.reaching = term.acts.partition_point(|act| reaches[act.group]);
        Some(term)
    }

    fn push(
        &mut self,
        step: StepPoints<'_, D>,
        point: usize,
        own: &'a Carried<D>,
        (kind, at): (Kind<'a, D>, Moment),
    ) {
        let points = step.points;
        let place = place_of(points, point, own);
        let offset: [f64; D] = std::array::from_fn(|i| place[i] - points.position[point][i]);
        let first = self.weights.len();
        let row = step.influences.row(point);
        let of_node = |(s, g): (&f64, &[f64; D])| s + dense::dot(g, &offset);
        let gradients = &step.influences.gradients[row.clone()];
        match step.influences.hoop.get(row.clone()) {
            None => {
                let weights = step.influences.weights[row].iter();
                self.weights.extend(weights.zip(gradients).map(of_node));
            }
            // The place of a ring follows the mean that is not weighted by the radius.
            Some(rows) => {
                let whole: f64 = rows.iter().sum();
                let weights: Vec<f64> = rows.iter().map(|row| row / whole).collect();
                self.weights.extend(weights.iter().zip(gradients).map(of_node));
            }
        }
        let area = area_of(points, point, own, &place, !step.influences.hoop.is_empty());
        self.acts.push(Act {
            point,
            group: step.groups.group_of_point[point],
            weights: first,
            place,
            area,
            element: &own.element,
            kind,
            at,
        });
    }

    /// Gives the last action the weights N_a(x_s) of the grid, if its carrier reaches all of their nodes.
    fn weigh_by_grid(&mut self, grid: &Grid<D>, step: StepPoints<'_, D>) {
        let Some(act) = self.acts.last() else { return };
        let nodes = &step.influences.nodes[step.influences.row(act.point)];
        if let Some(weights) = grid_weights(grid, &act.place, nodes) {
            self.weights[act.weights..].copy_from_slice(&weights);
        }
    }

    /// Adds this rank's shares of the force at an iterate, N, and the tangent of its negative where
    /// there are `rows`.
    pub fn add_shares<R: BlockRows<D>>(
        &self,
        step: StepPoints<'_, D>,
        part: Part,
        at: At<'_>,
        force: &mut [f64],
        mut rows: Option<&mut R>,
    ) {
        let acts = match part {
            Part::Reaching => &self.acts[..self.reaching],
            Part::Inner => &self.acts[self.reaching..],
        };
        let mut block = Vec::new();
        for acts in acts.chunk_by(|a, b| a.group == b.group) {
            let group = acts[0].group;
            let nodes = step.nodes_of_group(group);
            block.clear();
            if rows.is_some() {
                block.resize(nodes.len() * nodes.len() * D * D, 0.0);
            }
            for act in acts {
                let f = self.push_on(act, step, nodes, at.displacement, &mut block);
                for (&node, weight) in nodes.iter().zip(self.weights_of(act, nodes)) {
                    for i in 0..D {
                        force[node as usize * D + i] += weight * f[i];
                    }
                }
            }
            if let Some(rows) = rows.as_deref_mut() {
                add_block(at.pattern, group, nodes, &block, rows);
            }
        }
    }

    /// This rank's share of the force at `nodes` local nodes at the step's start, N.
    pub fn at_start(&self, step: StepPoints<'_, D>, pattern: &Pattern, nodes: usize) -> Vec<f64> {
        let (displacement, mut force) = (vec![0.0; nodes * D], vec![0.0; nodes * D]);
        let at = At { pattern, displacement: &displacement };
        for part in [Part::Reaching, Part::Inner] {
            let none: Option<&mut crate::system::scatter::BlockMatrix<D>> = None;
            self.add_shares(step, part, at, &mut force, none);
        }
        force
    }

    /// What each of the deck's `boundaries` that are supports bears at an iterate, this rank's share.
    pub fn borne(
        &self,
        step: StepPoints<'_, D>,
        displacement: &[f64],
        boundaries: usize,
    ) -> Vec<Borne> {
        let mut borne = vec![Borne::default(); boundaries];
        let mut last = vec![usize::MAX; boundaries];
        for act in &self.acts {
            let Kind::Held(support, ..) = act.kind else { continue };
            let nodes = step.nodes_of_group(act.group);
            let f = self.push_on(act, step, nodes, displacement, &mut []);
            let x = self.moved(act.place, act, nodes, displacement);
            let sum = &mut borne[support.boundary];
            sum.force.iter_mut().zip(f).for_each(|(sum, f)| *sum += f);
            sum.sum_abs += norm(&f);
            sum.torque += x[0] * f[1] - x[1] * f[0];
            if std::mem::replace(&mut last[support.boundary], act.point) != act.point {
                sum.held += step.points.volume(act.point);
            }
        }
        borne
    }

    /// Adds the stiffness by which supports hold local nodes, this rank's share, N/m.
    pub fn add_penalties(&self, step: StepPoints<'_, D>, stiffness: &mut [f64]) {
        for act in &self.acts {
            let Kind::Held(_, penalty, held) = act.kind else { continue };
            let nodes = step.nodes_of_group(act.group);
            let of_area = penalty * norm(&held.area);
            for (&node, w) in nodes.iter().zip(self.weights_of(act, nodes)) {
                stiffness[node as usize] += of_area * w * w;
            }
        }
    }

    fn weights_of(&self, act: &Act<'_, D>, nodes: &[u32]) -> &[f64] {
        &self.weights[act.weights..act.weights + nodes.len()]
    }

    /// `from` + Σ w_a u_a
    fn moved(
        &self,
        from: [f64; D],
        act: &Act<'_, D>,
        nodes: &[u32],
        displacement: &[f64],
    ) -> [f64; D] {
        let mut x = from;
        for (&node, weight) in nodes.iter().zip(self.weights_of(act, nodes)) {
            for (i, x) in x.iter_mut().enumerate() {
                *x += weight * displacement[node as usize * D + i];
            }
        }
        x
    }

    /// The force of an action at an iterate, N; its tangent is added to `block` unless that is empty.
    fn push_on(
        &self,
        act: &Act<'_, D>,
        step: StepPoints<'_, D>,
        nodes: &[u32],
        displacement: &[f64],
        block: &mut [f64],
    ) -> [f64; D] {
        let weights = self.weights_of(act, nodes);
        match act.kind {
            Kind::Traction(value) => {
                let traction: [f64; D] = act.at.values(value, &self.scope(act, &act.place));
                let area = norm(&act.element.area);
                traction.map(|t| t * area)
            }
            Kind::Held(support, stiffness, held) => {
                // Apart from the place, in which small increments would lose their digits.
                let target = support.target(act.element, &held, act.at);
                let start = std::array::from_fn(|i| act.place[i] - target[i]);
                let gap = self.moved(start, act, nodes, displacement);
                let scale = stiffness * norm(&held.area);
                let stiff = support.projection(&held).map(|row| row.map(|p| scale * p));
                if !block.is_empty() {
                    let rows = weights.iter().map(|w| stiff.map(|row| row.map(|k| w * k)));
                    add_products::<D, _>(block, nodes.len(), rows, |b, of_a, i| {
                        of_a[i].map(|k| k * weights[b])
                    });
                }
                let mut f = dense::apply(&stiff, &gap).map(|f| -f);
                if support.nitsche {
                    let wanted = !block.is_empty();
                    let (traction, slopes) = own_traction::on_area(
                        step,
                        act.point,
                        &act.area,
                        nodes,
                        displacement,
                        wanted,
                    );
                    let held = support.projection(&held);
                    let supplied = dense::apply(&held, &traction);
                    f.iter_mut().zip(supplied).for_each(|(f, t)| *f += t);
                    if wanted {
                        let slopes: Vec<_> =
                            slopes.iter().map(|slope| dense::multiply(&held, slope)).collect();
                        let weights = weights.iter().copied();
                        add_products::<D, _>(block, nodes.len(), weights, |b, w, i| {
                            slopes[b][i].map(|slope| -w * slope)
                        });
                    }
                }
                f
            }
            Kind::Pressure(pressure) => {
                let x = self.moved(act.place, act, nodes, displacement);
                let mut found = PressureAt::<D>::default();
                pressure.add_at(&x, &[0.0; D], (act.at, 1.0), &mut found);
                let gradients = &step.influences.gradients[step.influences.row(act.point)];
                let increment = displacement_gradient(gradients, |a| {
                    let first = nodes[a] as usize * D;
                    std::array::from_fn(|i| displacement[first + i])
                });
                let change = dense::plus_unit(&increment);
                let rings = !step.influences.hoop.is_empty();
                let turned = if rings { x[0] / act.place[0] } else { 1.0 };
                let area = carried_area(&change, &act.area).map(|a| a * turned);
                if !block.is_empty() {
                    let (inverse, _) = dense::inverse(&change);
                    let current: Vec<[f64; D]> = gradients
                        .iter()
                        .map(|g| {
                            std::array::from_fn(|i| (0..D).map(|j| g[j] * inverse[j][i]).sum())
                        })
                        .collect();
                    let (p, slope) = (found.value, found.first);
                    add_products::<D, _>(block, nodes.len(), weights.iter().copied(), |b, w, i| {
                        std::array::from_fn(|k| {
                            let turned = area[i] * current[b][k] - current[b][i] * area[k];
                            let mut sum = area[i] * slope[k] * weights[b] + p * turned;
                            if rings && k == 0 {
                                sum += p * area[i] * weights[b] / x[0];
                            }
                            w * sum
                        })
                    });
                }
                area.map(|a| -found.value * a)
            }
        }
    }

    fn scope(&self, act: &Act<'_, D>, place: &[f64; D]) -> crate::deck::Scope {
        let mut scope = act.at.scope();
        scope.initial[..D].copy_from_slice(&act.element.place);
        scope.current[..D].copy_from_slice(place);
        scope
    }
}

/// Adds to a dense block of `count` nodes: entries (a, i, b, ·) are `entry(b, row of a, i)`.
fn add_products<const D: usize, T>(
    block: &mut [f64],
    count: usize,
    rows: impl Iterator<Item = T>,
    entry: impl Fn(usize, &T, usize) -> [f64; D],
) {
    for (a, of_a) in rows.enumerate() {
        for i in 0..D {
            let line = &mut block[(a * D + i) * count * D..(a * D + i + 1) * count * D];
            for (b, target) in line.chunks_exact_mut(D).enumerate() {
                let values = entry(b, &of_a, i);
                target.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            }
        }
    }
}
