//! Valid files with bytes changed at random: never a panic, never memory beyond the file's size.

mod common;

use common::source;
use isograd_io::{parse_field, parse_geometry};
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Changed files for each valid one.
const CASES: usize = 4000;

/// xorshift64*: enough for picking bytes, and the same on every machine.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % n.max(1)
    }
}

/// Flips, overwrites, removes, repeats or cuts: one to four times.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = random.below(bytes.len());
        let end = (at + 1 + random.below(16)).min(bytes.len());
        match random.below(6) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at..end].fill([0x00, 0xff, b'9', b'-', b' ', b'\n'][random.below(6)]),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let copy = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, copy));
            }
            4 => bytes[at] = random.below(256) as u8,
            _ => bytes.truncate(at),
        }
    }
}

// One test, so that nothing else allocates while it counts.
#[test]
fn no_changed_file_panics_or_takes_memory_that_it_does_not_fill() {
    for (number, (name, format, valid)) in common::valid_files().into_iter().enumerate() {
        let seed = 0x9e37_79b9_7f4a_7c15 ^ (number as u64 + 1);
        let mut random = Random(seed);
        for case in 0..CASES {
            let mut bytes = valid.clone();
            mutate(&mut bytes, &mut random);
            let source = source(name, bytes);
            ALLOCATOR.reset_peak_usage();
            let before = ALLOCATOR.current_usage();
            let outcome = std::panic::catch_unwind(|| {
                drop(parse_geometry(&source, format));
                drop(parse_field(&source, format));
            });
            assert!(
                outcome.is_ok(),
                "{name}, seed {seed:#x}, case {case} panicked"
            );
            // The factor: one byte may become a number of 8 bytes, held twice; the constant: the
            // buffers of the unpacker.
            let used = ALLOCATOR.peak_usage().saturating_sub(before);
            let allowed = 64 * source.bytes.len() + (1 << 20);
            assert!(
                used <= allowed,
                "{name}, seed {seed:#x}, case {case}: {used} bytes"
            );
        }
    }
}
