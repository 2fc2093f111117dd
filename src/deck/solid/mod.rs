//! Solids bounded by triangles: from an STL file, or below a terrain.
//!
//! | file | idea |
//! |---|---|
//! | `mod.rs` | the solid, and which places are inside |
//! | `stl.rs` | the two kinds of STL file |
//! | `terrain.rs` | the ground below a grid of heights |
//! | `closed.rs` | is the surface closed, and do its facets face outward? |
//! | `meeting.rs` | do facets cut each other? |
//! | `nearest.rs` | the place of the surface nearest to another |
//! | `boxes.rs` | a tree of boxes around the triangles |
//!
//! A place is inside where its winding number is not zero: the crossings of a ray with the facets,
//! counted by the direction in which they face. Edges and corners that the ray meets are given to one
//! facet by moving the ray by an infinitely small step, so that a closed surface has no gaps.

mod boxes;
mod closed;
mod meeting;
mod nearest;
pub(crate) mod stl;
pub(crate) mod terrain;

use std::path::{Path, PathBuf};

use boxes::Boxes;
pub use nearest::Feature;

use super::crossing::Side;

pub type Place = [f64; 3];

/// A closed surface of triangles whose corners run counter-clockwise as seen from outside.
#[derive(Debug)]
pub struct Solid {
    /// The file that it came from.
    pub path: PathBuf,
    /// What the file's lengths were multiplied by.
    pub scale: f64,
    /// What is below a terrain reaches down to this height, m; `None` for an STL file.
    pub bottom: Option<f64>,
    pub triangles: Vec<[Place; 3]>,
    boxes: Boxes,
}

impl PartialEq for Solid {
    fn eq(&self, other: &Self) -> bool {
        (&self.path, self.bottom) == (&other.path, other.bottom)
            && self.triangles == other.triangles
    }
}

impl Solid {
    /// Error: the surface is open, its facets face inward or to different sides, or it cuts itself; in
    /// words, with places.
    pub fn new(
        path: &Path,
        bottom: Option<f64>,
        triangles: Vec<[Place; 3]>,
    ) -> Result<Self, String> {
        closed::require(&triangles)?;
        let boxes = Boxes::new(&triangles);
        meeting::require_none(&triangles, &boxes)?;
        Ok(Solid { path: path.to_path_buf(), scale: 1.0, bottom, triangles, boxes })
    }

    /// Of a file whose lengths are `1 / scale` times those of the deck. Errors as of [`Solid::new`].
    pub fn scaled(path: &Path, triangles: &[[Place; 3]], scale: f64) -> Result<Self, String> {
        let larger = |corners: &[Place; 3]| corners.map(|place| place.map(|x| x * scale));
        let triangles = triangles.iter().map(larger).collect();
        Ok(Solid { scale, ..Solid::new(path, None, triangles)? })
    }

    /// The box between two corners.
    #[cfg(test)]
    pub fn cuboid(path: &Path, min: Place, max: Place) -> Self {
        Solid::new(path, None, tests::cuboid(min, max)).expect("a closed surface")
    }

    /// The same as if it had come from another file.
    pub fn renamed(&self, path: PathBuf) -> Self {
        let triangles = self.triangles.clone();
        let boxes = Boxes::new(&triangles);
        Solid { path, scale: self.scale, bottom: self.bottom, triangles, boxes }
    }

    /// Lowest and highest coordinates, m.
    pub fn bounds(&self) -> (Place, Place) {
        self.boxes.bounds()
    }

    /// By the winding number.
    pub fn contains(&self, x: &Place) -> bool {
        let (low, high) = self.bounds();
        if (0..3).any(|a| x[a] < low[a] || x[a] > high[a]) {
            return false;
        }
        // A ray along the first axis.
        let ahead = |min: &Place, max: &Place| {
            max[0] >= x[0] && (1..3).all(|a| min[a] <= x[a] && x[a] <= max[a])
        };
        let mut winding = 0;
        self.boxes.visit(ahead, |index| winding += crossed(&self.triangles[index], x));
        winding != 0
    }

    /// How a box of these half lengths lies to it. `Cut` is always possible.
    pub fn side(&self, centre: &Place, half: &Place) -> Side {
        let mut cut = false;
        let overlaps = |min: &Place, max: &Place| {
            (0..3).all(|a| min[a] <= centre[a] + half[a] && centre[a] - half[a] <= max[a])
        };
        self.boxes.visit(overlaps, |index| {
            let [p, q, r] = &self.triangles[index];
            let end = |pick: fn(f64, f64) -> f64| -> Place {
                std::array::from_fn(|a| pick(pick(p[a], q[a]), r[a]))
            };
            cut |= overlaps(&end(f64::min), &end(f64::max));
        });
        match (cut, cut || self.contains(centre)) {
            (true, _) => Side::Cut,
            (false, true) => Side::Inside,
            (false, false) => Side::Outside,
        }
    }

    /// Appends every t at which the line a + t d may cross the surface between t = 0 and 1.
    pub fn crossings(&self, a: &Place, d: &Place, out: &mut Vec<f64>) {
        let near = |min: &Place, max: &Place| {
            (0..3).all(|k| {
                let (p, q) = (a[k].min(a[k] + d[k]), a[k].max(a[k] + d[k]));
                min[k] <= q && p <= max[k]
            })
        };
        self.boxes.visit(near, |index| {
            let [p, q, r] = &self.triangles[index];
            let normal = cross(&minus(q, p), &minus(r, p));
            let slope = dot(&normal, d);
            // Of facets along the line those beside them tell where it enters.
            if slope != 0.0 {
                out.push(dot(&normal, &minus(p, a)) / slope);
            }
        });
    }
}

/// 1 if a ray from `x` along the first axis leaves through a triangle, -1 if it enters, 0 if it does
/// not meet it.
fn crossed(triangle: &[Place; 3], x: &Place) -> i32 {
    let side = |k: usize| beside(&triangle[k], &triangle[(k + 1) % 3], x);
    let first = side(0);
    if side(1) != first || side(2) != first {
        return 0;
    }
    // Where the plane of the triangle is met.
    let [p, q, r] = triangle;
    let normal = cross(&minus(q, p), &minus(r, p));
    if normal[0] == 0.0 {
        return 0;
    }
    let along = dot(&normal, &minus(p, x)) / normal[0];
    if along < 0.0 {
        0
    } else if first {
        1
    } else {
        -1
    }
}

/// Whether `x` lies left of the edge from `a` to `b`, all seen along the first axis; a place on it is
/// moved by (e, e^2) with an infinitely small e. The same arithmetic for both directions of an edge.
fn beside(a: &Place, b: &Place, x: &Place) -> bool {
    let turned = (a[1], a[2], a[0]) > (b[1], b[2], b[0]);
    let (a, b) = if turned { (b, a) } else { (a, b) };
    let (u, v) = (b[1] - a[1], b[2] - a[2]);
    let product = u * (x[2] - a[2]) - v * (x[1] - a[1]);
    let left = if product != 0.0 {
        product > 0.0
    } else if v != 0.0 {
        v < 0.0
    } else {
        u > 0.0
    };
    left != turned
}

fn minus(a: &Place, b: &Place) -> Place {
    std::array::from_fn(|i| a[i] - b[i])
}

fn cross(a: &Place, b: &Place) -> Place {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: &Place, b: &Place) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// The surface of the box between two corners.
    pub fn cuboid(min: Place, max: Place) -> Vec<[Place; 3]> {
        let at = |k: usize| -> Place {
            std::array::from_fn(|a| if k >> a & 1 == 0 { min[a] } else { max[a] })
        };
        let faces =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let two = |[a, b, c, d]: [usize; 4]| [[at(a), at(b), at(c)], [at(a), at(c), at(d)]];
        faces.into_iter().flat_map(two).collect()
    }

    fn solid(triangles: Vec<[Place; 3]>) -> Result<Solid, String> {
        Solid::new(Path::new("a.stl"), None, triangles)
    }

    /// Rays through edges, corners and the diagonals of faces are counted once.
    #[test]
    fn places_are_inside_by_their_winding_number() {
        let cube = solid(cuboid([0.0; 3], [1.0, 2.0, 4.0])).expect("closed");
        for x in [[0.5, 1.0, 2.0], [0.25, 0.5, 1.0], [0.1, 1.0, 3.9], [0.999, 1e-9, 1e-9]] {
            assert!(cube.contains(&x), "{x:?}");
        }
        for x in [[-0.5, 1.0, 2.0], [-1e-9, 1.0, 2.0], [0.5, 1.0, 4.1], [1.1, 0.0, 0.0]] {
            assert!(!cube.contains(&x), "{x:?}");
        }
        assert_eq!(cube.side(&[0.5, 1.0, 2.0], &[0.4; 3]), Side::Inside);
        assert_eq!(cube.side(&[0.5, 1.0, 2.0], &[0.6; 3]), Side::Cut);
        assert_eq!(cube.side(&[2.5, 1.0, 2.0], &[0.6; 3]), Side::Outside);
        let mut crossings = Vec::new();
        cube.crossings(&[-1.0, 0.7, 0.9], &[4.0, 0.0, 0.0], &mut crossings);
        crossings.sort_by(f64::total_cmp);
        crossings.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
        assert_eq!(crossings, [0.25, 0.5]);
    }

    #[test]
    fn surfaces_that_bound_nothing_are_named() {
        let says = |triangles: Vec<[Place; 3]>, words: &str| {
            let text = solid(triangles).expect_err("a fault");
            assert!(text.contains(words), "{text}");
        };
        let cube = || cuboid([0.0; 3], [1.0; 3]);
        let mut open = cube();
        open.pop();
        says(open, "is open");
        let mut turned = cube();
        turned[3].swap(0, 1);
        says(turned, "face to different sides");
        let mut inward = cube();
        inward.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        says(inward, "face inward");
        let mut two = cube();
        two.extend(cuboid([0.5, 0.25, 0.3], [1.5, 0.6, 0.7]));
        says(two, "cut each other");
        says(Vec::new(), "no triangles");
        // Two bodies apart, and one inside the hole of another, are fine.
        let mut apart = cube();
        apart.extend(cuboid([2.0; 3], [3.0; 3]));
        assert!(solid(apart).expect("two closed surfaces").contains(&[2.5; 3]));
        let mut hollow = cube();
        let mut hole = cuboid([0.25; 3], [0.75; 3]);
        hole.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        hollow.extend(hole);
        let hollow = solid(hollow).expect("closed");
        assert!(hollow.contains(&[0.1; 3]) && !hollow.contains(&[0.5; 3]));
    }
}
