//! Distributed matrix in compressed rows (AIJ): pattern fixed at creation, values replaced whole.
//!
//! On more than one rank PETSc stores each row in two matrices: the columns this rank owns and
//! the others. With columns sorted, a row of ours is left part + own part + right part, so an
//! update is three block copies per row into PETSc's own arrays.

use std::marker::PhantomData;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicU64, Ordering};

use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{AsRaw, CommunicatorCollectives};

use super::check::{agree, bool_of, petsc, require_running};
use super::object::owned;
use super::sys;
use super::vector::DETERMINE;
use super::vector::{Index, Vector, index};
use crate::error::{Error, Result};

/// Owner of a PETSc `Mat`, square, with as many columns as rows on each rank.
#[derive(Debug)]
pub struct Matrix {
    raw: sys::Mat,
    /// Distinguishes matrices over the process: solvers drop what they built for another one.
    id: u64,
    rows: usize,
    block_size: usize,
    row_offsets: Vec<usize>,
    /// Per row: entries left of the own columns, and entries in them. Empty on one rank.
    split: Vec<(u32, u32)>,
    symmetric: Option<bool>,
    spd: Option<bool>,
}

static NEXT_ID: AtomicU64 = AtomicU64::new(1);

impl Matrix {
    /// Collective. Builds the matrix from this rank's rows (possibly none): row r holds
    /// `columns[row_offsets[r]..row_offsets[r + 1]]`, global and ascending, with `values`.
    /// `rows_local` is a multiple of `block_size`; ranks own consecutive rows in rank order.
    ///
    /// Errors, the same on every rank: more rows than an index can count, offsets or
    /// columns out of order or range.
    pub fn from_csr(
        comm: &SimpleCommunicator,
        block_size: usize,
        rows_local: usize,
        row_offsets: &[Index],
        columns: &[Index],
        values: &[f64],
    ) -> Result<Self> {
        let given = check_values(columns, values);
        agree(comm, given)?;
        let mut matrix = Self::zeros(comm, block_size, rows_local, row_offsets, columns)?;
        matrix.update(values)?;
        Ok(matrix)
    }

    /// [`Self::from_csr`] with values that are all zero.
    pub fn zeros(
        comm: &SimpleCommunicator,
        block_size: usize,
        rows_local: usize,
        row_offsets: &[Index],
        columns: &[Index],
    ) -> Result<Self> {
        require_running()?;
        let mut below = 0u64;
        let mut all = 0u64;
        let mine = rows_local as u64;
        comm.scan_into(&mine, &mut below, SystemOperation::sum());
        comm.all_reduce_into(&mine, &mut all, SystemOperation::sum());
        let first = (below - mine) as usize;
        let own = first..first + rows_local;
        agree(
            comm,
            index(all as usize)
                .map(drop)
                .and_then(|()| check_rows(block_size, &own, all, row_offsets, columns)),
        )?;

        let (n, block) = (index(rows_local)?, index(block_size)?);
        let mut matrix = Matrix {
            raw: null_mut(),
            id: NEXT_ID.fetch_add(1, Ordering::Relaxed),
            rows: rows_local,
            block_size,
            row_offsets: row_offsets.iter().map(|&k| k as usize).collect(),
            split: Vec::new(),
            symmetric: None,
            spd: None,
        };
        petsc!(MatCreate(comm.as_raw(), &mut matrix.raw))?;
        petsc!(MatSetSizes(matrix.raw, n, n, DETERMINE, DETERMINE))?;
        petsc!(MatSetBlockSize(matrix.raw, block))?;
        petsc!(MatSetType(matrix.raw, sys::MATAIJ.as_ptr().cast()))?;
        matrix.set_pattern(columns, own)?;
        // With these two the later assemblies need no communication.
        petsc!(MatSetOption(matrix.raw, sys::MAT_NO_OFF_PROC_ENTRIES, sys::PETSC_TRUE))?;
        petsc!(MatSetOption(matrix.raw, sys::MAT_NEW_NONZERO_LOCATIONS, sys::PETSC_FALSE))?;
        {
            let (mut inside, outside) = matrix.storage()?;
            inside.fill(0.0);
            outside.into_iter().for_each(|mut outside| outside.fill(0.0));
        }
        matrix.changed()?;
        matrix.check_split()?;
        Ok(matrix)
    }

    /// Hands PETSc the columns as they will be stored: entered row by row they would be searched
    /// for and sorted once more. `own`: columns of this rank.
    fn set_pattern(&mut self, columns: &[Index], own: std::ops::Range<usize>) -> Result<()> {
        let rows = || self.row_offsets.windows(2).map(|row| &columns[row[0]..row[1]]);
        let split: Vec<(u32, u32)> = rows()
            .map(|columns| {
                let left = columns.partition_point(|&c| (c as usize) < own.start);
                let end = columns.partition_point(|&c| (c as usize) < own.end);
                (left as u32, (end - left) as u32)
            })
            .collect();
        let inside: Vec<Index> = split.iter().map(|split| split.1 as Index).collect();
        let outside: Vec<Index> =
            rows().zip(&inside).map(|(columns, inside)| columns.len() as Index - inside).collect();
        // Each of the two does nothing on a matrix of the other type.
        petsc!(MatSeqAIJSetPreallocation(self.raw, 0, inside.as_ptr()))?;
        petsc!(MatMPIAIJSetPreallocation(self.raw, 0, inside.as_ptr(), 0, outside.as_ptr()))?;
        match self.parts()? {
            // PETSc copies the numbers, whatever its signature says.
            None => petsc!(MatSeqAIJSetColumnIndices(self.raw, columns.as_ptr().cast_mut())),
            Some((diagonal, other)) => {
                let (mut here, mut elsewhere) = (Vec::new(), Vec::new());
                for (columns, &(left, count)) in rows().zip(&split) {
                    let (left, rest) = columns.split_at(left as usize);
                    let (inside, right) = rest.split_at(count as usize);
                    here.extend(inside.iter().map(|&c| c - own.start as Index));
                    elsewhere.extend_from_slice(left);
                    elsewhere.extend_from_slice(right);
                }
                petsc!(MatSeqAIJSetColumnIndices(diagonal, here.as_mut_ptr()))?;
                petsc!(MatSeqAIJSetColumnIndices(other, elsewhere.as_mut_ptr()))?;
                self.split = split;
                Ok(())
            }
        }
    }

    /// Whether PETSc's parallel format holds the two parts of the rows as they were given.
    fn check_split(&self) -> Result<()> {
        let Some((diagonal, other)) = self.parts()? else { return Ok(()) };
        let inside: usize = self.split.iter().map(|s| s.1 as usize).sum();
        if stored(diagonal)? != inside || stored(other)? != self.entries_local() - inside {
            return Err(Error::Environment(
                "PETSc stored a matrix with another pattern than the one it was given".into(),
            ));
        }
        Ok(())
    }

    /// The two sequential matrices of the parallel format; `None` on one rank.
    fn parts(&self) -> Result<Option<(sys::Mat, sys::Mat)>> {
        let mut parallel = sys::PETSC_FALSE;
        let kind = sys::MATMPIAIJ.as_ptr().cast();
        petsc!(PetscObjectTypeCompare(self.raw.cast(), kind, &mut parallel))?;
        if parallel == sys::PETSC_FALSE {
            return Ok(None);
        }
        let (mut diagonal, mut other, mut map) = (null_mut(), null_mut(), std::ptr::null());
        petsc!(MatMPIAIJGetSeqAIJ(self.raw, &mut diagonal, &mut other, &mut map))?;
        Ok(Some((diagonal, other)))
    }

    /// Replaces all values, in the order of `from_csr`; solvers see the change. Collective, but
    /// without communication.
    pub fn update(&mut self, values: &[f64]) -> Result<()> {
        let total = self.row_offsets.last().copied().unwrap_or(0);
        if values.len() != total {
            return Err(Error::Environment(format!(
                "{} values for a matrix of {total} entries",
                values.len()
            )));
        }
        match self.parts()? {
            None => Entries::of(self.raw)?.copy_from_slice(values),
            Some((diagonal, other)) => {
                let (mut inside, mut outside) = (Entries::of(diagonal)?, Entries::of(other)?);
                let (mut i, mut o) = (0, 0);
                for (row, &(left, own)) in self.row_offsets.windows(2).zip(&self.split) {
                    let (a, b) = (row[0] + left as usize, row[0] + (left + own) as usize);
                    inside[i..i + (b - a)].copy_from_slice(&values[a..b]);
                    i += b - a;
                    outside[o..o + (a - row[0])].copy_from_slice(&values[row[0]..a]);
                    o += a - row[0];
                    outside[o..o + (row[1] - b)].copy_from_slice(&values[b..row[1]]);
                    o += row[1] - b;
                }
            }
        }
        self.changed()
    }

    /// The stored values, to be written in place: row by row those in own columns, and those in
    /// the columns of other ranks (`None` on one rank), ascending. To be followed by
    /// [`Self::changed`].
    pub fn storage(&mut self) -> Result<(Entries<'_>, Option<Entries<'_>>)> {
        Ok(match self.parts()? {
            None => (Entries::of(self.raw)?, None),
            Some((diagonal, other)) => (Entries::of(diagonal)?, Some(Entries::of(other)?)),
        })
    }

    /// Makes solvers see what was written in place. Collective, but without communication.
    pub fn changed(&mut self) -> Result<()> {
        petsc!(MatAssemblyBegin(self.raw, sys::MAT_FINAL_ASSEMBLY))?;
        petsc!(MatAssemblyEnd(self.raw, sys::MAT_FINAL_ASSEMBLY))?;
        self.declare_symmetry()
    }

    /// Tells solvers that A = A^T (or that it is not); holds over later updates.
    pub fn set_symmetric(&mut self, symmetric: bool) -> Result<()> {
        self.symmetric = Some(symmetric);
        self.declare_symmetry()
    }

    /// Tells solvers that A is symmetric positive definite: Cholesky and CG may be used.
    pub fn set_spd(&mut self, spd: bool) -> Result<()> {
        self.spd = Some(spd);
        self.declare_symmetry()
    }

    /// PETSc forgets both at an assembly.
    fn declare_symmetry(&mut self) -> Result<()> {
        if let Some(symmetric) = self.symmetric {
            petsc!(MatSetOption(self.raw, sys::MAT_SYMMETRIC, bool_of(symmetric)))?;
        }
        if let Some(spd) = self.spd {
            petsc!(MatSetOption(self.raw, sys::MAT_SPD, bool_of(spd)))?;
        }
        Ok(())
    }

    /// Gives multigrid the rigid-body motions (3 in 2D, 6 in 3D) of the nodes behind the rows.
    /// `coordinates`: this rank's nodes, `block_size` values each, as many values as rows.
    pub fn set_rigid_body_near_null_space(&mut self, coordinates: &[f64]) -> Result<()> {
        if coordinates.len() != self.rows || !(2..=3).contains(&self.block_size) {
            return Err(Error::Environment(format!(
                "rigid-body modes need 2 or 3 coordinates per node: {} values for {} rows in \
                 blocks of {}",
                coordinates.len(),
                self.rows,
                self.block_size
            )));
        }
        let mut positions = self.vector()?;
        positions.values_mut()?.copy_from_slice(coordinates);
        let mut modes = petsc!(MatNullSpaceCreateRigidBody(positions.raw()) -> null_mut())?;
        petsc!(MatSetNearNullSpace(self.raw, modes))?;
        petsc!(MatNullSpaceDestroy(&mut modes))
    }

    /// y = A x.
    pub fn mult(&self, x: &Vector, y: &mut Vector) -> Result<()> {
        petsc!(MatMult(self.raw, x.raw(), y.raw()))
    }

    /// Zero vector with the layout of the rows.
    pub fn vector(&self) -> Result<Vector> {
        let left = petsc!(MatCreateVecs(self.raw, null_mut()) -> null_mut())?;
        Vector::own(left, self.rows)
    }

    /// Rows on this rank.
    pub fn rows_local(&self) -> usize {
        self.rows
    }

    /// Rows on all ranks.
    pub fn rows_all(&self) -> Result<usize> {
        let mut rows = 0;
        petsc!(MatGetSize(self.raw, &mut rows, null_mut()))?;
        Ok(rows as usize)
    }

    /// Entries on this rank.
    pub fn entries_local(&self) -> usize {
        self.row_offsets.last().copied().unwrap_or(0)
    }

    /// A number that grows with every change of the values.
    pub(crate) fn state(&self) -> Result<u64> {
        let state = petsc!(PetscObjectStateGet(self.raw.cast()) -> 0)?;
        Ok(state as u64)
    }

    pub(crate) fn raw(&self) -> sys::Mat {
        self.raw
    }

    pub(crate) fn id(&self) -> u64 {
        self.id
    }
}

owned!(Matrix);

/// The array of stored values of a sequential matrix, to be overwritten while the [`Matrix`] that
/// holds it is borrowed.
pub struct Entries<'a> {
    raw: sys::Mat,
    pointer: *mut f64,
    count: usize,
    owner: PhantomData<&'a mut Matrix>,
}

impl Entries<'_> {
    fn of(raw: sys::Mat) -> Result<Self> {
        let count = stored(raw)?;
        let pointer = petsc!(MatSeqAIJGetArray(raw) -> null_mut())?;
        Ok(Entries { raw, pointer, count, owner: PhantomData })
    }
}

impl std::ops::Deref for Entries<'_> {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        if self.count == 0 {
            return &[];
        }
        // SAFETY: PETSc stores `count` values there, compact after assembly.
        unsafe { std::slice::from_raw_parts(self.pointer, self.count) }
    }
}

impl std::ops::DerefMut for Entries<'_> {
    fn deref_mut(&mut self) -> &mut [f64] {
        if self.count == 0 {
            return &mut [];
        }
        // SAFETY: as above, and this guard is the array's only user.
        unsafe { std::slice::from_raw_parts_mut(self.pointer, self.count) }
    }
}

impl Drop for Entries<'_> {
    fn drop(&mut self) {
        // SAFETY: returns what `of` took, and marks the matrix as changed.
        unsafe { sys::MatSeqAIJRestoreArray(self.raw, &mut self.pointer) };
    }
}

/// Entries stored by a sequential matrix.
fn stored(matrix: sys::Mat) -> Result<usize> {
    let mut info = std::mem::MaybeUninit::<sys::MatInfo>::zeroed();
    petsc!(MatGetInfo(matrix, sys::MAT_LOCAL, info.as_mut_ptr()))?;
    // SAFETY: plain numbers, zeroed and then filled by PETSc.
    Ok(unsafe { info.assume_init() }.nz_used as usize)
}

fn check_values(columns: &[Index], values: &[f64]) -> Result<()> {
    if values.len() == columns.len() {
        return Ok(());
    }
    Err(Error::Environment(format!(
        "matrix pattern: {} columns, but {} values",
        columns.len(),
        values.len()
    )))
}

fn check_rows(
    block_size: usize,
    own: &std::ops::Range<usize>,
    rows_global: u64,
    row_offsets: &[Index],
    columns: &[Index],
) -> Result<()> {
    let fail = |what: String| Err(Error::Environment(format!("matrix pattern: {what}")));
    let rows = own.len();
    if block_size == 0 || !rows.is_multiple_of(block_size) {
        return fail(format!("{rows} rows are not whole blocks of {block_size}"));
    }
    if row_offsets.len() != rows + 1 || row_offsets[0] != 0 {
        return fail(format!("{} row offsets for {rows} rows, from 0", row_offsets.len()));
    }
    if row_offsets[rows] as usize != columns.len() {
        return fail(format!(
            "offsets end at {}, but there are {} columns",
            row_offsets[rows],
            columns.len()
        ));
    }
    for (r, row) in row_offsets.windows(2).enumerate() {
        let Some(columns) = columns.get(row[0] as usize..row[1] as usize) else {
            return fail(format!("the offsets of row {} descend", own.start + r));
        };
        if !columns.windows(2).all(|c| c[0] < c[1])
            || columns.first().is_some_and(|&c| c < 0)
            || columns.last().is_some_and(|&c| c as u64 >= rows_global)
        {
            return fail(format!(
                "the columns of row {} do not ascend within 0..{rows_global}",
                own.start + r
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_patterns_are_named() {
        let text = |offsets: &[Index], columns: &[Index]| {
            check_rows(1, &(4..6), 8, offsets, columns).map_err(|e| e.to_string())
        };
        assert!(text(&[0, 2, 3], &[1, 7, 0]).is_ok());
        assert!(text(&[0, 2, 3], &[7, 1, 0]).unwrap_err().contains("row 4"));
        assert!(text(&[0, 2, 3], &[1, 7, 8]).unwrap_err().contains("row 5"));
        assert!(text(&[0, 3, 1], &[1, 7, 8]).unwrap_err().contains("offsets end at 1"));
        assert!(text(&[0, 1], &[1]).unwrap_err().contains("2 row offsets for 2 rows"));
    }
}
