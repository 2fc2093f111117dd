//! A formula evaluated on [`Jet`]s: exact first and second derivatives at the cost of a few
//! evaluations, however nested the formula is.

use exmex::{BinOp, Express, FlatEx, MakeOperators, Operator};

use super::jet::{Jet, RULES};
use super::{Scope, Variable};

/// A formula of X, Y, Z (and s, t as parameters) with its derivatives.
#[derive(Debug, Clone)]
pub struct Smooth {
    flat: FlatEx<Jet, JetOperators>,
    variables: Vec<Variable>,
}

impl Smooth {
    /// From the fully parenthesised form. Error: an operator or function without a rule.
    /// `averaged`: functions with a kink are allowed.
    pub(crate) fn parse(normal: &str, averaged: bool) -> Result<Self, String> {
        let kinked: &[&str] = if averaged { &KINKED } else { &[] };
        if let Some(name) = without_rule(normal, kinked) {
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
        let flat = FlatEx::parse(normal).map_err(|error| error.to_string())?;
        let variables = flat
            .var_names()
            .iter()
            .map(|name| Variable::from_name(name).ok_or_else(|| format!("unknown name `{name}`")))
            .collect::<Result<_, _>>()?;
        Ok(Smooth { flat, variables })
    }

    /// The value and its derivatives with respect to X, Y, Z; x, y, z, s and t count as constant.
    pub fn jet(&self, scope: &Scope) -> Jet {
        use Variable::{InitialX, InitialY, InitialZ};
        self.evaluate(scope, [InitialX, InitialY, InitialZ], [0.0; 3])
    }

    /// The value and its derivatives with respect to x, y, z; all others count as constant. Functions
    /// with a kink are averaged over `reach` to either side, m.
    pub fn jet_of_current(&self, scope: &Scope, reach: [f64; 3]) -> Jet {
        use Variable::{CurrentX, CurrentY, CurrentZ};
        self.evaluate(scope, [CurrentX, CurrentY, CurrentZ], reach)
    }

    fn evaluate(&self, scope: &Scope, axes: [Variable; 3], reach: [f64; 3]) -> Jet {
        let mut values = [Jet::default(); Variable::ALL.len()];
        for (value, &variable) in values.iter_mut().zip(&self.variables) {
            let number = scope.value(variable);
            *value = match axes.iter().position(|axis| *axis == variable) {
                Some(axis) => Jet::coordinate(number, axis).within(reach),
                None => Jet::constant(number),
            };
        }
        let nowhere = Jet::constant(f64::NAN);
        self.flat.eval(&values[..self.variables.len()]).unwrap_or(nowhere)
    }
}

/// The first operator or function of a normal form that has no derivative everywhere.
fn without_rule(normal: &str, kinked: &[&str]) -> Option<String> {
    const SYMBOLS: [&str; 9] = ["<=", ">=", "==", "!=", "<", ">", "&&", "||", "!"];
    if normal.contains(super::operators::THEN) {
        return Some("if".to_string());
    }
    if let Some(symbol) = SYMBOLS.into_iter().find(|symbol| normal.contains(symbol)) {
        return Some(symbol.to_string());
    }
    let smooth = |word: &&str| RULES.iter().any(|(name, _)| name == word) || *word == "atan2";
    let words = normal.split(|c: char| !c.is_ascii_alphanumeric());
    let mut functions = words.filter(|word| {
        word.starts_with(|c: char| c.is_ascii_alphabetic()) && Variable::from_name(word).is_none()
    });
    functions.find(|word| !smooth(word) && !kinked.contains(word)).map(str::to_string)
}

/// Functions with a kink: smooth once they are averaged over a width.
const KINKED: [&str; 3] = ["max", "min", "abs"];

/// The smooth ones of the deck's operators, and those with a kink, on jets.
#[derive(Clone, Debug)]
struct JetOperators;

impl MakeOperators<Jet> for JetOperators {
    fn make<'a>() -> Vec<Operator<'a, Jet>> {
        // Priorities do not matter: input comes parenthesised.
        let binary = |apply: fn(Jet, Jet) -> Jet| BinOp { apply, prio: 1, is_commutative: false };
        let mut operators = vec![
            Operator::make_bin_unary("-", binary(|a, b| a - b), |a| -a),
            Operator::make_bin("+", binary(|a, b| a + b)),
            Operator::make_bin("*", binary(|a, b| a * b)),
            Operator::make_bin("/", binary(|a, b| a / b)),
            Operator::make_bin("^", binary(Jet::power)),
            Operator::make_bin("atan2", binary(Jet::atan2)),
            Operator::make_bin("max", binary(Jet::max)),
            Operator::make_bin("min", binary(Jet::min)),
            Operator::make_unary("abs", Jet::abs),
        ];
        operators.extend(unary());
        operators
    }
}

/// exmex takes plain functions, so each rule needs one of its own: instance `N` applies rule `N`.
fn unary<'a>() -> Vec<Operator<'a, Jet>> {
    fn rule<const N: usize>(a: Jet) -> Jet {
        a.apply(RULES[N].1(a.value))
    }
    macro_rules! all {
        ($($n:literal)*) => { vec![$( Operator::make_unary(RULES[$n].0, rule::<$n>) ),*] };
    }
    let made = all!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18);
    debug_assert_eq!(made.len(), RULES.len());
    made
}
