//! The graph of a law at rest: force against deformation, velocity 0, phase 0.

use crate::element::Element;
use crate::solve::affine::AffineLaw;

/// A law at rest, region by region between its breakpoints.
#[derive(Debug)]
pub(super) struct Graph<'a> {
    element: &'a dyn Element,
    /// Ascending.
    breakpoints: Vec<f64>,
    /// Slopes and offsets of the regions of a law that is affine in each of them.
    affine: Option<AffineLaw>,
}

/// Set of deformations at which a law supports a force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ForceSupport {
    /// At one deformation, with the slope there.
    Point { x: f64, slope: f64 },
    /// On a jump of the force.
    Jump { x: f64 },
    /// Anywhere between two deformations; a side may be open.
    Flat { low: f64, high: f64 },
}

impl ForceSupport {
    /// The deformation: of a flat stretch its middle; of one without end on a side the place nearest to 0.
    pub(super) fn position(&self) -> f64 {
        match *self {
            ForceSupport::Point { x, .. } | ForceSupport::Jump { x } => x,
            ForceSupport::Flat { low, high } => middle(low, high),
        }
    }

    /// Slope of the law; `None` on a jump.
    pub(super) fn slope(&self) -> Option<f64> {
        match *self {
            ForceSupport::Point { slope, .. } => Some(slope),
            ForceSupport::Jump { .. } => None,
            ForceSupport::Flat { .. } => Some(0.0),
        }
    }
}

/// Middle of a stretch; the place nearest to 0 where it has no end on one side.
pub(super) fn middle(low: f64, high: f64) -> f64 {
    if low.is_finite() && high.is_finite() {
        0.5 * low + 0.5 * high
    } else {
        0.0_f64.clamp(low, high)
    }
}

/// Half width of the ramp that replaces a jump where forces cannot be read off one by one, relative to its breakpoint.
const RAMP: f64 = 1e-9;
/// Steps of the march along a law that is not a broken line: the first one and the growth, relative to the requested force.
const FIRST_STEP: f64 = 1e-3;
const GROWTH: f64 = 1.25;
const MAX_STEPS: usize = 250;
/// Where no force gives the size of the first step: relative to the largest breakpoint.
const SMALLEST: f64 = 1e-9;

/// Distance from a breakpoint that a law's own rounding does not bridge.
fn nudge(breakpoint: f64) -> f64 {
    8.0 * f64::EPSILON * breakpoint.abs().max(1e-3)
}

impl<'a> Graph<'a> {
    pub(super) fn of(element: &'a dyn Element) -> Graph<'a> {
        let affine = (element.is_piecewise_affine()).then(|| AffineLaw::read(element));
        Graph {
            breakpoints: element.breakpoints(),
            element,
            affine,
        }
    }

    fn eval(&self, x: f64) -> f64 {
        self.element.eval(x, 0.0, 0.0).f
    }

    /// Ends of a region.
    pub(super) fn ends(&self, region: usize) -> (f64, f64) {
        let below = region.checked_sub(1).map(|k| self.breakpoints[k]);
        let above = self.breakpoints.get(region).copied();
        (
            below.unwrap_or(f64::NEG_INFINITY),
            above.unwrap_or(f64::INFINITY),
        )
    }

    /// Region of a deformation; on a breakpoint the one below.
    pub(super) fn region(&self, x: f64) -> usize {
        self.breakpoints.iter().filter(|b| **b < x).count()
    }

    /// Force at an end of a region, seen from inside it.
    fn inner(&self, region: usize, end: f64) -> f64 {
        if !self.element.is_discontinuous() {
            return self.eval(end);
        }
        match &self.affine {
            Some(law) => law.slopes[region] * end + law.offsets[region],
            None if end <= self.ends(region).0 => self.eval(end + nudge(end)),
            None => self.eval(end - nudge(end)),
        }
    }

    /// Whether the force is the same all over a region.
    pub(super) fn is_flat(&self, region: usize) -> bool {
        if let Some(law) = &self.affine {
            return law.slopes[region] == 0.0;
        }
        let (low, high) = self.ends(region);
        let inside = |share: f64| match (low.is_finite(), high.is_finite()) {
            (true, true) => low + share * (high - low),
            (true, false) => low + share * (1.0 + low.abs()) * 1e3,
            (false, true) => high - share * (1.0 + high.abs()) * 1e3,
            (false, false) => (share - 0.5) * 1e3,
        };
        let first = self.element.eval(inside(0.5), 0.0, 0.0);
        let same = |share| self.eval(inside(share)) == first.f;
        first.df_dq == 0.0 && [0.01, 0.3, 0.77, 0.99].into_iter().all(same)
    }

    /// The stretch of constant force around a deformation; that deformation alone where there is none.
    pub(super) fn flat_stretch(&self, x: f64) -> (f64, f64) {
        let regions = [self.region(x), self.region(x) + 1];
        let flat = |r: &usize| {
            let (low, high) = self.ends(*r);
            low <= x && x <= high && self.is_flat(*r)
        };
        let here = regions[..if self.breakpoints.contains(&x) { 2 } else { 1 }]
            .iter()
            .copied();
        here.into_iter().find(flat).map_or((x, x), |r| self.ends(r))
    }

    /// Where the law supports a force and does not fall: the place nearest to 0 on the side to which
    /// the force points, else on the other. `None` where there is none.
    pub(super) fn support(&self, force: f64) -> Option<ForceSupport> {
        let home = self.region(0.0);
        let sides = if force < 0.0 {
            [-1.0, 1.0]
        } else {
            [1.0, -1.0]
        };
        // A breakpoint at 0 is the end of two regions.
        let begin = |side: f64| match self.breakpoints.get(home) {
            Some(b) if *b == 0.0 && side > 0.0 => home + 1,
            _ => home,
        };
        if let Some(at_zero) = self.at_zero(force, home) {
            return Some(at_zero);
        }
        (sides.into_iter()).find_map(|side| self.walk(force, begin(side), side))
    }

    /// A force met at 0 itself, where one side is flat or the force jumps over it.
    fn at_zero(&self, force: f64, home: usize) -> Option<ForceSupport> {
        if self.breakpoints.get(home) != Some(&0.0) {
            return None;
        }
        let (below, above) = (self.inner(home, 0.0), self.inner(home + 1, 0.0));
        if below < above && (below - force) * (above - force) <= 0.0 {
            return Some(ForceSupport::Jump { x: 0.0 });
        }
        // Both sides meet the force: a flat one leaves the place open.
        let flat = [home, home + 1].into_iter().find(|r| self.is_flat(*r));
        let (low, high) = flat.filter(|_| below == force).map(|r| self.ends(r))?;
        Some(ForceSupport::Flat { low, high })
    }

    /// From region to region, outwards from 0, until the force is met.
    fn walk(&self, force: f64, mut region: usize, side: f64) -> Option<ForceSupport> {
        let (low, high) = self.ends(region);
        let mut from = 0.0_f64.clamp(low, high);
        loop {
            let (low, high) = self.ends(region);
            let end = if side > 0.0 { high } else { low };
            if let Some(found) = self.within(force, region, (from, end)) {
                return Some(found);
            }
            if end.is_infinite() {
                return None;
            }
            let next = if side > 0.0 { region + 1 } else { region - 1 };
            let (here, beyond) = (self.inner(region, end), self.inner(next, end));
            let rises = side * (beyond - here) > 0.0;
            if rises && (here - force) * (beyond - force) <= 0.0 {
                return Some(ForceSupport::Jump { x: end });
            }
            (region, from) = (next, end);
        }
    }

    /// A force between two places of one region, `from` nearer to 0.
    fn within(&self, force: f64, region: usize, (from, end): (f64, f64)) -> Option<ForceSupport> {
        let (low, high) = self.ends(region);
        if self.is_flat(region) {
            let inside = if low.is_finite() { low } else { high };
            let inside = if inside.is_finite() { inside } else { 0.0 };
            return (self.inner(region, inside) == force)
                .then_some(ForceSupport::Flat { low, high });
        }
        let start = match from == low || from == high {
            true => self.inner(region, from),
            false => self.eval(from),
        };
        if let Some(law) = &self.affine {
            let slope = law.slopes[region];
            if slope < 0.0 {
                return None;
            }
            let x = from + (force - start) / slope;
            let reach = (x - from) * (end - from).signum();
            let is_inside = reach >= 0.0 && reach <= (end - from).abs();
            return (is_inside && x.is_finite()).then_some(ForceSupport::Point { x, slope });
        }
        let x = self.march((force, start), (from, end))?;
        let slope = self.element.eval(x, 0.0, 0.0).df_dq;
        Some(ForceSupport::Point { x, slope })
    }

    /// The first place between `from` and `end` where a smooth law rises to the force: growing steps, then bisection. Where it falls
    /// through the force nothing rests.
    fn march(&self, (force, start): (f64, f64), (from, end): (f64, f64)) -> Option<f64> {
        let side = (end - from).signum();
        let mut is_short = side * (start - force) < 0.0;
        if start == force {
            if self.element.eval(from, 0.0, 0.0).df_dq >= 0.0 {
                return Some(from);
            }
            is_short = true;
        }
        let room = (end - from).abs();
        let unit = match (room.is_finite(), start == force) {
            (true, _) => room,
            (false, false) => (force - start).abs(),
            (false, true) => SMALLEST * self.unit(),
        };
        let (mut near, mut step) = (from, FIRST_STEP * unit);
        for _ in 0..MAX_STEPS {
            let is_last = (near + side * step - from).abs() >= room - nudge(end);
            let far = match is_last && room.is_finite() {
                true => end - side * nudge(end),
                false => near + side * step,
            };
            let value = self.eval(far);
            if !value.is_finite() {
                return None;
            }
            let has_reached = side * (value - force) >= 0.0;
            if is_short && has_reached {
                return Some(self.bisect(force, side > 0.0, (near, far)));
            }
            if is_last {
                return None;
            }
            is_short = !has_reached;
            (near, step) = (far, step * GROWTH);
        }
        None
    }

    /// A deformation that counts as one unit: the largest breakpoint, else 1.
    fn unit(&self) -> f64 {
        let largest = self.breakpoints.iter().fold(0.0_f64, |m, b| m.max(b.abs()));
        if largest > 0.0 { largest } else { 1.0 }
    }

    fn bisect(&self, force: f64, rises: bool, (mut near, mut far): (f64, f64)) -> f64 {
        loop {
            let x = 0.5 * near + 0.5 * far;
            if x == near || x == far {
                return far;
            }
            let value = self.eval(x);
            if (value < force) == rises && value != force {
                near = x;
            } else {
                far = x;
            }
        }
    }

    /// Flank at a deformation that carries a force; at an end of a region that to which the force belongs.
    pub(super) fn flank(&self, x: f64, force: f64) -> i8 {
        let here = self.element.flank(x);
        if here != 0 || force == 0.0 {
            return here;
        }
        let width = 4.0 * RAMP * x.abs().max(1e-3);
        self.element.flank(x + force.signum() * width)
    }

    /// Force and slope with every jump replaced by a steep ramp, and whether the place is on one.
    pub(super) fn ramped(&self, x: f64) -> (f64, f64, bool) {
        if let Some((low, high)) = self.ramp(x) {
            let (begin, end) = (self.eval(low), self.eval(high));
            let slope = (end - begin) / (high - low);
            return (begin + slope * (x - low), slope, true);
        }
        let response = self.element.eval(x, 0.0, 0.0);
        (response.f, response.df_dq, false)
    }

    fn ramp(&self, x: f64) -> Option<(f64, f64)> {
        let is_jumping = self.element.is_discontinuous();
        let ends = self.breakpoints.iter().filter(|_| is_jumping);
        ends.map(|b| ramp_at(*b))
            .find(|(low, high)| x > *low && x < *high)
    }

    /// Deformations at which the slope of [`Graph::ramped`] changes.
    pub(super) fn kinks(&self) -> Vec<f64> {
        if !self.element.is_discontinuous() {
            return self.breakpoints.clone();
        }
        let ends = self.breakpoints.iter().map(|b| ramp_at(*b));
        ends.flat_map(|(low, high)| [low, high]).collect()
    }

    /// Whether the law is a broken line.
    pub(super) fn is_affine(&self) -> bool {
        self.affine.is_some()
    }
}

/// Both ends of the ramp that replaces the jump at a breakpoint.
fn ramp_at(breakpoint: f64) -> (f64, f64) {
    let half = RAMP * breakpoint.abs().max(1e-3);
    (breakpoint - half, breakpoint + half)
}
