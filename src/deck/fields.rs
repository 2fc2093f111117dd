//! Names of point fields that decks may ask for.

use crate::material::state_variables;

/// How many numbers a field has at a point, and how its components are called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldRank {
    /// A whole number: written, not compared.
    Integer,
    Scalar,
    /// Components x, y, z.
    Vector,
    /// Symmetric: components xx, xy, xz, yy, yz, zz.
    Symmetric,
    /// All nine components.
    Tensor,
}

impl FieldRank {
    /// Names of the components in `dimension` dimensions; tensors always have three axes.
    pub fn components(self, dimension: usize) -> &'static [&'static str] {
        match self {
            FieldRank::Integer | FieldRank::Scalar => &[],
            FieldRank::Vector => &["x", "y", "z"][..dimension],
            FieldRank::Symmetric => &["xx", "xy", "xz", "yy", "yz", "zz"],
            FieldRank::Tensor => &["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"],
        }
    }
}

/// Fields of every point that can be written; scalars, vector fields and components can be verified.
pub const FIELDS: [(&str, FieldRank); 22] = [
    ("displacement", FieldRank::Vector),
    ("position", FieldRank::Vector),
    ("position_initial", FieldRank::Vector),
    ("velocity", FieldRank::Vector),
    ("acceleration", FieldRank::Vector),
    // Cauchy
    ("stress", FieldRank::Symmetric),
    ("kirchhoff_stress", FieldRank::Symmetric),
    ("pressure", FieldRank::Scalar),
    ("von_mises", FieldRank::Scalar),
    // sqrt(2 J2) of the Kirchhoff stress
    ("deviatoric_radius", FieldRank::Scalar),
    ("plastic_strain", FieldRank::Scalar),
    ("dissipation", FieldRank::Scalar),
    ("deformation_gradient", FieldRank::Tensor),
    ("elastic_left_cauchy_green", FieldRank::Symmetric),
    ("J", FieldRank::Scalar),
    ("volume", FieldRank::Scalar),
    ("mass", FieldRank::Scalar),
    ("half_length", FieldRank::Vector),
    ("point_force", FieldRank::Vector),
    ("id", FieldRank::Integer),
    ("body", FieldRank::Integer),
    ("rank", FieldRank::Integer),
];

/// Names of the fields of every point, and of the state variables of all materials.
pub fn names() -> Vec<&'static str> {
    let of_materials = state_variables().into_iter().map(|variable| variable.name);
    FIELD_NAMES.iter().copied().chain(of_materials).collect()
}

/// What a field is made of, if there is one of that name.
pub fn rank(name: &str) -> Option<FieldRank> {
    let known = FIELDS.iter().find(|(known, _)| *known == name).map(|(_, rank)| *rank);
    let state = || state_variables().iter().any(|variable| variable.name == name);
    known.or_else(|| state().then_some(FieldRank::Scalar))
}

/// Names of the fields of every point.
pub const FIELD_NAMES: &[&str] = &{
    let mut names = [""; FIELDS.len()];
    let mut i = 0;
    while i < FIELDS.len() {
        names[i] = FIELDS[i].0;
        i += 1;
    }
    names
};
