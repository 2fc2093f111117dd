//! `[[stage]]`, `from` and `until`, and what stages must hold.

use crate::deck::model::{
    Analysis, AnalysisType, Body, Boundary, Contact, Held, Load, Place, Rigid, Support,
};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::stage::{Presence, Stage};

/// What has been there before the first stage comes with this one.
pub const INITIAL: &str = "initial";

/// The stages of the deck, at least one; the analysis takes their sums.
pub fn stages(root: &Table<'_>, analysis: &mut Got<Analysis>) -> Got<Vec<Stage>> {
    let names = root.names_of("stage");
    let Ok(analysis) = analysis else { return Ok(Vec::new()) };
    let stages = root.tables("stage", |index, table| stage(&table, analysis, &names, index))?;
    if stages.is_empty() {
        let Analysis { steps, duration, .. } = *analysis;
        let name = String::new();
        return Ok(vec![Stage { name, steps, duration, reset_displacement: false }]);
    }
    analysis.steps = stages.iter().map(|stage| stage.steps).sum();
    analysis.duration = stages.iter().map(|stage| stage.duration).sum();
    Ok(stages)
}

fn stage(table: &Table<'_>, analysis: &Analysis, names: &[String], index: usize) -> Got<Stage> {
    let name = &names[index];
    table.text_if("name")?;
    if name.is_empty() || name == INITIAL {
        let what = format!(
            "expected a name other than \"{INITIAL}\", which is the state before all stages"
        );
        return Err(table.problem("name", what));
    }
    if names[..index].contains(name) {
        return Err(table.problem("name", format!("another stage is called \"{name}\"")));
    }
    let (steps, duration) = (table.count_if("steps"), table.number_if("duration"));
    let reset = table.flag_if("reset_displacement");
    let (steps, duration, reset_displacement) = (steps?, duration?, reset?.unwrap_or(false));
    if analysis.kind.has_time() && duration.is_none() {
        let why = format!("analysis.type = \"{}\" needs it", analysis.kind.name());
        return Err(table.missing("duration", &why));
    }
    match (analysis.cfl, steps) {
        (Some(_), Some(_)) => {
            let why = "analysis.cfl sets the steps; leave one of them out";
            Err(table.problem("steps", why))
        }
        (None, None) => Err(table.missing("steps", "")),
        _ => Ok(Stage { name: name.clone(), steps, duration, reset_displacement }),
    }
}

/// `from` and `until` of a table; without a word it is `default`.
pub fn presence(table: &Table<'_>, stages: &[String], default: Presence) -> Got<Presence> {
    let index = |key: &str| -> Got<Option<usize>> {
        let Some(name) = table.text_if(key)? else { return Ok(None) };
        let mut known: Vec<&str> = stages.iter().map(String::as_str).collect();
        if let Some(found) = known.iter().position(|known| *known == name) {
            return Ok(Some(found));
        }
        if key == "from" {
            known.push(INITIAL);
        }
        if known.is_empty() {
            return Err(table.problem(key, "the deck has no [[stage]]"));
        }
        Err(table.unknown_word(key, &name, &known, table.origin(key)))
    };
    let initial = table.text_if("from")?.is_some_and(|name| name == INITIAL);
    let from = match (table.given("from"), initial) {
        (false, _) => default.from,
        (true, true) => None,
        (true, false) => index("from")?,
    };
    let until = index("until")?;
    let first = from.unwrap_or(0);
    if let Some(until) = until
        && until < first
    {
        let (from, until) = (&stages[first], &stages[until]);
        let what = format!("goes with stage \"{until}\", before it comes with stage \"{from}\"");
        return Err(table.problem("until", what));
    }
    let presence = Presence { from, until, ..default };
    if presence.fades && until.is_some() && from == until {
        let name = &stages[first];
        let what = format!(
            "comes and goes in stage \"{name}\": it would rise and fall at once and is never there in full"
        );
        let help = "let it come with an earlier stage, or go with a later one";
        return Err(table.problem_with_help("until", what, help));
    }
    Ok(presence)
}

/// With contact the forces of rigid bodies are part of the balance, which the release of what goes
/// does not know yet.
pub fn keeps_what_touches(
    root: &Table<'_>,
    kind: AnalysisType,
    bodies: &[Body],
    boundaries: &[Boundary],
) -> Got<()> {
    let goes = |presence: &Presence| presence.until.is_some();
    let any = bodies.iter().any(|body| goes(&body.presence))
        || boundaries.iter().any(|boundary| goes(&boundary.presence));
    if !(kind.is_static() && any) {
        return Ok(());
    }
    let what = "bodies and boundaries cannot go (until) in a quasi-static deck with contact";
    let help = "leave until out, or use analysis.type = \"explicit\"";
    Err(root.problem_with_help("contact", what, help))
}

/// The checks across sections: a stage holds something, and nothing acts on a body that is not
/// there.
pub fn check(
    root: &Table<'_>,
    kind: AnalysisType,
    stages: &[Stage],
    bodies: &[Body],
    boundaries: &[Boundary],
    (loads, presences): (&[Load], &[Presence]),
    (rigids, contacts): (&[Rigid], &[Contact]),
) -> Got<()> {
    let mut result = Ok(());
    let mut report = |section: &str, index: usize, key: &str, what: String, help: &str| {
        let reported = root.tables(section, |at, table| {
            if at != index {
                return Ok(());
            }
            Err(table.problem_with_help(key, &what, help))
        });
        result = reported.map(drop);
    };
    let quasi_static = kind.is_static();
    let changes = |stage: usize| {
        let passes =
            |presence: &Presence| presence.comes_in(stage) || presence.until == Some(stage);
        let moves = |(load, presence): (&Load, &Presence)| {
            passes(presence) || presence.is_in(stage) && load.depends_on_time()
        };
        let driven = |boundary: &Boundary| {
            let with_time = boundary.displacement.iter().any(|(_, value)| value.depends_on_time());
            passes(&boundary.presence) || boundary.presence.is_in(stage) && with_time
        };
        bodies.iter().any(|body| passes(&body.presence))
            || boundaries.iter().any(driven)
            || loads.iter().zip(presences).any(moves)
            || contacts.iter().any(|contact| passes(&contact.presence))
            || rigids.iter().any(|rigid| {
                passes(&rigid.presence)
                    || rigid.presence.is_in(stage) && rigid.motion.depends_on_time()
            })
    };
    for (index, stage) in stages.iter().enumerate() {
        let name = &stage.name;
        let there = |body: &Body| match quasi_static {
            true => body.presence.holds_in(index),
            false => body.presence.is_in(index),
        };
        if !bodies.iter().any(there) {
            let what =
                format!("stage \"{name}\" holds no body: all have gone, or have not come yet");
            report("stage", index, "", what, "see from and until of [[body]]");
        } else if quasi_static && index > 0 && !changes(index) {
            let what = format!(
                "stage \"{name}\" is empty: no body, boundary, load, rigid body or contact comes with \
                 it or goes with it, and none depends on s or t"
            );
            let help = format!("for example a [[load]] with from = \"{name}\"");
            report("stage", index, "", what, &help);
        }
    }
    let mut within = |section: &str, index: usize, own: &Presence, body: usize| {
        let Body { name, presence: of_body, .. } = &bodies[body];
        let called = |at: usize| stages[at].name.as_str();
        if let Some(from) = of_body.from
            && own.from.is_none_or(|own| own < from)
            && from > 0
        {
            let stage = called(from);
            let what = format!("acts on body \"{name}\" before that comes with stage \"{stage}\"");
            report(section, index, "", what, &format!("give it from = \"{stage}\""));
        } else if let Some(until) = of_body.until
            && own.until.is_none_or(|own| own > until)
        {
            let stage = called(until);
            let what =
                format!("acts on body \"{name}\" after that has gone with stage \"{stage}\"");
            report(section, index, "", what, &format!("give it until = \"{stage}\""));
        }
    };
    for (index, (load, presence)) in loads.iter().zip(presences).enumerate() {
        if let Some(body) = load.body() {
            within("load", index, presence, body);
        }
    }
    for (index, boundary) in boundaries.iter().enumerate() {
        match &boundary.place {
            Place::CellsOf { body } => within("boundary", index, &boundary.presence, *body),
            Place::Surface(Support { surface: Held::Surface(of), .. }) => {
                within("boundary", index, &boundary.presence, of.body);
            }
            _ => {}
        }
    }
    result
}
