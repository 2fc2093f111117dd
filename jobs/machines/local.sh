# This machine, with Open MPI, without a batch system or under a one-machine Slurm.
# A machine file defines launch RANKS PROGRAM ARGUMENTS... and may load modules. It is called in a
# subshell and ends in exec, so that signals to that process reach the launcher.

launch() {
    exec sh "$ROOT/jobs/mpirun.sh" "$@"
}
