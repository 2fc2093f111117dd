//! Tests that need whole meshes, and the meshes they share.

mod faults;
mod files;
mod location;
mod meshes;
mod moving;

use super::generate::{annulus, box_mesh};
use super::mesh::Mesh;
use crate::deck::model::Element;

/// A ring like that of Rotation §3.2.
pub(crate) fn ring(inner: [f64; 2], element: Element, grading: f64) -> Mesh<2> {
    annulus(inner, 10.0, [5, 18], element, grading).unwrap()
}

/// A box whose inner and outer nodes are all displaced a little, keeping it convex enough.
pub(crate) fn wavy_box(element: Element) -> Mesh<3> {
    let mut mesh = box_mesh([0.0, -1.0, 2.0], [3.0, 1.0, 4.0], [4, 3, 3], element).unwrap();
    let moved = (0..mesh.node_count())
        .map(|node| {
            let [x, y, z] = mesh.node_position(node);
            let w = 0.06 * (2.1 * x + 1.3 * y - 0.7 * z).sin();
            [x + w, y - 0.5 * w + 0.1 * x, z + 0.8 * w]
        })
        .collect();
    mesh.set_positions(moved).unwrap();
    mesh
}

/// Pseudo-random numbers in [0, 1), always the same ones after a seed.
pub(crate) fn scatter(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}
