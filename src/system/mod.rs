//! A step's equations: active nodes, their numbers, the sparsity, and the terms that fill it
//! (Ghost Figure 1 b, c).
//!
//! | file | idea |
//! |---|---|
//! | `model.rs` | the deck made computable: what stays while points move |
//! | `step_system.rs` | locate, map and number: the grid side of a step |
//! | `populated.rs` | which cells hold material, and whose |
//! | `rim.rs` | whose points lie in the cells at a lattice's edge |
//! | `step_points.rs` | points with their functions, as the equations see them |
//! | `numbering.rs` | equations over active nodes, contiguous by rank |
//! | `node_index.rs` | grid nodes to small indices |
//! | `graph.rs` | which nodes meet |
//! | `pattern.rs` | exact sparsity, and where every contribution goes |
//! | `support_columns.rs` | where each dense block lies in the rows |
//! | `kernel.rs` | sums over points, tiled for vector registers |
//! | `cell_rows.rs` | rows of cells that points share with F-bar, and their sums |
//! | `plain.rs` | these sums once more, written as the formulas read |
//! | `border.rs` | what waits for other ranks, and what does not |
//! | `scatter.rs` | dense blocks into the rows of their owners |
//! | `in_place.rs` | those rows in the solver's own memory |
//! | `held.rs` | held degrees of freedom in those rows |
//! | `conditions.rs` | Dirichlet conditions on the nodes |
//! | `supports.rs` | surfaces held by a penalty, wherever they lie on the grid |
//! | `holds.rs` | where a support of a later stage holds the elements that come with it |
//! | `carried.rs` | where elements of surfaces are that points carry |
//! | `face_points.rs` | the cells of points on faces, where the mass decides |
//! | `apart.rs` | no body overlaps a rigid one that comes |
//! | `facing.rs` | elements of surfaces that face another body |
//! | `shared_nodes.rs` | where bodies in velocity fields of their own meet |
//! | `unknowns.rs` | what the unknowns of a node are |
//! | `terms/` | contributions to the equations |

pub(crate) mod apart;
pub mod border;
pub(crate) mod carried;
pub(crate) mod cell_rows;
pub mod conditions;
pub(crate) mod face_points;
pub(crate) mod facing;
pub(crate) mod graph;
pub mod held;
pub(crate) mod holds;
pub mod in_place;
pub(crate) mod kernel;
pub mod model;
pub(crate) mod node_index;
pub mod numbering;
pub mod pattern;
pub mod plain;
pub(crate) mod populated;
pub(crate) mod rim;
pub mod scatter;
pub mod shared_nodes;
pub mod step_points;
pub mod step_system;
pub(crate) mod support_columns;
pub(crate) mod supports;
pub mod terms;
pub mod unknowns;
