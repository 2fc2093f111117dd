use super::*;

fn at(x: f64, y: f64) -> Scope {
    Scope { initial: [x, y, 0.7], current: [x, y, 0.3], load_factor: 0.25, time: 1.5 }
}

fn value(text: &str, x: f64, y: f64) -> f64 {
    Expression::parse(text).expect(text).value(&at(x, y))
}

#[test]
fn precedence_is_the_usual_one() {
    for (text, expected) in [
        ("-x^2", -9.0),
        ("2^-1", 0.5),
        ("2^3^2", 512.0),
        ("2 - 3 + 4", 3.0),
        ("8 / 4 * 2", 4.0),
        ("2 * 3 / 4 * 2", 3.0),
        ("1 - -x", 4.0),
        ("-2^2 + 1", -3.0),
        ("2*-x", -6.0),
        ("(1 + 2) * 3", 9.0),
        ("1e3 + 2.5e-1", 1000.25),
        ("80*10*(Y-50)", 800.0 * (5.0 - 50.0)),
        ("x**2", 9.0),
        ("sin(pi/2) + cos(0)", 2.0),
        ("min(x, y, 1) + max(x, y)", 6.0),
        ("atan2(1, 1) * 4", std::f64::consts::PI),
        ("x < y && y < 6", 1.0),
        ("x > y || !(y >= 5)", 0.0),
        ("1 + 1 == 2", 1.0),
        ("if(x < 2, 10, 20) + 1", 21.0),
        ("if(x > 2, if(y > 9, 1, 2), 3)", 2.0),
        ("s + t + z + Z", 0.25 + 1.5 + 0.3 + 0.7),
        ("log(e) + ln(e) + exp(0) + tanh(0) + abs(-1) + sqrt(4)", 6.0),
    ] {
        let found = value(text, 3.0, 5.0);
        assert!((found - expected).abs() < 1e-14 * expected.abs().max(1.0), "{text}: {found}");
    }
}

#[test]
fn constants_and_dependencies_are_known() {
    let constant = Expression::parse("4.0 * pi / pi").expect("valid");
    assert_eq!(constant.as_constant(), Some(4.0));
    assert!(!constant.depends_on_time());
    let ramp = Expression::parse("X*s").expect("valid");
    assert_eq!(ramp.as_constant(), None);
    assert!(ramp.depends_on_time() && ramp.depends_on(Variable::InitialX));
    assert!(!ramp.depends_on(Variable::CurrentX));
    fn sendable<T: Send + Sync + Clone>() {}
    sendable::<Expression>();
}

/// Formulas of X and Y that use every rule, smooth around X in 0.4..1.3, Y = 0.8.
const SMOOTH: [&str; 20] = [
    "X^2",
    "X^3 * Y",
    "sin(X*Y) / (1 + X^2)",
    "sqrt(1 + X^2)",
    "sqrt(X*X + Y)",
    "exp(-X^2)",
    "ln(2 + X*Y) + log(3 + X) + log10(2 + X*X) + log2(2+X)",
    "tan(X/3) + tanh(X*Y) + atan(X*Y) + asin(X/4) + acos(X*Y/4)",
    "sinh(X) - cosh(2*X*Y) + asinh(X)",
    "acosh(2 + X*Y) + atanh(X*Y/3) + cbrt(X + Y*Y)",
    "(1 + X^2)^(X/2)",
    "2^X",
    "-X^2 + 3 - X",
    "s*sin(2*pi*X)*Y",
    "X / Y / X^3",
    "atan2(Y, X) + atan2(X, 0.1*Y) + atan2(-X, -Y)",
    "sin(X*Y)*X^3",
    "exp(X*Y)/(1+X)",
    "s*sin(pi*X)*cos(pi*Y)*Z",
    "X^s",
];

fn jet(text: &str, x: f64, y: f64) -> Jet {
    Expression::parse(text).expect(text).smooth().expect(text).jet(&at(x, y))
}

#[test]
fn jets_agree_with_values_and_differences() {
    let h = 1e-5;
    for text in SMOOTH {
        for x in [0.4, 0.9, 1.3] {
            let y = 0.8;
            let found = jet(text, x, y);
            let expected = value(text, x, y);
            assert!((found.value - expected).abs() <= 1e-14 * expected.abs(), "{text}");
            let (right, left) = (jet(text, x + h, y), jet(text, x - h, y));
            let (above, below) = (jet(text, x, y + h), jet(text, x, y - h));
            let close = |found: f64, high: f64, low: f64| {
                let difference = (high - low) / (2.0 * h);
                let scale = difference.abs().max(1.0);
                assert!((found - difference).abs() < 2e-8 * scale, "{text}: {found} {difference}");
            };
            close(found.first[0], right.value, left.value);
            close(found.first[1], above.value, below.value);
            for axis in 0..3 {
                close(found.second_along(axis, 0), right.first[axis], left.first[axis]);
                close(found.second_along(1, axis), above.first[axis], below.first[axis]);
            }
        }
    }
}

#[test]
fn only_the_initial_position_carries_derivatives() {
    let found = jet("x*y*s*t + Z", 0.4, 0.8);
    assert_eq!(found.first, [0.0, 0.0, 1.0]);
    assert_eq!(found.second_along(0, 1), 0.0);
    let constant = Expression::constant(3.5).smooth().unwrap().jet(&Scope::default());
    assert_eq!((constant.value, constant.first), (3.5, [0.0; 3]));
}

#[test]
fn derivatives_of_a_power_exist_at_zero_and_below() {
    for (text, x, expected) in [
        ("X^2", 0.0, [0.0, 0.0, 2.0]),
        ("X^2", -3.0, [9.0, -6.0, 2.0]),
        ("X^1", 0.0, [0.0, 1.0, 0.0]),
        ("X^0", 0.0, [1.0, 0.0, 0.0]),
        ("X^-1", -2.0, [-0.5, -0.25, -0.25]),
        ("X^2.5", 0.0, [0.0, 0.0, 0.0]),
        ("tanh(1000*X)", 1.0, [1.0, 0.0, 0.0]),
        ("sqrt(0*X) + (0*X)^1.5 + X", 2.0, [2.0, 1.0, 0.0]),
    ] {
        let found = jet(text, x, 0.0);
        assert_eq!([found.value, found.first[0], found.second_along(0, 0)], expected, "{text}");
    }
}

#[test]
fn formulas_with_kinks_are_not_smooth() {
    for (text, name) in [
        ("abs(X)", "abs"),
        ("min(X, 1)", "min"),
        ("if(X < 1, X, 2)", "if"),
        ("(X < 1)*X", "<"),
        ("floor(X)", "floor"),
    ] {
        let message = Expression::parse(text).unwrap().smooth().unwrap_err();
        assert!(message.contains(&format!("`{name}` has no derivative rule")), "{message}");
    }
}

#[test]
fn messages_point_at_the_fault() {
    for (text, part) in [
        ("", "empty"),
        ("2 +", "character 4: expected a number, a variable, a function or `(`, found the end"),
        ("(1 + 2", "expected `)`, found the end"),
        ("2 x", "character 3: expected an operator or the end, found `x`"),
        ("sine(x)", "unknown name `sine` in \"sine(x)\" (did you mean `sin`?)"),
        ("u + 1", "variables: X Y Z x y z s t"),
        ("sin x", "expected `(` after `sin`"),
        ("sin(x, y)", "`sin` takes 1 argument, found 2"),
        ("if(x, 1)", "`if` takes 3 arguments, found 2"),
        ("0 < x < 1", "comparisons do not chain"),
        ("1..2", "expected an operator or the end"),
        ("x $ 2", "unexpected character `$`"),
    ] {
        let message = Expression::parse(text).unwrap_err();
        assert!(message.contains(part), "{text}: {message}");
    }
    let deep = "(".repeat(500);
    assert!(Expression::parse(&deep).unwrap_err().contains("nested too deeply"));
}
