//! Puts the values of a field in another order. All fields share one buffer: the system would have to
//! clear the pages of fresh memory, which costs more than the copies. Where few points change place,
//! only those move.

use std::any::Any;

/// An order that is applied to one field after the other.
pub(crate) struct Gather<'a> {
    order: &'a [usize],
    /// A `Vec<T>`: the memory that the last field left; the next one is mostly of its type.
    spare: Box<dyn Any>,
}

impl<'a> Gather<'a> {
    pub fn new(order: &'a [usize]) -> Self {
        Gather { order, spare: Box::new(()) }
    }

    /// Keeps `values[order[0]], values[order[1]], ...`; a field without values stays so.
    pub fn apply<T: Copy + 'static>(&mut self, values: &mut Vec<T>) {
        if values.is_empty() {
            return;
        }
        if !self.spare.is::<Vec<T>>() {
            self.spare = Box::new(Vec::<T>::with_capacity(with_slack(self.order.len())));
        }
        if let Some(spare) = self.spare.downcast_mut::<Vec<T>>() {
            spare.clear();
            spare.extend(self.order.iter().map(|&p| values[p]));
            std::mem::swap(spare, values);
        }
    }

    /// As [`Gather::apply`] for rows of `stride` values each.
    pub fn apply_rows(&mut self, values: &mut Vec<f64>, stride: usize) {
        let mut next = Vec::with_capacity(stride * with_slack(self.order.len()));
        for &p in self.order {
            next.extend_from_slice(&values[p * stride..][..stride]);
        }
        *values = next;
    }
}

/// Room for this many points and a few that arrive later.
pub(crate) fn with_slack(points: usize) -> usize {
    points + points / 64
}

/// Values that change place, one after the other.
pub(crate) struct Moves {
    from_to: Vec<(usize, usize)>,
    /// How many values there are in the end.
    left: usize,
}

impl Moves {
    /// Of `all` values those at the places `gone` (ascending, below `own`) make room for the ones from
    /// `own` on, in order. What is left over of these closes up; where they are too few, the last of
    /// the others take the places.
    pub fn new(gone: &[usize], own: usize, all: usize) -> Self {
        let filled = gone.len().min(all - own);
        let mut from_to: Vec<_> = (own..own + filled).zip(gone.iter().copied()).collect();
        from_to.extend((own + filled..all).zip(own..));
        let (mut gaps, mut last) = (&gone[filled..], own);
        while let [first, rest @ ..] = gaps {
            last -= 1;
            gaps = if let [others @ .., end] = gaps
                && *end == last
            {
                others
            } else {
                from_to.push((last, *first));
                rest
            };
        }
        Moves { from_to, left: all - gone.len() }
    }

    /// A field without values stays so.
    pub fn apply<T: Copy>(&self, values: &mut Vec<T>) {
        if values.is_empty() {
            return;
        }
        for &(from, to) in &self.from_to {
            values[to] = values[from];
        }
        values.truncate(self.left);
    }

    /// As [`Moves::apply`] for rows of `stride` values each.
    pub fn apply_rows(&self, values: &mut Vec<f64>, stride: usize) {
        for &(from, to) in &self.from_to {
            values.copy_within(from * stride..(from + 1) * stride, to * stride);
        }
        values.truncate(self.left * stride);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_different_types_follow_one_order() {
        for order in [vec![3, 0, 2], vec![0, 2, 3], vec![], vec![2, 2, 1, 0, 3]] {
            let mut gather = Gather::new(&order);
            let mut numbers = vec![10u64, 11, 12, 13];
            let (mut first, mut second) = (vec![0.0, 0.1, 0.2, 0.3], vec![1.0, 1.1, 1.2, 1.3]);
            let mut pairs = vec![[0u8, 1], [2, 3], [4, 5], [6, 7]];
            gather.apply(&mut numbers);
            gather.apply(&mut first);
            gather.apply(&mut second);
            gather.apply(&mut pairs);
            for (k, &p) in order.iter().enumerate() {
                assert_eq!(numbers[k], 10 + p as u64);
                assert_eq!((first[k], second[k]), (p as f64 / 10.0, 1.0 + p as f64 / 10.0));
                assert_eq!(pairs[k], [2 * p as u8, 2 * p as u8 + 1]);
            }
            let counts = [numbers.len(), first.len(), second.len(), pairs.len()];
            assert_eq!(counts, [order.len(); 4]);
        }
    }

    #[test]
    fn gaps_are_filled_and_the_others_stay() {
        let (own, new) = (6, 100);
        for gone in [vec![], vec![2], vec![0, 5], vec![3, 4, 5], vec![1, 3, 5], (0..6).collect()] {
            for arrived in 0..8 {
                let mut values: Vec<usize> = (0..own).chain(new..new + arrived).collect();
                let mut none: Vec<u8> = Vec::new();
                let moves = Moves::new(&gone, own, own + arrived);
                moves.apply(&mut values);
                moves.apply(&mut none);
                assert!(none.is_empty());
                assert_eq!(values.len(), own + arrived - gone.len());
                for (place, &value) in values.iter().enumerate() {
                    let stayed = value == place || value >= new || gone.contains(&place);
                    assert!(stayed, "{gone:?}, {arrived} arrived: {values:?}");
                }
                let mut sorted = values.clone();
                sorted.sort_unstable();
                let kept = (0..own).filter(|p| !gone.contains(p));
                let expected: Vec<usize> = kept.chain(new..new + arrived).collect();
                assert_eq!(sorted, expected, "{gone:?}, {arrived} arrived");
            }
        }
    }
}
