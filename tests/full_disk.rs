//! A disk that becomes full, or a file that may not grow, while results are written: the run ends
//! by itself on all ranks with one message, and what was written before is whole.

mod common;
#[path = "common/program.rs"]
mod program;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Mutex;

use common::run::PointTable;
use common::{job, left};
use program::{contents, deck, run_well};

static ONE_JOB: Mutex<()> = Mutex::new(());

/// Seconds for a run that takes one: a deadlock fails.
const TIME_LIMIT: u32 = 60;

/// What a run left.
struct Left {
    code: i32,
    /// Its words on the error channel, without what mpirun adds.
    said: String,
    out: PathBuf,
}

impl Left {
    fn of(folder: &Path, name: &str) -> Self {
        let read = |ending: &str| fs::read_to_string(folder.join(format!("{name}.{ending}")));
        let said = read("err").expect("the error channel");
        let said = said.split("-----").next().unwrap_or_default().trim_end().to_string();
        let code = read("code").expect("the exit code").trim().parse().expect("a number");
        Left { code, said, out: folder.join(name) }
    }

    fn names(&self) -> BTreeSet<String> {
        contents(&self.out).into_keys().collect()
    }

    fn steps_completed(&self) -> usize {
        left::summary(&self.out)["steps_completed"].as_u64().expect("a number") as usize
    }

    /// Ended as it should, by the failure to write `name`.
    #[track_caller]
    fn assert_ended(&self, name: &str, why: &str, what_to_do: &str, good: usize) {
        let expected = format!(
            "error: cannot write disk/out/{name}: {why}\n    \
             try: make room (disk, quota, file-size limit) or mend the disk, then {what_to_do}\n\
             results: disk/out, good up to step {good}"
        );
        assert_eq!(self.said, expected);
        assert_eq!(self.code, 3);
        self.assert_whole();
    }

    /// Nothing under a good name is damaged, and nothing unfinished is left.
    #[track_caller]
    fn assert_whole(&self) {
        let names = self.names();
        for name in &names {
            assert!(!name.ends_with(".partial"), "{name} is left");
            let path = self.out.join(name);
            if name.starts_with("points-") {
                let table = PointTable::read(&path);
                assert!(table.field("displacement").iter().all(|u| u.is_finite()), "{name}");
            } else if name.ends_with(".h5") {
                let file = hdf5::File::open(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
                for dataset in file.datasets().expect("a list of datasets") {
                    dataset.read_raw::<f64>().unwrap_or_else(|e| panic!("{name}: {e}"));
                }
            } else if name.ends_with(".xdmf") {
                let text = fs::read_to_string(&path).expect("text");
                assert!(text.ends_with("</Xdmf>\n"), "{name} is cut short");
                for word in text.split(['>', '<', ':', '\n']).map(str::trim) {
                    assert!(!word.ends_with(".h5") || names.contains(word), "{name}: no {word}");
                }
            } else if name.ends_with(".csv") {
                let text = fs::read_to_string(&path).expect("text");
                let width = text.lines().next().expect("a header").split(',').count();
                let whole = text.lines().all(|row| row.split(',').count() == width);
                assert!(whole && text.ends_with('\n'), "{name} has a torn row\n{text}");
            } else if name == "summary.json" {
                assert_eq!(left::summary(&self.out)["status"], "failed");
            }
        }
    }

    /// Every frame and checkpoint that is there is that of an undisturbed run.
    fn assert_like(&self, whole: &Path) {
        for name in self.names().iter().filter(|name| name.starts_with("points-")) {
            let [own, other] = [&self.out, whole].map(|out| PointTable::read(&out.join(name)));
            for field in ["position", "displacement", "stress"] {
                assert_eq!(own.field(field), other.field(field), "{name}: {field}");
            }
        }
    }
}

/// The words for a run into `disk/out`.
fn words(ranks: usize, more: &[&str]) -> Vec<String> {
    program::words(&deck("disk"), Path::new("disk/out"), more, ranks)
}

/// `sh -c script` in `folder`, where `run NAME WORD...` runs the program with more words and
/// keeps what it left under NAME.
fn script(folder: &Path, enter: &[&str], script: &str, job: &Command) -> Output {
    let _alone = ONE_JOB.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let script = format!(
        "run() {{ kept=$1; shift; \"$@\" >$kept.log 2>$kept.err; echo $? >$kept.code; \
         cp -r disk/out $kept; }}\n{script}"
    );
    let mut shell = Command::new(enter.first().unwrap_or(&"sh"));
    if let Some((_, more)) = enter.split_first() {
        shell.args(more).arg("sh");
    }
    shell.args(["-c", &script, "sh"]).arg(job.get_program()).args(job.get_args());
    for (name, value) in job.get_envs() {
        match value {
            Some(value) => shell.env(name, value),
            None => shell.env_remove(name),
        };
    }
    // After a run that failed mpirun waits so long for ranks that are gone already, s.
    shell.env("OMPI_MCA_odls_base_sigkill_timeout", "0");
    shell.current_dir(folder).output().expect("a shell")
}

/// Runs on a disk of so many kB that only the run sees; with `again` it goes on afterwards, on a
/// disk that has room. `None`, with a word why, where such a disk cannot be made.
fn on_small_disk(
    folder: &Path,
    ranks: usize,
    kilobytes: usize,
    more: &[&str],
    again: bool,
) -> Option<Vec<Left>> {
    fs::create_dir(folder.join("disk")).expect("a scratch folder");
    let mut job = job(ranks, TIME_LIMIT);
    job.args(words(ranks, more));
    let mut text =
        format!("mount -t tmpfs -o size={kilobytes}k none disk || exit 99\nrun first \"$@\"\n");
    if again {
        text += "mount -o remount,size=64m disk\nrun second \"$@\" --restart last\n";
    }
    let output = script(folder, &["unshare", "-rm"], &text, &job);
    if !folder.join("first.code").exists() {
        let why = String::from_utf8_lossy(&output.stderr).into_owned();
        eprintln!("skipped: no disk of its own can be made here: {}", why.trim_end());
        return None;
    }
    let names = if again { vec!["first", "second"] } else { vec!["first"] };
    Some(names.into_iter().map(|name| Left::of(folder, name)).collect())
}

/// Runs with a limit on the size of files, of so many half kB, for the ranks for which the shell
/// finds `whom` true.
fn under_a_limit(folder: &Path, ranks: usize, whom: &str, limit: usize, more: &[&str]) -> Left {
    fs::create_dir(folder.join("disk")).expect("a scratch folder");
    let mut job = job(ranks, TIME_LIMIT);
    // MPI's own files are larger: the limit comes after mpirun, and messages go by TCP.
    job.env("OMPI_MCA_btl", "self,tcp");
    let limited = format!("if {whom}; then ulimit -f {limit}; fi; exec \"$@\"");
    job.args(["sh", "-c", &limited, "sh"]).args(words(ranks, more));
    script(folder, &[], "run first \"$@\"\n", &job);
    Left::of(folder, "first")
}

const NO_SPACE: &str = "No space left on device (os error 28)";
const TOO_LARGE: &str = "File too large (os error 27)";
const FROM_2: &str = "go on from checkpoint-000002.h5 with --restart last";
const ANEW: &str = "start again with --force; output.checkpoint = { every = 10 } lets a run go on \
                    where it ended";

/// The run with room for everything.
fn undisturbed(ranks: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let _alone = ONE_JOB.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    run_well(ranks, &deck("disk"), folder.path(), &[]);
    folder
}

#[test]
fn a_disk_that_is_full_at_a_frame() {
    for ranks in [1, 2, 3] {
        let folder = tempfile::tempdir().unwrap();
        let Some(ends) = on_small_disk(folder.path(), ranks, 430, &[], true) else { return };
        ends[0].assert_ended("points-000003.h5", NO_SPACE, FROM_2, 2);
        assert_eq!(ends[0].steps_completed(), 2);
        assert_eq!(left::column(&ends[0].out, "step"), [1.0, 2.0]);
        let whole = undisturbed(ranks);
        ends[0].assert_like(whole.path());
        // With more room it goes on, to the same end.
        assert_eq!((ends[1].code, ends[1].said.as_str()), (0, ""));
        ends[1].assert_like(whole.path());
        assert_eq!(ends[1].names(), contents(whole.path()).into_keys().collect());
        assert_eq!(left::column(&ends[1].out, "step").len(), 8);
    }
}

#[test]
fn a_disk_that_is_full_at_a_checkpoint() {
    for ranks in [1, 2] {
        let folder = tempfile::tempdir().unwrap();
        let Some(ends) = on_small_disk(folder.path(), ranks, 620, &[], true) else { return };
        // Step 4 was solved and written; the earlier checkpoint is still there.
        ends[0].assert_ended("checkpoint-000004.h5", NO_SPACE, FROM_2, 4);
        assert!(ends[0].names().contains("checkpoint-000002.h5"));
        assert_eq!((ends[1].code, ends[1].said.as_str()), (0, ""));
        let whole = undisturbed(ranks);
        ends[1].assert_like(whole.path());
        assert_eq!(ends[1].names(), contents(whole.path()).into_keys().collect());
    }
}

/// Before the first step, and so full that not even the summary fits.
#[test]
fn a_disk_that_is_full_from_the_start() {
    // The first 4 kB are those of the lock.
    for (kilobytes, what) in [
        (4, "in the results directory disk/out"),
        (8, "disk/out/resolved.toml"),
        (12, "disk/out/log.txt"),
        (16, "disk/out/history.csv"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let Some(ends) = on_small_disk(folder.path(), 2, kilobytes, &[], false) else { return };
        assert_eq!(ends[0].said, format!("error: cannot write {what}: {NO_SPACE}"));
        assert_eq!(ends[0].code, 3);
        ends[0].assert_whole();
    }
}

/// The other ranks learn of it: whichever rank it is that cannot write.
#[test]
fn one_rank_alone_may_not_write_on() {
    for ranks in [2, 3] {
        for rank in 0..ranks {
            let folder = tempfile::tempdir().unwrap();
            let whom = format!("[ $OMPI_COMM_WORLD_RANK = {rank} ]");
            // Frames stay below 80 kB, checkpoints are larger.
            let end = under_a_limit(folder.path(), ranks, &whom, 160, &[]);
            end.assert_ended("checkpoint-000002.h5", TOO_LARGE, ANEW, 2);
            assert_eq!(left::column(&end.out, "step"), [1.0, 2.0]);
        }
    }
}

/// A row that does not fit is not begun.
#[test]
fn a_table_that_may_not_grow() {
    let more = [
        "--set",
        "analysis.steps=200",
        "--set",
        "output={ every = 1000 }",
        "--set",
        "body.0.shape={ box = { min = [0, 0], max = [1, 1] } }",
    ];
    for ranks in [1, 2] {
        let folder = tempfile::tempdir().unwrap();
        let end = under_a_limit(folder.path(), ranks, "true", 64, &more);
        let rows = left::column(&end.out, "step").len();
        assert!((10..200).contains(&rows), "{rows} rows");
        end.assert_ended("history.csv", TOO_LARGE, ANEW, rows);
        assert_eq!(end.steps_completed(), rows);
    }
}

/// A step that fails, and then a state that cannot be kept: the first is what ended the run.
#[test]
fn a_failed_step_is_not_hidden_by_the_disk() {
    let more = [
        "--set",
        "load.0={ body_force = [\"0\", \"if(x > 3.6 && s > 0.3, -1e9, -2e4)\"] }",
        "--set",
        "output.checkpoint={ every = 100 }",
    ];
    for ranks in [1, 2] {
        let folder = tempfile::tempdir().unwrap();
        let end = under_a_limit(folder.path(), ranks, "true", 160, &more);
        assert_eq!(end.code, 1, "{}", end.said);
        assert!(end.said.starts_with("error: step 3 of 8 could not be solved: "), "{}", end.said);
        assert_eq!(end.said.matches("error:").count(), 1, "{}", end.said);
        assert!(end.said.ends_with("results: disk/out, good up to step 2"), "{}", end.said);
        let log = fs::read_to_string(end.out.join("log.txt")).unwrap();
        let warning = format!("warning: cannot write disk/out/checkpoint-000002.h5: {TOO_LARGE}");
        assert!(log.contains(&warning), "{log}");
        assert_eq!(left::summary(&end.out)["status"], "stopped");
    }
}

/// Whatever is being written as the disk becomes full.
#[test]
#[ignore = "a minute"]
fn a_disk_that_is_full_at_any_moment() {
    for ranks in [1, 2, 3] {
        let mut named = BTreeSet::new();
        for kilobytes in (8..1020).step_by(28) {
            let folder = tempfile::tempdir().unwrap();
            let Some(ends) = on_small_disk(folder.path(), ranks, kilobytes, &[], true) else {
                return;
            };
            let Left { code, said, .. } = &ends[0];
            assert_eq!(*code, 3, "{kilobytes} kB on {ranks} ranks: {said}");
            let rest = said.strip_prefix("error: cannot write disk/out/").expect(said);
            let (name, rest) = rest.split_once(": ").expect(said);
            assert!(rest.starts_with(NO_SPACE) && !rest.contains("error:"), "{said}");
            named.insert(name.split(['-', '.']).next().unwrap_or(name).to_string());
            ends[0].assert_whole();
            if ends[0].names().iter().any(|name| name.starts_with("checkpoint-")) {
                assert_eq!(ends[1].code, 0, "{kilobytes} kB on {ranks} ranks: {}", ends[1].said);
                assert_eq!(left::column(&ends[1].out, "step").len(), 8);
            }
        }
        for kind in ["resolved", "points", "grid", "domains", "checkpoint"] {
            assert!(named.contains(kind), "{kind} never met the full disk: {named:?}");
        }
    }
}
