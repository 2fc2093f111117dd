//! Where the tables of this executable go.

use crate::common::validation::record_in;

/// A table of docs/evidence/validation-dynamics.md.
pub fn record(name: &str, header: &[&str], rows: &[Vec<String>]) {
    record_in("validation-dynamics.md", name, header, rows);
}
