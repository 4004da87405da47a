//! A motion followed until its record decides what attracts it.

use super::arrival;
use super::cycle::{Cycle, OrbitSearch};
use super::geometry::{self, Cloud};
use super::lyapunov::Exponents;
use super::map::{Map, Tori};
use super::record::{Along, KEPT, MapRecord, MapSize, RecordStop, Walk};
use super::returns::ReturnsVerdict;
use super::{
    Attractor, Goal, InvariantCurve, LEAST_POINTS, Label, LabelOptions, curve, evidence, lurking,
    reach,
};

/// Longest period looked for at the end of the transient.
const SHORT: usize = 48;
/// Period of the transient at which a motion is looked at first where its attractor alone is wanted.
const FIRST_LOOK: usize = 24;
/// Distance from an orbit, relative to the scale, within which a transient is cut short.
const CLOSE: f64 = 1e-4;
/// Laps of an orbit after each of which a motion that is expected there is looked at.
const LAPS_WATCHED: usize = 4;
/// Points that tell the scale of a motion.
const SCALED: usize = 24;
/// Laps of an expected orbit that may be integrated in search of it.
const NEWTON_LAPS: usize = 96;
/// Longest record to which one is extended.
const LONGEST_RECORD: usize = 100_000;

/// A motion on its way to a label.
pub(super) struct LabelHunt<'a> {
    pub walk: Walk<'a>,
    pub options: LabelOptions,
    pub found: Attractor,
}

/// Part of a motion that decides the label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MotionPart {
    Record,
    Extension,
}

/// What a stretch of points says.
enum StretchVerdict {
    Cycle(Cycle),
    Label(Label),
    /// The points seem to lie on an invariant curve.
    Curve(InvariantCurve),
    /// There is not enough evidence; an attracting orbit among the points may be where the motion ends.
    Open(Option<Cycle>),
}

impl<'a> LabelHunt<'a> {
    /// Of a motion of which nothing is known.
    pub fn new(walk: Walk<'a>, options: LabelOptions) -> LabelHunt<'a> {
        let record = MapRecord {
            points: Vec::new(),
            exponents: None,
            stop: None,
        };
        LabelHunt {
            walk,
            options,
            found: Attractor {
                record,
                label: Label::Undecided,
                cycle: None,
                extension: 0,
            },
        }
    }

    /// The transient and the record with its label. A record that ends early says nothing: false.
    pub fn record(&mut self, size: MapSize) -> bool {
        let (stop, early) = self.transient(size.transient);
        if let Some(cycle) = early
            .as_ref()
            .filter(|_| self.options.goal == Goal::Attractor)
        {
            self.walk
                .state
                .copy_from_slice(&cycle.points[..self.walk.state.len()]);
            self.accept(StretchVerdict::Cycle(cycle.clone()));
            return true;
        }
        // On a periodic orbit the deviations are known.
        let along = match early {
            Some(_) => Along::Nothing,
            None => Along::Deviations,
        };
        let stop = match stop {
            None => self.walk.record(size.periods, along),
            stop => {
                self.walk.stretch.points.clear();
                stop
            }
        };
        let left = self.limit(size.periods, None) - size.periods;
        let (stop, verdict) = match (stop, early) {
            (Some(stop), _) => (Some(stop), StretchVerdict::Open(None)),
            (None, Some(cycle)) => (None, StretchVerdict::Cycle(cycle)),
            (None, None) => self.judge(MotionPart::Record, left),
        };
        self.found.record.stop = stop;
        self.found.record.exponents = self.walk.exponents();
        self.found.record.points = std::mem::take(&mut self.walk.stretch.points);
        let own = size.periods.saturating_mul(self.walk.state.len());
        self.found.record.points.truncate(own);
        let asked = size.transient.saturating_add(size.periods);
        self.found.extension = self.walk.period().saturating_sub(asked);
        let lurking = self.accept(verdict);
        self.found.cycle = self.found.cycle.take().or(lurking);
        self.found.record.stop.is_none()
    }

    /// The transient, and the orbit on which the motion has settled at its end, or before it where the rest is not wanted.
    fn transient(&mut self, periods: usize) -> (Option<RecordStop>, Option<Cycle>) {
        let longest = self.options.longest_period.min(SHORT);
        let mut look = match self.options.goal {
            Goal::Record => periods,
            Goal::Attractor => FIRST_LOOK,
        };
        while look < periods {
            if let Some(stop) = self.walk.settle(look, periods) {
                return (Some(stop), None);
            }
            if self.comes_close(longest)
                && let Some(cycle) = self.settled(longest)
                && self.is_close(&cycle)
            {
                return (None, Some(cycle));
            }
            look *= 2;
        }
        match self.walk.settle(periods, periods) {
            None => (None, self.settled(longest)),
            stop => (stop, None),
        }
    }

    /// Whether the points repeat nearly.
    fn comes_close(&self, longest: usize) -> bool {
        let cloud = Cloud::new(&self.walk.stretch, self.walk.map.size());
        let longest = longest.min(cloud.count() / 2);
        (1..=longest).any(|n| cloud.end_recurrence(n) <= CLOSE)
    }

    /// Whether the motion is near the first point of an orbit.
    fn is_close(&self, cycle: &Cycle) -> bool {
        let cloud = Cloud::new(&self.walk.stretch, self.walk.map.size());
        let first = &cycle.points[..cloud.size];
        geometry::distance(first, cloud.last(), &cloud.scale) <= CLOSE
    }

    /// Extends the record until it decides; where deviations are not followed and no orbit is expected, to as many points as are looked
    /// at. The motion goes on without deviations while it is expected at a known orbit.
    pub fn extend(&mut self, periods: usize, gone: usize) {
        let mut lurking = self.found.cycle.take();
        let limit = self.limit(periods, lurking.as_ref());
        let mut total = periods + gone;
        while self.found.label == Label::Undecided && total < limit {
            let before = self.walk.state.to_vec();
            let begin = self.walk.period();
            let (stop, verdict) = match lurking.take() {
                Some(cycle) => self.await_capture(&[cycle], limit - total),
                None => {
                    let more = total.min(limit - total);
                    match self.walk.record(more, Along::Deviations) {
                        None => self.judge(MotionPart::Extension, limit - total - more),
                        stop => (stop, StretchVerdict::Open(None)),
                    }
                }
            };
            total += self.walk.period() - begin;
            self.found.extension = total - periods;
            match stop {
                Some(RecordStop::Interrupted) => {
                    self.found.record.stop = stop;
                    return;
                }
                // It was on no attractor, but the record is kept.
                Some(RecordStop::Failed(..)) => {
                    self.walk.state.copy_from_slice(&before);
                    return;
                }
                None => {}
            }
            let exponents = self.walk.exponents();
            self.found.record.exponents = exponents.or(self.found.record.exponents.take());
            lurking = self.accept(verdict);
        }
    }

    /// Length to which a record may be extended, with an orbit at which the motion is expected.
    fn limit(&self, periods: usize, expected: Option<&Cycle>) -> usize {
        let is_told_by_points = expected.is_none() && !self.walk.follows();
        let most = if is_told_by_points {
            curve::LARGEST
        } else {
            LONGEST_RECORD
        };
        let longest = periods.saturating_mul(self.options.extend);
        longest.min(most).max(periods)
    }

    /// Goes on, for a number of periods at most, until the motion arrives at one of the attracting orbits to which guesses lead, or has
    /// settled on another one at the end; whether it has.
    pub fn expect(&mut self, guesses: &[(usize, &[f64])], periods: usize) -> bool {
        let begin = self.walk.state.to_vec();
        let stop = self.walk.record(SCALED, Along::Nothing);
        if stop.is_some() || !self.walk.map.has_variation() {
            self.found.record.stop = stop;
            return false;
        }
        let cycles = self.attracting(guesses);
        if cycles.is_empty() {
            self.walk.state.copy_from_slice(&begin);
            return false;
        }
        let (mut stop, mut verdict) = self.await_capture(&cycles, periods);
        if let (None, StretchVerdict::Open(_)) = (&stop, &verdict) {
            (stop, verdict) = self.settled_elsewhere();
        }
        let is_caught = matches!(verdict, StretchVerdict::Cycle(_));
        self.found.record.stop = stop;
        self.accept(verdict);
        is_caught
    }

    /// The attracting orbits to which guesses lead, each once.
    fn attracting(&mut self, guesses: &[(usize, &[f64])]) -> Vec<Cycle> {
        let map = &mut *self.walk.map;
        let cloud = Cloud::new(&self.walk.stretch, map.size());
        let mut cycles: Vec<Cycle> = Vec::new();
        for (period, guess) in guesses {
            let mut search = OrbitSearch::new(map, &cloud, NEWTON_LAPS * period);
            let found = search.attracting(guess, *period);
            let found = found.or_else(|| search.attracting_doubled(guess, *period));
            cycles.extend(
                found.filter(|cycle| cycles.iter().all(|known| !known.is_near(cycle, &cloud))),
            );
        }
        cycles
    }

    /// The orbit on which a motion that none of the known ones has caught goes round nevertheless.
    fn settled_elsewhere(&mut self) -> (Option<RecordStop>, StretchVerdict) {
        if let Some(stop) = self.walk.record(KEPT, Along::Nothing) {
            return (Some(stop), StretchVerdict::Open(None));
        }
        let cycle = match self.comes_close(SHORT) {
            true => self.settled(SHORT),
            false => None,
        };
        (
            None,
            cycle.map_or(StretchVerdict::Open(None), StretchVerdict::Cycle),
        )
    }

    /// Goes on until the motion arrives at one of some orbits, for a number of periods at most.
    fn await_capture(
        &mut self,
        cycles: &[Cycle],
        periods: usize,
    ) -> (Option<RecordStop>, StretchVerdict) {
        let error = self.walk.map.error();
        let longest = cycles.iter().map(|cycle| cycle.period).max().unwrap_or(1);
        let lap = LAPS_WATCHED * longest + 1;
        let mut left = periods;
        while left > 0 {
            let stop = self.walk.record(lap.min(left), Along::Nothing);
            if stop.is_some() {
                return (stop, StretchVerdict::Open(None));
            }
            left -= lap.min(left);
            let cloud = Cloud::new(&self.walk.stretch, self.walk.map.size());
            let arrived = |cycle| arrival::captured(cycle, &cloud, error);
            if let Some(cycle) = cycles.iter().find_map(arrived) {
                return (None, StretchVerdict::Cycle(cycle));
            }
        }
        (None, StretchVerdict::Open(None))
    }

    /// Notes a verdict; an attracting orbit that may come.
    fn accept(&mut self, verdict: StretchVerdict) -> Option<Cycle> {
        match verdict {
            StretchVerdict::Cycle(cycle) => {
                let duration = self.walk.map.duration();
                if self.found.record.exponents.is_some() || self.walk.follows() {
                    self.found.record.exponents = Some(cycle.exponents(duration));
                }
                self.found.label = Label::Period(cycle.period);
                self.found.cycle = Some(cycle);
                None
            }
            StretchVerdict::Label(label) => {
                self.found.label = label;
                None
            }
            StretchVerdict::Open(cycle) => cycle,
            // Not confirmed.
            StretchVerdict::Curve(_) => None,
        }
    }

    /// The orbit on which the motion has settled before the record.
    fn settled(&mut self, longest: usize) -> Option<Cycle> {
        let map = &mut *self.walk.map;
        let cloud = Cloud::new(&self.walk.stretch, map.size());
        if !map.has_variation() || cloud.count() < 2 {
            return None;
        }
        arrival::settled(map, &cloud, longest)
    }

    /// What the last stretch says; a torus must be shown by as many points as tell it from a slow approach, for which the motion may go on for
    /// `left` periods.
    fn judge(&mut self, part: MotionPart, left: usize) -> (Option<RecordStop>, StretchVerdict) {
        let exponents = self.walk.exponents();
        let map = &mut *self.walk.map;
        let cloud = Cloud::new(&self.walk.stretch, map.size());
        let verdict = judge(map, &cloud, exponents.as_ref(), (self.options, part));
        let more = evidence::POINTS.saturating_sub(cloud.count()).min(left);
        match verdict {
            StretchVerdict::Curve(curve) => self.confirmed(&curve, more),
            verdict => (None, verdict),
        }
    }

    /// Whether the last stretch still shows a curve when the motion has gone on; where it comes to an orbit instead, that.
    fn confirmed(
        &mut self,
        first: &InvariantCurve,
        more: usize,
    ) -> (Option<RecordStop>, StretchVerdict) {
        if more > 0
            && let Some(stop) = self.walk.go_on(more)
        {
            return (Some(stop), StretchVerdict::Open(None));
        }
        let exponents = self.walk.exponents();
        let longest = self.options.longest_period;
        let map = &mut *self.walk.map;
        let cloud = Cloud::new(&self.walk.stretch, map.size());
        let found = match more {
            0 => Some(*first),
            _ => curve::invariant_curve(&cloud),
        };
        let found = found.filter(|c| evidence::still_predicts(c, first, exponents.as_ref()));
        let expected = match found.map(|c| c.returns.verdict(map, &cloud, longest)) {
            Some(ReturnsVerdict::Rotation) => {
                return (None, StretchVerdict::Label(Label::QuasiPeriodic));
            }
            Some(ReturnsVerdict::Open(cycle)) => cycle,
            None => None,
        };
        let settled = match more {
            0 => None,
            _ => self.settled(longest),
        };
        let verdict = settled.map_or(StretchVerdict::Open(expected), StretchVerdict::Cycle);
        (None, verdict)
    }
}

fn judge(
    map: &mut dyn Map,
    cloud: &Cloud<'_>,
    exponents: Option<&Exponents>,
    (options, part): (LabelOptions, MotionPart),
) -> StretchVerdict {
    if cloud.count() < 2 {
        return StretchVerdict::Open(None);
    }
    if !map.has_variation() {
        return label_of_record(map.tori(), cloud, options);
    }
    if let Some(cycle) = arrival::settled(map, cloud, options.longest_period) {
        return StretchVerdict::Cycle(cycle);
    }
    if cloud.count() < LEAST_POINTS {
        return StretchVerdict::Open(None);
    }
    let (label, verdict) = match exponents {
        Some(e) if e.is_stretching() => (Label::Chaotic, StretchVerdict::Label(Label::Chaotic)),
        exponents => match evidence::curve(map.tori(), cloud, exponents) {
            Some(curve) => (Label::QuasiPeriodic, StretchVerdict::Curve(curve)),
            // What decides nothing is searched once: an orbit found shortens the extension.
            None if part == MotionPart::Extension => return StretchVerdict::Open(None),
            None => (Label::Undecided, StretchVerdict::Open(None)),
        },
    };
    match lurking::orbit(map, cloud, (options.effort, reach(label))) {
        None => verdict,
        cycle => StretchVerdict::Open(cycle.filter(|c| c.period <= options.longest_period)),
    }
}

/// Label of a record alone: the derivative of the map is not known.
fn label_of_record(tori: Tori, cloud: &Cloud<'_>, options: LabelOptions) -> StretchVerdict {
    match arrival::repeats(cloud, options.longest_period) {
        Some(n) => StretchVerdict::Label(Label::Period(n)),
        None if cloud.count() < LEAST_POINTS => StretchVerdict::Open(None),
        None => evidence::curve(tori, cloud, None)
            .map_or(StretchVerdict::Open(None), StretchVerdict::Curve),
    }
}
