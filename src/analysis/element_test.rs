//! One point under a path of a laboratory test, without a grid or a body. The only equilibrium is that of the
//! point's stress with the pressure around it.
//!
//! Along every path but simple shear the axes of stress and strain stay: an increment adds to the
//! principal logarithmic strains, and where the Cauchy stress is prescribed in place of the strain,
//! the strain follows by Newton's method with the model's tangent, from
//! d sigma_a / d eps_b = (d tau_a / d eps_b - tau_a) / J. Simple shear turns the axes: the elastic
//! left Cauchy-Green tensor is pushed forward and split again.

use crate::deck::model::{ElementPath, ElementTest};
use crate::error::{Error, Result};
use crate::material::{MOST_STATE, Material, Response};

/// Largest number of Newton steps for the strain that a stress asks for.
const MOST_ITERATIONS: usize = 100;
/// A prescribed stress holds to this share of the stresses around it.
const TOLERANCE: f64 = 1e-10;

/// The point after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Logarithmic strains since the start of the path, along the axes of the test; in simple
    /// shear the principal ones, largest first.
    pub strain: [f64; 3],
    /// Cauchy stresses along them, Pa, tension positive.
    pub stress: [f64; 3],
    /// Norms of the plastic increments, summed.
    pub plastic_strain: f64,
    /// The model's state variables; the others are zero.
    pub state: [f64; MOST_STATE],
}

impl Row {
    /// Mean Cauchy pressure, Pa, compression positive.
    pub fn pressure(&self) -> f64 {
        -(self.stress[0] + self.stress[1] + self.stress[2]) / 3.0
    }

    /// sqrt(3 J2) of the Cauchy stress, Pa.
    pub fn deviator(&self) -> f64 {
        let [a, b, c] = self.stress;
        (0.5 * ((a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2))).sqrt()
    }

    /// Volume over that at the start of the path.
    pub fn volume_ratio(&self) -> f64 {
        (self.strain[0] + self.strain[1] + self.strain[2]).exp()
    }
}

/// Names of all columns, with units.
pub fn header(material: &Material) -> Vec<String> {
    let fixed = [
        "step [-]",
        "strain_1 [-]",
        "strain_2 [-]",
        "strain_3 [-]",
        "stress_1 [Pa]",
        "stress_2 [Pa]",
        "stress_3 [Pa]",
        "p [Pa]",
        "q [Pa]",
        "J [-]",
        "plastic_strain [-]",
    ];
    let state = material.state().iter().map(|known| format!("{} [{}]", known.name, known.unit));
    fixed.iter().map(|name| name.to_string()).chain(state).collect()
}

/// The numbers of a row below [`header`].
pub fn numbers(material: &Material, step: usize, row: &Row) -> Vec<f64> {
    let mut all = vec![step as f64];
    all.extend(row.strain);
    all.extend(row.stress);
    all.extend([row.pressure(), row.deviator(), row.volume_ratio(), row.plastic_strain]);
    all.extend(&row.state[..material.state().len()]);
    all
}

/// The point as the path goes on.
struct Point<'a> {
    material: &'a Material,
    elastic_strain: [f64; 3],
    row: Row,
}

impl<'a> Point<'a> {
    /// Under the isotropic pressure `confining`, Pa.
    fn at(material: &'a Material, confining: f64) -> Result<Self> {
        let strain = material.elastic_strain([-confining; 3]);
        if strain.iter().any(|e| !e.is_finite()) {
            return Err(Error::Input(format!(
                "element_test.confining: no elastic strain of the material gives a pressure of \
                 {confining} Pa; expected a pressure that it can bear"
            )));
        }
        let state = material.initial_state(strain);
        if state.iter().any(|word| !word.is_finite()) {
            return Err(Error::Input(
                "element_test.confining: ocr is a ratio to the pressure at the start: expected \
                 confining > 0 Pa"
                    .into(),
            ));
        }
        let words = material.state().len();
        let response = material.respond(strain, &state[..words]);
        if response.plastic_increment > 0.0 {
            let cure = match words {
                0 => "expected a pressure inside its yield surface".into(),
                _ => format!(
                    "expected one inside its yield surface (at the start {} = {} {})",
                    material.state()[0].name,
                    state[0],
                    material.state()[0].unit
                ),
            };
            return Err(Error::Input(format!(
                "element_test.confining: under a pressure of {confining} Pa the material yields \
                 before the test begins (overconsolidation ratio below 1): {cure}"
            )));
        }
        let row = Row { strain: [0.0; 3], stress: response.stress, plastic_strain: 0.0, state };
        Ok(Point { material, elastic_strain: strain, row })
    }

    fn respond(&self, trial: [f64; 3]) -> Response {
        self.material.respond(trial, &self.row.state[..self.material.state().len()])
    }

    fn response_to(&self, increment: [f64; 3]) -> Response {
        self.respond([0, 1, 2].map(|a| self.elastic_strain[a] + increment[a]))
    }

    /// Takes a response for the end of a step.
    fn take(&mut self, strain: [f64; 3], response: &Response) {
        let volume = (strain[0] + strain[1] + strain[2]).exp();
        self.row = Row {
            strain,
            stress: response.stress.map(|tau| tau / volume),
            plastic_strain: self.row.plastic_strain + response.plastic_increment,
            state: response.state,
        };
        self.elastic_strain = response.elastic_strain;
    }

    /// A step with all strains prescribed.
    fn strain_to(&mut self, strain: [f64; 3]) {
        let increment = [0, 1, 2].map(|a| strain[a] - self.row.strain[a]);
        let response = self.response_to(increment);
        self.take(strain, &response);
    }

    /// A step with the strains prescribed but those of `free`, which are equal and follow from the
    /// Cauchy stress -`confining`. `None` if no strain is found that gives it.
    fn press_to(&mut self, prescribed: [f64; 3], free: &[usize], confining: f64) -> Option<()> {
        let at = |side: f64| {
            let mut strain = prescribed;
            free.iter().for_each(|&axis| strain[axis] = side);
            let increment = [0, 1, 2].map(|a| strain[a] - self.row.strain[a]);
            let response = self.response_to(increment);
            let volume = (strain[0] + strain[1] + strain[2]).exp();
            let tau = response.stress[free[0]];
            let slope: f64 =
                free.iter().map(|&b| response.tangent[free[0]][b] - tau).sum::<f64>() / volume;
            let scale =
                confining.abs().max(response.stress.iter().fold(0.0, |m: f64, s| m.max(s.abs())));
            (strain, response, tau / volume + confining, slope, scale)
        };
        let mut side = self.row.strain[free[0]];
        let mut now = at(side);
        // Signs of the excess on both sides, where known: the stress grows with the strain.
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for _ in 0..MOST_ITERATIONS {
            let (_, _, excess, slope, scale) = now;
            if !excess.is_finite() {
                return None;
            }
            if excess > 0.0 {
                high = high.min(side)
            } else {
                low = low.max(side)
            }
            let newton = side - excess / slope;
            let next = if slope > 0.0 && newton > low && newton < high {
                newton
            } else if low.is_finite() && high.is_finite() {
                0.5 * (low + high)
            } else {
                side - excess.signum() * 1e-3
            };
            let then = at(next);
            // To round-off: where it holds and a step no longer helps.
            if excess.abs() <= TOLERANCE * scale && then.2.abs() >= 0.5 * excess.abs() {
                let (strain, response, ..) = now;
                self.take(strain, &response);
                return Some(());
            }
            (side, now) = (next, then);
        }
        let (strain, response, excess, _, scale) = now;
        (excess.abs() <= TOLERANCE * scale).then(|| self.take(strain, &response))
    }
}

/// Every step of the test, that at the start first. Errors: `Input` where the start is impossible,
/// `Run` where a step has no solution, with the rows up to it.
pub fn run(material: &Material, test: &ElementTest) -> (Vec<Row>, Result<()>) {
    let mut point = match Point::at(material, test.confining) {
        Ok(point) => point,
        Err(error) => return (Vec::new(), Err(error)),
    };
    let mut rows = vec![point.row];
    if test.path == ElementPath::SimpleShear {
        return shear(point, test, rows);
    }
    for step in 1..=test.total_steps() {
        // Compression positive, as the deck gives it.
        let axial = -test.strain * step as f64 / test.steps as f64;
        let done = match test.path {
            ElementPath::TriaxialDrained => {
                point.press_to([axial, 0.0, 0.0], &[1, 2], test.confining)
            }
            ElementPath::Biaxial => point.press_to([axial, 0.0, 0.0], &[1], test.confining),
            _ => {
                let strain = match test.path {
                    ElementPath::TriaxialUndrained => [axial, -0.5 * axial, -0.5 * axial],
                    ElementPath::Oedometer => [axial, 0.0, 0.0],
                    ElementPath::Isotropic => [axial; 3],
                    _ => test.history_at(step),
                };
                point.strain_to(strain);
                Some(())
            }
        };
        let good = done.is_some() && point.row.stress.iter().all(|s| s.is_finite());
        if !good {
            let what = if done.is_none() {
                format!("no lateral strain gives the pressure {} Pa", test.confining)
            } else {
                "the material gives no stress".to_string()
            };
            let text = format!(
                "step {step}: {what} at the strains {:?}: expected more, smaller steps \
                 (element_test.steps), or a smaller strain",
                rows[step - 1].strain
            );
            return (rows, Err(Error::Run(text)));
        }
        rows.push(point.row);
    }
    (rows, Ok(()))
}

/// Simple shear in the plane of the axes 1 and 2 at constant volume; `strain` is the amount of
/// shear.
fn shear(mut point: Point<'_>, test: &ElementTest, mut rows: Vec<Row>) -> (Vec<Row>, Result<()>) {
    let start = point.elastic_strain.map(|e| (2.0 * e).exp());
    // b_e in the plane: xx, xy, yy.
    let mut plane = [start[0], 0.0, start[1]];
    let more = test.strain / test.steps as f64;
    for step in 1..=test.steps {
        let [xx, xy, yy] = plane;
        let trial = [xx + 2.0 * more * xy + more * more * yy, xy + more * yy, yy];
        let (half, mean) = (0.5 * (trial[0] - trial[2]), 0.5 * (trial[0] + trial[2]));
        let radius = half.hypot(trial[1]);
        // The smaller value by the determinant: without loss where the two are far apart.
        let determinant = xx * yy - xy * xy;
        let (major, minor) = (mean + radius, determinant / (mean + radius));
        let axis = if radius > 0.0 { [half / radius, trial[1] / radius] } else { [1.0, 0.0] };
        let response = point.respond([0.5 * major.ln(), 0.5 * minor.ln(), point.elastic_strain[2]]);
        let stretch = (0.5 * test.strain * step as f64 / test.steps as f64).abs().asinh();
        point.take([stretch, -stretch, 0.0], &response);
        if point.row.stress.iter().any(|s| !s.is_finite()) {
            let text = format!(
                "step {step}: the material gives no stress: expected more, smaller steps \
                 (element_test.steps)"
            );
            return (rows, Err(Error::Run(text)));
        }
        let [e1, e2, _] = response.elastic_strain.map(|e| (2.0 * e).exp());
        let (mean, half) = (0.5 * (e1 + e2), 0.5 * (e1 - e2));
        plane = [mean + half * axis[0], half * axis[1], mean - half * axis[0]];
        let mut row = point.row;
        row.strain = [stretch, 0.0, -stretch];
        row.stress.sort_by(|a, b| b.total_cmp(a));
        rows.push(row);
    }
    (rows, Ok(()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::entry;

    fn made(name: &str, parameters: &[f64]) -> Material {
        let entry = entry(name).expect("a known model");
        (entry.make)(&entry.completed(parameters))
    }

    fn test(path: ElementPath, confining: f64, strain: f64, steps: usize) -> ElementTest {
        ElementTest { material: 0, path, confining, strain, steps, history: Vec::new() }
    }

    fn last(material: &Material, test: &ElementTest) -> Row {
        let (rows, outcome) = run(material, test);
        outcome.expect("a good end");
        assert_eq!(rows.len(), test.total_steps() + 1);
        *rows.last().expect("rows")
    }

    fn near(found: f64, wanted: f64, tolerance: f64) {
        assert!((found - wanted).abs() <= tolerance, "{found} in place of {wanted}");
    }

    /// At failure sigma_1 = N sigma_3 + 2 (c/J) sqrt(N); the plastic volume strain is
    /// (1 - N_psi) times the axial plastic strain.
    #[test]
    fn mohr_coulomb_fails_as_the_closed_form_says() {
        let law = made("mohr-coulomb", &[100e6, 0.3, 30.0, 10.0, 10e3, f64::INFINITY]);
        for steps in [10, 200] {
            let row = last(&law, &test(ElementPath::TriaxialDrained, 100e3, 0.1, steps));
            let volume = row.volume_ratio();
            let wanted = 3.0 * 100e3 + 2.0 * 10e3 / volume * 3f64.sqrt();
            near(-row.stress[0], wanted, 1e-8 * wanted);
            near(row.stress[1], -100e3, 1e-9 * 100e3);
            // Elastic strains under the Kirchhoff stresses J sigma less those at the start.
            let elastic = law.elastic_strain(row.stress.map(|s| s * volume));
            let start = law.elastic_strain([-100e3; 3]);
            let plastic = [0, 1, 2].map(|a| row.strain[a] - elastic[a] + start[a]);
            let dilation = 10f64.to_radians().sin();
            let n = (1.0 + dilation) / (1.0 - dilation);
            near(plastic.iter().sum::<f64>(), plastic[0] * (1.0 - n), 1e-10);
            let row = last(&law, &test(ElementPath::Biaxial, 100e3, 0.1, steps));
            let wanted = 3.0 * 100e3 + 2.0 * 10e3 / row.volume_ratio() * 3f64.sqrt();
            near(-row.stress[0], wanted, 1e-8 * wanted);
        }
    }

    /// Uniaxial: J sigma = sigma_y + H eps_p; pure shear and plane strain of the perfect law.
    #[test]
    fn von_mises_yields_at_its_strengths() {
        let law = made("von-mises", &[117e9, 0.35, 0.0, 400e6, 0.0, 100e6, 0.0, 0.0]);
        let row = last(&law, &test(ElementPath::TriaxialDrained, 0.0, -0.2, 20));
        let tau = row.stress[0] * row.volume_ratio();
        near(tau, 400e6 + 100e6 * (0.2 - tau / 117e9), 1e-10 * tau);
        near(row.state[0], 0.2 - tau / 117e9, 1e-10);
        let law = made("von-mises", &[100e6, 0.49, 0.0, 0.0, 10e3, 0.0, 0.0, 0.0]);
        let row = last(&law, &test(ElementPath::Biaxial, 50e3, 0.05, 20));
        // At collapse in plane strain the out-of-plane stress is the mean: tau_1 - tau_2 = 2 c_u.
        let jump = (row.stress[1] - row.stress[0]) * row.volume_ratio();
        near(jump, 20e3, 1e-3);
        let row = last(&law, &test(ElementPath::SimpleShear, 0.0, 0.5, 200));
        near(row.stress[0] - row.stress[2], 20e3, 1e-6);
        near(row.volume_ratio(), 1.0, 1e-14);
    }

    /// Elastic simple shear by the closed form of the Hencky solid: tau = 2 G asinh(gamma/2).
    #[test]
    fn simple_shear_turns_the_axes() {
        let law = made("hencky", &[2.6e6, 0.3]);
        for steps in [1, 37] {
            let row = last(&law, &test(ElementPath::SimpleShear, 30e3, 3.0, steps));
            let strain = 1.5f64.asinh();
            near(row.stress[0], 2e6 * strain - 30e3, 1e-3);
            near(row.stress[2], -2e6 * strain - 30e3, 1e-3);
            near(row.strain[0], strain, 1e-14);
        }
    }

    fn clay(ocr: f64) -> Material {
        made("cam-clay", &[1.0, 0.1, 0.02, 0.0, ocr, 1.0, 0.0, 0.0, 100e3, 3000e3])
    }

    /// p_cs = p_0 (R/2)^((lambda - kappa)/lambda), q_cs = M p_cs, for any size of the steps.
    #[test]
    fn undrained_clay_comes_to_its_critical_state() {
        for (ocr, wanted) in [(1.0, 57.4349e3), (2.0, 100e3), (5.0, 1e5 * 2.5f64.powf(0.8))] {
            for steps in [50, 400] {
                let test = test(ElementPath::TriaxialUndrained, 100e3, 1.5, steps);
                let row = last(&clay(ocr), &test);
                let exact = 1e5 * (0.5 * ocr).powf(0.8);
                near(exact, wanted, 0.1);
                near(row.pressure(), exact, 1e-9 * exact);
                near(row.deviator(), exact, 1e-9 * exact);
                near(row.volume_ratio(), 1.0, 1e-14);
            }
        }
    }

    /// p_cs = q_cs = 3 p_0 / (3 - M), and the volume of the line of critical states.
    #[test]
    fn drained_clay_comes_to_its_critical_state() {
        for (ocr, wanted) in [(1.0, -0.087271), (2.0, -0.036860), (5.0, 0.029779)] {
            // It is approached like an exponential: 1.2e-6 are left at 1.5.
            for (strain, left) in [(1.5, 2e-6), (3.0, 1e-10)] {
                let test = test(ElementPath::TriaxialDrained, 100e3, strain, 1500);
                let row = last(&clay(ocr), &test);
                near(row.pressure(), 150e3, left * 150e3);
                near(row.deviator(), 150e3, 3.0 * left * 150e3);
                near(row.volume_ratio().ln(), wanted, 1e-6);
                let exact = 0.02 * 1.5f64.ln() + 0.08 * (3.0 / ocr).ln();
                near(row.volume_ratio().ln(), -exact / 1.1, left);
            }
        }
    }

    #[test]
    fn isotropic_compression_is_a_line_in_the_logarithms() {
        let (rows, outcome) = run(&clay(1.0), &test(ElementPath::Isotropic, 100e3, 0.1, 10));
        outcome.expect("a good end");
        for row in &rows {
            let kirchhoff = row.pressure() * row.volume_ratio();
            near(-row.volume_ratio().ln(), 0.1 * (kirchhoff / 100e3).ln(), 1e-12);
        }
    }

    #[test]
    fn an_impossible_start_is_an_error_of_the_input() {
        let below = made("cam-clay", &[1.0, 0.1, 0.02, 80e3, 0.0, 1.0, 0.0, 0.0, 100e3, 3000e3]);
        let (rows, outcome) = run(&below, &test(ElementPath::Oedometer, 100e3, 0.1, 10));
        let error = outcome.expect_err("yields at once");
        assert!(rows.is_empty() && error.exit_code() == 2);
        assert!(error.to_string().contains("preconsolidation = 80000 Pa"), "{error}");
        let (_, outcome) = run(&clay(2.0), &test(ElementPath::Oedometer, 0.0, 0.1, 10));
        assert_eq!(outcome.expect_err("no pressure").exit_code(), 2);
        let law = made("mohr-coulomb", &[1e6, 0.3, 30.0, 0.0, 0.0, f64::INFINITY]);
        let (_, outcome) = run(&law, &test(ElementPath::Oedometer, -10.0, 0.1, 10));
        assert_eq!(outcome.expect_err("tension").exit_code(), 2);
    }
}
