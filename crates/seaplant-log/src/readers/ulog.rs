//! PX4 ULog files.
//!
//! A header, then messages: two bytes of size, a letter, and a body. `F` defines a topic's fields,
//! `A` assigns a number to a topic and an instance, `D` holds a record of such a number. Others
//! hold settings, text and dropouts.
//!
//! # Source
//! [ULog]

use std::io::{self, Read};
use std::path::Path;

use crate::assemble::Assembly;
use crate::content::Content;
use crate::limits::too_many_columns;
use crate::note::Note;
use crate::readers::window::Window;
use crate::{Epoch, Error, Log, ReadOptions};

mod logbook;
mod topic;

use logbook::Logbook;

const MAGIC: &[u8] = b"ULog\x01\x12\x35";
/// Length of the magic bytes, a version and the time of the start.
const FILE_HEADER: usize = 16;
/// Length of size and letter.
const HEADER: usize = 3;
/// Maximum length of a message and the header of the next.
const LONGEST: usize = HEADER + 0xffff + HEADER;
/// Valid letters.
const LETTERS: &[u8] = b"BFIMPQARDLCSO";

/// Returns whether bytes start like a ULog file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
}

/// Reads a ULog file: a channel `topic.field` for each number of each topic, `topic[1].field` for
/// topics with several instances, and roll, pitch and yaw for each quaternion `q`.
///
/// # Errors
/// [`Error::NoSamples`], [`Error::TooManyColumns`], [`Error::Io`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    let (origin, stream) = content.stream();
    let mut window = Window::new(stream);
    let mut logbook = Logbook::default();
    let cut = scan(&mut window, &mut logbook).map_err(|error| origin.failed(error))?;
    if logbook.has_too_many_fields() {
        return Err(too_many_columns(&path));
    }
    let mut assembly = Assembly::new(origin, options);
    notes(&path, &window, &logbook, cut).into_iter().for_each(|note| assembly.note(note));
    assembly.epoch(Epoch::Start { since_1970_s: logbook.start_s() });
    logbook.into_groups(&mut assembly);
    assembly.log("PX4 ULog")
}

fn notes<R: Read>(
    path: &Path,
    window: &Window<R>,
    logbook: &Logbook,
    cut: Option<u64>,
) -> Vec<Note> {
    let clock = match logbook.start_s().and_then(|s| jiff::Timestamp::from_second(s as i64).ok()) {
        Some(start) => {
            format!("seconds since the autopilot started, which was {start} by satellite")
        }
        None => "seconds since the autopilot started".to_owned(),
    };
    let mut notes = vec![Note::Clock { path: path.to_owned(), clock }];
    notes.extend(window.note(path));
    let last_s = logbook.latest_s;
    notes.extend(cut.map(|byte| Note::Truncated { path: path.to_owned(), byte, last_s }));
    notes
}

/// Reads every message, and returns the position of a truncated last one.
fn scan<R: Read>(window: &mut Window<R>, logbook: &mut Logbook) -> io::Result<Option<u64>> {
    let head = window.ahead(FILE_HEADER)?.len().min(FILE_HEADER);
    window.take(head);
    let mut in_step = true;
    loop {
        let at = window.byte();
        let ahead = window.ahead(LONGEST)?;
        // A logger that appends leaves the last message incomplete.
        let part = logbook.next_part(at).map_or(usize::MAX, |part| (part - at) as usize);
        let found = next(&ahead[..ahead.len().min(LONGEST)], logbook);
        match found {
            Next::Message(length) if length > part => window.take(part),
            Next::Message(length) => {
                logbook.enter(ahead[2], &ahead[HEADER..length]);
                window.take(length);
                in_step = true;
            }
            Next::Damage if part <= ahead.len() && part < LONGEST && in_step => window.take(part),
            Next::Damage => {
                let count = to_message(&ahead[..ahead.len().min(LONGEST)], logbook).min(part);
                window.skip(count);
                in_step = false;
            }
            Next::Cut if in_step => return Ok(Some(window.byte())),
            // Bytes within damage may look like the start of a message by chance.
            Next::Cut => window.skip(1),
            Next::End => return Ok(None),
        }
    }
}

/// Content that follows.
#[derive(Clone, Copy, PartialEq)]
enum Next {
    /// A message of this length, with its header.
    Message(usize),
    /// Unreadable bytes.
    Damage,
    /// A message that the end of the file truncates.
    Cut,
    End,
}

fn next(ahead: &[u8], logbook: &Logbook) -> Next {
    if ahead.is_empty() {
        return Next::End;
    }
    let Some(length) = length(ahead) else {
        return if ahead.len() < HEADER { Next::Cut } else { Next::Damage };
    };
    match ahead.get(HEADER..length) {
        None => Next::Cut,
        Some(body) if logbook.may_be(ahead[2], body) && may_follow(&ahead[length..]) => {
            Next::Message(length)
        }
        Some(_) => Next::Damage,
    }
}

/// Returns the length of a message by its header, if that is valid.
fn length(ahead: &[u8]) -> Option<usize> {
    let [low, high, letter, ..] = *ahead else { return None };
    LETTERS.contains(&letter).then(|| HEADER + usize::from(u16::from_le_bytes([low, high])))
}

/// Returns whether these bytes may follow a message.
fn may_follow(after: &[u8]) -> bool {
    after.len() < HEADER || length(after).is_some()
}

/// Returns the distance to the next message, or to the end of the search range.
fn to_message(ahead: &[u8], logbook: &Logbook) -> usize {
    /// Search range; beyond it, a new search starts.
    const LOOK: usize = 4096;
    let starts = |at: &usize| match next(&ahead[*at..], logbook) {
        Next::Message(_) => true,
        Next::Cut => ahead.len() - at < HEADER,
        _ => false,
    };
    let look = ahead.len().min(LOOK);
    (1..look).find(starts).unwrap_or(look.max(1))
}
