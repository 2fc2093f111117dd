#!/bin/bash
# Builds against Debian's PETSc with 64-bit indices and runs the core tests. Its packages are unpacked
# beside the build, nothing is installed.
# usage: jobs/portability.sh [FOLDER]      (default: target/portability)
set -eu
cd "$(dirname "$0")/.."
place=$(realpath -m "${1:-target/portability}")
root=$place/root
mkdir -p "$place/packages" "$root/usr/share"
(
  cd "$place/packages"
  ls libpetsc64-real3.18-dev_*.deb >/dev/null 2>&1 || apt-get download \
    libpetsc64-real3.18-dev libpetsc64-real3.18 libhypre64m-2.26.0 libmumps-64pord-5.5 \
    libopenblas64-0-pthread
)
for package in "$place"/packages/*.deb; do dpkg -x "$package" "$root"; done
# Headers that both widths have in common come with the default package.
ln -sfn /usr/share/petsc "$root/usr/share/petsc"
petsc=$root/usr/lib/petscdir/petsc64-3.18/$(gcc -dumpmachine)-real
sed -i "s#^prefix=.*#prefix=$petsc#" "$petsc"/lib/pkgconfig/*.pc
libraries=$root/usr/lib/$(gcc -dumpmachine)
export PKG_CONFIG_PATH=$petsc/lib/pkgconfig
export LD_LIBRARY_PATH=$libraries:$libraries/openblas64-pthread${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
cargo build --target-dir "$place/target"
# The first lines say which PETSc it is.
mpirun -n 2 "$place/target/debug/mpm-par" inputs/beam.toml --set analysis.steps=5 --out "$place/out" --force
cargo test --target-dir "$place/target" --test petsc --test assembly --test unknowns --test multigrid
