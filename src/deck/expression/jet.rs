//! f(a) with grad f = f' grad a and Hess f = f' Hess a + f'' grad a (x) grad a: values that carry
//! their first and second derivatives with respect to X, Y, Z (forward automatic differentiation).
//! `max`, `min` and `abs` have derivatives once they are averaged over a width.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Index of d2/dX_i dX_j in [`Jet::second`].
const PLACE: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];
/// The pair of axes at each place of [`Jet::second`].
const PAIR: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];

/// A number and its derivatives with respect to X, Y and Z.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Jet {
    /// The value itself.
    pub value: f64,
    /// d/dX, d/dY, d/dZ, 1/m times the unit of the value.
    pub first: [f64; 3],
    /// XX, XY, XZ, YY, YZ, ZZ; see [`Jet::second_along`].
    second: [f64; 6],
    /// Half widths along the axes, m, over which [`Jet::max`] and its kin are averaged. Zero: they
    /// are what they are, with the derivatives of one side.
    pub reach: [f64; 3],
}

impl Jet {
    /// A number that depends on nothing.
    pub fn constant(value: f64) -> Self {
        Jet { value, ..Jet::default() }
    }

    /// The coordinate along `axis`.
    pub fn coordinate(value: f64, axis: usize) -> Self {
        let mut first = [0.0; 3];
        first[axis] = 1.0;
        Jet { value, first, ..Jet::default() }
    }

    /// The same with another [`Jet::reach`].
    pub fn within(self, reach: [f64; 3]) -> Self {
        Jet { reach, ..self }
    }

    /// d2/dX_i dX_j.
    pub fn second_along(&self, i: usize, j: usize) -> f64 {
        self.second[PLACE[i][j]]
    }

    /// f(self), from f, f' and f'' at the value.
    pub fn apply(self, [f, slope, curvature]: [f64; 3]) -> Self {
        let mut out = Jet { value: f, reach: self.reach, ..Jet::default() };
        for axis in 0..3 {
            out.first[axis] = slope * self.first[axis];
        }
        for (place, [i, j]) in PAIR.into_iter().enumerate() {
            out.second[place] =
                slope * self.second[place] + curvature * self.first[i] * self.first[j];
        }
        out
    }

    fn is_constant(&self) -> bool {
        self.first == [0.0; 3] && self.second == [0.0; 6]
    }

    fn wider(self, other: Self) -> [f64; 3] {
        std::array::from_fn(|axis| self.reach[axis].max(other.reach[axis]))
    }

    /// max(self, other), averaged over -w to w of their difference d, w = Σ_i |d,_i| reach_i:
    /// other + (d + w)^2 / 4w between. Where d varies linearly along one axis, this is the mean over
    /// the width along it.
    pub fn max(self, other: Self) -> Self {
        let d = self - other;
        let width: f64 = d.first.iter().zip(d.reach).map(|(slope, r)| slope.abs() * r).sum();
        match d.value {
            v if v >= width => Jet { reach: d.reach, ..self },
            v if v <= -width => Jet { reach: d.reach, ..other },
            v => {
                let above = v + width;
                let ramp = [above * above / (4.0 * width), above / (2.0 * width), 0.5 / width];
                other + d.apply(ramp)
            }
        }
    }

    /// min(self, other), as [`Jet::max`].
    pub fn min(self, other: Self) -> Self {
        -(-self).max(-other)
    }

    /// |self|, as [`Jet::max`].
    pub fn abs(self) -> Self {
        self.max(-self)
    }

    fn reciprocal(self) -> Self {
        let r = 1.0 / self.value;
        self.apply([r, -r * r, 2.0 * r * r * r])
    }

    /// self^exponent. A constant exponent keeps whole powers exact at and below zero.
    pub fn power(self, exponent: Self) -> Self {
        if !exponent.is_constant() {
            return (exponent * self.ln()).exp();
        }
        let (x, n) = (self.value, exponent.value);
        // A vanishing factor wins over 0^-1: the derivatives of x and x^2 exist at zero.
        let term = |factor: f64, n: f64| if factor == 0.0 { 0.0 } else { factor * x.powf(n) };
        self.apply([x.powf(n), term(n, n - 1.0), term(n * (n - 1.0), n - 2.0)])
    }

    /// e^self
    pub fn exp(self) -> Self {
        self.apply([self.value.exp(); 3])
    }

    /// Natural logarithm.
    pub fn ln(self) -> Self {
        let r = 1.0 / self.value;
        self.apply([self.value.ln(), r, -r * r])
    }

    /// atan2(self, x), away from the origin.
    pub fn atan2(self, x: Self) -> Self {
        let angle = self.value.atan2(x.value);
        // Either quotient has the same derivatives up to sign; take the one without overflow.
        let mut out =
            if x.value.abs() >= self.value.abs() { atan(self / x) } else { -atan(x / self) };
        out.value = angle;
        out
    }
}

impl Add for Jet {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Jet {
            value: self.value + other.value,
            first: std::array::from_fn(|i| self.first[i] + other.first[i]),
            second: std::array::from_fn(|i| self.second[i] + other.second[i]),
            reach: self.wider(other),
        }
    }
}

impl Neg for Jet {
    type Output = Self;

    fn neg(self) -> Self {
        Jet {
            value: -self.value,
            first: self.first.map(|d| -d),
            second: self.second.map(|d| -d),
            reach: self.reach,
        }
    }
}

impl Sub for Jet {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Jet {
    type Output = Self;

    // The product rule adds.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (&self, &other);
        Jet {
            value: a.value * b.value,
            first: std::array::from_fn(|i| a.first[i] * b.value + a.value * b.first[i]),
            second: std::array::from_fn(|place| {
                let [i, j] = PAIR[place];
                a.second[place] * b.value
                    + a.value * b.second[place]
                    + a.first[i] * b.first[j]
                    + a.first[j] * b.first[i]
            }),
            reach: self.wider(other),
        }
    }
}

#[allow(clippy::suspicious_arithmetic_impl)]
impl Div for Jet {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        self * other.reciprocal()
    }
}

fn atan(a: Jet) -> Jet {
    let d = 1.0 / (1.0 + a.value * a.value);
    a.apply([a.value.atan(), d, -2.0 * a.value * d * d])
}

/// Value, first and second derivative of a function of one argument.
pub type Rule = fn(f64) -> [f64; 3];

/// Every function with derivatives everywhere in its domain.
pub const RULES: [(&str, Rule); 19] = [
    ("acos", |x| {
        let r = (1.0 - x * x).sqrt();
        [x.acos(), -1.0 / r, -x / (r * r * r)]
    }),
    ("acosh", |x| {
        let r = (x * x - 1.0).sqrt();
        [x.acosh(), 1.0 / r, -x / (r * r * r)]
    }),
    ("asin", |x| {
        let r = (1.0 - x * x).sqrt();
        [x.asin(), 1.0 / r, x / (r * r * r)]
    }),
    ("asinh", |x| {
        let r = (1.0 + x * x).sqrt();
        [x.asinh(), 1.0 / r, -x / (r * r * r)]
    }),
    ("atan", |x| {
        let d = 1.0 / (1.0 + x * x);
        [x.atan(), d, -2.0 * x * d * d]
    }),
    ("atanh", |x| {
        let d = 1.0 / (1.0 - x * x);
        [x.atanh(), d, 2.0 * x * d * d]
    }),
    ("cbrt", |x| {
        let r = x.cbrt();
        [r, 1.0 / (3.0 * r * r), -2.0 / (9.0 * r.powi(5))]
    }),
    ("cos", |x| [x.cos(), -x.sin(), -x.cos()]),
    ("cosh", |x| [x.cosh(), x.sinh(), x.cosh()]),
    ("exp", |x| [x.exp(); 3]),
    ("ln", logarithm::<0>),
    ("log", logarithm::<0>),
    ("log10", logarithm::<10>),
    ("log2", logarithm::<2>),
    ("sin", |x| [x.sin(), x.cos(), -x.sin()]),
    ("sinh", |x| [x.sinh(), x.cosh(), x.sinh()]),
    ("sqrt", |x| {
        let r = x.sqrt();
        [r, 0.5 / r, -0.25 / (r * x)]
    }),
    ("tan", |x| {
        let t = x.tan();
        [t, 1.0 + t * t, 2.0 * t * (1.0 + t * t)]
    }),
    ("tanh", |x| {
        let t = x.tanh();
        [t, 1.0 - t * t, -2.0 * t * (1.0 - t * t)]
    }),
];

/// The natural logarithm over that of `BASE` (0: the natural logarithm itself).
fn logarithm<const BASE: u32>(x: f64) -> [f64; 3] {
    let (value, scale) = match BASE {
        10 => (x.log10(), std::f64::consts::LN_10),
        2 => (x.log2(), std::f64::consts::LN_2),
        _ => (x.ln(), 1.0),
    };
    [value, 1.0 / (scale * x), -1.0 / (scale * x * x)]
}
