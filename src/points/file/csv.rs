//! Points from a csv file: header `x,y[,z],volume[,vx,vy,vz][,body]`, one point per line. Other names of the
//! columns come from the deck (`names`); columns that nobody asks for are then passed over.

use std::io::Read;
use std::path::Path;

use super::cloud::{Cloud, Rows};
use super::{Got, Refusal};
use crate::deck::model::{PointNames, PointsFile};
use crate::deck::nearest;
use crate::input_file;

pub fn read<const D: usize>(file: &PointsFile) -> Got<Cloud<D>> {
    let path = &file.path;
    let unreadable = |error: csv::Error| {
        Refusal::Unreadable(match error.kind() {
            csv::ErrorKind::Io(reason) => reason.to_string(),
            _ => error.to_string(),
        })
    };
    let wrong = |line: u64, what: String| Refusal::Wrong(Some(line), what);
    let source = input_file::open(path, input_file::DATA).map_err(|e| unreadable(e.into()))?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(source.take(input_file::DATA));
    let headers = match reader.headers() {
        Ok(headers) => headers.clone(),
        Err(error) if error.is_io_error() => return Err(unreadable(error)),
        Err(error) => return Err(wrong(1, error.to_string())),
    };
    let line = headers.position().map_or(1, csv::Position::line);
    let columns = Columns::find::<D>(&headers, &file.names).map_err(|what| wrong(line, what))?;

    let lines = Lines::of(path);
    let mut rows = Cloud {
        places: Vec::new(),
        volumes: Vec::new(),
        velocities: Vec::new(),
        bodies: Vec::new(),
        rows: Rows::Lines(Vec::new()),
    };
    let mut numbers = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| match error.position() {
            Some(position) => wrong(position.line(), of_record(&error)),
            None => unreadable(error),
        })?;
        let line = lines.of_record(&record);
        let number = |at: usize| -> Got<f64> {
            let text = record.get(at).unwrap_or("");
            text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
                let pointed = text.replacen(',', ".", 1);
                let hint = match pointed != text && pointed.parse::<f64>().is_ok() {
                    true => ": decimals have a point",
                    false => "",
                };
                let column = &headers[at];
                wrong(line, format!("\"{text}\" in column \"{column}\" is not a number{hint}"))
            })
        };
        let mut x = [0.0; D];
        for (value, &at) in x.iter_mut().zip(&columns.places) {
            *value = number(at)?;
        }
        rows.places.push(x);
        rows.volumes.push(number(columns.volume)?);
        let mut velocity = [0.0; D];
        for (value, at) in velocity.iter_mut().zip(&columns.speeds) {
            if let Some(at) = at {
                *value = number(*at)?;
            }
        }
        rows.velocities.push(velocity);
        if let Some(at) = columns.body {
            rows.bodies.push(number(at)?);
        }
        numbers.push(line);
    }
    if numbers.is_empty() {
        return Err(wrong(line, "a header and no points".to_string()));
    }
    rows.rows = Rows::Lines(numbers);
    Ok(rows)
}

/// What is wrong with a line.
fn of_record(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => format!(
            "{len} values, but the header has {expected_len} columns; commas stand between values, and \
             decimals have a point (0.5, not 0,5)"
        ),
        _ => error.to_string(),
    }
}

/// The lines of a file by their bytes: the reader counts those of comments and blanks before a record as
/// its own.
struct Lines {
    bytes: Vec<u8>,
    /// Where each line begins.
    starts: Vec<usize>,
}

impl Lines {
    fn of(path: &Path) -> Self {
        let bytes = input_file::read(path, input_file::DATA).unwrap_or_default();
        let ends = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
        let starts = std::iter::once(0).chain(ends.map(|(at, _)| at + 1)).collect();
        Lines { bytes, starts }
    }

    /// Number of the line, from 1.
    fn of_record(&self, record: &csv::StringRecord) -> u64 {
        let Some(position) = record.position() else { return 0 };
        let at = position.byte() as usize;
        let mut line = self.starts.partition_point(|start| *start < at);
        let text = |line: usize| {
            let start = *self.starts.get(line)?;
            let end = self.starts.get(line + 1).map_or(self.bytes.len(), |next| next - 1);
            Some(self.bytes.get(start..end)?.trim_ascii())
        };
        while text(line).is_some_and(|text| text.is_empty() || text.starts_with(b"#")) {
            line += 1;
        }
        line as u64 + 1
    }
}

/// Where in a line the values are.
struct Columns {
    places: Vec<usize>,
    volume: usize,
    speeds: Vec<Option<usize>>,
    body: Option<usize>,
}

impl Columns {
    /// Error: a column that is missing, unknown or there twice.
    fn find<const D: usize>(
        headers: &csv::StringRecord,
        names: &PointNames,
    ) -> std::result::Result<Self, String> {
        let own = |given: &Option<String>, usual: &'static str| {
            given.clone().unwrap_or_else(|| usual.to_string())
        };
        let axes: Vec<String> =
            ["x", "y", "z"][..D].iter().zip(&names.axes).map(|(u, given)| own(given, u)).collect();
        let rates: Vec<String> = ["vx", "vy", "vz"][..D]
            .iter()
            .zip(&names.rates)
            .map(|(usual, given)| own(given, usual))
            .collect();
        let (volume, body) = (own(&names.volume, "volume"), own(&names.body, "body"));
        let expected = format!(
            "the header must read {},{volume} and may add {}",
            axes.join(","),
            rates.join(",")
        );
        let known = || {
            let all = axes.iter().chain([&volume]).chain(&rates).chain([&body]);
            all.map(String::as_str)
        };
        // A file that was named by mistake may hold what must not appear on a screen or in a log.
        if !headers.iter().any(|name| known().any(|column| column == name)) {
            let first = headers.get(0).unwrap_or("");
            let apart = [(';', "semicolons"), ('\t', "tabs")];
            let hint = match apart.into_iter().find(|(mark, _)| first.contains(*mark)) {
                Some((_, marks)) => format!(
                    "; it has {marks} between the columns: write commas there, and decimals with a point"
                ),
                None => String::new(),
            };
            return Err(format!("this is not a file of points: {expected}{hint}"));
        }
        for (at, name) in headers.iter().enumerate() {
            if !names.any() && !known().any(|column| column == name) {
                // velocity_x, v1_y
                let speed = || {
                    let same = |v: &&String| name.starts_with('v') && name.ends_with(&v[1..]);
                    rates.iter().find(same).map(String::as_str)
                };
                let hint = match (D, name, nearest(name, known()).or_else(speed)) {
                    (2, "z" | "vz", _) => " (the problem is 2D)".to_string(),
                    (_, _, Some(near)) => format!(", did you mean \"{near}\"?"),
                    _ => String::new(),
                };
                return Err(format!("unknown column \"{name}\"{hint}; {expected}"));
            }
            let asked = known().any(|column| column == name);
            if asked && headers.iter().take(at).any(|earlier| earlier == name) {
                return Err(format!("column \"{name}\" is there twice; {expected}"));
            }
        }
        let column = |name: &str| headers.iter().position(|header| header == name);
        let needed =
            |name: &String| column(name).ok_or_else(|| format!("no column \"{name}\"; {expected}"));
        let speed = |(name, given): (&String, &Option<String>)| match given {
            Some(_) => needed(name).map(Some),
            None => Ok(column(name)),
        };
        Ok(Columns {
            places: axes.iter().map(needed).collect::<std::result::Result<_, _>>()?,
            volume: needed(&volume)?,
            speeds: rates
                .iter()
                .zip(&names.rates)
                .map(speed)
                .collect::<std::result::Result<_, _>>()?,
            body: speed((&body, &names.body))?,
        })
    }
}
