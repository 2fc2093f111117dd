# A cluster whose Slurm starts MPI itself. Copy this file, name it after the machine, load its
# modules here, and set MACHINE to its name.
#
# module load petsc hdf5 metis

launch() {
    ranks=$1
    shift
    # --mpi: what `srun --mpi=list` offers; pmix for Open MPI, pmi2 or cray_shasta for MPICH.
    export OMP_NUM_THREADS=1
    exec srun --mpi="${MPI_KIND:-pmix}" --ntasks="$ranks" --kill-on-bad-exit=1 "$@"
}
