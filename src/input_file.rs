//! Files that a user names, opened so that no device, pipe or endless file can hold the run up.

use std::fs::{File, OpenOptions};
use std::io::{Error, Read, Result};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Largest deck, bytes.
pub const DECK: u64 = 64 << 20;
/// Largest file of points and largest mesh, bytes.
pub const DATA: u64 = 16 << 30;

/// Opens a regular file of at most `most` bytes.
///
/// # Errors
/// It cannot be opened, is something else than a regular file, or is larger; the text says which.
pub fn open(path: &Path, most: u64) -> Result<File> {
    // Asked before it is opened: opening alone wakes some devices.
    require_regular(&std::fs::metadata(path)?)?;
    // What has taken its place meanwhile must not stop the run either.
    let file = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(path)?;
    let found = file.metadata()?;
    require_regular(&found)?;
    if found.len() > most {
        return Err(too_large(found.len(), most));
    }
    Ok(file)
}

/// Reads a regular file of at most `most` bytes. Errors as for [`open`].
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    // Files of the system's own have no length, or one that is not true.
    read_all(open(path, most)?, most)
}

/// Reads to the end, which comes within `most` bytes. Error: it does not, or reading fails.
pub fn read_all(source: impl Read, most: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let read = source.take(most + 1).read_to_end(&mut bytes)? as u64;
    if read > most { Err(too_large(read, most)) } else { Ok(bytes) }
}

fn require_regular(found: &std::fs::Metadata) -> Result<()> {
    let kind = found.file_type();
    let what = if kind.is_file() {
        return Ok(());
    } else if kind.is_dir() {
        return Err(std::io::ErrorKind::IsADirectory.into());
    } else if kind.is_fifo() {
        "a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    };
    Err(Error::other(format!("it is {what}, expected a regular file")))
}

fn too_large(found: u64, most: u64) -> Error {
    Error::other(format!("it has {found} bytes or more, expected at most {most}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_of_a_known_length_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, "12345678").unwrap();
        assert_eq!(read(&path, 8).unwrap(), b"12345678");
        let text = |path: &Path, most| read(path, most).unwrap_err().to_string();
        assert_eq!(text(&path, 7), "it has 8 bytes or more, expected at most 7");
        assert_eq!(text(Path::new("/dev/zero"), 7), "it is a device, expected a regular file");
        assert!(text(folder.path(), 7).contains("directory"));
        let pipe = folder.path().join("pipe");
        let name = std::ffi::CString::new(pipe.as_os_str().as_encoded_bytes()).unwrap();
        // SAFETY: a path that ends in a zero byte.
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
        assert_eq!(text(&pipe, 7), "it is a pipe, expected a regular file");
        // A hole has a length and no blocks.
        std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
        assert!(text(&path, DATA).contains("expected at most 17179869184"));
    }
}
