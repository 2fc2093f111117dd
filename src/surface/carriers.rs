//! The point that carries each element of a surface: the nearest of its body at the start, of equally
//! near ones the one with the smallest id. It depends on the start alone, so that a restart finds the
//! same one.

use std::f64::consts::TAU;

use rustc_hash::FxHashMap;

use super::{Carried, Element};
use crate::deck::model::Symmetry;
use crate::error::{Error, Result};
use crate::parallel::World;
use crate::points::Points;

/// Points further than so many spacings from an element do not carry it.
const REACH: i64 = 2;
/// Distances that differ by less than this share of the spacing are equal.
const EQUAL: f64 = 1e-9;

/// Mean distance of a body's points, m. Collective.
pub fn spacing<const D: usize>(
    world: &World,
    points: &Points<D>,
    body: usize,
    symmetry: Symmetry,
) -> f64 {
    let own = (0..points.len()).filter(|&p| points.body[p] as usize == body);
    // Of a ring its section counts.
    let size = |p: usize| match symmetry {
        Symmetry::PlaneStrain => points.volume_initial[p],
        Symmetry::Axisymmetric => points.volume_initial[p] / (TAU * points.position_initial[p][0]),
    };
    let (count, volume) = own.fold((0, 0.0), |(count, volume), p| (count + 1, volume + size(p)));
    let count = world.sum_usize(count);
    (world.sum(volume) / count.max(1) as f64).powf(1.0 / D as f64)
}

/// The `elements` (alike on all ranks) of a body whose points are `spacing` apart, each with the identity
/// of its carrier; `what` names the body. Collective. Error: no point near an element.
pub fn carried<const D: usize>(
    world: &World,
    points: &Points<D>,
    body: usize,
    elements: &[Element<D>],
    spacing: f64,
    what: &str,
) -> Result<Vec<(u64, Carried<D>)>> {
    let bin_of =
        |x: &[f64; D]| -> [i64; D] { std::array::from_fn(|a| (x[a] / spacing).floor() as i64) };
    // Only bins beside elements are looked into.
    let mut bins: FxHashMap<[i64; D], Vec<usize>> = FxHashMap::default();
    for element in elements {
        around(&bin_of(&element.place), |bin| {
            bins.entry(bin).or_default();
        });
    }
    for p in (0..points.len()).filter(|&p| points.body[p] as usize == body) {
        if let Some(bin) = bins.get_mut(&bin_of(&points.position_initial[p])) {
            bin.push(p);
        }
    }
    let distance = |p: usize, x: &[f64; D]| -> f64 {
        let own = &points.position_initial[p];
        own.iter().zip(x).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    let near = |element: &Element<D>, visit: &mut dyn FnMut(usize, f64)| {
        around(&bin_of(&element.place), |bin| {
            for &p in bins.get(&bin).into_iter().flatten() {
                visit(p, distance(p, &element.place));
            }
        });
    };
    let mut nearest = vec![f64::NEG_INFINITY; elements.len()];
    for (element, best) in elements.iter().zip(&mut nearest) {
        near(element, &mut |_, distance| *best = best.max(-distance));
    }
    let nearest = world.max_slice(&nearest);
    let mut chosen: Vec<Option<usize>> = vec![None; elements.len()];
    let mut ids = vec![f64::NEG_INFINITY; elements.len()];
    for (k, element) in elements.iter().enumerate() {
        near(element, &mut |p, distance| {
            let first = chosen[k].is_none_or(|known| points.id[p] < points.id[known]);
            if distance <= -nearest[k] + EQUAL * spacing && first {
                chosen[k] = Some(p);
                ids[k] = -(points.id[p] as f64);
            }
        });
    }
    let ids = world.max_slice(&ids);
    if let Some(k) = ids.iter().position(|id| *id == f64::NEG_INFINITY) {
        return Err(Error::Input(format!(
            "{what}: no point of the body lies near its surface at {:?} m; the shape reaches beyond \
             the grid, or the points do not fill it",
            elements[k].place
        )));
    }
    let mut places = vec![f64::NEG_INFINITY; elements.len() * D];
    for (k, chosen) in chosen.iter().enumerate() {
        if let Some(p) = chosen.filter(|&p| -(points.id[p] as f64) == ids[k]) {
            places[k * D..(k + 1) * D].copy_from_slice(&points.position_initial[p]);
        }
    }
    let places = world.max_slice(&places);
    let of_element = |(k, element): (usize, &Element<D>)| {
        let offset = std::array::from_fn(|a| element.place[a] - places[k * D + a]);
        ((-ids[k]) as u64, Carried { element: *element, offset })
    };
    Ok(elements.iter().enumerate().map(of_element).collect())
}

/// The bins within [`REACH`] of one.
fn around<const D: usize>(bin: &[i64; D], mut visit: impl FnMut([i64; D])) {
    let width = 2 * REACH + 1;
    for k in 0..width.pow(D as u32) {
        let mut rest = k;
        visit(std::array::from_fn(|a| {
            let shift = rest % width - REACH;
            rest /= width;
            bin[a] + shift
        }));
    }
}
