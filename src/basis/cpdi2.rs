//! S_ip = (1/V) sum_c S_i(x_c) int N_c dV, dS_ip = (1/V) sum_c S_i(x_c) int dN_c/dx dV over the
//! quadrilateral or hexahedron with corners x_c and its (bi- or tri)linear functions N_c
//! (Rotation §2 (iv), Lagrangian footnote 6; Sadeghirad et al. 2013).
//!
//! In 2D both integrals have closed forms. Those printed by Rotation are the correct ones: with
//! x = x_0 + A xi + C eta + B xi eta, det J = A x C + (A x B) xi + (B x C) eta, the integral of
//! N_c det J is V/4 + (xi_c b + eta_c a)/24, where b = 8 A x B and a = 8 B x C are Rotation's.
//! In 3D N_c det J and dN_c/dx det J are polynomials of degree three at most in each reference
//! coordinate, so 2 x 2 x 2 Gauss points are exact.
//!
//! In 2D the area of the moved domain is det(1 + mean du/dx) times the old one: mean gradients
//! map the diagonals exactly, and the area is half their cross product. Rotation's v_p is
//! therefore [`Points::volume`]; in 3D the two differ at second order in the hexahedron's warp.

use crate::deck::model::{Element, GimpEdge};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::grid::element::{determinant, inverse, jacobian};
use crate::grid::quadrature::gauss_rule;
use crate::points::Points;

use super::corner::{Cornered, Corners, for_each_place};
use super::declaration::{Declaration, Domain};
use super::domain::DomainStep;

/// Quadrilaterals or hexahedra whose corners follow the nodes.
pub struct Cpdi2;

impl Declaration for Cpdi2 {
    const WORD: &'static str = "cpdi2";
    const DOC: &'static str =
        "quadrilateral or hexahedral domains by their corners: large distortion";
    const DOMAIN: Domain = Domain::Corners;
    const NODES: [(usize, usize); 2] = [(8, 20), (30, 90)];

    fn of_deck(_edge: GimpEdge) -> Self {
        Cpdi2
    }
}

impl<const D: usize> Cornered<D> for Cpdi2 {
    fn places(points: &Points<D>, p: usize) -> [[f64; D]; 8] {
        points.corners[p]
    }

    /// A domain with a reflex angle still integrates to valid functions and is let through.
    fn shares(points: &Points<D>, p: usize) -> Result<Corners<D>> {
        let positions = points.corners[p];
        let (weights, gradients) = sound(points, p, &positions)?;
        Ok(Corners { positions, weights, gradients })
    }

    fn check(
        step: &DomainStep<'_, D>,
        points: &Points<D>,
        p: usize,
        hint: &mut Option<usize>,
    ) -> Result<Option<[[f64; D]; 8]>> {
        moved_corners(step.grids, points, p, hint, &|node| (step.nodal)(p, node)).map(Some)
    }
}

/// Volume (area in 2D) of a domain, m^D; negative if it is inside out.
pub fn volume<const D: usize>(corners: &[[f64; D]; 8]) -> f64 {
    if D == 2 {
        return area(corners);
    }
    let nodes = &corners[..8];
    let rule = gauss_rule::<D>(Element::Hex8, 2);
    let density = |xi| determinant(&jacobian(nodes, &Element::Hex8.shape_gradients(xi)));
    rule.iter().map(|(xi, weight)| weight * density(xi)).sum()
}

/// Centroid of a domain, m: where its point belongs at the start.
pub fn centroid<const D: usize>(corners: &[[f64; D]; 8]) -> [f64; D] {
    let (weights, _, _) = integrals(corners);
    position_of(corners, &weights)
}

fn position_of<const D: usize>(corners: &[[f64; D]; 8], weights: &[f64; 8]) -> [f64; D] {
    std::array::from_fn(|a| corners.iter().zip(weights).map(|(x, w)| w * x[a]).sum())
}

/// Half the cross product of the diagonals.
fn area<const D: usize>(x: &[[f64; D]; 8]) -> f64 {
    0.5 * ((x[2][0] - x[0][0]) * (x[3][1] - x[1][1]) - (x[3][0] - x[1][0]) * (x[2][1] - x[0][1]))
}

/// Weights, gradients and volume of a domain.
fn integrals<const D: usize>(x: &[[f64; D]; 8]) -> ([f64; 8], [[f64; D]; 8], f64) {
    if D == 2 { quadrilateral(x) } else { hexahedron(x) }
}

/// Rotation §2 (iv), with its names a and b.
fn quadrilateral<const D: usize>(x: &[[f64; D]; 8]) -> ([f64; 8], [[f64; D]; 8], f64) {
    let v = area(x);
    let [p1, p2, p3, p4] = [x[0], x[1], x[2], x[3]];
    let a = (p4[0] - p1[0]) * (p2[1] - p3[1]) - (p2[0] - p3[0]) * (p4[1] - p1[1]);
    let b = (p3[0] - p4[0]) * (p1[1] - p2[1]) - (p1[0] - p2[0]) * (p3[1] - p4[1]);
    let mut weights = [0.0; 8];
    let numerators = [6.0 * v - a - b, 6.0 * v - a + b, 6.0 * v + a + b, 6.0 * v + a - b];
    for (weight, numerator) in weights.iter_mut().zip(numerators) {
        *weight = numerator / (24.0 * v);
    }
    let mut gradients = [[0.0; D]; 8];
    for corner in 0..4 {
        let (next, before) = (x[(corner + 1) % 4], x[(corner + 3) % 4]);
        gradients[corner][0] = (next[1] - before[1]) / (2.0 * v);
        gradients[corner][1] = (before[0] - next[0]) / (2.0 * v);
    }
    (weights, gradients, v)
}

fn hexahedron<const D: usize>(x: &[[f64; D]; 8]) -> ([f64; 8], [[f64; D]; 8], f64) {
    let (mut weights, mut gradients, mut volume) = ([0.0; 8], [[0.0; D]; 8], 0.0);
    for (xi, gauss) in gauss_rule::<D>(Element::Hex8, 2) {
        let dn = Element::Hex8.shape_gradients(&xi);
        let j = jacobian(x, &dn);
        let part = gauss * determinant(&j);
        // A flat place has no volume to contribute.
        let Some(inverse) = inverse(&j) else { continue };
        volume += part;
        for (c, n) in Element::Hex8.shape(&xi).iter().enumerate() {
            weights[c] += part * n;
            for (i, g) in gradients[c].iter_mut().enumerate() {
                *g += part * (0..D).map(|k| dn[c][k] * inverse[k][i]).sum::<f64>();
            }
        }
    }
    (weights.map(|w| w / volume), gradients.map(|g| g.map(|g| g / volume)), volume)
}

/// Weights and gradients of a domain of point `p`, if it has a volume.
fn sound<const D: usize>(
    points: &Points<D>,
    p: usize,
    positions: &[[f64; D]; 8],
) -> Result<([f64; 8], [[f64; D]; 8])> {
    let (weights, gradients, volume) = integrals(positions);
    if volume > 0.0 && volume.is_finite() {
        return Ok((weights, gradients));
    }
    Err(Error::Run(format!(
        "the CPDI2 domain of point {} at {:?} m is inverted: volume {volume:e} m{D}, corners \
         {:?}; try smaller steps, or basis cpdi1 or mpm for such distortion",
        points.id[p],
        points.position[p],
        &positions[..1 << D]
    )))
}

/// Where the step's nodal displacement (m, zero where no equation lives) takes the corners of point
/// `p`, m, before the mesh moves (Rotation §2 (vii)). It is asked only for nodes in the point's own
/// row. Corners that domains share stay shared up to round-off. `after`: the grid of the next step.
/// `hint`: a cell near the first corner; left at that of the last.
///
/// Errors: a corner outside the grid, or outside `after`; a domain that the step inverts.
pub fn moved_corners<const D: usize>(
    [grid, after]: [&Grid<D>; 2],
    points: &Points<D>,
    p: usize,
    hint: &mut Option<usize>,
    displacement: &dyn Fn(usize) -> [f64; D],
) -> Result<[[f64; D]; 8]> {
    let mut moved = points.corners[p];
    for_each_place(grid, points, p, &points.corners[p], hint, |corner, at| {
        for (&node, &n) in at.nodes.iter().zip(&at.weights).take(at.count) {
            let u = displacement(node);
            for (x, u) in moved[corner].iter_mut().zip(&u) {
                *x += n * u;
            }
        }
    })?;
    sound(points, p, &moved)?;
    for_each_place(after, points, p, &moved, hint, |_, _| ())?;
    Ok(moved)
}

#[cfg(test)]
#[path = "cpdi_tests.rs"]
mod tests;
