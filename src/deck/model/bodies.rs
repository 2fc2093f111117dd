//! `[material.NAME]` and `[[body]]`.

use std::path::PathBuf;

use crate::deck::expression::{Expression, Scope};
use crate::deck::shape::Shape;
use crate::deck::stage::Presence;
use crate::material::{Entry, Parameter};

#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    pub model: &'static Entry,
    /// One per parameter of the model: a number or a formula of X, Y, Z; `None` where the deck
    /// leaves it out.
    pub parameters: Vec<Option<Expression>>,
    /// Size of the grid's cells, m: how wide a band of softening material is. 0 without a grid.
    pub cell: f64,
}

impl Material {
    /// Whether a parameter depends on the place.
    pub fn varies(&self) -> bool {
        self.parameters.iter().flatten().any(|value| value.as_constant().is_none())
    }

    /// The model with the parameters that hold at a place.
    pub fn at(&self, scope: &Scope) -> crate::material::Material {
        (self.model.make)(&self.values(scope))
    }

    /// Whether the model has a strength that can be reduced.
    pub fn has_strength(&self) -> bool {
        let mut given = self.model.parameters.iter().zip(&self.parameters);
        given.any(|(known, value)| value.is_some() && strength_of(known.key).is_some())
    }

    /// Divides the strength among `values`, in the order of the model's parameters, by a factor:
    /// stresses, and tangents of angles.
    pub fn weaken(&self, values: &mut [f64], factor: f64) {
        for (known, value) in self.model.parameters.iter().zip(values) {
            match strength_of(known.key) {
                Some(Strength::Stress) => *value /= factor,
                Some(Strength::Angle) => {
                    *value = (value.to_radians().tan() / factor).atan().to_degrees();
                }
                None => {}
            }
        }
    }

    /// The parameters at a place, in the order of the model's; the strain of softening is brought from
    /// its length to the grid's cells.
    pub fn values(&self, scope: &Scope) -> Vec<f64> {
        let given = self.parameters.iter().zip(self.model.parameters);
        let value = |(value, known): (&Option<Expression>, &Parameter)| match value {
            Some(value) => value.value(scope),
            None => known.value_if_absent(),
        };
        let mut values: Vec<f64> = given.map(value).collect();
        let place = |key: &str| self.model.parameters.iter().position(|known| known.key == key);
        if let (Some(strain), Some(length)) = (place("softening.strain"), place("softening.length"))
            && self.cell > 0.0
        {
            values[strain] *= values[length] / self.cell;
        }
        values
    }
}

enum Strength {
    Stress,
    Angle,
}

/// What a key of a material is to a strength reduction.
fn strength_of(key: &str) -> Option<Strength> {
    match key.rsplit('.').next().unwrap_or(key) {
        "cohesion" | "tension" | "shear_strength" | "yield" | "yield_stress" | "hardening"
        | "stress" => Some(Strength::Stress),
        "friction" | "dilation" => Some(Strength::Angle),
        _ => None,
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    pub name: String,
    /// Index into `Deck::materials`.
    pub material: usize,
    /// kg/m3, initial
    pub density: f64,
    pub source: BodySource,
    /// m/s, one expression per axis of X, Y, Z.
    pub velocity: Vec<Expression>,
    /// `overlap = "allow"`: it may lie where another body lies.
    pub may_overlap: bool,
    pub initial_stress: Option<InitialStress>,
    pub presence: Presence,
}

/// Effective Cauchy stress of a body before the first step, Pa, tension positive.
#[derive(Debug, Clone, PartialEq)]
pub enum InitialStress {
    /// xx, yy, zz, xy, yz, xz: expressions of X, Y, Z.
    Components(Box<[Expression; 6]>),
    /// Weight of what lies above, and a share of it to the sides.
    K0(Box<K0>),
}

/// Expressions of X, Y, Z, but for the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct K0 {
    /// N/m3, saturated where there is water.
    pub unit_weight: Expression,
    /// Height of the surface along the axis, m.
    pub surface: Expression,
    /// Horizontal over vertical effective stress.
    pub k0: Expression,
    /// On the surface, Pa, in all; without it the water that stands there.
    pub surcharge: Option<Expression>,
    /// The vertical one.
    pub axis: usize,
}

/// A file of points: csv, or VTK (.vtu, .vtp, .vtk).
#[derive(Debug, Clone, PartialEq)]
pub struct PointsFile {
    /// Joined to the deck's folder.
    pub path: PathBuf,
    /// Only the points with this number of a body.
    pub of_body: Option<usize>,
    pub names: PointNames,
}

impl PointsFile {
    /// The ending of its name in small letters.
    pub fn ending(&self) -> String {
        let ending = self.path.extension().unwrap_or_default();
        ending.to_string_lossy().to_ascii_lowercase()
    }
}

/// What a file calls its columns or arrays, where not by the usual names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PointNames {
    /// Columns of x, y, z, and of the velocity along them.
    pub axes: [Option<String>; 3],
    pub rates: [Option<String>; 3],
    pub volume: Option<String>,
    /// Array of a VTK file.
    pub velocity: Option<String>,
    pub body: Option<String>,
}

impl PointNames {
    /// Key and name, in the order of the schema.
    pub fn pairs(&self) -> Vec<(&'static str, &str)> {
        let keys = ["x", "y", "z", "vx", "vy", "vz", "volume", "velocity", "body"];
        let own = [&self.volume, &self.velocity, &self.body];
        let all = self.axes.iter().chain(&self.rates).chain(own);
        keys.into_iter().zip(all).filter_map(|(k, name)| Some((k, name.as_deref()?))).collect()
    }

    /// Whether any is given.
    pub fn any(&self) -> bool {
        !self.pairs().is_empty()
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum BodySource {
    Shape {
        shape: Shape,
        seeding: Seeding,
    },
    /// Points of a file.
    File(PointsFile),
    /// All cells of a mesh, or those with this physical tag.
    MeshCells {
        tag: Option<String>,
        seeding: Seeding,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub enum Seeding {
    /// Equal sub-cells per grid cell, per axis; on a mesh the equivalent number per element.
    PerCell(Vec<usize>),
    /// Points at offset + (i, j, k) * spacing, m, kept where the centre is inside the shape;
    /// volume spacing^D. Offset is a position in the shape's local frame (before `translate`).
    Lattice { spacing: f64, offset: Vec<f64> },
    /// Gauss points per axis and cell.
    Gauss(usize),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::schema;
    use crate::material::CATALOGUE;

    /// The reference names all that a strength reduction divides.
    #[test]
    fn the_reference_lists_what_a_strength_reduction_divides() {
        let analysis = schema::section("analysis");
        let doc = analysis.key("strength_tolerance").expect("a key").doc;
        for parameter in CATALOGUE.iter().flat_map(|entry| entry.parameters) {
            let key = parameter.key;
            if strength_of(key).is_none() {
                continue;
            }
            let named = match key {
                "yield" | "yield_stress" => "yield stresses",
                "shear_strength" => "shear strengths",
                "cohesion" | "tension" => &format!("{key}s"),
                key if key.starts_with("softening.") => "residual values",
                key => key,
            };
            assert!(doc.contains(named), "{key}: {named} is not in: {doc}");
        }
    }
}
