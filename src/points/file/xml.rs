//! Points of a VTK XML file, .vtu or .vtp: arrays as text, as base64, or raw at the end of the file, with
//! zlib's compression or without, in either byte order. What does not fit is an error; nothing in a file
//! makes the program reserve more memory than the file itself could fill a thousand times over.

use std::io::Read;

use flate2::read::ZlibDecoder;
use quick_xml::events::{BytesStart, Event};

use super::cloud::{Array, Arrays};
use super::{Got, Refusal, wrong};

/// Compressed data grow by a factor of at most 1032.
const MOST_GROWTH: usize = 1100;

pub fn read(bytes: &[u8]) -> Got<Arrays> {
    let (text, appended) = split(bytes);
    let text = std::str::from_utf8(text);
    let Ok(text) = text else { return wrong("it is no VTK XML file: its head is no text") };
    let mut layout = Layout::default();
    let mut found = Arrays::default();
    // What the elements around say, and the array that is open.
    let (mut kind, mut group) = (String::new(), String::new());
    let mut pieces = 0;
    let mut open: Option<Header> = None;
    let mut reader = quick_xml::Reader::from_str(text);
    reader.config_mut().check_end_names = false;
    loop {
        match reader.read_event() {
            Err(reason) => return wrong(format!("it is no VTK XML file: {reason}")),
            Ok(Event::Eof) => break,
            Ok(Event::Start(element)) => match element.name().as_ref() {
                "VTKFile" => {
                    layout = Layout::of(&element)?;
                    kind = attribute(&element, "type").unwrap_or_default();
                }
                "Piece" => pieces += 1,
                "PointData" | "Points" | "CellData" | "Cells" | "FieldData" => {
                    group = element.name().as_ref().to_string();
                }
                "DataArray" if wanted(&group) => open = Some(Header::of(&element)?),
                _ => {}
            },
            Ok(Event::Empty(element)) => match element.name().as_ref() {
                "DataArray" if wanted(&group) => {
                    let header = Header::of(&element)?;
                    take(&mut found, &group, pieces, &header, &layout, None, appended)?;
                }
                "PointData" | "Points" => group.clear(),
                _ => {}
            },
            Ok(Event::Text(content)) => {
                if let Some(header) = open.take() {
                    let inline = Some(content.as_bytes());
                    take(&mut found, &group, pieces, &header, &layout, inline, appended)?;
                }
            }
            Ok(Event::End(element)) => match element.name().as_ref() {
                "DataArray" => {
                    if let Some(header) = open.take() {
                        take(&mut found, &group, pieces, &header, &layout, None, appended)?;
                    }
                }
                "PointData" | "Points" | "CellData" | "Cells" | "FieldData" => group.clear(),
                _ => {}
            },
            Ok(_) => {}
        }
    }
    match &kind[..] {
        "UnstructuredGrid" | "PolyData" => Ok(found),
        "" => wrong("it is no VTK XML file: it has no VTKFile"),
        kind => wrong(format!("it holds a {kind}; expected an UnstructuredGrid or PolyData")),
    }
}

fn wanted(group: &str) -> bool {
    matches!(group, "PointData" | "Points")
}

/// The head, which is XML, and the data behind it: what follows the underscore of AppendedData.
fn split(bytes: &[u8]) -> (&[u8], Option<Appended<'_>>) {
    let mark = b"<AppendedData";
    let Some(at) = bytes.windows(mark.len()).position(|part| part == mark) else {
        return (bytes, None);
    };
    let behind = &bytes[at..];
    let end = behind.iter().position(|byte| *byte == b'>').unwrap_or(behind.len());
    let raw = behind[..end].windows(3).any(|part| part == b"raw");
    let start = behind[end..].iter().position(|byte| *byte == b'_');
    let data = start.map_or(&[][..], |start| &behind[end + start + 1..]);
    (&bytes[..at], Some(Appended { raw, data }))
}

#[derive(Clone, Copy)]
struct Appended<'a> {
    raw: bool,
    data: &'a [u8],
}

/// How numbers are stored.
#[derive(Default)]
struct Layout {
    big_endian: bool,
    /// Bytes of a number that is a length.
    count: usize,
    zlib: bool,
}

impl Layout {
    fn of(element: &BytesStart<'_>) -> Got<Self> {
        let compressor = attribute(element, "compressor").unwrap_or_default();
        if !matches!(&compressor[..], "" | "vtkZLibDataCompressor") {
            return wrong(format!(
                "it is compressed by {compressor}; expected vtkZLibDataCompressor or no compression"
            ));
        }
        Ok(Layout {
            big_endian: attribute(element, "byte_order").is_some_and(|word| word == "BigEndian"),
            count: match attribute(element, "header_type").as_deref() {
                Some("UInt64") => 8,
                _ => 4,
            },
            zlib: !compressor.is_empty(),
        })
    }

    /// The length at the beginning of `bytes`, and the rest.
    fn length<'b>(&self, bytes: &'b [u8]) -> Got<(usize, &'b [u8])> {
        let Some((own, rest)) = bytes.split_at_checked(self.count) else { return cut_short() };
        let mut all = [0; 8];
        if self.big_endian {
            all[8 - self.count..].copy_from_slice(own);
            Ok((u64::from_be_bytes(all) as usize, rest))
        } else {
            all[..self.count].copy_from_slice(own);
            Ok((u64::from_le_bytes(all) as usize, rest))
        }
    }

    /// The bytes of an array from those of the file.
    fn content(&self, bytes: &[u8]) -> Got<Vec<u8>> {
        let (first, mut rest) = self.length(bytes)?;
        if !self.zlib {
            return rest.get(..first).map_or_else(cut_short, |own| Ok(own.to_vec()));
        }
        let (blocks, block, last);
        (blocks, (block, rest)) = (first, self.length(rest)?);
        (last, rest) = self.length(rest)?;
        let mut sizes = Vec::new();
        for _ in 0..blocks {
            let (size, behind) = self.length(rest)?;
            sizes.push(size);
            rest = behind;
        }
        let mut content = Vec::new();
        for (at, size) in sizes.iter().enumerate() {
            let Some((own, behind)) = rest.split_at_checked(*size) else { return cut_short() };
            rest = behind;
            let whole = if at + 1 == blocks && last > 0 { last } else { block };
            if whole > size.saturating_mul(MOST_GROWTH).saturating_add(1 << 16) {
                return cut_short();
            }
            let before = content.len();
            let read = ZlibDecoder::new(own).take(whole as u64).read_to_end(&mut content);
            if read.is_err() || content.len() - before != whole {
                return wrong("an array of it cannot be unpacked");
            }
        }
        Ok(content)
    }
}

fn cut_short<T>() -> Got<T> {
    wrong("an array of it is cut short")
}

/// What the element of an array says.
struct Header {
    name: String,
    kind: String,
    columns: usize,
    format: String,
    offset: usize,
}

impl Header {
    fn of(element: &BytesStart<'_>) -> Got<Self> {
        let number = |name: &str, other: usize| -> Got<usize> {
            let Some(text) = attribute(element, name) else { return Ok(other) };
            let number = text.trim().parse();
            number.map_err(|_| Refusal::Wrong(None, format!("{name} = \"{text}\" is no number")))
        };
        Ok(Header {
            name: attribute(element, "Name").unwrap_or_default(),
            kind: attribute(element, "type").unwrap_or_default(),
            columns: number("NumberOfComponents", 1)?.max(1),
            format: attribute(element, "format").unwrap_or_else(|| "ascii".into()),
            offset: number("offset", 0)?,
        })
    }
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = element.attributes().flatten().find(|own| own.key.as_ref() == name)?;
    Some(found.value.into_owned())
}

/// Adds an array to what has been found. Pieces follow each other.
fn take(
    found: &mut Arrays,
    group: &str,
    pieces: usize,
    header: &Header,
    layout: &Layout,
    inline: Option<&[u8]>,
    appended: Option<Appended<'_>>,
) -> Got<()> {
    let inline = inline.unwrap_or_default();
    let values = match &header.format[..] {
        "ascii" => ascii(inline, header)?,
        "binary" => numbers(&layout.content(&from_base64(inline))?, header, layout)?,
        "appended" => {
            let Some(Appended { raw, data }) = appended else {
                return wrong("it has no AppendedData, which its arrays name");
            };
            let Some(own) = data.get(header.offset..) else { return cut_short() };
            match raw {
                true => numbers(&layout.content(own)?, header, layout)?,
                false => numbers(&layout.content(&from_base64(own))?, header, layout)?,
            }
        }
        format => {
            return wrong(format!("array \"{}\" has the unknown format {format}", header.name));
        }
    };
    if group == "Points" {
        found.places.extend(values);
        return Ok(());
    }
    match found.arrays.iter_mut().find(|array| array.name == header.name) {
        Some(array) if array.columns == header.columns && pieces > 1 => array.values.extend(values),
        Some(_) => return wrong(format!("array \"{}\" is there twice", header.name)),
        None => {
            let (name, columns) = (header.name.clone(), header.columns);
            found.arrays.push(Array { name, columns, values });
        }
    }
    Ok(())
}

fn ascii(text: &[u8], header: &Header) -> Got<Vec<f64>> {
    let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let number = |word: &[u8]| -> Got<f64> {
        let text = String::from_utf8_lossy(word);
        text.parse().map_err(|_| {
            Refusal::Wrong(None, format!("\"{text}\" in array \"{}\" is no number", header.name))
        })
    };
    words.map(number).collect()
}

fn numbers(bytes: &[u8], header: &Header, layout: &Layout) -> Got<Vec<f64>> {
    match numbers_of(bytes, &header.kind, layout.big_endian) {
        Some(values) => Ok(values),
        // Texts and the like: nobody asks for them.
        None => Ok(Vec::new()),
    }
}

/// Numbers of a VTK type; `None` for another type.
pub fn numbers_of(bytes: &[u8], kind: &str, big_endian: bool) -> Option<Vec<f64>> {
    macro_rules! read {
        ($kind:ty) => {
            bytes
                .chunks_exact(size_of::<$kind>())
                .map(|own| {
                    let own = own.try_into().unwrap_or_default();
                    let value = if big_endian {
                        <$kind>::from_be_bytes(own)
                    } else {
                        <$kind>::from_le_bytes(own)
                    };
                    value as f64
                })
                .collect()
        };
    }
    Some(match kind {
        "Float64" | "double" => read!(f64),
        "Float32" | "float" => read!(f32),
        "Int8" | "char" => read!(i8),
        "UInt8" | "unsigned_char" => read!(u8),
        "Int16" | "short" => read!(i16),
        "UInt16" | "unsigned_short" => read!(u16),
        "Int32" | "int" => read!(i32),
        "UInt32" | "unsigned_int" => read!(u32),
        "Int64" | "long" | "vtktypeint64" | "vtkIdType" => read!(i64),
        "UInt64" | "unsigned_long" | "vtktypeuint64" => read!(u64),
        _ => return None,
    })
}

/// Decodes up to what is no base64; padding may stand in the middle, where a length ends.
fn from_base64(text: &[u8]) -> Vec<u8> {
    let value = |byte: u8| match byte {
        b'A'..=b'Z' => Some(byte - b'A'),
        b'a'..=b'z' => Some(byte - b'a' + 26),
        b'0'..=b'9' => Some(byte - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let letters: Vec<u8> = text
        .iter()
        .copied()
        .filter(|byte| !byte.is_ascii_whitespace())
        .take_while(|byte| value(*byte).is_some() || *byte == b'=')
        .collect();
    for four in letters.chunks_exact(4) {
        let known = four.iter().take_while(|byte| **byte != b'=').count();
        let bits =
            four.iter().fold(0_u32, |bits, byte| bits << 6 | u32::from(value(*byte).unwrap_or(0)));
        let three = bits.to_be_bytes();
        bytes.extend_from_slice(&three[1..known.max(1)]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_with_padding_in_the_middle() {
        assert_eq!(from_base64(b" TQ==TWE=TWFu\n</"), b"MMaMan");
        assert_eq!(from_base64(b""), b"");
    }

    #[test]
    fn text_and_base64_are_read_and_wrong_files_refused() {
        // One point at (1, 2, 3) as text, its volume 0.25 as base64 with a length of four bytes.
        let good = "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\"><UnstructuredGrid>\
            <Piece NumberOfPoints=\"1\" NumberOfCells=\"0\"><PointData>\
            <DataArray type=\"Float64\" Name=\"volume\" format=\"binary\">CAAAAAAAAAAAANA/</DataArray>\
            </PointData><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">\
            1 2 3</DataArray></Points></Piece></UnstructuredGrid></VTKFile>";
        let found = read(good.as_bytes()).ok().expect("it is read");
        assert_eq!(found.places, [1.0, 2.0, 3.0]);
        let volume = Array { name: "volume".into(), columns: 1, values: vec![0.25] };
        assert_eq!(found.arrays, [volume]);
        for (from, to, why) in [
            ("UnstructuredGrid\" b", "ImageData\" b", "holds a ImageData"),
            ("CAAAAAAA", "EAAAAAAA", "cut short"),
            ("1 2 3", "1 two 3", "is no number"),
            ("VTKFile", "VTX", "no VTKFile"),
            ("byte_order", "compressor=\"vtkLZ4DataCompressor\" byte_order", "vtkLZ4"),
        ] {
            let Err(Refusal::Wrong(None, what)) = read(good.replace(from, to).as_bytes()) else {
                panic!("{to} is taken");
            };
            assert!(what.contains(why), "{what}");
        }
    }
}
