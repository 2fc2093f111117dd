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

#[test]
fn derivatives_agree_with_differences() {
    for text in [
        "x^2",
        "x^3 * y",
        "sin(x*y) / (1 + x^2)",
        "sqrt(1 + x^2)",
        "sqrt(x*x + y)",
        "exp(-x^2)",
        "ln(2 + x) + log(3 + x) + log10(2 + x) + log2(2+x)",
        "tan(x/3) + tanh(x) + atan(x) + asin(x/4) + acos(x/4)",
        "sinh(x) - cosh(2*x) + asinh(x)",
        "(1 + x^2)^(x/2)",
        "2^x",
        "-x^2 + 3 - x",
        "s*sin(2*pi*x)*y",
        "x / y / x^3",
    ] {
        let expression = Expression::parse(text).expect(text);
        let derivative = expression.derivative(Variable::CurrentX).expect(text);
        for x in [0.4, 0.9, 1.3] {
            let h = 1e-5;
            let difference = (value(text, x + h, 0.8) - value(text, x - h, 0.8)) / (2.0 * h);
            let found = derivative.value(&at(x, 0.8));
            let scale = difference.abs().max(1.0);
            assert!((found - difference).abs() < 1e-8 * scale, "{text}: {found} {difference}");
        }
    }
}

#[test]
fn derivative_of_a_power_exists_at_zero_and_below() {
    let twice = Expression::parse("x^2").expect("valid");
    let first = twice.derivative(Variable::CurrentX).expect("valid");
    assert_eq!(first.value(&at(0.0, 0.0)), 0.0);
    assert_eq!(first.value(&at(-3.0, 0.0)), -6.0);
    let second = first.derivative(Variable::CurrentX).expect("valid");
    assert_eq!(second.value(&at(0.0, 0.0)), 2.0);
    let other = twice.derivative(Variable::CurrentY).expect("valid");
    assert_eq!(other.as_constant(), Some(0.0));
}

#[test]
fn second_derivatives_agree_with_differences() {
    for text in ["sin(x*y)*x^3", "exp(x*y)/(1+x)", "s*sin(pi*x)*cos(pi*y)"] {
        let first = Expression::parse(text).expect(text).derivative(Variable::CurrentX).unwrap();
        let second = first.derivative(Variable::CurrentY).expect(text);
        let h = 1e-5;
        let difference =
            (first.value(&at(0.6, 0.8 + h)) - first.value(&at(0.6, 0.8 - h))) / (2.0 * h);
        assert!(
            (second.value(&at(0.6, 0.8)) - difference).abs() < 1e-7 * difference.abs().max(1.0)
        );
    }
}

#[test]
fn derivatives_without_a_rule_are_refused() {
    for (text, name) in
        [("abs(x)", "abs"), ("min(x, 1)", "min"), ("if(x < 1, x, 2)", "if"), ("(x < 1)*x", "<")]
    {
        let message = Expression::parse(text).unwrap().derivative(Variable::CurrentX).unwrap_err();
        assert!(message.contains(&format!("`{name}` has no rule")), "{message}");
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
