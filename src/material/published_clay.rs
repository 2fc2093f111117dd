//! Cam-clay: stresses and tangents of single points against independently computed figures and
//! differences; far trial states return.

use super::published::{Sequence, by_differences_with, near};
use super::{CamClay, Material, Model, entry};

/// kPa: bulk modulus 5000, shear modulus 3000.
const CONSTANT: [f64; 10] = [1.0, 0.10, 0.02, 150.0, 0.0, 0.0, 7500.0, 0.25, 0.0, 0.0];
const DEPENDENT: [f64; 10] = [1.0, 0.10, 0.02, 150.0, 0.0, 1.0, 0.0, 0.0, 100.0, 3000.0];

fn clay(parameters: &[f64; 10]) -> Material {
    assert_eq!((entry("cam-clay").expect("known").check)(parameters), Ok(()));
    Material::CamClay(<CamClay as Model>::new(parameters))
}

#[test]
fn returns_to_the_ellipse() {
    let law = clay(&CONSTANT);
    let trial = [-0.010, -0.012, -0.040];
    let found = law.respond(trial, &[150.0]);
    let stress = [-170.950561, -174.413181, -222.889863];
    let tangent = [
        [3437.051, 1669.895, 1168.054],
        [1690.256, 3382.894, 1110.173],
        [1473.472, 1395.230, 2031.149],
    ];
    for a in 0..3 {
        near(found.stress[a], stress[a], 1e-6);
        for b in 0..3 {
            near(found.tangent[a][b], tangent[a][b], 1e-3);
        }
    }
    near(found.state[0], 202.773709, 1e-6);
    by_differences_with(&law, trial, &[150.0], 1e-7);
    let found = law.respond([-0.005, -0.005, -0.030], &[150.0]);
    for (a, stress) in [-127.606170, -127.606170, -186.790591].into_iter().enumerate() {
        near(found.stress[a], stress, 1e-6);
    }
    near(found.state[0], 171.108784, 1e-6);
}

/// Wet and dry of critical, isotropic, far outside: on the surface, and a tangent that differences
/// confirm.
#[test]
fn far_trial_states_return() {
    let mut random = Sequence(17);
    for parameters in [CONSTANT, DEPENDENT] {
        let law = clay(&parameters);
        let mut plastic = 0;
        for k in 0..2000 {
            let size = if k % 4 == 0 { 0.2 } else { 0.03 };
            let centre = if parameters[5] == 0.0 { -0.01 } else { 0.0 };
            let mut trial = [0; 3].map(|_| centre + size * random.next());
            if k % 10 == 0 {
                trial = [trial[0]; 3];
            }
            let pressure = 150.0;
            let found = law.respond(trial, &[pressure]);
            assert!(found.stress.iter().all(|s| s.is_finite()), "{trial:?}");
            if found.plastic_increment == 0.0 {
                continue;
            }
            plastic += 1;
            let p = -found.stress.iter().sum::<f64>() / 3.0;
            let square: f64 = found.stress.iter().map(|s| (s + p) * (s + p)).sum();
            let f = 1.5 * square + p * (p - found.state[0]);
            near(f, 0.0, 1e-9 * found.state[0] * found.state[0].max(p.abs()));
            let beside = law.respond(trial.map(|e| e * (1.0 - 1e-4)), &[pressure]);
            // Where pressures are enormous no difference is small.
            if beside.plastic_increment > 0.0 && p < 2e3 && size < 0.1 {
                by_differences_with(&law, trial, &[pressure], 1e-8);
            }
        }
        assert!(plastic > 1000, "{plastic}");
    }
}

/// ln v - ln p is a straight line of slope lambda in steps of any size.
#[test]
fn normal_compression_is_a_line() {
    let law = clay(&DEPENDENT);
    let mut strain = law.elastic_strain([-150.0; 3]);
    let mut state = [150.0, 0.0, 0.0, 0.0];
    let mut total = 0.0;
    for step in [0.01, 0.1, 0.002, 0.3] {
        let found = law.respond(strain.map(|e| e - step / 3.0), &state[..1]);
        total += step;
        let pressure = -found.stress[0];
        near((pressure / 150.0).ln() * 0.10, total, 1e-12);
        near(found.state[0], pressure, 1e-9 * pressure);
        (strain, state) = (found.elastic_strain, found.state);
    }
}

#[test]
fn ocr_is_a_multiple_of_what_the_stress_yields_at() {
    let mut parameters = DEPENDENT;
    (parameters[3], parameters[4]) = (0.0, 2.0);
    let law = clay(&parameters);
    let strain = law.elastic_strain([-80.0, -80.0, -140.0]);
    near(law.initial_state(strain)[0], 2.0 * (100.0 + 3600.0 / 100.0), 1e-9);
    near(law.initial_state([0.0; 3])[0], 200.0, 1e-9);
    parameters = CONSTANT;
    (parameters[3], parameters[4]) = (0.0, 2.0);
    assert!(clay(&parameters).initial_state([0.0; 3])[0].is_nan());
}

#[test]
fn what_is_missing_is_named() {
    let check = entry("cam-clay").expect("known").check;
    let key = |at: usize, value: f64, mut p: [f64; 10]| {
        p[at] = value;
        check(&p).err().map(|misfit| misfit.key)
    };
    assert_eq!(key(2, 0.1, CONSTANT), Some("swelling"));
    assert_eq!(key(6, 0.0, CONSTANT), Some("young"));
    assert_eq!(key(9, 1.0, CONSTANT), Some("shear"));
    assert_eq!(key(8, 0.0, DEPENDENT), Some("reference_pressure"));
    assert_eq!(key(9, 0.0, DEPENDENT), Some("shear"));
}
