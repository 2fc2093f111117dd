//! Points from a csv file: header `x,y[,z],volume[,vx,vy,vz]`, one point per line.

use std::path::Path;

use crate::deck::model::Body;
use crate::error::{Error, Result};

use super::Points;
use super::share::Share;

/// Reads this rank's share of the lines; the domain of each point is a square (cube) of its
/// volume. Returns the number of lines.
pub fn read_points<const D: usize>(
    points: &mut Points<D>,
    index: usize,
    body: &Body,
    path: &Path,
    share: Share,
    first_id: u64,
) -> Result<u64> {
    let wrong = |line: u64, what: String| {
        Error::Input(format!(
            "{}:{line}: {what} (points of body \"{}\")",
            path.display(),
            body.name
        ))
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| wrong(1, error.to_string()))?;
    let headers = reader.headers().map_err(|error| wrong(1, error.to_string()))?.clone();
    let column = |name: &str| headers.iter().position(|header| header == name);
    let needed = |name: &str| {
        column(name).ok_or_else(|| {
            wrong(
                1,
                format!(
                    "no column \"{name}\"; the header must read {},volume and may add vx,vy{}",
                    &"x,y,z"[..2 * D - 1],
                    if D == 3 { ",vz" } else { "" }
                ),
            )
        })
    };
    let axes = ["x", "y", "z"];
    let places: Vec<usize> = axes[..D].iter().map(|name| needed(name)).collect::<Result<_>>()?;
    let volume_column = needed("volume")?;
    let speeds: Vec<Option<usize>> =
        ["vx", "vy", "vz"][..D].iter().map(|name| column(name)).collect();

    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            wrong(error.position().map_or(0, csv::Position::line), error.to_string())
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |at: usize| -> Result<f64> {
            let text = record.get(at).unwrap_or("");
            text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
                wrong(line, format!("\"{text}\" in column \"{}\" is not a number", &headers[at]))
            })
        };
        let mut x = [0.0; D];
        for (value, &at) in x.iter_mut().zip(&places) {
            *value = number(at)?;
        }
        let volume = number(volume_column)?;
        if volume <= 0.0 {
            return Err(wrong(line, format!("volume {volume} must be positive")));
        }
        let mut velocity = [0.0; D];
        for (value, at) in velocity.iter_mut().zip(&speeds) {
            if let Some(at) = at {
                *value = number(*at)?;
            }
        }
        rows.push((x, volume, velocity));
    }
    for row in share.of(rows.len()) {
        let (x, volume, velocity) = rows[row];
        let half = [0.5 * volume.powf(1.0 / D as f64); D];
        let id = first_id + row as u64;
        points.push_unstrained(id, index as u32, x, volume, body.density, half);
        *points.velocity.last_mut().expect("a point was just pushed") = velocity;
    }
    Ok(rows.len() as u64)
}
