//! The place of a surface nearest to another, and what is there: a facet, an edge or a corner.

use super::{Place, Solid, cross, dot, minus};

/// What the nearest place lies on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Feature {
    Facet,
    /// With its direction, of length one.
    Edge(Place),
    Corner,
}

/// The nearest place of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// m
    pub place: Place,
    pub feature: Feature,
    /// Of the facet that it belongs to, outward, of length one.
    pub normal: Place,
}

impl Solid {
    /// Of places equally near that of the facet met first.
    pub fn nearest(&self, x: &Place) -> Nearest {
        let mut found: Option<(f64, usize, Place, Feature)> = None;
        self.boxes.nearest(x, |index| {
            let (place, feature) = on_triangle(&self.triangles[index], x);
            let offset = minus(x, &place);
            let squared = dot(&offset, &offset);
            if found.is_none_or(|(best, ..)| squared < best) {
                found = Some((squared, index, place, feature));
            }
            squared
        });
        // A solid has triangles.
        let (_, index, place, feature) = found.unwrap_or((0.0, 0, *x, Feature::Facet));
        let [p, q, r] = &self.triangles[index];
        let normal = cross(&minus(q, p), &minus(r, p));
        let size = dot(&normal, &normal).sqrt();
        Nearest { place, feature, normal: normal.map(|n| n / size) }
    }
}

/// By the regions of a triangle (C. Ericson, Real-Time Collision Detection, 2005, §5.1.5).
fn on_triangle([a, b, c]: &[Place; 3], x: &Place) -> (Place, Feature) {
    let (ab, ac, ax) = (minus(b, a), minus(c, a), minus(x, a));
    let (d1, d2) = (dot(&ab, &ax), dot(&ac, &ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, Feature::Corner);
    }
    let bx = minus(x, b);
    let (d3, d4) = (dot(&ab, &bx), dot(&ac, &bx));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, Feature::Corner);
    }
    let along = |from: &Place, to: &Place, share: f64| {
        let edge = minus(to, from);
        let size = dot(&edge, &edge).sqrt();
        let place = std::array::from_fn(|i| from[i] + share * edge[i]);
        (place, Feature::Edge(edge.map(|e| e / size)))
    };
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return along(a, b, d1 / (d1 - d3));
    }
    let cx = minus(x, c);
    let (d5, d6) = (dot(&ab, &cx), dot(&ac, &cx));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, Feature::Corner);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return along(a, c, d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return along(b, c, (d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let (v, w) = (vb / (va + vb + vc), vc / (va + vb + vc));
    (std::array::from_fn(|i| a[i] + v * ab[i] + w * ac[i]), Feature::Facet)
}
