//! Method `integration`: the attractor followed from value to value of the parameter, summarised like a branch.
//!
//! At every value the motion goes on from where the last value left it: transient periods, then a record of Poincaré points
//! that gives the attractor its label. A period n attractor is measured over its n periods, any other over as many
//! periods as the record has, from its first point on: means are means over these periods.

use super::delivered::{Delivered, Ending};
use super::report::early_message;
use super::{BranchSettings, Method, Swept};
use crate::analysis::Setting;
use crate::analysis::bifurcation_diagram::SweepDirection;
use crate::analysis::branch_table::MeasureRecorder;
use crate::analysis::flow;
use crate::analysis::summary::{Unmeasured, measured};
use crate::solve::attractor::{
    Attractor, Cycle, Label, Map, RecordStop, Stroboscopic, attractor, reconsider,
};
use crate::solve::branch::{BranchPoint, Recorder, Stability};
use crate::solve::integrate::Strain;
use crate::solve::newton::{NewtonOutcome, NewtonStatus};
use crate::solve::orbit::Orbit;
use crate::system::System;
use nalgebra::DVector;

/// Values closer than this, relative to the range, are one.
const SAME: f64 = 1e-12;

/// Values with whether each is a mark, in the order of every sweep.
pub(super) fn sweeps(settings: &BranchSettings, swept: &Swept<'_>) -> Vec<Vec<(f64, bool)>> {
    SweepDirection::sweeps(settings.direction, values(settings, swept))
}

/// Follows the attractor over the values of a sweep; `keep` gets the orbits that are wanted, with the index of their point.
/// Returns what there is to deliver and warnings.
pub(super) fn follow(
    (settings, values): (&BranchSettings, Vec<(f64, bool)>),
    swept: &Swept<'_>,
    recorder: &mut MeasureRecorder<'_>,
    keep: &mut dyn FnMut(usize, &System, &Orbit),
) -> (Delivered, Vec<String>) {
    let mut sweep = Sweep {
        settings,
        swept,
        recorder,
        keep,
        // Where its place is wrong, that is told before.
        state: (settings.start.saved()).and_then(|point| Some(swept.saved(point).ok()?.1)),
        cycle: None,
        delivered: Delivered::new(Method::Integration, 1),
        warnings: Vec::new(),
        strain: None,
    };
    for (lambda, is_mark) in values {
        if let Err((reason, message)) = sweep.point(lambda, is_mark) {
            let message = early_message(swept, &message, &sweep.delivered.points);
            sweep.delivered.end = Ending::early(reason, message);
            break;
        }
    }
    let integrators = sweep.delivered.integrators();
    let labour = flow::labour(&integrators, sweep.strain, swept.setting);
    sweep.warnings.extend(labour);
    (sweep.delivered, sweep.warnings)
}

/// Evenly spaced values with the marks among them, in the order of the sweep; whether each is a mark.
fn values(settings: &BranchSettings, swept: &Swept<'_>) -> Vec<(f64, bool)> {
    let (from, to) = swept.range;
    let last = settings.points() - 1;
    let even = |k: usize| match k {
        0 => from,
        _ if k == last => to,
        _ => from + (to - from) * k as f64 / last as f64,
    };
    let is_same = |a: f64, b: f64| (a - b).abs() <= SAME * (to - from).abs();
    let mut list: Vec<(f64, bool)> = swept.marks.iter().map(|m| (*m, true)).collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    list.dedup_by(|a, b| is_same(a.0, b.0));
    let marks = list.clone();
    let is_mark = |x: f64| marks.iter().any(|m| is_same(m.0, x));
    let plain = (0..=last).map(even).filter(|x| !is_mark(*x));
    list.extend(plain.map(|x| (x, false)));
    list.sort_by(|a, b| ((a.0 - b.0) * (to - from)).total_cmp(&0.0));
    list
}

/// Why a sweep ends: one word and a sentence.
type Reason = (&'static str, String);

struct Sweep<'a, 'r> {
    settings: &'a BranchSettings,
    swept: &'a Swept<'a>,
    recorder: &'a mut MeasureRecorder<'r>,
    keep: &'a mut dyn FnMut(usize, &System, &Orbit),
    /// Where the last value left the motion.
    state: Option<Vec<f64>>,
    /// The last periodic orbit.
    cycle: Option<Cycle>,
    delivered: Delivered,
    warnings: Vec<String>,
    /// The most laborious point.
    strain: Option<Strain>,
}

impl Sweep<'_, '_> {
    /// The attractor at one value.
    fn point(&mut self, lambda: f64, is_mark: bool) -> Result<(), Reason> {
        let setting = self.swept.setting;
        let system = self.swept.system(lambda).map_err(|m| ("no_model", m))?;
        let mut state = match self.state.take() {
            Some(state) => state,
            None => {
                let (state, warning) = flow::rest(&system);
                self.warnings.extend(warning);
                state
            }
        };
        let mut integrator = flow::integrator(setting, &system, self.settings.flow())
            .map_err(|fault| ("no_integrator", fault.message))?;
        self.delivered.note_integrator(integrator.name());
        let size = self.settings.map_size();
        let mut keep_going = |_: usize| !setting.control.is_interrupted();
        let mut map = Stroboscopic {
            system: &system,
            integrator: integrator.as_mut(),
        };
        let options = self.settings.label_keys().options();
        let mut attractor = attractor(&mut map, &mut state, size, options, &mut keep_going);
        let (moving, hints) = (
            (&mut map as &mut dyn Map, &mut *state),
            self.cycle.as_slice(),
        );
        reconsider(moving, &mut attractor, hints, options, &mut keep_going);
        if let Some(stop) = attractor.record.stop {
            return Err(reason(setting, stop));
        }
        let label = attractor.label;
        self.strain = flow::harder(self.strain, integrator.strain());
        let (system, orbit) = self.measured(system, &attractor, &state)?;
        let mut recorded = Vec::new();
        self.recorder.record(lambda, &system, &orbit, &mut recorded);
        // Newton's iteration has no part in it: what was iterated is the Poincaré map.
        let newton = NewtonOutcome {
            status: NewtonStatus::Converged,
            iterations: size.transient + size.periods + attractor.extension,
            residual_norm: f64::NAN,
        };
        let point = BranchPoint {
            lambda,
            frequency: system.reference_frequency(),
            is_mark,
            unknowns: DVector::from_column_slice(&state),
            multipliers: Vec::new(),
            neutral: 0,
            stability: Stability::Unknown,
            newton,
            recorded,
        };
        let go_on = self.recorder.accept(&point);
        if matches!(label, Label::Period(_)) && self.settings.orbits.keeps(is_mark) {
            (self.keep)(self.delivered.points.len(), &system, &orbit);
        }
        self.delivered.points.push(point);
        self.delivered.labels.push(label);
        self.state = Some(state);
        self.cycle = attractor.cycle.or(self.cycle.take());
        if go_on {
            Ok(())
        } else {
            Err(reason(self.swept.setting, RecordStop::Interrupted))
        }
    }

    /// The stretch of motion that is measured, as one response period of its system.
    fn measured(
        &self,
        system: System,
        attractor: &Attractor,
        last: &[f64],
    ) -> Result<(System, Orbit), Reason> {
        let setting = self.swept.setting;
        let found = measured(setting, (system, self.settings.flow()), attractor, last);
        found.map_err(|why| match why {
            Unmeasured::Refused(message) => ("no_integrator", message),
            Unmeasured::Stopped(stop) => reason(setting, stop),
        })
    }
}

fn reason(setting: &Setting<'_>, stop: RecordStop) -> Reason {
    let word = match stop {
        RecordStop::Interrupted => "interrupted",
        RecordStop::Failed(..) => "integration_failed",
    };
    (word, flow::tell(stop, setting))
}
