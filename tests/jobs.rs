//! The job scripts without a batch system, and with a stand-in for one: a chain ends with the whole
//! run, replaces nothing unasked, keeps its options and can be stopped; the scaling scripts leave
//! whole tables or none. `slurm.rs` has them under a real Slurm.

mod common;
#[path = "common/program.rs"]
mod program;

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::channel;
use std::time::Duration;

use program::*;

/// Steps that no test waits for; their loads are small, so that the tolerance must not be.
const ENDLESS: usize = 20_000;

/// A script of jobs/ on one rank, as a user without Slurm starts it.
fn script(name: &str, words: &[&str]) -> Command {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new("bash");
    command.arg(root.join("jobs").join(name)).args(words).current_dir(root);
    for (name, _) in std::env::vars() {
        if name.starts_with("SLURM_") || name.starts_with("CHAIN_") {
            command.env_remove(name);
        }
    }
    for name in ["ROOT", "MACHINE", "LINKS", "LIMIT", "OUT", "H", "PETSC_OPTIONS"] {
        command.env_remove(name);
    }
    command.env("PROGRAM", PROGRAM).env("RANKS", "1");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// The chain on the deck of the restart tests, a checkpoint every five of `steps`.
fn chain(deck: &Path, out: &Path, steps: usize, more: &[&str]) -> Command {
    let (deck, out) = (deck.display().to_string(), out.display().to_string());
    let mut words = vec![deck, out];
    words.extend(settings(steps));
    words.extend(more.iter().map(|word| word.to_string()));
    words.extend(repeatable(1));
    script("chain.sbatch", &words.iter().map(String::as_str).collect::<Vec<_>>())
}

fn settings(steps: usize) -> Vec<String> {
    let keys = [
        format!("analysis.steps={steps}"),
        format!("output.every={steps}"),
        "output.checkpoint={every=5}".to_string(),
        format!("analysis.tolerance={}", if steps == ENDLESS { 1e-7 } else { 1e-11 }),
    ];
    keys.into_iter().flat_map(|key| ["--set".to_string(), key]).collect()
}

fn start(mut command: Command) -> Child {
    command.spawn().expect("bash is on the PATH")
}

/// Waits for the end of the script and of all that holds its output: a process left behind shows.
fn end(child: Child) -> Output {
    let (pid, (send, receive)) = (child.id() as i32, channel());
    std::thread::spawn(move || send.send(child.wait_with_output()));
    receive.recv_timeout(Duration::from_secs(100)).map_or_else(
        |_| {
            Running::signal(pid, libc::SIGKILL);
            panic!("the script, or something it left, does not end");
        },
        |output| output.expect("a child of this test"),
    )
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap_or_else(|| panic!("{}", text(output)))
}

/// Number of the newest checkpoint, 0 without.
fn reached(out: &Path) -> usize {
    let Ok(entries) = fs::read_dir(out) else { return 0 };
    let number = |name: String| name.strip_prefix("checkpoint-")?.strip_suffix(".h5")?.parse().ok();
    let names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter_map(number).max().unwrap_or(0)
}

/// Three links, two of them stopped, make the run in one piece.
#[test]
fn a_chain_of_links_is_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, out) = (folder.path().join("whole"), folder.path().join("out"));
    let steps = 150;
    let words = settings(steps);
    run_well(1, &deck("restart"), &whole, &words.iter().map(String::as_str).collect::<Vec<_>>());
    let mut command = chain(&deck("restart"), &out, steps, &[]);
    // Whatever counts an hour must not hold the output that long.
    let child = start({
        command.env("LIMIT", "3600");
        command
    });
    for _ in 0..2 {
        let before = reached(&out);
        wait_until(|| reached(&out) > before);
        Running::signal(child.id() as i32, libc::SIGUSR1);
        wait_until(|| reached(&out) > before + 5 || summary_says(&out, "SIGUSR1"));
    }
    let output = end(child);
    assert_eq!(code(&output), 0, "{}", text(&output));
    let said = text(&output);
    assert!(said.contains("chain: SIGUSR1") && said.contains("chain: completed"), "{said}");
    assert_eq!(history(&whole), history(&out));
    let last = format!("checkpoint-{steps:06}.h5");
    assert_eq!(difference(&points_of(&whole.join(&last)), &points_of(&out.join(&last))).0, 0.0);
    assert!(!out.join(".chain").exists());

    // Complete is complete.
    let before = contents(&out);
    let output = end(start(chain(&deck("restart"), &out, steps, &[])));
    assert_eq!(code(&output), 0, "{}", text(&output));
    assert!(text(&output).contains("nothing was run"), "{}", text(&output));
    assert!(contents(&out) == before, "a complete run was touched");
}

fn summary_says(out: &Path, word: &str) -> bool {
    fs::read_to_string(out.join("summary.json")).is_ok_and(|text| text.contains(word))
}

/// Nothing is replaced without --force, and what is refused stays as it was.
#[test]
fn a_refused_chain_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let refused = |out: &Path, deck: &Path, steps: usize, expected: i32| {
        let before = contents(out);
        let output = end(start(chain(deck, out, steps, &[])));
        assert_eq!(code(&output), expected, "{}", text(&output));
        assert!(contents(out) == before, "{} was changed", out.display());
        assert!(!text(&output).contains("no link follows"), "{}", text(&output));
    };
    let other = folder.path().join("other.toml");
    let text_of = fs::read_to_string(deck("restart")).unwrap();
    fs::write(&other, text_of.replace("\"Slump\"", "\"Other\"").replace("20e3", "30e3")).unwrap();

    // A complete run of another deck, with and without checkpoints.
    let complete = at("complete");
    let output = end(start(chain(&deck("restart"), &complete, 5, &[])));
    assert_eq!(code(&output), 0, "{}", text(&output));
    refused(&complete, &other, 5, 2);
    // Stopped, with checkpoints of another problem: the program's own refusal.
    let stopped = at("stopped");
    copy(&complete, &stopped);
    fs::remove_file(stopped.join("summary.json")).unwrap();
    refused(&stopped, &other, 5, 3);
    // Results without a checkpoint.
    fs::remove_file(stopped.join("checkpoint-000005.h5")).unwrap();
    refused(&stopped, &deck("restart"), 5, 2);
    // A deck that is wrong, and a folder that is not there.
    let output = end(start(chain(&deck("restart"), &at("new"), 5, &["--set", "grid.h=-1"])));
    assert_eq!(code(&output), 2, "{}", text(&output));
    assert!(!at("new").exists(), "a refused run left its folder");
    let output = end(start(chain(&other, &complete, 5, &["--force", "--set", "grid.h=-1"])));
    assert_eq!(code(&output), 2, "{}", text(&output));
    assert!(summary(&complete)["title"] == "Slump" && !complete.join(".chain").exists());
    // With --force it is replaced.
    let output = end(start(chain(&other, &complete, 5, &["--force"])));
    assert_eq!(code(&output), 0, "{}", text(&output));
    assert_eq!(summary(&complete)["title"], "Other");
}

/// Killed in its first link before there is a checkpoint, a chain begins again; with --force it does
/// not take up what the first link was to replace.
#[test]
fn a_chain_knows_what_it_has_begun() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output = end(start(chain(&deck("restart"), &out, 5, &[])));
    assert_eq!(code(&output), 0, "{}", text(&output));
    // The first launch dies before it has changed anything, the second leaves a table, the third runs.
    let stand_in = folder.path().join("program.sh");
    let count = folder.path().join("count");
    let body = format!(
        "#!/bin/sh\necho \"$@\" >>{count}\ncase $(wc -l <{count}) in\n1) exit 137 ;;\n2) head -n 1 \
         {out}/history.csv >{count}.head; rm {out}/*; mv {count}.head {out}/history.csv; \
         exit 137 ;;\nesac\nexec {PROGRAM} \"$@\"\n",
        count = count.display(),
        out = out.display(),
    );
    fs::write(&stand_in, body).unwrap();
    fs::set_permissions(&stand_in, fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = chain(&deck("restart"), &out, 10, &["--force"]);
    command.env("PROGRAM", &stand_in);
    let output = end(start(command));
    assert_eq!(code(&output), 0, "{}", text(&output));
    assert_eq!(history(&out).len(), 10);
    let launches = fs::read_to_string(&count).unwrap();
    assert_eq!(launches.lines().count(), 3, "{launches}");
    assert!(launches.lines().all(|line| line.contains("--force")), "{launches}");
    assert!(!launches.contains("--restart"), "{launches}");
}

/// LIMIT ends a link and LINKS the chain; the exit code tells that it is not complete.
#[test]
fn a_chain_ends_with_its_links() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = chain(&deck("restart"), folder.path(), ENDLESS, &[]);
    command.env("LIMIT", "1").env("LINKS", "2");
    let output = end(start(command));
    let said = text(&output);
    assert_eq!(code(&output), 1, "{said}");
    let links = said.matches("chain: SIGUSR1").count() + said.matches("link was killed").count();
    assert_eq!(links, 2, "{said}");
    assert!(said.contains("LINKS is used up"), "{said}");
}

/// SIGTERM ends the chain, not only the link, after a checkpoint.
#[test]
fn sigterm_ends_a_chain() {
    let folder = tempfile::tempdir().unwrap();
    let child = start(chain(&deck("restart"), folder.path(), ENDLESS, &[]));
    wait_until(|| reached(folder.path()) > 0);
    Running::signal(child.id() as i32, libc::SIGTERM);
    let output = end(child);
    let said = text(&output);
    assert_eq!(code(&output), 1, "{said}");
    assert!(said.contains("stopped by a signal"), "{said}");
    assert_eq!(said.matches("chain: SIGUSR1").count(), 1, "{said}");
    let steps = summary(folder.path())["steps_completed"].as_u64().unwrap() as usize;
    assert_eq!(reached(folder.path()), steps);
    assert_eq!(history(folder.path()).len(), steps);
}

/// ROOT from elsewhere is enough; a wrong one is an error before anything happens.
#[test]
fn the_project_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut command = chain(&deck("restart"), &out, 5, &[]);
    command.current_dir(folder.path()).env("ROOT", env!("CARGO_MANIFEST_DIR"));
    let output = end(start(command));
    assert_eq!(code(&output), 0, "{}", text(&output));
    let before = contents(&out);
    let mut command = chain(&deck("restart"), &out, 5, &["--force"]);
    command.env("ROOT", folder.path());
    let output = end(start(command));
    assert_eq!(code(&output), 2, "{}", text(&output));
    assert!(text(&output).contains("set ROOT"), "{}", text(&output));
    assert!(contents(&out) == before);
}

/// Commands that answer as Slurm's would and note what they were asked.
fn stand_in_for_slurm(folder: &Path, sbatch: &str) -> String {
    let note = folder.join("asked").display().to_string();
    let answers = [
        ("sbatch", format!("printf '%s ' sbatch \"$@\" LINKS=$LINKS CHAIN=$CHAIN_ID >>{note}\n{sbatch}")),
        ("scancel", format!("echo scancel \"$@\" >>{note}")),
        (
            "squeue",
            "f=$(printf '\\037')\necho \"1-02:00:00${f}3${f}long${f}soil${f}(null)${f}N/A${f}a|b${f}NO${f}my job\""
                .to_string(),
        ),
    ];
    for (name, body) in answers {
        let path = folder.join(name);
        fs::write(&path, format!("#!/bin/sh\n{body}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }
    format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default())
}

fn under_slurm(mut command: Command, path: &str) -> Command {
    command.env("PATH", path).env("SLURM_JOB_ID", "77").env("SLURM_NTASKS", "1");
    command.env("SLURM_SUBMIT_DIR", env!("CARGO_MANIFEST_DIR"));
    command.env("SLURM_CPUS_PER_TASK", "2").env("SLURM_MEM_PER_CPU", "900");
    command.env("CHAIN_OPTIONS", "--signal=B:USR1@30 --output=log-%j");
    command
}

/// The successor asks for what this job has; a complete chain takes it back.
#[test]
fn a_successor_keeps_the_options() {
    let folder = tempfile::tempdir().unwrap();
    let path = stand_in_for_slurm(folder.path(), "echo '78;cluster'");
    let out = folder.path().join("out");
    let output = end(start(under_slurm(chain(&deck("restart"), &out, 5, &[]), &path)));
    assert_eq!(code(&output), 0, "{}", text(&output));
    let asked = fs::read_to_string(folder.path().join("asked")).unwrap();
    for option in [
        "--dependency=afterany:77",
        "--ntasks=1 ",
        "--time=1-02:00:00",
        "--nodes=3",
        "--partition=long",
        "--account=soil",
        "--constraint=a|b",
        "--exclusive",
        "--job-name=my job",
        "--cpus-per-task=2",
        "--mem-per-cpu=900",
        "--signal=B:USR1@30 --output=log-%j",
        "LINKS=19 CHAIN=77",
        "scancel 78",
    ] {
        assert!(asked.contains(option), "no {option} in {asked}");
    }
    assert!(!asked.contains("--qos") && !asked.contains("--reservation"), "{asked}");
}

/// Without a successor a link that is not complete says so and fails.
#[test]
fn a_chain_that_breaks_fails() {
    let folder = tempfile::tempdir().unwrap();
    let path = stand_in_for_slurm(folder.path(), "echo 'no such account' >&2; exit 1");
    for (links, reason) in [("9", "could not be submitted"), ("1", "LINKS is used up")] {
        let out = folder.path().join(links);
        let mut command = under_slurm(chain(&deck("restart"), &out, ENDLESS, &[]), &path);
        command.env("LINKS", links);
        let child = start(command);
        wait_until(|| reached(&out) > 0);
        Running::signal(child.id() as i32, libc::SIGUSR1);
        let output = end(child);
        assert_eq!(code(&output), 1, "{}", text(&output));
        assert!(text(&output).contains(reason), "{}", text(&output));
    }
    let asked = fs::read_to_string(folder.path().join("asked")).unwrap();
    assert_eq!(asked.matches("sbatch").count(), 2, "the last link submits nothing: {asked}");
}

fn scaling(kind: &str, out: &Path) -> Command {
    let mut command = script(&format!("{kind}.sbatch"), &[]);
    command.env("OUT", out).env("RANKS", "1 2").env("H", "0.5").env("REPEAT", "1");
    command
}

/// Both studies into one folder at once: each has its runs and its table. A study that fails says so
/// and leaves the tables as they were.
#[test]
fn scaling_studies_keep_apart_and_fail_aloud() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let children = ["strong", "weak"].map(|kind| start(scaling(kind, out)));
    for output in children.map(end) {
        assert_eq!(code(&output), 0, "{}", text(&output));
    }
    let points = |kind: &str| -> Vec<f64> {
        let path = out.join(format!("scaling-{kind}.csv"));
        let mut table = csv::Reader::from_path(path).unwrap();
        let names = table.headers().unwrap().clone();
        let at = |name: &str| names.iter().position(|other| other == name).unwrap();
        let (points, linear) = (at("points"), at("linear"));
        let rows = table.records().map(|row| row.unwrap());
        rows.filter(|row| !row[linear].is_empty()).map(|row| row[points].parse().unwrap()).collect()
    };
    let (strong, weak) = (points("strong"), points("weak"));
    assert_eq!((strong.len(), weak.len()), (2, 2));
    assert!(strong[0] == strong[1] && weak[0] < 0.7 * weak[1], "{strong:?} {weak:?}");
    assert_eq!(strong[1], weak[1]);

    let before: Vec<_> = tables(out);
    assert_eq!(before.len(), 4, "two tables and their plots");
    let mut command = scaling("weak", out);
    command.env("PROGRAM", "/bin/false");
    let output = end(start(command));
    assert_eq!(code(&output), 1, "{}", text(&output));
    assert!(text(&output).contains("no table written: weak"), "{}", text(&output));
    assert!(tables(out) == before, "a study that failed has changed a table");
}

fn tables(out: &Path) -> Vec<(String, Vec<u8>)> {
    let files = fs::read_dir(out).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<_> = files
        .filter(|path| path.is_file())
        .map(|path| (path.display().to_string(), fs::read(path).unwrap()))
        .collect();
    found.sort();
    found
}

/// A run of endless steps on one rank below jobs/mpirun.sh, which has written a checkpoint.
fn below_mpirun_sh(out: &Path) -> Child {
    let mut words = vec!["1".to_string(), PROGRAM.to_string()];
    words.push(deck("restart").display().to_string());
    words.extend(["--out".to_string(), out.display().to_string()]);
    words.extend(settings(ENDLESS));
    words.extend(repeatable(1));
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let child = start(script("mpirun.sh", &words));
    wait_until(|| out.join("checkpoint-000005.h5").exists());
    child
}

/// The run does not outlive the script that started it, and stops in good order.
#[test]
fn killing_mpirun_sh_stops_its_run() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let child = below_mpirun_sh(&out);
    Running::signal(child.id() as i32, libc::SIGKILL);
    end(child);
    wait_until(|| out.join("summary.json").exists());
    assert_eq!(summary(&out)["status"], "stopped");
}

/// Whatever mpirun makes of a second signal, the exit code is one of the program's.
#[test]
fn a_second_signal_ends_mpirun_sh_as_a_run_that_failed() {
    let folder = tempfile::tempdir().unwrap();
    let child = below_mpirun_sh(&folder.path().join("out"));
    for _ in 0..2 {
        Running::signal(child.id() as i32, libc::SIGTERM);
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = end(child);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output));
}
