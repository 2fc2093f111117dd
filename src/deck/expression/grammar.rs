//! The grammar of formulas, with the usual precedence: `||`, `&&`, comparisons, `+ -`, `* /`,
//! sign and `!`, `^` (right associative).
//!
//! exmex binds a sign more tightly than a power (`-x^2` would be `(-x)^2`) and has its own
//! order of operators; the fully parenthesised text written here leaves it no choice.

use super::Variable;
use super::operators::{BINARY_FUNCTIONS, CONSTANTS, FUNCTIONS, OTHERWISE, THEN};

/// Depth of nested parentheses and powers that is accepted.
const DEEPEST: usize = 60;

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Symbol(&'static str),
    End,
}

/// Longer symbols first.
const SYMBOLS: [&str; 18] = [
    "**", "<=", ">=", "==", "!=", "&&", "||", "<", ">", "+", "-", "*", "/", "^", "!", "(", ")", ",",
];

/// Checks a formula and writes it with all parentheses, numbers without exponents.
pub fn normalise(text: &str) -> Result<String, String> {
    let tokens = tokenise(text)?;
    let mut parser = Parser { text, tokens, next: 0, depth: 0 };
    if *parser.peek() == Token::End {
        return Err("the expression is empty".to_string());
    }
    let normal = parser.level(0)?;
    match parser.peek() {
        Token::End => Ok(normal),
        _ => Err(parser.unexpected("an operator or the end")),
    }
}

/// The message for a name that is neither a variable nor a function.
pub fn unknown_name(text: &str, name: &str) -> String {
    let candidates = Variable::ALL
        .iter()
        .map(|v| v.name())
        .chain(FUNCTIONS)
        .chain(BINARY_FUNCTIONS)
        .chain(["if", "pi"]);
    let near = candidates
        .map(|known| (strsim::damerau_levenshtein(&name.to_lowercase(), known), known))
        .min()
        .filter(|(distance, known)| *distance <= 2 && known.len() > 1 && *distance < known.len());
    let near = near.map(|(_, known)| format!(" (did you mean `{known}`?)")).unwrap_or_default();
    format!("unknown name `{name}` in \"{text}\"{near}; {}", vocabulary())
}

/// What formulas may contain.
pub fn vocabulary() -> String {
    format!(
        "variables: {}; functions: {} {} if(c,a,b); constants: pi tau e; operators: + - * / ^ < <= > >= == != && || !",
        Variable::ALL.map(Variable::name).join(" "),
        FUNCTIONS.join(" "),
        BINARY_FUNCTIONS.join(" ")
    )
}

fn tokenise(text: &str) -> Result<Vec<(usize, Token)>, String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        let at = text.len() - rest.len();
        let Some(first) = rest.chars().next() else { break };
        let length;
        if first.is_ascii_digit() || first == '.' {
            length = number_length(rest);
            let value = rest[..length]
                .parse()
                .map_err(|_| format!("`{}` in \"{text}\" is not a number", &rest[..length]))?;
            tokens.push((at, Token::Number(value)));
        } else if first.is_ascii_alphabetic() || first == '_' {
            let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
            length = end.unwrap_or(rest.len());
            tokens.push((at, Token::Name(rest[..length].to_string())));
        } else if let Some(symbol) = SYMBOLS.into_iter().find(|symbol| rest.starts_with(symbol)) {
            length = symbol.len();
            tokens.push((at, Token::Symbol(if symbol == "**" { "^" } else { symbol })));
        } else {
            return Err(format!("unexpected character `{first}` in \"{text}\"; {}", vocabulary()));
        }
        rest = &rest[length..];
    }
    tokens.push((text.len(), Token::End));
    Ok(tokens)
}

/// Bytes of the number at the start: digits, one dot, an exponent if digits follow it.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    end
}

struct Parser<'a> {
    text: &'a str,
    tokens: Vec<(usize, Token)>,
    next: usize,
    depth: usize,
}

/// Binary operators from the loosest level to the tightest; comparisons do not chain.
const LEVELS: [&[&str]; 5] =
    [&["||"], &["&&"], &["<", "<=", ">", ">=", "==", "!="], &["+", "-"], &["*", "/"]];
const COMPARISON: usize = 2;

impl Parser<'_> {
    fn peek(&self) -> &Token {
        &self.tokens[self.next].1
    }

    fn take(&mut self) -> Token {
        let token = self.peek().clone();
        self.next = (self.next + 1).min(self.tokens.len() - 1);
        token
    }

    fn accept(&mut self, symbols: &[&'static str]) -> Option<&'static str> {
        let Token::Symbol(symbol) = *self.peek() else { return None };
        let found = symbols.iter().copied().find(|&s| s == symbol)?;
        self.take();
        Some(found)
    }

    fn expect(&mut self, symbol: &'static str) -> Result<(), String> {
        match self.accept(&[symbol]) {
            Some(_) => Ok(()),
            None => Err(self.unexpected(&format!("`{symbol}`"))),
        }
    }

    fn unexpected(&self, expected: &str) -> String {
        let (at, token) = &self.tokens[self.next];
        let column = self.text[..*at].chars().count() + 1;
        let found = match token {
            Token::Number(value) => format!("the number {value}"),
            Token::Name(name) => format!("`{name}`"),
            Token::Symbol(symbol) => format!("`{symbol}`"),
            Token::End => "the end".to_string(),
        };
        format!("in \"{}\", character {column}: expected {expected}, found {found}", self.text)
    }

    fn level(&mut self, level: usize) -> Result<String, String> {
        if level == LEVELS.len() {
            return self.signed();
        }
        let mut left = self.level(level + 1)?;
        while let Some(symbol) = self.accept(LEVELS[level]) {
            let right = self.level(level + 1)?;
            left = format!("({left} {symbol} {right})");
            if level == COMPARISON && LEVELS[level].iter().any(|s| *self.peek() == Token::Symbol(s))
            {
                return Err(format!(
                    "comparisons do not chain in \"{}\": write a < b && b < c",
                    self.text
                ));
            }
        }
        Ok(left)
    }

    fn signed(&mut self) -> Result<String, String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("\"{}\" is nested too deeply", self.text));
        }
        let text = match self.accept(&["-", "+", "!"]) {
            Some("-") => format!("(-({}))", self.signed()?),
            Some("!") => format!("(!({}))", self.signed()?),
            Some(_) => self.signed()?,
            None => {
                let base = self.primary()?;
                match self.accept(&["^"]) {
                    Some(_) => format!("({base} ^ {})", self.signed()?),
                    None => base,
                }
            }
        };
        self.depth -= 1;
        Ok(text)
    }

    fn primary(&mut self) -> Result<String, String> {
        match self.peek().clone() {
            Token::Number(value) => {
                self.take();
                Ok(number(value))
            }
            Token::Name(name) => {
                self.take();
                if *self.peek() == Token::Symbol("(") { self.call(&name) } else { self.word(&name) }
            }
            Token::Symbol("(") => {
                self.take();
                let inner = self.level(0)?;
                self.expect(")")?;
                Ok(inner)
            }
            _ => Err(self.unexpected("a number, a variable, a function or `(`")),
        }
    }

    fn word(&self, name: &str) -> Result<String, String> {
        if let Some((_, value)) = CONSTANTS.iter().find(|(known, _)| *known == name) {
            return Ok(number(*value));
        }
        if Variable::from_name(name).is_some() {
            return Ok(name.to_string());
        }
        let function = FUNCTIONS.contains(&name) || BINARY_FUNCTIONS.contains(&name);
        if function || name == "if" {
            return Err(self.unexpected(&format!("`(` after `{name}`")));
        }
        Err(unknown_name(self.text, name))
    }

    fn call(&mut self, name: &str) -> Result<String, String> {
        if name != "if" && !FUNCTIONS.contains(&name) && !BINARY_FUNCTIONS.contains(&name) {
            return Err(unknown_name(self.text, name));
        }
        self.expect("(")?;
        let mut arguments = vec![self.level(0)?];
        while self.accept(&[","]).is_some() {
            arguments.push(self.level(0)?);
        }
        self.expect(")")?;
        let wanted = match name {
            "if" => 3,
            "atan2" => 2,
            "min" | "max" => arguments.len().max(2),
            _ => 1,
        };
        if arguments.len() != wanted {
            return Err(format!(
                "`{name}` takes {wanted} argument{}, found {} in \"{}\"",
                if wanted == 1 { "" } else { "s" },
                arguments.len(),
                self.text
            ));
        }
        Ok(match name {
            "if" => {
                let [c, a, b] = [&arguments[0], &arguments[1], &arguments[2]];
                format!("(({c} {THEN} {a}) {OTHERWISE} {b})")
            }
            _ if BINARY_FUNCTIONS.contains(&name) => {
                let mut all = arguments.into_iter();
                let first = all.next().unwrap_or_default();
                all.fold(first, |left, right| format!("({left} {name} {right})"))
            }
            _ => format!("{name}({})", arguments[0]),
        })
    }
}

/// Rust writes floats in full, shortest exact digits and no exponent: what exmex can read.
fn number(value: f64) -> String {
    value.to_string()
}
