//! Attractors: records of Poincaré points, Lyapunov exponents, and labels.
//!
//! A label is given only where there is evidence for it; everything else is `undecided`. In this order:
//!
//! - **period n**: Newton's iteration from the last point finds a periodic orbit with all multipliers inside the unit circle, n is its
//!   minimal period, and the last laps of the record approach it in the way its transition matrix says ([`Cycle`]). Where the
//!   derivative of the map is not known, every point must repeat, and the repeats must have converged.
//! - **chaotic**: the largest Lyapunov exponent is significantly positive over the record and positive in each third of it
//!   (`Exponents::is_stretching`), and no attracting periodic orbit lies among the points. Never without exponents.
//! - **quasi-periodic**: the points lie on an invariant curve ([`InvariantCurve`]), that is, a rotation number and a curve taken from two thirds
//!   of the record predict the rest, also when the motion has gone on; where its best returns shrink or grow, there is no orbit of their
//!   period; the largest exponent is 0 and all others are negative; and no attracting periodic orbit lies among the points. Never where
//!   [`Tori::Excluded`] holds.
//!
//! A record that decides nothing is extended: to twice its length, four times, up to [`LabelOptions::extend`] times. Each decision
//! rests on the last part, which is as long as everything before it, so that the transient grows with the record.

mod arrival;
pub mod basins;
mod curve;
mod cycle;
mod evidence;
mod geometry;
mod hunt;
mod lurking;
pub mod lyapunov;
mod map;
mod record;
mod returns;
mod scatter;
mod together;
mod trap;

pub use curve::InvariantCurve;
pub use cycle::Cycle;
pub use map::{Map, Stroboscopic, Tori, tori};
pub(crate) use record::{ALIGNMENT, poincare};
pub use record::{HeadStart, Lengths, MapRecord, MapSize, RecordStop};
pub(crate) use scatter::scatter;
pub use together::head_starts;

use geometry::Cloud;
use hunt::LabelHunt;
use record::Walk;

/// Points below which a record is too short for a torus or chaos.
const LEAST_POINTS: usize = 100;
/// Laps spent on an orbit that is known nearby.
const HINTED: usize = 12;

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
    /// How much of a motion is wanted.
    pub goal: Goal,
}

/// How much of a motion is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// The whole transient and the record.
    Record,
    /// The attractor alone: a motion that has come close to an attracting orbit in its transient ends there, without a record.
    Attractor,
}

impl Default for LabelOptions {
    fn default() -> Self {
        LabelOptions {
            longest_period: 256,
            extend: 8,
            effort: 320,
            goal: Goal::Record,
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
    attractor_from(
        map,
        (state, HeadStart::default()),
        size,
        options,
        keep_going,
    )
}

/// The same of a motion that has a part of its transient behind it.
pub fn attractor_from(
    map: &mut dyn Map,
    begin: (&mut [f64], HeadStart),
    size: MapSize,
    options: LabelOptions,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Attractor {
    let longest = size.periods.saturating_mul(options.extend.max(1));
    let exponents = match size.exponents {
        Lengths::ForLabels if longest < LEAST_POINTS => Lengths::Ignored,
        exponents => exponents,
    };
    let mut hunt = LabelHunt::new(Walk::new(map, begin, exponents, keep_going), options);
    if hunt.record(size) && hunt.found.label == Label::Undecided {
        hunt.extend(size.periods, hunt.found.extension);
    }
    hunt.found
}

/// A motion that goes on from `state`, which ends as its last one, until it is caught by one of the attracting orbits to which guesses lead,
/// for a number of periods at most, or has settled on another one by then. `None` where it has not, or where no guess leads to such an
/// orbit: then it does not go on.
///
/// For motions beside which others have settled: long chaotic transients look like attractors.
pub(crate) fn caught(
    map: &mut dyn Map,
    state: &mut [f64],
    guesses: &[(usize, &[f64])],
    periods: usize,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Option<Attractor> {
    let begin = (state, HeadStart::default());
    let walk = Walk::new(map, begin, Lengths::Ignored, keep_going);
    let mut hunt = LabelHunt::new(walk, LabelOptions::default());
    hunt.expect(guesses, periods).then_some(hunt.found)
}

/// The invariant curve on which the points of a record lie, `size` values each; `None` where they show no rotation.
pub fn rotation(points: &[f64], size: usize) -> Option<InvariantCurve> {
    let stretch = record::RecordStretch::of(points);
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
    let stretch = record::RecordStretch::of(&found.record.points);
    let cloud = Cloud::new(&stretch, size);
    let reach = reach(found.label);
    let lurking = hints.iter().find_map(|hint| {
        let mut search = cycle::OrbitSearch::new(map, &cloud, HINTED * hint.period);
        let cycle = search.attracting(&hint.points[..size], hint.period)?;
        lurking::is_within_reach(&cycle.points, &cloud, reach).then_some(cycle)
    });
    let Some(cycle) = lurking else {
        return;
    };
    let gone = found.extension;
    found.label = Label::Undecided;
    found.cycle = Some(cycle);
    let begin = (state, HeadStart::default());
    let walk = Walk::new(map, begin, Lengths::Ignored, keep_going);
    let mut hunt = LabelHunt {
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
        Label::QuasiPeriodic => returns::ON_CURVE,
        _ => 0.5,
    }
}
