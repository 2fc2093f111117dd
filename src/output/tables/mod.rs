//! Tables that grow row by row.
//!
//! | file on disk | file |
//! |---|---|
//! | `history.csv` | `history.rs` |
//! | `residuals.csv` | `residuals.rs` |
//! | any such table | `csv_table.rs` |

pub(crate) mod csv_table;
pub(crate) mod history;
pub(crate) mod residuals;
