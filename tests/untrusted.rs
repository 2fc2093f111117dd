//! A deck may come from anybody, and a results directory may hold anybody's files: nothing is lost,
//! nothing is loaded or written elsewhere, and nothing is read for ever.

mod common;

use std::ffi::CString;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::Command;

use common::job;
use common::run::{Outcome, Run};

/// A soft block on smooth ground under its own weight.
fn block() -> Run {
    Run::text(include_str!("decks/block.toml"))
}

/// Refused as bad input, on 1 and 2 ranks, by a message with this part; returns what is there then.
#[track_caller]
fn refused(run: &Run, part: &str, put: impl Fn(&Path)) -> Outcome {
    let mut last = None;
    for ranks in [1, 2] {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path());
        let outcome = run.clone().ranks(ranks).limit(60).attempt_in(folder);
        assert!(outcome.said().contains(part), "on {ranks} ranks: {}", outcome.stderr);
        assert_eq!(outcome.code, 2, "on {ranks} ranks: {}", outcome.stderr);
        last = Some(outcome);
    }
    last.unwrap()
}

/// `log.txt` and `history.csv` are anybody's names: `--force` does not make them the program's.
#[test]
fn force_leaves_the_users_own_files() {
    let mine = [("log.txt", "dear diary\n"), ("history.csv", "year,event\n1789,much\n")];
    let put = |folder: &Path| {
        fs::create_dir(folder.join("out")).unwrap();
        mine.iter()
            .for_each(|(name, text)| fs::write(folder.join("out").join(name), text).unwrap());
    };
    for words in [&["--force"][..], &[]] {
        let run = words.iter().fold(block(), |run, word| run.word(*word));
        let part = "error: out holds files under names that a run writes, and nothing shows that a \
                    run of this program wrote them: history.csv, log.txt\n    try: --out DIR";
        let outcome = refused(&run, part, put);
        for (name, text) in mine {
            let path = outcome.folder.path().join("out").join(name);
            assert_eq!(fs::read_to_string(path).unwrap(), text);
        }
    }
    // Beside results of a run as well.
    let first = block().attempt();
    assert_eq!(first.code, 0, "{}", first.stderr);
    let log = first.folder.path().join("out/log.txt");
    fs::write(&log, "dear diary\n").unwrap();
    let again = block().word("--force").attempt_in(first.folder);
    assert_eq!(again.code, 2, "{}", again.stderr);
    assert!(again.said().contains("wrote them: log.txt\n"), "{}", again.stderr);
    assert_eq!(fs::read_to_string(&log).unwrap(), "dear diary\n");
    assert!(again.folder.path().join("out/points-000002.h5").exists());
}

/// What loads a library, starts a program or writes a file is refused in the deck, also when it only
/// is to be checked, and passes on the command line.
#[test]
fn a_deck_runs_no_code_and_writes_no_files() {
    for option in [
        "dll_append = \"./F.so\"",
        "dll_prepend = \"./F.so\"",
        "log_view = \":F\"",
        "history = \"F\"",
        "info = \":F\"",
        "log = \"F\"",
        "malloc_view = \"F\"",
        "options_file = \"F\"",
        "qs_ksp_view = \"ascii:F\"",
        "qs_ksp_view_mat = \"binary:F\"",
        "qs_ksp_type = \"-start_in_debugger\"",
    ] {
        let run = block().replaced(|deck| format!("{deck}\n[petsc]\n{option}\n"));
        for run in [run.clone(), run.word("--check")] {
            let name = option.split(' ').next().unwrap();
            let outcome = refused(&run, &format!("petsc.{name}: a deck "), |_| ());
            assert!(outcome.said().contains("command line, as -NAME VALUE"), "{}", outcome.stderr);
            assert_eq!(outcome.files(), ["deck.toml"], "{option}");
        }
    }
    let outcome = block().word("-qs_ksp_view").word("ascii:F").attempt();
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    assert!(outcome.files().contains(&"F".to_string()));
}

fn pipe(path: &Path) {
    let name = CString::new(path.as_os_str().as_bytes()).unwrap();
    // SAFETY: a path that ends in a zero byte.
    assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
}

/// Devices and pipes never end, or never begin.
#[test]
fn only_regular_files_are_read() {
    let points = |file: &str| {
        block()
            .set("body.0.points_per_cell=")
            .set(format!("body.0.shape={{ points = \"{file}\" }}"))
    };
    let mesh = |file: &str| {
        block()
            .set(format!("grid={{ type = \"mesh\", file = \"{file}\" }}"))
            .set("method={ basis = \"mpm\" }")
            .set("boundary.0.where={ box = { min = [0, 0], max = [6, 0] } }")
            .set("boundary.1.where={ box = { min = [0, 0], max = [0, 4] } }")
    };
    let put = |folder: &Path| pipe(&folder.join("pipe"));
    for (run, part) in [
        (points("/dev/zero"), "cannot read /dev/zero: it is a device, expected a regular file"),
        (points("pipe"), "pipe: it is a pipe, expected a regular file"),
        (mesh("/dev/zero"), "the mesh /dev/zero: it is a device, expected a regular file"),
        (mesh("pipe"), "pipe: it is a pipe, expected a regular file"),
        (Run::file("/dev/zero"), "the deck /dev/zero: it is a device, expected a regular file"),
        (Run::file("pipe"), "the deck pipe: it is a pipe, expected a regular file"),
    ] {
        refused(&run, part, put);
    }
    // A hole of a terabyte takes no room on the disk.
    let hole = |folder: &Path| {
        fs::File::create(folder.join("hole")).unwrap().set_len(1 << 40).unwrap();
    };
    refused(&points("hole"), "has 1099511627776 bytes or more, expected at most 17179869184", hole);
    refused(&Run::file("hole"), "1099511627776 bytes or more, expected at most 67108864", hole);
}

/// A file that was named by mistake, or on purpose, does not appear on the screen.
#[test]
fn what_is_no_file_of_points_is_not_shown() {
    let put = |folder: &Path| {
        fs::write(folder.join("secret"), "root:$6$hash,second\nhunter2,more\n").unwrap();
    };
    let run = block().set("body.0.points_per_cell=").set("body.0.shape={ points = \"secret\" }");
    let outcome =
        refused(&run, "secret:1: this is not a file of points: the header must read", put);
    for word in ["root", "hash", "second", "hunter2"] {
        assert!(!outcome.stderr.contains(word) && !outcome.stdout.contains(word), "{word}");
    }
}

/// mpirun can give each rank words of its own.
#[test]
fn other_arguments_on_another_rank_are_refused_by_all() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("deck.toml"), include_str!("decks/block.toml")).unwrap();
    let program = env!("CARGO_BIN_EXE_mpm-par");
    for other in ["--frce", "--check"] {
        let mut job = job(1, 60);
        job.args([program, "deck.toml", ":", "-n", "1", program, "deck.toml", other]);
        let output = job.current_dir(folder.path()).output().expect("mpirun is on the PATH");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        let part = "error: rank 1 was given other arguments than rank 0";
        assert_eq!(said.matches(part).count(), 1, "{said}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// A line is kept once, not once for each key on it.
#[test]
fn a_long_line_takes_memory_in_proportion_to_its_length() {
    let read = |count: usize| {
        let boxes: Vec<String> = (0..count)
            .map(|k| format!("{{ box = {{ min = [0, {k}e-3], max = [4, 3] }} }}"))
            .collect();
        let shape = format!("shape = {{ union = [{}] }}", boxes.join(", "));
        let text = include_str!("decks/block.toml")
            .replace("shape = { box = { min = [0, 0], max = [4, 3] } }", &shape);
        let deck = mpm_par::deck::read(Path::new("deck.toml"), &text, &[]).expect("a good deck");
        (format!("{:?}", deck.origins).len(), text.len())
    };
    for count in [50, 400] {
        let (kept, written) = read(count);
        assert!(kept < 30 * written, "{kept} bytes of memory for {written} of text");
    }
}

/// Names go into the headers of tables, which have one line.
#[test]
fn names_have_one_line() {
    let run = block().set("boundary.0.name=\"gro\\nund\"");
    refused(&run, "boundary.0.name: expected a name without line ends", |_| ());
}

/// Another MPI's launcher starts runs of one rank each; here its trace in the environment.
#[test]
fn anothers_launcher_is_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("deck.toml"), include_str!("decks/block.toml")).unwrap();
    for (name, alarm) in [("PMI_SIZE", true), ("SLURM_NTASKS", false)] {
        let mut run = Command::new(env!("CARGO_BIN_EXE_mpm-par"));
        run.args(["deck.toml", "--check"]).env(name, "4").current_dir(folder.path());
        let output = run.output().expect("the program");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{said}");
        let part = "the launcher of MPICH or Intel MPI has started 4 processes (PMI_SIZE)";
        assert_eq!(said.contains(part), alarm, "{said}");
    }
}
