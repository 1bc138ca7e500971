//! Records of MCAP files: their kinds and lengths.

/// Record types.
pub(super) mod op {
    pub(crate) const FOOTER: u8 = 2;
    pub(crate) const SCHEMA: u8 = 3;
    pub(crate) const CHANNEL: u8 = 4;
    pub(crate) const MESSAGE: u8 = 5;
    pub(crate) const CHUNK: u8 = 6;
    pub(crate) const CHUNK_INDEX: u8 = 8;
    pub(crate) const STATISTICS: u8 = 11;
    pub(crate) const DATA_END: u8 = 15;
    /// First type reserved for private records.
    pub(crate) const PRIVATE: u8 = 128;
}

/// Length of the type byte and the length field.
pub(super) const RECORD: u64 = 9;
/// Longer records are implausible, unless they are attachments.
pub(super) const LONGEST: u64 = 1 << 30;
