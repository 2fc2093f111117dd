//! A csv file that grows row by row and can be read at any moment. The first column is the step.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use mpi::topology::{Communicator, SimpleCommunicator};
use mpi::traits::Root;

use crate::error::{Error, Result};
use crate::output::agreement::on_root;
use crate::output::terminal::log::Log;
use crate::output::whole_file::{cannot_read, cannot_write, write_whole};

/// How far a table had come: what belongs to the run when it goes on from there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mark {
    pub rows: usize,
    /// Step of the last row.
    pub step: usize,
}

/// Written by rank 0; the other ranks get the outcome.
#[derive(Debug)]
pub struct CsvTable {
    path: PathBuf,
    columns: usize,
    mark: Mark,
    /// What the file holds when it is opened, on rank 0.
    start: String,
    /// Open on rank 0 only.
    file: Option<File>,
}

impl CsvTable {
    /// A new table. Nothing is written before [`Self::open`].
    pub fn create(path: &Path, header: &[String]) -> Result<Self> {
        Ok(Self {
            path: path.to_path_buf(),
            columns: header.len(),
            mark: Mark { rows: 0, step: 0 },
            start: line(header)?,
            file: None,
        })
    }

    /// Continues a table up to `mark`: later rows, and a row cut short, are dropped. A missing
    /// file is begun anew. Rows that should be there and are not are lost, which is said: the state
    /// of the run does not depend on them. Nothing is written before [`Self::open`].
    ///
    /// # Errors
    /// `File` if the file has other columns.
    pub fn resume(&mut self, mark: Mark, log: &mut Log, comm: &SimpleCommunicator) -> Result<()> {
        let path = &self.path;
        let mut found = 0;
        on_root(comm, || {
            if path.exists() {
                let text = fs::read_to_string(path).map_err(|reason| cannot_read(path, &reason))?;
                (self.start, found) = kept(path, &text, &self.start, self.columns, mark)?;
            }
            Ok(())
        })?;
        comm.process_at_rank(0).broadcast_into(&mut found);
        if found < mark.rows {
            log.say(&format!(
                "warning: {} has lost rows: {found} of {} are left, and the run goes on without \
                 the others",
                path.display(),
                mark.rows
            ));
        }
        self.mark = Mark { rows: found, ..mark };
        Ok(())
    }

    /// Writes what the table begins with, and is ready for more.
    pub fn open(&mut self, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            write_whole(&self.path, self.start.as_bytes())?;
            self.start = String::new();
            let file = OpenOptions::new().append(true).open(&self.path);
            self.file = Some(file.map_err(|reason| cannot_write(&self.path, &reason))?);
            Ok(())
        })
    }

    /// Brings all rows to the disk.
    pub fn sync(&self, comm: &SimpleCommunicator) -> Result<()> {
        on_root(comm, || {
            let synced = self.file.as_ref().map_or(Ok(()), File::sync_data);
            synced.map_err(|reason| cannot_write(&self.path, &reason))
        })
    }

    /// Where the table is now, rows of earlier parts of the run included.
    pub fn mark(&self) -> Mark {
        self.mark
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
        on_root(comm, || match &mut self.file {
            Some(file) => {
                append(file, text.as_bytes()).map_err(|reason| cannot_write(&self.path, &reason))
            }
            None => Err(Error::File(format!("cannot write {}: not open", self.path.display()))),
        })?;
        self.mark.rows += rows.len();
        self.mark.step = rows.last().map_or(self.mark.step, |row| row[0] as usize);
        Ok(())
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

/// Without a last row that has no end: a run that goes on may have written half of it.
pub fn whole_rows(text: &str) -> &str {
    text.rfind('\n').map_or("", |end| &text[..=end])
}

/// The header and the rows up to `mark`, and the number of the rows. By their number alone rows
/// after a gap would be taken for those that are missing.
fn kept(
    path: &Path,
    text: &str,
    header: &str,
    columns: usize,
    mark: Mark,
) -> Result<(String, usize)> {
    let mut lines = text.split_inclusive('\n');
    let found = lines.next().unwrap_or_default();
    if found != header {
        return Err(Error::File(format!(
            "{} has other columns than this run writes: found `{}`, expected `{}`\n    try: move \
             it away, and the table starts anew",
            path.display(),
            found.trim_end(),
            header.trim_end()
        )));
    }
    let belongs = |row: &&str| {
        let step = row.split(',').next().and_then(|word| word.parse::<f64>().ok());
        let whole = row.ends_with('\n') && row.split(',').count() == columns;
        whole && step.is_some_and(|step| step <= mark.step as f64)
    };
    let rows: Vec<&str> = lines.filter(belongs).take(mark.rows).collect();
    Ok((std::iter::once(found).chain(rows.iter().copied()).collect(), rows.len()))
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
        let header = "step [-],x [m]\n";
        let of = |text: &str, rows, step| {
            kept(path, &format!("{header}{text}"), header, 2, Mark { rows, step }).unwrap()
        };
        let kept_rows = |text, rows, step| {
            let (text, count) = of(text, rows, step);
            let rows = text.strip_prefix(header).expect("the header").to_string();
            assert_eq!(rows.lines().count(), count);
            rows
        };
        let text = "1,0.5\n2,0.6\n3,0.7\n4,0";
        assert_eq!(kept_rows(text, 2, 2), "1,0.5\n2,0.6\n");
        assert_eq!(kept_rows(text, 4, 4), "1,0.5\n2,0.6\n3,0.7\n");
        assert_eq!(kept_rows(text, 0, 0), "");
        // Step 2 came in two parts, and the checkpoint between them.
        assert_eq!(kept_rows("1,0.5\n2,0.6\n2,0.7\n", 2, 2), "1,0.5\n2,0.6\n");
        // Rows 3 and 4 are lost: those behind them do not take their place.
        assert_eq!(kept_rows("1,0.5\n2,0.6\n5,0.7\n6,0.8\n", 4, 4), "1,0.5\n2,0.6\n");
        // A block that never reached the disk reads as zeros.
        assert_eq!(kept_rows("1,0.5\n\0\0\0\n3,\n4\n", 4, 4), "1,0.5\n3,\n");
        let other = kept(path, text, "step [-],y [m]\n", 2, Mark { rows: 2, step: 2 });
        let error = other.unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains("other columns"), "{error}");
    }

    #[test]
    fn a_name_with_a_comma_stays_one_column() {
        assert_eq!(line(&["a,b".into(), "c".into()]).unwrap(), "\"a,b\",c\n");
    }
}
