//! The text that a deck was read from, and how a message points into it.

use super::tree::Origin;

/// Longest piece of a line that a message shows, characters.
const SHOWN: usize = 160;

/// The sources of a deck, for messages.
#[derive(Debug, Default)]
pub struct Sources {
    /// As the user named the file.
    pub file: String,
    pub text: String,
    pub sets: Vec<String>,
}

impl Sources {
    /// What a message about `origin` begins with, and the lines of text that follow it.
    pub fn mark(&self, origin: &Origin) -> (String, String) {
        match origin {
            Origin::Nowhere => (self.file.clone(), String::new()),
            Origin::Set(index) => {
                let option = self.sets.get(*index).map_or("", String::as_str);
                (format!("--set {option}"), String::new())
            }
            Origin::Text(span) => {
                let (line, column, content) = self.locate(span.start);
                let number = line.to_string();
                let margin = " ".repeat(number.len());
                let marked = self.text.get(span.clone()).unwrap_or("");
                let marked = marked.lines().next().unwrap_or("").chars().count().max(1);
                let (content, before) = window(content, column - 1);
                let indent: String = content
                    .chars()
                    .take(before)
                    .map(|c| if c == '\t' { '\t' } else { ' ' })
                    .collect();
                let rest = content.chars().count().saturating_sub(before).max(1);
                let carets = "^".repeat(marked.min(rest));
                (
                    format!("{}:{line}:{column}", self.file),
                    format!("\n {margin} |\n {number} | {content}\n {margin} | {indent}{carets}"),
                )
            }
        }
    }

    /// Line and column from one, and the line itself.
    fn locate(&self, offset: usize) -> (usize, usize, &str) {
        let offset = offset.min(self.text.len());
        let before = self.text.get(..offset).unwrap_or(&self.text);
        let line = before.matches('\n').count() + 1;
        let start = before.rfind('\n').map_or(0, |at| at + 1);
        let column = before[start..].chars().count() + 1;
        let content = self.text[start..].lines().next().unwrap_or("");
        (line, column, content)
    }
}

/// The piece of a line around a character, and the number of characters of it that stand before that
/// one. Dots stand for what is left out.
fn window(line: &str, at: usize) -> (String, usize) {
    let length = line.chars().count();
    if length <= SHOWN {
        return (line.to_string(), at);
    }
    let first = at.saturating_sub(SHOWN / 3).min(length - SHOWN);
    let piece: String = line.chars().skip(first).take(SHOWN).collect();
    let (head, tail) = (if first > 0 { "... " } else { "" }, first + SHOWN < length);
    let before = at - first + head.len();
    (format!("{head}{piece}{}", if tail { " ..." } else { "" }), before)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marked(text: &str, at: usize, length: usize) -> String {
        let sources = Sources { text: text.into(), file: "deck.toml".into(), ..Sources::default() };
        let (place, lines) = sources.mark(&Origin::Text(at..at + length));
        format!("{place}{lines}")
    }

    #[test]
    fn a_short_line_is_shown_whole() {
        let expected = "deck.toml:2:3\n   |\n 2 | \tbc = 1\n   | \t ^^";
        let text = "a = 1\n\tbc = 1\n";
        assert_eq!(marked(text, 8, 2), expected);
    }

    #[test]
    fn of_a_long_line_the_piece_around_the_place_is_shown() {
        let text = format!("{}HERE{}", "x".repeat(5000), "y".repeat(5000));
        let lines = marked(&text, 5000, 4);
        assert!(lines.len() < 500, "{lines}");
        let mut rows = lines.lines().skip(2).map(|row| row.split_once(" | ").unwrap().1);
        let (content, carets) = (rows.next().unwrap(), rows.next().unwrap());
        assert_eq!(content.find("HERE"), carets.find("^^^^"), "{lines}");
        assert!(content.starts_with("... xxx") && content.ends_with("yyy ..."));
    }
}
