//! Parses one ensemble: a header with the positions of its data types, the data types, and a
//! checksum.

/// Marker at the start of an ensemble.
pub(super) const MARK: [u8; 2] = [0x7f, 0x7f];

/// Length of the header before the offsets of the data types.
const HEADER: usize = 6;

/// Length of the checksum after an ensemble.
const CHECKSUM: usize = 2;

/// Maximum length of an ensemble with its checksum.
pub(super) const MOST_BYTES: usize = u16::MAX as usize + CHECKSUM;

/// Settings of the instrument.
pub(super) const FIXED_LEADER: u16 = 0x0000;
/// Data that change between ensembles: time, attitude, the water.
pub(super) const VARIABLE_LEADER: u16 = 0x0080;
/// Bottom-track measurements.
pub(super) const BOTTOM_TRACK: u16 = 0x0600;

/// An ensemble with a valid checksum.
pub(super) struct Ensemble<'a> {
    /// Everything except the checksum.
    bytes: &'a [u8],
}

/// Positions of data types from the header.
struct Header<'a> {
    /// Length of the ensemble without the checksum, bytes.
    bytes: usize,
    offsets: &'a [u8],
}

impl<'a> Header<'a> {
    /// Parses the header at the start of `bytes`, if it is a possible one.
    fn at_start(bytes: &'a [u8]) -> Option<Self> {
        if !bytes.starts_with(&MARK) {
            return None;
        }
        let size = usize::from(u16_at(bytes, 2)?);
        let types = usize::from(*bytes.get(5)?);
        let offsets = bytes.get(HEADER..HEADER + 2 * types)?;
        let header = Self { bytes: size, offsets };
        let inside = |offset: usize| HEADER + offsets.len() <= offset && offset + 2 <= size;
        (types > 0 && header.offsets().all(inside)).then_some(header)
    }

    fn offsets(&self) -> impl Iterator<Item = usize> + use<'a> {
        self.offsets.chunks_exact(2).map(|two| usize::from(u16::from_le_bytes([two[0], two[1]])))
    }
}

impl<'a> Ensemble<'a> {
    /// Parses the ensemble at the start of `bytes`.
    pub(super) fn at_start(bytes: &'a [u8]) -> Option<Self> {
        let size = Header::at_start(bytes)?.bytes;
        let checksum = u16_at(bytes, size)?;
        let sum = bytes[..size].iter().fold(0_u16, |sum, &byte| sum.wrapping_add(byte.into()));
        (sum == checksum).then_some(Self { bytes: &bytes[..size] })
    }

    /// Returns its length with the checksum.
    pub(super) fn size(&self) -> usize {
        self.bytes.len() + CHECKSUM
    }

    /// Iterates over the data types, each from its number to the end of the ensemble.
    pub(super) fn types(&self) -> impl Iterator<Item = (u16, &'a [u8])> + '_ {
        let offsets = Header::at_start(self.bytes).into_iter().flat_map(|header| header.offsets());
        offsets.filter_map(|offset| {
            let bytes = &self.bytes[offset..];
            Some((u16_at(bytes, 0)?, bytes))
        })
    }

    /// Returns the first data type of that number.
    pub(super) fn find(&self, number: u16) -> Option<&'a [u8]> {
        self.types().find(|(found, _)| *found == number).map(|(_, bytes)| bytes)
    }
}

/// Returns whether `bytes`, the last of a file, start with a truncated ensemble.
pub(super) fn is_cut(bytes: &[u8]) -> bool {
    let short = bytes.len() < HEADER || bytes.len() < HEADER + 2 * usize::from(bytes[5]);
    let begun = bytes.starts_with(&MARK) || bytes == &MARK[..1];
    let longer = || Header::at_start(bytes).is_some_and(|h| h.bytes + CHECKSUM > bytes.len());
    begun && (short || longer())
}

/// Iterates over the positions at which ensembles may start.
pub(super) fn marks(bytes: &[u8]) -> impl Iterator<Item = usize> + '_ {
    let pairs = bytes.windows(MARK.len()).enumerate();
    let pairs = pairs.filter(|(_, pair)| *pair == MARK).map(|(at, _)| at);
    // The end of the file may split a mark.
    let half = (bytes.last() == Some(&MARK[0])).then(|| bytes.len() - 1);
    pairs.chain(half)
}

pub(super) fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
}
