//! `residuals.csv`: the normalised residual (Lagrangian eq. 40) of every iteration of every step.

use mpi::topology::SimpleCommunicator;

use super::csv_table::CsvTable;
use super::directory::{RESIDUALS, ResultsDirectory};
use crate::error::Result;

/// The open list of residuals.
#[derive(Debug)]
pub struct Residuals {
    table: CsvTable,
}

impl Residuals {
    pub fn create(directory: &ResultsDirectory, comm: &SimpleCommunicator) -> Result<Self> {
        let table = CsvTable::create(&directory.file(RESIDUALS), &header(), comm)?;
        Ok(Self { table })
    }

    /// Continues the list of a run after its first `rows` rows.
    pub fn resume(
        directory: &ResultsDirectory,
        rows: usize,
        comm: &SimpleCommunicator,
    ) -> Result<Self> {
        let path = directory.file(RESIDUALS);
        Ok(Self { table: CsvTable::resume(&path, &header(), rows, comm)? })
    }

    /// Rows of the whole run so far.
    pub fn rows(&self) -> usize {
        self.table.rows()
    }

    /// Appends the residuals of one step; the first belongs to iteration 0, at zero displacement. A step that failed
    /// and is tried again writes its iterations again.
    pub fn push_step(
        &mut self,
        step: usize,
        residuals: &[f64],
        comm: &SimpleCommunicator,
    ) -> Result<()> {
        let rows: Vec<[f64; 3]> = residuals
            .iter()
            .enumerate()
            .map(|(index, &residual)| [step as f64, index as f64, residual])
            .collect();
        let rows: Vec<&[f64]> = rows.iter().map(|row| &row[..]).collect();
        self.table.push_all(&rows, comm)
    }
}

fn header() -> Vec<String> {
    ["step [-]", "iteration [-]", "residual [-]"].map(String::from).to_vec()
}
