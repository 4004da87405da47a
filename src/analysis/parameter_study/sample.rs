//! Random samples: distributions, Latin hypercubes, Monte Carlo; every run's values from its number alone.

use super::permutation::Permutation;
use crate::quantity::Quantity;
use indexmap::IndexMap;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::function::erf::{erfc, erfc_inv};
use std::f64::consts::SQRT_2;

/// Random values of parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// Sampling method.
    #[serde(default)]
    pub method: SamplingMethod,
    /// Number of runs.
    pub count: u64,
    /// Seed of the generator: the same seed gives the same values.
    pub seed: u64,
    /// Distributions by path.
    pub parameters: IndexMap<String, Distribution>,
}

/// Sampling method.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SamplingMethod {
    /// Latin hypercube: one value of every parameter in each of `count` equally likely intervals, paired at random.
    #[default]
    LatinHypercube,
    /// Independent random values.
    MonteCarlo,
}

/// Distribution of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Distribution {
    /// Shape of the distribution.
    pub distribution: Shape,
    /// Lower end of `uniform`, or lower truncation limit of the other distributions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub low: Option<Quantity>,
    /// Upper end or truncation limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub high: Option<Quantity>,
    /// Mean of the parameter before truncation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean: Option<Quantity>,
    /// Standard deviation of the parameter before truncation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deviation: Option<Quantity>,
}

/// Shape of a distribution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// Uniform between `low` and `high`.
    Uniform,
    /// Normal (Gaussian).
    Normal,
    /// Lognormal: for positive quantities.
    Lognormal,
}

/// A distribution ready for use: its inverse.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Inverse {
    /// low + (high - low) u.
    Uniform { low: f64, high: f64 },
    /// Gaussian with mean `mu` and standard deviation `sigma`, cut off at the standardised `range`.
    Normal {
        mu: f64,
        sigma: f64,
        range: (f64, f64),
        is_exponent: bool,
    },
}

impl Distribution {
    /// All quantities with their keys.
    pub(super) fn quantities(&self) -> impl Iterator<Item = (&'static str, &Quantity)> {
        let all = [
            ("low", &self.low),
            ("high", &self.high),
            ("mean", &self.mean),
            ("deviation", &self.deviation),
        ];
        all.into_iter()
            .filter_map(|(key, q)| Some((key, q.as_ref()?)))
    }

    /// The inverse of its distribution function, in the units of the values.
    ///
    /// # Errors
    /// Key and what is wrong with it.
    pub(super) fn inverse(&self) -> Result<Inverse, (&'static str, String)> {
        let value = |key, quantity: &Option<Quantity>| match quantity {
            Some(quantity) => Ok(quantity.value),
            None => Err((
                key,
                format!("missing: required by {:?}", self.distribution).to_lowercase(),
            )),
        };
        let low = self.low.as_ref().map_or(f64::NEG_INFINITY, |q| q.value);
        let high = self.high.as_ref().map_or(f64::INFINITY, |q| q.value);
        if low >= high {
            return Err(("high", format!("{high} must be above `low`, {low}")));
        }
        if self.distribution == Shape::Uniform {
            for (key, given) in [("mean", &self.mean), ("deviation", &self.deviation)] {
                if given.is_some() {
                    return Err((
                        key,
                        "a uniform distribution is given by `low` and `high`".into(),
                    ));
                }
            }
            let (low, high) = (value("low", &self.low)?, value("high", &self.high)?);
            return Ok(Inverse::Uniform { low, high });
        }
        let (mean, deviation) = (
            value("mean", &self.mean)?,
            value("deviation", &self.deviation)?,
        );
        if deviation <= 0.0 {
            return Err(("deviation", format!("{deviation} must be > 0")));
        }
        let inverse = if self.distribution == Shape::Normal {
            Inverse::normal((mean, deviation), (low, high), false)
        } else {
            if mean <= 0.0 {
                return Err((
                    "mean",
                    format!("{mean} must be > 0 for a lognormal distribution"),
                ));
            }
            // ln x is Gaussian with these moments when x has that mean and deviation.
            let variance = (deviation / mean).powi(2).ln_1p();
            let moments = (mean.ln() - 0.5 * variance, variance.sqrt());
            // Below 0 there is nothing to cut off.
            let range = (low.max(0.0).ln(), high.max(0.0).ln());
            Inverse::normal(moments, range, true)
        };
        match inverse {
            Inverse::Normal { range: (a, b), .. } if mass(a, b) <= 0.0 => {
                let message = "nothing of the distribution lies between `low` and `high`";
                Err((
                    if self.low.is_some() { "low" } else { "high" },
                    message.into(),
                ))
            }
            inverse => Ok(inverse),
        }
    }
}

impl Inverse {
    fn normal((mu, sigma): (f64, f64), (low, high): (f64, f64), is_exponent: bool) -> Inverse {
        Inverse::Normal {
            mu,
            sigma,
            range: ((low - mu) / sigma, (high - mu) / sigma),
            is_exponent,
        }
    }

    /// The ends of the distribution, where it has any.
    pub fn ends(&self) -> (Option<f64>, Option<f64>) {
        match *self {
            Inverse::Uniform { low, high } => (Some(low), Some(high)),
            Inverse::Normal {
                mu,
                sigma,
                range: (low, high),
                is_exponent,
            } => {
                let end = |z: f64| {
                    let x = mu + sigma * z;
                    let value = if is_exponent { x.exp() } else { x };
                    z.is_finite().then_some(value)
                };
                (end(low), end(high))
            }
        }
    }

    /// The value below which a share u of the distribution lies, 0 < u < 1.
    pub fn at(&self, u: f64) -> f64 {
        match *self {
            Inverse::Uniform { low, high } => low + (high - low) * u,
            Inverse::Normal {
                mu,
                sigma,
                range,
                is_exponent,
            } => {
                let x = mu + sigma * standard(range, u);
                if is_exponent { x.exp() } else { x }
            }
        }
    }
}

/// Share of the standard normal distribution below z.
fn below(z: f64) -> f64 {
    0.5 * erfc(-z / SQRT_2)
}

/// Share between a and b, in the lower tail where both are positive, so that it keeps its digits.
fn mass(a: f64, b: f64) -> f64 {
    if a > 0.0 {
        below(-a) - below(-b)
    } else {
        below(b) - below(a)
    }
}

/// Quantile of the standard normal distribution cut off at a and b.
fn standard((a, b): (f64, f64), u: f64) -> f64 {
    if a > 0.0 {
        return -standard((-b, -a), 1.0 - u);
    }
    let share = below(a) + u * mass(a, b);
    // Rounding must not carry a value over the ends.
    (-SQRT_2 * erfc_inv(2.0 * share)).clamp(a, b)
}

/// Uniform numbers of a sample, one for every run and parameter.
#[derive(Debug, Clone)]
pub(super) struct Draw {
    count: u64,
    seed: u64,
    /// One a parameter for Latin hypercubes, none for Monte Carlo.
    permutations: Vec<Permutation>,
}

impl Draw {
    /// For a number of parameters; `sample.count` is at least 1.
    pub fn new(sample: &Sample, parameters: usize) -> Draw {
        let count = sample.count;
        let permutation = |k: usize| {
            // Streams of values are even, those of permutations odd.
            let mut random = stream(sample.seed, 2 * k as u64 + 1);
            Permutation::new(count, &mut || random.next_u64())
        };
        let permutations = match sample.method {
            SamplingMethod::LatinHypercube => (0..parameters).map(permutation).collect(),
            SamplingMethod::MonteCarlo => Vec::new(),
        };
        Draw {
            count,
            seed: sample.seed,
            permutations,
        }
    }

    /// The number of one run and parameter, 0 < u < 1.
    pub fn uniform(&self, run: u64, parameter: usize) -> f64 {
        let mut random = stream(self.seed, 2 * parameter as u64);
        // A 64-bit number takes two words.
        random.set_word_pos(2 * u128::from(run));
        // 53 bits and a half: never 0, never 1.
        let u = ((random.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
        match self.permutations.get(parameter) {
            None => u,
            Some(permutation) => (permutation.image(run) as f64 + u) / self.count as f64,
        }
    }
}

fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    random
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distribution(text: &str) -> Distribution {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn quantiles_of_the_normal_distribution() {
        // Abramowitz & Stegun, table 26.1, and the far tail from mpmath.
        let normal = distribution(r#"{"distribution": "normal", "mean": 2, "deviation": 0.5}"#);
        let inverse = normal.inverse().unwrap();
        for (u, z) in [
            (0.5, 0.0),
            (0.841_344_746_068_542_9, 1.0),
            (0.977_249_868_051_820_8, 2.0),
            (0.025, -1.959_963_984_540_054),
            (1e-10, -6.361_340_902_404_056),
        ] {
            let found = (inverse.at(u) - 2.0) / 0.5;
            assert!((found - z).abs() < 1e-12, "{u}: {found}");
        }
    }

    #[test]
    fn truncated_distributions_keep_their_ends_and_digits() {
        // Far in the upper tail: the density falls like exp(-8 t), t the distance from 8.
        let (a, b) = (8.0, 9.0);
        assert_eq!(standard((a, b), 0.0), a);
        assert!((standard((a, b), 1.0) - b).abs() < 1e-9);
        let median = standard((a, b), 0.5);
        let share = (below(-a) - below(-median)) / mass(a, b);
        assert!((share - 0.5).abs() < 1e-9, "{median}: {share}");
        assert_eq!(standard((a, b), 0.5), -standard((-b, -a), 0.5));
    }

    #[test]
    fn lognormal_has_the_moments_that_were_asked_for() {
        let given = distribution(r#"{"distribution": "lognormal", "mean": 3, "deviation": 1.5}"#);
        let inverse = given.inverse().unwrap();
        // Midpoints of equally likely intervals: the tail beyond the last one is what is missing.
        let count = 200_000;
        let values = (0..count).map(|k| inverse.at((f64::from(k) + 0.5) / f64::from(count)));
        let values: Vec<f64> = values.collect();
        let mean = values.iter().sum::<f64>() / f64::from(count);
        let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        assert!((mean - 3.0).abs() < 1e-4, "{mean}");
        assert!(((square / f64::from(count)).sqrt() - 1.5).abs() < 2e-3);
    }

    #[test]
    fn a_latin_hypercube_meets_every_interval_once() {
        let sample = Sample {
            method: SamplingMethod::LatinHypercube,
            count: 1000,
            seed: 7,
            parameters: IndexMap::new(),
        };
        let draw = Draw::new(&sample, 2);
        let interval = |run, k| (draw.uniform(run, k) * 1000.0) as usize;
        for k in 0..2 {
            let mut seen = vec![0; 1000];
            (0..1000).for_each(|run| seen[interval(run, k)] += 1);
            assert!(seen.iter().all(|n| *n == 1));
        }
        // Independent parameters: the correlation of 1000 pairs has a standard deviation of 0.03.
        let centred = |run, k| draw.uniform(run, k) - 0.5;
        let sum: f64 = (0..1000).map(|run| centred(run, 0) * centred(run, 1)).sum();
        assert!((12.0 * sum / 1000.0).abs() < 0.12, "{sum}");
    }
}
