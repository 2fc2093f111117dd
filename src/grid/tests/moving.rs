//! Motion between steps.

use super::*;
use crate::deck::model::MeshMotion;

fn strip() -> Mesh<2> {
    box_mesh([0.0; 2], [2.0, 2.0], [2, 2], Element::Quad4).unwrap()
}

#[test]
fn a_rotation_is_rigid_and_there_and_back_is_where_it_was() {
    let mut mesh = ring([6.0, 4.0], Element::Tri3, 1.0);
    let volume = mesh.cell_volume(17);
    let motion = MeshMotion::RotateWith("inner".into());
    let angle = -5f64.to_radians();
    for _ in 0..16 {
        mesh.advance(&motion, |_| None, Some(([1.0, -2.0], angle))).unwrap();
    }
    assert!((mesh.cell_volume(17) - volume).abs() < 1e-13);
    // 80 degrees clockwise about (1, -2) take (6, 0) to (1 + 5c + 2s, -2 - 5s + 2c).
    let (s, c) = 80f64.to_radians().sin_cos();
    let at = mesh.node_position(0);
    assert!((at[0] - (1.0 + 5.0 * c + 2.0 * s)).abs() < 1e-13);
    assert!((at[1] - (-2.0 - 5.0 * s + 2.0 * c)).abs() < 1e-13);
    assert_eq!(mesh.node_position_initial(0), [6.0, 0.0]);
    mesh.advance(&motion, |_| None, Some(([1.0, -2.0], -16.0 * angle))).unwrap();
    for node in 0..mesh.node_count() {
        let (p, q) = (mesh.node_position(node), mesh.node_position_initial(node));
        assert!((p[0] - q[0]).abs() < 1e-13 && (p[1] - q[1]).abs() < 1e-13);
    }
}

#[test]
fn following_one_axis_leaves_the_others_and_inactive_nodes_alone() {
    let mut mesh = strip();
    let u = |node: usize| (node != 8).then(|| [0.1 * (node % 3) as f64, -0.05]);
    mesh.advance(&MeshMotion::Follow(vec![0]), u, None).unwrap();
    assert_eq!(mesh.node_position(5), [2.2, 1.0]);
    assert_eq!(mesh.node_position(8), [2.0, 2.0]);
    mesh.advance(&MeshMotion::Material, u, None).unwrap();
    assert_eq!(mesh.node_position(4), [1.0 + 0.1 + 0.1, 1.0 - 0.05]);
    assert_eq!(mesh.node_position_initial(4), [1.0, 1.0]);
    // Node 8 stayed at (2, 2), node 7 went to (1.2, 1.95).
    assert!((mesh.cell_size() - 0.8f64.hypot(0.05)).abs() < 1e-14);
}

#[test]
fn a_cell_that_turns_over_is_named_and_nothing_moves() {
    let mut mesh = strip();
    let u = |node: usize| Some(if node == 4 { [1.5, 0.0] } else { [0.0, 0.0] });
    let error = mesh.advance(&MeshMotion::Material, u, None).unwrap_err();
    assert_eq!(error.exit_code(), 1);
    let text = error.to_string();
    assert!(text.contains("turns over cell 1 (nodes [1, 2, 5, 4])"), "{text}");
    assert_eq!(mesh.node_position(4), [1.0, 1.0]);
    let nan = mesh.advance(&MeshMotion::Material, |_| Some([f64::NAN; 2]), None);
    assert!(nan.is_err());
}

#[test]
fn rotating_with_a_tag_needs_its_rotation() {
    let error = strip().advance(&MeshMotion::RotateWith("rim".into()), |_| None, None).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("\"rim\""));
}
