//! Periodic excitations as Taylor series at any phase.

use crate::numeric::broken_line::BrokenLine;
use crate::numeric::growth::Growth;
use crate::numeric::periodic::Periodic;
use crate::numeric::taylor::{COUNT, Polynomial, convolve};

/// A step's place in the excitation: phases of the excitation within the turn that holds the middle of the stretch at hand.
#[derive(Debug, Clone, Copy)]
pub struct Instant {
    /// Start of the series.
    pub phase: f64,
    /// A phase inside the stretch: it decides between the sides of a corner.
    pub middle: f64,
    /// Radians per unit of time of the series.
    pub rate: f64,
    /// Growth of that rate per unit of time of the series; 0 where the excitation turns evenly.
    pub change: f64,
    /// Place in the course of speed, if there is one.
    pub course: Option<CoursePosition>,
}

/// A place in a course of speed.
#[derive(Debug, Clone, Copy)]
pub struct CoursePosition {
    /// Phase at the begin of the step, full turns included: what an order that is not a whole number sees.
    pub phase: f64,
    /// Time at the begin of the step and inside the stretch, omega_c t.
    pub time: (f64, f64),
    /// Unit of time of the series.
    pub unit: f64,
    /// Speed of the reference over omega_c inside the stretch.
    pub speed: f64,
    /// Revolutions of the reference in a turn of the phase.
    pub revolutions: f64,
}

impl Instant {
    /// The phase of an order as a series: cos and sin.
    ///
    /// ```text
    /// (k + 1) c_(k+1) = -(w s_k + a s_(k-1)),    (k + 1) s_(k+1) = w c_k + a c_(k-1)
    /// ```
    fn waves(&self, order: f64) -> [Polynomial; 2] {
        let (w, a) = (order * self.rate, order * self.change);
        let phase = match &self.course {
            Some(place) if order.fract() != 0.0 => place.phase,
            _ => self.phase,
        };
        let (mut c, mut s) = ([0.0; COUNT], [0.0; COUNT]);
        (s[0], c[0]) = (order * phase).sin_cos();
        (c[1], s[1]) = (-w * s[0], w * c[0]);
        for k in 1..COUNT - 1 {
            let share = 1.0 / (k + 1) as f64;
            c[k + 1] = -share * (w * s[k] + a * s[k - 1]);
            s[k + 1] = share * (w * c[k] + a * c[k - 1]);
        }
        [c, s]
    }
}

/// Factor of a source.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Factor {
    /// 1.
    One,
    /// The rate of the phase over omega_c.
    Rate,
    /// Its square.
    Square,
    /// The rate of that rate, over omega_c^2.
    Change,
    /// An amplitude that depends on the speed.
    Growth(Growth),
}

impl Factor {
    /// Its value where the excitation turns evenly, from the rate of the phase over omega_c and the revolutions in a turn.
    fn steady(&self, frequency: f64, revolutions: f64) -> f64 {
        match self {
            Factor::One => 1.0,
            Factor::Rate => frequency,
            Factor::Square => frequency * frequency,
            Factor::Change => 0.0,
            Factor::Growth(growth) => growth.factor(frequency * revolutions),
        }
    }

    /// Its series along a course.
    fn expand(&self, at: &Instant, place: &CoursePosition, out: &mut Polynomial) {
        let per_time = 1.0 / place.unit;
        match self {
            Factor::One => {
                *out = [0.0; COUNT];
                out[0] = 1.0;
            }
            Factor::Rate => {
                *out = [0.0; COUNT];
                (out[0], out[1]) = (at.rate * per_time, at.change * per_time);
            }
            Factor::Square => {
                let (w, a) = (at.rate * per_time, at.change * per_time);
                *out = [0.0; COUNT];
                (out[0], out[1], out[2]) = (w * w, 2.0 * w * a, a * a);
            }
            Factor::Change => {
                *out = [0.0; COUNT];
                out[0] = at.change * per_time * per_time;
            }
            Factor::Growth(growth) => {
                let factor = place.revolutions * per_time;
                growth.expand((at.rate * factor, at.change * factor), place.speed, out);
            }
        }
    }
}

/// A vector of periodic functions: sums of harmonics, and what is a polynomial between its corners.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    mean: Vec<f64>,
    terms: Vec<Term>,
    broken: Vec<Broken>,
    lines: Vec<ForcingTerm>,
}

/// A multiple of a function of time in one component.
#[derive(Debug, Clone)]
struct ForcingTerm {
    index: usize,
    factor: f64,
    line: BrokenLine,
}

/// One order in every component.
#[derive(Debug, Clone)]
pub(crate) struct Term {
    pub order: f64,
    factor: Factor,
    /// The factor where the excitation turns evenly.
    pub scale: f64,
    pub cos: Vec<f64>,
    pub sin: Vec<f64>,
    /// w^k / k!, w: its frequency in the unit of time of the series.
    pub powers: Polynomial,
}

/// A multiple of a table or rectangle, or of its slope, in one component.
#[derive(Debug, Clone)]
struct Broken {
    index: usize,
    factor: f64,
    series: Periodic,
    part: ForcingPart,
    /// Rate of the phase over omega_c where the excitation turns evenly.
    frequency: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ForcingPart {
    Value,
    Slope,
    Acceleration,
}

impl Broken {
    fn expand(&self, at: &Instant, out: &mut Polynomial) {
        let slope = self.factor * self.series.derivative(at.middle);
        match self.part {
            ForcingPart::Slope => match at.course {
                None => out[0] += slope * self.frequency,
                Some(place) => {
                    out[0] += slope * at.rate / place.unit;
                    out[1] += slope * at.change / place.unit;
                }
            },
            ForcingPart::Acceleration => match at.course {
                None => out[0] += slope * self.frequency * self.frequency,
                Some(place) => {
                    let [w, a] = [at.rate / place.unit, at.change / place.unit];
                    let change = a / place.unit;
                    let inside = self.factor * self.series.value(at.middle);
                    let value = inside + slope * (at.phase - at.middle);
                    out[0] += slope * w * w + change * value;
                    out[1] += 2.0 * slope * w * a + change * slope * at.rate;
                    out[2] += slope * a * a + 0.5 * change * slope * at.change;
                }
            },
            ForcingPart::Value => {
                let inside = self.factor * self.series.value(at.middle);
                out[0] += inside + slope * (at.phase - at.middle);
                out[1] += slope * at.rate;
                out[2] += 0.5 * slope * at.change;
            }
        }
    }
}

impl Sources {
    /// Zero, with a number of components.
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
                    let term = self.term(h.order as f64, &Factor::One);
                    term.cos[index] += factor * h.cos;
                    term.sin[index] += factor * h.sin;
                }
            }
            constant if constant.is_constant() => self.mean[index] += factor * constant.mean(),
            broken => self.broken.push(Broken {
                index,
                factor,
                series: broken.clone(),
                part: ForcingPart::Value,
                frequency: 0.0,
            }),
        }
    }

    /// Adds a multiple of the rate of a series, d/d(omega_c t), to one component.
    pub(crate) fn add_rate(&mut self, index: usize, factor: f64, series: &Periodic) {
        match series {
            Periodic::Fourier { harmonics, .. } => {
                for h in harmonics {
                    let order = h.order as f64;
                    let term = self.term(order, &Factor::Rate);
                    term.cos[index] += factor * order * h.sin;
                    term.sin[index] -= factor * order * h.cos;
                }
            }
            constant if constant.is_constant() => {}
            broken => self.broken.push(Broken {
                index,
                factor,
                series: broken.clone(),
                part: ForcingPart::Slope,
                frequency: 0.0,
            }),
        }
    }

    /// Adds a multiple of the rate, d/d(omega_c t), of a series times the rate of the phase to one component.
    pub(crate) fn add_acceleration(&mut self, index: usize, factor: f64, series: &Periodic) {
        match series {
            Periodic::Fourier { mean, harmonics } => {
                let own = self.term(0.0, &Factor::Change);
                own.cos[index] += factor * mean;
                for h in harmonics {
                    let order = h.order as f64;
                    let term = self.term(order, &Factor::Square);
                    term.cos[index] += factor * order * h.sin;
                    term.sin[index] -= factor * order * h.cos;
                    let term = self.term(order, &Factor::Change);
                    term.cos[index] += factor * h.cos;
                    term.sin[index] += factor * h.sin;
                }
            }
            broken => self.broken.push(Broken {
                index,
                factor,
                series: broken.clone(),
                part: ForcingPart::Acceleration,
                frequency: 0.0,
            }),
        }
    }

    /// Adds a multiple of harmonics of a phase `ratio` times as fast, whose amplitude depends on the speed.
    pub(crate) fn add_orders(
        &mut self,
        index: usize,
        factor: f64,
        (series, ratio): (&Periodic, f64),
        growth: &Growth,
    ) {
        let Periodic::Fourier { mean, harmonics } = series else {
            return;
        };
        if *mean != 0.0 {
            let term = self.term(0.0, &Factor::Growth(growth.clone()));
            term.cos[index] += factor * mean;
        }
        for h in harmonics {
            let order = h.order as f64 * ratio;
            let term = self.term(order, &Factor::Growth(growth.clone()));
            term.cos[index] += factor * h.cos;
            term.sin[index] += factor * h.sin;
        }
    }

    /// Adds a multiple of a function of omega_c t.
    pub(crate) fn add_line(&mut self, index: usize, factor: f64, line: &BrokenLine) {
        self.lines.push(ForcingTerm {
            index,
            factor,
            line: line.clone(),
        });
    }

    fn term(&mut self, order: f64, factor: &Factor) -> &mut Term {
        let known = (self.terms.iter()).position(|t| t.order == order && t.factor == *factor);
        let index = known.unwrap_or_else(|| {
            let zero = vec![0.0; self.mean.len()];
            self.terms.push(Term {
                order,
                factor: factor.clone(),
                scale: 1.0,
                cos: zero.clone(),
                sin: zero,
                powers: [0.0; COUNT],
            });
            self.terms.len() - 1
        });
        &mut self.terms[index]
    }

    /// Whether there is nothing but zero.
    pub(crate) fn is_zero(&self) -> bool {
        self.terms.is_empty()
            && self.broken.is_empty()
            && self.lines.is_empty()
            && self.mean.iter().all(|m| *m == 0.0)
    }

    /// Means and harmonics where there is nothing else.
    pub fn harmonics(&self) -> Option<(&[f64], &[Term])> {
        let is_plain = self.broken.is_empty() && self.lines.is_empty();
        is_plain.then_some((&self.mean, &self.terms))
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

    /// Sets the excitation frequency over omega_c, the unit of time of the series and the revolutions in a turn.
    pub fn prepare(&mut self, excitation: f64, unit: f64, revolutions: f64) {
        let frequency = excitation * unit;
        for broken in &mut self.broken {
            broken.frequency = excitation;
        }
        for term in &mut self.terms {
            term.scale = term.factor.steady(excitation, revolutions);
            term.powers[0] = 1.0;
            for k in 1..COUNT {
                term.powers[k] = term.powers[k - 1] * term.order * frequency / k as f64;
            }
        }
    }

    /// Writes the Taylor coefficients of every component.
    pub(crate) fn expand(&self, at: &Instant, out: &mut [Polynomial]) {
        for (polynomial, mean) in out.iter_mut().zip(&self.mean) {
            *polynomial = [0.0; COUNT];
            polynomial[0] = *mean;
        }
        match &at.course {
            None => self.expand_even(at, out),
            Some(place) => self.expand_along(at, place, out),
        }
        for broken in &self.broken {
            broken.expand(at, &mut out[broken.index]);
        }
    }

    /// Harmonics that turn evenly.
    fn expand_even(&self, at: &Instant, out: &mut [Polynomial]) {
        for term in &self.terms {
            let (s, c) = (term.order * at.phase).sin_cos();
            let (s, c) = (term.scale * s, term.scale * c);
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

    /// Harmonics and functions of time along a course.
    fn expand_along(&self, at: &Instant, place: &CoursePosition, out: &mut [Polynomial]) {
        let mut factor = [0.0; COUNT];
        for term in &self.terms {
            let [mut c, mut s] = at.waves(term.order);
            if term.factor != Factor::One {
                term.factor.expand(at, place, &mut factor);
                for wave in [&mut c, &mut s] {
                    for k in (0..COUNT).rev() {
                        wave[k] = convolve(wave, &factor, k);
                    }
                }
            }
            for ((polynomial, cos), sin) in out.iter_mut().zip(&term.cos).zip(&term.sin) {
                if *cos == 0.0 && *sin == 0.0 {
                    continue;
                }
                for k in 0..COUNT {
                    polynomial[k] += cos * c[k] + sin * s[k];
                }
            }
        }
        for ForcingTerm {
            index,
            factor,
            line,
        } in &self.lines
        {
            let piece = line.on(place.time.0, place.time.1);
            out[*index][0] += factor * piece.value;
            out[*index][1] += factor * piece.slope * place.unit;
        }
    }
}
