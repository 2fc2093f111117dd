//! What the size of the Ghost mass does to Ghost Table 3, and to the condition of the mass.

use super::conditioning::{ghost, largest};
use super::ghosts::{COARSE, MEDIUM, Resolution};
use super::report::record;
use super::table_3::{SPACINGS, collision, mean_error, of_all};
use crate::common::run::Run;

/// Errors at the three spacings by 2389 points in 1000 steps, and what else is set.
fn errors_with(update: &str, mass: &str, resolution: &Resolution, sets: &[String]) -> [f64; 3] {
    let runs: Vec<Run> = SPACINGS
        .iter()
        .map(|h| {
            let run = collision(0, resolution, 1000, h)
                .set(format!("method.stress_update=\"{update}\""))
                .set(format!("method.mass=\"{mass}\""));
            sets.iter().fold(run, |run, word| run.set(word.clone()))
        })
        .collect();
    let found = of_all(&runs, mean_error);
    [found[0], found[1], found[2]]
}

fn said(errors: [f64; 3]) -> String {
    errors.map(|e| format!("{e:.2}")).join(" / ")
}

/// What a user gains and loses by more Ghost mass, with the program's default motion of points.
#[test]
#[ignore = "two minutes; writes the table"]
fn energy_and_condition_by_ghost_mass() {
    let mut rows = Vec::new();
    let lumped = ["usf", "usl", "musl"].map(|update| errors_with(update, "lumped", &MEDIUM, &[]));
    rows.push([vec!["lumped".to_string(), String::new()], lumped.map(said).to_vec()].concat());
    for (scaling, factor) in [
        ("published", 0.25),
        ("scale-free", 0.0025),
        ("scale-free", 0.025),
        ("scale-free", 0.25),
        ("scale-free", 2.5),
    ] {
        let sets = [
            format!("ghost.scaling=\"{scaling}\""),
            format!("ghost.mass_factor={factor:?}"),
            "method.position_update=\"momentum\"".to_string(),
        ];
        let moved = ghost(&COARSE, 40);
        let moved = sets[..2].iter().fold(moved, |run, word| run.set(word.clone())).results();
        let kappa = largest(&moved, "kappa_mass_ghost", 2.0);
        let [usf, usl, musl] =
            ["usf", "usl", "musl"].map(|update| errors_with(update, "consistent", &MEDIUM, &sets));
        rows.push(vec![
            format!("{scaling}, mass_factor = {factor}"),
            format!("{kappa:.1e}"),
            said(usf),
            said(usl),
            said(musl),
        ]);
        assert!(musl.iter().all(|e| *e < 3.0), "{musl:?}");
        if (scaling, factor) == ("scale-free", 0.25) {
            assert!(kappa < 2e3, "{kappa}");
            assert!((0..3).all(|h| usl[h] > 10.0 * musl[h]), "{usl:?} {musl:?}");
        }
    }
    // The lumped mass gains by musl, too.
    assert!((0..3).all(|h| lumped[1][h] > 5.0 * lumped[2][h]), "{lumped:?}");
    record("ghost-3-mass", &["Ghost mass", "largest κ(M)", "usf", "usl", "musl"], &rows);
}

/// The paper's three trends of usf and usl together by the same Ghost mass: by none of these.
#[test]
#[ignore = "84 runs, two minutes; writes the table"]
fn table_3_by_other_scales_of_the_ghost_mass() {
    let (mut rows, mut all_hold) = (Vec::new(), Vec::new());
    for resolution in [&COARSE, &MEDIUM] {
        let of = |mass: &str, sets: &[String]| {
            ["usf", "usl"].map(|update| errors_with(update, mass, resolution, sets))
        };
        let [usf_lumped, usl_lumped] = of("lumped", &[]);
        for (scaling, factor) in [
            ("published", 0.25),
            ("published", 1.0),
            ("published", 4.0),
            ("published", 16.0),
            ("published", 64.0),
            ("scale-free", 0.25),
        ] {
            let sets =
                [format!("ghost.scaling=\"{scaling}\""), format!("ghost.mass_factor={factor:?}")];
            let [usf, usl] = of("consistent", &sets);
            let ratio =
                |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|h| a[h] / b[h]) };
            let (below, over) = (ratio(usf, usf_lumped), ratio(usl_lumped, usl));
            let usf_holds = below[0] < 1.0 && below[1] < 1.0 && below[2] > 1.0;
            let usl_holds = over[1] > 4.0 && over[2] > 4.0;
            let name = format!("{}, {scaling}, {factor}", resolution.name);
            let yes = |holds: bool| if holds { "yes" } else { "no" }.to_string();
            rows.push(vec![name.clone(), said(below), yes(usf_holds), said(over), yes(usl_holds)]);
            if usf_holds && usl_holds {
                all_hold.push(name);
            }
        }
    }
    let header = [
        "points, scaling, mass_factor",
        "usf: ghost over lumped",
        "below 1, below 1, above 1",
        "usl: lumped over ghost",
        "last two above 4",
    ];
    record("ghost-3-scales", &header, &rows);
    assert!(all_hold.is_empty(), "reproduced after all: {all_hold:?}");
}
