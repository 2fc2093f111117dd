//! The same answer on one to four ranks, also where a partition cuts domains.

use mpm_par::basis;
use mpm_par::deck::model::{Basis, MeshMotion};
use mpm_par::grid::Grid;
use mpm_par::parallel::migrate::{locate, migrate_from};
use mpm_par::parallel::{Partition, World};
use mpm_par::points::Points;
use mpm_par::points::seed::{CellByCell, seed};
use mpm_par::points::share::Share;
use mpm_par::run::setup;
use mpm_par::system::step_system::Discretisation;
use mpm_par::{deck, parallel};

use crate::common::on_ranks;
use crate::common::run::{Run, input, relative_difference};
use crate::{cpdi, ghost};

/// Positions and stresses after `step` on two, three and four ranks against one.
fn assert_same(name: &str, run: &Run, step: usize) {
    assert_same_of(name, &|ranks| run.clone().ranks(ranks), step);
}

/// The same for a run that takes other solver options on several ranks.
fn assert_same_of(name: &str, run: &dyn Fn(usize) -> Run, step: usize) {
    let fields = |ranks: usize| {
        let results = run(ranks).set("output.fields=[\"stress\"]").results();
        let points = results.points(step);
        ["position", "stress"].map(|field| points.field(field).to_vec())
    };
    let one = fields(1);
    for ranks in [2, 3, 4] {
        for (a, b) in fields(ranks).iter().zip(&one) {
            let difference = relative_difference(a, b);
            assert!(difference < 1e-8, "{name} on {ranks} ranks: {difference:e}");
        }
    }
}

const METHODS: [&str; 4] = [
    "method.basis=\"mpm\"",
    "method.basis=\"cpdi1\"",
    "method.basis=\"cpdi2\"",
    "method.control=\"fem\"",
];

#[test]
fn moving_meshes_do_not_depend_on_the_ranks() {
    for method in METHODS {
        assert_same(method, &Run::of("doughnut-10").set(method), 2);
    }
}

/// CPDI2 over triangles, with Ghost faces across the borders of the partition.
#[test]
fn ghost_faces_on_triangles_do_not_depend_on_the_ranks() {
    assert_same("beam on triangles", &ghost::beam_on_triangles().set("analysis.steps=20"), 20);
}

#[test]
#[ignore = "long: make validate"]
fn all_cases_do_not_depend_on_the_ranks() {
    for method in METHODS {
        assert_same(method, &Run::of("stretch").set(method), 20);
        assert_same(method, &Run::of("doughnut").set(method), 16);
        assert_same(method, &Run::of("ellipse").set(method), 16);
    }
    assert_same("rings", &Run::of("annulus-mms"), 10);
    assert_same("unstructured", &Run::of("annulus-unstructured"), 10);
    assert_same("gimp in the plane", &Run::of("mms-2d"), 2);
    assert_same("gimp in space", &Run::of("mms-3d"), 2);
    for method in &METHODS[..3] {
        assert_same(method, &Run::of("mms-2d-mesh").set(*method), 2);
        assert_same(method, &Run::of("mms-3d-mesh").set(*method), 2);
    }
    assert_same("finite element beam", &Run::of("beam-fem").set("analysis.steps=10"), 10);
    assert_same_of("collapse", &cpdi::collapse, 40);
    assert_same_of("beam", &|ranks| cpdi::beam(0.25, ranks), 50);
}

/// Turned by a quarter of a cell under its domains, the partition of the mesh runs through them: rows
/// reach corners in cells of other ranks, and stay complete.
#[test]
fn a_partition_may_cut_domains() {
    const NAME: &str = "ranks::a_partition_may_cut_domains";
    on_ranks(NAME, &[2, 3, 4], |universe| {
        let _session = mpm_par::petsc::Session::start(universe, &[], &[]).unwrap();
        let world = World::new(mpi::topology::Communicator::duplicate(&universe.world()));
        for method in ["cpdi1", "cpdi2"] {
            let path = input("doughnut");
            let text = std::fs::read_to_string(&path).unwrap();
            let sets = [format!("method.basis=\"{method}\"")];
            let deck = deck::read(&path, &text, &sets).unwrap();
            let (mut model, mut points) = setup::prepare::<2>(&world, deck).unwrap();
            let Grid::Mesh(mesh) = &mut model.grid else { panic!("a mesh") };
            let turn = Some(([0.0; 2], 5f64.to_radians()));
            mesh.advance(&MeshMotion::RotateWith("inner".into()), |_| None, turn).unwrap();
            parallel::migrate(&world, &model.partition, &model.grid, &mut points).unwrap();

            let basis = if method == "cpdi1" { Basis::Cpdi1 } else { Basis::Cpdi2 };
            let mut cut = 0;
            for p in 0..points.len() {
                let mut cells = Vec::new();
                basis::populated_cells(&model.grid, basis, &points, p, None, &mut cells).unwrap();
                let elsewhere = |&cell: &usize| {
                    model.partition.owner_of_cell(&model.grid, cell) != world.rank()
                };
                cut += usize::from(cells.iter().any(elsewhere));
            }
            assert!(world.sum_usize(cut) > 0, "no domain is cut: the test shows nothing");

            let step = Discretisation::new(&world, &model, &points).unwrap();
            let weights = step.node_weights(&world).unwrap();
            let owned = &weights[..step.numbering.owned];
            let total = world.sum(owned.iter().sum());
            let count = world.sum_usize(points.len()) as f64;
            assert!((total / count - 1.0).abs() < 1e-12, "weights add up to one for each point");
            // Positions of the nodes map to those of the points' domains: linear fields survive.
            for p in 0..points.len() {
                let mut x = [0.0; 2];
                for entry in step.influences.row(p) {
                    let node = model.grid.node_position(step.influences.nodes[entry]);
                    for a in 0..2 {
                        x[a] += step.influences.weights[entry] * node[a];
                    }
                }
                for a in 0..2 {
                    assert!((x[a] - points.position[p][a]).abs() < 1e-9, "{x:?}");
                }
            }
        }
    });
}

/// Points that change rank at the start are made anew where they arrive: the same as if they had been
/// sent, in the same order, beside those of a file, which are sent. On a mesh turned since, where they
/// would be other points, all are sent.
#[test]
fn points_made_where_they_arrive_are_those_that_would_be_sent() {
    const NAME: &str = "ranks::points_made_where_they_arrive_are_those_that_would_be_sent";
    on_ranks(NAME, &[1, 2, 3], |universe| {
        let world = World::new(mpi::topology::Communicator::duplicate(&universe.world()));
        let path = input("doughnut-10");
        let text = std::fs::read_to_string(&path).unwrap();
        let share = Share { rank: world.rank(), ranks: world.size() };
        let words = |points: &Points<2>| {
            let mut words = Vec::new();
            (0..points.len()).for_each(|p| points.pack(p, &mut words));
            words.into_iter().map(f64::to_bits).collect::<Vec<u64>>()
        };
        for basis in ["mpm", "cpdi2"] {
            let sets = [format!("method.basis=\"{basis}\"")];
            let deck = deck::read(&path, &text, &sets).unwrap();
            let grid = setup::build_grid::<2>(&deck).unwrap();
            let mut turned = grid.clone();
            let Grid::Mesh(mesh) = &mut turned else { panic!("a mesh") };
            let turn = Some(([0.0; 2], 7f64.to_radians()));
            mesh.advance(&MeshMotion::RotateWith("inner".into()), |_| None, turn).unwrap();
            for after in [&grid, &turned] {
                let (mut points, first_ids) = seed(&deck, &grid, share).unwrap();
                let seeding = CellByCell::new(&deck, &grid, first_ids).unwrap();
                assert!(seeding.makes(0) && !seeding.makes(1), "cells and a file");
                let cells = locate(&world, after, &points).unwrap();
                let partition = Partition::for_cells(&world, after, None, &cells, None).unwrap();
                let mut sent = points.clone();
                let moved =
                    migrate_from(&world, &partition, after, &mut sent, cells.clone()).unwrap();
                assert_eq!(moved > 0, world.size() > 1, "something has to move");
                let settled = parallel::distribute_seeded(
                    &world,
                    &partition,
                    after,
                    &mut points,
                    cells,
                    &seeding,
                );
                assert_eq!(settled.unwrap(), moved);
                assert!(words(&points) == words(&sent), "{basis}");
            }
        }
    });
}
