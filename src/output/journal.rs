//! The journal of a study: its finished runs, one line each, in the order in which they finished.
//!
//! ```text
//! c4a1f2d0 {"gearlash journal":1, ..}      what the study is: nobody else's lines are taken for its own
//! 9d03b7e1 17,5e-06,0.8213,complete,,      a finished run as in the table
//! ```
//!
//! A line begins with the CRC-32 of the rest, so that one that a kill or a full disk cut short is known. Lines are handed to
//! the operating system one by one, in one call each: a killed process loses none. They are forced to the disk every
//! [`SYNC_INTERVAL`] and at the end: a power failure costs the runs of those seconds, which run again.
//!
//! Runs finish out of order, but never further ahead than [`WINDOW`] of the first one that has not: that bounds the
//! memory of every reader, whatever the number of runs.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::file_error;
use crate::error::Error;

/// Runs that may be finished ahead of the first unfinished one.
pub const WINDOW: u64 = 16384;
/// Time between two times that the lines are forced to the disk.
pub const SYNC_INTERVAL: Duration = Duration::from_secs(5);
/// Bytes of the longest line: texts in it are cropped far below.
const LONGEST: u64 = 1 << 20;
/// Digits of the checksum, and the blank after it.
const FRONT: usize = 9;

/// A journal open for more runs. Nobody else can open it meanwhile.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    synced: Instant,
}

/// Runs that are finished: all below a number, and some above.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Finished {
    below: u64,
    ahead: std::collections::BTreeSet<u64>,
}

impl Finished {
    /// The first run that is not finished.
    pub fn first_open(&self) -> u64 {
        self.below
    }

    /// How many are.
    pub fn count(&self) -> u64 {
        self.below + self.ahead.len() as u64
    }

    /// Whether a run is.
    pub fn contains(&self, run: u64) -> bool {
        run < self.below || self.ahead.contains(&run)
    }

    /// Notes a run. False, and nothing noted, when it is known already or too far ahead.
    pub fn insert(&mut self, run: u64) -> bool {
        if run < self.below || run - self.below >= WINDOW || !self.ahead.insert(run) {
            return false;
        }
        while self.ahead.remove(&self.below) {
            self.below += 1;
        }
        true
    }
}

/// A journal and its content.
#[derive(Debug)]
pub struct Opened {
    /// Open for more.
    pub journal: Journal,
    /// Runs that it holds.
    pub finished: Finished,
    /// Bytes of damaged lines that were cut off at its end; 0 when it is whole, also after the last line was torn.
    pub damaged: u64,
}

impl Journal {
    /// Opens a journal or begins one. `header`: one line that says whose it is. `place` turns the number at the front of a
    /// record into its place in this journal, 0, 1, ..; `None`: it does not belong here.
    ///
    /// What follows the first line that is torn, damaged, repeated or another's is cut off: those runs run again.
    ///
    /// # Errors
    /// `Error::File` when the file cannot be opened, read or written, or when another process has it open.
    pub fn open(
        path: &Path,
        header: &str,
        place: &dyn Fn(u64) -> Option<u64>,
    ) -> Result<Opened, Error> {
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        let file = open_plain(options, path).map_err(|e| file_error("open", path, e))?;
        lock(&file, path)?;
        let mut journal = Journal {
            path: path.to_path_buf(),
            file,
            synced: Instant::now(),
        };
        let (finished, damaged) = journal
            .replay(header, place)
            .map_err(|e| file_error("read", path, e))?;
        Ok(Opened {
            journal,
            finished,
            damaged,
        })
    }

    /// Reads the content, truncates damaged lines, and positions at the end.
    fn replay(
        &mut self,
        header: &str,
        place: &dyn Fn(u64) -> Option<u64>,
    ) -> std::io::Result<(Finished, u64)> {
        let mut finished = Finished::default();
        let mut lines = JournalLines::new(&self.file);
        let (mut good, mut torn) = (0, 0);
        if lines.next()? == JournalLine::Whole && lines.text() == header.as_bytes() {
            good = lines.read;
            loop {
                match lines.next()? {
                    JournalLine::Whole if !note(lines.text(), place, &mut finished) => break,
                    JournalLine::Whole => good = lines.read,
                    JournalLine::Torn => {
                        torn = lines.read - good;
                        break;
                    }
                    JournalLine::Damaged => break,
                }
            }
        }
        let length = self.file.metadata()?.len();
        self.file.set_len(good)?;
        self.file.seek(SeekFrom::Start(good))?;
        if good == 0 {
            self.file.write_all(&line(header.as_bytes()))?;
        }
        // Content before a complete header is not a loss.
        let damaged = if good == 0 { 0 } else { length - good - torn };
        Ok((finished, damaged))
    }

    /// Adds the record of a finished run; on return the operating system has it.
    ///
    /// # Errors
    /// `Error::File` when it cannot be written. What was written before stays readable.
    pub fn append(&mut self, record: &[u8]) -> Result<(), Error> {
        let failed = |e| file_error("write", &self.path, e);
        self.file.write_all(&line(record)).map_err(failed)?;
        if self.synced.elapsed() >= SYNC_INTERVAL {
            self.sync()?;
        }
        Ok(())
    }

    /// Forces everything to the disk.
    ///
    /// # Errors
    /// `Error::File`: a full disk may show only here.
    pub fn sync(&mut self) -> Result<(), Error> {
        self.synced = Instant::now();
        let failed = |e| file_error("write", &self.path, e);
        self.file.sync_data().map_err(failed)
    }

    /// Hands every record to `each`, in the order of their places, holding back at most [`WINDOW`] of them.
    ///
    /// # Errors
    /// `Error::File` when the journal cannot be read, and what `each` says.
    pub fn in_order(
        &mut self,
        place: &dyn Fn(u64) -> Option<u64>,
        each: &mut dyn FnMut(&[u8]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let failed = |e| file_error("read", &self.path, e);
        self.file.rewind().map_err(failed)?;
        let mut lines = JournalLines::new(&self.file);
        let (mut next, mut waiting) = (0, BTreeMap::new());
        // The header.
        lines.next().map_err(failed)?;
        while lines.next().map_err(failed)? == JournalLine::Whole {
            let Some(place) = number(lines.text()).and_then(place) else {
                break;
            };
            if place != next {
                waiting.insert(place, lines.text().to_vec());
                continue;
            }
            each(lines.text())?;
            next += 1;
            while let Some(record) = waiting.remove(&next) {
                each(&record)?;
                next += 1;
            }
        }
        self.file.seek(SeekFrom::End(0)).map_err(failed)?;
        waiting.values().try_for_each(|record| each(record))
    }

    /// Takes the journal away: its runs are in a table.
    ///
    /// # Errors
    /// `Error::File` when the operating system will not.
    pub fn remove(self) -> Result<(), Error> {
        // Some systems keep a file that is open.
        drop(self.file);
        std::fs::remove_file(&self.path).map_err(|e| file_error("remove", &self.path, e))
    }

    /// Name of the file.
    pub fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }
}

/// The header of a journal, whoever has it open; `None` when the file is none.
pub fn header(path: &Path) -> Option<String> {
    let mut options = File::options();
    options.read(true);
    let file = open_plain(options, path).ok()?;
    let mut lines = JournalLines::new(&file);
    let is_whole = lines.next().ok()? == JournalLine::Whole;
    is_whole.then(|| String::from_utf8_lossy(lines.text()).into_owned())
}

/// Opens a file that is not a link, under one name, and neither pipe nor device: anything else is a trap or
/// somebody else's file.
fn open_plain(mut options: std::fs::OpenOptions, path: &Path) -> std::io::Result<File> {
    let refused = || std::io::Error::other("it is a link or no regular file; remove it");
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        use std::os::unix::fs::OpenOptionsExt;
        // A pipe would keep the caller waiting.
        let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits();
        options.custom_flags(flags.cast_signed());
    }
    if std::fs::symlink_metadata(path).is_ok_and(|found| !found.is_file()) {
        return Err(refused());
    }
    let file = options.open(path)?;
    let found = file.metadata()?;
    #[cfg(unix)]
    let has_other_names = std::os::unix::fs::MetadataExt::nlink(&found) > 1;
    #[cfg(not(unix))]
    let has_other_names = false;
    match found.is_file() && !has_other_names {
        true => Ok(file),
        false => Err(refused()),
    }
}

/// Keeps other processes out. File systems without locks are used without.
fn lock(file: &File, path: &Path) -> Result<(), Error> {
    match file.try_lock() {
        Err(std::fs::TryLockError::WouldBlock) => {
            let source = std::io::Error::other("another process is running this study here");
            Err(file_error("open", path, source))
        }
        Err(std::fs::TryLockError::Error(_)) | Ok(()) => Ok(()),
    }
}

/// A line with its checksum and end.
fn line(text: &[u8]) -> Vec<u8> {
    let mut line = Vec::with_capacity(text.len() + FRONT + 1);
    line.extend_from_slice(format!("{:08x} ", crc32fast::hash(text)).as_bytes());
    line.extend_from_slice(text);
    line.push(b'\n');
    line
}

/// The number at the front of a record.
fn number(record: &[u8]) -> Option<u64> {
    let end = record.iter().position(|b| *b == b',')?;
    std::str::from_utf8(&record[..end]).ok()?.parse().ok()
}

fn note(record: &[u8], place: &dyn Fn(u64) -> Option<u64>, finished: &mut Finished) -> bool {
    let place = number(record).and_then(place);
    place.is_some_and(|place| finished.insert(place))
}

/// Kind of the next line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum JournalLine {
    /// Complete, with the right checksum.
    Whole,
    /// The end of the file, or the beginning of a line before it.
    Torn,
    /// Anything else.
    Damaged,
}

/// Lines of a journal one by one, in bounded memory.
struct JournalLines<'a> {
    reader: BufReader<&'a File>,
    line: Vec<u8>,
    /// Bytes read so far.
    read: u64,
}

impl<'a> JournalLines<'a> {
    fn new(file: &'a File) -> JournalLines<'a> {
        JournalLines {
            reader: BufReader::new(file),
            line: Vec::new(),
            read: 0,
        }
    }

    fn next(&mut self) -> std::io::Result<JournalLine> {
        self.line.clear();
        let count = (&mut self.reader)
            .take(LONGEST)
            .read_until(b'\n', &mut self.line)?;
        self.read += count as u64;
        if self.line.last() != Some(&b'\n') {
            let is_at_end = self.reader.fill_buf()?.is_empty();
            return Ok(if is_at_end {
                JournalLine::Torn
            } else {
                JournalLine::Damaged
            });
        }
        let checksum = self.line.get(..FRONT - 1).map(std::str::from_utf8);
        let is_whole = self.line.len() > FRONT
            && checksum.is_some_and(|digits| {
                digits.is_ok_and(|d| u32::from_str_radix(d, 16) == Ok(crc32fast::hash(self.text())))
            });
        Ok(if is_whole {
            JournalLine::Whole
        } else {
            JournalLine::Damaged
        })
    }

    /// Text of the last line, without checksum and end.
    fn text(&self) -> &[u8] {
        &self.line[FRONT..self.line.len() - 1]
    }
}
