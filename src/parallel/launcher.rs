//! Whether the launcher that started this process belongs to the MPI that the program is linked with.
//! A launcher of another MPI starts n runs of one rank each.

/// Variables in which launchers leave the number of processes that they have started: Open MPI's mpirun,
/// those of MPICH and Intel MPI, srun. What Slurm grants to a job (`SLURM_NTASKS`) is not among them:
/// in a job of many tasks anybody may run a program on one rank.
const SIZES: [(&str, &str); 3] = [
    ("OMPI_COMM_WORLD_SIZE", "Open MPI's mpirun"),
    ("PMI_SIZE", "the launcher of MPICH or Intel MPI"),
    ("SLURM_STEP_NUM_TASKS", "srun"),
];

/// A warning if the world has one rank and the only launchers that are known of have started
/// several. `variable`: of the environment; `library`: the name of this program's MPI.
pub fn warning(
    ranks: usize,
    library: &str,
    variable: impl Fn(&str) -> Option<String>,
) -> Option<String> {
    let launched: Vec<(&str, &str, usize)> = SIZES
        .iter()
        .filter_map(|(name, who)| Some((*name, *who, variable(name)?.trim().parse().ok()?)))
        .collect();
    if ranks > 1 || launched.iter().any(|(_, _, size)| *size == ranks) {
        return None;
    }
    let (name, who, size) = launched.into_iter().find(|(_, _, size)| *size > ranks)?;
    Some(format!(
        "warning: {who} has started {size} processes ({name}), and each of them is a run of its own \
         on 1 rank: this program is linked with {library}; start it with the mpirun of that library, \
         or with srun --mpi=pmix"
    ))
}

/// The rank of this process by its launcher's variables, before MPI starts; 0 without a launcher.
pub fn rank_of_process(variable: impl Fn(&str) -> Option<String>) -> usize {
    let names = ["OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK", "SLURM_PROCID"];
    names.iter().find_map(|name| variable(name)?.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alarm(ranks: usize, set: &[(&str, &str)]) -> Option<String> {
        let found = |name: &str| set.iter().find(|(n, _)| *n == name).map(|(_, v)| v.to_string());
        warning(ranks, "Open MPI v4.1.4", found)
    }

    #[test]
    fn another_launcher_is_named() {
        let text = alarm(1, &[("PMI_SIZE", "4"), ("PMI_RANK", "0")]).unwrap();
        assert!(text.contains("MPICH") && text.contains("4 processes (PMI_SIZE)"), "{text}");
        assert!(alarm(1, &[("SLURM_STEP_NUM_TASKS", "8"), ("SLURM_NTASKS", "8")]).is_some());
        assert!(alarm(1, &[("OMPI_COMM_WORLD_SIZE", "2")]).is_some());
    }

    #[test]
    fn good_starts_raise_no_alarm() {
        // One rank by itself; in a job of eight tasks; by mpirun in it, also below srun.
        assert_eq!(alarm(1, &[]), None);
        assert_eq!(alarm(1, &[("SLURM_NTASKS", "8")]), None);
        let inside = [("SLURM_STEP_NUM_TASKS", "2"), ("OMPI_COMM_WORLD_SIZE", "1")];
        assert_eq!(alarm(1, &inside), None);
        assert_eq!(alarm(4, &[("OMPI_COMM_WORLD_SIZE", "4")]), None);
        assert_eq!(alarm(8, &[("PMI_SIZE", "8"), ("SLURM_STEP_NUM_TASKS", "8")]), None);
        // Two of eight tasks were joined by other means.
        assert_eq!(alarm(2, &[("SLURM_STEP_NUM_TASKS", "8")]), None);
    }
}
