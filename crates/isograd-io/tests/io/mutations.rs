//! Valid files with random changes cause no panic and no memory use beyond their size.

use isograd_io::parse_field;

use crate::files::{self, parse_in_bounds, source};

/// Mutants of each valid file.
const CASES: usize = 4000;

/// xorshift64*: the same numbers on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, n: usize) -> usize {
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

#[test]
fn no_mutant_causes_a_panic_or_unbounded_memory() {
    for (number, (name, format, valid)) in files::valid_files().into_iter().enumerate() {
        let seed = 0x9e37_79b9_7f4a_7c15 ^ (number as u64 + 1);
        let mut random = Random(seed);
        for case in 0..CASES {
            let mut bytes = valid.clone();
            mutate(&mut bytes, &mut random);
            let source = source(&name, bytes);
            let outcome = std::panic::catch_unwind(|| {
                drop(parse_in_bounds(&source, format));
                drop(parse_field(&source, format));
            });
            assert!(
                outcome.is_ok(),
                "{name}, seed {seed:#x}, case {case} panicked"
            );
        }
    }
}
