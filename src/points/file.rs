//! Points from a csv file: header `x,y[,z],volume[,vx,vy,vz]`, one point per line.

use std::f64::consts::TAU;
use std::io::Read;
use std::path::Path;

use crate::deck::model::{Basis, Body, Deck, Symmetry};
use crate::deck::{figure, nearest, rough};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::input_file;

use super::Points;
use super::share::Share;

/// By how much a GIMP domain may exceed a cell: six digits of a volume.
const SLACK: f64 = 1e-5;

/// Reads this rank's share of the lines; the domain of each point is a square (cube) of its
/// volume. Returns the number of lines. Errors name file and line; one of a file that cannot be
/// read names the deck's.
pub fn read_points<const D: usize>(
    points: &mut Points<D>,
    deck: &Deck,
    index: usize,
    grid: &Grid<D>,
    path: &Path,
    share: Share,
    first_id: u64,
) -> Result<u64> {
    let body = &deck.bodies[index];
    let unreadable = |error: csv::Error| {
        let reason = match error.kind() {
            csv::ErrorKind::Io(reason) => reason.to_string(),
            _ => error.to_string(),
        };
        let key = format!("body.{index}.shape.points");
        let message = format!("cannot read {}: {reason}", path.display());
        Error::Input(deck.places.say(&key, &message))
    };
    let wrong = |line: u64, what: String| at(path, body, line, &what);
    let file = input_file::open(path, input_file::DATA).map_err(|e| unreadable(e.into()))?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(file.take(input_file::DATA));
    let headers = match reader.headers() {
        Ok(headers) => headers.clone(),
        Err(error) if error.is_io_error() => return Err(unreadable(error)),
        Err(error) => return Err(wrong(1, error.to_string())),
    };
    let line = headers.position().map_or(1, csv::Position::line);
    let columns = Columns::find::<D>(&headers).map_err(|what| wrong(line, what))?;
    let widest = match grid {
        Grid::Lattice(lattice) if deck.method.basis == Basis::Gimp => {
            lattice.spacing.iter().copied().fold(f64::INFINITY, f64::min)
        }
        _ => f64::INFINITY,
    };

    let rings = deck.analysis.symmetry == Symmetry::Axisymmetric;
    let width_of = |x: &[f64; D], volume: f64| {
        let section = if rings { volume / (TAU * x[0]) } else { volume };
        section.powf(1.0 / D as f64)
    };
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| match error.position() {
            Some(position) => wrong(position.line(), error.to_string()),
            None => unreadable(error),
        })?;
        let line = || line_of(path, &record);
        let number = |at: usize| -> Result<f64> {
            let text = record.get(at).unwrap_or("");
            text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
                wrong(line(), format!("\"{text}\" in column \"{}\" is not a number", &headers[at]))
            })
        };
        let mut x = [0.0; D];
        for (value, &at) in x.iter_mut().zip(&columns.places) {
            *value = number(at)?;
        }
        if rings && x[0] <= 0.0 {
            return Err(wrong(
                line(),
                format!("radius {} must be positive: x is the radius", x[0]),
            ));
        }
        let volume = number(columns.volume)?;
        if volume <= 0.0 {
            return Err(wrong(line(), format!("volume {volume} must be positive")));
        }
        let width = width_of(&x, volume);
        if width > widest * (1.0 + SLACK) {
            let what = format!(
                "volume {} is that of a domain of width {} m, expected at most the cell size {} \
                 m: with basis = \"gimp\" a domain may not be larger than a cell",
                figure(volume),
                rough(width),
                figure(widest)
            );
            return Err(wrong(line(), what));
        }
        let mut velocity = [0.0; D];
        for (value, at) in velocity.iter_mut().zip(&columns.speeds) {
            if let Some(at) = at {
                *value = number(*at)?;
            }
        }
        rows.push((x, volume, velocity));
    }
    if rows.is_empty() {
        return Err(wrong(line, "a header and no points".to_string()));
    }
    if let Some((first, second)) = twice(&rows) {
        let (x, lines) = (rows[first].0, [first, second].map(|row| line_of_row(path, row)));
        let what = format!(
            "a second point at {x:?} m, after that of line {}, whose mass would count twice",
            lines[0]
        );
        return Err(wrong(lines[1], what));
    }
    for row in share.of(rows.len()) {
        let (x, volume, velocity) = rows[row];
        let half = [0.5 * width_of(&x, volume); D];
        let id = first_id + row as u64;
        points.push_unstrained(id, index as u32, x, volume, body.density, half);
        *points.velocity.last_mut().expect("a point was just pushed") = velocity;
    }
    Ok(rows.len() as u64)
}

/// The first row that repeats the place of an earlier one, after that.
fn twice<const D: usize>(rows: &[([f64; D], f64, [f64; D])]) -> Option<(usize, usize)> {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    let place = |row: usize| rows[row].0.map(|x| (x + 0.0).to_bits());
    order.sort_unstable_by_key(|&row| (place(row), row));
    let pairs = order.windows(2).filter(|pair| place(pair[0]) == place(pair[1]));
    pairs.map(|pair| (pair[0], pair[1])).min_by_key(|pair| pair.1)
}

/// Line of a point, counted from 0.
fn line_of_row(path: &Path, row: usize) -> u64 {
    let mut builder = csv::ReaderBuilder::new();
    let reader = builder.trim(csv::Trim::All).comment(Some(b'#')).from_path(path);
    let record = reader.ok().and_then(|reader| reader.into_records().nth(row)?.ok());
    record.map_or(0, |record| line_of(path, &record))
}

/// Line of a record: the reader counts those of comments and blanks before it as its own.
fn line_of(path: &Path, record: &csv::StringRecord) -> u64 {
    let Some(position) = record.position() else { return 0 };
    let bytes = input_file::read(path, input_file::DATA).unwrap_or_default();
    let (before, after) = bytes.split_at(bytes.len().min(position.byte() as usize));
    let ends = before.iter().filter(|&&byte| byte == b'\n').count();
    let skipped = after.split(|&byte| byte == b'\n').take_while(|line| {
        let line = line.trim_ascii();
        line.is_empty() || line.starts_with(b"#")
    });
    (1 + ends + skipped.count()) as u64
}

fn at(path: &Path, body: &Body, line: u64, what: &str) -> Error {
    Error::Input(format!("{}:{line}: {what} (points of body \"{}\")", path.display(), body.name))
}

/// Where in a line the values are.
struct Columns {
    places: Vec<usize>,
    volume: usize,
    speeds: Vec<Option<usize>>,
}

impl Columns {
    /// Error: a column that is missing, unknown or there twice.
    fn find<const D: usize>(headers: &csv::StringRecord) -> std::result::Result<Self, String> {
        let (axes, rates) = (&["x", "y", "z"][..D], &["vx", "vy", "vz"][..D]);
        let expected = format!(
            "the header must read {},volume and may add {}",
            axes.join(","),
            rates.join(",")
        );
        let known = || axes.iter().chain(&["volume"]).chain(rates).copied();
        // A file that was named by mistake may hold what must not appear on a screen or in a log.
        if !headers.iter().any(|name| known().any(|column| column == name)) {
            return Err(format!("this is not a file of points: {expected}"));
        }
        for (at, name) in headers.iter().enumerate() {
            if !known().any(|column| column == name) {
                // velocity_x, v1_y
                let speed = || {
                    rates.iter().copied().find(|v| name.starts_with('v') && name.ends_with(&v[1..]))
                };
                let hint = match (D, name, nearest(name, known()).or_else(speed)) {
                    (2, "z" | "vz", _) => " (the problem is 2D)".to_string(),
                    (_, _, Some(near)) => format!(", did you mean \"{near}\"?"),
                    _ => String::new(),
                };
                return Err(format!("unknown column \"{name}\"{hint}; {expected}"));
            }
            if headers.iter().take(at).any(|earlier| earlier == name) {
                return Err(format!("column \"{name}\" is there twice; {expected}"));
            }
        }
        let column = |name: &str| headers.iter().position(|header| header == name);
        let needed =
            |name: &str| column(name).ok_or_else(|| format!("no column \"{name}\"; {expected}"));
        Ok(Columns {
            places: axes.iter().map(|name| needed(name)).collect::<std::result::Result<_, _>>()?,
            volume: needed("volume")?,
            speeds: rates.iter().map(|name| column(name)).collect(),
        })
    }
}
