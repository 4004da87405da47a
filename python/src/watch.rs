//! Long work beside a Python thread that stays awake for Ctrl-C and progress.

use super::failure::whole;
use gearlash::analysis::{Control, Observer};
use gearlash::error::Error;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time between two looks at signals.
const PAUSE: Duration = Duration::from_millis(50);
/// Stack of the thread that computes; only what is used is taken.
const STACK: usize = 32 << 20;

/// How far the work is.
#[derive(Default)]
struct State {
    ended: bool,
    told: Option<(f64, String)>,
}

/// What the two threads share.
#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    moved: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for the end, or for a while; the progress since the last time, and whether the work has ended.
    fn wait(&self) -> (Option<(f64, String)>, bool) {
        let waited = self
            .moved
            .wait_timeout_while(self.state(), PAUSE, |s| !s.ended);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner).0;
        (state.told.take(), state.ended)
    }

    fn end(&self) {
        self.state().ended = true;
        self.moved.notify_all();
    }
}

/// Runs work on a thread of its own without the GIL. `progress` is called on this thread with (share, words) now and then. Ctrl-C
/// asks the work to end with what it has: the second value says so. Asked twice, it raises KeyboardInterrupt.
///
/// # Errors
/// Those of the work; exceptions of signal handlers and of `progress`.
pub fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&dyn Control) -> Result<T, Error> + Send,
) -> PyResult<(T, bool)> {
    let shared = Arc::new(Shared::default());
    let listener = shared.clone();
    let observer = Observer::new(move |_: &str, share: f64, words: &str| {
        listener.state().told = Some((share, words.to_owned()));
        true
    });
    let mut interruption: Option<PyErr> = None;
    let outcome = std::thread::scope(|scope| {
        let worker = std::thread::Builder::new().stack_size(STACK);
        let (shared, observer) = (&shared, &observer);
        let worker = worker.spawn_scoped(scope, move || {
            let outcome = catch_unwind(AssertUnwindSafe(|| in_pool(|| work(observer))));
            shared.end();
            outcome
        });
        let Ok(worker) = worker else {
            return Err(PyRuntimeError::new_err("cannot start another thread"));
        };
        let mut asked_twice = false;
        loop {
            let (told, ended) = py.detach(|| shared.wait());
            if ended {
                break;
            }
            let mut stop = py.check_signals();
            if let (Ok(()), Some((share, words)), Some(progress)) = (&stop, told, progress) {
                stop = progress.call1((share, words)).map(|_| ());
            }
            if let Err(error) = stop {
                observer.interrupt().request();
                asked_twice |= interruption.is_some();
                interruption = Some(error);
            }
        }
        let joined = py.detach(|| worker.join());
        match interruption.take() {
            Some(error) if asked_twice || !error.is_instance_of::<PyKeyboardInterrupt>(py) => {
                Err(error)
            }
            earlier => {
                interruption = earlier;
                Ok(joined.and_then(|outcome| outcome))
            }
        }
    })?;
    Ok((whole(py, outcome)?, interruption.is_some()))
}

/// Whether this process is a fork of one that had threads already: they have not come along.
static FORKED: AtomicBool = AtomicBool::new(false);
/// Threads of a forked process, with its number.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Told by Python in the child after a fork.
#[pyfunction]
pub fn forked() {
    FORKED.store(true, Ordering::Relaxed);
}

/// Runs work where its parallel parts find threads: the common ones, or those of a forked process.
pub fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if !FORKED.load(Ordering::Relaxed) {
        return work();
    }
    let own = std::process::id();
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let threads = match &*pool {
        Some((process, threads)) if *process == own => Some(threads.clone()),
        _ => ThreadPoolBuilder::new().build().ok().map(Arc::new),
    };
    *pool = threads.clone().map(|threads| (own, threads));
    drop(pool);
    match threads {
        Some(threads) => threads.install(work),
        None => work(),
    }
}
