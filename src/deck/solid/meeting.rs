//! Do facets cut each other? An edge of one that goes through the inside of another.

use super::boxes::Boxes;
use super::{Place, cross, dot, minus};

/// An edge goes through a facet if it reaches beyond it by more than this share of its own length and of
/// the facet's sides. Facets that only touch are fine.
const CLEARLY: f64 = 1e-9;

/// In words the first two facets that cut each other, if any do.
pub fn require_none(triangles: &[[Place; 3]], boxes: &Boxes) -> Result<(), String> {
    for (index, own) in triangles.iter().enumerate() {
        let reach = |a: usize| {
            let all = own.iter().map(|x| x[a]);
            (all.clone().fold(f64::INFINITY, f64::min), all.fold(f64::NEG_INFINITY, f64::max))
        };
        let [x, y, z] = [reach(0), reach(1), reach(2)];
        let near = |min: &Place, max: &Place| {
            [x, y, z].iter().enumerate().all(|(a, (low, high))| min[a] <= *high && *low <= max[a])
        };
        let mut found = None;
        boxes.visit(near, |other| {
            if found.is_none() && other != index {
                let edges = (0..3).map(|k| (&own[k], &own[(k + 1) % 3]));
                let through = |(a, b): (&Place, &Place)| meets(a, b, &triangles[other]);
                found = edges.into_iter().find_map(through).map(|place| (other, place));
            }
        });
        if let Some((other, place)) = found {
            return Err(format!(
                "facets {} and {} cut each other near {place:?}: a surface that cuts itself bounds no \
                 body; unite its parts first",
                index.min(other) + 1,
                index.max(other) + 1
            ));
        }
    }
    Ok(())
}

/// Where an edge goes through the inside of a triangle.
fn meets(a: &Place, b: &Place, [p, q, r]: &[Place; 3]) -> Option<Place> {
    let (u, v, d) = (minus(q, p), minus(r, p), minus(b, a));
    let normal = cross(&u, &v);
    let slope = dot(&normal, &d);
    if slope == 0.0 {
        return None;
    }
    let t = dot(&normal, &minus(p, a)) / slope;
    let x: Place = std::array::from_fn(|i| a[i] + t * d[i]);
    let offset = minus(&x, p);
    let size = dot(&normal, &normal);
    let s = dot(&cross(&offset, &v), &normal) / size;
    let w = dot(&cross(&u, &offset), &normal) / size;
    let inside = |share: f64| share > CLEARLY && share < 1.0 - CLEARLY;
    (inside(t) && inside(s) && inside(w) && s + w < 1.0 - CLEARLY).then_some(x)
}
