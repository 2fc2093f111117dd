//! Files that options name are opened by this program first. PETSc opens them on one rank only, and
//! where that fails the other ranks wait for ever.

use std::ffi::CString;
use std::fs::{self, OpenOptions};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use mpi::topology::SimpleCommunicator;
use mpi::traits::Communicator;

use super::check::agree;
use super::options;
use crate::error::{Error, Result};

/// Options that name a file with further options.
const WITH_OPTIONS: [&str; 2] = ["-options_file", "-options_file_yaml"];
/// Options with a viewer that PETSc has looked at by the time of [`require_writable`].
const SEEN: [&str; 2] = ["-log_view", "-options_view"];
/// Words of the names of options that take a viewer.
const OF_VIEWERS: [&str; 3] = ["view", "monitor", "reason"];
/// Kinds of viewers, as PETSc calls them.
const VIEWERS: [&str; 10] =
    ["ascii", "binary", "draw", "socket", "matlab", "saws", "vtk", "hdf5", "glvis", "exodusii"];
/// Options whose value can be nothing but a viewer.
const PLAIN: [&str; 6] = [
    "ksp_view",
    "ksp_monitor",
    "ksp_converged_reason",
    "snes_view",
    "snes_monitor",
    "snes_converged_reason",
];

/// Options that open a file at the start or the end of PETSc, and end the program where they cannot.
const OPENED: [&str; 8] = [
    "-history",
    "-info",
    "-log",
    "-log_all",
    "-log_trace",
    "-malloc_view",
    "-malloc_log",
    "-memory_view",
];

/// The files with options among the words of an argument list can be read, and those that PETSc opens
/// by itself can be written. For the rank that reads.
pub(crate) fn require_readable(words: &[String]) -> Result<()> {
    for pair in words.windows(2) {
        let [option, file] = pair else { continue };
        if OPENED.contains(&option.as_str()) && !file.starts_with('-') && !expanded_by_petsc(file) {
            // `-info` has kinds of messages behind the file.
            let file = file.split(':').next().unwrap_or_default();
            let outcome = if file.is_empty() { Ok(()) } else { writable(Path::new(file)) };
            outcome.map_err(|why| {
                Error::Input(format!("{option} {file}: cannot be written: {why}"))
            })?;
        }
        if !WITH_OPTIONS.contains(&option.as_str()) || expanded_by_petsc(file) {
            continue;
        }
        if let Err(why) = fs::read(file) {
            return Err(Error::Input(format!("{option} {file}: cannot be read: {why}")));
        }
    }
    Ok(())
}

/// The files that viewers write, and their folders, can be written, judged by rank 0, which opens
/// them; none is made. Collective, after the session's start. Error, the same on all ranks: one
/// cannot be written; PETSc's end does not try it again.
pub fn require_writable(comm: &SimpleCommunicator) -> Result<()> {
    let writable = agree(comm, if comm.rank() == 0 { check_viewers() } else { Ok(()) });
    if writable.is_err() {
        for name in SEEN {
            options::clear(name)?;
        }
    }
    writable
}

fn check_viewers() -> Result<()> {
    let mut chosen = Vec::new();
    for name in SEEN {
        if options::is_users(name)? {
            chosen.extend(options::get(name)?.map(|viewer| (name.to_owned(), viewer)));
        }
    }
    for option in options::unused()? {
        if let Some((name, viewer)) = option.split_once(' ') {
            chosen.push((name.to_owned(), viewer.to_owned()));
        }
    }
    for (name, viewer) in chosen {
        if let Err(why) = check_viewer(&name, &viewer) {
            return Err(Error::Input(format!("{name} {viewer}: {why}")));
        }
    }
    Ok(())
}

/// `viewer`: `kind:file:format:mode`, each part possibly empty or absent.
fn check_viewer(name: &str, viewer: &str) -> std::result::Result<(), String> {
    if !OF_VIEWERS.iter().any(|word| name.contains(word)) {
        return Ok(());
    }
    let mut parts = viewer.split(':');
    let kind = parts.next().unwrap_or_default();
    let file = parts.next();
    let plain = PLAIN.iter().any(|word| name.ends_with(&format!("_{word}")));
    if (plain || file.is_some()) && !kind.is_empty() && !VIEWERS.contains(&kind) {
        return Err(format!("there is no viewer \"{kind}\": {}", VIEWERS.join(", ")));
    }
    match file {
        None | Some("" | "stdout" | "stderr") => Ok(()),
        Some(file) if expanded_by_petsc(file) || kind == "socket" => Ok(()),
        Some(file) => writable(Path::new(file)).map_err(|why| format!("cannot be written: {why}")),
    }
}

/// Names that only PETSc can read.
fn expanded_by_petsc(file: &str) -> bool {
    file.starts_with('~') || file.contains('$')
}

fn writable(file: &Path) -> std::io::Result<()> {
    if file.exists() {
        return OpenOptions::new().append(true).open(file).map(drop);
    }
    let folder = match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let path = CString::new(folder.as_os_str().as_bytes())?;
    // SAFETY: a path that ends in a zero byte.
    match unsafe { libc::access(path.as_ptr(), libc::W_OK | libc::X_OK) } {
        0 if folder.is_dir() => Ok(()),
        0 => Err(std::io::ErrorKind::NotADirectory.into()),
        _ => Err(std::io::Error::last_os_error()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viewers_are_taken_apart() {
        for (name, viewer) in [
            ("-log_view", ""),
            ("-log_view", ":out.xml:ascii_xml"),
            ("-qs_ksp_monitor", "ascii::ascii_info"),
            ("-qs_ksp_view_mat", "binary:matrix:::append"),
            ("-qs_ksp_monitor_pause_final", "1"),
            ("-qs_ksp_view", ":stdout"),
            ("-qs_ksp_rtol", "1:/nowhere/at/all"),
        ] {
            assert_eq!(check_viewer(name, viewer), Ok(()), "{name} {viewer}");
        }
        for (name, viewer, part) in [
            ("-log_view", ":/nowhere/at/all", "No such file"),
            ("-qs_mg_levels_ksp_view", "binary:/nowhere/at/all", "No such file"),
            ("-qs_ksp_view_mat", "binari:matrix", "no viewer \"binari\""),
            ("-qs_ksp_monitor", "asci", "no viewer \"asci\""),
            ("-log_view", ":.", "directory"),
        ] {
            let why = check_viewer(name, viewer).expect_err(viewer);
            assert!(why.contains(part), "{name} {viewer}: {why}");
        }
    }

    #[test]
    fn files_of_options_are_read_first() {
        let words = |file: &str| ["-a", "-options_file", file].map(String::from);
        assert!(require_readable(&words("/nowhere/at/all")).is_err());
        assert!(require_readable(&words("Cargo.toml")).is_ok());
        assert!(require_readable(&words("src")).is_err());
    }
}
