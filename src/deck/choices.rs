//! The deck's own words for the enumerations of the model.

use super::model::{
    AffineTransfer, AnalysisType, Cost, DomainUpdate, Element, ElementPath, Format, Frame,
    GhostScaling, GimpEdge, Initial, InvertedIterates, Locking, Mass, OnFailure, PointVolume,
    PositionUpdate, StressUpdate, SupportMethod, Symmetry, Tangent, VerifyNorm,
};

/// An enumeration that the deck spells in words.
pub trait Choice: Copy + PartialEq + 'static {
    /// Every word with its value, in the order of the documentation.
    const SPELLINGS: &'static [(&'static str, Self)];
}

macro_rules! choices {
    ($( $type:ident { $( $word:literal => $variant:ident ),* $(,)? } )*) => { $(
        impl Choice for $type {
            const SPELLINGS: &'static [(&'static str, Self)] = &[ $( ($word, $type::$variant) ),* ];
        }

        impl $type {
            /// All words of the deck for this choice.
            pub const NAMES: &'static [&'static str] = &[ $( $word ),* ];

            /// The deck's word.
            pub fn name(self) -> &'static str {
                match self { $( $type::$variant => $word ),* }
            }
        }
    )* };
}

choices! {
    AnalysisType {
        "quasi-static" => QuasiStatic,
        "explicit" => Explicit,
        "implicit-dynamic" => ImplicitDynamic,
        "conditioning" => Conditioning,
        "strength-reduction" => StrengthReduction,
        "element-test" => ElementTest,
    }
    ElementPath {
        "triaxial-drained" => TriaxialDrained,
        "triaxial-undrained" => TriaxialUndrained,
        "oedometer" => Oedometer,
        "isotropic" => Isotropic,
        "simple-shear" => SimpleShear,
        "biaxial" => Biaxial,
        "strain" => Strain,
    }
    Symmetry { "plane-strain" => PlaneStrain, "axisymmetric" => Axisymmetric }
    OnFailure { "stop" => Stop, "cut" => Cut }
    InvertedIterates { "reject" => Reject, "allow" => Allow }
    Tangent { "auto" => Auto, "unsymmetric" => Unsymmetric }
    AffineTransfer { "apic" => Apic, "tpic" => Tpic }
    DomainUpdate {
        "none" => None,
        "det" => Det,
        "normal" => Normal,
        "stretch" => Stretch,
        "corners" => Corners,
        "normal-corrected" => NormalCorrected,
        "normal-incremental" => NormalIncremental,
    }
    GimpEdge { "continued" => Continued, "published" => Published }
    PointVolume { "deformation" => Deformation, "domain" => Domain }
    Locking { "none" => None, "f-bar" => FBar }
    Frame { "previous" => Previous, "updated" => Updated, "total" => Total }
    Mass { "consistent" => Consistent, "lumped" => Lumped }
    StressUpdate { "usf" => Usf, "usl" => Usl, "musl" => Musl }
    PositionUpdate { "momentum" => Momentum, "published" => Published }
    GhostScaling { "scale-free" => ScaleFree, "literal" => Literal, "published" => Published }
    Element { "quad4" => Quad4, "tri3" => Tri3, "hex8" => Hex8, "tet4" => Tet4 }
    Initial { "balanced" => Balanced, "slabs" => Slabs }
    Cost { "points" => Points, "time" => Time }
    SupportMethod { "penalty" => Penalty, "nitsche" => Nitsche }
    Format { "xdmf" => Xdmf, "vtkhdf" => VtkHdf, "vtu" => Vtu }
    VerifyNorm { "volume-l1" => VolumeL1, "volume-l2" => VolumeL2, "max" => Max }
}
