//! Point-steps per second and core of explicit runs: the whole program, everything in a step
//! included, beside the machine's limits.
//!
//! `cargo bench --bench explicit [-- WORDS]`: the cases whose names hold one of the words;
//! `-- ranks` (and words) compares two ranks with one, in wall time, and wants an idle machine;
//! `-- limits` (and words) holds each phase of the lumped cases against the machine's limits.
//!
//! Each case runs twice, with few and with more steps; the difference of the processor times
//! over the difference of the steps is what a step costs, free of set-up and output.

mod counts;
mod limits;
mod report;

use std::path::Path;
use std::process::{Command, Stdio};

use counts::Numbers;
use limits::Machine;
use report::{children_seconds, machine};

/// Counted pairs of runs of each case.
const PAIRS: usize = 5;
/// Runs of each length beside the limits.
const RUNS: usize = 12;
/// Steps of the short and of the long run.
const SHORT: usize = 4;
const LONG: usize = 16;
/// Of the long run on two ranks: whatever else the machine does for a moment counts less.
const LONGEST: usize = 64;

const PHASES: [&str; 6] = ["locate", "assemble", "solve", "update", "migrate", "output"];

#[derive(Clone, Copy)]
struct Case {
    dimension: usize,
    basis: &'static str,
    mass: &'static str,
    plastic: bool,
    /// Cells per side of the block of material.
    cells: usize,
}

impl Case {
    fn name(&self) -> String {
        let model = if self.plastic { "plastic" } else { "elastic" };
        format!("{}d-{}-{}-{model}", self.dimension, self.basis, self.mass)
    }

    fn points(&self) -> usize {
        (2 * self.cells).pow(self.dimension as u32)
    }

    /// A block off the grid lines with 2 points per cell and axis that shakes in all directions;
    /// with plastic flow most points yield.
    fn deck(&self, steps: usize) -> String {
        let Case { dimension, basis, mass, cells, .. } = *self;
        let list = |value: f64| format!("{:?}", vec![value; dimension]);
        let material =
            if self.plastic { "model = \"von-mises\"\nyield = 20" } else { "model = \"hencky\"" };
        let domains = if basis == "gimp" { "domain_update = \"stretch\"\n" } else { "" };
        let velocity = match dimension {
            2 => r#"["3*sin(0.5*X)*cos(0.4*Y)", "3*cos(0.45*X)"]"#,
            _ => r#"["3*sin(0.5*X)*cos(0.4*Y)", "3*cos(0.45*X)", "2*sin(0.5*Z + 0.3*X)"]"#,
        };
        format!(
            "title = \"{}\"\n[analysis]\ntype = \"explicit\"\nsteps = {steps}\nduration = {:e}\n\
             [method]\nbasis = \"{basis}\"\n{domains}mass = \"{mass}\"\nstress_update = \"usl\"\n\
             [ghost]\nmass_factor = 0.25\n\
             [grid]\ntype = \"lattice\"\norigin = {}\nsize = {}\nh = 1.0\n\
             [material.m]\n{material}\nyoung = 1e4\npoisson = 0.3\n\
             [[body]]\nname = \"block\"\nmaterial = \"m\"\ndensity = 1.0\n\
             shape = {{ box = {{ min = {}, max = {} }} }}\npoints_per_cell = {:?}\n\
             velocity = {velocity}\n[output]\nevery = 1000000\nfields = [\"stress\"]\n",
            self.name(),
            1e-3 * steps as f64,
            list(-2.0),
            list(cells as f64 + 4.0),
            list(0.13),
            list(cells as f64 + 0.13),
            vec![2; dimension],
        )
    }

    /// What the counts of a step are made from, at its start. Each axis of a cell holds one point
    /// whose domain lies inside and one whose domain reaches into the next cell.
    fn numbers(&self) -> Numbers {
        let power = |base: f64| base.powi(self.dimension as i32);
        let side = self.cells as f64;
        let gimp = self.basis == "gimp";
        let (nodes, groups, reach) =
            if gimp { (power(2.5), 1.0, 1.0) } else { (power(2.0), power(0.5), 0.0) };
        Numbers {
            dimension: self.dimension,
            gimp,
            plastic: self.plastic,
            nodes,
            groups,
            group_nodes: nodes * groups,
            cells: power((side + reach) / (2.0 * side)),
            active: power((side + reach + 1.0) / (2.0 * side)),
            ..Numbers::default()
        }
    }

    fn run(&self, folder: &Path, steps: usize, ranks: usize) -> Used {
        std::fs::write(folder.join("case.toml"), self.deck(steps)).expect("a scratch folder");
        let program = env!("CARGO_BIN_EXE_mpm-par");
        let mut job = match ranks {
            1 => Command::new(program),
            _ => {
                let mut job = Command::new("mpirun");
                job.args(["-n", &ranks.to_string(), program]);
                job
            }
        };
        for (name, value) in [
            ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
            ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
            ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
            ("OMPI_MCA_hwloc_base_binding_policy", "none"),
            ("OMP_NUM_THREADS", "1"),
        ] {
            job.env(name, value);
        }
        let before = children_seconds();
        let status = job
            .args(["case.toml", "--out", "out", "--force"])
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .status()
            .expect("the program starts");
        assert!(status.success(), "{} ran to its end", self.name());
        let text = std::fs::read_to_string(folder.join("out/summary.json")).expect("a summary");
        let summary: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let wall = |name: &str| summary["wall_seconds"][name].as_f64().unwrap_or(0.0);
        Used {
            processor: children_seconds() - before,
            stepping: wall("total") - wall("setup"),
            phases: PHASES.map(wall),
            iterations: iterations(&folder.join("out/history.csv")),
        }
    }
}

/// What a run took, s.
struct Used {
    processor: f64,
    /// Wall, without set-up.
    stepping: f64,
    /// Wall.
    phases: [f64; PHASES.len()],
    iterations: f64,
}

/// Sum of the column `linear_iterations`.
fn iterations(history: &Path) -> f64 {
    let text = std::fs::read_to_string(history).expect("a history");
    let mut lines = text.lines().map(|line| line.split(','));
    let column = lines
        .next()
        .and_then(|mut titles| titles.position(|title| title.starts_with("linear_iterations")))
        .expect("the column");
    lines.filter_map(|mut cells| cells.nth(column)?.parse::<f64>().ok()).sum()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (dimension, basis, cells) in
        [(2, "mpm", 160), (2, "gimp", 160), (3, "mpm", 24), (3, "gimp", 24)]
    {
        for plastic in [false, true] {
            for mass in ["lumped", "consistent"] {
                cases.push(Case { dimension, basis, mass, plastic, cells });
            }
        }
    }
    cases
}

/// Domains of corners; the counts of bytes and operations do not know them.
fn corner_cases() -> [Case; 2] {
    [(2, "cpdi2", 160), (3, "cpdi1", 24)].map(|(dimension, basis, cells)| Case {
        dimension,
        basis,
        mass: "lumped",
        plastic: true,
        cells,
    })
}

/// The cases whose names hold one of the words; all without words.
fn chosen(cases: Vec<Case>, words: &[String]) -> impl Iterator<Item = Case> + '_ {
    let named = |case: &Case| words.iter().any(|word| case.name().contains(word.as_str()));
    cases.into_iter().filter(move |case| words.is_empty() || named(case))
}

fn main() {
    let words: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let folder = tempfile::tempdir().expect("a scratch folder");
    println!("machine: {}", machine());
    let limits = limits::measured();
    match words.first().map(String::as_str) {
        Some("ranks") => return two_ranks(folder.path(), &words[1..]),
        Some("limits") => return beside_limits(folder.path(), &words[1..], &limits),
        _ => {}
    }
    println!(
        "\nprocessor time, {PAIRS} runs of {LONG} steps less {PAIRS} of {SHORT}; shares of wall time\n\
         | case | points | million point-steps/s, median (worst to best) | ns | {} | other | iterations/step |",
        PHASES[..5].join(" | ")
    );
    println!("|---|---|---|---|{}---|---|", "---|".repeat(5));
    let mut costs: Vec<(String, f64)> = Vec::new();
    for case in chosen(cases(), &words) {
        let name = case.name();
        let cost = row(folder.path(), &case);
        if let Some((_, lumped)) =
            costs.iter().find(|(other, _)| *other == name.replace("consistent", "lumped"))
        {
            println!("  consistent over lumped: {:.2}", cost / lumped);
        }
        costs.push((name, cost));
    }
}

/// Prints a case; returns its ns per point and step.
fn row(folder: &Path, case: &Case) -> f64 {
    let steps = (LONG - SHORT) as f64;
    let (mut costs, mut shares) = (Vec::new(), vec![Vec::new(); PHASES.len()]);
    let mut iterations = 0.0;
    for _ in 0..PAIRS {
        let (short, long) = (case.run(folder, SHORT, 1), case.run(folder, LONG, 1));
        costs.push((long.processor - short.processor) / (steps * case.points() as f64) * 1e9);
        let whole = long.stepping - short.stepping;
        for (k, share) in shares.iter_mut().enumerate() {
            share.push((long.phases[k] - short.phases[k]) / whole);
        }
        iterations = (long.iterations - short.iterations) / steps;
    }
    let of = |ns: f64| 1e3 / ns;
    let (least, most) =
        costs.iter().fold((f64::MAX, 0.0f64), |(low, high), c| (low.min(*c), high.max(*c)));
    let cost = median(costs);
    let shares: Vec<f64> = shares.into_iter().map(median).collect();
    let named: Vec<String> = shares[..5].iter().map(|s| format!("{:.0} %", 100.0 * s)).collect();
    println!(
        "| {} | {} | {:.2} ({:.2} to {:.2}) | {cost:.0} | {} | {:.0} % | {iterations:.0} |",
        case.name(),
        case.points(),
        of(cost),
        of(most),
        of(least),
        named.join(" | "),
        100.0 * (1.0 - shares[..5].iter().sum::<f64>()),
    );
    cost
}

/// Phase by phase: the least wall time of the steps beside what their bytes and operations need.
fn beside_limits(folder: &Path, words: &[String], machine: &Machine) {
    println!(
        "\nper point and step; wall time: the least of {RUNS} runs of {LONG} steps less the least \
         of {RUNS} of {SHORT}"
    );
    counts::print_head();
    for case in chosen(cases(), words).filter(|case| case.mass == "lumped") {
        let numbers = case.numbers();
        // The five phases of the counts, then the whole.
        let mut least = [[f64::MAX; 6]; 2];
        for _ in 0..RUNS {
            for (least, steps) in least.iter_mut().zip([SHORT, LONG]) {
                let used = case.run(folder, steps, 1);
                let [locate, assemble, solve, update, migrate, output] = used.phases;
                let known = locate + assemble + solve + update + migrate + output;
                let other = used.stepping - known;
                let taken = [locate, assemble, update, migrate, other, used.stepping - output];
                for (least, taken) in least.iter_mut().zip(taken) {
                    *least = least.min(taken);
                }
            }
        }
        let steps = ((LONG - SHORT) * case.points()) as f64;
        let ns = |k: usize| (least[1][k] - least[0][k]) / steps * 1e9;
        let counts = numbers.explicit();
        for (k, count) in counts.iter().enumerate() {
            counts::print(&case.name(), count, ns(k), machine);
        }
        let sum = |of: fn(&counts::Count) -> f64| counts.iter().map(of).sum::<f64>();
        let step = counts::Count {
            phase: "step",
            bytes: sum(|count| count.bytes),
            operations: sum(|count| count.operations),
            wide: false,
        };
        counts::print(&case.name(), &step, ns(5), machine);
    }
}

/// Wall time of the steps on one rank over that on two, in turn, and twice that of one rank over
/// that of two independent copies at once: the most that the machine allows.
fn two_ranks(folder: &Path, words: &[String]) {
    println!(
        "\n| case | one rank over two, wall: median (least to most) | by the least times | two \
         copies | of that |\n|---|---|---|---|---|"
    );
    let places = [folder.to_path_buf(), folder.join("copy")];
    std::fs::create_dir_all(&places[1]).expect("a folder for the copy");
    let all = cases().into_iter().chain(corner_cases()).collect();
    for case in chosen(all, words) {
        let cost = |folder: &Path, ranks: usize| {
            case.run(folder, LONGEST, ranks).stepping - case.run(folder, SHORT, ranks).stepping
        };
        let (mut gains, mut limits, mut least) = (Vec::new(), Vec::new(), [f64::MAX; 2]);
        for _ in 0..PAIRS {
            let [alone, shared] = [1, 2].map(|ranks| cost(folder, ranks));
            gains.push(alone / shared);
            least = [least[0].min(alone), least[1].min(shared)];
            let both: f64 = std::thread::scope(|scope| {
                places
                    .each_ref()
                    .map(|place| scope.spawn(|| cost(place, 1)))
                    .map(|copy| copy.join().expect("the copy ends"))
                    .iter()
                    .sum()
            });
            limits.push(4.0 * alone / both);
        }
        gains.sort_by(f64::total_cmp);
        let (gain, limit) = (gains[PAIRS / 2], median(limits));
        println!(
            "| {} | {gain:.2} ({:.2} to {:.2}) | {:.2} | {limit:.2} | {:.0} % |",
            case.name(),
            gains[0],
            gains[PAIRS - 1],
            least[0] / least[1],
            100.0 * gain / limit
        );
    }
}
