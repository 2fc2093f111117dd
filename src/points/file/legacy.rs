//! Points of a legacy VTK file, .vtk, text or binary: UNSTRUCTURED_GRID and POLYDATA of the versions 2 to 5.

use super::cloud::{Array, Arrays};
use super::xml::numbers_of;
use super::{Got, Refusal, wrong};

pub fn read(bytes: &[u8]) -> Got<Arrays> {
    let mut lines = bytes.splitn(4, |byte| *byte == b'\n');
    let (version, _title, format, rest) = (lines.next(), lines.next(), lines.next(), lines.next());
    let is_vtk = version.is_some_and(|line| line.starts_with(b"# vtk DataFile"));
    let (true, Some(format), Some(rest)) = (is_vtk, format, rest) else {
        return wrong("it is no VTK file: it does not begin with \"# vtk DataFile\"");
    };
    let binary = match format.trim_ascii() {
        b"ASCII" => false,
        b"BINARY" => true,
        _ => return wrong("its third line must be ASCII or BINARY"),
    };
    let mut input = Input { rest, binary };
    let mut found = Arrays::default();
    // Rows of the data that follow; of cells they are passed over.
    let (mut rows, mut of_points) = (0, false);
    while let Some(word) = input.word() {
        match &word.to_ascii_uppercase()[..] {
            "DATASET" => {
                let kind = input.needed()?;
                if !["UNSTRUCTURED_GRID", "POLYDATA"].contains(&&kind.to_ascii_uppercase()[..]) {
                    return wrong(format!(
                        "it holds a {kind}; expected an UNSTRUCTURED_GRID or POLYDATA"
                    ));
                }
            }
            "POINTS" => {
                let count = input.count()?;
                let kind = input.needed()?;
                found.places = input.values(count.saturating_mul(3), &kind)?;
            }
            "CELLS" | "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS" => {
                let (first, second) = (input.count()?, input.count()?);
                let before = input.rest;
                // Version 5 has two arrays, earlier ones a single one.
                if input.word().is_some_and(|word| word == "OFFSETS") {
                    let kind = input.needed()?;
                    input.values(first, &kind)?;
                    let (_, kind) = (input.needed()?, input.needed()?);
                    input.values(second, &kind)?;
                } else {
                    input.rest = before;
                    input.values(second, "int")?;
                }
            }
            "CELL_TYPES" => {
                let count = input.count()?;
                input.values(count, "int")?;
            }
            "POINT_DATA" => (rows, of_points) = (input.count()?, true),
            "CELL_DATA" => (rows, of_points) = (input.count()?, false),
            "SCALARS" => {
                let (name, kind) = (input.needed()?, input.needed()?);
                let before = input.rest;
                let word = input.needed()?;
                let columns = match word.parse() {
                    Ok(columns) => columns,
                    Err(_) => {
                        input.rest = before;
                        1
                    }
                };
                let before = input.rest;
                if input.word().is_some_and(|word| word == "LOOKUP_TABLE") {
                    input.needed()?;
                } else {
                    input.rest = before;
                }
                let values = input.values(rows.saturating_mul(columns), &kind)?;
                add(&mut found, of_points, Array { name, columns, values });
            }
            "VECTORS" | "NORMALS" | "TENSORS" => {
                let (name, kind) = (input.needed()?, input.needed()?);
                let columns = if word.eq_ignore_ascii_case("TENSORS") { 9 } else { 3 };
                let values = input.values(rows.saturating_mul(columns), &kind)?;
                add(&mut found, of_points, Array { name, columns, values });
            }
            "LOOKUP_TABLE" => {
                let (_, count) = (input.needed()?, input.count()?);
                input.values(count.saturating_mul(4), "unsigned_char")?;
            }
            "FIELD" => {
                let (_, count) = (input.needed()?, input.count()?);
                for _ in 0..count {
                    let mut name = input.needed()?;
                    while name == "METADATA" {
                        input.skip_paragraph();
                        name = input.needed()?;
                    }
                    let (columns, tuples) = (input.count()?, input.count()?);
                    let kind = input.needed()?;
                    let values = input.values(columns.saturating_mul(tuples), &kind)?;
                    // A field before any data belongs to the file.
                    add(&mut found, of_points, Array { name, columns, values });
                }
            }
            "METADATA" => input.skip_paragraph(),
            _ => return wrong(format!("unknown word \"{word}\"")),
        }
    }
    Ok(found)
}

fn add(found: &mut Arrays, of_points: bool, array: Array) {
    if of_points {
        found.arrays.push(array);
    }
}

/// What has not been read yet.
struct Input<'a> {
    rest: &'a [u8],
    binary: bool,
}

impl Input<'_> {
    fn word(&mut self) -> Option<String> {
        let start = self.rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let from = &self.rest[start..];
        let end = from.iter().position(u8::is_ascii_whitespace).unwrap_or(from.len());
        self.rest = &from[end..];
        Some(String::from_utf8_lossy(&from[..end]).into_owned())
    }

    fn needed(&mut self) -> Got<String> {
        self.word().map_or_else(|| wrong("it is cut short"), Ok)
    }

    fn count(&mut self) -> Got<usize> {
        let word = self.needed()?;
        let none = |_| Refusal::Wrong(None, format!("\"{word}\" where a count was expected"));
        word.parse().map_err(none)
    }

    /// So many numbers of a type.
    fn values(&mut self, count: usize, kind: &str) -> Got<Vec<f64>> {
        if !self.binary {
            let mut values = Vec::new();
            for _ in 0..count {
                let word = self.needed()?;
                let none =
                    |_| Refusal::Wrong(None, format!("\"{word}\" where a number was expected"));
                values.push(word.parse().map_err(none)?);
            }
            return Ok(values);
        }
        let Some(one) = numbers_of(&[0; 8], kind, true).map(|values| 8 / values.len()) else {
            return wrong(format!("numbers of the unknown type {kind}"));
        };
        let start = self.rest.iter().position(|byte| *byte == b'\n').map_or(0, |at| at + 1);
        let end = count.checked_mul(one).and_then(|length| length.checked_add(start));
        let Some(own) = end.and_then(|end| self.rest.get(start..end)) else {
            return wrong("it is cut short");
        };
        self.rest = &self.rest[start + own.len()..];
        Ok(numbers_of(own, kind, true).unwrap_or_default())
    }

    /// To behind the next empty line.
    fn skip_paragraph(&mut self) {
        let end = self.rest.windows(2).position(|two| two == b"\n\n");
        self.rest = end.map_or(&[], |at| &self.rest[at + 2..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# vtk DataFile Version 2.0\npoints\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n\
        0 0 0\n1 0.5 0\nVERTICES 2 4\n1 0\n1 1\nPOINT_DATA 2\nSCALARS volume double\n\
        LOOKUP_TABLE default\n0.5 0.25\nVECTORS velocity float\n1 2 0 3 4 0\n";

    #[test]
    fn a_text_is_read() {
        let found = read(TEXT.as_bytes()).ok().expect("it is read");
        assert_eq!(found.places, [0.0, 0.0, 0.0, 1.0, 0.5, 0.0]);
        assert_eq!(found.arrays[0].values, [0.5, 0.25]);
        assert_eq!((found.arrays[1].columns, &found.arrays[1].name[..]), (3, "velocity"));
    }

    #[test]
    fn binary_numbers_are_read() {
        let mut bytes =
            b"# vtk DataFile Version 5.1\nx\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 double\n"
                .to_vec();
        for x in [1.5_f64, -2.0, 0.0] {
            bytes.extend(x.to_be_bytes());
        }
        bytes.extend(b"\nCELLS 2 1\nOFFSETS vtktypeint64\n");
        for n in [0_i64, 1] {
            bytes.extend(n.to_be_bytes());
        }
        bytes.extend(b"\nCONNECTIVITY vtktypeint64\n");
        bytes.extend(0_i64.to_be_bytes());
        bytes.extend(b"\nCELL_TYPES 1\n");
        bytes.extend(1_i32.to_be_bytes());
        bytes.extend(b"\nPOINT_DATA 1\nFIELD FieldData 1\nvolume 1 1 float\n");
        bytes.extend(0.125_f32.to_be_bytes());
        bytes.extend(b"\nMETADATA\nINFORMATION 0\n\n");
        let found = read(&bytes).ok().expect("it is read");
        assert_eq!(found.places, [1.5, -2.0, 0.0]);
        assert_eq!(found.arrays[0].values, [0.125]);
        // Any beginning of it ends with a message, or lacks only what comes last.
        for end in 0..bytes.len() {
            let _ = read(&bytes[..end]);
        }
    }

    #[test]
    fn wrong_files_are_refused() {
        for (from, to, why) in [
            ("# vtk", "# obj", "does not begin"),
            ("ASCII", "TEXT", "ASCII or BINARY"),
            ("POLYDATA", "STRUCTURED_POINTS", "holds a STRUCTURED_POINTS"),
            ("1 0.5 0", "1 x 0", "\"x\" where a number"),
            ("1 2 0 3 4 0", "1 2 0", "cut short"),
            ("VERTICES", "CORNERS", "unknown word \"CORNERS\""),
        ] {
            let Err(Refusal::Wrong(None, what)) = read(TEXT.replace(from, to).as_bytes()) else {
                panic!("{to} is taken");
            };
            assert!(what.contains(why), "{what}");
        }
    }
}
