//! Element types by Gmsh's numbers (reference manual, "MSH file format").

/// Type of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    pub number: i64,
    pub name: &'static str,
    pub dimension: usize,
    pub nodes: usize,
    /// Degree of the shape functions.
    pub order: usize,
}

/// Number, name, dimension, nodes, order.
const KINDS: [(i64, &str, usize, usize, usize); 31] = [
    (1, "line2", 1, 2, 1),
    (2, "tri3", 2, 3, 1),
    (3, "quad4", 2, 4, 1),
    (4, "tet4", 3, 4, 1),
    (5, "hex8", 3, 8, 1),
    (6, "prism6", 3, 6, 1),
    (7, "pyramid5", 3, 5, 1),
    (8, "line3", 1, 3, 2),
    (9, "tri6", 2, 6, 2),
    (10, "quad9", 2, 9, 2),
    (11, "tet10", 3, 10, 2),
    (12, "hex27", 3, 27, 2),
    (13, "prism18", 3, 18, 2),
    (14, "pyramid14", 3, 14, 2),
    (15, "point", 0, 1, 1),
    (16, "quad8", 2, 8, 2),
    (17, "hex20", 3, 20, 2),
    (18, "prism15", 3, 15, 2),
    (19, "pyramid13", 3, 13, 2),
    (20, "tri9", 2, 9, 3),
    (21, "tri10", 2, 10, 3),
    (22, "tri12", 2, 12, 4),
    (23, "tri15", 2, 15, 4),
    (24, "tri15", 2, 15, 5),
    (25, "tri21", 2, 21, 5),
    (26, "line4", 1, 4, 3),
    (27, "line5", 1, 5, 4),
    (28, "line6", 1, 6, 5),
    (29, "tet20", 3, 20, 3),
    (30, "tet35", 3, 35, 4),
    (36, "quad16", 2, 16, 3),
];

impl Kind {
    pub(super) fn from_number(number: i64) -> Option<Kind> {
        let &(number, name, dimension, nodes, order) =
            KINDS.iter().find(|kind| kind.0 == number)?;
        Some(Kind { number, name, dimension, nodes, order })
    }
}
