//! The starts followed, spread over the threads. The result is the same for any number of them: attractors become known between
//! rounds of starts only, in the order of the starts.

use super::grid::Grid;
use crate::analysis::Setting;
use crate::analysis::flow::PreparedMotion;
use crate::interrupt;
use crate::solve::attractor::basins::{Fate, Patience, SettledMotion, fate, trapped};
use crate::solve::attractor::{RecordStop, Stroboscopic};
use crate::solve::ensemble::{Ensemble, Next, Visit};
use crate::solve::integrate::{IntegrationEnd, IntegratorChoice};
use crate::system::System;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Outcome of a start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sorted {
    /// It has not been followed.
    Unknown,
    /// It ends at this attractor.
    At(u32),
    /// It ends nowhere within the limit.
    Undecided,
    /// It could not be followed.
    Failed,
}

/// Starts of the first round and of the largest one.
const ROUNDS: (usize, usize) = (8, 65_536);
/// Starts that a thread takes at a time.
const CHUNK: usize = 64;
/// Step through the starts relative to their number: the golden ratio visits all parts of the grid early.
const STEP: f64 = 0.618_033_988_749_894_9;

/// Data shared by all starts.
#[derive(Clone, Copy)]
pub(super) struct BasinStart<'a> {
    system: &'a System,
    /// State at phase 0 before the grid's coordinates are put in.
    state: &'a [f64],
    integrator: &'static str,
}

/// The starts on their way to attractors.
pub(super) struct Sorting<'a> {
    setting: &'a Setting<'a>,
    start: BasinStart<'a>,
    pub grid: &'a Grid,
    pub patience: Patience,
    pub known: Vec<SettledMotion>,
    pub sorted: Vec<Sorted>,
    /// The first start that could not be followed, and why.
    pub failure: Option<(usize, RecordStop)>,
    done: AtomicUsize,
}

impl<'a> Sorting<'a> {
    pub fn new(
        setting: &'a Setting<'a>,
        (start, grid): (BasinStart<'a>, &'a Grid),
        patience: Patience,
    ) -> Sorting<'a> {
        Sorting {
            setting,
            start,
            grid,
            patience,
            known: Vec::new(),
            sorted: vec![Sorted::Unknown; grid.starts()],
            failure: None,
            done: AtomicUsize::new(0),
        }
    }

    /// Follows all starts, round by round.
    pub fn run(&mut self) {
        let total = self.sorted.len();
        let step = stride(total);
        let (mut begin, mut length) = (0, ROUNDS.0);
        while begin < total && !self.setting.control.is_interrupted() {
            let end = (begin + length).min(total);
            let start = |k: usize| (k as u128 * step as u128 % total as u128) as usize;
            let starts: Vec<usize> = (begin..end).map(start).collect();
            let fates = self.round(&starts);
            for (start, fate) in starts.into_iter().zip(fates) {
                self.settle(start, fate);
            }
            begin = end;
            length = (2 * length).min(ROUNDS.1);
        }
    }

    /// Where some starts end, as far as it is known what there is.
    fn round(&self, starts: &[usize]) -> Vec<Fate> {
        let flag = interrupt::current();
        let chunk = |ensemble: &mut Option<Ensemble>, starts: &[usize]| {
            flag.scope(|| {
                let ensemble = match ensemble {
                    Some(ensemble) => ensemble,
                    // The choice was made for this system before.
                    None => match Ensemble::new(self.start.system, self.start.choice()) {
                        Ok(made) => ensemble.insert(made),
                        Err(_) => return vec![Fate::Undecided; starts.len()],
                    },
                };
                self.chunk(ensemble, starts)
            })
        };
        let chunks = starts.par_chunks(CHUNK).map_init(|| None, chunk);
        chunks.flatten().collect()
    }

    /// The transients of several starts together, and what is left of each alone.
    fn chunk(&self, ensemble: &mut Ensemble, starts: &[usize]) -> Vec<Fate> {
        let system = self.start.system;
        let (size, transient) = (self.size(), self.patience.transient);
        let mut states = Vec::with_capacity(size * starts.len());
        let mut fates: Vec<Option<Fate>> = Vec::with_capacity(starts.len());
        for start in starts {
            let mut state = self.start.state.to_vec();
            self.grid.place(*start, &mut state);
            fates.push(trapped(&self.known, &state).map(Fate::Known));
            states.extend(state);
        }
        // What is trapped from the begin stays at home.
        let travelling: Vec<usize> = (0..starts.len()).filter(|k| fates[*k].is_none()).collect();
        let begins = travelling.iter().flat_map(|k| &states[k * size..][..size]);
        let begins: Vec<f64> = begins.copied().collect();
        let mut visit = |visit: Visit<'_>| {
            let k = travelling[visit.trajectory];
            if !visit.state.iter().all(|x| x.is_finite()) {
                let stop = RecordStop::Failed(IntegrationEnd::Diverged, visit.period);
                fates[k] = Some(Fate::Stopped(stop));
            } else if self.setting.control.is_interrupted() {
                fates[k] = Some(Fate::Stopped(RecordStop::Interrupted));
            } else if visit.period < transient {
                fates[k] = trapped(&self.known, visit.state).map(Fate::Known);
            }
            states[k * size..][..size].copy_from_slice(visit.state);
            match fates[k] {
                None => Next::GoOn,
                Some(_) => Next::Stop,
            }
        };
        let ends = ensemble.run(system, &begins, transient, &mut visit);
        for (k, end) in travelling.iter().zip(ends) {
            if end != IntegrationEnd::Reached {
                fates[*k] = Some(Fate::Stopped(RecordStop::of(end, transient)));
            }
        }
        let states = states.chunks_exact_mut(size);
        let fates = fates.into_iter().zip(states).map(|(fate, state)| {
            let fate = fate.unwrap_or_else(|| self.settled(ensemble, state));
            self.note();
            fate
        });
        fates.collect()
    }

    /// Where a state behind its transient ends.
    fn settled(&self, ensemble: &mut Ensemble, state: &mut [f64]) -> Fate {
        let mut map = Stroboscopic {
            system: self.start.system,
            integrator: ensemble.integrator(),
        };
        let mut keep_going = |_: usize| !self.setting.control.is_interrupted();
        let from = (state, self.patience.transient);
        fate(&mut map, from, &self.known, self.patience, &mut keep_going)
    }

    fn note(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if done.is_multiple_of(64) {
            let total = self.sorted.len();
            let words = format!("start {done} of {total}");
            let share = done as f64 / total as f64;
            self.setting
                .control
                .progress(self.setting.name, share, &words);
        }
    }

    fn settle(&mut self, start: usize, fate: Fate) {
        self.sorted[start] = match fate {
            Fate::Known(k) => Sorted::At(k as u32),
            Fate::New(found) => {
                let known = self.known.iter().position(|a| a.is_same(&found));
                let k = known.unwrap_or_else(|| {
                    self.known.push(*found);
                    self.known.len() - 1
                });
                Sorted::At(k as u32)
            }
            Fate::Undecided => Sorted::Undecided,
            Fate::Stopped(RecordStop::Interrupted) => Sorted::Unknown,
            Fate::Stopped(stop) => {
                self.failure.get_or_insert((start, stop));
                Sorted::Failed
            }
        };
    }

    /// Values in a state.
    pub fn size(&self) -> usize {
        self.start.state.len()
    }

    /// The system at its frequency.
    pub fn system(&self) -> &System {
        self.start.system
    }

    /// Integrator.
    pub fn integrator(&self) -> &'static str {
        self.start.integrator
    }

    /// Starts that end at every attractor.
    pub fn counts(&self) -> Vec<usize> {
        let mut counts = vec![0; self.known.len()];
        for sorted in &self.sorted {
            if let Sorted::At(k) = sorted {
                counts[*k as usize] += 1;
            }
        }
        counts
    }
}

impl<'a> BasinStart<'a> {
    /// Initial state of a motion.
    pub fn of(motion: &'a PreparedMotion) -> BasinStart<'a> {
        BasinStart {
            system: &motion.system,
            state: &motion.state,
            integrator: motion.integrator.name(),
        }
    }

    /// Each thread has an integrator of its own.
    fn choice(self) -> IntegratorChoice {
        match self.integrator {
            "dopri5" => IntegratorChoice::Dopri5,
            _ => IntegratorChoice::Auto,
        }
    }
}

/// A step through the starts that visits each of them once.
fn stride(total: usize) -> usize {
    let divisor = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let first = ((total as f64 * STEP) as usize).max(1);
    (first..).find(|k| divisor(*k, total) == 1).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_start_is_met_once() {
        for total in [1, 2, 3, 7, 8, 100, 41 * 41] {
            let step = stride(total);
            let mut met: Vec<usize> = (0..total).map(|k| k * step % total).collect();
            met.sort_unstable();
            assert!(met.into_iter().eq(0..total), "{total}");
        }
    }
}
