//! The runs of a parameter study: spread over threads, noted in a journal as they end, written as a table in their order.
//!
//! Threads take runs in their order, never more than a window ahead of the first unfinished one. Each has a pool of its
//! own for what an analysis does in parallel: in a common pool a thread that waits for its share of one run would begin
//! another one, and the window could wait for a run that lies beneath it on the same stack.

use super::record::{Head, StudyRecord, journals};
use super::shelf::Shelf;
use super::{RunSettings, Shard};
use crate::analysis::parameter_study::{Plan, Tally};
use crate::analysis::{Control, ParameterStudy};
use crate::error::Error;
use crate::output::journal::{self, Finished, Journal, Opened};
use crate::output::{self, csv, stream};
use crate::report::{Column, Report, Streamed};
use serde_json::json;
use std::path::Path;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A study and where it runs.
pub(super) struct StudyEnsemble<'a> {
    pub name: &'a str,
    /// Name of the model.
    pub model: &'a str,
    /// The author's words below the heading.
    pub caption: &'a str,
    /// Warnings about the model as written.
    pub warnings: &'a [String],
    pub study: &'a ParameterStudy,
    pub plan: &'a Plan<'a>,
    pub shard: Option<Shard>,
    pub settings: &'a RunSettings,
    pub shelf: &'a Shelf,
    pub control: &'a dyn Control,
}

/// A study as far as it went.
pub(super) struct DeliveredRuns {
    pub report: Report,
    /// To be removed when all results of the command are on disk; `None` when runs are missing.
    pub journal: Option<Journal>,
}

/// Rows kept in memory for figures.
const DRAWN: u64 = 5000;
/// Time between two reports of the progress, and between two looks at the interruption while a thread waits.
const PAUSE: Duration = Duration::from_millis(100);

impl StudyEnsemble<'_> {
    /// Runs what is not finished yet and writes the table of what is.
    ///
    /// # Errors
    /// A file that cannot be written: what is finished stays in the journal. Results of another part in the folder.
    pub fn run(&self) -> Result<DeliveredRuns, Error> {
        let part = self.shard.unwrap_or(Shard::WHOLE);
        let record = self.record();
        record.refuse_other_parts(self.name, &self.settings.out)?;
        output::create_folder(&self.settings.out)?;
        let header = record.header(self.name);
        let digest = output::manifest::sha256(header.as_bytes());
        let file = format!("{}.{}.journal", self.name, &digest[..12]);
        let path = self.settings.out.join(file);
        let place = |run| part.place(run);
        let Opened {
            journal,
            finished,
            damaged,
        } = Journal::open(&path, &header, &place)?;
        let mut warnings = self.strangers(&journal);
        if damaged > 0 {
            let file = journal.name();
            let message =
                format!("{file} was damaged: {damaged} bytes are removed and their runs repeated");
            warnings.push(message);
        }
        let board = Board::new(self, part, journal, finished);
        self.work(&board)?;
        let _writing = self.shelf.writing();
        let (mut journal, finished) = board.conclude()?;
        let table = self.settings.out.join(format!("{}.csv", self.name));
        let columns = self.plan.columns();
        let mut rows = stream::RowFile::create(&table, columns)?;
        journal.in_order(&place, &mut |record| rows.write(record))?;
        rows.finish()?;
        let share = part.share(self.plan.runs());
        let record = StudyRecord {
            finished: finished.count(),
            ..record
        };
        let mut report = conclude(self.study, &table, columns, share, &record)?;
        report.warnings.splice(0..0, warnings);
        let is_complete = record.finished == share;
        if !is_complete {
            let name = json!(journal.name());
            report.summary.insert("journal".into(), name);
        }
        Ok(DeliveredRuns {
            report,
            journal: is_complete.then_some(journal),
        })
    }

    fn record(&self) -> StudyRecord {
        let identity = self.plan.identity().to_string();
        StudyRecord {
            model: self.model.to_owned(),
            version: env!("CARGO_PKG_VERSION").into(),
            input: output::manifest::sha256(identity.as_bytes()),
            runs: self.plan.runs(),
            shard: self.shard,
            finished: 0,
            columns: self.plan.columns().iter().map(Head::of).collect(),
            caption: self.caption.to_owned(),
            warnings: self.warnings.to_vec(),
        }
    }

    /// Warnings about unfinished studies of this name with other settings.
    fn strangers(&self, own: &Journal) -> Vec<String> {
        let own = own.name();
        let names = journals(&self.settings.out, self.name);
        let others = names.into_iter().filter(|name| *name != own);
        let warning = |name: String| {
            format!(
                "{name} holds finished runs of this study with other settings or another version; it is kept: with \
                 those settings the study resumes from it"
            )
        };
        others.map(warning).collect()
    }

    /// Runs the workers until nothing is left, or somebody stops them.
    fn work(&self, board: &Board<'_>) -> Result<(), Error> {
        let jobs = self.settings.jobs.max(1);
        let left = board.left();
        let workers = usize::try_from(left).map_or(jobs, |left| left.min(jobs));
        // No more side by side than the memory holds.
        let bytes = self.plan.cost_of_a_run().bytes;
        let fit = (self.control.memory()).map_or(workers, |most| (most as f64 / bytes) as usize);
        let workers = workers.min(fit.max(1));
        let pool = || {
            rayon::ThreadPoolBuilder::new()
                // Few runs on many cores: each run may use several.
                .num_threads((jobs / workers.max(1)).max(1))
                .build()
                .map_err(|error| Error::File {
                    action: "start threads for",
                    path: self.settings.out.clone(),
                    source: std::io::Error::other(error),
                })
        };
        let pools = (0..workers)
            .map(|_| pool())
            .collect::<Result<Vec<_>, Error>>()?;
        std::thread::scope(|scope| {
            for pool in &pools {
                scope.spawn(|| {
                    pool.install(|| self.control.interrupt().scope(|| self.follow(board)))
                });
            }
        });
        Ok(())
    }

    /// One worker.
    fn follow(&self, board: &Board<'_>) {
        let _alarm = Alarm(board);
        let mut worker = self.plan.worker();
        while let Some(place) = board.take() {
            let Some(row) = worker.run(board.part.run(place)) else {
                return;
            };
            let record = csv::record(&row.cells).map_err(|source| Error::File {
                action: "write",
                path: self.settings.out.clone(),
                source,
            });
            board.note(place, record);
        }
    }
}

/// The report of a table on disk. `share`: the runs that it should have.
///
/// # Errors
/// A table that cannot be read back.
pub(super) fn conclude(
    study: &ParameterStudy,
    table: &Path,
    columns: &[Column],
    share: u64,
    record: &StudyRecord,
) -> Result<Report, Error> {
    // The table ends with `status, reason, warnings`.
    let [reason, warned] = [columns.len() - 2, columns.len() - 1];
    let survey = stream::survey(table, columns, (record.finished, DRAWN), &[reason, warned])?;
    let tally = Tally {
        runs: share,
        finished: record.finished,
        failed: survey.filled[0],
        warned: survey.filled[1],
        stride: survey.stride,
    };
    let mut report = study.report(survey.kept, &tally);
    let statistics: serde_json::Map<String, serde_json::Value> = (columns.iter())
        .zip(&survey.statistics)
        .filter_map(|(column, found)| {
            let s = found.filter(|s| s.count > 0)?;
            let value = json!({
                "count": s.count, "min": s.min, "mean": s.mean, "max": s.max, "deviation": s.deviation(),
            });
            Some((column.name.clone(), value))
        })
        .collect();
    report
        .summary
        .insert("statistics".into(), statistics.into());
    report.summary.insert("study".into(), json!(record));
    report.streamed = Some(Streamed {
        rows: survey.rows,
        files: stream::formats(table, columns)?,
    });
    Ok(report)
}

/// What the workers share: the runs that are left, and the journal.
struct Board<'a> {
    name: &'a str,
    part: Shard,
    total: u64,
    control: &'a dyn Control,
    state: Mutex<EnsembleState>,
    /// The first unfinished run has moved, or everything stops.
    moved: Condvar,
}

struct EnsembleState {
    journal: Journal,
    finished: Finished,
    /// The next place to look at.
    next: u64,
    stopped: bool,
    error: Option<Error>,
    told: Instant,
}

impl<'a> Board<'a> {
    fn new(
        ensemble: &StudyEnsemble<'a>,
        part: Shard,
        journal: Journal,
        finished: Finished,
    ) -> Board<'a> {
        Board {
            name: ensemble.name,
            part,
            total: part.share(ensemble.plan.runs()),
            control: ensemble.control,
            state: Mutex::new(EnsembleState {
                journal,
                next: finished.first_open(),
                finished,
                stopped: false,
                error: None,
                told: Instant::now(),
            }),
            moved: Condvar::new(),
        }
    }

    fn state(&self) -> MutexGuard<'_, EnsembleState> {
        // Whatever panicked has stopped the others; what is in the journal is sound.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn left(&self) -> u64 {
        self.total - self.state().finished.count()
    }

    /// The next place to run; `None` when there is none or all shall stop.
    fn take(&self) -> Option<u64> {
        let mut state = self.state();
        loop {
            while state.finished.contains(state.next) {
                state.next += 1;
            }
            if state.stopped || state.next >= self.total || self.control.is_interrupted() {
                return None;
            }
            if state.next - state.finished.first_open() < journal::WINDOW {
                state.next += 1;
                return Some(state.next - 1);
            }
            let waited = self.moved.wait_timeout(state, PAUSE);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Puts a finished run into the journal.
    fn note(&self, place: u64, record: Result<Vec<u8>, Error>) {
        let mut state = self.state();
        if state.stopped {
            return;
        }
        match record.and_then(|record| state.journal.append(&record)) {
            Ok(()) => {
                state.finished.insert(place);
            }
            Err(error) => {
                state.stopped = true;
                state.error = Some(error);
            }
        }
        if state.told.elapsed() >= PAUSE {
            state.told = Instant::now();
            let done = state.finished.count();
            let share = done as f64 / self.total as f64;
            let words = format!("{done} of {} runs", self.total);
            self.control.progress(self.name, share, &words);
        }
        self.moved.notify_all();
    }

    /// The journal, all of it on the disk, and what is in it.
    fn conclude(self) -> Result<(Journal, Finished), Error> {
        let state = self.state.into_inner();
        let mut state = state.unwrap_or_else(PoisonError::into_inner);
        match state.error {
            Some(error) => Err(error),
            None => {
                state.journal.sync()?;
                Ok((state.journal, state.finished))
            }
        }
    }
}

/// Stops all workers when one panics: its run would keep the others waiting for ever.
struct Alarm<'a, 'b>(&'a Board<'b>);

impl Drop for Alarm<'_, '_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.state().stopped = true;
            self.0.moved.notify_all();
        }
    }
}
