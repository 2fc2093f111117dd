//! `probes.csv`: fields of watched points, and means over bodies, beside the rows of the history.
//!
//! A point is found once, by its initial position, and followed by its id over ranks and restarts.
//! The mean over a body is weighted by the initial volume.

use crate::deck::Deck;
use crate::deck::fields::{Field, PointField};
use crate::deck::model::{Probe, Spot};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::output::directory::{PROBES, ResultsDirectory};
use crate::output::restart::run_state::RunState;
use crate::output::tables::csv_table::{CsvTable, Mark};
use crate::output::tables::history::HistoryRow;
use crate::output::terminal::log::Log;
use crate::parallel::World;
use crate::parallel::nearest::require_near;
use crate::points::Points;

/// What a probe follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Followed {
    /// A point, by its id.
    Point(u64),
    /// All points of a body.
    Body(u32),
}

/// What each probe of the deck follows. Errors, exit code 2: a place further from all points than the
/// diagonal of a cell and half that of the point's domain; an id that no point has. Collective.
pub fn find<const D: usize>(
    world: &World,
    deck: &Deck,
    grid: &Grid<D>,
    points: &Points<D>,
) -> Result<Vec<Followed>> {
    let refuse = |index: usize, key: &str, why: &str| {
        Err(Error::Input(deck.origins.message(&format!("probe.{index}.{key}"), why)))
    };
    let mut all = Vec::new();
    for (index, probe) in deck.probes.iter().enumerate() {
        all.push(match &probe.spot {
            Spot::Mean(body) => Followed::Body(*body as u32),
            Spot::Id(id) => {
                if !world.any(points.id.contains(id)) {
                    let why = format!("no point has the id {id}: the field id tells them");
                    return refuse(index, "id", &why);
                }
                Followed::Point(*id)
            }
            Spot::Near { place, body } => {
                let of = body.map(|body| (body, deck.bodies[body].name.as_str()));
                match require_near(world, grid, points, of, place) {
                    Ok(id) => Followed::Point(id),
                    Err(why) => return refuse(index, "near", &why),
                }
            }
        });
    }
    Ok(all)
}

/// One probe: what it follows, its columns, and where its point was found last on this rank.
#[derive(Debug)]
struct Watch {
    followed: Followed,
    /// A field and one of its components.
    columns: Vec<(PointField, usize)>,
    last: usize,
}

/// The open table of a run with probes.
#[derive(Debug)]
pub struct Probes {
    watches: Vec<Watch>,
    pub table: CsvTable,
}

impl Probes {
    /// `None` for a deck without probes. `resume`: the state of the run that goes on in this
    /// directory. Nothing is written before [`CsvTable::open`].
    pub fn new(
        world: &World,
        deck: &Deck,
        followed: &[Followed],
        directory: &ResultsDirectory,
        resume: Option<&RunState>,
        log: &mut Log,
    ) -> Result<Option<Self>> {
        if deck.probes.is_empty() {
            return Ok(None);
        }
        let mut header = ["step [-]", "load_factor [-]", "time [s]"].map(String::from).to_vec();
        let mut watches = Vec::new();
        for (probe, &followed) in deck.probes.iter().zip(followed) {
            let columns = columns_of(probe, deck.dimension)?;
            header.extend(columns.iter().map(|(name, unit, ..)| format!("{name} [{unit}]")));
            let columns = columns.into_iter().map(|(_, _, field, k)| (field, k)).collect();
            watches.push(Watch { followed, columns, last: 0 });
        }
        let mut table = CsvTable::create(&directory.file(PROBES), &header)?;
        if let Some(state) = resume {
            let count = |name: &str| state.count(name).map_or(0, |n| n as usize);
            let mark =
                Mark { rows: count("recorder.probe_rows"), step: count("recorder.probe_step") };
            table.resume(mark, log, world.comm())?;
        }
        Ok(Some(Probes { watches, table }))
    }

    /// For a checkpoint.
    pub fn save(&self, state: &mut RunState) {
        let mark = self.table.mark();
        state.set_count("recorder.probe_rows", mark.rows as u64);
        state.set_count("recorder.probe_step", mark.step as u64);
    }

    /// Appends the values at the end of a step; those of a point that is not there are no numbers.
    /// Collective.
    pub fn push<const D: usize>(
        &mut self,
        world: &World,
        points: &Points<D>,
        row: &HistoryRow,
    ) -> Result<()> {
        // Of each probe the weight of its points, then its columns.
        let mut own = Vec::new();
        for watch in &mut self.watches {
            let start = own.len();
            own.resize(start + 1 + watch.columns.len(), 0.0);
            match watch.followed {
                Followed::Point(id) => {
                    if points.id.get(watch.last) != Some(&id) {
                        watch.last = points.id.iter().position(|own| *own == id).unwrap_or(0);
                    }
                    if points.id.get(watch.last) == Some(&id) {
                        watch.add(points, watch.last, 1.0, &mut own[start..]);
                    }
                }
                Followed::Body(body) => {
                    for p in (0..points.len()).filter(|&p| points.body[p] == body) {
                        watch.add(points, p, points.volume_initial[p], &mut own[start..]);
                    }
                }
            }
        }
        let sums = world.sum_slice(&own);
        let mut values = vec![row.step as f64, row.load_factor, row.time];
        let mut rest = &sums[..];
        for watch in &self.watches {
            let (one, others) = rest.split_at(1 + watch.columns.len());
            // Nothing over nothing is no number.
            values.extend(one[1..].iter().map(|value| value / one[0]));
            rest = others;
        }
        self.table.push(&values, world.comm())
    }
}

impl Watch {
    fn add<const D: usize>(&self, points: &Points<D>, p: usize, weight: f64, sums: &mut [f64]) {
        sums[0] += weight;
        let mut values = Vec::new();
        for ((field, component), sum) in self.columns.iter().zip(&mut sums[1..]) {
            values.clear();
            field.append(points, p, &mut values);
            *sum += weight * values[*component];
        }
    }
}

/// Name, unit, field and component of each column of a probe.
fn columns_of(
    probe: &Probe,
    dimension: usize,
) -> Result<Vec<(String, &'static str, PointField, usize)>> {
    let mut columns = Vec::new();
    for word in &probe.fields {
        let (field, component) = PointField::parse_selector(word)?;
        let base = format!("{}.{}", probe.name, field.name());
        let Field { unit, rank, .. } = field.facts();
        let names = rank.components(3);
        let parts = match component {
            Some(k) => k..k + 1,
            None => 0..rank.components(dimension).len(),
        };
        if parts.is_empty() {
            columns.push((base, unit, field, 0));
        } else {
            columns.extend(parts.map(|k| (format!("{base}.{}", names[k]), unit, field, k)));
        }
    }
    Ok(columns)
}
