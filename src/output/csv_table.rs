//! A csv file that grows row by row and is readable at any moment; the first column is the step.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use mpi::topology::SimpleCommunicator;

use super::agreement::on_root;
use super::whole_file::{cannot_read, cannot_write, write_whole};
use crate::error::{Error, Result};

/// Written by rank 0; the other ranks only learn the outcome.
#[derive(Debug)]
pub struct CsvTable {
    path: PathBuf,
    columns: usize,
    rows: usize,
    /// Open on rank 0 only.
    file: Option<File>,
}

impl CsvTable {
    pub fn create(path: &Path, header: &[String], comm: &SimpleCommunicator) -> Result<Self> {
        let mut file = None;
        on_root(comm, || {
            write_whole(path, line(header)?.as_bytes())?;
            file = Some(open_to_append(path)?);
            Ok(())
        })?;
        Ok(Self { path: path.to_path_buf(), columns: header.len(), rows: 0, file })
    }

    /// Continues a table after its first `rows` rows: later ones, and a row cut short, are
    /// dropped. A missing file is begun anew.
    ///
    /// # Errors
    /// `File` if the file has other columns.
    pub fn resume(
        path: &Path,
        header: &[String],
        rows: usize,
        comm: &SimpleCommunicator,
    ) -> Result<Self> {
        let mut file = None;
        on_root(comm, || {
            let header = line(header)?;
            let text = if path.exists() {
                fs::read_to_string(path).map_err(|reason| cannot_read(path, &reason))?
            } else {
                header.clone()
            };
            write_whole(path, rows_until(path, &text, &header, rows)?.as_bytes())?;
            file = Some(open_to_append(path)?);
            Ok(())
        })?;
        Ok(Self { path: path.to_path_buf(), columns: header.len(), rows, file })
    }

    /// Rows of the whole run so far, those of its earlier parts included.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Appends a row in one write, so that a reader never meets half a number.
    pub fn push(&mut self, row: &[f64], comm: &SimpleCommunicator) -> Result<()> {
        self.push_all(&[row], comm)
    }

    /// Appends several rows.
    pub fn push_all(&mut self, rows: &[&[f64]], comm: &SimpleCommunicator) -> Result<()> {
        let mut text = String::new();
        for row in rows {
            assert_eq!(row.len(), self.columns, "{}: one value per column", self.path.display());
            let words: Vec<_> = row.iter().map(|&value| number(value)).collect();
            text.push_str(&words.join(","));
            text.push('\n');
        }
        self.rows += rows.len();
        on_root(comm, || match &mut self.file {
            Some(file) => {
                append(file, text.as_bytes()).map_err(|reason| cannot_write(&self.path, &reason))
            }
            None => Ok(()),
        })
    }
}

/// Appends everything or nothing: a full disk takes the beginning of a row.
fn append(file: &mut File, bytes: &[u8]) -> std::io::Result<()> {
    let length = file.metadata()?.len();
    file.write_all(bytes).inspect_err(|_| {
        let _ = file.set_len(length);
    })
}

/// Shortest text that reads back as the same number; whole numbers without a point.
fn number(value: f64) -> String {
    if value == value.trunc() && value.abs() < 1e15 {
        format!("{value:.0}")
    } else if !value.is_finite() {
        // The spelling that numpy, pandas and spreadsheets agree on.
        if value.is_nan() {
            "nan".into()
        } else if value > 0.0 {
            "inf".into()
        } else {
            "-inf".into()
        }
    } else {
        format!("{value:e}")
    }
}

fn line(words: &[String]) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let text = writer
        .write_record(words)
        .map_err(|reason| reason.to_string())
        .and_then(|()| writer.into_inner().map_err(|reason| reason.to_string()))
        .and_then(|bytes| String::from_utf8(bytes).map_err(|reason| reason.to_string()));
    text.map_err(|reason| Error::File(format!("cannot compose a csv header: {reason}")))
}

fn rows_until(path: &Path, text: &str, header: &str, rows: usize) -> Result<String> {
    let mut lines = text.split_inclusive('\n');
    let found = lines.next().unwrap_or_default();
    if found != header {
        return Err(Error::File(format!(
            "{} has other columns than this run writes: found `{}`, expected `{}`",
            path.display(),
            found.trim_end(),
            header.trim_end()
        )));
    }
    let kept = lines.take(rows).filter(|row| row.ends_with('\n'));
    Ok(std::iter::once(found).chain(kept).collect())
}

fn open_to_append(path: &Path) -> Result<File> {
    OpenOptions::new().append(true).open(path).map_err(|reason| cannot_write(path, &reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_exactly() {
        for value in [0.1, -1.0 / 3.0, 1e-300, 12.0, -7.0, 1e15, 6.02e23, f64::MIN_POSITIVE] {
            assert_eq!(number(value).parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
        assert_eq!(number(12.0), "12");
        assert_eq!(number(f64::NAN), "nan");
        assert_eq!(number(f64::NEG_INFINITY), "-inf");
    }

    #[test]
    fn a_restart_drops_later_and_broken_rows() {
        let path = Path::new("history.csv");
        let text = "step [-],x [m]\n1,0.5\n2,0.6\n3,0.7\n4,0";
        let kept = |rows| rows_until(path, text, "step [-],x [m]\n", rows).unwrap();
        assert_eq!(kept(2), "step [-],x [m]\n1,0.5\n2,0.6\n");
        assert_eq!(kept(9), "step [-],x [m]\n1,0.5\n2,0.6\n3,0.7\n");
        assert_eq!(kept(0), "step [-],x [m]\n");
        let error = rows_until(path, text, "step [-],y [m]\n", 2).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains("other columns"), "{error}");
    }

    #[test]
    fn a_name_with_a_comma_stays_one_column() {
        assert_eq!(line(&["a,b".into(), "c".into()]).unwrap(), "\"a,b\",c\n");
    }
}
