//! Point fields that decks may ask for: name, shape, unit and meaning of each, in one table.

use crate::material::{StateVariable, state_variables};

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

    /// How many numbers a file holds for a point: vectors have three, whatever the dimension.
    pub fn columns(self) -> usize {
        self.components(3).len().max(1)
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

macro_rules! fields {
    ($( $variant:ident $name:literal $rank:ident $unit:literal $doc:literal, )*) => {
        /// A field of the points, named as in `output.fields`.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum PointField {
            $( #[doc = concat!("`", $name, "`")] $variant, )*
            /// A state variable of a material; zero where a point's material does not have it.
            State(StateVariable),
        }

        impl PointField {
            /// All but the state variables.
            pub const ALL: &'static [PointField] = &[ $( PointField::$variant ),* ];

            /// What the deck and the files say of it.
            pub fn facts(self) -> Field {
                match self {
                    $( PointField::$variant => {
                        Field { name: $name, rank: FieldRank::$rank, unit: $unit, doc: $doc }
                    } )*
                    PointField::State(StateVariable { name, unit, .. }) => {
                        Field { name, rank: FieldRank::Scalar, unit, doc: "State variable of a material" }
                    }
                }
            }
        }

        /// Names of the fields of every point.
        pub const FIELD_NAMES: &[&str] = &[ $( $name ),* ];

        /// Fields of every point that can be written; scalars, vector fields and components can be verified.
        pub const FIELDS: &[Field] = &[
            $( Field { name: $name, rank: FieldRank::$rank, unit: $unit, doc: $doc } ),*
        ];
    };
}

fields! {
    Displacement "displacement" Vector "m" "x - X; from the start of the last stage with reset_displacement",
    Position "position" Vector "m" "x, at the end of the step",
    PositionInitial "position_initial" Vector "m" "X, at the start of the run",
    Velocity "velocity" Vector "m/s" "",
    Acceleration "acceleration" Vector "m/s2" "Of implicit dynamics",
    Stress "stress" Symmetric "Pa" "Cauchy stress, tension positive; with [water] the total one",
    EffectiveStress "effective_stress" Symmetric "Pa"
        "Cauchy stress of the material, tension positive: stress + pore_pressure",
    PorePressure "pore_pressure" Scalar "Pa" "Of [water], compression positive",
    KirchhoffStress "kirchhoff_stress" Symmetric "Pa" "J times the effective stress",
    PrincipalStress "principal_stress" Principal "Pa"
        "Principal values of stress, tension positive, the largest first",
    Pressure "pressure" Scalar "Pa" "-tr(stress)/3, compression positive",
    MeanStress "p" Scalar "Pa"
        "Mean effective stress of soil mechanics, compression positive: without water the pressure",
    Deviator "q" Scalar "Pa"
        "sqrt(3 J2) of the Cauchy stress, soil mechanics' deviator stress: von_mises by its other name",
    VonMises "von_mises" Scalar "Pa" "sqrt(3 J2) of the Cauchy stress",
    MobilisedFriction "mobilised_friction" Scalar "degrees"
        "asin((s1 - s3)/(-s1 - s3)) of the effective stress: friction angle that cohesionless material would need; 90 in tension",
    DeviatoricRadius "deviatoric_radius" Scalar "Pa" "sqrt(2 J2) of the Kirchhoff stress (Lagrangian eq. 43)",
    LogStrain "log_strain" Symmetric "-" "Spatial logarithmic strain, ln(F F^T)/2, tension positive",
    VolumetricStrain "volumetric_strain" Scalar "-" "ln J, the trace of log_strain",
    EquivalentStrain "equivalent_strain" Scalar "-" "sqrt(2/3 e:e), e the deviator of log_strain",
    PlasticStrain "plastic_strain" Scalar "-" "Norms of the plastic logarithmic strain increments, summed",
    Dissipation "dissipation" Scalar "J/m3" "Plastic work per initial volume",
    DeformationGradient "deformation_gradient" Tensor "-" "F",
    ElasticLeftCauchyGreen "elastic_left_cauchy_green" Symmetric "-" "b_e",
    Jacobian "J" Scalar "-" "det F, the volume over the initial volume",
    Volume "volume" Scalar "m3" "Current volume; per metre of thickness in plane strain",
    Mass "mass" Scalar "kg" "Per metre of thickness in plane strain",
    HalfLength "half_length" Vector "m" "Half lengths of the point's domain",
    PointForce "point_force" Vector "N" "Held force at full load",
    ContactForce "contact_force" Vector "N"
        "Of contacts on the point's body: of rigid bodies at the corners of its domain, of other bodies its share by mass of the nodes' forces",
    ContactGap "contact_gap" Scalar "m"
        "Of the deepest place of the point that touches; negative, 0 without contact",
    ContactSlip "contact_slip" Scalar "m" "Way that it has slid in contact so far",
    ContactStatus "contact_status" Scalar "-" "0 apart, 1 sticks, 2 slides",
    Id "id" Integer "-" "Number of the point, from 0 on without gaps, body by body; it stays",
    Body "body" Integer "-" "Number of the deck's body, from 0",
    Rank "rank" Integer "-" "Rank that owns the point",
}

impl PointField {
    /// The field of that name, of every point or of a material.
    pub fn from_name(name: &str) -> Option<Self> {
        let of_points = Self::ALL.iter().copied();
        let of_materials = state_variables().into_iter().map(PointField::State);
        of_points.chain(of_materials).find(|field| field.name() == name)
    }

    pub fn name(self) -> &'static str {
        self.facts().name
    }
}

/// Names of the fields of every point, and of the state variables of all materials.
pub fn names() -> Vec<&'static str> {
    let of_materials = state_variables().into_iter().map(|variable| variable.name);
    FIELD_NAMES.iter().copied().chain(of_materials).collect()
}

/// What a field is made of, if there is one of that name.
pub fn rank(name: &str) -> Option<FieldRank> {
    PointField::from_name(name).map(|field| field.facts().rank)
}
