//! Names of point fields that decks may ask for.

/// How many numbers a field has at a point, and how its components are called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldRank {
    Scalar,
    /// Components x, y, z.
    Vector,
    /// Components xx, yy, zz, xy, yz, xz.
    Tensor,
}

/// Fields that can be written; scalars, vector fields and components can be verified.
pub const FIELDS: [(&str, FieldRank); 12] = [
    ("displacement", FieldRank::Vector),
    ("velocity", FieldRank::Vector),
    ("acceleration", FieldRank::Vector),
    // Cauchy
    ("stress", FieldRank::Tensor),
    ("kirchhoff_stress", FieldRank::Tensor),
    ("deformation_gradient", FieldRank::Tensor),
    ("J", FieldRank::Scalar),
    ("plastic_strain", FieldRank::Scalar),
    ("dissipation", FieldRank::Scalar),
    ("volume", FieldRank::Scalar),
    ("mass", FieldRank::Scalar),
    ("half_length", FieldRank::Vector),
];

/// The names alone.
pub const FIELD_NAMES: &[&str] = &{
    let mut names = [""; FIELDS.len()];
    let mut i = 0;
    while i < FIELDS.len() {
        names[i] = FIELDS[i].0;
        i += 1;
    }
    names
};

pub const TENSOR_COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];
