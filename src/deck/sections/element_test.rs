//! `[element_test]`, and the deck that consists of it and its material.

use std::path::Path;

use crate::deck::model::{
    Analysis, Deck, ElementPath, ElementTest, Grid, LatticeGrid, Material, Method, Output, Parallel,
};
use crate::deck::origins::Origins;
use crate::deck::problems::Got;
use crate::deck::reader::Table;

/// What every deck has, as far as it could be read.
pub struct Basics {
    pub title: Got<String>,
    pub analysis: Got<Analysis>,
    pub method: Got<Method>,
    pub materials: Got<Vec<Material>>,
    pub output: Got<Output>,
    pub parallel: Got<Parallel>,
}

/// The deck of an element test. Its grid is one cell that nothing reads.
pub fn deck(root: &Table<'_>, basics: Basics, directory: &Path) -> Got<Deck> {
    let named = |all: &Vec<Material>| all.iter().map(|one| one.name.clone()).collect();
    let names: Option<Vec<String>> = basics.materials.as_ref().ok().map(named);
    let test = if root.given("element_test") {
        root.table("element_test", |table| element_test(&table, names.as_deref()))
    } else {
        Err(root.missing("element_test", "analysis.type = \"element-test\" needs it"))
    };
    let (materials, test) = (basics.materials?, test?);
    if materials[test.material].varies() {
        let key = "material";
        let name = &materials[test.material].name;
        return root.table("element_test", |table| {
            let why = format!(
                "\"{name}\" has parameters that depend on the place, and the test has none: \
                 expected numbers"
            );
            Err(table.problem(key, why))
        });
    }
    let cell = LatticeGrid { origin: vec![0.0; 3], spacing: vec![1.0; 3], cells: vec![1; 3] };
    Ok(Deck {
        title: basics.title?,
        dimension: 3,
        directory: directory.to_path_buf(),
        analysis: basics.analysis?,
        stages: Vec::new(),
        method: basics.method?,
        ghost: None,
        grid: Grid::Lattice(cell),
        materials,
        bodies: Vec::new(),
        boundaries: Vec::new(),
        loads: Vec::new(),
        load_presence: Vec::new(),
        terms: Vec::new(),
        rigids: Vec::new(),
        contacts: Vec::new(),
        verify: Vec::new(),
        probes: Vec::new(),
        output: basics.output?,
        parallel: basics.parallel?,
        conditioning_displacement: None,
        element_test: Some(test),
        petsc: Vec::new(),
        notes: Vec::new(),
        origins: Origins::default(),
    })
}

/// `names` of the materials, if they could be read: else only their own faults are reported.
fn element_test(table: &Table<'_>, names: Option<&[String]>) -> Got<ElementTest> {
    let material = table.text("material");
    let path: Got<ElementPath> = table.choice("path");
    let confining = table.number("confining");
    let strain = table.number_if("strain");
    let steps = table.count("steps");
    let history = if table.given("history") { table.points("history", 3) } else { Ok(Vec::new()) };
    let (path, strain, history) = (path?, strain?, history?);
    if path == ElementPath::Strain {
        table.refuse(&["strain"], "path = \"strain\" takes history in its place")?;
        if history.is_empty() {
            return Err(table.missing("history", "path = \"strain\" needs it"));
        }
    } else {
        table.refuse(&["history"], "only path = \"strain\" reads it; give strain")?;
        if strain.is_none() {
            return Err(table.missing("strain", ""));
        }
    }
    let material = material?;
    let place = names.map(|names| (names, names.iter().position(|name| *name == material)));
    if let Some((names, None)) = place {
        let known = names.join(", ");
        return Err(table.problem("material", format!("no [material.{material}]; known: {known}")));
    }
    let place = place.and_then(|(_, place)| place).unwrap_or(0);
    Ok(ElementTest {
        material: place,
        path,
        confining: confining?,
        strain: strain.unwrap_or(0.0),
        steps: steps?,
        history: history.iter().map(|strain| [strain[0], strain[1], strain[2]]).collect(),
    })
}
