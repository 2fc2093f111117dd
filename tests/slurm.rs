//! The job scripts under a real Slurm of one machine: a chain that is killed once and stopped by
//! its time limit ends with the whole run, another one started by srun keeps its options; the scaling
//! scripts leave their tables.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Exit code of jobs/one-machine-slurm.sh where no Slurm can be had.
const CANNOT: i32 = 77;
/// A chain has a handful of links of a minute; the scaling scripts take less.
const LIMIT: Duration = Duration::from_secs(30 * 60);

/// The script that owns the daemons: asked to clean up if the test ends before it does.
struct Slurm(Child);

impl Drop for Slurm {
    fn drop(&mut self) {
        if self.0.try_wait().ok().flatten().is_none() {
            // SAFETY: signals a process that this test started.
            unsafe { libc::kill(self.0.id() as i32, libc::SIGTERM) };
            let _ = self.0.wait();
        }
    }
}

#[test]
#[ignore = "minutes; needs root, slurm-wlm and munge: make validate"]
fn job_scripts_run_under_slurm() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a scratch folder");
    let path = folder.path().display().to_string();
    let log = folder.path().join("test.txt");
    let output = std::fs::File::create(&log).expect("the scratch folder is writable");
    let errors = output.try_clone().expect("a second handle");
    let script = "jobs/one-machine-slurm.sh \"$1\" bash jobs/test-slurm.sh \"$1\"";
    let child = Command::new("bash")
        .args(["-c", &format!("exec bash {script}"), "bash", &path])
        .current_dir(root)
        .env("PROGRAM", env!("CARGO_BIN_EXE_mpm-par"))
        .env_remove("PETSC_OPTIONS")
        .stdin(Stdio::null())
        .stdout(output)
        .stderr(errors)
        .spawn()
        .expect("bash is on the PATH");
    let mut slurm = Slurm(child);
    let begin = Instant::now();
    let status = loop {
        if let Some(status) = slurm.0.try_wait().expect("a child of this test") {
            break status;
        }
        assert!(begin.elapsed() < LIMIT, "{}", std::fs::read_to_string(&log).unwrap_or_default());
        std::thread::sleep(Duration::from_millis(200));
    };
    let text = std::fs::read_to_string(&log).unwrap_or_default();
    println!("{text}");
    if status.code() == Some(CANNOT) {
        println!("not tested");
        return;
    }
    assert!(status.success(), "{status}\n{text}");
    for part in ["chain: killed at row", "chain by srun: stopped and gone on", "tables written"] {
        assert!(text.contains(part), "{text}");
    }
    for daemon in ["slurmd.pid", "slurmctld.pid"] {
        let pid = std::fs::read_to_string(folder.path().join(daemon)).unwrap_or_default();
        let alive = !pid.trim().is_empty() && Path::new("/proc").join(pid.trim()).exists();
        assert!(!alive, "{daemon} still runs");
    }
}
