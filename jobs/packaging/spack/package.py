from spack_repo.builtin.build_systems.cargo import CargoPackage

from spack.package import *


class MpmPar(CargoPackage):
    """Distributed implicit and explicit material point method on PETSc."""

    # The sources are a clone: in its folder, `spack dev-build mpm-par@main`.
    license("MIT OR Apache-2.0")

    version("main", branch="main")

    depends_on("c", type="build")
    depends_on("rust@1.89:", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("llvm+clang", type="build")
    depends_on("mpi")
    depends_on("petsc@3.18:3.26 +mpi+mumps~complex")
    depends_on("hdf5@1.10:")
    depends_on("metis@5:")

    def setup_build_environment(self, env):
        env.set("HDF5_DIR", self.spec["hdf5"].prefix)
        env.set("LIBCLANG_PATH", self.spec["llvm"].prefix.lib)
