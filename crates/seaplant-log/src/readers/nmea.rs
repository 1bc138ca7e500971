//! NMEA 0183 sentences and their relatives.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether text is sentences mostly: `$`, five letters or more, a comma.
pub(crate) fn recognises(head: &[u8]) -> bool {
    /// How many lines are looked at.
    const LINES: usize = 50;
    let lines = head.split(|&b| b == b'\n').map(<[u8]>::trim_ascii).filter(|l| !l.is_empty());
    let sentence = |line: &[u8]| {
        let talker = line.iter().position(|&b| b == b'$').map(|at| &line[at + 1..]);
        let letters = talker.map_or(0, |t| t.iter().take_while(|b| b.is_ascii_uppercase()).count());
        letters >= 4 && talker.is_some_and(|t| t.get(letters) == Some(&b','))
    };
    let (all, sentences) = lines
        .take(LINES)
        .fold((0, 0), |(all, sentences), line| (all + 1, sentences + usize::from(sentence(line))));
    2 * sentences > all
}

/// Reads sentences.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
