//! Text from files in messages.

/// Number of characters of the longest line that [`printable`] returns.
pub const LONGEST_LINE: usize = 500;

/// A message as one line that can be printed to a terminal.
///
/// Control characters and marks that change the direction of writing are escaped (`\u{1b}`, `\n`): file names and the
/// content of files may hold sequences that move the cursor or look like another message. A line of more than
/// [`LONGEST_LINE`] characters is cut and ends in `…`.
pub fn printable(message: &str) -> String {
    let mut line = String::new();
    let mut length = 0;
    for character in message.chars() {
        let before = line.len();
        match needs_escape(character) {
            true => line.extend(character.escape_default()),
            false => line.push(character),
        }
        length += line[before..].chars().count();
        if length > LONGEST_LINE {
            let end = line.char_indices().nth(LONGEST_LINE - 1);
            line.truncate(end.map_or(line.len(), |(end, _)| end));
            line.push('…');
            break;
        }
    }
    line
}

fn needs_escape(character: char) -> bool {
    let turns = matches!(character, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || character.is_control()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_without_control_characters_stays() {
        for text in ["", "a.ply: 3 of 7 – φ, „Größe“, 点群 🐟"] {
            assert_eq!(printable(text), text);
        }
    }

    #[test]
    fn no_control_character_is_left() {
        let all: String = (0..0x3000).filter_map(char::from_u32).collect();
        for part in all.chars().collect::<Vec<_>>().chunks(40) {
            let text: String = part.iter().collect();
            let line = printable(&text);
            assert!(!line.contains(char::is_control), "{line:?}");
            assert!(!line.contains(['\u{202e}', '\u{2066}']), "{line:?}");
        }
        assert_eq!(printable("a\u{1b}[2J\nb\u{9b}c"), "a\\u{1b}[2J\\nb\\u{9b}c");
    }

    #[test]
    fn lines_are_cut_at_500_characters() {
        let exact = "ä".repeat(500);
        assert_eq!(printable(&exact), exact);
        for long in ["ä".repeat(501), "\u{1b}".repeat(500), "x".repeat(1 << 20)] {
            let line = printable(&long);
            assert_eq!(line.chars().count(), 500);
            assert!(line.ends_with('…'));
        }
    }
}
