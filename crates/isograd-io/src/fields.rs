//! Fields of the rows of a text file.

use crate::lines::{number, quoted};
use crate::names::MAX_COLUMNS;

/// Separator of the fields of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Delimiter {
    Space,
    Byte(u8),
}

impl Delimiter {
    /// `;` if there is one outside of quotes, else `,`, else white space.
    pub fn detect(line: &[u8]) -> Self {
        let mut quote = None;
        let mut found = Self::Space;
        for &b in line {
            match (quote, b) {
                (None, b';') => return Self::Byte(b';'),
                (None, b',') => found = Self::Byte(b','),
                (None, b'"') => quote = Some(b),
                (Some(open), b) if b == open => quote = None,
                _ => {}
            }
        }
        found
    }

    pub fn fields(self, line: &[u8]) -> Fields<'_> {
        let line = match self {
            // Some programs write a delimiter after the last field.
            Self::Byte(d) => line.strip_suffix(&[d]).unwrap_or(line),
            Self::Space => line,
        };
        Fields {
            delimiter: self,
            rest: Some(line),
        }
    }

    /// Parses the fields into `row`; fails at the first that is not a number.
    pub fn numbers(self, line: &[u8], row: &mut Vec<f64>) -> Result<(), String> {
        row.clear();
        for field in self.fields(line) {
            if row.len() == MAX_COLUMNS {
                return Err(TOO_MANY.into());
            }
            row.push(
                number(field).map_err(|problem| match decimal_comma(line, field) {
                    Some(word) => format!(
                        "{} has a decimal comma; write numbers with a decimal point, such as 1.5",
                        quoted(word)
                    ),
                    None => {
                        format!("{problem}; a row must hold numbers only, with a decimal point")
                    }
                })?,
            );
        }
        Ok(())
    }

    /// Column names in a line.
    pub fn names(self, line: &[u8]) -> Result<Vec<String>, String> {
        // Names may have spaces where tabs separate them.
        let delimiter = match self {
            Self::Space if line.contains(&b'\t') => Self::Byte(b'\t'),
            other => other,
        };
        let mut names: Vec<String> = Vec::new();
        for field in delimiter.fields(line) {
            let is_unit = delimiter == Self::Space && matches!(field, [b'[' | b'(', ..]);
            let text = String::from_utf8_lossy(field);
            if let Some(name) = names.last_mut().filter(|_| is_unit) {
                name.push_str(&text);
            } else if names.len() == MAX_COLUMNS {
                return Err(TOO_MANY.into());
            } else {
                names.push(text.replace("\"\"", "\""));
            }
        }
        Ok(names)
    }

    /// Whether a line can be one of column names: three fields or more, none of them a number, one with a letter.
    pub fn is_header(self, line: &[u8]) -> bool {
        let is_number = |field: &[u8]| number(field).is_ok() || is_decimal_comma(field);
        let has_letter =
            |field: &[u8]| !field.is_ascii() || field.iter().any(u8::is_ascii_alphabetic);
        self.fields(line).count() >= 3
            && !self.fields(line).any(is_number)
            && self.fields(line).any(has_letter)
    }
}

const TOO_MANY: &str = "more than 4096 columns; remove some";

/// Fields of a line, without surrounding white space and quotes.
pub(crate) struct Fields<'a> {
    delimiter: Delimiter,
    /// The rest of the line after the last field; `None` at its end.
    rest: Option<&'a [u8]>,
}

impl<'a> Iterator for Fields<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let line = self.rest?.trim_ascii_start();
        if self.delimiter == Delimiter::Space && line.is_empty() {
            self.rest = None;
            return None;
        }
        let end = |text: &[u8]| match self.delimiter {
            Delimiter::Space => text.iter().position(u8::is_ascii_whitespace),
            Delimiter::Byte(d) => memchr::memchr(d, text),
        };
        if let Some((field, after)) = split_quoted(line) {
            let gap = end(after).unwrap_or(after.len());
            if after[..gap].trim_ascii().is_empty() {
                self.rest = after.get(gap + 1..);
                return Some(field.trim_ascii());
            }
        }
        let length = end(line).unwrap_or(line.len());
        self.rest = line.get(length + 1..);
        Some(line[..length].trim_ascii())
    }
}

/// Splits a line that begins with a quoted text behind the closing quote. Two quotes stand for one.
fn split_quoted(line: &[u8]) -> Option<(&[u8], &[u8])> {
    let (&quote, text) = line
        .split_first()
        .filter(|(b, _)| matches!(b, b'"' | b'\''))?;
    let mut at = 0;
    loop {
        at += memchr::memchr(quote, &text[at..])?;
        if text.get(at + 1) != Some(&quote) {
            return Some((&text[..at], &text[at + 1..]));
        }
        at += 2;
    }
}

/// The number with a decimal comma because of which `field` of a row is not a number, if that is the reason.
fn decimal_comma<'a>(line: &'a [u8], field: &'a [u8]) -> Option<&'a [u8]> {
    if is_decimal_comma(field) {
        return Some(field);
    }
    let words = || {
        line.split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty())
    };
    let all = words().all(|word| number(word).is_ok() || is_decimal_comma(word));
    let mut commas = words().filter(|word| is_decimal_comma(word));
    commas.next().filter(|_| all && words().count() > 1)
}

fn is_decimal_comma(word: &[u8]) -> bool {
    let Some(at) = memchr::memchr(b',', word) else {
        return false;
    };
    let digit = |at: usize| word.get(at).is_some_and(u8::is_ascii_digit);
    let mut with_point = word.to_vec();
    with_point[at] = b'.';
    at > 0 && digit(at - 1) && digit(at + 1) && number(&with_point).is_ok()
}
