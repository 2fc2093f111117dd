//! Ghost §5.3, Figure 14: where the energy of colliding elasto-plastic ghosts goes.

use super::report::record;
use crate::common::run::Run;

/// Energy at the start, J/m.
const START: f64 = 2.14726;

#[test]
#[ignore = "writes the table; the figure's claims are asserted in conservation.rs"]
fn figure_14() {
    let run = Run::of("ghost-collision-plastic").set("output.every=100000").results();
    let column = |name: &str| run.history(name);
    let (time, kinetic) = (column("time"), column("energy_kinetic"));
    let (strain, plastic) = (column("energy_strain"), column("energy_plastic"));
    let begins = plastic.iter().position(|w| *w > 1e-4 * START).expect("it yields");
    let mut shown: Vec<usize> = (1..=7).map(|half| half * time.len() / 7 - 1).collect();
    shown.push(begins);
    shown.sort_unstable();
    let rows = shown.into_iter().map(|k| {
        let total = kinetic[k] + strain[k] + plastic[k];
        let energies = [kinetic[k], strain[k], plastic[k], total].map(|w| format!("{w:.4}"));
        let error = format!("{:.2} %", 100.0 * (total / START - 1.0));
        [vec![format!("{:.2}", time[k])], energies.to_vec(), vec![error]].concat()
    });
    let header = ["t [s]", "kinetic", "strain", "dissipated", "total", "error of the total"];
    record("ghost-14", &header, &rows.collect::<Vec<_>>());
    assert!((1.3..1.7).contains(&time[begins]), "{}", time[begins]);
    let late = plastic[time.len() * 27 / 35];
    assert!(*plastic.last().expect("rows") > late, "waves go on dissipating beyond 2.7 s");
    let plateau = &strain[time.len() * 30 / 35..];
    let (low, high) = plateau.iter().fold((f64::MAX, 0.0f64), |(a, b), w| (a.min(*w), b.max(*w)));
    assert!(low > 1e-3 && high < 2.0 * low, "trapped strain energy: {low} to {high}");
}
