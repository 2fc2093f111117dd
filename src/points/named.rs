//! Numbers that points carry because their body's material asks for them: state variables, and
//! parameters that vary in space. Every point has as many words as the body with the most.

use std::sync::Arc;

use super::gather::{Gather, Moves};

/// Rows of words, one per point, whose names depend on the point's body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Named {
    /// Names of the words of each body's points, in order.
    names: Arc<Vec<Vec<String>>>,
    /// Words per point.
    stride: usize,
    /// Rows one after the other.
    pub values: Vec<f64>,
}

impl Named {
    /// The same words, of no points.
    pub fn empty_like(&self) -> Self {
        Named { names: self.names.clone(), stride: self.stride, values: Vec::new() }
    }

    /// Without points; `names` of each body's words.
    pub fn new(names: Vec<Vec<String>>) -> Self {
        let stride = names.iter().map(Vec::len).max().unwrap_or(0);
        Named { names: Arc::new(names), stride, values: Vec::new() }
    }

    /// Rows of `count` points, all zero, with the names of each body's words.
    pub fn zeros(names: Vec<Vec<String>>, count: usize) -> Self {
        let mut made = Self::new(names);
        made.values = vec![0.0; made.stride * count];
        made
    }

    /// Whether these names are the same as ours but for some that `may` come and go.
    pub fn differ_in(&self, names: &[Vec<String>], may: impl Fn(&str) -> bool) -> bool {
        let kept = |all: &[Vec<String>]| -> Vec<Vec<String>> {
            all.iter().map(|own| own.iter().filter(|n| !may(n)).cloned().collect()).collect()
        };
        let mut ours = self.names.to_vec();
        ours.resize(names.len().max(ours.len()), Vec::new());
        kept(&ours) == kept(names)
    }

    /// The words under other names of each body's points, whose `bodies` are those; new ones are zero.
    pub fn renamed(&self, names: Vec<Vec<String>>, bodies: &[u32]) -> Self {
        let mut made = Self::zeros(names, bodies.len());
        for (p, &body) in bodies.iter().enumerate() {
            for at in 0..made.names[body as usize].len() {
                let value = self.get(p, body, &made.names[body as usize][at]);
                made.of_mut(p, body)[at] = value.unwrap_or(0.0);
            }
        }
        made
    }

    /// Words per point.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Names of the words of each body.
    pub fn names(&self) -> &[Vec<String>] {
        &self.names
    }

    /// The words of point `p` of a body.
    #[inline(always)]
    pub fn of(&self, p: usize, body: u32) -> &[f64] {
        Self::row(&self.values, self.stride, &self.names, p, body)
    }

    /// The words of point `p` in `values` that were set aside.
    #[inline(always)]
    pub fn of_former<'a>(&self, values: &'a [f64], p: usize, body: u32) -> &'a [f64] {
        Self::row(values, self.stride, &self.names, p, body)
    }

    #[inline(always)]
    fn row<'a>(
        values: &'a [f64],
        stride: usize,
        names: &[Vec<String>],
        p: usize,
        body: u32,
    ) -> &'a [f64] {
        if stride == 0 {
            return &[];
        }
        &values[p * stride..][..names[body as usize].len()]
    }

    /// The same to be written.
    #[inline(always)]
    pub fn of_mut(&mut self, p: usize, body: u32) -> &mut [f64] {
        if self.stride == 0 {
            return &mut [];
        }
        &mut self.values[p * self.stride..][..self.names[body as usize].len()]
    }

    /// Takes the first words of `words` as those of point `p`, as many as a row has.
    #[inline(always)]
    pub fn set(&mut self, p: usize, words: &[f64]) {
        if self.stride > 0 {
            self.values[p * self.stride..][..self.stride].copy_from_slice(&words[..self.stride]);
        }
    }

    /// The word of that name at a point; `None` if its body has none.
    pub fn get(&self, p: usize, body: u32, name: &str) -> Option<f64> {
        let at = self.names.get(body as usize)?.iter().position(|known| known == name)?;
        self.of(p, body).get(at).copied()
    }

    /// All words of point `p`, those that its body does not use included.
    pub(super) fn whole(&self, p: usize) -> &[f64] {
        &self.values[p * self.stride..][..self.stride]
    }

    /// Appends the row that begins `words` and takes it away from them.
    pub(super) fn take(&mut self, words: &mut &[f64]) {
        let (own, rest) = words.split_at(self.stride);
        self.values.extend_from_slice(own);
        *words = rest;
    }

    pub(super) fn truncate(&mut self, count: usize) {
        self.values.truncate(count * self.stride);
    }

    pub(super) fn reserve(&mut self, more: usize) {
        self.values.reserve_exact(more * self.stride);
    }

    pub(super) fn gather(&mut self, gather: &mut Gather<'_>) {
        if self.stride > 0 {
            gather.apply_rows(&mut self.values, self.stride);
        }
    }

    pub(super) fn rearrange(&mut self, moves: &Moves) {
        if self.stride > 0 {
            moves.apply_rows(&mut self.values, self.stride);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_follow_their_points() {
        let words = |names: &[&str]| names.iter().map(|name| name.to_string()).collect();
        let mut named = Named::zeros(vec![words(&["a", "b"]), words(&["b"]), words(&[])], 3);
        for (p, body) in [(0, 0), (1, 1), (2, 2)] {
            for (k, word) in named.of_mut(p, body).iter_mut().enumerate() {
                *word = (10 * p + k) as f64;
            }
        }
        assert_eq!((named.of(0, 0), named.of(1, 1)), (&[0.0, 1.0][..], &[10.0][..]));
        assert_eq!((named.get(0, 0, "b"), named.get(1, 1, "b")), (Some(1.0), Some(10.0)));
        assert_eq!((named.get(1, 1, "a"), named.get(2, 2, "b")), (None, None));
        let order = [2, 0];
        named.gather(&mut Gather::new(&order));
        assert_eq!((named.of(0, 2), named.of(1, 0)), (&[][..], &[0.0, 1.0][..]));
        named.take(&mut &[5.0, 6.0][..]);
        named.rearrange(&Moves::new(&[0], 2, 3));
        assert_eq!((named.of(0, 0), named.of(1, 0)), (&[5.0, 6.0][..], &[0.0, 1.0][..]));
    }

    #[test]
    fn without_words_nothing_is_carried() {
        let mut named = Named::new(vec![Vec::new(); 2]);
        named.take(&mut &[][..]);
        assert!(named.of(7, 1).is_empty() && named.of_mut(7, 1).is_empty());
        assert!(Named::default().of(3, 0).is_empty());
    }
}
