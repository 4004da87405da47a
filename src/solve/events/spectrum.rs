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
    /// One a multiplier, in the order of the place that lists fewer.
    pub paths: Vec<Pathway>,
}

impl Motion {
    /// Matches by the least sum of squared distances; empty where the multipliers of one place are not known.
    pub fn between(a: &[Complex<f64>], b: &[Complex<f64>]) -> Motion {
        if a.len() > b.len() {
            let mut motion = Motion::between(b, a);
            for path in &mut motion.paths {
                std::mem::swap(&mut path.from, &mut path.to);
            }
            return motion;
        }
        let partners = partners(a, b);
        let mut paths = Vec::with_capacity(partners.len());
        // Multipliers without a partner come from among the small ones that are not listed.
        let hidden = Hidden::below(a);
        for (k, to) in partners.iter().map(|k| b[*k]).enumerate() {
            let from = a.get(k).copied().unwrap_or_else(|| hidden.nearest(to));
            paths.push(Pathway { from, to });
        }
        Motion { paths }
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
        let count = a.multipliers.len();
        let elsewhere = third
            .filter(|t| t.multipliers.len() == count && b.multipliers.len() == count)
            .map(|t| partners(a.multipliers, t.multipliers));
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

/// The disc of the multipliers that a list of leading ones leaves out.
#[derive(Debug, Clone, Copy)]
struct Hidden {
    radius: f64,
}

impl Hidden {
    fn below(list: &[Complex<f64>]) -> Hidden {
        let smallest = list.iter().map(|mu| mu.norm()).fold(1.0, f64::min);
        Hidden { radius: smallest }
    }

    fn nearest(self, mu: Complex<f64>) -> Complex<f64> {
        mu * (self.radius / mu.norm()).min(1.0)
    }
}

/// For every multiplier of `a`, and then for every one that it leaves out, its partner in `b`, which lists as many or more;
/// empty where one list is.
fn partners(a: &[Complex<f64>], b: &[Complex<f64>]) -> Vec<usize> {
    if a.is_empty() || b.is_empty() {
        return Vec::new();
    }
    let from: Vec<_> = a.iter().map(|mu| chart(*mu)).collect();
    let to: Vec<_> = b.iter().map(|mu| chart(*mu)).collect();
    let hidden = Hidden::below(a);
    assign(b.len(), b.len(), |i, j| match from.get(i) {
        Some(from) => (from - to[j]).norm_sqr(),
        None => (hidden.nearest(b[j]) - to[j]).norm_sqr(),
    })
}
