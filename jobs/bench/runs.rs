//! Whole runs of the program: the §7.3 beam, two ranks beside one, memory per point and node.
//!
//! `cargo bench --bench runs [-- beam|pairs|mesh|dense|memory|triad|products ...]`. Wall times: on a machine that is busy
//! they say little; the load is printed beside them.

mod limits;
mod products;
mod report;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use report::machine;

/// Runs of each kind; pairs alternate one and two ranks.
const REPEATS: usize = 5;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let wanted = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word));
    println!("machine: {}, load {}", machine(), load());
    if wanted("triad") {
        let [one, two] = [1, 2].map(limits::triad_of);
        println!("triad, GB/s by wall time: one core {one:.1}, two together {two:.1}");
    }
    if wanted("products") {
        products::products();
    }
    if wanted("beam") {
        beam();
    }
    if wanted("pairs") {
        // The papers' analyses take 20 to 50 steps.
        pairs("2D gimp, 2 x 2 points, 20 steps", "scaling", &["grid.h=0.02", "analysis.steps=20"]);
        let many = ["grid.h=0.04", "body.0.points_per_cell=[4,4]", "analysis.steps=40"];
        pairs("2D gimp, 4 x 4 points, 40 steps", "scaling", &many);
        pairs("3D gimp, 4 steps", "scaling", &block_3d(30, &["analysis.steps=4"]));
        let dense = [
            "analysis.steps=12",
            "body.0.points_per_cell=[3,3,3]",
            "method.basis=\"mpm\"",
            "method.domain_update=",
        ];
        pairs("3D mpm, 3 x 3 x 3 points, 12 steps", "scaling", &block_3d(20, &dense));
    }
    if wanted("mesh") {
        for basis in ["mpm", "cpdi2"] {
            let basis = format!("method.basis=\"{basis}\"");
            let name = format!("mesh of quadrilaterals, {basis}, 16 steps");
            pairs(&name, "doughnut-10", &[&MESH[..], &[&basis]].concat());
        }
    }
    if wanted("dense") {
        let dense = [
            "output.every=16",
            "grid.generate.annulus.radial=40",
            "grid.generate.annulus.around=320",
            "analysis.steps=16",
            "body.0.points_per_cell=[4,4]",
            "method.basis=\"cpdi2\"",
        ];
        pairs("mesh of quadrilaterals, cpdi2, 4 x 4 points, 16 steps", "doughnut-10", &dense);
    }
    if wanted("memory") {
        memory();
    }
}

/// A finished run's summary.
struct Summary(serde_json::Value);

impl Summary {
    fn number(&self, path: &str) -> f64 {
        self.0.pointer(path).and_then(|value| value.as_f64()).unwrap_or(f64::NAN)
    }

    fn wall(&self, phase: &str) -> f64 {
        self.number(&format!("/wall_seconds/{phase}"))
    }
}

fn input(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("inputs").join(name)
}

fn run(ranks: usize, deck: &Path, sets: &[&str]) -> Summary {
    run_in("runs", ranks, deck, sets)
}

/// Two independent runs on one rank at once: what the machine leaves to each of two busy cores.
fn two_copies(deck: &Path, sets: &[&str]) -> [Summary; 2] {
    std::thread::scope(|scope| {
        let other = scope.spawn(|| run_in("runs-copy", 1, deck, sets));
        [run_in("runs", 1, deck, sets), other.join().expect("the copy ends")]
    })
}

fn run_in(folder: &str, ranks: usize, deck: &Path, sets: &[&str]) -> Summary {
    let out = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(folder);
    // Removing the last run's files is not part of this one.
    std::fs::remove_dir_all(&out).or_else(|_| std::fs::create_dir_all(&out)).expect("a folder");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/mpirun.sh");
    let mut command = Command::new("sh");
    command.arg(script).arg(ranks.to_string()).arg(env!("CARGO_BIN_EXE_mpm-par")).arg(deck);
    command.arg("--force").arg("--out").arg(&out);
    for set in sets {
        command.arg("--set").arg(set);
    }
    // Bound, two copies would share a core.
    command.env("OMPI_MCA_hwloc_base_binding_policy", "none");
    command.stdin(Stdio::null()).stdout(Stdio::null());
    let status = command.status().expect("the program starts");
    assert!(status.success(), "{} {sets:?} on {ranks} ranks", deck.display());
    let text = std::fs::read_to_string(out.join("summary.json")).expect("summary.json");
    Summary(serde_json::from_str(&text).expect("JSON"))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn load() -> String {
    std::fs::read_to_string("/proc/loadavg")
        .map_or_else(|_| "unknown".into(), |text| text[..text.len().min(14)].to_string())
}

/// Lagrangian §7.3 at h = 0.125 m with 6 x 6 points.
fn beam() {
    let runs: Vec<Summary> = (0..REPEATS)
        .map(|_| {
            let sets = ["grid.h=0.125", "body.0.points_per_cell=[6,6]"];
            run(1, &input("beam.toml"), &sets)
        })
        .collect();
    let of = |phase: &str| median(runs.iter().map(|run| run.wall(phase)).collect());
    println!("\nbeam, h = 0.125 m, 6 x 6 points, 1 rank, medians of {REPEATS}");
    println!(
        "total {:.2} s: assemble {:.2}, solve {:.2}, locate {:.2}, update {:.2}, output {:.2}; \
         {} evaluations of {} points; load {}",
        of("total"),
        of("assemble"),
        of("solve"),
        of("locate"),
        of("update"),
        of("output"),
        runs[0].number("/newton_iterations/total"),
        runs[0].number("/points"),
        load()
    );
}

/// `inputs/doughnut-10.toml` on a finer mesh: 205 000 points, solved by the program's defaults.
const MESH: [&str; 4] = [
    // One frame, at the end, as in the other pairs.
    "output.every=16",
    "grid.generate.annulus.radial=80",
    "grid.generate.annulus.around=640",
    "analysis.steps=16",
];

/// The block of `inputs/scaling.toml` as a cube of `cells` a side, and what `more` changes.
fn block_3d(cells: usize, more: &[&str]) -> Vec<String> {
    let h = 1.0 / cells as f64;
    let block = [
        format!("grid.h={h}"),
        "grid.origin=[0.0,0.0,0.0]".into(),
        format!("grid.size=[{a},{a},{a}]", a = 1.0 + 2.0 * h),
        "body.0.shape={box={min=[0,0,0],max=[1,1,1]}}".into(),
        "body.0.points_per_cell=[2,2,2]".into(),
        "boundary.1.fix=[\"x\"]".into(),
        "boundary.0.where={side=\"back\"}".into(),
        "boundary.0.fix=[\"z\",\"y\"]".into(),
        "load.0.gravity=[0,0,-10]".into(),
        "analysis.steps=2".into(),
    ];
    block.into_iter().chain(more.iter().map(|set| (*set).to_string())).collect()
}

/// Two ranks beside one and beside two independent copies, in turn. The copies share nothing but
/// the machine: twice the time of one alone over theirs is the most that two ranks can gain.
fn pairs<S: AsRef<str>>(name: &str, deck: &str, sets: &[S]) {
    let sets: Vec<&str> = sets.iter().map(AsRef::as_ref).collect();
    let sets = &sets[..];
    let deck = input(&format!("{deck}.toml"));
    let (mut runs, mut copies) = ([Vec::new(), Vec::new()], Vec::new());
    for _ in 0..REPEATS {
        for ranks in [1, 2] {
            runs[ranks - 1].push(run(ranks, &deck, sets));
        }
        copies.push(two_copies(&deck, sets));
    }
    println!("\ntwo ranks over one: {name}, {REPEATS} rounds in turn, medians");
    println!(
        "| phase | 1 rank, s | 2 ranks, s | gain | by the least times | two copies' gain | of \
         that | gains |\n|---|---|---|---|---|---|---|---|"
    );
    let phases = ["total", "solve", "assemble", "locate", "setup", "update", "migrate", "output"];
    for phase in phases.into_iter().chain(["total less setup"]) {
        let wall = |run: &Summary| match phase {
            "total less setup" => run.wall("total") - run.wall("setup"),
            _ => run.wall(phase),
        };
        let times = [0, 1].map(|k| runs[k].iter().map(wall).collect::<Vec<_>>());
        let gains: Vec<f64> = (0..REPEATS).map(|k| times[0][k] / times[1][k]).collect();
        let limits = (0..REPEATS)
            .map(|k| 4.0 * times[0][k] / copies[k].iter().map(wall).sum::<f64>())
            .collect();
        let (gain, limit) = (median(gains.clone()), median(limits));
        let [alone, shared] = times.each_ref().map(|t| t.iter().copied().fold(f64::MAX, f64::min));
        let gains: Vec<String> = gains.iter().map(|gain| format!("{gain:.2}")).collect();
        println!(
            "| {phase} | {:.3} | {:.3} | {gain:.2} | {:.2} | {limit:.2} | {:.0} % | {} |",
            median(times[0].clone()),
            median(times[1].clone()),
            alone / shared,
            100.0 * gain / limit,
            gains.join(", ")
        );
    }
    let linear = [0, 1].map(|k| runs[k][0].number("/linear_iterations/total"));
    let memory = [0, 1].map(|k| runs[k][0].number("/peak_memory_bytes/max") / 1e6);
    println!(
        "{} points; linear iterations {} and {}; memory of the largest rank {:.0} and {:.0} MB; \
         load {}",
        runs[0][0].number("/points"),
        linear[0],
        linear[1],
        memory[0],
        memory[1],
        load()
    );
}

/// Peak memory over the size: the slope between runs that differ in points alone, and in grid
/// and points together.
fn memory() {
    println!("\nmemory, 1 rank");
    println!("| case | bytes per point | bytes per populated cell (about one node) |");
    println!("|---|---|---|");
    let sizes = |sets: &[String]| {
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let run = run(1, &input("scaling.toml"), &sets);
        let at = |path: &str| run.number(path);
        [at("/points"), at("/cells_populated"), at("/peak_memory_bytes/max")]
    };
    // bytes = constant + p points + q cells: more points in the same cells, then more cells.
    let fit = |name: &str, few: [f64; 3], many: [f64; 3], fine: [f64; 3]| {
        let p = (many[2] - few[2]) / (many[0] - few[0]);
        let q = (fine[2] - few[2] - p * (fine[0] - few[0])) / (fine[1] - few[1]);
        println!("| {name} | {p:.0} | {q:.0} |");
    };
    let plane = |n: usize, per: usize| {
        vec![
            format!("grid.h={}", 1.0 / n as f64),
            format!("body.0.points_per_cell=[{per},{per}]"),
            "analysis.steps=2".into(),
        ]
    };
    fit("2D gimp", sizes(&plane(24, 2)), sizes(&plane(24, 4)), sizes(&plane(48, 2)));
    let solid = |n: usize, per: usize| {
        block_3d(n, &[&format!("body.0.points_per_cell=[{per},{per},{per}]")])
    };
    fit("3D gimp", sizes(&solid(14, 2)), sizes(&solid(14, 3)), sizes(&solid(22, 2)));
}
