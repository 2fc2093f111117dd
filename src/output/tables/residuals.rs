//! `residuals.csv`: the normalised residual (Lagrangian eq. 40) of every iteration of every step.

use mpi::topology::SimpleCommunicator;

use super::csv_table::CsvTable;
use crate::error::Result;
use crate::output::directory::{RESIDUALS, ResultsDirectory};

/// The open list of residuals.
#[derive(Debug)]
pub struct Residuals {
    pub table: CsvTable,
}

impl Residuals {
    /// A new list. Nothing is written before [`CsvTable::open`].
    pub fn create(directory: &ResultsDirectory) -> Result<Self> {
        let header = ["step [-]", "iteration [-]", "residual [-]"].map(String::from);
        Ok(Self { table: CsvTable::create(&directory.file(RESIDUALS), &header)? })
    }

    /// Appends the residuals of one step; the first belongs to iteration 0, at zero displacement.
    /// A step that failed and is tried again writes its iterations again.
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
