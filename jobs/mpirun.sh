#!/bin/sh
# mpirun.sh RANKS PROGRAM ARGUMENTS...: Open MPI on one machine, in a container as well.
set -eu

[ $# -ge 2 ] || {
    echo "usage: mpirun.sh RANKS PROGRAM ARGUMENTS..." >&2
    exit 2
}
ranks=$1
shift

# Open MPI refuses to start as root unless told twice; containers have no other user.
if [ "$(id -u)" = 0 ]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi
# Open MPI counts cores, not hardware threads, and refuses more ranks than it counts.
export OMPI_MCA_rmaps_base_oversubscribe=1
cores=$(lscpu --parse=CORE,SOCKET 2>/dev/null | grep -v '^#' | sort -u | wc -l)
if [ "$ranks" -gt "$cores" ]; then
    # Waiting ranks give way to working ones.
    export OMPI_MCA_hwloc_base_binding_policy=none OMPI_MCA_mpi_yield_when_idle=1
fi
# After SIGTERM a rank may finish its step and write a checkpoint before it is killed, s.
export OMPI_MCA_odls_base_sigkill_timeout="${OMPI_MCA_odls_base_sigkill_timeout:-60}"
export OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}"
exec mpirun -n "$ranks" "$@"
