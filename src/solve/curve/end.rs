//! Why curves end.

use super::nature::Codimension;
use crate::solve::continuation::PathEnd;

/// Reason of the end of a curve.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum CurveEnd {
    /// It left the ranges and did not come back within the margin.
    LeftRange,
    /// It came back to its first point.
    Closed,
    /// A Neimark-Sacker curve at which the pair became real: 1:1 or 1:2.
    Resonance(u8),
    /// An extremum of this connection touches a breakpoint: behind it the multipliers have infinite slope, and the condition of
    /// a smooth bifurcation is not met.
    MeetsGrazing(usize),
    /// A branch point unfolds: the branches no longer cross, as where parts are alike no more.
    Unfolded,
    /// An event at which the curve was to end.
    Stated(Codimension),
    /// The path follower ended.
    Path(PathEnd),
    /// The model ends.
    NoModel(String),
}

impl CurveEnd {
    /// One word for files.
    pub fn reason(&self) -> &'static str {
        match self {
            CurveEnd::LeftRange => "range_reached",
            CurveEnd::Closed => "closed",
            CurveEnd::Resonance(1) => "resonance_1_1",
            CurveEnd::Resonance(_) => "resonance_1_2",
            CurveEnd::MeetsGrazing(_) => "meets_grazing",
            CurveEnd::Unfolded => "unfolded",
            CurveEnd::Stated(event) => event.word(),
            CurveEnd::Path(end) => end.reason(),
            CurveEnd::NoModel(_) => "no_model",
        }
    }

    /// A sentence for people.
    pub fn message(&self) -> String {
        match self {
            CurveEnd::LeftRange => "the curve left the ranges".into(),
            CurveEnd::Closed => "the curve closed on itself".into(),
            CurveEnd::Resonance(n) => format!(
                "the pair of multipliers became real at the 1:{n} resonance; beyond it the orbit is a neutral saddle"
            ),
            CurveEnd::MeetsGrazing(_) => {
                "the curve meets a grazing, beyond which the multipliers have infinite slope".into()
            }
            CurveEnd::Unfolded => {
                "the branches no longer cross: beside this point a change of the second parameter tears the branch point apart".into()
            }
            CurveEnd::Stated(event) => {
                format!("the curve was to end at this event: {}", event.word())
            }
            CurveEnd::Path(end) => end.message(),
            CurveEnd::NoModel(reason) => format!("the model ends: {reason}"),
        }
    }

    /// Whether nothing is missing.
    pub(crate) fn is_complete(&self) -> bool {
        matches!(
            self,
            CurveEnd::LeftRange
                | CurveEnd::Closed
                | CurveEnd::Resonance(_)
                | CurveEnd::MeetsGrazing(_)
                | CurveEnd::Stated(_)
        )
    }
}
