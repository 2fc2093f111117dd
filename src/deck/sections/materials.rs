//! `[material.NAME]`: the parameters of a model as the model declares them.

use super::bodies::finite_sums;
use crate::deck::expression::{Expression, Scope};
use crate::deck::model::{Analysis, AnalysisType, Material};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::schema::materials::{models, readers};
use crate::deck::schema::quoted;
use crate::material::parameter::Absence;
use crate::material::{CATALOGUE, Entry, Parameter};

/// All materials of the deck.
pub fn materials(root: &Table<'_>, analysis: Option<&Analysis>) -> Got<Vec<Material>> {
    let materials = root.named("material", |name, table| material(name, &table, analysis))?;
    if materials.is_empty() {
        return Err(root.missing("material", "expected a [material.NAME]"));
    }
    Ok(materials)
}

fn material(name: &str, table: &Table<'_>, analysis: Option<&Analysis>) -> Got<Material> {
    let model = &CATALOGUE[table.choice_of("model", models())?];
    let foreign = refuse_foreign(table, model);
    let alternatives = one_of_each(table, model);
    let parameters = parameters(table, model);
    foreign?;
    alternatives?;
    let material = Material { name: name.to_string(), model, parameters: parameters?, cell: 0.0 };
    let values = material.values(&Scope::default());
    if !material.varies() {
        check_stiffness(table, model, &values, analysis)?;
    }
    // What varies is judged at the points.
    if !material.varies()
        && let Err(misfit) = (model.check)(&values)
    {
        return Err(match misfit.key.split_once('.') {
            Some((inner, key)) if table.given(inner) => table
                .table(inner, |table| Err::<(), _>(table.problem(key, &misfit.why)))
                .unwrap_err(),
            _ => table.problem(misfit.key, misfit.why),
        });
    }
    Ok(material)
}

/// Reports stiffness that the analysis cannot do without.
fn check_stiffness(
    table: &Table<'_>,
    model: &Entry,
    values: &[f64],
    analysis: Option<&Analysis>,
) -> Got<()> {
    let mut known = model.parameters.iter().zip(values);
    let (Some((_, &young)), Some(analysis)) = (known.find(|(p, _)| p.key == "young"), analysis)
    else {
        return Ok(());
    };
    if !table.given("young") {
        // The model does without, or has said that it is missing.
        return Ok(());
    }
    if young == 0.0 && analysis.cfl.is_some() {
        return Err(table.problem_with_help(
            "young",
            "expected > 0 Pa: without stiffness there is no stability limit for cfl to divide",
            "give analysis.steps in place of analysis.cfl",
        ));
    }
    if young == 0.0 && analysis.kind != AnalysisType::Explicit {
        return Err(table.problem("young", "expected > 0 Pa: only explicit runs do without"));
    }
    Ok(())
}

/// Reports keys that only other models read.
fn refuse_foreign(table: &Table<'_>, model: &Entry) -> Got<()> {
    let mut result = Ok(());
    for key in table.keys().filter(|key| *key != "model" && table.given(key)) {
        let readers = readers(key);
        if !readers.contains(&model.name) {
            let which = match &readers[..] {
                [one] => format!("\"{one}\""),
                several => quoted(several),
            };
            result = Err(table.problem(key, format!("only for model = {which}")));
        }
    }
    result
}

/// Error: a group of alternatives has none or several of its keys in the deck.
fn one_of_each(table: &Table<'_>, model: &Entry) -> Got<()> {
    let mut result = Ok(());
    for (keys, why) in model.alternatives {
        if keys.iter().any(|key| table.given(key)) {
            result = result.and(table.one_of(keys).map(drop));
        } else {
            result = Err(table.missing(keys[0], why));
        }
    }
    result
}

/// One value per parameter of the model.
fn parameters(table: &Table<'_>, model: &Entry) -> Got<Vec<Option<Expression>>> {
    let read = |parameter: &Parameter| -> Got<Option<Expression>> {
        match parameter.split() {
            (None, key) => value(table, key, parameter),
            (Some(inner), key) if table.given(inner) => {
                table.table(inner, |inner| value(&inner, key, parameter))
            }
            _ => Ok(None),
        }
    };
    let all: Vec<_> = model.parameters.iter().map(read).collect();
    all.into_iter().collect()
}

/// The value of a parameter; `None` where the deck may leave it out and does.
fn value(table: &Table<'_>, key: &'static str, parameter: &Parameter) -> Got<Option<Expression>> {
    if !table.given(key) {
        return match parameter.absence {
            Absence::Means(..) => Ok(None),
            Absence::Never | Absence::WithTable(_) => Err(table.missing(key, "")),
        };
    }
    if !parameter.words.is_empty() {
        let place = table.choice_of(key, parameter.words)?;
        return Ok(Some(Expression::constant(place as f64)));
    }
    let found = table.number_or_expression(key, parameter.range)?;
    if let Some(value) = found.as_ref().and_then(Expression::as_constant) {
        finite_sums(table, key, value)?;
    }
    Ok(found)
}
