//! Expressions in the deck: numbers or formulas of X, Y, Z, x, y, z, s, t.
//!
//! | file | idea |
//! |---|---|
//! | `mod.rs` | [`Expression`]: a formula and what it depends on |
//! | `grammar.rs` | the deck's grammar |
//! | `operators.rs` | operators and functions on plain numbers |
//! | `program.rs` | a formula as operations on a stack, for any kind of number |
//! | `jet.rs` | numbers that carry their first and second derivatives, and [`Jet`], what is read off them |
//! | `smooth.rs` | [`Smooth`]: a formula evaluated on these |

mod grammar;
pub(crate) mod jet;
mod operators;
mod program;
pub(crate) mod smooth;
#[cfg(test)]
mod tests;

use std::sync::Arc;

pub use grammar::vocabulary;
pub use jet::Jet;
use program::Program;
pub use smooth::Smooth;

/// Values of the variables. In 2D the third components are zero.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Scope {
    /// X, Y, Z: start position of the node or point, m.
    pub initial: [f64; 3],
    /// x, y, z: current position, m.
    pub current: [f64; 3],
    /// s: load factor, 0 to 1.
    pub load_factor: f64,
    /// t: time, s.
    pub time: f64,
}

impl Scope {
    fn value(&self, variable: Variable) -> f64 {
        match variable {
            Variable::InitialX => self.initial[0],
            Variable::InitialY => self.initial[1],
            Variable::InitialZ => self.initial[2],
            Variable::CurrentX => self.current[0],
            Variable::CurrentY => self.current[1],
            Variable::CurrentZ => self.current[2],
            Variable::LoadFactor => self.load_factor,
            Variable::Time => self.time,
        }
    }
}

/// What a formula may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    /// X
    InitialX,
    /// Y
    InitialY,
    /// Z
    InitialZ,
    /// x
    CurrentX,
    /// y
    CurrentY,
    /// z
    CurrentZ,
    /// s
    LoadFactor,
    /// t
    Time,
}

impl Variable {
    /// All of them, as [`Scope`] lists them.
    pub const ALL: [Variable; 8] = [
        Variable::InitialX,
        Variable::InitialY,
        Variable::InitialZ,
        Variable::CurrentX,
        Variable::CurrentY,
        Variable::CurrentZ,
        Variable::LoadFactor,
        Variable::Time,
    ];

    /// The name in formulas.
    pub fn name(self) -> &'static str {
        match self {
            Variable::InitialX => "X",
            Variable::InitialY => "Y",
            Variable::InitialZ => "Z",
            Variable::CurrentX => "x",
            Variable::CurrentY => "y",
            Variable::CurrentZ => "z",
            Variable::LoadFactor => "s",
            Variable::Time => "t",
        }
    }

    fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|variable| variable.name() == name)
    }
}

/// A parsed formula or a constant. Cloning is cheap; equality is equality of the text.
///
/// ```
/// use mpm_par::deck::{Expression, Scope};
///
/// let depth = Expression::parse("9.81e3 * max(0, 8 - y)")?;
/// let scope = Scope { current: [0.0, 6.0, 0.0], ..Scope::default() };
/// assert!((depth.value(&scope) - 19_620.0).abs() < 1e-9);
/// assert_eq!(Expression::parse("2 * 3")?.as_constant(), Some(6.0));
/// assert!(Expression::parse("2 *").is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    constant: Option<f64>,
    formula: Arc<Program>,
}

impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl Expression {
    /// Parses a formula; the message says what is wrong and lists variables and functions.
    pub fn parse(text: &str) -> Result<Self, String> {
        let program = grammar::parse(text)?;
        let varies = Variable::ALL.iter().any(|&variable| program.contains(variable));
        let constant = (!varies).then(|| program.number(&Scope::default()));
        Ok(Expression { text: text.to_string(), constant, formula: Arc::new(program) })
    }

    /// A number.
    pub fn constant(value: f64) -> Self {
        let mut program = Program::default();
        program.push(program::Operation::Number(value));
        Expression { text: value.to_string(), constant: Some(value), formula: Arc::new(program) }
    }

    /// As the deck has it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The value, if it depends on nothing.
    pub fn as_constant(&self) -> Option<f64> {
        self.constant
    }

    /// Whether the variable stands in it.
    pub fn depends_on(&self, variable: Variable) -> bool {
        self.formula.contains(variable)
    }

    /// True if it contains `s` or `t`.
    pub fn depends_on_time(&self) -> bool {
        self.depends_on(Variable::LoadFactor) || self.depends_on(Variable::Time)
    }

    /// True if it contains a coordinate.
    pub fn depends_on_place(&self) -> bool {
        use Variable::{LoadFactor, Time};
        let place = |variable: &Variable| !matches!(variable, LoadFactor | Time);
        Variable::ALL.iter().filter(|variable| place(variable)).any(|&v| self.depends_on(v))
    }

    /// The value; not a number where the formula has none (for example `ln(-1)`).
    pub fn value(&self, scope: &Scope) -> f64 {
        self.constant.unwrap_or_else(|| self.formula.number(scope))
    }

    /// The formula with its derivatives. Error: it contains a function or an operator that is
    /// not smooth (comparisons, `min`, `max`, `if`, `abs`, ...).
    pub fn smooth(&self) -> Result<Smooth, String> {
        Smooth::new(self.formula.clone(), false).map_err(|why| format!("\"{}\": {why}", self.text))
    }

    /// As [`Self::smooth`], with `min`, `max` and `abs` averaged over a width.
    pub fn averaged(&self) -> Result<Smooth, String> {
        Smooth::new(self.formula.clone(), true).map_err(|why| format!("\"{}\": {why}", self.text))
    }
}
