# Sourced by the job scripts: where the project is, which machine, how programs start.
# Slurm runs a copy of the script, so its own folder tells nothing: submit from the project.

ROOT=${ROOT:-${SLURM_SUBMIT_DIR:-$(pwd)}}
[ -f "$ROOT/jobs/common.sh" ] || {
    echo "start this from the project's folder, or set ROOT to it" >&2
    exit 2
}
PROGRAM=${PROGRAM:-$ROOT/target/release/mpm-par}
[ -x "$PROGRAM" ] || {
    echo "$PROGRAM is missing: make build" >&2
    exit 2
}
MACHINE=${MACHINE:-local}
[ -f "$ROOT/jobs/machines/$MACHINE.sh" ] || {
    echo "no jobs/machines/$MACHINE.sh; there are:" "$ROOT"/jobs/machines/*.sh >&2
    exit 2
}
. "$ROOT/jobs/machines/$MACHINE.sh"
