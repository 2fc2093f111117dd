//! Start and end of PETSc, and the order in which options win:
//! built-in < `.petscrc` < `[petsc]` table < `PETSC_OPTIONS` < command line.
//!
//! `PetscInitialize` itself reads `.petscrc`, then the environment, then an argument list, each
//! overriding the one before. The table has to come between, so the argument list given to it is
//! table + environment (again) + command line. Options that act at start-up, such as
//! `-log_view`, thereby work from each place. Built-in values are set later, where absent
//! ([`super::options::set_default`]).

use std::ffi::{CString, c_char, c_int};
use std::marker::PhantomData;
use std::ptr::null;

use mpi::environment::Universe;
use mpi::traits::{Communicator, Root};

use super::abort::{end_all, end_all_with, install_panic_hook};
use super::check::{agree, check, essence, petsc, remember};
use super::{files, options, sys};
use crate::error::{Error, Result};

/// PETSc between its start and its end. The borrow of the universe makes it end before MPI.
#[derive(Debug)]
pub struct Session<'u> {
    universe: PhantomData<&'u Universe>,
}

impl<'u> Session<'u> {
    /// Collective over all ranks; once per process. `table` holds names without the dash and
    /// values ("" for a bare flag); `words` the command line's words, dashes included. The
    /// lists of rank 0 count on all ranks.
    ///
    /// Errors: PETSc was started before; a file with options cannot be read. Where PETSc's own
    /// start fails, all ranks end ([`end_all`]).
    pub fn start(
        universe: &'u Universe,
        table: &[(String, String)],
        words: &[String],
    ) -> Result<Self> {
        let started = petsc!(PetscInitialized() -> sys::PETSC_FALSE)?;
        let ended = petsc!(PetscFinalized() -> sys::PETSC_FALSE)?;
        if started != sys::PETSC_FALSE || ended != sys::PETSC_FALSE {
            return Err(Error::Environment("PETSc can be started only once per process".into()));
        }
        let environment = std::env::var("PETSC_OPTIONS").unwrap_or_default();
        let arguments = broadcast(universe, argument_list(table, &environment, words));
        let rank = universe.world().rank();
        let readable = if rank == 0 { files::require_readable(&arguments) } else { Ok(()) };
        agree(&universe.world(), readable)?;
        install_panic_hook();

        // PETSc keeps the argument list for its whole life.
        let strings: &'static [CString] = Box::leak(
            arguments
                .iter()
                .map(|word| super::check::c_text(word))
                .collect::<Result<Vec<_>>>()?
                .into_boxed_slice(),
        );
        let mut pointers: Vec<*mut c_char> =
            strings.iter().map(|s| s.as_ptr().cast_mut()).collect();
        pointers.push(std::ptr::null_mut());
        let count: &'static mut c_int = Box::leak(Box::new(strings.len() as c_int));
        let list: &'static mut *mut *mut c_char =
            Box::leak(Box::new(Box::leak(pointers.into_boxed_slice()).as_mut_ptr()));
        // Before the start: PETSc would fill the screen with what has failed in it.
        petsc!(PetscPushErrorHandler(Some(remember), std::ptr::null_mut()))?;
        // SAFETY: a null-terminated argument list that lives for ever; the help texts may be null.
        let code = unsafe { sys::PetscInitialize(count, list, null(), null()) };
        if let Err(error) = check(code, "PetscInitialize") {
            let text = format!("PETSc could not be started: {}", essence(&error));
            end_all(rank, &Error::Environment(text));
        }
        petsc!(PetscPushErrorHandler(Some(remember), std::ptr::null_mut()))?;
        // Signals stay the program's own: PETSc would turn each into an abort.
        petsc!(PetscPopSignalHandler())?;
        // Multigrid's coarse operators: the default algorithm adds in the order of arrival, this
        // one gives the same bits on every repeat. Sequential matrices do not know the word.
        if universe.world().size() > 1 {
            options::set_default("matptap_via", "allatonce")?;
        }
        Ok(Session { universe: PhantomData })
    }

    /// See [`options::set_default`].
    pub fn set_default_option(&self, name: &str, value: &str) -> Result<()> {
        options::set_default(name, value)
    }

    /// Options the user gave that no object has read (built-in values are not listed), as
    /// `-name value`. Ask at the end of the run.
    pub fn unused_options(&self) -> Result<Vec<String>> {
        options::unused()
    }
}

impl Session<'_> {
    /// Ends PETSc after a run that came to `outcome`, the same on all ranks, and gives it back. What
    /// fails in PETSc's end (a profile that cannot be written) does not change how the run ended:
    /// then all ranks end here, with a warning and the exit code of the run.
    pub fn end(self, outcome: Result<()>) -> Result<()> {
        let (rank, ended) = finalize();
        // PETSc is ended once.
        std::mem::forget(self);
        if let Err(error) = ended {
            let text = format!("warning: PETSc could not be ended in order: {}", essence(&error));
            end_all_with(rank, &text, outcome.as_ref().err());
        }
        outcome
    }
}

impl Drop for Session<'_> {
    fn drop(&mut self) {
        if let (rank, Err(error)) = finalize() {
            let text = format!("PETSc could not be ended in order: {}", essence(&error));
            end_all(rank, &Error::Environment(text));
        }
    }
}

/// This rank, and the outcome of PETSc's end.
fn finalize() -> (i32, Result<()>) {
    let mut rank = 0;
    let cleared = options::clear_unread_defaults();
    // SAFETY: PETSc was started by a session and MPI is alive (borrow of the universe).
    let code = unsafe {
        mpi::ffi::MPI_Comm_rank(mpi::ffi::RSMPI_COMM_WORLD, &mut rank);
        sys::PetscFinalize()
    };
    (rank, check(code, "PetscFinalize").and(cleared))
}

/// The full argument list, program name first.
fn argument_list(table: &[(String, String)], environment: &str, words: &[String]) -> Vec<String> {
    let mut list = vec![env!("CARGO_PKG_NAME").to_owned()];
    for (name, value) in table {
        list.push(format!("-{}", name.trim_start_matches('-')));
        if !value.is_empty() {
            list.push(value.clone());
        }
    }
    list.extend(split_words(environment));
    list.extend_from_slice(words);
    list
}

/// Words of `PETSC_OPTIONS`: separated by blanks; quotes hold words together.
fn split_words(text: &str) -> Vec<String> {
    let (mut words, mut word, mut inside, mut quote) = (Vec::new(), String::new(), false, None);
    for c in text.chars() {
        match quote {
            Some(q) if c == q => quote = None,
            Some(_) => word.push(c),
            None if c == '"' || c == '\'' => (quote, inside) = (Some(c), true),
            None if c.is_whitespace() => {
                if inside {
                    words.push(std::mem::take(&mut word));
                }
                inside = false;
            }
            None => {
                word.push(c);
                inside = true;
            }
        }
    }
    if inside {
        words.push(word);
    }
    words
}

/// Rank 0's list on every rank: environments may differ between machines.
fn broadcast(universe: &Universe, list: Vec<String>) -> Vec<String> {
    let world = universe.world();
    let root = world.process_at_rank(0);
    let mut bytes = list.join("\0").into_bytes();
    let mut length = bytes.len();
    root.broadcast_into(&mut length);
    bytes.resize(length, 0);
    root.broadcast_into(&mut bytes[..]);
    String::from_utf8_lossy(&bytes).split('\0').map(str::to_owned).collect()
}

/// Version of the PETSc library in use, for example "3.18.5".
pub fn version() -> String {
    let (mut major, mut minor, mut patch, mut release) = (0, 0, 0, 0);
    // SAFETY: writes four integers; needs no running PETSc.
    unsafe { sys::PetscGetVersionNumber(&mut major, &mut minor, &mut patch, &mut release) };
    let width = if size_of::<super::Index>() == 8 { " with 64-bit indices" } else { "" };
    format!("{major}.{minor}.{patch}{width}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owned(words: &[&str]) -> Vec<String> {
        words.iter().map(|w| w.to_string()).collect()
    }

    #[test]
    fn later_places_come_later_in_the_list() {
        let table = [("qs_ksp_type".into(), "cg".into()), ("log_view".into(), String::new())];
        let list = argument_list(&table, "-b 2 -c '3 4'", &owned(&["-b", "5"]));
        let expected =
            ["mpm-par", "-qs_ksp_type", "cg", "-log_view", "-b", "2", "-c", "3 4", "-b", "5"];
        assert_eq!(list, owned(&expected));
    }

    #[test]
    fn words_split_at_blanks_outside_quotes() {
        assert_eq!(split_words("  -a  \"x y\" -b\n''"), owned(&["-a", "x y", "-b", ""]));
        assert!(split_words(" ").is_empty());
    }
}
