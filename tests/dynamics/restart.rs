//! A dynamic run that goes on from a checkpoint ends as the run in one piece: bit by bit on as
//! many ranks, to round-off on others.

use std::path::{Path, PathBuf};

use super::ghosts::contact;
use super::program::{difference, history, points_of, repeatable};
use crate::common::run::{Results, Run};

const RANKS: [usize; 3] = [1, 2, 3];
const STEPS: usize = 12;

fn last_checkpoint(run: &Results) -> PathBuf {
    run.directory.join(format!("checkpoint-{STEPS:06}.h5"))
}

/// Every number of ranks goes on from the middle of what each of `writers` wrote.
fn every_number_of_ranks_goes_on(deck: &Run, writers: &[usize], tolerance: f64) {
    let on = |ranks: usize| {
        let run = deck.clone().ranks(ranks).set("output.checkpoint={ every = 6, keep = 9 }");
        repeatable(ranks).into_iter().fold(run, Run::word)
    };
    let wholes: Vec<Results> = writers.iter().map(|&ranks| on(ranks).results()).collect();
    let reference = points_of(&last_checkpoint(&wholes[0]));
    for (&wrote, whole) in writers.iter().zip(&wholes) {
        let middle = whole.directory.join("checkpoint-000006.h5");
        for goes_on in RANKS {
            let part = on(goes_on).word("--restart").word(middle.to_string_lossy()).results();
            let end = points_of(&last_checkpoint(&part));
            let (error, field) = difference(&reference, &end);
            assert!(error < tolerance, "{wrote} -> {goes_on} ranks: {field} {error:e}");
            let rows = history(&part.directory);
            assert_eq!(rows.len(), STEPS - 6, "a new directory holds the steps that were left");
            if wrote == goes_on {
                let (error, field) = difference(&points_of(&last_checkpoint(whole)), &end);
                assert_eq!(error, 0.0, "{wrote} ranks: {field} is not the same bit by bit");
                assert_eq!(rows[..], history(&whole.directory)[6..], "{wrote} ranks");
            }
        }
    }
}

fn has_checkpoints(directory: &Path, steps: &[usize]) -> bool {
    steps.iter().all(|step| directory.join(format!("checkpoint-{step:06}.h5")).exists())
}

#[test]
fn explicit_with_the_stabilised_mass() {
    every_number_of_ranks_goes_on(&contact(STEPS), &RANKS, 1e-10);
}

#[test]
fn explicit_with_the_lumped_mass_and_plasticity() {
    let deck = contact(STEPS)
        .set("method.mass=\"lumped\"")
        .set("method.stress_update=\"musl\"")
        .set("method.velocity_update=0.9")
        .set("material.soft.model=\"von-mises\"")
        .set("material.soft.yield=1");
    every_number_of_ranks_goes_on(&deck, &[2], 1e-10);
}

/// The velocity gradients of the points are part of the state.
#[test]
fn explicit_with_an_affine_transfer() {
    let deck = contact(STEPS)
        .set("method.gimp_edge=\"continued\"")
        .set("method.stress_update=\"musl\"")
        .set("method.mass=\"lumped\"")
        .set("method.velocity_update=\"apic\"");
    every_number_of_ranks_goes_on(&deck, &RANKS, 1e-10);
}

/// The domains of this basis are part of the state.
#[test]
fn explicit_with_cpdi2() {
    every_number_of_ranks_goes_on(&contact(STEPS).set("method.basis=\"cpdi2\""), &[2], 1e-10);
}

/// Steps that follow the stability limit start again with the same limit.
#[test]
fn explicit_with_steps_by_the_stability_limit() {
    let text = std::fs::read_to_string(crate::common::run::input("ghost-collision"))
        .expect("a deck")
        .replace("steps = 1000", "cfl = 0.4")
        .replace("duration = 3.5", "duration = 0.06");
    let run = |name: &str| {
        let folder = tempfile::tempdir().expect("a scratch folder");
        let path = folder.path().join(format!("{name}.toml"));
        std::fs::write(&path, &text).expect("the scratch folder is writable");
        (folder, Run::file(path).ranks(2).set("output.checkpoint={ every = 1, keep = 99 }"))
    };
    let (_deck, run) = run("limit");
    let whole = run.results();
    let steps = whole.count("steps_completed");
    assert!(steps > 2, "{steps}");
    let middle = whole.directory.join("checkpoint-000002.h5");
    let part = run.word("--restart").word(middle.to_string_lossy()).results();
    assert_eq!(part.count("steps_completed"), steps);
    let end = format!("checkpoint-{steps:06}.h5");
    let ends = [&whole, &part].map(|run| points_of(&run.directory.join(&end)));
    assert_eq!(difference(&ends[0], &ends[1]).0, 0.0);
}

fn implicit(alpha: &str) -> Run {
    contact(STEPS)
        .set("analysis.type=\"implicit-dynamic\"")
        .set("analysis.tolerance=1e-12")
        .set(format!("analysis.hht_alpha={alpha}"))
        .set("ghost.stiffness_factor=0.1")
}

#[test]
fn implicit_dynamic() {
    every_number_of_ranks_goes_on(&implicit("0.0"), &[2], 1e-10);
}

#[test]
fn implicit_dynamic_with_dissipation() {
    every_number_of_ranks_goes_on(&implicit("-0.1"), &RANKS, 1e-10);
}

/// A run that was cut short goes on in its own directory, from the last checkpoint.
#[test]
fn a_directory_is_continued() {
    for kind in ["explicit", "implicit-dynamic"] {
        let run = contact(STEPS)
            .ranks(2)
            .set(format!("analysis.type=\"{kind}\""))
            .set("output.every=3")
            .set("output.checkpoint={ every = 4, keep = 9 }");
        let implicit = kind == "implicit-dynamic";
        let run = if implicit { run.set("ghost.stiffness_factor=0.1") } else { run };
        let run = repeatable(2).into_iter().fold(run, Run::word);
        let whole = run.results();
        let folder = run.results().into_folder();
        let out = folder.path().join("out");
        assert!(has_checkpoints(&out, &[4, 8, STEPS]), "{kind}");
        std::fs::remove_file(out.join(format!("checkpoint-{STEPS:06}.h5"))).expect("removable");
        let resumed = run.clone().word("--restart").word("last").attempt_in(folder);
        assert_eq!(resumed.code, 0, "{}", resumed.stderr);
        let resumed = resumed.results();
        assert_eq!(history(&resumed.directory), history(&whole.directory), "{kind}");
        for series in ["points.xdmf", "grid.xdmf"] {
            assert_eq!(resumed.text(series), whole.text(series), "{kind}: {series}");
        }
    }
}
