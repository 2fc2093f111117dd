//! `body.initial_stress`: b_e = exp(2 D^-1 tau) with F = 1, tau = sigma (formulations.md B.7). The
//! place at the start is the reference, so that Cauchy and Kirchhoff stress are equal.

use nalgebra::Matrix3;

use crate::deck::model::{InitialStress, K0, Water};
use crate::deck::{Deck, Scope, figure};
use crate::error::Result;
use crate::loads::scope_of;
use crate::material::{Material, local};
use crate::parallel::World;
use crate::points::Points;
use crate::tensor::Spectrum;

/// A stress is outside the yield surface if the return takes more than this share of it.
const OUTSIDE: f64 = 1e-9;

/// Gives the points of bodies with `initial_stress` that stress and the elastic strain of it. Error,
/// the same on all ranks, with the first point where there is none. Collective.
pub fn set<const D: usize>(
    world: &World,
    deck: &Deck,
    materials: &[Material],
    points: &mut Points<D>,
) -> Result<()> {
    let mut fault: Option<(u64, String)> = None;
    for p in 0..points.len() {
        let body = points.body[p] as usize;
        let Some(initial) = &deck.bodies[body].initial_stress else { continue };
        let stress = stress_at(initial, &scope_of(points, p, 0.0, 0.0), deck.water());
        let spectrum = spectrum::<D>(&stress);
        let strain = local(materials, points, p).model().elastic_strain(spectrum.values);
        if strain.iter().all(|e| e.is_finite()) {
            points.kirchhoff_stress[p] = stress;
            points.elastic_excess[p] = spectrum.compose(strain.map(|e| (2.0 * e).exp_m1()));
        } else if fault.as_ref().is_none_or(|(id, _)| points.id[p] < *id) {
            let why = match stress.iter().all(|s| s.is_finite()) {
                true => "no elastic strain of the material gives it: check its parameters",
                false => "an expression has no finite value there",
            };
            fault = Some((points.id[p], message_at(deck, points, p, &stress, why)));
        }
    }
    world.refuse_lowest(fault)
}

/// An error, the same on all ranks, where the initial stress of a point lies outside the yield
/// surface. The points have the state of their materials. Collective.
pub fn require_elastic<const D: usize>(
    world: &World,
    deck: &Deck,
    materials: &[Material],
    points: &Points<D>,
) -> Result<()> {
    let (mut fault, mut count): (Option<(u64, usize)>, usize) = (None, 0);
    for p in 0..points.len() {
        let body = points.body[p];
        if deck.bodies[body as usize].initial_stress.is_none() {
            continue;
        }
        let Spectrum { values, .. } = spectrum::<D>(&points.kirchhoff_stress[p]);
        let model = local(materials, points, p).model();
        let returned = model.respond(model.elastic_strain(values), points.state.of(p, body)).stress;
        let size = |v: [f64; 3]| v.iter().map(|s| s * s).sum::<f64>().sqrt();
        let off = size(std::array::from_fn(|a| returned[a] - values[a]));
        if off > OUTSIDE * size(values) {
            count += 1;
            if fault.is_none_or(|(id, _)| points.id[p] < id) {
                fault = Some((points.id[p], p));
            }
        }
    }
    let count = world.sum_usize(count);
    let message = fault.map(|(id, p)| {
        let stress = points.kirchhoff_stress[p];
        let others = match count {
            1 => String::new(),
            more => format!(", as are {} others", more - 1),
        };
        let why = format!(
            "it is outside the yield surface of the material{others}: give a stress that the strength \
             can hold (K0 nearer to one, or between the active and the passive limit), or more \
             strength"
        );
        (id, message_at(deck, points, p, &stress, &why))
    });
    world.refuse_lowest(message)
}

/// A message about the initial stress of a point, with its place.
fn message_at<const D: usize>(
    deck: &Deck,
    points: &Points<D>,
    p: usize,
    stress: &Matrix3<f64>,
    why: &str,
) -> String {
    let body = points.body[p] as usize;
    let message = format!(
        "at point {} of body \"{}\", X = {:?} m, the stress is xx = {}, yy = {}, zz = {}, xy = {} Pa: {why}",
        points.id[p],
        deck.bodies[body].name,
        points.position_initial[p],
        figure(stress[(0, 0)]),
        figure(stress[(1, 1)]),
        figure(stress[(2, 2)]),
        figure(stress[(0, 1)]),
    );
    deck.origins.message(&format!("body.{body}.initial_stress"), &message)
}

/// In the plane the third axis is z.
fn spectrum<const D: usize>(stress: &Matrix3<f64>) -> Spectrum {
    match D {
        2 => Spectrum::plane(stress[(0, 0)], stress[(1, 1)], stress[(0, 1)], stress[(2, 2)]),
        _ => Spectrum::of(stress),
    }
}

/// With water the stress is the effective one.
fn stress_at(initial: &InitialStress, scope: &Scope, water: Option<Water>) -> Matrix3<f64> {
    match initial {
        InitialStress::Components(all) => {
            let [xx, yy, zz, xy, yz, xz] = all.each_ref().map(|e| e.value(scope));
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        }
        InitialStress::K0(k0) => {
            let K0 { unit_weight, surface, k0, surcharge, axis } = &**k0;
            let surface = surface.value(scope);
            let depth = (surface - scope.initial[*axis]).max(0.0);
            let mut top = scope.initial;
            top[*axis] = surface;
            let pore = |x: &[f64]| water.map_or(0.0, |water| water.pressure(x));
            let above = surcharge.as_ref().map_or_else(|| pore(&top), |given| given.value(scope));
            let vertical = pore(&scope.initial) - (unit_weight.value(scope) * depth + above);
            let horizontal = k0.value(scope) * vertical;
            let mut stress = Matrix3::from_diagonal_element(horizontal);
            stress[(*axis, *axis)] = vertical;
            stress
        }
    }
}
