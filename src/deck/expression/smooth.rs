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
    pub(crate) fn parse(normal: &str) -> Result<Self, String> {
        if let Some(name) = without_rule(normal) {
            return Err(format!(
                "`{name}` has no derivative rule; use + - * / ^ atan2 {}",
                RULES.map(|(name, _)| name).join(" ")
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
        let mut values = [Jet::default(); Variable::ALL.len()];
        for (value, &variable) in values.iter_mut().zip(&self.variables) {
            let number = scope.value(variable);
            *value = match variable {
                Variable::InitialX => Jet::coordinate(number, 0),
                Variable::InitialY => Jet::coordinate(number, 1),
                Variable::InitialZ => Jet::coordinate(number, 2),
                _ => Jet::constant(number),
            };
        }
        let nowhere = Jet::constant(f64::NAN);
        self.flat.eval(&values[..self.variables.len()]).unwrap_or(nowhere)
    }
}

/// The first operator or function of a normal form that has no derivative everywhere.
fn without_rule(normal: &str) -> Option<String> {
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
    functions.find(|word| !smooth(word)).map(str::to_string)
}

/// The smooth ones of the deck's operators, on jets.
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
