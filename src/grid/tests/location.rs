//! Point location against a search through all cells, on edges, outside, and after motion.

use super::super::Grid;
use super::super::bins::{EDGE_TOLERANCE, REACH};
use super::super::inverse_map::inverse_map;
use super::*;
use crate::deck::model::MeshMotion;

/// The lowest cell that holds `x`, looking at every cell.
fn brute<const D: usize>(mesh: &Mesh<D>, x: &[f64; D]) -> Option<usize> {
    (0..mesh.cell_count()).find(|&cell| {
        let positions = mesh.cell_positions(cell);
        let nodes = &positions[..mesh.element.node_count()];
        inverse_map(mesh.element, nodes, x)
            .is_some_and(|xi| mesh.element.outside(&xi) <= EDGE_TOLERANCE)
    })
}

fn check_everywhere<const D: usize>(mesh: &Mesh<D>, low: [f64; D], high: [f64; D]) {
    let mut next = scatter(7);
    let (mut inside, mut outside) = (0, 0);
    for _ in 0..600 {
        let x = std::array::from_fn(|a| low[a] + (high[a] - low[a]) * next());
        let found = mesh.locate(&x);
        assert_eq!(found, brute(mesh, &x), "{:?} {x:?}", mesh.element);
        let hint = (next() * mesh.cell_count() as f64) as usize;
        assert_eq!(mesh.locate_near(&x, 0.0, Some(hint)).map(|f| f.0), found);
        if found.is_some() { inside += 1 } else { outside += 1 }
    }
    assert!(inside > 50 && outside > 50, "{inside} {outside}");
    // Nodes and the middles of all edges, where cells meet.
    for cell in 0..mesh.cell_count() {
        let x = mesh.cell_positions(cell);
        for face in mesh.element.faces() {
            for (k, &a) in face.iter().enumerate() {
                let b = face[(k + 1) % face.len()];
                let middle = std::array::from_fn(|i| 0.5 * (x[a][i] + x[b][i]));
                for point in [x[a], middle] {
                    let found = mesh.locate(&point).unwrap();
                    assert_eq!(Some(found), brute(mesh, &point));
                    assert!(found <= cell);
                }
            }
        }
    }
}

#[test]
fn bins_find_what_a_search_through_all_cells_finds() {
    for grading in [1.0, 6.0] {
        for element in [Element::Quad4, Element::Tri3] {
            check_everywhere(&ring([6.0, 4.0], element, grading), [-11.0; 2], [11.0; 2]);
        }
    }
    for element in [Element::Hex8, Element::Tet4] {
        check_everywhere(&wavy_box(element), [-0.5, -1.5, 1.5], [3.5, 1.8, 4.5]);
    }
}

/// Straight beyond an outer node its cells are equally near.
#[test]
fn round_off_does_not_choose_among_cells_equally_near() {
    fn check<const D: usize>(mesh: &Mesh<D>, h: f64) {
        let mut next = scatter(11);
        let middle: [f64; D] = std::array::from_fn(|a| {
            let nodes = 0..mesh.node_count();
            nodes.map(|n| mesh.node_position(n)[a]).sum::<f64>() / mesh.node_count() as f64
        });
        let mut asked = 0;
        for node in 0..mesh.node_count() {
            let x = mesh.node_position(node);
            for axis in 0..D {
                let mut beyond = x;
                beyond[axis] += 0.1 * h * (x[axis] - middle[axis]).signum();
                let Some((first, _)) = mesh.locate_near(&beyond, REACH, None) else { continue };
                for _ in 0..20 {
                    let near = beyond.map(|x| x + 1e-14 * h * (next() - 0.5));
                    let found = mesh.locate_near(&near, REACH, None).map(|(cell, _)| cell);
                    if mesh.locate(&near).is_none() {
                        asked += 1;
                        assert_eq!(found, Some(first), "{:?} {near:?}", mesh.element);
                    }
                }
            }
        }
        assert!(asked > 100, "{asked}");
    }
    for element in [Element::Quad4, Element::Tri3] {
        check(&box_mesh([0.1, 0.3], [1.0, 1.5], [3, 4], element).unwrap(), 0.3);
    }
    for element in [Element::Hex8, Element::Tet4] {
        check(&box_mesh([0.1, 0.3, 0.7], [1.0, 1.5, 1.6], [3, 4, 3], element).unwrap(), 0.3);
    }
}

#[test]
fn location_follows_a_mesh_that_turned() {
    let mut mesh = ring([6.0, 4.0], Element::Quad4, 2.0);
    let x = [6.3, 0.4];
    let before = mesh.locate(&x).unwrap();
    let motion = MeshMotion::RotateWith("inner".into());
    mesh.advance(&motion, |_| None, Some(([0.0; 2], 1.2))).unwrap();
    let (sine, cosine) = 1.2f64.sin_cos();
    let turned = [cosine * x[0] - sine * x[1], sine * x[0] + cosine * x[1]];
    assert_eq!(mesh.locate(&turned), Some(before));
    check_everywhere(&mesh, [-11.0; 2], [11.0; 2]);
}

#[test]
fn round_off_on_the_outer_edge_is_inside_and_more_is_not() {
    let mesh = box_mesh([0.0; 2], [2.0, 2.0], [4, 4], Element::Quad4).unwrap();
    let h = 0.5;
    assert_eq!(mesh.locate(&[2.0 + 1e-10 * h, 1.1]), Some(11));
    assert_eq!(mesh.locate(&[-1e-10 * h, -1e-10 * h]), Some(0));
    assert_eq!(mesh.locate(&[2.0 + 1e-8 * h, 1.1]), None);
    assert_eq!(mesh.locate(&[f64::NAN, 1.0]), None);
    assert_eq!(mesh.locate(&[1e300, 1.0]), None);
    let lattice =
        Grid::Lattice(super::super::Lattice { origin: [0.0; 2], spacing: [h; 2], cells: [4, 4] });
    let at = lattice.interpolate(&[2.0 + 1e-10 * h, 1.1], 0.0, None).unwrap();
    assert_eq!(at.values.cell, 11);
    assert!(lattice.interpolate(&[2.0 + 1e-8 * h, 1.1], 0.0, None).is_none());
}

#[test]
fn the_allowance_extends_outer_cells_linearly_and_no_further_than_asked() {
    let mesh = box_mesh([0.0; 2], [2.0, 2.0], [4, 4], Element::Quad4).unwrap();
    let grid = Grid::Mesh(mesh);
    let x = [2.0 + 0.2 * 0.5, 1.1];
    assert!(grid.interpolate(&x, 0.1, None).is_none());
    let at = grid.interpolate(&x, REACH, None).unwrap().values;
    assert_eq!(at.cell, 11);
    let field = |p: [f64; 2]| 1.0 + 2.0 * p[0] - 3.0 * p[1];
    let sum: f64 =
        (0..at.count).map(|a| at.weights[a] * field(grid.node_position(at.nodes[a]))).sum();
    assert!((sum - field(x)).abs() < 1e-13);
    assert!(grid.interpolate(&[2.0 + 0.26 * 0.5, 1.1], 1.0, None).is_none());
    // Outside a corner, both axes count.
    assert!(grid.interpolate(&[2.08, 2.08], REACH, None).is_some());
    assert!(grid.interpolate(&[2.1, 2.1], REACH, None).is_none());
}
