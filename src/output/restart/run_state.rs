//! Named numbers that a time loop needs to go on where it stopped; they come back bit by bit.

use std::collections::BTreeMap;

use crate::error::{Error, Result};

/// Counts and numbers by name, the same on every rank. Each part of a run puts its own in and
/// takes them out again: `stepping.position`, `totals.work`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunState {
    counts: BTreeMap<String, u64>,
    numbers: BTreeMap<String, f64>,
}

impl RunState {
    pub fn new() -> Self {
        Self::default()
    }

    pub fn set_count(&mut self, name: &str, value: u64) {
        self.counts.insert(name.to_string(), value);
    }

    pub fn set(&mut self, name: &str, value: f64) {
        self.numbers.insert(name.to_string(), value);
    }

    /// Error: the checkpoint does not hold it, as another program version or analysis wrote it.
    pub fn count(&self, name: &str) -> Result<u64> {
        self.counts.get(name).copied().ok_or_else(|| absent(name))
    }

    /// Error: as [`Self::count`].
    pub fn number(&self, name: &str) -> Result<f64> {
        self.numbers.get(name).copied().ok_or_else(|| absent(name))
    }

    /// Adds everything in `other`, which wins over what has the same name here.
    pub fn merge(&mut self, other: RunState) {
        self.counts.extend(other.counts);
        self.numbers.extend(other.numbers);
    }

    /// Names, one a line, and values; [`Self::from_lists`] is the way back.
    pub fn lists(&self) -> (String, Vec<u64>, String, Vec<f64>) {
        let names =
            |keys: Vec<&String>| keys.iter().map(|key| key.as_str()).collect::<Vec<_>>().join("\n");
        (
            names(self.counts.keys().collect()),
            self.counts.values().copied().collect(),
            names(self.numbers.keys().collect()),
            self.numbers.values().copied().collect(),
        )
    }

    pub fn from_lists(count_names: &str, counts: &[u64], names: &str, numbers: &[f64]) -> Self {
        let pair = |names: &str| names.lines().map(str::to_string).collect::<Vec<_>>();
        RunState {
            counts: pair(count_names).into_iter().zip(counts.iter().copied()).collect(),
            numbers: pair(names).into_iter().zip(numbers.iter().copied()).collect(),
        }
    }
}

fn absent(name: &str) -> Error {
    Error::File(format!(
        "the checkpoint does not hold `{name}`: another version of the program, or another kind \
         of analysis, wrote it"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_under_their_names() {
        let mut state = RunState::new();
        state.set("b", 0.1 + 0.2);
        state.set("a", -0.0);
        state.set_count("n", u64::MAX);
        let (count_names, counts, names, numbers) = state.lists();
        let back = RunState::from_lists(&count_names, &counts, &names, &numbers);
        assert_eq!(back, state);
        assert_eq!(back.number("a").unwrap().to_bits(), (-0.0_f64).to_bits());
        assert_eq!(back.count("n").unwrap(), u64::MAX);
        let error = back.number("c").unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains("`c`"), "{error}");
    }
}
