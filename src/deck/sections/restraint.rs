//! Whether boundary conditions hold the bodies: a quasi-static system without them is singular.

use crate::deck::model::{Analysis, Boundary, Load, Symmetry};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::schema::AXES;
use crate::deck::stage::Stage;
use crate::deck::tree::Origin;
use crate::system::terms::Declared;

/// Reports an axis along which nothing is prescribed in a stage of a quasi-static analysis.
pub fn check(
    root: &Table<'_>,
    analysis: &Analysis,
    stages: &[Stage],
    (boundaries, loads, terms): (&[Boundary], &[Load], &[Declared]),
    dimension: usize,
) -> Got<()> {
    if !analysis.kind.is_static() {
        return Ok(());
    }
    let held = |axis: usize, stage: usize| {
        // Rings resist what would stretch their hoops.
        let hoops = axis == 0 && analysis.symmetry == Symmetry::Axisymmetric;
        let floats = loads.iter().any(|load| load.may_hold(axis))
            || terms.iter().any(|term| term.may_hold(axis));
        let holds =
            |boundary: &Boundary| boundary.presence.holds_in(stage) && boundary.may_hold(axis);
        hoops || floats || boundaries.iter().any(holds)
    };
    let free_in = |stage: usize| -> Vec<&str> {
        (0..dimension).filter(|axis| !held(*axis, stage)).map(|axis| AXES[axis]).collect()
    };
    let Some((stage, free)) =
        (0..stages.len()).map(|stage| (stage, free_in(stage))).find(|(_, free)| !free.is_empty())
    else {
        return Ok(());
    };
    let when = match stages[stage].name.as_str() {
        "" => String::new(),
        name => format!(" in stage \"{name}\""),
    };
    let message = if boundaries.is_empty() && free.len() == dimension {
        "no [[boundary]]: nothing holds the bodies, so that the quasi-static system is singular (any rigid motion solves it)".to_string()
    } else {
        format!(
            "no [[boundary]] holds {}{when}: the bodies can move rigidly along it, so that the quasi-static system is singular",
            free.join(" and ")
        )
    };
    let fix = free.iter().map(|axis| format!("\"{axis}\"")).collect::<Vec<_>>().join(", ");
    let help = format!("for example a [[boundary]] with fix = [{fix}]");
    Err(root.problems().report(&Origin::Nowhere, "boundary", message, help))
}
