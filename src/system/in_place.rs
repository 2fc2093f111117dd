//! Block rows in the memory that the solver multiplies with: assembling is then the only pass
//! over the system. A row is cleared when it is first met, just before it is added to.
//!
//! PETSc keeps a row's entries in own columns apart from those in the columns of other ranks. Rows
//! that have both (they lie at the border of the rank) and rows of other ranks' nodes are
//! assembled in an array of ours, whole as [`Pattern`] has them; [`InPlace::hand_over`] deals the
//! former out. All other rows lie in PETSc's array from the start.

use crate::error::{Error, Result};

use super::numbering::Numbering;
use super::pattern::Pattern;
use super::scatter::{BlockMatrix, BlockRows, add_scalar_row};

/// So many rows before a row is cleared its memory is asked for.
const AHEAD: usize = 4;

/// Asks for values before they are needed.
#[inline(always)]
fn prefetch(values: &[f64]) {
    #[cfg(target_arch = "x86_64")]
    for line in values.chunks(8) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: the address is that of a value, and the instruction changes nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>((&raw const line[0]).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = values;
}

/// Where the block rows of a pattern lie. Addresses below `main` are in the solver's array, the
/// others in ours.
#[derive(Debug)]
pub struct RowAddresses<const B: usize> {
    /// Address of the first value of each row.
    starts: Vec<usize>,
    /// Values in own columns, all of them in the solver's array.
    main: usize,
    /// Values in columns of other ranks.
    other: usize,
    border: Vec<BorderRow>,
    /// Addresses of the rows that belong to other ranks begin here.
    ghosts: usize,
    end: usize,
}

/// An owned row with columns of other ranks: `left` of them, then `own` ones, then others again.
#[derive(Debug, Clone, Copy)]
struct BorderRow {
    row: u32,
    left: u32,
    own: u32,
    width: u32,
    /// Its first value among those in own columns, and among those in other ranks' columns.
    inside: usize,
    outside: usize,
}

impl<const B: usize> RowAddresses<B> {
    /// Of the rows of a pattern.
    pub fn new(numbering: &Numbering, pattern: &Pattern) -> Self {
        let rows = pattern.offsets.len().saturating_sub(1);
        let mut addresses = RowAddresses {
            starts: Vec::with_capacity(rows),
            main: 0,
            other: 0,
            border: Vec::new(),
            ghosts: 0,
            end: 0,
        };
        let own = |&column: &u32| (column as usize) < numbering.owned;
        for row in 0..numbering.owned {
            addresses.starts.push(addresses.main);
            let columns = &pattern.columns[pattern.offsets[row]..pattern.offsets[row + 1]];
            let mut count = columns.len();
            // Without ghosts there is nothing to look for.
            if numbering.len() > numbering.owned {
                count = columns.iter().filter(|c| own(c)).count();
            }
            if count < columns.len() {
                let left = columns.iter().take_while(|c| !own(c)).count();
                addresses.border.push(BorderRow {
                    row: row as u32,
                    left: left as u32,
                    own: count as u32,
                    width: columns.len() as u32,
                    inside: addresses.main,
                    outside: addresses.other,
                });
                addresses.other += B * B * (columns.len() - count);
            }
            addresses.main += B * B * count;
        }
        addresses.end = addresses.main;
        for border in &addresses.border {
            addresses.starts[border.row as usize] = addresses.end;
            addresses.end += B * B * border.width as usize;
        }
        addresses.ghosts = addresses.end;
        for row in numbering.owned..rows {
            addresses.starts.push(addresses.end);
            addresses.end += B * B * (pattern.offsets[row + 1] - pattern.offsets[row]);
        }
        addresses
    }

    /// Address of the first value of a row.
    #[inline]
    pub fn start(&self, row: usize) -> usize {
        self.starts[row]
    }

    /// Values of rows that are not in the solver's array.
    pub fn len_beside(&self) -> usize {
        self.end - self.main
    }
}

/// The rows while they are written.
pub struct InPlace<'a, const B: usize> {
    addresses: &'a RowAddresses<B>,
    main: &'a mut [f64],
    beside: &'a mut [f64],
    /// Rows not met yet.
    fresh: Vec<bool>,
    /// J of the term J ⊗ 1 that owned rows start from, and which of them it reaches.
    base: Option<(&'a BlockMatrix<1>, &'a [bool])>,
}

impl<'a, const B: usize> InPlace<'a, B> {
    /// `main`: the solver's values in own columns; `beside`: [`RowAddresses::len_beside`] of ours. All rows
    /// are taken to hold nothing yet.
    pub fn new(
        addresses: &'a RowAddresses<B>,
        main: &'a mut [f64],
        beside: &'a mut [f64],
        base: Option<(&'a BlockMatrix<1>, &'a [bool])>,
    ) -> Result<Self> {
        if main.len() != addresses.main || beside.len() != addresses.len_beside() {
            return Err(Error::Environment(format!(
                "the solver stores {} values where the system has {}",
                main.len(),
                addresses.main
            )));
        }
        let fresh = vec![true; addresses.starts.len()];
        Ok(InPlace { addresses, main, beside, fresh, base })
    }

    /// The same rows, already assembled.
    pub fn filled(
        addresses: &'a RowAddresses<B>,
        main: &'a mut [f64],
        beside: &'a mut [f64],
    ) -> Result<Self> {
        let mut rows = Self::new(addresses, main, beside, None)?;
        rows.fresh.clear();
        Ok(rows)
    }

    /// Clears those from row `first` on that nothing was added to.
    pub fn finish(&mut self, pattern: &Pattern, first: usize) {
        for row in first..self.fresh.len() {
            self.touch(pattern, row);
        }
    }

    #[cold]
    #[inline(never)]
    fn add_base(&mut self, pattern: &Pattern, row: usize, base: &BlockMatrix<1>) {
        add_scalar_row(base, pattern, row, self);
    }

    /// Copies the rows of the border into the solver's arrays; `other` holds the values in
    /// columns of other ranks.
    pub fn hand_over(&mut self, other: &mut [f64]) -> Result<()> {
        if other.len() != self.addresses.other {
            return Err(Error::Environment(format!(
                "the solver stores {} values in columns of other ranks where the system has {}",
                other.len(),
                self.addresses.other
            )));
        }
        for border in &self.addresses.border {
            let [left, own, width] =
                [border.left, border.own, border.width].map(|n| n as usize * B);
            let start = self.addresses.starts[border.row as usize] - self.addresses.main;
            for i in 0..B {
                let source = &self.beside[start + i * width..start + (i + 1) * width];
                let inside = border.inside + i * own;
                self.main[inside..inside + own].copy_from_slice(&source[left..left + own]);
                let outside = border.outside + i * (width - own);
                other[outside..outside + left].copy_from_slice(&source[..left]);
                other[outside + left..outside + width - own].copy_from_slice(&source[left + own..]);
            }
        }
        Ok(())
    }
}

impl<const B: usize> BlockRows<B> for InPlace<'_, B> {
    #[inline(always)]
    fn start(&self, _: &Pattern, row: usize) -> usize {
        self.addresses.starts[row]
    }

    #[inline(always)]
    fn values(&mut self, start: usize, length: usize) -> &mut [f64] {
        let main = self.main.len();
        if start < main {
            &mut self.main[start..start + length]
        } else {
            &mut self.beside[start - main..start - main + length]
        }
    }

    #[inline(always)]
    fn touch(&mut self, pattern: &Pattern, row: usize) {
        if !std::mem::replace(&mut self.fresh[row], false) {
            return;
        }
        let width = pattern.offsets[row + 1] - pattern.offsets[row];
        let (start, length) = (self.addresses.starts[row], B * B * width);
        // Rows are mostly met in their order.
        if let Some(ahead) = self.main.get(start + AHEAD * length..start + (AHEAD + 1) * length) {
            prefetch(ahead);
        }
        self.values(start, length).fill(0.0);
        if let Some((base, reaches)) = self.base
            && reaches.get(row) == Some(&true)
        {
            self.add_base(pattern, row, base);
        }
    }

    fn ghosts(&self, _: &Pattern) -> &[f64] {
        &self.beside[self.addresses.ghosts - self.addresses.main..]
    }
}
