//! Interruption of long computations: a flag that reaches every loop without passing through every call.
//!
//! The caller of an analysis enters a scope with a flag. Loops that may last for seconds check [`is_requested`]: integrators every
//! few steps, factorisations from block to block, searches from evaluation to evaluation. Work that is handed to other
//! threads takes [`current`] along and enters it there. Without a scope nothing is ever interrupted.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that another thread may raise.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicBool>);

thread_local! {
    static CURRENT: RefCell<Option<Interrupt>> = const { RefCell::new(None) };
}

impl Interrupt {
    /// Requests everything in the scopes of this flag to stop.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether a stop was requested.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Runs `work` in the scope of this flag, on this thread.
    pub fn scope<T>(&self, work: impl FnOnce() -> T) -> T {
        let _outer = Outer(CURRENT.replace(Some(self.clone())));
        work()
    }
}

/// Restores the outer scope, also when the work panics.
struct Outer(Option<Interrupt>);

impl Drop for Outer {
    fn drop(&mut self) {
        CURRENT.set(self.0.take());
    }
}

/// Flag of the scope around the caller; outside all scopes a flag that is never raised.
pub fn current() -> Interrupt {
    CURRENT.with_borrow(|flag| flag.clone()).unwrap_or_default()
}

/// Whether the scope around the caller was requested to stop.
pub fn is_requested() -> bool {
    CURRENT.with_borrow(|flag| flag.as_ref().is_some_and(Interrupt::is_requested))
}

/// Checks the flag at intervals, for loops with short iterations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Watch(u32);

/// Rounds between two looks, a power of two: few, for the steps of a long train take milliseconds.
const ROUNDS: u32 = 16;

impl Watch {
    /// Counts a round; whether to stop.
    pub fn is_requested(&mut self) -> bool {
        self.0 = self.0.wrapping_add(1);
        self.0.is_multiple_of(ROUNDS) && is_requested()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scopes_nest_and_end_with_a_panic() {
        let (outer, inner) = (Interrupt::default(), Interrupt::default());
        outer.request();
        assert!(!is_requested());
        outer.scope(|| {
            assert!(is_requested());
            inner.scope(|| assert!(!is_requested()));
            let end = std::panic::catch_unwind(|| inner.scope(|| panic!("as planned")));
            assert!(end.is_err() && is_requested());
            let flag = current();
            let elsewhere = std::thread::spawn(move || flag.scope(is_requested));
            assert!(elsewhere.join().unwrap());
        });
        assert!(!is_requested());
    }

    #[test]
    fn watches_look_once_in_a_while() {
        let flag = Interrupt::default();
        flag.request();
        flag.scope(|| {
            let mut watch = Watch::default();
            let rounds = (1..).find(|_| watch.is_requested());
            assert_eq!(rounds, Some(ROUNDS));
        });
    }
}
