//! What a body of revolution cannot have: a part beyond its axis, a turn of its section, and the
//! bases and loads that are not derived for rings.

use crate::basis::Domain;
use crate::deck::model::{
    AffineTransfer, BodySource, Deck, GimpEdge, Grid, Load, MeshMotion, Support, SupportMethod,
    Symmetry,
};
use crate::deck::problems::Got;
use crate::deck::reader::Table;

/// Reports the first key that `analysis.symmetry = "axisymmetric"` does not go with.
pub fn check(root: &Table<'_>, deck: &Deck) -> Got<()> {
    if deck.analysis.symmetry == Symmetry::PlaneStrain {
        return Ok(());
    }
    let symmetry = |message: String, help: &str| -> Got<()> {
        root.table("analysis", |t| Err(t.problem_with_help("symmetry", message, help)))
    };
    if deck.dimension != 2 {
        let message = "\"axisymmetric\" is for problems in two dimensions, and the grid has three";
        return symmetry(message.into(), "take a grid of two axes: x is the radius, y the axis");
    }
    method(root, deck)?;
    if let Grid::Lattice(lattice) = &deck.grid
        && lattice.origin[0] < 0.0
    {
        let message = format!("expected at least 0: x is the radius, found {}", lattice.origin[0]);
        return root.table("grid", |t| Err(t.problem("origin", message)));
    }
    if let Grid::Mesh(mesh) = &deck.grid
        && matches!(mesh.motion, MeshMotion::RotateWith(_))
    {
        let message = "turns the section, which a body of revolution cannot do";
        return root.table("grid", |t| Err(t.problem("motion", message)));
    }
    root.tables("body", |index, table| {
        let lowest = match &deck.bodies[index].source {
            BodySource::Shape { shape, .. } => shape.bounds().map_or(0.0, |(min, _)| min[0]),
            _ => 0.0,
        };
        // A disc about the origin is cut by `where = "x > 0"` or by an intersection.
        if lowest < -1e-12 * shape_size(deck, index) {
            let message = format!("reaches to x = {lowest} m, beyond the axis: x is the radius");
            let help = "give the half of the section with x >= 0";
            return Err(table.problem_with_help("shape", message, help));
        }
        Ok(())
    })?;
    root.tables("boundary", |index, table| match &deck.boundaries[index].rotation {
        Some(_) => {
            Err(table
                .problem("rotation", "turns the section, which a body of revolution cannot do"))
        }
        None if deck.boundaries[index].support().is_some_and(by_nitsche) => {
            Err(table.problem("method", "\"nitsche\" is not derived for rings; use \"penalty\""))
        }
        None => Ok(()),
    })?;
    root.tables("load", |index, table| match &deck.loads[index] {
        Load::MadeField(_) => Err(table.problem(
            "manufactured",
            "has the equilibrium of plane strain or space; use body_force and [[verify]]",
        )),
        _ => Ok(()),
    })?;
    if deck.conditioning_displacement.as_ref().is_some_and(|d| d[0] != 0.0) {
        let message = "the first component must be 0: a body of revolution is rigid along y only";
        return root.table("conditioning", |t| Err(t.problem("displacement", message)));
    }
    Ok(())
}

fn by_nitsche(support: &Support) -> bool {
    support.method == SupportMethod::Nitsche
}

fn method(root: &Table<'_>, deck: &Deck) -> Got<()> {
    let refuse = |key: &'static str, message: String| -> Got<()> {
        root.table_or_default("method", |t| Err(t.problem(key, message)))
    };
    let method = &deck.method;
    match method.basis.domain() {
        Domain::None | Domain::Box => {}
        Domain::Parallelepiped | Domain::Corners => {
            let name = method.basis.name();
            return refuse(
                "basis",
                format!(
                    "\"{name}\" is not derived for rings (analysis.symmetry = \"axisymmetric\"); use \"mpm\" or \"gimp\""
                ),
            );
        }
    }
    if method.basis.domain() == Domain::Box && method.gimp_edge == GimpEdge::Published {
        let message = "\"published\" loses weight at the axis; with analysis.symmetry = \
                       \"axisymmetric\" use \"continued\"";
        return refuse("gimp_edge", message.into());
    }
    if let Some(name) = method.affine.map(AffineTransfer::name) {
        let message = format!(
            "\"{name}\" keeps the angular momentum of a plane or of space; with analysis.symmetry = \
             \"axisymmetric\" use \"flip\", \"pic\" or \"xpic\""
        );
        return refuse("velocity_update", message);
    }
    Ok(())
}

/// Largest extent of a body's shape, m.
fn shape_size(deck: &Deck, body: usize) -> f64 {
    let BodySource::Shape { shape, .. } = &deck.bodies[body].source else { return 0.0 };
    let Some((min, max)) = shape.bounds() else { return 0.0 };
    min.iter().zip(&max).map(|(a, b)| b - a).fold(0.0, f64::max)
}
