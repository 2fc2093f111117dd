#!/bin/bash
# test-slurm.sh FOLDER: under a Slurm (see one-machine-slurm.sh) submits the chain with jobs too
# short for the run, one of them killed without warning, then a chain and the scaling scripts with
# srun (MACHINE=slurm). Exit code 0 if the chains end with the whole run and the tables are there.
set -uo pipefail

folder=$1
fail() {
    echo "test: $1" >&2
    squeue >&2
    tail -n 20 "$folder"/*.log >&2
    exit 1
}
. "$(pwd)/jobs/common.sh"
export LINKS=25 MACHINE=local
settings=(--set grid.h=0.0625 --set analysis.tolerance=1e-9 --set "output.checkpoint={every=5}")
# So many steps that the run takes 90 s here and now: longer than a job may last.
sh jobs/mpirun.sh 2 "$PROGRAM" tests/decks/restart.toml --out "$folder/trial" "${settings[@]}" \
    --set analysis.steps=1000 --set output.every=1000 >"$folder/trial.log" 2>&1 &
trial=$!
sleep 15
kill -TERM $trial
wait $trial
done_in_trial=$(($(wc -l <"$folder/trial/history.csv") - 1))
steps=${STEPS:-$((done_in_trial * 6 + 60))}
# Slurm counts whole minutes and looks every half minute: the warning comes at 0 to 30 s. The
# first link gets none that means anything, and is killed by its time limit.
export CHAIN_OPTIONS="--signal=B:USR1@30 --output=$folder/chain-%j.log"
first=$(sbatch --parsable --ntasks=2 --time=1 --signal=B:CONT@10 --output="$folder/chain-%j.log" \
    jobs/chain.sbatch tests/decks/restart.toml "$folder/out" --set "analysis.steps=$steps" \
    --set "output.every=$steps" "${settings[@]}") || fail "sbatch refused the chain"

rows() { wc -l <"$folder/out/history.csv" 2>/dev/null || echo 0; }
status() { sed -n 's/^  "status": "\(.*\)",$/\1/p' "$folder/out/summary.json" 2>/dev/null; }
wait_for() {
    what=$1
    shift
    for _ in $(seq "${PATIENCE:-900}"); do
        "$@" && return
        sleep 1
    done
    fail "$what"
}
wait_for "the first link is not killed by its time limit" \
    grep -qs "DUE TO TIME LIMIT" "$folder/chain-$first.log"
limited=$(rows)
# The second: killed with all its processes, without warning, once it has left a checkpoint.
running() { squeue -h -t R -o %i | grep -v "^$first\$" | head -n 1; }
newest() { ls "$folder/out" | sed -n 's/^checkpoint-0*\([0-9]*\)\.h5$/\1/p' | sort -n | tail -n 1; }
reached=$(newest)
[ -n "$reached" ] || fail "the first link left no checkpoint"
further() { [ -n "$(running)" ] && [ "$(newest)" -gt "$reached" ]; }
wait_for "no checkpoint of a second link" further
second=$(running)
before=$(rows)
# Not by scancel, which sends SIGTERM before SIGKILL.
kill -9 $(scontrol listpids "$second" | awk '$1 + 0 > 1 {print $1}')
# The links after it go on, some stopped by their time limit, to the end.
ended() { [ "$(status)" = completed ] || [ -z "$(squeue -h)" ]; }
wait_for "the chain does not end" ended
[ "$(status)" = completed ] || fail "the chain ended early"
[ "$before" -lt "$steps" ] || fail "the run was over before it was killed"
[ "$(rows)" = $((steps + 1)) ] || fail "history.csv has $(rows) rows for $steps steps"
grep -q "asked the run to stop" "$folder/chain-$second.log" && fail "the second link was warned"
echo "chain: killed at row $limited by its time limit, at row $before without warning, of" \
    "$steps; links: $(ls "$folder"/chain-*.log | wc -l), stopped by the warning:" \
    "$(grep -l 'asked the run to stop' "$folder"/chain-*.log | wc -l)"
wait_for "a link is left" sh -c '[ -z "$(squeue -h)" ]'

# As on a cluster, by srun.
export MACHINE=slurm
unset LINKS
export CHAIN_OPTIONS="--output=$folder/srun-%j.log"
first=$(sbatch --parsable --ntasks=2 --time=7 --partition=other --account=soil --job-name="a name" \
    --output="$folder/srun-%j.log" jobs/chain.sbatch tests/decks/restart.toml "$folder/srun" \
    --set analysis.steps=60 --set output.every=60 "${settings[@]}") || fail "sbatch refused the chain"
wait_for "no checkpoint of a run by srun" sh -c "ls $folder/srun/checkpoint-*.h5 >/dev/null 2>&1"
kept=$(squeue -h -o '%i %l %D %P %a %j' | grep -v "^$first ")
scancel --signal=USR1 --batch "$first"
completed() { grep -q '^  "status": "completed"' "$folder/srun/summary.json" 2>/dev/null; }
wait_for "the chain by srun does not end" completed
[ "${kept#* }" = "7:00 1 other soil a name" ] || fail "the next link asks for: $kept"
grep -q "chain: SIGUSR1" "$folder/srun-$first.log" || fail "srun did not hand the signal on"
[ "$(wc -l <"$folder/srun/history.csv")" = 61 ] || fail "the chain by srun is not whole"
echo "chain by srun: stopped and gone on, with the options of its first job"
wait_for "a link is left" sh -c '[ -z "$(squeue -h)" ]'

export OUT=$folder/scaling RANKS="1 2" H=0.5
for kind in strong weak; do
    sbatch --wait --ntasks=2 --time=5 --output="$folder/$kind.log" jobs/$kind.sbatch >/dev/null &
done
wait
for kind in strong weak; do
    [ "$(grep -c ',8,' "$OUT/scaling-$kind.csv")" = 2 ] && [ -s "$OUT/scaling-$kind.svg" ] ||
        fail "$kind.sbatch left no table"
done
echo "scaling: tables written"
