//! Where material points start inside a cell: equal sub-cells or Gauss points.
//!
//! Quads and hexes split into n^D equal boxes of the reference cell; triangles and tetrahedra
//! into the n^D congruent-in-volume simplices that cutting parallel to the faces gives (the
//! Kuhn division of a cube, restricted to one of its simplices).

use std::sync::OnceLock;

use super::element;
use crate::deck::model::Element;

/// A material point's share of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SubCell<const D: usize> {
    /// Image of the centre of the reference sub-cell, m.
    pub position: [f64; D],
    /// Centroid, m: the centre that CPDI2's functions reproduce.
    pub centroid: [f64; D],
    /// m^D
    pub volume: f64,
    /// Domain for CPDI, m: counter-clockwise in 2D, hex8 order in 3D. A simplex repeats
    /// corners (a, b, c, c) or (a, b, c, c, d, d, d, d), which gives its linear basis exactly.
    pub corners: [[f64; D]; 8],
}

/// Splits a cell into n^D sub-cells per axis count `n` (simplices: all counts equal `n[0]`).
/// The volumes add up to the cell's to round-off.
pub fn sub_cells<const D: usize>(
    element: Element,
    nodes: &[[f64; D]],
    n: [usize; D],
    out: &mut Vec<SubCell<D>>,
) {
    if element.is_simplex() {
        simplices(element, nodes, n[0], out)
    } else {
        boxes(element, nodes, n, out)
    }
}

fn boxes<const D: usize>(
    element: Element,
    nodes: &[[f64; D]],
    n: [usize; D],
    out: &mut Vec<SubCell<D>>,
) {
    let rule = two_points::<D>();
    for flat in 0..n.iter().product() {
        let mut rest = flat;
        let index: [usize; D] = std::array::from_fn(|a| {
            let i = rest % n[a];
            rest /= n[a];
            i
        });
        // Reference sub-cell to reference cell: centre + half length * local coordinate.
        let half: [f64; D] = std::array::from_fn(|a| 1.0 / n[a] as f64);
        let place = |local: [f64; D]| -> [f64; D] {
            std::array::from_fn(|a| half[a] * ((2 * index[a] + 1) as f64 + local[a]) - 1.0)
        };
        let mut volume = 0.0;
        let mut moment = [0.0; D];
        for (local, weight) in &rule[..1 << D] {
            // x det J has degree three per axis at most, so two points are exact.
            let xi = place(*local);
            let dn = element.shape_gradients(&xi);
            let part = weight * element::determinant(&element::jacobian(nodes, &dn));
            volume += part;
            for (m, x) in moment.iter_mut().zip(element::position(element, nodes, &xi)) {
                *m += part * x;
            }
        }
        let mut corners = [[0.0; D]; 8];
        for (a, corner) in corners.iter_mut().enumerate().take(1 << D) {
            *corner = element::position(element, nodes, &place(element.reference_node(a)));
        }
        out.push(SubCell {
            position: element::position(element, nodes, &place([0.0; D])),
            centroid: moment.map(|m| m / volume),
            volume: volume * half.iter().product::<f64>(),
            corners,
        });
    }
}

/// The rule of two Gauss points per axis on a box, 2^D entries: [`gauss_rule`] without its list, for
/// every cell of a mesh.
fn two_points<const D: usize>() -> [([f64; D], f64); 8] {
    static LINE: OnceLock<Vec<(f64, f64)>> = OnceLock::new();
    let line = LINE.get_or_init(|| gauss_legendre(2));
    std::array::from_fn(|flat| {
        let pick = |a: usize| line[flat >> a & 1];
        (std::array::from_fn(|a| pick(a).0), (0..D).map(|a| pick(a).1).product())
    })
}

/// Corners of the simplices of Kuhn's division: from a cube's low corner along each order of axes.
const ORDERS: [&[[usize; 3]]; 2] =
    [&[[0, 1, 2], [1, 0, 2]], &[[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]]];

/// Integer vertices of the simplices that fill the unit cube at `low`, one per order of axes,
/// positively oriented.
pub(crate) fn kuhn_simplices<const D: usize>(
    low: [usize; D],
) -> impl Iterator<Item = [[usize; D]; 4]> {
    ORDERS[D - 2].iter().map(move |order| {
        let mut vertices = [low; 4];
        for k in 0..D {
            vertices[k + 1] = vertices[k];
            vertices[k + 1][order[k]] += 1;
        }
        let inversions = (0..D)
            .flat_map(|i| (i + 1..D).map(move |j| (i, j)))
            .filter(|&(i, j)| order[i] > order[j])
            .count();
        if inversions % 2 == 1 {
            vertices.swap(D - 1, D);
        }
        vertices
    })
}

fn simplices<const D: usize>(
    element: Element,
    nodes: &[[f64; D]],
    n: usize,
    out: &mut Vec<SubCell<D>>,
) {
    let dn = element.shape_gradients(&[0.0; D]);
    let det = element::determinant(&element::jacobian(nodes, &dn));
    let volume = det * element.reference_measure() / (n as f64).powi(D as i32);
    for flat in 0..n.pow(D as u32) {
        let mut rest = flat;
        let low: [usize; D] = std::array::from_fn(|_| {
            let i = rest % n;
            rest /= n;
            i
        });
        for vertices in kuhn_simplices(low) {
            // The parent is the simplex 0 <= ... <= y <= x <= n of the divided cube.
            if vertices[..=D].iter().any(|v| v.windows(2).any(|pair| pair[1] > pair[0])) {
                continue;
            }
            let place = |v: &[usize; D]| -> [f64; D] {
                let barycentric: [f64; D] = std::array::from_fn(|a| {
                    (v[a] - v.get(a + 1).copied().unwrap_or(0)) as f64 / n as f64
                });
                element::position(element, nodes, &barycentric)
            };
            let x: Vec<[f64; D]> = vertices[..=D].iter().map(place).collect();
            let mut corners = [[0.0; D]; 8];
            let pattern: &[usize] = if D == 2 { &[0, 1, 2, 2] } else { &[0, 1, 2, 2, 3, 3, 3, 3] };
            for (corner, &vertex) in corners.iter_mut().zip(pattern) {
                *corner = x[vertex];
            }
            let position =
                std::array::from_fn(|a| x.iter().map(|x| x[a]).sum::<f64>() / (D as f64 + 1.0));
            out.push(SubCell { position, centroid: position, volume, corners });
        }
    }
}

/// Points and weights on the reference cell; the weights add up to its measure.
///
/// | element | `n` = 1, 2, 3, m | exact for degree |
/// |---|---|---|
/// | quad4, hex8 | n^D Gauss-Legendre, any n | 2n - 1 per axis |
/// | tri3 | 1, 3, 6 points; above: as 3 | 1, 2, 4 |
/// | tet4 | 1, 4, 14 points; above: as 3 | 1, 2, 5 |
pub fn gauss_rule<const D: usize>(element: Element, n: usize) -> Vec<([f64; D], f64)> {
    if !element.is_simplex() {
        let line = gauss_legendre(n);
        return (0..n.pow(D as u32))
            .map(|flat| {
                let pick = |a: usize| line[flat / n.pow(a as u32) % n];
                (std::array::from_fn(|a| pick(a).0), (0..D).map(|a| pick(a).1).product())
            })
            .collect();
    }
    // (multiplicity pattern, weight): barycentric coordinates are permuted.
    let orbits: &[(Orbit, f64)] = match (D, n) {
        (_, 0 | 1) => &[(Orbit::Centre, 1.0)],
        (2, 2) => &[(Orbit::Corner(1.0 / 6.0), 1.0 / 3.0)],
        (2, _) => &[
            (Orbit::Corner(0.445_948_490_915_964_9), 0.223_381_589_678_011_47),
            (Orbit::Corner(0.091_576_213_509_770_74), 0.109_951_743_655_321_87),
        ],
        (_, 2) => &[(Orbit::Corner(0.138_196_601_125_010_5), 0.25)],
        (_, _) => &[
            (Orbit::Corner(0.310_885_919_263_300_6), 0.112_687_925_718_015_85),
            (Orbit::Corner(0.092_735_250_310_891_23), 0.073_493_043_116_361_95),
            (Orbit::Edge(0.045_503_704_125_649_65), 0.042_546_020_777_081_466),
        ],
    };
    let mut rule = Vec::new();
    for &(orbit, weight) in orbits {
        let weight = weight * element.reference_measure();
        match orbit {
            Orbit::Centre => rule.push((element.reference_centre(), weight)),
            Orbit::Corner(a) => {
                let special = 1.0 - D as f64 * a;
                // Entry 0 of the barycentric coordinates is the dependent one.
                for corner in 0..=D {
                    let xi = std::array::from_fn(|i| if i + 1 == corner { special } else { a });
                    rule.push((xi, weight));
                }
            }
            Orbit::Edge(a) => {
                for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                    let on = |k: usize| k + 1 == i || k + 1 == j;
                    rule.push((std::array::from_fn(|k| if on(k) { a } else { 0.5 - a }), weight));
                }
            }
        }
    }
    rule
}

#[derive(Clone, Copy)]
enum Orbit {
    Centre,
    /// All barycentric coordinates equal but one.
    Corner(f64),
    /// Two and two equal (tetrahedra).
    Edge(f64),
}

/// Gauss-Legendre abscissae (ascending) and weights on [-1, 1]; error of a few round-offs.
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let mut rule: Vec<(f64, f64)> = (0..n)
        .map(|i| {
            let mut x = -((i as f64 + 0.75) / (n as f64 + 0.5) * std::f64::consts::PI).cos();
            let mut slope = 1.0;
            for _ in 0..20 {
                // Recurrence (k+1) P_k+1 = (2k+1) x P_k - k P_k-1.
                let (mut p, mut before) = (x, 1.0);
                for k in 1..n {
                    let k = k as f64;
                    (p, before) = (((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0), p);
                }
                slope = n as f64 * (x * p - before) / (x * x - 1.0);
                let step = p / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect();
    if n % 2 == 1 {
        rule[n / 2].0 = 0.0;
    }
    rule
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::inverse_map::inverse_map;

    /// Integral of x^p y^q z^r over the reference simplex: p! q! r! / (p + q + r + D)!.
    fn simplex_monomial(powers: &[u32], dimension: u32) -> f64 {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        let top: f64 = powers.iter().map(|&p| factorial(p)).product();
        top / factorial(powers.iter().sum::<u32>() + dimension)
    }

    fn check_simplex<const D: usize>(element: Element, n: usize, degree: u32) {
        let rule = gauss_rule::<D>(element, n);
        for flat in 0..(degree + 1).pow(D as u32) {
            let powers: [u32; D] =
                std::array::from_fn(|a| flat / (degree + 1).pow(a as u32) % (degree + 1));
            if powers.iter().sum::<u32>() > degree {
                continue;
            }
            let monomial =
                |x: &[f64; D]| (0..D).map(|a| x[a].powi(powers[a] as i32)).product::<f64>();
            let sum: f64 = rule.iter().map(|(x, w)| w * monomial(x)).sum();
            let exact = simplex_monomial(&powers, D as u32);
            assert!((sum - exact).abs() < 1e-15, "{element:?} {n} {powers:?}: {sum} {exact}");
        }
    }

    #[test]
    fn simplex_rules_have_their_degree() {
        for (n, degree) in [(1, 1), (2, 2), (3, 4)] {
            check_simplex::<2>(Element::Tri3, n, degree);
        }
        for (n, degree) in [(1, 1), (2, 2), (3, 5)] {
            check_simplex::<3>(Element::Tet4, n, degree);
        }
    }

    #[test]
    fn gauss_legendre_has_its_degree() {
        for n in 1..9 {
            for degree in 0..2 * n as i32 {
                let sum: f64 = gauss_legendre(n).iter().map(|(x, w)| w * x.powi(degree)).sum();
                let exact = if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-14, "{n} {degree}");
            }
        }
        assert_eq!(gauss_rule::<2>(Element::Quad4, 2).len(), 4);
        assert_eq!(gauss_rule::<3>(Element::Hex8, 3).len(), 27);
    }

    /// First and zeroth moments of the sub-cells against the whole cell's.
    #[test]
    fn sub_cells_fill_the_cell() {
        let quad = [[0.1, -0.2], [2.0, 0.3], [1.7, 1.9], [-0.3, 1.2]];
        let shoelace: f64 = (0..4)
            .map(|i| quad[i][0] * quad[(i + 1) % 4][1] - quad[(i + 1) % 4][0] * quad[i][1])
            .sum();
        let mut cells = Vec::new();
        sub_cells(Element::Quad4, &quad, [3, 2], &mut cells);
        assert_eq!(cells.len(), 6);
        let volume: f64 = cells.iter().map(|c| c.volume).sum();
        assert!((volume - 0.5 * shoelace).abs() < 1e-14);
        // A bilinear map takes the sub-cell's centre to the mean of its corners.
        for cell in &cells {
            let mean = cell.corners[..4].iter().map(|c| c[0]).sum::<f64>() / 4.0;
            assert!((mean - cell.position[0]).abs() < 1e-14);
        }

        let tet = [[0.0, 0.0, 0.0], [2.0, 0.1, 0.0], [0.2, 1.5, -0.1], [0.3, 0.2, 1.1]];
        let rows = [1, 2, 3].map(|k: usize| std::array::from_fn(|a| tet[k][a] - tet[0][a]));
        let whole = element::determinant::<3>(&rows) / 6.0;
        for n in 1..5 {
            let mut cells = Vec::new();
            sub_cells(Element::Tet4, &tet, [n; 3], &mut cells);
            assert_eq!(cells.len(), n * n * n);
            let mut centroid = [0.0; 3];
            let mut volume = 0.0;
            for cell in &cells {
                let c = &cell.corners;
                let edges = [1, 2, 4].map(|k: usize| std::array::from_fn(|a| c[k][a] - c[0][a]));
                let own = element::determinant::<3>(&edges) / 6.0;
                assert!((own - cell.volume).abs() < 1e-14, "orientation or volume: {own}");
                let xi = inverse_map(Element::Tet4, &tet, &cell.position).unwrap();
                assert!(Element::Tet4.outside(&xi) < 0.0);
                volume += own;
                for (sum, x) in centroid.iter_mut().zip(&cell.position) {
                    *sum += own * x;
                }
            }
            assert!((volume - whole).abs() < 1e-14);
            for a in 0..3 {
                let exact = tet.iter().map(|x| x[a]).sum::<f64>() / 4.0;
                assert!((centroid[a] / volume - exact).abs() < 1e-14);
            }
        }
        let mut cells = Vec::new();
        sub_cells(Element::Tri3, &quad[..3], [4; 2], &mut cells);
        assert_eq!(cells.len(), 16);
    }

    #[test]
    fn hex_sub_cell_volumes_are_exact() {
        let hex: Vec<[f64; 3]> = (0..8)
            .map(|a| {
                let r = Element::Hex8.reference_node::<3>(a);
                [r[0] * (1.0 + 0.2 * r[2]), r[1] + 0.3 * r[0] * r[2], r[2] + 0.1 * r[0] * r[1]]
            })
            .collect();
        let total = |n: usize| {
            let mut cells = Vec::new();
            sub_cells(Element::Hex8, &hex, [n, 1, n + 1], &mut cells);
            cells.iter().map(|c| c.volume).sum::<f64>()
        };
        assert!((total(1) - total(4)).abs() < 1e-13);
        let fine: f64 = gauss_rule::<3>(Element::Hex8, 4)
            .iter()
            .map(|(xi, w)| w * element::gradients(Element::Hex8, &hex, xi).unwrap().1)
            .sum();
        assert!((total(2) - fine).abs() < 1e-13);
    }
}
