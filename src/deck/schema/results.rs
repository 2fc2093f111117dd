//! Keys of what is written and watched, of the distribution, and of analyses without loads.

use super::Kind::{Choice, Choices, Count, Flag, Number, Points, Special, Table, Text, Vector};
use super::Need::{Default, Optional, Required};
use super::{POSITIVE, Section, at_least, key, only};
use crate::deck::fields::FIELD_NAMES;
use crate::deck::model::{Cost, ElementPath, Format, Initial, VerifyNorm};

pub const SECTIONS: &[Section] = &[
    Section {
        name: "verify",
        header: "[[verify]]",
        doc: "A figure of merit, printed and stored in summary.json. One without a finite value (a formula that has none at some point) does not fail the run, whose results are as good without it: a warning names the first such point, and summary.json says null.",
        keys: &[
            key("name", Text, Required, "Its name there."),
            key(
                "field",
                Special("a field such as \"stress.yy\" or \"displacement\""),
                Required,
                "The point field that is compared: a scalar, a component, or a vector.",
            ),
            key(
                "exact",
                Special("a number or an expression; for a vector an array of one per axis"),
                Required,
                "Exact value, of X, Y, Z, x, y, z, s, t.",
            ),
            key(
                "norm",
                Choice(VerifyNorm::NAMES),
                Default("\"volume-l1\""),
                "Lagrangian eq. 42, its quadratic form, or the largest error.",
            ),
            key("scale", Number, Default("1.0"), "Divides the error.").range(POSITIVE),
        ],
    },
    Section {
        name: "probe",
        header: "[[probe]]",
        doc: "Fields of one point, or means over a body, in `probes.csv`: a row beside each of `history.csv`, a column for each component, named `NAME.field.component [unit]`. A point is followed wherever it goes. Give one of near, id and body.",
        keys: &[
            key("name", Text, Required, "Its name there."),
            key(
                "near",
                Vector,
                Optional("or id, body"),
                "The point whose initial position is nearest, of all bodies or of `body`.",
            )
            .unit("m"),
            key("id", Count, Optional("or near, body"), "The point with this id (field `id`)."),
            key(
                "body",
                Text,
                Optional("or near, id"),
                "Name of a body: the mean over its points, weighted by the initial volume.",
            ),
            key(
                "fields",
                Special(
                    "an array of fields or components, such as [\"displacement\", \"stress.yy\"]",
                ),
                Required,
                "What is written: of a whole vector or tensor all components.",
            ),
        ],
    },
    Section {
        name: "output",
        header: "[output]",
        doc: "What is written, and when.",
        keys: &[
            key(
                "every",
                Special("a whole number of steps, or { seconds = s }"),
                Default("1"),
                "Interval between outputs.",
            ),
            key(
                "history",
                Special("a whole number of steps, or { seconds = s }"),
                Default("1"),
                "Interval between rows of `history.csv`. A row tells of its own step; iterations and \
                 moved points are sums since the row before. The last step always has a row.",
            ),
            key(
                "log",
                Special("a whole number of steps, or { seconds = s }"),
                Optional("explicit: one second, others: one step"),
                "Interval between lines on the terminal and in `log.txt`. The first and the last step \
                 always have a line; `--verbose` shows all.",
            ),
            key(
                "fields",
                Choices(FIELD_NAMES),
                Default("[\"displacement\", \"stress\", \"plastic_strain\"]"),
                "Point fields.",
            ),
            key(
                "format",
                Choices(Format::NAMES),
                Default("[\"xdmf\"]"),
                "Readers of frames, whose HDF5 files are written in any case. xdmf: `points.xdmf`, `domains.xdmf`, `grid.xdmf` beside them. vtkhdf: `points-*.h5` are VTKHDF files, too, listed in `points.vtkhdf.series`. vtu: `points-*.vtu` besides, listed in `points.pvd`.",
            ),
            key(
                "report",
                Flag,
                Default("true"),
                "Whether the run ends with `report.html`, one page for any browser. `mpm-par report DIR` makes it, too.",
            ),
            key("checkpoint", Table("output.checkpoint"), Optional("none"), "Checkpoints."),
        ],
    },
    Section {
        name: "output.every",
        header: "output.every",
        doc: "An interval of time instead of steps.",
        keys: &[key(
            "seconds",
            Number,
            Required,
            "Simulated time between outputs; without a time, of the load factor.",
        )
        .unit("s")
        .range(POSITIVE)],
    },
    Section {
        name: "output.history",
        header: "output.history",
        doc: "An interval of time instead of steps.",
        keys: &[key(
            "seconds",
            Number,
            Required,
            "Simulated time between rows; without a time, of the load factor.",
        )
        .unit("s")
        .range(POSITIVE)],
    },
    Section {
        name: "output.log",
        header: "output.log",
        doc: "An interval of time instead of steps.",
        keys: &[key("seconds", Number, Required, "Wall time between lines.")
            .unit("s")
            .range(POSITIVE)],
    },
    Section {
        name: "output.checkpoint",
        header: "output.checkpoint",
        doc: "At least one of the two intervals.",
        keys: &[
            key("every", Count, Optional("or minutes"), "Steps between checkpoints.")
                .range(at_least(1.0)),
            key("minutes", Number, Optional("or every"), "Wall time between checkpoints.")
                .unit("min")
                .range(POSITIVE),
            key("keep", Count, Default("2"), "How many to keep.").range(at_least(1.0)),
        ],
    },
    Section {
        name: "parallel",
        header: "[parallel]",
        doc: "Distribution over ranks. The results do not depend on it.",
        keys: &[
            key(
                "brick",
                Count,
                Optional("chosen by size"),
                "Cells per side of a lattice brick, the unit of partition.",
            )
            .range(at_least(1.0))
            .read_by(&[only("grid.type", &["lattice"])]),
            key(
                "initial",
                Choice(Initial::NAMES),
                Default("\"balanced\""),
                "First partition: by the points, or equal slices of the grid for comparison.",
            ),
            key(
                "cost",
                Choice(Cost::NAMES),
                Default("\"points\""),
                "What is levelled: points (repeats bit by bit), or measured time.",
            ),
            key(
                "rebalance_above",
                Number,
                Default("1.1"),
                "Repartition when the largest cost exceeds this times the mean; 0: never.",
            )
            .range(at_least(0.0)),
        ],
    },
    Section {
        name: "conditioning",
        header: "[conditioning]",
        doc: "With analysis.type = \"conditioning\": rigid motion in `steps` increments, nothing solved.",
        keys: &[key("displacement", Vector, Required, "Total motion.").unit("m")],
    },
    Section {
        name: "element_test",
        header: "[element_test]",
        doc: "With analysis.type = \"element-test\": one point of a material under a path of a laboratory test, without grid or body. Axis 1 is the axial one. Rows of element.csv count strain and Cauchy stress tension positive, p compression positive; strain is logarithmic and counts from the start.",
        keys: &[
            key("material", Text, Required, "Name of a `[material.NAME]`."),
            key(
                "path",
                Choice(ElementPath::NAMES),
                Required,
                "triaxial-drained: axial strain, lateral Cauchy stresses stay. triaxial-undrained: axial strain at constant volume. oedometer: axial strain alone. isotropic: equal strains. biaxial: axial strain, axis 2 keeps its Cauchy stress, axis 3 its length. simple-shear: in the plane of the axes 1 and 2, principal values are told. strain: own history.",
            ),
            key(
                "confining",
                Number,
                Default("0.0"),
                "Isotropic pressure at the start, compression positive.",
            )
            .unit("Pa"),
            key(
                "strain",
                Number,
                Optional("needed, except with history"),
                "Axial logarithmic strain at the end, compression positive; with simple-shear the amount of shear.",
            ),
            key("steps", Count, Required, "Equal steps of the test, or of each leg of a history.")
                .range(at_least(1.0)),
            key(
                "history",
                Points,
                Optional("path = \"strain\" needs it, alone"),
                "Three principal logarithmic strains, tension positive, at the end of each leg.",
            ),
        ],
    },
];
