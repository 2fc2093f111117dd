//! A closed surface of triangles, from an STL file: the nearest facet, edge or corner.

use std::sync::Arc;

use super::facets::Facets;
use super::surface::{Near, Surface, around_point};
use crate::deck::solid::{Feature, Solid};

#[derive(Debug, Clone)]
pub struct Triangles(pub Arc<Solid>);

impl Surface<3> for Triangles {
    /// Beside a facet the distance from its plane; beside an edge or a corner the distance from that,
    /// whose sign is that of the winding number.
    fn near(&self, x: &[f64; 3]) -> Near<3> {
        let nearest = self.0.nearest(x);
        let offset: [f64; 3] = std::array::from_fn(|i| x[i] - nearest.place[i]);
        let away = offset.iter().any(|v| *v != 0.0);
        let edge = match nearest.feature {
            Feature::Corner if away => [0.0; 3],
            Feature::Edge(along) if away => along,
            _ => {
                let normal = nearest.normal;
                let gap = normal.iter().zip(offset).map(|(n, d)| n * d).sum();
                return Near { gap, normal, curvature: [[0.0; 3]; 3] };
            }
        };
        let sign = if self.0.contains(x) { -1.0 } else { 1.0 };
        let mut near = around_point(&offset, sign);
        for i in 0..3 {
            for j in 0..3 {
                near.curvature[i][j] -= edge[i] * edge[j] / near.gap;
            }
        }
        near
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        self.0.bounds()
    }

    fn facets(&self, _: &[f64; 3], _: f64) -> Facets<3> {
        let corners = self.0.triangles.as_flattened().to_vec();
        let facets = (0..self.0.triangles.len()).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        Facets { corners, facets }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::contact::cuboid::Cuboid;

    /// The twelve facets of a box are its surface: gap, normal and curvature beside faces, edges and
    /// corners, outside and inside.
    #[test]
    fn the_facets_of_a_box_are_its_surface() {
        let (min, max) = ([0.0, 0.0, 0.0], [1.0, 2.0, 4.0]);
        let solid = Solid::cuboid(Path::new("a.stl"), min, max);
        let (triangles, exact) = (Triangles(Arc::new(solid)), Cuboid { min, max });
        for x in [
            [0.3, 0.7, 4.5],
            [0.3, 0.7, 3.9],
            [1.2, 2.3, 1.1],
            [-0.1, 1.4, 4.4],
            [1.3, 2.4, 4.5],
            [0.9, 0.7, 1.9],
            [-0.2, -0.3, -0.1],
        ] {
            let (a, b) = (triangles.near(&x), exact.near(&x));
            assert!((a.gap - b.gap).abs() < 1e-14, "{x:?}: {a:?} {b:?}");
            for i in 0..3 {
                assert!((a.normal[i] - b.normal[i]).abs() < 1e-13, "{x:?}: {a:?} {b:?}");
                for j in 0..3 {
                    let apart = a.curvature[i][j] - b.curvature[i][j];
                    assert!(apart.abs() < 1e-12, "{x:?}: {a:?} {b:?}");
                }
            }
        }
    }

    /// In a pit of slope 2 in the lower side of a block, what lies inside is nearest to facets, to edges that point
    /// inwards, and to the corner; the normal is the gradient of the gap and the curvature that of the normal.
    #[test]
    fn edges_and_corners_that_point_inwards_curve_the_gap() {
        let at = |reach: f64, z: f64| {
            [[-reach, -reach, z], [reach, -reach, z], [reach, reach, z], [-reach, reach, z]]
        };
        let (outer, above, rim, apex) =
            (at(1.5, 0.0), at(1.5, 1.0), at(0.15, 0.0), [0.0, 0.0, 0.3]);
        let mut triangles = vec![[above[0], above[1], above[2]], [above[0], above[2], above[3]]];
        for k in 0..4 {
            let next = (k + 1) % 4;
            triangles.push([outer[k], outer[next], above[next]]);
            triangles.push([outer[k], above[next], above[k]]);
            triangles.push([outer[k], rim[next], outer[next]]);
            triangles.push([outer[k], rim[k], rim[next]]);
            triangles.push([rim[k], apex, rim[next]]);
        }
        let solid = Solid::new(Path::new("pit.stl"), None, triangles).expect("a closed surface");
        let surface = Triangles(Arc::new(solid));
        // A facet, an edge and the corner: so many directions curve.
        for (x, directions) in
            [([0.17, 0.01, 0.16], 0), ([0.14, 0.12, 0.2], 1), ([0.03, -0.05, 0.4], 2)]
        {
            let near = surface.near(&x);
            assert!(near.gap < 0.0, "{x:?} lies outside");
            let trace = -near.gap * (0..3).map(|i| near.curvature[i][i]).sum::<f64>();
            assert!((trace + f64::from(directions)).abs() < 1e-9, "{x:?}: {trace}");
            for j in 0..3 {
                let beside = |by: f64| {
                    let mut x = x;
                    x[j] += by;
                    surface.near(&x)
                };
                let (more, less) = (beside(1e-6), beside(-1e-6));
                let slope = (more.gap - less.gap) / 2e-6;
                assert!((slope - near.normal[j]).abs() < 1e-8, "{x:?}: {slope} {near:?}");
                for i in 0..3 {
                    let turn = (more.normal[i] - less.normal[i]) / 2e-6;
                    assert!((turn - near.curvature[i][j]).abs() < 1e-6, "{x:?}: {turn} {near:?}");
                }
            }
        }
    }
}
