//! A box along the axes: inside, the distance is that from the nearest side.

use super::facets::Facets;
use super::solid::Solid;
use super::surface::{Near, Surface, length};

#[derive(Debug, Clone)]
pub struct Cuboid<const D: usize> {
    /// m
    pub min: [f64; D],
    /// m
    pub max: [f64; D],
}

impl<const D: usize> Surface<D> for Cuboid<D> {
    fn near(&self, x: &[f64; D]) -> Near<D> {
        let beyond: [f64; D] = std::array::from_fn(|i| x[i] - x[i].clamp(self.min[i], self.max[i]));
        let distance = length(&beyond);
        let (mut normal, mut curvature) = ([0.0; D], [[0.0; D]; D]);
        if distance > 0.0 {
            // Beyond one side it is a plane, beyond an edge or a corner a cylinder or a ball.
            normal = beyond.map(|v| v / distance);
            for i in 0..D {
                for j in 0..D {
                    let unit = if i == j && beyond[i] != 0.0 { 1.0 } else { 0.0 };
                    curvature[i][j] = (unit - normal[i] * normal[j]) / distance;
                }
            }
            return Near { gap: distance, normal, curvature };
        }
        let mut gap = f64::NEG_INFINITY;
        for axis in 0..D {
            for (depth, sign) in [(self.min[axis] - x[axis], -1.0), (x[axis] - self.max[axis], 1.0)]
            {
                if depth > gap {
                    gap = depth;
                    normal = [0.0; D];
                    normal[axis] = sign;
                }
            }
        }
        Near { gap, normal, curvature }
    }

    fn facets(&self, _: &[f64; D], _: f64) -> Facets<D> {
        let corner = |upper: usize| -> [f64; D] {
            std::array::from_fn(|a| if upper >> a & 1 == 1 { self.max[a] } else { self.min[a] })
        };
        if D == 2 {
            return Facets::polygon([0, 1, 3, 2].map(corner).to_vec(), true);
        }
        let mut made = Facets { corners: (0..8).map(corner).collect(), facets: Vec::new() };
        for axis in 0..3 {
            let (b, c) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            for low in [0, 1 << axis] {
                let square = [low, low + b, low + b + c, low + c];
                made.facets.push(std::array::from_fn(|a| square[a % 4]));
                made.facets.push(std::array::from_fn(|a| square[(a + 2) % 4]));
            }
        }
        made
    }

    fn bounds(&self) -> ([f64; D], [f64; D]) {
        (self.min, self.max)
    }

    fn solid(&self) -> Option<Solid<D>> {
        let mut edges = [0.0; 3];
        for a in 0..D {
            edges[a] = self.max[a] - self.min[a];
        }
        let volume = edges[..D].iter().product::<f64>();
        let squares = edges.map(|e| e * e / 12.0);
        let inertia = std::array::from_fn(|i| {
            let across = (0..3).filter(|&j| j != i).map(|j| squares[j]).sum::<f64>();
            std::array::from_fn(|j| if i == j { volume * across } else { 0.0 })
        });
        let centroid = std::array::from_fn(|a| 0.5 * (self.min[a] + self.max[a]));
        Some(Solid { volume, centroid, inertia })
    }
}
