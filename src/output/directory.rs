//! Creates the results directory, and protects what is already in it.

use std::fs;
use std::path::{Path, PathBuf};

use mpi::topology::SimpleCommunicator;

use super::agreement::on_root;
use super::names::names_in;
pub use super::names::{
    DECK, ELEMENT, HISTORY, LOG, PASSED_OVER, PROBES, RESIDUALS, RESOLVED_DECK, SUMMARY, SUPERSEDED,
};
use super::ownership::{self, RESOLVED_HEAD, holds, look};
use super::whole_file::{PARTIAL, cannot_read, cannot_write, write_whole};
use crate::error::{Error, Result};

/// What the run reads: no old result of one of these names is removed.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    /// Text of the deck.
    pub deck: String,
    /// The deck and the files that it names.
    pub files: Vec<PathBuf>,
}

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
    /// `Input` if results exist and `force` is not set; if files have names that this run would
    /// write and nothing shows that a run wrote them; if one of `inputs` would be removed. `File` if
    /// the directory cannot be written.
    pub fn create(
        path: &Path,
        force: bool,
        inputs: &Inputs,
        comm: &SimpleCommunicator,
    ) -> Result<Self> {
        on_root(comm, || prepare(path, force, inputs))?;
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
            let names = names_in(&self.path)?;
            remove(&self.path, names.iter().filter(|n| *n == SUMMARY || n.ends_with(PARTIAL)))
        })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes the deck as it was read, and as it was understood with every default. Each is written
    /// beside its name and renamed, in this order: the deck that runs may be either of the two, and
    /// at every moment one of them holds its text. A deck that is there already is left as it is.
    pub fn write_decks(
        &self,
        input: &str,
        resolved: &str,
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        on_root(comm, || {
            let deck = self.file(DECK);
            if !holds(&deck, input) {
                write_whole(&deck, input.as_bytes())?;
            }
            let resolved = format!("{RESOLVED_HEAD}{resolved}");
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

/// Error: a file stands where the directory, or one above it, would have to be. Creates nothing.
/// Collective.
pub fn require_place(path: &Path, comm: &SimpleCommunicator) -> Result<()> {
    on_root(comm, || {
        let there = path.ancestors().find(|above| above.exists());
        match there.filter(|above| !above.is_dir()) {
            Some(file) => Err(Error::File(format!(
                "cannot create the results directory {}: {} is a file; give --out DIR",
                path.display(),
                file.display()
            ))),
            None => Ok(()),
        }
    })
}

fn prepare(path: &Path, force: bool, inputs: &Inputs) -> Result<()> {
    make_folder(path)?;
    let found = look(path, &inputs.deck)?;
    let folder = path.display();
    if !found.unproven.is_empty() {
        return Err(Error::Input(format!(
            "{folder} holds files under names that a run writes, and nothing shows that a run of \
             this program wrote them: {}\n    try: --out DIR to write elsewhere, or move them away; \
             nothing was changed",
            ownership::list(&found.unproven),
        )));
    }
    // The two decks are replaced, never removed: the one that runs may be among them.
    let old: Vec<String> =
        found.ours.iter().filter(|name| *name != DECK && *name != RESOLVED_DECK).cloned().collect();
    if !found.ours.is_empty() && !force {
        return Err(Error::Input(format!(
            "{folder} already holds results ({} files): give --force to replace them, --out DIR to \
             write elsewhere, or --restart last to continue\n    --force replaces: {}",
            found.ours.len(),
            ownership::list(&found.ours),
        )));
    }
    let needed = ownership::read_by_the_run(path, &old, &inputs.files);
    if !needed.is_empty() {
        return Err(Error::Input(format!(
            "--force would remove from {folder} what this run reads: {}\n    try: --out DIR to write \
             elsewhere, or move it; nothing was changed",
            ownership::list(&needed),
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

/// Permission bits do not show quotas and read-only mounts: write something.
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
    fn existing_results_need_force_and_foreign_files_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a").join("b");
        let inputs = Inputs { deck: "title = \"this\"".into(), files: Vec::new() };
        prepare(&path, false, &inputs).unwrap();
        fs::write(path.join("notes.txt"), "mine").unwrap();
        fs::write(path.join("input.toml"), &inputs.deck).unwrap();
        prepare(&path, false, &inputs).unwrap();
        fs::write(path.join("log.txt"), "mpm-par 0.0.0: ...").unwrap();
        fs::write(path.join("resolved.toml"), "title = \"that\"").unwrap();
        fs::write(path.join("points-000001.h5"), "").unwrap();
        let error = prepare(&path, false, &inputs).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let text = error.to_string();
        let list = "--force replaces: log.txt, points-000001.h5, resolved.toml";
        assert!(text.contains("(3 files)") && text.contains(list), "{text}");
        assert!(path.join("log.txt").exists(), "a refusal must not remove anything");
        prepare(&path, true, &inputs).unwrap();
        assert_eq!(names_in(&path).unwrap(), ["input.toml", "resolved.toml"]);
        assert_eq!(fs::read(path.join("notes.txt")).unwrap(), b"mine");
    }

    #[test]
    fn what_nobody_is_known_to_have_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        fs::write(path.join("log.txt"), "dear diary").unwrap();
        fs::write(path.join("summary.json"), "{\"versions\": {\"mpm-par\": \"0.1.0\"}}").unwrap();
        for force in [false, true] {
            let error = prepare(path, force, &Inputs::default()).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains("wrote them: log.txt\n"), "{error}");
        }
        assert_eq!(fs::read(path.join("log.txt")).unwrap(), b"dear diary");
        assert!(path.join("summary.json").exists());
    }

    #[test]
    fn what_the_run_reads_is_not_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        fs::write(path.join("log.txt"), "mpm-par 0.0.0: ...").unwrap();
        let inputs = Inputs { deck: String::new(), files: vec![path.join("log.txt")] };
        let error = prepare(path, true, &inputs).unwrap_err();
        assert!(error.to_string().contains("what this run reads: log.txt"), "{error}");
        assert!(path.join("log.txt").exists());
    }

    #[test]
    fn a_file_in_the_way_is_a_file_error_with_its_path() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        fs::write(&path, "x").unwrap();
        let error = prepare(&path, true, &Inputs::default()).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains("taken"), "{error}");
    }
}
