//! MATLAB files of versions 5 to 7, which Octave and SciPy also write.
//!
//! Follows MathWorks' published description of the format: a header, then one element for each
//! variable, compressed or not.

mod matrix;

use std::io::{self, BufReader, Read};

use flate2::read::ZlibDecoder;

use crate::assemble::Assembly;
use crate::content::Content;
use crate::error::TooMuch;
use crate::note::Note;
use crate::readers::workspace::Workspace;
use crate::unpack::limit;
use crate::{Error, Log, ReadOptions};
use matrix::{ByteOrder, COMPRESSED, MATRIX};

/// Name of the format in messages.
const FORMAT: &str = "a MATLAB file";

/// Length of the header: text, then version and byte order.
const HEADER: usize = 128;

/// Returns whether bytes start like a MATLAB file, by version and byte order, whatever the text.
pub(crate) fn recognises(head: &[u8]) -> bool {
    let text = |text: &[u8]| text.iter().all(|b| b.is_ascii_graphic() || matches!(b, b' ' | 0));
    head.starts_with(b"MATLAB 5.0")
        || (byte_order(head).is_some() && text(&head[..116]) && head[0] != 0)
}

/// Returns the byte order of a file whose header has version 1, the only version of this format.
fn byte_order(head: &[u8]) -> Option<ByteOrder> {
    match head.get(HEADER - 4..HEADER)? {
        b"\x00\x01IM" => Some(ByteOrder::Little),
        b"\x01\x00MI" => Some(ByteOrder::Big),
        _ => None,
    }
}

/// Reads a MATLAB file.
///
/// # Errors
/// [`Error::Io`], [`Error::Corrupt`] where its start is no header or nothing in it can be read;
/// those of [`Workspace::log`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    let (origin, stream) = content.stream();
    let mut stream = BufReader::new(stream);
    let failed = |error| Error::io(&path, error);
    let corrupt = |byte, found: &str| {
        let (path, found) = (path.clone(), found.to_owned());
        Error::Corrupt { path, format: FORMAT, byte, found }
    };
    let header = take(&mut stream, HEADER).map_err(failed)?;
    let order = byte_order(&header).ok_or_else(|| {
        corrupt(0, "the header does not say in which order bytes are, as version 5 and later do")
    })?;
    let mut workspace = Workspace::default();
    let found = elements(&mut stream, order, &mut workspace).map_err(failed)?;
    if workspace.is_empty()
        && let Some((byte, _)) = found.damaged
    {
        return Err(corrupt(byte, "there is no variable"));
    }
    let mut assembly = Assembly::new(origin, options);
    if let Some(byte) = found.cut {
        assembly.note(Note::Truncated { path: path.clone(), byte, last_s: None });
    }
    if let Some((first_byte, bytes)) = found.damaged {
        let (path, count) = (path.clone(), found.stretches);
        assembly.note(Note::CorruptRecords { path, count, first_byte, bytes });
    }
    workspace.log(assembly, options, &path, "MATLAB")
}

/// Damage of a file.
#[derive(Default)]
struct Damage {
    /// Position of a variable that the end of the file truncates.
    cut: Option<u64>,
    /// Number of unreadable variables.
    stretches: usize,
    /// Position of the first, and the number of bytes of all.
    damaged: Option<(u64, u64)>,
}

impl Damage {
    fn add(&mut self, byte: u64, bytes: u64) {
        self.stretches += 1;
        self.damaged.get_or_insert((byte, 0)).1 += bytes;
    }
}

/// Reads one variable after another.
fn elements(
    stream: &mut impl Read,
    order: ByteOrder,
    workspace: &mut Workspace,
) -> io::Result<Damage> {
    let mut damage = Damage::default();
    let mut at = HEADER as u64;
    loop {
        let tag = take(stream, 8)?;
        let Ok(tag) = <[u8; 8]>::try_from(tag.as_slice()) else {
            damage.cut = (!tag.is_empty()).then_some(at);
            break;
        };
        let (kind, length) = order.tag(tag);
        if kind != MATRIX && kind != COMPRESSED {
            // The position of the next variable is unknown.
            let rest = io::copy(stream, &mut io::sink())?;
            damage.add(at, 8 + rest);
            break;
        }
        let body = take(stream, length as usize)?;
        if body.len() < length as usize {
            damage.cut = Some(at);
            break;
        }
        let read = if kind == COMPRESSED {
            inflate(&body)?
                .is_some_and(|body| matrix::compressed(&body, order, workspace).is_some())
        } else {
            matrix::variable(&body, order, workspace).is_some()
        };
        let size = 8 + u64::from(length);
        if !read {
            damage.add(at, size);
        }
        at += size;
    }
    Ok(damage)
}

/// Unpacks a compressed element; `None` if it is damaged.
fn inflate(packed: &[u8]) -> io::Result<Option<Vec<u8>>> {
    let most = limit(packed.len() as u64);
    let mut unpacked = Vec::new();
    let read = ZlibDecoder::new(packed).take(most + 1).read_to_end(&mut unpacked);
    if unpacked.len() as u64 > most {
        let packed = packed.len() as u64;
        return Err(io::Error::other(TooMuch { unpacked: most, packed }));
    }
    Ok(read.is_ok().then_some(unpacked))
}

/// Reads the next `count` bytes, or the remaining ones.
fn take(stream: &mut impl Read, count: usize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    stream.take(count as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}
