//! Progress on a terminal, and Ctrl-C.

use crate::analysis::Control;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A run shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);
const TICKS: u64 = 1000;

/// Progress bar and interruption flag of a run.
pub struct Terminal {
    interrupted: Arc<AtomicBool>,
    began: Instant,
    bar: ProgressBar,
    analyses: usize,
    shares: Mutex<BTreeMap<String, f64>>,
}

impl Terminal {
    /// A bar over so many analyses; none when quiet or when standard error is no terminal.
    pub fn new(analyses: usize, quiet: bool) -> Terminal {
        let bar = ProgressBar::with_draw_target(Some(TICKS), ProgressDrawTarget::hidden());
        if !quiet && std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::stderr());
            if let Ok(style) =
                ProgressStyle::with_template("{bar:30} {percent}% {msg} ({eta} left)")
            {
                bar.set_style(style);
            }
        }
        let interrupted = Arc::new(AtomicBool::new(false));
        Terminal {
            interrupted,
            began: Instant::now(),
            bar,
            analyses,
            shares: Mutex::new(BTreeMap::new()),
        }
    }

    /// The first Ctrl-C asks the analyses to stop and to write what they have; the second ends the process.
    pub fn watch_for_interrupts(&self) {
        let flag = Arc::clone(&self.interrupted);
        let handler = move || {
            if flag.swap(true, Ordering::Relaxed) {
                std::process::exit(i32::from(super::INTERRUPTED));
            }
            eprintln!(
                "\ninterrupted: writing what is finished; press Ctrl-C again to quit at once"
            );
        };
        if let Err(error) = ctrlc::set_handler(handler) {
            eprintln!("warning: Ctrl-C will end the run at once ({error})");
        }
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

impl Control for Terminal {
    fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
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
