//! What a model reads from `[material.NAME]`: key, unit, range, and what holds without it.

/// Interval of numbers; the flags say whether an end belongs to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// Whether the lower end belongs to it.
    pub low_included: bool,
    /// Upper end.
    pub high: f64,
    /// Whether the upper end belongs to it.
    pub high_included: bool,
}

/// All numbers.
pub const ANY: Range = between(f64::NEG_INFINITY, f64::INFINITY);
/// Numbers above zero.
pub const POSITIVE: Range = Range { low_included: false, ..at_least(0.0) };

/// Both ends belong to it.
pub const fn between(low: f64, high: f64) -> Range {
    Range { low, low_included: true, high, high_included: true }
}

/// No end belongs to it.
pub const fn inside(low: f64, high: f64) -> Range {
    Range { low, low_included: false, high, high_included: false }
}

/// From `low` on.
pub const fn at_least(low: f64) -> Range {
    between(low, f64::INFINITY)
}

impl Range {
    /// Whether `value` lies in it; never for a value that is not a number.
    pub fn contains(&self, value: f64) -> bool {
        let above = if self.low_included { value >= self.low } else { value > self.low };
        let below = if self.high_included { value <= self.high } else { value < self.high };
        above && below
    }

    /// Empty for all numbers.
    pub fn describe(&self) -> String {
        let low = (self.low > f64::NEG_INFINITY)
            .then(|| format!("{} {}", if self.low_included { ">=" } else { ">" }, self.low));
        let high = (self.high < f64::INFINITY)
            .then(|| format!("{} {}", if self.high_included { "<=" } else { "<" }, self.high));
        [low, high].into_iter().flatten().collect::<Vec<_>>().join(" and ")
    }
}

/// Whether a deck may leave a parameter out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Absence {
    /// The deck must give it.
    Never,
    /// This value holds then; the text says what it means.
    Means(f64, &'static str),
    /// It must be given if its table is; otherwise this value holds.
    WithTable(f64),
}

/// A parameter of a model: a number, a formula of X, Y, Z, or one of some words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Key below `[material.NAME]`; `table.key` for one in a table of its own.
    pub key: &'static str,
    /// SI unit, or empty.
    pub unit: &'static str,
    /// Where a number must lie.
    pub range: Range,
    /// What holds where the deck leaves it out.
    pub absence: Absence,
    /// A choice: the parameter's value is the place of the word. Empty for numbers.
    pub words: &'static [&'static str],
    /// Its meaning, for the reference.
    pub doc: &'static str,
}

impl Parameter {
    /// A number that the deck must give.
    pub const fn new(
        key: &'static str,
        unit: &'static str,
        range: Range,
        doc: &'static str,
    ) -> Self {
        Parameter { key, unit, range, absence: Absence::Never, words: &[], doc }
    }

    /// `value` holds where the deck leaves it out, which `means` says in words.
    pub const fn absent(self, value: f64, means: &'static str) -> Self {
        Parameter { absence: Absence::Means(value, means), ..self }
    }

    /// It must be given where its table is; `value` holds where the table is left out.
    pub const fn with_table(self, value: f64) -> Self {
        Parameter { absence: Absence::WithTable(value), ..self }
    }

    /// One of `words`, the first where the deck leaves it out.
    pub const fn choice(
        key: &'static str,
        words: &'static [&'static str],
        means: &'static str,
        doc: &'static str,
    ) -> Self {
        let absence = Absence::Means(0.0, means);
        Parameter { key, unit: "", range: ANY, absence, words, doc }
    }

    /// The table around it, if any, and its key there.
    pub fn split(&self) -> (Option<&'static str>, &'static str) {
        match self.key.split_once('.') {
            Some((table, key)) => (Some(table), key),
            None => (None, self.key),
        }
    }

    /// What holds where the deck leaves it out; not a number where it may not.
    pub fn value_if_absent(&self) -> f64 {
        match self.absence {
            Absence::Never => f64::NAN,
            Absence::Means(value, _) | Absence::WithTable(value) => value,
        }
    }
}

/// Young's modulus of a model without limits of its own.
pub const YOUNG: Parameter = Parameter::new(
    "young",
    "Pa",
    at_least(0.0),
    "Young's modulus; zero (none) only in explicit runs.",
);

/// Poisson's ratio.
pub const POISSON: Parameter = Parameter::new("poisson", "", inside(-1.0, 0.5), "Poisson's ratio.");
