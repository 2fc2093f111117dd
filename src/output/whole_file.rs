//! Files that are whole or absent: written under another name, then renamed.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use mpi::topology::{Communicator, SimpleCommunicator};

use crate::error::{Error, Result};

/// Ending of a file that is still being written.
pub const PARTIAL: &str = ".partial";

/// The name a file has until it is whole.
pub fn partial_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(PARTIAL);
    PathBuf::from(name)
}

/// Replaces `path` by `content`; a reader sees the old file or the new one, never a mixture.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<()> {
    let partial = partial_path(path);
    let write = || -> std::io::Result<()> {
        let mut file = File::create(&partial)?;
        file.write_all(content)?;
        file.sync_all()?;
        fs::rename(&partial, path)
    };
    write().map_err(|reason| {
        // A file that could not be finished would only confuse the next reader.
        let _ = fs::remove_file(&partial);
        cannot_write(path, &reason)
    })
}

/// Brings the names in a folder to the disk; not every file system can do this.
pub fn sync_names(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// A file of all ranks that does not have its name yet. Rank 0 answers for it: it gives the name,
/// or removes the file when this is dropped before.
#[derive(Debug, Default)]
pub struct Partial {
    name: PathBuf,
    path: PathBuf,
    answers: bool,
}

impl Partial {
    /// Of the file that is to have this name.
    pub fn of(name: &Path, comm: &SimpleCommunicator) -> Self {
        Self { name: name.to_path_buf(), path: partial_path(name), answers: comm.rank() == 0 }
    }

    /// The name it is to have.
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// For rank 0: the file is whole.
    pub fn give_name(mut self) -> Result<()> {
        fs::rename(&self.path, &self.name).map_err(|reason| cannot_write(&self.name, &reason))?;
        self.answers = false;
        Ok(())
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if self.answers {
            // Who has it open still holds its space, which the summary of the failure needs.
            let _ = OpenOptions::new().write(true).truncate(true).open(&self.path);
            let _ = fs::remove_file(&self.path);
        }
    }
}

pub fn cannot_write(path: &Path, reason: &std::io::Error) -> Error {
    Error::File(format!("cannot write {}: {reason}", path.display()))
}

pub fn cannot_read(path: &Path, reason: &std::io::Error) -> Error {
    Error::File(format!("cannot read {}: {reason}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_the_old_content_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("summary.json");
        write_whole(&path, b"old and longer").unwrap();
        write_whole(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named_with_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent").join("summary.json");
        let error = write_whole(&path, b"x").unwrap_err();
        assert_eq!(error.exit_code(), 3);
        let text = error.to_string();
        assert!(text.contains("absent/summary.json"), "{text}");
        assert!(text.contains("No such file"), "{text}");
    }
}
