//! What a report shows, read from the files of a results directory: also while the run goes on.

use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};

use crate::error::Result;
use crate::output::names::{
    DECK, ELEMENT, HISTORY, LOG, PROBES, RESIDUALS, RESOLVED_DECK, SUMMARY,
};
use crate::output::series::frames::{self, Frames, spacing};
use crate::output::tables::csv_table::whole_rows;

/// Rows of a table that a report holds at most.
const MOST_ROWS: usize = 2000;
/// Lines of the log at its beginning and at its end, and bytes of a deck.
const LOG_LINES: usize = 150;
const MOST_DECK: usize = 200_000;

/// Everything that the page reads, as JSON.
pub fn gather(directory: &Path) -> Result<Value> {
    let text = |name: &str| fs::read_to_string(directory.join(name)).ok();
    let resolved: Option<toml::Table> = text(RESOLVED_DECK).and_then(|text| text.parse().ok());
    let summary: Option<Value> = text(SUMMARY).and_then(|text| serde_json::from_str(&text).ok());
    let mut tables = Map::new();
    for name in [HISTORY, RESIDUALS, PROBES, ELEMENT] {
        if let Some(found) = text(name).and_then(|text| table(&text)) {
            tables.insert(name.trim_end_matches(".csv").to_string(), found);
        }
    }
    let title = resolved.as_ref().and_then(|deck| deck.get("title")?.as_str()).unwrap_or_default();
    let title = match title {
        "" => {
            directory.file_name().map_or("Run".into(), |name| name.to_string_lossy().into_owned())
        }
        title => title.to_string(),
    };
    let mut deck = text(DECK).unwrap_or_default();
    if deck.len() > MOST_DECK {
        let end = (0..=MOST_DECK).rev().find(|&k| deck.is_char_boundary(k)).unwrap_or(0);
        deck.truncate(end);
        deck.push_str("\n(the rest is in input.toml)\n");
    }
    Ok(json!({
        "title": title,
        "summary": summary,
        "tables": tables,
        "deck": deck,
        "log": log(&text(LOG).unwrap_or_default()),
        "grid": resolved.as_ref().map(lattice),
        "points": points(&frames::read(directory)?),
    }))
}

/// Origin, spacing and cells of a lattice; null on a mesh.
fn lattice(deck: &toml::Table) -> Value {
    let Some(grid) = deck.get("grid") else { return Value::Null };
    let numbers = |key: &str| -> Option<Vec<f64>> {
        let items = grid.get(key)?.as_array()?;
        items.iter().map(|x| x.as_float().or(x.as_integer().map(|n| n as f64))).collect()
    };
    let spacing = numbers("h").or_else(|| {
        let one = grid.get("h")?;
        let one = one.as_float().or(one.as_integer().map(|n| n as f64))?;
        Some(vec![one; 3])
    });
    match (numbers("origin"), spacing, numbers("size"), numbers("cells")) {
        (Some(origin), Some(h), Some(size), _) => {
            json!({ "origin": origin, "h": h, "size": size })
        }
        (Some(origin), Some(h), None, Some(cells)) => {
            let size: Vec<f64> = cells.iter().zip(&h).map(|(n, h)| n * h).collect();
            json!({ "origin": origin, "h": h, "size": size })
        }
        _ => Value::Null,
    }
}

/// Header, columns and the number of rows of a csv table; every k-th row and the last of a long one.
fn table(text: &str) -> Option<Value> {
    let text = whole_rows(text);
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(text.as_bytes());
    let header: Vec<String> = reader.headers().ok()?.iter().map(String::from).collect();
    let rows: Vec<csv::StringRecord> = reader
        .records()
        .filter_map(|row| row.ok().filter(|row| row.len() == header.len()))
        .collect();
    let every = rows.len().div_ceil(MOST_ROWS).max(1);
    let kept = rows.iter().enumerate().filter(|(k, _)| k % every == 0 || k + 1 == rows.len());
    let mut columns: Vec<Vec<Value>> = vec![Vec::new(); header.len()];
    for (_, row) in kept {
        for (word, column) in row.iter().zip(&mut columns) {
            column.push(word.parse().map_or(Value::Null, figure));
        }
    }
    Some(json!({ "header": header, "columns": columns, "rows": rows.len(), "every": every }))
}

/// A number with as many figures as a picture shows; null for what is none.
fn figure(value: f64) -> Value {
    if value == value.trunc() && value.abs() < 1e15 {
        return json!(value as i64);
    }
    format!("{value:.6e}").parse::<f64>().map_or(Value::Null, |rounded| json!(rounded))
}

fn log(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    if lines.len() <= 2 * LOG_LINES {
        return lines.join("\n");
    }
    let (head, tail) = (&lines[..LOG_LINES], &lines[lines.len() - LOG_LINES..]);
    let left = lines.len() - 2 * LOG_LINES;
    format!("{}\n\n({left} lines are in log.txt)\n\n{}", head.join("\n"), tail.join("\n"))
}

/// Positions and values in steps of 1/65535 of their range over all frames, as base64.
fn points(frames: &Frames) -> Value {
    if frames.frames.is_empty() {
        return Value::Null;
    }
    let axes = if frames.flat { 2 } else { 3 };
    let axis_of = |axis: usize| {
        let frames = frames.frames.iter();
        frames.flat_map(move |frame| frame.positions.iter().skip(axis).step_by(3).copied())
    };
    let bounds: Vec<(f64, f64)> = (0..axes).map(|axis| range(axis_of(axis))).collect();
    let ranges: Vec<(f64, f64)> = (0..frames.columns.len())
        .map(|c| range(frames.frames.iter().flat_map(|frame| frame.values[c].iter().copied())))
        .collect();
    let each = frames.frames.iter().map(|frame| {
        let places: Vec<String> = (0..axes)
            .map(|axis| {
                let values = frame.positions.iter().skip(axis).step_by(3).copied();
                packed(values, bounds[axis])
            })
            .collect();
        let values: Vec<String> = frame
            .values
            .iter()
            .zip(&ranges)
            .map(|(values, range)| packed(values.iter().copied(), *range))
            .collect();
        let own: Vec<(f64, f64)> =
            frame.values.iter().map(|values| range(values.iter().copied())).collect();
        let edges: Vec<Value> =
            frame.edges.iter().flatten().map(|x| figure(f64::from(*x))).collect();
        json!({
            "edges": edges,
            "step": frame.step, "time": frame.time, "places": places, "values": values, "ranges": own,
        })
    });
    let columns: Vec<Value> = frames
        .columns
        .iter()
        .zip(&ranges)
        .map(|(column, range)| json!({ "name": column.name, "unit": column.unit, "range": range }))
        .collect();
    json!({
        "frames": each.collect::<Vec<_>>(),
        "columns": columns,
        "bounds": bounds,
        "size": spacing(&frames.frames[0].positions),
        "stride": frames.stride,
        "all": frames.points,
        "written": frames.written,
    })
}

/// Least and largest finite value; 0 and 0 without any.
fn range(values: impl Iterator<Item = f32>) -> (f64, f64) {
    let finite = values.filter(|x| x.is_finite());
    let ends = finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    if ends.0 <= ends.1 { (f64::from(ends.0), f64::from(ends.1)) } else { (0.0, 0.0) }
}

/// Steps of a 65534th of the range, two bytes each, low byte first; 65535 is no number.
fn packed(values: impl Iterator<Item = f32>, (low, high): (f64, f64)) -> String {
    let scale = if high > low { 65534.0 / (high - low) } else { 0.0 };
    let step = |x: f32| {
        if x.is_finite() { ((f64::from(x) - low) * scale).round() as u16 } else { u16::MAX }
    };
    base64(&values.flat_map(|x| step(x).to_le_bytes()).collect::<Vec<u8>>())
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = (u32::from(chunk[0]) << 16)
            | (u32::from(chunk.get(1).copied().unwrap_or(0)) << 8)
            | u32::from(chunk.get(2).copied().unwrap_or(0));
        for k in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * k)) as usize & 63];
            out.push(if k <= chunk.len() { letter as char } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_rfc_4648() {
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn long_tables_keep_their_first_and_last_rows() {
        let mut text = String::from("step [-],x [m]\n");
        (1..=5001).for_each(|step| text.push_str(&format!("{step},{}\n", step as f64 / 3.0)));
        text.push_str("5002,0.");
        let table = table(&text).unwrap();
        let steps = table["columns"][0].as_array().unwrap();
        assert!(steps.len() <= 2001);
        assert_eq!((&steps[0], steps.last().unwrap()), (&json!(1), &json!(5001)));
        // A row without its end is left out.
        assert_eq!(table["rows"], 5001);
        assert_eq!(table["columns"][1][0], json!(0.3333333));
    }

    #[test]
    fn values_are_packed_in_their_range() {
        let text = packed([0.0, 1.0, f32::NAN].into_iter(), (0.0, 1.0));
        assert_eq!(text, base64(&[0, 0, 0xfe, 0xff, 0xff, 0xff]));
        // One value alone has no range.
        assert_eq!(packed([7.0].into_iter(), (7.0, 7.0)), base64(&[0, 0]));
    }
}
