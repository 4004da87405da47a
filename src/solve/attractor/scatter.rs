//! Random initial states.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Moves a state at random within a box of half widths `widths`. Every stream of a seed has its own numbers.
pub(crate) fn scatter(seed: u64, stream: usize, widths: &[f64], state: &mut [f64]) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream as u64);
    for (x, width) in state.iter_mut().zip(widths) {
        *x += width * random.random_range(-1.0..=1.0);
    }
}
