//! Curves of bifurcations and grazings in two numbers of the model.

mod plane;
mod report;
mod start;
mod trace;

use super::cost::{Cost, Period};
use super::response::Confirm;
use super::{Analysis, Fault, Link, Setting, columns, limits};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Report, Table};
use crate::solve::integrate::IntegratorChoice;
use indexmap::IndexMap;
pub(super) use plane::{Axes, CurveAxis, Grounds};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;
pub(super) use start::other;
use std::path::PathBuf;
use std::time::Instant;

/// Settings of `bifurcation_curve`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BifurcationCurve {
    /// The two numbers: `frequency`, or paths of numbers of the model.
    pub parameters: Vec<String>,
    /// Range of each: [first, last].
    pub ranges: Vec<(Quantity, Quantity)>,
    /// Further numbers that follow one of them, such as `{gear_1.drag: {gear_2.drag: "0.4*x"}}`.
    #[serde(default, skip_serializing_if = "Link::is_empty")]
    pub link: Link,
    /// Excitation frequency, if it is not one of the parameters.
    #[serde(default)]
    pub at: Option<Quantity>,
    /// Start of the curve; a list for several curves.
    pub start: OneOrMany,
    /// Values of the second parameter to solve exactly at every passage.
    #[serde(default)]
    pub marks: Vec<Quantity>,
    /// Events inside the ranges at which a curve ends; default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub until: Vec<Until>,
    /// Excitation periods per orbit period.
    #[serde(default = "defaults::subharmonic")]
    pub subharmonic: usize,
    /// First step, in ranges of the parameters and sizes of the state.
    #[serde(default = "defaults::step")]
    pub step: f64,
    /// Smallest step.
    #[serde(default = "defaults::min_step")]
    pub min_step: f64,
    /// Largest step.
    #[serde(default = "defaults::max_step")]
    pub max_step: f64,
    /// Limit of points in each direction from a start.
    #[serde(default = "defaults::max_points")]
    pub max_points: usize,
    /// Distance beyond the ranges over which a curve is followed, because it may return; in ranges.
    #[serde(default = "defaults::margin")]
    pub margin: f64,
    /// Integrator.
    #[serde(default)]
    pub integrator: IntegratorChoice,
    /// Points to locate again on a branch in the first parameter alone: every tenth (`events`, the default), `all`,
    /// every k-th, or `none`.
    #[serde(default)]
    pub confirm: Option<Confirm>,
}

mod defaults {
    pub fn subharmonic() -> usize {
        1
    }
    pub fn step() -> f64 {
        0.01
    }
    pub fn min_step() -> f64 {
        1e-7
    }
    pub fn max_step() -> f64 {
        0.025
    }
    pub fn max_points() -> usize {
        5000
    }
    pub fn margin() -> f64 {
        0.3
    }
}

/// One start or several.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a start {analysis, kind, near} or {kind, at}, or a list of them"
)]
pub enum OneOrMany {
    /// One.
    One(Box<CurveStart>),
    /// Several.
    Many(Vec<CurveStart>),
}

/// Start of a curve: an event of an analysis of this file, or values of both parameters near an event.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CurveStart {
    /// Name of a `frequency_response` or `parameter_response` of this file.
    #[serde(default)]
    pub analysis: Option<String>,
    /// Kind of the event.
    pub kind: CurveEventKind,
    /// Value of the analysis's parameter near the event; default: the first event of the kind.
    #[serde(default)]
    pub near: Option<Quantity>,
    /// Grazing connection.
    #[serde(default)]
    pub connection: Option<String>,
    /// Values of both parameters near the event.
    #[serde(default)]
    pub at: Option<IndexMap<String, Quantity>>,
    /// State at phase 0 near the orbit that has the event, beside `at`; default: orbits from many states are looked at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial: Option<super::Initial>,
    /// Results folder of another run that contains the point of `analysis`, relative to the working directory.
    #[serde(default)]
    pub results: Option<PathBuf>,
    /// Branch or curve of that point; default 0.
    #[serde(default)]
    pub branch: usize,
    /// Number of that point.
    #[serde(default)]
    pub point: Option<usize>,
}

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CurveEventKind {
    /// Two orbits meet.
    Fold,
    /// Two branches cross.
    BranchPoint,
    /// Multiplier -1.
    PeriodDoubling,
    /// A complex pair on the unit circle.
    NeimarkSacker,
    /// An extremum of a deformation on a breakpoint.
    Grazing,
}

/// Event at which a curve ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Until {
    /// Two fold curves meet.
    Cusp,
    /// Multipliers +1 and -1.
    FoldFlip,
    /// A period doubling changes its criticality.
    GeneralisedFlip,
    /// A Neimark-Sacker event changes its criticality.
    GeneralisedNeimarkSacker,
    /// A pair on the unit circle and +1.
    FoldNeimarkSacker,
    /// A pair on the unit circle and -1.
    FlipNeimarkSacker,
    /// A double multiplier +1.
    #[serde(rename = "resonance_1_1")]
    Resonance1,
    /// A double multiplier -1.
    #[serde(rename = "resonance_1_2")]
    Resonance2,
    /// A pair at 120 degrees.
    #[serde(rename = "resonance_1_3")]
    Resonance3,
    /// A pair at 90 degrees.
    #[serde(rename = "resonance_1_4")]
    Resonance4,
    /// A meeting with a grazing, or of a grazing curve with another.
    MeetsGrazing,
    /// The first parameter turns.
    #[serde(rename = "turning_1")]
    Turning1,
    /// The second parameter turns.
    #[serde(rename = "turning_2")]
    Turning2,
}

impl Until {
    /// Word of the event in files.
    fn word(self) -> &'static str {
        match self {
            Until::Cusp => "cusp",
            Until::FoldFlip => "fold_flip",
            Until::GeneralisedFlip => "generalised_flip",
            Until::GeneralisedNeimarkSacker => "generalised_neimark_sacker",
            Until::FoldNeimarkSacker => "fold_neimark_sacker",
            Until::FlipNeimarkSacker => "flip_neimark_sacker",
            Until::Resonance1 => "resonance_1_1",
            Until::Resonance2 => "resonance_1_2",
            Until::Resonance3 => "resonance_1_3",
            Until::Resonance4 => "resonance_1_4",
            Until::MeetsGrazing => "meets_grazing",
            Until::Turning1 => "turning_1",
            Until::Turning2 => "turning_2",
        }
    }
}

/// Every how many points one is confirmed, unless asked otherwise.
const TENTH: usize = 10;

impl BifurcationCurve {
    /// Every how many points one is confirmed.
    fn confirm_stride(&self) -> Option<usize> {
        match self.confirm {
            Some(Confirm::None) => None,
            Some(Confirm::All) => Some(1),
            Some(Confirm::Every(stride)) => Some(stride),
            Some(Confirm::Events) | None => Some(TENTH),
        }
    }
}

impl OneOrMany {
    /// The starts with their keys.
    fn list(&self) -> Vec<(String, &CurveStart)> {
        match self {
            OneOrMany::One(begin) => vec![("start".into(), begin)],
            OneOrMany::Many(list) => (list.iter().enumerate())
                .map(|(k, begin)| (format!("start.{k}"), begin))
                .collect(),
        }
    }
}

/// Linear systems per point of a curve, codimension-2 events included.
const SYSTEMS: f64 = 8.0;
/// Points of a curve, as a rule.
const POINTS: f64 = 150.0;

#[typetag::serde(name = "bifurcation_curve")]
impl Analysis for BifurcationCurve {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = self.check_steps();
        match Axes::new(setting, self) {
            Ok(axes) => {
                faults.extend(axes.check(setting));
                faults.extend(axes.marks(setting, self).err().into_iter().flatten());
                for (key, begin) in self.start.list() {
                    faults.extend(start::check(setting, &axes, (&key, begin)));
                }
                if self.start.list().is_empty() {
                    faults.push(Fault::new("start", "an empty list: no curve to follow"));
                }
            }
            Err(list) => faults.extend(list),
        }
        let system = &setting.assembly.system;
        faults.extend(super::flow::integrator(setting, system, self.integrator).err());
        if let Err(error) = crate::solve::jumps::refuse_hidden(system) {
            faults.push(Fault::new("start", setting.name_connection(&error)));
        }
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let Ok(axes) = Axes::new(setting, self) else {
            return Cost::default();
        };
        let period = Period::of(setting, axes.slowest());
        let size = 2.0 * setting.assembly.system.dof() as f64;
        let shots = SYSTEMS * 2.0 * (size + 3.0) * self.subharmonic as f64;
        let curves = self.start.list().len() as f64;
        Cost::table(curves * POINTS, 9.0 + size, "max_points")
            .lasting(curves * POINTS * shots * period.varied, "start")
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let refused = |fault| columns::refused(setting, fault);
        let began = Instant::now();
        let axes = Axes::new(setting, self).map_err(|mut list| refused(list.remove(0)))?;
        let marks = axes.marks(setting, self);
        let marks = marks.map_err(|mut list| refused(list.remove(0)))?;
        let curves = trace::all(self, setting, &axes, &marks)?;
        let mut report = report::assemble(self, setting, (&axes, &marks), &curves);
        let seconds = began.elapsed().as_secs_f64();
        (report.summary).insert("timings".into(), json!({ "seconds": seconds }));
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        match Axes::new(setting, self) {
            Ok(axes) => report::tables(setting, (&axes, &[]), &[]),
            Err(_) => Vec::new(),
        }
    }
}

impl BifurcationCurve {
    fn check_steps(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let positive = |key: &str, value: f64| {
            let is_good = value > 0.0 && value.is_finite();
            (!is_good).then(|| Fault::new(key, format!("{value} must be > 0")))
        };
        faults.extend(positive("step", self.step));
        faults.extend(positive("min_step", self.min_step));
        faults.extend(positive("max_step", self.max_step));
        if faults.is_empty() && !(self.min_step <= self.step && self.step <= self.max_step) {
            let message = format!(
                "{} must lie between min_step = {} and max_step = {}",
                self.step, self.min_step, self.max_step
            );
            faults.push(Fault::new("step", message));
        }
        if !(0.0..=10.0).contains(&self.margin) {
            let message = format!("{} must lie between 0 and 10 ranges", self.margin);
            faults.push(Fault::new("margin", message));
        }
        faults.extend(limits::check(
            "max_points",
            self.max_points,
            2,
            limits::POINTS,
        ));
        faults.extend(limits::check("subharmonic", self.subharmonic, 1, 1000));
        faults
    }
}
