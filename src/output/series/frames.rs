//! The points of the written frames, read by one process: as many as a report has room for, or those of
//! one frame.
//!
//! Of large models every k-th row is read, and of many frames every k-th and the last. Rows lie in the
//! order of ranks and cells, so that a sample is spread over the body; k is a prime number, as points lie
//! in their cells in groups of 4, 8, 9 or 27, and another k could pick one place in every group. Memory
//! holds nothing but the sample.

use std::path::{Path, PathBuf};

use hdf5::{Hyperslab, SliceOrIndex};

use crate::error::{Error, Result};
use crate::output::names::{names_in, number_of};
use crate::output::whole_file::cannot_read;

/// Numbers that a report may hold, of two bytes each.
const MOST_NUMBERS: usize = 4_500_000;
const MOST_FRAMES: usize = 60;
/// Points of all frames together: what may be read.
const MOST_ROWS: usize = 20_000_000;
/// Of more rows than this they are read in groups: a read of its own for each would take hours.
const MANY: usize = 20_000_000;
const TOGETHER: usize = 4096;
const MOST_COLUMNS: usize = 24;
const MOST_EDGES: usize = 5000;

/// One number at each point.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// `stress.yy`, `|displacement|`
    pub name: String,
    pub unit: String,
    dataset: String,
    /// `None`: the length of a vector.
    component: Option<usize>,
}

/// A sample of the points at the end of a step.
#[derive(Debug, Clone)]
pub struct Frame {
    pub step: usize,
    /// s, or the load factor
    pub time: f64,
    /// x, y, z of each point
    pub positions: Vec<f32>,
    /// Of each column.
    pub values: Vec<Vec<f32>>,
    /// x, y, z of the 4 or 8 corners of each point's domain; empty unless asked for.
    pub corners: Vec<f32>,
    /// Edges of the surfaces of rigid bodies: x, y, z of both ends.
    pub edges: Vec<[f32; 6]>,
}

/// The frames of a results directory.
#[derive(Debug, Clone, Default)]
pub struct Frames {
    pub columns: Vec<Column>,
    pub frames: Vec<Frame>,
    /// Points of the model, and one in how many is shown.
    pub points: usize,
    pub stride: usize,
    /// Written frames.
    pub written: usize,
    pub flat: bool,
}

/// Step and path of each written frame, in order.
pub fn written(directory: &Path) -> Result<Vec<(usize, PathBuf)>> {
    let mut found: Vec<(usize, PathBuf)> = names_in(directory)?
        .iter()
        .filter_map(|name| Some((number_of(name, "points-")?, directory.join(name))))
        .collect();
    found.sort();
    Ok(found)
}

/// A sample of the frames of `directory`; empty without frames.
pub fn read(directory: &Path) -> Result<Frames> {
    let all = written(directory)?;
    let Some((_, first)) = all.first() else { return Ok(Frames::default()) };
    let file = open(first)?;
    let points = rows(&file, "position").map_err(|reason| unreadable(first, &reason))?;
    let last = open(&all[all.len() - 1].1)?;
    let flat = is_flat(&file).and_then(|flat| Ok(flat && is_flat(&last)?));
    let flat = flat.map_err(|reason| unreadable(first, &reason))?;
    let columns =
        columns(&file, flat, MOST_COLUMNS).map_err(|reason| unreadable(first, &reason))?;
    let wanted = MOST_FRAMES.min(MOST_ROWS / points.max(1)).max(2);
    let every = (all.len() - 1).div_ceil(wanted - 1).max(1);
    let chosen: Vec<_> = all
        .iter()
        .enumerate()
        .filter(|(k, _)| k.is_multiple_of(every) || *k == all.len() - 1)
        .map(|(_, frame)| frame)
        .collect();
    let numbers = chosen.len() * (3 + columns.len());
    let stride = prime_from((points * numbers).div_ceil(MOST_NUMBERS));
    let mut frames = Vec::new();
    for (step, path) in chosen {
        let frame = open(path).and_then(|file| {
            sample(&file, *step, stride, &columns).map_err(|r| unreadable(path, &r))
        });
        frames.push(with_edges(directory, frame?)?);
    }
    Ok(Frames { columns, frames, points, stride, written: all.len(), flat })
}

/// Points of one frame at most: a picture has no room for more.
const MOST_POINTS: usize = 2_000_000;

/// A frame and its columns. `step`: `None` for the last. `domains`: with the corners of the points' domains.
///
/// # Errors
/// `Input` if there is no frame, or none of that step, or no domains in it.
pub fn read_one(directory: &Path, step: Option<usize>, domains: bool) -> Result<Frames> {
    let all = written(directory)?;
    let Some((last, _)) = all.last() else {
        return Err(Error::Input(format!("{} holds no points-*.h5", directory.display())));
    };
    let step = step.unwrap_or(*last);
    let Some((_, path)) = all.iter().find(|(number, _)| *number == step) else {
        let steps: Vec<String> = all.iter().map(|(number, _)| number.to_string()).collect();
        let known = steps.join(", ");
        return Err(Error::Input(format!("no frame of step {step}; there are those of {known}")));
    };
    let file = open(path)?;
    let frames = || -> hdf5::Result<Frames> {
        let points = rows(&file, "position")?;
        let flat = is_flat(&file)?;
        let columns = columns(&file, flat, usize::MAX)?;
        let stride = prime_from(points.div_ceil(MOST_POINTS));
        let frame = sample(&file, step, stride, &columns)?;
        Ok(Frames { columns, frames: vec![frame], points, stride, written: all.len(), flat })
    };
    let mut read = frames().map_err(|reason| unreadable(path, &reason))?;
    if domains {
        if !file.link_exists("domain_corners") {
            return Err(Error::Input(format!(
                "{} has no domains: method.basis = \"mpm\" has points only",
                path.display()
            )));
        }
        if read.stride > 1 {
            return Err(Error::Input(format!(
                "domains are drawn of {MOST_POINTS} points at most, and the frame has {}",
                read.points
            )));
        }
        let corners = table(&file, "domain_corners", 1).map_err(|r| unreadable(path, &r))?.0;
        read.frames[0].corners = corners.iter().map(|&x| x as f32).collect();
    }
    if let Some(frame) = read.frames.pop() {
        read.frames.push(with_edges(directory, frame)?);
    }
    Ok(read)
}

/// Adds the surfaces of rigid bodies, where the run has written them.
fn with_edges(directory: &Path, mut frame: Frame) -> Result<Frame> {
    let path = directory.join(format!("rigid-{:06}.h5", frame.step));
    if !path.exists() {
        return Ok(frame);
    }
    let file = open(&path)?;
    let edges = || -> hdf5::Result<Vec<[f32; 6]>> {
        let (places, _) = table(&file, "coordinates", 1)?;
        let (corners, width) = table(&file, "connectivity", 1)?;
        let place = |corner: f64| places.get(3 * corner as usize..3 * corner as usize + 3);
        let mut edges = Vec::new();
        for facet in corners.chunks_exact(width.max(1)) {
            // A segment has one edge, a triangle three.
            for k in 0..if width == 2 { 1 } else { width } {
                if let (Some(a), Some(b)) = (place(facet[k]), place(facet[(k + 1) % width])) {
                    let mut ends = a.iter().chain(b).map(|x| *x as f32);
                    edges.push(std::array::from_fn(|_| ends.next().unwrap_or(0.0)));
                }
            }
        }
        edges.truncate(MOST_EDGES);
        Ok(edges)
    };
    frame.edges = edges().map_err(|reason| unreadable(&path, &reason))?;
    Ok(frame)
}

/// Median distance of a point to its nearest neighbour, of 40 points; x, y, z of each.
pub fn spacing(positions: &[f32]) -> f64 {
    let all: Vec<&[f32]> = positions.chunks_exact(3).collect();
    let mut nearest: Vec<f32> = all
        .iter()
        .step_by((all.len() / 40).max(1))
        .map(|a| {
            let square =
                |b: &&[f32]| a.iter().zip(b.iter()).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
            all.iter().map(square).filter(|d| *d > 0.0).fold(f32::INFINITY, f32::min)
        })
        .filter(|d| d.is_finite())
        .collect();
    nearest.sort_by(f32::total_cmp);
    nearest.get(nearest.len() / 2).map_or(0.0, |d| f64::from(d.sqrt()))
}

fn open(path: &Path) -> Result<hdf5::File> {
    // The operating system's reason is only to be had from an ordinary open.
    std::fs::File::open(path).map_err(|reason| cannot_read(path, &reason))?;
    hdf5::File::open(path).map_err(|reason| unreadable(path, &reason))
}

fn unreadable(path: &Path, reason: &hdf5::Error) -> Error {
    Error::File(format!("{} is not a frame that this program wrote: {reason}", path.display()))
}

fn rows(file: &hdf5::File, name: &str) -> hdf5::Result<usize> {
    Ok(file.dataset(name)?.shape().first().copied().unwrap_or(0))
}

/// One row in `stride` of a dataset, and its number of columns.
fn table(file: &hdf5::File, name: &str, stride: usize) -> hdf5::Result<(Vec<f64>, usize)> {
    let together = if rows(file, name)? > MANY { TOGETHER } else { 1 };
    rows_together(file, name, stride, together)
}

/// The same, with so many rows together and a gap behind them.
fn rows_together(
    file: &hdf5::File,
    name: &str,
    stride: usize,
    together: usize,
) -> hdf5::Result<(Vec<f64>, usize)> {
    let dataset = file.dataset(name)?;
    let shape = dataset.shape();
    let total = shape.first().copied().unwrap_or(0);
    let columns = shape.get(1).copied().unwrap_or(1);
    if stride == 1 || total == 0 {
        return Ok((dataset.read_raw()?, columns));
    }
    let part = |step, count, block| SliceOrIndex::SliceCount { start: 0, step, count, block };
    let count = match together {
        1 => total.div_ceil(stride),
        _ => (total / (stride * together)).max(1),
    };
    let mut slices = vec![part(stride * together, count, together)];
    let values: Vec<f64> = if shape.len() > 1 {
        slices.push(part(1, columns, 1));
        dataset.read_slice_2d::<f64, _>(Hyperslab::from(slices))?.into_iter().collect()
    } else {
        dataset.read_slice_1d::<f64, _>(Hyperslab::from(slices))?.into_iter().collect()
    };
    Ok((values, columns))
}

/// 1 for 0 and 1, else the first prime number that is not below `least`.
fn prime_from(least: usize) -> usize {
    let is_prime = |n: &usize| (2..).take_while(|k| k * k <= *n).all(|k| !n.is_multiple_of(k));
    (least.max(1)..).find(is_prime).unwrap_or(1)
}

fn is_flat(file: &hdf5::File) -> hdf5::Result<bool> {
    let stride = prime_from(rows(file, "position")? / 10_000);
    Ok(table(file, "position", stride)?.0.chunks(3).all(|x| x[2] == 0.0))
}

/// What there is to colour by: numbers, lengths of vectors, then components.
fn columns(file: &hdf5::File, flat: bool, most: usize) -> hdf5::Result<Vec<Column>> {
    let mut names = file.member_names()?;
    let points = rows(file, "position")?;
    names.retain(|name| {
        let other = ["position", "vertices", "id"].contains(&name.as_str());
        !other && !name.starts_with("domain_") && rows(file, name).is_ok_and(|n| n == points)
    });
    let (mut whole, mut parts) = (Vec::new(), Vec::new());
    for name in names {
        let dataset = file.dataset(&name)?;
        let width = dataset.shape().get(1).copied().unwrap_or(1);
        let unit = text_attribute(&dataset, "unit");
        let column = |name: String, component| Column {
            name,
            unit: unit.clone(),
            dataset: dataset.name().trim_start_matches('/').to_string(),
            component,
        };
        let principal = name.starts_with("principal");
        let words: &[&str] = match width {
            1 => {
                whole.push(column(name.clone(), Some(0)));
                continue;
            }
            3 if principal => &["1", "2", "3"],
            3 => &["x", "y", "z"],
            6 => &["xx", "xy", "xz", "yy", "yz", "zz"],
            9 => &["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"],
            _ => continue,
        };
        if width == 3 && !principal {
            whole.push(column(format!("|{name}|"), None));
        }
        let is_zero = |word: &str| match word {
            "z" | "xz" | "yz" | "zx" | "zy" => flat,
            _ => false,
        };
        let own = words.iter().enumerate().filter(|(_, word)| !is_zero(word));
        parts.extend(own.map(|(k, word)| column(format!("{name}.{word}"), Some(k))));
    }
    // `rank` shows the partition: it comes last.
    whole.sort_by_key(|column| {
        ["body", "rank"].iter().position(|n| *n == column.name).map_or(0, |k| k + 1)
    });
    whole.extend(parts);
    whole.truncate(most);
    Ok(whole)
}

/// A text attribute, or nothing.
fn text_attribute(dataset: &hdf5::Dataset, name: &str) -> String {
    use hdf5::types::{FixedUnicode, VarLenUnicode};
    let Ok(attribute) = dataset.attr(name) else { return String::new() };
    if let Ok(text) = attribute.as_reader().read_scalar::<FixedUnicode<64>>() {
        return text.to_string();
    }
    attribute.as_reader().read_scalar::<VarLenUnicode>().map_or(String::new(), |t| t.to_string())
}

fn sample(
    file: &hdf5::File,
    step: usize,
    stride: usize,
    columns: &[Column],
) -> hdf5::Result<Frame> {
    let time = file.attr("time")?.as_reader().read_scalar::<f64>()?;
    let positions = table(file, "position", stride)?.0.iter().map(|&x| x as f32).collect();
    let mut values = Vec::new();
    let mut read: Option<(&str, Vec<f64>, usize)> = None;
    for column in columns {
        if read.as_ref().is_none_or(|(name, ..)| *name != column.dataset) {
            let (all, width) = table(file, &column.dataset, stride)?;
            read = Some((&column.dataset, all, width));
        }
        let Some((_, all, width)) = &read else { continue };
        let of_row = |row: &[f64]| match column.component {
            Some(k) => row[k] as f32,
            None => row.iter().map(|x| x * x).sum::<f64>().sqrt() as f32,
        };
        values.push(all.chunks_exact(*width).map(of_row).collect());
    }
    Ok(Frame { step, time, positions, values, corners: Vec::new(), edges: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_read_one_by_one_or_in_groups() {
        let folder = tempfile::tempdir().unwrap();
        let file = hdf5::File::create(folder.path().join("points.h5")).unwrap();
        let numbers: Vec<f64> = (0..60).map(f64::from).collect();
        file.new_dataset::<f64>()
            .shape((20, 3))
            .create("wide")
            .unwrap()
            .write_raw(&numbers)
            .unwrap();
        file.new_dataset::<f64>().shape(60).create("thin").unwrap().write_raw(&numbers).unwrap();
        let read = |name, stride, together| rows_together(&file, name, stride, together).unwrap();
        assert_eq!(read("thin", 23, 1).0, [0.0, 23.0, 46.0]);
        assert_eq!(
            read("thin", 5, 4).0,
            [0.0, 1.0, 2.0, 3.0, 20.0, 21.0, 22.0, 23.0, 40.0, 41.0, 42.0, 43.0]
        );
        assert_eq!(read("thin", 31, 2).0, [0.0, 1.0]);
        let wide = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 30.0, 31.0, 32.0, 33.0, 34.0, 35.0];
        assert_eq!(read("wide", 5, 2), (wide.to_vec(), 3));
        assert_eq!(read("wide", 1, 2).0, numbers);
    }

    #[test]
    fn strides_are_prime() {
        assert_eq!([0, 1, 2, 4, 8, 24, 100].map(prime_from), [1, 1, 2, 5, 11, 29, 101]);
        let apart = [0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 2.0, 0.0, 0.0];
        assert_eq!(spacing(&apart), 0.5);
    }
}
