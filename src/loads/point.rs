//! f_p = share f(s, t) (Lagrangian eq. 29): a total force held by a few points.
//!
//! Points hold a constant force themselves (`points.point_force`, moved and stored with them). A
//! function of s or t is held here, with the identities of the points that carry it.

use super::declaration::{Around, Declaration, all_of, expressions};
use super::{Load, Moment, Start};
use crate::deck::expression::Expression;
use crate::deck::model::Body;
use crate::deck::schema::{Key, Kind, Need, Section, key};
use crate::deck::{Got, Table, of_body, toml_text};
use crate::error::Result;
use crate::material::Material;
use crate::points::Points;

/// A point force as the deck has it: in N (2D: N/m), expressions of s and t, shared equally by the points nearest to
/// the given places.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Whose points carry it.
    pub body: usize,
    /// Places, m.
    pub nearest: Vec<Vec<f64>>,
    /// Total force.
    pub force: Vec<Expression>,
}

impl Declaration for Point {
    const KEY: Key = {
        let doc = "Force held by material points.";
        key("point", Kind::Table("load.point"), Need::Optional("-"), doc)
    };

    const SECTIONS: &'static [Section] = &[Section {
        name: "load.point",
        header: "load.point",
        doc: "Shared equally by the points nearest to the given places.",
        keys: &[
            key("body", Kind::Text, Need::Optional("the only body"), "Name of the body."),
            key("nearest", Kind::Points, Need::Required, "Places, one point each: the nearest, at most the diagonal of a cell (and half that of its domain) away.").unit("m"),
            key("force", Kind::Expressions("s t"), Need::Required, "Total force (per metre in plane strain).").unit("N"),
        ],
    }];

    fn read(table: &Table<'_>, around: &Around<'_>) -> Got<Self> {
        table.table("point", |t| {
            let body = of_body(&t, around.names);
            let nearest = t.points("nearest", around.dimension);
            let force = expressions(&t, "force", around.dimension);
            let nearest = nearest?;
            let force = force?;
            if nearest.is_empty() {
                return Err(t.problem("nearest", "expected one or more positions, found none"));
            }
            Ok(Point { body: body?, nearest, force })
        })
    }

    fn written(&self, bodies: &[Body]) -> String {
        toml_text::inline(&[
            ("body", toml_text::quote(&bodies[self.body].name)),
            ("nearest", toml_text::array(self.nearest.iter().map(|x| toml_text::vector(x)))),
            ("force", toml_text::expressions(&self.force)),
        ])
    }

    fn formulas(&self) -> Vec<(&'static str, &Expression)> {
        all_of("point.force", &self.force)
    }

    fn body(&self) -> Option<usize> {
        Some(self.body)
    }

    fn make<const D: usize>(&self, start: Start<'_, D>) -> Result<Box<dyn Load<D>>> {
        Ok(Box::new(PointForce::new(&self.force, &start.found.carriers)))
    }
}

/// Identities of the points that carry a load, each with its share of it; a point may come several
/// times. The same on all ranks; empty for loads that no single points carry.
pub type Carriers = Vec<(u64, f64)>;

/// Total force of s and t, N, and who carries it: ascending, each once.
pub struct PointForce {
    force: Vec<Expression>,
    carriers: Carriers,
}

impl PointForce {
    /// `carriers`: empty where the points hold the force themselves.
    pub fn new(force: &[Expression], carriers: &Carriers) -> Self {
        let mut carriers = carriers.clone();
        carriers.sort_by_key(|(id, _)| *id);
        carriers.dedup_by(|(next, more), (id, share)| {
            let again = next == id;
            if again {
                *share += *more;
            }
            again
        });
        PointForce { force: force.to_vec(), carriers }
    }
}

impl<const D: usize> Load<D> for PointForce {
    fn add_to_points(
        &self,
        points: &Points<D>,
        _materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        if self.carriers.is_empty() {
            return Ok(());
        }
        let total: [f64; D] = at.values(&self.force, &at.scope());
        for (force, id) in forces.iter_mut().zip(&points.id) {
            if let Ok(place) = self.carriers.binary_search_by_key(id, |(id, _)| *id) {
                for (f, total) in force.iter_mut().zip(total) {
                    *f += total * self.carriers[place].1;
                }
            }
        }
        Ok(())
    }
}
