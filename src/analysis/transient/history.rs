//! `time_history` with `duration`: from t = 0 on, along a course of speed.

use super::{
    Drive, Impacts, Rows, SpeedProfile, Transient, switch_table, tell, time, time_in_words,
};
use crate::analysis::{Fault, Initial, Setting, columns, flow, limits};
use crate::error::Error;
use crate::model::{BodyCourse, Structure};
use crate::numeric::broken_line::BrokenLine;
use crate::numeric::fraction;
use crate::quantity::Quantity;
use crate::report::Report;
use crate::solve::integrate::{FlowObserver, IntegratorOptions, Segment, Switch};
use crate::system::System;
use serde_json::json;

/// The keys that say how a motion over time goes.
pub struct HistoryKeys<'a> {
    /// Constant speed of the reference, where no `speed` is given.
    pub at: Option<&'a Quantity>,
    /// How long.
    pub duration: &'a Quantity,
    /// Speed of the reference over time.
    pub speed: Option<&'a SpeedProfile>,
    /// Whether the train follows the speed.
    pub follow: bool,
    /// Instants that are written.
    pub samples: Option<&'a [Quantity]>,
    /// Rows written, where no instants are listed.
    pub points: usize,
    /// State at t = 0.
    pub initial: &'a Initial,
    /// Integrator.
    pub integrator: IntegratorOptions,
}

/// What the keys say, nondimensional.
struct HistoryPlan {
    end: f64,
    speed: BrokenLine,
    times: Vec<f64>,
}

impl HistoryPlan {
    fn drive(&self, history: &HistoryKeys<'_>) -> Drive<'_> {
        Drive {
            speed: &self.speed,
            phase: 0.0,
            follow: history.follow,
        }
    }
}

/// Everything wrong with the keys.
pub fn check(history: &HistoryKeys<'_>, setting: &Setting<'_>) -> Vec<Fault> {
    let mut faults = history.initial.check(setting, "initial");
    faults.extend(flow::check_tolerance(history.integrator));
    match plan(history, setting) {
        Err(list) => faults.extend(list),
        Ok(plan) => {
            faults.extend(super::check_speed(setting, &plan.speed, "speed"));
            let motion = Transient::new(
                setting,
                plan.drive(history),
                &Initial::default(),
                history.integrator,
            );
            faults.extend(motion.err());
        }
    }
    faults
}

fn plan(history: &HistoryKeys<'_>, setting: &Setting<'_>) -> Result<HistoryPlan, Vec<Fault>> {
    let mut faults = Vec::new();
    let end = positive_time(setting, "duration", history.duration);
    let end = end.map_err(|fault| faults.push(fault));
    let speed = match (history.speed, history.at) {
        (Some(speed), None) => speed.line(setting, "speed"),
        (Some(_), Some(_)) => {
            let message = "excludes `speed`, which gives the speed at every instant";
            Err(vec![Fault::new("at", message)])
        }
        (None, Some(at)) => (setting.frequency(at))
            .map(BrokenLine::constant)
            .map_err(|message| vec![Fault::new("at", message)]),
        (None, None) => match measured_speed(setting) {
            Some(line) => Ok(line),
            None => own_speed(setting).map(BrokenLine::constant),
        },
    };
    if let (Some(_), Some(key)) = (
        measured_speed(setting),
        history.speed.map(|_| "speed").or(history.at.map(|_| "at")),
    ) {
        let message =
            "the measured motion of the train gives the speed at every instant: leave this out";
        faults.push(Fault::new(key, message));
    }
    let speed = speed.map_err(|list| faults.extend(list));
    let times =
        end.and_then(|end| times(history, setting, end).map_err(|list| faults.extend(list)));
    match (end, speed, times) {
        (Ok(end), Ok(speed), Ok(times)) if faults.is_empty() => {
            Ok(HistoryPlan { end, speed, times })
        }
        _ => Err(faults),
    }
}

/// A time above 0.
pub(in crate::analysis) fn positive_time(
    setting: &Setting<'_>,
    key: &str,
    quantity: &Quantity,
) -> Result<f64, Fault> {
    let value = time(setting, quantity).map_err(|message| Fault::new(key, message))?;
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Fault::new(
        key,
        format!("`{}` must be a time > 0", quantity.text),
    ))
}

/// The speed that the model gives its reference; any where nothing turns with it.
fn own_speed(setting: &Setting<'_>) -> Result<f64, Vec<Fault>> {
    let own = match &setting.model.structure {
        Structure::Train(train) => train.mean_motion.as_ref(),
        Structure::Reduced(_) => None,
    };
    match own {
        Some(motion) => Ok(motion.speed.abs() / setting.assembly.scales.frequency),
        None if super::is_periodic(&setting.assembly.system) => {
            let message = "is missing: loads or connections follow the phase, so give a speed (`at`, `speed`, or the \
                           model's `reference`)";
            Err(vec![Fault::new("at", message)])
        }
        None => Ok(1.0),
    }
}

/// The speed of the reference that the measured motion of a body over time means, over omega_c against omega_c t.
fn measured_speed(setting: &Setting<'_>) -> Option<BrokenLine> {
    let Structure::Train(train) = &setting.model.structure else {
        return None;
    };
    let mean = train.mean_motion.as_ref()?;
    let w_c = setting.assembly.scales.frequency;
    train.motions.iter().find_map(|motion| {
        let ratio = fraction::to_f64(&mean.ratios[motion.body]) * mean.speed.signum();
        match &motion.course {
            BodyCourse::Timed(line) if ratio != 0.0 => Some(line.scaled(w_c, 1.0 / (ratio * w_c))),
            _ => None,
        }
    })
}

/// Instants of the rows, omega_c t.
fn times(
    history: &HistoryKeys<'_>,
    setting: &Setting<'_>,
    end: f64,
) -> Result<Vec<f64>, Vec<Fault>> {
    let Some(samples) = history.samples else {
        let last = history.points.max(2) - 1;
        let at = |k: usize| {
            if k == last {
                end
            } else {
                end * k as f64 / last as f64
            }
        };
        return match limits::check("points", history.points, 2, limits::POINTS) {
            Some(fault) => Err(vec![fault]),
            None => Ok((0..=last).map(at).collect()),
        };
    };
    let (mut list, mut faults) = (Vec::new(), Vec::new());
    for (k, sample) in samples.iter().enumerate() {
        let key = format!("samples.{k}");
        match time(setting, sample) {
            Err(message) => faults.push(Fault::new(key, message)),
            Ok(t) if !(0.0..=end * (1.0 + 1e-12)).contains(&t) => {
                let message = format!("`{}` lies outside 0 .. duration", sample.text);
                faults.push(Fault::new(key, message));
            }
            Ok(t) if list.last().is_some_and(|last| t <= *last) => {
                faults.push(Fault::new(key, "instants must ascend"));
            }
            Ok(t) => list.push(t.min(end)),
        }
    }
    if faults.is_empty() {
        Ok(list)
    } else {
        Err(faults)
    }
}

/// Runs, and returns the report without its options.
///
/// # Errors
/// Misuse that `check` could not detect.
pub fn run(history: &HistoryKeys<'_>, setting: &Setting<'_>) -> Result<Report, Error> {
    let first = |mut list: Vec<Fault>| columns::refused(setting, list.remove(0));
    let plan = plan(history, setting).map_err(first)?;
    let start = plan.drive(history);
    let motion = Transient::new(setting, start, history.initial, history.integrator);
    let mut motion = motion.map_err(|fault| columns::refused(setting, fault))?;
    let system = motion.system.clone();
    let mut record = TransientRecord {
        rows: Rows::new(setting, &system),
        impacts: Impacts::new(setting, &system, (0.0, 0.0), &motion.state),
        switches: Vec::new(),
        system: &system,
        times: &plan.times,
        next: 0,
        state: vec![0.0; system.state_size()],
        reached: 0.0,
    };
    if plan.times.first() == Some(&0.0) {
        record.rows.push(0.0, 0.0, &motion.state);
        record.next = 1;
    }
    let state = motion.state.clone();
    motion.integrator.start(&system, 0.0, &state, &mut record);
    let stop = motion.advance(setting, (0.0, plan.end), &mut record);
    // The last instant is the end itself, which no step reaches beyond.
    if stop.is_none() && record.next < plan.times.len() {
        record.rows.push(plan.end, plan.end, &motion.state);
    }
    let reached = record.reached;
    let mut tables = vec![record.rows.table(), switch_table(setting, &record.switches)];
    tables.extend(record.impacts.tables((0.0, reached)));
    let mut report = Report {
        tables,
        warnings: motion.warnings(setting),
        ended_early: stop.map(|stop| tell(setting, stop, reached)),
        ..Report::default()
    };
    let integrator = json!(motion.integrator.name());
    report.summary.insert("integrator".into(), integrator);
    let reached = json!(time_in_words(setting, reached));
    report.summary.insert("reached".into(), reached);
    Ok(report)
}

/// Collects while the integrator runs.
struct TransientRecord<'a> {
    rows: Rows<'a>,
    impacts: Impacts<'a>,
    switches: Vec<(f64, Switch)>,
    system: &'a System,
    times: &'a [f64],
    next: usize,
    state: Vec<f64>,
    reached: f64,
}

impl FlowObserver for TransientRecord<'_> {
    fn segment(&mut self, segment: &Segment<'_>) {
        let end = segment.tau + segment.width;
        while let Some(time) = self.times.get(self.next).filter(|t| **t <= end) {
            let x = ((time - segment.tau) / segment.width).clamp(0.0, 1.0);
            segment.state(x, self.system.omega(), &mut self.state);
            self.rows.push(*time, *time, &self.state);
            self.next += 1;
        }
        self.impacts.segment(segment);
        self.reached = end;
    }

    fn switch(&mut self, switch: &Switch) {
        if self.impacts.is_news(switch) {
            self.switches.push((switch.tau, *switch));
        }
        self.impacts.switch(switch.tau, switch);
    }
}
