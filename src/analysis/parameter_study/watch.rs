//! Whether a run of a study was interrupted.

use crate::analysis::Control;
use crate::interrupt::Interrupt;
use std::sync::atomic::{AtomicBool, Ordering};

/// Hands the interruption on to a run, and remembers whether the run has heard of it: one that has not is complete.
pub(super) struct RunWatch<'a> {
    control: &'a dyn Control,
    spoke: AtomicBool,
}

impl<'a> RunWatch<'a> {
    /// Of a run that is about to start.
    pub fn new(control: &'a dyn Control) -> RunWatch<'a> {
        RunWatch {
            control,
            spoke: AtomicBool::new(false),
        }
    }

    /// Whether the run has heard of an interruption.
    pub fn has_spoken(&self) -> bool {
        self.spoke.load(Ordering::Relaxed)
    }
}

impl Control for RunWatch<'_> {
    fn interrupt(&self) -> Interrupt {
        self.control.interrupt()
    }

    fn memory(&self) -> Option<u64> {
        self.control.memory()
    }

    fn is_interrupted(&self) -> bool {
        let interrupted = self.control.is_interrupted();
        if interrupted {
            self.spoke.store(true, Ordering::Relaxed);
        }
        interrupted
    }
}
