//! Sums of harmonics as Taylor series at any phase.

use super::series::{COUNT, Polynomial};
use crate::numeric::periodic::Periodic;

/// A vector of Fourier series.
#[derive(Debug, Clone, Default)]
pub struct Harmonics {
    mean: Vec<f64>,
    terms: Vec<Term>,
}

/// One order in every component.
#[derive(Debug, Clone)]
struct Term {
    order: f64,
    cos: Vec<f64>,
    sin: Vec<f64>,
    /// w^k / k!, w: its frequency in the unit of time of the series.
    powers: Polynomial,
}

impl Harmonics {
    /// Zero in so many components.
    pub fn new(size: usize) -> Harmonics {
        Harmonics {
            mean: vec![0.0; size],
            terms: Vec::new(),
        }
    }

    /// Adds a multiple of a series to one component; a series that is no sum of harmonics adds nothing.
    pub fn add(&mut self, index: usize, factor: f64, series: &Periodic) {
        let Periodic::Fourier { mean, harmonics } = series else {
            return;
        };
        self.mean[index] += factor * mean;
        for h in harmonics {
            let term = self.term(h.order as f64);
            term.cos[index] += factor * h.cos;
            term.sin[index] += factor * h.sin;
        }
    }

    /// Adds a multiple of the derivative of another one with respect to the phase.
    pub fn add_derivative(&mut self, factor: f64, other: &Harmonics) {
        for t in &other.terms {
            let order = t.order;
            let term = self.term(order);
            for i in 0..t.cos.len() {
                term.cos[i] += factor * order * t.sin[i];
                term.sin[i] -= factor * order * t.cos[i];
            }
        }
    }

    fn term(&mut self, order: f64) -> &mut Term {
        let known = self.terms.iter().position(|t| t.order == order);
        let index = known.unwrap_or_else(|| {
            let zero = vec![0.0; self.mean.len()];
            self.terms.push(Term {
                order,
                cos: zero.clone(),
                sin: zero,
                powers: [0.0; COUNT],
            });
            self.terms.len() - 1
        });
        &mut self.terms[index]
    }

    /// Whether there is nothing but zero.
    pub fn is_zero(&self) -> bool {
        self.terms.is_empty() && self.mean.iter().all(|m| *m == 0.0)
    }

    /// Sum of |order + 1| times the amplitudes of a component, and its mean: bounds its values and its slope.
    pub fn size(&self, index: usize) -> f64 {
        let amplitude = |t: &Term| (t.order + 1.0) * (t.cos[index].abs() + t.sin[index].abs());
        self.mean[index].abs() + self.terms.iter().map(amplitude).sum::<f64>()
    }

    /// Sets the excitation frequency in the unit of time of the series.
    pub fn prepare(&mut self, frequency: f64) {
        for term in &mut self.terms {
            term.powers[0] = 1.0;
            for k in 1..COUNT {
                term.powers[k] = term.powers[k - 1] * term.order * frequency / k as f64;
            }
        }
    }

    /// Writes the Taylor coefficients of every component at a phase of the excitation.
    pub fn expand(&self, phase: f64, out: &mut [Polynomial]) {
        for (polynomial, mean) in out.iter_mut().zip(&self.mean) {
            *polynomial = [0.0; COUNT];
            polynomial[0] = *mean;
        }
        for term in &self.terms {
            let (s, c) = (term.order * phase).sin_cos();
            let (powers, _) = term.powers.as_chunks::<4>();
            for ((polynomial, cos), sin) in out.iter_mut().zip(&term.cos).zip(&term.sin) {
                if *cos == 0.0 && *sin == 0.0 {
                    continue;
                }
                let (even, odd) = (cos * c + sin * s, sin * c - cos * s);
                let pattern = [even, odd, -even, -odd];
                for (part, powers) in polynomial.as_chunks_mut::<4>().0.iter_mut().zip(powers) {
                    for k in 0..4 {
                        part[k] += pattern[k] * powers[k];
                    }
                }
            }
        }
    }
}
