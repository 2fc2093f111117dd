//! Operators and functions of formulas: exmex's, and what the deck adds to them.

use exmex::{BinOp, FloatOpsFactory, MakeOperators, Operator};

/// Functions of one argument. `log` is the natural logarithm, as `ln`.
pub const FUNCTIONS: [&str; 24] = [
    "abs", "acos", "acosh", "asin", "asinh", "atan", "atanh", "cbrt", "ceil", "cos", "cosh", "exp",
    "floor", "fract", "ln", "log", "log10", "log2", "signum", "sin", "sinh", "sqrt", "tan", "tanh",
];

/// Functions of two arguments; `min` and `max` take any number.
pub const BINARY_FUNCTIONS: [&str; 3] = ["atan2", "max", "min"];

/// Names that stand for numbers.
pub const CONSTANTS: [(&str, f64); 4] = [
    ("pi", std::f64::consts::PI),
    ("PI", std::f64::consts::PI),
    ("tau", std::f64::consts::TAU),
    ("e", std::f64::consts::E),
];

/// The names that `if(c, a, b)` becomes: `((c) THEN (a)) OTHERWISE (b)`.
pub const THEN: &str = "__then__";
pub const OTHERWISE: &str = "__otherwise__";

/// A quiet NaN with a payload of its own: "the condition did not hold".
const ELSE: u64 = 0x7ff8_6d70_6d5f_656c;

fn truth(value: bool) -> f64 {
    if value { 1.0 } else { 0.0 }
}

fn holds(value: f64) -> bool {
    value != 0.0 && !value.is_nan()
}

/// exmex's operators plus comparisons, logic, `atan2`, `min`, `max`, inverse hyperbolic
/// functions and the two halves of `if`. Priorities do not matter: input comes parenthesised.
#[derive(Clone, Debug)]
pub struct Operators;

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        let binary = |name: &'a str, apply: fn(f64, f64) -> f64| {
            Operator::make_bin(name, BinOp { apply, prio: -1, is_commutative: false })
        };
        let mut operators = FloatOpsFactory::<f64>::make();
        let known: Vec<&str> = operators.iter().map(|operator| operator.repr()).collect();
        let additions = [
            binary("<", |a, b| truth(a < b)),
            binary("<=", |a, b| truth(a <= b)),
            binary(">", |a, b| truth(a > b)),
            binary(">=", |a, b| truth(a >= b)),
            binary("==", |a, b| truth(a == b)),
            binary("!=", |a, b| truth(a != b)),
            binary("&&", |a, b| truth(holds(a) && holds(b))),
            binary("||", |a, b| truth(holds(a) || holds(b))),
            binary("atan2", f64::atan2),
            binary("min", f64::min),
            binary("max", f64::max),
            binary(THEN, |c, a| if holds(c) { a } else { f64::from_bits(ELSE) }),
            binary(OTHERWISE, |a, b| if a.to_bits() == ELSE { b } else { a }),
            Operator::make_unary("!", |a| truth(!holds(a))),
            Operator::make_unary("asinh", f64::asinh),
            Operator::make_unary("acosh", f64::acosh),
            Operator::make_unary("atanh", f64::atanh),
        ];
        operators.extend(additions.into_iter().filter(|o| !known.contains(&o.repr())));
        operators
    }
}
