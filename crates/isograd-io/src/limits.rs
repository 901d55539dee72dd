//! Limits on the memory that a reader may use.

use std::cell::Cell;

/// Limits of the readers. Files may come from anywhere, and a few kilobytes can unpack to gigabytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Memory in bytes of the file and of everything that is read from it, numbers as `f64`. `None`: 64 times the size
    /// of the file, at least 64 MiB.
    pub memory: Option<u64>,
}

impl Limits {
    /// Memory in bytes that a reader may use for a file of `size` bytes.
    pub fn memory_for(&self, size: usize) -> u64 {
        const FACTOR: u64 = 64;
        const LEAST: u64 = 64 << 20;
        let default = (size as u64).saturating_mul(FACTOR).max(LEAST);
        self.memory.unwrap_or(default)
    }
}

/// Parses a size in bytes: a number, optionally followed by K, M, G or T (powers of 1024) and by B or iB, such as
/// `512M` or `1.5 GiB`.
///
/// # Errors
/// The problem, for a message.
pub fn parse_size(text: &str) -> Result<u64, String> {
    let wrong = || format!("'{text}' is not a size, such as 512M or 4G");
    let lower = text.trim().to_ascii_lowercase();
    let unit_at = lower.find(|c: char| !c.is_ascii_digit() && c != '.');
    let (number, unit) = lower.split_at(unit_at.unwrap_or(lower.len()));
    let shift = match unit.trim() {
        "" | "b" => 0,
        "k" | "kb" | "kib" => 10,
        "m" | "mb" | "mib" => 20,
        "g" | "gb" | "gib" => 30,
        "t" | "tb" | "tib" => 40,
        _ => return Err(wrong()),
    };
    let number: f64 = number.parse().map_err(|_| wrong())?;
    let bytes = number * (1u64 << shift) as f64;
    // Exact up to 2⁵³ bytes, far beyond any memory.
    (bytes >= 1.0 && bytes < u64::MAX as f64)
        .then_some(bytes as u64)
        .ok_or_else(wrong)
}

/// A size in bytes for a message.
pub(crate) fn size_text(bytes: u64) -> String {
    let units = ["bytes", "KiB", "MiB", "GiB", "TiB"];
    let mut size = bytes as f64;
    let mut unit = 0;
    while size >= 1024.0 && unit + 1 < units.len() {
        size /= 1024.0;
        unit += 1;
    }
    match unit == 0 || size.fract() == 0.0 {
        true => format!("{size} {}", units[unit]),
        false => format!("{size:.1} {}", units[unit]),
    }
}

/// Memory of a reader: the amount used so far, and its limit.
#[derive(Debug)]
pub(crate) struct Memory {
    limit: u64,
    used: Cell<u64>,
}

impl Memory {
    /// Memory of which a file of `size` bytes is already a part.
    pub fn new(limits: &Limits, size: usize) -> Self {
        Self {
            limit: limits.memory_for(size),
            used: Cell::new(size as u64),
        }
    }

    /// Counts `bytes` that are about to be allocated; the error is the problem.
    pub fn reserve(&self, bytes: usize) -> Result<(), String> {
        let needed = self.used.get().saturating_add(bytes as u64);
        if needed > self.limit {
            return Err(exceeded(needed, self.limit));
        }
        self.used.set(needed);
        Ok(())
    }

    /// Counts `bytes` as free again.
    pub fn release(&self, bytes: usize) {
        self.used.set(self.used.get().saturating_sub(bytes as u64));
    }

    /// `count` default values.
    pub fn filled<T: Clone + Default>(&self, count: usize) -> Result<Vec<T>, String> {
        let mut values = self.with_capacity(count)?;
        values.resize(count, T::default());
        Ok(values)
    }

    /// An empty vector with room for `capacity` values.
    pub fn with_capacity<T>(&self, capacity: usize) -> Result<Vec<T>, String> {
        let mut values = Vec::new();
        self.grow(&mut values, capacity)?;
        Ok(values)
    }

    /// Ensures that `more` values can be appended without an allocation. Capacities double, so that the work per value
    /// is constant.
    pub fn make_room<T>(&self, values: &mut Vec<T>, more: usize) -> Result<(), String> {
        const SMALLEST: usize = 16;
        if values.capacity() - values.len() >= more {
            return Ok(());
        }
        let doubled = values.capacity().saturating_mul(2).max(SMALLEST);
        self.grow(values, values.len().saturating_add(more).max(doubled))
    }

    fn grow<T>(&self, values: &mut Vec<T>, capacity: usize) -> Result<(), String> {
        // While the values move, both blocks are there.
        let old = values.capacity() * size_of::<T>();
        self.reserve(capacity.saturating_mul(size_of::<T>()))?;
        values
            .try_reserve_exact(capacity - values.len())
            .map_err(|e| format!("{e}; free some memory or reduce the file"))?;
        self.release(old);
        Ok(())
    }
}

pub(crate) fn exceeded(needed: u64, limit: u64) -> String {
    format!(
        "reading takes at least {} of memory, and the limit is {}; if the file is sound, raise the limit (--max-memory SIZE, max_memory in Python, Limits in Rust)",
        size_text(needed),
        size_text(limit)
    )
}
