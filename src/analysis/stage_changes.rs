//! What changes when a stage begins: bodies come and go, displacements count anew.
//!
//! In quasi-static analyses a body goes at the start of its last stage; what it held is released over
//! that stage ([`super::release`]). In dynamics its points stay to the end of the stage.

use crate::error::{Error, Result};
use crate::parallel;
use crate::points::Points;
use crate::record::context::Run;
use crate::record::ledger::{Entry, StepSums};
use crate::system::apart::require_apart;
use crate::system::conditions::StepSpan;
use crate::system::holds;
use crate::transfer::{affine, update};

/// Brings the points to what the stage of a step holds; returns the energy that came with bodies
/// less that which went with them, J. Done twice in one stage it changes nothing the second time.
/// Collective.
pub fn enter<const D: usize>(run: &mut Run<D>, span: StepSpan) -> Result<f64> {
    let stage = span.stage;
    run.recorder.enter_stage(stage);
    let deck = &run.model.deck;
    if !deck.is_staged() {
        return Ok(0.0);
    }
    let begins = span.factor_start == 0.0;
    if begins {
        let name = &deck.stages[stage].name;
        run.recorder.log.say(&format!("stage \"{name}\" ({} of {})", stage + 1, deck.stages.len()));
    }
    if begins && deck.stages[stage].reset_displacement {
        run.points.displacement_start.clone_from(&run.points.position);
    }
    let mut gained = 0.0;
    if deck.has_passing_bodies() {
        let before = energy(run);
        let gone = remove(run, stage);
        let come = bring(run, stage)?;
        if gone || come {
            gained = energy(run) - before;
        }
    }
    if begins && stage > 0 {
        holds::take(&run.model, &mut run.points, stage);
        require_apart(run.world, &run.model, &run.points, span.start())?;
    }
    Ok(gained)
}

/// Energy of the points of all ranks, J. Collective.
fn energy<const D: usize>(run: &Run<D>) -> f64 {
    let energies = update::energies(&run.points, &run.model.materials);
    let sums = StepSums { energies, ..StepSums::default() };
    Entry::unite(run.world, &run.points, sums).total()
}

/// Number of points of each body, over all ranks. Collective.
fn counts<const D: usize>(run: &Run<D>, points: &Points<D>) -> Vec<f64> {
    let mut counts = vec![0.0; run.model.deck.bodies.len()];
    points.body.iter().for_each(|&body| counts[body as usize] += 1.0);
    run.world.sum_slice(&counts)
}

/// Takes out the bodies that are not there any more; false if there were none. Collective.
fn remove<const D: usize>(run: &mut Run<D>, stage: usize) -> bool {
    let deck = &run.model.deck;
    let at_once = deck.analysis.kind.is_static();
    let gone: Vec<bool> = deck
        .bodies
        .iter()
        .map(|body| {
            let until = body.presence.until;
            until.is_some_and(|until| until < stage || at_once && until == stage)
        })
        .collect();
    let counts = counts(run, &run.points);
    let mut any = false;
    for (index, count) in counts.into_iter().enumerate() {
        if gone[index] && count > 0.0 {
            any = true;
            let how = match at_once {
                true => ": the forces it held fall to zero over the stage",
                false => "",
            };
            let name = &run.model.deck.bodies[index].name;
            run.recorder.log.say(&format!("body \"{name}\" goes, {count} points{how}"));
        }
    }
    if any {
        let points = &mut run.points;
        let kept: Vec<usize> =
            (0..points.len()).filter(|&p| !gone[points.body[p] as usize]).collect();
        points.select(&kept);
    }
    any
}

/// Brings the bodies that come with the stage; false if none does. Collective. Error: one lies
/// outside the grid, which may have moved.
fn bring<const D: usize>(run: &mut Run<D>, stage: usize) -> Result<bool> {
    let comes = |body: usize| run.model.deck.bodies[body].presence.comes_in(stage);
    let counts = counts(run, &run.model.waiting);
    let mut any = false;
    for (index, count) in counts.into_iter().enumerate() {
        if comes(index) && count > 0.0 {
            any = true;
            let name = &run.model.deck.bodies[index].name;
            run.recorder.log.say(&format!("body \"{name}\" comes, {count} points"));
        }
    }
    if !any {
        return Ok(false);
    }
    let waiting = &run.model.waiting;
    let (coming, rest): (Vec<usize>, Vec<usize>) =
        (0..waiting.len()).partition(|&p| comes(waiting.body[p] as usize));
    let mut arrived = waiting.clone();
    arrived.select(&coming);
    if run.points.counts_anew {
        arrived.displacement_start.clone_from(&arrived.position);
    }
    let begun = affine::begin(&run.model.deck.method, &run.model.grid, &mut arrived);
    run.world.fail_together(begun)?;
    run.model.waiting.select(&rest);
    let Run { world, model, points, .. } = run;
    points.append(&arrived);
    let moved = parallel::migrate(world, &model.partition, &model.grid, points);
    moved.map_err(|error| match error {
        Error::Run(text) => Error::Input(format!("as stage {} begins {text}", stage + 1)),
        other => other,
    })?;
    // One order, whatever the ranks held before.
    let cells: Vec<usize> =
        model.grid.locate_each(points.position.iter()).map_while(|cell| cell).collect();
    let mut order: Vec<usize> = (0..cells.len().min(points.len())).collect();
    order.sort_unstable_by_key(|&p| (cells[p], points.id[p]));
    if order.len() == points.len() {
        points.select(&order);
    }
    Ok(true)
}
