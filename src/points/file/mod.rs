//! Points from files: a table (`csv.rs`), or a VTK file of another program (`xml.rs`: .vtu and .vtp,
//! `legacy.rs`: .vtk).
//!
//! A reader makes a [`Cloud`]: places, volumes, velocities and body numbers, and what to call a row of
//! it. Everything else, the checks and the points, is here.

mod cloud;
mod csv;
mod legacy;
mod xml;

use std::f64::consts::TAU;

use crate::basis::Domain;
use crate::deck::model::{Deck, PointsFile, Symmetry};
use crate::deck::{figure, rough};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::input_file;

use super::Points;
use super::share::Share;
use cloud::Cloud;

/// By how much a GIMP domain may exceed a cell: six digits of a volume.
const SLACK: f64 = 1e-5;

/// Why a file was not taken.
enum Refusal {
    /// The system's reason: it cannot be read at all.
    Unreadable(String),
    /// What is wrong in it, and in which line, if it has lines.
    Wrong(Option<u64>, String),
}

type Got<T> = std::result::Result<T, Refusal>;

fn wrong<T>(what: impl Into<String>) -> Got<T> {
    Err(Refusal::Wrong(None, what.into()))
}

/// Reads this rank's share of the points; the domain of each is a square (cube) of its volume.
/// Returns the number of points. Errors name the file and the place in it; one of a file that
/// cannot be read names the deck's key.
pub fn read_points<const D: usize>(
    points: &mut Points<D>,
    deck: &Deck,
    index: usize,
    grid: &Grid<D>,
    file: &PointsFile,
    share: Share,
    first_id: u64,
) -> Result<u64> {
    let (path, body) = (&file.path, &deck.bodies[index]);
    let refused = |refusal: Refusal| {
        let (line, what) = match refusal {
            Refusal::Unreadable(reason) => {
                let key = format!("body.{index}.shape.points");
                let message = format!("cannot read {}: {reason}", path.display());
                return Error::Input(deck.origins.message(&key, &message));
            }
            Refusal::Wrong(Some(line), what) => (format!("{}:{line}", path.display()), what),
            Refusal::Wrong(None, what) => (path.display().to_string(), what),
        };
        Error::Input(format!("{line}: {what} (points of body \"{}\")", body.name))
    };
    let mut cloud: Cloud<D> = match file.ending().as_str() {
        "vtu" | "vtp" | "vtk" => of_vtk(file).map_err(refused)?,
        _ => csv::read(file).map_err(refused)?,
    };
    cloud.choose(file.of_body).map_err(refused)?;

    let widest = match grid {
        Grid::Lattice(lattice) if deck.method.basis.domain() == Domain::Box => {
            lattice.spacing.iter().copied().fold(f64::INFINITY, f64::min)
        }
        _ => f64::INFINITY,
    };
    let rings = deck.analysis.symmetry == Symmetry::Axisymmetric;
    let width_of = |x: &[f64; D], volume: f64| {
        let section = if rings { volume / (TAU * x[0]) } else { volume };
        section.powf(1.0 / D as f64)
    };
    for row in 0..cloud.places.len() {
        let (x, volume) = (&cloud.places[row], cloud.volumes[row]);
        let fault = |what: String| Err(refused(cloud.fault(row, what)));
        if rings && x[0] <= 0.0 {
            return fault(format!("radius {} must be positive: x is the radius", x[0]));
        }
        if volume <= 0.0 {
            return fault(format!("volume {volume} must be positive"));
        }
        let width = width_of(x, volume);
        if width > widest * (1.0 + SLACK) {
            return fault(format!(
                "volume {} is that of a domain of width {} m, expected at most the cell size {} \
                 m: with basis = \"gimp\" a domain may not be larger than a cell",
                figure(volume),
                rough(width),
                figure(widest)
            ));
        }
    }
    if let Some((first, second)) = twice(&cloud.places) {
        let what = format!(
            "a second point at {:?} m, after that of {}, whose mass would count twice",
            cloud.places[first],
            cloud.name_of(first)
        );
        return Err(refused(cloud.fault(second, what)));
    }
    for row in share.of(cloud.places.len()) {
        let (x, volume) = (cloud.places[row], cloud.volumes[row]);
        let half = [0.5 * width_of(&x, volume); D];
        let id = first_id + row as u64;
        points.push_unstrained(id, index as u32, x, volume, body.density, half);
        if let (Some(own), Some(velocity)) = (points.velocity.last_mut(), cloud.velocities.get(row))
        {
            *own = *velocity;
        }
    }
    Ok(cloud.places.len() as u64)
}

fn of_vtk<const D: usize>(file: &PointsFile) -> Got<Cloud<D>> {
    let bytes = input_file::read(&file.path, input_file::DATA);
    let bytes = bytes.map_err(|reason| Refusal::Unreadable(reason.to_string()))?;
    let data = match file.ending().as_str() {
        "vtk" => legacy::read(&bytes)?,
        _ => xml::read(&bytes)?,
    };
    Cloud::of_arrays(data, &file.names)
}

/// The first row that repeats the place of an earlier one, after that.
fn twice<const D: usize>(places: &[[f64; D]]) -> Option<(usize, usize)> {
    let mut order: Vec<usize> = (0..places.len()).collect();
    let place = |row: usize| places[row].map(|x| (x + 0.0).to_bits());
    order.sort_unstable_by_key(|&row| (place(row), row));
    let pairs = order.windows(2).filter(|pair| place(pair[0]) == place(pair[1]));
    pairs.map(|pair| (pair[0], pair[1])).min_by_key(|pair| pair.1)
}
