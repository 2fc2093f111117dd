//! `[ghost]`, `ghost = "off"`, and what is in force when the deck says neither.

use crate::deck::model::{AnalysisType, Ghost, GhostScaling, Mass};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::tree::Value;

/// What the deck says of the stabilisation.
pub enum Wanted {
    /// No word, or a scaling alone: the default factors.
    Default(GhostScaling),
    Off,
    Given(Ghost),
}

pub fn wanted(root: &Table<'_>) -> Got<Wanted> {
    match root.node("ghost").map(|node| (node, &node.value)) {
        Some((_, Value::String(word))) if word == "off" => return Ok(Wanted::Off),
        Some((node, Value::String(word))) => {
            return Err(root.unknown_word("ghost", word, &["off"], &node.origin));
        }
        Some((_, Value::Table(_))) | None => {}
        Some((node, _)) => {
            let message = format!("expected a table or \"off\", found {}", node.describe());
            return Err(root.problem("ghost", message));
        }
    }
    // Finite elements are whole: there is no small overlap.
    let fem = |method: Table<'_>| method.choice_of("control", &["off", "fem"]);
    if !root.given("ghost") && root.table_or_default("method", fem).is_ok_and(|at| at == 1) {
        return Ok(Wanted::Off);
    }
    root.table_or_default("ghost", |table| table_of(&table))
}

fn table_of(table: &Table<'_>) -> Got<Wanted> {
    let stiffness = table.number_if("stiffness");
    let stiffness_factor = table.number_if("stiffness_factor");
    let mass = table.number_if("mass");
    let mass_factor = table.number_if("mass_factor");
    let scaling = table.choice("scaling");
    for (value, factor) in [("stiffness", "stiffness_factor"), ("mass", "mass_factor")] {
        if table.given(value) {
            table.refuse(&[factor], &format!("{value} is given too; leave one of them out"))?;
        }
    }
    let keys = ["stiffness", "stiffness_factor", "mass", "mass_factor"];
    if !keys.iter().any(|key| table.given(key)) {
        return Ok(Wanted::Default(scaling?));
    }
    Ok(Wanted::Given(Ghost {
        stiffness: stiffness?,
        stiffness_factor: stiffness_factor?,
        mass: mass?,
        mass_factor: mass_factor?,
        scaling: scaling?,
    }))
}

impl Wanted {
    /// Whether the stiffness is stabilised in an analysis of this kind.
    pub fn stiffens(&self, kind: Option<AnalysisType>) -> bool {
        match self {
            Wanted::Default(_) => kind != Some(AnalysisType::Explicit),
            Wanted::Off => false,
            Wanted::Given(ghost) => {
                ghost.stiffness.or(ghost.stiffness_factor).is_some_and(|value| value > 0.0)
            }
        }
    }

    /// What this comes to. The lumped mass has nothing to stabilise, and quasi-static analyses
    /// have no mass matrix.
    pub fn in_force(self, kind: AnalysisType, mass: Mass) -> Option<Ghost> {
        let stiffens = self.stiffens(Some(kind));
        let scaling = match self {
            Wanted::Off => return None,
            Wanted::Given(ghost) => return Some(ghost),
            Wanted::Default(scaling) => scaling,
        };
        let weighs = match kind {
            AnalysisType::QuasiStatic
            | AnalysisType::StrengthReduction
            | AnalysisType::ElementTest => false,
            AnalysisType::Conditioning => true,
            AnalysisType::Explicit | AnalysisType::ImplicitDynamic => mass == Mass::Consistent,
        };
        (stiffens || weighs).then(|| Ghost {
            stiffness: None,
            stiffness_factor: stiffens.then_some(Ghost::STIFFNESS_FACTOR),
            mass: None,
            mass_factor: weighs.then_some(match kind {
                AnalysisType::ImplicitDynamic => Ghost::IMPLICIT_MASS_FACTOR,
                _ => Ghost::MASS_FACTOR,
            }),
            scaling,
        })
    }
}
