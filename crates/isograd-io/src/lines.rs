//! Lines, words and numbers of text.

/// Lines of a text, numbered from 1, without line ends and surrounding white space. A line ends in `\n`, `\r\n` or `\r`.
#[derive(Clone)]
pub(crate) struct Lines<'a> {
    text: &'a [u8],
    /// Whether `\r` ends the first line: then a `\n` behind a `\r` is not part of the line end.
    carriage_returns: bool,
    /// Byte offset of the next line.
    pub offset: usize,
    /// Number of the last line returned.
    pub number: usize,
}

impl<'a> Lines<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        Self::from(text, 0, 0)
    }

    /// Lines from byte `offset` on, the first of which follows line `number`.
    pub fn from(text: &'a [u8], offset: usize, number: usize) -> Self {
        let end = memchr::memchr2(b'\n', b'\r', text);
        let end = end.map_or(&[][..], |at| &text[at..]);
        Self {
            text,
            carriage_returns: end.starts_with(b"\r") && !end.starts_with(b"\r\n"),
            offset: offset.min(text.len()),
            number,
        }
    }

    /// The next line that is not blank.
    pub fn next_filled(&mut self) -> Option<(usize, &'a [u8])> {
        self.find(|(_, line)| !line.is_empty())
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.offset >= self.text.len() {
            return None;
        }
        let rest = &self.text[self.offset..];
        let length = memchr::memchr2(b'\n', b'\r', rest).unwrap_or(rest.len());
        let is_pair = !self.carriage_returns && rest[length..].starts_with(b"\r\n");
        self.offset += length + if is_pair { 2 } else { 1 };
        self.number += 1;
        Some((self.number, rest[..length].trim_ascii()))
    }
}

/// Words of a line, separated by white space.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// Parses a decimal number; `nan` and `inf` count as numbers.
pub(crate) fn number(word: &[u8]) -> Result<f64, String> {
    let text = std::str::from_utf8(word).ok();
    text.and_then(|text| text.parse().ok())
        .ok_or_else(|| format!("{} is not a number", quoted(word)))
}

/// The first three numbers of a line.
pub(crate) fn coordinates<'a>(
    mut words: impl Iterator<Item = &'a [u8]>,
) -> Result<[f64; 3], String> {
    let mut v = [0.0; 3];
    for value in &mut v {
        *value = number(words.next().ok_or("the line has fewer than 3 numbers")?)?;
    }
    Ok(v)
}

/// A word in quotes for a message: shortened, without control characters.
pub(crate) fn quoted(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text: String = String::from_utf8_lossy(&word[..word.len().min(4 * LONGEST)])
        .chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .take(LONGEST)
        .collect();
    format!("'{text}'")
}
