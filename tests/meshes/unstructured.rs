//! Manufactured solutions on irregular meshes: second order where nothing repeats.

use crate::common::run::{Run, input};
use crate::irregular::{self, Irregular};
use crate::manufactured::order;

/// A deck of `inputs/` on a mesh in place of its own.
fn outcome(deck: &str, mesh: &Irregular, basis: &str, per_edge: usize) -> Result<f64, String> {
    let folder = tempfile::tempdir().expect("a scratch folder");
    mesh.write(&folder.path().join("irregular.msh"));
    let text = std::fs::read_to_string(input(deck)).expect("a deck of this project");
    let line = text.lines().find(|line| line.starts_with("generate")).expect("a generated mesh");
    let dimension = if deck.contains("3d") { 3 } else { 2 };
    let file = format!("file = \"irregular.msh\"\ndimension = {dimension}");
    let per_cell = vec![per_edge.to_string(); dimension].join(", ");
    let run = Run::text(&text.replace(line, &file))
        .set(format!("method.basis=\"{basis}\""))
        .set(format!("body.0.points_per_cell=[{per_cell}]"));
    let outcome = run.attempt_in(folder);
    match outcome.code {
        0 => Ok(outcome.results().verify("displacement_error")),
        _ => Err(outcome.stderr),
    }
}

/// Displacement errors from coarse to fine, printed with their orders.
fn errors(
    deck: &str,
    meshes: impl IntoIterator<Item = Irregular>,
    basis: &str,
    per_edge: usize,
) -> Vec<f64> {
    let error =
        |mesh| outcome(deck, &mesh, basis, per_edge).unwrap_or_else(|said| panic!("{said}"));
    let errors: Vec<f64> = meshes.into_iter().map(error).collect();
    let orders: Vec<f64> = errors.windows(2).map(|pair| order(pair[0], pair[1])).collect();
    let row: Vec<String> = errors.iter().map(|error| format!("{error:.2e}")).collect();
    println!("{deck} {basis} {per_edge}: {} {orders:.2?}", row.join(", "));
    errors
}

/// At least `least` orders for each halving, and 1.85 on the finest pair.
#[track_caller]
fn assert_second_order(errors: &[f64], least: f64) {
    let orders: Vec<f64> = errors.windows(2).map(|pair| order(pair[0], pair[1])).collect();
    assert!(orders.iter().all(|&order| order >= least), "{errors:?} {orders:?}");
    assert!(orders.last().is_some_and(|&order| order >= 1.85), "{errors:?} {orders:?}");
}

const PLANE: &str = "mms-2d-mesh";
const SPACE: &str = "mms-3d-mesh";

#[test]
fn irregular_triangles_converge_at_second_order() {
    let meshes = || [4, 8, 16].map(|n| irregular::triangles(n, 1));
    assert_second_order(&errors(PLANE, meshes(), "mpm", 8), 1.7);
}

#[test]
fn irregular_quadrilaterals_converge_at_second_order() {
    let meshes = || [4, 8, 16].map(|n| irregular::triangles(n, 1).into_bricks());
    assert_second_order(&errors(PLANE, meshes(), "mpm", 8), 1.95);
    assert_second_order(&errors(PLANE, meshes(), "cpdi2", 2), 1.95);
}

#[test]
fn irregular_hexahedra_converge_at_second_order() {
    let hexahedra = [1, 2, 4].map(|n| irregular::tetrahedra(n, 1).into_bricks());
    assert_second_order(&errors(SPACE, hexahedra, "cpdi2", 2), 1.1);
}

#[test]
#[ignore = "long: make validate"]
fn finer_irregular_meshes_of_the_plane_converge_at_second_order() {
    for seed in [1, 2] {
        let triangles = || [4, 8, 16, 32].map(|n| irregular::triangles(n, seed));
        assert_second_order(&errors(PLANE, triangles(), "mpm", 8), 1.65);
        let quads = || [4, 8, 16, 32].map(|n| irregular::triangles(n, seed).into_bricks());
        assert_second_order(&errors(PLANE, quads(), "mpm", 16), 1.85);
        assert_second_order(&errors(PLANE, quads(), "cpdi1", 4), 1.9);
        assert_second_order(&errors(PLANE, quads(), "cpdi2", 4), 1.9);
    }
}

#[test]
#[ignore = "long: make validate"]
fn finer_irregular_meshes_of_space_converge_at_second_order() {
    let tetrahedra = || [4, 8, 16].map(|n| irregular::tetrahedra(n, 1));
    assert_second_order(&errors(SPACE, tetrahedra(), "mpm", 3), 1.6);
    let hexahedra = || [1, 2, 4].map(|n| irregular::tetrahedra(n, 1).into_bricks());
    assert_second_order(&errors(SPACE, hexahedra(), "mpm", 4), 1.1);
    assert_second_order(&errors(SPACE, hexahedra(), "cpdi1", 2), 1.1);
}

/// §7.4 on irregular rings of the paper's five sizes, 8 x 8 points: 1.20, 1.85, 2.10, 1.82 orders.
/// The finest pair is where this number of points begins to show.
#[test]
#[ignore = "long: make validate"]
fn the_annulus_converges_on_irregular_meshes() {
    let many = errors("annulus-mms", (0..5).map(irregular_ring), "mpm", 8);
    let orders: Vec<f64> = many.windows(2).map(|pair| order(pair[0], pair[1])).collect();
    assert!(orders[0] > 1.15 && orders[1..].iter().all(|&order| order > 1.8), "{orders:?}");
}

/// One point per element: the error grows again, and then elements run empty.
#[test]
fn one_point_fails_on_irregular_rings() {
    let one = [1, 2, 3].map(|k| outcome("annulus-mms", &irregular_ring(k), "mpm", 1));
    let [Ok(coarse), Ok(middle), fine] = &one else { panic!("{one:?}") };
    assert!(middle > coarse && fine.as_ref().map_or(true, |fine| fine > coarse), "{one:?}");
}

fn irregular_ring(k: usize) -> Irregular {
    irregular::ring(2 << k, 18 << k, 1)
}
