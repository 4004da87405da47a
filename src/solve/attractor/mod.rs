//! Attractors: records of Poincaré points, Lyapunov exponents, and labels.
//!
//! A label is given only where there is evidence for it; everything else is `undecided`. In this order:
//!
//! - **period n**: Newton's iteration from the last point finds a periodic orbit with all multipliers inside the unit circle, n is its
//!   minimal period, and the last laps of the record approach it in the way its transition matrix says ([`Cycle`]). Where the
//!   derivative of the map is not known, every point must repeat, and the repeats must have converged.
//! - **chaotic**: the largest Lyapunov exponent is significantly positive over the record and positive in each third of it
//!   (`Exponents::is_stretching`), and no attracting periodic orbit lies among the points. Never without exponents.
//! - **quasi-periodic**: the points lie on an invariant curve ([`Curve`]), that is, a rotation number and a curve taken from two thirds
//!   of the record predict the rest; the largest exponent is 0 and all others are negative; and no attracting periodic orbit
//!   lies among the points. Never where [`Tori::Excluded`] holds.
//!
//! A record that decides nothing is extended: to twice its length, four times, up to [`LabelOptions::extend`] times. Each decision
//! rests on the last part, which is as long as everything before it, so that the transient grows with the record.

pub mod basins;
mod curve;
mod cycle;
mod geometry;
mod lurking;
pub mod lyapunov;
mod map;
mod record;
mod scatter;
mod trap;

pub use curve::Curve;
pub use cycle::Cycle;
pub(crate) use map::Stroboscopic;
pub use map::{Map, Tori, tori};
pub use record::MapRecord;
pub(crate) use record::{ALIGNMENT, poincare};
pub use record::{Lengths, MapSize, Stop};
pub(crate) use scatter::scatter;

use geometry::Cloud;
use lyapunov::Exponents;
use record::{Along, Walk};

/// Points below which a record is too short for a torus or chaos.
const LEAST_POINTS: usize = 100;
/// Error of the prediction on an invariant curve that is evidence for it.
const PREDICTED: f64 = 0.05;
/// The same where exponents do not confirm it.
const PREDICTED_ALONE: f64 = 1e-6;
/// Error of the prediction above which it must fall with the length of the record, and to which share.
const FALLING: (f64, f64) = (1e-3, 0.7);
/// Longest period looked for at the end of the transient.
const SHORT: usize = 48;
/// Laps of an orbit after each of which a motion that is expected there is looked at.
const LAPS_WATCHED: usize = 4;
/// Laps spent on an orbit that is known nearby.
const HINTED: usize = 12;
/// Longest record to which one is extended.
const LONGEST_RECORD: usize = 100_000;

/// Kind of an attractor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Label {
    /// Repeats after this number of excitation periods.
    Period(usize),
    /// Points on closed curves.
    QuasiPeriodic,
    /// Neighbouring motions separate exponentially.
    Chaotic,
    /// There is not enough evidence.
    Undecided,
}

impl std::fmt::Display for Label {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Label::Period(n) => write!(f, "period {n}"),
            Label::QuasiPeriodic => f.write_str("quasi-periodic"),
            Label::Chaotic => f.write_str("chaotic"),
            Label::Undecided => f.write_str("undecided"),
        }
    }
}

/// Limits of labels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LabelOptions {
    /// Longest period looked for.
    pub longest_period: usize,
    /// Length to which a record that decides nothing may be extended, in lengths of the record.
    pub extend: usize,
    /// Iterates spent, per decision, on the search for attracting orbits among the points.
    pub effort: usize,
}

impl Default for LabelOptions {
    fn default() -> Self {
        LabelOptions {
            longest_period: 256,
            extend: 8,
            effort: 320,
        }
    }
}

/// An attractor as a record shows it.
#[derive(Debug, Clone)]
pub struct Attractor {
    /// The requested record. Its exponents are those of the part that decided the label.
    pub record: MapRecord,
    /// Kind of the attractor.
    pub label: Label,
    /// The periodic orbit.
    pub cycle: Option<Cycle>,
    /// Periods gone after the record.
    pub extension: usize,
}

/// Follows a motion from `state`, which ends as the last one, and says what attracts it.
///
/// `keep_going` is asked before each period with its number, counted from 1.
pub fn attractor(
    map: &mut dyn Map,
    state: &mut [f64],
    size: MapSize,
    options: LabelOptions,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Attractor {
    let longest = size.periods.saturating_mul(options.extend.max(1));
    let exponents = match size.exponents {
        Lengths::ForLabels if longest < LEAST_POINTS => Lengths::Ignored,
        exponents => exponents,
    };
    let walk = Walk::new(map, state, exponents, keep_going);
    let record = MapRecord {
        points: Vec::new(),
        exponents: None,
        stop: None,
    };
    let mut hunt = Hunt {
        walk,
        options,
        found: Attractor {
            record,
            label: Label::Undecided,
            cycle: None,
            extension: 0,
        },
    };
    if hunt.record(size) && hunt.found.label == Label::Undecided {
        hunt.extend(size.periods, 0);
    }
    hunt.found
}

/// The invariant curve on which the points of a record lie, `size` values each; `None` where they show no rotation.
pub fn rotation(points: &[f64], size: usize) -> Option<Curve> {
    let stretch = record::Stretch::of(points);
    curve::invariant_curve(&Cloud::new(&stretch, size))
}

/// Judges an attractor again with attracting orbits that are known nearby: those of neighbouring values of a parameter, or of other initial
/// states. Where one of them lies among the points of a record that is not periodic, the motion goes on until it arrives there, or to
/// the end of the extension: undecided.
pub(crate) fn reconsider(
    (map, state): (&mut dyn Map, &mut [f64]),
    found: &mut Attractor,
    hints: &[Cycle],
    options: LabelOptions,
    keep_going: &mut dyn FnMut(usize) -> bool,
) {
    let is_open = matches!(found.label, Label::Chaotic | Label::QuasiPeriodic);
    if !is_open || found.record.stop.is_some() || !map.has_variation() {
        return;
    }
    let size = map.size();
    let periods = found.record.points.len() / size;
    let stretch = record::Stretch::of(&found.record.points);
    let cloud = Cloud::new(&stretch, size);
    let reach = reach(found.label);
    let lurking = hints.iter().find_map(|hint| {
        let mut search = cycle::Search::new(map, &cloud, HINTED * hint.period);
        let cycle = search.attracting(&hint.points[..size], hint.period)?;
        lurking::is_within_reach(&cycle, &cloud, reach).then_some(cycle)
    });
    let Some(cycle) = lurking else {
        return;
    };
    let gone = found.extension;
    found.label = Label::Undecided;
    found.cycle = Some(cycle);
    let walk = Walk::new(map, state, Lengths::Ignored, keep_going);
    let mut hunt = Hunt {
        walk,
        options,
        found: found.clone(),
    };
    hunt.extend(periods, gone);
    *found = hunt.found;
}

/// How near an orbit must pass a record to be where its motion may end, relative to the extent of the record: on the curve of a torus,
/// or in one of the holes of a chaotic set.
fn reach(label: Label) -> f64 {
    match label {
        Label::QuasiPeriodic => 0.03,
        _ => 0.5,
    }
}

/// A motion on its way to a label.
struct Hunt<'a> {
    walk: Walk<'a>,
    options: LabelOptions,
    found: Attractor,
}

/// Part of a motion that decides the label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Record,
    Extension,
}

/// What a stretch of points says.
enum Verdict {
    Cycle(Cycle),
    Label(Label),
    /// There is not enough evidence; an attracting orbit among the points may be where the motion ends.
    Open(Option<Cycle>),
}

impl Hunt<'_> {
    /// The transient and the record with its label. A record that ends early says nothing: false.
    fn record(&mut self, size: MapSize) -> bool {
        let stop = self.walk.settle(size.transient);
        let early = match stop {
            None => self.settled(self.options.longest_period.min(SHORT)),
            Some(_) => None,
        };
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
        let verdict = match (&stop, early) {
            (Some(_), _) => Verdict::Open(None),
            (None, Some(cycle)) => Verdict::Cycle(cycle),
            (None, None) => self.judge(Part::Record),
        };
        self.found.record.stop = stop;
        self.found.record.exponents = self.walk.exponents();
        self.found.record.points = std::mem::take(&mut self.walk.stretch.points);
        let lurking = self.accept(verdict);
        self.found.cycle = self.found.cycle.take().or(lurking);
        self.found.record.stop.is_none()
    }

    /// Extends the record until it decides; where deviations are not followed and no orbit is expected, to as many points as are looked
    /// at. The motion goes on without deviations while it is expected at a known orbit.
    fn extend(&mut self, periods: usize, gone: usize) {
        let mut lurking = self.found.cycle.take();
        let is_told_by_points = lurking.is_none() && !self.walk.follows();
        let most = if is_told_by_points {
            periods.max(curve::LARGEST)
        } else {
            LONGEST_RECORD
        };
        let limit = periods.saturating_mul(self.options.extend).min(most);
        let mut total = periods + gone;
        while self.found.label == Label::Undecided && total < limit {
            let before = self.walk.state.to_vec();
            let begin = self.walk.period();
            let (stop, verdict) = match lurking.take() {
                Some(cycle) => self.await_capture(cycle, limit - total),
                None => {
                    let more = total.min(limit - total);
                    let stop = self.walk.record(more, Along::Deviations);
                    let verdict = match stop {
                        None => self.judge(Part::Extension),
                        Some(_) => Verdict::Open(None),
                    };
                    (stop, verdict)
                }
            };
            total += self.walk.period() - begin;
            self.found.extension = total - periods;
            match stop {
                Some(Stop::Interrupted) => {
                    self.found.record.stop = stop;
                    return;
                }
                // It was on no attractor, but the record is kept.
                Some(Stop::Failed(..)) => {
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

    /// Goes on until the motion arrives at an orbit, for a number of periods at most.
    fn await_capture(&mut self, cycle: Cycle, periods: usize) -> (Option<Stop>, Verdict) {
        let error = self.walk.map.error();
        let lap = LAPS_WATCHED * cycle.period + 1;
        let mut left = periods;
        while left > 0 {
            let stop = self.walk.record(lap.min(left), Along::Nothing);
            if stop.is_some() {
                return (stop, Verdict::Open(None));
            }
            left -= lap.min(left);
            let cloud = Cloud::new(&self.walk.stretch, self.walk.map.size());
            if let Some(cycle) = cycle::captured(&cycle, &cloud, error) {
                return (None, Verdict::Cycle(cycle));
            }
        }
        (None, Verdict::Open(None))
    }

    /// Notes a verdict; an attracting orbit that may come.
    fn accept(&mut self, verdict: Verdict) -> Option<Cycle> {
        match verdict {
            Verdict::Cycle(cycle) => {
                let duration = self.walk.map.duration();
                if self.found.record.exponents.is_some() || self.walk.follows() {
                    self.found.record.exponents = Some(cycle.exponents(duration));
                }
                self.found.label = Label::Period(cycle.period);
                self.found.cycle = Some(cycle);
                None
            }
            Verdict::Label(label) => {
                self.found.label = label;
                None
            }
            Verdict::Open(cycle) => cycle,
        }
    }

    /// The orbit on which the motion has settled before the record.
    fn settled(&mut self, longest: usize) -> Option<Cycle> {
        let map = &mut *self.walk.map;
        let cloud = Cloud::new(&self.walk.stretch, map.size());
        if !map.has_variation() || cloud.count() < 2 {
            return None;
        }
        cycle::settled(map, &cloud, longest)
    }

    /// What the last stretch says.
    fn judge(&mut self, part: Part) -> Verdict {
        let exponents = self.walk.exponents();
        let map = &mut *self.walk.map;
        let cloud = Cloud::new(&self.walk.stretch, map.size());
        judge(map, &cloud, exponents.as_ref(), (self.options, part))
    }
}

fn judge(
    map: &mut dyn Map,
    cloud: &Cloud<'_>,
    exponents: Option<&Exponents>,
    (options, part): (LabelOptions, Part),
) -> Verdict {
    if cloud.count() < 2 {
        return Verdict::Open(None);
    }
    if !map.has_variation() {
        return label_of_record(map.tori(), cloud, options);
    }
    if let Some(cycle) = cycle::settled(map, cloud, options.longest_period) {
        return Verdict::Cycle(cycle);
    }
    if cloud.count() < LEAST_POINTS {
        return Verdict::Open(None);
    }
    let label = match exponents {
        Some(e) if e.is_stretching() => Some(Label::Chaotic),
        exponents if shows_torus(map.tori(), cloud, exponents) => Some(Label::QuasiPeriodic),
        _ => None,
    };
    // What decides nothing is searched once: an orbit found shortens the extension.
    if label.is_none() && part == Part::Extension {
        return Verdict::Open(None);
    }
    let reach = reach(label.unwrap_or(Label::Undecided));
    match (lurking::orbit(map, cloud, (options.effort, reach)), label) {
        (None, Some(label)) => Verdict::Label(label),
        (cycle, _) => Verdict::Open(cycle.filter(|c| c.period <= options.longest_period)),
    }
}

/// Label of a record alone: the derivative of the map is not known.
fn label_of_record(tori: Tori, cloud: &Cloud<'_>, options: LabelOptions) -> Verdict {
    match cycle::repeats(cloud, options.longest_period) {
        Some(n) => Verdict::Label(Label::Period(n)),
        None if cloud.count() < LEAST_POINTS => Verdict::Open(None),
        None if shows_torus(tori, cloud, None) => Verdict::Label(Label::QuasiPeriodic),
        None => Verdict::Open(None),
    }
}

/// Whether points lie on an invariant curve that attracts them.
fn shows_torus(tori: Tori, cloud: &Cloud<'_>, exponents: Option<&Exponents>) -> bool {
    let is_attracting = match (tori, exponents) {
        (Tori::Excluded, _) => false,
        (Tori::Conservative, Some(e)) => e.is_neutral(),
        (Tori::Possible, Some(e)) => e.is_neutral() && e.contracts_across(),
        (_, None) => true,
    };
    if !is_attracting {
        return false;
    }
    let limit = match exponents {
        Some(_) => PREDICTED,
        None => PREDICTED_ALONE,
    };
    curve::invariant_curve(cloud).is_some_and(|curve| {
        let falls = curve.error <= FALLING.0 || curve.error <= FALLING.1 * curve.error_of_half;
        curve.error <= limit && falls
    })
}
