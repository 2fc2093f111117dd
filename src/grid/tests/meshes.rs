//! Generated meshes: measures, neighbours, tags, face jumps.

use super::super::{FacePair, Grid};
use super::*;

fn volume<const D: usize>(mesh: &Mesh<D>) -> f64 {
    (0..mesh.cell_count()).map(|c| mesh.cell_volume(c)).sum()
}

#[test]
fn a_box_has_its_volume_counts_and_tags() {
    for (element, per_box) in
        [(Element::Quad4, 1), (Element::Tri3, 2), (Element::Hex8, 1), (Element::Tet4, 6)]
    {
        if element.dimension() == 2 {
            let mesh = box_mesh([0.0, 1.0], [2.0, 4.0], [4, 3], element).unwrap();
            assert_eq!((mesh.node_count(), mesh.cell_count()), (20, 12 * per_box));
            assert!((volume(&mesh) - 6.0).abs() < 1e-13);
            for (tag, axis, at) in
                [("left", 0, 0.0), ("right", 0, 2.0), ("bottom", 1, 1.0), ("top", 1, 4.0)]
            {
                let tagged = mesh.tagged_nodes(tag).unwrap();
                let exact: Vec<usize> =
                    (0..20).filter(|&n| mesh.node_position(n)[axis] == at).collect();
                assert_eq!(tagged, exact);
            }
        } else {
            let mesh = box_mesh([0.0; 3], [2.0, 1.0, 0.5], [4, 2, 1], element).unwrap();
            assert_eq!((mesh.node_count(), mesh.cell_count()), (30, 8 * per_box));
            assert!((volume(&mesh) - 1.0).abs() < 1e-13);
            assert_eq!(mesh.tagged_nodes("front").unwrap().len(), 15);
            assert_eq!(mesh.tagged_nodes("back").unwrap().len(), 15);
        }
    }
}

/// Euler's count of faces, symmetry, and no neighbour across the outer edge.
#[test]
fn neighbours_are_mutual_and_every_face_is_counted_once() {
    fn check<const D: usize>(mesh: &Mesh<D>) {
        let interior = mesh.interior_faces().count();
        let outer = mesh.boundary_faces().count();
        assert_eq!(2 * interior + outer, mesh.cell_count() * mesh.element.faces().len());
        for FacePair { lower, upper } in mesh.interior_faces() {
            assert!(lower < upper);
            assert!(mesh.across(upper).any(|c| c == Some(lower)));
            let shared =
                mesh.nodes_of(lower).iter().filter(|n| mesh.nodes_of(upper).contains(n)).count();
            assert_eq!(shared, mesh.element.faces()[0].len());
        }
        for node in 0..mesh.node_count() {
            let exact = (0..mesh.cell_count())
                .find(|&c| mesh.nodes_of(c).contains(&(node as u32)))
                .unwrap();
            assert_eq!(mesh.lowest_cell(node), exact);
        }
    }
    for element in [Element::Tri3, Element::Quad4] {
        let mesh = ring([5.0, 5.0], element, 1.0);
        check(&mesh);
        assert_eq!(mesh.boundary_faces().count(), 36);
    }
    for element in [Element::Tet4, Element::Hex8] {
        check(&wavy_box(element));
    }
}

#[test]
fn the_lattice_and_the_box_of_quads_agree() {
    let mesh = Grid::Mesh(box_mesh([0.0; 2], [2.0, 1.0], [4, 3], Element::Quad4).unwrap());
    let lattice = Grid::Lattice(super::super::Lattice {
        origin: [0.0; 2],
        spacing: [0.5, 1.0 / 3.0],
        cells: [4, 3],
    });
    for node in 0..mesh.node_count() {
        assert_eq!(mesh.lowest_cell(node), lattice.lowest_cell(node));
    }
    for cell in 0..mesh.cell_count() {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        mesh.cell_nodes(cell, &mut a);
        lattice.cell_nodes(cell, &mut b);
        assert_eq!(a, b);
        a.clear();
        b.clear();
        mesh.face_neighbours(cell, &mut a);
        lattice.face_neighbours(cell, &mut b);
        a.sort_unstable();
        b.sort_unstable();
        assert_eq!(a, b);
        for &upper in a.iter().filter(|&&c| c > cell) {
            let pair = FacePair { lower: cell, upper };
            let (p, q) = (mesh.face_jump(pair).unwrap(), lattice.face_jump(pair).unwrap());
            assert_eq!(p.nodes, q.nodes);
            assert!((p.size - q.size).abs() < 1e-14 && (p.cell_size - q.cell_size).abs() < 1e-14);
            // Points may come in the other order: compare the face matrices.
            let matrix = |jump: &super::super::FaceJump, i: usize, j: usize| -> f64 {
                jump.points.iter().map(|(w, v)| w * v[i] * v[j]).sum()
            };
            for i in 0..p.nodes.len() {
                for j in 0..p.nodes.len() {
                    assert!((matrix(&p, i, j) - matrix(&q, i, j)).abs() < 1e-12);
                }
            }
        }
    }
    let x = [1.31, 0.77];
    let (p, q) =
        (mesh.interpolate(&x, 0.0, None).unwrap(), lattice.interpolate(&x, 0.0, None).unwrap());
    assert_eq!((p.values.cell, p.values.nodes), (q.values.cell, q.values.nodes));
    for a in 0..4 {
        assert!((p.values.weights[a] - q.values.weights[a]).abs() < 1e-13);
        assert!((p.gradients[a][0] - q.gradients[a][0]).abs() < 1e-12);
        assert!((p.gradients[a][1] - q.gradients[a][1]).abs() < 1e-12);
    }
}

/// A linear field has no jump on any mesh, and the quadrature weights add up to the faces' areas:
/// the divergence theorem on each interior cell.
#[test]
fn face_jumps_of_linear_fields_vanish_on_distorted_meshes() {
    fn check<const D: usize>(mesh: Mesh<D>) {
        let grid = Grid::Mesh(mesh);
        let Grid::Mesh(mesh) = &grid else { unreachable!("just made") };
        for pair in mesh.interior_faces() {
            let jump = grid.face_jump(pair).unwrap();
            assert!(jump.nodes.is_sorted_by(|a, b| a < b));
            let area: f64 = jump.points.iter().map(|p| p.0).sum();
            assert!((jump.size.powi(D as i32 - 1) - area).abs() < 1e-12 * area);
            for (_, jumps) in &jump.points {
                let mut field = 0.0;
                let mut quadratic = 0.0;
                for (&node, j) in jump.nodes.iter().zip(jumps) {
                    let x = mesh.node_position(node);
                    field += j * (2.0 + (0..D).map(|a| (a as f64 - 0.4) * x[a]).sum::<f64>());
                    quadratic += j * x[0] * x[0];
                }
                assert!(field.abs() < 1e-10, "{:?} {field}", mesh.element);
                assert!(quadratic.is_finite());
            }
        }
    }
    check(ring([6.0, 4.0], Element::Quad4, 3.0));
    check(ring([6.0, 4.0], Element::Tri3, 3.0));
    check(wavy_box(Element::Hex8));
    check(wavy_box(Element::Tet4));
}

/// Two triangles that halve the unit square: u = 1 at one corner off the diagonal has slope
/// sqrt 2 towards it in one cell and none in the other.
#[test]
fn the_jump_across_a_diagonal_is_the_slope() {
    let grid = Grid::Mesh(box_mesh([0.0; 2], [1.0; 2], [1, 1], Element::Tri3).unwrap());
    let jump = grid.face_jump(FacePair { lower: 0, upper: 1 }).unwrap();
    assert_eq!(jump.nodes, [0, 1, 2, 3]);
    assert!((jump.size - 2f64.sqrt()).abs() < 1e-14);
    assert!((jump.cell_size - 0.5f64.sqrt()).abs() < 1e-14);
    for (weight, jumps) in &jump.points {
        assert!((weight - 0.5f64.sqrt()).abs() < 1e-14);
        assert!((jumps[1].abs() - 2f64.sqrt()).abs() < 1e-13);
        assert!((jumps[2] - jumps[1]).abs() < 1e-13);
    }
}

/// Two simplices that share a node only are tied by the jump of their whole gradient: none for a
/// linear field, some for most pairs of others.
#[test]
fn simplices_with_a_common_node_are_tied_by_their_gradients() {
    fn check<const D: usize>(mesh: Mesh<D>) {
        let grid = Grid::Mesh(mesh);
        let Grid::Mesh(mesh) = &grid else { unreachable!("just made") };
        let shares =
            |a: usize, b: usize| mesh.nodes_of(a).iter().any(|n| mesh.nodes_of(b).contains(n));
        let mut faces = Vec::new();
        mesh.face_neighbours(0, &mut faces);
        let (mut tied, mut kinked, mut refused) = (0, 0, 0);
        for upper in (1..mesh.cell_count()).filter(|cell| !faces.contains(cell)) {
            let pair = FacePair { lower: 0, upper };
            if !shares(0, upper) {
                refused += usize::from(grid.face_jump(pair).is_err());
                continue;
            }
            tied += 1;
            let jump = grid.face_jump(pair).unwrap();
            assert!(jump.nodes.is_sorted_by(|a, b| a < b) && jump.points.len() == D);
            let of = |f: &dyn Fn([f64; D]) -> f64| -> Vec<f64> {
                let values: Vec<f64> =
                    jump.nodes.iter().map(|&n| f(mesh.node_position(n))).collect();
                let sum = |j: &Vec<f64>| j.iter().zip(&values).map(|(j, v)| j * v).sum();
                jump.points.iter().map(|(_, j)| sum(j)).collect()
            };
            for value in of(&|x| 2.0 + (0..D).map(|a| (a as f64 - 0.4) * x[a]).sum::<f64>()) {
                assert!(value.abs() < 1e-10, "{value}");
            }
            kinked += usize::from(of(&|x| x[0] * x[0] + x[1]).iter().any(|v| v.abs() > 1e-3));
            for (weight, _) in &jump.points {
                assert!((jump.size.powi(D as i32 - 1) - weight).abs() < 1e-12 * weight);
            }
        }
        assert!(tied > 0 && 2 * kinked > tied && refused > 0, "{tied} {kinked} {refused}");
    }
    check(box_mesh([0.0; 2], [1.0; 2], [3, 3], Element::Tri3).unwrap());
    check(ring([6.0, 4.0], Element::Tri3, 3.0));
    check(wavy_box(Element::Tet4));
}

#[test]
fn rings_have_the_area_of_their_polygons_and_tags_on_the_curves() {
    for element in [Element::Quad4, Element::Tri3] {
        let mesh = ring([5.0, 5.0], element, 1.0);
        assert_eq!(mesh.node_count(), 6 * 18);
        let exact = 0.5 * 18.0 * (100.0 - 25.0) * (std::f64::consts::TAU / 18.0).sin();
        assert!((volume(&mesh) - exact).abs() < 1e-11);
        for (tag, radius) in [("inner", 5.0), ("outer", 10.0)] {
            let nodes = mesh.tagged_nodes(tag).unwrap();
            assert_eq!(nodes.len(), 18);
            for node in nodes {
                let [x, y] = mesh.node_position(node);
                assert!((x.hypot(y) - radius).abs() < 1e-13);
            }
        }
    }
    let start = ring([6.0, 4.0], Element::Quad4, 1.0).node_position(0);
    assert_eq!(start, [6.0, 0.0]);
}

#[test]
fn grading_refines_at_the_ends_of_the_long_axis() {
    let spacing = |mesh: &Mesh<2>, a: usize, b: usize| {
        let (p, q) = (mesh.node_position(a), mesh.node_position(b));
        (p[0] - q[0]).hypot(p[1] - q[1])
    };
    for inner in [[6.0, 4.0], [4.0, 6.0]] {
        let uniform = annulus(inner, 10.0, [6, 80], Element::Quad4, 1.0).unwrap();
        let graded = annulus(inner, 10.0, [6, 80], Element::Quad4, 3.0).unwrap();
        // Spoke at the end of the long axis, and of the short one.
        let (long, short) = if inner[0] > inner[1] { (0, 20) } else { (20, 0) };
        let around = |spoke: usize| spacing(&graded, spoke, spoke + 1);
        let plain = |spoke: usize| spacing(&uniform, spoke, spoke + 1);
        assert!((around(long) / plain(long) - 0.5).abs() < 0.01);
        assert!((around(short) / plain(short) - 1.5).abs() < 0.01);
        let radial = |spoke: usize, ring: usize| {
            spacing(&graded, spoke + 80 * ring, spoke + 80 * (ring + 1))
        };
        assert!((radial(long, 5) / radial(long, 0) - 17.0 / 7.0).abs() < 1e-9);
        assert!((radial(short, 5) / radial(short, 0) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn memory_per_cell_is_as_documented() {
    fn per_cell<const D: usize>(mesh: &Mesh<D>) -> f64 {
        mesh.memory_bytes() as f64 / mesh.cell_count() as f64
    }
    let plane = |e| per_cell(&box_mesh([0.0; 2], [1.0; 2], [100, 100], e).unwrap());
    let space = |e| per_cell(&box_mesh([0.0; 3], [1.0; 3], [20, 20, 20], e).unwrap());
    for (element, documented) in [(Element::Tri3, 60.0), (Element::Quad4, 90.0)] {
        let actual = plane(element);
        assert!((actual / documented - 1.0).abs() < 0.15, "{element:?} {actual}");
    }
    for (element, documented) in [(Element::Tet4, 77.0), (Element::Hex8, 160.0)] {
        let actual = space(element);
        assert!((actual / documented - 1.0).abs() < 0.15, "{element:?} {actual}");
    }
}
