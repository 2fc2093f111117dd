//! Material points: what the body carries from step to step (struct of arrays, one rank's share).
//!
//! | file | idea |
//! |---|---|
//! | `mod.rs` | the fields of a point |
//! | `fields.rs` | how all of them are packed, moved and reordered |
//! | `former.rs` | what a step overwrites, to go back to where it fails |
//! | `gather.rs` | a field's values in another order |
//! | `named.rs` | words that a body's material asks for, by name |
//! | `seed.rs` | deck bodies -> points |
//! | `sub_cells.rs`, `coverage.rs` | sub-cells of a lattice that a shape fills or cuts |
//! | `overlap.rs` | are two bodies in one place? |
//! | `seed_cells.rs` | the same for bodies that fill the cells of a mesh |
//! | `share.rs` | which of them a rank makes |
//! | `sort.rs` | points in the order of their cells |

pub(crate) mod coverage;
mod fields;
pub(crate) mod file;
pub(crate) mod former;
mod gather;
mod named;
pub(crate) mod overlap;
pub mod seed;
mod seed_cells;
pub mod share;
pub(crate) mod sort;
mod sub_cells;

use std::f64::consts::TAU;

pub use fields::Packed;
use fields::point_fields;
use former::Former;
use gather::{Gather, Moves};
use nalgebra::Matrix3;
pub use named::Named;

use crate::deck::model::{Basis, Method, Water};
use crate::grid::lattice::CORNER_SIGNS;
use crate::tensor::Spectrum;
use crate::tensor::spectral::ln_1p;

point_fields! {
    /// x, m
    position: [f64; D], D;
    /// X, m
    position_initial: [f64; D], D;
    /// V0, m3 (m2 in plane strain)
    volume_initial: f64, 1;
    /// kg (kg/m in plane strain), constant
    mass: f64, 1;
    /// v, m/s
    velocity: [f64; D], D;
    /// a, m/s2 (implicit dynamics)
    acceleration: [f64; D], D;
    /// L of an affine transfer, 1/s: see [`crate::transfer::affine`]; none without one
    velocity_gradient: [[f64; D]; D], D * D;
    /// Σ S (x_i - x_p)^2 along each axis when L was taken from the grid, m2; none without L
    spread: [f64; D], D;
    /// Where the displacement counts from, m; none where it counts from the start
    displacement_start: [f64; D], D;
    /// F at the end of the last finished step
    deformation_gradient: Matrix3<f64>, 9;
    /// b_e - 1, b_e the elastic left Cauchy-Green strain at the end of the last finished step: apart
    /// from the unit, so that small strains keep their digits
    elastic_excess: Matrix3<f64>, 9;
    /// Kirchhoff stress tau, Pa, at the end of the last finished step
    kirchhoff_stress: Matrix3<f64>, 9;
    /// Accumulated plastic strain: sum of the norms of the plastic log-strain increments
    plastic_strain: f64, 1;
    /// Plastic dissipation, J per unit of initial volume
    dissipation: f64, 1;
    /// Half lengths l_p of the GIMP domain, m (for mpm: V^(1/D)/2)
    half_length: [f64; D], D;
    /// Half lengths at the start, m
    half_length_initial: [f64; D], D;
    /// Point force held by the point at full load, N
    point_force: [f64; D], D;
    /// 1 for the outermost layer of the body's initial seeding, 0 inside
    outermost: f64, 1;
    /// Corners of the CPDI2 domain (2D: 4, counter-clockwise; 3D: 8, hex8 order), m; with CPDI1
    /// those at the start; none with the other bases
    corners: [[f64; D]; 8], 8 * D;
}

impl<const D: usize> Points<D> {
    /// No points yet, of a basis that may read no corners: a quarter of a point's memory.
    pub fn of_basis(basis: Basis) -> Self {
        Points { cornerless: !basis.domain().has_corners(), ..Points::default() }
    }

    /// No points yet, that carry what `method` reads.
    pub fn of_method(method: &Method) -> Self {
        Points { affine: method.affine.is_some(), ..Self::of_basis(method.basis) }
    }

    /// Forgets what `basis` does not read.
    pub fn shed(&mut self, basis: Basis) {
        self.cornerless = Self::of_basis(basis).cornerless;
        if self.cornerless {
            self.corners = Vec::new();
        }
    }

    fn carries(&self, field: &str) -> bool {
        !(self.cornerless && field == "corners"
            || !self.affine && Self::of_affine(field)
            || !self.counts_anew && field == "displacement_start")
    }

    /// Whether checkpoints hold a field only where points carry it.
    pub fn is_optional(field: &str) -> bool {
        Self::of_affine(field) || field == "displacement_start"
    }

    /// Whether a checkpoint holds a field of these points.
    pub fn stores(&self, field: &str) -> bool {
        !Self::is_optional(field) || self.carries(field)
    }

    /// u = x - X, or since the last stage that reset it, m.
    pub fn displacement(&self, p: usize) -> [f64; D] {
        let start = self.displacement_start.get(p).unwrap_or(&self.position_initial[p]);
        std::array::from_fn(|a| self.position[p][a] - start[a])
    }

    /// Pore pressure, Pa, compression positive.
    pub fn pore_pressure(&self, p: usize) -> f64 {
        self.water.map_or(0.0, |water| water.pressure(&self.position[p]))
    }

    /// Appends points of another container with the same fields.
    pub fn append(&mut self, other: &Points<D>) {
        let mut record = Vec::with_capacity(other.record_words());
        for p in 0..other.len() {
            record.clear();
            other.pack(p, &mut record);
            self.unpack(&record);
        }
    }

    /// A container without points that carries the same fields.
    pub fn empty_like(&self) -> Self {
        Points {
            cornerless: self.cornerless,
            affine: self.affine,
            counts_anew: self.counts_anew,
            counted: self.counted,
            water: self.water,
            state: self.state.empty_like(),
            parameters: self.parameters.empty_like(),
            slip: self.slip.empty_like(),
            ..Points::default()
        }
    }

    /// Whether only an affine transfer has this field.
    pub fn of_affine(field: &str) -> bool {
        matches!(field, "velocity_gradient" | "spread")
    }

    /// Number of points on this rank.
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether this rank has no points.
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// V = det F V0 of the last finished step, m3.
    pub fn volume(&self, p: usize) -> f64 {
        self.deformation_gradient[p].determinant() * self.volume_initial[p]
    }

    /// Area of a ring's section, V / (2π r), m2.
    pub fn section(&self, p: usize) -> f64 {
        let hoop = self.deformation_gradient[p][(2, 2)];
        self.volume(p) / (TAU * self.position_initial[p][0] * hoop)
    }

    /// Makes rings of the points from `first` on: volumes and masses of the section become those of the
    /// whole turn about the axis x = 0 (Pappus: 2π times the radius of the section's centroid).
    pub fn make_rings(&mut self, first: usize) {
        for p in first..self.len() {
            let around = TAU * self.position_initial[p][0];
            self.volume_initial[p] *= around;
            self.mass[p] *= around;
        }
    }

    /// Principal elastic logarithmic strains of the last finished step.
    pub fn elastic_strain(&self, p: usize) -> [f64; 3] {
        Spectrum::of(&self.elastic_excess[p]).values.map(|e| 0.5 * ln_1p(e))
    }

    /// Appends a point at rest and unstrained. `half_length` is that of its rectangular domain.
    pub fn push_unstrained(
        &mut self,
        id: u64,
        body: u32,
        position: [f64; D],
        volume: f64,
        density: f64,
        half_length: [f64; D],
    ) {
        self.id.push(id);
        self.body.push(body);
        self.position.push(position);
        self.position_initial.push(position);
        self.volume_initial.push(volume);
        self.mass.push(density * volume);
        self.velocity.push([0.0; D]);
        self.acceleration.push([0.0; D]);
        if self.affine {
            self.velocity_gradient.push([[0.0; D]; D]);
            self.spread.push([0.0; D]);
        }
        if self.counts_anew {
            self.displacement_start.push(position);
        }
        self.deformation_gradient.push(Matrix3::identity());
        self.elastic_excess.push(Matrix3::zeros());
        self.kirchhoff_stress.push(Matrix3::zeros());
        self.plastic_strain.push(0.0);
        self.dissipation.push(0.0);
        self.half_length.push(half_length);
        self.half_length_initial.push(half_length);
        self.point_force.push([0.0; D]);
        self.outermost.push(0.0);
        if !self.cornerless {
            self.corners.push(rectangle_corners(position, half_length));
        }
    }
}

/// Corners of an axis-aligned domain: 2D counter-clockwise from (-,-), 3D in hex8 order.
pub fn rectangle_corners<const D: usize>(x: [f64; D], half: [f64; D]) -> [[f64; D]; 8] {
    let mut corners = [[0.0; D]; 8];
    for (corner, sign) in corners.iter_mut().zip(&CORNER_SIGNS).take(1 << D) {
        for axis in 0..D {
            corner[axis] = x[axis] + sign[axis] * half[axis];
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_without_corners_travel_like_the_others() {
        for basis in [Basis::Gimp, Basis::Cpdi2] {
            let mut points = Points::<2>::of_basis(basis);
            for k in 0..3 {
                points.push_unstrained(k, 0, [k as f64, 0.0], 1.0, 2.0, [0.5; 2]);
            }
            let carried = if basis == Basis::Gimp { 0 } else { 3 };
            assert_eq!(points.corners.len(), carried);
            let mut record = Vec::new();
            points.pack(1, &mut record);
            assert_eq!(record.len(), points.record_words());
            let mut field = Vec::new();
            assert!(points.field_of("corners", 2, &mut field));
            assert_eq!(field.len(), 16);

            let mut other = Points::<2>::of_basis(basis);
            other.reserve(1);
            other.unpack(&record);
            points.select(&[2, 1]);
            assert_eq!((other.position[0], points.position[1]), ([1.0, 0.0], [1.0, 0.0]));
            assert_eq!(
                (points.corners.len(), other.corners.len()),
                (carried.min(2), carried.min(1))
            );
            if basis == Basis::Cpdi2 {
                assert_eq!(points.corners[1], other.corners[0]);
            }
            points.shed(Basis::Mpm);
            assert!(points.corners.is_empty());
        }
    }

    /// A step that fails after the points have responded gives their state back.
    #[test]
    fn state_comes_back() {
        let mut points = Points::<2>::of_basis(Basis::Mpm);
        for k in 0..3 {
            points.push_unstrained(k, 0, [k as f64, 0.5], 1.0, 2.0, [0.5; 2]);
        }
        points.state = Named::zeros(vec![vec!["hardening".to_string()]], 3);
        points.state.values = vec![0.1, 0.2, 0.3];
        let mut before = Snapshot::default();
        for _ in 0..2 {
            before.begin();
            before.state.set_aside(&mut points.state.values);
            points.state.set(1, &[0.9]);
            before.restore(&mut points);
            assert_eq!(points.state.values, [0.1, 0.2, 0.3]);
        }
    }

    #[test]
    fn what_a_step_overwrote_comes_back() {
        let mut points = Points::<2>::of_basis(Basis::Gimp);
        for k in 0..3 {
            points.push_unstrained(k, 0, [k as f64, 0.5], 1.0, 2.0, [0.5; 2]);
        }
        let mut before = Snapshot::default();
        // The second step has more points, the third fewer.
        for count in [3, 4, 2] {
            points.truncate(count);
            while points.len() < count {
                points.push_unstrained(7, 0, [9.0, 0.5], 1.0, 2.0, [0.5; 2]);
            }
            before.begin();
            let (position, velocity) = (points.position.clone(), points.velocity.clone());
            before.position.set_aside(&mut points.position);
            for (new, old) in points.position.iter_mut().zip(before.position.values()) {
                *new = old.map(|x| x + 1.0);
            }
            assert_eq!(points.position[1], position[1].map(|x| x + 1.0));
            before.velocity.replace(&mut points.velocity, vec![[4.0; 2]; count]);
            before.restore(&mut points);
            assert_eq!((&points.position, &points.velocity), (&position, &velocity));
            // A step that fails before it overwrites anything leaves the points alone.
            before.begin();
            before.restore(&mut points);
            assert_eq!((&points.position, &points.velocity), (&position, &velocity));
        }
    }
}
