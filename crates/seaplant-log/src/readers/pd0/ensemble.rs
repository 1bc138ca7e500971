//! One ensemble: a header that says where its data types are, these, and a checksum.

/// What an ensemble starts with.
pub(super) const MARK: [u8; 2] = [0x7f, 0x7f];

/// The header up to the offsets of the data types.
const HEADER: usize = 6;

/// The checksum behind an ensemble.
const CHECKSUM: usize = 2;

/// The longest that an ensemble can be, with its checksum.
pub(super) const MOST_BYTES: usize = u16::MAX as usize + CHECKSUM;

/// Settings of the instrument.
pub(super) const FIXED_LEADER: u16 = 0x0000;
/// What changes from ensemble to ensemble: time, attitude, the water.
pub(super) const VARIABLE_LEADER: u16 = 0x0080;
/// What was seen of the bottom.
pub(super) const BOTTOM_TRACK: u16 = 0x0600;

/// An ensemble whose checksum is right.
pub(super) struct Ensemble<'a> {
    /// All but the checksum.
    bytes: &'a [u8],
}

/// Where the header says that data types are.
struct Header<'a> {
    /// The bytes of the ensemble, without the checksum.
    bytes: usize,
    offsets: &'a [u8],
}

impl<'a> Header<'a> {
    /// The header at the start of `bytes`, unless no ensemble can have it.
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
    /// The ensemble that `bytes` start with.
    pub(super) fn at_start(bytes: &'a [u8]) -> Option<Self> {
        let size = Header::at_start(bytes)?.bytes;
        let checksum = u16_at(bytes, size)?;
        let sum = bytes[..size].iter().fold(0_u16, |sum, &byte| sum.wrapping_add(byte.into()));
        (sum == checksum).then_some(Self { bytes: &bytes[..size] })
    }

    /// Its length, with the checksum.
    pub(super) fn size(&self) -> usize {
        self.bytes.len() + CHECKSUM
    }

    /// The data types, each from its number to the end of the ensemble.
    pub(super) fn types(&self) -> impl Iterator<Item = (u16, &'a [u8])> + '_ {
        let offsets = Header::at_start(self.bytes).into_iter().flat_map(|header| header.offsets());
        offsets.filter_map(|offset| {
            let bytes = &self.bytes[offset..];
            Some((u16_at(bytes, 0)?, bytes))
        })
    }

    /// The first data type of that number.
    pub(super) fn find(&self, number: u16) -> Option<&'a [u8]> {
        self.types().find(|(found, _)| *found == number).map(|(_, bytes)| bytes)
    }
}

/// Whether `bytes`, the last of a file, start with an ensemble that is longer.
pub(super) fn is_cut(bytes: &[u8]) -> bool {
    let short = bytes.len() < HEADER || bytes.len() < HEADER + 2 * usize::from(bytes[5]);
    let begun = bytes.starts_with(&MARK) || bytes == &MARK[..1];
    let longer = || Header::at_start(bytes).is_some_and(|h| h.bytes + CHECKSUM > bytes.len());
    begun && (short || longer())
}

/// Where ensembles may start.
pub(super) fn marks(bytes: &[u8]) -> impl Iterator<Item = usize> + '_ {
    let pairs = bytes.windows(MARK.len()).enumerate();
    let pairs = pairs.filter(|(_, pair)| *pair == MARK).map(|(at, _)| at);
    // The end of the file may part a mark.
    let half = (bytes.last() == Some(&MARK[0])).then(|| bytes.len() - 1);
    pairs.chain(half)
}

pub(super) fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
}
