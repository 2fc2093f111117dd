//! `mpirun -n N mpm-par INPUT.toml [options] [PETSc options]`

fn main() {
    std::process::exit(mpm_par::analysis::driver::run(std::env::args_os()));
}
