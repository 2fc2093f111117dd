#!/bin/bash
# Builds the program with other libraries than Debian's default ones and runs the core tests:
#   int64   Debian's PETSc with 64-bit indices; its packages are unpacked beside the build
#   newer   PETSc's newest release, from the source package that PyPI carries, with Debian's MUMPS
#   mpich   the same release without MUMPS, on MPICH and a serial HDF5; their packages are unpacked, too
# usage: jobs/portability.sh [int64 | newer | mpich]...      (default: int64 newer)
#   PLACE=target/portability       where packages, libraries and builds go; nothing is installed
#   PETSC_RELEASE=3.26.1           which release `newer` and `mpich` take
#   TESTS="petsc assembly ..."     files of tests/
set -eu
cd "$(dirname "$0")/.."
place=$(realpath -m "${PLACE:-target/portability}")
release=${PETSC_RELEASE:-3.26.1}
tests=${TESTS:-petsc assembly unknowns multigrid quasi_static}
machine=$(gcc -dumpmachine)
mkdir -p "$place/packages"

# trial MPI: builds with the PETSc of PKG_CONFIG_PATH, bends a beam, runs the tests.
trial() {
  local target=$place/target-$1 test arguments=()
  for test in $tests; do arguments+=(--test "$test"); done
  cargo build --target-dir "$target"
  # The first lines say which PETSc it is.
  sh jobs/mpirun.sh 2 "$target/debug/mpm-par" inputs/beam.toml \
    --out "$place/out" --force
  cargo test --no-fail-fast --target-dir "$target" "${arguments[@]}"
}

int64() {
  local root=$place/root petsc libraries package
  mkdir -p "$root/usr/share"
  (
    cd "$place/packages"
    ls libpetsc64-real3.18-dev_*.deb >/dev/null 2>&1 || apt-get download \
      libpetsc64-real3.18-dev libpetsc64-real3.18 libhypre64m-2.26.0 libmumps-64pord-5.5 \
      libopenblas64-0-pthread
  )
  for package in "$place"/packages/*.deb; do dpkg -x "$package" "$root"; done
  # Headers that both widths have in common come with the default package.
  ln -sfn /usr/share/petsc "$root/usr/share/petsc"
  petsc=$root/usr/lib/petscdir/petsc64-3.18/$machine-real
  sed -i "s#^prefix=.*#prefix=$petsc#" "$petsc"/lib/pkgconfig/*.pc
  libraries=$root/usr/lib/$machine
  export PKG_CONFIG_PATH=$petsc/lib/pkgconfig
  export LD_LIBRARY_PATH=$libraries:$libraries/openblas64-pthread${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
  trial openmpi
}

# library NAME OPTIONS...: PETSC_RELEASE by the options, in $place/NAME.
library() {
  local name=$1 sources=$place/petsc-$release
  shift
  [ -d "$sources" ] || (
    cd "$place/packages"
    python3 -m pip download "petsc==$release" --no-binary petsc --no-deps
    tar xf "petsc-$release.tar.gz" -C "$place"
  )
  [ -f "$place/$name/lib/pkgconfig/PETSc.pc" ] || (
    cd "$sources"
    export PETSC_DIR=$sources PETSC_ARCH=$name
    python3 ./configure --prefix="$place/$name" --with-shared-libraries=1 --with-debugging=0 \
      --with-c2html=0 --with-x=0 --with-cxx=0 COPTFLAGS=-O2 "$@"
    make all
    make install
  ) >"$place/$name.log" 2>&1 || { tail -n 30 "$place/$name.log" >&2; exit 1; }
  export PKG_CONFIG_PATH=$place/$name/lib/pkgconfig
  export LD_LIBRARY_PATH=$place/$name/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
}

newer() {
  library newer --with-cc=mpicc --with-fc=mpif90 --with-fortran-bindings=0 \
    --with-scalapack-lib=-lscalapack-openmpi --with-mumps-include=/usr/include \
    --with-mumps-lib="-ldmumps -lzmumps -lsmumps -lcmumps -lmumps_common -lpord"
  trial openmpi
}

# unpacked FOLDER PACKAGE...: Debian's packages, in a folder of their own instead of the system.
unpacked() {
  local root=$place/$1 package
  shift
  for package in "$@"; do
    ls "$place/packages/${package}"_*.deb >/dev/null 2>&1 ||
      (cd "$place/packages" && apt-get download "$package")
    dpkg -x "$place/packages/${package}"_*.deb "$root"
  done
}

mpich() {
  local root=$place/mpich-root
  unpacked mpich-root mpich libmpich-dev libmpich12 libslurm38 libhdf5-dev libhdf5-103-1
  # The compiler's wrapper and the starter, for the place they are in. What starts runs in scripts and
  # tests is Open MPI's mpirun with its words.
  mkdir -p "$place/bin"
  sed "s#=/usr\\b#=$root/usr#; s#^sysconfdir=.*#sysconfdir=$root/etc/mpich#" \
    "$root/usr/bin/mpicc.mpich" >"$place/bin/mpicc.mpich"
  cat >"$place/bin/mpirun" <<SCRIPT
#!/bin/bash
words=()
while [ \$# -gt 0 ]; do
  case \$1 in
    -n) words+=(-n "\$2"); shift 2 ;;
    --timeout) export MPIEXEC_TIMEOUT=\$2; shift 2 ;;
    *) break ;;
  esac
done
exec $root/usr/bin/mpiexec.hydra "\${words[@]}" "\$@"
SCRIPT
  chmod +x "$place"/bin/mpi*
  # Its own library of MPI first, then what the packages ask of the system.
  export LD_LIBRARY_PATH=$root/usr/lib/$machine${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
  export PATH=$place/bin:$PATH MPICC=$place/bin/mpicc.mpich HDF5_DIR=$root/usr/lib/$machine/hdf5/serial
  library mpich --with-cc="$MPICC" --with-fc=0 --with-sowing=0
  trial mpich
}

[ $# -gt 0 ] || set -- int64 newer
for one in "$@"; do
  case $one in
    int64|newer|mpich) ;;
    *) echo "portability: int64, newer or mpich, not $one" >&2; exit 2 ;;
  esac
  echo "portability: $one"
  # Each in a shell of its own: what one exports, the next must not find.
  ( set -e; "$one" )
done
