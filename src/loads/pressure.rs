//! f_I = Σ_p V (σ̄ ∇S_I + S_I div σ̄) with σ̄ = -p 1 (virtual stress: Given et al. 2024,
//! doi 10.1007/s40571-024-00793-0): a pressure p(x, s, t) on the surface of all bodies as a sum
//! over points, without a surface.
//!
//! By the divergence theorem ∫ (σ̄ ∇S + S div σ̄) dV = ∫ σ̄ n S dA = -∫ p n S dA. As p depends on the
//! current place alone, f_I = -d/du_I Σ_p V_p p(x_p): the force has a potential, and its tangent is
//! symmetric. The sum over the points is formed in `system/terms/pressure.rs`; this file gives p and
//! its derivatives at a point.
//!
//! `max`, `min` and `abs` in the formula are averaged over the width of a point's domain
//! ([`jet::Averaged`]), exactly so where the arguments vary along one
//! axis. The force then changes continuously while points cross a water surface.

use super::{Load, Moment};
use crate::deck::Scope;
use crate::deck::expression::jet::{self, Dual};
use crate::deck::expression::{Expression, Jet, Smooth};
use crate::error::{Error, Result};

/// Cells over which a pressure fades outside its zone where the deck says nothing.
const FADE_CELLS: f64 = 3.0;

/// Where a pressure acts in full, in current positions.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureZone {
    /// m
    pub min: Vec<f64>,
    /// m
    pub max: Vec<f64>,
    /// Width over which it falls to zero outside, m; `None`: three cells.
    pub fade: Option<f64>,
}

/// A pressure on the surface of all bodies.
pub struct Pressure {
    value: Expression,
    smooth: Smooth,
    zone: Option<PressureZone>,
    /// m
    fade: f64,
}

/// p, Pa, and its first and second derivatives by the current place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureAt<const D: usize> {
    pub value: f64,
    pub first: [f64; D],
    pub second: [[f64; D]; D],
}

impl<const D: usize> Default for PressureAt<D> {
    fn default() -> Self {
        PressureAt { value: 0.0, first: [0.0; D], second: [[0.0; D]; D] }
    }
}

impl<const D: usize> PressureAt<D> {
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }

    pub fn is_finite(&self) -> bool {
        let first = self.first.iter().all(|v| v.is_finite());
        let second = self.second.as_flattened().iter().all(|v| v.is_finite());
        self.value.is_finite() && first && second
    }

    fn add(&mut self, jet: &Jet) {
        self.value += jet.value;
        for i in 0..D {
            self.first[i] += jet.first[i];
            for j in 0..D {
                self.second[i][j] += jet.second_along(i, j);
            }
        }
    }
}

impl Pressure {
    /// `cell`: size of the grid's cells, m. Error: a function without derivative.
    pub fn new(value: &Expression, zone: Option<&PressureZone>, cell: f64) -> Result<Self> {
        let wrong = |what: String| Error::Input(format!("load.pressure.value: {what}"));
        let smooth = value.averaged().map_err(wrong)?;
        let fade = zone.and_then(|zone| zone.fade).unwrap_or(FADE_CELLS * cell);
        Ok(Pressure { value: value.clone(), smooth, zone: zone.cloned(), fade })
    }

    /// Adds p at the place `x` of a point whose domain reaches `reach` to either side, m; `body`: the
    /// share that its body takes.
    pub fn add_at<const D: usize>(
        &self,
        x: &[f64; D],
        reach: &[f64; D],
        (at, body): (Moment, f64),
        sum: &mut PressureAt<D>,
    ) {
        let mut scope = Scope { load_factor: at.load_factor, time: at.time, ..Scope::default() };
        scope.current[..D].copy_from_slice(x);
        let mut wide = [0.0; 3];
        wide[..D].copy_from_slice(reach);
        let mut value = self.smooth.of_current(&scope, wide);
        if let Some(zone) = &self.zone {
            for axis in 0..D {
                let place = jet::coordinate(x[axis], axis);
                value *= fading(place, zone.min[axis], zone.max[axis], self.fade);
            }
        }
        sum.add(&(value * (at.factor_of(&self.value) * body)).into());
    }
}

/// 1 from `min` to `max`, and 0 beyond `fade` outside, with two continuous derivatives between:
/// 1 - d^3 (10 - 15 d + 6 d^2) at d fades.
fn fading(x: Dual, min: f64, max: f64, fade: f64) -> Dual {
    let d = match x.re {
        v if v < min => -(x - min) / fade,
        v if v > max => (x - max) / fade,
        _ => return Dual::from_re(1.0),
    };
    if d.re >= 1.0 {
        return Dual::from_re(0.0);
    }
    -(d * d * d * ((d * 6.0 - 15.0) * d + 10.0)) + 1.0
}

impl<const D: usize> Load<D> for Pressure {
    fn pressure(&self) -> Option<&Pressure> {
        Some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::model::AnalysisType;
    use crate::deck::{Presence, When};

    fn at(pressure: &Pressure, x: [f64; 2]) -> PressureAt<2> {
        let mut sum = PressureAt::default();
        let when = When { factor: 1.0, ..When::default() };
        let moment = Moment::new(AnalysisType::QuasiStatic, Presence::default(), when);
        pressure.add_at(&x, &[0.1, 0.2], (moment, 1.0), &mut sum);
        sum
    }

    /// Derivatives by central differences.
    #[test]
    fn derivatives_are_those_of_the_value() {
        let zone = PressureZone { min: vec![0.0, 0.5], max: vec![1.0, 1.0], fade: Some(0.7) };
        for (value, zone) in [
            ("1e3*exp(-x)*(2-y)^2", None),
            ("max(0, 9.81*(1.1-y))", None),
            ("max(0, 9.81*(1.1-y+0.3*x), min(x, 0.5))", Some(&zone)),
            ("100*(1+x*y)", Some(&zone)),
        ] {
            let value = Expression::parse(value).expect("valid");
            let pressure = Pressure::new(&value, zone, 0.5).expect("derivatives");
            for x in [[0.2, 0.31], [1.3, 1.05], [-0.4, 1.33], [0.9, 0.17]] {
                let made = at(&pressure, x);
                let step = 1e-6;
                for i in 0..2 {
                    let beside = |sign: f64| {
                        let mut x = x;
                        x[i] += sign * step;
                        at(&pressure, x)
                    };
                    let (more, less) = (beside(1.0), beside(-1.0));
                    let slope = (more.value - less.value) / (2.0 * step);
                    let scale = 1.0 + made.value.abs();
                    assert!((slope - made.first[i]).abs() < 1e-6 * scale, "{value:?} {x:?}");
                    for j in 0..2 {
                        let slope = (more.first[j] - less.first[j]) / (2.0 * step);
                        let scale = 1.0 + made.second[i][j].abs();
                        assert!(
                            (slope - made.second[i][j]).abs() < 1e-5 * scale,
                            "{value:?} {x:?}"
                        );
                    }
                }
            }
        }
    }

    /// The average of the clipped water pressure over a domain from y - 0.2 to y + 0.2.
    #[test]
    fn a_clipped_pressure_is_averaged_over_the_domain() {
        let value = Expression::parse("max(0, 10*(1-y))").expect("valid");
        let pressure = Pressure::new(&value, None, 0.5).expect("derivatives");
        for y in [0.5, 0.79, 0.85, 1.0, 1.15, 1.21, 2.0f64] {
            let (low, high) = ((y - 0.2).min(1.0), (y + 0.2).min(1.0));
            let exact = 10.0 * ((1.0 - low).powi(2) - (1.0 - high).powi(2)) / 2.0 / 0.4;
            assert!((at(&pressure, [0.3, y]).value - exact).abs() < 1e-13, "{y}");
        }
        assert!(Pressure::new(&Expression::parse("floor(x)").expect("valid"), None, 0.5).is_err());
    }
}
