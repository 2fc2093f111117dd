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
# Open MPI counts cores, not hardware threads, and refuses more ranks than it counts. The second name is
# that of Open MPI 5.
export OMPI_MCA_rmaps_base_oversubscribe=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
cores=$(lscpu --parse=CORE,SOCKET 2>/dev/null | grep -v '^#' | sort -u | wc -l)
if [ "$ranks" -gt "$cores" ]; then
    # Waiting ranks give way to working ones.
    export OMPI_MCA_hwloc_base_binding_policy=none PRTE_MCA_hwloc_default_binding_policy=none
    export OMPI_MCA_mpi_yield_when_idle=1
fi
export OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}"

# mpirun answers SIGTERM and Ctrl-C by killing the ranks a second later. SIGUSR1 it hands on: the
# program writes a checkpoint after its step and stops. So the first signal becomes that one, and
# only the next is meant as it is. In a session of its own Ctrl-C does not reach mpirun first.
own=
command -v setsid >/dev/null 2>&1 && own=setsid
# Before the start: a signal in between would end this script and leave the job behind.
job=
asked=
stop() {
    asked=yes
    [ -z "$job" ] || kill -USR1 "$job" 2>/dev/null || true
}
trap stop USR1
trap 'stop; trap "[ -z \"\$job\" ] || kill -TERM \$job 2>/dev/null" TERM INT HUP' TERM INT HUP
$own mpirun -n "$ranks" "$@" &
job=$!
[ -z "$asked" ] || stop
# Should this script be killed outright, the run stops in good order instead of living on unseen.
# A process that is dead and not yet asked for its exit code still answers signals.
$own sh -c 'alive() {
        kill -0 "$1" || return 1
        case "$(cat "/proc/$1/stat")" in *") Z "*) return 1 ;; esac
    }
    while alive "$1" && kill -0 "$2"; do sleep 1; done
    kill -USR1 "$2"' watch $$ "$job" >/dev/null 2>&1 &
watch=$!
# A signal ends the wait, not the job.
code=0
wait "$job" || code=$?
while kill -0 "$job" 2>/dev/null; do
    code=0
    wait "$job" || code=$?
done
kill "$watch" 2>/dev/null || true
# A launcher that was told twice ends by a signal or a crash of its own: the run has failed.
[ -z "$asked" ] || [ "$code" -le 4 ] || code=1
exit "$code"
