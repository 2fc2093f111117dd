//! Runs a deck through the program, as a user would, and reads what it leaves.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;

use tempfile::TempDir;

use super::room::Room;
use super::{job, left};

/// Seconds after which `mpirun` kills a job: a deadlock fails instead of hanging.
const TIME_LIMIT: u32 = 900;

/// `inputs/NAME.toml` of this project.
pub fn input(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("inputs").join(format!("{name}.toml"))
}

/// One call of the program.
#[derive(Clone)]
pub struct Run {
    deck: Deck,
    ranks: usize,
    words: Vec<String>,
    env: Vec<(String, String)>,
    limit: u32,
}

#[derive(Clone)]
enum Deck {
    File(PathBuf),
    /// Written into the scratch folder as `deck.toml`.
    Text(String),
}

/// What a call left: its exit code, its words, and a scratch folder with the results in `out`.
pub struct Outcome {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
    pub folder: TempDir,
}

impl Run {
    /// A deck of `inputs/`, on one rank.
    pub fn of(name: &str) -> Self {
        Self::file(input(name))
    }

    pub fn file(path: impl Into<PathBuf>) -> Self {
        Run {
            deck: Deck::File(path.into()),
            ranks: 1,
            words: Vec::new(),
            env: Vec::new(),
            limit: TIME_LIMIT,
        }
    }

    /// A deck given as text.
    pub fn text(text: &str) -> Self {
        Run { deck: Deck::Text(text.into()), ..Self::file("") }
    }

    /// The same with a deck changed by `change`. Panics for a deck that is a file.
    pub fn replaced(mut self, change: impl FnOnce(&str) -> String) -> Self {
        match &self.deck {
            Deck::Text(text) => self.deck = Deck::Text(change(text)),
            Deck::File(path) => panic!("{} is a file", path.display()),
        }
        self
    }

    pub fn ranks(mut self, ranks: usize) -> Self {
        self.ranks = ranks;
        self
    }

    /// For a job that may take longer than others, s.
    pub fn limit(mut self, seconds: u32) -> Self {
        self.limit = seconds;
        self
    }

    /// `--set ASSIGNMENT`
    pub fn set(self, assignment: impl Into<String>) -> Self {
        self.word("--set").word(assignment)
    }

    /// Any word of the command line.
    pub fn word(mut self, word: impl Into<String>) -> Self {
        self.words.push(word.into());
        self
    }

    pub fn env(mut self, name: &str, value: &str) -> Self {
        self.env.push((name.into(), value.into()));
        self
    }

    /// Runs whatever comes of it. Without an `--out` of its own the results go to `out` in the
    /// scratch folder, which is also the working directory.
    pub fn attempt(&self) -> Outcome {
        self.attempt_in(tempfile::tempdir().expect("a scratch folder"))
    }

    /// The same in a folder that an earlier call may have left.
    pub fn attempt_in(&self, folder: TempDir) -> Outcome {
        let deck = match &self.deck {
            Deck::File(path) => path.clone(),
            Deck::Text(text) => {
                let path = folder.path().join("deck.toml");
                std::fs::write(&path, text).expect("the scratch folder is writable");
                path
            }
        };
        let mut arguments = vec![deck.to_string_lossy().into_owned()];
        arguments.extend(self.words.iter().cloned());
        if !self.words.iter().any(|word| word == "--out") {
            arguments.extend(["--out".to_string(), "out".to_string()]);
        }
        let mut output = self.start(folder.path(), &arguments);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        if died_in_mpi_init(&output, folder.path()) {
            eprintln!(
                "a rank died in MPI_Init; the job starts once more\n{}",
                text(&output.stderr)
            );
            output = self.start(folder.path(), &arguments);
        }
        Outcome {
            code: output.status.code().unwrap_or(-1),
            stdout: text(&output.stdout),
            stderr: text(&output.stderr),
            folder,
        }
    }

    fn start(&self, folder: &Path, arguments: &[String]) -> Output {
        let _room = Room::take(self.ranks);
        let mut job = job(self.ranks, self.limit);
        job.arg(env!("CARGO_BIN_EXE_mpm-par")).args(arguments).current_dir(folder);
        // After a run that failed mpirun waits so long for ranks that are gone already, s.
        job.env("OMPI_MCA_odls_base_sigkill_timeout", "0");
        job.envs(self.env.iter().map(|(name, value)| (name, value)));
        job.output().expect("mpirun is on the PATH")
    }

    /// Runs to a good end.
    pub fn results(&self) -> Results {
        let outcome = self.attempt();
        assert_eq!(
            outcome.code, 0,
            "{:?} on {} ranks\n{}\n{}",
            self.words, self.ranks, outcome.stdout, outcome.stderr
        );
        outcome.results()
    }
}

impl Outcome {
    pub fn results(self) -> Results {
        Results::read(self.folder, "out")
    }

    /// What the program said on its error channel, without what mpirun adds.
    pub fn said(&self) -> String {
        let text = self.stderr.split("-----").next().unwrap_or_default();
        let scratch = format!("{}/", self.folder.path().display());
        text.trim_end().replace(&scratch, "")
    }

    /// Every file below the scratch folder, relative, sorted.
    pub fn files(&self) -> Vec<String> {
        fn walk(root: &Path, folder: &Path, found: &mut Vec<String>) {
            for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
                let path = entry.path();
                if path.is_dir() {
                    walk(root, &path, found);
                } else if let Ok(relative) = path.strip_prefix(root) {
                    found.push(relative.to_string_lossy().into_owned());
                }
            }
        }
        let mut found = Vec::new();
        walk(self.folder.path(), self.folder.path(), &mut found);
        found.sort();
        found
    }
}

/// Whether a rank died before the program's first words, as Debian's PMIx ends a start now and then on
/// a loaded core (docs/evidence/portability.md). A fault of the program's own start repeats and is told.
fn died_in_mpi_init(output: &Output, folder: &Path) -> bool {
    let stderr = String::from_utf8_lossy(&output.stderr);
    let silent = output.stdout.iter().all(u8::is_ascii_whitespace);
    silent && stderr.contains("exited on signal 11") && !folder.join("out").exists()
}

/// A results directory.
pub struct Results {
    pub summary: serde_json::Value,
    pub directory: PathBuf,
    folder: TempDir,
}

impl Results {
    fn read(folder: TempDir, name: &str) -> Self {
        let directory = folder.path().join(name);
        Results { summary: left::summary(&directory), directory, folder }
    }

    pub fn into_folder(self) -> TempDir {
        self.folder
    }

    /// A number of `summary.json` by its path, for example `newton_iterations.total`.
    pub fn number(&self, path: &str) -> f64 {
        let mut value = &self.summary;
        for word in path.split('.') {
            value = match word.parse::<usize>() {
                Ok(index) => &value[index],
                Err(_) => &value[word],
            };
        }
        value.as_f64().unwrap_or_else(|| panic!("summary.json has no number {path}"))
    }

    pub fn count(&self, path: &str) -> usize {
        self.number(path) as usize
    }

    pub fn verify(&self, name: &str) -> f64 {
        self.number(&format!("verify.{name}"))
    }

    pub fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.directory.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// A column of `history.csv` by its name without the unit.
    pub fn history(&self, name: &str) -> Vec<f64> {
        left::column(&self.directory, name)
    }

    /// Residuals of all attempts at a step, in order.
    pub fn residuals(&self, step: usize) -> Vec<f64> {
        self.text("residuals.csv")
            .lines()
            .skip(1)
            .filter_map(|line| {
                let cells: Vec<&str> = line.split(',').collect();
                (cells[0] == step.to_string()).then(|| cells[2].parse().expect("a number"))
            })
            .collect()
    }

    /// The points at the end of a step, ordered by their id.
    pub fn points(&self, step: usize) -> PointTable {
        PointTable::read(&self.directory.join(format!("points-{step:06}.h5")))
    }
}

/// Columns of a points file, rows ordered by id.
pub struct PointTable {
    pub id: Vec<i64>,
    columns: BTreeMap<String, (usize, Vec<f64>)>,
}

impl PointTable {
    pub fn read(path: &Path) -> Self {
        let file = hdf5::File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let id: Vec<i64> = file.dataset("id").and_then(|d| d.read_raw()).expect("ids");
        let mut order: Vec<usize> = (0..id.len()).collect();
        order.sort_by_key(|&row| id[row]);
        let mut columns = BTreeMap::new();
        for name in file.member_names().expect("a list of datasets") {
            let dataset = file.dataset(&name).expect("a dataset");
            let shape = dataset.shape();
            if ["id", "vertices"].contains(&name.as_str())
                || shape.first() != Some(&id.len())
                || name.starts_with("domain")
            {
                continue;
            }
            let width = shape.get(1).copied().unwrap_or(1);
            let raw: Vec<f64> = dataset.read_raw().expect("numbers");
            let sorted = order.iter().flat_map(|&row| &raw[row * width..(row + 1) * width]);
            columns.insert(name, (width, sorted.copied().collect()));
        }
        PointTable { id: order.iter().map(|&row| id[row]).collect(), columns }
    }

    pub fn has(&self, name: &str) -> bool {
        self.columns.contains_key(name)
    }

    /// All numbers of a field, row by row.
    pub fn field(&self, name: &str) -> &[f64] {
        let (_, values) =
            self.columns.get(name).unwrap_or_else(|| panic!("no field {name} in the file"));
        values
    }

    /// One component of a field.
    pub fn component(&self, name: &str, component: usize) -> Vec<f64> {
        let (width, values) = &self.columns[name];
        values.chunks_exact(*width).map(|row| row[component]).collect()
    }
}

/// The last entry of a column of the history.
pub fn last(results: &Results, name: &str) -> f64 {
    *results.history(name).last().expect("a row")
}

/// The last value of a column of `probes.csv`, whose name begins with `name`.
pub fn probed(results: &Results, name: &str) -> f64 {
    let text = results.text("probes.csv");
    let mut rows = text.lines();
    let column = rows.next().expect("names").split(',').position(|own| own.starts_with(name));
    let row = rows.next_back().expect("a row");
    row.split(',').nth(column.expect("a column")).expect("a cell").parse().expect("a number")
}

/// Largest difference over the largest magnitude of `b`; infinite if the lengths differ.
pub fn relative_difference(a: &[f64], b: &[f64]) -> f64 {
    if a.len() != b.len() {
        return f64::INFINITY;
    }
    let scale = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut worst = 0.0f64;
    for (a, b) in a.iter().zip(b) {
        let difference = (a - b).abs();
        worst = if difference.is_nan() { f64::INFINITY } else { worst.max(difference) };
    }
    if worst == 0.0 { 0.0 } else { worst / scale }
}

/// `value` rounds to the printed `text` at its number of significant digits.
#[track_caller]
pub fn assert_prints(value: f64, text: &str) {
    let printed: f64 = text.parse().expect("a printed number");
    let mantissa = text.split(['e', 'E']).next().unwrap_or(text);
    let digits = mantissa.split('.').nth(1).map_or(0, str::len) as i32;
    let exponent: i32 = text.split(['e', 'E']).nth(1).map_or(0, |e| e.parse().expect("exponent"));
    // Half a unit of the last digit, and a little for ties.
    let unit = 10f64.powi(exponent - digits);
    assert!((value - printed).abs() <= 0.5001 * unit, "{value:.6e} is not printed as {text}");
}
