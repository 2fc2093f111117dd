//! Element tests through the program: `inputs/triaxial.toml` and what may go wrong with it.

use crate::common::run::{Run, input};

/// `element.csv`: names without units, and rows.
fn table(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let names = lines.next().expect("a header").split(',');
    let names = names.map(|name| name.split(' ').next().unwrap_or_default().to_string()).collect();
    let numbers =
        |line: &str| line.split(',').map(|word| word.parse().expect("a number")).collect();
    (names, lines.map(numbers).collect())
}

#[test]
fn triaxial_sand_fails_at_its_strength_on_any_number_of_ranks() {
    let tables: Vec<String> = [1, 2]
        .into_iter()
        .map(|ranks| {
            let run = Run::of("triaxial").ranks(ranks).results();
            assert_eq!(run.summary["status"], "completed");
            assert_eq!((run.count("steps_completed"), run.count("points")), (100, 1));
            assert!(run.text("resolved.toml").contains("path = \"triaxial-drained\""));
            run.text("element.csv")
        })
        .collect();
    assert_eq!(tables[0], tables[1]);
    let (names, rows) = table(&tables[0]);
    assert_eq!(
        names,
        [
            "step",
            "strain_1",
            "strain_2",
            "strain_3",
            "stress_1",
            "stress_2",
            "stress_3",
            "p",
            "q",
            "J",
            "plastic_strain"
        ]
    );
    let last = &rows[100];
    let wanted = 3.0 * 100e3 + 20e3 / last[9] * 3f64.sqrt();
    assert!((-last[4] - wanted).abs() < 1e-8 * wanted, "{last:?}");
    assert!((last[8] - (wanted - 100e3)).abs() < 1e-8 * wanted);
    assert!((last[1] + 0.1).abs() < 1e-15 && (last[5] + 100e3).abs() < 1e-4);
}

/// The deck's own clay, and the model's state by its name.
#[test]
fn clay_comes_to_its_critical_state() {
    let clay = "material.sand={ model = \"cam-clay\", slope = 1.0, compression = 0.1, \
                swelling = 0.02, ocr = 1.0, elasticity = \"pressure-dependent\", \
                reference_pressure = 100e3, shear = 3e6 }";
    let run = Run::of("triaxial").set(clay).set("element_test.strain=3.0");
    let (names, rows) = table(&run.set("element_test.steps=500").results().text("element.csv"));
    assert_eq!(names.last().map(String::as_str), Some("preconsolidation"));
    let last = rows.last().expect("rows");
    assert!((last[7] - 150e3).abs() < 1e-6 * 150e3, "{last:?}");
    // p_c J is that of the ellipse whose top is the critical state: 2 p in Kirchhoff stress.
    assert!((last[11] - 2.0 * last[7] * last[9]).abs() < 1e-5 * last[11]);
}

#[test]
fn what_is_wrong_with_a_test_is_told_before_anything_is_written() {
    let clay = "material.sand={ model = \"cam-clay\", slope = 1.0, compression = 0.1, \
                swelling = 0.02, preconsolidation = 80e3, young = 1e7, poisson = 0.3 }";
    let cases: [(&[&str], &str); 7] = [
        (&[clay], "overconsolidation ratio below 1"),
        (&["element_test.material=\"mud\""], "no [material.mud]"),
        (&["element_test.path=\"torsion\""], "triaxial-drained"),
        (&["element_test="], "element_test: missing"),
        (&["grid.h=1.0"], "grid: has no effect"),
        (&["analysis.steps=3"], "element_test.steps"),
        (&["material.sand.cohesion=\"1e3*Y\""], "parameters that depend on the place"),
    ];
    for (sets, said) in cases {
        for ranks in [1, 2] {
            let run = Run::of("triaxial").ranks(ranks);
            let outcome = sets.iter().fold(run, |run, set| run.set(*set)).attempt();
            assert_eq!(outcome.code, 2, "{sets:?}: {}", outcome.stderr);
            assert!(outcome.stderr.contains(said), "{sets:?}: {}", outcome.stderr);
            assert!(outcome.files().is_empty(), "{sets:?}: {:?}", outcome.files());
        }
    }
    // The same deck with the wrong place for it.
    let text = std::fs::read_to_string(input("beam")).expect("a deck");
    let run = Run::text(&text).set("element_test={ material = \"rubber\", steps = 1 }");
    assert_eq!(run.attempt().code, 2);
}
