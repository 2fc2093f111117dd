//! `[[load]]` and `[water]`.

pub use crate::loads::Declared as Load;

impl Load {
    /// Whether a value of it depends on s or t. In quasi-static runs values that hold neither are ramped with the
    /// load factor.
    pub fn depends_on_time(&self) -> bool {
        self.formulas().into_iter().any(|(_, formula)| formula.depends_on_time())
    }
}

/// Still water in the pores and around the bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Water {
    /// m, along the axis.
    pub level: f64,
    /// N/m3
    pub unit_weight: f64,
    /// The vertical one.
    pub axis: usize,
}

impl Water {
    /// p = unit_weight (level - height), 0 above, Pa.
    pub fn pressure(&self, x: &[f64]) -> f64 {
        self.unit_weight * (self.level - x[self.axis]).max(0.0)
    }
}
