//! What a run warns of: each warning once on the terminal, all of them in `summary.json` and at the
//! end of the terminal's output.

/// A warning and how often it was given.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Warning {
    text: String,
    /// The step that gave it first, for one that steps give.
    step: Option<usize>,
    times: usize,
}

/// The warnings of a run so far, in the order of their first times.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Warnings(Vec<Warning>);

impl Warnings {
    /// Counts a warning; true if it is new.
    pub fn add(&mut self, step: Option<usize>, text: &str) -> bool {
        if let Some(known) = self.0.iter_mut().find(|known| known.text == text) {
            known.times += 1;
            return false;
        }
        self.0.push(Warning { text: text.into(), step, times: 1 });
        true
    }

    /// One line for each.
    pub fn lines(&self) -> Vec<String> {
        let line = |warning: &Warning| match (warning.step, warning.times) {
            (None, _) => warning.text.clone(),
            (Some(step), 1) => format!("step {step}: {}", warning.text),
            (Some(step), times) => {
                format!("step {step} and {} later: {}", times - 1, warning.text)
            }
        };
        self.0.iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_kept_once_and_counted() {
        let mut warnings = Warnings::default();
        assert!(warnings.add(None, "a"));
        assert!(warnings.add(Some(3), "b"));
        assert!(!warnings.add(Some(4), "b") && !warnings.add(None, "a"));
        assert!(warnings.add(Some(5), "c"));
        assert_eq!(warnings.lines(), ["a", "step 3 and 1 later: b", "step 5: c"]);
    }
}
