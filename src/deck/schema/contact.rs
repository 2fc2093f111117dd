//! Keys of rigid bodies and contact.

use super::Kind::{Expression, Expressions, Number, Points, Special, Table, Text, Vector};
use super::Need::{Default, Optional, Required};
use super::bodies::{BALL_KEYS, BOX_KEYS, CAPSULE_KEYS};
use super::{DYNAMIC, POSITIVE, Section, at_least, between, key};

pub const SECTIONS: &[Section] = &[
    Section {
        name: "rigid",
        header: "[[rigid]]",
        doc: "A body that does not deform: held, driven by `motion`, or, with a density in dynamic runs, moved by its weight and the bodies that touch it (history.csv has `rigid.NAME.*`: its centre of mass, velocity, spin and energy). It acts on the bodies that a `[[contact]]` names with it.",
        keys: &[
            key("name", Text, Required, "Names the reaction columns: what it exerts on the bodies, and the torque about the centre of its rotation or the origin. Unique among boundaries and rigid bodies."),
            key("shape", Table("rigid.shape"), Required, "Its surface."),
            key("motion", Table("rigid.motion"), Optional("held"), "How it is driven."),
            key("density", Number, Optional("held or driven"), "It moves freely: in place of `motion`. Not of a half space.")
                .unit("kg/m3").range(POSITIVE).read_by(&[DYNAMIC]),
            key("velocity", Vector, Optional("zeros"), "Of a body with a density, at the start.")
                .unit("m/s").read_by(&[DYNAMIC]),
            key("from", Text, Optional("the first stage"),
                "The stage it comes with, where it is in the deck then: s of its motion is that of this stage, and velocities count from its start.")
                .read_by(&[super::LOADED]),
            key("until", Text, Optional("it stays"),
                "The last stage in which it is there; in quasi-static runs its forces fall to nothing over it.")
                .read_by(&[super::LOADED]),
        ],
    },
    Section {
        name: "rigid.shape",
        header: "rigid.shape",
        doc: "One form, where it is at the start.",
        keys: &[
            key("half_space", Table("rigid.half_space"), Optional("-"), "Everything behind a plane (2D: a line)."),
            key("disc", Table("rigid.ball"), Optional("-"), "Disc (a ball in 3D)."),
            key("ball", Table("rigid.ball"), Optional("-"), "The same as disc."),
            key("box", Table("rigid.box"), Optional("-"), "Axis-aligned box; `motion` may turn it."),
            key("capsule", Table("rigid.capsule"), Optional("-"), "All within a radius of a segment."),
            key("polygon", Points, Optional("-"),
                "2D: three or more corners in order; it may have corners that point inwards. In axisymmetry a profile; an edge on the axis x = 0 is no surface.").unit("m"),
            key("stl", Text, Optional("-"),
                "3D: an STL file (text or binary) beside the deck, a closed surface whose facets face outward. Held or driven. Lengths are in m, unless `scale` turns them into m."),
            key("scale", Number, Optional("1.0"),
                "Beside stl: what a length of the file is multiplied by; 0.001 for a file in mm.").range(POSITIVE),
            key("cone", Table("rigid.cone"), Optional("-"), "3D: a cone with a shaft behind it."),
        ],
    },
    Section {
        name: "rigid.half_space",
        header: "rigid.shape.half_space",
        doc: "Its surface goes through `point`.",
        keys: &[
            key("point", Vector, Required, "A place on the surface.").unit("m"),
            key("normal", Vector, Required, "Out of the rigid body, of any length."),
        ],
    },
    Section {
        name: "rigid.ball",
        header: "rigid.shape.disc",
        doc: "|x - centre| <= radius.",
        keys: BALL_KEYS,
    },
    Section {
        name: "rigid.box",
        header: "rigid.shape.box",
        doc: "min <= x <= max.",
        keys: BOX_KEYS,
    },
    Section {
        name: "rigid.capsule",
        header: "rigid.shape.capsule",
        doc: "All within `radius` of a segment.",
        keys: CAPSULE_KEYS,
    },
    Section {
        name: "rigid.cone",
        header: "rigid.shape.cone",
        doc: "A cone of revolution with a cylinder of its radius behind it.",
        keys: &[
            key("tip", Vector, Required, "Where its tip is.").unit("m"),
            key("axis", Vector, Optional("z"), "From the tip into it, of any length."),
            key("angle", Number, Default("60.0"), "At the tip, from side to side.")
                .unit("deg").range(between(1.0, 179.0)),
            key("radius", Number, Required, "Of its base and of the shaft.").unit("m").range(POSITIVE),
            key("shaft", Number, Default("0.0"), "Length of the shaft.").unit("m").range(at_least(0.0)),
        ],
    },
    Section {
        name: "rigid.motion",
        header: "rigid.motion",
        doc: "A total that holds neither s nor t grows with s. Displacement and velocity add up.",
        keys: &[
            key("displacement", Expressions("s t"), Optional("none"), "Total over the analysis.").unit("m"),
            key("velocity", Expressions("t"), Optional("none"), "From the start of the analysis on.")
                .unit("m/s").read_by(&[DYNAMIC]),
            key("rotation", Table("rigid.rotation"), Optional("none"), "Rigid rotation."),
        ],
    },
    Section {
        name: "rigid.rotation",
        header: "rigid.motion.rotation",
        doc: "Right-handed, in 2D counter-clockwise, about a centre that moves along.",
        keys: &[
            key("centre", Vector, Optional("zeros"), "Centre at the start.").unit("m"),
            key("degrees", Expression("s t"), Required, "Total over the analysis.").unit("deg"),
            key("axis", Vector, Optional("z"), "3D: direction of the axis."),
        ],
    },
    Section {
        name: "contact",
        header: "[[contact]]",
        doc: "A body on a rigid body: a penalty keeps the corners of the domains of its points (gimp, cpdi1, cpdi2), or its points (mpm), outside. Two bodies move in fields of their own. In explicit runs, with a lumped mass, impulses at the nodes that both reach keep them apart where their domains meet; in implicit runs a penalty keeps the elements of either surface off the other body.",
        keys: &[
            key("name", Text, Optional("the two names with a hyphen between"),
                "Names the columns of the history, unique."),
            key("between", Special("an array of the names of a rigid body and a body, or of two bodies"), Required,
                "Who touches whom. Bodies that no contact names together meet on the grid without slip."),
            key("friction", Special("a number of at least 0, or \"rough\""), Default("0.0"),
                "Coulomb's coefficient; 0: smooth; \"rough\": no slip."),
            key("adhesion", Number, Default("0.0"), "Tangential traction that it takes to slip, besides friction, as long as there is contact.")
                .unit("Pa").range(at_least(0.0)),
            key("max_shear", Number, Optional("none"), "Largest tangential traction, whatever the pressure.")
                .unit("Pa").range(POSITIVE),
            key("penalty", Number, Default("10.0"),
                "Pressure over depth, times the body's stiffness (of two bodies the lower one) over the cell size: a pressure p goes p h / (penalty E) deep. Two bodies in explicit runs have none.")
                .range(POSITIVE),
            key("from", Text, Optional("the first stage"),
                "The stage it comes with. Two bodies do not slip on each other before.")
                .read_by(&[super::LOADED]),
            key("until", Text, Optional("it stays"),
                "The last stage in which it is there; in quasi-static runs its forces fall to nothing over it.")
                .read_by(&[super::LOADED]),
        ],
    },
];
