//! The values of a field in another order, without fresh memory for every field: pages that the
//! system has to clear cost more than the copies.

use std::any::Any;

/// An order that is applied to one field after the other.
pub(super) struct Gather<'a> {
    order: &'a [usize],
    ascending: bool,
    /// A `Vec<T>`: the memory that the last field left; the next one is mostly of its type.
    spare: Box<dyn Any>,
}

impl<'a> Gather<'a> {
    pub fn new(order: &'a [usize]) -> Self {
        let ascending = order.windows(2).all(|pair| pair[0] < pair[1]);
        Gather { order, ascending, spare: Box::new(()) }
    }

    /// Keeps `values[order[0]], values[order[1]], ...`; a field without values stays so.
    pub fn apply<T: Copy + 'static>(&mut self, values: &mut Vec<T>) {
        if values.is_empty() {
            return;
        }
        if self.ascending {
            return keep(values, self.order);
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
}

/// Room for this many points and a few that arrive later.
pub(super) fn with_slack(points: usize) -> usize {
    points + points / 64
}

/// Keeps the values at the places `stay`, which ascend.
fn keep<T: Copy>(values: &mut Vec<T>, stay: &[usize]) {
    let moved = stay.iter().enumerate().skip_while(|(to, from)| to == *from);
    for (to, &from) in moved {
        values[to] = values[from];
    }
    values.truncate(stay.len());
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
}
