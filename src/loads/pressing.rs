//! `pressure` of `[[load]]`: by virtual stress on the surfaces of all bodies ([`Pressure`]), or on a body's own surface
//! ([`SurfacePressure`]).

use super::declaration::{Around, Declaration};
use super::pressure::{Pressure, PressureZone};
use super::surface_pressure::SurfacePressure;
use super::{Load, Start};
use crate::deck::expression::{Expression, Variable};
use crate::deck::model::{Body, BodySurface};
use crate::deck::schema::{BOX_KEYS, Key, Kind, Need, OF_BODY, POSITIVE, Section, key};
use crate::deck::{Got, Table, body_surface, corners, toml_text};
use crate::error::Result;

/// A pressure as the deck has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Pressing {
    /// Pa, an expression of x, y, z, s, t.
    pub value: Expression,
    /// Where on the surfaces of all bodies; `None`: everywhere.
    pub zone: Option<PressureZone>,
    /// A body's own surface in place of those of all bodies.
    pub surface: Option<BodySurface>,
}

impl Declaration for Pressing {
    const KEY: Key = {
        let doc = "Pressure on the surface of all bodies, in the current state.";
        key("pressure", Kind::Table("load.pressure"), Need::Optional("-"), doc)
    };

    const SECTIONS: &'static [Section] = &[
        Section {
            name: "load.surface",
            header: "load.pressure.surface",
            doc: "A part of a body's own surface, at the start.",
            keys: OF_BODY,
        },
        Section {
            name: "load.pressure",
            header: "load.pressure",
            doc: "Acts along the inward normal of every surface, and follows the motion; on a surface that is held, the reaction takes it. It is a sum over the points (virtual stress), which needs no surface: what it pushes is where the points' volume ends. `max`, `min` and `abs` are averaged over a point's domain. Water up to level 8: value = \"max(0, 9.81e3*(8-y))\".",
            keys: &[
                key(
                    "value",
                    Kind::Expression("x y z s t"),
                    Need::Required,
                    "Compression positive; a formula has derivatives (no `if`, no comparisons).",
                )
                .unit("Pa"),
                key(
                    "where",
                    Kind::Table("load.pressure.where"),
                    Need::Optional("everywhere"),
                    "A part of the surfaces.",
                ),
                key(
                    "surface",
                    Kind::Table("load.surface"),
                    Need::Optional("-"),
                    "The body's own surface, or a part of it: the pressure then acts at places of its shape, carried by the points beside them, and not by virtual stress. Its area and normal follow the deformation.",
                ),
            ],
        },
        Section {
            name: "load.pressure.where",
            header: "load.pressure.where",
            doc: "The pressure acts in full inside a box, and falls smoothly to zero outside: surfaces within that width are pushed too, by less. The fall lies inside the body, too, where points that are too few for it show as an error of the force: 3e-4 with three cells of 2 points a side. A fade of less than a cell is not resolved.",
            keys: &[
                key(
                    "box",
                    Kind::Table("load.pressure.where.box"),
                    Need::Required,
                    "In current positions.",
                ),
                key("fade", Kind::Number, Need::Optional("three cells"), "Width of the fall.")
                    .unit("m")
                    .range(POSITIVE),
            ],
        },
        Section {
            name: "load.pressure.where.box",
            header: "load.pressure.where.box",
            doc: "A plane where min equals max.",
            keys: BOX_KEYS,
        },
    ];

    fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self> {
        let Around { dimension, names, bodies, .. } = *around;
        table.table("pressure", |t| {
            let value = t.expression_if("value");
            let zone = t.table_if("where", |t| {
                let corners = t.table("box", |t| corners(&t, dimension, true));
                let ((min, max), fade) = (corners?, t.number_if("fade")?);
                Ok(PressureZone { min, max, fade })
            });
            let value = value?.ok_or_else(|| t.missing("value", ""))?;
            if dimension == 2 && value.depends_on(Variable::CurrentZ) {
                return Err(t.problem("value", "z is not known here: the problem is 2D"));
            }
            if let Err(why) = value.averaged() {
                return Err(t.problem("value", why));
            }
            if !t.given("surface") {
                return Ok(Pressing { value, zone: zone?, surface: None });
            }
            t.refuse(&["where"], "surface has a where of its own")?;
            let surface = t.table("surface", |t| body_surface(&t, dimension, names, bodies));
            Ok(Pressing { value, zone: None, surface: Some(surface?) })
        })
    }

    fn written(&self, bodies: &[Body]) -> String {
        let mut pairs = vec![("value", toml_text::expression(&self.value))];
        if let Some(zone) = &self.zone {
            let limits =
                [("min", toml_text::vector(&zone.min)), ("max", toml_text::vector(&zone.max))];
            let mut place = vec![("box", toml_text::inline(&limits))];
            place.extend(zone.fade.map(|fade| ("fade", toml_text::number(fade))));
            pairs.push(("where", toml_text::inline(&place)));
        }
        if let Some(surface) = &self.surface {
            let pairs_of_surface = toml_text::body_surface(bodies, surface);
            pairs.push(("surface", toml_text::inline(&pairs_of_surface)));
        }
        toml_text::inline(&pairs)
    }

    fn formulas(&self) -> Vec<(&'static str, &Expression)> {
        vec![("pressure.value", &self.value)]
    }

    fn body(&self) -> Option<usize> {
        self.surface.as_ref().map(|surface| surface.body)
    }

    fn surface(&self) -> Option<(&BodySurface, &'static str)> {
        self.surface.as_ref().map(|surface| (surface, "pressure.surface"))
    }

    fn may_hold(&self, axis: usize) -> bool {
        const PLACE: [Variable; 3] = [Variable::CurrentX, Variable::CurrentY, Variable::CurrentZ];
        self.surface.is_none() && (self.zone.is_some() || self.value.depends_on(PLACE[axis]))
    }

    fn make<const D: usize>(&self, start: Start<'_, D>) -> Result<Box<dyn Load<D>>> {
        let pressure = Pressure::new(&self.value, self.zone.as_ref(), start.cell)?;
        Ok(match self.surface {
            Some(_) => Box::new(SurfacePressure { surface: start.found.surface, pressure }),
            None => Box::new(pressure),
        })
    }
}
