//! Whether a grid fits into memory, before it is tried.

use crate::error::Error;

/// Arrays of one value per cell that a reconstruction holds at once: φ, χ, the closest triangles, and the
/// work space of the Fourier transform.
const FIELDS: f64 = 4.5;

const GIB: f64 = (1u64 << 30) as f64;

/// Refuses a grid that needs more memory than is free, where the system says how much that is.
///
/// # Errors
/// [`Error::Memory`].
pub fn check(shape: [usize; 3], bytes_per_value: usize) -> Result<(), Error> {
    let cells: f64 = shape.iter().map(|&n| n as f64).product();
    let needed = cells * FIELDS * bytes_per_value as f64 / GIB;
    match available() {
        Some(available) if needed > available => Err(Error::Memory {
            shape,
            needed,
            available,
        }),
        _ => Ok(()),
    }
}

/// Free memory in GiB, as Linux tells it; `None` elsewhere.
fn available() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text
        .lines()
        .find(|line| line.starts_with("MemAvailable:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024.0 / GIB)
}
