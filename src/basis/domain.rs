//! l_p after a step: how the domains follow the deformation (Lagrangian §6.4, eq. 32-39).
//!
//! | deck value | half length on axis i | equation |
//! |---|---|---|
//! | `none` | unchanged | |
//! | `det` | l0_i (det F)^(1/D) | 32 |
//! | `normal` | l0_i \|F_ii\| | 33 |
//! | `stretch` | l0_i U_ii, U^2 = F^T F | 34 |
//! | `corners` | half the extent of the moved side centres, scaled to the volume | 35-37 |
//! | `normal-corrected` | as `normal`, scaled to the volume | 38 |
//! | `normal-incremental` | as `normal-corrected`, from the last step with dF | 39 |
//!
//! A half length is a size: F_ii counts by its magnitude, so a half turn keeps a domain. Scaling
//! to the volume (with axisymmetry: to the area of the section) multiplies all half lengths by one factor such that their product is that of
//! the initial ones times det F. The basis `mpm` has no domain; its half length is V^(1/D)/2 of
//! the current volume whatever the rule. CPDI domains move in their own files.

use nalgebra::Matrix3;

use super::hats::spans;
use super::lattice_of;
use crate::deck::model::DomainUpdate;
use crate::error::{Error, Result};
use crate::grid::{Grid, Lattice};
use crate::points::Points;
use crate::tensor::dense;
use crate::tensor::spectral::square_root;

/// A step as the domains of the points see it.
pub struct DomainStep<'a, const D: usize> {
    /// The grid of the step, and that of the next.
    pub grids: [&'a Grid<D>; 2],
    /// dF - 1 of each point.
    pub increments: &'a [[[f64; D]; D]],
    /// Displacement of each point, m.
    pub moved: &'a [[f64; D]],
    /// Displacement, as a point sees it, of a node, m; zero where no equation lives. It is asked only
    /// for nodes in the point's own row of [`super::contract::Basis::map_points`].
    pub nodal: &'a dyn Fn(usize, usize) -> [f64; D],
    /// The points are rings: axisymmetry.
    pub rings: bool,
}

/// Half lengths of points without domains: half the side of a cube of the point's volume, or, with
/// `rings`, of a square of the section's area A = V0 det F / (2π X F_zz).
pub fn update_cubes<const D: usize>(points: &mut Points<D>, rings: bool) -> Result<usize> {
    for p in 0..points.len() {
        if rings {
            points.half_length[p] = [0.5 * points.section(p).sqrt(); D];
            continue;
        }
        let new = [0.5 * root::<D>(points.volume(p)); D];
        require_sound(points, p, DomainUpdate::None, new)?;
        points.half_length[p] = new;
    }
    Ok(0)
}

/// Half lengths of domains whose `corners` follow the deformation by themselves.
pub fn update_extents<const D: usize>(
    points: &mut Points<D>,
    corners: impl Fn(&Points<D>, usize) -> [[f64; D]; 8],
) {
    for p in 0..points.len() {
        points.half_length[p] = half_extent(&corners(points, p));
    }
}

/// Half lengths of rectangular domains by the deck's rule.
pub fn update_rectangles<const D: usize>(
    rule: DomainUpdate,
    step: &DomainStep<'_, D>,
    points: &mut Points<D>,
) -> Result<usize> {
    let mut overgrown = 0;
    if rule == DomainUpdate::NormalIncremental {
        assert_eq!(step.increments.len(), points.len(), "one increment for each point");
    }
    for p in 0..points.len() {
        let gradient = &points.deformation_gradient[p];
        let initial = &points.half_length_initial[p];
        let new = match rule {
            DomainUpdate::None => continue,
            DomainUpdate::Det => {
                let factor = root::<D>(section_determinant::<D>(gradient));
                initial.map(|l| l * factor)
            }
            DomainUpdate::Normal => scaled_by_diagonal(initial, gradient),
            DomainUpdate::Stretch => {
                let stretch = square_root(&(gradient.transpose() * gradient));
                scaled_by_diagonal(initial, &stretch)
            }
            DomainUpdate::NormalCorrected => {
                let lengths = scaled_by_diagonal(initial, gradient);
                with_product(lengths, section_determinant::<D>(gradient) * product(initial))
            }
            DomainUpdate::NormalIncremental => {
                let increment = dense::embed(&dense::plus_unit(&step.increments[p]), 1.0);
                let before = &points.half_length[p];
                let lengths = scaled_by_diagonal(before, &increment);
                with_product(lengths, increment.determinant() * product(before))
            }
            DomainUpdate::Corners => {
                let lengths =
                    extent_of_moved_sides(step.grids[0], points, p, &|node| (step.nodal)(p, node))?;
                let volume = section_determinant::<D>(gradient) * product(initial);
                let lengths = with_product(lengths, volume);
                let of_stretch = extent_of_stretched_sides(initial, gradient);
                if lengths.iter().zip(&longest(&of_stretch)).any(|(l, most)| *l > OVERGROWN * most)
                {
                    overgrown += 1;
                    with_product(of_stretch, volume)
                } else {
                    lengths
                }
            }
        };
        require_sound(points, p, rule, new)?;
        points.half_length[p] = new;
    }
    Ok(overgrown)
}

fn require_sound<const D: usize>(
    points: &Points<D>,
    p: usize,
    rule: DomainUpdate,
    lengths: [f64; D],
) -> Result<()> {
    match lengths.iter().all(|l| *l > 0.0 && l.is_finite()) {
        true => Ok(()),
        false => Err(collapsed(points, p, rule, lengths)),
    }
}

/// det F of what a domain has sides of: a ring's hoop is none.
fn section_determinant<const D: usize>(gradient: &Matrix3<f64>) -> f64 {
    match D {
        2 => dense::determinant(&dense::block::<2>(gradient)),
        _ => gradient.determinant(),
    }
}

/// Half the extent of the side centres where F takes those of the initial domain: what the rule
/// `corners` follows in steps, in one step from the start.
fn extent_of_stretched_sides<const D: usize>(
    initial: &[f64; D],
    gradient: &Matrix3<f64>,
) -> [f64; D] {
    std::array::from_fn(|i| (0..D).map(|j| gradient[(i, j)].abs() * initial[j]).fold(0.0, f64::max))
}

/// The longest of `lengths` on every axis: a domain that has turned may have exchanged them.
fn longest<const D: usize>(lengths: &[f64; D]) -> [f64; D] {
    [lengths.iter().copied().fold(0.0, f64::max); D]
}

/// A domain is put back to the stretch of its point where it has grown to more than this multiple of
/// it: displacements of nodes with hardly any mass move its corners, and the next step's functions
/// reach further to such nodes. A turn alone makes 3^(1/2) at most.
const OVERGROWN: f64 = 2.0;

fn scaled_by_diagonal<const D: usize>(lengths: &[f64; D], tensor: &Matrix3<f64>) -> [f64; D] {
    std::array::from_fn(|i| lengths[i] * tensor[(i, i)].abs())
}

/// Scales `lengths` by one factor so that their product becomes `volume`.
fn with_product<const D: usize>(lengths: [f64; D], volume: f64) -> [f64; D] {
    let factor = root::<D>(volume / product(&lengths));
    lengths.map(|l| l * factor)
}

fn product<const D: usize>(lengths: &[f64; D]) -> f64 {
    lengths.iter().product()
}

/// x^(1/D); NaN below zero.
fn root<const D: usize>(x: f64) -> f64 {
    match D {
        2 => x.sqrt(),
        _ if x < 0.0 => f64::NAN,
        _ => x.cbrt(),
    }
}

/// Eq. 35, 36: moves the corners of the domain with the grid, takes the centre of each side
/// (edges in the plane, faces in space: the mean of its corners) and returns half of the
/// centres' extent per axis.
///
/// A corner is interpolated in the overlapped cell it belongs to, so only nodes of the point's
/// own row are asked for; a corner beyond the grid moves as the nearest place on the grid's edge.
fn extent_of_moved_sides<const D: usize>(
    grid: &Grid<D>,
    points: &Points<D>,
    p: usize,
    displacement: &dyn Fn(usize) -> [f64; D],
) -> Result<[f64; D]> {
    let lattice = lattice_of(grid)?;
    let spans = spans(grid, lattice, points, p)?;
    let (x, half) = (&points.position[p], &points.half_length[p]);

    // Centres relative to the point: sides[axis][0] below, [1] above.
    let mut sides = [[[0.0; D]; 2]; D];
    let share = 1.0 / f64::from(1u32 << (D - 1));
    for corner in 0..1usize << D {
        let upper: [bool; D] = std::array::from_fn(|a| corner >> a & 1 == 1);
        let offset: [f64; D] = std::array::from_fn(|a| if upper[a] { half[a] } else { -half[a] });
        let cell = std::array::from_fn(|a| if upper[a] { spans[a].last } else { spans[a].first });
        let local = std::array::from_fn(|a| {
            (lattice.scaled(a, x[a] + offset[a]) - cell[a] as f64).clamp(0.0, 1.0)
        });
        let moved = interpolate(lattice, cell, local, displacement);
        for axis in 0..D {
            let centre = &mut sides[axis][usize::from(upper[axis])];
            for i in 0..D {
                centre[i] += share * (offset[i] + moved[i]);
            }
        }
    }
    Ok(std::array::from_fn(|i| {
        let places = || sides.iter().flatten().map(|centre| centre[i]);
        0.5 * (places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min))
    }))
}

/// Displacement at `local` in [0, 1]^D of the cell with index `low`.
fn interpolate<const D: usize>(
    lattice: &Lattice<D>,
    low: [usize; D],
    local: [f64; D],
    displacement: &dyn Fn(usize) -> [f64; D],
) -> [f64; D] {
    let mut sum = [0.0; D];
    for corner in 0..1usize << D {
        let upper: [usize; D] = std::array::from_fn(|a| corner >> a & 1);
        let weight = (0..D).fold(1.0, |product, a| {
            product * if upper[a] == 1 { local[a] } else { 1.0 - local[a] }
        });
        let node = lattice.node_at(std::array::from_fn(|a| low[a] + upper[a]));
        let value = displacement(node);
        for i in 0..D {
            sum[i] += weight * value[i];
        }
    }
    sum
}

fn collapsed<const D: usize>(
    points: &Points<D>,
    p: usize,
    rule: DomainUpdate,
    lengths: [f64; D],
) -> Error {
    let gradient = &points.deformation_gradient[p];
    let diagonal: [f64; D] = std::array::from_fn(|i| gradient[(i, i)]);
    let advice = match rule {
        DomainUpdate::Corners | DomainUpdate::Stretch | DomainUpdate::None => {
            "the deformation itself is not valid: try smaller steps"
        }
        _ => "method.domain_update = \"corners\" or \"stretch\" stays valid under rotation",
    };
    Error::Run(format!(
        "point {} at {:?} m: its domain got half lengths {lengths:?} m from det F = {:e} and \
         diagonal F = {diagonal:?}; {advice}",
        points.id[p],
        points.position[p],
        gradient.determinant(),
    ))
}

/// Half the extent of a CPDI domain along each axis, for extents of bodies only.
fn half_extent<const D: usize>(corners: &[[f64; D]; 8]) -> [f64; D] {
    std::array::from_fn(|axis| {
        let along = || corners[..1 << D].iter().map(|x| x[axis]);
        0.5 * (along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min))
    })
}

#[cfg(test)]
#[path = "domain_tests.rs"]
mod tests;
