//! Numbers that carry their first and second derivatives with respect to X, Y and Z (`num_dual`). `max`, `min` and
//! `abs` have derivatives once they are averaged over a width.

use std::sync::LazyLock;

use nalgebra::{Const, U1};
use num_dual::{Dual2SVec64, DualNum};

use super::operators::{BINARY, FUNCTIONS, holds};
use super::program::Algebra;

/// A number and its derivatives.
pub type Dual = Dual2SVec64<3>;

/// A number and its derivatives with respect to X, Y and Z, as plain arrays.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Jet {
    /// The value itself.
    pub value: f64,
    /// d/dX, d/dY, d/dZ, 1/m times the unit of the value.
    pub first: [f64; 3],
    second: [[f64; 3]; 3],
}

impl Jet {
    /// d2/dX_i dX_j.
    pub fn second_along(&self, i: usize, j: usize) -> f64 {
        self.second[i][j]
    }

    fn is_constant(&self) -> bool {
        self.first == [0.0; 3] && self.second == [[0.0; 3]; 3]
    }
}

impl From<Dual> for Jet {
    fn from(dual: Dual) -> Self {
        let (first, second) =
            (dual.v1.unwrap_generic(U1, Const), dual.v2.unwrap_generic(Const, Const));
        Jet { value: dual.re, first: std::array::from_fn(|i| first[i]), second: second.into() }
    }
}

/// The coordinate along `axis`.
pub fn coordinate(value: f64, axis: usize) -> Dual {
    Dual::from_re(value).derivative(axis)
}

/// `max`, `min` and `abs` are averaged over these half widths along the axes, m. Zero: they are what they are, with
/// the derivatives of one side.
pub struct Averaged(pub [f64; 3]);

impl Averaged {
    /// max(a, b), averaged over -w to w of their difference d, w = Σ_i |d,_i| reach_i:
    /// b + (d + w)^2 / 4w between. Where d varies linearly along one axis, this is the mean over
    /// the width along it.
    pub fn max(&self, a: Dual, b: Dual) -> Dual {
        let d = a - b;
        let slopes = Jet::from(d).first;
        let width: f64 = slopes.iter().zip(self.0).map(|(slope, r)| slope.abs() * r).sum();
        match d.re {
            v if v >= width => a,
            v if v <= -width => b,
            _ => b + (d + width).powi(2) / (4.0 * width),
        }
    }
}

impl Algebra for Averaged {
    type Number = Dual;

    fn number(&self, value: f64) -> Dual {
        Dual::from_re(value)
    }

    fn negated(&self, a: Dual) -> Dual {
        -a
    }

    /// Formulas that branch are not smooth: [`super::Smooth::new`] refuses them.
    fn inverted(&self, _: Dual) -> Dual {
        Dual::from_re(f64::NAN)
    }

    fn holds(&self, a: Dual) -> bool {
        holds(a.re)
    }

    fn function(&self, place: usize, a: Dual) -> Dual {
        // Derivatives that are infinite here do not act on what does not vary.
        if Jet::from(a).is_constant() {
            return Dual::from_re(FUNCTIONS[place].1(a.re));
        }
        match (SMOOTH_OF[place], FUNCTIONS[place].0) {
            (Some(smooth), _) => smooth(&a),
            (None, "abs") => self.max(a, -a),
            _ => Dual::from_re(f64::NAN),
        }
    }

    fn binary(&self, place: usize, a: Dual, b: Dual) -> Dual {
        match BINARY[place].0 {
            "+" => a + b,
            "-" => a - b,
            "*" => a * b,
            "/" => a / b,
            "^" => power(a, b),
            "atan2" => atan2(a, b),
            "max" => self.max(a, b),
            "min" => -self.max(-a, -b),
            _ => Dual::from_re(f64::NAN),
        }
    }
}

/// a^b. A constant exponent keeps whole powers exact at and below zero; a factor that vanishes wins over 0^-1, as the
/// derivatives of x and x^2 exist at zero.
fn power(a: Dual, b: Dual) -> Dual {
    if !Jet::from(b).is_constant() {
        return a.powd(b);
    }
    let (x, n) = (a.re, b.re);
    let term = |factor: f64, n: f64| if factor == 0.0 { 0.0 } else { factor * x.powf(n) };
    chained(a, [x.powf(n), term(n, n - 1.0), term(n * (n - 1.0), n - 2.0)])
}

/// tanh without the quotient of two functions that overflow.
fn tanh(a: &Dual) -> Dual {
    let t = a.re.tanh();
    let slope = 1.0 - t * t;
    chained(*a, [t, slope, -2.0 * t * slope])
}

/// f(a), where `f` has its value, first and second derivative at a.
fn chained(a: Dual, f: [f64; 3]) -> Dual {
    if Jet::from(a).is_constant() {
        return Dual::from_re(f[0]);
    }
    let varying = a - a.re;
    varying * varying * (0.5 * f[2]) + varying * f[1] + f[0]
}

/// atan2(y, x), away from the origin.
fn atan2(y: Dual, x: Dual) -> Dual {
    let angle = y.re.atan2(x.re);
    // Either quotient has the same derivatives up to sign; take the one without overflow.
    let mut out = if x.re.abs() >= y.re.abs() { (y / x).atan() } else { -(x / y).atan() };
    out.re = angle;
    out
}

/// A function of one number with its derivatives.
type Smooth = fn(&Dual) -> Dual;

/// Every function with derivatives everywhere in its domain.
pub const RULES: [(&str, Smooth); 19] = [
    ("acos", Dual::acos),
    ("acosh", Dual::acosh),
    ("asin", Dual::asin),
    ("asinh", Dual::asinh),
    ("atan", Dual::atan),
    ("atanh", Dual::atanh),
    ("cbrt", Dual::cbrt),
    ("cos", Dual::cos),
    ("cosh", Dual::cosh),
    ("exp", Dual::exp),
    ("ln", Dual::ln),
    ("log", Dual::ln),
    ("log10", Dual::log10),
    ("log2", Dual::log2),
    ("sin", Dual::sin),
    ("sinh", Dual::sinh),
    ("sqrt", Dual::sqrt),
    ("tan", Dual::tan),
    ("tanh", tanh),
];

/// The rule of each of [`FUNCTIONS`].
static SMOOTH_OF: LazyLock<[Option<Smooth>; FUNCTIONS.len()]> = LazyLock::new(|| {
    FUNCTIONS.map(|(name, _)| RULES.iter().find(|(known, _)| *known == name).map(|(_, rule)| *rule))
});
