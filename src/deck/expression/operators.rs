//! Operators and functions of formulas on plain numbers.

/// A name and what it computes from one number.
type Function = (&'static str, fn(f64) -> f64);
/// A name and what it computes from two numbers.
type Binary = (&'static str, fn(f64, f64) -> f64);

/// Functions of one argument. `log` is the natural logarithm, as `ln`.
pub const FUNCTIONS: [Function; 24] = [
    ("abs", f64::abs),
    ("acos", f64::acos),
    ("acosh", f64::acosh),
    ("asin", f64::asin),
    ("asinh", f64::asinh),
    ("atan", f64::atan),
    ("atanh", f64::atanh),
    ("cbrt", f64::cbrt),
    ("ceil", f64::ceil),
    ("cos", f64::cos),
    ("cosh", f64::cosh),
    ("exp", f64::exp),
    ("floor", f64::floor),
    ("fract", f64::fract),
    ("ln", f64::ln),
    ("log", f64::ln),
    ("log10", f64::log10),
    ("log2", f64::log2),
    ("signum", f64::signum),
    ("sin", f64::sin),
    ("sinh", f64::sinh),
    ("sqrt", f64::sqrt),
    ("tan", f64::tan),
    ("tanh", f64::tanh),
];

/// Operators of two arguments, and functions of two; `min` and `max` take any number.
pub const BINARY: [Binary; 16] = [
    ("+", |a, b| a + b),
    ("-", |a, b| a - b),
    ("*", |a, b| a * b),
    ("/", |a, b| a / b),
    ("^", f64::powf),
    ("<", |a, b| truth(a < b)),
    ("<=", |a, b| truth(a <= b)),
    (">", |a, b| truth(a > b)),
    (">=", |a, b| truth(a >= b)),
    ("==", |a, b| truth(a == b)),
    ("!=", |a, b| truth(a != b)),
    ("&&", |a, b| truth(holds(a) && holds(b))),
    ("||", |a, b| truth(holds(a) || holds(b))),
    ("atan2", f64::atan2),
    ("max", f64::max),
    ("min", f64::min),
];

/// Those of [`BINARY`] that are written as functions.
pub const BINARY_FUNCTIONS: [&str; 3] = ["atan2", "max", "min"];

/// Names that stand for numbers.
pub const CONSTANTS: [(&str, f64); 4] = [
    ("pi", std::f64::consts::PI),
    ("PI", std::f64::consts::PI),
    ("tau", std::f64::consts::TAU),
    ("e", std::f64::consts::E),
];

/// The place of a function of one argument in [`FUNCTIONS`].
pub fn function(name: &str) -> Option<usize> {
    FUNCTIONS.iter().position(|(known, _)| *known == name)
}

/// The place of an operator or function of two arguments in [`BINARY`].
pub fn binary(name: &str) -> Option<usize> {
    BINARY.iter().position(|(known, _)| *known == name)
}

pub fn truth(value: bool) -> f64 {
    if value { 1.0 } else { 0.0 }
}

pub fn holds(value: f64) -> bool {
    value != 0.0 && !value.is_nan()
}
