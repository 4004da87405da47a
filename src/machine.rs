//! What the machine has: memory within all limits, room on a disk, living processes.
//!
//! Systems that do not say are taken to have no limit.

use std::path::Path;
use std::sync::OnceLock;

/// Share of the free memory that is promised: the rest is for stacks, the allocator and everybody else.
const PROMISED: f64 = 0.9;

/// Bytes of memory that this process may still take, within the limits of the process, of its control group and of the
/// machine; `None` if unknown. Asked once: the same answer for all runs of a study.
pub fn available_memory() -> Option<u64> {
    static AVAILABLE: OnceLock<Option<u64>> = OnceLock::new();
    *AVAILABLE.get_or_init(|| {
        let least = [free_memory(), address_space(), control_groups()];
        let least = least.into_iter().flatten().min()?;
        Some((PROMISED * least as f64) as u64)
    })
}

/// Bytes of memory that this process takes at the moment.
pub fn resident_memory() -> Option<u64> {
    pages(1)
}

/// Bytes of memory that the machine has left at the moment.
pub fn free_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    let kilobytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    kilobytes.checked_mul(1024)
}

/// Bytes left of the address space that the process may have.
pub fn address_space() -> Option<u64> {
    limit_of_address_space()?.checked_sub(pages(0)?)
}

#[cfg(unix)]
fn limit_of_address_space() -> Option<u64> {
    use rustix::process::{Resource, getrlimit};
    let limits = [Resource::As, Resource::Data].map(|r| getrlimit(r).current);
    limits.into_iter().flatten().min()
}

#[cfg(not(unix))]
fn limit_of_address_space() -> Option<u64> {
    None
}

/// A field of /proc/self/statm, in bytes.
fn pages(field: usize) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split_whitespace().nth(field)?.parse().ok()?;
    pages.checked_mul(page_size())
}

#[cfg(unix)]
fn page_size() -> u64 {
    rustix::param::page_size() as u64
}

#[cfg(not(unix))]
fn page_size() -> u64 {
    4096
}

/// Bytes left in the control groups of the process, version 2 and 1.
fn control_groups() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    let left = |line: &str| {
        let mut parts = line.splitn(3, ':');
        let (controllers, group) = (parts.nth(1)?, parts.next()?.trim_start_matches('/'));
        let (root, most, taken) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max", "memory.current"),
            list if list.split(',').any(|c| c == "memory") => (
                "/sys/fs/cgroup/memory",
                "memory.limit_in_bytes",
                "memory.usage_in_bytes",
            ),
            _ => return None,
        };
        // The limits of all groups above hold as well.
        let group = Path::new(root).join(group);
        let above = group.ancestors().take_while(|g| g.starts_with(root));
        above
            .filter_map(|g| number(&g.join(most))?.checked_sub(number(&g.join(taken))?))
            .min()
    };
    text.lines().filter_map(left).min()
}

fn number(path: &Path) -> Option<u64> {
    std::fs::read_to_string(path).ok()?.trim().parse().ok()
}

/// Bytes that this user may still write to the file system of a folder.
#[cfg(unix)]
pub fn room(folder: &Path) -> Option<u64> {
    let found = rustix::fs::statvfs(folder).ok()?;
    found.f_bavail.checked_mul(found.f_frsize)
}

/// Bytes that this user may still write to the file system of a folder.
#[cfg(not(unix))]
pub fn room(_folder: &Path) -> Option<u64> {
    None
}

/// Whether a process of this number lives; who cannot know says yes.
#[cfg(unix)]
pub fn is_alive(process: u32) -> bool {
    use rustix::process::{Pid, test_kill_process};
    let pid = i32::try_from(process).ok().and_then(Pid::from_raw);
    pid.is_some_and(|pid| test_kill_process(pid) != Err(rustix::io::Errno::SRCH))
}

/// Whether a process of this number lives; who cannot know says yes.
#[cfg(not(unix))]
pub fn is_alive(_process: u32) -> bool {
    true
}

/// A number of bytes for people: `3.4 GB`.
pub fn bytes(count: f64) -> String {
    let units = ["bytes", "kB", "MB", "GB", "TB", "PB"];
    let (mut value, mut unit) = (count, 0);
    while value >= 999.5 && unit + 1 < units.len() {
        (value, unit) = (value / 1000.0, unit + 1);
    }
    match unit {
        0 => format!("{value:.0} bytes"),
        _ if value >= 1e4 => format!("{value:.1e} {}", units[unit]),
        _ => format!("{} {}", two_digits(value), units[unit]),
    }
}

/// A number of seconds for people: `40 s`, `3.2 h`.
pub fn duration(seconds: f64) -> String {
    let units = [
        (86_400.0 * 365.0, "years"),
        (86_400.0, "days"),
        (3600.0, "h"),
        (60.0, "min"),
    ];
    match units
        .into_iter()
        .find(|(length, _)| seconds >= 2.0 * length)
    {
        Some((length, unit)) if seconds / length >= 1e4 => {
            format!("{:.1e} {unit}", seconds / length)
        }
        Some((length, unit)) => format!("{} {unit}", two_digits(seconds / length)),
        None => format!("{} s", two_digits(seconds)),
    }
}

fn two_digits(value: f64) -> String {
    if value < 10.0 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_times_are_for_people() {
        let sizes = [0.0, 999.0, 2.5e9, 6.4977e10, 1e30].map(bytes);
        assert_eq!(
            sizes,
            ["0 bytes", "999 bytes", "2.5 GB", "65 GB", "1.0e15 PB"]
        );
        let times = [1.0, 90.0, 200.0, 7200.0, 1e6, 1e15].map(duration);
        assert_eq!(
            times,
            [
                "1.0 s",
                "90 s",
                "3.3 min",
                "2.0 h",
                "12 days",
                "3.2e7 years"
            ]
        );
    }

    #[test]
    fn this_process_lives_and_takes_memory() {
        assert!(is_alive(std::process::id()));
        if cfg!(target_os = "linux") {
            assert!(resident_memory().unwrap() > 100_000);
            assert!(free_memory().unwrap() > resident_memory().unwrap() / 100);
            assert!(available_memory().unwrap() < free_memory().unwrap() * 2);
            // The largest number that a process can have is 2^22.
            assert!(!is_alive(1 << 23));
        }
    }
}
