//! Point fields that decks may ask for: name, shape, unit and meaning of each, in one table.

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
    /// Three principal values, the largest (tension positive) first.
    Principal,
}

impl FieldRank {
    /// Names of the components in `dimension` dimensions; tensors always have three axes.
    pub fn components(self, dimension: usize) -> &'static [&'static str] {
        match self {
            FieldRank::Integer | FieldRank::Scalar => &[],
            FieldRank::Vector => &["x", "y", "z"][..dimension],
            FieldRank::Symmetric => &["xx", "xy", "xz", "yy", "yz", "zz"],
            FieldRank::Tensor => &["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"],
            FieldRank::Principal => &["1", "2", "3"],
        }
    }
}

/// A field of every point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    pub name: &'static str,
    pub rank: FieldRank,
    /// SI unit.
    pub unit: &'static str,
    /// What it is, in a few words; empty where the name says it.
    pub doc: &'static str,
}

const fn field(
    name: &'static str,
    rank: FieldRank,
    unit: &'static str,
    doc: &'static str,
) -> Field {
    Field { name, rank, unit, doc }
}

/// Fields of every point that can be written; scalars, vector fields and components can be verified.
pub const FIELDS: &[Field] = &[
    field(
        "displacement",
        FieldRank::Vector,
        "m",
        "x - X; from the start of the last stage with reset_displacement",
    ),
    field("position", FieldRank::Vector, "m", "x, at the end of the step"),
    field("position_initial", FieldRank::Vector, "m", "X, at the start of the run"),
    field("velocity", FieldRank::Vector, "m/s", ""),
    field("acceleration", FieldRank::Vector, "m/s2", "Of implicit dynamics"),
    field(
        "stress",
        FieldRank::Symmetric,
        "Pa",
        "Cauchy stress, tension positive; with [water] the total one",
    ),
    field(
        "effective_stress",
        FieldRank::Symmetric,
        "Pa",
        "Cauchy stress of the material, tension positive: stress + pore_pressure",
    ),
    field("pore_pressure", FieldRank::Scalar, "Pa", "Of [water], compression positive"),
    field("kirchhoff_stress", FieldRank::Symmetric, "Pa", "J times the effective stress"),
    field(
        "principal_stress",
        FieldRank::Principal,
        "Pa",
        "Principal values of stress, tension positive, the largest first",
    ),
    field("pressure", FieldRank::Scalar, "Pa", "-tr(stress)/3, compression positive"),
    field(
        "p",
        FieldRank::Scalar,
        "Pa",
        "Mean effective stress of soil mechanics, compression positive: without water the pressure",
    ),
    field(
        "q",
        FieldRank::Scalar,
        "Pa",
        "sqrt(3 J2) of the Cauchy stress, soil mechanics' deviator stress: von_mises by its other name",
    ),
    field("von_mises", FieldRank::Scalar, "Pa", "sqrt(3 J2) of the Cauchy stress"),
    field(
        "mobilised_friction",
        FieldRank::Scalar,
        "degrees",
        "asin((s1 - s3)/(-s1 - s3)) of the effective stress: friction angle that cohesionless material would need; 90 in tension",
    ),
    field(
        "deviatoric_radius",
        FieldRank::Scalar,
        "Pa",
        "sqrt(2 J2) of the Kirchhoff stress (Lagrangian eq. 43)",
    ),
    field(
        "log_strain",
        FieldRank::Symmetric,
        "-",
        "Spatial logarithmic strain, ln(F F^T)/2, tension positive",
    ),
    field("volumetric_strain", FieldRank::Scalar, "-", "ln J, the trace of log_strain"),
    field(
        "equivalent_strain",
        FieldRank::Scalar,
        "-",
        "sqrt(2/3 e:e), e the deviator of log_strain",
    ),
    field(
        "plastic_strain",
        FieldRank::Scalar,
        "-",
        "Norms of the plastic logarithmic strain increments, summed",
    ),
    field("dissipation", FieldRank::Scalar, "J/m3", "Plastic work per initial volume"),
    field("deformation_gradient", FieldRank::Tensor, "-", "F"),
    field("elastic_left_cauchy_green", FieldRank::Symmetric, "-", "b_e"),
    field("J", FieldRank::Scalar, "-", "det F, the volume over the initial volume"),
    field(
        "volume",
        FieldRank::Scalar,
        "m3",
        "Current volume; per metre of thickness in plane strain",
    ),
    field("mass", FieldRank::Scalar, "kg", "Per metre of thickness in plane strain"),
    field("half_length", FieldRank::Vector, "m", "Half lengths of the point's domain"),
    field("point_force", FieldRank::Vector, "N", "Held force at full load"),
    field(
        "contact_force",
        FieldRank::Vector,
        "N",
        "Of contacts on the point's body: of rigid bodies at the corners of its domain, of other bodies its share by mass of the nodes' forces",
    ),
    field(
        "contact_gap",
        FieldRank::Scalar,
        "m",
        "Of the deepest place of the point that touches; negative, 0 without contact",
    ),
    field("contact_slip", FieldRank::Scalar, "m", "Way that it has slid in contact so far"),
    field("contact_status", FieldRank::Scalar, "-", "0 apart, 1 sticks, 2 slides"),
    field(
        "id",
        FieldRank::Integer,
        "-",
        "Number of the point, from 0 on without gaps, body by body; it stays",
    ),
    field("body", FieldRank::Integer, "-", "Number of the deck's body, from 0"),
    field("rank", FieldRank::Integer, "-", "Rank that owns the point"),
];

/// The field of that name, which a constant names.
pub fn known(name: &str) -> &'static Field {
    FIELDS.iter().find(|field| field.name == name).expect("fields are named by constants")
}

/// Names of the fields of every point, and of the state variables of all materials.
pub fn names() -> Vec<&'static str> {
    let of_materials = state_variables().into_iter().map(|variable| variable.name);
    FIELD_NAMES.iter().copied().chain(of_materials).collect()
}

/// What a field is made of, if there is one of that name.
pub fn rank(name: &str) -> Option<FieldRank> {
    let known = FIELDS.iter().find(|field| field.name == name).map(|field| field.rank);
    let state = || state_variables().iter().any(|variable| variable.name == name);
    known.or_else(|| state().then_some(FieldRank::Scalar))
}

/// Names of the fields of every point.
pub const FIELD_NAMES: &[&str] = &{
    let mut names = [""; FIELDS.len()];
    let mut i = 0;
    while i < FIELDS.len() {
        names[i] = FIELDS[i].name;
        i += 1;
    }
    names
};
