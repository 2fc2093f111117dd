//! Expressions in the deck: numbers or formulas of X, Y, Z, x, y, z, s, t.

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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    InitialX,
    InitialY,
    InitialZ,
    CurrentX,
    CurrentY,
    CurrentZ,
    LoadFactor,
    Time,
}

/// A parsed formula or a constant.
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    constant: Option<f64>,
}

impl Expression {
    /// Parses a formula; the message says what is wrong and lists variables and functions.
    pub fn parse(_text: &str) -> Result<Self, String> {
        todo!()
    }
    pub fn constant(value: f64) -> Self {
        Expression { text: value.to_string(), constant: Some(value) }
    }
    pub fn text(&self) -> &str {
        &self.text
    }
    /// The value, if it depends on nothing.
    pub fn as_constant(&self) -> Option<f64> {
        self.constant
    }
    pub fn depends_on(&self, _variable: Variable) -> bool {
        todo!()
    }
    /// True if it contains `s` or `t`.
    pub fn depends_on_time(&self) -> bool {
        self.depends_on(Variable::LoadFactor) || self.depends_on(Variable::Time)
    }
    pub fn value(&self, _scope: &Scope) -> f64 {
        todo!()
    }
    /// Symbolic partial derivative.
    pub fn derivative(&self, _variable: Variable) -> Result<Expression, String> {
        todo!()
    }
}
