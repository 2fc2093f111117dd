//! What lies in a results directory belongs to one run: while it runs, when it is killed, and when
//! it goes on there.

mod common;
#[path = "common/program.rs"]
mod program;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};

use common::at_once::at_once;
use common::mpirun;
use program::*;

const OFTEN: [&str; 2] = ["--set", "output.checkpoint={every=1,keep=9}"];
const LOCK: &str = ".mpm-par.lock";

/// A finished run of six steps on one rank with all its checkpoints.
fn finished(folder: &Path) -> PathBuf {
    let out = folder.join("finished");
    run_well(1, &deck("restart"), &out, &[&OFTEN[..], &["--set", "output.every=1"]].concat());
    out
}

/// The words that go on from a checkpoint of this directory.
fn from(out: &Path, step: usize) -> [String; 2] {
    let path = out.join(format!("checkpoint-{step:06}.h5"));
    ["--restart".to_string(), path.display().to_string()]
}

/// Tables and series that do not fit are met before anything is changed.
#[test]
fn a_refused_continuation_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let good = finished(folder.path());
    let cases = [
        ("history.csv", "step [-],other [m]\n1,2\n", "has other columns than this run writes"),
        ("residuals.csv", "", "has other columns than this run writes"),
        ("points.xdmf", "<Xdmf/>", "is not a time series that this program wrote"),
        ("domains.xdmf", "", "is not a time series that this program wrote"),
        ("grid.xdmf", "<Xdmf/>", "is not a time series that this program wrote"),
    ];
    for (case, (name, content, why)) in cases.into_iter().enumerate() {
        let out = folder.path().join(format!("out-{case}"));
        copy(&good, &out);
        fs::write(out.join(name), content).unwrap();
        fs::write(out.join("checkpoint-000007.h5.partial"), "killed here").unwrap();
        let before = contents(&out);
        let [restart, path] = from(&out, 3);
        let output = run(case % 3 + 1, &deck("restart"), &out, &[&restart, &path]);
        assert_eq!(output.status.code(), Some(3), "{}", text(&output));
        assert!(text(&output).contains(&format!("{name} {why}")), "{}", text(&output));
        let after = contents(&out);
        assert_eq!(before.keys().collect::<Vec<_>>(), after.keys().collect::<Vec<_>>());
        for (file, bytes) in &before {
            assert!(after[file] == *bytes, "{name} was refused, and {file} was changed");
        }
    }
}

/// Rows that should be there and are not: said, and those that follow do not take their place.
#[test]
fn lost_rows_are_said() {
    let folder = tempfile::tempdir().unwrap();
    let out = finished(folder.path());
    for name in ["history.csv", "residuals.csv"] {
        let text = fs::read_to_string(out.join(name)).unwrap();
        let of_two =
            |row: &&str| !["3,", "4,", "5,", "6,"].iter().any(|step| row.starts_with(step));
        let rows: Vec<&str> = text.split_inclusive('\n').filter(of_two).collect();
        fs::write(out.join(name), rows.concat()).unwrap();
    }
    let go_on = |ranks: usize, step: usize| {
        let [restart, path] = from(&out, step);
        let more = [&OFTEN[..], &["--set", "output.every=1", &restart, &path]].concat();
        text(&run_well(ranks, &deck("restart"), &out, &more))
    };
    // Checkpoints after step 3 are of the earlier course until they are written anew.
    let said = go_on(2, 4);
    assert!(said.contains("history.csv has lost rows: 2 of 4 are left"), "{said}");
    assert!(said.contains("residuals.csv has lost rows: "), "{said}");
    assert_eq!(column(&out, "step"), [1.0, 2.0, 5.0, 6.0]);
    // From before the gap, from behind it: no row comes twice, and none is out of order.
    let said = go_on(1, 5);
    assert!(!said.contains("lost rows"), "known already: {said}");
    assert_eq!(column(&out, "step"), [1.0, 2.0, 5.0, 6.0]);
    let said = go_on(3, 3);
    assert!(said.contains("history.csv has lost rows: 2 of 3 are left"), "{said}");
    assert_eq!(column(&out, "step"), [1.0, 2.0, 4.0, 5.0, 6.0]);
    let residuals = fs::read_to_string(out.join("residuals.csv")).unwrap();
    let steps: Vec<&str> = residuals.lines().skip(1).filter_map(|r| r.split(',').next()).collect();
    assert!(steps.is_sorted() && !steps.contains(&"3"), "{steps:?}");
}

/// kill -9, and at once on: nothing of the killed run stands in the way or speaks for the new one.
#[test]
fn a_killed_run_leaves_nothing_that_misleads() {
    let folder = tempfile::tempdir().unwrap();
    let deck = deck("restart");
    let long = ["--set", "analysis.steps=20", "--set", "output.every=20"];
    let often = ["--set", "output.checkpoint={every=1,keep=20}"];
    let plan = [&long[..], &often].concat();
    let whole = folder.path().join("whole");
    run_well(1, &deck, &whole, &plan);
    for ranks in [1, 2, 3] {
        let out = folder.path().join(format!("out-{ranks}"));
        copy(&whole, &out);
        let [restart, path] = from(&out, 5);
        let mut running =
            Running::start(ranks, &deck, &out, &[&plan[..], &[&restart, &path]].concat());
        // The earlier ones of later steps are set aside before the first new one.
        wait_until(|| {
            out.join("checkpoint-000005.h5").exists() && !out.join("checkpoint-000020.h5").exists()
        });
        wait_until(|| out.join("checkpoint-000007.h5").exists());
        running.kill();
        assert!(!out.join("summary.json").exists(), "it tells of steps that are gone");
        assert!(out.join(LOCK).exists(), "it was killed");
        for name in ["checkpoint-000013.h5.partial", "points-000014.h5.partial"] {
            fs::write(out.join(name), "begun").unwrap();
        }
        fs::write(out.join("mine.partial"), "not yours").unwrap();
        run_well(ranks, &deck, &out, &[&plan[..], &["--restart", "last"]].concat());
        assert_eq!(summary(&out)["status"], "completed");
        assert_eq!(column(&out, "step").len(), 20);
        let ours: Vec<_> = contents(&out).into_keys().filter(|n| n.ends_with(".partial")).collect();
        assert_eq!(ours, ["mine.partial"]);
        assert!(!out.join(LOCK).exists(), "it ended by itself");
    }
    // With --force no file of a killed run stays either.
    fs::write(whole.join("grid-000014.h5.partial"), "begun").unwrap();
    fs::write(whole.join(LOCK), "process 1 on a machine that was switched off").unwrap();
    run_well(2, &deck, &whole, &["--force"]);
    assert!(!whole.join("grid-000014.h5.partial").exists());
}

/// A second run is refused whatever it is told, by all its ranks, and the first does not notice.
#[test]
fn one_run_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let (deck, out) = (deck("restart"), folder.path().join("out"));
    let slow = ["--set", "analysis.steps=400", "--set", "output.every=400"];
    let plan = [&slow[..], &["--set", "output.checkpoint={every=2,keep=9}"]].concat();
    let mut first = Running::start(2, &deck, &out, &plan);
    wait_until(|| out.join("checkpoint-000002.h5").exists());
    let [restart, path] = from(&out, 2);
    // It takes as long as the others need.
    let ranks = first.ranks();
    ranks.iter().for_each(|&pid| Running::signal(pid, libc::SIGSTOP));
    let seconds: Vec<Running> = [
        (1, vec![]),
        (2, vec!["--force"]),
        (3, vec!["--restart", "last"]),
        (1, vec![restart.as_str(), path.as_str()]),
    ]
    .into_iter()
    .map(|(ranks, more)| Running::start(ranks, &deck, &out, &[&plan[..], &more].concat()))
    .collect();
    for second in seconds {
        let mut second = second;
        let output = second.output();
        let said = text(&output);
        assert_eq!(output.status.code(), Some(3), "{said}");
        let holders: Vec<bool> = first
            .ranks()
            .iter()
            .map(|pid| said.contains(&format!("out is in use: process {pid} on ")))
            .collect();
        assert_eq!(holders.iter().filter(|&&holder| holder).count(), 1, "{said}");
        assert_eq!(said.matches("error:").count(), 1, "{said}");
    }
    assert!(first.0.try_wait().unwrap().is_none(), "the first ran to its end meanwhile");
    // What only looks is let through.
    let check = [&plan[..], &["--check", "--restart", "last"]].concat();
    run_well(1, &deck, &out, &check);
    ranks.iter().for_each(|&pid| Running::signal(pid, libc::SIGCONT));
    Running::signal(first.0.id() as i32, libc::SIGUSR1);
    assert_eq!(first.0.wait().unwrap().code(), Some(1));
    let stopped = summary(&out);
    assert_eq!(stopped["status"], "stopped");
    let done = stopped["steps_completed"].as_u64().unwrap();
    assert_eq!(column(&out, "step"), (1..=done).map(|n| n as f64).collect::<Vec<_>>());
    assert!(!out.join(LOCK).exists());
}

/// Between the program and the system: refuses locks with the error number in `NO_LOCKS`, and
/// notes in the file `NOTES` which files are brought to the disk and renamed. Ends the process before
/// the removal or renaming in a results directory that `KILL_AT` counts.
const BETWEEN: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void note(const char *what, const char *path) {
    const char *notes = getenv("NOTES");
    FILE *file = notes ? fopen(notes, "a") : NULL;
    if (file) { fprintf(file, "%s %s\n", what, path); fclose(file); }
}
static void note_open(int number) {
    char link[64], path[4096] = "";
    snprintf(link, sizeof link, "/proc/self/fd/%d", number);
    if (readlink(link, path, sizeof path - 1) > 0) note("synced", path);
}
static void perhaps_end(const char *path) {
    static int count = 0;
    const char *at = getenv("KILL_AT");
    if (at && strstr(path, "/results/") && ++count == atoi(at)) _exit(9);
}
int unlink(const char *path) {
    perhaps_end(path);
    return ((int (*)(const char *))dlsym(RTLD_NEXT, "unlink"))(path);
}
int fsync(int number) {
    note_open(number);
    return ((int (*)(int))dlsym(RTLD_NEXT, "fsync"))(number);
}
int fdatasync(int number) {
    note_open(number);
    return ((int (*)(int))dlsym(RTLD_NEXT, "fdatasync"))(number);
}
int rename(const char *from, const char *to) {
    note("named", to);
    perhaps_end(to);
    return ((int (*)(const char *, const char *))dlsym(RTLD_NEXT, "rename"))(from, to);
}
int flock(int number, int what) {
    const char *refusal = getenv("NO_LOCKS");
    if (refusal) { errno = atoi(refusal); return -1; }
    return ((int (*)(int, int))dlsym(RTLD_NEXT, "flock"))(number, what);
}
"#;

fn between(folder: &Path) -> String {
    let (source, library) = (folder.join("between.c"), folder.join("between.so"));
    fs::write(&source, BETWEEN).unwrap();
    let mut compile = Command::new("cc");
    compile.args(["-shared", "-fPIC", "-o"]).args([&library, &source]).arg("-ldl");
    let output = compile.output().expect("the C compiler that the program was built with");
    assert!(output.status.success(), "{}", text(&output));
    library.display().to_string()
}

/// Some file systems know no locks: that is no reason not to run.
#[test]
fn a_file_system_without_locks_stops_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let library = between(folder.path());
    for (ranks, number) in [(1, libc::ENOLCK), (2, libc::ENOSYS), (3, libc::EOPNOTSUPP)] {
        let out = folder.path().join(format!("out-{ranks}"));
        let env = [("LD_PRELOAD", library.as_str()), ("NO_LOCKS", &number.to_string())];
        let output = mpirun(ranks, &words(&deck("restart"), &out, &[], ranks), &env);
        assert!(output.status.success(), "{}", text(&output));
        assert!(
            text(&output).contains("out of it") && !out.join(LOCK).exists(),
            "{}",
            text(&output)
        );
        let why = format!("cannot be locked ({})", std::io::Error::from_raw_os_error(number));
        assert_eq!(text(&output).matches(&why).count(), 1, "{}", text(&output));
    }
}

/// The rows that a checkpoint counts on are on the disk before it has its name.
#[test]
fn rows_reach_the_disk_before_their_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let library = between(folder.path());
    let (out, notes) = (folder.path().join("out"), folder.path().join("notes"));
    let notes_path = notes.display().to_string();
    let env = [("LD_PRELOAD", library.as_str()), ("NOTES", &notes_path)];
    let output = mpirun(2, &words(&deck("restart"), &out, &OFTEN, 2), &env);
    assert!(output.status.success(), "{}", text(&output));
    let notes = fs::read_to_string(&notes).unwrap();
    let mut before: Vec<&str> = Vec::new();
    let mut checkpoints = 0;
    for line in notes.lines() {
        if line.starts_with("named ") && line.contains("/checkpoint-") {
            for name in ["history.csv", "residuals.csv"] {
                let synced = format!("synced {}", out.join(name).display());
                assert!(before.contains(&synced.as_str()), "{name} before {line}\n{notes}");
            }
            checkpoints += 1;
            before.clear();
        }
        before.push(line);
    }
    assert_eq!(checkpoints, 6, "{notes}");
}

/// A results directory run again in place: wherever the run is killed, the deck is there, by its own
/// name or that of the copy that a run keeps of it.
#[test]
fn a_deck_in_its_results_directory_is_never_lost() {
    let folder = tempfile::tempdir().unwrap();
    let library = between(folder.path());
    let good = folder.path().join("good");
    let short = ["--set", "analysis.steps=1", "--set", "output.checkpoint="];
    run_well(1, &deck("restart"), &good, &short);
    at_once(["input.toml", "resolved.toml"], |name| {
        let text = fs::read(good.join(name)).unwrap();
        let ended = AtomicBool::new(false);
        for first in (1..200).step_by(4).take_while(|_| !ended.load(Ordering::Relaxed)) {
            at_once(first..first + 4, |at| {
                let out = folder.path().join(format!("{name}-{at}/results"));
                fs::create_dir_all(out.parent().unwrap()).unwrap();
                copy(&good, &out);
                let env = [("LD_PRELOAD", library.as_str()), ("KILL_AT", &at.to_string())];
                // Another deck than the last one's, so that both copies change.
                let more = [&short[..], &["--force", "--set", "title=again"]].concat();
                let output = mpirun(1, &words(&out.join(name), &out, &more, 1), &env);
                let kept =
                    ["input.toml", "resolved.toml"].map(|name| fs::read(out.join(name)).ok());
                let whole = kept.contains(&Some(text.clone()));
                assert!(whole, "{name} is lost when killed at {at}: {}", self::text(&output));
                assert!(kept[usize::from(name == "resolved.toml")].is_some(), "{name}, {at}");
                // The new log comes after the decks.
                let removed = !out.join("summary.json").exists();
                if removed && out.join("log.txt").exists() {
                    assert!(at > 5, "only {at} moments");
                    ended.store(true, Ordering::Relaxed);
                }
            });
        }
        assert!(ended.into_inner(), "{name}: no run ended in 200 moments");
    });
}

/// A restart from an early checkpoint gives up what came later: its frames do not lie beside those of
/// the new course, and go with its end. A series that is gone is said to be.
#[test]
fn frames_of_an_abandoned_course_are_set_aside() {
    let folder = tempfile::tempdir().unwrap();
    let out = finished(folder.path());
    fs::remove_file(out.join("domains.xdmf")).unwrap();
    let [restart, path] = from(&out, 2);
    // The new course writes fewer frames, and no checkpoints.
    let more = ["--set", "output.every=6", "--set", "output.checkpoint=", &restart, &path];
    let said = text(&run_well(2, &deck("restart"), &out, &more));
    let missing = "domains.xdmf is not there: the series begins anew after step 2";
    assert!(said.contains(missing), "{said}");
    assert!(!said.contains("points.xdmf is not there"), "{said}");
    let left: Vec<String> = contents(&out).into_keys().collect();
    let ending = |name: &&String| name.ends_with(".superseded") || name.ends_with(".partial");
    assert_eq!(left.iter().filter(ending).collect::<Vec<_>>(), Vec::<&String>::new());
    let points: Vec<&String> = left.iter().filter(|name| name.starts_with("points-")).collect();
    assert_eq!(
        points,
        ["points-000000.h5", "points-000001.h5", "points-000002.h5", "points-000006.h5"]
    );
    let series = fs::read_to_string(out.join("points.xdmf")).unwrap();
    assert_eq!(series.matches("<Grid Name=\"step ").count(), 4, "{series}");
}
