//! A formula evaluated on dual numbers: exact first and second derivatives at the cost of a few
//! evaluations, however nested the formula is.

use std::sync::Arc;

use super::jet::{Averaged, Dual, Jet, RULES, coordinate};
use super::operators::{BINARY, FUNCTIONS};
use super::program::{Operation, Program};
use super::{Scope, Variable};

/// A formula of X, Y, Z (and s, t as parameters) with its derivatives.
#[derive(Debug, Clone)]
pub struct Smooth(Arc<Program>);

/// Functions with a kink: smooth once they are averaged over a width.
const KINKED: [&str; 3] = ["max", "min", "abs"];
/// Operators of two arguments that are smooth.
const SMOOTH: [&str; 6] = ["+", "-", "*", "/", "^", "atan2"];

impl Smooth {
    /// Error: an operator or function without a rule. `averaged`: functions with a kink are allowed.
    pub(crate) fn new(program: Arc<Program>, averaged: bool) -> Result<Self, String> {
        let kinked: &[&str] = if averaged { &KINKED } else { &[] };
        if let Some(name) = without_rule(&program, kinked) {
            return Err(format!(
                "`{name}` has no derivative rule; use + - * / ^ atan2 {}",
                RULES
                    .map(|(name, _)| name)
                    .into_iter()
                    .chain(kinked.iter().copied())
                    .collect::<Vec<_>>()
                    .join(" ")
            ));
        }
        Ok(Smooth(program))
    }

    /// The value and its derivatives with respect to X, Y, Z; x, y, z, s and t count as constant.
    pub fn jet(&self, scope: &Scope) -> Jet {
        use Variable::{InitialX, InitialY, InitialZ};
        self.evaluate(scope, [InitialX, InitialY, InitialZ], [0.0; 3]).into()
    }

    /// The value and its derivatives with respect to x, y, z; all others count as constant. Functions
    /// with a kink are averaged over `reach` to either side, m.
    pub(crate) fn of_current(&self, scope: &Scope, reach: [f64; 3]) -> Dual {
        use Variable::{CurrentX, CurrentY, CurrentZ};
        self.evaluate(scope, [CurrentX, CurrentY, CurrentZ], reach)
    }

    fn evaluate(&self, scope: &Scope, axes: [Variable; 3], reach: [f64; 3]) -> Dual {
        self.0.value(&Averaged(reach), |variable| {
            let number = scope.value(variable);
            match axes.iter().position(|axis| *axis == variable) {
                Some(axis) => coordinate(number, axis),
                None => Dual::from_re(number),
            }
        })
    }
}

/// The first operator or function of a formula that has no derivative everywhere; `if` before all.
fn without_rule(program: &Program, kinked: &[&str]) -> Option<&'static str> {
    let smooth = |name: &str| {
        RULES.iter().any(|(known, _)| *known == name)
            || SMOOTH.contains(&name)
            || kinked.contains(&name)
    };
    let operations = program.operations();
    if operations.iter().any(|operation| matches!(operation, Operation::Unless(_))) {
        return Some("if");
    }
    operations.iter().find_map(|operation| {
        let name = match *operation {
            Operation::Not => "!",
            Operation::Function(place) => FUNCTIONS[place].0,
            Operation::Binary(place) => BINARY[place].0,
            _ => return None,
        };
        (!smooth(name)).then_some(name)
    })
}
