//! Tables in Markdown, and numbers in them.

use std::fmt;

/// A table: a head and rows of cells. The first columns, as many as `labels`, are words.
pub struct Table {
    head: Vec<String>,
    labels: usize,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with no rows.
    pub fn new(labels: &[&str], numbers: impl IntoIterator<Item = String>) -> Self {
        let mut head: Vec<String> = labels.iter().map(|&label| label.into()).collect();
        head.extend(numbers);
        Self {
            head,
            labels: labels.len(),
            rows: Vec::new(),
        }
    }

    /// One more row.
    pub fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |", cells.join(" | "))
        };
        writeln!(f, "{}", line(&self.head))?;
        let rule = |column| if column < self.labels { "---" } else { "--:" };
        let rules: Vec<&str> = (0..self.head.len()).map(rule).collect();
        writeln!(f, "|{}|", rules.join("|"))?;
        for row in &self.rows {
            writeln!(f, "{}", line(row))?;
        }
        Ok(())
    }
}

/// Two or three digits that count, where there are not many zeros before them: `0.0132`, `0.28`, `5.6`, `28`.
pub fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let decimals = match value.abs() {
        size if size >= 10.0 => 0,
        size if size >= 1.0 => 1,
        size if size >= 0.1 => 2,
        _ => 4,
    };
    format!("{value:.decimals$}").replace('-', "−")
}

/// As many digits as asked for, but no fewer than stand before the point: `0.03812`, `3818`.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return number(value);
    }
    let before = value.abs().log10().floor() as i64 + 1;
    let decimals = (digits as i64 - before).max(0) as usize;
    format!("{value:.decimals$}").replace('-', "−")
}

/// A relative error in percent, with its sign.
pub fn percent(relative: f64) -> String {
    let percent = 100.0 * relative;
    let decimals = if percent.abs() < 0.095 { 3 } else { 2 };
    format!("{percent:+.decimals$}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_the_digits_that_count() {
        let shown = [0.0, 0.00312, 0.0132, 0.2812, 5.64, 27.9, -0.5, f64::NAN].map(number);
        let wanted = ["0", "0.0031", "0.0132", "0.28", "5.6", "28", "−0.50", "NaN"];
        assert_eq!(shown, wanted);
        assert_eq!(percent(-0.00019), "−0.019");
        assert_eq!(percent(0.1), "+10.00");
        let shown = [0.038_123, -381.759, 2093.18, 0.0].map(|x| significant(x, 4));
        assert_eq!(shown, ["0.03812", "−381.8", "2093", "0"]);
    }

    #[test]
    fn a_table_has_as_many_columns_in_every_line() {
        let mut table = Table::new(&["body"], ["|φ|".to_string(), "64".to_string()]);
        table.row(vec!["torus".into(), "1".into(), "2".into()]);
        assert_eq!(
            table.to_string(),
            "| body | \\|φ\\| | 64 |\n|---|--:|--:|\n| torus | 1 | 2 |\n"
        );
    }
}
