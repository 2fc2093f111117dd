#!/bin/bash
# one-machine-slurm.sh FOLDER COMMAND...: starts a Slurm of this machine alone with everything it
# keeps in FOLDER, runs COMMAND under it, and stops it. Needs root, slurm-wlm and munge.
# Exit code 77: it cannot be had here; the reason is printed.
set -uo pipefail

[ $# -ge 2 ] || {
    echo "usage: one-machine-slurm.sh FOLDER COMMAND..." >&2
    exit 2
}
folder=$(mkdir -p "$1" && cd "$1" && pwd)
shift
cannot() {
    echo "no Slurm here: $1"
    exit 77
}
[ "$(id -u)" = 0 ] || cannot "only root may start it"
for program in slurmctld slurmd sbatch munged; do
    command -v $program >/dev/null || cannot "$program is missing (apt-get install slurm-wlm munge)"
done
pgrep -x slurmctld >/dev/null && cannot "another one is running"

host=$(hostname -s)
export SLURM_CONF=$folder/slurm.conf
mkdir -p "$folder/state" "$folder/spool"
cat >"$SLURM_CONF" <<CONF
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=2
KillWait=5
MpiDefault=none
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
NodeName=$host NodeAddr=127.0.0.1 CPUs=4 RealMemory=4000
PartitionName=all Nodes=ALL Default=YES State=UP MaxTime=60
PartitionName=other Nodes=ALL State=UP MaxTime=60
CONF
echo "CgroupAutomount=no" >"$folder/cgroup.conf"

# A munge daemon of our own: the machine's may not run.
munge_pid=
if ! munge -n >/dev/null 2>&1; then
    install -d -o munge -g munge /run/munge /var/log/munge
    runuser -u munge -- munged --force >"$folder/munged.log" 2>&1 || cannot "munged does not start"
    munge_pid=/run/munge/munged.pid
fi
# However this ends, nothing of it is left: jobs first, then the daemons.
stop() {
    trap - EXIT
    if sinfo -h >/dev/null 2>&1; then
        scancel --user="$(id -un)" --full --signal=KILL 2>/dev/null
        scancel --user="$(id -un)" 2>/dev/null
        for _ in $(seq 40); do
            [ -n "$(squeue -h 2>/dev/null)" ] || break
            sleep 0.5
        done
    fi
    for file in "$folder/slurmd.pid" "$folder/slurmctld.pid" $munge_pid; do
        [ -f "$file" ] || continue
        pid=$(cat "$file")
        kill "$pid" 2>/dev/null
        for _ in $(seq 40); do
            kill -0 "$pid" 2>/dev/null || break
            sleep 0.25
        done
        kill -9 "$pid" 2>/dev/null
    done
}
trap stop EXIT
trap 'exit 143' TERM INT HUP
slurmctld >"$folder/start.log" 2>&1 && slurmd >>"$folder/start.log" 2>&1 ||
    cannot "it does not start: $(tail -n 2 "$folder/start.log")"
for _ in $(seq 60); do
    [ "$(sinfo -h -p all -o %T 2>/dev/null)" = idle ] && break
    sleep 0.5
done
[ "$(sinfo -h -p all -o %T)" = idle ] || cannot "the node does not come up: $(tail -n 2 "$folder/slurmd.log")"
# In the background, so that a signal ends the wait at once.
"$@" &
wait $!
