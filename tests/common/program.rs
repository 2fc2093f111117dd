//! Runs of the program that go on while a test watches, kills or continues them; `run.rs` is for
//! those that come to their end.
#![allow(dead_code)]

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Output, Stdio};
use std::time::{Duration, Instant};

#[allow(unused_imports)]
pub use crate::common::left::{column, history, summary};
use crate::common::{job, mpirun};

pub const PROGRAM: &str = env!("CARGO_BIN_EXE_mpm-par");

/// `tests/decks/NAME.toml`
pub fn deck(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/decks").join(format!("{name}.toml"))
}

/// Solver options whose answers repeat bit by bit on `n` ranks (those of `Linear::DirectOnOne`).
pub fn repeatable(n: usize) -> Vec<String> {
    [
        "-qs_ksp_type preonly",
        "-qs_pc_type telescope",
        &format!("-qs_pc_telescope_reduction_factor {n}"),
        "-qs_telescope_ksp_type preonly",
        "-qs_telescope_pc_type lu",
        "-qs_telescope_pc_factor_mat_solver_type mumps",
    ]
    .iter()
    .flat_map(|words| words.split(' ').map(str::to_string).collect::<Vec<_>>())
    .collect()
}

/// The words of one run.
pub fn words(deck: &Path, out: &Path, more: &[&str], n: usize) -> Vec<String> {
    let mut words = vec![PROGRAM.to_string(), deck.display().to_string()];
    words.extend(["--out".to_string(), out.display().to_string()]);
    words.extend(more.iter().map(|word| word.to_string()));
    words.extend(repeatable(n));
    words
}

/// Runs to its end; the output tells how.
pub fn run(n: usize, deck: &Path, out: &Path, more: &[&str]) -> Output {
    mpirun(n, &words(deck, out, more, n), &[])
}

/// [`run`], which must succeed.
pub fn run_well(n: usize, deck: &Path, out: &Path, more: &[&str]) -> Output {
    let output = run(n, deck, out, more);
    assert!(output.status.success(), "{more:?} on {n} ranks\n{}", text(&output));
    output
}

pub fn text(output: &Output) -> String {
    format!(
        "{}\n{}\n{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

/// A run that goes on in the background; killed with all its ranks when dropped.
pub struct Running(pub Child);

impl Running {
    pub fn start(n: usize, deck: &Path, out: &Path, more: &[&str]) -> Self {
        let mut job = job(n, 120);
        job.args(words(deck, out, more, n));
        job.stdout(Stdio::piped()).stderr(Stdio::piped());
        Running(job.spawn().expect("mpirun is on the PATH"))
    }

    /// Waits for the end, which tells how it was.
    pub fn output(&mut self) -> Output {
        let mut read = [Vec::new(), Vec::new()];
        if let (Some(out), Some(err)) = (&mut self.0.stdout, &mut self.0.stderr) {
            // A run that is watched says less than a pipe holds.
            out.read_to_end(&mut read[0]).expect("what it says");
            err.read_to_end(&mut read[1]).expect("what it says");
        }
        let status = self.0.wait().expect("it is a child");
        let [stdout, stderr] = read;
        Output { status, stdout, stderr }
    }

    /// Process numbers of the ranks that live.
    pub fn ranks(&self) -> Vec<i32> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir("/proc").expect("Linux").flatten() {
            let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse().ok()) else {
                continue;
            };
            let stat = std::fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
            // pid (name) state parent: the name may hold blanks.
            let parent = stat.rsplit_once(')').and_then(|(_, rest)| {
                rest.split_whitespace().nth(1).and_then(|word| word.parse::<u32>().ok())
            });
            if parent == Some(self.0.id()) {
                found.push(pid);
            }
        }
        found
    }

    pub fn signal(pid: i32, signal: i32) {
        // SAFETY: sends a signal to a process that this test started.
        unsafe { libc::kill(pid, signal) };
    }

    /// kill -9 for every rank and for mpirun; nothing of the run is left afterwards.
    pub fn kill(&mut self) {
        let ranks = self.ranks();
        for &pid in &ranks {
            Self::signal(pid, libc::SIGKILL);
        }
        let _ = self.0.kill();
        let _ = self.0.wait();
        let gone = |pid: &i32| !Path::new(&format!("/proc/{pid}")).exists();
        wait_until(|| ranks.iter().all(gone));
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if self.0.try_wait().ok().flatten().is_none() {
            self.kill();
        }
    }
}

/// Waits for at most a minute.
pub fn wait_until(mut done: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !done() {
        assert!(begin.elapsed() < Duration::from_secs(60), "nothing happened for a minute");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// All fields of the points in a checkpoint, in the order of the points' ids.
pub fn points_of(checkpoint: &Path) -> BTreeMap<String, Vec<f64>> {
    let file = hdf5::File::open(checkpoint)
        .unwrap_or_else(|error| panic!("{}: {error}", checkpoint.display()));
    let ids: Vec<u64> = file.dataset("points.id").unwrap().read_raw().unwrap();
    let mut order: Vec<usize> = (0..ids.len()).collect();
    order.sort_by_key(|&p| ids[p]);
    let mut fields = BTreeMap::new();
    for name in file.member_names().unwrap() {
        let Some(field) = name.strip_prefix("points.") else { continue };
        let dataset = file.dataset(&name).unwrap();
        let columns = dataset.shape().get(1).copied().unwrap_or(1);
        let values: Vec<f64> = dataset.read_raw::<f64>().unwrap();
        let rows = order.iter().flat_map(|&p| &values[p * columns..(p + 1) * columns]);
        fields.insert(field.to_string(), rows.copied().collect());
    }
    fields
}

/// Largest difference between two sets of fields, each relative to its field's largest value.
pub fn difference(a: &BTreeMap<String, Vec<f64>>, b: &BTreeMap<String, Vec<f64>>) -> (f64, String) {
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    let mut largest = (0.0, String::new());
    for (name, a) in a {
        let b = &b[name];
        assert_eq!(a.len(), b.len(), "{name}");
        let scale = a.iter().fold(f64::MIN_POSITIVE, |m: f64, x| m.max(x.abs()));
        let error = a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / scale;
        if error > largest.0 {
            largest = (error, name.clone());
        }
    }
    largest
}

/// Names and contents of a folder.
pub fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| {
            let entry = entry.expect("an entry");
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, std::fs::read(entry.path()).expect("a file"))
        })
        .collect()
}

pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for (name, bytes) in contents(from) {
        std::fs::write(to.join(name), bytes).expect("written");
    }
}
