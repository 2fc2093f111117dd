//! Versions 4.0 and 4.1: elements lie on entities of the geometry, which carry the physical groups.

use rustc_hash::FxHashMap;

use super::scanner::{Scanner, SyntaxError};
use super::{Block, Kind, Version};

/// Physical groups of each entity (dimension, number).
type Groups = FxHashMap<(i64, i64), Vec<i64>>;

/// Points, curves, surfaces and volumes: `number box groups group.. parts part..`. The box of a
/// point is the point itself since 4.1.
///
/// `partitioned`: the parts into which a partition has cut the entities; they keep the groups. Before
/// the box then stand the parent's dimension and number, and the parts that the piece belongs to.
pub(super) fn entities(
    scanner: &mut Scanner,
    version: Version,
    partitioned: bool,
    groups: &mut Groups,
) -> Result<(), SyntaxError> {
    if partitioned {
        scanner.size()?;
        let ghosts = scanner.size()?;
        scanner.skip_ints(2 * ghosts)?;
    }
    let counts = [scanner.size()?, scanner.size()?, scanner.size()?, scanner.size()?];
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let number = scanner.int()?;
            if partitioned {
                scanner.skip_ints(2)?;
                let parts = scanner.size()?;
                scanner.skip_ints(parts)?;
            }
            if dimension == 0 && version == Version::V41 {
                scanner.reals::<3>()?;
            } else {
                scanner.reals::<6>()?;
            }
            let mut own = Vec::new();
            for _ in 0..scanner.size()? {
                // The sign is the direction of the entity in the group.
                own.push(scanner.int()?.abs());
            }
            if dimension > 0 {
                let parts = scanner.size()?;
                scanner.skip_ints(parts)?;
            }
            groups.insert((dimension as i64, number), own);
        }
    }
    Ok(())
}

/// Dimension and number of a block's entity: 4.0 has them the other way round.
fn block_entity(scanner: &mut Scanner, version: Version) -> Result<(i64, i64), SyntaxError> {
    let (a, b) = (scanner.int()?, scanner.int()?);
    Ok(if version == Version::V40 { (b, a) } else { (a, b) })
}

/// Blocks of nodes: in 4.1 all numbers, then all places, each with the parameters of the entity
/// where the block has them; in 4.0 number and place together.
pub(super) fn nodes(
    scanner: &mut Scanner,
    version: Version,
    nodes: &mut Vec<(u64, [f64; 3])>,
) -> Result<(), SyntaxError> {
    let blocks = scanner.size()?;
    let all = scanner.size()?;
    if version == Version::V41 {
        // The smallest and the largest number.
        scanner.size()?;
        scanner.size()?;
    }
    nodes.reserve((all as usize).min(scanner.left() / 8));
    for _ in 0..blocks {
        let (dimension, _) = block_entity(scanner, version)?;
        let parameters = if scanner.int()? == 0 { 0 } else { dimension.clamp(0, 3) };
        let count = scanner.size()?;
        let first = nodes.len();
        if version == Version::V41 {
            for _ in 0..count {
                nodes.push((scanner.size()?, [0.0; 3]));
            }
        }
        for k in 0..count as usize {
            if version == Version::V40 {
                nodes.push((scanner.size()?, [0.0; 3]));
            }
            nodes[first + k].1 = scanner.reals()?;
            for _ in 0..parameters {
                scanner.real()?;
            }
        }
    }
    if nodes.len() as u64 != all {
        return Err(SyntaxError(format!(
            "{all} nodes are announced, and {} of them are there",
            nodes.len()
        )));
    }
    Ok(())
}

/// Blocks of elements: `number node..`, all of one type and on one entity.
pub(super) fn elements(
    scanner: &mut Scanner,
    version: Version,
    groups: &Groups,
    blocks: &mut Vec<Block>,
) -> Result<(), SyntaxError> {
    let count = scanner.size()?;
    scanner.size()?;
    if version == Version::V41 {
        scanner.size()?;
        scanner.size()?;
    }
    for _ in 0..count {
        let entity = block_entity(scanner, version)?;
        let kind = kind(scanner)?;
        let elements = scanner.size()?;
        let groups = groups.get(&entity).cloned().unwrap_or_default();
        let mut block = Block { kind, groups, labels: Vec::new(), nodes: Vec::new() };
        let room = (elements as usize).min(scanner.left());
        block.labels.reserve(room);
        block.nodes.reserve(room);
        for _ in 0..elements {
            block.labels.push(scanner.size()?);
            for _ in 0..kind.nodes {
                block.nodes.push(scanner.size()?);
            }
        }
        if elements > 0 {
            blocks.push(block);
        }
    }
    Ok(())
}

/// The type of an element.
pub(super) fn kind(scanner: &mut Scanner) -> Result<Kind, SyntaxError> {
    let number = scanner.int()?;
    Kind::from_number(number)
        .ok_or_else(|| SyntaxError(format!("no element type has the number {number}")))
}
