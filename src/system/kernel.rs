//! K_aibk += Σ_p g_aj A_ijkl g_bl V (Lagrangian eq. 27) for points that share their nodes: the
//! products of a batch of points are summed in registers, tile by tile, and go straight into
//! the sparse rows. The plain form is in `plain.rs`; a test compares the two.

use crate::mechanics::dilation::{Dilation, Rows};
use crate::mechanics::{Contribution, Hoop};
use crate::tensor::fused::multiply_add;

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
    /// Rows of a point: one per axis, with axisymmetry one for the hoop, and with F-bar as many of its cells.
    depth: usize,
    /// Rows of the point itself.
    own: usize,
    points: usize,
    capacity: usize,
    /// g_aj: row (p, j), column a.
    gradients: Vec<f64>,
    /// A_ijkl g_bl V: plane i, row (p, j), column (b, k).
    flux: Vec<f64>,
    /// One strip of finished rows.
    strip: Vec<f64>,
}

impl Batch {
    /// Starts a group of points on `nodes` nodes; `rings`: each has a hoop, too; `cells`: each has rows of
    /// its cells.
    #[inline(always)]
    pub fn start<const D: usize>(&mut self, nodes: usize, rings: bool, cells: bool) {
        self.nodes = nodes;
        self.stride = (nodes * D).next_multiple_of(NARROW);
        self.own = D + usize::from(rings);
        self.depth = self.own * (1 + usize::from(cells));
        self.points = 0;
        self.capacity = (BATCH_VALUES / (D * self.depth * self.stride)).max(1);
        // Columns beyond the last node are never read back; they only have to exist.
        grow(&mut self.gradients, self.capacity * self.depth * nodes);
        grow(&mut self.flux, self.capacity * D * self.depth * self.stride);
        grow(&mut self.strip, TALL * self.stride);
    }

    pub fn is_full(&self) -> bool {
        self.points == self.capacity
    }

    pub fn is_empty(&self) -> bool {
        self.points == 0
    }

    /// Adds a point with its gradients in the frame, (node, axis).
    #[inline(always)]
    pub fn push<const D: usize, const FUSED: bool>(
        &mut self,
        gradients: &[[f64; D]],
        contribution: &Contribution<D>,
    ) {
        let (nodes, stride) = (self.nodes, self.stride);
        let first = self.points * self.depth;
        self.points += 1;
        for j in 0..D {
            let row = &mut self.gradients[(first + j) * nodes..(first + j + 1) * nodes];
            for (target, gradient) in row.iter_mut().zip(gradients) {
                *target = gradient[j];
            }
        }
        let plane = self.capacity * self.depth * stride;
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

    /// Adds what F-bar does ([`Dilation`]) to the point pushed last. `frame`: gradients and hoop rows in the
    /// frame, the latter empty but for rings; `rows`: those of the current state; `volume` in m3.
    #[inline(always)]
    pub fn push_dilation<const D: usize, const FUSED: bool>(
        &mut self,
        (gradients, hoops): (&[[f64; D]], &[f64]),
        rows: &[Rows<D>],
        dilation: &Dilation<D>,
        volume: f64,
    ) {
        let (nodes, stride) = (self.nodes, self.stride);
        let first = (self.points - 1) * self.depth;
        let common = first + self.own;
        let plane = self.capacity * self.depth * stride;
        for j in 0..D {
            let line = &mut self.gradients[(common + j) * nodes..(common + j + 1) * nodes];
            line.iter_mut().zip(rows).for_each(|(target, row)| *target = row.common.0[j]);
        }
        let rings = !hoops.is_empty();
        if rings {
            let line = &mut self.gradients[(common + D) * nodes..(common + D + 1) * nodes];
            line.iter_mut().zip(rows).for_each(|(target, row)| *target = row.common.1);
        }
        let (moduli, back, share) = (&dilation.moduli, &dilation.back, dilation.share);
        let pressure = moduli.trace * share * volume;
        for (b, row) in rows.iter().enumerate() {
            let hoop = hoops.get(b).copied().unwrap_or(0.0);
            let change = dilation.change_of_trace((&gradients[b], hoop), &row.swelling);
            let change = change.map(|c| c * share * volume);
            let swelling = row.swelling.map(|r| r * volume);
            for i in 0..D {
                let at = |line: usize| i * plane + line * stride + b * D;
                for j in 0..D {
                    let turn = pressure * row.own.0[i];
                    let own = &mut self.flux[at(first + j)..][..D];
                    for k in 0..D {
                        let mut sum = moduli.rate[i][j] * swelling[k] - back.0[j][i] * change[k];
                        sum = multiply_add::<FUSED>(turn, back.0[j][k], sum);
                        own[k] += sum;
                    }
                    let cells = &mut self.flux[at(common + j)..][..D];
                    cells.fill(0.0);
                    if i == j {
                        cells.copy_from_slice(&change);
                    }
                    cells[j] -= pressure * row.common.0[i];
                }
                if !rings {
                    continue;
                }
                let cells = at(common + D);
                if i > 0 {
                    self.flux[cells..cells + D].fill(0.0);
                    continue;
                }
                let own = &mut self.flux[at(first + D)..][..D];
                for k in 0..D {
                    own[k] += moduli.hoop_rate * swelling[k] - back.1 * change[k];
                }
                own[0] += pressure * back.1 * row.own.1;
                let cells = &mut self.flux[cells..cells + D];
                cells.copy_from_slice(&change);
                cells[0] -= pressure * row.common.1;
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
        let first = (self.points - 1) * self.depth;
        let plane = self.capacity * self.depth * stride;
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
        if self.points == 1 && self.depth == D {
            return self.flush_one::<D, FUSED, R>(place, rows, values);
        }
        let depth = self.points * self.depth;
        self.points = 0;
        let plane = self.capacity * self.depth * self.stride;
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
        self.points = 0;
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
        let plane = self.capacity * D * stride;
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
