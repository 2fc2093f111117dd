//! What the terminal and `log.txt` say.
//!
//! | idea | file |
//! |---|---|
//! | text of the banner, the plan, the steps, the closing table, a failure | `report.rs` |
//! | how often a line is worth saying | `progress.rs` |
//! | the log itself | `log.rs` |

pub(crate) mod log;
pub(crate) mod progress;
pub(crate) mod report;
