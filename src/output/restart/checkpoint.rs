//! `checkpoint-000010.h5`: everything a run needs to go on, on any number of ranks.
//!
//! | dataset | rows | content |
//! |---|---|---|
//! | `text.physics`, `text.resolved` | bytes | the problem, the deck with all defaults |
//! | `state.*` | named values | counters and totals of the time loop ([`RunState`]) |
//! | `rank_rows` | ranks | points of each rank that wrote it |
//! | `owners` | units | rank of each unit of the partition |
//! | `mesh_positions` | nodes | where a mesh has moved to |
//! | `points.id`, `points.body`, `points.FIELD` | points | rank after rank, in their order there |
//! | `text.state` | bodies | names of the state variables of each body's points, if any has some |
//! | `points.state` | points | their values, in that order |
//! | `text.slip`, `points.slip` | bodies, points | likewise of contacts with friction |
//! | `sums` | datasets | checksum of each dataset above, over its rows, from memory |
//!
//! Format 1 had no state variables, and the elastic strain b_e in place of b_e - 1: it is read too.
//!
//! On as many ranks as wrote it every rank gets its own points back in their order, and the
//! partition is the stored one: what follows is bit by bit the run without interruption.

use std::path::{Path, PathBuf};

use bytemuck::NoUninit;
use hdf5::H5Type;
use mpi::topology::{Communicator, SimpleCommunicator};

use super::run_state::RunState;
use super::seal::{self, Checksum, Flaw, checksum_of, wrapping_sum};
use crate::deck::physics::{Physics, difference, difference_from_format_1};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::output::agreement::{all_agree, on_root};
use crate::output::series::hdf5_reader::FileReader;
use crate::output::series::hdf5_writer::FileWriter;
use crate::output::whole_file::sync_names;
use crate::points::{Named, Points};

/// Number of the format written here; files of later formats are refused.
pub const FORMAT: u64 = 2;

/// What is written. Points and grid are those of this rank, the rest is the same on all.
pub struct Checkpoint<'a, const D: usize> {
    /// Finished steps.
    pub step: usize,
    /// [`crate::deck::physics::physics`] of the deck.
    pub physics: &'a str,
    pub resolved: &'a str,
    pub state: &'a RunState,
    pub points: &'a Points<D>,
    pub grid: &'a Grid<D>,
    /// Cells per side of the partition's bricks; `None` on a mesh.
    pub brick: Option<usize>,
    pub owners: &'a [u32],
}

/// What is read back.
pub struct Restored<const D: usize> {
    pub path: PathBuf,
    pub step: usize,
    /// Ranks that wrote it.
    pub ranks: usize,
    pub state: RunState,
    /// This rank's share: its own points if the number of ranks is the same, otherwise any.
    pub points: Points<D>,
    pub mesh_positions: Option<Vec<[f64; D]>>,
    pub brick: Option<usize>,
    pub owners: Vec<u32>,
}

impl<const D: usize> Checkpoint<'_, D> {
    /// Writes the file under another name, seals it, brings it to the disk and renames it.
    /// Collective.
    pub fn write(&self, path: &Path, comm: &SimpleCommunicator) -> Result<()> {
        let file = FileWriter::create(path, comm)?;
        file.write_number("step", &(self.step as u64))?;
        file.write_number("ranks", &(comm.size() as u64))?;
        file.write_number("dimension", &(D as u64))?;
        file.write_number("brick", &(self.brick.unwrap_or(0) as u64))?;
        file.write_number("counted", &u64::from(self.points.counted))?;
        let mut out = Writer { file, comm, sums: Vec::new() };

        out.text("text.physics", self.physics)?;
        out.text("text.resolved", self.resolved)?;
        let (count_names, counts, number_names, numbers) = self.state.lists();
        out.text("state.count_names", &count_names)?;
        out.whole("state.counts", &counts)?;
        out.text("state.number_names", &number_names)?;
        out.whole("state.numbers", &numbers)?;

        let points = self.points;
        out.rows("rank_rows", 1, &[points.len() as u64])?;
        let owners: Vec<u64> = self.owners.iter().map(|&rank| u64::from(rank)).collect();
        out.whole("owners", &owners)?;
        if let Grid::Mesh(mesh) = self.grid {
            let share = share(mesh.node_count(), comm);
            let own: Vec<f64> = share.flat_map(|node| mesh.node_position(node)).collect();
            out.rows("mesh_positions", D, &own)?;
        }
        out.rows("points.id", 1, &points.id)?;
        let body: Vec<u64> = points.body.iter().map(|&body| u64::from(body)).collect();
        out.rows("points.body", 1, &body)?;
        for (name, words) in Points::<D>::field_words() {
            if !points.stores(name) {
                continue;
            }
            let mut values = Vec::with_capacity(points.len() * words);
            for p in 0..points.len() {
                points.field_of(name, p, &mut values);
            }
            out.rows(&dataset_of(name), words, &values)?;
        }
        for (kind, named) in [("state", &points.state), ("slip", &points.slip)] {
            if named.stride() > 0 {
                let names: Vec<String> =
                    named.names().iter().map(|names| names.join(" ")).collect();
                out.text(&format!("text.{kind}"), &names.join("\n"))?;
                out.rows(&dataset_of(kind), named.stride(), &named.values)?;
            }
        }
        let Writer { file, sums, .. } = out;
        let own = if comm.rank() == 0 { &sums[..] } else { &[] };
        file.write_rows("sums", 2, &own.iter().flat_map(|&(n, s)| [n, s]).collect::<Vec<u64>>())?;

        let partial = file.close_unnamed()?;
        seal::seal(&partial, FORMAT, comm)?;
        on_root(comm, || {
            partial.give_name()?;
            if let Some(folder) = path.parent() {
                sync_names(folder);
            }
            Ok(())
        })
    }
}

/// Reads a checkpoint of the problem `physics`; whatever is wrong is a reason not to take this
/// file, and says nothing about others. Collective, the same outcome on all ranks.
pub fn read<const D: usize>(
    path: &Path,
    physics: &Physics,
    comm: &SimpleCommunicator,
) -> std::result::Result<Restored<D>, Refusal> {
    let format = match seal::test(path, FORMAT, comm) {
        Ok(Ok(format)) => format,
        Ok(Err(flaw)) => return Err(flaw.into()),
        Err(why) => return Err(Refusal::Unreadable(why.to_string())),
    };
    // Sealed, and yet not what was in memory when it was written.
    let damaged = |why: Error| Refusal::Damaged(why.to_string());
    let file = FileReader::open(path, comm).map_err(damaged)?;
    let sums = file.read_all::<u64>("sums").map_err(damaged)?;
    let sums = sums.chunks_exact(2).map(|s| (s[0], s[1])).collect();
    let input = Reader { file, comm, sums };
    let own = input.text("text.physics").map_err(damaged)?;
    let physics = physics.beside(&own);
    if own != physics {
        let found = match format {
            1 => difference_from_format_1(&own, physics),
            _ => Some(difference(&own, physics).unwrap_or_default()),
        };
        if let Some(found) = found {
            return Err(Refusal::Foreign(foreign(found)));
        }
    }
    content(&input, path).map_err(damaged)
}

/// Why a checkpoint is not taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// The system does not give it; the text names the file.
    Unreadable(String),
    Damaged(String),
    Newer(u64),
    /// Of another problem; the text says in what they differ.
    Foreign(String),
}

impl From<Flaw> for Refusal {
    fn from(flaw: Flaw) -> Self {
        match flaw {
            Flaw::Damaged(why) => Refusal::Damaged(why),
            Flaw::Newer(format) => Refusal::Newer(format),
        }
    }
}

impl Refusal {
    /// The sentence for the user.
    pub fn describe(&self, path: &Path) -> String {
        let path = path.display();
        match self {
            Refusal::Unreadable(why) => why.clone(),
            Refusal::Damaged(why) => format!("{path} is damaged and cannot be continued: {why}"),
            Refusal::Newer(format) => format!(
                "{path} was written by a newer version of the program (format {format}; this one \
                 reads up to {FORMAT})"
            ),
            Refusal::Foreign(why) => format!("{path} belongs to another problem: {why}"),
        }
    }
}

/// Why more steps are not always taken.
const EXTENDING: &str = "\n    why: loads, displacements and rotations that are totals over the whole \
    analysis would mean something else\n    try: the steps of the checkpoint; a dynamic run can be \
    extended where its motions and loads are formulas of t, without s";

/// In words; lines that are empty are of texts that differ in nothing but line ends.
fn foreign((theirs, ours): (String, String)) -> String {
    if theirs == ours {
        return "its deck differs".into();
    }
    let longer = theirs.starts_with("steps = ") || theirs.starts_with("duration = ");
    let why = if longer { EXTENDING } else { "" };
    format!("it was written with `{theirs}` where this deck has `{ours}`{why}")
}

fn content<const D: usize>(input: &Reader<'_>, path: &Path) -> Result<Restored<D>> {
    let number = |name: &str| input.file.read_number::<u64>(name).map(|n| n as usize);
    let (step, ranks, brick) = (number("step")?, number("ranks")?, number("brick")?);
    if number("dimension")? != D {
        return Err(Error::File(format!("{} is not {D}-dimensional", path.display())));
    }
    let state = RunState::from_lists(
        &input.text("state.count_names")?,
        &input.whole::<u64>("state.counts")?,
        &input.text("state.number_names")?,
        &input.whole::<f64>("state.numbers")?,
    );
    let owners = input.whole::<u64>("owners")?.into_iter().map(|rank| rank as u32).collect();
    let mesh_positions = if input.file.has("mesh_positions") {
        let flat = input.whole::<f64>("mesh_positions")?;
        Some(flat.chunks_exact(D).map(|x| std::array::from_fn(|axis| x[axis])).collect())
    } else {
        None
    };
    let rank_rows = input.whole::<u64>("rank_rows")?;
    let mut points = input.points(&rank_rows)?;
    // Earlier versions left numbers out.
    points.counted = number("counted").is_ok_and(|counted| counted == 1);
    let brick = (brick > 0).then_some(brick);
    let path = path.to_path_buf();
    Ok(Restored { path, step, ranks, state, points, mesh_positions, brick, owners })
}

/// Writes datasets and remembers their checksums.
struct Writer<'c> {
    file: FileWriter<'c>,
    comm: &'c SimpleCommunicator,
    /// (checksum of the name, checksum of the rows)
    sums: Vec<(u64, u64)>,
}

impl Writer<'_> {
    fn rows<T: Word>(&mut self, name: &str, columns: usize, values: &[T]) -> Result<()> {
        let first = self.file.first_row(values.len() / columns);
        let sum = wrapping_sum(self.comm, rows_sum(first, columns, values));
        self.sums.push((checksum_of(name), sum));
        self.file.write_rows(name, columns, values).map(drop)
    }

    /// What every rank has, written by the first.
    fn whole<T: Word>(&mut self, name: &str, values: &[T]) -> Result<()> {
        self.rows(name, 1, if self.comm.rank() == 0 { values } else { &[] })
    }

    fn text(&mut self, name: &str, text: &str) -> Result<()> {
        // Never empty: HDF5 would have nothing to store.
        self.whole(name, format!("{text}\n").as_bytes())
    }
}

/// Reads datasets and compares their checksums.
struct Reader<'c> {
    file: FileReader<'c>,
    comm: &'c SimpleCommunicator,
    sums: Vec<(u64, u64)>,
}

impl Reader<'_> {
    /// All rows on every rank.
    fn whole<T: Word>(&self, name: &str) -> Result<Vec<T>> {
        let columns = self.file.shape(name)?.1;
        let values = self.file.read_all::<T>(name)?;
        self.compare(name, rows_sum(0, columns, &values))?;
        Ok(values)
    }

    fn text(&self, name: &str) -> Result<String> {
        let bytes = self.whole::<u8>(name)?;
        String::from_utf8(bytes)
            .map(|text| text.strip_suffix('\n').unwrap_or(&text).to_string())
            .map_err(|_| Error::File(format!("its {name} is not text")))
    }

    fn rows<T: Word>(&self, name: &str, first: usize, rows: usize) -> Result<Vec<T>> {
        let columns = self.file.shape(name)?.1;
        let values = self.file.read_rows::<T>(name, first, rows)?;
        self.compare(name, wrapping_sum(self.comm, rows_sum(first, columns, &values)))?;
        Ok(values)
    }

    /// The same outcome on all ranks, as all have the same sums.
    fn compare(&self, name: &str, found: u64) -> Result<()> {
        let key = checksum_of(name);
        let good = self.sums.iter().any(|&(name, sum)| name == key && sum == found);
        all_agree(
            self.comm,
            if good {
                Ok(())
            } else {
                Err(Error::File(format!("its dataset {name} is not what was written")))
            },
        )
    }

    /// This rank's points: its own where as many ranks wrote the file, an equal share otherwise.
    fn points<const D: usize>(&self, rank_rows: &[u64]) -> Result<Points<D>> {
        let total = self.file.shape("points.id")?.0;
        let rank = self.comm.rank() as usize;
        let range = if rank_rows.len() == self.comm.size() as usize {
            let first = rank_rows[..rank].iter().sum::<u64>() as usize;
            first..first + rank_rows[rank] as usize
        } else {
            share(total, self.comm)
        };
        let (first, rows) = (range.start, range.len());
        let id = self.rows::<u64>("points.id", first, rows)?;
        let body = self.rows::<u64>("points.body", first, rows)?;
        let mut fields = Vec::new();
        let mut absent = Vec::new();
        for (field, words) in Points::<D>::field_words() {
            let mut name = dataset_of(field);
            if Points::<D>::is_optional(field) && !self.file.has(&name) {
                absent.push(field);
                fields.push((words, vec![0.0; words * rows]));
                continue;
            }
            // Format 1 stored b_e itself.
            let whole = dataset_of("elastic_left_cauchy_green");
            let of_whole = name == dataset_of("elastic_excess") && self.file.has(&whole);
            if of_whole {
                name = whole;
            }
            if !self.file.has(&name) || self.file.shape(&name)? != (total, words) {
                return Err(Error::File(format!(
                    "it holds no {name} of {words} numbers for {total} points: another version \
                     of the program wrote it"
                )));
            }
            let mut values = self.rows::<f64>(&name, first, rows)?;
            if of_whole {
                values
                    .chunks_exact_mut(9)
                    .for_each(|b| [0, 4, 8].iter().for_each(|&k| b[k] -= 1.0));
            }
            fields.push((words, values));
        }
        let has = |field: &str| !absent.contains(&field);
        let mut points = Points {
            affine: has("spread"),
            counts_anew: has("displacement_start"),
            ..Points::default()
        };
        let mut record = Vec::with_capacity(Points::<D>::base_words());
        for p in 0..rows {
            record.clear();
            record.push(f64::from_bits(id[p]));
            record.push(f64::from_bits(body[p]));
            for (words, values) in &fields {
                record.extend_from_slice(&values[p * words..(p + 1) * words]);
            }
            points.unpack(&record);
        }
        for (kind, named) in [("state", &mut points.state), ("slip", &mut points.slip)] {
            let dataset = dataset_of(kind);
            if !self.file.has(&dataset) {
                continue;
            }
            let names = self.text(&format!("text.{kind}"))?;
            let words = |line: &str| line.split_whitespace().map(String::from).collect();
            *named = Named::new(names.split('\n').map(words).collect());
            if self.file.shape(&dataset)? != (total, named.stride()) {
                return Err(Error::File(format!("its {dataset} is not what it names")));
            }
            named.values = self.rows::<f64>(&dataset, first, rows)?;
        }
        Ok(points)
    }
}

fn dataset_of(field: &str) -> String {
    format!("points.{field}")
}

/// Rows of this rank when `total` are dealt out equally.
fn share(total: usize, comm: &SimpleCommunicator) -> std::ops::Range<usize> {
    let (rank, size) = (comm.rank() as usize, comm.size() as usize);
    total * rank / size..total * (rank + 1) / size
}

/// Sum of the checksums of the rows, each with its number in the whole table: however the rows
/// are dealt out, the sum over the ranks is the same.
fn rows_sum<T: Word>(first: usize, columns: usize, values: &[T]) -> u64 {
    values.chunks_exact(columns).enumerate().fold(0, |total: u64, (row, values)| {
        let mut sum = Checksum::new((first + row) as u64);
        values.iter().for_each(|value| sum.add(value.word()));
        total.wrapping_add(sum.finish())
    })
}

/// What a checkpoint is made of.
trait Word: H5Type + NoUninit + Default {
    fn word(&self) -> u64;
}

impl Word for u64 {
    fn word(&self) -> u64 {
        *self
    }
}

impl Word for f64 {
    fn word(&self) -> u64 {
        self.to_bits()
    }
}

impl Word for u8 {
    fn word(&self) -> u64 {
        u64::from(*self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_the_rows_does_not_depend_on_how_they_are_dealt_out() {
        let values: Vec<f64> = (0..30).map(|k| 1.0 / f64::from(k + 1)).collect();
        let whole = rows_sum(0, 3, &values);
        for cut in 0..=10 {
            let (a, b) = values.split_at(3 * cut);
            assert_eq!(rows_sum(0, 3, a).wrapping_add(rows_sum(cut, 3, b)), whole);
        }
        let mut swapped = values.clone();
        swapped.swap(0, 3);
        assert_ne!(rows_sum(0, 3, &swapped), whole);
        let mut negative_zero = vec![0.0_f64; 3];
        let zeros = rows_sum(0, 3, &negative_zero);
        negative_zero[1] = -0.0;
        assert_ne!(rows_sum(0, 3, &negative_zero), zeros);
    }

    #[test]
    fn refusals_say_what_and_why() {
        let path = Path::new("out/checkpoint-000001.h5");
        let text = Refusal::Newer(7).describe(path);
        assert!(text.contains("format 7") && text.contains("checkpoint-000001.h5"), "{text}");
        let text = Refusal::Foreign(foreign(("b = 2".into(), "b = 3".into()))).describe(path);
        assert!(text.contains("`b = 2`") && text.contains("`b = 3`"), "{text}");
    }
}
