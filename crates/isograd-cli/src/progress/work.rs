//! Share of the work that is done, and time to go.

use std::time::{Duration, Instant};

/// Share of a part after which it is drawn as nearly done, however long it takes.
const NEARLY: f64 = 0.95;

/// Share of the predicted work that counts for the prediction until measured times outweigh it.
const TRUST: f64 = 0.1;

/// Work of a run: parts of known or equal amounts, for one cloud or several.
#[derive(Clone, Debug)]
pub struct Work {
    /// Predicted seconds of each part; empty if all parts are equal.
    predicted: Vec<(&'static str, f64)>,
    /// Sum over all parts: predicted seconds, or the number of equal parts.
    total: f64,
    /// Amount of the finished parts.
    done: f64,
    /// Amount of the current part.
    part: f64,
    /// Begin of the parts that count.
    begun: Instant,
    part_begun: Instant,
    /// Number of clouds, the clouds before this one, and the begin of the first.
    clouds: usize,
    cloud: usize,
    first_begun: Instant,
}

impl Work {
    /// Work of `parts` equal parts.
    pub fn new(parts: usize, now: Instant) -> Self {
        Self {
            predicted: Vec::new(),
            total: parts as f64,
            done: 0.0,
            part: 0.0,
            begun: now,
            part_begun: now,
            clouds: 1,
            cloud: 0,
            first_begun: now,
        }
    }

    /// Sets the parts still to come, with the seconds that each may take.
    pub fn expect(&mut self, parts: Vec<(&'static str, f64)>, now: Instant) {
        self.total = parts.iter().map(|(_, seconds)| seconds).sum();
        self.predicted = parts;
        (self.done, self.part) = (0.0, 0.0);
        (self.begun, self.part_begun) = (now, now);
    }

    /// Begins cloud `cloud`, from 0, of several.
    pub fn begin_cloud(&mut self, cloud: usize, clouds: usize, parts: usize, now: Instant) {
        let first_begun = self.first_begun;
        *self = Self {
            clouds,
            cloud,
            first_begun,
            ..Self::new(parts, now)
        };
    }

    /// Begins a part.
    pub fn begin(&mut self, name: &str, now: Instant) {
        let named = |part: &&(&'static str, f64)| part.0 == name;
        self.part = match self.predicted.is_empty() {
            true => 1.0,
            false => self.predicted.iter().find(named).map_or(0.0, |part| part.1),
        };
        self.part_begun = now;
    }

    /// Ends the current part.
    pub fn end(&mut self, now: Instant) {
        self.done += std::mem::take(&mut self.part);
        self.part_begun = now;
    }

    /// Share of the work that is done, from 0 to 1, and the time to go, where it can be told.
    pub fn progress(&self, now: Instant) -> (f64, Option<Duration>) {
        let (share, left) = self.progress_of_cloud(now);
        if self.clouds == 1 {
            return (
                share,
                left.and_then(|left| Duration::try_from_secs_f64(left).ok()),
            );
        }
        let share = (self.cloud as f64 + share) / self.clouds as f64;
        let left = seconds(self.first_begun, now) * (1.0 - share) / share;
        (share, Duration::try_from_secs_f64(left).ok())
    }

    /// `(k, n)`: cloud `k`, from 1, of `n`, where there are several.
    pub fn clouds(&self) -> Option<(usize, usize)> {
        (self.clouds > 1).then_some((self.cloud + 1, self.clouds))
    }

    fn progress_of_cloud(&self, now: Instant) -> (f64, Option<f64>) {
        let trusted = match self.predicted.is_empty() {
            true => 0.0,
            false => TRUST * self.total,
        };
        // Seconds per unit of work.
        let pace = (seconds(self.begun, self.part_begun) + trusted) / (self.done + trusted);
        if !(pace > 0.0) || !pace.is_finite() || !(self.total > 0.0) {
            return (0.0, None);
        }
        let inside = (seconds(self.part_begun, now) / pace).min(NEARLY * self.part);
        let done = (self.done + inside).min(self.total);
        (done / self.total, Some((self.total - done) * pace))
    }
}

fn seconds(from: Instant, to: Instant) -> f64 {
    to.saturating_duration_since(from).as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(start: Instant, seconds: f64) -> Instant {
        start + Duration::from_secs_f64(seconds)
    }

    #[test]
    fn predicted_parts_count_by_their_seconds() {
        let start = Instant::now();
        let mut work = Work::new(3, start);
        work.begin("read", start);
        assert_eq!(work.progress(after(start, 1.0)), (0.0, None));
        work.end(after(start, 1.0));
        let read = after(start, 1.0);
        work.expect(vec![("orient", 6.0), ("distance", 2.0)], read);
        work.begin("orient", read);
        let (share, left) = work.progress(after(read, 2.0));
        assert!((share - 0.25).abs() < 1e-9, "{share}");
        assert!((left.expect("known").as_secs_f64() - 6.0).abs() < 1e-6);
        // A part that takes longer never looks done.
        let (share, _) = work.progress(after(read, 100.0));
        assert!((share - 0.95 * 0.75).abs() < 1e-9, "{share}");
        work.end(after(read, 12.0));
        work.begin("distance", after(read, 12.0));
        let (share, left) = work.progress(after(read, 12.0));
        assert!((share - 0.75).abs() < 1e-9);
        // Twice as slow as predicted, of which a tenth of all is still trusted.
        let pace = (12.0 + 0.8) / (6.0 + 0.8);
        assert!((left.expect("known").as_secs_f64() - 2.0 * pace).abs() < 1e-6);
        work.end(after(read, 16.0));
        assert!((work.progress(after(read, 16.0)).0 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn equal_parts_have_no_time_to_go_before_the_first_is_done() {
        let start = Instant::now();
        let mut work = Work::new(4, start);
        work.begin("a", start);
        assert_eq!(work.progress(after(start, 1.0)), (0.0, None));
        work.end(after(start, 2.0));
        work.begin("b", after(start, 2.0));
        let (share, left) = work.progress(after(start, 3.0));
        assert!((share - 0.375).abs() < 1e-9, "{share}");
        assert!((left.expect("known").as_secs_f64() - 5.0).abs() < 1e-6);
    }

    #[test]
    fn clouds_count_as_equal_parts() {
        let start = Instant::now();
        let mut work = Work::new(1, start);
        assert_eq!(work.clouds(), None);
        work.begin_cloud(2, 4, 3, after(start, 6.0));
        assert_eq!(work.clouds(), Some((3, 4)));
        work.expect(vec![("orient", 1.0), ("distance", 1.0)], after(start, 6.0));
        work.begin("orient", after(start, 6.0));
        work.end(after(start, 7.5));
        let (share, left) = work.progress(after(start, 7.5));
        assert!((share - 0.625).abs() < 1e-9, "{share}");
        assert!((left.expect("known").as_secs_f64() - 4.5).abs() < 1e-6);
    }

    #[test]
    fn work_of_no_parts_is_no_division_by_zero() {
        let start = Instant::now();
        let mut work = Work::new(0, start);
        work.begin("a", start);
        work.expect(Vec::new(), start);
        work.end(start);
        assert_eq!(work.progress(after(start, 1.0)), (0.0, None));
    }
}
