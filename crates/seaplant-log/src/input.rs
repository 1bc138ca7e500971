//! A file as a stream of text bytes: hashed as it passes, byte-order mark gone, binary refused.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::Error;
use crate::log::Source;

/// How much of a file is looked at to tell what it is.
const HEAD: usize = 256 * 1024;

/// A text file, its first [`HEAD`] bytes at hand, the rest to be read.
pub(crate) struct Input {
    path: PathBuf,
    head: Vec<u8>,
    at: usize,
    /// Whether `head` is the whole text.
    whole: bool,
    file: File,
    hash: Sha256,
    bytes: u64,
    newline: Newline,
    closing: &'static [u8],
    encoding: Option<&'static str>,
    squeeze: Option<Squeeze>,
    scratch: Vec<u8>,
}

/// What ends a line, which tells how far the CSV reader's count of lines is ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Newline {
    Lf,
    CrLf,
    Cr,
}

impl Input {
    /// Opens a text file.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Directory`], [`Error::Binary`], [`Error::Empty`].
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::io(path, source);
        if std::fs::metadata(path).map_err(failed)?.is_dir() {
            return Err(Error::Directory { path: path.to_owned() });
        }
        let mut file = File::open(path).map_err(failed)?;
        let mut head = Vec::new();
        (&mut file).take(HEAD as u64).read_to_end(&mut head).map_err(failed)?;
        let mut whole = head.len() < HEAD;
        let marked = encoding_rs::Encoding::for_bom(&head);
        let wide = marked.map(|(encoding, _)| encoding).filter(|e| *e != encoding_rs::UTF_8);
        if wide.is_some() {
            file.read_to_end(&mut head).map_err(failed)?;
            whole = true;
        }
        let (hash, bytes) = (Sha256::new_with_prefix(&head), head.len() as u64);
        head.drain(..marked.map_or(0, |(_, mark)| mark));
        if let Some(wide) = wide {
            head = wide.decode_without_bom_handling(&head).0.into_owned().into_bytes();
        }
        check(&head, whole, path)?;
        let newline = newline(&head);
        Ok(Self {
            path: path.to_owned(),
            head,
            at: 0,
            whole,
            file,
            hash,
            bytes,
            newline,
            // The end of the last record must count as a line like any other.
            closing: if newline == Newline::CrLf { b"\r\n" } else { b"\n" },
            encoding: wide.map(encoding_rs::Encoding::name),
            squeeze: None,
            scratch: Vec::new(),
        })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn newline(&self) -> Newline {
        self.newline
    }

    /// The encoding, if a byte-order mark named another than UTF-8.
    pub(crate) fn encoding(&self) -> Option<&'static str> {
        self.encoding
    }

    /// The first lines, complete ones only unless there is but one.
    pub(crate) fn head(&self) -> &[u8] {
        if self.whole {
            return &self.head;
        }
        match self.head.iter().rposition(|&b| b == b'\n' || b == b'\r') {
            Some(end) => &self.head[..=end],
            None => &self.head,
        }
    }

    /// Whether the head is the whole text.
    pub(crate) fn is_whole(&self) -> bool {
        self.whole
    }

    /// From here on, runs of blanks arrive as one tab.
    pub(crate) fn squeeze_blanks(&mut self) {
        self.squeeze = Some(Squeeze::default());
    }

    /// What was read, to be called at its end.
    pub(crate) fn source(&self, format: String) -> Source {
        let digest = self.hash.clone().finalize();
        let sha256 = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        Source { path: self.path.clone(), bytes: self.bytes, sha256, format }
    }

    fn fill(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.at < self.head.len() {
            let n = buffer.len().min(self.head.len() - self.at);
            buffer[..n].copy_from_slice(&self.head[self.at..self.at + n]);
            self.at += n;
            return Ok(n);
        }
        let n = if self.whole { 0 } else { self.file.read(buffer)? };
        if n == 0 {
            let n = buffer.len().min(self.closing.len());
            buffer[..n].copy_from_slice(&self.closing[..n]);
            self.closing = &self.closing[n..];
            return Ok(n);
        }
        self.hash.update(&buffer[..n]);
        self.bytes += n as u64;
        Ok(n)
    }
}

impl Read for Input {
    /// Needs a buffer of two bytes at least; the CSV reader's is larger by far.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Some(mut squeeze) = self.squeeze.take() else { return self.fill(buffer) };
        let mut scratch = std::mem::take(&mut self.scratch);
        // A blank held back from the last buffer may come before the first byte of this one.
        scratch.resize(buffer.len().saturating_sub(1), 0);
        let written = loop {
            let n = self.fill(&mut scratch)?;
            let written = squeeze.pass(&scratch[..n], buffer);
            if n == 0 || written > 0 {
                break written;
            }
        };
        self.squeeze = Some(squeeze);
        self.scratch = scratch;
        Ok(written)
    }
}

/// Turns runs of blanks into one tab, except in quotes, in brackets and before a bracket, so that
/// `u [m/s]` stays one cell.
#[derive(Debug, Default)]
pub(crate) struct Squeeze {
    started: bool,
    blank: bool,
    brackets: u32,
    quoted: bool,
}

impl Squeeze {
    /// Writes `from`, squeezed, to the start of `to`, which is longer by one at least.
    pub(crate) fn pass(&mut self, from: &[u8], to: &mut [u8]) -> usize {
        let mut written = 0;
        let mut put = |byte| {
            to[written] = byte;
            written += 1;
        };
        for &byte in from {
            match byte {
                b'\n' | b'\r' => *self = Self::default(),
                b' ' | b'\t' if !self.quoted && self.brackets == 0 => {
                    self.blank = self.started;
                    continue;
                }
                b'"' => self.quoted = !self.quoted,
                _ => {}
            }
            if std::mem::take(&mut self.blank) {
                put(if matches!(byte, b'(' | b'[') { b' ' } else { b'\t' });
            }
            match byte {
                b'(' | b'[' => self.brackets += 1,
                b')' | b']' => self.brackets = self.brackets.saturating_sub(1),
                _ => {}
            }
            self.started = !matches!(byte, b'\n' | b'\r');
            put(byte);
        }
        written
    }
}

/// Refuses what is no text.
fn check(head: &[u8], whole: bool, path: &Path) -> Result<(), Error> {
    let path = path.to_owned();
    if let Some(name) = binary(head) {
        return Err(Error::Binary { path, looks_like: name.to_owned() });
    }
    if whole && head.iter().all(u8::is_ascii_whitespace) {
        return Err(Error::Empty { path });
    }
    Ok(())
}

fn newline(head: &[u8]) -> Newline {
    // The last, since a preamble may be written by another hand than the rows.
    match head.iter().rposition(|&b| b == b'\n') {
        Some(0) => Newline::Lf,
        Some(end) if head[end - 1] == b'\r' => Newline::CrLf,
        Some(_) => Newline::Lf,
        None if head.contains(&b'\r') => Newline::Cr,
        None => Newline::Lf,
    }
}

/// First bytes of the formats that people take for logs, and what to call them.
const MAGIC: &[(&[u8], &str)] = &[
    (b"\x1f\x8b", "a gzip archive (unpack it first)"),
    (b"PK\x03\x04", "a zip archive or an Excel workbook (.xlsx)"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook (.xls)"),
    (b"\x89HDF", "an HDF5 file or a MATLAB 7.3 file"),
    (b"MATLAB 5.0", "a MATLAB file"),
    (b"CDF\x01", "a NetCDF file"),
    (b"CDF\x02", "a NetCDF file"),
    (b"#ROSBAG", "a ROS 1 bag"),
    (b"\x89MCAP", "an MCAP file"),
    (b"SQLite format 3", "an SQLite database, perhaps a ROS 2 bag"),
    (b"PAR1", "a Parquet file"),
    (b"ARROW1", "an Arrow file"),
    (b"\xa3\x95\x80", "an ArduPilot DataFlash log (.BIN)"),
    (b"ULog\x01\x12\x35", "a PX4 ULog"),
    (b"\x7f\x7f", "a Teledyne RDI PD0 file"),
    (b"BZh", "a bzip2 archive (unpack it first)"),
    (b"\x28\xb5\x2f\xfd", "a zstd archive (unpack it first)"),
    (b"\xfd7zXZ", "an xz archive (unpack it first)"),
    (b"%PDF", "a PDF document"),
];

/// What the bytes look like, unless they are text.
fn binary(head: &[u8]) -> Option<&'static str> {
    /// How far control characters are counted.
    const LOOK: usize = 8 * 1024;
    if let Some((_, name)) = MAGIC.iter().find(|(magic, _)| head.starts_with(magic)) {
        return Some(name);
    }
    let start = &head[..head.len().min(LOOK)];
    let is_control = |b: u8| b < 0x20 && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c) || b == 0x7f;
    let control = start.iter().filter(|&&b| is_control(b)).count();
    if is_mavlink(start) {
        return Some("a MAVLink telemetry log (.tlog)");
    }
    (start.contains(&0) || 50 * control > start.len()).then_some("binary data")
}

/// Eight bytes of time, then a MAVLink start mark.
fn is_mavlink(head: &[u8]) -> bool {
    head.len() > 8 && head[0] == 0 && matches!(head[8], 0xfe | 0xfd)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squeeze(pieces: &[&str]) -> String {
        let mut squeeze = Squeeze::default();
        let mut squeezed = Vec::new();
        for piece in pieces {
            let mut buffer = vec![0; piece.len() + 1];
            let written = squeeze.pass(piece.as_bytes(), &mut buffer);
            squeezed.extend_from_slice(&buffer[..written]);
        }
        String::from_utf8(squeezed).unwrap()
    }

    #[test]
    fn runs_of_blanks_become_one_tab() {
        assert_eq!(squeeze(&["  a \t b\r\n c   d  \n"]), "a\tb\r\nc\td\n");
    }

    #[test]
    fn brackets_and_quotes_keep_their_blanks() {
        assert_eq!(
            squeeze(&["u [m s-1]  \"a  b\" F (Kg f)\n( a\nb c"]),
            "u [m s-1]\t\"a  b\"\tF (Kg f)\n( a\nb\tc"
        );
    }

    #[test]
    fn where_the_buffer_ends_does_not_matter() {
        let text = " time [s]  u \n 0   1.5\n";
        let expected = squeeze(&[text]);
        for cut in 0..text.len() {
            assert_eq!(squeeze(&[&text[..cut], &text[cut..]]), expected, "{cut}");
        }
    }

    #[test]
    fn newlines_are_told_by_the_last() {
        assert_eq!(newline(b"a\r\nb\r\n"), Newline::CrLf);
        assert_eq!(newline(b"# a\nb\r\nc\r\n"), Newline::CrLf);
        assert_eq!(newline(b"a\rb"), Newline::Cr);
        assert_eq!((newline(b"\n"), newline(b"a")), (Newline::Lf, Newline::Lf));
    }
}
