//! Headers of the records of a ROS 1 bag.

use crate::readers::bytes::Bytes;

/// Record types.
pub(super) mod op {
    pub(crate) const MESSAGE: u8 = 2;
    pub(crate) const BAG: u8 = 3;
    pub(crate) const INDEX: u8 = 4;
    pub(crate) const CHUNK: u8 = 5;
    pub(crate) const CHUNK_INFO: u8 = 6;
    pub(crate) const CONNECTION: u8 = 7;
}

/// A record's header: fields `name=value`, each preceded by its length.
#[derive(Clone, Copy)]
pub(super) struct Header<'a>(pub(super) &'a [u8]);

impl<'a> Header<'a> {
    pub(super) fn field(self, name: &str) -> Option<&'a [u8]> {
        let mut bytes = Bytes(self.0);
        while !bytes.0.is_empty() {
            let length = bytes.u32()? as usize;
            let field = bytes.take(length)?;
            let value = field.strip_prefix(name.as_bytes()).and_then(|v| v.strip_prefix(b"="));
            if value.is_some() {
                return value;
            }
        }
        None
    }

    /// Returns a number of up to eight bytes.
    pub(super) fn number(self, name: &str) -> Option<u64> {
        let value = self.field(name).filter(|value| value.len() <= 8)?;
        Some(value.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte)))
    }

    pub(super) fn op(self) -> Option<u8> {
        match self.field("op")? {
            &[
                op @ (op::MESSAGE
                | op::BAG
                | op::INDEX
                | op::CHUNK
                | op::CHUNK_INFO
                | op::CONNECTION),
            ] => Some(op),
            _ => None,
        }
    }
}
