//! Multipliers of neighbouring orbits, matched by continuity.
//!
//! Distances are taken in a chart of the plane that keeps the unit disc and is logarithmic along the rays beyond it, so that
//! large multipliers count by their ratio and small ones do not count at all.

use super::Look;
use crate::numeric::assignment::assign;
use num_complex::Complex;

/// Imaginary part below which a multiplier counts as real, relative to its modulus.
const REAL: f64 = 1e-9;
/// A matching is trusted when to exchange two partners costs so many times more.
const CLEAR: f64 = 4.0;
/// A parabola through three places is trusted up to so many times its height over the chord.
const TRUST: f64 = 2.0;

/// Place of a multiplier in the chart.
fn chart(mu: Complex<f64>) -> Complex<f64> {
    let modulus = mu.norm();
    if modulus <= 1.0 {
        mu
    } else {
        mu * ((1.0 + modulus.ln()) / modulus)
    }
}

/// Signed distance from the unit circle in the chart, positive outside.
pub fn margin(mu: Complex<f64>) -> f64 {
    chart(mu).norm() - 1.0
}

/// What a multiplier does between two places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Passage {
    /// Stays on its side of the unit circle.
    None,
    /// Passes -1.
    MinusOne,
    /// Passes +1.
    PlusOne,
    /// Passes the circle as a member of a pair.
    Pair,
    /// Passes, and changes between real and complex on the way.
    Mixed,
}

/// One multiplier at two places.
#[derive(Debug, Clone, Copy)]
pub struct Pathway {
    /// At the first place.
    pub from: Complex<f64>,
    /// At the second place.
    pub to: Complex<f64>,
}

impl Pathway {
    /// What happens on the way.
    pub fn passage(&self) -> Passage {
        if (margin(self.from) > 0.0) == (margin(self.to) > 0.0) {
            return Passage::None;
        }
        match (is_real(self.from), is_real(self.to)) {
            (false, false) => Passage::Pair,
            (true, true) if self.from.re < 0.0 && self.to.re < 0.0 => Passage::MinusOne,
            (true, true) if self.from.re > 0.0 && self.to.re > 0.0 => Passage::PlusOne,
            _ => Passage::Mixed,
        }
    }

    fn cost(&self) -> f64 {
        (chart(self.from) - chart(self.to)).norm_sqr()
    }
}

/// Whether a multiplier counts as real.
pub fn is_real(mu: Complex<f64>) -> bool {
    mu.im.abs() <= REAL * mu.norm()
}

/// Multipliers at one place of a smooth stretch of the path.
#[derive(Debug, Clone, Copy)]
pub struct Place<'a> {
    /// Abscissa in which the multipliers vary smoothly.
    pub x: f64,
    /// The multipliers.
    pub multipliers: &'a [Complex<f64>],
}

impl<'a> Place<'a> {
    /// What a look shows, at an abscissa.
    pub fn new(x: f64, look: &'a Look) -> Place<'a> {
        Place {
            x,
            multipliers: &look.survey.multipliers,
        }
    }
}

/// The multipliers of two places, matched.
#[derive(Debug)]
pub struct Motion {
    /// One a multiplier, in the order of the first place.
    pub paths: Vec<Pathway>,
}

impl Motion {
    /// Matches by the least sum of squared distances; empty where the multipliers of one place are not known.
    pub fn between(a: &[Complex<f64>], b: &[Complex<f64>]) -> Motion {
        let partners = partners(a, b);
        let paths = a.iter().zip(partners);
        Motion {
            paths: paths
                .map(|(from, k)| Pathway {
                    from: *from,
                    to: b[k],
                })
                .collect(),
        }
    }

    /// Whether another matching, hardly more costly, tells another story.
    pub fn is_unclear(&self) -> bool {
        let kinds: Vec<Passage> = self.paths.iter().map(Pathway::passage).collect();
        let count = self.paths.len();
        (0..count).any(|i| (i + 1..count).any(|j| self.may_exchange((i, j), &kinds)))
    }

    fn may_exchange(&self, (i, j): (usize, usize), kinds: &[Passage]) -> bool {
        let (p, q) = (self.paths[i], self.paths[j]);
        let outside = |mu| margin(mu) > 0.0;
        let is_quiet = kinds[i] == Passage::None && kinds[j] == Passage::None;
        // Without a passage now, an exchange makes one only between the two sides of the circle.
        if is_quiet && outside(p.from) == outside(q.from) {
            return false;
        }
        let (r, s) = (Pathway { to: q.to, ..p }, Pathway { to: p.to, ..q });
        let (x, y) = (r.passage(), s.passage());
        let is_same = (x, y) == (kinds[i], kinds[j]) || (y, x) == (kinds[i], kinds[j]);
        !is_same && r.cost() + s.cost() < CLEAR * (p.cost() + q.cost())
    }

    /// Whether a multiplier that stays on its side at both places may pass the circle and come back in between.
    ///
    /// With a third place: the parabola through the three, its height over the chord taken twice. Without: whether the
    /// distance from the circle changes by more than its smaller value.
    pub fn may_touch(&self, a: &Place<'_>, b: &Place<'_>, third: Option<&Place<'_>>) -> bool {
        let elsewhere = third.map(|t| partners(a.multipliers, t.multipliers));
        let known = elsewhere.filter(|list| list.len() == self.paths.len());
        self.paths.iter().enumerate().any(|(k, path)| {
            let (from, to) = (margin(path.from), margin(path.to));
            if (from > 0.0) != (to > 0.0) {
                return false;
            }
            let near = from.abs().min(to.abs());
            let parabola = known.as_ref().zip(third).and_then(|(list, t)| {
                let mu = t.multipliers[list[k]];
                let is_smooth =
                    is_real(path.from) == is_real(path.to) && is_real(path.from) == is_real(mu);
                is_smooth.then(|| height((a.x, from), (b.x, to), (t.x, margin(mu))))
            });
            match parabola {
                // Inside the circle the margin is negative, and a hill leads towards it; outside a valley.
                Some(height) => TRUST * height * -from.signum() >= near,
                None => (to - from).abs() >= near,
            }
        })
    }
}

/// Largest height of the parabola through three places over its chord between the first two.
pub fn height(a: (f64, f64), b: (f64, f64), third: (f64, f64)) -> f64 {
    let slope = |p: (f64, f64), q: (f64, f64)| (q.1 - p.1) / (q.0 - p.0);
    let second = (slope(a, b) - slope(a, third)) / (b.0 - third.0);
    -0.25 * second * (b.0 - a.0).powi(2)
}

/// For every multiplier of `a` its partner in `b`; empty when the two do not have equally many.
fn partners(a: &[Complex<f64>], b: &[Complex<f64>]) -> Vec<usize> {
    if a.len() != b.len() {
        return Vec::new();
    }
    let (from, to): (Vec<_>, Vec<_>) = a.iter().zip(b).map(|(a, b)| (chart(*a), chart(*b))).unzip();
    assign(a.len(), b.len(), |i, j| (from[i] - to[j]).norm_sqr())
}
