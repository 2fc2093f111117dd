//! The part of a deck that a continued run must share with the run it continues.
//!
//! Left out: title, output, verify, parallel, PETSc options, and how hard the solver tries
//! (tolerance, iterations, what happens on failure): these may change between the parts of a run.
//! A dynamic run may also be extended, as long as nothing in its deck is a total over the whole
//! analysis: then its time step counts, and not how many steps there are. A run of stages may be
//! extended by further ones, and by what comes with them.

use super::expression::{Expression, Variable};
use super::model::{
    AnalysisType, BodySource, Contact, Deck, Every, Grid, MeshSource, OnFailure, Output, Partner,
    RigidShape,
};
use super::resolved::resolved;
use super::stage::Presence;

/// What a continued run must share with the run it continues: of a deck with stages, with as many of
/// them as that one had.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Physics {
    /// Of the first stage alone, the first two, and so on.
    texts: Vec<String>,
}

impl Physics {
    pub fn of(deck: &Deck) -> Self {
        let first = if deck.is_staged() { 1 } else { deck.stages.len().max(1) };
        let counts = first..=deck.stages.len().max(1);
        Physics { texts: counts.map(|count| physics(&first_stages(deck, count))).collect() }
    }

    /// Adds a line that is about no stage.
    pub fn push_line(&mut self, line: &str) {
        for text in &mut self.texts {
            text.push('\n');
            text.push_str(line);
        }
    }

    /// Of the whole deck.
    pub fn whole(&self) -> &str {
        self.texts.last().map_or("", String::as_str)
    }

    /// What the `other` text is to be compared with.
    pub fn beside(&self, other: &str) -> &str {
        let stages = other.lines().filter(|line| *line == "[[stage]]").count();
        stages.checked_sub(1).and_then(|at| self.texts.get(at)).map_or(self.whole(), String::as_str)
    }
}

/// The deck without the stages from `count` on, and without what comes with those. Bodies stay where
/// others follow that do not go: points know bodies by their index. With a body go the terms that act on it.
fn first_stages(deck: &Deck, count: usize) -> Deck {
    let mut deck = deck.clone();
    if count >= deck.stages.len() {
        return deck;
    }
    let later = |presence: &Presence| presence.from.is_some_and(|from| from >= count);
    deck.stages.truncate(count);
    deck.analysis.steps = deck.stages.iter().map(|stage| stage.steps).sum();
    deck.analysis.duration = deck.stages.iter().map(|stage| stage.duration).sum();
    // A checkpoint knows the state of all contacts there are: one more makes another problem.
    let touches = |deck: &Deck, body: usize| {
        let names =
            |contact: &Contact| contact.body == body || contact.partner == Partner::Body(body);
        deck.contacts.iter().any(names)
    };
    while let Some(last) = deck.bodies.len().checked_sub(1)
        && later(&deck.bodies[last].presence)
        && !touches(&deck, last)
    {
        deck.bodies.pop();
    }
    let known = 0..deck.bodies.len();
    deck.terms.retain(|term| term.of_body().is_none_or(|body| known.contains(&body)));
    deck.boundaries.retain(|boundary| !later(&boundary.presence));
    let loads = std::mem::take(&mut deck.loads).into_iter().zip(deck.load_presence);
    (deck.loads, deck.load_presence) = loads.filter(|(_, presence)| !later(presence)).unzip();
    let bodies = deck.bodies.iter_mut().map(|body| &mut body.presence);
    let boundaries = deck.boundaries.iter_mut().map(|boundary| &mut boundary.presence);
    for presence in bodies.chain(boundaries).chain(&mut deck.load_presence) {
        presence.until = presence.until.filter(|until| *until < count);
    }
    deck
}

/// The resolved deck without what may change. Files are named without their folder, so that a
/// deck may move.
pub fn physics(deck: &Deck) -> String {
    let mut deck = deck.clone();
    deck.title.clear();
    deck.verify.clear();
    deck.probes.clear();
    deck.petsc.clear();
    deck.output = Output {
        every: Every::Steps(1),
        history: Every::Steps(1),
        log: Every::Steps(1),
        fields: Vec::new(),
        checkpoint: None,
        formats: Vec::new(),
        report: false,
    };
    let mut time_step = String::new();
    if !deck.is_staged() && may_be_extended(&deck) {
        if let (Some(steps), Some(duration)) = (deck.analysis.steps, deck.analysis.duration) {
            // 0.3/30 and 0.5/50 differ in the last bit.
            time_step = format!("time step = {:.12e} s\n", duration / steps as f64);
        }
        (deck.analysis.steps, deck.analysis.duration) = (None, None);
    }
    deck.analysis.tolerance = 0.0;
    deck.analysis.max_iterations = 0;
    deck.analysis.on_failure = OnFailure::Stop;
    deck.analysis.inverted_iterates = super::model::InvertedIterates::Reject;
    deck.analysis.tangent = super::model::Tangent::Auto;
    let name_only = |path: &mut std::path::PathBuf| {
        if let Some(name) = path.file_name() {
            *path = name.into();
        }
    };
    if let Grid::Mesh(mesh) = &mut deck.grid
        && let MeshSource::File(path) = &mut mesh.source
    {
        name_only(path);
    }
    for rigid in &mut deck.rigids {
        if let RigidShape::Solid(solid) = &mut rigid.shape {
            let mut path = solid.path.clone();
            name_only(&mut path);
            *solid = std::sync::Arc::new(solid.renamed(path));
        }
    }
    for body in &mut deck.bodies {
        match &mut body.source {
            BodySource::File(file) => name_only(&mut file.path),
            BodySource::Shape { shape, .. } => shape.rename_files(&name_only),
            BodySource::MeshCells { .. } => {}
        }
    }
    // Without Ghost there is no [ghost]; checkpoints of earlier versions say no more than that.
    let text = resolved(&deck).replacen("\nghost = \"off\"\n", "\n", 1);
    // What follows [output] is about the run, not about the problem.
    let text = text.split("\n[output]").next().unwrap_or_default().trim();
    format!("{time_step}{text}")
}

/// Whether more steps or a longer duration leave what has been computed as it is. In quasi-static
/// and conditioning runs loads and displacements are totals over all steps; in dynamics prescribed
/// displacements, rotations and formulas of s are, as s goes from 0 to 1 over the analysis.
fn may_be_extended(deck: &Deck) -> bool {
    let of_factor = |expression: &Expression| expression.depends_on(Variable::LoadFactor);
    let total = |(_, expression): &(usize, Expression)| {
        of_factor(expression) || !expression.depends_on_time()
    };
    let boundary_totals = deck
        .boundaries
        .iter()
        .any(|boundary| boundary.rotation.is_some() || boundary.displacement.iter().any(total));
    let load_totals = deck
        .loads
        .iter()
        .any(|load| load.formulas().into_iter().any(|(_, formula)| of_factor(formula)));
    let rigid_totals = deck.rigids.iter().any(|rigid| {
        let total = |value: &Expression| of_factor(value) || !value.depends_on_time();
        let motion = &rigid.motion;
        motion.displacement.iter().any(total)
            || motion.rotation.as_ref().is_some_and(|rotation| total(&rotation.degrees))
    });
    let dynamic =
        matches!(deck.analysis.kind, AnalysisType::Explicit | AnalysisType::ImplicitDynamic);
    dynamic && !boundary_totals && !load_totals && !rigid_totals
}

/// The first lines in which two such texts differ, `(first, second)`; `None` if they are equal.
pub fn difference(first: &str, second: &str) -> Option<(String, String)> {
    let (mut a, mut b) = (first.lines(), second.lines());
    loop {
        match (a.next(), b.next()) {
            (None, None) => return None,
            (x, y) if x == y => {}
            (x, y) => {
                let line = |line: Option<&str>| line.unwrap_or("(nothing)").trim().to_string();
                return Some((line(x), line(y)));
            }
        }
    }
}

/// Keys that format 1 of the checkpoints did not know, and what its programs did.
const FORMER: [(&str, &str, &str); 1] = [("[method]", "gimp_edge", "\"published\"")];

/// [`difference`] from the text in a checkpoint of format 1, whose programs wrote other keys: sections
/// must be those of `ours`, and keys that both texts have must agree. A key of `ours` alone must have
/// the value that stands for what those programs did.
pub fn difference_from_format_1(theirs: &str, ours: &str) -> Option<(String, String)> {
    let (former, now) = (entries(theirs), entries(ours));
    let line = |key: &str, value: &str| format!("{key} = {value}");
    if let Some((time_step, extended)) = time_step_of(&former, &now)
        && time_step != extended
    {
        return Some((line("time step", &time_step), line("time step", &extended)));
    }
    let sections = |entries: &[Entry]| -> Vec<String> {
        let mut names: Vec<String> = entries.iter().map(|entry| entry.section.clone()).collect();
        names.dedup();
        names.retain(|name| !name.is_empty());
        names
    };
    if let Some(found) = difference(&sections(&former).join("\n"), &sections(&now).join("\n")) {
        return Some(found);
    }
    for entry in &now {
        let same = |other: &&Entry| (&other.section, &other.key) == (&entry.section, &entry.key);
        let value = former.iter().find(same).map(|other| other.value.as_str());
        let meant = FORMER.iter().find(|(section, key, _)| {
            (*section, *key) == (entry.section.as_str(), entry.key.as_str())
        });
        if let Some(value) = value.or(meant.map(|(_, _, value)| *value))
            && value != entry.value
        {
            return Some((line(&entry.key, value), line(&entry.key, &entry.value)));
        }
    }
    None
}

/// A line `key = value` below the header `section`; headers of arrays carry their number.
struct Entry {
    section: String,
    key: String,
    value: String,
}

fn entries(text: &str) -> Vec<Entry> {
    let (mut section, mut headers, mut entries) = (String::new(), Vec::new(), Vec::new());
    for line in text.lines().map(str::trim) {
        if line.starts_with('[') && line.ends_with(']') && !line.contains('=') {
            headers.push(line);
            let before = headers.iter().filter(|header| **header == line).count();
            section =
                if line.starts_with("[[") { format!("{line} {before}") } else { line.to_string() };
        } else if let Some((key, value)) = line.split_once(" = ") {
            let [section, key, value] = [&section, key, value].map(String::from);
            entries.push(Entry { section, key, value });
        }
    }
    entries
}

/// Time steps of the two texts where `now` has one: that of format 1 follows from its steps.
fn time_step_of(former: &[Entry], now: &[Entry]) -> Option<(String, String)> {
    let told = now.iter().find(|entry| entry.key == "time step")?;
    let number = |key: &str| -> Option<f64> {
        let of_analysis = |entry: &&Entry| entry.section == "[analysis]" && entry.key == key;
        former.iter().find(of_analysis)?.value.parse().ok()
    };
    let time_step = number("duration")? / number("steps")?;
    Some((format!("{time_step:.12e} s"), told.value.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::{read, reference};
    use std::path::Path;

    fn of(sets: &[&str]) -> String {
        let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
        physics(&read(Path::new("deck.toml"), reference::EXAMPLE, &sets).unwrap())
    }

    #[test]
    fn what_a_run_may_change_is_left_out() {
        let same = [
            "title=\"other\"",
            "output.every=7",
            "output.checkpoint={every=1}",
            "analysis.tolerance=1e-6",
            "analysis.on_failure=\"cut\"",
            "parallel.brick=3",
            "petsc.log_view=true",
        ];
        assert_eq!(difference(&of(&[]), &of(&same)), None);
    }

    #[test]
    fn format_1_is_compared_by_the_keys_of_both() {
        let ours = of(&["ghost=off", "method.gimp_edge=\"published\""]);
        // Earlier programs wrote keys without effect, and had no other edge than the published one.
        let theirs = ours.replace("gimp_edge = \"published\"", "stress_update = \"usl\"");
        assert_ne!(theirs, ours);
        assert_eq!(difference_from_format_1(&theirs, &ours), None);
        let found = difference_from_format_1(&theirs, &of(&["ghost=off"]));
        let edge = |value: &str| format!("gimp_edge = \"{value}\"");
        assert_eq!(found, Some((edge("published"), edge("continued"))));
        let steps = difference_from_format_1(&theirs.replace("steps = 50", "steps = 51"), &ours);
        assert_eq!(steps, Some(("steps = 51".into(), "steps = 50".into())));
        // Ghost was off where nothing was said.
        assert!(difference_from_format_1(&theirs, &of(&[])).is_some());
    }

    #[test]
    fn a_run_may_be_extended_by_further_stages() {
        let staged = |more: &str, until: &str| {
            let text = reference::EXAMPLE.replacen("steps = 50\n", "", 1);
            let text = text.replacen("[[load]]\n", &format!("[[load]]\n{until}"), 1);
            let text = format!("{text}\n[[stage]]\nname = \"a\"\nsteps = 3\n{more}");
            Physics::of(&read(Path::new("deck.toml"), &text, &[]).unwrap())
        };
        let more =
            "[[stage]]\nname = \"b\"\nsteps = 2\n[[load]]\nbody_force = [1, 0]\nfrom = \"b\"\n";
        let (short, long) = (staged("", ""), staged(more, "until = \"b\"\n"));
        assert_ne!(short.whole(), long.whole());
        assert_eq!(difference(short.whole(), long.beside(short.whole())), None);
        // What was in the stages that are done must stay.
        let other = staged(&format!("{more}[[load]]\nbody_force = [2, 0]\n"), "");
        assert!(difference(short.whole(), other.beside(short.whole())).is_some());
        assert!(difference(long.whole(), short.beside(long.whole())).is_some());
    }

    #[test]
    fn a_stage_may_bring_a_body_with_springs_but_no_contact() {
        let staged = |more: &str| {
            let text = reference::EXAMPLE.replacen("steps = 50\n", "", 1);
            let text = text.replacen("nearest = ", "body = \"beam\", nearest = ", 1);
            let rigid =
                "[[rigid]]\nname = \"r\"\nshape = { box = { min = [0, 0], max = [1, 1] } }\n";
            let text = format!("{text}\n{rigid}[[stage]]\nname = \"a\"\nsteps = 3\n{more}");
            Physics::of(&read(Path::new("deck.toml"), &text, &[]).unwrap())
        };
        let body = "[[stage]]\nname = \"b\"\nsteps = 2\n[[body]]\nname = \"top\"\nfrom = \"b\"\n\
                    material = \"rubber\"\nshape = { box = { min = [8, 2], max = [9, 3] } }\n";
        let contact = |with: &str| format!("[[contact]]\nbetween = [\"top\", \"{with}\"]\n");
        let springs = "[[foundation]]\nbody = \"top\"\naxis = \"x\"\nstiffness = 1.0\n";
        let short = staged("");
        let long = staged(&format!("{body}{springs}"));
        assert_eq!(difference(short.whole(), long.beside(short.whole())), None);
        for with in ["r", "beam"] {
            let touching = staged(&format!("{body}{}", contact(with)));
            assert!(difference(short.whole(), touching.beside(short.whole())).is_some());
        }
    }

    #[test]
    fn what_defines_the_problem_is_compared() {
        for set in ["analysis.steps=77", "method.basis=\"mpm\"", "material.rubber.young=1.5"] {
            let (a, b) = difference(&of(&[]), &of(&[set])).expect(set);
            assert_ne!(a, b);
        }
        let (_, b) = difference(&of(&[]), &of(&["analysis.steps=77"])).unwrap();
        assert_eq!(b, "steps = 77");
    }
}
