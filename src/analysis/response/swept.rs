//! The continued parameter of a response: what it means, the systems along it, and how it is reported.

use super::model_family::{ModelFamily, NumberTrack, Road, Ties};
use super::{BranchSettings, ResponseTable, TableChoice};
use crate::analysis::parameter::{FREQUENCY, Variation, VariedParameter, joined};
use crate::analysis::saved::SavedPoint;
use crate::analysis::sections::Sections;
use crate::analysis::{Fault, Link, Setting};
use crate::assembly::Assembly;
use crate::error::SolveError;
use crate::measure::ColumnHeading;
use crate::model::{Knob, Model};
use crate::postprocess::connection::is_clearance;
use crate::quantity::{Quantity, UnitDimension};
use crate::solve::closed_form::ClosedForm;
use crate::solve::events::Resolution;
use crate::solve::family::{Family, FrequencyFamily};
use crate::solve::floquet::Spectrum;
use crate::system::{Mount, System};
use std::borrow::Cow;
use std::sync::OnceLock;

/// The continued parameter lambda: omega/omega_c, or the share of the way between the two ends of a number of the model.
///
/// Shares make sizes like 1e8 N/m and 5e-6 m alike for steps and arclengths.
pub(in crate::analysis) struct Swept<'a> {
    pub setting: &'a Setting<'a>,
    /// First and last lambda.
    pub range: (f64, f64),
    /// Values of lambda to solve exactly: the marks, then those at which random starts are made.
    pub marks: Vec<f64>,
    /// How many of these are starts.
    starts: usize,
    /// Unit of the reported parameter.
    pub unit: String,
    tables: TableChoice,
    /// Orders of the reference whose amplitudes are reported.
    pub orders: Vec<f64>,
    stability: bool,
    subharmonic: usize,
    kind: SweptKind,
    /// Headings of the values recorded at every point, each with its table; computed on first use.
    headings: OnceLock<Vec<(ResponseTable, ColumnHeading)>>,
}

/// Share of the range by which a saved point may lie outside it: what is written is rounded.
const OUTSIDE: f64 = 1e-9;
/// A share of the range that is not a special value.
const INSIDE: f64 = 0.618_033_988_749_894_9;

enum SweptKind {
    /// The factor makes rad/s of omega/omega_c in SI reports.
    Frequency {
        factor: f64,
    },
    /// The same with numbers that follow it.
    Linked {
        factor: f64,
        ties: Ties,
    },
    Number(NumberTrack),
}

/// The model at one value of the parameter.
pub(in crate::analysis) struct Here<'a> {
    pub model: Cow<'a, Model>,
    pub assembly: Cow<'a, Assembly>,
    /// Stiffness of every connection over the one of the model as written, whose scales do not change along a parameter.
    pub stiffening: Vec<f64>,
}

impl<'a> Swept<'a> {
    /// Harmonics of the reference frequency that a number of unknowns of the Galerkin method has, for a subharmonic index.
    pub fn harmonics(&self, unknowns: usize, subharmonic: usize) -> usize {
        let system = &self.setting.assembly.system;
        unknowns / system.dof() / 2 / subharmonic / system.revolutions()
    }

    /// Which multipliers the Galerkin method computes; the averaged estimates exist only with all of them.
    pub fn spectrum(&self) -> Spectrum {
        Spectrum::of(self.setting.assembly.system.dof())
    }

    /// Whether a table is computed and written.
    pub fn computes(&self, table: ResponseTable) -> bool {
        // A dense eigenvalue problem per point, and comparable only where all multipliers are known.
        let is_possible = match table {
            ResponseTable::Main | ResponseTable::Events | ResponseTable::Rattle => true,
            ResponseTable::Multipliers => self.stability,
            ResponseTable::MultiplierEstimates => {
                self.stability && self.spectrum() == Spectrum::All
            }
        };
        is_possible && self.tables.include(table, self.has_gap())
    }

    /// Headings of a table, each with the place of its values among the recorded ones of a point; none where it is not computed.
    pub fn columns(&self, table: ResponseTable) -> impl Iterator<Item = (usize, &ColumnHeading)> {
        let headings = self
            .headings
            .get_or_init(|| self.sections().headings(&self.setting.units()));
        let places = headings.iter().enumerate();
        places.filter_map(move |(k, (of, heading))| (*of == table).then_some((k, heading)))
    }

    /// Values recorded at every point.
    pub fn sections(&self) -> Sections {
        Sections::of(self.setting, &self.orders, |table| self.computes(table))
    }

    /// Whether a law has a gap, in the model as written or at an end of the range.
    fn has_gap(&self) -> bool {
        let gap = |mount: &Mount| is_clearance(mount.element.as_ref());
        let written = self.setting.assembly.system.mounts();
        let at = |lambda: f64| {
            self.system(lambda)
                .is_ok_and(|s| s.mounts().iter().any(gap))
        };
        let varies = !matches!(self.kind, SweptKind::Frequency { .. });
        written.iter().any(gap) || (varies && (at(self.range.0) || at(self.range.1)))
    }

    /// The excitation frequency, with the numbers that follow it.
    ///
    /// # Errors
    /// The first value that is not a frequency; what is wrong with the link.
    pub fn frequency(
        setting: &'a Setting<'a>,
        settings: &BranchSettings,
        link: &Link,
    ) -> Result<Swept<'a>, Fault> {
        let (range, marks) = read(settings, &|written| setting.frequency(written))?;
        let (unit, factor) = match setting.is_si() {
            true => ("rad/s".into(), setting.assembly.scales.frequency),
            false => (String::new(), 1.0),
        };
        let parameter = VariedParameter::alone(setting, FREQUENCY, link);
        let parameter = parameter.map_err(|message| Fault::new("link", message))?;
        Ok(Swept {
            setting,
            range,
            marks,
            starts: settings.starts_at().len(),
            unit,
            tables: settings.tables.clone(),
            orders: orders(setting, settings)?,
            stability: settings.stability,
            subharmonic: settings.subharmonic,
            kind: match parameter {
                VariedParameter::Frequency(followers) if !followers.is_empty() => {
                    SweptKind::Linked {
                        factor,
                        ties: Ties {
                            followers,
                            unit: setting.assembly.scales.frequency,
                            range,
                        },
                    }
                }
                _ => SweptKind::Frequency { factor },
            },
            headings: OnceLock::new(),
        })
    }

    /// A number of the model, `written` by the user, at a fixed excitation frequency.
    ///
    /// # Errors
    /// The first value that the model refuses.
    pub fn number(
        setting: &'a Setting<'a>,
        settings: &BranchSettings,
        (knob, written): (&Knob, &str),
        at: f64,
    ) -> Result<Swept<'a>, Fault> {
        let (ends, marks) = read(settings, &|quantity| Ok(quantity.value))?;
        let span = ends.1 - ends.0;
        let share = |value: &f64| match span {
            0.0 => 0.0,
            span => (value - ends.0) / span,
        };
        let shares: Vec<f64> = marks.iter().map(share).collect();
        let mut exact = vec![(0.0, ends.0), (1.0, ends.1)];
        exact.extend(shares.iter().copied().zip(marks));
        let track = NumberTrack {
            knob: knob.clone(),
            written: written.into(),
            ends,
            exact,
            at,
        };
        Ok(Swept {
            setting,
            range: (0.0, if span == 0.0 { 0.0 } else { 1.0 }),
            marks: shares,
            starts: settings.starts_at().len(),
            unit: unit(settings, knob),
            tables: settings.tables.clone(),
            orders: orders(setting, settings)?,
            stability: settings.stability,
            subharmonic: settings.subharmonic,
            kind: SweptKind::Number(track),
            headings: OnceLock::new(),
        })
    }

    /// Width in lambda down to which changes of stability are looked for; `share`: relative to the parameter.
    pub fn resolution(&self, share: f64) -> Resolution {
        let zero = match &self.kind {
            SweptKind::Frequency { .. } | SweptKind::Linked { .. } => 0.0,
            SweptKind::Number(track) => -track.ends.0 / (track.ends.1 - track.ends.0),
        };
        Resolution {
            share,
            zero,
            range: self.range.1 - self.range.0,
        }
    }

    /// The systems along the parameter.
    ///
    /// # Errors
    /// There is no system at its beginning.
    pub fn family(&self) -> Result<Box<dyn Family + '_>, SolveError> {
        self.family_for(self.subharmonic)
    }

    /// Changes the subharmonic index.
    ///
    /// # Errors
    /// There is no system at its beginning.
    pub fn family_for(&self, subharmonic: usize) -> Result<Box<dyn Family + '_>, SolveError> {
        Ok(match &self.kind {
            SweptKind::Frequency { .. } => {
                let mut system = self.setting.assembly.system.clone();
                system.set_subharmonic(subharmonic);
                Box::new(FrequencyFamily::new(system))
            }
            SweptKind::Linked { ties, .. } => {
                let from = self.range.0;
                Box::new(ModelFamily::new(self.setting, ties, (from, subharmonic))?)
            }
            SweptKind::Number(track) => {
                Box::new(ModelFamily::new(self.setting, track, (0.0, subharmonic))?)
            }
        })
    }

    /// The model at lambda with its assembly.
    fn model(&self, lambda: f64) -> Result<(Cow<'a, Model>, Cow<'a, Assembly>), String> {
        let road: &dyn Road = match &self.kind {
            SweptKind::Frequency { .. } => {
                let Setting {
                    model, assembly, ..
                } = self.setting;
                return Ok((Cow::Borrowed(model), Cow::Borrowed(assembly)));
            }
            SweptKind::Linked { ties, .. } => ties,
            SweptKind::Number(track) => track,
        };
        let found = Variation::new(self.setting, road.knobs()).at(&road.values(lambda));
        let (model, assembly) = found.map_err(|list| joined(&list))?;
        Ok((Cow::Owned(model), Cow::Owned(assembly)))
    }

    /// The model at a point of a branch; as written where it does not exist, which is nowhere on a branch.
    pub fn here(&self, lambda: f64) -> Here<'a> {
        let setting = self.setting;
        let written = (
            Cow::Borrowed(setting.model),
            Cow::Borrowed(setting.assembly),
        );
        let (model, assembly) = self.model(lambda).unwrap_or(written);
        let stiffness = assembly.scales.stiffness.iter();
        let stiffening = stiffness.zip(&setting.assembly.scales.stiffness);
        Here {
            stiffening: stiffening.map(|(k, written)| k / written).collect(),
            model,
            assembly,
        }
    }

    /// The system at lambda with subharmonic index 1.
    ///
    /// # Errors
    /// Errors of the model at this value.
    pub fn system(&self, lambda: f64) -> Result<System, String> {
        let mut system = self.model(lambda)?.1.into_owned().system;
        system.set_reference_frequency(self.excitation(lambda));
        Ok(system)
    }

    /// What keeps a method of closed forms from the systems along the parameter: both ends and a place between them, where no
    /// number has a special value.
    pub fn refusal(&self, form: ClosedForm) -> Option<String> {
        let (from, to) = self.range;
        let systems = [from, to, from + INSIDE * (to - from)].map(|lambda| self.system(lambda));
        systems.iter().flatten().find_map(|system| {
            let mounts = system.mounts().iter().enumerate();
            let mut refusals = mounts.filter_map(|(c, mount)| Some((c, form.refusal(mount)?)));
            refusals.next().map(|(connection, reason)| {
                let error = SolveError::Unsupported { connection, reason };
                self.setting.name_connection(&error)
            })
        })
    }

    /// Excitation frequency over omega_c.
    pub fn excitation(&self, lambda: f64) -> f64 {
        match &self.kind {
            SweptKind::Frequency { .. } | SweptKind::Linked { .. } => lambda,
            SweptKind::Number(track) => track.at,
        }
    }

    /// Lambda and the state of a saved point.
    ///
    /// # Errors
    /// No such point, or one outside the range.
    pub fn saved(&self, point: &SavedPoint) -> Result<(f64, Vec<f64>), String> {
        let row = point.read()?;
        let lambda = match &self.kind {
            SweptKind::Frequency { .. } | SweptKind::Linked { .. } => {
                row.value(self.setting, &VariedParameter::Frequency(Vec::new()))?
            }
            SweptKind::Number(track) => {
                let parameter = VariedParameter::Number(Box::new(track.knob.clone()));
                let value = row.value(self.setting, &parameter)?;
                (value - track.ends.0) / (track.ends.1 - track.ends.0)
            }
        };
        let (low, high) = (
            self.range.0.min(self.range.1),
            self.range.0.max(self.range.1),
        );
        let slack = OUTSIDE * (high - low);
        match (low - slack..=high + slack).contains(&lambda) {
            true => Ok((lambda.clamp(low, high), row.state(self.setting)?)),
            false => Err(format!(
                "the saved point at {} lies outside the range",
                self.place(lambda)
            )),
        }
    }

    /// Values of lambda at which random starts are made.
    pub fn starts(&self) -> &[f64] {
        &self.marks[self.marks.len() - self.starts..]
    }

    /// The reported value of the parameter.
    pub fn value(&self, lambda: f64) -> f64 {
        match &self.kind {
            SweptKind::Frequency { factor } | SweptKind::Linked { factor, .. } => lambda * factor,
            SweptKind::Number(track) => track.value(lambda),
        }
    }

    /// The path of a varied number as the user wrote it; `None` for the frequency.
    pub fn written(&self) -> Option<&str> {
        match &self.kind {
            SweptKind::Frequency { .. } | SweptKind::Linked { .. } => None,
            SweptKind::Number(track) => Some(&track.written),
        }
    }

    /// Full path of the number that is varied, and its value; `None` where that is the frequency.
    pub fn number_at(&self, lambda: f64) -> Option<(String, f64)> {
        match &self.kind {
            SweptKind::Frequency { .. } | SweptKind::Linked { .. } => None,
            SweptKind::Number(track) => Some((track.knob.name().to_owned(), track.value(lambda))),
        }
    }

    /// The places of some points between which all of them lie, in words.
    pub fn between(&self, lambdas: impl Iterator<Item = f64> + Clone) -> String {
        let low = lambdas.clone().fold(f64::INFINITY, f64::min);
        let high = lambdas.fold(f64::NEG_INFINITY, f64::max);
        match low == high {
            true => format!("at {}", self.place(low)),
            false => format!("between {} and {}", self.place(low), self.place(high)),
        }
    }

    /// Place on a branch, in words.
    pub fn place(&self, lambda: f64) -> String {
        match &self.kind {
            SweptKind::Frequency { .. } | SweptKind::Linked { .. } => {
                format!("omega/omega_c = {lambda:.6}")
            }
            SweptKind::Number(track) => {
                let unit = match self.unit.as_str() {
                    "" => String::new(),
                    unit => format!(" {unit}"),
                };
                format!("{} = {:.6e}{unit}", track.written, track.value(lambda))
            }
        }
    }
}

/// The two ends, and the marks with the places of random starts behind them.
fn read(
    settings: &BranchSettings,
    value: &dyn Fn(&Quantity) -> Result<f64, String>,
) -> Result<((f64, f64), Vec<f64>), Fault> {
    let one = |key: String, written: &Quantity| {
        value(written).map_err(|message| Fault::new(key, message))
    };
    let marks = settings.marks.iter().enumerate();
    let marks = marks.map(|(k, mark)| one(format!("marks.{k}"), mark));
    let starts = settings.starts_at().into_iter();
    let starts = starts.map(|(key, written)| one(key, written));
    let marks: Result<Vec<f64>, Fault> = marks.chain(starts).collect();
    let (from, to) = settings.ends().map_err(|mut faults| faults.remove(0))?;
    let ends = (one("from".into(), from)?, one("to".into(), to)?);
    Ok((ends, marks?))
}

/// SI unit of a number of the model, from whatever of its values is written with a unit.
/// Orders of the reference.
fn orders(setting: &Setting<'_>, settings: &BranchSettings) -> Result<Vec<f64>, Fault> {
    let numbered = settings.orders.iter().enumerate();
    let value = |(k, order): (usize, &crate::analysis::ReportedOrder)| {
        let fault = |message| Fault::new(format!("orders.{k}"), message);
        order.value(setting).map_err(fault)
    };
    numbered.map(value).collect()
}

fn unit(settings: &BranchSettings, knob: &Knob) -> String {
    let ends = [&settings.from, &settings.to].into_iter().flatten();
    let all = ends.chain(&settings.marks);
    let dimension = all.filter_map(|quantity| quantity.dimension).next();
    match dimension {
        Some(UnitDimension::NUMBER) => String::new(),
        Some(dimension) => dimension.unit(),
        None => knob.unit(),
    }
}
