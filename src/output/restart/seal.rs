//! The seal at the end of a checkpoint: a few bytes behind the HDF5 content with its
//! length, its format and its checksum. It is tested before HDF5 sees the file, so that no damage
//! ever reaches a parser, and it is only there when the file was finished.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

use mpi::collective::{CommunicatorCollectives, SystemOperation};
use mpi::topology::{Communicator, SimpleCommunicator};
use mpi::traits::Root;

use crate::error::Result;
use crate::output::agreement::{all_agree, on_root};
use crate::output::whole_file::{Partial, cannot_read, cannot_write};

const MAGIC: &[u8; 16] = b"mpm-par-restart\n";
/// Magic, format and length and checksum of the content, checksum of the seal itself.
const SEAL_BYTES: usize = 16 + 4 * 8;
/// Bytes that one rank reads at a time; part of the format, as the checksum is per block.
const BLOCK: usize = 1 << 20;

/// Why a file cannot be taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Flaw {
    /// Cut short, altered, or not a checkpoint: the text says which.
    Damaged(String),
    /// Written in a format of this number, which this program does not know.
    Newer(u64),
}

/// A running checksum of 64-bit words.
#[derive(Debug, Clone, Copy)]
pub struct Checksum(u64);

impl Checksum {
    /// The sum of no words; other starts give other sums.
    pub fn new(start: u64) -> Self {
        Checksum(start ^ 0x9e37_79b9_7f4a_7c15)
    }

    /// Folds the 128-bit product: every bit of the word reaches every bit of the sum.
    pub fn add(&mut self, word: u64) {
        let product = u128::from(self.0 ^ word) * 0xd6e8_feb8_6659_fd93_u128;
        self.0 = ((product >> 64) as u64 ^ product as u64).wrapping_add(0xa076_1d64_78bd_642f);
    }

    /// Bytes by eights, the rest filled up with zeros, then their number.
    pub fn add_bytes(&mut self, bytes: &[u8]) {
        for word in bytes.chunks(8) {
            let mut padded = [0; 8];
            padded[..word.len()].copy_from_slice(word);
            self.add(u64::from_le_bytes(padded));
        }
        self.add(bytes.len() as u64);
    }

    /// The sum.
    pub fn finish(mut self) -> u64 {
        self.add(0);
        self.0
    }
}

/// Checksum of a text.
pub fn checksum_of(text: &str) -> u64 {
    checksum_of_bytes(text.as_bytes())
}

/// Checksum of bytes.
pub fn checksum_of_bytes(bytes: &[u8]) -> u64 {
    let mut sum = Checksum::new(0);
    sum.add_bytes(bytes);
    sum.finish()
}

/// Sum over all ranks, modulo 2^64: the order of the terms does not matter.
pub fn wrapping_sum(comm: &SimpleCommunicator, own: u64) -> u64 {
    let mut all = 0;
    comm.all_reduce_into(&own, &mut all, SystemOperation::sum());
    all
}

/// Seals the finished file with a format number and brings it to the disk. Collective: the
/// ranks read the file back block by block.
pub fn seal(partial: &Partial, format: u64, comm: &SimpleCommunicator) -> Result<()> {
    let path = partial.path();
    let mut length = 0;
    on_root(comm, || {
        length = std::fs::metadata(path).map_err(|reason| cannot_read(path, &reason))?.len();
        Ok(())
    })?;
    comm.process_at_rank(0).broadcast_into(&mut length);
    let checksum = content_checksum(path, length, comm)?;
    on_root(comm, || {
        let write = || -> std::io::Result<()> {
            let mut file = OpenOptions::new().append(true).open(path)?;
            file.write_all(&seal_bytes(format, length, checksum))?;
            file.sync_all()
        };
        write().map_err(|reason| cannot_write(partial.name(), &reason))
    })
}

/// Tests a sealed file of format `known` or older; returns its format. Collective. Errors: the
/// file cannot be read.
pub fn test(
    path: &Path,
    known: u64,
    comm: &SimpleCommunicator,
) -> Result<std::result::Result<u64, Flaw>> {
    // What rank 0 reads at the end of the file: whether there is a seal, and its numbers.
    let mut found = [0_u64; 4];
    on_root(comm, || {
        found = read_seal(path).map_err(|reason| cannot_read(path, &reason))?;
        Ok(())
    })?;
    comm.process_at_rank(0).broadcast_into(&mut found[..]);
    let [sealed, format, length, checksum] = found;
    if sealed == 0 {
        let why = "it has no seal at its end: it was cut short, or is not a checkpoint";
        return Ok(Err(Flaw::Damaged(why.into())));
    }
    // A later format may seal its content in another way: ask for its number first.
    if format > known {
        return Ok(Err(Flaw::Newer(format)));
    }
    if content_checksum(path, length, comm)? != checksum {
        let why = "its content does not have the checksum of its seal";
        return Ok(Err(Flaw::Damaged(why.into())));
    }
    Ok(Ok(format))
}

/// True if the file ends in a whole seal that fits its length; its content is not tested.
pub fn is_sealed(path: &Path) -> bool {
    read_seal(path).is_ok_and(|found| found[0] == 1)
}

fn seal_bytes(format: u64, length: u64, checksum: u64) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    for number in [format, length, checksum] {
        bytes.extend(number.to_le_bytes());
    }
    let mut own = Checksum::new(1);
    own.add_bytes(&bytes);
    bytes.extend(own.finish().to_le_bytes());
    bytes
}

/// 1, format, length and checksum; zeros without a whole seal that fits the file.
fn read_seal(path: &Path) -> std::io::Result<[u64; 4]> {
    // Asked before: to open what is no file may take for ever.
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("it is not a file"));
    }
    let mut file = File::open(path)?;
    let size = file.metadata()?.len();
    let Some(length) = size.checked_sub(SEAL_BYTES as u64) else { return Ok([0; 4]) };
    let mut bytes = [0; SEAL_BYTES];
    file.seek(SeekFrom::Start(length))?;
    file.read_exact(&mut bytes)?;
    let number = |k: usize| {
        let start = MAGIC.len() + 8 * k;
        u64::from_le_bytes(bytes[start..start + 8].try_into().expect("eight bytes"))
    };
    let whole = bytes[..] == seal_bytes(number(0), number(1), number(2)) && number(1) == length;
    Ok(if whole { [1, number(0), number(1), number(2)] } else { [0; 4] })
}

/// Sum of the checksums of the blocks, dealt out to the ranks in turn.
fn content_checksum(path: &Path, length: u64, comm: &SimpleCommunicator) -> Result<u64> {
    let own = own_blocks(path, length, comm.rank() as u64, comm.size() as u64);
    let (own, outcome) = match own {
        Ok(sum) => (sum, Ok(())),
        Err(reason) => (0, Err(cannot_read(path, &reason))),
    };
    all_agree(comm, outcome)?;
    Ok(wrapping_sum(comm, own))
}

fn own_blocks(path: &Path, length: u64, rank: u64, ranks: u64) -> std::io::Result<u64> {
    let mut file = File::open(path)?;
    let mut buffer = vec![0; BLOCK];
    let mut sum = 0_u64;
    let blocks = length.div_ceil(BLOCK as u64);
    for block in (rank..blocks).step_by(ranks as usize) {
        let start = block * BLOCK as u64;
        let bytes = &mut buffer[..(length - start).min(BLOCK as u64) as usize];
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(bytes)?;
        let mut part = Checksum::new(block);
        part.add_bytes(bytes);
        sum = sum.wrapping_add(part.finish());
    }
    Ok(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_the_blocks_does_not_depend_on_who_reads_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("content");
        let bytes: Vec<u8> = (0..5 * BLOCK + 77).map(|k| (k * k % 251) as u8).collect();
        std::fs::write(&path, &bytes).unwrap();
        let sum = |ranks: u64| {
            (0..ranks)
                .map(|rank| own_blocks(&path, bytes.len() as u64, rank, ranks).unwrap())
                .fold(0, u64::wrapping_add)
        };
        assert_eq!(sum(1), sum(3));
        assert_eq!(sum(1), sum(64));
        // Blocks that change places are seen.
        let mut swapped = bytes.clone();
        let (head, tail) = swapped.split_at_mut(BLOCK);
        head.swap_with_slice(&mut tail[..BLOCK]);
        let before = sum(1);
        std::fs::write(&path, &swapped).unwrap();
        assert_ne!(sum(1), before);
    }

    #[test]
    fn a_single_bit_changes_the_sum() {
        let bytes = vec![0x5a_u8; 64];
        let of = |bytes: &[u8]| {
            let mut sum = Checksum::new(7);
            sum.add_bytes(bytes);
            sum.finish()
        };
        let mut seen = vec![of(&bytes)];
        for bit in 0..8 * bytes.len() {
            let mut other = bytes.clone();
            other[bit / 8] ^= 1 << (bit % 8);
            seen.push(of(&other));
        }
        seen.push(of(&bytes[..63]));
        let count = seen.len();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), count);
    }

    #[test]
    fn only_a_whole_seal_at_the_end_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sealed");
        let content = b"some content".to_vec();
        let sealed = [content.clone(), seal_bytes(3, content.len() as u64, 42)].concat();
        let found = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            read_seal(&path).unwrap()
        };
        assert_eq!(found(&sealed), [1, 3, content.len() as u64, 42]);
        assert_eq!(found(&sealed[..sealed.len() - 1]), [0; 4]);
        assert_eq!(found(&sealed[1..]), [0; 4]);
        assert_eq!(found(&[sealed.clone(), vec![0]].concat()), [0; 4]);
        assert_eq!(found(&content), [0; 4]);
        let mut altered = sealed;
        let place = altered.len() - 20;
        altered[place] ^= 1;
        assert_eq!(found(&altered), [0; 4]);
    }
}
