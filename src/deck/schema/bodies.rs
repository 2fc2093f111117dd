//! Keys of what is analysed: bodies, shapes, boundaries, water.

use super::Kind::{
    Choice, Choices, Count, CountOrCounts, Expression, Expressions, Flag, Number, Points, Special,
    Table, Text, Vector,
};
use super::Need::{Default, Optional, Required};
use crate::deck::model::SupportMethod;

use super::loads::OF_BODY;
use super::{AXES, POSITIVE, Section, UNTIL, at_least, between, from_stage, key};

const SHAPES: &str = "an array of shapes";
/// Keys of a box.
pub const BOX_KEYS: &[super::Key] = &[
    key("min", Vector, Required, "Lower corner.").unit("m"),
    key("max", Vector, Required, "Upper corner.").unit("m"),
];
pub(super) const CAPSULE_KEYS: &[super::Key] = &[
    key("from", Vector, Required, "One end.").unit("m"),
    key("to", Vector, Required, "The other end.").unit("m"),
    key("radius", Number, Required, "Radius.").unit("m").range(POSITIVE),
];
pub(super) const BALL_KEYS: &[super::Key] = &[
    key("centre", Vector, Required, "Centre.").unit("m"),
    key("radius", Number, Required, "Radius.").unit("m").range(POSITIVE),
];

pub const SECTIONS: &[Section] = &[
    Section {
        name: "body",
        header: "[[body]]",
        doc: "A body: a shape filled with points, or a file of points. One of points_per_cell, lattice and gauss.",
        keys: &[
            key("name", Text, Optional("body-1, body-2, ..."), "Its name, unique."),
            key("material", Text, Required, "Name of a `[material.NAME]`."),
            key("density", Number, Optional("0; needed by dynamics and gravity"), "Initial density.")
                .unit("kg/m3").range(at_least(0.0)),
            key("shape", Table("shape"), Required, "The region it fills, or where its points are."),
            key("points_per_cell", CountOrCounts, Optional("2, when lattice and gauss are absent"),
                "Equal sub-cells per cell and axis.").range(between(1.0, 100.0)),
            key("lattice", Table("body.lattice"), Optional("none"),
                "Points on a lattice of their own."),
            key("gauss", Count, Optional("none"),
                "Gauss points per axis and cell: updated-Lagrangian finite elements, with basis = \"mpm\" and motion = { follow = \"material\" }.")
                .range(between(1.0, 8.0)),
            key("velocity", Expressions("X Y Z"), Optional("zeros, or those of the file of points"),
                "Initial velocity. An explicit run takes it half a time step before the start, as leapfrog does: a body in free fall is g dt t / 2 further at the time t than one that has it at t = 0 (subtract a dt / 2, a the first acceleration, for the velocity at t = 0).")
                .unit("m/s").read_by(&[super::DYNAMIC]),
            key("overlap", Choice(&["refuse", "allow"]), Default("\"refuse\""),
                "Bodies that lie in one place are refused, as mass counts twice there, unless one of the two allows it."),
            key("initial_stress", Table("body.initial_stress"), Optional("free of stress"),
                "Effective Cauchy stress before the first step, tension positive.")
                .read_by(&[super::LOADED]),
            from_stage("initial"),
            UNTIL,
        ],
    },
    Section {
        name: "body.initial_stress",
        header: "body.initial_stress",
        doc: "Either components, or K0: unit_weight, surface and k0. The place at the start is the reference: F = 1 under this stress. Gravity whose values hold neither s nor t then acts in full from the first step on, as if it had `from = \"initial\"`; other loads that the stress balances need that key. What is not in balance acts in the first step. With `[water]` the vertical effective stress is the weight of what lies above, of soil and of water that stands on the surface, less the pore pressure. Points outside the yield surface are refused.",
        keys: &[
            key("xx", Expression("X Y Z"), Optional("0"), "Normal stress.").unit("Pa"),
            key("yy", Expression("X Y Z"), Optional("0"), "Normal stress.").unit("Pa"),
            key("zz", Expression("X Y Z"), Optional("0"), "Normal stress.").unit("Pa"),
            key("xy", Expression("X Y Z"), Optional("0"), "Shear stress.").unit("Pa"),
            key("yz", Expression("X Y Z"), Optional("0"), "Shear stress, in 3D.").unit("Pa"),
            key("xz", Expression("X Y Z"), Optional("0"), "Shear stress, in 3D.").unit("Pa"),
            key("unit_weight", Expression("X Y Z"), Optional("K0 needs it"),
                "Weight per volume of what lies above, water in the pores included.").unit("N/m3").range(at_least(0.0)),
            key("surface", Expression("X Y Z"), Optional("K0 needs it"),
                "Height of the ground's surface along the axis.").unit("m"),
            key("k0", Expression("X Y Z"), Optional("K0 needs it"),
                "Horizontal over vertical effective stress.").range(at_least(0.0)),
            key("surcharge", Expression("X Y Z"), Optional("0; with [water], what stands on the surface"), "Pressure on the surface in all: loads, the weight of other bodies with the water in them, water that stands there. Of layers each has its own surface and surcharge.")
                .unit("Pa").range(at_least(0.0)),
            key("axis", Choice(&AXES), Optional("the last one: y in 2D, z in 3D"),
                "The vertical axis, upwards."),
        ],
    },
    Section {
        name: "body.lattice",
        header: "body.lattice",
        doc: "Points at offset + (i, j, k) spacing, kept where they are inside; volume spacing^D.",
        keys: &[
            key("spacing", Number, Required, "Distance of neighbours.").unit("m").range(POSITIVE),
            key("offset", Vector, Optional("zeros"),
                "Position of one point, in the shape's frame before `rotate` and `translate`.")
                .unit("m"),
        ],
    },
    Section {
        name: "shape",
        header: "shape",
        doc: "One form, and where it is put. `points` and `cells` only directly in a body.",
        keys: &[
            key("box", Table("shape.box"), Optional("-"), "Axis-aligned box."),
            key("disc", Table("shape.disc"), Optional("-"), "Disc (a ball in 3D)."),
            key("ball", Table("shape.ball"), Optional("-"), "The same as disc."),
            key("ellipse", Table("shape.ellipse"), Optional("-"), "Ellipse (an ellipsoid in 3D)."),
            key("ellipsoid", Table("shape.ellipsoid"), Optional("-"), "The same as ellipse."),
            key("capsule", Table("shape.capsule"), Optional("-"), "Segment with a round radius."),
            key("polygon", Table("shape.polygon"), Optional("-"), "2D, also non-convex."),
            key("stl", Text, Optional("-"),
                "3D: an STL file (text or binary) beside the deck, a closed surface whose facets face outward. A place is inside by its winding number. Lengths are in m, unless `scale` turns them into m."),
            key("scale", Number, Optional("1.0"),
                "Beside stl: what a length of the file is multiplied by; 0.001 for a file in mm.").range(POSITIVE),
            key("terrain", Table("shape.terrain"), Optional("-"),
                "3D: the ground below a grid of heights, z upward."),
            key("where", Text, Optional("-"),
                "Condition on x, y, z in the shape's frame, such as \"x*x + y < 1\"; bound it with intersection."),
            key("union", Special(SHAPES), Optional("-"), "Points in any of them."),
            key("intersection", Special(SHAPES), Optional("-"), "Points in all of them."),
            key("difference", Special(SHAPES), Optional("-"), "The first minus the others."),
            key("points", Text, Optional("-"),
                "File of points beside the deck. A csv file has the header x,y[,z],volume[,vx,vy,vz][,body] and no other columns, unless `names` is given. A VTK file (.vtu, .vtp, .vtk, of this or another program) has arrays `volume` and, if it likes, `velocity` and `body` at its points; others are passed over. A point's domain is a square (cube) of its volume; with basis = \"gimp\" no wider than a cell."),
            key("of_body", Count, Optional("all points"),
                "Beside points: only those whose `body` is this number. A file of several bodies needs it."),
            key("names", Table("shape.names"), Optional("the usual names"),
                "Beside points: what the file calls its columns or arrays. Others are then passed over."),
            key("cells", Text, Optional("-"),
                "Cells of a mesh with this tag, or \"all\"."),
            key("rotate", Table("shape.rotate"), Optional("not turned"),
                "Turns the form, before translate."),
            key("translate", Vector, Optional("not moved"), "Moves the form.").unit("m"),
        ],
    },
    Section {
        name: "shape.names",
        header: "shape.names",
        doc: "Columns of a csv file, or arrays of a VTK file.",
        keys: &[
            key("x", Text, Optional("x"), "csv: column of x."),
            key("y", Text, Optional("y"), "csv: column of y."),
            key("z", Text, Optional("z"), "csv: column of z."),
            key("vx", Text, Optional("vx"), "csv: column of the velocity along x."),
            key("vy", Text, Optional("vy"), "csv: column of the velocity along y."),
            key("vz", Text, Optional("vz"), "csv: column of the velocity along z."),
            key("volume", Text, Optional("volume"), "Volume, m3; per metre of thickness in plane strain."),
            key("velocity", Text, Optional("velocity"), "VTK: array of velocities, m/s."),
            key("body", Text, Optional("body"), "Number of the body that a point belongs to."),
        ],
    },
    Section {
        name: "shape.box",
        header: "shape.box",
        doc: "min <= x <= max.",
        keys: BOX_KEYS,
    },
    Section { name: "shape.disc", header: "shape.disc", doc: "|x - centre| <= radius.", keys: BALL_KEYS },
    Section { name: "shape.ball", header: "shape.ball", doc: "|x - centre| <= radius.", keys: BALL_KEYS },
    Section { name: "shape.ellipse", header: "shape.ellipse", doc: "Axes along the coordinates.", keys: ELLIPSE_KEYS },
    Section { name: "shape.ellipsoid", header: "shape.ellipsoid", doc: "Axes along the coordinates.", keys: ELLIPSE_KEYS },
    Section {
        name: "shape.capsule",
        header: "shape.capsule",
        doc: "All within `radius` of a segment.",
        keys: CAPSULE_KEYS,
    },
    Section {
        name: "shape.polygon",
        header: "shape.polygon",
        doc: "Even-odd rule.",
        keys: &[key("vertices", Points, Required, "Corners in order, three or more.").unit("m")],
    },
    Section {
        name: "shape.terrain",
        header: "shape.terrain",
        doc: "The heights are joined by triangles and stand at the middles of the file's cells. Gaps (NODATA) are refused. `translate` brings a place on the map to the grid.",
        keys: &[
            key("file", Text, Required, "ESRI ASCII grid (ncols, nrows, xllcorner, yllcorner, cellsize, rows from the north) beside the deck."),
            key("bottom", Number, Required, "Height of the flat bottom, below all heights.").unit("m"),
        ],
    },
    Section {
        name: "shape.rotate",
        header: "shape.rotate",
        doc: "Right-handed; in 2D counter-clockwise.",
        keys: &[
            key("degrees", Number, Required, "Angle.").unit("deg"),
            key("about", Vector, Optional("zeros"), "A point that stays.").unit("m"),
            key("axis", Vector, Optional("z"), "3D: direction of the axis."),
        ],
    },
    Section {
        name: "boundary",
        header: "[[boundary]]",
        doc: "Prescribed displacement: of grid nodes (where), at least one of fix, displacement and rotation; or of a surface, wherever it lies on the grid (surface).",
        keys: &[
            key("name", Text, Optional("boundary-1, boundary-2, ..."),
                "Names the reaction columns, unique. A component of a node that several boundaries hold counts for the one whose motion the node follows, of equal ones for the first in the deck."),
            key("where", Table("where"), Optional("or surface"), "Which nodes."),
            key("surface", Table("surface"), Optional("or where"),
                "A surface that is held by a penalty: in all components, in those of fix and displacement if there are any, or with slip in its normal one.")
                .read_by(&[super::LOADED]),
            key("fix", Choices(&AXES), Optional("none"), "Components held at zero."),
            key("displacement", Table("displacement"), Optional("none"), "Prescribed components."),
            key("rotation", Table("rotation"), Optional("none"),
                "Rigid rotation: prescribes x and y. In 3D z is free unless fix or displacement prescribe it. Not with surface."),
            key("slip", Flag, Optional("false; only with surface"),
                "Holds the component along the normal that the surface has at the start, and lets the material slide along it: exact on a plane. With displacement its normal component is prescribed.")
                .read_by(&[super::LOADED]),
            key("penalty", Number, Optional("100, with nitsche 10; only with surface"),
                "Force per area and per distance times the cell size over the body's stiffness: the surface gives way by p h / (penalty E) under the pressure p. In explicit runs it shortens the stable time step.")
                .range(POSITIVE).read_by(&[super::LOADED]),
            key("method", Choice(SupportMethod::NAMES), Optional("\"penalty\"; only with surface"),
                "nitsche: the material's own stress supplies the traction there, and the penalty bears what is left, so that it can be small: more exact, with an unsymmetric tangent.")
                .read_by(&[super::IMPLICIT]),
            from_stage("the first stage"),
            UNTIL,
        ],
    },
    Section {
        name: "surface",
        header: "boundary.surface",
        doc: "A part of a body's own surface, which moves with it and is held where it was at the start, or as the stage of `from` began; or the material that lies on a line (2D) or plane (3D) at the start. With slip, what has slid beyond the ends of a line or plane is free, and what has slid onto it is held.",
        keys: &[
            OF_BODY[0],
            OF_BODY[1],
            OF_BODY[2],
            key("line", Points, Optional("-"), "Two ends (2D).").unit("m"),
            key("plane", Points, Optional("-"), "Three corners of a parallelogram, the first between the others (3D).").unit("m"),
        ],
    },
    Section {
        name: "where",
        header: "boundary.where",
        doc: "One of the four.",
        keys: &[
            key("side", Choice(SIDES), Optional("-"), "A face of the lattice."),
            key("box", Table("where.box"), Optional("-"),
                "Nodes in or on a box (tolerance 1e-9 of a cell), in start positions; at least one of the grid."),
            key("tag", Text, Optional("-"), "Nodes of a tag of the mesh."),
            key("cells_of", Text, Optional("-"),
                "Nodes of the cells that hold the outermost points of a body, found anew in each step (Lagrangian §7.2). On a mesh these are the points seeded in cells that the body does not fill, or behind one face of which it has nothing. Not for a body of a file."),
        ],
    },
    Section {
        name: "where.box",
        header: "boundary.where.box",
        doc: "A plane, a line or a node where min equals max.",
        keys: BOX_KEYS,
    },
    Section {
        name: "displacement",
        header: "boundary.displacement",
        doc: "Total over the analysis; a value without `s` or `t` is ramped with the load factor.",
        keys: &[
            key("x", Expression("X Y Z s t"), Optional("free"), "Component x.").unit("m"),
            key("y", Expression("X Y Z s t"), Optional("free"), "Component y.").unit("m"),
            key("z", Expression("X Y Z s t"), Optional("free"), "Component z.").unit("m"),
        ],
    },
    Section {
        name: "rotation",
        header: "boundary.rotation",
        doc: "Total over the analysis, counter-clockwise about z.",
        keys: &[
            key("centre", Vector, Optional("zeros"), "Centre.").unit("m"),
            key("degrees", Number, Required, "Angle.").unit("deg"),
        ],
    },
    Section {
        name: "water",
        header: "[water]",
        doc: "Still water in the pores of all bodies and around them: the pore pressure is unit_weight (level - height), and 0 above the level, whatever the bodies do. Materials respond with their effective stress; the field `stress` is the total one, effective_stress - pore_pressure. What is below the level is lifted by unit_weight times its volume (at the start of a step), as the gradient of the pore pressure does; densities are those with the water in the pores. Reactions are those of the effective stress. The lift ramps like a load, and acts in full from the first step on where a body has initial_stress.",
        keys: &[
            key("level", Number, Required, "Height of the water table.").unit("m"),
            key("unit_weight", Number, Default("9.81e3"), "Unit weight of water.").unit("N/m3").range(POSITIVE),
            key("axis", Choice(&AXES), Optional("the last one: y in 2D, z in 3D"),
                "The vertical axis, upwards."),
        ],
    },
];

const ELLIPSE_KEYS: &[super::Key] = &[
    key("centre", Vector, Required, "Centre.").unit("m"),
    key("semi_axes", Vector, Required, "Semi-axes.").unit("m").range(POSITIVE),
];

/// Faces of a box: axis = index / 2, upper = odd.
pub const SIDES: &[&str] = &["left", "right", "bottom", "top", "back", "front"];
