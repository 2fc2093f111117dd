//! Irregular meshes of a square, a cube or a ring: nodes off their places, diagonals at random, and
//! quadrilaterals and hexahedra by cutting such triangles and tetrahedra up, so that neither the
//! shapes of the cells nor their number at a node repeat. Written as Gmsh 4.1 files.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

pub struct Irregular {
    dimension: usize,
    /// m; z = 0 in the plane.
    nodes: Vec<[f64; 3]>,
    cells: Vec<Vec<usize>>,
    /// Which boundaries a place is on.
    sides: fn(&[f64; 3]) -> Vec<&'static str>,
}

/// Numbers between -1 and 1 that repeat with the seed (splitmix64).
struct Noise(u64);

impl Noise {
    fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn number(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Sides of a unit square or cube, named as those of a generated box.
fn of_box(x: &[f64; 3]) -> Vec<&'static str> {
    let names = [["left", "right"], ["bottom", "top"], ["back", "front"]];
    let ends = [0.0, 1.0];
    let at = |axis: usize, end: usize| (x[axis] - ends[end]).abs() < 1e-9;
    let all = (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]);
    all.filter(|&(axis, end)| at(axis, end)).map(|(axis, end)| names[axis][end]).collect()
}

const RING: [f64; 2] = [0.75, 1.25];

fn of_ring(x: &[f64; 3]) -> Vec<&'static str> {
    let radius = x[0].hypot(x[1]);
    let on = |&(_, at): &(&str, f64)| (radius - at).abs() < 1e-9;
    [("inner", RING[0]), ("outer", RING[1])].iter().filter(|side| on(side)).map(|s| s.0).collect()
}

/// A unit square, `n` by `n` squares each cut along one of its diagonals; inner nodes shifted by
/// up to `shift` of the spacing along each axis, those of a side along it.
fn plane(n: usize, shift: f64, seed: u64) -> Irregular {
    let mut noise = Noise(seed);
    let mut nodes = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            let mut place = |at: usize| {
                let by = if at.is_multiple_of(n) { 0.0 } else { shift * noise.number() };
                (at as f64 + by) / n as f64
            };
            nodes.push([place(i), place(j), 0.0]);
        }
    }
    let cells = halves(n, n, |i, j| j * (n + 1) + i, &mut noise);
    Irregular { dimension: 2, nodes, cells, sides: of_box }
}

/// Triangles of a unit square, `n` times `n` pairs.
pub fn triangles(n: usize, seed: u64) -> Irregular {
    plane(n, 0.2, seed)
}

/// Triangles between radii 0.75 and 1.25, `radial` by `around` pairs.
pub fn ring(radial: usize, around: usize, seed: u64) -> Irregular {
    let mut noise = Noise(seed);
    let mut nodes = Vec::new();
    for i in 0..=radial {
        for j in 0..around {
            let by = if i.is_multiple_of(radial) { 0.0 } else { 0.2 * noise.number() };
            let radius = RING[0] + (RING[1] - RING[0]) * (i as f64 + by) / radial as f64;
            let angle = (j as f64 + 0.2 * noise.number()) / around as f64;
            let (sin, cos) = (std::f64::consts::TAU * angle).sin_cos();
            nodes.push([radius * cos, radius * sin, 0.0]);
        }
    }
    let cells = halves(radial, around, |i, j| i * around + j % around, &mut noise);
    Irregular { dimension: 2, nodes, cells, sides: of_ring }
}

/// Quadrilaterals numbered by `at`, each cut in two along one diagonal or the other.
fn halves(
    columns: usize,
    rows: usize,
    at: impl Fn(usize, usize) -> usize,
    noise: &mut Noise,
) -> Vec<Vec<usize>> {
    let mut cells = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let [one, two] =
                if noise.number() > 0.0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            cells.extend([one.to_vec(), two.to_vec()]);
        }
    }
    cells
}

/// Tetrahedra of a unit cube: `n` layers of prisms over irregular triangles, each cut into three.
/// Its quadrilateral faces are cut from the node that comes first in a random order, so that
/// prisms which share a face agree.
pub fn tetrahedra(n: usize, seed: u64) -> Irregular {
    let base = plane(n, 0.15, seed);
    let mut noise = Noise(!seed);
    let per_layer = base.nodes.len();
    let mut nodes = Vec::new();
    for k in 0..=n {
        for &[x, y, _] in &base.nodes {
            let inside = |v: f64| v > 1e-9 && v < 1.0 - 1e-9;
            nodes.push(
                [x, y, k as f64 / n as f64]
                    .map(|v| if inside(v) { v + 0.08 * noise.number() / n as f64 } else { v }),
            );
        }
    }
    let order: Vec<u64> = nodes.iter().map(|_| noise.word()).collect();
    let mut cells = Vec::new();
    for k in 0..n {
        for triangle in &base.cells {
            let corner = |c: usize| (k + c / 3) * per_layer + triangle[c % 3];
            cells.extend(thirds(std::array::from_fn(corner), &order, &nodes));
        }
    }
    Irregular { dimension: 3, nodes, cells, sides: of_box }
}

/// Three tetrahedra of a prism with nodes 0 1 2 below 3 4 5: the triangle across from the first
/// node in `order`, and the two halves of the quadrilateral that it is not on.
fn thirds(prism: [usize; 6], order: &[u64], nodes: &[[f64; 3]]) -> [Vec<usize>; 3] {
    let first = |of: &[usize]| of.iter().copied().min_by_key(|&c| order[prism[c]]).unwrap_or(0);
    let apex = first(&[0, 1, 2, 3, 4, 5]);
    let (level, at) = (apex / 3, apex % 3);
    let corner = |level: usize, c: usize| 3 * (level % 2) + c % 3;
    let [b, c] = [corner(level, at + 1), corner(level, at + 2)];
    let [a, e, f] = [0, 1, 2].map(|k| corner(level + 1, at + k));
    let cut = first(&[b, c, e, f]);
    let [one, two] =
        if cut == b || cut == f { [[b, c, f], [b, f, e]] } else { [[c, e, b], [c, f, e]] };
    [[a, e, f], one, two].map(|[p, q, r]| {
        let mut cell = [apex, p, q, r].map(|c| prism[c]).to_vec();
        if volume(nodes, &cell) < 0.0 {
            cell.swap(2, 3);
        }
        cell
    })
}

/// Six times the volume of a tetrahedron.
fn volume(nodes: &[[f64; 3]], cell: &[usize]) -> f64 {
    let edge =
        |to: usize| -> [f64; 3] { std::array::from_fn(|a| nodes[cell[to]][a] - nodes[cell[0]][a]) };
    let [u, v, w] = [edge(1), edge(2), edge(3)];
    (0..3)
        .map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            u[i] * (v[j] * w[k] - v[k] * w[j])
        })
        .sum()
}

impl Irregular {
    /// Each triangle cut into three quadrilaterals, each tetrahedron into four hexahedra, by the
    /// middles of its edges and faces and its own.
    pub fn into_bricks(mut self) -> Self {
        let mut known = BTreeMap::new();
        let mut finer = Vec::new();
        for cell in std::mem::take(&mut self.cells) {
            let mut middle = |of: &[usize]| self.middle(&mut known, of);
            match cell[..] {
                [a, b, c] => {
                    for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
                        let centre = middle(&[a, b, c]);
                        finer.push(vec![a, middle(&[a, b]), centre, middle(&[a, c])]);
                    }
                }
                [a, b, c, d] => {
                    // Even orders keep the hexahedra right-handed.
                    for [a, b, c, d] in [[a, b, c, d], [b, a, d, c], [c, d, a, b], [d, c, b, a]] {
                        finer.push(vec![
                            a,
                            middle(&[a, b]),
                            middle(&[a, b, c]),
                            middle(&[a, c]),
                            middle(&[a, d]),
                            middle(&[a, b, d]),
                            middle(&[a, b, c, d]),
                            middle(&[a, c, d]),
                        ]);
                    }
                }
                _ => unreachable!("only simplices are cut"),
            }
        }
        self.cells = finer;
        self
    }

    /// The node in the middle of some nodes.
    fn middle(&mut self, known: &mut BTreeMap<Vec<usize>, usize>, of: &[usize]) -> usize {
        let mut key = of.to_vec();
        key.sort_unstable();
        let next = self.nodes.len();
        let at = *known.entry(key).or_insert(next);
        if at == next {
            let mean = |a| of.iter().map(|&n| self.nodes[n][a]).sum::<f64>() / of.len() as f64;
            self.nodes.push([mean(0), mean(1), mean(2)]);
        }
        at
    }

    /// Corners of a cell's faces, and Gmsh's numbers of the cell's and the faces' kinds.
    fn kind(&self) -> (&'static [&'static [usize]], usize, usize) {
        match (self.dimension, self.cells[0].len()) {
            (2, 3) => (&[&[0, 1], &[1, 2], &[2, 0]], 2, 1),
            (2, _) => (&[&[0, 1], &[1, 2], &[2, 3], &[3, 0]], 3, 1),
            (_, 4) => (&[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]], 4, 2),
            _ => (
                &[
                    &[0, 3, 2, 1],
                    &[4, 5, 6, 7],
                    &[0, 1, 5, 4],
                    &[1, 2, 6, 5],
                    &[2, 3, 7, 6],
                    &[3, 0, 4, 7],
                ],
                5,
                3,
            ),
        }
    }

    /// Outer faces by the side they are on.
    fn outer(&self) -> BTreeMap<&'static str, Vec<Vec<usize>>> {
        let (faces, ..) = self.kind();
        let mut found: BTreeMap<&'static str, Vec<Vec<usize>>> = BTreeMap::new();
        for cell in &self.cells {
            for face in faces {
                let face: Vec<usize> = face.iter().map(|&c| cell[c]).collect();
                let mut common = (self.sides)(&self.nodes[face[0]]);
                for &node in &face[1..] {
                    let sides = (self.sides)(&self.nodes[node]);
                    common.retain(|side| sides.contains(side));
                }
                if let Some(side) = common.first() {
                    found.entry(side).or_default().push(face);
                }
            }
        }
        found
    }

    /// Writes the mesh with its sides as tags, and all cells under "block".
    pub fn write(&self, path: &Path) {
        let (sides, (_, cell_kind, face_kind), d) = (self.outer(), self.kind(), self.dimension);
        let mut text = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n");
        let mut put = |line: String| writeln!(text, "{line}").expect("a string grows");
        put((sides.len() + 1).to_string());
        let block = sides.len() + 1;
        for (k, side) in sides.keys().chain([&"block"]).enumerate() {
            let dimension = if k + 1 == block { d } else { d - 1 };
            put(format!("{dimension} {} \"{side}\"", k + 1));
        }
        put("$EndPhysicalNames\n$Entities".into());
        put(if d == 2 {
            format!("0 {} 1 0", sides.len())
        } else {
            format!("0 0 {} 1", sides.len())
        });
        for k in 1..=block {
            let tag = if k == block { 1 } else { k };
            put(format!("{tag} -2 -2 -2 2 2 2 1 {k} 0"));
        }
        let count = self.nodes.len();
        put(format!("$EndEntities\n$Nodes\n1 {count} 1 {count}\n{d} 1 0 {count}"));
        (1..=count).for_each(|k| put(k.to_string()));
        self.nodes.iter().for_each(|[x, y, z]| put(format!("{x:?} {y:?} {z:?}")));
        let total = self.cells.len() + sides.values().map(Vec::len).sum::<usize>();
        put(format!("$EndNodes\n$Elements\n{block} {total} 1 {total}"));
        let mut number = 0;
        let faces = sides.values().enumerate().map(|(k, faces)| (d - 1, k + 1, face_kind, faces));
        for (dimension, entity, kind, entries) in faces.chain([(d, 1, cell_kind, &self.cells)]) {
            put(format!("{dimension} {entity} {kind} {}", entries.len()));
            for entry in entries {
                number += 1;
                let nodes: Vec<String> = entry.iter().map(|n| (n + 1).to_string()).collect();
                put(format!("{number} {}", nodes.join(" ")));
            }
        }
        put("$EndElements".into());
        std::fs::write(path, text).expect("a mesh file is written");
    }
}
