//! `mpirun -n N mpm-par INPUT.toml [options] [PETSc options]`

use std::process::exit;

fn main() {
    match mpm_par::cli::parse(std::env::args_os()) {
        Ok(arguments) => exit(mpm_par::analysis::driver::run(&arguments)),
        Err(error) => {
            eprintln!("{error}");
            exit(error.exit_code())
        }
    }
}
