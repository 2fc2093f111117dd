//! Which candidates for points a rank makes: an equal share of them, whatever the partition will be.

use std::ops::Range;

/// Which share of the candidates to make.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    /// From zero.
    pub rank: usize,
    /// Number of shares.
    pub ranks: usize,
}

impl Share {
    /// This rank's part of `0..count`.
    pub fn of(&self, count: usize) -> Range<usize> {
        count * self.rank / self.ranks..count * (self.rank + 1) / self.ranks
    }

    /// This rank's part of a box of `size` candidates: about as many inside the shape as on any
    /// other rank, and in slices across the longest axis, as parts of the body will mostly be, so
    /// that few points have to change rank. `inside`: of a place in units of candidates.
    pub(crate) fn of_box<const D: usize>(
        &self,
        size: [usize; D],
        inside: impl Fn(&[f64; D]) -> bool,
    ) -> Slice<D> {
        let count: usize = size.iter().product();
        let axis = (0..D).max_by_key(|&a| size[a]).unwrap_or(0);
        if self.ranks == 1 || count == 0 {
            return Slice { size, axis, range: 0..count };
        }
        // Points in the slices before each of these, by a coarse sample: on all ranks the same.
        let mut before = vec![0.0];
        let across = SAMPLES_ACROSS.pow(D as u32 - 1);
        for slice in 0..SLICES {
            let found = (0..across).filter(|&sample| {
                let mut rest = sample;
                inside(&std::array::from_fn(|a| {
                    let at = if a == axis {
                        (slice as f64 + 0.5) / SLICES as f64
                    } else {
                        let place = rest % SAMPLES_ACROSS;
                        rest /= SAMPLES_ACROSS;
                        (place as f64 + 0.5) / SAMPLES_ACROSS as f64
                    };
                    at * size[a] as f64
                }))
            });
            // A body too thin for the samples is somewhere, too.
            before.push(before[slice] + found.count() as f64 + 1e-3);
        }
        let start = |rank: usize| {
            let goal = before[SLICES] * rank as f64 / self.ranks as f64;
            let slice = before.partition_point(|&sum| sum <= goal).clamp(1, SLICES) - 1;
            let part = (goal - before[slice]) / (before[slice + 1] - before[slice]);
            let place = ((slice as f64 + part) / SLICES as f64 * count as f64) as usize;
            if rank == self.ranks { count } else { place.min(count) }
        };
        Slice { size, axis, range: start(self.rank)..start(self.rank + 1) }
    }
}

/// Slices of a sample of a shape, and samples along each axis of one of them.
const SLICES: usize = 64;
const SAMPLES_ACROSS: usize = 16;

/// Candidates that follow each other where those along `axis` differ slowest.
pub(crate) struct Slice<const D: usize> {
    size: [usize; D],
    axis: usize,
    range: Range<usize>,
}

impl<const D: usize> Slice<D> {
    /// Calls `visit` with number and index of each, in ascending order of the number, which counts
    /// with the first axis fastest.
    pub(crate) fn for_each(&self, mut visit: impl FnMut(usize, [usize; D])) {
        let Slice { size, axis, range } = self;
        let layer: usize = size.iter().product::<usize>() / size[*axis].max(1);
        if range.is_empty() {
            return;
        }
        let first = range.start / layer;
        let mut within = *size;
        within[*axis] = (range.end - 1) / layer + 1 - first;
        for k in 0..within.iter().product() {
            let mut at: [usize; D] = split(k, &within);
            at[*axis] += first;
            let number = (0..D).rev().fold(0, |flat, a| flat * size[a] + at[a]);
            let others = (0..D).rev().filter(|a| a != axis);
            let place = others.fold(at[*axis], |flat, a| flat * size[a] + at[a]);
            if range.contains(&place) {
                visit(number, at);
            }
        }
    }
}

/// Index of `flat` in an array of these counts, first axis fastest.
pub(crate) fn split<const D: usize>(mut flat: usize, counts: &[usize]) -> [usize; D] {
    std::array::from_fn(|axis| {
        let i = flat % counts[axis];
        flat /= counts[axis];
        i
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_are_about_equal_and_leave_nothing_out() {
        // A quarter of an ellipse in a window with room to spare.
        let inside = |x: &[f64; 2]| (x[0] / 80.0).powi(2) + (x[1] / 40.0).powi(2) <= 1.0;
        let size = [90, 45];
        for ranks in [1, 2, 7, 500] {
            let (mut met, mut kept) = (vec![0; 90 * 45], Vec::new());
            for rank in 0..ranks {
                let (mut last, mut own) = (None, 0);
                Share { rank, ranks }.of_box(size, inside).for_each(|number, at| {
                    assert_eq!(number, at[0] + 90 * at[1]);
                    assert!(last < Some(number));
                    last = Some(number);
                    met[number] += 1;
                    own += usize::from(inside(&at.map(|i| i as f64 + 0.5)));
                });
                kept.push(own);
            }
            assert!(met.iter().all(|&times| times == 1), "{ranks} ranks");
            let mean = kept.iter().sum::<usize>() as f64 / ranks as f64;
            let largest = kept.iter().copied().fold(0, usize::max) as f64;
            // Half a layer more or less, where a rank has less than one.
            assert!(largest < 1.1 * mean + 10.0, "{ranks} ranks: {largest}, mean {mean}");
        }
        let empty = Share { rank: 1, ranks: 3 }.of_box([0, 4, 5], |_| true);
        empty.for_each(|_, _| panic!("there is nothing"));
    }
}
