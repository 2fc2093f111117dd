//! A_c = P^T A P: the coarse operator in its owners' rows, and the coarse nodes behind it.

use crate::error::Result;
use crate::parallel::{HaloPlan, World, exchange};
use crate::petsc::Index;
use crate::tensor::fused::{self, Block, add_product, add_transposed_product};

use super::aggregate::Aggregates;
use super::level::{self, BlockCsr, Nodes, Rows};
use super::owners::Owners;
use super::prolongator::Prolongator;

/// The next level.
pub struct Coarse<const C: usize> {
    pub nodes: Nodes,
    pub rows: BlockCsr<C>,
}

/// Coarse nodes seen by the fine ones of this rank: owned ones first, then ghosts, ascending.
struct Seen {
    first: Index,
    owned: usize,
    ghosts: Vec<Index>,
}

impl Seen {
    fn new(owners: &Owners, mut ghosts: Vec<Index>) -> Self {
        let (first, owned) = (owners.owned().start as Index, owners.owned().len());
        ghosts.retain(|&number| !(first..first + owned as Index).contains(&number));
        ghosts.sort_unstable();
        ghosts.dedup();
        Seen { first, owned, ghosts }
    }

    fn len(&self) -> usize {
        self.owned + self.ghosts.len()
    }

    /// Place of a global number that is known to be there.
    #[inline(always)]
    fn place(&self, number: Index) -> usize {
        level::place(self.first, self.owned, &self.ghosts, number)
    }

    fn number(&self, place: usize) -> Index {
        if place < self.owned {
            self.first + place as Index
        } else {
            self.ghosts[place - self.owned]
        }
    }
}

/// Rows that grow while blocks are added to them.
struct Sums<const C: usize> {
    /// Per row: columns, ascending, and where their blocks are.
    rows: Vec<Vec<(u32, u32)>>,
    blocks: Vec<Block<C, C>>,
}

impl<const C: usize> Sums<C> {
    #[inline(always)]
    fn block(&mut self, row: usize, column: u32) -> &mut Block<C, C> {
        let entries = &mut self.rows[row];
        let place = match entries.binary_search_by_key(&column, |entry| entry.0) {
            Ok(place) => entries[place].1,
            Err(place) => {
                let new = self.blocks.len() as u32;
                entries.insert(place, (column, new));
                self.blocks.push([[0.0; C]; C]);
                new
            }
        };
        &mut self.blocks[place as usize]
    }
}

/// Multiplies the coarse operator out. Collective.
pub fn coarse_operator<const K: usize, const C: usize>(
    world: &World,
    nodes: &Nodes,
    rows: &impl Rows<K>,
    prolongator: &Prolongator<K, C>,
    aggregates: &Aggregates,
) -> Result<Coarse<C>> {
    let owners = Owners::of(world, aggregates);
    let seen = Seen::new(&owners, prolongator.columns.clone());
    let mut sums = Sums { rows: vec![Vec::new(); seen.len()], blocks: Vec::new() };
    multiply(nodes.owned, rows, prolongator, &seen, &mut sums);
    let received = hand_over(world, &owners, &seen, &sums)?;

    // Columns that come with other ranks' contributions, and those of the transfer.
    let mut ghosts: Vec<Index> = Vec::new();
    let own_rows = sums.rows[..seen.owned].iter().flatten();
    ghosts.extend(own_rows.map(|&(column, _)| seen.number(column as usize)));
    ghosts.extend_from_slice(&prolongator.columns[..prolongator.offsets[nodes.owned]]);
    let each = || received.iter().flat_map(|(_, words)| words.chunks_exact(2 + C * C));
    ghosts.extend(each().map(|entry| entry[1] as Index));
    let known = Seen::new(&owners, ghosts);
    let place: Vec<u32> =
        (0..seen.len()).map(|place| known.place(seen.number(place)) as u32).collect();
    sums.rows.truncate(seen.owned);
    for entries in &mut sums.rows {
        entries.iter_mut().for_each(|(column, _)| *column = place[*column as usize]);
        entries.sort_unstable();
    }
    for entry in each() {
        let (row, column) = (known.place(entry[0] as Index), known.place(entry[1] as Index));
        let block = sums.block(row, column as u32);
        for (sum, value) in block.iter_mut().flatten().zip(&entry[2..]) {
            *sum += value;
        }
    }
    let mut coarse = BlockCsr { offsets: vec![0], columns: Vec::new(), values: Vec::new() };
    for entries in &sums.rows {
        coarse.columns.extend(entries.iter().map(|&(column, _)| column));
        coarse.values.extend(entries.iter().map(|&(_, place)| sums.blocks[place as usize]));
        coarse.offsets.push(coarse.columns.len());
    }
    Ok(Coarse { nodes: coarse_nodes(world, nodes, aggregates, &owners, &known)?, rows: coarse })
}

/// Row by row of the fine level: (A P)_i, then P_i^T (A P)_i into the coarse rows.
fn multiply<const K: usize, const C: usize>(
    owned: usize,
    rows: &impl Rows<K>,
    prolongator: &Prolongator<K, C>,
    seen: &Seen,
    sums: &mut Sums<C>,
) {
    #[cfg(target_arch = "x86_64")]
    if fused::has_avx2() {
        // SAFETY: the processor has just said that it knows the instructions.
        return unsafe { multiply_avx2(owned, rows, prolongator, seen, sums) };
    }
    multiply_in::<K, C, false>(owned, rows, prolongator, seen, sums);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn multiply_avx2<const K: usize, const C: usize>(
    owned: usize,
    rows: &impl Rows<K>,
    prolongator: &Prolongator<K, C>,
    seen: &Seen,
    sums: &mut Sums<C>,
) {
    multiply_in::<K, C, true>(owned, rows, prolongator, seen, sums);
}

#[inline(always)]
fn multiply_in<const K: usize, const C: usize, const FUSED: bool>(
    owned: usize,
    rows: &impl Rows<K>,
    prolongator: &Prolongator<K, C>,
    seen: &Seen,
    sums: &mut Sums<C>,
) {
    const NONE: u32 = u32::MAX;
    let places: Vec<u32> =
        prolongator.columns.iter().map(|&number| seen.place(number) as u32).collect();
    let mut slot = vec![NONE; seen.len()];
    let (mut columns, mut products): (Vec<u32>, Vec<Block<K, C>>) = (Vec::new(), Vec::new());
    for row in 0..owned {
        let range = prolongator.offsets[row]..prolongator.offsets[row + 1];
        if range.is_empty() {
            continue;
        }
        rows.visit(row, |column, block| {
            let range = prolongator.offsets[column]..prolongator.offsets[column + 1];
            for (&place, value) in places[range.clone()].iter().zip(&prolongator.values[range]) {
                let mut at = slot[place as usize];
                if at == NONE {
                    at = columns.len() as u32;
                    slot[place as usize] = at;
                    columns.push(place);
                    products.push([[0.0; C]; K]);
                }
                add_product::<K, K, C, FUSED>(&mut products[at as usize], block, value);
            }
        });
        for (&place, left) in places[range.clone()].iter().zip(&prolongator.values[range]) {
            for (&column, right) in columns.iter().zip(&products) {
                add_transposed_product::<K, C, C, FUSED>(
                    sums.block(place as usize, column),
                    left,
                    right,
                );
            }
        }
        columns.iter().for_each(|&place| slot[place as usize] = NONE);
        columns.clear();
        products.clear();
    }
}

/// Contributions to other ranks' rows go to their owners: row, column and values.
fn hand_over<const C: usize>(
    world: &World,
    owners: &Owners,
    seen: &Seen,
    sums: &Sums<C>,
) -> Result<Vec<(usize, Vec<f64>)>> {
    let mut outgoing: Vec<(usize, Vec<f64>)> = Vec::new();
    for (row, entries) in sums.rows.iter().enumerate().skip(seen.owned) {
        let owner = owners.of_number(seen.number(row));
        if outgoing.last().is_none_or(|(rank, _)| *rank != owner) {
            outgoing.push((owner, Vec::new()));
        }
        let Some((_, words)) = outgoing.last_mut() else { continue };
        for &(column, place) in entries {
            words.extend([row, column as usize].map(|place| seen.number(place) as f64));
            words.extend(sums.blocks[place as usize].iter().flatten());
        }
    }
    exchange(world, outgoing)
}

fn coarse_nodes(
    world: &World,
    fine: &Nodes,
    aggregates: &Aggregates,
    owners: &Owners,
    known: &Seen,
) -> Result<Nodes> {
    let ghosts: Vec<(usize, usize)> =
        known.ghosts.iter().map(|&number| (owners.of_number(number), number as usize)).collect();
    let first = known.first as usize;
    let halo = HaloPlan::build(world, known.owned, &ghosts, |number| {
        number.checked_sub(first).filter(|&place| place < known.owned)
    })?;
    const VALUES: usize = 4;
    let mut values = owners.roots(world, fine, aggregates)?;
    values.resize(known.len() * VALUES, 0.0);
    halo.forward(world, &mut values, VALUES)?;
    Ok(Nodes {
        owned: known.owned,
        global: (0..known.len()).map(|place| known.number(place)).collect(),
        halo,
        key: values.iter().copied().step_by(VALUES).collect(),
        position: values.chunks_exact(VALUES).map(|v| [v[1], v[2], v[3]]).collect(),
        modes: fine.modes,
    })
}
