//! The ground below a grid of heights in an ESRI ASCII grid: header `ncols`, `nrows`, `xllcorner` (or
//! `xllcenter`), `yllcorner` (or `yllcenter`), `cellsize`, `NODATA_value`, then the heights row by row, the
//! northern one first. Its surface joins the heights by triangles, z upward.

use super::Place;

/// Heights at most.
const MOST: usize = 50_000_000;

/// A grid of heights.
#[derive(Debug, PartialEq)]
pub struct Heights {
    columns: usize,
    rows: usize,
    /// Place of the first height, south-west, m.
    origin: [f64; 2],
    cell: f64,
    /// Rows from south to north.
    values: Vec<f64>,
}

impl Heights {
    /// Error, in words, with a line.
    pub fn read(text: &str) -> Result<Self, String> {
        let mut header: Vec<(String, f64)> = Vec::new();
        let mut values = Vec::new();
        for (line, content) in text.lines().enumerate() {
            let wrong = |what: String| format!("line {}: {what}", line + 1);
            let mut words = content.split_whitespace().peekable();
            let Some(first) = words.peek() else { continue };
            if first.starts_with(|c: char| c.is_ascii_alphabetic()) && values.is_empty() {
                let name = words.next().unwrap_or_default().to_ascii_lowercase();
                let value = words.next().and_then(|word| word.parse().ok());
                let value: f64 =
                    value.ok_or_else(|| wrong(format!("expected {name} with a number")))?;
                header.push((name, value));
                continue;
            }
            for word in words {
                let value = word.parse::<f64>().ok().filter(|v| v.is_finite());
                values.push(value.ok_or_else(|| wrong(format!("\"{word}\" is no height")))?);
                if values.len() > MOST {
                    return Err(format!("has more than {MOST} heights"));
                }
            }
        }
        let known =
            |name: &str| header.iter().find(|(known, _)| known == name).map(|(_, value)| *value);
        let needed = |name: &str| known(name).ok_or_else(|| format!("has no {name}"));
        let count = |name: &str| {
            needed(name).and_then(|n| match n.fract() == 0.0 && (2.0..1e6).contains(&n) {
                true => Ok(n as usize),
                false => Err(format!("expected {name} of 2 or more, found {n}")),
            })
        };
        let (columns, rows, cell) = (count("ncols")?, count("nrows")?, needed("cellsize")?);
        if cell <= 0.0 || !cell.is_finite() {
            return Err(format!("expected cellsize > 0, found {cell}"));
        }
        // Heights are those of the middles of cells.
        let origin = |axis: &str| match known(&format!("{axis}llcenter")) {
            Some(centre) => Ok(centre),
            None => needed(&format!("{axis}llcorner")).map(|corner| corner + 0.5 * cell),
        };
        let origin = [origin("x")?, origin("y")?];
        if values.len() != columns * rows {
            let wanted = columns * rows;
            return Err(format!("has {} heights, expected {wanted} (ncols nrows)", values.len()));
        }
        if let Some(nothing) = known("nodata_value")
            && let Some(at) = values.iter().position(|v| *v == nothing)
        {
            return Err(format!(
                "has no height (NODATA) in row {}, column {}: fill the gaps, or cut the grid",
                at / columns + 1,
                at % columns + 1
            ));
        }
        let values = values.chunks_exact(columns).rev().flatten().copied().collect();
        Ok(Heights { columns, rows, origin, cell, values })
    }

    /// The surface of the ground between the heights and a flat bottom, m. Error: a height does not lie
    /// above it.
    pub fn above(&self, bottom: f64) -> Result<Vec<[Place; 3]>, String> {
        if let Some(low) = self.values.iter().copied().find(|height| *height <= bottom) {
            return Err(format!("expected bottom below all heights, which go down to {low} m"));
        }
        let top = |i: usize, j: usize| -> Place {
            let x = |axis: usize, k: usize| self.origin[axis] + k as f64 * self.cell;
            [x(0, i), x(1, j), self.values[j * self.columns + i]]
        };
        let foot = |i: usize, j: usize| -> Place {
            let [x, y, _] = top(i, j);
            [x, y, bottom]
        };
        let mut triangles = Vec::new();
        let mut square = |[a, b, c, d]: [Place; 4]| triangles.extend([[a, b, c], [a, c, d]]);
        for j in 0..self.rows - 1 {
            for i in 0..self.columns - 1 {
                square([top(i, j), top(i + 1, j), top(i + 1, j + 1), top(i, j + 1)]);
                square([foot(i, j), foot(i, j + 1), foot(i + 1, j + 1), foot(i + 1, j)]);
            }
        }
        let (east, north) = (self.columns - 1, self.rows - 1);
        for i in 0..east {
            square([foot(i, 0), foot(i + 1, 0), top(i + 1, 0), top(i, 0)]);
            square([foot(i + 1, north), foot(i, north), top(i, north), top(i + 1, north)]);
        }
        for j in 0..north {
            square([foot(0, j + 1), foot(0, j), top(0, j), top(0, j + 1)]);
            square([foot(east, j), foot(east, j + 1), top(east, j + 1), top(east, j)]);
        }
        Ok(triangles)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::Solid;
    use super::*;

    const RAMP: &str = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 20\ncellsize 2\n\
                        NODATA_value -9999\n4 5 6\n1 2 3\n";

    #[test]
    fn ground_is_below_its_heights() {
        let heights = Heights::read(RAMP).expect("a grid");
        let ground = heights.above(-1.0).expect("above the bottom");
        let ground = Solid::new(Path::new("a.asc"), Some(-1.0), ground).expect("closed");
        assert_eq!(ground.bounds(), ([11.0, 21.0, -1.0], [15.0, 23.0, 6.0]));
        // South-west lies at the height 1, north-east at 6.
        assert!(ground.contains(&[11.1, 21.1, 1.1]) && !ground.contains(&[11.1, 21.1, 1.3]));
        assert!(ground.contains(&[14.9, 22.9, 5.7]) && !ground.contains(&[14.9, 22.9, 5.9]));
        assert!(!ground.contains(&[12.0, 22.0, -1.1]));
    }

    #[test]
    fn broken_grids_are_named() {
        let says = |text: String, words: &str| {
            let found = Heights::read(&text).and_then(|h| h.above(0.0)).expect_err("a fault");
            assert!(found.contains(words), "{found}");
        };
        says(RAMP.replace("4 5 6", "4 5"), "has 5 heights, expected 6");
        says(RAMP.replace("4 5 6", "4 -9999 6"), "row 1, column 2");
        says(RAMP.replace("4 5 6", "4 five 6"), "line 7: \"five\" is no height");
        says(RAMP.replace("cellsize 2", "cellsize -2"), "cellsize > 0");
        says(RAMP.replace("ncols 3\n", ""), "has no ncols");
        says(RAMP.replace("1 2 3", "0 2 3"), "bottom below all heights");
    }
}
