//! The compression of chunks and messages within a bag.

use std::io::Read;

/// Compression of a chunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Packing {
    None,
    Lz4,
    Zstd,
    Bzip2,
}

/// Magic bytes of zstd frames.
pub(crate) const ZSTD: &[u8] = b"\x28\xb5\x2f\xfd";

/// A chunk that unpacks to more than this, or than [`TIMES`] its packed size, is implausible.
const ALWAYS: usize = 1 << 20;
const TIMES: usize = 1000;

impl Packing {
    /// Unpacks as much as possible of `packed` into `unpacked`; returns whether everything was
    /// unpacked.
    pub(crate) fn unpack(self, packed: &[u8], unpacked: &mut Vec<u8>) -> bool {
        unpacked.clear();
        let most = ALWAYS.saturating_add(packed.len().saturating_mul(TIMES)) as u64;
        let read = match self {
            Self::None => {
                unpacked.extend_from_slice(packed);
                Ok(0)
            }
            Self::Lz4 => {
                lz4_flex::frame::FrameDecoder::new(packed).take(most).read_to_end(unpacked)
            }
            Self::Zstd => match zstd::stream::read::Decoder::with_buffer(packed) {
                Ok(decoder) => decoder.take(most).read_to_end(unpacked),
                Err(error) => Err(error),
            },
            Self::Bzip2 => {
                bzip2::bufread::MultiBzDecoder::new(packed).take(most).read_to_end(unpacked)
            }
        };
        read.is_ok() && (unpacked.len() as u64) < most.max(1)
    }
}
