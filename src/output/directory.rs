//! Creates the results directory, and protects what is already in it.

use std::fs;
use std::path::{Path, PathBuf};

use mpi::topology::SimpleCommunicator;

use super::agreement::on_root;
use super::whole_file::{PARTIAL, cannot_read, cannot_write, write_whole};
use crate::error::{Error, Result};

/// Fixed names of a results directory.
pub const SUMMARY: &str = "summary.json";
pub const HISTORY: &str = "history.csv";
pub const RESIDUALS: &str = "residuals.csv";
pub const LOG: &str = "log.txt";
pub const DECK: &str = "input.toml";
pub const RESOLVED_DECK: &str = "resolved.toml";

/// Ending of a checkpoint that a restart from an earlier one has made void.
pub const SUPERSEDED: &str = ".superseded";
/// Ending of a checkpoint that `--restart last` could not take: not this run's to remove.
pub const PASSED_OVER: &str = ".passed-over";

/// All names that a run may leave, apart from the numbered ones.
const NAMES: [&str; 9] = [
    SUMMARY,
    HISTORY,
    RESIDUALS,
    LOG,
    DECK,
    RESOLVED_DECK,
    "points.xdmf",
    "grid.xdmf",
    "domains.xdmf",
];
/// `points-000005.h5` and its like.
const NUMBERED: [&str; 3] = ["points-", "grid-", "checkpoint-"];

/// An existing, writable results directory.
#[derive(Debug, Clone)]
pub struct ResultsDirectory {
    path: PathBuf,
}

impl ResultsDirectory {
    /// Creates the directory, or empties it of an earlier run's files when `force` is set; other
    /// files in it are left alone.
    ///
    /// # Errors
    /// `Input` if results exist and `force` is not set, `File` if it cannot be written.
    pub fn create(path: &Path, force: bool, comm: &SimpleCommunicator) -> Result<Self> {
        on_root(comm, || prepare(path, force))?;
        Ok(Self { path: path.to_path_buf() })
    }

    /// The directory of a run that is continued: it must exist and be writable; nothing is
    /// removed.
    pub fn reopen(path: &Path, comm: &SimpleCommunicator) -> Result<Self> {
        on_root(comm, || {
            fs::read_dir(path).map_err(|reason| cannot_read(path, &reason))?;
            probe(path)
        })?;
        Ok(Self { path: path.to_path_buf() })
    }

    /// Removes what would be wrong as soon as a continued run changes its tables: the summary of
    /// the earlier part, and files that it had not finished. A directory without a summary is that
    /// of a run that goes on, or was killed.
    pub fn leave_earlier_part(&self, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            let names = results_in(&self.path)?;
            remove(&self.path, names.iter().filter(|n| *n == SUMMARY || n.ends_with(PARTIAL)))
        })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes the deck as it was read, and as it was understood with every default.
    pub fn write_decks(
        &self,
        input: &str,
        resolved: &str,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        on_root(comm, || {
            write_whole(&self.file(DECK), input.as_bytes())?;
            write_whole(&self.file(RESOLVED_DECK), resolved.as_bytes())
        })
    }
}

/// Creates a directory with all those above it.
pub fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).map_err(|reason| {
        Error::File(format!("cannot create the results directory {}: {reason}", path.display()))
    })
}

fn prepare(path: &Path, force: bool) -> Result<()> {
    make_folder(path)?;
    let old = results_in(path)?;
    if !old.is_empty() && !force {
        return Err(Error::Input(format!(
            "{} already holds results ({} files, e.g. {}): give --force to replace them, \
             --out DIR to write elsewhere, or --restart last to continue",
            path.display(),
            old.len(),
            old[0],
        )));
    }
    probe(path)?;
    remove(path, old.iter())
}

fn remove<'a>(folder: &Path, names: impl Iterator<Item = &'a String>) -> Result<()> {
    for name in names {
        let file = folder.join(name);
        fs::remove_file(&file).map_err(|reason| {
            Error::File(format!("cannot remove the old {}: {reason}", file.display()))
        })?;
    }
    Ok(())
}

/// Sorted names of the files in `path` that a run of this program wrote.
fn results_in(path: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(path).map_err(|reason| cannot_read(path, &reason))? {
        let entry = entry.map_err(|reason| cannot_read(path, &reason))?;
        let is_file = entry.file_type().is_ok_and(|kind| !kind.is_dir());
        if let (true, Ok(name)) = (is_file, entry.file_name().into_string())
            && is_ours(&name)
        {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

fn is_ours(name: &str) -> bool {
    let endings = [PARTIAL, SUPERSEDED, PASSED_OVER];
    let name = endings.iter().find_map(|ending| name.strip_suffix(ending)).unwrap_or(name);
    NAMES.contains(&name)
        || NUMBERED.iter().any(|prefix| {
            name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(".h5")).is_some_and(
                |number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()),
            )
        })
}

/// Permission bits do not tell the whole truth (quota, read-only mounts): write something.
fn probe(path: &Path) -> Result<()> {
    let file = path.join(".writable.partial");
    fs::write(&file, b"x").map_err(|reason| {
        let _ = fs::remove_file(&file);
        Error::File(format!("cannot write in the results directory {}: {reason}", path.display()))
    })?;
    fs::remove_file(&file).map_err(|reason| cannot_write(&file, &reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_its_own_files() {
        for name in [
            "summary.json",
            "points-000005.h5",
            "grid-000000.h5.partial",
            "checkpoint-12.h5",
            "checkpoint-000012.h5.superseded",
            "checkpoint-000012.h5.passed-over",
            "points.xdmf.partial",
        ] {
            assert!(is_ours(name), "{name}");
        }
        for name in [
            "points-.h5",
            "points-a.h5",
            "my-points-000005.h5",
            "notes.txt",
            "grid.h5",
            ".mpm-par.lock",
        ] {
            assert!(!is_ours(name), "{name}");
        }
    }

    #[test]
    fn existing_results_need_force_and_foreign_files_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a").join("b");
        prepare(&path, false).unwrap();
        fs::write(path.join("notes.txt"), "mine").unwrap();
        prepare(&path, false).unwrap();
        fs::write(path.join("summary.json"), "{}").unwrap();
        fs::write(path.join("points-000001.h5"), "").unwrap();
        let error = prepare(&path, false).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("--force"), "{error}");
        assert!(path.join("summary.json").exists(), "a refusal must not remove anything");
        prepare(&path, true).unwrap();
        assert_eq!(results_in(&path).unwrap(), Vec::<String>::new());
        assert_eq!(fs::read(path.join("notes.txt")).unwrap(), b"mine");
    }

    #[test]
    fn a_file_in_the_way_is_a_file_error_with_its_path() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        fs::write(&path, "x").unwrap();
        let error = prepare(&path, true).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains("taken"), "{error}");
    }
}
