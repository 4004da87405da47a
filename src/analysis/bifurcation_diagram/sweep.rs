//! The runs of a bifurcation diagram, spread over the threads. Each value of the results depends on its own run alone.

use super::{Seeds, StartBox};
use crate::analysis::columns;
use crate::analysis::flow::{self, LabelKeys};
use crate::analysis::parameter::{Systems, VariedParameter, joined};
use crate::analysis::{Fault, Initial, Setting};
use crate::interrupt;
use crate::report::Column;
use crate::solve::attractor::lyapunov::Exponents;
use crate::solve::attractor::{
    Attractor, Cycle, HeadStart, Label, Map, MapSize, RecordStop, Stroboscopic, attractor_from,
    head_starts, reconsider, scatter,
};
use crate::solve::ensemble::Ensemble;
use crate::solve::integrate::{IntegratorOptions, Strain};
use crate::system::System;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Random states whose transients are gone through together.
const TOGETHER: usize = 16;
/// Reasons told in full.
const SHOWN: usize = 4;

/// What to run.
pub(super) struct SweepPlan {
    pub parameter: VariedParameter,
    /// Excitation frequency over omega_c, where it is not the parameter.
    pub at: f64,
    /// Values in the order of each sweep.
    pub sweeps: Vec<Vec<f64>>,
    pub seeds: Option<States>,
    pub size: MapSize,
    pub labels: LabelKeys,
    pub integrator: IntegratorOptions,
    pub initial: Initial,
    /// Unit of the reported parameter, and the factor to it.
    pub unit: String,
    pub factor: f64,
}

impl SweepPlan {
    /// `parameter`, and `speed_rpm` where it is the frequency and there is a reference shaft.
    pub fn columns(&self, setting: &Setting<'_>, values: &[f64]) -> Vec<Column> {
        let reported = values.iter().map(|x| x * self.factor).collect();
        let mut list = vec![columns::float("parameter", self.unit.clone(), reported)];
        if self.parameter.is_frequency() {
            list.extend(columns::speed_rpm(setting, values.iter().copied()));
        }
        list
    }
}

/// Random states: how many a value, from which seed, how far from rest (2n half widths).
pub(super) struct States {
    pub count: usize,
    seed: u64,
    widths: Vec<f64>,
}

/// One value of the parameter in one run.
pub(super) struct SweepPoint {
    pub value: f64,
    pub run: usize,
    pub attractor: Attractor,
    pub integrator: &'static str,
    pub strain: Option<Strain>,
    pub warning: Option<String>,
}

/// Names of the integrators that ran, and the most laborious point.
pub(super) fn integrations(points: &[SweepPoint]) -> (String, Option<Strain>) {
    let mut names: Vec<&str> = points.iter().map(|p| p.integrator).collect();
    names.sort_unstable();
    names.dedup();
    let strain = points.iter().map(|p| p.strain).fold(None, flow::harder);
    (names.join(", "), strain)
}

impl Seeds {
    /// The box in nondimensional numbers.
    pub(super) fn states(&self, setting: &Setting<'_>) -> Result<States, Fault> {
        let widths = match &self.reach {
            StartBox::Uniform(width) => vec![*width; setting.assembly.system.state_size()],
            StartBox::Each(widths) => widths.widths(setting, "seeds.box")?,
        };
        Ok(States {
            count: self.count,
            seed: self.seed,
            widths,
        })
    }
}

/// Periodic orbits found at each value of the parameter, one per period.
struct Hints(Vec<Vec<Cycle>>);

impl Hints {
    fn new(values: usize, list: &[(usize, Vec<f64>, SweepPoint)]) -> Hints {
        let mut found: Vec<Vec<Cycle>> = vec![Vec::new(); values];
        for (k, _, point) in list {
            let Label::Period(n) = point.attractor.label else {
                continue;
            };
            if let Some(cycle) = &point.attractor.cycle
                && found[*k].iter().all(|c| c.period != n)
            {
                found[*k].push(cycle.clone());
            }
        }
        Hints(found)
    }

    /// Those of a value and its neighbours, its own first, one per period.
    fn near(&self, k: usize) -> Vec<Cycle> {
        let mut list: Vec<Cycle> = Vec::new();
        let neighbours = [k, k.wrapping_sub(1), k + 1];
        for cycle in neighbours.iter().filter_map(|j| self.0.get(*j)).flatten() {
            if list.iter().all(|c| c.period != cycle.period) {
                list.push(cycle.clone());
            }
        }
        list
    }
}

/// The runs with their progress and the reasons why some ended early.
pub(super) struct SweepWork<'a> {
    setting: &'a Setting<'a>,
    plan: &'a SweepPlan,
    total: usize,
    done: AtomicUsize,
    /// Run, position in it, reason: in the order of the results, whichever thread was first.
    stops: Mutex<Vec<(usize, usize, String)>>,
}

impl<'a> SweepWork<'a> {
    pub fn new(setting: &'a Setting<'a>, plan: &'a SweepPlan) -> SweepWork<'a> {
        let values: usize = plan.sweeps.iter().map(Vec::len).sum();
        SweepWork {
            setting,
            plan,
            total: values * plan.seeds.as_ref().map_or(1, |s| s.count),
            done: AtomicUsize::new(0),
            stops: Mutex::new(Vec::new()),
        }
    }

    /// Failed values with reasons; an interruption once.
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
    pub fn followed(&self) -> Vec<SweepPoint> {
        let flag = interrupt::current();
        let sweeps = self.plan.sweeps.par_iter().enumerate();
        let lists: Vec<Vec<SweepPoint>> = sweeps
            .map(|(run, values)| flag.scope(|| self.follow(run, values)))
            .collect();
        lists.into_iter().flatten().collect()
    }

    fn follow(&self, run: usize, values: &[f64]) -> Vec<SweepPoint> {
        let mut points: Vec<(usize, Vec<f64>, SweepPoint)> = Vec::with_capacity(values.len());
        let mut carried: Option<Vec<f64>> = None;
        // The last periodic orbit.
        let mut cycle: Option<Cycle> = None;
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
            let hints = cycle.as_slice();
            let begin = (state.as_mut_slice(), HeadStart::default());
            let Some(mut point) = self.point((run, k, *value), &system, begin, hints) else {
                continue;
            };
            if point.attractor.label != Label::Undecided {
                cycle = point.attractor.cycle.clone().or(cycle);
            }
            if point.attractor.record.stop.is_none() {
                carried = Some(state.clone());
            }
            point.warning = warning;
            points.push((k, state, point));
        }
        self.look_back(&mut points);
        points.into_iter().map(|(_, _, point)| point).collect()
    }

    /// Judges the points of a sweep again, from the last to the first, with the orbit on which the motion has settled later: before a
    /// chaotic transient is caught for the first time, nothing tells it from an attractor.
    fn look_back(&self, points: &mut [(usize, Vec<f64>, SweepPoint)]) {
        let mut later: Option<Cycle> = None;
        for (k, state, point) in points.iter_mut().rev() {
            self.reconsider(*k, state, point, later.as_slice());
            match point.attractor.label {
                Label::Undecided => {}
                _ => later = point.attractor.cycle.clone(),
            }
        }
    }

    /// Every value with every random state, on its own.
    pub fn scattered(&self, states: &States) -> Vec<SweepPoint> {
        let values = &self.plan.sweeps[0];
        let groups = states.count.div_ceil(TOGETHER);
        let tasks = (0..values.len() * groups).into_par_iter();
        let flag = interrupt::current();
        let list = tasks.flat_map_iter(|task| {
            let first = task % groups * TOGETHER;
            let runs = first..states.count.min(first + TOGETHER);
            flag.scope(|| self.group(states, task / groups, runs))
        });
        let list: Vec<(usize, Vec<f64>, SweepPoint)> = list.collect();
        let hints = Hints::new(values.len(), &list);
        let points = list.into_par_iter().map(|(k, mut state, mut point)| {
            flag.scope(|| self.reconsider(k, &mut state, &mut point, &hints.near(k)));
            point
        });
        points.collect()
    }

    /// Some of the runs at a value: their transients together, the rest of each on its own.
    fn group(
        &self,
        states: &States,
        k: usize,
        runs: Range<usize>,
    ) -> Vec<(usize, Vec<f64>, SweepPoint)> {
        let (value, first) = (self.plan.sweeps[0][k], runs.start);
        let Some(system) = self.system(first, k, value) else {
            // Each run has its own row in the list of those that ended.
            runs.skip(1)
                .for_each(|run| drop(self.system(run, k, value)));
            return Vec::new();
        };
        let (rest, warning) = flow::rest(&system);
        let mut starts = vec![rest; runs.len()];
        for (run, state) in runs.clone().zip(&mut starts) {
            scatter(states.seed, k * states.count + run, &states.widths, state);
        }
        let heads = match Ensemble::new(&system, self.plan.integrator) {
            Ok(mut ensemble) => {
                let mut keep_going = || !self.setting.control.is_interrupted();
                let transient = self.plan.size.transient;
                head_starts(
                    &mut ensemble,
                    &system,
                    &mut starts,
                    transient,
                    &mut keep_going,
                )
            }
            // The runs say why.
            Err(_) => vec![None; runs.len()],
        };
        let begins = starts.into_iter().zip(heads);
        let points = runs.zip(begins).filter_map(|(run, (mut state, head))| {
            let begin = (state.as_mut_slice(), head.unwrap_or_default());
            let mut point = self.point((run, k, value), &system, begin, &[])?;
            point.warning = warning.clone();
            Some((k, state, point))
        });
        points.collect()
    }

    /// Judges a run again with the periodic orbits of the other runs.
    fn reconsider(&self, k: usize, state: &mut [f64], point: &mut SweepPoint, hints: &[Cycle]) {
        let is_open = !matches!(point.attractor.label, Label::Period(_) | Label::Undecided);
        if !is_open || hints.is_empty() {
            return;
        }
        let system = self.system(point.run, k, point.value);
        let Some(system) = system else { return };
        let chosen = flow::integrator(self.setting, &system, self.plan.integrator);
        let Ok(mut integrator) = chosen else { return };
        let mut map = Stroboscopic {
            system: &system,
            integrator: integrator.as_mut(),
        };
        let options = self.plan.labels.options();
        let mut keep_going = |_: usize| !self.setting.control.is_interrupted();
        let moving = (&mut map as &mut dyn Map, state);
        reconsider(
            moving,
            &mut point.attractor,
            hints,
            options,
            &mut keep_going,
        );
    }

    /// The system at a value; `None` when there is none, or when an interrupt was requested.
    fn system(&self, run: usize, k: usize, value: f64) -> Option<System> {
        if self.setting.control.is_interrupted() {
            return None;
        }
        let parameters = std::slice::from_ref(&self.plan.parameter);
        let mut systems = Systems::new(self.setting, parameters, self.plan.at, 1);
        match systems.at(&[value]) {
            Ok(system) => Some(system.clone()),
            Err(list) => {
                self.stop(run, k, value, &joined(&list));
                None
            }
        }
    }

    /// One value, from `state`, which ends as the last one; `None` when it was interrupted or cannot be integrated.
    fn point(
        &self,
        (run, k, value): (usize, usize, f64),
        system: &System,
        (state, head): (&mut [f64], HeadStart),
        hints: &[Cycle],
    ) -> Option<SweepPoint> {
        let setting = self.setting;
        let mut integrator = match flow::integrator(setting, system, self.plan.integrator) {
            Ok(integrator) => integrator,
            Err(fault) => {
                self.stop(run, k, value, &fault.message);
                return None;
            }
        };
        let mut map = Stroboscopic {
            system,
            integrator: integrator.as_mut(),
        };
        let options = self.plan.labels.options();
        let mut keep_going = |_: usize| !setting.control.is_interrupted();
        let begin = (&mut *state, head);
        let mut attractor =
            attractor_from(&mut map, begin, self.plan.size, options, &mut keep_going);
        let moving = (&mut map as &mut dyn Map, &mut *state);
        reconsider(moving, &mut attractor, hints, options, &mut keep_going);
        match attractor.record.stop {
            // A point that was cut short says nothing about its attractor.
            Some(RecordStop::Interrupted) => return None,
            Some(stop) => self.stop(run, k, value, &flow::tell(stop, setting)),
            None => {}
        }
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let share = done as f64 / self.total as f64;
        let words = format!("{done} of {} points", self.total);
        setting.control.progress(setting.name, share, &words);
        Some(SweepPoint {
            value,
            run,
            attractor,
            integrator: integrator.name(),
            strain: integrator.strain(),
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

/// The first reasons in one text; all of them are in the summary.
pub(super) fn shortened(stops: &[String]) -> String {
    let shown = stops[..stops.len().min(SHOWN)].join("; ");
    match stops.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown}; and {more} more (`stops` in the JSON file)"),
    }
}

/// Lyapunov exponents of every point.
pub(super) fn exponents(points: &[SweepPoint]) -> Vec<Option<&Exponents>> {
    let list = points.iter();
    list.map(|p| p.attractor.record.exponents.as_ref())
        .collect()
}
