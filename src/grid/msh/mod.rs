//! What a Gmsh file holds: `.msh` of the versions 2.2 and 4.1 (text or binary) and 4.0 (text).
//!
//! Source: Gmsh reference manual, "MSH file format" (4.1) and "Legacy formats" (2.2, 4.0).
//!
//! | idea | file |
//! |---|---|
//! | words of a text, numbers of a binary file, and where they stand | `scanner.rs` |
//! | `$Nodes`, `$ParametricNodes`, `$Elements` of 2.2 | `version2.rs` |
//! | `$Entities`, `$PartitionedEntities`, `$Nodes`, `$Elements` of 4.0 and 4.1 | `version4.rs` |
//! | element types: name, dimension, nodes | `kind.rs` |

mod kind;
mod scanner;
mod version2;
mod version4;

use rustc_hash::FxHashMap;

pub use kind::Kind;
use scanner::{Scanner, SyntaxError};

/// Nodes, elements and physical groups as the file lists them.
#[derive(Debug, Default)]
pub struct Contents {
    /// Number and place (m).
    pub nodes: Vec<(u64, [f64; 3])>,
    pub blocks: Vec<Block>,
    /// Names of physical groups by (dimension, number).
    pub names: FxHashMap<(i64, i64), String>,
}

/// Elements of one type and of the same physical groups.
#[derive(Debug)]
pub struct Block {
    pub kind: Kind,
    /// Numbers of the physical groups.
    pub groups: Vec<i64>,
    pub labels: Vec<u64>,
    /// `kind.nodes` node numbers for each element.
    pub nodes: Vec<u64>,
}

/// Layouts that differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    V2,
    V40,
    V41,
}

/// Reads the whole file.
///
/// # Errors
/// One sentence without the file's name: what was expected, what was found, and on which line.
pub fn parse(bytes: &[u8]) -> Result<Contents, String> {
    let mut scanner = Scanner::new(bytes);
    let mut contents = Contents::default();
    let mut groups = FxHashMap::default();
    let version = loop {
        match scanner.section() {
            Some(name) if name == "MeshFormat" => break header(&mut scanner)?,
            // Remarks may stand before everything else.
            Some(name) if name == "Comments" => scanner.skip(&name)?,
            _ => return Err("is not a Gmsh file: it does not start with $MeshFormat".into()),
        }
    };
    while let Some(name) = scanner.section() {
        let read = match (name.as_str(), version) {
            ("PhysicalNames", _) => physical_names(&mut scanner, &mut contents.names),
            ("Nodes" | "ParametricNodes", Version::V2) => {
                version2::nodes(&mut scanner, name == "ParametricNodes", &mut contents.nodes)
            }
            ("Elements", Version::V2) => version2::elements(&mut scanner, &mut contents.blocks),
            ("Entities" | "PartitionedEntities", _) => {
                let partitioned = name == "PartitionedEntities";
                version4::entities(&mut scanner, version, partitioned, &mut groups)
            }
            ("Nodes", _) => version4::nodes(&mut scanner, version, &mut contents.nodes),
            ("Elements", _) => {
                version4::elements(&mut scanner, version, &groups, &mut contents.blocks)
            }
            _ => {
                scanner.skip(&name)?;
                continue;
            }
        };
        read.and_then(|()| scanner.end(&name)).map_err(|fault| {
            format!("is not a valid Gmsh file: {fault} ({}, in ${name})", scanner.place())
        })?;
    }
    if contents.nodes.is_empty() {
        return Err("has no nodes: its section $Nodes is missing or empty".into());
    }
    if version == Version::V2 {
        version2::join_repeated(&mut contents.blocks);
    }
    Ok(contents)
}

/// `4.1 0 8`: version, 1 for binary, bytes of a number; in binary files then a one, from which the
/// order of the bytes is told.
fn header(scanner: &mut Scanner) -> Result<Version, String> {
    let line = scanner.line();
    let words: Vec<&str> = line.split_whitespace().collect();
    let &[number, kind, size] = words.as_slice() else {
        return Err("has a malformed line after $MeshFormat; it should read as \"4.1 0 8\"".into());
    };
    let version = match number {
        "2" | "2.0" | "2.1" | "2.2" => Version::V2,
        "4" | "4.0" => Version::V40,
        "4.1" => Version::V41,
        _ => {
            return Err(format!(
                "has Gmsh format version {number}; 2.2, 4.0 and 4.1 are read. Convert it with: \
                 gmsh OLD.msh -save -format msh41 -o NEW.msh"
            ));
        }
    };
    if !matches!(kind, "0" | "1") || size != "8" {
        return Err(format!("has the unknown file type \"{kind} {size}\""));
    }
    if kind == "1" {
        if version == Version::V40 {
            return Err("is a binary file of version 4.0; of this version text files are read. \
                        Convert it with: gmsh OLD.msh -save -format msh41 -o NEW.msh"
                .into());
        }
        scanner.binary_from_here().map_err(|fault| format!("is not a valid Gmsh file: {fault}"))?;
    }
    scanner.end("MeshFormat").map_err(|fault| format!("is not a valid Gmsh file: {fault}"))?;
    Ok(version)
}

/// Lines of dimension, number and name in quotes; text in binary files, too.
fn physical_names(
    scanner: &mut Scanner,
    names: &mut FxHashMap<(i64, i64), String>,
) -> Result<(), SyntaxError> {
    let count = scanner.text(|s| s.size())?;
    scanner.line();
    for _ in 0..count {
        let line = scanner.line();
        let mut words = line.trim().splitn(3, char::is_whitespace);
        let parsed = (|| {
            let dimension = words.next()?.parse().ok()?;
            let number = words.next()?.parse().ok()?;
            let name = words.next()?.trim();
            // One quote at each end: a name may itself end in one.
            let name = name.strip_prefix('"').and_then(|n| n.strip_suffix('"')).unwrap_or(name);
            Some(((dimension, number), name.to_string()))
        })();
        let (key, name) = parsed.ok_or_else(|| {
            SyntaxError(format!(
                "a physical name reads as `2 1 \"soil\"`, not as `{}`",
                line.trim()
            ))
        })?;
        names.insert(key, name);
    }
    Ok(())
}
