//! Records of MCAP files: their kinds and lengths.

/// What a record is.
pub(super) mod op {
    pub(crate) const FOOTER: u8 = 2;
    pub(crate) const SCHEMA: u8 = 3;
    pub(crate) const CHANNEL: u8 = 4;
    pub(crate) const MESSAGE: u8 = 5;
    pub(crate) const CHUNK: u8 = 6;
    pub(crate) const CHUNK_INDEX: u8 = 8;
    pub(crate) const STATISTICS: u8 = 11;
    pub(crate) const DATA_END: u8 = 15;
    /// From here on, anybody's own.
    pub(crate) const PRIVATE: u8 = 128;
}

/// The byte that says what a record is, and its length.
pub(super) const RECORD: u64 = 9;
/// Longer records than this are none, unless they are attachments.
pub(super) const LONGEST: u64 = 1 << 30;
