//! A random permutation of 0 .. n - 1 that is computed one image at a time.

/// A permutation drawn by random keys: the swap-or-not shuffle. Each round pairs every number x with K - x (mod n) and
/// swaps the two or not, as a hash of the pair says; it needs no table, and no memory that grows with n.
///
/// V. T. Hoang, B. Morris, P. Rogaway, An enciphering scheme based on a card shuffle, CRYPTO 2012, 1-13.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Permutation {
    size: u64,
    rounds: Vec<Round>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Round {
    /// Uniform below the size.
    pivot: u64,
    key: u64,
}

/// Rounds of any permutation, and for every bit of the size: beyond 6 log2 n the shuffle of the paper is well mixed.
const ROUNDS: (u32, u32) = (32, 6);

impl Permutation {
    /// A permutation of `size` numbers, at least 1; `random` gives uniform 64-bit numbers.
    pub fn new(size: u64, random: &mut dyn FnMut() -> u64) -> Permutation {
        let bits = u64::BITS - size.leading_zeros();
        let round = |_| Round {
            pivot: below(size, random),
            key: random(),
        };
        Permutation {
            size,
            rounds: (0..ROUNDS.0 + ROUNDS.1 * bits).map(round).collect(),
        }
    }

    /// Image of a number below the size.
    pub fn image(&self, number: u64) -> u64 {
        let mut x = number;
        for Round { pivot, key } in &self.rounds {
            // pivot - x mod size, without leaving the range.
            let partner = if x <= *pivot {
                pivot - x
            } else {
                self.size - (x - pivot)
            };
            if mixed(x.max(partner) ^ key) & 1 == 1 {
                x = partner;
            }
        }
        x
    }
}

/// A uniform number below `size`, by rejection.
fn below(size: u64, random: &mut dyn FnMut() -> u64) -> u64 {
    let usable = u64::MAX - u64::MAX % size;
    loop {
        let x = random();
        if x < usable {
            return x % size;
        }
    }
}

/// The finaliser of SplitMix64, twice: every bit of the result depends on every bit of the argument.
///
/// G. L. Steele, D. Lea, C. H. Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
fn mixed(x: u64) -> u64 {
    let once = |mut z: u64| {
        z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    once(once(x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::collections::HashMap;

    fn drawn(size: u64, seed: u64) -> Permutation {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        Permutation::new(size, &mut || random.next_u64())
    }

    #[test]
    fn every_number_is_the_image_of_one() {
        for size in [1, 2, 3, 7, 64, 1000, 65_537] {
            let permutation = drawn(size, size);
            let mut seen = vec![false; size as usize];
            for x in 0..size {
                let image = &mut seen[permutation.image(x) as usize];
                assert!(!*image, "{size}: {x}");
                *image = true;
            }
        }
        let large = drawn(u64::MAX / 2, 1);
        assert!(large.image(u64::MAX / 2 - 1) < u64::MAX / 2);
    }

    #[test]
    fn small_permutations_are_equally_likely() {
        const DRAWS: u64 = 24_000;
        let mut counts: HashMap<Vec<u64>, u64> = HashMap::new();
        for seed in 0..DRAWS {
            let permutation = drawn(4, seed);
            let images: Vec<u64> = (0..4).map(|x| permutation.image(x)).collect();
            *counts.entry(images).or_default() += 1;
        }
        assert_eq!(counts.len(), 24);
        // Chi-square with 23 degrees of freedom: 49.7 is passed by chance once in a thousand.
        let expected = DRAWS as f64 / 24.0;
        let squares = counts.values().map(|n| (*n as f64 - expected).powi(2));
        let chi_square = squares.sum::<f64>() / expected;
        assert!(chi_square < 49.7, "{chi_square}");
    }

    #[test]
    fn neighbours_are_torn_apart() {
        // For a random permutation of n numbers the mean distance of the images of neighbours is (n + 1) / 3.
        let size = 100_000;
        let permutation = drawn(size, 3);
        let distance = |x: u64| permutation.image(x).abs_diff(permutation.image(x + 1)) as f64;
        let mean = (0..size - 1).map(distance).sum::<f64>() / (size - 1) as f64;
        assert!((mean / (size as f64 / 3.0) - 1.0).abs() < 0.01, "{mean}");
    }
}
