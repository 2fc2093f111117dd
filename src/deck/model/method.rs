//! `[method]` and `[ghost]`.

use crate::deck::choices::choices;

pub use crate::basis::Declared as Basis;

#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    pub basis: Basis,
    pub domain_update: DomainUpdate,
    pub gimp_edge: GimpEdge,
    pub point_volume: PointVolume,
    pub locking: Locking,
    pub frame: Frame,
    pub mass: Mass,
    pub stress_update: StressUpdate,
    pub position_update: PositionUpdate,
    /// FLIP share: 1 is FLIP, 0 is PIC.
    pub flip: f64,
    /// `velocity_update = "xpic"` with `xpic_order = m`; `None` otherwise.
    pub xpic: Option<usize>,
    /// `velocity_update = "apic"` or `"tpic"`; `None` otherwise.
    pub affine: Option<AffineTransfer>,
    /// A node whose summed basis weight is below this fraction of the largest one is held at
    /// zero and left out of the residual (default 1e-8 without Ghost stiffness, 0 with it).
    pub drop_below: f64,
}

/// Ghost stabilisation parameters. Absolute values win over factors.
#[derive(Debug, Clone, PartialEq)]
pub struct Ghost {
    /// gamma_K, Pa.
    pub stiffness: Option<f64>,
    /// gamma_K as a multiple of each body's Young's modulus.
    pub stiffness_factor: Option<f64>,
    /// gamma_M, kg/m3.
    pub mass: Option<f64>,
    /// gamma_M as a multiple of each body's density.
    pub mass_factor: Option<f64>,
    pub scaling: GhostScaling,
}

impl Ghost {
    /// gamma_K over Young's modulus where the deck says nothing: docs/evidence/ghost-factors.md.
    pub const STIFFNESS_FACTOR: f64 = 0.01;
    /// gamma_M over the density where the deck says nothing (Ghost §5.1).
    pub const MASS_FACTOR: f64 = 0.25;
    /// The same in implicit dynamics, where each step takes half of dv (M~ - M) dv from the energy:
    /// 0.25 would cost a bar of sixteen cells a third of it in four periods.
    pub const IMPLICIT_MASS_FACTOR: f64 = 0.01;
}

choices! {
    /// Which of the two a point keeps while it moves: see [`crate::transfer::affine`].
    AffineTransfer {
        /// Its affine moment: the angular momentum.
        Apic = "apic",
        /// Its velocity gradient: a rigid rotation.
        Tpic = "tpic",
    }

    /// How a GIMP domain follows the deformation (Lagrangian §6.4).
    DomainUpdate {
        None = "none",
        Det = "det",
        Normal = "normal",
        Stretch = "stretch",
        Corners = "corners",
        NormalCorrected = "normal-corrected",
        NormalIncremental = "normal-incremental",
    }

    /// What stresses are integrated over: the two differ where a domain's size does not follow det F.
    #[derive(Default)]
    PointVolume {
        /// det F V0
        #[default]
        Deformation = "deformation",
        /// That of the GIMP domain, as in the program behind Lagrangian §7.
        Domain = "domain",
    }

    /// What keeps points from locking where the volume can hardly change.
    #[derive(Default)]
    Locking {
        #[default]
        None = "none",
        /// Stress from dF_bar = (det dF_0 / det dF)^(1/n) dF, dF_0 that of the cells.
        FBar = "f-bar",
    }

    Frame {
        Previous = "previous",
        Updated = "updated",
        Total = "total",
    }

    Mass {
        Consistent = "consistent",
        Lumped = "lumped",
    }

    StressUpdate {
        Usf = "usf",
        Usl = "usl",
        Musl = "musl",
    }

    /// Functions of a GIMP domain that sticks out of the grid.
    GimpEdge {
        /// The functions of the outer cell go on beyond the edge, and their sum stays one.
        Continued = "continued",
        /// Hats of the grid's own nodes alone: what a node beyond the edge would hold is lost.
        Published = "published",
    }

    /// What moves the points of an explicit step with a Ghost mass.
    PositionUpdate {
        /// The velocity that keeps the angular momentum.
        Momentum = "momentum",
        /// The updated nodal velocity (Ghost eq. 9).
        Published = "published",
    }

    /// Scale of the face matrix: numerics of the default and of the papers' tables differ.
    GhostScaling {
        ScaleFree = "scale-free",
        Literal = "literal",
        Published = "published",
    }
}
