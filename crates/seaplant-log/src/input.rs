//! A text as a stream of bytes: in UTF-8 or close to it, without byte-order mark, runs of blanks
//! collapsed.

use std::io::{self, Read};
use std::path::Path;

use crate::Error;
use crate::content::{Content, Origin, is_binary};

/// A text whose first bytes are in memory.
pub(crate) struct Input {
    origin: Origin,
    head: Vec<u8>,
    at: usize,
    /// True if `head` is the complete text.
    whole: bool,
    rest: Box<dyn Read + Send>,
    newline: Newline,
    closing: &'static [u8],
    encoding: Option<&'static str>,
    squeeze: Option<Squeeze>,
    scratch: Vec<u8>,
    /// Number of bytes handed out.
    given: u64,
    /// True if the last of them ends a line or a quoted cell.
    at_end: bool,
    /// Position at which the text ends within a cell.
    cut: Option<u64>,
}

/// Line ending, which determines how far the CSV reader's count of lines is ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Newline {
    Lf,
    CrLf,
    Cr,
}

impl Input {
    /// Opens a text.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Binary`], [`Error::Empty`].
    pub(crate) fn new(content: Content) -> Result<Self, Error> {
        let (origin, mut head, mut whole, mut rest) = content.into_parts();
        lengthen(&mut head, &mut whole, &mut rest).map_err(|e| origin.failed(e))?;
        let marked = encoding_rs::Encoding::for_bom(&head);
        let wide = marked.map(|(encoding, _)| encoding).filter(|e| *e != encoding_rs::UTF_8);
        if wide.is_some() {
            rest.read_to_end(&mut head).map_err(|e| origin.failed(e))?;
            whole = true;
        }
        head.drain(..marked.map_or(0, |(_, mark)| mark));
        if let Some(wide) = wide {
            head = wide.decode_without_bom_handling(&head).0.into_owned().into_bytes();
        }
        check(&head, whole, origin.path())?;
        let newline = newline(&head);
        Ok(Self {
            origin,
            head,
            at: 0,
            whole,
            rest,
            newline,
            // The end of the last record must count as a line like any other.
            closing: if newline == Newline::CrLf { b"\r\n" } else { b"\n" },
            encoding: wide.map(encoding_rs::Encoding::name),
            squeeze: None,
            scratch: Vec::new(),
            given: 0,
            at_end: false,
            cut: None,
        })
    }

    pub(crate) fn path(&self) -> &Path {
        self.origin.path()
    }

    pub(crate) fn newline(&self) -> Newline {
        self.newline
    }

    /// Returns the encoding, if a byte-order mark states another than UTF-8.
    pub(crate) fn encoding(&self) -> Option<&'static str> {
        self.encoding
    }

    /// Returns the first lines, only complete ones unless there is just one.
    pub(crate) fn head(&self) -> &[u8] {
        if self.whole {
            return &self.head;
        }
        match self.head.iter().rposition(|&b| b == b'\n' || b == b'\r') {
            Some(end) => &self.head[..=end],
            None => &self.head,
        }
    }

    /// Returns whether the head is the complete text.
    pub(crate) fn is_whole(&self) -> bool {
        self.whole
    }

    /// Collapses runs of blanks to one tab from here on.
    pub(crate) fn squeeze_blanks(&mut self) {
        self.squeeze = Some(Squeeze::default());
    }

    /// Returns whether the text ends within a cell before `byte`, counted in the bytes handed out.
    pub(crate) fn is_cut_before(&self, byte: u64) -> bool {
        self.cut.is_some_and(|cut| cut < byte)
    }

    /// Returns whether the enclosing archive is truncated.
    pub(crate) fn is_archive_cut(&self) -> bool {
        self.origin.is_cut()
    }

    /// Returns whether these are only parts of a text.
    pub(crate) fn is_in_part(&self) -> bool {
        self.origin.is_in_part()
    }

    /// Returns the origin of the text.
    pub(crate) fn into_origin(self) -> Origin {
        self.origin
    }

    fn fill(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.at < self.head.len() {
            let n = buffer.len().min(self.head.len() - self.at);
            buffer[..n].copy_from_slice(&self.head[self.at..self.at + n]);
            self.at += n;
            return Ok(n);
        }
        let n = if self.whole { 0 } else { self.rest.read(buffer)? };
        if n == 0 {
            let n = buffer.len().min(self.closing.len());
            buffer[..n].copy_from_slice(&self.closing[..n]);
            self.closing = &self.closing[n..];
            return Ok(n);
        }
        Ok(n)
    }

    /// Fills a buffer with the text, with blanks collapsed if requested.
    fn squeezed(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
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

impl Read for Input {
    /// Needs a buffer of at least two bytes; the CSV reader's is much larger.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let closing = self.closing.len();
        let n = self.squeezed(buffer)?;
        if self.closing.len() < closing && !self.at_end {
            self.cut.get_or_insert(self.given);
        }
        self.given += n as u64;
        if let Some(last) = buffer[..n].last() {
            self.at_end = matches!(last, b'\n' | b'\r' | b'"');
        }
        Ok(n)
    }
}

/// Collapses runs of blanks to one tab, except in quotes, in brackets and before a bracket, so that
/// `u [m/s]` stays one cell.
#[derive(Debug, Default)]
pub(crate) struct Squeeze {
    started: bool,
    blank: bool,
    brackets: u32,
    quoted: bool,
}

impl Squeeze {
    /// Writes `from`, collapsed, to the start of `to`, which must be longer by at least one byte.
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

/// Reads on until the head holds some lines, however long.
fn lengthen(head: &mut Vec<u8>, whole: &mut bool, rest: &mut dyn Read) -> io::Result<()> {
    /// Lines enough to distinguish the header from the rows.
    const LINES: usize = 10;
    /// Ten lines of a hundred thousand columns.
    const MOST: usize = 16 << 20;
    let is_end = |&&b: &&u8| b == b'\n' || b == b'\r';
    while !*whole && head.len() < MOST && head.iter().filter(is_end).count() < LINES {
        let more = head.len() as u64;
        *whole = (rest.take(more).read_to_end(head)? as u64) < more;
    }
    Ok(())
}

/// Rejects content that is not text.
fn check(head: &[u8], whole: bool, path: &Path) -> Result<(), Error> {
    let path = path.to_owned();
    // A byte-order mark of UTF-16 may precede anything.
    if is_binary(head) {
        return Err(Error::Binary { path, looks_like: "binary data".to_owned() });
    }
    if whole && head.iter().all(u8::is_ascii_whitespace) {
        return Err(Error::Empty { path });
    }
    Ok(())
}

fn newline(head: &[u8]) -> Newline {
    // The last line, because a preamble may have another author than the rows.
    match head.iter().rposition(|&b| b == b'\n') {
        Some(0) => Newline::Lf,
        Some(end) if head[end - 1] == b'\r' => Newline::CrLf,
        Some(_) => Newline::Lf,
        None if head.contains(&b'\r') => Newline::Cr,
        None => Newline::Lf,
    }
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
    fn newlines_are_determined_by_the_last() {
        assert_eq!(newline(b"a\r\nb\r\n"), Newline::CrLf);
        assert_eq!(newline(b"# a\nb\r\nc\r\n"), Newline::CrLf);
        assert_eq!(newline(b"a\rb"), Newline::Cr);
        assert_eq!((newline(b"\n"), newline(b"a")), (Newline::Lf, Newline::Lf));
    }
}
