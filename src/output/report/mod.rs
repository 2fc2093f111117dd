//! `report.html`: a run in one file, for any browser, without a network.
//!
//! | file | idea |
//! |---|---|
//! | `gather.rs` | the data, from the files of the results directory |
//! | `mod.rs` | the page around them |
//! | `assets/` | the page's own parts; uPlot (MIT) draws the curves, OGL (Unlicense) the points by WebGL |
//!
//! `jobs/report_assets.sh` makes the two libraries from npm.
//!
//! Everything comes from what the run has written: nothing is gathered from other ranks, and a report
//! of a run that goes on, or was killed, is made by the command `mpm-par report`.

mod gather;

use std::path::Path;

use super::names::{REPORT, names_in};
use super::whole_file::{cannot_read, write_whole};
use crate::error::{Error, Result};

/// How a report begins.
pub const HEAD: &str = "<!doctype html>\n<!-- Report of a run of mpm-par. -->\n";

const BODY: &str = include_str!("assets/body.html");
const STYLE: &str = include_str!("assets/style.css");
const POINTS: &str = include_str!("assets/points.js");
const PAGE: &str = include_str!("assets/page.js");
const OGL: &str = include_str!("assets/ogl.iife.min.js");
const OGL_LICENCE: &str = include_str!("assets/ogl.LICENSE");
const PLOT: &str = include_str!("assets/uPlot.iife.min.js");
const PLOT_STYLE: &str = include_str!("assets/uPlot.min.css");
const PLOT_LICENCE: &str = include_str!("assets/uPlot.LICENSE");

/// Writes `report.html` into a results directory; the number of its bytes.
///
/// # Errors
/// `File` if the directory holds no run, a file cannot be read, or the report not be written.
pub fn write(directory: &Path) -> Result<usize> {
    write_to(directory, &directory.join(REPORT))
}

/// The same with the report somewhere else.
pub fn write_to(directory: &Path, path: &Path) -> Result<usize> {
    if !directory.is_dir() {
        let reason = std::io::Error::from(std::io::ErrorKind::NotFound);
        return Err(cannot_read(directory, &reason));
    }
    if names_in(directory)?.is_empty() {
        return Err(Error::File(format!(
            "{} holds no results: expected the directory that a run has written",
            directory.display()
        )));
    }
    let page = page(&gather::gather(directory)?);
    write_whole(path, page.as_bytes())?;
    Ok(page.len())
}

fn page(data: &serde_json::Value) -> String {
    // No tag can end inside the data.
    let json = data.to_string().replace('<', "\\u003c");
    let title = data["title"].as_str().unwrap_or_default();
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    format!(
        "{HEAD}<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{PLOT_STYLE}\n{STYLE}</style>\n</head>\n<body>\n{BODY}\
         <script type=\"application/json\" id=\"data\">{json}</script>\n\
         <!-- uPlot draws the curves.\n{PLOT_LICENCE}-->\n<script>{PLOT}</script>\n\
         <!-- OGL draws the points.\n{OGL_LICENCE}-->\n<script>{OGL}</script>\n\
         <script>\n{POINTS}</script>\n<script>\n{PAGE}</script>\n</body>\n</html>\n"
    )
}
