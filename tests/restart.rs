//! A run that is killed, moved or stopped ends as if nothing had happened; a checkpoint that is
//! not whole, or of another problem, is never taken.

mod common;
#[path = "common/program.rs"]
mod program;

use std::fs;
use std::path::Path;
use std::time::Duration;

use common::at_once::at_once;
use common::mpirun;
use mpm_par::output::restart::seal::Checksum;
use program::*;

const RANKS: [usize; 4] = [1, 2, 3, 4];

/// Every number of ranks continues what any other wrote; on the same number bit by bit.
#[test]
fn any_number_of_ranks_continues_any_other() {
    let folder = tempfile::tempdir().unwrap();
    let deck = deck("restart");
    let at = |name: String| folder.path().join(name);
    at_once(RANKS, |wrote| {
        run_well(wrote, &deck, &at(format!("whole-{wrote}")), &[]);
    });
    let reference = points_of(&at("whole-1".into()).join("checkpoint-000006.h5"));
    at_once(RANKS, |wrote| {
        let whole = at(format!("whole-{wrote}"));
        let middle = whole.join("checkpoint-000003.h5");
        at_once(RANKS, |goes_on| {
            let part = at(format!("part-{wrote}-{goes_on}"));
            run_well(goes_on, &deck, &part, &["--restart", &middle.display().to_string()]);
            let end = points_of(&part.join("checkpoint-000006.h5"));
            let (error, field) = difference(&reference, &end);
            assert!(error < 1e-8, "{wrote} -> {goes_on}: {field} differs by {error:e}");
            let summaries = (summary(&whole), summary(&part));
            assert_eq!(summaries.0["newton_iterations"], summaries.1["newton_iterations"]);
            let rows = history(&part);
            assert_eq!(rows.len(), 3, "a new directory holds the steps after the checkpoint");
            if wrote == goes_on {
                let whole_end = points_of(&whole.join("checkpoint-000006.h5"));
                assert_eq!(difference(&whole_end, &end).0, 0.0, "{wrote} ranks: not bit by bit");
                assert_eq!(rows[..], history(&whole)[3..]);
            }
        });
    });
}

/// In its own directory a run goes on as one: tables and series are those of a run in one piece.
#[test]
fn a_continued_directory_is_that_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, part) = (folder.path().join("whole"), folder.path().join("part"));
    let deck = deck("restart");
    let often = ["--set", "output.every=1", "--set", "output.checkpoint={every=1,keep=9}"];
    run_well(2, &deck, &whole, &often);
    copy(&whole, &part);
    let middle = part.join("checkpoint-000002.h5").display().to_string();
    let words = [&often[..], &["--restart", &middle]].concat();
    run_well(2, &deck, &part, &words);
    let (a, b) = (contents(&whole), contents(&part));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for name in ["points.xdmf", "grid.xdmf", "domains.xdmf", "residuals.csv", "resolved.toml"] {
        assert!(a[name] == b[name], "{name} differs");
    }
    assert_eq!(history(&whole), history(&part));
    assert!(column(&part, "wall_seconds").is_sorted());
    let log = String::from_utf8_lossy(&b["log.txt"]).into_owned();
    assert!(log.contains("checkpoint-000002.h5 after step 2, written by 2 ranks"), "{log}");
}

/// A mesh that has moved is put back where it was.
#[test]
fn a_moved_mesh_is_restored() {
    let folder = tempfile::tempdir().unwrap();
    let deck = Path::new(env!("CARGO_MANIFEST_DIR")).join("inputs/stretch.toml");
    let whole = folder.path().join("whole");
    let plan = ["--set", "output.checkpoint={every=8,keep=9}", "--set", "analysis.steps=16"];
    run_well(2, &deck, &whole, &plan);
    let middle = whole.join("checkpoint-000008.h5").display().to_string();
    for ranks in [2, 3] {
        let part = folder.path().join(format!("part-{ranks}"));
        run_well(ranks, &deck, &part, &[&plan[..], &["--restart", &middle]].concat());
        let ends = [&whole, &part].map(|out| points_of(&out.join("checkpoint-000016.h5")));
        let (error, field) = difference(&ends[0], &ends[1]);
        let limit = if ranks == 2 { 0.0 } else { 1e-8 };
        assert!(error <= limit, "{ranks} ranks: {field} differs by {error:e}");
    }
}

/// A file that is not whole is refused with exit code 3, and nothing changes; `last` falls back.
#[test]
fn damaged_checkpoints_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let good_out = folder.path().join("out");
    let deck = deck("restart");
    run_well(1, &deck, &good_out, &["--set", "output.checkpoint={every=2,keep=9}"]);
    let good = fs::read(good_out.join("checkpoint-000006.h5")).unwrap();
    let size = good.len();
    let refuse = |(bytes, what): (Vec<u8>, String)| {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        copy(&good_out, &out);
        let newest = out.join("checkpoint-000006.h5");
        fs::write(&newest, bytes).unwrap();
        let before = contents(&out);
        let output = run(1, &deck, &out, &["--restart", &newest.display().to_string(), "--force"]);
        assert_eq!(output.status.code(), Some(3), "{what}: {}", text(&output));
        assert!(text(&output).contains("checkpoint-000006.h5 is damaged"), "{}", text(&output));
        assert!(contents(&out) == before, "{what}: something was changed");
    };
    // A bit in the superblock, in a header, in the middle, in the seal; and the file cut short.
    let mut cases = vec![([&good[..], b"x"].concat(), "one byte more".to_owned())];
    for place in [0, 9, 100, size / 3, size / 2, size - 50, size - 1] {
        let mut bytes = good.clone();
        bytes[place] ^= 0x10;
        cases.push((bytes, format!("bit at {place} of {size}")));
    }
    for length in [0, 10, size / 2, size - 48, size - 1] {
        cases.push((good[..length].to_vec(), format!("{length} of {size} bytes")));
    }
    at_once(cases, refuse);

    let out = good_out;
    let newest = out.join("checkpoint-000006.h5");
    fs::write(&newest, [&good[..], b"x"].concat()).unwrap();
    // The newest is damaged now: the one before it is taken, and this is said.
    let output = run_well(1, &deck, &out, &["--restart", "last"]);
    let said = text(&output);
    assert!(said.contains("checkpoint-000006.h5 is damaged"), "{said}");
    assert!(said.contains("falling back") && said.contains("after step 4"), "{said}");
    assert_eq!(column(&out, "step"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(fs::read(&newest).unwrap().len(), size, "written anew");
    // None is good: an error, not a start from the beginning.
    for step in [2, 4, 6] {
        let path = out.join(format!("checkpoint-{step:06}.h5"));
        fs::write(&path, &fs::read(&path).unwrap()[..1000]).unwrap();
    }
    let before = contents(&out);
    let output = run(1, &deck, &out, &["--restart", "last"]);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    assert!(text(&output).contains("no checkpoint in"), "{}", text(&output));
    assert!(contents(&out) == before);
}

/// Whatever keeps `last` from taking the newest, it says so and takes the one before; what it
/// passed over stays under another name.
#[test]
fn last_passes_over_whatever_it_cannot_take() {
    let folder = tempfile::tempdir().unwrap();
    let (good, deck) = (folder.path().join("good"), deck("restart"));
    let often = ["--set", "output.checkpoint={every=1,keep=9}"];
    run_well(1, &deck, &good, &often);
    let sealed = fs::read(good.join("checkpoint-000006.h5")).unwrap();
    let with_bit = |bytes: &[u8], place: usize| {
        let mut bytes = bytes.to_vec();
        bytes[place] ^= 1;
        bytes
    };
    let words = b"yield = 20000";
    let physics = sealed.windows(words.len()).position(|found| found == words).unwrap();
    let content = &sealed[..sealed.len() - 48];
    let other = folder.path().join("other");
    run_well(1, &deck, &other, &["--set", "material.clay.yield=21e3"]);
    let foreign = fs::read(other.join("checkpoint-000006.h5")).unwrap();
    let newer = resealed(content.to_vec(), 77);
    type Make<'a> = Box<dyn Fn(&Path) + 'a>;
    let write = |bytes: Vec<u8>| -> Make { Box::new(move |at| fs::write(at, &bytes).unwrap()) };
    let link = |to: &'static str| -> Make {
        Box::new(move |at| std::os::unix::fs::symlink(to, at).unwrap())
    };
    let full_folder: Make = Box::new(|at| {
        fs::create_dir(at).unwrap();
        fs::write(at.join("mine"), "").unwrap();
    });
    let cases: [(&str, Make); 7] = [
        ("No such file", link("absent")),
        ("it is not a file", full_folder),
        ("is not a readable HDF5 file", write(resealed(with_bit(content, 9), 1))),
        (
            "its dataset text.physics is not what was written",
            write(resealed(with_bit(content, physics + 9), 1)),
        ),
        ("its content does not have the checksum", write(with_bit(&sealed, physics))),
        ("belongs to another problem", write(foreign.clone())),
        ("written by a newer version", write(newer)),
    ];
    for (case, (why, make)) in cases.iter().enumerate() {
        let ranks = case % 3 + 1;
        let out = folder.path().join(format!("out-{case}"));
        copy(&good, &out);
        let newest = out.join("checkpoint-000006.h5");
        fs::remove_file(&newest).unwrap();
        make(&newest);
        let bytes = fs::read(&newest).ok();
        let output = run_well(ranks, &deck, &out, &[&often[..], &["--restart", "last"]].concat());
        let said = text(&output);
        let warning = said.lines().find(|line| line.contains(why));
        let warning = warning.unwrap_or_else(|| panic!("{why}? {said}"));
        assert!(warning.starts_with("warning: "), "{said}");
        assert!(warning.contains("checkpoint-000006.h5"), "{said}");
        let taken = format!("falling back to {}", out.join("checkpoint-000005.h5").display());
        assert!(said.contains(&taken), "{said}");
        assert_eq!(column(&out, "step"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(fs::metadata(&newest).unwrap().len(), sealed.len() as u64, "written anew");
        let aside = out.join("checkpoint-000006.h5.passed-over");
        assert!(fs::symlink_metadata(&aside).is_ok(), "{why}: it is gone");
        assert!(fs::read(&aside).ok() == bytes, "{why}: it was changed");
    }

    // Older ones do not help: every reason is said, nothing is changed.
    for step in 1..5 {
        fs::remove_file(good.join(format!("checkpoint-{step:06}.h5"))).unwrap();
    }
    fs::write(good.join("checkpoint-000006.h5"), &foreign).unwrap();
    fs::write(good.join("checkpoint-000005.h5"), "").unwrap();
    let before = contents(&good);
    for ranks in [1, 2, 3] {
        let output = run(ranks, &deck, &good, &["--restart", "last"]);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(said.contains("checkpoint-000006.h5 belongs to another problem"), "{said}");
        assert!(said.contains("checkpoint-000005.h5 is damaged"), "{said}");
        assert_eq!(said.matches("error:").count(), 1, "{said}");
        assert!(contents(&good) == before);
    }
}

/// A checkpoint that 1571419 wrote in format 1, with b_e in place of b_e - 1, goes on as the run that it is part of.
#[test]
fn a_checkpoint_of_format_1_is_continued() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let (deck, old) = (data.join("format-1.toml"), data.join("format-1.h5"));
    let folder = tempfile::tempdir().unwrap();
    let (whole, part) = (folder.path().join("whole"), folder.path().join("part"));
    run_well(1, &deck, &whole, &[]);
    run_well(2, &deck, &part, &["--restart", &old.display().to_string()]);
    // That program numbered its points in another order, so sums are compared.
    for name in ["energy_strain", "energy_plastic", "work_external", "reaction.left.x"] {
        let [whole, part] = [&whole, &part].map(|out| *column(out, name).last().unwrap());
        assert!((part / whole - 1.0).abs() < 1e-9, "{name}: {part}, in one run {whole}");
    }
    // The last row of that program's own history.
    let strain = *column(&part, "energy_strain").last().unwrap();
    assert!((strain / 668.467701355831 - 1.0).abs() < 1e-9, "{strain}");
}

/// Content with a seal of this format that belongs to it.
fn resealed(content: Vec<u8>, format: u64) -> Vec<u8> {
    let blocks = content.chunks(1 << 20).enumerate().map(|(block, bytes)| {
        let mut sum = Checksum::new(block as u64);
        sum.add_bytes(bytes);
        sum.finish()
    });
    let sum = blocks.fold(0, u64::wrapping_add);
    let mut seal = b"mpm-par-restart\n".to_vec();
    for number in [format, content.len() as u64, sum] {
        seal.extend(number.to_le_bytes());
    }
    let mut own = Checksum::new(1);
    own.add_bytes(&seal);
    [content, seal, own.finish().to_le_bytes().to_vec()].concat()
}

/// Checkpoints come when their time has come, and the newest `keep` stay.
#[test]
fn checkpoints_come_by_the_clock_and_the_newest_stay() {
    let folder = tempfile::tempdir().unwrap();
    let deck = deck("restart");
    let cases = [
        // However short a step, more time than this has passed.
        ("minutes=1e-9,keep=3", 6, &[4, 5, 6][..]),
        ("minutes=1e-9,every=3,keep=1", 6, &[6]),
        ("minutes=1e9,every=2,keep=2", 3, &[4, 6]),
        ("minutes=1e9", 0, &[]),
    ];
    for (case, (plan, written, left)) in cases.into_iter().enumerate() {
        let out = folder.path().join(case.to_string());
        run_well(case % 3 + 1, &deck, &out, &["--set", &format!("output.checkpoint={{{plan}}}")]);
        let log = fs::read_to_string(out.join("log.txt")).unwrap();
        assert_eq!(log.matches("checkpoint: ").count(), written, "{plan}\n{log}");
        let names = contents(&out).into_keys().filter(|name| name.starts_with("checkpoint-"));
        let expected: Vec<_> = left.iter().map(|n| format!("checkpoint-{n:06}.h5")).collect();
        assert_eq!(names.collect::<Vec<_>>(), expected, "{plan}");
    }
}

/// Another problem, another format, no file at all: exit code 3 on all of them.
#[test]
fn foreign_newer_and_missing_checkpoints_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let deck = deck("restart");
    run_well(1, &deck, &out, &[]);
    let newest = out.join("checkpoint-000006.h5").display().to_string();
    let before = contents(&out);
    let refuse = |more: &[&str], what: &str| {
        for ranks in [1, 2] {
            let output = run(ranks, &deck, &out, more);
            assert_eq!(output.status.code(), Some(3), "{}", text(&output));
            assert!(text(&output).contains(what), "{what}? {}", text(&output));
        }
        assert!(contents(&out) == before, "{what}: something was changed");
    };
    let foreign = ["--set", "material.clay.yield=21e3", "--restart"];
    refuse(&[&foreign[..], &["last"]].concat(), "`yield = 20000.0");
    refuse(&[&foreign[..], &[&newest]].concat(), "belongs to another problem");
    let absent = folder.path().join("absent.h5").display().to_string();
    refuse(&["--restart", &absent], "absent.h5");

    let empty = folder.path().join("empty").display().to_string();
    let output = run(1, &deck, Path::new(&empty), &["--restart", "last"]);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    assert!(!Path::new(&empty).exists(), "a refusal creates nothing");

    // A format from the future, sealed as it should be.
    let sealed = fs::read(&newest).unwrap();
    let bytes = resealed(sealed[..sealed.len() - 48].to_vec(), 77);
    let newer = folder.path().join("newer.h5");
    fs::write(&newer, &bytes).unwrap();
    refuse(&["--restart", &newer.display().to_string()], "newer version of the program (format 77");
}

/// What may change between the parts of a run may change.
#[test]
fn output_and_solver_settings_may_change() {
    let folder = tempfile::tempdir().unwrap();
    let (out, deck) = (folder.path().join("out"), deck("restart"));
    run_well(1, &deck, &out, &[]);
    let middle = out.join("checkpoint-000003.h5").display().to_string();
    let other = folder.path().join("other");
    let sets = [
        "--set",
        "analysis.tolerance=1e-6",
        "--set",
        "title=\"again\"",
        "--set",
        "parallel.brick=1",
        "--restart",
        &middle,
    ];
    run_well(1, &deck, &other, &sets);
    assert_eq!(summary(&other)["title"], "again");
    assert_eq!(summary(&other)["steps_completed"], 6);
}

/// SIGUSR1, SIGTERM and SIGINT: a checkpoint at the end of the step, status "stopped", and on we go.
#[test]
fn signals_stop_a_run_in_good_order() {
    let folder = tempfile::tempdir().unwrap();
    let deck = deck("restart");
    let slow = ["--set", "analysis.steps=400", "--set", "output.every=400"];
    for (signal, name) in
        [(libc::SIGUSR1, "SIGUSR1"), (libc::SIGTERM, "SIGTERM"), (libc::SIGINT, "SIGINT")]
    {
        let out = folder.path().join(name);
        let mut running = Running::start(2, &deck, &out, &[&slow[..], &NEVER].concat());
        let rows = || fs::read_to_string(out.join("history.csv")).unwrap_or_default();
        wait_until(|| rows().lines().count() > 3);
        // mpirun hands SIGUSR1 on to all ranks; SIGTERM goes to one rank, and all must learn.
        let target = match signal {
            libc::SIGUSR1 => running.0.id() as i32,
            _ => *running.ranks().first().expect("a rank"),
        };
        Running::signal(target, signal);
        let status = running.0.wait().unwrap();
        assert_eq!(status.code(), Some(1), "stopped is not done");
        let stopped = summary(&out);
        assert_eq!(stopped["status"], "stopped");
        let reason = stopped["reason"].as_str().unwrap();
        assert!(reason.contains(name) && reason.contains("--restart last"), "{reason}");
        let done = stopped["steps_completed"].as_u64().unwrap();
        assert!(done < 400, "the run was over before the signal");
        assert!(out.join(format!("checkpoint-{done:06}.h5")).exists());
        assert_eq!(rows().lines().count() as u64, done + 1);
        let output =
            run_well(1, &deck, &out, &[&slow[..], &NEVER, &["--restart", "last"]].concat());
        assert!(text(&output).contains(&format!("after step {done}")), "{}", text(&output));
        assert_eq!(column(&out, "step"), (1..=400).map(f64::from).collect::<Vec<_>>());
    }
}

/// Only signals write checkpoints.
const NEVER: [&str; 2] = ["--set", "output.checkpoint={minutes=1000}"];

/// kill -9 at moments that differ from run to run, during writes too: there is always a good
/// checkpoint or none, and the end is that of a run in one piece.
fn kill_at_random(times: u32, ranks: usize) {
    let folder = tempfile::tempdir().unwrap();
    let deck = deck("restart");
    // Nearly all the time goes into writing.
    let busy = ["--set", "analysis.steps=60", "--set", "output.checkpoint={every=1,keep=2}"];
    let whole = folder.path().join("whole");
    run_well(ranks, &deck, &whole, &busy);
    let out = folder.path().join("out");
    let (mut killed, mut during_write, mut restarts) = (0, 0, 0);
    let mut draw = std::process::id();
    while killed < times {
        let newest_before = newest(&out);
        let start = match newest_before {
            None => vec!["--force"],
            Some(_) => vec!["--restart", "last"],
        };
        let mut running = Running::start(ranks, &deck, &out, &[&busy[..], &start].concat());
        // From its first new checkpoint on, or early, in set-up and reading.
        draw = draw.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        if draw >> 29 != 0 {
            wait_until(|| newest(&out) > newest_before || exited(&mut running));
        }
        std::thread::sleep(Duration::from_millis(u64::from(draw >> 8) % 60));
        if exited(&mut running) {
            // It came to its end before the blow: begin again.
            fs::remove_dir_all(&out).unwrap();
            continue;
        }
        running.kill();
        killed += 1;
        restarts += u32::from(newest_before.is_some());
        let partial = |name: &String| name.starts_with("checkpoint-") && name.ends_with(".partial");
        during_write += u32::from(out.exists() && contents(&out).keys().any(partial));
    }
    println!("{killed} kills, {restarts} of restarted runs, {during_write} in mid-checkpoint");
    assert!(restarts > 0);
    let last = if newest(&out).is_some() { ["--restart", "last"] } else { ["--force", "--force"] };
    let last = if last[0] == "--force" { &last[..1] } else { &last[..] };
    run_well(ranks, &deck, &out, &[&busy[..], last].concat());
    let ends = [&whole, &out].map(|out| points_of(&out.join("checkpoint-000060.h5")));
    let (error, field) = difference(&ends[0], &ends[1]);
    assert_eq!(error, 0.0, "{field} differs");
    assert_eq!(history(&whole), history(&out));
}

fn exited(running: &mut Running) -> bool {
    running.0.try_wait().unwrap().is_some()
}

/// Step of the newest checkpoint that has its name.
fn newest(out: &Path) -> Option<usize> {
    let names = fs::read_dir(out).ok()?.flatten().map(|entry| entry.file_name());
    names
        .filter_map(|name| {
            name.to_str()?.strip_prefix("checkpoint-")?.strip_suffix(".h5")?.parse().ok()
        })
        .max()
}

#[test]
fn killed_at_any_moment_a_run_goes_on() {
    kill_at_random(6, 2);
}

#[test]
#[ignore = "long: 50 kills"]
fn killed_fifty_times_a_run_goes_on() {
    kill_at_random(25, 2);
    kill_at_random(25, 3);
}

/// A failed step leaves the last good state, from which other settings may go on.
#[test]
fn a_run_that_failed_goes_on_with_other_settings() {
    let folder = tempfile::tempdir().unwrap();
    let (out, deck) = (folder.path().join("out"), deck("restart"));
    let hopeless = ["--set", "analysis.max_iterations=6", "--set", "analysis.on_failure=\"stop\""];
    let output = mpirun(2, &words(&deck, &out, &hopeless, 2), &[]);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output));
    let done = summary(&out)["steps_completed"].as_u64().unwrap();
    assert!((1..6).contains(&done), "{done}");
    run_well(2, &deck, &out, &["--restart", "last"]);
    let (whole, reference) = (folder.path().join("whole"), "checkpoint-000006.h5");
    run_well(2, &deck, &whole, &[]);
    let ends = [&whole, &out].map(|out| points_of(&out.join(reference)));
    assert_eq!(difference(&ends[0], &ends[1]).0, 0.0);
}

/// A dynamic run that is made twice as long goes on as if it had been so from the start, in the
/// place where its last step left it: points bit by bit, and the rows of the history.
#[test]
fn a_dynamic_run_is_extended() {
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("fall.toml");
    for kind in ["explicit", "implicit-dynamic"] {
        fs::write(&deck, FALL.replace("KIND", kind)).unwrap();
        let long = ["--set", "analysis.steps=16", "--set", "analysis.duration=0.0625"];
        for ranks in [1, 2] {
            let at = |name: &str| folder.path().join(format!("{kind}-{name}-{ranks}"));
            let (whole, part) = (at("whole"), at("part"));
            run_well(ranks, &deck, &whole, &long);
            run_well(ranks, &deck, &part, &[]);
            assert_eq!(summary(&part)["steps_completed"], 8);
            // Output and tolerance may change on the way.
            let more = ["--restart", "last", "--set", "output.every=4"];
            run_well(ranks, &deck, &part, &[&long[..], &more].concat());
            assert_eq!(summary(&part)["steps_completed"], 16);
            let ends = [&whole, &part].map(|out| points_of(&out.join("checkpoint-000016.h5")));
            let (error, field) = difference(&ends[0], &ends[1]);
            assert_eq!(error, 0.0, "{kind}, {ranks} ranks: {field}");
            for name in ["step", "time", "energy_kinetic", "energy_strain", "work_external"] {
                assert_eq!(column(&part, name), column(&whole, name), "{kind}: {name}");
            }
        }
    }
}

/// What an extension would change is refused, and nothing is touched.
#[test]
fn extensions_that_change_the_problem_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, text: &str, sets: &[&str], said: &[&str]| {
        let deck = folder.path().join(format!("{name}.toml"));
        fs::write(&deck, text).unwrap();
        let out = folder.path().join(name);
        run_well(1, &deck, &out, &[]);
        let before = contents(&out);
        let mut words = vec!["--restart", "last"];
        sets.iter().for_each(|set| words.extend(["--set", set]));
        let output = run(1, &deck, &out, &words);
        assert_eq!(output.status.code(), Some(3), "{}", self::text(&output));
        for word in said {
            assert!(self::text(&output).contains(word), "no `{word}` in {}", self::text(&output));
        }
        assert!(contents(&out) == before, "{name}: something was changed");
    };
    let fall = FALL.replace("KIND", "explicit");
    refused("step", &fall, &["analysis.duration=0.0625"], &["time step = "]);
    let shorter = ["analysis.steps=4", "analysis.duration=0.015625"];
    refused("shorter", &fall, &shorter, &["behind the end", "analysis.steps = 4"]);
    let moved = format!(
        "{fall}\n[[boundary]]\nwhere = {{ side = \"left\" }}\ndisplacement = {{ x = \"0.01\" }}\n"
    );
    let long = ["analysis.steps=16", "analysis.duration=0.0625"];
    refused("moved", &moved, &long, &["`steps = 8`", "totals over the whole", "formulas of t"]);
    let still = FALL
        .replace("KIND", "quasi-static")
        .replace("duration = 0.03125\n", "")
        .replace("mass = \"lumped\"\n", "");
    refused("still", &still, &["analysis.steps=16"], &["`steps = 8`", "totals over the whole"]);
}

/// Rows of the history at an interval: each is the row of its step in a history of all steps, with
/// the sums of the iterations; also when the run goes on from between two rows.
#[test]
fn a_thinned_history_keeps_its_sums() {
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("fall.toml");
    fs::write(&deck, FALL.replace("KIND", "implicit-dynamic")).unwrap();
    let (all, thin) = (folder.path().join("all"), folder.path().join("thin"));
    let checkpoints = ["--set", "output.checkpoint={every=1,keep=99}"];
    let thinned = [&checkpoints[..], &["--set", "output.history=3", "--quiet"]].concat();
    run_well(1, &deck, &all, &checkpoints);
    let check = |out: &Path| {
        assert_eq!(column(out, "step"), [3.0, 6.0, 8.0]);
        for name in
            ["time", "dt", "energy_kinetic", "energy_strain", "work_external", "reaction.floor.y"]
        {
            let every = column(&all, name);
            assert_eq!(column(out, name), [every[2], every[5], every[7]], "{name}");
        }
        for name in ["newton_iterations", "linear_iterations"] {
            let sum = |steps: std::ops::Range<usize>| column(&all, name)[steps].iter().sum::<f64>();
            assert_eq!(column(out, name), [sum(0..3), sum(3..6), sum(6..8)], "{name}");
        }
    };
    run_well(1, &deck, &thin, &thinned);
    check(&thin);
    for step in [2, 3, 5] {
        let middle = thin.join(format!("checkpoint-{step:06}.h5")).display().to_string();
        run_well(1, &deck, &thin, &[&thinned[..], &["--restart", &middle]].concat());
        check(&thin);
    }
    let timed = folder.path().join("timed");
    run_well(1, &deck, &timed, &["--set", "output.history={seconds=0.0078125}"]);
    assert_eq!(column(&timed, "step"), [2.0, 4.0, 6.0, 8.0]);
}

/// A long explicit run tells of a step a second at most, on the terminal and in the log; the deck
/// and the command line may ask for more or less.
#[test]
fn explicit_runs_do_not_tell_of_every_step() {
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("fall.toml");
    fs::write(
        &deck,
        FALL.replace("KIND", "explicit").replace("every = 8, keep", "every = 800, keep"),
    )
    .unwrap();
    let steps = ["--set", "analysis.steps=400", "--set", "output.every=400"];
    let lines = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let output = run_well(1, &deck, &out, &[&steps[..], more].concat());
        let of = |text: &str| text.lines().filter(|line| line.contains("/400 ")).count();
        let log = fs::read_to_string(out.join("log.txt")).unwrap();
        let seconds = column(&out, "wall_seconds").last().copied().unwrap();
        assert_eq!(column(&out, "step").len(), 400);
        (of(&text(&output)), of(&log), seconds, text(&output))
    };
    let (shown, noted, seconds, _) = lines("plain", &[]);
    assert!(
        shown == noted && noted >= 2 && noted as f64 <= 2.0 + seconds,
        "{shown} {noted} {seconds}"
    );
    let (shown, noted, ..) = lines("steps", &["--set", "output.log=150"]);
    assert_eq!((shown, noted), (4, 4), "steps 1, 150, 300, 400");
    let (shown, noted, ..) = lines("verbose", &["--verbose"]);
    assert_eq!((shown, noted), (400, 400));
    let (shown, noted, _, said) = lines("quiet", &["--quiet", "--set", "output.log=150"]);
    assert_eq!((shown, noted), (0, 4));
    assert!(!said.contains("mpm-par") && !said.contains("phase"), "{said}");
}

/// A block on a floor under gravity; steps and duration are such that doubling is exact.
const FALL: &str = r#"
title = "fall"
[analysis]
type = "KIND"
steps = 8
duration = 0.03125
[method]
basis = "mpm"
mass = "lumped"
[grid]
type = "lattice"
origin = [0, 0]
size = [1, 1]
h = 0.25
[material.m]
model = "hencky"
young = 1e4
poisson = 0.25
[[body]]
name = "block"
material = "m"
density = 1000
shape = { box = { min = [0, 0], max = [1, 0.5] } }
points_per_cell = [2, 2]
[[boundary]]
name = "floor"
where = { side = "bottom" }
fix = ["x", "y"]
[[load]]
gravity = [0, -10]
[output]
every = 1
checkpoint = { every = 8, keep = 2 }
"#;

/// A model that hardens: its state is written, read, moved between ranks, and given back by a step
/// that is cut.
#[test]
fn state_of_a_hardening_material_goes_with_its_points() {
    let folder = tempfile::tempdir().unwrap();
    let deck = deck("restart");
    let at = |name: String| folder.path().join(name);
    let hardens = ["--set", "material.clay.hardening=2e5"];
    for wrote in 1..=3 {
        run_well(wrote, &deck, &at(format!("whole-{wrote}")), &hardens);
    }
    let reference = points_of(&at("whole-1".into()).join("checkpoint-000006.h5"));
    let largest = reference["state"].iter().fold(0.0, |most: f64, &word| most.max(word));
    assert!(largest > 0.01, "nothing hardens: {largest}");
    let norms = reference["plastic_strain"].iter().map(|norm| norm * (2.0_f64 / 3.0).sqrt());
    for (word, norm) in reference["state"].iter().zip(norms) {
        assert!((word - norm).abs() < 1e-12, "{word} {norm}");
    }
    for wrote in 1..=3 {
        let middle = at(format!("whole-{wrote}")).join("checkpoint-000003.h5");
        for goes_on in 1..=3 {
            let part = at(format!("part-{wrote}-{goes_on}"));
            let middle = middle.display().to_string();
            let words = [&hardens[..], &["--restart", &middle]].concat();
            run_well(goes_on, &deck, &part, &words);
            let end = points_of(&part.join("checkpoint-000006.h5"));
            let (error, field) = difference(&reference, &end);
            assert!(error < 1e-8, "{wrote} -> {goes_on}: {field} differs by {error:e}");
            if wrote == goes_on {
                let whole = points_of(&at(format!("whole-{wrote}")).join("checkpoint-000006.h5"));
                assert_eq!(difference(&whole, &end).0, 0.0, "{wrote} ranks: not bit by bit");
            }
        }
    }
    // Steps that are cut count what they keep, and nothing else.
    let cut = ["--set", "analysis.steps=3", "--set", "analysis.max_iterations=6"];
    run_well(2, &deck, &at("cut".into()), &[&hardens[..], &cut].concat());
    let end = points_of(&at("cut".into()).join("checkpoint-000003.h5"));
    assert!(fs::read_to_string(at("cut".into()).join("log.txt")).unwrap().contains("refused"));
    for (word, norm) in end["state"].iter().zip(&end["plastic_strain"]) {
        assert!((word - norm * (2.0_f64 / 3.0).sqrt()).abs() < 1e-12, "{word} {norm}");
    }
    // Without hardening the digits are those of the perfect law, and nothing is carried.
    run_well(1, &deck, &at("perfect".into()), &[]);
    let perfect = points_of(&at("perfect".into()).join("checkpoint-000006.h5"));
    assert!(!perfect.contains_key("state"));
}
