//! Periodic excitations as Taylor series at any phase.

use crate::numeric::periodic::Periodic;
use crate::numeric::taylor::{COUNT, Polynomial};

/// A step's place in the excitation: phases of the excitation within the turn that holds the middle of the stretch at hand.
#[derive(Debug, Clone, Copy)]
pub struct Instant {
    /// Where the series begins.
    pub phase: f64,
    /// A phase inside the stretch: it decides between the sides of a corner.
    pub middle: f64,
    /// Radians per unit of time of the series.
    pub rate: f64,
}

/// A vector of periodic functions: sums of harmonics, and what is a polynomial between its corners.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    mean: Vec<f64>,
    terms: Vec<Term>,
    broken: Vec<Broken>,
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

/// A multiple of a table or rectangle, or of its slope, in one component.
#[derive(Debug, Clone)]
struct Broken {
    index: usize,
    factor: f64,
    series: Periodic,
    part: Part,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Value,
    Slope,
}

impl Broken {
    fn expand(&self, at: &Instant, out: &mut Polynomial) {
        let slope = self.factor * self.series.derivative(at.middle);
        match self.part {
            Part::Slope => out[0] += slope,
            Part::Value => {
                let inside = self.factor * self.series.value(at.middle);
                out[0] += inside + slope * (at.phase - at.middle);
                out[1] += slope * at.rate;
            }
        }
    }
}

impl Sources {
    /// Zero in so many components.
    pub fn new(size: usize) -> Sources {
        Sources {
            mean: vec![0.0; size],
            ..Sources::default()
        }
    }

    /// Adds a multiple of a series to one component.
    pub fn add(&mut self, index: usize, factor: f64, series: &Periodic) {
        match series {
            Periodic::Fourier { mean, harmonics } => {
                self.mean[index] += factor * mean;
                for h in harmonics {
                    let term = self.term(h.order as f64);
                    term.cos[index] += factor * h.cos;
                    term.sin[index] += factor * h.sin;
                }
            }
            constant if constant.is_constant() => self.mean[index] += factor * constant.mean(),
            broken => self.broken.push(Broken {
                index,
                factor,
                series: broken.clone(),
                part: Part::Value,
            }),
        }
    }

    /// Adds a multiple of the derivative of another one with respect to the phase.
    pub fn add_derivative(&mut self, factor: f64, other: &Sources) {
        for t in &other.terms {
            let order = t.order;
            let term = self.term(order);
            for i in 0..t.cos.len() {
                term.cos[i] += factor * order * t.sin[i];
                term.sin[i] -= factor * order * t.cos[i];
            }
        }
        self.broken.extend(other.broken.iter().map(|b| Broken {
            factor: factor * b.factor,
            part: Part::Slope,
            ..b.clone()
        }));
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
        self.terms.is_empty() && self.broken.is_empty() && self.mean.iter().all(|m| *m == 0.0)
    }

    /// Bounds the values and the slope of a component: for harmonics the sum of |order + 1| times the amplitudes.
    pub fn size(&self, index: usize) -> f64 {
        let amplitude = |t: &Term| (t.order + 1.0) * (t.cos[index].abs() + t.sin[index].abs());
        let broken = self.broken.iter().filter(|b| b.index == index);
        let largest = |b: &Broken| b.factor.abs() * b.series.steepest();
        self.mean[index].abs()
            + self.terms.iter().map(amplitude).sum::<f64>()
            + broken.map(largest).sum::<f64>()
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

    /// Writes the Taylor coefficients of every component.
    pub fn expand(&self, at: &Instant, out: &mut [Polynomial]) {
        for (polynomial, mean) in out.iter_mut().zip(&self.mean) {
            *polynomial = [0.0; COUNT];
            polynomial[0] = *mean;
        }
        for term in &self.terms {
            let (s, c) = (term.order * at.phase).sin_cos();
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
        for broken in &self.broken {
            broken.expand(at, &mut out[broken.index]);
        }
    }
}
