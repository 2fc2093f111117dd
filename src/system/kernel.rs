//! K_aibk += Σ_p g_aj A_ijkl g_bl V (Lagrangian eq. 27) for points that share their nodes: the
//! products of a batch of points are summed in registers, tile by tile, and go straight into
//! the sparse rows. The plain form is in `plain.rs`; a test compares the two.

use crate::mechanics::{Contribution, Expansion, Hoop};
use crate::tensor::fused::multiply_add;

use super::cell_rows::{CellNow, CellRows, Now};
use super::scatter::BlockRows;
use super::support_columns::ColumnRuns;

/// Rows of a tile: so many gradients share each load of a flux.
const TALL: usize = 4;
/// Columns of a tile.
const WIDE: usize = 8;
/// Half a tile, for the last columns.
const NARROW: usize = 4;
/// Fluxes of a batch fill at most this many values: they should stay in the nearest cache.
const BATCH_VALUES: usize = 4096;

/// Points of one group, gathered until there are enough for one pass over the group's rows.
#[derive(Default)]
pub(crate) struct Batch {
    nodes: usize,
    /// Columns of a row, filled up to whole tiles.
    stride: usize,
    /// Lines of a point: one per axis, with axisymmetry one for the hoop. With F-bar cells have as many.
    depth: usize,
    lines: usize,
    /// First line of the point pushed last.
    first: usize,
    /// A batch with so many lines is full.
    capacity: usize,
    /// Lines that there is memory for: with F-bar cells may follow the last point of a full batch.
    allocated: usize,
    /// g_aj: line (p, j), column a.
    gradients: Vec<f64>,
    /// A_ijkl g_bl V: plane i, line (p, j), column (b, k).
    flux: Vec<f64>,
    /// One strip of finished rows.
    strip: Vec<f64>,
}

impl Batch {
    /// Starts a group of points on `nodes` nodes; `rings`: each has a hoop, too; `cells`: lines of cells come
    /// between those of points.
    #[inline(always)]
    pub fn start<const D: usize>(&mut self, nodes: usize, rings: bool, cells: bool) {
        self.nodes = nodes;
        self.stride = (nodes * D).next_multiple_of(NARROW);
        self.depth = D + usize::from(rings);
        self.lines = 0;
        let points = (BATCH_VALUES / (D * self.depth * self.stride)).max(1);
        self.capacity = points * self.depth;
        self.allocated = self.capacity + if cells { 2 * self.depth } else { 0 };
        // Columns beyond the last node are never read back; they only have to exist.
        grow(&mut self.gradients, self.allocated * nodes);
        grow(&mut self.flux, self.allocated * D * self.stride);
        grow(&mut self.strip, TALL * self.stride);
    }

    pub fn is_full(&self) -> bool {
        self.lines >= self.capacity
    }

    pub fn is_empty(&self) -> bool {
        self.lines == 0
    }

    /// Adds a point with its gradients in the frame, (node, axis).
    #[inline(always)]
    pub fn push<const D: usize, const FUSED: bool>(
        &mut self,
        gradients: &[[f64; D]],
        contribution: &Contribution<D>,
    ) {
        let (nodes, stride) = (self.nodes, self.stride);
        let first = self.lines;
        self.first = first;
        self.lines += self.depth;
        for j in 0..D {
            let row = &mut self.gradients[(first + j) * nodes..(first + j + 1) * nodes];
            for (target, gradient) in row.iter_mut().zip(gradients) {
                *target = gradient[j];
            }
        }
        let plane = self.allocated * stride;
        for i in 0..D {
            for j in 0..D {
                let tangent =
                    contribution.tangent[i][j].map(|row| row.map(|v| v * contribution.volume));
                let start = i * plane + (first + j) * stride;
                let row = &mut self.flux[start..start + nodes * D];
                for (target, gradient) in row.chunks_exact_mut(D).zip(gradients) {
                    for k in 0..D {
                        let mut sum = tangent[k][0] * gradient[0];
                        for l in 1..D {
                            sum = multiply_add::<FUSED>(tangent[k][l], gradient[l], sum);
                        }
                        target[k] = sum;
                    }
                }
            }
        }
    }

    /// Adds (Q g_a) x e_b of F-bar to the point pushed last. `share` has its Q; `expansion`: e of the nodes;
    /// `volume` in m3.
    #[inline(always)]
    pub fn push_share<const D: usize, const FUSED: bool>(
        &mut self,
        expansion: &[[f64; D]],
        share: &Expansion<D>,
        volume: f64,
    ) {
        let plane = self.allocated * self.stride;
        let expansion = expansion.as_flattened();
        let mut add = |i: usize, line: usize, modulus: f64| {
            let start = i * plane + (self.first + line) * self.stride;
            let flux = &mut self.flux[start..start + expansion.len()];
            for (target, row) in flux.iter_mut().zip(expansion) {
                *target = multiply_add::<FUSED>(modulus, *row, *target);
            }
        };
        for i in 0..D {
            for j in 0..D {
                add(i, j, share.rate[i][j] * volume);
            }
        }
        if self.depth > D {
            add(0, D, share.hoop_rate * volume);
        }
    }

    /// Adds e_a x Σ V (q g_b + kappa/n^2 e_b) of cells ([`CellRows::change`]), and - Σ V pi/n g_0b x g_0a where
    /// they are one.
    #[inline(always)]
    pub fn push_cells<const D: usize, const FUSED: bool>(&mut self, cells: &CellRows<D>) {
        let (stride, first, rings) = (self.stride, self.lines, self.depth > D);
        let plane = self.allocated * stride;
        self.push_rows::<D>(cells.gradients.iter().copied().enumerate());
        let trace = if cells.is_single() { cells.trace } else { 0.0 };
        for (b, (row, hoop)) in cells.gradients.iter().enumerate() {
            let change = cells.change::<FUSED>(b);
            let turn = row.map(|g| trace * g);
            for i in 0..D {
                let at = |j: usize| i * plane + (first + j) * stride + b * D;
                for j in 0..D {
                    let target = &mut self.flux[at(j)..][..D];
                    for k in 0..D {
                        let same = if i == j { change[k] } else { 0.0 };
                        target[k] = if j == k { same - turn[i] } else { same };
                    }
                }
                if rings {
                    let target = &mut self.flux[at(D)..][..D];
                    target.fill(0.0);
                    if i == 0 {
                        target.copy_from_slice(&change);
                        target[0] -= trace * hoop;
                    }
                }
            }
        }
    }

    /// Adds Σ V v_c pi/n (e_ca x e_cb - g_cb x g_ca) of one cell of several.
    #[inline(always)]
    pub fn push_cell<const D: usize>(&mut self, cell: &CellNow<D>) {
        let (nodes, stride, first) = (self.nodes, self.stride, self.lines);
        let plane = self.allocated * stride;
        self.gradients[first * nodes..(first + self.depth) * nodes].fill(0.0);
        self.push_rows::<D>(cell.nodes().map(|(place, row)| (place, *row)));
        for i in 0..D {
            let lines = i * plane + first * stride;
            self.flux[lines..lines + self.depth * stride].fill(0.0);
            for (b, (row, hoop)) in cell.nodes() {
                let turn = row.map(|g| cell.trace * g);
                let hoop = cell.trace * hoop;
                let mut expansion = turn;
                expansion[0] += hoop;
                self.flux[lines + i * stride + b * D..][..D].copy_from_slice(&expansion);
                for j in 0..D {
                    self.flux[lines + j * stride + b * D + j] -= turn[i];
                }
                if i == 0 && self.depth > D {
                    let target = &mut self.flux[lines + D * stride + b * D..][..D];
                    target.copy_from_slice(&expansion);
                    target[0] -= hoop;
                }
            }
        }
    }

    /// Takes lines for the rows of nodes, with the hoops' of rings.
    #[inline(always)]
    fn push_rows<const D: usize>(&mut self, rows: impl Iterator<Item = (usize, Now<D>)>) {
        let first = self.lines * self.nodes;
        self.lines += self.depth;
        for (place, (row, hoop)) in rows {
            for j in 0..D {
                self.gradients[first + j * self.nodes + place] = row[j];
            }
            if self.depth > D {
                self.gradients[first + D * self.nodes + place] = hoop;
            }
        }
    }

    /// Adds the hoop of the point pushed last ([`Hoop`]), `rows` and `gradients` in the frame, `volume`
    /// in m3.
    #[inline(always)]
    pub fn push_hoop<const D: usize, const FUSED: bool>(
        &mut self,
        rows: &[f64],
        gradients: &[[f64; D]],
        hoop: &Hoop<D>,
        volume: f64,
    ) {
        let (nodes, stride) = (self.nodes, self.stride);
        let first = self.first;
        let plane = self.allocated * stride;
        self.gradients[(first + D) * nodes..(first + D + 1) * nodes].copy_from_slice(rows);
        // What a hoop strain does to the section.
        for i in 0..D {
            for j in 0..D {
                let start = i * plane + (first + j) * stride;
                let flux = &mut self.flux[start..start + nodes * D];
                let modulus = hoop.from[i][j] * volume;
                for (target, row) in flux.chunks_exact_mut(D).zip(rows) {
                    target[0] = multiply_add::<FUSED>(modulus, *row, target[0]);
                }
            }
        }
        // The hoop's stress acts along the radius alone.
        let onto = hoop.onto.map(|row| row.map(|v| v * volume));
        for i in 0..D {
            let start = i * plane + (first + D) * stride;
            let flux = &mut self.flux[start..start + nodes * D];
            if i > 0 {
                flux.fill(0.0);
                continue;
            }
            for ((target, gradient), row) in flux.chunks_exact_mut(D).zip(gradients).zip(rows) {
                for k in 0..D {
                    let mut sum = onto[k][0] * gradient[0];
                    for l in 1..D {
                        sum = multiply_add::<FUSED>(onto[k][l], gradient[l], sum);
                    }
                    target[k] = sum;
                }
                target[0] = multiply_add::<FUSED>(hoop.own * volume, *row, target[0]);
            }
        }
    }

    /// Adds the batch into the sparse rows and empties it. `rows` gives the address of each
    /// node's first value and the width of its scalar rows in values.
    #[inline(always)]
    pub fn flush<const D: usize, const FUSED: bool, R: BlockRows<D>>(
        &mut self,
        place: ColumnRuns<'_>,
        rows: &[(usize, usize)],
        values: &mut R,
    ) {
        if self.lines == D {
            return self.flush_one::<D, FUSED, R>(place, rows, values);
        }
        let depth = self.lines;
        self.lines = 0;
        let plane = self.allocated * self.stride;
        for i in 0..D {
            let flux = &self.flux[i * plane..i * plane + depth * self.stride];
            let mut a = 0;
            while a < self.nodes {
                let tall = (self.nodes - a).min(TALL);
                let gradients = &self.gradients[a..];
                let (n, stride, strip) = (self.nodes, self.stride, &mut self.strip[..]);
                match tall {
                    4 => fill::<4, FUSED>(depth, gradients, n, flux, stride, strip),
                    3 => fill::<3, FUSED>(depth, gradients, n, flux, stride, strip),
                    2 => fill::<2, FUSED>(depth, gradients, n, flux, stride, strip),
                    _ => fill::<1, FUSED>(depth, gradients, n, flux, stride, strip),
                }
                for row in 0..tall {
                    let node = a + row;
                    let (start, width) = rows[node];
                    let target = values.values(start + i * width, width);
                    let source = &self.strip[row * self.stride..row * self.stride + n * D];
                    let runs = n / place.run;
                    let positions = &place.positions[node * runs..(node + 1) * runs];
                    match (D, place.run) {
                        (2, 3) => add_runs::<D, 6>(target, source, positions),
                        (3, 3) => add_runs::<D, 9>(target, source, positions),
                        (2, 2) => add_runs::<D, 4>(target, source, positions),
                        (3, 2) => add_runs::<D, 6>(target, source, positions),
                        _ => add_runs::<D, D>(target, source, positions),
                    }
                }
                a += tall;
            }
        }
    }
}

impl Batch {
    /// The same for a single point: so few products are not worth a strip.
    #[inline(always)]
    fn flush_one<const D: usize, const FUSED: bool, R: BlockRows<D>>(
        &mut self,
        place: ColumnRuns<'_>,
        rows: &[(usize, usize)],
        values: &mut R,
    ) {
        self.lines = 0;
        match (D, place.run) {
            (2, 3) => self.products::<D, 6, FUSED, R>(place, rows, values),
            (3, 3) => self.products::<D, 9, FUSED, R>(place, rows, values),
            (2, 2) => self.products::<D, 4, FUSED, R>(place, rows, values),
            (3, 2) => self.products::<D, 6, FUSED, R>(place, rows, values),
            _ => self.products::<D, D, FUSED, R>(place, rows, values),
        }
    }

    #[inline(always)]
    fn products<const D: usize, const LENGTH: usize, const FUSED: bool, R: BlockRows<D>>(
        &self,
        place: ColumnRuns<'_>,
        rows: &[(usize, usize)],
        values: &mut R,
    ) {
        let (n, stride) = (self.nodes, self.stride);
        let runs = n / place.run;
        let plane = self.allocated * stride;
        for (node, &(start, width)) in rows.iter().enumerate() {
            let positions = &place.positions[node * runs..(node + 1) * runs];
            let factors: [f64; D] = std::array::from_fn(|j| self.gradients[j * n + node]);
            for i in 0..D {
                let target = values.values(start + i * width, width);
                let flux: [&[f64]; D] = std::array::from_fn(|j| {
                    &self.flux[i * plane + j * stride..i * plane + j * stride + n * D]
                });
                for (run, &position) in positions.iter().enumerate() {
                    let mut sums = [0.0; LENGTH];
                    for j in 0..D {
                        let source: &[f64; LENGTH] = first(&flux[j][run * LENGTH..]);
                        for (sum, value) in sums.iter_mut().zip(source) {
                            *sum = multiply_add::<FUSED>(factors[j], *value, *sum);
                        }
                    }
                    let target: &mut [f64; LENGTH] = target[usize::from(position) * D..]
                        .first_chunk_mut()
                        .expect("a run lies within its row");
                    // Loaded as a whole: entry by entry the compiler must fear an overlap.
                    let mut total = *target;
                    for (total, sum) in total.iter_mut().zip(sums) {
                        *total += sum;
                    }
                    *target = total;
                }
            }
        }
    }
}

/// strip = gradients^T flux for `TALL` rows: gradients are `depth` rows of `nodes`, fluxes
/// `depth` rows of `stride`.
#[inline(always)]
fn fill<const ROWS: usize, const FUSED: bool>(
    depth: usize,
    gradients: &[f64],
    nodes: usize,
    flux: &[f64],
    stride: usize,
    strip: &mut [f64],
) {
    let mut column = 0;
    while column + WIDE <= stride {
        tile::<ROWS, WIDE, FUSED>(
            depth,
            gradients,
            nodes,
            &flux[column..],
            stride,
            &mut strip[column..],
        );
        column += WIDE;
    }
    if column < stride {
        tile::<ROWS, NARROW, FUSED>(
            depth,
            gradients,
            nodes,
            &flux[column..],
            stride,
            &mut strip[column..],
        );
    }
}

#[inline(always)]
fn tile<const ROWS: usize, const COLUMNS: usize, const FUSED: bool>(
    depth: usize,
    gradients: &[f64],
    nodes: usize,
    flux: &[f64],
    stride: usize,
    strip: &mut [f64],
) {
    let mut sums = [[0.0; COLUMNS]; ROWS];
    for k in 0..depth {
        let source: &[f64; COLUMNS] = first(&flux[k * stride..]);
        let factors: &[f64; ROWS] = first(&gradients[k * nodes..]);
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                sums[row][column] =
                    multiply_add::<FUSED>(factors[row], source[column], sums[row][column]);
            }
        }
    }
    for (row, sums) in sums.iter().enumerate() {
        strip[row * stride..row * stride + COLUMNS].copy_from_slice(sums);
    }
}

/// Adds `source`, runs of `LENGTH` values, at the columns (of `D` values) `positions`.
#[inline(always)]
pub(crate) fn add_runs<const D: usize, const LENGTH: usize>(
    target: &mut [f64],
    source: &[f64],
    positions: &[u16],
) {
    for (run, &position) in source.chunks_exact(LENGTH).zip(positions) {
        let start = usize::from(position) * D;
        let target: &mut [f64; LENGTH] =
            target[start..].first_chunk_mut().expect("a run lies within its row");
        // Loaded as wholes: entry by entry the compiler must fear that the slices overlap.
        let (run, mut sum): (&[f64; LENGTH], _) = (first(run), *target);
        for (sum, add) in sum.iter_mut().zip(*run) {
            *sum += add;
        }
        *target = sum;
    }
}

#[inline(always)]
fn first<const N: usize>(values: &[f64]) -> &[f64; N] {
    values.first_chunk().expect("rows are filled up to whole tiles")
}

fn grow(values: &mut Vec<f64>, length: usize) {
    if values.len() < length {
        values.resize(length, 0.0);
    }
}
