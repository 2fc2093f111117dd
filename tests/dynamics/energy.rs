//! What implicit dynamics loses of the energy, and how that falls with the time step.

use crate::common::run::{Results, Run};

/// Kinetic and elastic energy after each step.
fn energies(run: &Results) -> Vec<f64> {
    let strain = run.history("energy_strain");
    run.history("energy_kinetic").iter().zip(strain).map(|(a, b)| a + b).collect()
}

/// Two elastic discs that meet and part; their energy before is 2.4889 J/m. A small Ghost mass:
/// points do not take over its share (test below).
fn discs(steps: usize) -> f64 {
    let disc = |name: &str, centre: f64, velocity: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmaterial = \"m\"\ndensity = 1000.0\n\
             shape = {{ disc = {{ centre = [{centre}, {centre}], radius = 0.2 }} }}\n\
             lattice = {{ spacing = 0.016666666666666666, offset = [{}, {}] }}\n\
             velocity = [{velocity}, {velocity}]\n",
            centre + 0.5 / 60.0,
            centre + 0.5 / 60.0
        )
    };
    let run = Run::text(&format!(
        "[analysis]\ntype = \"implicit-dynamic\"\nsteps = {steps}\nduration = 3.5\ntolerance = 1e-8\n\
         [method]\nbasis = \"gimp\"\ndomain_update = \"stretch\"\n\
         [ghost]\nmass_factor = 0.025\n\
         [grid]\ntype = \"lattice\"\norigin = [-0.4, -0.4]\nsize = [1.8, 1.8]\nh = 0.05\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 1000.0\npoisson = 0.3\n{}{}\
         [output]\nevery = 1000\n",
        disc("a", 0.2, 0.1),
        disc("b", 0.8, -0.1)
    ));
    let energies = energies(&run.results());
    let (start, end) = (energies[0], energies[energies.len() - 1]);
    assert!((start / 2.4889 - 1.0).abs() < 1e-4, "{start}");
    assert!(energies.iter().all(|&energy| energy < start * (1.0 + 1e-9)), "gains");
    1.0 - end / start
}

/// 40 % and 9 % were lost with accelerations that came back from the points.
#[test]
fn discs_that_collide_keep_their_energy_the_better_the_smaller_the_steps() {
    let losses = [30, 60].map(discs);
    assert!(losses[0] < 0.1 && losses[1] < 0.04, "{losses:?}");
    let order = (losses[0] / losses[1]).log2();
    assert!(order > 1.0, "{losses:?}");
}

/// Energies of a bar that swings for four periods in its sixth mode; `ghost` is the deck's first line.
fn bar(ghost: &str, mass: &str, steps: usize) -> Vec<f64> {
    let run = Run::text(&format!(
        "{ghost}\n[analysis]\ntype = \"implicit-dynamic\"\nsteps = {steps}\n\
         duration = 0.12536605198128506\n\
         [method]\nbasis = \"mpm\"\nmass = \"{mass}\"\n\
         [grid]\ntype = \"lattice\"\nsize = [1.125, 0.0625]\nh = 0.0625\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 100.0\npoisson = 0.3\n\
         [[body]]\nmaterial = \"m\"\ndensity = 1.0\npoints_per_cell = [4, 2]\n\
         shape = {{ box = {{ min = [0, 0], max = [1, 0.0625] }} }}\n\
         velocity = [\"0.0020047485608360883*sin(17.27875959474386*X)\", \"0\"]\n\
         [[boundary]]\nwhere = {{ side = \"left\" }}\nfix = [\"x\"]\n\
         [[boundary]]\nwhere = {{ side = \"bottom\" }}\nfix = [\"y\"]\n\
         [[boundary]]\nwhere = {{ side = \"top\" }}\nfix = [\"y\"]\n\
         [output]\nevery = 1000\n"
    ));
    energies(&run.results())
}

/// Of each step Δv (M~ - M) Δv / 2 is lost, M the consistent mass that the points have: with a lumped
/// mass M~ decay at a rate in proportion to the time step, and no gain.
#[test]
fn a_lumped_mass_damps_at_first_order() {
    let rate = |steps: usize| {
        let energies = bar("ghost = \"off\"", "lumped", steps);
        let highest = energies.iter().copied().fold(0.0, f64::max);
        assert!(highest <= energies[0] * (1.0 + 1e-9), "{steps}: {highest} of {}", energies[0]);
        (energies[0] / energies[energies.len() - 1]).ln()
    };
    let rates = [59, 118, 236].map(rate);
    for pair in rates.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((0.85..1.15).contains(&order), "{rates:?}");
    }
}

/// A Ghost mass of a quarter of the density would take a third of it, at any time step.
#[test]
fn the_default_ghost_mass_takes_less_than_a_per_cent() {
    let energies = bar("", "consistent", 118);
    let kept = energies[energies.len() - 1] / energies[0];
    assert!((0.99..1.01).contains(&kept), "{kept}");
}
