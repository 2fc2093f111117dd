//! Keys of the analysis, the method and the grid.

use super::Kind::{
    Choice, Count, Counts, Flag, Number, NumberOrVector, Special, Table, Text, Vector,
};
use super::Need::{Default, Optional, Required};
use super::{
    DYNAMIC, EXPLICIT, GIMP, HEAVY, IMPLICIT, IMPLICIT_DYNAMIC, LOADED, ON_GRID, POSITIVE,
    QUASI_STATIC, STIFF, STRENGTH_REDUCTION, Section, at_least, between, key, only,
};
use crate::deck::model::{
    AnalysisType, Basis, DomainUpdate, Element, Frame, GhostScaling, GimpEdge, InvertedIterates,
    Locking, Mass, OnFailure, PointVolume, PositionUpdate, StressUpdate, Symmetry, Tangent,
};

pub const SECTIONS: &[Section] = &[
    Section {
        name: "analysis",
        header: "[analysis]",
        doc: "What is solved, and in which steps.",
        keys: &[
            key("type", Choice(AnalysisType::NAMES), Required, "Kind of analysis."),
            key("symmetry", Choice(Symmetry::NAMES), Default("\"plane-strain\""),
                "What a problem in two dimensions stands for. plane-strain: a slice of unit thickness. axisymmetric: half of a section through a body of revolution, x the radius (not below 0) and y the axis; zz is the hoop direction. Volumes, masses, forces, reactions and energies are those of the whole turn, and grid nodes on the axis keep x = 0. Bases mpm and gimp.")
                .read_by(&[ON_GRID]),
            key("steps", Count, Optional("needed, except with cfl, with [[stage]] and in element tests"),
                "Equal load steps or time steps.").range(at_least(1.0)),
            key("duration", Number, Optional("needed by dynamics without [[stage]], only there"),
                "Simulated time; the time step is duration / steps.").unit("s").range(POSITIVE),
            key("cfl", Number, Optional("explicit only, instead of steps"),
                "Time step as a fraction of the stability limit.").range(POSITIVE),
            key("tolerance", Number, Default("1e-9"),
                "Normalised residual that ends the iterations (Lagrangian eq. 40).")
                .range(POSITIVE)
                .read_by(&[IMPLICIT]),
            key("max_iterations", Count, Default("20"),
                "Evaluations of the residual in one step, the first at zero displacement included. \
                 With contact, a step whose iterates come no closer over nine of them is \
                 solved again with narrower line searches, which takes 12 or more.")
                .range(at_least(2.0))
                .read_by(&[IMPLICIT]),
            key("on_failure", Choice(OnFailure::NAMES), Default("\"stop\""),
                "What to do with a step that does not converge: stop, or halve it and retry.")
                .read_by(&[IMPLICIT]),
            key("smallest_step", Number, Default("0.0009765625"),
                "With on_failure = \"cut\": smallest step as a fraction of the nominal one.")
                .range(super::Range { low_included: false, ..between(0.0, 1.0) })
                .read_by(&[IMPLICIT, only("analysis.on_failure", &["cut"])]),
            key("inverted_iterates", Choice(InvertedIterates::NAMES), Default("\"reject\""),
                "Iterates in which a point is turned inside out (det dF <= 0).")
                .read_by(&[IMPLICIT]),
            key("tangent", Choice(Tangent::NAMES), Default("\"auto\""),
                "`auto`: symmetric storage and solvers where all materials have a symmetric \
                 tangent. `unsymmetric`: the general ones (FGMRES, line search) in any case.")
                .read_by(&[IMPLICIT]),
            key("newmark_beta", Number, Default("0.25"), "Implicit dynamics.")
                .range(super::Range { low_included: false, ..between(0.0, 0.5) })
                .read_by(&[IMPLICIT_DYNAMIC]),
            key("newmark_gamma", Number, Default("0.5"), "Implicit dynamics.")
                .range(between(0.5, 1.0))
                .read_by(&[IMPLICIT_DYNAMIC]),
            key("hht_alpha", Number, Default("0.0"),
                "Implicit dynamics: numerical damping; sets Newmark's beta and gamma.")
                .range(between(-1.0 / 3.0, 0.0))
                .read_by(&[IMPLICIT_DYNAMIC]),
            key("strength_tolerance", Number, Default("0.005"),
                "Strength reduction: relative width of the bracket that ends the search. The run first goes through its steps, or stages, with the strength as it is; then cohesions, tensions, shear strengths and yield stresses, their growth (`hardening`, `saturation.stress`) and residual values, and the tangents of friction and dilation angles, are divided by a factor that grows until no equilibrium is found in a single step (Newton's method fails, or the displacement jumps: a node moves by more than a cell, or by a hundred times as much per relative change of the factor as in the calmest trial), and the bracket is halved. The middle is strength_factor of summary.json.")
                .range(super::Range { low_included: false, ..between(0.0, 1.0) })
                .read_by(&[STRENGTH_REDUCTION]),
            key("damping", Table("analysis.damping"), Optional("none"),
                "Slows the nodes down, for states of rest as the limit of a motion.")
                .read_by(&[DYNAMIC]),
        ],
    },
    Section {
        name: "analysis.damping",
        header: "analysis.damping",
        doc: "What it takes from the energy is `dissipation_damping` of history.csv. It acts at the nodes and takes momentum from free motion, too: it is for bodies that come to rest, not for flight or fall.",
        keys: &[
            key("local", Number, Optional("0"),
                "Local non-viscous damping: this share of the force out of balance on each component of each node acts against its velocity; 0.7 to 0.8 is usual. It does not depend on frequencies or units (explicit: of the acceleration, which with a lumped mass is the same; implicit: of that at the step's start).")
                .range(super::Range { high_included: false, ..between(0.0, 1.0) }),
            key("mass", Number, Optional("0"),
                "Mass-proportional damping: this times the momentum acts against the velocity. A mode of circular frequency w is damped by mass / (2 w) of the critical damping.")
                .unit("1/s").range(at_least(0.0)),
        ],
    },
    Section {
        name: "stage",
        header: "[[stage]]",
        doc: "A part of the analysis, in the order of the deck. Bodies, boundaries and loads come and go by the names of stages (`from`, `until`); `from = \"initial\"` says that something has acted before the first stage. s runs from 0 to 1 in each stage. What comes with a stage ramps with s over it (in quasi-static analyses, and loads alone: a boundary's displacement and a body's weight are ramped likewise) and keeps its full value in later stages, where its formulas see s = 1. What goes falls to nothing over its last stage. A body that goes leaves a quasi-static analysis at the start of its last stage; the forces that it and boundaries of that stage held then fall to zero in proportion to 1 - s. In dynamics its points stay to the end of the stage, with a share 1 - s of their stress and weight, and a boundary holds to the end of its last stage. A body that comes is free of stress unless it has initial_stress, and where the deck puts it. Without time t counts stages: it is the number of those before plus s. Work done by what comes and goes is in work_external; the energy of points that have gone is in no column.",
        keys: &[
            key("name", Text, Optional("stage-1, stage-2, ..."), "Its name, unique; not \"initial\"."),
            key("steps", Count, Optional("needed, except with cfl"),
                "Equal load steps or time steps of this stage.").range(at_least(1.0)),
            key("duration", Number, Optional("needed by dynamics, only there"),
                "Simulated time of this stage.").unit("s").range(POSITIVE)
                .read_by(&[DYNAMIC]),
            key("reset_displacement", Flag, Optional("false"),
                "The field `displacement` counts from the start of this stage. Nothing else changes."),
        ],
    },
    Section {
        name: "method",
        header: "[method]",
        doc: "Variant of the material point method.",
        keys: &[
            key("basis", Choice(Basis::NAMES), Default("\"mpm\""),
                "Basis functions of the points. `gimp` needs a lattice."),
            key("control", Choice(&["off", "fem"]), Default("\"off\""),
                "fem: the same deck by updated-Lagrangian finite elements, as a control: Gauss points for points_per_cell, basis mpm, a mesh that follows the material."),
            key("domain_update", Choice(DomainUpdate::NAMES), Default("\"corners\""),
                "How GIMP domains follow the deformation (Lagrangian eq. 32-39).")
                .read_by(&[GIMP, LOADED]),
            key("gimp_edge", Choice(GimpEdge::NAMES), Default("\"continued\""),
                "Functions of a GIMP domain that sticks out of the grid. continued: those of the grid's outer cell go on, so that no weight is lost. published: hats of the grid's own nodes, which lose the share of a node beyond the edge (the papers' tables).")
                .read_by(&[GIMP]),
            key("point_volume", Choice(PointVolume::NAMES), Default("\"deformation\""),
                "What stresses are integrated over: det F V0, or the volume of the GIMP domain (domain: quasi-static; Lagrangian §7 with normal, stretch or none).")
                .read_by(&[GIMP, QUASI_STATIC]),
            key("locking", Choice(Locking::NAMES), Default("\"none\""),
                "f-bar: stresses from dF with the change of volume of the cells that a point touches (the mean over the material in each of them), for Poisson's ratios near 0.5 and plastic flow without change of volume (mpm; gimp, cpdi1 and cpdi2 on a lattice). The force is the derivative of the energy: nothing is gained or lost, and the tangent is symmetric where the materials' are. Triangles and tetrahedra gain nothing.")
                .read_by(&[LOADED]),
            key("frame", Choice(Frame::NAMES), Default("\"previous\""),
                "State in which equilibrium is written (Lagrangian §3-5).")
                .read_by(&[IMPLICIT]),
            key("mass", Choice(Mass::NAMES), Default("\"consistent\""), "Mass matrix (dynamics).")
                .read_by(&[DYNAMIC]),
            key("stress_update", Choice(StressUpdate::NAMES), Default("\"musl\""),
                "When stress is updated in an explicit step: first, last, or last with remapped velocity (musl). usl dissipates.")
                .read_by(&[EXPLICIT]),
            key("position_update", Choice(PositionUpdate::NAMES), Default("\"momentum\""),
                "What moves the points of an explicit step with the consistent mass: the velocity that keeps the angular momentum, or the updated nodal velocity (published: Ghost eq. 9).")
                .read_by(&[EXPLICIT, only("method.mass", &["consistent"])]),
            key("velocity_update", Special("\"flip\", \"pic\", \"xpic\", \"apic\", \"tpic\", or a number from 0 (pic) to 1 (flip)"),
                Default("\"flip\""), "How points take their velocity from the grid, in explicit and implicit dynamics; xpic, apic and tpic are explicit and take the lumped mass. With apic and tpic points carry a velocity gradient beside their velocity: apic keeps the angular momentum to round-off, tpic to the change of the gimp functions along the way. Both need basis gimp with gimp_edge continued, and musl or usl.")
                .read_by(&[DYNAMIC]),
            key("xpic_order", Count, Optional("2; only with velocity_update = \"xpic\""),
                "Order m of XPIC(m).").range(at_least(1.0))
                .read_by(&[only("method.velocity_update", &["xpic"])]),
            key("drop_below", Number, Optional("0 with Ghost stiffness and in explicit runs, 1e-8 without"),
                "Nodes whose summed basis weight is below this fraction of the largest are held at zero.")
                .range(between(0.0, 1.0))
                .read_by(&[IMPLICIT]),
        ],
    },
    Section {
        name: "ghost",
        header: "[ghost]",
        doc: "Ghost stabilisation (Ghost §3). Without this table, or without a stiffness and a mass in it, the default factors are in force: stiffness_factor = 0.01 in implicit analyses, and with the consistent mass mass_factor = 0.25 in explicit and 0.01 in implicit dynamics (a conditioning study takes 0.01 and 0.25). Nothing is stabilised in explicit analyses with the lumped mass, with method.control = \"fem\", and with `ghost = \"off\"`. A table with a stiffness or a mass says all: what it leaves out is not stabilised. An absolute value or a factor, not both. How the defaults were chosen: docs/evidence/ghost-factors.md.",
        keys: &[
            key("stiffness", Number, Optional("no Ghost stiffness"), "gamma_K.")
                .unit("Pa").range(at_least(0.0))
                .read_by(&[STIFF]),
            key("stiffness_factor", Number, Optional("no Ghost stiffness"),
                "gamma_K as a multiple of each body's Young's modulus.").range(at_least(0.0))
                .read_by(&[STIFF]),
            key("mass", Number, Optional("no Ghost mass"), "gamma_M.")
                .unit("kg/m3").range(at_least(0.0))
                .read_by(&[HEAVY]),
            key("mass_factor", Number, Optional("no Ghost mass"),
                "gamma_M as a multiple of each body's density.").range(at_least(0.0))
                .read_by(&[HEAVY]),
            key("scaling", Choice(GhostScaling::NAMES), Default("\"scale-free\""),
                "Scale of the face matrix J: gamma_K J / h2 and gamma_M J (scale-free), J as in eq. 23 (literal), or (h2/4) J (published: reproduces the papers' tables)."),
        ],
    },
    Section {
        name: "grid",
        header: "[grid]",
        doc: "Background grid. Its vectors set the dimension of the problem: two components mean plane strain, or axisymmetry (`analysis.symmetry`).",
        keys: &[
            key("type", Choice(&["lattice", "mesh"]), Required,
                "Equal boxes, or an unstructured mesh."),
            key("origin", Vector, Optional("zeros"), "Lattice: lower corner.").unit("m"),
            key("size", Vector, Optional("a lattice needs size or cells"),
                "Lattice: extent, a whole number of cells along each axis.").unit("m").range(POSITIVE),
            key("cells", Counts, Optional("a lattice needs size or cells"), "Lattice: cells per axis.")
                .range(at_least(1.0)),
            key("h", NumberOrVector, Optional("needed by a lattice"), "Lattice: spacing.")
                .unit("m").range(POSITIVE),
            key("file", Text, Optional("a mesh needs file or generate"),
                "Mesh: Gmsh file, version 2.2, 4.0 or 4.1; a relative path starts at the deck."),
            key("dimension", Count, Optional("2; only with file"), "Mesh from a file: 2 or 3.")
                .range(between(2.0, 3.0)),
            key("generate", Table("grid.generate"), Optional("a mesh needs file or generate"),
                "Mesh: made here."),
            key("motion", Table("grid.motion"), Optional("the mesh stays"),
                "Mesh: how it moves between steps."),
        ],
    },
    Section {
        name: "grid.generate",
        header: "grid.generate",
        doc: "One of the two.",
        keys: &[
            key("annulus", Table("grid.generate.annulus"), Optional("or box"),
                "Ring around the origin; tags \"inner\" and \"outer\"."),
            key("box", Table("grid.generate.box"), Optional("or annulus"),
                "Box; tags \"left\", \"right\", \"bottom\", \"top\" (3D: \"back\", \"front\")."),
        ],
    },
    Section {
        name: "grid.generate.annulus",
        header: "grid.generate.annulus",
        doc: "A disc with a circular or elliptic hole.",
        keys: &[
            key("inner", Special("a radius, or an array of two semi-axes"), Required,
                "Radius of the hole, or the semi-axes of an elliptic one.").unit("m").range(POSITIVE),
            key("outer", Number, Required, "Outer radius.").unit("m").range(POSITIVE),
            key("radial", Count, Required, "Elements along the radius.").range(at_least(1.0)),
            key("around", Count, Required, "Elements around.").range(at_least(3.0)),
            key("element", Choice(&["quad4", "tri3"]), Default("\"quad4\""), "Element."),
            key("grading", Number, Default("1.0"),
                "Refinement around the ends of the long axis of the hole; 1: uniform.")
                .range(at_least(1.0)),
        ],
    },
    Section {
        name: "grid.generate.box",
        header: "grid.generate.box",
        doc: "An axis-aligned box: of equal elements by min, max and cells, or by spacing.",
        keys: &[
            key("min", Vector, Optional("or spacing"), "Lower corner.").unit("m"),
            key("max", Vector, Optional("or spacing"), "Upper corner.").unit("m"),
            key("cells", Counts, Optional("or spacing"), "Boxes per axis.").range(at_least(1.0)),
            key("spacing", Special("for each axis an array of pairs [place, spacing there]"),
                Optional("or min, max and cells"),
                "Lines that lie closer where it matters: for each axis places from one end of the box to the \
                 other, a line through each, and the spacing of the lines there; between two places it \
                 changes linearly.").unit("m"),
            key("element", Choice(Element::NAMES), Optional("quad4 in 2D, hex8 in 3D"), "Element."),
        ],
    },
    Section {
        name: "grid.motion",
        header: "grid.motion",
        doc: "One of the two.",
        keys: &[
            key("rotate_with", Text, Optional("or follow"),
                "Tag of a boundary with a prescribed rotation: the whole mesh turns with it."),
            key("follow", Special("\"material\", or an array of axes such as [\"x\"]"),
                Optional("or rotate_with"),
                "Nodes follow the computed displacement along these axes; \"material\": wholly."),
        ],
    },
];
