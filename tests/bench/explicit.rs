//! Point-steps per second and core of explicit runs: the whole program, everything in a step
//! included, beside the machine's limits.
//!
//! `cargo bench --bench explicit [-- WORDS]`: the cases whose names hold one of the words;
//! `-- ranks` (and words) compares two ranks with one, in wall time, and wants an idle machine.
//!
//! Each case runs twice, with few and with more steps; the difference of the processor times
//! over the difference of the steps is what a step costs, free of set-up and output.

mod limits;
mod report;

use std::path::Path;
use std::process::{Command, Stdio};

use report::machine;

/// Counted pairs of runs of each case.
const PAIRS: usize = 5;
/// Steps of the short and of the long run.
const SHORT: usize = 4;
const LONG: usize = 16;

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

    /// Bytes that a lumped step moves for one point, each array counted once per pass over it
    /// (nodal arrays stay in the caches), and floating-point operations from the formulas, a
    /// logarithm or an exponential as 20, a root or a division as one.
    fn counted(&self) -> (f64, f64) {
        let d = self.dimension as f64;
        let gimp = self.basis == "gimp";
        let nodes = if gimp { 2.5f64.powf(d) } else { 2f64.powf(d) };
        let (tensor, plane, vector) = (72.0, 8.0 * d * d, 8.0 * d);
        let row = nodes * (8.0 + vector) + 16.0;
        let bytes = [
            // kept in case the step fails; basis; groups; populated cells; weights of the nodes
            2.0 * (tensor + vector),
            vector * if gimp { 2.0 } else { 1.0 } + nodes * (16.0 + vector) + 8.0,
            8.0 * nodes + 24.0,
            vector + 4.0,
            8.0 * nodes + 16.0,
            // mass; momentum and force; rates and velocities; increments; their check
            8.0 * nodes + 24.0,
            row + tensor + vector + 16.0,
            8.0 * nodes + 16.0 + 3.0 * vector,
            row + plane + vector,
            2.0 * vector + plane,
            // F; domain; stress; position; ledger; migration
            2.0 * tensor + plane,
            tensor + 8.0 + vector * if gimp { 2.0 } else { 1.0 },
            plane + 3.0 * tensor + 44.0,
            3.0 * vector,
            8.0 + 2.0 * vector,
            vector + 56.0,
        ];
        let spectral = if d == 2.0 { 20.0 + 2.0 * 16.0 } else { 150.0 + 2.0 * 54.0 };
        let plastic = if self.plastic { 45.0 + 60.0 } else { 0.0 };
        let operations = [
            // basis; momentum and force; rates and velocities; increments
            if gimp { 20.0 * d } else { 4.0 * d } + nodes * (d * d - 1.0),
            d + d * d + nodes * (2.0 * d + 2.0 * d * d),
            nodes * 2.0 * d + 2.0 * d,
            nodes * (2.0 * d * d + 2.0 * d),
            // F; trial strain; principal axes, logarithms, stress; return; ledger
            6.0 * d * d,
            2.0 * d * d * d + d * d * (d + 1.0),
            spectral + 60.0 + 25.0,
            plastic,
            30.0,
        ];
        (bytes.iter().sum(), operations.iter().sum())
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

/// Processor time of all children that have ended, s.
fn children_seconds() -> f64 {
    // SAFETY: the structure is plain numbers, which the call fills in.
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        libc::getrusage(libc::RUSAGE_CHILDREN, &mut usage);
        usage
    };
    let seconds = |t: libc::timeval| t.tv_sec as f64 + 1e-6 * t.tv_usec as f64;
    seconds(usage.ru_utime) + seconds(usage.ru_stime)
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

fn main() {
    let words: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let folder = tempfile::tempdir().expect("a scratch folder");
    println!("machine: {}", machine());
    let triad = limits::triad();
    let peaks = limits::peaks();
    println!("triad bandwidth of one core: {triad:.1} GB/s");
    for peak in &peaks {
        println!("peak arithmetic, {}: {:.1} GFLOP/s", peak.name, peak.gflops);
    }
    if words.iter().any(|word| word == "ranks") {
        return two_ranks(folder.path(), &words);
    }
    println!(
        "\nprocessor time, {PAIRS} runs of {LONG} steps less {PAIRS} of {SHORT}; shares of wall time\n\
         | case | points | million point-steps/s, median (worst to best) | ns | {} | other | iterations/step |",
        PHASES[..5].join(" | ")
    );
    println!("|---|---|---|---|{}---|---|", "---|".repeat(5));
    let mut costs: Vec<(String, f64)> = Vec::new();
    for case in cases() {
        let name = case.name();
        if !words.is_empty() && !words.iter().any(|word| name.contains(word.as_str())) {
            continue;
        }
        let cost = row(folder.path(), &case);
        if case.mass == "lumped" {
            let (bytes, operations) = case.counted();
            println!(
                "  counted: {bytes:.0} bytes = {:.0} ns at the triad, {operations:.0} operations = \
                 {:.0} ns at the baseline peak",
                bytes / triad,
                operations / peaks[0].gflops
            );
        }
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

/// Wall time of the steps on one rank over that on two, in turn, and twice that of one rank over
/// that of two independent copies at once: the most that the machine allows.
fn two_ranks(folder: &Path, words: &[String]) {
    println!(
        "\n| case | one rank over two, wall: median (least to most) | two copies | of that |\n\
         |---|---|---|---|"
    );
    let named = |case: &Case| words.iter().any(|word| case.name().contains(word.as_str()));
    let places = [folder.to_path_buf(), folder.join("copy")];
    std::fs::create_dir_all(&places[1]).expect("a folder for the copy");
    for case in cases().into_iter().filter(|case| words.len() == 1 || named(case)) {
        let cost = |folder: &Path, ranks: usize| {
            case.run(folder, LONG, ranks).stepping - case.run(folder, SHORT, ranks).stepping
        };
        let (mut gains, mut limits) = (Vec::new(), Vec::new());
        for _ in 0..PAIRS {
            let alone = cost(folder, 1);
            gains.push(alone / cost(folder, 2));
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
            "| {} | {gain:.2} ({:.2} to {:.2}) | {limit:.2} | {:.0} % |",
            case.name(),
            gains[0],
            gains[PAIRS - 1],
            100.0 * gain / limit
        );
    }
}
