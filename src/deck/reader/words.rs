//! Words out of a list, and expressions.

use super::Table;
use crate::deck::choices::Choice;
use crate::deck::expression::{Expression, Variable};
use crate::deck::problems::{Got, Reported, nearest};
use crate::deck::schema::{Key, Kind, Range, quoted};
use crate::deck::slips;
use crate::deck::synonyms;
use crate::deck::tree::{Node, Origin, Value};

impl Table<'_> {
    fn word<T: Choice>(&self, name: &str, word: &str, origin: &Origin) -> Got<T> {
        if let Some((_, value)) = T::SPELLINGS.iter().find(|(known, _)| *known == word) {
            return Ok(*value);
        }
        let names: Vec<&str> = T::SPELLINGS.iter().map(|(known, _)| *known).collect();
        Err(self.unknown_word(name, word, &names, origin))
    }

    /// Reports a word that is none of `known`.
    pub fn unknown_word(
        &self,
        name: &str,
        word: &str,
        known: &[&str],
        origin: &Origin,
    ) -> Reported {
        let near = || nearest(word, known.iter().copied());
        let help = match synonyms::word(word, known.iter().copied()) {
            Some(meant) => format!("here it is called \"{meant}\""),
            None => near().map(|near| format!("did you mean \"{near}\"?")).unwrap_or_default(),
        };
        let expected = match known {
            [] => "nothing to choose from".to_string(),
            [one] => format!("expected \"{one}\""),
            _ => format!("expected one of {}", quoted(known)),
        };
        let message = format!("{expected}, found \"{word}\"");
        self.problems.report(origin, &self.full(name), message, help)
    }

    /// An enumeration of the model.
    pub fn choice<T: Choice>(&self, name: &str) -> Got<T> {
        self.present(name, self.choice_if(name))
    }

    /// [`Self::choice`], if the key is given or has a default.
    pub fn choice_if<T: Choice>(&self, name: &str) -> Got<Option<T>> {
        self.read(name, |key, node| {
            let text = self.text_in(key, node)?;
            self.word(name, &text, &node.origin)
        })
    }

    /// A word of the schema's list; `allowed` of them hold here.
    pub fn choice_of(&self, name: &str, allowed: &[&str]) -> Got<usize> {
        let at = self.read(name, |key, node| {
            let text = self.text_in(key, node)?;
            allowed
                .iter()
                .position(|known| *known == text)
                .ok_or_else(|| self.unknown_word(name, &text, allowed, &node.origin))
        });
        self.present(name, at)
    }

    /// One of some names of the deck: its place among them.
    pub fn choice_of_names(&self, name: &str, names: &[String]) -> Got<usize> {
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        self.choice_of(name, &known)
    }

    /// Enters a name among those before it, whose bearer is a `what`.
    pub fn unique(&self, name: String, names: &mut Vec<String>, what: &str) -> Got<String> {
        if names.contains(&name) {
            return Err(self.problem("name", format!("another {what} is called \"{name}\"")));
        }
        names.push(name.clone());
        Ok(name)
    }

    /// Positions in `allowed` of the words of an array, without repeats.
    pub fn choices(&self, name: &str, allowed: &[&str]) -> Got<Vec<usize>> {
        let found = self.read(name, |key, node| {
            let mut chosen = Vec::new();
            let mut one = |item: &Node| {
                let text = self.text_in(&Key { kind: Kind::Text, ..*key }, item)?;
                let Some(at) = allowed.iter().position(|known| *known == text) else {
                    return Err(self.unknown_word(name, &text, allowed, &item.origin));
                };
                if chosen.contains(&at) {
                    let message = format!("\"{text}\" is named twice");
                    let full = self.full(name);
                    return Err(self.problems.report(&item.origin, &full, message, String::new()));
                }
                chosen.push(at);
                Ok(())
            };
            // All of them, so that every unknown word is reported.
            let words: Vec<Got<()>> = self.items(key, node)?.iter().map(&mut one).collect();
            words.into_iter().collect::<Got<()>>()?;
            Ok(chosen)
        });
        Ok(found?.unwrap_or_default())
    }

    fn expression_in(&self, key: &Key, node: &Node, variables: &str) -> Got<Expression> {
        if let Some(value) = node.number().filter(|value| value.is_finite()) {
            return Ok(Expression::constant(value));
        }
        let Value::String(text) = &node.value else { return Err(self.mismatch(key, node)) };
        let report = |message: String| {
            let help = slips::cure_of_formula(text);
            self.problems.report(&node.origin, &self.full(key.name), message, help)
        };
        let expression = Expression::parse(text).map_err(report)?;
        let foreign = Variable::ALL
            .into_iter()
            .find(|v| expression.depends_on(*v) && !variables.split(' ').any(|n| n == v.name()));
        match foreign {
            Some(v) => {
                let name = v.name();
                Err(report(format!("`{name}` is not known here; variables: {variables}")))
            }
            None => Ok(expression),
        }
    }

    fn variables(key: &Key) -> &'static str {
        match key.kind {
            Kind::Expression(variables) | Kind::Expressions(variables) => variables,
            _ => "X Y Z x y z s t",
        }
    }

    /// A formula in the variables of the schema, if the key is given.
    pub fn expression_if(&self, name: &str) -> Got<Option<Expression>> {
        self.read(name, |key, node| self.expression_in(key, node, Self::variables(key)))
    }

    /// A number in `range`, or an expression whose value nobody knows yet.
    pub fn number_or_expression(&self, name: &str, range: Range) -> Got<Option<Expression>> {
        self.read(name, |key, node| {
            let found = self.expression_in(key, node, Self::variables(key))?;
            match found.as_constant() {
                Some(value) if !range.contains(value) => {
                    Err(self.mismatch(&Key { kind: Kind::Number, range, ..*key }, node))
                }
                _ => Ok(found),
            }
        })
    }

    /// A formula that must be a string, in the given variables.
    pub fn formula(&self, name: &str, variables: &str) -> Got<Expression> {
        self.present(
            name,
            self.read(name, |key, node| {
                self.text_in(key, node)?;
                self.expression_in(key, node, variables)
            }),
        )
    }

    /// One formula per axis, if the key is given.
    pub fn expressions_if(&self, name: &str, dimension: usize) -> Got<Option<Vec<Expression>>> {
        self.read(name, |key, node| {
            let variables = Self::variables(key);
            let one = Key { kind: Kind::Expression(variables), ..*key };
            let items = self.per_axis(key, node, dimension)?;
            items.iter().map(|item| self.expression_in(&one, item, variables)).collect()
        })
    }
}
