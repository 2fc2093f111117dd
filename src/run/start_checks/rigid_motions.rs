//! Rigid motions of pieces of the material, and which of them nothing resists.
//!
//! A direction in which a place is held is a row: what each rigid motion moves that place along it. The motions that
//! all rows of a piece annihilate are free. Places are scaled by the extent of all points.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::deck::schema::AXES;
use crate::error::Result;
use crate::parallel::{World, exchange};
use crate::points::Points;
use crate::system::model::Model;

/// Share of the largest eigenvalue below which a motion counts as free. The rows are exact but
/// for rounding; a held line of a thousandth of the body's length leaves 1e-6.
const FREE: f64 = 1e-12;

/// Middle and largest extent of all points.
pub struct Extent<const D: usize> {
    middle: [f64; D],
    length: f64,
}

impl<const D: usize> Extent<D> {
    /// Collective.
    pub fn of(world: &World, points: &Points<D>) -> Self {
        let end = |axis: usize, sign: f64| {
            let own = points.position.iter().map(|x| sign * x[axis]).fold(f64::MIN, f64::max);
            sign * world.max(own)
        };
        let high: [f64; D] = std::array::from_fn(|a| end(a, 1.0));
        let low: [f64; D] = std::array::from_fn(|a| end(a, -1.0));
        let length = (0..D).map(|a| high[a] - low[a]).fold(0.0, f64::max);
        let middle = std::array::from_fn(|a| 0.5 * (high[a] + low[a]));
        Extent { middle, length: if length > 0.0 { length } else { 1.0 } }
    }

    fn scaled(&self, place: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|a| (place[a] - self.middle[a]) / self.length)
    }

    /// Component `component` of every rigid motion at a place: translations, then turns in the planes of
    /// axes (0, 1), (1, 2), (2, 0).
    pub fn component(&self, place: &[f64; D], component: usize) -> Vec<f64> {
        let x = self.scaled(place);
        let mut row = vec![0.0; D];
        row[component] = 1.0;
        for turn in 0..D * (D - 1) / 2 {
            let (a, b) = (turn, (turn + 1) % D);
            row.push(match component {
                c if c == a => -x[b],
                c if c == b => x[a],
                _ => 0.0,
            });
        }
        row
    }

    /// What each rigid motion moves a place along a direction.
    pub fn along(&self, place: &[f64; D], direction: &[f64; D]) -> Vec<f64> {
        let rows = (0..D).map(|i| (direction[i], self.component(place, i)));
        rows.fold(vec![0.0; count(D)], |mut sum, (share, row)| {
            sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += share * value);
            sum
        })
    }
}

/// Number of rigid motions.
fn count(dimension: usize) -> usize {
    dimension + dimension * (dimension - 1) / 2
}

/// Σ row row^T of each piece: it maps the motions that all rows annihilate to nothing.
pub struct Restraints<const D: usize>(BTreeMap<u64, Vec<f64>>);

impl<const D: usize> Restraints<D> {
    /// Nothing is held.
    pub fn nowhere() -> Self {
        Restraints(BTreeMap::new())
    }

    /// A piece of which nothing may be held.
    pub fn enter(&mut self, piece: u64) {
        self.of(piece);
    }

    fn of(&mut self, piece: u64) -> &mut Vec<f64> {
        self.0.entry(piece).or_insert_with(|| vec![0.0; count(D) * count(D)])
    }

    /// Adds a direction in which a piece is held.
    pub fn add(&mut self, piece: u64, row: &[f64]) {
        let gram = self.of(piece);
        for (line, a) in gram.chunks_exact_mut(count(D)).zip(row) {
            line.iter_mut().zip(row).for_each(|(sum, b)| *sum += a * b);
        }
    }

    /// The first piece that can move rigidly, and how, in words: in any motion, or along one of the `pulled` axes.
    /// Each piece is judged by the rank that owns its first node. Collective.
    pub fn free(
        self,
        world: &World,
        model: &Model<D>,
        pulled: Option<[bool; D]>,
    ) -> Result<Option<(u64, String)>> {
        let motions = count(D);
        let free = self.of_all_ranks(world, model)?.into_iter().find_map(|(piece, gram)| {
            if let Some(pulled) = pulled {
                let axis = (0..D).find(|&a| pulled[a] && gram[a * motions + a] == 0.0)?;
                return Some((piece, along_axis(axis)));
            }
            let spectrum = DMatrix::from_vec(motions, motions, gram).symmetric_eigen();
            let largest = spectrum.eigenvalues.max().max(1e-300);
            let free = (0..motions).find(|&k| spectrum.eigenvalues[k] <= FREE * largest)?;
            Some((piece, name(spectrum.eigenvectors.column(free).iter().copied(), D)))
        });
        let first = world.min_u64(free.as_ref().map_or(u64::MAX, |(piece, _)| *piece));
        let motion = free.filter(|(piece, _)| *piece == first).map(|(_, motion)| motion);
        Ok(world.first_message(motion).map(|motion| (first, motion)))
    }

    /// The sums over all ranks of the pieces whose first node is owned here, ascending.
    fn of_all_ranks(self, world: &World, model: &Model<D>) -> Result<BTreeMap<u64, Vec<f64>>> {
        let mut outgoing: BTreeMap<usize, Vec<u64>> = BTreeMap::new();
        for (piece, gram) in self.0 {
            let owner = model.partition.owner_of_node(&model.grid, piece as usize);
            let list = outgoing.entry(owner).or_default();
            list.push(piece);
            list.extend(gram.iter().map(|value| value.to_bits()));
        }
        let mut sums: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
        for (_, words) in exchange(world, outgoing.into_iter().collect())? {
            for record in words.chunks_exact(1 + count(D) * count(D)) {
                let sum = sums.entry(record[0]).or_insert_with(|| vec![0.0; record.len() - 1]);
                for (sum, &word) in sum.iter_mut().zip(&record[1..]) {
                    *sum += f64::from_bits(word);
                }
            }
        }
        Ok(sums)
    }
}

fn along_axis(axis: usize) -> String {
    format!("move along {}", AXES[axis])
}

/// The motion in words.
fn name(motion: impl Iterator<Item = f64>, dimension: usize) -> String {
    let size: Vec<f64> = motion.map(f64::abs).collect();
    let largest = (0..size.len()).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    if largest < dimension {
        along_axis(largest)
    } else if dimension == 2 {
        "turn".into()
    } else {
        format!("turn about {}", AXES[(largest - dimension + 2) % 3])
    }
}
