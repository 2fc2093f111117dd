//! Version 2.2: every element carries its physical group.

use std::collections::hash_map::Entry;

use rustc_hash::FxHashMap;

use super::scanner::{Scanner, SyntaxError};
use super::{Block, Kind};

/// `number x y z`; with parameters then the dimension and number of the geometry and its one or
/// two parameters.
pub(super) fn nodes(
    scanner: &mut Scanner,
    parametric: bool,
    nodes: &mut Vec<(u64, [f64; 3])>,
) -> Result<(), SyntaxError> {
    let count = scanner.text(|s| s.size())?;
    scanner.line();
    nodes.reserve((count as usize).min(scanner.left() / 8));
    for _ in 0..count {
        nodes.push((positive(scanner, "node")?, scanner.reals()?));
        if parametric {
            let dimension = scanner.int()?;
            scanner.int()?;
            let parameters = if matches!(dimension, 1 | 2) { dimension } else { 0 };
            for _ in 0..parameters {
                scanner.real()?;
            }
        }
    }
    Ok(())
}

/// Text: `number type tags tag.. node..`; binary: runs of elements of one type and number of tags.
/// The first tag is the physical group, 0 for none.
pub(super) fn elements(scanner: &mut Scanner, blocks: &mut Vec<Block>) -> Result<(), SyntaxError> {
    let count = scanner.text(|s| s.size())?;
    scanner.line();
    let mut read = 0;
    while read < count {
        let (label, kind, tags, run) = if scanner.is_text() {
            let label = positive(scanner, "element")?;
            (Some(label), super::version4::kind(scanner)?, scanner.int()?, 1)
        } else {
            let kind = super::version4::kind(scanner)?;
            let run = scanner.int()?;
            (None, kind, scanner.int()?, run)
        };
        if run < 1 || run as u64 > count - read {
            return Err(SyntaxError(format!(
                "a run of {run} elements does not fit to {count} in all"
            )));
        }
        for _ in 0..run {
            let label = label.map_or_else(|| positive(scanner, "element"), Ok)?;
            let group = if tags > 0 { scanner.int()?.abs() } else { 0 };
            scanner.skip_ints((tags - 1).max(0) as u64)?;
            let mut nodes = Vec::with_capacity(kind.nodes);
            for _ in 0..kind.nodes {
                nodes.push(positive(scanner, "node")?);
            }
            let groups: &[i64] = if group == 0 { &[] } else { &[group] };
            push(blocks, kind, groups, label, &nodes);
        }
        read += run as u64;
    }
    Ok(())
}

fn positive(scanner: &mut Scanner, what: &str) -> Result<u64, SyntaxError> {
    let number = scanner.int()?;
    u64::try_from(number)
        .map_err(|_| SyntaxError(format!("a {what} cannot have the number {number}")))
}

/// An element of several physical groups is listed once for each of them, under numbers of its own.
/// What remains is its entry in the first of them, with all the groups. Entries within one group
/// are left: the check of the mesh names them.
pub(super) fn join_repeated(blocks: &mut Vec<Block>) {
    let key = |kind: Kind, nodes: &[u64]| {
        // A negative group turns its elements round.
        let mut sorted = nodes.to_vec();
        sorted.sort_unstable();
        (kind.number, sorted)
    };
    let mut groups: FxHashMap<(i64, Vec<u64>), Vec<i64>> = FxHashMap::default();
    let mut repeated = false;
    for block in blocks.iter() {
        for nodes in block.nodes.chunks_exact(block.kind.nodes) {
            match groups.entry(key(block.kind, nodes)) {
                Entry::Vacant(entry) => drop(entry.insert(block.groups.clone())),
                Entry::Occupied(mut entry) => {
                    repeated |= entry.get() != &block.groups;
                    let known = entry.get_mut();
                    known.extend(
                        block
                            .groups
                            .iter()
                            .filter(|g| !known.contains(g))
                            .copied()
                            .collect::<Vec<_>>(),
                    );
                }
            }
        }
    }
    if !repeated {
        return;
    }
    let mut joined: Vec<Block> = Vec::new();
    for block in blocks.iter() {
        for (&label, nodes) in block.labels.iter().zip(block.nodes.chunks_exact(block.kind.nodes)) {
            let all = &groups[&key(block.kind, nodes)];
            if block.groups.first() == all.first() {
                push(&mut joined, block.kind, all, label, nodes);
            }
        }
    }
    *blocks = joined;
}

/// Adds an element to the last block, or to a new one where it is of another kind.
fn push(blocks: &mut Vec<Block>, kind: Kind, groups: &[i64], label: u64, nodes: &[u64]) {
    match blocks.last_mut() {
        Some(last) if last.kind == kind && last.groups == groups => {
            last.labels.push(label);
            last.nodes.extend(nodes);
        }
        _ => blocks.push(Block {
            kind,
            groups: groups.to_vec(),
            labels: vec![label],
            nodes: nodes.to_vec(),
        }),
    }
}
