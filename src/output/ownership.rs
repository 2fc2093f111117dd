//! Which files in a results directory a run of this program is proven to have written.
//!
//! A name alone proves nothing: `log.txt` and `history.csv` are anybody's. The tables, the log, the
//! series and the summary prove themselves by how they begin. Frames, checkpoints and unfinished
//! files have names that nobody else gives, and are a run's where one of those proofs lies beside
//! them; a sealed checkpoint proves itself.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use super::names::{
    DECK, ELEMENT, HISTORY, LOG, PROBES, PVD_HEAD, PVDS, REPORT, RESIDUALS, RESOLVED_DECK, RIGID,
    SERIES, SERIES_HEAD, SERIES_LIST_HEAD, SUMMARY, names_in,
};
use super::report;
use super::restart::seal;
use crate::error::Result;

/// First line of [`RESOLVED_DECK`].
pub const RESOLVED_HEAD: &str = "# The deck with every default, written by mpm-par.\n";
/// Beginning of the tables.
const TABLE_HEAD: &str = "step [-],";
/// Beginning of the log: the banner.
const LOG_HEAD: &str = "mpm-par ";

/// How a file of a fixed name proves whose it is.
#[derive(Debug, Clone, Copy)]
enum Proof {
    /// It begins like this. One that was cut short before the end of these words, or is empty,
    /// holds nothing that could be lost.
    Begins(&'static str),
    /// It is the summary of a run: a JSON object with the versions of the program.
    Summary,
    /// A proven file lies beside it.
    Company,
}

/// All names that a run may leave, apart from the numbered ones.
const NAMES: [(&str, Proof); 13] = [
    (SUMMARY, Proof::Summary),
    (HISTORY, Proof::Begins(TABLE_HEAD)),
    (RESIDUALS, Proof::Begins(TABLE_HEAD)),
    (PROBES, Proof::Begins(TABLE_HEAD)),
    (REPORT, Proof::Begins(report::HEAD)),
    (ELEMENT, Proof::Begins(TABLE_HEAD)),
    (LOG, Proof::Begins(LOG_HEAD)),
    (DECK, Proof::Company),
    (RESOLVED_DECK, Proof::Company),
    ("points.xdmf", Proof::Begins(SERIES_HEAD)),
    ("grid.xdmf", Proof::Begins(SERIES_HEAD)),
    ("domains.xdmf", Proof::Begins(SERIES_HEAD)),
    (RIGID, Proof::Begins(SERIES_HEAD)),
];
/// The files of a folder that have names of ours, sorted.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Written by a run of this program.
    pub ours: Vec<String>,
    /// Perhaps somebody's own.
    pub unproven: Vec<String>,
}

/// Looks at every file of `folder`. `deck`: the text of the deck that is about to run; a file
/// [`DECK`] that holds exactly this text is not counted at all, since the run leaves it as it is.
pub fn look(folder: &Path, deck: &str) -> Result<Found> {
    let mut proven = Vec::new();
    let mut others = Vec::new();
    for name in names_in(folder)? {
        let path = folder.join(&name);
        if name == DECK && holds(&path, deck) {
            continue;
        }
        if proves_itself(&path, &name) { proven.push(name) } else { others.push(name) }
    }
    // An empty file is nobody's loss and nobody's proof.
    let company = proven.iter().any(|name| !is_empty(&folder.join(name)));
    let (more, unproven): (Vec<String>, Vec<String>) =
        others.into_iter().partition(|name| company && matches!(proof_of(name), Proof::Company));
    proven.extend(more);
    proven.sort();
    Ok(Found { ours: proven, unproven })
}

/// Those of `reads` (files that the run reads) which lie in `folder` under one of `names`.
pub fn read_by_the_run(folder: &Path, names: &[String], reads: &[PathBuf]) -> Vec<String> {
    let whole: Vec<PathBuf> = reads.iter().filter_map(|path| fs::canonicalize(path).ok()).collect();
    let is_read = |name: &&String| {
        fs::canonicalize(folder.join(name)).is_ok_and(|path| whole.contains(&path))
    };
    names.iter().filter(is_read).cloned().collect()
}

/// Names in one line, those that differ by a number taken together.
pub fn list(names: &[String]) -> String {
    let mut parts: Vec<(String, String, String, usize)> = Vec::new();
    for name in names {
        let digits = |c: char| c.is_ascii_digit();
        let kind = name.replace(digits, "");
        match parts.last_mut() {
            Some(last) if last.0 == kind => (last.2, last.3) = (name.clone(), last.3 + 1),
            _ => parts.push((kind, name.clone(), name.clone(), 1)),
        }
    }
    let words = parts.into_iter().map(|(_, first, last, count)| match count {
        1 => first,
        2 => format!("{first}, {last}"),
        _ => format!("{first} to {last} ({count} files)"),
    });
    words.collect::<Vec<_>>().join(", ")
}

/// Of a file whose name ends in `.partial` and its like no content can be expected.
fn proof_of(name: &str) -> Proof {
    if PVDS.contains(&name) {
        return Proof::Begins(PVD_HEAD);
    }
    if SERIES.contains(&name) {
        return Proof::Begins(SERIES_LIST_HEAD);
    }
    let fixed = NAMES.iter().find(|(fixed, _)| *fixed == name);
    fixed.map_or(Proof::Company, |(_, proof)| *proof)
}

fn proves_itself(path: &Path, name: &str) -> bool {
    // To open a pipe or a device may take for ever.
    if !fs::metadata(path).is_ok_and(|found| found.is_file()) {
        return false;
    }
    match proof_of(name) {
        Proof::Begins(head) => begins(path, head),
        Proof::Summary => is_empty(path) || is_summary(path),
        Proof::Company if name == RESOLVED_DECK => begins(path, RESOLVED_HEAD),
        Proof::Company => name.starts_with("checkpoint-") && seal::is_sealed(path),
    }
}

fn is_empty(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| found.len() == 0)
}

/// True if the file begins with `head`, or is a beginning of it.
fn begins(path: &Path, head: &str) -> bool {
    let mut start = Vec::new();
    let read = File::open(path)
        .and_then(|file| file.take(head.len() as u64).read_to_end(&mut start))
        .is_ok();
    read && head.as_bytes().starts_with(&start)
}

fn is_summary(path: &Path) -> bool {
    /// No summary is larger.
    const MOST: u64 = 100 << 20;
    let mut text = String::new();
    let read = File::open(path).and_then(|file| file.take(MOST).read_to_string(&mut text));
    read.is_ok()
        && serde_json::from_str::<serde_json::Value>(&text)
            .is_ok_and(|value| value["versions"][env!("CARGO_PKG_NAME")].is_string())
}

/// True if `path` is a file with exactly this text.
pub fn holds(path: &Path, text: &str) -> bool {
    let same_length =
        fs::metadata(path).is_ok_and(|found| found.is_file() && found.len() == text.len() as u64);
    same_length && fs::read(path).is_ok_and(|bytes| bytes == text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_alone_proves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        let names = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<Vec<_>>();
        for (name, text) in [
            ("log.txt", "dear diary"),
            ("history.csv", "year,event\n"),
            ("summary.json", "{\"versions\": {}}"),
            ("points-000001.h5", "measured on Monday"),
            ("checkpoint-000001.h5", "of another program"),
            ("resolved.toml", "solved = true"),
            ("input.toml", "mine = 1"),
        ] {
            put(name, text);
        }
        let found = look(folder.path(), "title = \"another deck\"").unwrap();
        assert_eq!(found.ours, names(&[]));
        assert_eq!(found.unproven.len(), 7);
        // The deck that is about to run is neither.
        assert_eq!(look(folder.path(), "mine = 1").unwrap().unproven.len(), 6);
        // Beside a proven file the names that only runs give are a run's; the others speak for
        // themselves.
        put("residuals.csv", "step [-],iteration [-],residual [-]\n");
        let found = look(folder.path(), "mine = 1").unwrap();
        let ours = ["checkpoint-000001.h5", "points-000001.h5", "residuals.csv", "resolved.toml"];
        assert_eq!(found.ours, names(&ours));
        assert_eq!(found.unproven, names(&["history.csv", "log.txt", "summary.json"]));
    }

    #[test]
    fn an_empty_file_is_no_proof_and_no_loss() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["log.txt", "points-000001.h5"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        let found = look(folder.path(), "").unwrap();
        assert_eq!(found.ours, ["log.txt"]);
        assert_eq!(found.unproven, ["points-000001.h5"]);
    }

    #[test]
    fn numbered_names_are_told_together() {
        let names: Vec<String> = (0..4)
            .map(|n| format!("grid-{n:06}.h5"))
            .chain(["log.txt".to_string(), "points-000000.h5".to_string()])
            .collect();
        let expected = "grid-000000.h5 to grid-000003.h5 (4 files), log.txt, points-000000.h5";
        assert_eq!(list(&names), expected);
    }
}
