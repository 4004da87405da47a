//! Progress on a terminal, and what ends a run before its end: signals and limits.

use super::signals::{self, SignalNumber};
use crate::analysis::{Control, Emergency};
use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::machine;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// A run shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);
const TICKS: u64 = 1000;
/// Time between two looks at the limits.
const PAUSE: Duration = Duration::from_millis(50);
/// Bytes that the machine keeps, and bytes of addresses that the process keeps: a run ends in order before the system ends it.
const RESERVE: u64 = 100 << 20;
const ADDRESSES: u64 = 32 << 20;
/// Time that a run has to end in order after an interruption.
const GRACE: Duration = Duration::from_millis(1400);

/// Cause of an early end of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// A signal.
    Signal(SignalNumber),
    /// The limit of time.
    Time(Duration),
    /// The limit of memory, in bytes; `None`: that of the machine.
    Memory(Option<u64>),
}

/// Limits that the user gives.
#[derive(Debug, Clone, Copy, Default)]
pub struct RunLimits {
    /// Of time.
    pub time: Option<Duration>,
    /// Of memory, in bytes.
    pub memory: Option<u64>,
}

/// Progress bar, interruption and limits of a run.
pub struct Terminal {
    interrupt: Interrupt,
    cause: Arc<OnceLock<Cause>>,
    began: Instant,
    limits: RunLimits,
    /// What writes the finished results when a run does not hear of an interruption.
    emergency: Arc<Mutex<Option<Emergency>>>,
    bar: ProgressBar,
    analyses: usize,
    shares: Mutex<BTreeMap<String, f64>>,
}

impl Terminal {
    /// A bar for a number of analyses; none if quiet or if standard error is not a terminal.
    pub fn new(analyses: usize, quiet: bool, limits: RunLimits) -> Terminal {
        let bar = ProgressBar::with_draw_target(Some(TICKS), ProgressDrawTarget::hidden());
        if !quiet && std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::stderr());
            if let Ok(style) =
                ProgressStyle::with_template("{bar:30} {percent}% {msg} ({eta} left)")
            {
                bar.set_style(style);
            }
        }
        Terminal {
            interrupt: Interrupt::default(),
            cause: Arc::default(),
            began: Instant::now(),
            limits,
            emergency: Arc::default(),
            bar,
            analyses,
            shares: Mutex::new(BTreeMap::new()),
        }
    }

    /// The first signal asks the analyses to stop and to write what they have; the second ends the process.
    pub fn watch_for_signals(&self) {
        let (flag, cause) = (self.interrupt.clone(), Arc::clone(&self.cause));
        let handler = move |signal| {
            let _ = cause.set(Cause::Signal(signal));
            flag.request();
            super::complain(
                "\ninterrupted: writing finished results; a second signal (Ctrl-C) quits at once",
            );
        };
        if let Err(error) = signals::watch(handler) {
            super::complain(&format!(
                "warning: signals such as Ctrl-C will end the run at once ({error})"
            ));
        }
    }

    /// Ends the analyses where they reach a limit.
    pub fn watch_limits(&self) {
        let (flag, cause) = (self.interrupt.clone(), Arc::clone(&self.cause));
        let (limits, began) = (self.limits, self.began);
        let emergency = Arc::clone(&self.emergency);
        let watch = move || {
            while !flag.is_requested() {
                std::thread::sleep(PAUSE);
                if let Some(reached) = reached(limits, began) {
                    let _ = cause.set(reached);
                    flag.request();
                }
            }
            std::thread::sleep(GRACE);
            let conclude = emergency
                .lock()
                .ok()
                .and_then(|mut conclude| conclude.take());
            if let Some(outcome) = conclude.and_then(|conclude| conclude()) {
                let status = cause
                    .get()
                    .map_or(super::ENDED_EARLY, |cause| cause.status());
                std::process::exit(i32::from(leave(outcome, status)));
            }
        };
        // Without the thread only the estimates made before the run apply.
        let _ = std::thread::Builder::new()
            .name("limits".into())
            .spawn(watch);
    }

    /// Cause of an early end, if any.
    pub fn cause(&self) -> Option<Cause> {
        self.cause.get().copied()
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// Says what is lost when the process ends before its analyses; the exit status.
fn leave(outcome: Result<Vec<String>, Error>, status: u8) -> u8 {
    match outcome {
        Ok(names) => {
            for name in names {
                super::complain(&format!(
                    "warning: {name} did not end in time: finished runs of a study are in its journal, its other \
                     results are lost"
                ));
            }
            status
        }
        Err(error) => {
            super::complain(&super::describe(&error));
            super::BAD_INPUT
        }
    }
}

/// The limit that a run has reached.
fn reached(limits: RunLimits, began: Instant) -> Option<Cause> {
    if let Some(time) = limits.time.filter(|time| began.elapsed() >= *time) {
        return Some(Cause::Time(time));
    }
    let is_beyond = |most: &u64| machine::resident_memory().is_some_and(|taken| taken >= *most);
    if limits.memory.as_ref().is_some_and(is_beyond) {
        return Some(Cause::Memory(limits.memory));
    }
    let is_full = machine::free_memory().is_some_and(|left| left < RESERVE)
        || machine::address_space().is_some_and(|left| left < ADDRESSES);
    is_full.then_some(Cause::Memory(None))
}

impl Cause {
    /// Exit status.
    pub fn status(self) -> u8 {
        match self {
            Cause::Signal(signal) => signals::status(signal),
            Cause::Time(_) | Cause::Memory(_) => super::ENDED_EARLY,
        }
    }

    /// A sentence for people.
    pub fn message(self) -> String {
        match self {
            Cause::Signal(_) => "interrupted".into(),
            Cause::Time(limit) => {
                let limit = machine::duration(limit.as_secs_f64());
                format!("the time limit of {limit} was reached (--time-limit)")
            }
            Cause::Memory(Some(limit)) => {
                let limit = machine::bytes(limit as f64);
                format!("the memory limit of {limit} was reached (--memory-limit)")
            }
            Cause::Memory(None) => "the memory of the machine is exhausted".into(),
        }
    }
}

impl Control for Terminal {
    fn is_interrupted(&self) -> bool {
        self.interrupt.is_requested()
    }

    fn interrupt(&self) -> Interrupt {
        self.interrupt.clone()
    }

    fn in_emergency(&self, conclude: Emergency) {
        if let Ok(mut emergency) = self.emergency.lock() {
            *emergency = Some(conclude);
        }
    }

    fn memory(&self) -> Option<u64> {
        let machine = machine::available_memory();
        [self.limits.memory, machine].into_iter().flatten().min()
    }

    fn reason(&self) -> Option<String> {
        match self.cause()? {
            Cause::Signal(_) => None,
            limit => Some(limit.message()),
        }
    }

    fn progress(&self, analysis: &str, share: f64, words: &str) {
        if self.bar.is_hidden() || self.began.elapsed() < PATIENCE {
            return;
        }
        let Ok(mut shares) = self.shares.lock() else {
            return;
        };
        shares.insert(analysis.to_string(), share);
        let done = shares.values().sum::<f64>() / self.analyses.max(1) as f64;
        self.bar.set_position((done * TICKS as f64) as u64);
        self.bar.set_message(format!("{analysis}: {words}"));
    }
}
