//! Words of a text and numbers of a binary file, one after the other.

use std::fmt;

/// What is wrong at the place where the scanner stands.
#[derive(Debug)]
pub(super) struct SyntaxError(pub String);

impl fmt::Display for SyntaxError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Text,
    LittleEndian,
    BigEndian,
}

#[derive(Debug)]
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    form: Form,
}

impl<'a> Scanner<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        // Some editors put a mark of the encoding first.
        let at = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { bytes, at, form: Form::Text }
    }

    /// The rest of the line, which may be empty.
    pub fn line(&mut self) -> String {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at = (self.at + length + 1).min(self.bytes.len());
        String::from_utf8_lossy(&rest[..length]).into_owned()
    }

    /// Name of the next section, and its line is passed. `None` at the end, or where something
    /// else stands.
    pub fn section(&mut self) -> Option<String> {
        self.skip_blanks();
        let line = self.bytes[self.at..].first().filter(|&&b| b == b'$').map(|_| self.line())?;
        Some(line.trim()[1..].to_string())
    }

    /// Passes a section that is not read.
    pub fn skip(&mut self, name: &str) -> Result<(), String> {
        let end = format!("$End{name}");
        let rest = &self.bytes[self.at..];
        let found = rest.windows(end.len()).position(|w| w == end.as_bytes());
        self.at += found.ok_or(format!("ends inside ${name}"))?;
        self.line();
        Ok(())
    }

    /// The line that closes a section.
    pub fn end(&mut self, name: &str) -> Result<(), SyntaxError> {
        self.skip_blanks();
        let expected = format!("$End{name}");
        if self.at == self.bytes.len() {
            return Err(SyntaxError(format!("the file ends where {expected} should stand")));
        }
        // Looked at before it is passed, so that the place named is that of the fault.
        let rest = &self.bytes[self.at..];
        let line = &rest[..rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len())];
        let line = String::from_utf8_lossy(line);
        if line.trim() == expected {
            self.line();
            return Ok(());
        }
        Err(SyntaxError(format!("{expected} should stand where {} stands", quoted(line.trim()))))
    }

    /// The file is binary; the number one here, four bytes long, shows the order of its bytes.
    pub fn binary_from_here(&mut self) -> Result<(), SyntaxError> {
        self.form = match self.take::<4>()? {
            [1, 0, 0, 0] => Form::LittleEndian,
            [0, 0, 0, 1] => Form::BigEndian,
            _ => return Err(SyntaxError("a one of four bytes should follow the header".into())),
        };
        Ok(())
    }

    /// Reads a part that is text in binary files, too.
    pub fn text<T>(&mut self, read: impl FnOnce(&mut Self) -> T) -> T {
        let form = std::mem::replace(&mut self.form, Form::Text);
        let result = read(self);
        self.form = form;
        result
    }

    pub fn is_text(&self) -> bool {
        self.form == Form::Text
    }

    /// Bytes that are left: no list can have more entries, whatever its header says.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// A whole number; four bytes in a binary file.
    pub fn int(&mut self) -> Result<i64, SyntaxError> {
        match self.form {
            Form::Text => self.word("a whole number"),
            Form::LittleEndian => Ok(i64::from(i32::from_le_bytes(self.take()?))),
            Form::BigEndian => Ok(i64::from(i32::from_be_bytes(self.take()?))),
        }
    }

    /// A count or a number of a node or element; eight bytes in a binary file.
    pub fn size(&mut self) -> Result<u64, SyntaxError> {
        match self.form {
            Form::Text => self.word("a whole number from 0"),
            Form::LittleEndian => Ok(u64::from_le_bytes(self.take()?)),
            Form::BigEndian => Ok(u64::from_be_bytes(self.take()?)),
        }
    }

    pub fn real(&mut self) -> Result<f64, SyntaxError> {
        match self.form {
            Form::Text => self.word("a number"),
            Form::LittleEndian => Ok(f64::from_le_bytes(self.take()?)),
            Form::BigEndian => Ok(f64::from_be_bytes(self.take()?)),
        }
    }

    pub fn reals<const N: usize>(&mut self) -> Result<[f64; N], SyntaxError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.real()?;
        }
        Ok(values)
    }

    /// Passes over so many whole numbers.
    pub fn skip_ints(&mut self, count: u64) -> Result<(), SyntaxError> {
        (0..count).try_for_each(|_| self.int().map(drop))
    }

    /// Where the scanner stands, for a message.
    pub fn place(&self) -> String {
        if self.form == Form::Text {
            let before = self.bytes[..self.at].iter().filter(|&&b| b == b'\n').count();
            format!("line {}", before + 1)
        } else {
            format!("byte {}", self.at + 1)
        }
    }

    fn skip_blanks(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len());
    }

    fn word<T: std::str::FromStr>(&mut self, expected: &str) -> Result<T, SyntaxError> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return Err(SyntaxError(format!("the file ends where {expected} should stand")));
        }
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let word = std::str::from_utf8(&rest[..length]).ok();
        let value = word.and_then(|word| word.parse().ok()).ok_or_else(|| {
            let found = quoted(&String::from_utf8_lossy(&rest[..length]));
            SyntaxError(format!("{expected} should stand where {found} stands"))
        })?;
        self.at += length;
        Ok(value)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], SyntaxError> {
        let bytes = self.bytes.get(self.at..self.at + N).and_then(|b| b.try_into().ok());
        let bytes = bytes
            .ok_or_else(|| SyntaxError("the file ends where a number should stand".to_string()))?;
        self.at += N;
        Ok(bytes)
    }
}

/// A short piece of the file for a message.
fn quoted(found: &str) -> String {
    let short: String = found.chars().take(30).filter(|c| !c.is_control()).collect();
    format!("`{short}`")
}
