//! `mpirun -n N mpm-par INPUT.toml [options] [PETSc options]`

use std::process::exit;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match mpm_par::cli::parse(&words) {
        Ok(arguments) => exit(mpm_par::analysis::driver::run(&arguments)),
        Err(error) => {
            eprintln!("{error}");
            exit(error.exit_code())
        }
    }
}
