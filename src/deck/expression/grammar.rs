//! The grammar of formulas, with the usual precedence: `||`, `&&`, comparisons, `+ -`, `* /`,
//! sign and `!`, `^` (right associative, and tighter than a sign before it: -x^2 is -(x^2)).

use super::Variable;
use super::operators::{self, BINARY_FUNCTIONS, CONSTANTS, FUNCTIONS};
use super::program::{Operation, Program};

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

/// The operations of a formula. Error: it is none, with the place and what would be right.
pub fn parse(text: &str) -> Result<Program, String> {
    let tokens = tokenise(text)?;
    let program = Program::default();
    let mut parser = Parser { text, tokens, next: 0, depth: 0, program };
    if *parser.peek() == Token::End {
        return Err("the expression is empty".to_string());
    }
    parser.level(0)?;
    match parser.peek() {
        Token::End => Ok(parser.program),
        _ => Err(parser.unexpected("an operator or the end")),
    }
}

/// The message for a name that is neither a variable nor a function.
pub fn unknown_name(text: &str, name: &str) -> String {
    let candidates = Variable::ALL
        .iter()
        .map(|v| v.name())
        .chain(FUNCTIONS.map(|(name, _)| name))
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
        FUNCTIONS.map(|(name, _)| name).join(" "),
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
    program: Program,
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

    fn level(&mut self, level: usize) -> Result<(), String> {
        if level == LEVELS.len() {
            return self.signed();
        }
        self.level(level + 1)?;
        while let Some(symbol) = self.accept(LEVELS[level]) {
            self.level(level + 1)?;
            self.binary(symbol);
            if level == COMPARISON && LEVELS[level].iter().any(|s| *self.peek() == Token::Symbol(s))
            {
                return Err(format!(
                    "comparisons do not chain in \"{}\": write a < b && b < c",
                    self.text
                ));
            }
        }
        Ok(())
    }

    /// Appends an operator of two arguments; its symbol is in the grammar.
    fn binary(&mut self, symbol: &str) {
        if let Some(place) = operators::binary(symbol) {
            self.program.push(Operation::Binary(place));
        }
    }

    fn signed(&mut self) -> Result<(), String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("\"{}\" is nested too deeply", self.text));
        }
        match self.accept(&["-", "+", "!"]) {
            Some("-") => {
                self.signed()?;
                self.program.push(Operation::Negate);
            }
            Some("!") => {
                self.signed()?;
                self.program.push(Operation::Not);
            }
            Some(_) => self.signed()?,
            None => {
                self.primary()?;
                if self.accept(&["^"]).is_some() {
                    self.signed()?;
                    self.binary("^");
                }
            }
        }
        self.depth -= 1;
        Ok(())
    }

    fn primary(&mut self) -> Result<(), String> {
        match self.peek().clone() {
            Token::Number(value) => {
                self.take();
                self.program.push(Operation::Number(value));
                Ok(())
            }
            Token::Name(name) => {
                self.take();
                if *self.peek() == Token::Symbol("(") { self.call(&name) } else { self.word(&name) }
            }
            Token::Symbol("(") => {
                self.take();
                self.level(0)?;
                self.expect(")")
            }
            _ => Err(self.unexpected("a number, a variable, a function or `(`")),
        }
    }

    fn word(&mut self, name: &str) -> Result<(), String> {
        if let Some((_, value)) = CONSTANTS.iter().find(|(known, _)| *known == name) {
            self.program.push(Operation::Number(*value));
            return Ok(());
        }
        if let Some(variable) = Variable::from_name(name) {
            self.program.push(Operation::Variable(variable));
            return Ok(());
        }
        let function = operators::function(name).is_some() || BINARY_FUNCTIONS.contains(&name);
        if function || name == "if" {
            return Err(self.unexpected(&format!("`(` after `{name}`")));
        }
        Err(unknown_name(self.text, name))
    }

    fn call(&mut self, name: &str) -> Result<(), String> {
        let function = operators::function(name);
        let of_two = BINARY_FUNCTIONS.contains(&name);
        if name != "if" && function.is_none() && !of_two {
            return Err(unknown_name(self.text, name));
        }
        self.expect("(")?;
        self.level(0)?;
        let mut count = 1;
        let mut jumps = Vec::new();
        while self.accept(&[","]).is_some() {
            match (name, count) {
                ("if", 1) => jumps.push(self.program.branch(Operation::Unless)),
                ("if", 2) => {
                    let end = self.program.branch(Operation::Skip);
                    self.program.land(jumps[0]);
                    jumps.push(end);
                }
                _ => {}
            }
            self.level(0)?;
            count += 1;
            // As many arguments as one likes, from the left.
            if of_two {
                self.binary(name);
            }
        }
        self.expect(")")?;
        let wanted = match name {
            "if" => 3,
            "atan2" => 2,
            "min" | "max" => count.max(2),
            _ => 1,
        };
        if count != wanted {
            return Err(format!(
                "`{name}` takes {wanted} argument{}, found {count} in \"{}\"",
                if wanted == 1 { "" } else { "s" },
                self.text
            ));
        }
        if let Some(&end) = jumps.get(1) {
            self.program.land(end);
        }
        if let Some(place) = function {
            self.program.push(Operation::Function(place));
        }
        Ok(())
    }
}
