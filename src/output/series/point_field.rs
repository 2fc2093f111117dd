//! The point fields that can be written or verified: names, shapes and formulas.
//!
//! Cauchy stress sigma = tau / J; pressure p = -tr(sigma)/3 (positive in compression);
//! `von_mises` sqrt(3 J2) of the Cauchy stress; `deviatoric_radius` sqrt(2 J2) of the Kirchhoff
//! stress, the radius that the von Mises model bounds by its yield value (Lagrangian eq. 43).
//! Logarithmic strain ln(b)/2, b = F F^T; its principal values come from b - 1, so that small strains
//! keep their digits. Units and meanings are those of [`crate::deck::fields`].

use nalgebra::Matrix3;

use crate::contact::point_state;
use crate::deck::fields::{self, PointField};
use crate::deck::nearest;
use crate::error::{Error, Result};
use crate::points::Points;
use crate::tensor::Spectrum;
use crate::tensor::spectral::ln_1p;

impl PointField {
    /// The fields of `output.fields`.
    ///
    /// # Errors
    /// `Input` for an unknown name, with the nearest known one.
    pub fn parse_list(names: &[String]) -> Result<Vec<Self>> {
        names.iter().map(|name| Self::from_name(name).ok_or_else(|| unknown(name))).collect()
    }

    /// A field, or one component of it: `stress`, `stress.yy`.
    pub fn parse_selector(text: &str) -> Result<(Self, Option<usize>)> {
        let (name, component) = match text.split_once('.') {
            Some((name, component)) => (name, Some(component)),
            None => (text, None),
        };
        let field = Self::from_name(name).ok_or_else(|| unknown(name))?;
        let Some(component) = component else { return Ok((field, None)) };
        let known = field.facts().rank.components(3);
        match known.iter().position(|&word| word == component) {
            Some(index) => Ok((field, Some(index))),
            None if known.is_empty() => Err(Error::Input(format!(
                "{name} is one number and has no component `{component}`"
            ))),
            None => Err(Error::Input(format!(
                "{name} has no component `{component}`; it has {}",
                known.join(", ")
            ))),
        }
    }

    /// Appends the columns of this field at point `p`; integers of fields of whole numbers
    /// come from [`PointField::integer`] instead and appear here rounded to `f64`.
    pub fn append<const D: usize>(self, points: &Points<D>, p: usize, out: &mut Vec<f64>) {
        let jacobian = || points.deformation_gradient[p].determinant();
        let effective = || points.kirchhoff_stress[p] / jacobian();
        let cauchy = || match points.water {
            None => effective(),
            Some(_) => effective() - Matrix3::identity() * points.pore_pressure(p),
        };
        let of_contact = |name| points.slip.get(p, points.body[p], name).unwrap_or(0.0);
        match self {
            PointField::Displacement => append_vector(&points.displacement(p), out),
            PointField::Position => append_vector(&points.position[p], out),
            PointField::PositionInitial => append_vector(&points.position_initial[p], out),
            PointField::Velocity => append_vector(&points.velocity[p], out),
            PointField::Acceleration => append_vector(&points.acceleration[p], out),
            PointField::HalfLength => append_vector(&points.half_length[p], out),
            PointField::PointForce => append_vector(&points.point_force[p], out),
            PointField::Stress => append_symmetric(&cauchy(), out),
            PointField::EffectiveStress => append_symmetric(&effective(), out),
            PointField::PorePressure => out.push(points.pore_pressure(p)),
            PointField::KirchhoffStress => append_symmetric(&points.kirchhoff_stress[p], out),
            PointField::ElasticLeftCauchyGreen => {
                append_symmetric(&(Matrix3::identity() + points.elastic_excess[p]), out);
            }
            PointField::PrincipalStress => out.extend(descending(&cauchy())),
            PointField::Pressure => out.push(-cauchy().trace() / 3.0),
            PointField::MeanStress => out.push(-effective().trace() / 3.0),
            PointField::MobilisedFriction => out.push(mobilised_friction(&effective())),
            PointField::LogStrain => append_symmetric(&LogStrain::of(points, p).tensor(), out),
            PointField::VolumetricStrain => out.push(LogStrain::of(points, p).trace()),
            PointField::EquivalentStrain => out.push(LogStrain::of(points, p).equivalent()),
            PointField::VonMises | PointField::Deviator => {
                out.push(1.5_f64.sqrt() * deviatoric_norm(&cauchy()))
            }
            PointField::DeviatoricRadius => out.push(deviatoric_norm(&points.kirchhoff_stress[p])),
            PointField::PlasticStrain => out.push(points.plastic_strain[p]),
            PointField::Dissipation => out.push(points.dissipation[p]),
            PointField::DeformationGradient => {
                let f = &points.deformation_gradient[p];
                out.extend_from_slice(&std::array::from_fn::<f64, 9, _>(|k| f[(k / 3, k % 3)]));
            }
            PointField::Jacobian => out.push(jacobian()),
            PointField::Volume => out.push(points.volume(p)),
            PointField::Mass => out.push(points.mass[p]),
            PointField::ContactForce => out.extend(point_state::FORCE.map(&of_contact)),
            PointField::ContactGap => out.push(of_contact(point_state::GAP)),
            PointField::ContactSlip => out.push(of_contact(point_state::SLIP)),
            PointField::ContactStatus => out.push(of_contact(point_state::STATUS)),
            PointField::Id => out.push(points.id[p] as f64),
            PointField::Body => out.push(f64::from(points.body[p])),
            PointField::Rank => out.push(0.0),
            PointField::State(variable) => {
                let value = points.state.get(p, points.body[p], variable.name);
                out.push(value.unwrap_or(0.0));
            }
        }
    }

    /// The value of an integer field, `None` for the others.
    pub fn integer<const D: usize>(self, points: &Points<D>, p: usize, rank: i32) -> Option<i64> {
        match self {
            PointField::Id => Some(points.id[p] as i64),
            PointField::Body => Some(i64::from(points.body[p])),
            PointField::Rank => Some(i64::from(rank)),
            _ => None,
        }
    }
}

/// Three columns whatever the dimension: readers take positions and vectors in space only.
pub fn append_vector<const D: usize>(vector: &[f64; D], out: &mut Vec<f64>) {
    let mut row = [0.0; 3];
    row[..D].copy_from_slice(vector);
    out.extend_from_slice(&row);
}

fn append_symmetric(tensor: &Matrix3<f64>, out: &mut Vec<f64>) {
    const UPPER: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    out.extend_from_slice(&UPPER.map(|index| tensor[index]));
}

/// ||s|| = sqrt(2 J2)
fn deviatoric_norm(stress: &Matrix3<f64>) -> f64 {
    (stress - Matrix3::identity() * (stress.trace() / 3.0)).norm()
}

/// Principal values, the largest first.
fn descending(stress: &Matrix3<f64>) -> [f64; 3] {
    let mut values = Spectrum::of(stress).values;
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

/// Angle of the line through the origin that touches the largest Mohr circle, degrees; 0 without
/// stress, 90 where the circle reaches into tension.
fn mobilised_friction(stress: &Matrix3<f64>) -> f64 {
    let [first, _, third] = descending(stress);
    let (radius, centre) = (first - third, -first - third);
    match radius {
        _ if radius.is_nan() => f64::NAN,
        0.0 => 0.0,
        _ if radius >= centre => 90.0,
        _ => (radius / centre).asin().to_degrees(),
    }
}

/// ln(b)/2 by principal values and axes.
struct LogStrain {
    values: [f64; 3],
    axes: [[f64; 3]; 3],
}

impl LogStrain {
    fn of<const D: usize>(points: &Points<D>, p: usize) -> Self {
        // b - 1 = H + H^T + H H^T, H = F - 1.
        let h = points.deformation_gradient[p] - Matrix3::identity();
        let Spectrum { values, axes } = Spectrum::of(&(h + h.transpose() + h * h.transpose()));
        LogStrain { values: values.map(|excess| 0.5 * ln_1p(excess)), axes }
    }

    fn trace(&self) -> f64 {
        self.values.iter().sum()
    }

    fn tensor(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| {
            let parts = self.values.iter().zip(&self.axes);
            parts.map(|(value, axis)| value * axis[i] * axis[j]).sum()
        })
    }

    /// sqrt(2/3 e:e) of the deviator e.
    fn equivalent(&self) -> f64 {
        let [a, b, c] = self.values;
        // e:e is a third of the sum of the squared differences; they cancel no digits.
        let squares = (a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2);
        (2.0 * squares).sqrt() / 3.0
    }
}

fn unknown(name: &str) -> Error {
    let known = fields::names();
    let near = nearest(name, known.iter().copied());
    let near = near.map_or(";".into(), |near| format!(": did you mean `{near}`?"));
    Error::Input(format!("unknown point field `{name}`{near} known are {}", known.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(points: &Points<2>, field: PointField) -> Vec<f64> {
        let mut out = Vec::new();
        field.append(points, 0, &mut out);
        assert_eq!(out.len(), field.facts().rank.columns(), "{}", field.name());
        out
    }

    /// One point stretched by 2 along x and sheared, with a full stress.
    fn sample() -> Points<2> {
        let mut points = Points::<2>::default();
        points.push_unstrained(7, 1, [1.0, 2.0], 0.25, 8.0, [0.25, 0.25]);
        points.position[0] = [1.5, 1.0];
        points.deformation_gradient[0] = Matrix3::new(2.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        points.kirchhoff_stress[0] = Matrix3::new(8.0, 2.0, 0.0, 2.0, 4.0, 0.0, 0.0, 0.0, 6.0);
        points
    }

    #[test]
    fn values_by_hand() {
        let points = sample();
        assert_eq!(values(&points, PointField::Displacement), [0.5, -1.0, 0.0]);
        assert_eq!(values(&points, PointField::Stress), [4.0, 1.0, 0.0, 2.0, 0.0, 3.0]);
        assert_eq!(values(&points, PointField::Pressure), [-3.0]);
        // tau: deviator diag(2, -2, 0) and shear 2: s:s = 4 + 4 + 2 * 4 = 16
        approx::assert_relative_eq!(values(&points, PointField::DeviatoricRadius)[0], 4.0);
        // sigma = tau / 2: s:s = 4, sqrt(3/2 * 4)
        approx::assert_relative_eq!(values(&points, PointField::VonMises)[0], 6.0_f64.sqrt());
        assert_eq!(values(&points, PointField::Jacobian), [2.0]);
        assert_eq!(values(&points, PointField::Volume), [0.5]);
        assert_eq!(values(&points, PointField::Mass), [2.0]);
        let f = values(&points, PointField::DeformationGradient);
        assert_eq!(f, [2.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(PointField::Id.integer(&points, 0, 3), Some(7));
        assert_eq!(PointField::Body.integer(&points, 0, 3), Some(1));
        assert_eq!(PointField::Rank.integer(&points, 0, 3), Some(3));
        for &field in PointField::ALL {
            values(&points, field);
            assert_eq!(PointField::from_name(field.name()), Some(field));
        }
    }

    /// Of a known stretch, turned out of the axes, and of one so small that its square is round-off.
    #[test]
    fn logarithmic_strain_and_its_invariants() {
        let mut points = sample();
        let (c, s) = (0.3_f64.cos(), 0.3_f64.sin());
        let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        for [a, b] in [[0.5_f64, -0.2], [3e-12, 1e-12]] {
            let stretch = Matrix3::from_diagonal(&[a.exp(), b.exp(), 1.0].into());
            // b does not see a rotation before the stretch.
            points.deformation_gradient[0] = turn * stretch * turn.transpose() * turn;
            let strain = turn * Matrix3::from_diagonal(&[a, b, 0.0].into()) * turn.transpose();
            let got = values(&points, PointField::LogStrain);
            let tolerance = 1e-15_f64.max(1e-14 * a);
            for (got, index) in got.iter().zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]) {
                approx::assert_abs_diff_eq!(*got, strain[index], epsilon = tolerance);
            }
            let volumetric = values(&points, PointField::VolumetricStrain)[0];
            approx::assert_abs_diff_eq!(volumetric, a + b, epsilon = tolerance);
            let deviator = strain - Matrix3::identity() * ((a + b) / 3.0);
            let equivalent = (2.0 / 3.0 * deviator.norm_squared()).sqrt();
            let got = values(&points, PointField::EquivalentStrain)[0];
            approx::assert_abs_diff_eq!(got, equivalent, epsilon = tolerance);
        }
    }

    /// Triaxial compression sigma = -(100, 100, 300) kPa: p = 500/3, q = 200, sin(phi) = 1/2.
    #[test]
    fn stresses_of_soil_mechanics() {
        let mut points = sample();
        points.deformation_gradient[0] = Matrix3::identity();
        let mut with = |stress: [f64; 3], field| {
            points.kirchhoff_stress[0] = Matrix3::from_diagonal(&stress.into());
            values(&points, field)
        };
        let triaxial = [-100e3, -300e3, -100e3];
        assert_eq!(with(triaxial, PointField::PrincipalStress), [-100e3, -100e3, -300e3]);
        approx::assert_relative_eq!(with(triaxial, PointField::MeanStress)[0], 500e3 / 3.0);
        approx::assert_relative_eq!(with(triaxial, PointField::Deviator)[0], 200e3);
        let friction = |with: &mut dyn FnMut([f64; 3], PointField) -> Vec<f64>, stress| {
            with(stress, PointField::MobilisedFriction)[0]
        };
        approx::assert_relative_eq!(friction(&mut with, triaxial), 30.0, max_relative = 1e-14);
        assert_eq!(friction(&mut with, [0.0; 3]), 0.0);
        assert_eq!(friction(&mut with, [-5.0; 3]), 0.0);
        assert_eq!(friction(&mut with, [1.0, -5.0, -5.0]), 90.0);
        assert_eq!(friction(&mut with, [1.0, 5.0, 5.0]), 90.0);
    }

    #[test]
    fn the_table_of_fields_is_that_of_the_deck() {
        let names: Vec<_> = PointField::ALL.iter().map(|field| field.name()).collect();
        assert_eq!(names, fields::FIELD_NAMES);
    }

    #[test]
    fn selectors() {
        let parse = PointField::parse_selector;
        assert_eq!(parse("stress.yy").unwrap(), (PointField::Stress, Some(3)));
        assert_eq!(parse("deformation_gradient.zx").unwrap().1, Some(6));
        assert_eq!(parse("J").unwrap(), (PointField::Jacobian, None));
        for (text, part) in [
            ("stess.yy", "did you mean `stress`"),
            ("stress.y", "it has xx, xy, xz, yy, yz, zz"),
            ("J.x", "has no component `x`"),
        ] {
            let error = parse(text).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(part), "{error}");
        }
    }
}
