//! A file of entries between a fixed head and a fixed tail that grows by one entry at a time and is
//! whole at every moment, for what each entry costs.
//!
//! Two files take turns. The one without the name lags an entry behind: it gets the entries that it
//! lacks and the tail, is brought to the disk, and takes the name by a rename; the one that had the
//! name lags now. A reader, and whoever looks after a kill or on a full disk, finds the old file or
//! the new one. Where the file system knows no hard links, the file is written whole each time.

use std::fs::{self, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::output::whole_file::{cannot_write, partial_path};

#[derive(Debug)]
pub struct GrowingFile {
    path: PathBuf,
    head: &'static str,
    tail: &'static str,
    /// Length of the entries, and where the last ones begin, from the end of the head.
    length: usize,
    lagging: Option<Lagging>,
    /// Bytes written so far.
    pub written: u64,
}

/// The file without the name.
#[derive(Debug, Clone, Copy)]
struct Lagging {
    /// Length of the entries in it.
    length: usize,
}

impl GrowingFile {
    /// Nothing is written before [`Self::replace`] or [`Self::push`].
    pub fn new(path: &Path, head: &'static str, tail: &'static str) -> Self {
        let path = path.to_path_buf();
        Self { path, head, tail, length: 0, lagging: None, written: 0 }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds the last of `entries`. The others are those that the file holds already.
    pub fn push<'a>(&mut self, entries: impl Iterator<Item = &'a str> + Clone) -> Result<()> {
        let before = self.length;
        let total: usize = entries.clone().map(str::len).sum();
        let partial = partial_path(&self.path);
        let extended = self
            .lagging
            .take()
            .is_some_and(|lagging| self.extend(&partial, lagging, entries.clone()).is_ok());
        let outcome = if extended { Ok(()) } else { self.write(&partial, entries) };
        let outcome = outcome.and_then(|()| self.give_name(&partial, before));
        self.length = total;
        outcome.map_err(|reason| {
            let _ = fs::remove_file(&partial);
            cannot_write(&self.path, &reason)
        })
    }

    /// Replaces all that the file holds.
    pub fn replace<'a>(&mut self, entries: impl Iterator<Item = &'a str> + Clone) -> Result<()> {
        self.lagging = None;
        self.length = entries.clone().map(str::len).sum();
        let partial = partial_path(&self.path);
        self.write(&partial, entries).and_then(|()| fs::rename(&partial, &self.path)).map_err(
            |reason| {
                let _ = fs::remove_file(&partial);
                cannot_write(&self.path, &reason)
            },
        )
    }

    /// The file holds these entries, as another process left it.
    pub fn assume<'a>(&mut self, entries: impl Iterator<Item = &'a str>) {
        self.lagging = None;
        self.length = entries.map(str::len).sum();
    }

    fn write<'a>(&mut self, to: &Path, entries: impl Iterator<Item = &'a str>) -> io::Result<()> {
        let mut text = String::from(self.head);
        text.extend(entries);
        text.push_str(self.tail);
        let mut file = fs::File::create(to)?;
        file.write_all(text.as_bytes())?;
        self.written += text.len() as u64;
        file.sync_all()
    }

    /// Adds to the lagging file what it lacks.
    fn extend<'a>(
        &mut self,
        at: &Path,
        lagging: Lagging,
        entries: impl Iterator<Item = &'a str>,
    ) -> io::Result<()> {
        let mut file = OpenOptions::new().write(true).open(at)?;
        let end = self.head.len() + lagging.length;
        // Somebody else has been at it.
        if file.metadata()?.len() != (end + self.tail.len()) as u64 {
            return Err(io::ErrorKind::InvalidData.into());
        }
        let mut text = String::new();
        let mut begin = 0;
        for entry in entries {
            if begin >= lagging.length {
                text.push_str(entry);
            }
            begin += entry.len();
        }
        text.push_str(self.tail);
        file.seek(SeekFrom::Start(end as u64))?;
        file.write_all(text.as_bytes())?;
        self.written += text.len() as u64;
        file.sync_all()
    }

    /// Renames the file that is whole; the one that had the name, with `length` of entries, lags from
    /// now on.
    fn give_name(&mut self, whole: &Path, length: usize) -> io::Result<()> {
        let aside = partial_path(whole);
        // A killed run may have left one.
        let _ = fs::remove_file(&aside);
        let kept = fs::hard_link(&self.path, &aside).is_ok();
        fs::rename(whole, &self.path)?;
        if kept && fs::rename(&aside, whole).is_ok() {
            self.lagging = Some(Lagging { length });
        }
        Ok(())
    }
}

impl Drop for GrowingFile {
    fn drop(&mut self) {
        if self.lagging.is_some() {
            let _ = fs::remove_file(partial_path(&self.path));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(count: usize) -> Vec<String> {
        (0..count).map(|k| format!("<entry {k}{}/>\n", ".".repeat(k % 7))).collect()
    }

    #[test]
    fn it_is_whole_after_every_entry_and_costs_what_the_entries_cost() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series");
        let entries = entries(500);
        let mut file = GrowingFile::new(&path, "<head>\n", "</head>\n");
        for count in 1..=entries.len() {
            file.push(entries[..count].iter().map(String::as_str)).unwrap();
            let whole = format!("<head>\n{}</head>\n", entries[..count].concat());
            assert_eq!(fs::read_to_string(&path).unwrap(), whole);
        }
        let size = fs::metadata(&path).unwrap().len();
        assert!(file.written < 4 * size, "{} bytes for a file of {size}", file.written);
        drop(file);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn it_goes_on_from_what_another_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series");
        let entries = entries(6);
        let part = |count: usize| entries[..count].iter().map(String::as_str);
        let mut file = GrowingFile::new(&path, "<", ">");
        (1..=4).for_each(|count| file.push(part(count)).unwrap());
        // Killed between the renames: all three names are there.
        fs::copy(&path, partial_path(&partial_path(&path))).unwrap();
        std::mem::forget(file);
        let mut file = GrowingFile::new(&path, "<", ">");
        file.replace(part(2)).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), format!("<{}>", entries[..2].concat()));
        for count in 3..=6 {
            file.push(part(count)).unwrap();
            // A stranger changes the other file: it is written anew.
            if count == 4 {
                fs::write(partial_path(&path), "?").unwrap();
            }
            let whole = format!("<{}>", entries[..count].concat());
            assert_eq!(fs::read_to_string(&path).unwrap(), whole);
        }
    }
}
