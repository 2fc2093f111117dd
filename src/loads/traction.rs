//! t(X, s, t) A: a dead traction per initial area on a body's surface (formulations.md B.6 (b)). It
//! acts at the surface's elements ([`crate::surface`]): `system/terms/surface.rs` hands it to the nodes.

use super::declaration::{Around, Declaration, all_of, expressions};
use super::{Load, OnSurface, Start};
use crate::deck::expression::Expression;
use crate::deck::model::{Body, BodySurface};
use crate::deck::schema::{Key, Kind, Need, OF_BODY, Section, key};
use crate::deck::{Got, Table, body_surface, toml_text};
use crate::error::Result;
use crate::surface::Surface;

/// A traction as the deck has it.
#[derive(Debug, Clone, PartialEq)]
pub struct TractionOn {
    /// Where it acts.
    pub surface: BodySurface,
    /// Pa per initial area, expressions of X, Y, Z, s, t.
    pub value: Vec<Expression>,
}

impl Declaration for TractionOn {
    const KEY: Key = {
        let doc = "Dead load per initial area on a body's surface.";
        key("traction", Kind::Table("load.traction"), Need::Optional("-"), doc)
    };

    const SECTIONS: &'static [Section] = &[Section {
        name: "load.traction",
        header: "load.traction",
        doc: "Keeps its direction and its total, whatever the body does. It acts on the body's own surface: at places of its shape, which the points beside them carry along.",
        keys: &[
            OF_BODY[0],
            OF_BODY[1],
            OF_BODY[2],
            key("value", Kind::Expressions("X Y Z s t"), Need::Required, "Force per initial area.")
                .unit("Pa"),
        ],
    }];

    fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self> {
        let Around { dimension, names, bodies, .. } = *around;
        table.table("traction", |t| {
            let surface = body_surface(&t, dimension, names, bodies);
            let value = expressions(&t, "value", dimension)?;
            Ok(TractionOn { surface: surface?, value })
        })
    }

    fn written(&self, bodies: &[Body]) -> String {
        let mut pairs = toml_text::body_surface(bodies, &self.surface);
        pairs.push(("value", toml_text::expressions(&self.value)));
        toml_text::inline(&pairs)
    }

    fn formulas(&self) -> Vec<(&'static str, &Expression)> {
        all_of("traction.value", &self.value)
    }

    fn body(&self) -> Option<usize> {
        Some(self.surface.body)
    }

    fn surface(&self) -> Option<(&BodySurface, &'static str)> {
        Some((&self.surface, "traction"))
    }

    fn make<const D: usize>(&self, start: Start<'_, D>) -> Result<Box<dyn Load<D>>> {
        Ok(Box::new(Traction { surface: start.found.surface, value: self.value.clone() }))
    }
}

/// A traction and the surface that it acts on.
pub struct Traction<const D: usize> {
    /// Where it acts.
    pub surface: Surface<D>,
    /// Pa, one expression of X, Y, Z, s, t per axis.
    pub value: Vec<Expression>,
}

impl<const D: usize> Load<D> for Traction<D> {
    fn on_surface(&self) -> Option<OnSurface<'_, D>> {
        Some(OnSurface::Traction { surface: &self.surface, value: &self.value })
    }
}
