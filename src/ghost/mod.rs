//! Ghost stabilisation: penalise jumps of the normal gradient near the boundary of each body
//! (Ghost §3), so that the condition of mass and stiffness is bounded wherever bodies lie on
//! the grid.
//!
//! | file | idea | source |
//! |---|---|---|
//! | `cells.rs` | what is known of cells, across ranks | |
//! | `faces.rs` | boundary faces, per body, then united | Ghost §3.1, §4.2 |
//! | `ties.rs` | simplices that hold together by a node only | |
//! | `stencil.rs` | the scalar face matrix J_G and its scalings | Ghost eq. 23, 24, 27, 28 |

mod cells;
pub(crate) mod faces;
pub(crate) mod stencil;
mod ties;

pub use cells::BoundaryFace;
pub use faces::boundary_faces;
pub use stencil::{FaceStencil, face_stencils};
