//! Is a surface closed, and do its facets face outward? Each edge of a facet has to be met by one
//! other facet in the opposite direction.

use rustc_hash::FxHashMap;

use super::{Place, cross, dot, minus};

/// In words what is wrong with a surface, if anything.
pub fn require(triangles: &[[Place; 3]]) -> Result<(), String> {
    if triangles.is_empty() {
        return Err("has no triangles".into());
    }
    let flat = |[p, q, r]: &[Place; 3]| p == q || q == r || r == p;
    if let Some(index) = triangles.iter().position(flat) {
        return Err(format!(
            "facet {} at {:?} has two equal corners: remove degenerate facets",
            index + 1,
            triangles[index][0]
        ));
    }
    // How often each edge is passed in its own direction.
    let mut passed: FxHashMap<[[u64; 3]; 2], u32> = FxHashMap::default();
    for [p, q, r] in triangles {
        for (a, b) in [(p, q), (q, r), (r, p)] {
            *passed.entry([bits(a), bits(b)]).or_default() += 1;
        }
    }
    let mut once = Vec::new();
    for (index, [p, q, r]) in triangles.iter().enumerate() {
        for (a, b) in [(p, q), (q, r), (r, p)] {
            let (own, other) =
                (passed[&[bits(a), bits(b)]], passed.get(&[bits(b), bits(a)]).copied());
            if own > 1 && other != Some(own) {
                return Err(format!(
                    "facets face to different sides: facet {} and another one pass the edge from \
                     {a:?} to {b:?} in one direction; make the normals consistent",
                    index + 1
                ));
            }
            if other.is_none() {
                once.push((a, b));
            }
        }
    }
    if let Some((a, b)) = once.first() {
        return Err(format!(
            "is open: {} edges belong to one facet only, the first from {a:?} to {b:?}; close the \
             holes, and merge corners that are to be one",
            once.len()
        ));
    }
    let volume: f64 = triangles
        .iter()
        .map(|[p, q, r]| {
            // About the first corner, so that a place far from the origin costs no digits.
            let o = &triangles[0][0];
            dot(&minus(p, o), &cross(&minus(q, o), &minus(r, o))) / 6.0
        })
        .sum();
    if volume <= 0.0 {
        return Err("its facets face inward: turn the normals over".into());
    }
    Ok(())
}

/// Zero has one sign here.
fn bits(x: &Place) -> [u64; 3] {
    x.map(|x| (x + 0.0).to_bits())
}
