//! STL files: text (`solid ... facet ... vertex x y z`) and binary (80 bytes, a count, 50 bytes a
//! facet).

use super::Place;

/// Bytes before the facets of a binary file, and of each facet.
const HEAD: usize = 84;
const FACET: usize = 50;

/// The triangles of a file. Error, in words: it is neither kind, or broken, with its line or facet.
pub fn read(bytes: &[u8]) -> Result<Vec<[Place; 3]>, String> {
    // A binary file may begin with the word of a text, so that its length decides.
    let count = bytes.get(80..HEAD).map(|n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    if let Some(count) = count
        && count.checked_mul(FACET).map(|size| size + HEAD) == Some(bytes.len())
    {
        return binary(&bytes[HEAD..]);
    }
    match std::str::from_utf8(bytes) {
        Ok(text) if text.trim_start().starts_with("solid") => of_text(text),
        _ => Err(match count {
            Some(count) => format!(
                "is no STL file: it does not begin with \"solid\", and a binary one of {count} \
                 triangles would have {} bytes, not {}",
                HEAD as u64 + FACET as u64 * count as u64,
                bytes.len()
            ),
            None => "is no STL file: it is too short".into(),
        }),
    }
}

fn binary(facets: &[u8]) -> Result<Vec<[Place; 3]>, String> {
    let number = |bytes: &[u8], at: usize| {
        let at = 4 * at;
        f64::from(f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
    };
    let facet = |(index, bytes): (usize, &[u8])| {
        // The normal comes first; the order of the corners says the same.
        let corner = |k: usize| std::array::from_fn(|a| number(bytes, 3 * k + 3 + a));
        let triangle: [Place; 3] = std::array::from_fn(corner);
        match triangle.as_flattened().iter().all(|x| x.is_finite()) {
            true => Ok(triangle),
            false => Err(format!("facet {}: a coordinate is not finite", index + 1)),
        }
    };
    facets.chunks_exact(FACET).enumerate().map(facet).collect()
}

fn of_text(text: &str) -> Result<Vec<[Place; 3]>, String> {
    let mut triangles = Vec::new();
    let mut corners: Vec<Place> = Vec::new();
    for (line, content) in text.lines().enumerate() {
        let mut words = content.split_whitespace();
        let wrong = |what: &str| Err(format!("line {}: {what}", line + 1));
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("vertex") => {
                let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
                match numbers[..] {
                    [x, y, z] if [x, y, z].iter().all(|x| x.is_finite()) => {
                        corners.push([x, y, z]);
                    }
                    _ => return wrong("expected vertex with three numbers"),
                }
            }
            Some("endloop") => match corners[..] {
                [a, b, c] => {
                    triangles.push([a, b, c]);
                    corners.clear();
                }
                _ => return wrong("expected three vertices in a facet"),
            },
            None | Some("solid" | "facet" | "outer" | "endfacet" | "endsolid") => {}
            Some(_) => {
                return wrong("expected facet, outer loop, vertex, endloop, endfacet or endsolid");
            }
        }
    }
    match corners.is_empty() {
        true => Ok(triangles),
        false => Err("ends within a facet".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::cuboid;
    use super::*;

    pub fn as_text(triangles: &[[Place; 3]]) -> String {
        let mut text = String::from("solid a\n");
        for corners in triangles {
            text.push_str(" facet normal 0 0 0\n  outer loop\n");
            corners.iter().for_each(|[x, y, z]| text.push_str(&format!("   vertex {x} {y} {z}\n")));
            text.push_str("  endloop\n endfacet\n");
        }
        text + "endsolid a\n"
    }

    #[test]
    fn both_kinds_give_the_triangles() {
        let triangles = cuboid([0.0; 3], [1.0, 0.5, 2.0]);
        let text = as_text(&triangles);
        assert_eq!(read(text.as_bytes()).expect("text"), triangles);
        let mut bytes = b"solid by its name".to_vec();
        bytes.resize(80, b' ');
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for corners in &triangles {
            bytes.extend([0; 12]);
            for x in corners.as_flattened() {
                bytes.extend((*x as f32).to_le_bytes());
            }
            bytes.extend([0; 2]);
        }
        assert_eq!(read(&bytes).expect("binary"), triangles);
        let says = |bytes: &[u8], words: &str| {
            let why = read(bytes).expect_err("a fault");
            assert!(why.contains(words), "{why}");
        };
        says(&bytes[..bytes.len() - 1], "would have 684 bytes, not 683");
        says(b"facets", "too short");
        says(b"PK\x03\x04 and more than eighty bytes of something else, that is no triangle at all, nor a text of it", "is no STL file");
        says(text.replacen("vertex 1", "vertex one", 1).as_bytes(), "three numbers");
        says(text.replacen("endloop", "loop", 1).as_bytes(), "expected facet");
        says(&text.as_bytes()[..74], "ends within a facet");
    }
}
