//! Mutations of files that know of headers, lines, words and numbers.

use std::ops::Range;

use crate::random::Random;

/// Largest size of a mutated file.
pub const MOST_BYTES: usize = 1 << 20;
/// Half of all mutations fall within this many first bytes, where headers are.
const HEADER: usize = 400;
/// Extreme numbers as text.
const TEXTS: &str = "0 -1 1 2 255 65536 2147483647 2147483648 -2147483648 4294967295 4294967296 \
    9223372036854775807 18446744073709551615 18446744073709551616 1e308 1e309 -1e-320 nan -inf 0x10 1,5 1e";
/// Extreme integers.
const INTEGERS: [i64; 8] = [
    0,
    1,
    -1,
    i64::MAX,
    i64::MIN,
    1 << 31,
    1 << 32,
    (1 << 31) - 1,
];
/// Extreme floating-point numbers.
const REALS: [f64; 6] = [f64::NAN, f64::INFINITY, -0.0, 1e308, 5e-324, -1e38];

/// A change of a file.
type Mutation = fn(&mut Editor);

/// Every kind of mutation, by name.
const KINDS: [(&str, Mutation); 16] = [
    ("flip a bit", Editor::flip),
    ("set a byte", Editor::set_byte),
    ("fill", Editor::fill),
    ("cut", Editor::cut),
    ("remove", Editor::remove),
    ("repeat", Editor::repeat),
    ("splice", Editor::splice),
    ("cross", Editor::cross),
    ("decimal number", Editor::decimal_number),
    ("binary number", Editor::binary_number),
    ("double a line", Editor::double_line),
    ("drop a line", Editor::drop_line),
    ("swap lines", Editor::swap_lines),
    ("number copies of a line", Editor::series),
    ("swap a word", Editor::word),
    ("pad", Editor::pad),
];

/// Applies one to eight mutations, some with parts of a second file, and returns their names.
pub fn mutate(bytes: &mut Vec<u8>, donor: &[u8], random: &mut Random) -> Vec<&'static str> {
    let most = if random.one_in(8) { 8 } else { 3 };
    let count = 1 + random.below(most);
    let mut editor = Editor {
        bytes: std::mem::take(bytes),
        donor: donor.to_vec(),
        random: random.clone(),
    };
    let mut applied = Vec::new();
    for _ in 0..count {
        let (name, mutation) = editor.random.pick(&KINDS);
        mutation(&mut editor);
        editor.bytes.truncate(MOST_BYTES);
        applied.push(name);
    }
    (*bytes, *random) = (editor.bytes, editor.random);
    applied
}

/// A file that is being mutated.
struct Editor {
    bytes: Vec<u8>,
    donor: Vec<u8>,
    random: Random,
}

/// A place in so many bytes, often in the header.
fn place(length: usize, random: &mut Random) -> usize {
    let whole = random.one_in(2);
    random.below(if whole { length } else { length.min(HEADER) })
}

/// A range that begins at such a place; empty only if there are no bytes.
fn range(length: usize, random: &mut Random) -> Range<usize> {
    let start = place(length, random);
    let longest = if random.one_in(4) { length } else { 16 };
    start..(start + 1 + random.below(longest)).min(length)
}

/// The part around the first byte at or after a random place that may begin it.
fn run(
    bytes: &[u8],
    random: &mut Random,
    is_start: fn(&u8) -> bool,
    is_part: fn(&u8) -> bool,
) -> Option<Range<usize>> {
    let from = place(bytes.len(), random);
    let at = from + bytes.get(from..)?.iter().position(is_start)?;
    let before = bytes[..at].iter().rev().take_while(|b| is_part(b)).count();
    let after = bytes[at..].iter().take_while(|b| is_part(b)).count();
    Some(at - before..at + after)
}

impl Editor {
    fn range(&mut self) -> Range<usize> {
        range(self.bytes.len(), &mut self.random)
    }

    /// The bytes from a random place on.
    fn rest(&mut self) -> &mut [u8] {
        let at = place(self.bytes.len(), &mut self.random);
        &mut self.bytes[at..]
    }

    /// A line with its end.
    fn line(&mut self) -> Range<usize> {
        let at = place(self.bytes.len(), &mut self.random);
        let (before, after) = self.bytes.split_at(at);
        let is_end = |b: &u8| *b == b'\n';
        let start = before.iter().rposition(is_end).map_or(0, |end| end + 1);
        let length = after
            .iter()
            .position(is_end)
            .map_or(after.len(), |end| end + 1);
        start..at + length
    }

    /// Number of copies of so many bytes: a few as a rule, now and then as many as fit.
    fn copies(&mut self, length: usize) -> usize {
        let fit = (MOST_BYTES / length.max(1)).max(1);
        let most = match self.random.below(64) {
            0 => fit,
            1..8 => fit.min(1000),
            _ => fit.min(4),
        };
        1 + self.random.below(most)
    }

    fn insert(&mut self, at: usize, new: Vec<u8>) {
        self.bytes.splice(at..at, new);
    }

    fn flip(&mut self) {
        let bit = 1 << self.random.below(8);
        self.rest().iter_mut().take(1).for_each(|byte| *byte ^= bit);
    }

    fn set_byte(&mut self) {
        let new = self.random.next() as u8;
        self.rest().iter_mut().take(1).for_each(|byte| *byte = new);
    }

    fn fill(&mut self) {
        let range = self.range();
        self.bytes[range].fill(self.random.pick(b"\x00\xff\x7f\x8009-., \t\n\r\"<"));
    }

    fn cut(&mut self) {
        let at = self.random.below(self.bytes.len());
        self.bytes.truncate(at);
    }

    fn remove(&mut self) {
        let range = self.range();
        self.bytes.drain(range);
    }

    fn repeat(&mut self) {
        let range = self.range();
        let copies = self.copies(range.len());
        self.insert(range.end, self.bytes[range].repeat(copies));
    }

    fn splice(&mut self) {
        let part = &self.donor[range(self.donor.len(), &mut self.random)];
        let start = place(self.bytes.len(), &mut self.random);
        let replaced = if self.random.one_in(2) { part.len() } else { 0 };
        let end = (start + replaced).min(self.bytes.len());
        self.bytes.splice(start..end, part.iter().copied());
    }

    /// The first part of this file and the last of the other.
    fn cross(&mut self) {
        let at = place(self.bytes.len(), &mut self.random);
        let from = match self.random.one_in(2) {
            true => at.min(self.donor.len()),
            false => place(self.donor.len(), &mut self.random),
        };
        self.bytes.truncate(at);
        self.bytes.extend_from_slice(&self.donor[from..]);
    }

    /// Replaces a number written in decimal by an extreme one, or by its neighbor or double.
    fn decimal_number(&mut self) {
        let is_part = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'e' | b'E');
        let Some(range) = run(&self.bytes, &mut self.random, u8::is_ascii_digit, is_part) else {
            return;
        };
        let old = String::from_utf8_lossy(&self.bytes[range.clone()]).parse::<u64>();
        let extreme: Vec<&str> = TEXTS.split_whitespace().collect();
        let new = match (self.random.below(4), old) {
            (0, Ok(n)) => n.wrapping_add(1).to_string(),
            (1, Ok(n)) => n.wrapping_sub(1).to_string(),
            (2, Ok(n)) => n.wrapping_mul(2).to_string(),
            (3, _) if self.random.one_in(16) => "7".repeat(1 + self.random.below(1000)),
            _ => self.random.pick(&extreme).into(),
        };
        self.bytes.splice(range, new.into_bytes());
    }

    /// Overwrites bytes with an extreme integer or floating-point number.
    fn binary_number(&mut self) {
        let real = self.random.pick(&REALS);
        let mut number = match self.random.below(3) {
            0 => real.to_le_bytes().to_vec(),
            1 => (real as f32).to_le_bytes().to_vec(),
            _ => self.random.pick(&INTEGERS).to_le_bytes()[..self.random.pick(&[1, 2, 4, 8])]
                .to_vec(),
        };
        if self.random.one_in(3) {
            number.reverse();
        }
        self.rest()
            .iter_mut()
            .zip(number)
            .for_each(|(byte, new)| *byte = new);
    }

    fn double_line(&mut self) {
        let range = self.line();
        self.insert(range.end, self.bytes[range].to_vec());
    }

    fn drop_line(&mut self) {
        let range = self.line();
        self.bytes.drain(range);
    }

    fn swap_lines(&mut self) {
        let mut lines = [self.line(), self.line()];
        lines.sort_by_key(|line| line.start);
        let [a, b] = lines;
        if a.end <= b.start {
            let parts = [b.clone(), a.end..b.start, a.clone()].map(|part| &self.bytes[part]);
            let swapped = parts.concat();
            self.bytes.splice(a.start..b.end, swapped);
        }
    }

    /// Copies of a line in which the last word has the number of the copy: many properties, columns or elements.
    fn series(&mut self) {
        let range = self.line();
        let text = String::from_utf8_lossy(self.bytes[range.clone()].trim_ascii_end()).into_owned();
        let copies = self.copies(range.len() + 6);
        let copies: String = (0..copies)
            .map(|number| format!("{text}{number}\n"))
            .collect();
        self.insert(range.end, copies.into_bytes());
    }

    /// Replaces a word by one of the other file.
    fn word(&mut self) {
        let is_part = |b: &u8| b.is_ascii_alphabetic() || *b == b'_';
        let mut find =
            |bytes: &[u8]| run(bytes, &mut self.random, u8::is_ascii_alphabetic, is_part);
        if let (Some(old), Some(new)) = (find(&self.bytes), find(&self.donor)) {
            self.bytes.splice(old, self.donor[new].iter().copied());
        }
    }

    /// Appends copies of one byte, which compress well.
    fn pad(&mut self) {
        let byte = self.random.next() as u8;
        let count = self.copies(1) * self.random.pick(&[1, 100]);
        self.bytes.extend(std::iter::repeat_n(byte, count));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &[u8] =
        b"ply\nformat ascii 1.0\nelement vertex 12\nproperty float x\nend_header\n0 1 2\n";
    const DONOR: &[u8] = b"solid thing\nfacet normal 0 0 1\nouter loop\n";

    fn edited(file: &[u8], donor: &[u8], seed: u64, mutation: Mutation) -> Vec<u8> {
        let mut editor = Editor {
            bytes: file.to_vec(),
            donor: donor.to_vec(),
            random: Random::new(seed, 0, 0),
        };
        mutation(&mut editor);
        editor.bytes
    }

    #[test]
    fn every_kind_changes_a_file_and_none_fails_on_an_empty_one() {
        for (name, mutation) in KINDS {
            assert!(
                (0..20).any(|seed| edited(FILE, DONOR, seed, mutation) != FILE),
                "{name}"
            );
            for seed in 0..20 {
                edited(&[], DONOR, seed, mutation);
                edited(FILE, &[], seed, mutation);
            }
        }
    }

    #[test]
    fn every_kind_is_reached_and_equal_seeds_give_equal_files() {
        let mutant = |number| {
            let mut bytes = FILE.to_vec();
            let names = mutate(&mut bytes, DONOR, &mut Random::new(1, 0, number));
            assert!(bytes.len() <= MOST_BYTES);
            (names, bytes)
        };
        let mut reached = std::collections::BTreeSet::new();
        for number in 0..500 {
            assert_eq!(mutant(number), mutant(number));
            reached.extend(mutant(number).0);
        }
        assert_eq!(reached.len(), KINDS.len());
        assert_ne!(mutant(1).1, mutant(2).1);
    }

    #[test]
    fn numbers_and_lines_are_changed_as_wholes() {
        for seed in 0..200 {
            let text = edited(b"count 1234 end", &[], seed, Editor::decimal_number);
            assert!(
                text.starts_with(b"count") && text.ends_with(b" end"),
                "{seed}"
            );
            let swapped = edited(FILE, &[], seed, Editor::swap_lines);
            let mut lines =
                [swapped.as_slice(), FILE].map(|b| b.split(|b| *b == b'\n').collect::<Vec<_>>());
            lines.iter_mut().for_each(|lines| lines.sort());
            assert_eq!(lines[0], lines[1], "{seed}");
        }
    }
}
