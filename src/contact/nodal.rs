//! Impulses between the velocity fields of two bodies at a node (Bardenhagen et al. 2001; Nairn et al.
//! 2020, CMAME 362:112859).
//!
//! With v_b - v_a = r at the step's end before contact, n from a to b, g the gap between the domains and
//! W = 1/m_a + 1/m_b along each axis (0 where both are held), the impulse J on b (-J on a) makes
//! r' = r + W J. Where g + dt r·n < 0 the bodies touch:
//!
//! r'·n = -max(g, 0)/dt with J·n = N >= 0, and r' has no tangential part if that takes
//! |T| <= min(adhesion A dt + μ N, most A dt); else T is that limit, against r.

use super::law::Friction;
use super::surface::length;
use crate::tensor::dense::dot;

/// Two fields at a node.
#[derive(Debug, Clone, Copy)]
pub struct Meeting<const D: usize> {
    /// From the first body to the second.
    pub normal: [f64; D],
    /// Between their domains along the normal, m; negative where they overlap.
    pub gap: f64,
    /// The node's share of the surface, m2 (m in 2D).
    pub area: f64,
}

/// What two bodies exchange at a node in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exchange<const D: usize> {
    /// On the second body, N s.
    pub impulse: [f64; D],
    /// r', m/s.
    pub after: [f64; D],
}

impl<const D: usize> Meeting<D> {
    /// `relative`: r, m/s; `compliance`: W, 1/kg; `touching`: gap up to which the bodies touch, m. `None`
    /// where they do not.
    pub fn exchange(
        &self,
        friction: Friction,
        relative: &[f64; D],
        compliance: &[f64; D],
        (touching, dt): (f64, f64),
    ) -> Option<Exchange<D>> {
        let n = &self.normal;
        if self.gap + dt * dot(relative, n) > touching {
            return None;
        }
        let wanted = -self.gap.max(0.0) / dt;
        let along = wanted - dot(relative, n);
        let weighted = |u: &[f64; D], v: &[f64; D]| -> f64 {
            (0..D).map(|i| u[i] * compliance[i] * v[i]).sum()
        };
        let soft = weighted(n, n);
        if soft == 0.0 {
            return None;
        }
        let stuck: [f64; D] = std::array::from_fn(|i| match compliance[i] {
            0.0 => 0.0,
            w => (wanted * n[i] - relative[i]) / w,
        });
        let pressed = dot(&stuck, n);
        let shear: [f64; D] = std::array::from_fn(|i| stuck[i] - pressed * n[i]);
        let size = length(&shear);
        let Limit { fixed, coefficient, most } = self.limit(friction, dt);
        let impulse = if friction == Friction::Smooth || size == 0.0 {
            n.map(|n| (along / soft).max(0.0) * n)
        } else if size <= (fixed + coefficient * pressed.max(0.0)).min(most) && pressed >= 0.0 {
            stuck
        } else {
            let way = shear.map(|t| t / size);
            let across = weighted(n, &way);
            // N of T = fixed + coefficient N, or of T = most.
            let sliding = ((along - fixed * across) / (soft + coefficient * across)).max(0.0);
            let (normal, tangential) = match friction {
                Friction::Rough => (0.0, 0.0),
                _ if fixed + coefficient * sliding <= most => {
                    (sliding, fixed + coefficient * sliding)
                }
                _ => (((along - most * across) / soft).max(0.0), most),
            };
            // What adheres without pressure does not overshoot the stick.
            let tangential = if normal > 0.0 { tangential } else { tangential.min(size) };
            std::array::from_fn(|i| normal * n[i] + tangential * way[i])
        };
        let after = std::array::from_fn(|i| relative[i] + compliance[i] * impulse[i]);
        Some(Exchange { impulse, after })
    }

    /// Of the tangential impulse, N s.
    fn limit(&self, friction: Friction, dt: f64) -> Limit {
        let (fixed, coefficient, most) = match friction {
            Friction::Smooth => (0.0, 0.0, 0.0),
            Friction::Rough => (0.0, 0.0, f64::INFINITY),
            Friction::Coulomb { coefficient, adhesion, most } => {
                (adhesion * self.area * dt, coefficient, most * self.area * dt)
            }
        };
        if friction == Friction::Rough {
            return Limit { fixed: f64::INFINITY, coefficient: 0.0, most };
        }
        // Of no area a limit of the shear says nothing: infinity times zero.
        Limit { fixed, coefficient, most: if most.is_nan() { f64::INFINITY } else { most } }
    }
}

/// |T| <= min(fixed + coefficient N, most), N s.
struct Limit {
    fixed: f64,
    coefficient: f64,
    most: f64,
}

impl<const D: usize> Exchange<D> {
    /// What the impulse takes, J: by friction, and along the normal, where bodies that meet lose their
    /// approach at the nodes. It acts over the step, in which r goes from `start` to `after`.
    pub fn dissipation(&self, start: &[f64; D], normal: &[f64; D]) -> [f64; 2] {
        let mean: [f64; D] = std::array::from_fn(|i| 0.5 * (start[i] + self.after[i]));
        let pressed = -dot(&self.impulse, normal) * dot(&mean, normal);
        let all = -dot(&self.impulse, &mean);
        [all - pressed, pressed]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COULOMB: Friction =
        Friction::Coulomb { coefficient: 0.3, adhesion: 0.0, most: f64::INFINITY };

    fn meeting(gap: f64) -> Meeting<2> {
        Meeting { normal: [0.0, 1.0], gap, area: 0.5 }
    }

    #[test]
    fn bodies_that_part_or_do_not_reach_each_other_exchange_nothing() {
        let apart =
            |gap, r: [f64; 2]| meeting(gap).exchange(COULOMB, &r, &[2.0; 2], (1e-9, 0.1)).is_none();
        assert!(apart(0.2, [0.0, -1.0]) && apart(0.0, [0.0, 1.0]) && !apart(0.05, [0.0, -1.0]));
    }

    /// A gap closes in the step and no further; what is overlapped stays.
    #[test]
    fn the_approach_ends_where_the_gap_is_closed() {
        for gap in [0.05, 0.0, -0.3] {
            let found = meeting(gap)
                .exchange(Friction::Smooth, &[0.4, -1.0], &[2.0; 2], (0.0, 0.1))
                .expect("they touch");
            assert!((found.after[1] + f64::max(gap, 0.0) / 0.1).abs() < 1e-14, "{found:?}");
            assert_eq!(found.after[0], 0.4);
        }
    }

    #[test]
    fn friction_sticks_below_its_limit_and_slides_at_it() {
        let of = |friction, r: [f64; 2], w: [f64; 2]| {
            meeting(0.0).exchange(friction, &r, &w, (0.0, 0.1)).expect("they touch")
        };
        let stuck = of(COULOMB, [0.2, -1.0], [2.0; 2]);
        assert_eq!(stuck.after, [0.0, 0.0]);
        let slid = of(COULOMB, [0.4, -1.0], [2.0; 2]);
        assert!((slid.impulse[0] + 0.3 * slid.impulse[1]).abs() < 1e-14 && slid.after[0] > 0.0);
        // Dissipation is the loss of kinetic energy of two masses of 1 kg.
        let lost = slid.dissipation(&[0.4, -1.0], &[0.0, 1.0]);
        let energy = |r: [f64; 2]| 0.25 * (r[0] * r[0] + r[1] * r[1]);
        assert!((lost[0] + lost[1] - energy([0.4, -1.0]) + energy(slid.after)).abs() < 1e-14);
        // Held along x nothing is exchanged there.
        assert_eq!(of(COULOMB, [0.4, -1.0], [0.0, 2.0]).impulse[0], 0.0);
        let adhesive = Friction::Coulomb { coefficient: 0.0, adhesion: 2.0, most: 1.5 };
        let sheared = of(adhesive, [0.4, 0.0], [2.0; 2]);
        assert!((sheared.impulse[0] + 1.5 * 0.5 * 0.1).abs() < 1e-14, "{sheared:?}");
        assert_eq!(of(Friction::Rough, [0.4, -1.0], [2.0; 2]).after, [0.0, 0.0]);
    }

    /// With a normal off the axes and a held component the law holds as well.
    #[test]
    fn a_tilted_plane_with_a_held_axis_does_not_let_through() {
        let tilted = Meeting { normal: [0.6, 0.8], gap: 0.0, area: 1.0 };
        let found = tilted.exchange(COULOMB, &[1.0, -2.0], &[1.0, 0.0], (0.0, 0.1));
        let found = found.expect("they touch");
        assert!(dot(&found.after, &tilted.normal).abs() < 1e-14, "{found:?}");
        let n = dot(&found.impulse, &tilted.normal);
        let t = dot(&found.impulse, &[0.8, -0.6]);
        assert!(n > 0.0 && (t.abs() - 0.3 * n).abs() < 1e-12, "{n} {t}");
    }
}
