//! Runs things under `mpirun` from ordinary tests, with a time limit, and not too many at a time.
#![allow(dead_code)]

pub mod at_once;
pub mod left;
pub mod product;
pub mod room;
pub mod run;
pub mod validation;

use std::ffi::OsStr;
use std::process::{Command, Output, Stdio};

use mpi::environment::Universe;

/// Seconds after which `mpirun` kills a job: a deadlock fails instead of hanging.
const TIME_LIMIT: u32 = 120;
/// More ranks than cores, none bound, and waiting ranks give way; root is welcome. Open MPI 5 has its
/// own names for the first two.
const OPEN_MPI: [(&str, &str); 8] = [
    ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
    ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
    ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
    ("OMPI_MCA_hwloc_base_binding_policy", "none"),
    ("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe"),
    ("PRTE_MCA_hwloc_default_binding_policy", "none"),
    ("OMPI_MCA_mpi_yield_when_idle", "1"),
    ("OMP_NUM_THREADS", "1"),
];
/// Set in the ranks of [`on_ranks`].
const INSIDE: &str = "MPM_PAR_TEST_RANK";

/// Runs `command` (program, then its arguments) on `n` ranks with extra environment variables.
pub fn mpirun<S: AsRef<OsStr>>(n: usize, command: &[S], env: &[(&str, &str)]) -> Output {
    let _room = room::Room::take(n);
    let mut job = job(n, TIME_LIMIT);
    job.args(command).envs(env.iter().copied());
    job.output().expect("mpirun is on the PATH")
}

/// `mpirun` on `n` ranks, killed after `seconds`; what it runs is yet to be said.
pub fn job(n: usize, seconds: u32) -> Command {
    let mut job = Command::new("mpirun");
    job.args(["-n", &n.to_string(), "--timeout", &seconds.to_string()]);
    job.envs(OPEN_MPI).env_remove("PETSC_OPTIONS").stdin(Stdio::null());
    job
}

/// Body of a test on several rank counts. The ordinary test process starts its own executable
/// under `mpirun` for each of `counts`, restricted to the test `name` (its path as the harness
/// prints it); the ranks come here again and run `body`.
pub fn on_ranks(name: &str, counts: &[usize], body: impl FnOnce(&Universe)) {
    on_ranks_with(name, counts, &[], body);
}

/// [`on_ranks`] with environment variables for the ranks.
pub fn on_ranks_with(
    name: &str,
    counts: &[usize],
    env: &[(&str, &str)],
    body: impl FnOnce(&Universe),
) {
    if std::env::var(INSIDE).as_deref() == Ok(name) {
        let (universe, _) = mpi::initialize_with_threading(mpi::Threading::Funneled)
            .expect("MPI was not started before");
        mpm_par::petsc::install_panic_hook();
        body(&universe);
        return;
    }
    let program = std::env::current_exe().expect("the path of this test");
    let command: Vec<&OsStr> = vec![
        program.as_os_str(),
        OsStr::new("--exact"),
        OsStr::new(name),
        OsStr::new("--nocapture"),
        OsStr::new("--test-threads=1"),
        OsStr::new("--include-ignored"),
    ];
    let env: Vec<(&str, &str)> = env.iter().copied().chain([(INSIDE, name)]).collect();
    for &n in counts {
        let output = mpirun(n, &command, &env);
        let stdout = String::from_utf8_lossy(&output.stdout);
        assert!(
            output.status.success() && stdout.matches("1 passed").count() == n,
            "{name} failed on {n} ranks ({})\n{stdout}\n{}",
            output.status,
            String::from_utf8_lossy(&output.stderr)
        );
    }
}
