//! `mpirun -n N mpm-par INPUT.toml [options] [PETSc options]`

fn main() {
    std::process::exit(mpm_par::run::session::run(std::env::args_os()));
}
