//! Slips of the pen that leave a deck no TOML, or a formula no formula: what to write instead.

use std::ops::Range;

use super::problems::rough;
use super::schema::{self, Kind};

const UNITS: &str = "numbers carry no unit: lengths are in m, densities in kg/m3, stresses in Pa, so that \
                     10 MPa is 10e6";

/// What to write, by the line on which the reader stopped; empty if nothing is known of such a line.
pub fn cure(text: &str, span: Option<&Range<usize>>) -> String {
    let Some(span) = span else { return String::new() };
    let at = span.start.min(text.len());
    let start = text.get(..at).and_then(|before| before.rfind('\n')).map_or(0, |end| end + 1);
    let line = text.get(start..).and_then(|rest| rest.lines().next()).unwrap_or("");
    if line.contains(['\u{201c}', '\u{201d}', '\u{201e}', '\u{2018}', '\u{2019}']) {
        return "write straight quotes: \"sand\"".into();
    }
    if line.trim_start().starts_with('[') {
        return of_header(line.trim());
    }
    let Some((key, value)) = line.split_once('=') else { return String::new() };
    let value = value.split('#').next().unwrap_or("").trim();
    if value.find('"').is_some_and(|quote| value[quote..].contains('\\')) {
        return "in double quotes a backslash begins an escape: write the name in 'single quotes', or \
                with /"
            .into();
    }
    if has_unit(value) {
        return UNITS.into();
    }
    if let Some((whole, rest)) = value.split_once(',')
        && is_digits(whole.trim_start_matches('-'))
        && is_digits(rest)
    {
        return format!("decimals have a point: {} = {whole}.{rest}", key.trim());
    }
    String::new()
}

/// What to write in place of a formula such as `10 MPa`; empty for others.
pub fn cure_of_formula(text: &str) -> String {
    if has_unit(text.trim()) { UNITS.into() } else { String::new() }
}

/// A body may well be larger than its grid, but not so many times.
const LARGER: f64 = 30.0;

/// What to say of a body of this length, m, that lies outside a grid of that one; empty unless it dwarfs the
/// grid.
pub fn of_length(body: f64, grid: f64) -> String {
    if !(body > LARGER * grid && body.is_finite()) {
        return String::new();
    }
    format!(
        "the body is {} m long, the grid {} m: is the body in mm? Lengths are in m; an STL file in mm has \
         scale = 0.001 beside stl",
        rough(body),
        rough(grid)
    )
}

/// A number, then a word.
fn has_unit(value: &str) -> bool {
    let Some((number, word)) = value.split_once(|c: char| c.is_whitespace()) else { return false };
    number.parse::<f64>().is_ok() && word.trim_start().starts_with(|c: char| c.is_alphabetic())
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// A table that is there twice.
fn of_header(line: &str) -> String {
    let name = line.trim_matches(['[', ']']);
    match name.split('.').next() {
        Some("material") => "each material has a name of its own: [material.NAME]".into(),
        Some(name) if !line.starts_with("[[") => {
            let key = schema::section("").key(name);
            match key.map(|key| key.kind) {
                Some(Kind::Tables(_)) => {
                    format!("write [[{name}]], in double brackets, once for each of them")
                }
                _ => String::new(),
            }
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_slips_have_a_cure() {
        let of = |line: &str| cure(&format!("a = 1\n{line}\nb = 2"), Some(&(9..10)));
        assert_eq!(of("density = 1835,0   # kg/m3"), "decimals have a point: density = 1835.0");
        assert_eq!(of("young = 10 MPa"), UNITS);
        assert!(of("points = \"C:\\data\\p.csv\"").contains("'single quotes'"));
        assert!(of("shape = { points = \"C:\\data\\p.csv\" }").contains("'single quotes'"));
        assert!(of("title = \u{201c}sand\u{201d}").contains("straight"));
        assert!(of("[load]").contains("[[load]]"));
        assert!(of("[material.clay]").contains("[material.NAME]"));
        for good in ["size = [1 2]", "x = 3", "word = hencky", "x = \"1 2\"", ""] {
            assert_eq!(of(good), "", "{good}");
        }
        assert_eq!(cure("a", Some(&(7..9))), "");
        assert_eq!(cure_of_formula("10 MPa"), UNITS);
        assert_eq!(cure_of_formula("10*X"), "");
    }
}
