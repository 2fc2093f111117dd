//! `[[verify]]`, `[output]`, `[parallel]`, `[petsc]`.

use crate::deck::choices::Choice;
use crate::deck::expression::Expression;
use crate::deck::fields::{self, FieldRank};
use crate::deck::model::{AnalysisType, Checkpoint, Every, Format, Output, Parallel, Verify};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::schema::{self, at_least};
use crate::deck::tree::Value;

pub fn verify(root: &Table<'_>, dimension: usize) -> Got<Vec<Verify>> {
    let mut names: Vec<String> = Vec::new();
    root.tables("verify", |_, table| {
        let name = table.text("name");
        let components = components(&table, dimension);
        let norm = table.choice("norm");
        let scale = table.number("scale");
        let (field, components) = components?;
        let exact = exact(&table, &field, components);
        let name = table.unique(name?, &mut names, "figure of merit")?;
        Ok(Verify { name, field, exact: exact?, norm: norm?, scale: scale? })
    })
}

/// The field and how many components are compared.
fn components(table: &Table<'_>, dimension: usize) -> Got<(String, usize)> {
    let field = table.text("field")?;
    let (base, component) = match field.split_once('.') {
        Some((base, component)) => (base, Some(component)),
        None => (field.as_str(), None),
    };
    let unknown = |word: &str, known: &[&str]| {
        Err(table.unknown_word("field", word, known, table.origin("field")))
    };
    let Some(rank) = fields::rank(base) else {
        return unknown(&field, &fields::names());
    };
    let known: Vec<String> = match rank {
        FieldRank::Integer => {
            return Err(table.problem("field", format!("\"{field}\" has no exact value")));
        }
        FieldRank::Scalar => vec![base.to_string()],
        _ => rank.components(dimension).iter().map(|c| format!("{base}.{c}")).collect(),
    };
    match (rank, component) {
        (FieldRank::Vector, None) => Ok((field, dimension)),
        _ if known.contains(&field) => Ok((field, 1)),
        _ => unknown(&field, &known.iter().map(String::as_str).collect::<Vec<_>>()),
    }
}

fn exact(table: &Table<'_>, field: &str, components: usize) -> Got<Vec<Expression>> {
    let Some(node) = table.node("exact") else { return Err(table.missing("exact", "")) };
    let found = match &node.value {
        Value::Array(items) => items.len(),
        _ => 1,
    };
    if found != components {
        let message = format!("\"{field}\" has {components} component(s), found {found} value(s)");
        return Err(table.problem("exact", message));
    }
    match &node.value {
        Value::Array(_) => table.expressions_if("exact", components).map(Option::unwrap_or_default),
        _ => Ok(table.expression_if("exact")?.into_iter().collect()),
    }
}

pub fn output(table: &Table<'_>, kind: Option<AnalysisType>) -> Got<Output> {
    let every = interval(table, "every", "output.every");
    let history = interval(table, "history", "output.history");
    let log = interval(table, "log", "output.log");
    let known = fields::names();
    let fields = table.choices("fields", &known);
    let formats = table.choices("format", Format::NAMES);
    let report = table.flag_if("report");
    let checkpoint = table.table_if("checkpoint", |t| {
        let (every, minutes, keep) = (t.count_if("every"), t.number_if("minutes"), t.count("keep"));
        if !t.given("every") && !t.given("minutes") {
            return Err(
                t.problem("", "expected \"every\" (steps), \"minutes\" (wall time) or both")
            );
        }
        Ok(Checkpoint { every: every?, minutes: minutes?, keep: keep? })
    });
    let fields = fields?.into_iter().map(|at| known[at].to_string()).collect();
    Ok(Output {
        every: every?.unwrap_or(Every::Steps(1)),
        history: history?.unwrap_or(Every::Steps(1)),
        log: log?.unwrap_or(match kind {
            Some(AnalysisType::Explicit) => Every::Seconds(1.0),
            _ => Every::Steps(1),
        }),
        fields,
        checkpoint: checkpoint?,
        formats: formats?.into_iter().map(|at| Format::SPELLINGS[at].1).collect(),
        report: report?.unwrap_or(true),
    })
}

/// A whole number of steps, or a table with seconds.
fn interval(table: &Table<'_>, key: &str, section: &str) -> Got<Option<Every>> {
    let Some(node) = table.node(key) else { return Ok(None) };
    match &node.value {
        Value::Table(_) => {
            let path = table.full(key);
            let section = schema::section(section);
            let time = Table::open(table.problems(), section, &path, node)?;
            Ok(Some(Every::Seconds(time.number("seconds")?)))
        }
        Value::Integer(_) => {
            let steps = table.number_from(key, node, at_least(1.0))?;
            Ok(Some(Every::Steps(steps as usize)))
        }
        _ => Err(table.wrong(key, node)),
    }
}

pub fn parallel(table: &Table<'_>) -> Got<Parallel> {
    let (brick, above) = (table.count_if("brick"), table.number("rebalance_above"));
    let (initial, cost) = (table.choice("initial"), table.choice("cost"));
    let above = above?;
    if above != 0.0 && above < 1.0 {
        return Err(table.problem(
            "rebalance_above",
            format!("expected 0 (never) or a number >= 1, found {above}"),
        ));
    }
    Ok(Parallel { brick: brick?, initial: initial?, cost: cost?, rebalance_above: above })
}
