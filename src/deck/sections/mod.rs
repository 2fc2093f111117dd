//! Values of each section, and the checks across sections.
//!
//! | file | sections |
//! |---|---|
//! | `analysis.rs` | analysis, method, conditioning |
//! | `axisymmetry.rs` | what a body of revolution cannot have |
//! | `element_test.rs` | element_test, and a deck of nothing else |
//! | `ghost.rs` | ghost, and what is in force without it |
//! | `grid.rs` | grid |
//! | `materials.rs` | material |
//! | `stages.rs` | stage, `from` and `until` |
//! | `bodies.rs` | body |
//! | `initial_stress.rs` | body.initial_stress |
//! | `shapes.rs` | body.shape |
//! | `conditions.rs` | boundary, load, water |
//! | `surfaces.rs` | boundary.surface, and the surfaces of loads |
//! | `contact.rs` | rigid, contact |
//! | `restraint.rs` | whether rigid motion is held |
//! | `probes.rs` | probe |
//! | `results.rs` | verify, output, parallel |
//! | `petsc.rs` | petsc |

mod analysis;
mod axisymmetry;
mod bodies;
pub(super) mod conditions;
mod contact;
mod element_test;
mod ghost;
mod grid;
mod initial_stress;
mod materials;
pub(super) mod petsc;
mod probes;
mod restraint;
mod results;
pub(super) mod shapes;
mod stages;
pub(super) mod surfaces;

use std::path::Path;

use super::model::{AnalysisType, Deck};
use super::origins::Origins;
use super::problems::{Got, Problems};
use super::reader::Table;
use super::schema;
use super::tree::Node;
use crate::loads::Around;
use crate::system::terms;

/// Reads the whole deck; goes on after a problem as long as what follows can be judged.
pub fn deck(problems: &Problems, root: &Node, directory: &Path) -> Got<Deck> {
    let root = Table::open(problems, schema::section(""), "", root)?;
    let title = root.text("title");
    let staged = root.given("stage");
    let mut analysis = root.table("analysis", |table| analysis::analysis(&table, staged));
    let stages = stages::stages(&root, &mut analysis);
    let stage_names = root.names_of("stage");
    let ghost = ghost::wanted(&root);
    let kind = analysis.as_ref().ok().map(|analysis| analysis.kind);
    let method = root
        .table_or_default("method", |table| analysis::method(&table, ghost.as_ref().ok(), kind));
    let materials = materials::materials(&root, analysis.as_ref().ok());
    let output = root.table_or_default("output", |table| results::output(&table, kind));
    let parallel = root.table_or_default("parallel", |table| results::parallel(&table));
    let petsc = petsc::petsc(&root);
    // Where [analysis] could not be read, [element_test] shows its kind.
    let alone = kind.is_none() && root.given("element_test");
    if alone || kind == Some(AnalysisType::ElementTest) {
        let basics = element_test::Basics { title, analysis, method, materials, output, parallel };
        return element_test::deck(&root, basics, directory);
    }
    // Without the grid the dimension is unknown, and nothing below can be judged.
    let (grid, dimension) = root.table("grid", |table| grid::grid(&table, directory))?;
    let conditioning = analysis::conditioning(&root, analysis.as_ref().ok(), dimension);
    let earlier = bodies::EarlierSections {
        dimension,
        directory,
        grid: &grid,
        analysis: analysis.as_ref().ok(),
        method: method.as_ref().ok(),
        stages: &stage_names,
    };
    let bodies = bodies::bodies(&root, &earlier);
    let names = root.names_of("body");
    let boundaries = conditions::boundaries(&root, &earlier, &names, bodies.as_deref().ok());
    let loads = conditions::loads(&root, &earlier, &names, bodies.as_deref().ok());
    let around = Around { root: &root, dimension, names: &names, bodies: bodies.as_deref().ok() };
    let terms = terms::Declared::read(&root, &around);
    let staging = contact::InStages { names: &stage_names, kind };
    let rigids = contact::rigids(&root, directory, dimension, boundaries.as_deref().ok(), &staging);
    let contacts = {
        let choices = (analysis.as_ref().ok(), method.as_ref().ok());
        contact::contacts(&root, rigids.as_deref().ok(), &names, choices, &staging)
    };
    let verify = results::verify(&root, dimension);
    let probes = probes::probes(&root, dimension, &names);
    if let (Ok(method), Ok(boundaries)) = (&method, &boundaries) {
        let grid_problems = root.table("grid", |table| {
            grid::check_basis(&table, &grid, method)?;
            grid::check_motion(&table, &grid, boundaries)
        });
        grid_problems?;
    }
    if let (Ok(analysis), Ok(stages), Ok(boundaries), Ok(loads), Ok(terms)) =
        (&analysis, &stages, &boundaries, &loads, &terms)
    {
        // What a rigid body holds is known once its corners are.
        if matches!(&contacts, Ok(contacts) if contacts.is_empty()) {
            restraint::check(&root, analysis, stages, (boundaries, &loads.0, terms), dimension)?;
        } else if let Ok(bodies) = &bodies {
            stages::keeps_what_touches(&root, analysis.kind, bodies, boundaries)?;
        }
        if let (true, Ok(bodies)) = (staged, &bodies) {
            let loads = (&loads.0[..], &loads.1[..]);
            let touching =
                (rigids.as_deref().unwrap_or_default(), contacts.as_deref().unwrap_or_default());
            stages::check(&root, analysis.kind, stages, bodies, boundaries, loads, touching)?;
        }
    }
    if let (Ok(analysis), Ok(materials), Ok(bodies)) = (&analysis, &materials, &bodies)
        && analysis.kind == AnalysisType::StrengthReduction
        && !bodies.iter().any(|body| materials[body.material].has_strength())
    {
        let what = "no body has a material with a strength that could be reduced";
        let help = "for example model = \"mohr-coulomb\"";
        return root.table("analysis", |table| Err(table.problem_with_help("type", what, help)));
    }
    let (analysis, method, stages) = (analysis?, method?, stages?);
    let (mut loads, mut load_presence) = loads?;
    let water = conditions::water(&root, dimension, bodies.as_deref().ok());
    if let Some((load, presence)) = water? {
        loads.push(load);
        load_presence.push(presence);
    }
    let ghost = ghost?.in_force(analysis.kind, method.mass);
    let mut deck = Deck {
        title: title?,
        dimension,
        directory: directory.to_path_buf(),
        analysis,
        stages,
        method,
        ghost,
        materials: materials?,
        bodies: bodies?,
        boundaries: boundaries?,
        loads,
        load_presence,
        terms: terms?,
        rigids: rigids?,
        contacts: contacts?,
        verify: verify?,
        probes: probes?,
        output: output?,
        parallel: parallel?,
        conditioning_displacement: conditioning?,
        element_test: None,
        petsc: petsc?,
        notes: Vec::new(),
        origins: Origins::default(),
        grid,
    };
    grid::make_finite_elements(&root, &mut deck)?;
    axisymmetry::check(&root, &deck)?;
    Ok(deck)
}
