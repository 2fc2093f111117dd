//! Where elements of bodies' surfaces are that points carry, how large they are, and which nodes move them.

use crate::grid::Grid;
use crate::loads::OnSurface;
use crate::points::Points;
use crate::surface::Carried;
use crate::tensor::dense;

use super::model::Model;

/// Weights up to this are those of round-off.
const NO_WEIGHT: f64 = 1e-12;

/// This rank's points that carry elements of any surface of the deck.
pub fn carriers<const D: usize>(model: &Model<D>, points: &Points<D>) -> Vec<usize> {
    if !model.acts_on_surfaces() {
        return Vec::new();
    }
    let surfaces = || {
        let loads = model.loads.iter().filter_map(|load| load.on_surface());
        let of_loads = loads.map(|load| match load {
            OnSurface::Traction { surface, .. } | OnSurface::Pressure { surface, .. } => surface,
        });
        of_loads.chain(model.supports.iter().map(|support| &support.surface))
    };
    let carries = |&p: &usize| surfaces().any(|s| !s.carried_by(points.id[p]).is_empty());
    (0..points.len()).filter(carries).collect()
}

/// F of a point in the axes of the grid.
fn in_space<const D: usize>(points: &Points<D>, p: usize) -> dense::Square<D> {
    let gradient = &points.deformation_gradient[p];
    std::array::from_fn(|i| std::array::from_fn(|j| gradient[(i, j)]))
}

/// x_s = x_p + F (X_s - X_p)
pub fn place_of<const D: usize>(points: &Points<D>, p: usize, own: &Carried<D>) -> [f64; D] {
    let offset = dense::apply(&in_space(points, p), &own.offset);
    std::array::from_fn(|i| points.position[p][i] + offset[i])
}

/// Area vector of an element that is at `place` now, m2 (m in 2D). Around the axis a ring has grown with its radius.
pub fn area_of<const D: usize>(
    points: &Points<D>,
    p: usize,
    own: &Carried<D>,
    place: &[f64; D],
    rings: bool,
) -> [f64; D] {
    let area = carried_area(&in_space(points, p), &own.element.area);
    if rings { area.map(|a| a * place[0] / own.element.place[0]) } else { area }
}

/// The grid's functions N(x) at these `nodes`, ascending; `None` where others have a weight.
pub fn grid_weights<const D: usize>(
    grid: &Grid<D>,
    x: &[f64; D],
    nodes: &[usize],
) -> Option<Vec<f64>> {
    let values = grid.interpolate(x, 0.0, None)?.values;
    let mut weights = vec![0.0; nodes.len()];
    for (&node, &weight) in values.nodes.iter().zip(&values.weights).take(values.count) {
        match nodes.binary_search(&node) {
            Ok(a) => weights[a] = weight,
            // Nodes off a face that the place lies on.
            Err(_) if weight.abs() < NO_WEIGHT => {}
            Err(_) => return None,
        }
    }
    Some(weights)
}

/// det F F^-T A (Nanson).
pub fn carried_area<const D: usize>(gradient: &dense::Square<D>, area: &[f64; D]) -> [f64; D] {
    let (inverse, determinant) = dense::inverse(gradient);
    std::array::from_fn(|i| determinant * (0..D).map(|j| inverse[j][i] * area[j]).sum::<f64>())
}
