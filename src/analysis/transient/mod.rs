//! Motions over time: along a course of speed, under loads that are functions of time.

mod history;
mod impacts;
mod ramp;
mod rows;
mod speed;

pub(super) use history::{HistoryKeys, check as check_history, run as run_history};
pub(super) use impacts::Impacts;
pub(super) use ramp::{RampKeys, SpeedRamp, ramp};
pub(super) use rows::{Rows, headings, switch_table};
pub use speed::SpeedProfile;
pub(super) use speed::time;

use super::{Fault, Initial, Setting, columns, flow};
use crate::model::Structure;
use crate::numeric::broken_line::BrokenLine;
use crate::solve::attractor::RecordStop;
use crate::solve::integrate::{FlowObserver, IntegrationEnd, Integrator, IntegratorOptions};
use crate::system::{Course, LoadKind, LoadSource, Mount, System};

/// How the reference turns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drive<'a> {
    /// Its speed over omega_c against omega_c t.
    pub speed: &'a BrokenLine,
    /// Its phase at time 0.
    pub phase: f64,
    /// Whether the train follows: accelerations contain those of the mean motion.
    pub follow: bool,
}

/// A motion about to start along a course of speed.
pub(super) struct Transient {
    /// The system, whose `tau` is omega_c t.
    pub system: System,
    /// Integrator.
    pub integrator: Box<dyn Integrator + Send>,
    /// [q; v].
    pub state: Vec<f64>,
    /// Warning about the state.
    pub warning: Option<String>,
}

impl Transient {
    /// Along the course of the reference.
    ///
    /// # Errors
    /// The first of the faults of the keys `initial` and `integrator`.
    pub fn new(
        setting: &Setting<'_>,
        drive: Drive<'_>,
        initial: &Initial,
        options: impl Into<IntegratorOptions>,
    ) -> Result<Transient, Fault> {
        let own = &setting.assembly.system;
        let revolutions = own.revolutions() as f64;
        let speed = drive.speed.scaled(1.0, 1.0 / revolutions);
        let course = Course::new(speed, drive.phase / revolutions);
        let system = own.along(course.followed(drive.follow));
        let integrator = flow::integrator(setting, &system, options)?;
        let (state, warning) = initial.state(setting, &system, "initial")?;
        Ok(Transient {
            system,
            integrator,
            state,
            warning,
        })
    }

    /// What is to be said about the start and about the steps that were taken.
    pub fn warnings(&self, setting: &Setting<'_>) -> Vec<String> {
        let integrator = self.integrator.as_ref();
        let labour = flow::labour(integrator.name(), integrator.strain(), setting);
        self.warning.iter().cloned().chain(labour).collect()
    }

    /// Advances over (begin, end] of omega_c t in bits, with progress; why it ended before.
    pub fn advance(
        &mut self,
        setting: &Setting<'_>,
        (begin, end): (f64, f64),
        observer: &mut dyn FlowObserver,
    ) -> Option<RecordStop> {
        let Transient {
            system,
            integrator,
            state,
            ..
        } = self;
        let at = |k: usize| match k {
            BITS => end,
            k => begin + (end - begin) * k as f64 / BITS as f64,
        };
        for k in 0..BITS {
            if setting.control.is_interrupted() {
                return Some(RecordStop::Interrupted);
            }
            let outcome = integrator.advance(system, (at(k), at(k + 1)), state, observer);
            let is_finite = state.iter().all(|x| x.is_finite());
            if outcome != IntegrationEnd::Reached {
                return Some(RecordStop::of(outcome, 1));
            }
            if !is_finite {
                return Some(RecordStop::of(IntegrationEnd::Diverged, 1));
            }
            let share = (k + 1) as f64 / BITS as f64;
            let words = time_in_words(setting, at(k + 1));
            setting.control.progress(setting.name, share, &words);
        }
        None
    }
}

/// A time in words.
pub(super) fn time_in_words(setting: &Setting<'_>, time: f64) -> String {
    let heading = columns::time(setting);
    let value = time * heading.factor;
    match heading.unit.as_str() {
        "" => format!("{} = {value:.6}", heading.name),
        unit => format!("{} = {value:.6} {unit}", heading.name),
    }
}

/// Why a motion over time ended, in the units of the report.
pub(super) fn tell(setting: &Setting<'_>, stop: RecordStop, time: f64) -> String {
    match stop {
        RecordStop::Failed(IntegrationEnd::NotAnalytic(_), _) => flow::tell(stop, setting),
        RecordStop::Failed(end, _) => {
            format!("{} at {}", end.message(), time_in_words(setting, time))
        }
        RecordStop::Interrupted => format!("interrupted at {}", time_in_words(setting, time)),
    }
}

/// Whether anything of the model turns with the reference.
pub(super) fn is_periodic(system: &System) -> bool {
    let loads = system.loads().iter().any(|load| match load.kind {
        LoadKind::Timed(_) => false,
        _ => !load.series.is_constant(),
    });
    let follows_phase = |mount: &Mount| {
        let series = [&mount.stiffness_variation, &mount.transmission_error];
        let force = |phase| mount.element.eval(0.7, 0.3, phase).f;
        series.into_iter().flatten().any(|s| !s.is_constant())
            || PHASES.into_iter().any(|phase| force(phase) != force(0.0))
    };
    loads || system.mounts().iter().any(follows_phase)
}

/// Phases at which a law that reads the phase differs from itself at phase 0.
const PHASES: [f64; 3] = [0.4, 1.3, 2.9];

/// Faults of loads that have no value where a speed passes 0: amplitudes with certain powers, drags that would turn round.
pub(super) fn check_speed(setting: &Setting<'_>, speed: &BrokenLine, key: &str) -> Option<Fault> {
    let system = &setting.assembly.system;
    let values = || speed.points().iter().map(|p| p.1);
    let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), w| {
        (l.min(w), h.max(w))
    });
    if low > 0.0 {
        return None;
    }
    if let Some(body) = dragged(setting).filter(|_| low < 0.0) {
        let message = format!(
            "the speed falls below 0, where the constant drag of `{body}` turns round: keep the speed at 0 or above, give the \
             drag a viscous part alone, or turn the sign of `reference.speed`"
        );
        return Some(Fault::new(key, message));
    }
    if high < 0.0 {
        return None;
    }
    let needs = |load: &LoadSource| match &load.kind {
        LoadKind::Orders { growth, .. } => growth.needs_speed(),
        _ => false,
    };
    system.loads().iter().any(needs).then(|| {
        let message = "the speed passes 0, where an amplitude with a fractional or negative `speed_power` has no \
                       value: give it a table {speed: [..], values: [..]}, or keep the speed above 0";
        Fault::new(key, message)
    })
}

/// A body with drag that does not vanish with the speed.
fn dragged<'a>(setting: &Setting<'a>) -> Option<&'a str> {
    let Structure::Train(train) = &setting.model.structure else {
        return None;
    };
    let mut bodies = train.bodies.iter();
    let found = bodies.find(|(_, body)| body.drag.constant > 0.0);
    found.map(|(name, _)| name.as_str())
}

/// Bits in which a motion is advanced: progress and interruption.
const BITS: usize = 200;
