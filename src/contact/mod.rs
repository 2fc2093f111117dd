//! Contact of bodies with rigid surfaces, by a penalty (formulations.md B.5; Bird et al. 2024,
//! arXiv 2412.01565), and with each other, by impulses at nodes (Bardenhagen et al. 2001; Nairn et al.
//! 2020) in explicit runs and by a penalty in implicit ones ([`crate::system::facing`]).
//!
//! | deck key | type | file |
//! |---|---|---|
//! | what a surface says of a place | [`Surface`](surface::Surface), [`Near`] | `surface.rs` |
//! | `half_space` | [`HalfSpace`](half_space::HalfSpace) | `half_space.rs` |
//! | `disc`, `ball` | [`Ball`](ball::Ball) | `ball.rs` |
//! | `box` | [`Cuboid`](cuboid::Cuboid) | `cuboid.rs` |
//! | `capsule` | [`Capsule`](capsule::Capsule) | `capsule.rs` |
//! | `polygon` | [`Outline`](outline::Outline) | `outline.rs` |
//! | `stl` | [`Triangles`](triangles::Triangles) | `triangles.rs` |
//! | `cone` | [`Cone`](cone::Cone) | `cone.rs` |
//! | where a rigid body is | [`Pose`](pose::Pose) | `pose.rs` |
//! | how it is driven | [`Motion`](motion::Motion) | `motion.rs` |
//! | volume and inertia | [`Solid`](solid::Solid) | `solid.rs` |
//! | surfaces to be looked at | [`Facets`](facets::Facets) | `facets.rs` |
//! | a rigid body that moves freely | [`FreeBody`](free::FreeBody) | `free.rs` |
//! | pressure and friction | [`Law`](law::Law) | `law.rs` |
//! | corners of the points' domains | [`DomainCorners`](corner::DomainCorners) | `corner.rs` |
//! | corners at the start of a run | [`Corner`](start::Corner) | `start.rs` |
//! | velocity fields of bodies that touch each other | [`Fields`](fields::Fields) | `fields.rs` |
//! | the plane between two bodies | [`separate`](separator::separate) | `separator.rs` |
//! | impulses between two fields at a node | [`Meeting`](nodal::Meeting) | `nodal.rs` |
//! | the state of contact of a point, for the fields `contact_*` | [`ContactState`](point_state::ContactState) | `point_state.rs` |
//! | the rigid bodies and contacts of a deck | [`Contacts`] | `contacts.rs` |
//!
//! A new surface is one file that implements [`Surface`](surface::Surface) and one line of `contacts.rs`. The forces
//! and their tangent are a term of the equations: `system/terms/contact/mod.rs`.

pub(crate) mod ball;
pub(crate) mod capsule;
pub(crate) mod cone;
pub(crate) mod contacts;
pub(crate) mod corner;
pub(crate) mod cuboid;
pub(crate) mod facets;
pub(crate) mod fields;
pub(crate) mod free;
pub(crate) mod half_space;
pub(crate) mod law;
pub(crate) mod motion;
pub(crate) mod nodal;
pub(crate) mod outline;
pub(crate) mod point_state;
pub(crate) mod pose;
pub(crate) mod separator;
pub(crate) mod solid;
pub(crate) mod start;
pub(crate) mod surface;
pub(crate) mod triangles;

pub use contacts::{Contacts, Pair};
pub use surface::Near;

#[cfg(test)]
mod tests;
