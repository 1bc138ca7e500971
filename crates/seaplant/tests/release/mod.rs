//! Random seeds that a release draws anew, so that nothing can be tuned to them.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Draws so many seeds for a test; the same until the version changes.
pub fn seeds(test: &str, count: usize) -> Vec<u64> {
    let name = format!("{} {test}", env!("CARGO_PKG_VERSION"));
    let mut key = [0_u8; 32];
    for (k, byte) in name.bytes().enumerate() {
        key[k % 32] = key[k % 32].rotate_left(3) ^ byte;
    }
    let mut random = ChaCha8Rng::from_seed(key);
    (0..count).map(|_| u64::from(random.random::<u32>())).collect()
}
