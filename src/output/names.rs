//! The names of all files in a results directory.

use std::fs;
use std::path::Path;

use super::whole_file::{PARTIAL, cannot_read};
use crate::error::Result;

/// Fixed names of a results directory.
pub const SUMMARY: &str = "summary.json";
pub const HISTORY: &str = "history.csv";
/// Rows of an element test.
pub const ELEMENT: &str = "element.csv";
/// The run in one page.
pub const REPORT: &str = "report.html";
/// Rows of `[[probe]]`.
pub const PROBES: &str = "probes.csv";
pub const RESIDUALS: &str = "residuals.csv";
/// Series of the rigid bodies' surfaces.
pub const RIGID: &str = "rigid.xdmf";
pub const LOG: &str = "log.txt";
pub const DECK: &str = "input.toml";
pub const RESOLVED_DECK: &str = "resolved.toml";

/// Ending of a checkpoint or frame that a restart from an earlier one has made void.
pub const SUPERSEDED: &str = ".superseded";
/// Ending of a checkpoint that `--restart last` could not take: not this run's to remove.
pub const PASSED_OVER: &str = ".passed-over";

/// How every series (`*.xdmf`) begins.
pub const SERIES_HEAD: &str = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
     <Xdmf Version=\"3.0\">\n  <Domain>\n    \
     <Grid Name=\"series\" GridType=\"Collection\" CollectionType=\"Temporal\">\n";

/// Lists of frames for ParaView, and how they begin.
pub const PVDS: [&str; 3] = ["points.pvd", "domains.pvd", "grid.pvd"];
pub const PVD_HEAD: &str =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n";
pub const SERIES: [&str; 3] =
    ["points.vtkhdf.series", "domains.vtkhdf.series", "grid.vtkhdf.series"];
pub const SERIES_LIST_HEAD: &str = "{\"file-series-version\":\"1.0\",\"files\":[\n";

/// All names that a run may leave, apart from the numbered ones.
const NAMES: [&str; 13] = [
    SUMMARY,
    HISTORY,
    PROBES,
    REPORT,
    RESIDUALS,
    ELEMENT,
    LOG,
    DECK,
    RESOLVED_DECK,
    "points.xdmf",
    "grid.xdmf",
    "domains.xdmf",
    RIGID,
];
/// `points-000005.h5` and its like.
const NUMBERED: [&str; 5] = ["points-", "domains-", "grid-", "rigid-", "checkpoint-"];
/// Frames, and those that may be VTU files.
const FRAMES: [&str; 4] = ["points-", "domains-", "grid-", "rigid-"];
const VTU_FRAMES: [&str; 3] = ["points-", "domains-", "grid-"];
/// Digits of a frame's and a checkpoint's number, at least.
const DIGITS: usize = 6;

/// Sorted names of files in `folder` that a run may write.
pub fn names_in(folder: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(|reason| cannot_read(folder, &reason))? {
        let entry = entry.map_err(|reason| cannot_read(folder, &reason))?;
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
    let name = without_ending(name);
    let numbered = NUMBERED.iter().any(|begin| number_of(name, begin).is_some());
    let listed = NAMES.contains(&name) || PVDS.contains(&name) || SERIES.contains(&name);
    listed || numbered || frame_of(name).is_some()
}

/// Number of the finished file `begin`NNNNNN.h5; `None` for other names.
pub fn number_of(name: &str, begin: &str) -> Option<usize> {
    let number = name.strip_prefix(begin)?.strip_suffix(".h5")?.parse().ok()?;
    (name == format!("{begin}{number:0DIGITS$}.h5")).then_some(number)
}

/// Step of the frame that a file belongs to; `None` for other names.
pub fn frame_of(name: &str) -> Option<usize> {
    if let Some(stem) = name.strip_suffix(".vtu") {
        let name = format!("{stem}.h5");
        return VTU_FRAMES.iter().find_map(|begin| number_of(&name, begin));
    }
    FRAMES.iter().find_map(|begin| number_of(name, begin))
}

fn without_ending(name: &str) -> &str {
    let endings = [PARTIAL, SUPERSEDED, PASSED_OVER];
    // A series has two unfinished files at times.
    let name = name.strip_suffix(PARTIAL).unwrap_or(name);
    endings.iter().find_map(|ending| name.strip_suffix(ending)).unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_the_names_of_a_run() {
        for name in [
            "summary.json",
            "points-000005.h5",
            "grid-000000.h5.partial",
            "checkpoint-1000012.h5",
            "checkpoint-000012.h5.superseded",
            "points-000012.h5.superseded",
            "checkpoint-000012.h5.passed-over",
            "rigid-000003.h5",
            "rigid.xdmf",
            "points.xdmf.partial",
            "points.xdmf.partial.partial",
            "points-000005.vtu",
            "points-000005.vtu.superseded",
            "points.pvd.partial",
            "grid-000005.vtu",
            "domains-000005.h5",
            "domains.vtkhdf.series",
        ] {
            assert!(is_ours(name), "{name}");
        }
        for name in [
            "points-.h5",
            "points-5.h5",
            "points-a.h5",
            "my-points-000005.h5",
            "notes.txt",
            "grid.h5",
            "grid-5.vtu",
            "rigid-000005.vtu",
            ".mpm-par.lock",
        ] {
            assert!(!is_ours(name), "{name}");
        }
    }
}
