//! Which bodies are too thin to bend as they should.
//!
//! Linear functions bend by shearing a cell. Beside Timoshenko's beam a cantilever of `gimp` points is
//! too stiff by 5 to 7 % at two cells of thickness, 15 to 26 % at one, 1.5 to 2.3 times at a half and
//! twelve times at a fifth, as it lies on the grid (tests/mistakes.rs).

use crate::deck::model::{AnalysisType, Place, Symmetry};
use crate::deck::rough;
use crate::grid::Grid;
use crate::parallel::World;
use crate::points::Points;
use crate::system::model::Model;

use super::plan_checks::extents;

/// A body thinner than so many cells is warned of.
const THIN: f64 = 1.9;
/// A body bends rather than shears if its length is so many times its thickness.
const SLENDER: f64 = 5.0;
/// The other bodies hold a body straight, as layers of the ground do, unless it is so many times stiffer than
/// each of them.
const STIFFER: f64 = 10.0;

/// A warning of the first such body on a lattice. Collective.
pub fn warning<const D: usize>(
    world: &World,
    model: &Model<D>,
    points: &Points<D>,
) -> Option<String> {
    let Grid::Lattice(lattice) = &model.grid else { return None };
    let deck = &model.deck;
    // Rings are stiff in themselves.
    let kind = deck.analysis.kind;
    if kind == AnalysisType::Conditioning || deck.analysis.symmetry == Symmetry::Axisymmetric {
        return None;
    }
    let unit = |axis: usize| std::array::from_fn(|a| if a == axis { 1.0 } else { 0.0 });
    let spans: [_; D] = std::array::from_fn(|axis| extents(world, model, points, unit(axis)));
    let mut volumes = vec![0.0; deck.bodies.len()];
    for p in 0..points.len() {
        volumes[points.body[p] as usize] += points.volume_initial[p];
    }
    let volumes = world.sum_slice(&volumes);
    for (index, body) in deck.bodies.iter().enumerate() {
        let length: [f64; D] =
            std::array::from_fn(|axis| spans[axis][index][1] - spans[axis][index][0]);
        let longest = length.into_iter().fold(0.0, f64::max);
        if volumes[index] == 0.0 {
            // The body comes in a later stage.
            continue;
        }
        let mut others = (0..deck.bodies.len()).filter(|&other| other != index);
        if !others.all(|other| model.stiffness[index] >= STIFFER * model.stiffness[other]) {
            continue;
        }
        for axis in 0..D {
            let area: f64 = (0..D).filter(|&a| a != axis).map(|a| length[a]).product();
            let thickness = volumes[index] / area;
            let cells = thickness / lattice.spacing[axis];
            // Between walls it cannot bend that way.
            let guided = deck.boundaries.iter().any(|boundary| match boundary.place {
                Place::Side { axis: of, upper } if of == axis && boundary.may_hold(axis) => {
                    let [low, high] = spans[axis][index];
                    let gap =
                        if upper { lattice.end(axis) - high } else { low - lattice.origin[axis] };
                    gap < lattice.spacing[axis]
                }
                _ => false,
            });
            if cells < THIN && longest > SLENDER * thickness && !guided {
                return Some(format!(
                    "body \"{}\" is {} cells thick and {} m long: if it bends, it is too stiff, by some 6 % at two \
                     cells, 15 to 25 % at one, up to twice at a half, twelve times at a fifth; take a smaller h",
                    body.name,
                    rough(cells),
                    rough(longest)
                ));
            }
        }
    }
    None
}
