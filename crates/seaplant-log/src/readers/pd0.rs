//! Teledyne RDI PD0 files: the ensembles of a Doppler velocity log or current profiler.

mod ensemble;
mod records;
mod window;

use std::io::Read;

use crate::assemble::Assembly;
use crate::content::{Content, Origin, is_binary};
use crate::framing::Framing;
use crate::note::Note;
use crate::{Error, Log, ReadOptions};
use ensemble::{Ensemble, MOST_BYTES};
use records::Records;
use window::Window;

/// Returns whether bytes are ensembles: at their start, or after a partial ensemble or some lines
/// of text, which a recorder that starts in mid-stream leaves.
pub(crate) fn recognises(head: &[u8]) -> bool {
    if head.starts_with(&ensemble::MARK) {
        return true;
    }
    let Some((before, ensemble)) =
        ensemble::marks(head).find_map(|at| Some((&head[..at], Ensemble::at_start(&head[at..])?)))
    else {
        return false;
    };
    before.len() <= ensemble.size() || !is_binary(before)
}

/// Separates ensembles by the length that each starts with.
pub(crate) fn framing(_head: &[u8]) -> Option<Framing> {
    let length = |bytes: &[u8]| Ensemble::at_start(bytes).map(|ensemble| ensemble.size());
    Some(Framing::Records(Box::new(length)))
}

/// Reads a PD0 file.
///
/// # Errors
/// [`Error::Io`]; [`Error::NoSamples`] of a file without a whole ensemble.
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let (origin, stream) = content.stream();
    let mut records = Records::default();
    let gaps = walk(stream, &origin, |ensemble| records.take(ensemble))?;
    let path = origin.path().to_owned();
    let mut assembly = Assembly::new(origin, options);
    if gaps.count > 0 {
        let Gaps { count, first_byte, bytes, .. } = gaps;
        assembly.note(Note::CorruptRecords { path: path.clone(), count, first_byte, bytes });
    }
    if let Some(byte) = gaps.cut {
        let last_s = records.last_s().map(|last_s| last_s + options.offset_s);
        assembly.note(Note::Truncated { path: path.clone(), byte, last_s });
    }
    if gaps.text {
        let text = "text between ensembles".to_owned();
        assembly.leave_out(text, "is of another instrument");
    }
    records.hand_over(&path, &mut assembly);
    assembly.log("Teledyne RDI PD0")
}

/// Damage and other content between complete ensembles.
#[derive(Default)]
struct Gaps {
    /// Number of damaged stretches.
    count: usize,
    first_byte: u64,
    bytes: u64,
    /// True if there are lines of text, such as those of a receiver on the same port.
    text: bool,
    /// Position of an ensemble that the end of the file truncates.
    cut: Option<u64>,
}

impl Gaps {
    /// Counts the stretch of the file between two ensembles.
    fn add(&mut self, gap: &Gap) {
        if gap.bytes == 0 {
            return;
        }
        if !gap.binary {
            self.text = true;
            return;
        }
        if self.count == 0 {
            self.first_byte = gap.start;
        }
        self.count += 1;
        self.bytes += gap.bytes;
    }
}

/// A stretch of the file without a complete ensemble.
#[derive(Default)]
struct Gap {
    start: u64,
    bytes: u64,
    binary: bool,
    /// Position of an ensemble that is longer than the rest of the file.
    cut: Option<u64>,
}

impl Gap {
    /// Skips `bytes`, which start at `at` in the file, up to the next possible start of an
    /// ensemble.
    fn pass(&mut self, bytes: &[u8], at: u64) -> usize {
        if self.cut.is_none() && ensemble::is_cut(bytes) {
            self.cut = Some(at);
        }
        let next = ensemble::marks(&bytes[1..]).next().map_or(bytes.len(), |next| next + 1);
        self.binary |= is_binary(&bytes[..next]);
        self.bytes += next as u64;
        next
    }
}

/// Passes every complete ensemble to the caller in turn.
fn walk(
    stream: impl Read,
    origin: &Origin,
    mut take: impl FnMut(&Ensemble<'_>),
) -> Result<Gaps, Error> {
    let mut window = Window::new(stream);
    let (mut gaps, mut gap) = (Gaps::default(), Gap::default());
    loop {
        window.fill(MOST_BYTES).map_err(|error| origin.failed(error))?;
        let (bytes, at) = (window.bytes(), window.position());
        if bytes.is_empty() {
            break;
        }
        let passed = if let Some(ensemble) = Ensemble::at_start(bytes) {
            gaps.add(&gap);
            gap = Gap { start: at + ensemble.size() as u64, ..Gap::default() };
            take(&ensemble);
            ensemble.size()
        } else {
            gap.pass(bytes, at)
        };
        window.pass(passed);
    }
    gaps.cut = gap.cut;
    gap.bytes = gap.cut.map_or(gap.bytes, |cut| cut - gap.start);
    gaps.add(&gap);
    Ok(gaps)
}
