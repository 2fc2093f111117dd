//! x_p += dt Σ S w: the velocity w that carries the points of an explicit step (Ghost eq. 9 with
//! w in the place of v'), chosen so that the angular momentum is kept.
//!
//! Let v and v' = v + dt a be the nodal velocities of Ghost eq. 10 and 11, M~ = M + M_G the mass
//! that gave them, and P' = Σ m S^T v_p' the momenta of the updated points, mapped with the same
//! functions. Where the nodal forces have no moment the step changes the angular momentum by
//! dt Σ w x P' over the nodes: linear fields lie in the kernel of M_G, which therefore adds
//! momentum to neither the sum nor its moment. With w = v' that is -dt^2 Σ v' x (M_G a) for
//! `flip`: the Ghost mass shares in the velocity of the nodes, not in that of the points.
//!
//! - w = M~^-1 P' makes it zero, as M~ is symmetric. For `flip` this is v' - dt M~^-1 M_G a: a
//!   change of order dt^2 in a step, and none where the acceleration is linear in space.
//! - The plain v' serves where P' = M v': for `pic`, and for all without a Ghost mass.
//! - Stress updated first acts in the configuration x + dt v, about which its moment vanishes;
//!   about x it is -dt Σ v x f. The points then move by w = M~^-1 P' - dt a, which is v for
//!   `flip` without a Ghost mass: the deformation and the motion of a step are the same. With a
//!   PIC share and a Ghost mass, the points deform, and the forces act, in the field
//!   u = M~^-1 Σ m S^T v_p° of the points with that share, v_p° = α v_p + (1 - α) S v, as else
//!   nothing bounded keeps the moment.
//!
//! The lumped mass keeps no angular momentum, and w = v' there, as wherever the deck asks for the
//! published motion.

use crate::deck::model::{PositionUpdate, StressUpdate};

/// What carries the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    /// v'
    Updated,
    /// v = v' - dt a
    Start,
    /// M~^-1 P'
    Remapped,
    /// M~^-1 P' - dt a
    RemappedBack,
}

/// The rule above. `consistent`: the kind of mass; `ghost`: it has a Ghost share on some rank;
/// `share`: of FLIP.
pub fn carrier(
    motion: PositionUpdate,
    update: StressUpdate,
    consistent: bool,
    ghost: bool,
    share: f64,
) -> Carrier {
    match (update, ghost) {
        _ if motion == PositionUpdate::Published || !consistent => Carrier::Updated,
        (StressUpdate::Usf, true) => Carrier::RemappedBack,
        (StressUpdate::Usf, false) => Carrier::Start,
        (_, true) if share > 0.0 => Carrier::Remapped,
        _ => Carrier::Updated,
    }
}

impl Carrier {
    /// True where w takes a solve with the mass.
    pub fn needs_solve(self) -> bool {
        matches!(self, Carrier::Remapped | Carrier::RemappedBack)
    }
}
