#!/bin/sh
# Installs the Debian packages that the build and the tests need, those that are missing only.
# Quiet when there is nothing to do; safe to repeat. Needs root or sudo only to install.
#
#   MPM_PAR_SKIP_SETUP=1   trust the machine (module systems, other distributions)
set -eu

packages="libpetsc-real-dev libopenmpi-dev openmpi-bin libhdf5-openmpi-dev libmetis-dev
libclang-dev pkg-config hdf5-tools libopenblas0-serial gcc g++"

fail() {
    echo "setup: $1" >&2
    exit 4
}

[ "${MPM_PAR_SKIP_SETUP:-0}" = 1 ] && exit 0

command -v cargo >/dev/null 2>&1 ||
    fail "cargo is missing: install Rust 1.89 or newer from https://rustup.rs, then repeat"

command -v dpkg-query >/dev/null 2>&1 || fail "this is not a Debian system. Install PETSc 3.18 to 3.26 (real \
scalars), MPI, HDF5 1.10 or newer, METIS 5, libclang and pkg-config by its \
own means, then set MPM_PAR_SKIP_SETUP=1"

missing=
for package in $packages; do
    status=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
    [ "$status" = installed ] || missing="$missing $package"
done
[ -z "$missing" ] && exit 0

if [ "$(id -u)" = 0 ]; then
    as_root=
elif command -v sudo >/dev/null 2>&1; then
    as_root=sudo
else
    fail "these packages are missing and need root to install:
  apt-get install$missing"
fi

echo "setup: installing$missing"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# Left unquoted on purpose: $as_root may be empty, $missing is a list.
install() {
    $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -q --no-install-recommends $missing >"$log" 2>&1
}
# Package lists may be absent (containers) or fresh enough; ask for new ones when they are not.
install || {
    $as_root apt-get update -q >"$log" 2>&1 && install
} || {
    tail -n 20 "$log" >&2
    fail "apt-get could not install$missing (its last words are above). Debian 12 and 13 have these \
packages; check the network and /etc/apt/sources.list"
}

petsc=$(pkg-config --modversion petsc 2>/dev/null || pkg-config --modversion PETSc 2>/dev/null || true)
case $petsc in
    3.1[89].*|3.2[0-6].*) ;;
    *) fail "PETSc 3.18 to 3.26 is needed, found '${petsc:-none}': Debian 12 (bookworm) and 13 (trixie) have one" ;;
esac
