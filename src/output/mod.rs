//! The results directory.
