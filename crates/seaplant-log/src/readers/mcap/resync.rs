//! Finds the start of records in an MCAP file, also after damage.

use std::io;

use super::record::{LONGEST, RECORD, op};
use crate::readers::bytes::Bytes;
use crate::readers::ros::Window;

/// Returns the type and the length of the current record, unless the file ends.
pub(super) fn head(window: &mut Window) -> io::Result<Option<(u8, u64)>> {
    let mut bytes = Bytes(window.look(RECORD)?);
    Ok(bytes.u8().zip(bytes.u64()))
}

/// Returns whether the current position may hold a record.
pub(super) fn is_plausible(window: &mut Window) -> io::Result<bool> {
    let Some((kind, length)) = head(window)? else { return Ok(false) };
    if length > window.left() - RECORD {
        return Ok(false);
    }
    Ok(match kind {
        op::CHUNK => chunk_is_plausible(window)?,
        op::SCHEMA | op::CHANNEL | op::MESSAGE => length <= LONGEST,
        0 => false,
        ..=op::DATA_END | op::PRIVATE.. => true,
        _ => false,
    })
}

/// Returns whether the lengths of the current chunk, which the end of the file may truncate, are
/// consistent.
pub(super) fn chunk_is_plausible(window: &mut Window) -> io::Result<bool> {
    /// Start, end, size, checksum and name of the compression, a short one.
    const HEAD: u64 = 8 + 8 + 8 + 4 + 4 + 8;
    const NAME: u64 = 16;
    let mut bytes = Bytes(window.look(RECORD + HEAD + NAME)?);
    let mut fits = || {
        bytes.u8()?;
        let length = bytes.u64()?;
        bytes.take(28)?;
        let name = u64::from(bytes.u32()?);
        bytes.take(usize::try_from(name).ok().filter(|&name| name as u64 <= NAME)?)?;
        Some(length <= LONGEST && length.checked_sub(HEAD + name)? == bytes.u64()?)
    };
    Ok(fits() == Some(true))
}

/// Moves past the damage to the next plausible record; returns whether there is one.
pub(super) fn resync(window: &mut Window) -> io::Result<bool> {
    window.skip(1)?;
    loop {
        let starts = |b: &u8| matches!(*b, op::MESSAGE | op::CHUNK | op::DATA_END);
        let ahead = window.look(4096)?;
        if ahead.is_empty() {
            return Ok(false);
        }
        let step = ahead.iter().position(starts).unwrap_or(ahead.len());
        window.skip(step as u64)?;
        if step == 0 {
            if is_plausible(window)? && next_is_plausible(window)? {
                return Ok(true);
            }
            window.skip(1)?;
        }
    }
}

/// Returns whether another record follows the current one, or need not: the lengths in a chunk are
/// evidence enough.
fn next_is_plausible(window: &mut Window) -> io::Result<bool> {
    /// Messages longer than this are accepted without a look at the next record.
    const FAR: u64 = 1 << 16;
    let Some((kind, length)) = head(window)? else { return Ok(false) };
    if kind == op::CHUNK {
        return Ok(true);
    }
    if kind == op::DATA_END {
        return Ok(length == 4);
    }
    if !(22..FAR).contains(&length) {
        return Ok(false);
    }
    let mut next = Bytes(window.look(2 * RECORD + length)?);
    let mut follows = || {
        next.take((RECORD + length) as usize)?;
        let (kind, length) = (next.u8()?, next.u64()?);
        Some((op::SCHEMA..=op::DATA_END).contains(&kind) && length < FAR)
    };
    Ok(follows() == Some(true))
}
