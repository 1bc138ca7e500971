//! NMEA 0183 sentences and their relatives, as serial ports and networks deliver them.
//!
//! No available crate decodes the sentences of vehicles (PRDID, PASHR, PIXSE, THS), so this module
//! has its own tables of fields.

mod line;
mod prefix;
mod records;
mod tables;
mod utc;

use std::collections::HashSet;
use std::io::{self, BufRead, BufReader, Read};

use crate::assemble::Assembly;
use crate::content::Content;
use crate::note::Note;
use crate::{Epoch, Error, Log, ReadOptions};
use line::{Check, Sentence};
use prefix::Prefix;
use records::Records;

/// Number of lines by which a text is recognised.
const LINES: usize = 50;

/// Returns whether most lines of a text hold sentences, whatever precedes them.
pub(crate) fn recognises(head: &[u8]) -> bool {
    let (mut all, mut sentences) = (0, 0);
    for line in lines(head).filter(|line| !line.trim_ascii().is_empty()).take(LINES) {
        all += 1;
        sentences += usize::from(line::sentences(line).any(|s| s.check != Check::Wrong));
    }
    2 * sentences > all
}

/// Splits a text into lines, whatever their endings.
fn lines(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(|&byte| byte == b'\n' || byte == b'\r')
}

/// Reads sentences.
///
/// The time of a sentence is the time before it in its line. Where there is none, RMC, ZDA, GGA,
/// GLL and PASHR contain UTC, and other sentences are spread evenly, in their order, between these.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] of sentences without any time; [`Error::NoSamples`] of
/// those of unknown kinds only.
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    let prefix = Prefix::detect(lines(content.head()).take(LINES));
    let checked = checked(content.head());
    let (origin, stream) = content.stream();
    let mut records = Records::new(prefix);
    let damage = walk(BufReader::new(stream), &checked, &mut records);
    let damage = damage.map_err(|error| origin.failed(error))?;
    let mut assembly = Assembly::new(origin, options);
    if let Some((first_byte, bytes)) = damage.wrong {
        let (path, count) = (path.clone(), damage.count);
        assembly.note(Note::CorruptRecords { path, count, first_byte, bytes });
    }
    let Some(times) = records.times() else {
        let detail = "without a time in any sentence or before it".to_owned();
        let advice = "log again with the time of receipt before each sentence, or with RMC or ZDA \
                      sentences among them";
        return Err(Error::Unsupported { path, format: "NMEA 0183 text", detail, advice });
    };
    if let Some(byte) = damage.cut {
        let last_s = times.last_s().map(|last_s| last_s + options.offset_s);
        assembly.note(Note::Truncated { path: path.clone(), byte, last_s });
    }
    if damage.text {
        assembly.leave_out("lines without a sentence".to_owned(), "are other text");
    }
    assembly.note(Note::Clock { path, clock: times.clock() });
    if times.are_of_day() {
        assembly.epoch(Epoch::Midnight);
    }
    records.hand_over(&times, &mut assembly);
    assembly.log("NMEA 0183")
}

/// Returns the kinds of sentences that have a checksum: without one they are damaged.
fn checked(head: &[u8]) -> HashSet<String> {
    let sentences = lines(head).flat_map(line::sentences);
    let right = sentences.filter(|sentence| sentence.check == Check::Right);
    right.map(|sentence| sentence.address().to_owned()).collect()
}

/// Damage and other content between sentences.
#[derive(Default)]
struct Damage {
    /// Number of sentences whose checksum is wrong or missing.
    count: usize,
    /// Position of the first, and the number of bytes of all.
    wrong: Option<(u64, u64)>,
    /// Position of a sentence that the end of the file truncates.
    cut: Option<u64>,
    /// True if there are lines of other text.
    text: bool,
}

impl Damage {
    fn add(&mut self, byte: u64, bytes: u64) {
        self.count += 1;
        self.wrong.get_or_insert((byte, 0)).1 += bytes;
    }
}

/// Passes every valid sentence to `take` in turn.
fn walk(
    mut stream: impl BufRead,
    checked: &HashSet<String>,
    records: &mut Records,
) -> io::Result<Damage> {
    /// Maximum length of a line of sentences.
    const LONGEST: u64 = 64 * 1024;
    let mut damage = Damage::default();
    let (mut bytes, mut start) = (Vec::new(), 0_u64);
    loop {
        let read = stream.by_ref().take(LONGEST).read_until(b'\n', &mut bytes)?;
        if bytes.is_empty() {
            return Ok(damage);
        }
        if let Some(cut) = damage.cut.take() {
            // That was only the end of a stretch.
            damage.add(cut, start - cut);
        }
        // Some lines end with a carriage return: the last of these may continue.
        let whole = match bytes.iter().rposition(|byte| *byte == b'\r') {
            Some(last) if read > 0 && !bytes.ends_with(b"\n") => last + 1,
            _ => bytes.len(),
        };
        take(&bytes[..whole], start, checked, records, &mut damage);
        start += whole as u64;
        bytes.drain(..whole);
    }
}

/// Reads the sentences of some lines; `start` is their position in the file.
fn take(
    bytes: &[u8],
    start: u64,
    checked: &HashSet<String>,
    records: &mut Records,
    damage: &mut Damage,
) {
    let mut at = start;
    for line in lines(bytes) {
        let mut found = line.trim_ascii().is_empty();
        for sentence in line::sentences(line) {
            found = true;
            let byte = at + sentence.start as u64;
            if is_sound(&sentence, checked) {
                records.take(&line[..sentence.prefix], &sentence);
            } else if byte + sentence.bytes.len() as u64 == start + bytes.len() as u64 {
                damage.cut = Some(byte);
            } else {
                damage.add(byte, sentence.bytes.len() as u64);
            }
        }
        damage.text |= !found;
        at += line.len() as u64 + 1;
    }
}

fn is_sound(sentence: &Sentence<'_>, checked: &HashSet<String>) -> bool {
    match sentence.check {
        Check::Right => true,
        Check::Wrong => false,
        Check::None => !checked.contains(sentence.address()),
    }
}
