//! When a run leaves checkpoints, which of them are kept, and how a run goes on from one.
//!
//! A time loop takes part by two calls: [`crate::record::recorder::Recorder::resumed`] before the first
//! step, and [`crate::record::recorder::Recorder::end_step`] as the last thing in every step.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::deck::model::{
    AnalysisType, BodySource, Checkpoint as Plan, Grid as GridSource, MeshSource, RigidShape,
};
use crate::deck::physics::Physics;
use crate::deck::{self, Deck};
use crate::error::{Error, Result};
use crate::input_file;
use crate::output::agreement::on_root;
use crate::output::directory::ResultsDirectory;
use crate::output::directory::{PASSED_OVER, SUPERSEDED};
use crate::output::names::{frame_of, names_in, number_of};
use crate::output::restart::checkpoint::{self, Checkpoint, Refusal, Restored};
use crate::output::restart::run_state::RunState;
use crate::output::restart::seal::checksum_of_bytes;
use crate::output::terminal::log::Log;
use crate::output::whole_file::{cannot_read, cannot_write, sync_names};
use crate::parallel::World;
use crate::parallel::signals::{self, Signal};
use crate::points::Points;

use super::step::Moment;
use crate::system::model::Model;

/// Which checkpoint a run goes on from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Restart {
    /// The newest checkpoint in the results directory.
    Last,
    File(PathBuf),
}

/// Writes checkpoints when the deck or a signal asks for them.
#[derive(Debug)]
pub struct Checkpointer {
    plan: Plan,
    directory: PathBuf,
    physics: String,
    resolved: String,
    last: Instant,
}

impl Checkpointer {
    /// `physics` as [`physics_of`] gives it.
    pub fn new(deck: &Deck, physics: &Physics, directory: &ResultsDirectory) -> Self {
        // Without a word in the deck only signals write.
        let plan = deck.output.checkpoint.unwrap_or(Plan { every: None, minutes: None, keep: 2 });
        Checkpointer {
            plan,
            directory: directory.path().to_path_buf(),
            physics: physics.whole().to_string(),
            resolved: deck::resolved(deck),
            last: Instant::now(),
        }
    }

    /// True if the deck plans checkpoints.
    pub fn planned(&self) -> bool {
        self.plan.every.is_some() || self.plan.minutes.is_some()
    }

    /// Whether to write now, and the signal that asks to stop. Collective.
    pub fn due(&self, world: &World, step: usize, moment: Moment) -> (bool, Option<Signal>) {
        let minutes = self.last.elapsed().as_secs_f64() / 60.0;
        let by_clock = world.is_root() && self.plan.minutes.is_some_and(|limit| minutes >= limit);
        let (signal, by_clock) = signals::received(world, by_clock);
        let whole = moment != Moment::PartOfStep;
        let by_step = whole && self.plan.every.is_some_and(|every| step.is_multiple_of(every));
        (by_clock || by_step, signal)
    }

    /// Writes the checkpoint of finished step `step` and removes those beyond the newest `keep`.
    /// Collective.
    pub fn write<const D: usize>(
        &mut self,
        world: &World,
        step: usize,
        model: &Model<D>,
        points: &Points<D>,
        state: &RunState,
    ) -> Result<PathBuf> {
        let path = self.directory.join(name_of(step));
        Checkpoint {
            step,
            physics: &self.physics,
            resolved: &self.resolved,
            state,
            points,
            grid: &model.grid,
            brick: model.partition.brick(),
            owners: model.partition.owners(),
        }
        .write(&path, world.comm())?;
        self.last = Instant::now();
        on_root(world.comm(), || {
            let mut known = checkpoints_in(&self.directory)?;
            known.retain(|(_, path)| !is_folder(path));
            let excess = known.len().saturating_sub(self.plan.keep);
            for (_, old) in &known[..excess] {
                fs::remove_file(old).map_err(|reason| cannot_write(old, &reason))?;
            }
            remove_superseded_in(&self.directory)
        })?;
        Ok(path)
    }

    /// Removes what the run has replaced, once it is complete. Collective.
    pub fn remove_superseded(&self, world: &World) -> Result<()> {
        on_root(world.comm(), || remove_superseded_in(&self.directory))
    }
}

/// What identifies the problem in a checkpoint: the deck's physics and a checksum of each file that it
/// takes a mesh, points or triangles from. Collective.
pub fn physics_of(world: &World, deck: &Deck) -> Result<Physics> {
    let mut physics = Physics::of(deck);
    if let GridSource::Mesh(mesh) = &deck.grid
        && let MeshSource::File(path) = &mesh.source
    {
        let sum = checksum_of_file(world, path, |reason| {
            format!("cannot read the mesh {}: {reason}", path.display())
        })?;
        physics.push_line(&format!("checksum of the mesh file = {sum:016x}"));
    }
    let mut solids = Vec::new();
    for (index, body) in deck.bodies.iter().enumerate() {
        match &body.source {
            BodySource::File(file) => {
                let sum = checksum_of_file(world, &file.path, |reason| {
                    let message = format!("cannot read {}: {reason}", file.path.display());
                    deck.origins.message(&format!("body.{index}.shape.points"), &message)
                })?;
                physics.push_line(&checksum_line(&file.path, sum));
            }
            BodySource::Shape { shape, .. } => shape.solids(&mut solids),
            BodySource::MeshCells { .. } => {}
        }
    }
    solids.extend(deck.rigids.iter().filter_map(|rigid| match &rigid.shape {
        RigidShape::Solid(solid) => Some(&**solid),
        _ => None,
    }));
    for solid in solids {
        // Every rank has read them, so that no file is opened again.
        let numbers = solid.triangles.as_flattened().as_flattened();
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_bits().to_le_bytes()).collect();
        physics.push_line(&checksum_line(&solid.path, checksum_of_bytes(&bytes)));
    }
    Ok(physics)
}

fn checksum_line(path: &Path, sum: u64) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str()).display();
    format!("checksum of {name} = {sum:016x}")
}

/// Collective. Error: it cannot be read, as `message` says with the reason.
fn checksum_of_file(
    world: &World,
    path: &Path,
    message: impl Fn(&dyn std::fmt::Display) -> String,
) -> Result<u64> {
    let mut sum = 0_u64;
    on_root(world.comm(), || {
        let bytes = input_file::read(path, input_file::DATA)
            .map_err(|reason| Error::Input(message(&reason)))?;
        sum = checksum_of_bytes(&bytes);
        Ok(())
    })?;
    let mut bytes = sum.to_le_bytes().to_vec();
    world.broadcast_bytes(0, &mut bytes);
    Ok(bytes.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte)))
}

/// Finds and reads the checkpoint that `--restart` names. `last`: the newest good one in the
/// results directory; others (damaged, not to be read, of another problem or a newer format) are
/// passed over with a word about it. Nothing is written. Collective. Errors: exit code 3.
pub fn find<const D: usize>(
    world: &World,
    physics: &Physics,
    choice: &Restart,
    out: &Path,
    log: &mut Log,
) -> Result<Restored<D>> {
    let comm = world.comm();
    let candidates = match choice {
        Restart::File(path) => vec![path.clone()],
        Restart::Last => listed(world, out)?,
    };
    let mut refused: Vec<(_, String)> = Vec::new();
    for path in &candidates {
        match checkpoint::read::<D>(path, physics, comm) {
            Ok(restored) => {
                for (_, text) in &refused {
                    log.warn(text);
                }
                if !refused.is_empty() {
                    log.warn(&format!("falling back to {}", path.display()));
                }
                return Ok(restored);
            }
            Err(refusal) => {
                let text = refusal.describe(path);
                refused.push((refusal, text));
            }
        }
    }
    let reasons: Vec<&str> = refused.iter().map(|(_, text)| text.as_str()).collect();
    let reasons = reasons.join("\n");
    let bad = |refusal: &Refusal| matches!(refusal, Refusal::Damaged(_) | Refusal::Unreadable(_));
    Err(Error::File(error_text(&match (choice, refused.is_empty()) {
        (Restart::File(_), _) if refused.iter().any(|(refusal, _)| bad(refusal)) => format!(
            "{reasons}\n    try: --restart last, which takes the newest good checkpoint of {}",
            out.display()
        ),
        (Restart::File(_), _) => reasons,
        (Restart::Last, true) => format!(
            "--restart last: {} holds no checkpoint\n    try: output.checkpoint = {{ every = 10 }} \
             in the deck, and a run without --restart",
            out.display()
        ),
        (Restart::Last, false) => format!(
            "--restart last: no checkpoint in {} can be continued:\n{reasons}",
            out.display()
        ),
    })))
}

/// A run that is made shorter has to end behind its checkpoint. Error: exit code 3.
pub fn require_later_end<const D: usize>(deck: &Deck, found: &Restored<D>) -> Result<()> {
    let analysis = &deck.analysis;
    let behind = match (analysis.steps, analysis.duration) {
        // The trials of a strength reduction follow its steps.
        (Some(_), _) if analysis.kind == AnalysisType::StrengthReduction => None,
        (Some(steps), _) => (found.step > steps).then(|| format!("analysis.steps = {steps}")),
        (None, Some(duration)) => {
            let time = found.state.number("time_steps.time").unwrap_or(0.0);
            (time > duration * (1.0 + 1e-12)).then(|| format!("analysis.duration = {duration} s"))
        }
        (None, None) => None,
    };
    match behind {
        None => Ok(()),
        Some(end) => Err(Error::File(error_text(&format!(
            "{} was written after step {}, behind the end of this deck ({end})",
            found.path.display(),
            found.step
        )))),
    }
}

fn error_text(text: &str) -> String {
    format!("{text}\nnothing was changed")
}

/// What helps when results could not be written. Collective.
pub fn advice(world: &World, out: &Path) -> String {
    let newest = listed(world, out).ok().and_then(|known| known.into_iter().next());
    let newest = newest.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy());
    let remedy = "make room (disk, quota, file-size limit) or mend the disk";
    match newest {
        Some(name) => format!("{remedy}, then go on from {name} with --restart last"),
        None => format!(
            "{remedy}, then start again with --force; output.checkpoint = {{ every = 10 }} lets a run \
             go on where it ended"
        ),
    }
}

/// True if the checkpoint lies in the results directory, which is then continued. Collective.
pub fn lies_in(world: &World, checkpoint: &Path, out: &Path) -> bool {
    let same = || {
        let folder = checkpoint.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?;
        Some(folder == fs::canonicalize(out).ok()?)
    };
    world.any(world.is_root() && same().unwrap_or(false))
}

/// Renames checkpoints of later steps than the one continued from. After a named file they belong
/// to a course of the run that is given up; the next checkpoint, or the end of the run, removes them.
/// Those that `last` has passed over may be worth something to somebody: they stay under their new
/// name.
pub fn set_later_aside(
    world: &World,
    out: &Path,
    choice: &Restart,
    used: &Path,
    step: usize,
) -> Result<()> {
    let ending = match choice {
        Restart::File(_) => SUPERSEDED,
        Restart::Last => PASSED_OVER,
    };
    on_root(world.comm(), || {
        let used = used.file_name();
        for (_, path) in checkpoints_in(out)?.into_iter().filter(|(number, _)| *number > step) {
            if path.file_name() != used {
                let mut aside = path.clone().into_os_string();
                aside.push(ending);
                fs::rename(&path, aside).map_err(|reason| cannot_write(&path, &reason))?;
            }
        }
        // Before the tables are cut: a checkpoint of rows that are gone must not come back.
        sync_names(out);
        Ok(())
    })
}

/// Renames the frames of later steps, once the series no longer name them: they would lie beside those
/// of the new course. They go with the checkpoints that were set aside.
pub fn set_later_frames_aside(world: &World, out: &Path, step: usize) -> Result<()> {
    on_root(world.comm(), || {
        for name in names_in(out)? {
            if frame_of(&name).is_some_and(|number| number > step) {
                let path = out.join(&name);
                let aside = out.join(format!("{name}{SUPERSEDED}"));
                fs::rename(&path, aside).map_err(|reason| cannot_write(&path, &reason))?;
            }
        }
        Ok(())
    })
}

fn name_of(step: usize) -> String {
    format!("checkpoint-{step:06}.h5")
}

/// Checkpoints in a directory, newest first; the same on all ranks.
fn listed(world: &World, out: &Path) -> Result<Vec<PathBuf>> {
    let mut bytes = Vec::new();
    on_root(world.comm(), || {
        let known = if out.exists() { checkpoints_in(out)? } else { Vec::new() };
        let numbers: Vec<String> = known.iter().rev().map(|(n, _)| n.to_string()).collect();
        bytes = numbers.join("\n").into_bytes();
        Ok(())
    })?;
    world.broadcast_bytes(0, &mut bytes);
    let numbers = String::from_utf8_lossy(&bytes).into_owned();
    Ok(numbers.lines().filter_map(|n| n.parse().ok()).map(|n| out.join(name_of(n))).collect())
}

/// Step and path of each finished checkpoint, in ascending order of the step.
fn checkpoints_in(folder: &Path) -> Result<Vec<(usize, PathBuf)>> {
    let mut found: Vec<(usize, PathBuf)> = entries(folder)?
        .into_iter()
        .filter_map(|name| {
            let number = number_of(&name, "checkpoint-")?;
            Some((number, folder.join(name)))
        })
        .collect();
    found.sort();
    Ok(found)
}

fn remove_superseded_in(folder: &Path) -> Result<()> {
    for old in superseded_in(folder)? {
        fs::remove_file(&old).map_err(|reason| cannot_write(&old, &reason))?;
    }
    Ok(())
}

/// Checkpoints and frames of a course that was given up.
fn superseded_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let names = names_in(folder)?;
    let paths =
        names.iter().filter(|name| name.ends_with(SUPERSEDED)).map(|name| folder.join(name));
    Ok(paths.filter(|path| !is_folder(path)).collect())
}

/// Has the name of a checkpoint, and is none.
fn is_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_dir())
}

fn entries(folder: &Path) -> Result<Vec<String>> {
    let read = || -> std::io::Result<Vec<String>> {
        let names = fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name()));
        let names: std::io::Result<Vec<_>> = names.collect();
        Ok(names?.into_iter().filter_map(|name| name.into_string().ok()).collect())
    };
    read().map_err(|reason| cannot_read(folder, &reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finished_checkpoints_are_found_in_order_and_others_are_not() {
        let folder = tempfile::tempdir().unwrap();
        for name in [
            "checkpoint-000010.h5",
            "checkpoint-000009.h5",
            "checkpoint-1000000.h5",
            "checkpoint-000011.h5.partial",
            "checkpoint-000012.h5.superseded",
            "checkpoint-13.h5",
            "points-000014.h5",
        ] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        let found = checkpoints_in(folder.path()).unwrap();
        let numbers: Vec<usize> = found.iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, [9, 10, 1_000_000]);
        assert_eq!(superseded_in(folder.path()).unwrap().len(), 1);
    }
}
