//! Finished analyses on their way to the page and the manifest, where two may conclude: the run itself, or, when an analysis
//! does not hear of an interruption in time, whoever ends the process.

use super::{Outcome, RunSettings, WrittenReport};
use crate::error::Error;
use crate::output::RunOptions;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Results that are on disk, by their place in the file.
#[derive(Clone)]
pub(super) struct Shelf(Arc<Inner>);

struct Inner {
    settings: RunSettings,
    options: RunOptions,
    /// Names of the analyses, by place.
    names: Vec<String>,
    state: Mutex<ShelfState>,
}

#[derive(Default)]
struct ShelfState {
    written: BTreeMap<usize, WrittenReport>,
    /// Analyses whose files are being written.
    writers: usize,
    is_concluded: bool,
}

/// Time that files being written get before the process ends.
const PATIENCE: Duration = Duration::from_secs(20);
/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(10);

impl Shelf {
    /// An empty one.
    pub fn new(settings: &RunSettings, options: RunOptions, names: Vec<String>) -> Shelf {
        Shelf(Arc::new(Inner {
            settings: settings.clone(),
            options,
            names,
            state: Mutex::default(),
        }))
    }

    fn state(&self) -> MutexGuard<'_, ShelfState> {
        let state = self.0.state.lock();
        state.unwrap_or_else(PoisonError::into_inner)
    }

    /// Tells that results are being written: whoever ends the process waits until the guard is gone.
    pub fn writing(&self) -> Writing<'_> {
        self.state().writers += 1;
        Writing(self)
    }

    /// Writes an analysis and keeps it.
    ///
    /// # Errors
    /// Errors of `write`.
    pub fn put(
        &self,
        place: usize,
        write: impl FnOnce() -> Result<WrittenReport, Error>,
    ) -> Result<(), Error> {
        let _writing = self.writing();
        let written = write()?;
        self.state().written.insert(place, written);
        Ok(())
    }

    /// Writes page and manifest of what is there. When somebody else does so, this waits for the end of the process.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn conclude(&self, interrupted: bool) -> Result<Outcome, Error> {
        loop {
            if let Some(written) = self.claim() {
                return self.summarise(written, interrupted);
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// The same in place of the run, which is still busy: what has not ended is left out. `None` when the run concludes.
    pub fn conclude_without_the_rest(&self) -> Option<Result<Outcome, Error>> {
        let began = Instant::now();
        while self.state().writers > 0 && began.elapsed() < PATIENCE {
            std::thread::sleep(PAUSE);
        }
        let written = self.claim()?;
        let names = self.0.names.iter().enumerate();
        let missing = names.filter(|(place, _)| !written.contains_key(place));
        let left_out = missing.map(|(_, name)| name.clone()).collect();
        let outcome = self.summarise(written, true);
        Some(outcome.map(|outcome| Outcome {
            left_out,
            ..outcome
        }))
    }

    fn claim(&self) -> Option<BTreeMap<usize, WrittenReport>> {
        let mut state = self.state();
        let is_first = !std::mem::replace(&mut state.is_concluded, true);
        is_first.then(|| std::mem::take(&mut state.written))
    }

    fn summarise(
        &self,
        written: BTreeMap<usize, WrittenReport>,
        interrupted: bool,
    ) -> Result<Outcome, Error> {
        let Inner {
            settings, options, ..
        } = &*self.0;
        Outcome::summarised(
            written.into_values().collect(),
            settings,
            options,
            interrupted,
        )
    }
}

/// Results that are being written, until it is dropped.
pub(super) struct Writing<'a>(&'a Shelf);

impl Drop for Writing<'_> {
    fn drop(&mut self) {
        self.0.state().writers -= 1;
    }
}
