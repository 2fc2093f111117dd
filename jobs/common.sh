# Sourced by the job scripts: where the project is, which machine, how programs start.

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
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
