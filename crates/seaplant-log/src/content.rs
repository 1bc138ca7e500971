//! A file's bytes on their way to a reader: inspected at the start, hashed as they pass.

use std::fs::File;
use std::io::{self, BufReader, Chain, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::hashed::Hashed;
use crate::log::Source;
use crate::note::Note;
use crate::progress;
use crate::unpack::{self, Unpacking};
use crate::{Epoch, Error};

/// Packed bytes of an archive.
pub(crate) type Packed = BufReader<Chain<Cursor<Vec<u8>>, Box<dyn Read + Send>>>;

/// Number of leading bytes from which the format is detected.
pub(crate) const HEAD: usize = 256 * 1024;

/// A file, or bytes in its place, with its first bytes in memory.
///
/// A reader takes it through one of [`Content::stream`] (front to back, the lightest),
/// [`Content::seekable`] and [`Content::bytes`] (all of it in memory).
pub(crate) struct Content {
    head: Vec<u8>,
    /// True if `head` holds the complete content.
    whole: bool,
    rest: Box<dyn Read + Send>,
    origin: Origin,
    /// Length of the file at the origin's path, if these are its bytes and can be read again.
    file: Option<u64>,
}

impl Content {
    /// Opens a file.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Directory`], [`Error::NotAFile`].
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::io(path, source);
        let metadata = std::fs::metadata(path).map_err(failed)?;
        if metadata.is_dir() {
            return Err(Error::Directory { path: path.to_owned() });
        }
        // Reading a pipe would wait for a writer, and a device such as `/dev/zero` never ends.
        if !metadata.is_file() {
            return Err(Error::NotAFile { path: path.to_owned() });
        }
        progress::add_opened(metadata.len());
        Self::new(path, Box::new(File::open(path).map_err(failed)?), Some(metadata.len()))
    }

    /// Wraps bytes in place of a file; messages call them `path`.
    ///
    /// # Errors
    /// None, but for those of [`Content::open`].
    pub(crate) fn of_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, Error> {
        Self::new(path, Box::new(Cursor::new(bytes)), None)
    }

    fn new(path: &Path, raw: Box<dyn Read + Send>, file: Option<u64>) -> Result<Self, Error> {
        let hashed = Hashed::new(raw);
        let (unpacking, in_part) = (Vec::new(), None);
        let origin = Origin { path: path.to_owned(), raw: hashed.clone(), unpacking, in_part };
        Self::with_head(origin, Box::new(hashed), file)
    }

    /// Wraps parts of a file that has `length` bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn in_part(mut self, parts: Box<dyn Read + Send>, size: u64) -> Result<Self, Error> {
        self.origin.reads_in_part(size);
        Self::with_head(self.origin, parts, None)
    }

    /// Unpacks an archive. `packing` names its kind: "gzip".
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Archive`], [`Error::TooMuch`]; [`Error::Unsupported`] of an archive
    /// in an archive in an archive.
    pub(crate) fn unpack(
        mut self,
        packing: &'static str,
        unpacker: impl FnOnce(Packed) -> io::Result<Box<dyn Read + Send>>,
    ) -> Result<Self, Error> {
        /// One archive within another may be an accident; a deeper nesting is not.
        const DEEP: usize = 2;
        if self.origin.unpacking.len() >= DEEP {
            let (path, detail) = (self.path().to_owned(), "in archives in archives".to_owned());
            let (format, advice) = ("an archive", "unpack it first");
            return Err(Error::Unsupported { path, format, detail, advice });
        }
        let packed = BufReader::new(Cursor::new(self.head).chain(self.rest));
        let raw = self.origin.raw.clone();
        let (unpacked, state) = unpack::Unpacked::new(packing, raw, unpacker(packed));
        self.origin.unpacking.push(Arc::clone(&state));
        let content = Self::with_head(self.origin, Box::new(unpacked), None)?;
        match state.cut() {
            Some((0, reason)) => {
                Err(Error::Archive { path: content.path().to_owned(), packing, reason })
            }
            _ => Ok(content),
        }
    }

    fn with_head(
        origin: Origin,
        mut rest: Box<dyn Read + Send>,
        file: Option<u64>,
    ) -> Result<Self, Error> {
        let mut head = Vec::new();
        (&mut rest).take(HEAD as u64).read_to_end(&mut head).map_err(|e| origin.failed(e))?;
        let whole = head.len() < HEAD;
        Ok(Self { head, whole, rest, origin, file })
    }

    pub(crate) fn path(&self) -> &Path {
        self.origin.path()
    }

    /// Returns the length of the file, if its bytes are neither packed nor partial.
    pub(crate) fn file_length(&self) -> Option<u64> {
        self.file
    }

    /// Returns the first bytes, from which the format is detected.
    pub(crate) fn head(&self) -> &[u8] {
        &self.head
    }

    /// Returns the origin, the head, whether the head is complete, and the rest.
    pub(crate) fn into_parts(self) -> (Origin, Vec<u8>, bool, Box<dyn Read + Send>) {
        (self.origin, self.head, self.whole, self.rest)
    }

    /// Returns the bytes from front to back.
    pub(crate) fn stream(self) -> (Origin, impl Read + Send + use<>) {
        (self.origin, Cursor::new(self.head).chain(self.rest))
    }

    /// Reads all bytes into memory.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn bytes(mut self) -> Result<(Origin, Vec<u8>), Error> {
        self.rest.read_to_end(&mut self.head).map_err(|e| self.origin.failed(e))?;
        Ok((self.origin, self.head))
    }

    /// Returns the bytes with random access.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn seekable(self) -> Result<(Origin, Seekable), Error> {
        let Some(length) = self.file else {
            let (origin, bytes) = self.bytes()?;
            return Ok((origin, Seekable::Memory(Cursor::new(bytes))));
        };
        let file = File::open(self.path()).map_err(|e| self.origin.failed(e))?;
        progress::add_opened(length);
        Ok((self.origin, Seekable::File(file)))
    }
}

/// Bytes with random access.
pub(crate) enum Seekable {
    File(File),
    Memory(Cursor<Vec<u8>>),
}

impl Read for Seekable {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::File(file) => {
                let read = file.read(buffer)?;
                progress::add_read(read as u64);
                Ok(read)
            }
            Self::Memory(bytes) => bytes.read(buffer),
        }
    }
}

impl Seek for Seekable {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Self::File(file) => file.seek(to),
            Self::Memory(bytes) => bytes.seek(to),
        }
    }
}

/// Origin of bytes.
pub(crate) struct Origin {
    path: PathBuf,
    raw: Hashed,
    /// Enclosing archives, the outermost first.
    unpacking: Vec<Arc<Unpacking>>,
    /// Length of the file, if only parts of it are read.
    in_part: Option<u64>,
}

impl Origin {
    /// Records that only parts of the file, which has `length` bytes, are read.
    pub(crate) fn reads_in_part(&mut self, length: u64) {
        self.in_part = Some(length);
    }

    /// Returns whether only parts of the file are read.
    pub(crate) fn is_in_part(&self) -> bool {
        self.in_part.is_some()
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn failed(&self, source: io::Error) -> Error {
        Error::io(&self.path, source)
    }

    /// Returns whether an enclosing archive is truncated.
    pub(crate) fn is_cut(&self) -> bool {
        self.unpacking.iter().any(|unpacking| unpacking.cut().is_some())
    }

    /// Returns the notes on the enclosing archives, once everything is read.
    pub(crate) fn notes(&self) -> impl Iterator<Item = Note> + '_ {
        self.unpacking.iter().filter_map(|unpacking| {
            let (path, packing) = (self.path.clone(), unpacking.packing());
            let (byte, reason) = unpacking.cut()?;
            Some(Note::ArchiveCut { path, packing, byte, reason })
        })
    }

    /// Returns the file with its hash, reading what was not read yet. If only parts are read, there
    /// is no hash.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn source(&self, format: String) -> Result<Source, Error> {
        let (path, epoch) = (self.path.clone(), Epoch::Unstated);
        if let Some(bytes) = self.in_part {
            let sha256 = String::new();
            return Ok(Source { path, bytes, sha256, format, epoch });
        }
        io::copy(&mut self.raw.clone(), &mut io::sink()).map_err(|e| self.failed(e))?;
        let packings = self.unpacking.iter().rev().map(|unpacking| unpacking.packing());
        let format = packings.fold(format, |format, packing| format!("{format}, {packing}"));
        let (bytes, sha256) = (self.raw.passed(), self.raw.sha256());
        Ok(Source { path, bytes, sha256, format, epoch })
    }
}

/// Returns whether bytes are not text: a NUL, or more control characters than text has.
pub(crate) fn is_binary(head: &[u8]) -> bool {
    /// Number of bytes searched for control characters.
    const LOOK: usize = 8 * 1024;
    let start = &head[..head.len().min(LOOK)];
    let is_control = |b: u8| b < 0x20 && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c) || b == 0x7f;
    let control = start.iter().filter(|&&b| is_control(b)).count();
    start.contains(&0) || 50 * control > start.len()
}
