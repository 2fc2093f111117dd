//! Figures of merit: a computed point field against its exact value (Lagrangian eq. 42).

use std::collections::BTreeMap;

use crate::deck::fields::PointField;
use crate::deck::model::{Verify, VerifyNorm};
use crate::error::Result;
use crate::loads::manufactured::Manufactured;
use crate::loads::scope_of;
use crate::material::{Material, local};
use crate::parallel::World;
use crate::points::Points;

use super::context::Run;

/// Figures by name, and what is to be said of those that could not be computed.
#[derive(Debug, Default)]
pub struct Figures {
    pub values: BTreeMap<String, f64>,
    pub warnings: Vec<String>,
}

impl Figures {
    /// `why`: what is known of a value that is not finite.
    fn insert(&mut self, name: String, value: f64, why: Option<String>) {
        if !value.is_finite() {
            let why = why.map_or_else(|| format!("it is {value}"), |why| format!("at {why}"));
            self.warnings
                .push(format!("verify \"{name}\" has no value ({why}): summary.json says null"));
        }
        self.values.insert(name, value);
    }
}

/// Figures of merit at the end of a run; the log names those without a value. Collective.
pub fn of_run<const D: usize>(run: &mut Run<D>) -> Result<BTreeMap<String, f64>> {
    let Run { world, model, points, recorder, .. } = run;
    let (factor, time) = recorder.reached;
    let before = recorder.stage() as f64;
    let time = if model.deck.analysis.kind.has_time() { time } else { before + factor };
    let mut figures = figures(world, &model.deck.verify, points, factor, time)?;
    if let Some(field) = &model.manufactured {
        let materials = &model.materials;
        manufactured(&mut figures, world, field, materials, points, factor, time);
    }
    for warning in &figures.warnings {
        recorder.log.warn(warning);
    }
    Ok(figures.values)
}

/// Evaluates all entries of the deck at the present state. A difference that is not finite at one
/// point leaves its figure without a value. Collective.
pub fn figures<const D: usize>(
    world: &World,
    entries: &[Verify],
    points: &Points<D>,
    load_factor: f64,
    time: f64,
) -> Result<Figures> {
    let mut figures = Figures::default();
    let total_volume = world.sum(points.volume_initial.iter().sum());
    for entry in entries {
        let (field, component) = PointField::parse_selector(&entry.field)?;
        let (mut sum, mut worst) = (0.0, 0.0f64);
        // The point with the lowest id that has none, its id first.
        let mut without: Option<(u64, String)> = None;
        let mut values = Vec::new();
        for p in 0..points.len() {
            values.clear();
            field.append(points, p, &mut values);
            let scope = scope_of(points, p, load_factor, time);
            let computed: &[f64] = match component {
                Some(c) => &values[c..=c],
                None => &values,
            };
            let square: f64 = computed
                .iter()
                .zip(&entry.exact)
                .map(|(value, exact)| (value - exact.value(&scope)).powi(2))
                .sum();
            let difference = square.sqrt();
            // `max` forgets what is not a number.
            worst = if difference.is_nan() || worst.is_nan() {
                f64::NAN
            } else {
                worst.max(difference)
            };
            let id = points.id[p];
            if !difference.is_finite() && without.as_ref().is_none_or(|(first, _)| id < *first) {
                let exact: Vec<f64> = entry.exact.iter().map(|exact| exact.value(&scope)).collect();
                let x = points.position[p];
                let why = format!("point {id}, {x:?} m, {computed:?} against {exact:?}");
                without = Some((id, why));
            }
            sum += points.volume_initial[p]
                * match entry.norm {
                    VerifyNorm::VolumeL2 => square,
                    _ => difference,
                };
        }
        let sum = world.sum(sum);
        let value = match entry.norm {
            VerifyNorm::VolumeL1 => sum / (entry.scale * total_volume),
            VerifyNorm::VolumeL2 => (sum / total_volume).sqrt() / entry.scale,
            VerifyNorm::Max => world.max(worst) / entry.scale,
        };
        figures.insert(entry.name.clone(), value, world.lowest_message(without));
    }
    Ok(figures)
}

/// Adds the errors of a manufactured solution: |u - u_exact| and |tau - tau(F_exact)| (Kirchhoff) in the L2
/// norm over the initial volume, over the same norm of the exact field. Collective.
pub fn manufactured<const D: usize>(
    figures: &mut Figures,
    world: &World,
    field: &Manufactured,
    materials: &[Material],
    points: &Points<D>,
    load_factor: f64,
    time: f64,
) {
    let mut sums = [0.0; 4];
    for p in 0..points.len() {
        let scope = scope_of(points, p, load_factor, time);
        let (exact, stress) = field.solution::<D>(local(materials, points, p), &scope);
        let volume = points.volume_initial[p];
        for a in 0..D {
            let found = points.position[p][a] - points.position_initial[p][a];
            sums[0] += volume * (found - exact[a]).powi(2);
            sums[1] += volume * exact[a].powi(2);
        }
        sums[2] += volume * (points.kirchhoff_stress[p] - stress).norm_squared();
        sums[3] += volume * stress.norm_squared();
    }
    let sums = world.sum_slice(&sums);
    let relative = |error: f64, scale: f64| (error / scale).sqrt();
    figures.insert("manufactured_displacement".into(), relative(sums[0], sums[1]), None);
    figures.insert("manufactured_stress".into(), relative(sums[2], sums[3]), None);
}
