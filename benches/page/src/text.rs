//! Sentences in Markdown, broken into lines, and numbers in them.

/// An item of a list, in lines of about as many letters as those of the code.
pub fn item(text: &str) -> String {
    const LETTERS: usize = 115;
    let mut lines = vec!["-".to_string()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if lines[last].chars().count() + word.chars().count() >= LETTERS {
            lines.push(format!("  {word}"));
        } else {
            lines[last].push(' ');
            lines[last].push_str(word);
        }
    }
    lines.push(String::new());
    lines.join("\n")
}

/// `50,000`.
pub fn thousands(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::item;

    #[test]
    fn lines_of_an_item_are_of_moderate_length_and_lose_no_word() {
        let text = "word ".repeat(100);
        let item = item(&text);
        assert!(item.lines().all(|line| line.len() <= 115));
        assert!(item.starts_with("- word") && item.ends_with("word\n"));
        assert_eq!(item.matches("word").count(), 100);
    }
}
