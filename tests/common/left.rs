//! What a run leaves in its directory, read back.

use std::path::Path;

pub fn summary(directory: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(directory.join("summary.json")).expect("summary.json");
    serde_json::from_str(&text).expect("valid JSON")
}

fn table(directory: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut table = csv::Reader::from_path(directory.join("history.csv")).expect("history.csv");
    let header = table.headers().expect("a header").iter().map(str::to_string).collect();
    let row = |row: csv::Result<csv::StringRecord>| {
        row.expect("a whole row").iter().map(str::to_string).collect()
    };
    (header, table.records().map(row).collect())
}

/// A column of `history.csv` by the name before its unit.
pub fn column(directory: &Path, name: &str) -> Vec<f64> {
    let (header, rows) = table(directory);
    let at = header
        .iter()
        .position(|title| title.split(" [").next() == Some(name))
        .unwrap_or_else(|| panic!("no column {name} among {header:?}"));
    rows.iter().map(|row| row[at].parse().expect("a number")).collect()
}

/// `history.csv` without the columns that tell of the machine.
pub fn history(directory: &Path) -> Vec<Vec<String>> {
    let (header, mut rows) = table(directory);
    for row in &mut rows {
        let mut names = header.iter();
        row.retain(|_| names.next().is_some_and(|name| !name.starts_with("wall_seconds")));
    }
    rows
}
