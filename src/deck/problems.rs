//! Faults of a deck: collected, then reported with file, line, column and the text itself.

use std::cell::RefCell;
use std::sync::Arc;

use super::marks::Sources;
use super::origins::Origins;
use super::tree::{Node, Origin};
use crate::error::Error;

/// Problems shown at once.
const SHOWN: usize = 10;

#[derive(Debug, PartialEq)]
struct Problem {
    origin: Origin,
    /// Dotted key, or empty.
    key: String,
    message: String,
    help: String,
}

/// Collects problems in the order they are found.
#[derive(Debug)]
pub struct Problems {
    sources: Arc<Sources>,
    found: RefCell<Vec<Problem>>,
}

/// A problem was reported; the value cannot be had.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reported;

/// A value, or the knowledge that a problem was reported.
pub type Got<T> = Result<T, Reported>;

impl Problems {
    pub fn new(sources: Sources) -> Self {
        Problems { sources: Arc::new(sources), found: RefCell::new(Vec::new()) }
    }

    /// Reports a problem at `origin` about the dotted `key`; `help` may be empty.
    pub fn report(&self, origin: &Origin, key: &str, message: String, help: String) -> Reported {
        let problem = Problem { origin: origin.clone(), key: key.to_string(), message, help };
        let mut found = self.found.borrow_mut();
        // A section that is read twice says the same twice.
        if !found.contains(&problem) {
            found.push(problem);
        }
        Reported
    }

    /// Where the keys below `root` are written.
    pub fn origins(&self, root: &Node) -> Origins {
        Origins::of(root, &self.sources)
    }

    /// The problems as one error, if there are any.
    pub fn into_error(self) -> Option<Error> {
        let mut found = self.found.into_inner();
        if found.is_empty() {
            return None;
        }
        // In the order of the text; options after it.
        found.sort_by_key(|problem| match &problem.origin {
            Origin::Text(span) => (0, span.start),
            Origin::Nowhere => (1, 0),
            Origin::Set(index) => (2, *index),
        });
        let hidden = found.len().saturating_sub(SHOWN);
        let mut text: Vec<String> =
            found.iter().take(SHOWN).map(|problem| render(&self.sources, problem)).collect();
        if hidden > 0 {
            text.push(format!("... and {hidden} more"));
        }
        Some(Error::Input(text.join("\n")))
    }
}

/// The problem with its place and the text there.
fn render(sources: &Sources, problem: &Problem) -> String {
    let key = match problem.key.as_str() {
        "" => String::new(),
        key => format!("{key}: "),
    };
    let (place, lines) = sources.mark(&problem.origin);
    let mut out = format!("{place}: {key}{}{lines}", problem.message);
    for line in problem.help.lines() {
        out.push_str("\n   = ");
        out.push_str(line);
    }
    out
}

/// A number in a message: as people write it, by its power of ten where that would take too many
/// digits.
pub fn figure(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_string(),
        size if (1e-5..1e15).contains(&size) => value.to_string(),
        _ => format!("{value:e}"),
    }
}

/// [`figure`] to four digits.
pub fn rough(value: f64) -> String {
    figure(format!("{value:.3e}").parse().unwrap_or(value))
}

/// The known name nearest to a mistyped one, if one is near enough to be meant.
pub fn nearest<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    known
        .into_iter()
        .map(|candidate| {
            let (a, b) = (name.to_lowercase(), candidate.to_lowercase());
            let prefix = a.len() >= 3 && (b.starts_with(&a) || a.starts_with(&b));
            let distance = strsim::damerau_levenshtein(&a, &b);
            (if prefix { distance.min(1) } else { distance }, candidate)
        })
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, candidate)| {
            let length = candidate.len().max(name.len());
            *distance < length && *distance <= (length / 3).max(1)
        })
        .map(|(_, candidate)| candidate)
}
