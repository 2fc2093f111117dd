//! Figures of merit, probes, output, ranks and solvers.

use crate::deck::model::{Deck, Every, Spot};

use super::toml_text::{array, expression, expressions, inline, number, quote, vector};
use super::writer::Writer;

pub(super) fn results(w: &mut Writer<'_>, deck: &Deck) {
    for verify in &deck.verify {
        w.table("[[verify]]");
        w.line("verify", "name", quote(&verify.name));
        w.line("verify", "field", quote(&verify.field));
        let exact = match verify.exact.as_slice() {
            [one] => expression(one),
            all => expressions(all),
        };
        w.line("verify", "exact", exact);
        w.line("verify", "norm", quote(verify.norm.name()));
        w.line("verify", "scale", number(verify.scale));
    }
    for probe in &deck.probes {
        w.table("[[probe]]");
        w.line("probe", "name", quote(&probe.name));
        let body = |body: &usize| quote(&deck.bodies[*body].name);
        match &probe.spot {
            Spot::Near { place, body: of } => {
                w.line("probe", "near", vector(place));
                w.optional("probe", "body", of.as_ref().map(body));
            }
            Spot::Id(id) => w.line("probe", "id", id.to_string()),
            Spot::Mean(of) => w.line("probe", "body", body(of)),
        }
        w.line("probe", "fields", array(probe.fields.iter().map(|field| quote(field))));
    }
    w.table("[output]");
    let interval = |every: Every| match every {
        Every::Steps(steps) => steps.to_string(),
        Every::Seconds(seconds) => inline(&[("seconds", number(seconds))]),
    };
    w.line("output", "every", interval(deck.output.every));
    w.line("output", "history", interval(deck.output.history));
    w.line("output", "log", interval(deck.output.log));
    w.line("output", "fields", array(deck.output.fields.iter().map(|field| quote(field))));
    let formats = deck.output.formats.iter().map(|format| quote(format.name()));
    w.line("output", "format", array(formats));
    w.line("output", "report", deck.output.report.to_string());
    if let Some(checkpoint) = &deck.output.checkpoint {
        let mut pairs = Vec::new();
        pairs.extend(checkpoint.every.map(|steps| ("every", steps.to_string())));
        pairs.extend(checkpoint.minutes.map(|minutes| ("minutes", number(minutes))));
        pairs.push(("keep", checkpoint.keep.to_string()));
        w.line("output", "checkpoint", inline(&pairs));
    }
    w.table("[parallel]");
    w.optional("parallel", "brick", deck.parallel.brick.map(|cells| cells.to_string()));
    w.line("parallel", "initial", quote(deck.parallel.initial.name()));
    w.line("parallel", "cost", quote(deck.parallel.cost.name()));
    w.line("parallel", "rebalance_above", number(deck.parallel.rebalance_above));
    if !deck.petsc.is_empty() {
        w.table("[petsc]");
        for (name, value) in &deck.petsc {
            let value = if value.is_empty() { "true".to_string() } else { quote(value) };
            w.text.push_str(&format!("{} = {value}\n", quote(name)));
        }
    }
}
