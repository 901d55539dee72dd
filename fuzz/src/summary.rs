//! Counts of inputs and failures, and their table.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::case::{Case, Outcome, Part};

/// Failures of one kind that are printed in full.
const SHOWN: usize = 3;

/// Row of the summary: one reader, number type or kind of run.
#[derive(Debug, Default, PartialEq, Serialize)]
pub struct Row {
    name: &'static str,
    inputs: u64,
    accepted: u64,
    failures: u64,
    /// Largest live memory over size of the input.
    memory_ratio: f64,
    /// Largest time per byte, in ns.
    ns_per_byte: f64,
}

/// Counts of all parts.
#[derive(Debug, Default)]
pub struct Summary {
    rows: BTreeMap<(usize, &'static str), Row>,
    /// Number of failures of each kind.
    kinds: BTreeMap<String, usize>,
}

/// The form of the JSON file.
#[derive(Serialize)]
struct File<'a> {
    seed: u64,
    minutes: f64,
    parts: BTreeMap<&'static str, Vec<&'a Row>>,
}

impl Summary {
    /// Counts an outcome; prints its failure unless several of its kind were printed.
    pub fn add(&mut self, case: &Case, outcome: Outcome) {
        let name = outcome.row;
        let row = self.rows.entry((case.part as usize, name)).or_default();
        row.name = name;
        row.inputs += 1;
        row.accepted += u64::from(outcome.accepted);
        row.memory_ratio = row.memory_ratio.max(outcome.memory_ratio);
        row.ns_per_byte = row.ns_per_byte.max(outcome.ns_per_byte);
        if let Some(failure) = outcome.failure {
            row.failures += 1;
            let count = self.kinds.entry(kind(name, &failure)).or_default();
            *count += 1;
            if *count <= SHOWN {
                println!("FAILED {name}: {failure}\n  repeat: {case}");
            }
        }
    }

    /// Number of failures.
    pub fn failures(&self) -> u64 {
        self.rows.values().map(|row| row.failures).sum()
    }

    /// Table of all rows, and the number of failures of each kind.
    pub fn table(&self) -> String {
        let head = [
            "part",
            "input",
            "inputs",
            "accepted",
            "failures",
            "bytes/byte",
            "ns/byte",
        ];
        let mut lines = vec![line(head.map(String::from))];
        let ratio = |ratio: f64| match ratio > 0.0 {
            true => format!("{ratio:.1}"),
            false => "-".into(),
        };
        for (&(part, _), row) in &self.rows {
            lines.push(line([
                Part::ALL[part].name().into(),
                row.name.into(),
                row.inputs.to_string(),
                row.accepted.to_string(),
                row.failures.to_string(),
                ratio(row.memory_ratio),
                ratio(row.ns_per_byte),
            ]));
        }
        let kinds = self.kinds.iter();
        lines.extend(kinds.map(|(kind, count)| format!("{count} × {kind}")));
        lines.join("\n")
    }

    /// The rows as JSON, with one row a line.
    pub fn json(&self, seed: u64, minutes: f64) -> serde_json::Result<String> {
        let mut parts: BTreeMap<&'static str, Vec<&Row>> = BTreeMap::new();
        for (&(part, _), row) in &self.rows {
            parts.entry(Part::ALL[part].name()).or_default().push(row);
        }
        let file = File {
            seed,
            minutes,
            parts,
        };
        Ok(serde_json::to_string(&file)?.replace("{\"name\"", "\n{\"name\"") + "\n")
    }
}

fn line([part, input, numbers @ ..]: [String; 7]) -> String {
    let numbers = numbers.map(|number| format!("{number:>11}")).concat();
    format!("{part:8} {input:18}{numbers}")
}

/// A failure without its numbers and history, so that failures of one cause fall together.
fn kind(row: &str, failure: &str) -> String {
    let text = failure.split(['[', '"', '`']).next().unwrap_or_default();
    let text: String = text
        .chars()
        .filter(|c| !c.is_ascii_digit())
        .take(150)
        .collect();
    format!("{row}: {text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_of_one_kind_are_counted_together() {
        let mut summary = Summary::default();
        for number in 0..10 {
            let case = Case {
                part: Part::Readers,
                seed: 1,
                number,
            };
            let failure = (number < 4).then(|| format!("{number} bytes of memory [cut]"));
            let outcome = Outcome {
                row: "PLY",
                accepted: number % 2 == 0,
                memory_ratio: number as f64,
                failure,
                ..Outcome::default()
            };
            summary.add(&case, outcome);
        }
        assert_eq!(summary.failures(), 4);
        assert!(summary.table().contains("4 × PLY:  bytes of memory"));
        let json: serde_json::Value =
            serde_json::from_str(&summary.json(1, 0.5).expect("JSON")).expect("JSON");
        let row = &json["parts"]["readers"][0];
        assert_eq!((&row["inputs"], &row["accepted"]), (&10.into(), &5.into()));
        assert_eq!(
            (&row["memory_ratio"], &json["minutes"]),
            (&9.0.into(), &0.5.into())
        );
    }
}
