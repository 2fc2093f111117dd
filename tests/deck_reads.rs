//! Decks that are right: what they become.

use std::path::Path;

use mpm_par::deck::model::*;
use mpm_par::deck::{self, Deck, Scope};
use mpm_par::loads::Point;

const BEAM: &str = include_str!("decks/beam.toml");
const DYNAMIC: &str = include_str!("decks/collision.toml");
const ANNULUS: &str = include_str!("decks/annulus.toml");
const CUBE: &str = include_str!("decks/cube.toml");

fn read(text: &str, sets: &[&str]) -> Deck {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_string()).collect();
    deck::read(Path::new("deck.toml"), text, &sets).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn beam_becomes_a_deck() {
    let deck = read(BEAM, &[]);
    assert_eq!((deck.title.as_str(), deck.dimension), ("Elastic cantilever beam", 2));
    let Grid::Lattice(grid) = &deck.grid else { panic!("a lattice") };
    assert_eq!((&grid.cells, &grid.spacing), (&vec![22, 20], &vec![0.5, 0.5]));
    assert_eq!(deck.analysis.steps, Some(50));
    assert_eq!(deck.analysis.max_iterations, 10);
    assert_eq!(deck.analysis.smallest_step, 1.0 / 1024.0);
    assert_eq!(deck.method.drop_below, 0.0);
    let ghost = deck.ghost.as_ref().expect("given");
    assert_eq!((ghost.stiffness, ghost.scaling), (Some(12e6), GhostScaling::Published));
    assert_eq!(deck.materials[0].model.name, "hencky");
    assert_eq!(deck.materials[0].values(&Scope::default()), [12e6, 0.2]);
    assert_eq!(deck.boundaries[0].place, Place::Side { axis: 0, upper: false });
    assert_eq!(deck.boundaries[0].fix, [0]);
    assert_eq!(deck.boundaries[1].name, "boundary-2");
    let Load::Point(Point { nearest, force, .. }) = &deck.loads[0] else { panic!("a point load") };
    let force: Vec<_> = force.iter().map(|f| f.as_constant()).collect();
    assert_eq!((nearest.len(), force), (2, vec![Some(0.0), Some(-100e3)]));
    assert_eq!(deck.output.every, Every::Steps(5));
    assert_eq!(
        deck.petsc,
        [("qs_ksp_type".to_string(), "cg".to_string()), ("log_view".to_string(), String::new())]
    );
}

#[test]
fn dynamics_meshes_and_three_dimensions_become_decks() {
    let deck = read(DYNAMIC, &[]);
    assert_eq!(deck.analysis.kind, AnalysisType::Explicit);
    assert_eq!((deck.analysis.steps, deck.analysis.cfl), (None, Some(0.5)));
    assert_eq!(deck.bodies.len(), 2);
    assert_eq!(deck.method.flip, 0.95);
    assert_eq!(deck.output.every, Every::Seconds(0.1));

    let deck = read(ANNULUS, &[]);
    let Grid::Mesh(mesh) = &deck.grid else { panic!("a mesh") };
    assert_eq!(mesh.motion, MeshMotion::RotateWith("inner".to_string()));
    let MeshSource::Annulus { inner, element, .. } = &mesh.source else { panic!("an annulus") };
    assert_eq!((*inner, *element), ([6.0, 4.0], Element::Quad4));
    assert!(matches!(&deck.bodies[0].source, BodySource::MeshCells { tag: None, .. }));

    let deck = read(CUBE, &[]);
    assert_eq!(deck.dimension, 3);
    assert_eq!(deck.boundaries[2].place, Place::Side { axis: 2, upper: false });
}

/// (stiffness factor, mass factor) in force; the resolved deck reads back to the deck.
fn ghost_factors(text: &str, sets: &[&str]) -> Option<(Option<f64>, Option<f64>)> {
    let deck = read(text, sets);
    let again = read(&deck::resolved(&deck), &[]);
    assert_eq!((&again.ghost, &again.method), (&deck.ghost, &deck.method), "{sets:?}");
    deck.ghost.map(|ghost| (ghost.stiffness_factor, ghost.mass_factor))
}

#[test]
fn ghost_is_on_unless_it_is_turned_off() {
    let (stiffness, mass, implicit) = (Some(0.01), Some(0.25), Some(0.01));
    for (text, sets, expected) in [
        (BEAM, &["ghost="][..], Some((stiffness, None))),
        (BEAM, &["ghost.stiffness="], Some((stiffness, None))),
        (BEAM, &["ghost=off"], None),
        (BEAM, &["ghost=\"off\""], None),
        // A table with one of the two says all.
        (CUBE, &["ghost=off", "ghost.mass_factor=0.5"], Some((None, Some(0.5)))),
        (CUBE, &[], Some((stiffness, implicit))),
        (CUBE, &["method.mass=lumped"], Some((stiffness, None))),
        (DYNAMIC, &["ghost="], Some((None, mass))),
        (DYNAMIC, &["ghost=", "method.mass=lumped"], None),
        (ANNULUS, &[], Some((stiffness, None))),
        (ANNULUS, &["method.control=fem", "grid.motion="], None),
    ] {
        assert_eq!(ghost_factors(text, sets), expected, "{sets:?}");
    }
    assert_eq!(read(BEAM, &["ghost="]).method.drop_below, 0.0);
    assert_eq!(
        read(BEAM, &["ghost=", "ghost.scaling=literal"]).ghost.unwrap().scaling,
        GhostScaling::Literal
    );
}

#[test]
fn options_change_the_deck() {
    let deck = read(BEAM, &["method.basis=mpm", "body.0.points_per_cell=[3, 4]", "ghost=off"]);
    assert_eq!(deck.method.basis, Basis::Mpm);
    assert!(matches!(
        &deck.bodies[0].source,
        BodySource::Shape { seeding: Seeding::PerCell(counts), .. } if *counts == [3, 4]
    ));
    assert!(deck.ghost.is_none());
    assert_eq!(deck.method.drop_below, 1e-8);
    let deck = read(
        DYNAMIC,
        &["method.velocity_update=xpic", "method.xpic_order=5", "method.mass=lumped"],
    );
    assert_eq!((deck.method.xpic, deck.method.flip), (Some(5), 0.0));
    assert_eq!(deck.method.position_update, PositionUpdate::Momentum);
    assert_eq!(deck.method.point_volume, PointVolume::Deformation);
    let deck = read(BEAM, &["method.point_volume=domain"]);
    assert_eq!(deck.method.point_volume, PointVolume::Domain);
    let deck = read(DYNAMIC, &["method.position_update=published"]);
    assert_eq!(deck.method.position_update, PositionUpdate::Published);
    let deck = read(CUBE, &["analysis.hht_alpha=-0.1"]);
    assert!((deck.analysis.newmark_beta - 1.1 * 1.1 / 4.0).abs() < 1e-15);
    assert!((deck.analysis.newmark_gamma - 0.6).abs() < 1e-15);
}

#[test]
fn finite_elements_are_gauss_points_on_a_mesh_that_follows() {
    let deck = read(
        ANNULUS,
        &[
            "grid.motion={ follow = \"material\" }",
            "body.0.points_per_cell=",
            "body.0.gauss=2",
            "method.basis=mpm",
        ],
    );
    assert!(matches!(
        &deck.bodies[0].source,
        BodySource::MeshCells { seeding: Seeding::Gauss(2), .. }
    ));
}

/// Points at (0.2 + (i + fx) s, 0.2 + (j + fy) s), s = sqrt(A / N): numerics of the ghost body.
#[test]
fn ghost_body_has_the_papers_point_counts() {
    let ghost = include_str!("decks/ghost.toml");
    let area: f64 = 0.107363;
    for (count, fx, fy) in [(646, 0.0, 0.605), (2389, 0.25, 0.02), (9613, 0.25, 0.10)] {
        let s = (area / f64::from(count)).sqrt();
        let lattice = format!(
            "body.0.lattice={{ spacing = {s}, offset = [{}, {}] }}",
            0.2 + fx * s,
            0.2 + fy * s
        );
        let deck = read(ghost, &[&lattice]);
        let BodySource::Shape { shape, seeding: Seeding::Lattice { spacing, offset } } =
            &deck.bodies[0].source
        else {
            panic!("a shape on a lattice")
        };
        let (low, high) = shape.local_bounds().expect("bounded");
        let range = |axis: usize| {
            let index = |x: f64| (x - offset[axis]) / spacing;
            index(low[axis]).floor() as i64..=index(high[axis]).ceil() as i64
        };
        let mut found = 0;
        for j in range(1) {
            for i in range(0) {
                let x = [offset[0] + i as f64 * spacing, offset[1] + j as f64 * spacing];
                found += i32::from(shape.contains(&shape.to_global(&x)));
            }
        }
        assert_eq!(found, count);
    }
}

/// A material that yields at sigma_y in uniaxial tension, or at c_u in pure shear, however the
/// deck says so: the stress that the model returns far beyond yield shows it.
#[test]
fn strength_in_three_ways() {
    let stress = |set: &str, trial: [f64; 3]| {
        let deck = read(BEAM, &["material.steel.model=von-mises", set]);
        deck.materials[0].at(&Scope::default()).respond(trial, &[]).stress
    };
    let near = |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-12, "{found}");
    let tension = stress("material.steel.yield_stress=30e3", [0.2, -0.1, -0.1]);
    near(tension[0] - tension[1], 30e3);
    let shear = stress("material.steel.shear_strength=12e3", [0.1, -0.1, 0.0]);
    near(shear[0], 12e3);
    let radius = stress("material.steel.yield=20e3", [0.1, -0.1, 0.0]);
    near(radius[0] * 2.0_f64.sqrt(), 20e3);
}
