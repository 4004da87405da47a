//! Extrema of one deformation at neighbouring orbits, matched by continuity: which of them pass a breakpoint.

use crate::numeric::assignment::assign;
use std::f64::consts::TAU;

/// A parabola through three places is trusted up to this multiple of its height over the chord.
const TRUST: f64 = 2.0;
/// A matching is trusted if exchanging two partners costs this many times more.
const CLEAR: f64 = 4.0;
/// A deformation this close to a breakpoint, relative to the size of both, rests on it and is not beyond.
const RESTS: f64 = 1e-12;

/// An extremum of a deformation over one period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extremum {
    /// Phase of the response.
    pub tau: f64,
    /// Deformation.
    pub value: f64,
}

/// Maxima or minima of one deformation at one place of the path, and one breakpoint.
#[derive(Debug)]
pub(crate) struct Heights {
    /// Abscissa of the place.
    pub x: f64,
    list: Vec<Extremum>,
    low: f64,
    span: f64,
    level: f64,
}

impl Heights {
    /// Extrema of one kind of a list whose first entry is repeated at the end.
    pub fn new(x: f64, extrema: &[(f64, f64)], is_maximum: bool, breakpoint: f64) -> Heights {
        let pairs = extrema.windows(2);
        let own = pairs.filter(|w| (w[0].1 > w[1].1) == is_maximum);
        let list = own
            .map(|w| Extremum {
                tau: w[0].0,
                value: w[0].1,
            })
            .collect();
        let bounds = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = extrema
            .iter()
            .fold(bounds, |(low, high), x| (low.min(x.1), high.max(x.1)));
        let size = extrema
            .iter()
            .fold(breakpoint.abs(), |m, x| m.max(x.1.abs()));
        Heights {
            x,
            list,
            low,
            span: (high - low).max(f64::MIN_POSITIVE),
            level: breakpoint + RESTS * size,
        }
    }

    /// Height of an extremum over the breakpoint; positive only where it is beyond.
    pub fn over(&self, extremum: &Extremum) -> f64 {
        extremum.value - self.level
    }

    /// Whether all of the motion is beyond the breakpoint; so it is where nothing moves.
    fn is_wholly_above(&self) -> bool {
        self.low > self.level
    }

    fn is_above(&self, extremum: &Extremum) -> bool {
        self.over(extremum) > 0.0
    }

    /// The extremum nearest in time.
    pub fn nearest(&self, tau: f64) -> Option<&Extremum> {
        let distance = |x: &&Extremum| turn(x.tau, tau).abs();
        self.list
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

/// Extrema of one kind at two places, matched by the least sum of squared distances in time and height.
#[derive(Debug)]
pub(crate) struct Matched<'a> {
    places: [&'a Heights; 2],
    span: f64,
    /// Extrema that live at both.
    pub pairs: Vec<(Extremum, Extremum)>,
    /// Numbers of extrema above the level that live at one place only; none where all of the motion is above at both: ripples
    /// come and go there without passing.
    pub single_above: [usize; 2],
}

impl<'a> Matched<'a> {
    /// Matches the extrema of two places.
    pub fn between(a: &'a Heights, b: &'a Heights) -> Matched<'a> {
        let mut this = Matched {
            places: [a, b],
            span: a.span.max(b.span),
            pairs: Vec::new(),
            single_above: [0, 0],
        };
        let is_forward = a.list.len() <= b.list.len();
        let (few, many) = if is_forward { (a, b) } else { (b, a) };
        let partners = assign(few.list.len(), many.list.len(), |i, j| {
            this.cost(&few.list[i], &many.list[j])
        });
        if !(a.is_wholly_above() && b.is_wholly_above()) {
            let single = (0..many.list.len()).filter(|j| !partners.contains(j));
            this.single_above[usize::from(is_forward)] =
                single.filter(|j| many.is_above(&many.list[*j])).count();
        }
        this.pairs = few
            .list
            .iter()
            .zip(&partners)
            .map(|(x, j)| (*x, many.list[*j]))
            .map(|(x, y)| if is_forward { (x, y) } else { (y, x) })
            .collect();
        this
    }

    fn cost(&self, p: &Extremum, q: &Extremum) -> f64 {
        turn(p.tau, q.tau).powi(2) + ((p.value - q.value) / self.span).powi(2)
    }

    /// Whether an extremum is beyond the breakpoint at one place and not at the other.
    pub fn passes(&self, pair: &(Extremum, Extremum)) -> bool {
        self.places[0].is_above(&pair.0) != self.places[1].is_above(&pair.1)
    }

    /// Whether another matching, hardly more costly, tells another story.
    pub(crate) fn is_unclear(&self) -> bool {
        let count = self.pairs.len();
        let exchange = |i: usize, j: usize| {
            let (p, q) = (self.pairs[i], self.pairs[j]);
            let (r, s) = ((p.0, q.1), (q.0, p.1));
            let passages = |x, y| usize::from(self.passes(x)) + usize::from(self.passes(y));
            let cost = |x: &(Extremum, Extremum)| self.cost(&x.0, &x.1);
            passages(&p, &q) != passages(&r, &s)
                && cost(&r) + cost(&s) < CLEAR * (cost(&p) + cost(&q))
        };
        (0..count).any(|i| (i + 1..count).any(|j| exchange(i, j)))
    }

    /// Whether an extremum that stays on its side at both places may pass and come back in between, as far as the parabola
    /// through a third place tells.
    pub(crate) fn may_touch(&self, third: &Heights) -> bool {
        let [a, b] = self.places;
        self.pairs.iter().any(|pair| {
            let (low, high) = (a.over(&pair.0), b.over(&pair.1));
            let near = low.abs().min(high.abs());
            let over = third.nearest(pair.0.tau).map(|x| third.over(x));
            let bends = |t: f64| {
                let height = height((a.x, low), (b.x, high), (third.x, t));
                TRUST * height * -low.signum() >= near
            };
            !self.passes(pair) && over.is_some_and(bends)
        })
    }
}

/// Largest height of the parabola through three places over its chord between the first two.
fn height(a: (f64, f64), b: (f64, f64), third: (f64, f64)) -> f64 {
    let slope = |p: (f64, f64), q: (f64, f64)| (q.1 - p.1) / (q.0 - p.0);
    let second = (slope(a, b) - slope(a, third)) / (b.0 - third.0);
    -0.25 * second * (b.0 - a.0).powi(2)
}

/// The smallest turn from one phase to another, in [-pi, pi].
pub fn turn(from: f64, to: f64) -> f64 {
    let x = (to - from).rem_euclid(TAU);
    if x > 0.5 * TAU { x - TAU } else { x }
}
