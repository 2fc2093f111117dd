//! Energies, momenta and work of a dynamic run, step by step, and the fault they reveal: energy
//! that grows without work means a time step over the stability limit.

use crate::error::Result;
use crate::output::restart::run_state::RunState;
use crate::output::tables::history::HistoryRow;
use crate::parallel::World;
use crate::points::Points;

use crate::transfer::affine;
use crate::transfer::update::PointEnergies;

/// Energy may exceed what was there and what work brought in by this share of their sum; the
/// explicit schemes stray by less in every stable run of the papers.
const GROWTH: f64 = 0.25;
/// From this share on a gain is reported: it is no longer the scheme's ordinary error.
const WORTH_A_WARNING: f64 = 0.05;
/// Below this share of m c^2, the energy of a strain of 1e-4, nothing is judged: bodies at rest.
const NOISE: f64 = 1e-8;
/// Nor is this multiple of v M v of the nodes that boundaries move. Their velocity is there at
/// once and strains the first cells, while the reaction, and so the work, follows from the next
/// step on. In a step below the stability limit (w dt <= 2) that strain holds v K v dt^2 / 2, at
/// most 2 v M v.
const LEAD: f64 = 2.0;

/// One state's sums over all ranks, and what the last step added.
#[derive(Debug, Clone, Default)]
pub struct Entry {
    pub kinetic: f64,
    pub strain: f64,
    pub plastic: f64,
    pub ghost: f64,
    /// Work of loads and moved boundaries over the step.
    pub work: f64,
    /// v M v of the nodes that boundaries move.
    pub driven: f64,
    /// What damping took in the step.
    pub damped: f64,
    /// GIMP domains that had grown far beyond what their points are stretched by.
    pub overgrown: f64,
    pub momentum: [f64; 3],
    /// About the origin: of the points' velocities, and of their velocity gradients with an affine
    /// transfer.
    pub angular_momentum: [f64; 3],
}

/// Sums of this rank before they are united.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepSums {
    pub energies: PointEnergies,
    pub ghost: f64,
    pub work: f64,
    pub driven: f64,
    pub damped: f64,
    /// GIMP domains put back to what their points are stretched by.
    pub overgrown: usize,
}

impl Entry {
    /// Adds up all ranks; the kinetic part and the momenta are taken from the points. Collective.
    pub fn unite<const D: usize>(world: &World, points: &Points<D>, sums: StepSums) -> Self {
        let mut kinetic = 0.0;
        let mut momentum = [0.0; 3];
        let mut angular = [0.0; 3];
        for p in 0..points.len() {
            let mut x = [0.0; 3];
            let mut carried = [0.0; 3];
            let mass = points.mass[p];
            for i in 0..D {
                let v = points.velocity[p][i];
                kinetic += 0.5 * mass * v * v;
                x[i] = points.position[p][i];
                carried[i] = mass * v;
                momentum[i] += carried[i];
            }
            angular[2] += x[0] * carried[1] - x[1] * carried[0];
            if D == 3 {
                angular[0] += x[1] * carried[2] - x[2] * carried[1];
                angular[1] += x[2] * carried[0] - x[0] * carried[2];
            }
            if points.affine {
                kinetic += mass * affine::kinetic_energy(points, p);
                let moment = affine::angular_momentum(points, p);
                for (sum, m) in angular.iter_mut().zip(moment) {
                    *sum += mass * m;
                }
            }
        }
        let StepSums { energies, ghost, work, driven, overgrown, damped } = sums;
        let all = world.sum_slice(&[
            kinetic,
            energies.strain,
            energies.plastic,
            ghost,
            work,
            driven,
            momentum[0],
            momentum[1],
            momentum[2],
            angular[0],
            angular[1],
            angular[2],
            overgrown as f64,
            damped,
        ]);
        Entry {
            kinetic: all[0],
            strain: all[1],
            plastic: all[2],
            ghost: all[3],
            work: all[4],
            driven: all[5],
            damped: all[13],
            overgrown: all[12],
            momentum: [all[6], all[7], all[8]],
            angular_momentum: [all[9], all[10], all[11]],
        }
    }

    /// Energy of the points, plastic dissipation included.
    pub fn total(&self) -> f64 {
        self.kinetic + self.strain + self.plastic
    }
}

/// Running sums of a dynamic analysis.
#[derive(Debug, Clone)]
pub struct Ledger {
    start: f64,
    /// Sum of the work, and of its magnitude.
    work: f64,
    gross_work: f64,
    /// What damping has taken.
    damped: f64,
    /// What is not judged: NOISE, or the largest LEAD so far.
    noise: f64,
}

impl Ledger {
    /// `start`: the state before the first step; `wave_energy`: Σ m c^2, J.
    pub fn new(start: &Entry, wave_energy: f64) -> Self {
        Ledger {
            start: start.total(),
            work: 0.0,
            gross_work: 0.0,
            damped: 0.0,
            noise: NOISE * wave_energy,
        }
    }

    /// Bodies have come and gone with this much energy, J.
    pub fn take_in(&mut self, energy: f64) {
        self.start += energy;
    }

    /// Writes the sums into a checkpoint.
    pub fn save(&self, state: &mut RunState) {
        for (name, value) in self.fields() {
            state.set(name, value);
        }
    }

    /// Takes the sums out of a checkpoint.
    pub fn restore(&mut self, state: &RunState) -> Result<()> {
        self.start = state.number("ledger.start")?;
        self.work = state.number("ledger.work")?;
        self.gross_work = state.number("ledger.gross_work")?;
        self.noise = state.number("ledger.noise")?;
        // Not known to the first checkpoints of this format.
        self.damped = state.number("ledger.damped").unwrap_or(0.0);
        Ok(())
    }

    fn fields(&self) -> [(&'static str, f64); 5] {
        [
            ("ledger.start", self.start),
            ("ledger.work", self.work),
            ("ledger.gross_work", self.gross_work),
            ("ledger.noise", self.noise),
            ("ledger.damped", self.damped),
        ]
    }

    /// Energy that came from nowhere up to a booked state, as a share of what was there or brought
    /// in, where that share is worth a warning.
    pub fn gain(&self, entry: &Entry) -> Option<f64> {
        let gained = entry.total() + self.damped - self.start - self.work;
        let brought = self.start + self.gross_work;
        let noise = self.noise.max(LEAD * entry.driven);
        (gained > WORTH_A_WARNING * brought + noise).then(|| gained / brought)
    }

    /// Books a step into its row. The answer names energy that came from nowhere; such a step is
    /// in the row only.
    pub fn book(&mut self, entry: &Entry, row: &mut HistoryRow) -> std::result::Result<(), String> {
        let (work, gross_work) = (self.work + entry.work, self.gross_work + entry.work.abs());
        row.energy_kinetic = entry.kinetic;
        row.energy_strain = entry.strain;
        row.energy_plastic = entry.plastic;
        row.energy_ghost = entry.ghost;
        row.work_external = work;
        let damped = self.damped + entry.damped;
        row.dissipation_damping = damped;
        row.momentum = entry.momentum;
        row.angular_momentum = entry.angular_momentum;

        let gained = entry.total() + damped - self.start - work;
        let brought = self.start + gross_work;
        let noise = self.noise.max(LEAD * entry.driven);
        if gained.is_finite() && gained <= GROWTH * brought + noise {
            (self.work, self.gross_work, self.noise) = (work, gross_work, noise);
            self.damped = damped;
            return Ok(());
        }
        Err(format!(
            "the energy has grown by {gained:.3e} J without work done on the bodies ({brought:.3e} \
             J were there or brought in)"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energy of the points is judged against what was there and what work brought in.
    #[test]
    fn a_gain_of_a_few_per_cent_is_told_before_it_ends_the_run() {
        let state = |kinetic: f64, work: f64| Entry { kinetic, work, ..Entry::default() };
        let mut ledger = Ledger::new(&state(100.0, 0.0), 0.0);
        let mut book = |entry: &Entry| {
            let booked = ledger.book(entry, &mut HistoryRow::default()).is_ok();
            (booked, ledger.gain(entry))
        };
        assert_eq!(book(&state(104.0, 0.0)), (true, None));
        let (booked, gain) = book(&state(106.0, 0.0));
        assert!(booked && (gain.expect("a warning") - 0.06).abs() < 1e-12);
        // Work of 100 J accounts for 200 J, and doubles what may be off.
        assert_eq!(book(&state(209.0, 100.0)), (true, None));
        assert!(book(&state(211.0, 0.0)).1.is_some());
        assert!(!book(&state(251.0, 0.0)).0);
    }
}
