//! f_p = c q(y) A_p n with q(y) = rho v(y)^2 / 2 and v(y) = v_10 (y / 10 m)^a: pressure of wind with
//! a power-law profile (EN 1991-1-4 has its own profile; this one is common in ASCE 7) on a side of
//! a body, carried by its outermost layer of points.

use crate::deck::expression::Expression;
use crate::deck::model::Body;
use crate::deck::schema::{Key, Kind, Need, POSITIVE, Section, at_least, key};
use crate::deck::{Got, Table, toml_text};
use crate::error::Result;
use crate::loads::{Around, Declaration, Load, Moment, Start};
use crate::material::Material;
use crate::points::Points;

/// Height that the speed belongs to, m.
const REFERENCE: f64 = 10.0;

/// A point belongs to the layer if its domain ends at the side, to this share of its half length.
const SLACK: f64 = 1e-6;

/// Wind along the axis x on a plane side of the bodies, as the deck has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Wind {
    /// The windward side, m; the bodies lie beyond it.
    pub side: f64,
    /// m2 (m in 2D)
    pub area: f64,
    /// rho, kg/m3
    pub density: f64,
    /// v_10, m/s, a formula of s and t
    pub speed: Expression,
    /// a
    pub exponent: f64,
    /// c: positive for pressure, negative for suction.
    pub coefficient: f64,
}

impl Declaration for Wind {
    const KEY: Key = {
        let doc = "Wind along x on a plane side.";
        key("wind", Kind::Table("load.wind"), Need::Optional("-"), doc)
    };

    const SECTIONS: &'static [Section] = &[Section {
        name: "load.wind",
        header: "load.wind",
        doc: "The speed grows with a power of the height. The outermost points carry the pressure.",
        keys: &[
            key("side", Kind::Number, Need::Required, "x of the windward side.").unit("m"),
            key("area", Kind::Number, Need::Required, "Of the side.").unit("m2").range(POSITIVE),
            key("density", Kind::Number, Need::Default("1.25"), "Of air.").unit("kg/m3"),
            key("speed", Kind::Expression("s t"), Need::Required, "In a height of 10 m.")
                .unit("m/s"),
            key("exponent", Kind::Number, Need::Default("0.2"), "Power of the height.")
                .range(at_least(0.0)),
            key("coefficient", Kind::Number, Need::Required, "Pressure over dynamic pressure."),
        ],
    }];

    fn read(table: &Table<'_>, _around: &Around<'_>) -> Got<Self> {
        table.table("wind", |t| {
            let (side, area, density) = (t.number("side"), t.number("area"), t.number("density"));
            let (speed, exponent) = (t.expression_if("speed"), t.number("exponent"));
            Ok(Wind {
                coefficient: t.number("coefficient")?,
                speed: speed?.ok_or_else(|| t.missing("speed", ""))?,
                side: side?,
                area: area?,
                density: density?,
                exponent: exponent?,
            })
        })
    }

    fn written(&self, _bodies: &[Body]) -> String {
        toml_text::inline(&[
            ("side", toml_text::number(self.side)),
            ("area", toml_text::number(self.area)),
            ("density", toml_text::number(self.density)),
            ("speed", toml_text::expression(&self.speed)),
            ("exponent", toml_text::number(self.exponent)),
            ("coefficient", toml_text::number(self.coefficient)),
        ])
    }

    fn formulas(&self) -> Vec<(&'static str, &Expression)> {
        vec![("wind.speed", &self.speed)]
    }

    fn make<const D: usize>(&self, start: Start<'_, D>) -> Result<Box<dyn Load<D>>> {
        let Start { world, points, .. } = start;
        let carried = (0..points.len()).filter(|&p| carries(0, self.side, points, p));
        let volume = world.sum(carried.map(|p| points.volume_initial[p]).sum());
        Ok(Box::new(Blowing { wind: self.clone(), volume }))
    }
}

/// Whether point `p` is in the outermost layer at a side across `axis`. It depends on the start alone.
pub fn carries<const D: usize>(axis: usize, side: f64, points: &Points<D>, p: usize) -> bool {
    let (x, half) = (points.position_initial[p][axis], points.half_length_initial[p][axis]);
    x - (1.0 + SLACK) * half <= side
}

/// Wind on the points of a run.
struct Blowing {
    wind: Wind,
    /// Initial volume of the points that carry the side, over all ranks, m3.
    volume: f64,
}

impl<const D: usize> Load<D> for Blowing {
    fn add_to_points(
        &self,
        points: &Points<D>,
        _materials: &[Material],
        at: Moment,
        forces: &mut [[f64; D]],
    ) -> Result<()> {
        let Wind { side, area, density, speed, exponent, coefficient } = &self.wind;
        // With the ramp of the load's pressure, which grows with the square of the speed.
        let (factor, speed) = (at.factor_of(speed), speed.value(&at.scope()));
        for (p, force) in forces.iter_mut().enumerate() {
            if !carries(0, *side, points, p) {
                continue;
            }
            let height = points.position_initial[p][1].max(0.0);
            let speed = speed * (height / REFERENCE).powf(*exponent);
            let pressure = coefficient * 0.5 * density * speed * speed;
            force[0] += factor * pressure * area * points.volume_initial[p] / self.volume;
        }
        Ok(())
    }
}
