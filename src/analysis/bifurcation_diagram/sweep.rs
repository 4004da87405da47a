//! The runs of a bifurcation diagram, spread over the threads. Each value of the results depends on its own run alone.

use super::{Reach, Seeds};
use crate::analysis::flow::{self, MapRecord, MapSize, Stop};
use crate::analysis::parameter::{Parameter, joined};
use crate::analysis::{Fault, Initial, Setting};
use crate::interrupt;
use crate::postprocess::attractor::Label;
use crate::solve::integrate::IntegratorChoice;
use crate::system::System;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Reasons told in full.
const SHOWN: usize = 4;

/// What to run.
pub(super) struct Plan {
    pub parameter: Parameter,
    /// Excitation frequency over omega_c, where it is not the parameter.
    pub at: f64,
    /// Values in the order of each sweep.
    pub sweeps: Vec<Vec<f64>>,
    pub seeds: Option<States>,
    pub size: MapSize,
    pub integrator: IntegratorChoice,
    pub initial: Initial,
    /// Unit of the reported parameter, and the factor to it.
    pub unit: String,
    pub factor: f64,
}

/// Random states: how many a value, from which seed, how far from rest (2n half widths).
pub(super) struct States {
    pub count: usize,
    seed: u64,
    widths: Vec<f64>,
}

/// One value of the parameter in one run.
pub(super) struct Point {
    pub value: f64,
    pub run: usize,
    pub record: MapRecord,
    pub label: Label,
    pub integrator: &'static str,
    pub warning: Option<String>,
}

impl Seeds {
    /// The box in nondimensional numbers.
    pub(super) fn states(&self, setting: &Setting<'_>) -> Result<States, Fault> {
        let widths = match &self.reach {
            Reach::Uniform(width) => vec![*width; 2 * setting.assembly.system.dof()],
            Reach::Each(widths) => widths.widths(setting, "seeds.box")?,
        };
        Ok(States {
            count: self.count,
            seed: self.seed,
            widths,
        })
    }
}

impl States {
    /// Moves a state at random within the box; every `stream` has its own numbers.
    fn scatter(&self, stream: usize, state: &mut [f64]) {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(stream as u64);
        for (x, width) in state.iter_mut().zip(&self.widths) {
            *x += width * random.random_range(-1.0..=1.0);
        }
    }
}

/// The runs with their progress and the reasons why some ended early.
pub(super) struct Work<'a> {
    setting: &'a Setting<'a>,
    plan: &'a Plan,
    total: usize,
    done: AtomicUsize,
    /// Run, position in it, reason: in the order of the results, whichever thread was first.
    stops: Mutex<Vec<(usize, usize, String)>>,
}

impl<'a> Work<'a> {
    pub fn new(setting: &'a Setting<'a>, plan: &'a Plan) -> Work<'a> {
        let values: usize = plan.sweeps.iter().map(Vec::len).sum();
        Work {
            setting,
            plan,
            total: values * plan.seeds.as_ref().map_or(1, |s| s.count),
            done: AtomicUsize::new(0),
            stops: Mutex::new(Vec::new()),
        }
    }

    /// Which values failed and why; an interruption once.
    pub fn into_stops(self) -> Vec<String> {
        let mut list = self.stops.into_inner().unwrap_or_default();
        list.sort();
        let mut texts: Vec<String> = list.into_iter().map(|(_, _, text)| text).collect();
        if self.setting.control.is_interrupted() {
            let done = self.done.load(Ordering::Relaxed);
            texts.insert(
                0,
                format!("interrupted after {done} of {} points", self.total),
            );
        }
        texts
    }

    /// Sweeps: the final state at one value is the initial one at the next. After a value that fails, the next one starts from
    /// the last state that was reached, or from the initial one.
    pub fn followed(&self) -> Vec<Point> {
        let flag = interrupt::current();
        let sweeps = self.plan.sweeps.par_iter().enumerate();
        let lists: Vec<Vec<Point>> = sweeps
            .map(|(run, values)| flag.scope(|| self.follow(run, values)))
            .collect();
        lists.into_iter().flatten().collect()
    }

    fn follow(&self, run: usize, values: &[f64]) -> Vec<Point> {
        let mut points = Vec::with_capacity(values.len());
        let mut carried: Option<Vec<f64>> = None;
        for (k, value) in values.iter().enumerate() {
            if self.setting.control.is_interrupted() {
                break;
            }
            let Some(system) = self.system(run, k, *value) else {
                continue;
            };
            let start = match &carried {
                Some(state) => Ok((state.clone(), None)),
                None => self.plan.initial.state(self.setting, &system, "initial"),
            };
            let (mut state, warning) = match start {
                Ok(start) => start,
                Err(fault) => {
                    self.stop(run, k, *value, &fault.message);
                    continue;
                }
            };
            let Some(mut point) = self.point(run, k, *value, &system, &mut state) else {
                continue;
            };
            if point.record.stop.is_none() {
                carried = Some(state);
            }
            point.warning = warning;
            points.push(point);
        }
        points
    }

    /// Every value with every random state, on its own.
    pub fn scattered(&self, states: &States) -> Vec<Point> {
        let values = &self.plan.sweeps[0];
        let one = |task: usize| {
            let (k, run) = (task / states.count, task % states.count);
            let system = self.system(run, k, values[k])?;
            let (mut state, warning) = flow::rest(&system);
            states.scatter(task, &mut state);
            let mut point = self.point(run, k, values[k], &system, &mut state)?;
            point.warning = warning;
            Some(point)
        };
        let tasks = (0..values.len() * states.count).into_par_iter();
        let flag = interrupt::current();
        tasks.filter_map(|task| flag.scope(|| one(task))).collect()
    }

    /// The system at a value; `None` when there is none, or when somebody asked to stop.
    fn system(&self, run: usize, k: usize, value: f64) -> Option<System> {
        if self.setting.control.is_interrupted() {
            return None;
        }
        match self
            .plan
            .parameter
            .system(self.setting, value, self.plan.at)
        {
            Ok(system) => Some(system),
            Err(list) => {
                self.stop(run, k, value, &joined(&list));
                None
            }
        }
    }

    /// One value, from `state`, which ends as the last one; `None` when it was interrupted or cannot be integrated.
    fn point(
        &self,
        run: usize,
        k: usize,
        value: f64,
        system: &System,
        state: &mut [f64],
    ) -> Option<Point> {
        let setting = self.setting;
        let mut integrator = match flow::integrator(setting, system, self.plan.integrator) {
            Ok(integrator) => integrator,
            Err(fault) => {
                self.stop(run, k, value, &fault.message);
                return None;
            }
        };
        let record = flow::poincare(
            integrator.as_mut(),
            system,
            state,
            self.plan.size,
            &mut |_| !setting.control.is_interrupted(),
        );
        match record.stop {
            // A point that was cut short says nothing about its attractor.
            Some(Stop::Interrupted) => return None,
            Some(stop) => self.stop(run, k, value, &stop.to_string()),
            None => {}
        }
        let label = record.label(system);
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let share = done as f64 / self.total as f64;
        let words = format!("{done} of {} points", self.total);
        setting.control.progress(setting.name, share, &words);
        Some(Point {
            value,
            run,
            record,
            label,
            integrator: integrator.name(),
            warning: None,
        })
    }

    fn stop(&self, run: usize, k: usize, value: f64, reason: &str) {
        let shown = value * self.plan.factor;
        let unit = match self.plan.unit.as_str() {
            "" => String::new(),
            unit => format!(" {unit}"),
        };
        let text = format!("run {run} at {shown:.6e}{unit}: {reason}");
        if let Ok(mut list) = self.stops.lock() {
            list.push((run, k, text));
        }
    }
}

/// The first reasons in one text; all of them stand in the summary.
pub(super) fn shortened(stops: &[String]) -> String {
    let shown = stops[..stops.len().min(SHOWN)].join("; ");
    match stops.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown}; and {more} more (`stops` in the JSON file)"),
    }
}
