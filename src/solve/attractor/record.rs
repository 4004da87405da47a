//! Records of Poincaré points.

use super::lyapunov::{Exponents, Lyapunov};
use super::map::Map;
use crate::solve::integrate::IntegrationEnd;
use nalgebra::DMatrix;

/// Reason why a motion was not followed to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RecordStop {
    /// An interrupt was requested.
    Interrupted,
    /// The integration ended, in this period, counted from 1.
    Failed(IntegrationEnd, usize),
}

impl RecordStop {
    /// Of an integration that ended in a period.
    pub fn of(end: IntegrationEnd, period: usize) -> RecordStop {
        match end {
            IntegrationEnd::Interrupted => RecordStop::Interrupted,
            end => RecordStop::Failed(end, period),
        }
    }
}

impl std::fmt::Display for RecordStop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            RecordStop::Interrupted => f.write_str("interrupted"),
            RecordStop::Failed(end, period) => write!(f, "{} in period {period}", end.message()),
        }
    }
}

/// Lengths of a Poincaré map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapSize {
    /// Excitation periods before the record.
    pub transient: usize,
    /// Periods recorded.
    pub periods: usize,
    /// Compute Lyapunov exponents.
    pub exponents: Lengths,
}

/// Whether small deviations are followed along with the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lengths {
    /// They are, and give the Lyapunov exponents.
    Followed,
    /// They are where a label may rest on them: where the record, once extended, has enough points.
    ForLabels,
    /// They are not.
    Ignored,
}

impl Lengths {
    /// Value of the key `lyapunov`.
    pub fn wanted(lyapunov: bool) -> Lengths {
        match lyapunov {
            true => Lengths::Followed,
            false => Lengths::Ignored,
        }
    }

    /// The same of an analysis that gives labels and no exponents.
    pub(crate) fn for_labels(lyapunov: bool) -> Lengths {
        match lyapunov {
            true => Lengths::ForLabels,
            false => Lengths::Ignored,
        }
    }
}

/// Record of a Poincaré map.
#[derive(Debug, Clone)]
pub struct MapRecord {
    /// States at phase 0 after each recorded period, 2n values each.
    pub points: Vec<f64>,
    /// Lyapunov exponents over the record, in units of omega_c.
    pub exponents: Option<Exponents>,
    /// Reason why the record is shorter than requested.
    pub stop: Option<RecordStop>,
}

/// Periods, before the record begins, over which the frame of deviations turns into place.
pub(crate) const ALIGNMENT: usize = 50;

/// Periods before the record whose points are kept, to see whether the motion has settled already.
pub(super) const KEPT: usize = 128;
/// Numbers in all derivatives that are kept.
const MAX_NUMBERS: usize = 2_000_000;

/// Successive points with the derivatives of the map between the last of them.
#[derive(Debug, Default)]
pub(super) struct RecordStretch {
    pub points: Vec<f64>,
    /// DP, column by column, from each point to the next; the last one leads to the last point.
    pub derivatives: Vec<f64>,
}

impl RecordStretch {
    /// Points alone.
    pub fn of(points: &[f64]) -> RecordStretch {
        RecordStretch {
            points: points.to_vec(),
            derivatives: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.points.clear();
        self.derivatives.clear();
    }

    /// The derivative DP = Z Q' of the last step, which led a frame Q with orthonormal columns to Z.
    fn keep(&mut self, before: &DMatrix<f64>, after: &DMatrix<f64>) {
        let numbers = before.len();
        if self.derivatives.len() + numbers > MAX_NUMBERS {
            let half = self.derivatives.len() / numbers / 2 * numbers;
            self.derivatives.drain(..half);
        }
        let derivative = after * before.transpose();
        self.derivatives.extend_from_slice(derivative.as_slice());
    }
}

/// What a motion has behind it when it is taken over.
#[derive(Debug, Clone, Default)]
pub struct HeadStart {
    /// Periods of the transient.
    pub(super) periods: usize,
    /// States after the last of them, as far as they are looked at.
    pub(super) points: Vec<f64>,
}

/// A motion that is followed period after period.
pub(super) struct Walk<'a> {
    pub map: &'a mut dyn Map,
    /// State at phase 0, which ends as the last one.
    pub state: &'a mut [f64],
    /// Deviations, where they are followed.
    deviations: Option<Lyapunov>,
    /// Asked before each period with its number, counted from 1.
    keep_going: &'a mut dyn FnMut(usize) -> bool,
    /// Periods gone.
    period: usize,
    /// Last recorded state.
    pub stretch: RecordStretch,
    frame: DMatrix<f64>,
}

/// Whether deviations go along with a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Along {
    Deviations,
    Nothing,
}

impl<'a> Walk<'a> {
    /// A motion with what is behind it.
    pub fn new(
        map: &'a mut dyn Map,
        (state, head): (&'a mut [f64], HeadStart),
        exponents: Lengths,
        keep_going: &'a mut dyn FnMut(usize) -> bool,
    ) -> Walk<'a> {
        let size = state.len();
        Walk {
            map,
            state,
            deviations: (exponents != Lengths::Ignored).then(|| Lyapunov::new(size)),
            keep_going,
            period: head.periods,
            stretch: RecordStretch {
                points: head.points,
                derivatives: Vec::new(),
            },
            frame: DMatrix::zeros(size, size),
        }
    }

    /// The periods before the record, up to one of them; deviations turn into place during the last ones.
    pub fn settle(&mut self, until: usize, transient: usize) -> Option<RecordStop> {
        if until > self.period + KEPT {
            self.stretch.points.clear();
        }
        for k in self.period..until {
            let along = match k + ALIGNMENT >= transient {
                true => Along::Deviations,
                false => Along::Nothing,
            };
            let stop = self.step(along);
            if stop.is_some() {
                return stop;
            }
            if k + KEPT >= until {
                self.stretch.points.extend_from_slice(self.state);
            }
            if let Some(deviations) = self
                .deviations
                .as_mut()
                .filter(|_| along == Along::Deviations)
            {
                deviations.skip();
            }
        }
        None
    }

    /// Records the states after each of a number of periods. Exponents, if they go along, are counted from here on.
    pub fn record(&mut self, periods: usize, along: Along) -> Option<RecordStop> {
        self.stretch.clear();
        self.stretch
            .points
            .reserve(periods.saturating_mul(self.state.len()));
        if let Some(deviations) = &mut self.deviations {
            deviations.restart();
        }
        self.append(periods, along)
    }

    /// Goes on with a record without deviations.
    pub fn go_on(&mut self, periods: usize) -> Option<RecordStop> {
        self.stretch.derivatives.clear();
        self.append(periods, Along::Nothing)
    }

    fn append(&mut self, periods: usize, along: Along) -> Option<RecordStop> {
        for _ in 0..periods {
            let stop = self.step(along);
            if stop.is_some() {
                return stop;
            }
            self.stretch.points.extend_from_slice(self.state);
            if let Some(deviations) = self
                .deviations
                .as_mut()
                .filter(|_| along == Along::Deviations)
            {
                deviations.count();
            }
        }
        None
    }

    /// Exponents over the periods counted last.
    pub fn exponents(&self) -> Option<Exponents> {
        let length = self.map.duration();
        self.deviations.as_ref().and_then(|d| d.exponents(length))
    }

    /// Whether deviations are followed at all.
    pub fn follows(&self) -> bool {
        self.deviations.is_some()
    }

    /// Periods gone.
    pub fn period(&self) -> usize {
        self.period
    }

    fn step(&mut self, along: Along) -> Option<RecordStop> {
        let period = self.period + 1;
        if !(self.keep_going)(period) {
            return Some(RecordStop::Interrupted);
        }
        self.period = period;
        let end = match self
            .deviations
            .as_mut()
            .filter(|_| along == Along::Deviations)
        {
            Some(d) => {
                self.frame.copy_from(d.frame_mut());
                let end = (self.map).advance_with_variation(self.state, d.frame_mut());
                self.stretch.keep(&self.frame, d.frame_mut());
                end
            }
            None => self.map.advance(self.state),
        };
        let is_finite = self.state.iter().all(|x| x.is_finite());
        match end {
            IntegrationEnd::Interrupted => Some(RecordStop::Interrupted),
            _ if !is_finite => Some(RecordStop::Failed(IntegrationEnd::Diverged, period)),
            IntegrationEnd::Reached => None,
            end => Some(RecordStop::Failed(end, period)),
        }
    }
}

/// States after successive iterates, from `state`, which ends as the last one; `keep_going` is asked before each of them with its
/// number.
pub(crate) fn poincare(
    map: &mut dyn Map,
    state: &mut [f64],
    size: MapSize,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> MapRecord {
    let mut walk = Walk::new(
        map,
        (state, HeadStart::default()),
        size.exponents,
        keep_going,
    );
    let settled = walk.settle(size.transient, size.transient);
    walk.stretch.clear();
    let stop = settled.or_else(|| walk.record(size.periods, Along::Deviations));
    MapRecord {
        exponents: walk.exponents(),
        points: walk.stretch.points,
        stop,
    }
}
