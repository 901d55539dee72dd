//! Counts passed, failed and skipped tests in the output of test runners.
//!
//! A test that cannot run on a machine (because data is missing, for example) prints a line that begins with `SKIPPED`
//! and returns. The runner counts it as passed; here it counts as skipped. pytest counts its skipped tests itself.

use std::collections::BTreeSet;

/// Counts over all test programs.
#[derive(Debug, Default, PartialEq)]
pub struct Tally {
    passed: usize,
    failed: usize,
    ignored: usize,
    /// Tests of the current program that printed a `SKIPPED` line.
    skipping: BTreeSet<String>,
    skipped: usize,
    lines: Vec<String>,
    /// The test whose output is being read, in the list of what passed.
    current: Option<String>,
    inside_successes: bool,
}

impl Tally {
    /// Reads a line. Returns whether to print it: of tests that passed, only `SKIPPED` lines are printed.
    pub fn read(&mut self, line: &str) -> bool {
        if let Some(counts) = line.strip_prefix("test result: ") {
            self.end_program(counts);
            return true;
        }
        match line {
            "successes:" => self.inside_successes = true,
            "failures:" => self.inside_successes = false,
            _ => {}
        }
        if let Some(name) = test_name(line) {
            self.current = Some(name.to_owned());
        }
        if line.trim_start().starts_with("SKIPPED") {
            self.skip(line.trim());
            return true;
        }
        !self.inside_successes
    }

    /// Reads a line of pytest: a `SKIPPED` line, or the last line with the counts.
    pub fn read_pytest(&mut self, line: &str) {
        if line.starts_with("SKIPPED") {
            self.lines.push(format!("{line}  [pytest]"));
        }
        let Some((counts, time)) = line.rsplit_once(" in ") else {
            return;
        };
        // `12 passed, 1 skipped in 83.20s (0:01:23)`, not a sentence with these words.
        let seconds = time
            .split(' ')
            .next()
            .and_then(|time| time.strip_suffix('s'));
        if seconds.is_some_and(|number| number.parse::<f64>().is_ok()) {
            let sum = |names: &[&str]| names.iter().map(|name| count(counts, name)).sum::<usize>();
            self.passed += sum(&["passed"]);
            self.failed += sum(&["failed", "error", "errors"]);
            self.ignored += sum(&["skipped", "xfailed"]);
        }
    }

    /// Number of tests, whatever their result.
    pub fn counted(&self) -> usize {
        self.passed + self.failed + self.ignored
    }

    /// Every `SKIPPED` line, with the test that printed it.
    pub fn skipped_lines(&self) -> Vec<String> {
        self.lines.clone()
    }

    /// `12 passed, 0 failed, 1 skipped`.
    pub fn summary(&self) -> String {
        // A test may print several such lines, and one that fails may have printed one as well.
        let passed = self.passed.saturating_sub(self.skipped);
        let skipped = self.ignored + self.skipped.min(self.passed);
        format!("{passed} passed, {} failed, {skipped} skipped", self.failed)
    }

    fn skip(&mut self, line: &str) {
        let test = self.current.clone().unwrap_or_default();
        // In the list of what failed, the test is counted by its failure.
        if self.inside_successes {
            self.skipping.insert(test.clone());
        }
        self.lines.push(format!("{line}  [{test}]"));
    }

    fn end_program(&mut self, counts: &str) {
        self.passed += count(counts, "passed");
        self.failed += count(counts, "failed");
        self.ignored += count(counts, "ignored");
        self.skipped += std::mem::take(&mut self.skipping).len();
        self.current = None;
        self.inside_successes = false;
    }
}

/// The `N` of `N passed;` or `N passed,` in a line of counts.
fn count(counts: &str, what: &str) -> usize {
    counts
        .split([';', ',', '.'])
        .filter_map(|part| part.trim().strip_suffix(what))
        .find_map(|number| number.trim().parse().ok())
        .unwrap_or(0)
}

/// The `a::b` of `---- a::b stdout ----`.
fn test_name(line: &str) -> Option<&str> {
    line.strip_prefix("---- ")?.strip_suffix(" stdout ----")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO_PROGRAMS: &str = "
running 4 tests
test io::reads ... ok
test shapes::fish ... ok
test slow ... ignored
test shapes::cow ... ok

successes:

---- io::reads stdout ----
a table

---- shapes::cow stdout ----
SKIPPED cow: no shared data here
SKIPPED wing: no shared data here


successes:
    io::reads
    shapes::cow

test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.02s

running 2 tests
test good ... ok
test bad ... FAILED

successes:

successes:
    good

failures:

---- bad stdout ----
thread 'bad' panicked at 1 + 1

failures:
    bad

test result: FAILED. 1 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.00s
";

    fn read(text: &str) -> (Tally, String) {
        let mut tally = Tally::default();
        let shown: Vec<&str> = text.lines().filter(|line| tally.read(line)).collect();
        (tally, shown.join("\n"))
    }

    #[test]
    fn a_test_with_a_skipped_line_is_not_counted_as_passed() {
        let (tally, _) = read(TWO_PROGRAMS);
        // Six tests: reads, fish and good passed; bad failed; slow and cow were left out.
        assert_eq!(tally.summary(), "3 passed, 1 failed, 2 skipped");
        assert_eq!(tally.counted(), 6);
    }

    #[test]
    fn each_skipped_line_is_kept_with_its_test() {
        let (tally, _) = read(TWO_PROGRAMS);
        let lines = tally.skipped_lines();
        assert_eq!(lines.len(), 2);
        assert!(lines[0].contains("cow: no shared data") && lines[0].contains("[shapes::cow]"));
    }

    #[test]
    fn failures_are_shown_and_the_output_of_successes_is_not() {
        let (_, shown) = read(TWO_PROGRAMS);
        assert!(shown.contains("panicked at 1 + 1"));
        assert!(shown.contains("SKIPPED wing"));
        assert!(!shown.contains("a table"));
    }

    #[test]
    fn the_counts_of_pytest_are_added() {
        let (mut tally, _) = read(TWO_PROGRAMS);
        for line in [
            "..s.F    [100%]",
            "SKIPPED [2] tests/test_torch.py:9: no torch",
            "2 passed in time",
            "1 failed, 4 passed, 2 skipped, 7 warnings, 1 error in 83.20s (0:01:23)",
        ] {
            tally.read_pytest(line);
        }
        assert_eq!(tally.summary(), "7 passed, 3 failed, 4 skipped");
        assert!(tally.skipped_lines()[2].contains("no torch"));
    }

    #[test]
    fn an_ignored_test_that_failed_nothing_leaves_the_count_at_zero() {
        assert_eq!(Tally::default().summary(), "0 passed, 0 failed, 0 skipped");
        assert_eq!(count("ok. 17 passed; 0 failed; 2 ignored", "passed"), 17);
        assert_eq!(count("nonsense", "passed"), 0);
    }
}
