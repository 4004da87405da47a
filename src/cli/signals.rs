//! Signals: the first one asks a run to write what it has and to end, the second one ends the process at once.

/// Number of a signal; the exit status is 128 more.
pub type SignalNumber = u8;

/// Ctrl-C.
#[cfg(not(unix))]
const INTERRUPT: SignalNumber = 2;

/// Exit status of a process that a signal has ended.
pub fn status(signal: SignalNumber) -> u8 {
    128 + signal
}

/// Calls `first` with the number of the first signal that asks the process to end.
///
/// # Errors
/// Errors of the operating system: signals then end the process at once.
#[cfg(unix)]
pub fn watch(first: impl Fn(SignalNumber) + Send + 'static) -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXCPU, SIGXFSZ};
    use signal_hook::iterator::Signals;
    // Whoever started the process may have told it to ignore some, as `nohup` does.
    let ignored = ignored();
    let is_wanted = |signal: &i32| ignored & (1 << (signal - 1)) == 0;
    // A file that grows beyond the limit of the process is an error of its writer, who removes what is incomplete.
    let is_beyond = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
    signal_hook::flag::register(SIGXFSZ, is_beyond)?;
    let wanted = [SIGINT, SIGTERM, SIGHUP, SIGXCPU];
    let mut signals = Signals::new(wanted.iter().filter(|s| is_wanted(s)))?;
    let listen = move || {
        let mut has_come = false;
        for signal in signals.forever() {
            let signal = SignalNumber::try_from(signal).unwrap_or_default();
            // The limit of computing time is announced every second.
            if has_come && i32::from(signal) != SIGXCPU {
                std::process::exit(i32::from(status(signal)));
            }
            if !has_come {
                first(signal);
            }
            has_come = true;
        }
    };
    std::thread::Builder::new()
        .name("signals".into())
        .spawn(listen)?;
    Ok(())
}

/// Signals that the process was told to ignore, one bit each, the first one in the lowest.
#[cfg(unix)]
fn ignored() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = text.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or(0)
}

/// Calls `first` with the number of the first signal that asks the process to end.
///
/// # Errors
/// Errors of the operating system: signals then end the process at once.
#[cfg(not(unix))]
pub fn watch(first: impl Fn(SignalNumber) + Send + 'static) -> std::io::Result<()> {
    let has_come = std::sync::atomic::AtomicBool::new(false);
    let handler = move || {
        if has_come.swap(true, std::sync::atomic::Ordering::Relaxed) {
            std::process::exit(i32::from(status(INTERRUPT)));
        }
        first(INTERRUPT);
    };
    ctrlc::set_handler(handler).map_err(std::io::Error::other)
}
