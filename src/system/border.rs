//! Work in two parts, so that messages travel while the second is done: first the points that touch
//! nodes of another rank and the rows that read values of another rank, then all others.

use std::ops::Range;

/// Which of both is asked for. What other ranks wait for comes first, and is on its way while the rest is summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// What reaches nodes of other ranks.
    Reaching,
    /// The rest.
    Inner,
}

/// Indices of either kind, each as ascending runs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Border {
    /// They reach values of other ranks.
    pub reaching: Vec<Range<usize>>,
    /// They do not.
    pub inner: Vec<Range<usize>>,
}

impl Border {
    /// Indices of a part.
    pub fn of(&self, part: Part) -> &[Range<usize>] {
        match part {
            Part::Reaching => &self.reaching,
            Part::Inner => &self.inner,
        }
    }

    /// Index by index, whether it reaches values of other ranks.
    pub fn new(reaches: impl Iterator<Item = bool>) -> Self {
        let mut border = Border::default();
        for (index, reaches) in reaches.enumerate() {
            let runs = if reaches { &mut border.reaching } else { &mut border.inner };
            match runs.last_mut() {
                Some(run) if run.end == index => run.end += 1,
                _ => runs.push(index..index + 1),
            }
        }
        border
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_index_is_in_one_run() {
        let marks = [true, true, false, true, false, false];
        let border = Border::new(marks.into_iter());
        assert_eq!((border.reaching, border.inner), (vec![0..2, 3..4], vec![2..3, 4..6]));
        assert_eq!(Border::new([false; 3].into_iter()).inner[0], 0..3);
        assert!(Border::new([true; 3].into_iter()).inner.is_empty());
        assert_eq!(Border::new(std::iter::empty()), Border::default());
    }
}
