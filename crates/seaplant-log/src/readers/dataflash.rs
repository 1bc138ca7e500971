//! ArduPilot DataFlash logs.
//!
//! A record is two marks, the number of its type, and fields without names. FMT records name types
//! and fields, FMTU, UNIT and MULT give fields a unit and a multiplier.
//!
//! # Source
//! [DataFlash]

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::assemble::Assembly;
use crate::content::Content;
use crate::framing::Framing;
use crate::note::Note;
use crate::readers::window::Window;
use crate::{Error, Log, ReadOptions};

mod definition;
mod logbook;
mod table;

use definition::{FMT, FMT_LENGTH, HEADER};
use logbook::Logbook;

/// Marks at the start of every record.
const MARKS: [u8; 2] = [0xa3, 0x95];
/// Upper limit on the length of a record and the marks of the next.
const LONGEST: usize = 255 + HEADER;

/// Returns whether bytes start like a DataFlash log.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(&[MARKS[0], MARKS[1], FMT])
}

/// Reads a DataFlash log: a channel `MESSAGE.Field` for each number of each type of message, and
/// `MESSAGE[0].Field` for messages with an instance number.
///
/// # Errors
/// [`Error::NoSamples`], [`Error::Io`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    let (origin, stream) = content.stream();
    let mut window = Window::new(stream);
    let mut logbook = Logbook::default();
    let cut = scan(&mut window, &mut logbook).map_err(|error| origin.failed(error))?;
    let notes = notes(&path, &window, &logbook, cut);
    let mut assembly = Assembly::new(origin, options);
    notes.into_iter().for_each(|note| assembly.note(note));
    logbook.into_log(assembly)
}

/// Separates records by their lengths, which the definitions in `head` state.
pub(crate) fn framing(head: &[u8]) -> Option<Framing> {
    let mut logbook = Logbook::default();
    scan(&mut Window::new(head), &mut logbook).ok()?;
    let length = move |bytes: &[u8]| match next(&bytes[..bytes.len().min(LONGEST)], &logbook) {
        Next::Record(length) => Some(length),
        _ => None,
    };
    Some(Framing::Records(Box::new(length)))
}

fn notes<R: Read>(
    path: &Path,
    window: &Window<R>,
    logbook: &Logbook,
    cut: Option<u64>,
) -> Vec<Note> {
    let path: PathBuf = path.to_owned();
    let mut notes = vec![Note::Clock { path: path.clone(), clock: logbook.clock() }];
    notes.extend(window.note(&path));
    if !logbook.restarts_s.is_empty() {
        let at_s = logbook.restarts_s.clone();
        notes.push(Note::Restarted { path: path.clone(), at_s });
    }
    notes.extend(cut.map(|byte| Note::Truncated { path, byte, last_s: logbook.latest_s }));
    notes
}

/// Reads every record into the logbook, and returns the position of a truncated last one.
fn scan<R: Read>(window: &mut Window<R>, logbook: &mut Logbook) -> io::Result<Option<u64>> {
    let mut in_step = true;
    loop {
        let ahead = window.ahead(LONGEST)?;
        match next(ahead, logbook) {
            Next::Record(length) => {
                logbook.enter(ahead[2], &ahead[HEADER..length]);
                window.take(length);
                in_step = true;
            }
            Next::Damage(length) => {
                window.skip(length);
                in_step = false;
            }
            Next::Padding if is_padding(window)? => return Ok(None),
            Next::Padding => skip_padding(window)?,
            Next::Cut if in_step => return Ok(Some(window.byte())),
            // Bytes within damage may look like the start of a record by chance.
            Next::Cut => window.skip(1),
            Next::End => return Ok(None),
        }
    }
}

/// Content that follows.
enum Next {
    /// A record of this length.
    Record(usize),
    /// Unreadable bytes, this many.
    Damage(usize),
    /// Bytes of erased memory, possibly to the end.
    Padding,
    /// A record that the end of the file truncates.
    Cut,
    End,
}

fn next(ahead: &[u8], logbook: &Logbook) -> Next {
    let damage = || Next::Damage(1 + to_marks(&ahead[1..]));
    match *ahead {
        [] => Next::End,
        [mark, second, number, ..] if [mark, second] == MARKS => {
            let Some(length) = logbook.length(number) else { return damage() };
            match ahead.get(length..) {
                Some(after) if may_follow(after) => Next::Record(length),
                Some(_) => damage(),
                None => Next::Cut,
            }
        }
        _ if MARKS.starts_with(ahead) => Next::Cut,
        [0 | 0xff, ..] => Next::Padding,
        _ => damage(),
    }
}

/// Returns the distance to the next marks, or to a byte that may be the first of them.
fn to_marks(bytes: &[u8]) -> usize {
    let starts = |at: &usize| MARKS.starts_with(&bytes[*at..bytes.len().min(at + MARKS.len())]);
    (0..bytes.len()).find(starts).unwrap_or(bytes.len())
}

/// Returns whether these bytes may follow a record: in the absence of a checksum, nothing else
/// reveals a record that lost bytes and so holds the start of the next.
fn may_follow(after: &[u8]) -> bool {
    let near = &after[..after.len().min(MARKS.len())];
    MARKS.starts_with(near) || near == [0, 0] || near == [0xff, 0xff]
}

/// Returns whether only erased memory follows.
fn is_padding<R: Read>(window: &mut Window<R>) -> io::Result<bool> {
    /// Pages are padded, and so are blocks of pages.
    const LONGEST: usize = 1 << 17;
    let ahead = window.ahead(LONGEST)?;
    let fill = ahead[0];
    Ok(ahead.len() < LONGEST && ahead.iter().all(|byte| *byte == fill))
}

fn skip_padding<R: Read>(window: &mut Window<R>) -> io::Result<()> {
    let ahead = window.ahead(LONGEST)?;
    let fill = ahead[0];
    let length = ahead.iter().take_while(|byte| **byte == fill).count();
    window.skip(length);
    Ok(())
}

const _: () = assert!(FMT_LENGTH < LONGEST);
