//! One run at a time in a results directory: a lock that ends with the process that holds it.
//!
//! Rank 0 holds a lock of the system (`flock`) on a file whose name begins with a dot. However the
//! process ends, the system takes the lock away, so that a killed run never stands in the way of
//! the next one; a run that ends by itself also removes the file.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mpi::topology::SimpleCommunicator;

use crate::error::{Error, Result};
use crate::output::agreement::on_root;
use crate::output::directory::make_folder;
use crate::output::terminal::log::Log;

const NAME: &str = ".mpm-par.lock";
/// Ranks outlive an `mpirun` that was killed alone by two to three seconds (Open MPI 4.1).
const PATIENCE: Duration = Duration::from_secs(5);
const BETWEEN: Duration = Duration::from_millis(50);

/// The right to write in a results directory; given back when dropped.
#[derive(Debug)]
pub struct RunLock {
    folder: PathBuf,
    /// Locked, on rank 0 only.
    file: Option<File>,
    tried: bool,
}

impl RunLock {
    /// Of this directory, not taken yet.
    pub fn of(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf(), file: None, tried: false }
    }

    /// Takes the lock unless it has been taken before. Without `create` a directory that does not
    /// exist is left so, and nothing is locked. Where the file system knows no locks the run goes
    /// on with a warning. Collective.
    ///
    /// # Errors
    /// `File` if another run holds it, or the directory cannot be created.
    pub fn take(&mut self, create: bool, log: &mut Log, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            if create {
                make_folder(&self.folder)?;
            }
            if self.tried || !self.folder.is_dir() {
                return Ok(());
            }
            self.tried = true;
            let host = mpi::environment::processor_name().unwrap_or_default();
            let own = format!("process {} on {host}", std::process::id());
            match locked(&self.folder.join(NAME), &own, PATIENCE) {
                Ok(Attempt::Taken(file)) => self.file = Some(file),
                Ok(Attempt::Held(by)) => return Err(in_use(&self.folder, &by)),
                Err(reason) => log.say(&format!(
                    "warning: {} cannot be locked ({reason}): nothing keeps a second run out of it",
                    self.folder.display()
                )),
            }
            Ok(())
        })
    }
}

impl Drop for RunLock {
    fn drop(&mut self) {
        let path = self.folder.join(NAME);
        if self.file.as_ref().is_some_and(|file| is_at(file, &path)) {
            let _ = fs::remove_file(&path);
        }
    }
}

enum Attempt {
    Taken(File),
    /// By whom, in words; empty if it does not say.
    Held(String),
}

/// Takes the lock and leaves word of its `own` holder. Errors: the file cannot be had, or not be
/// locked by anyone.
fn locked(path: &Path, own: &str, patience: Duration) -> io::Result<Attempt> {
    let begin = Instant::now();
    loop {
        let mut options = OpenOptions::new();
        let mut file = options.read(true).write(true).create(true).truncate(false).open(path)?;
        match file.try_lock() {
            // Whoever held it may have removed the file after it was opened here.
            Ok(()) if !is_at(&file, path) => {}
            Ok(()) => {
                // Only the words of a refusal depend on this: a full disk will be met elsewhere.
                let _ = file.set_len(0);
                let _ = writeln!(file, "{own}");
                return Ok(Attempt::Taken(file));
            }
            Err(TryLockError::WouldBlock) if begin.elapsed() < patience => {
                std::thread::sleep(BETWEEN);
            }
            Err(TryLockError::WouldBlock) => {
                let mut by = String::new();
                let _ = file.take(1000).read_to_string(&mut by);
                return Ok(Attempt::Held(by.trim().to_string()));
            }
            Err(TryLockError::Error(reason)) if reason.kind() == io::ErrorKind::Interrupted => {}
            Err(TryLockError::Error(reason)) => {
                let _ = fs::remove_file(path);
                return Err(reason);
            }
        }
    }
}

/// True if the open file is the one that has this name.
fn is_at(file: &File, path: &Path) -> bool {
    let number = |found: io::Result<fs::Metadata>| found.ok().map(|m| (m.dev(), m.ino()));
    number(file.metadata()).is_some_and(|own| number(fs::metadata(path)) == Some(own))
}

fn in_use(folder: &Path, by: &str) -> Error {
    let by = if by.is_empty() { "another process" } else { by };
    Error::File(format!(
        "{} is in use: {by} is running there\n    try: wait for its end, or --out DIR to write \
         elsewhere; nothing was changed",
        folder.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(path: &Path) -> File {
        match locked(path, "process 7 on here", Duration::ZERO).unwrap() {
            Attempt::Taken(file) => file,
            Attempt::Held(by) => panic!("held by {by}"),
        }
    }

    #[test]
    fn one_holds_it_and_the_others_learn_who() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        fs::write(&path, "process 1 on a machine that was switched off").unwrap();
        let first = taken(&path);
        let Attempt::Held(by) = locked(&path, "another", Duration::ZERO).unwrap() else {
            panic!("twice")
        };
        assert_eq!(by, "process 7 on here");
        assert_eq!(in_use(folder.path(), &by).exit_code(), 3);
        drop(first);
        drop(taken(&path));
    }

    #[test]
    fn a_file_that_was_removed_is_not_the_lock() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        let first = taken(&path);
        let lock = RunLock { folder: folder.path().into(), file: Some(first), tried: true };
        fs::remove_file(&path).unwrap();
        let second = taken(&path);
        drop(lock);
        assert!(is_at(&second, &path), "the first removed what was not its own");
        drop(RunLock { folder: folder.path().into(), file: Some(second), tried: true });
        assert!(!path.exists());
    }
}
