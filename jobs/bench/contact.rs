//! What contact adds to an explicit step: a block of 10^6 points (1 % of them in contact) on a rigid floor,
//! beside the block alone.
//!
//! `cargo bench --bench contact [-- CELLS]`: cells per side of the block (50). Each deck runs with few and
//! with more steps; the difference of the processor times over that of the steps is what a step costs.

mod report;

use std::path::Path;
use std::process::{Command, Stdio};

use report::{children_seconds, machine};

/// Counted runs of each kind.
const RUNS: usize = 3;
/// Steps of the short and of the long run.
const STEPS: [usize; 2] = [2, 10];

fn deck(cells: usize, friction: Option<f64>) -> String {
    let h = 1.0 / cells as f64;
    let (low, size) = (-2.0 * h, 1.0 + 4.0 * h);
    let contact = friction.map_or(String::new(), |friction| {
        format!(
            "[[rigid]]\nname = \"floor\"\n\
             shape = {{ half_space = {{ point = [0, 0, 0], normal = [0, 0, 1] }} }}\n\
             [[contact]]\nbetween = [\"floor\", \"block\"]\nfriction = {friction}\n"
        )
    });
    format!(
        "[analysis]\ntype = \"explicit\"\nsteps = 2\nduration = 2e-5\n\
         [method]\nbasis = \"gimp\"\nmass = \"lumped\"\ndomain_update = \"stretch\"\n\
         [grid]\ntype = \"lattice\"\norigin = [{low}, {low}, {low}]\nsize = [{size}, {size}, {size}]\nh = {h}\n\
         [material.rubber]\nmodel = \"neo-hookean\"\nyoung = 1e6\npoisson = 0.3\n\
         [[body]]\nname = \"block\"\nmaterial = \"rubber\"\ndensity = 1000.0\n\
         shape = {{ box = {{ min = [0, 0, 0], max = [1, 1, 1] }} }}\n\
         [[load]]\ngravity = [0, 0, -10]\n[output]\nevery = 1000\n{contact}"
    )
}

/// Processor time of a step, s.
fn step(folder: &Path, cells: usize, friction: Option<f64>) -> f64 {
    std::fs::write(folder.join("case.toml"), deck(cells, friction)).expect("a scratch folder");
    let [short, long] = STEPS.map(|steps| {
        let before = children_seconds();
        let status = Command::new(env!("CARGO_BIN_EXE_mpm-par"))
            .args(["case.toml", "--out", "out", "--force"])
            .args(["--set", &format!("analysis.steps={steps}")])
            .args(["--set", &format!("analysis.duration={}", 1e-5 * steps as f64)])
            .current_dir(folder)
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .status()
            .expect("the program starts");
        assert!(status.success(), "the run ends well");
        children_seconds() - before
    });
    (long - short) / (STEPS[1] - STEPS[0]) as f64
}

fn main() {
    let cells = std::env::args().skip(1).find_map(|word| word.parse().ok()).unwrap_or(50);
    let folder = tempfile::tempdir().expect("a scratch folder");
    let points = (2 * cells as u64).pow(3);
    // Each point of the lowest layer has four corners on the floor.
    let corners = 4 * (2 * cells as u64).pow(2);
    println!("machine: {}\n{points} points, {corners} corners that touch", machine());
    println!(
        "| contact | s per step | share of contact | ns per corner that touches |\n|---|---|---|---|"
    );
    let least = |friction| {
        (0..RUNS).map(|_| step(folder.path(), cells, friction)).fold(f64::INFINITY, f64::min)
    };
    let alone = least(None);
    println!("| none | {alone:.3} | | |");
    for (name, friction) in [("smooth", 0.0), ("friction 0.3", 0.3)] {
        let with = least(Some(friction));
        let (share, each) = (1.0 - alone / with, (with - alone) / corners as f64 * 1e9);
        println!("| {name} | {with:.3} | {:.1} % | {each:.0} |", 100.0 * share);
    }
}
