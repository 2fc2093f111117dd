//! What boundaries hold, component by component, and what they do not.

use crate::common::run::Run;

/// A shaft turned at its head: x and y turn there, z is what the other keys say.
fn shaft(head: &str) -> Run {
    Run::text(&format!(
        "ghost = \"off\"\n[analysis]\ntype = \"quasi-static\"\nsteps = 1\ntolerance = 1e-8\n\
         [method]\nbasis = \"mpm\"\n\
         [grid]\ntype = \"mesh\"\ngenerate = {{ box = {{ min = [-0.5, -0.5, 0.0], \
         max = [0.5, 0.5, 1.0], cells = [2, 2, 4], element = \"hex8\" }} }}\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 1e6\npoisson = 0.3\n\
         [[body]]\nmaterial = \"m\"\nshape = {{ cells = \"all\" }}\npoints_per_cell = [2, 2, 2]\n\
         [[boundary]]\nname = \"foot\"\nwhere = {{ tag = \"back\" }}\nfix = [\"x\", \"y\", \"z\"]\n\
         [[boundary]]\nname = \"head\"\nwhere = {{ tag = \"front\" }}\n{head}\n\
         [output]\nfields = [\"displacement\", \"position_initial\"]\n"
    ))
}

/// Mean displacement in z of the points nearest to the head, and the head's force along z, N.
fn lifted(head: &str, ranks: usize) -> (f64, f64) {
    let results = shaft(head).ranks(ranks).results();
    let points = results.points(1);
    let heights = points.component("position_initial", 2);
    let moves = points.component("displacement", 2);
    let near: Vec<f64> =
        heights.iter().zip(moves).filter(|(z, _)| **z > 0.9).map(|(_, u)| u).collect();
    let mean = near.iter().sum::<f64>() / near.len() as f64;
    (mean, *results.history("reaction.head.z").last().expect("a row"))
}

#[test]
fn a_rotation_prescribes_x_and_y_alone() {
    let turn = "rotation = { centre = [0, 0, 1.0], degrees = 5.0 }";
    for ranks in [1, 2] {
        // 0.1 m over a shaft 1 m long, whose last points lie at 0.9375 m.
        let (lift, pull) = lifted(&format!("{turn}\ndisplacement = {{ z = 0.1 }}"), ranks);
        assert!((lift - 0.09375).abs() < 2e-3, "{lift}");
        assert!(pull > 0.08e6, "{pull}");
        // Free in z: a twisted elastic shaft hardly changes its length.
        let (lift, pull) = lifted(turn, ranks);
        assert!(lift.abs() < 2e-3 && pull == 0.0, "{lift} {pull}");
        let (_, held) = lifted(&format!("{turn}\nfix = [\"z\"]"), ranks);
        assert!(held.abs() > 1.0, "{held}");
    }
}

/// The outermost points of a body on a mesh: all of it in this deck moves with its rim.
fn driven(grid: &str, shape: &str) -> Run {
    Run::text(&format!(
        "ghost = \"off\"\n[analysis]\ntype = \"quasi-static\"\nsteps = 2\n[method]\nbasis = \"mpm\"\n\
         [grid]\n{grid}\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 1e3\npoisson = 0.3\n\
         [[body]]\nname = \"b\"\nmaterial = \"m\"\ndensity = 1.0\n{shape}\n\
         [[boundary]]\nname = \"rim\"\nwhere = {{ cells_of = \"b\" }}\n\
         displacement = {{ x = 0.1, y = 0.0 }}\n\
         [output]\nfields = [\"displacement\"]\n"
    ))
}

const MESH: &str = "type = \"mesh\"\ngenerate = { box = { min = [-1, -1], max = [2, 2], \
                    cells = [12, 12], element = \"quad4\" } }";

#[test]
fn the_cells_of_a_body_on_a_mesh_move_it() {
    let block = "shape = { box = { min = [0, 0], max = [1, 1] } }\npoints_per_cell = [2, 2]";
    for ranks in [1, 2] {
        let results = driven(MESH, block).ranks(ranks).results();
        let points = results.points(2);
        assert_eq!(points.id.len(), 64);
        for u in points.component("displacement", 0) {
            assert!((u - 0.1).abs() < 1e-9, "{u}");
        }
    }
    // All of a mesh: its own outline.
    let whole = "type = \"mesh\"\nmotion = { follow = \"material\" }\ngenerate = { box = { min = [0, 0], \
                 max = [1, 1], cells = [4, 4], element = \"quad4\" } }";
    let results = driven(whole, "shape = { cells = \"all\" }\npoints_per_cell = [2, 2]").results();
    for u in results.points(2).component("displacement", 0) {
        assert!((u - 0.1).abs() < 1e-9, "{u}");
    }
}

/// The points of a file do not tell which of them are outermost.
#[test]
fn the_cells_of_a_body_of_a_file_are_refused() {
    let folder = tempfile::tempdir().expect("a scratch folder");
    std::fs::write(folder.path().join("p.csv"), "x,y,volume\n0.5,0.5,0.1\n").expect("writable");
    let lattice = "type = \"lattice\"\nsize = [2, 2]\nh = 0.5";
    let run = driven(lattice, "shape = { points = \"p.csv\" }");
    let outcome = run.ranks(2).attempt_in(folder);
    assert_eq!(outcome.code, 2, "{}", outcome.stderr);
    assert!(outcome.said().contains("boundary.0.where.cells_of: body \"b\""), "{}", outcome.said());
    assert_eq!(outcome.files(), ["deck.toml", "p.csv"]);
}

/// A block on a rough floor beside a smooth wall, which share the corner's x.
#[test]
fn a_component_that_two_boundaries_hold_counts_once() {
    let deck = |first: &str, second: &str| {
        Run::text(&format!(
            "ghost = \"off\"\n[analysis]\ntype = \"quasi-static\"\nsteps = 1\n[method]\nbasis = \"mpm\"\n\
             [grid]\ntype = \"lattice\"\nsize = [2, 1.25]\nh = 0.25\n\
             [material.m]\nmodel = \"hencky\"\nyoung = 1e5\npoisson = 0.3\n\
             [[body]]\nmaterial = \"m\"\ndensity = 100.0\n\
             shape = {{ box = {{ min = [0, 0], max = [1, 1] }} }}\n\
             {first}{second}[[load]]\ngravity = [0, -10]\n"
        ))
    };
    let floor =
        "[[boundary]]\nname = \"floor\"\nwhere = { side = \"bottom\" }\nfix = [\"x\", \"y\"]\n";
    let wall = "[[boundary]]\nname = \"wall\"\nwhere = { side = \"left\" }\nfix = [\"x\"]\n";
    let bears = |run: Run| {
        let results = run.results();
        let last = |name: &str| *results.history(name).last().expect("a row");
        (last("reaction.floor.x"), last("reaction.wall.x"), last("reaction.floor.y"))
    };
    let (floor_x, wall_x, weight) = bears(deck(floor, wall));
    for ranks in [1, 2] {
        let (other_floor_x, other_wall_x, _) = bears(deck(wall, floor).ranks(ranks));
        // No load acts along x, and the weight is 1000 N.
        assert!((floor_x + wall_x).abs() < 1e-6, "{floor_x} {wall_x}");
        assert!((other_floor_x + other_wall_x).abs() < 1e-6, "{other_floor_x} {other_wall_x}");
        assert!((weight - 1000.0).abs() < 1e-6, "{weight}");
        // The corner goes to the first of them.
        assert!((floor_x - other_floor_x).abs() > 1.0, "{floor_x} {other_floor_x}");
    }
}

/// Nodes of the first surface push a soft block down, which leaves them behind.
#[test]
fn a_boundary_that_the_body_has_left_is_warned_of() {
    let deck = "[analysis]\ntype = \"quasi-static\"\nsteps = 8\non_failure = \"cut\"\n\
         [method]\nbasis = \"gimp\"\ndomain_update = \"stretch\"\n\
         [ghost]\nstiffness_factor = 0.1\n\
         [grid]\ntype = \"lattice\"\nsize = [1, 1.5]\nh = 0.25\n\
         [material.m]\nmodel = \"hencky\"\nyoung = 1e4\npoisson = 0.0\n\
         [[body]]\nmaterial = \"m\"\nshape = { box = { min = [0, 0], max = [1, 1] } }\n\
         [[boundary]]\nwhere = { side = \"left\" }\nfix = [\"x\"]\n\
         [[boundary]]\nname = \"floor\"\nwhere = { side = \"bottom\" }\nfix = [\"y\"]\n\
         [[boundary]]\nname = \"plate\"\nwhere = { box = { min = [0, 1], max = [1, 1] } }\n\
         displacement = { y = -0.2 }\n\
         [output]\nevery = 100\n";
    for ranks in [1, 2] {
        let results = Run::text(deck).ranks(ranks).results();
        let plate = results.history("reaction.plate.held");
        // Half a cell beside the surface holds (h/2)/2 of the points' volume.
        assert!((0.08..0.14).contains(&plate[0]), "{plate:?}");
        assert!(plate[plate.len() - 1] < 0.25 * plate[0], "{plate:?}");
        let floor = results.history("reaction.floor.held");
        assert!(floor[floor.len() - 1] > 0.5 * floor[0], "{floor:?}");
        let warnings = results.summary["warnings"].to_string();
        assert!(
            warnings.contains("boundary \\\"plate\\\" holds less than a quarter"),
            "{warnings}"
        );
        assert!(!warnings.contains("floor"), "{warnings}");
        assert!(results.text("log.txt").contains("warning: step "), "told in the log");
    }
}
