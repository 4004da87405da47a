//! Periodic functions of one phase: loads, stiffness variation, transmission error.

use super::fraction::gcd;
use serde::{Deserialize, Serialize};

/// One harmonic: `cos` cos(order phase) + `sin` sin(order phase).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Harmonic {
    /// Order, >= 1.
    pub order: usize,
    /// Cosine part.
    pub cos: f64,
    /// Sine part.
    pub sin: f64,
}

/// A periodic function of the phase, period 2 pi.
#[derive(Debug, Clone, PartialEq)]
pub enum Periodic {
    /// mean + sum of harmonics.
    Fourier {
        /// Mean value.
        mean: f64,
        /// Harmonics, in any order.
        harmonics: Vec<Harmonic>,
    },
    /// Equally spaced values over one period of `base_order` times the phase, linear between them.
    Table {
        /// Values; the first one is at phase 0 and again at the end of the period.
        values: Vec<f64>,
        /// Periods of the table in one period of the phase.
        base_order: usize,
    },
    /// Values at ascending places of one period of `base_order` times the phase, linear between them and from the last one
    /// to the first one of the next period.
    Uneven {
        /// Places in periods of the table, in [0, 1).
        places: Vec<f64>,
        /// Values there.
        values: Vec<f64>,
        /// Periods of the table in one period of the phase.
        base_order: usize,
    },
    /// `high` for the share `duty` of the period that starts at `phase`, `low` else.
    Rectangular {
        /// Value of the first part.
        high: f64,
        /// Value of the second part.
        low: f64,
        /// Share of the first part, between 0 and 1.
        duty: f64,
        /// Where the first part begins [rad of the table's own phase].
        phase: f64,
        /// Periods of the pattern in one period of the phase.
        base_order: usize,
    },
}

const TAU: f64 = std::f64::consts::TAU;

impl Periodic {
    /// Greatest common divisor of the orders; 0 where nothing varies.
    pub(crate) fn common_order(&self) -> usize {
        match self {
            _ if self.is_constant() => 0,
            Periodic::Fourier { harmonics, .. } => {
                let moving = harmonics.iter().filter(|h| h.cos != 0.0 || h.sin != 0.0);
                moving.fold(0, |common, h| gcd(common, h.order))
            }
            Periodic::Table { base_order, .. }
            | Periodic::Uneven { base_order, .. }
            | Periodic::Rectangular { base_order, .. } => *base_order,
        }
    }

    /// Value at a phase.
    pub fn value(&self, phase: f64) -> f64 {
        match self {
            Periodic::Fourier { mean, harmonics } => harmonics.iter().fold(*mean, |sum, h| {
                let (s, c) = (h.order as f64 * phase).sin_cos();
                sum + h.cos * c + h.sin * s
            }),
            Periodic::Table { values, base_order } => {
                let (k, x) = table_cell(values.len(), *base_order, phase);
                values[k] + x * (values[(k + 1) % values.len()] - values[k])
            }
            Periodic::Uneven {
                places,
                values,
                base_order,
            } => {
                let (k, x, _) = uneven_cell(places, *base_order, phase);
                values[k] + x * (values[(k + 1) % values.len()] - values[k])
            }
            Periodic::Rectangular {
                high,
                low,
                duty,
                phase: begin,
                base_order,
            } => {
                let x = (*base_order as f64 * phase - begin).rem_euclid(TAU) / TAU;
                if x < *duty { *high } else { *low }
            }
        }
    }

    /// Derivative with respect to the phase; at a kink the value on its right.
    pub fn derivative(&self, phase: f64) -> f64 {
        match self {
            Periodic::Fourier { harmonics, .. } => harmonics.iter().fold(0.0, |sum, h| {
                let order = h.order as f64;
                let (s, c) = (order * phase).sin_cos();
                sum + order * (h.sin * c - h.cos * s)
            }),
            Periodic::Table { values, base_order } => {
                let (k, _) = table_cell(values.len(), *base_order, phase);
                let slope = values[(k + 1) % values.len()] - values[k];
                slope * values.len() as f64 * *base_order as f64 / TAU
            }
            Periodic::Uneven {
                places,
                values,
                base_order,
            } => {
                let (k, _, width) = uneven_cell(places, *base_order, phase);
                let slope = (values[(k + 1) % values.len()] - values[k]) / width;
                slope * *base_order as f64 / TAU
            }
            Periodic::Rectangular { .. } => 0.0,
        }
    }

    /// Second derivative with respect to the phase, between the kinks.
    pub(crate) fn second_derivative(&self, phase: f64) -> f64 {
        match self {
            Periodic::Fourier { harmonics, .. } => harmonics.iter().fold(0.0, |sum, h| {
                let order = h.order as f64;
                let (s, c) = (order * phase).sin_cos();
                sum - order * order * (h.cos * c + h.sin * s)
            }),
            Periodic::Table { .. } | Periodic::Uneven { .. } | Periodic::Rectangular { .. } => 0.0,
        }
    }

    /// Mean over a period.
    pub fn mean(&self) -> f64 {
        match self {
            Periodic::Fourier { mean, .. } => *mean,
            Periodic::Table { values, .. } => values.iter().sum::<f64>() / values.len() as f64,
            Periodic::Uneven { places, values, .. } => (0..values.len())
                .map(|k| 0.5 * (values[k] + values[(k + 1) % values.len()]) * gap(places, k))
                .sum(),
            Periodic::Rectangular {
                high, low, duty, ..
            } => duty * high + (1.0 - duty) * low,
        }
    }

    /// Bound on the distance from the mean.
    pub fn swing(&self) -> f64 {
        let mean = self.mean();
        let farthest = |values: &[f64]| values.iter().fold(0.0_f64, |m, x| m.max((x - mean).abs()));
        match self {
            Periodic::Fourier { harmonics, .. } => {
                harmonics.iter().map(|h| h.cos.hypot(h.sin)).sum()
            }
            Periodic::Table { values, .. } | Periodic::Uneven { values, .. } => farthest(values),
            Periodic::Rectangular { high, low, .. } => farthest(&[*high, *low]),
        }
    }

    /// Periods of a table or of a pattern in one period of the phase; 1 for harmonics.
    pub fn turns(&self) -> usize {
        match self {
            Periodic::Fourier { .. } => 1,
            Periodic::Table { base_order, .. }
            | Periodic::Uneven { base_order, .. }
            | Periodic::Rectangular { base_order, .. } => *base_order,
        }
    }

    /// Phases in [0, 2 pi) where the function or its derivative is not smooth, ascending.
    pub fn kinks(&self) -> Vec<f64> {
        let mut list = match self {
            Periodic::Fourier { .. } => Vec::new(),
            Periodic::Table { values, base_order } => {
                let count = values.len() * base_order;
                (0..count).map(|k| k as f64 * TAU / count as f64).collect()
            }
            Periodic::Uneven {
                places, base_order, ..
            } => (0..*base_order)
                .flat_map(|m| {
                    places
                        .iter()
                        .map(move |x| (x + m as f64) * TAU / *base_order as f64)
                })
                .collect(),
            Periodic::Rectangular {
                duty,
                phase,
                base_order,
                ..
            } => (0..*base_order)
                .flat_map(|k| {
                    [0.0, *duty].map(|x| (phase + TAU * (x + k as f64)) / *base_order as f64)
                })
                .map(|x| x.rem_euclid(TAU))
                .collect(),
        };
        list.sort_by(f64::total_cmp);
        list
    }

    /// The same function with every value multiplied.
    pub fn scaled(&self, factor: f64) -> Periodic {
        let mut copy = self.clone();
        match &mut copy {
            Periodic::Fourier { mean, harmonics } => {
                *mean *= factor;
                for h in harmonics {
                    h.cos *= factor;
                    h.sin *= factor;
                }
            }
            Periodic::Table { values, .. } | Periodic::Uneven { values, .. } => {
                values.iter_mut().for_each(|v| *v *= factor);
            }
            Periodic::Rectangular { high, low, .. } => {
                *high *= factor;
                *low *= factor;
            }
        }
        copy
    }

    /// The same function with a constant added.
    pub fn plus(&self, constant: f64) -> Periodic {
        let mut copy = self.clone();
        match &mut copy {
            Periodic::Fourier { mean, .. } => *mean += constant,
            Periodic::Table { values, .. } | Periodic::Uneven { values, .. } => {
                values.iter_mut().for_each(|v| *v += constant);
            }
            Periodic::Rectangular { high, low, .. } => {
                *high += constant;
                *low += constant;
            }
        }
        copy
    }

    /// The function of (phase - delay).
    pub fn delayed(&self, delay: f64) -> Periodic {
        match self {
            Periodic::Fourier { mean, harmonics } => {
                let turned = harmonics.iter().map(|h| {
                    let (s, c) = (h.order as f64 * delay).sin_cos();
                    Harmonic {
                        order: h.order,
                        cos: h.cos * c - h.sin * s,
                        sin: h.cos * s + h.sin * c,
                    }
                });
                Periodic::Fourier {
                    mean: *mean,
                    harmonics: turned.collect(),
                }
            }
            Periodic::Table { values, base_order } => {
                let even = (0..values.len()).map(|k| k as f64 / values.len() as f64);
                turned_table(even.collect(), values, (*base_order, delay))
            }
            Periodic::Uneven {
                places,
                values,
                base_order,
            } => turned_table(places.clone(), values, (*base_order, delay)),
            Periodic::Rectangular {
                high,
                low,
                duty,
                phase,
                base_order,
            } => Periodic::Rectangular {
                high: *high,
                low: *low,
                duty: *duty,
                phase: phase + *base_order as f64 * delay,
                base_order: *base_order,
            },
        }
    }

    /// Whether the function changes otherwise than by jumps.
    pub(crate) fn varies_smoothly(&self) -> bool {
        !self.is_constant() && !matches!(self, Periodic::Rectangular { .. })
    }

    /// A bound on the modulus.
    pub fn largest(&self) -> f64 {
        match self {
            Periodic::Fourier { mean, harmonics } => {
                let amplitudes = harmonics.iter().map(|h| h.cos.hypot(h.sin));
                mean.abs() + amplitudes.sum::<f64>()
            }
            Periodic::Table { values, .. } | Periodic::Uneven { values, .. } => {
                values.iter().fold(0.0, |m, v| m.max(v.abs()))
            }
            Periodic::Rectangular { high, low, .. } => high.abs().max(low.abs()),
        }
    }

    /// Largest value and slope together, roughly.
    pub(crate) fn steepest(&self) -> f64 {
        match self {
            Periodic::Fourier { mean, harmonics } => harmonics.iter().fold(mean.abs(), |sum, h| {
                sum + h.order as f64 * (h.cos.abs() + h.sin.abs())
            }),
            Periodic::Table { values, base_order } => {
                self.largest() * (1.0 + (values.len() * base_order) as f64)
            }
            Periodic::Uneven {
                places, base_order, ..
            } => {
                let least = (0..places.len())
                    .map(|k| gap(places, k))
                    .fold(1.0, f64::min);
                self.largest() * (1.0 + *base_order as f64 / least)
            }
            Periodic::Rectangular { .. } => self.largest(),
        }
    }

    /// Whether the function is the same at every phase.
    pub(crate) fn is_constant(&self) -> bool {
        match self {
            Periodic::Fourier { harmonics, .. } => {
                harmonics.iter().all(|h| h.cos == 0.0 && h.sin == 0.0)
            }
            Periodic::Table { values, .. } | Periodic::Uneven { values, .. } => {
                values.iter().all(|v| v == &values[0])
            }
            Periodic::Rectangular {
                high, low, duty, ..
            } => high == low || *duty == 0.0 || *duty == 1.0,
        }
    }
}

/// A table whose places are moved by a delay.
fn turned_table(places: Vec<f64>, values: &[f64], (base_order, delay): (usize, f64)) -> Periodic {
    let turn = base_order as f64 * delay / TAU;
    let mut list: Vec<(f64, f64)> = (places.into_iter().zip(values))
        .map(|(x, y)| ((x + turn).rem_euclid(1.0) % 1.0, *y))
        .collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    Periodic::Uneven {
        places: list.iter().map(|p| p.0).collect(),
        values: list.iter().map(|p| p.1).collect(),
        base_order,
    }
}

/// Distance from a place to the next one.
fn gap(places: &[f64], k: usize) -> f64 {
    match places.get(k + 1) {
        Some(next) => next - places[k],
        None => 1.0 + places[0] - places[k],
    }
}

/// Cell of an uneven table, the position in it, 0..1, and its width.
fn uneven_cell(places: &[f64], base_order: usize, phase: f64) -> (usize, f64, f64) {
    let x = (base_order as f64 * phase).rem_euclid(TAU) / TAU;
    let above = places.partition_point(|p| *p <= x);
    let (k, from) = match above {
        0 => (places.len() - 1, places[places.len() - 1] - 1.0),
        k => (k - 1, places[k - 1]),
    };
    let width = gap(places, k);
    (k, (x - from) / width, width)
}

/// Cell of a table and the position in it, 0..1.
fn table_cell(len: usize, base_order: usize, phase: f64) -> (usize, f64) {
    let x = (base_order as f64 * phase).rem_euclid(TAU) / TAU * len as f64;
    let k = (x as usize).min(len - 1);
    (k, x - k as f64)
}
