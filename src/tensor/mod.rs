//! Small fixed-size tensors.
//!
//! | idea | file |
//! |---|---|
//! | `[[f64; D]; D]`: product, determinant, inverse, between 2D and 3D | `dense.rs` |
//! | products of small blocks in inner loops | `fused.rs` |
//! | principal values and axes of a symmetric 3 x 3 tensor, ln, exp, sqrt | `spectral.rs` |
//!
//! Second-order tensors in `D` dimensions are `[[f64; D]; D]`, row first; what is
//! three-dimensional even in plane strain is a `nalgebra::Matrix3`.

pub(crate) mod dense;
pub(crate) mod fused;
pub(crate) mod spectral;

pub use dense::Square;
pub use spectral::Spectrum;
