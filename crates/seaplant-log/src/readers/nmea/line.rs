//! Finds the sentences in a line.

/// Result of a sentence's checksum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Check {
    Right,
    Wrong,
    /// There is no checksum.
    None,
}

/// `$GPHDT,123.4,T*33` in a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sentence<'a> {
    /// Position in the line.
    pub(super) start: usize,
    /// Length of the part of the line before the first sentence.
    pub(super) prefix: usize,
    pub(super) bytes: &'a [u8],
    /// Content between `$` and `*`.
    pub(super) body: &'a str,
    pub(super) check: Check,
}

impl<'a> Sentence<'a> {
    /// Returns the talker and the kind of sentence.
    pub(super) fn address(&self) -> &'a str {
        self.body.split(',').next().unwrap_or_default()
    }
}

/// Iterates over the sentences in a line, from left to right.
pub(super) fn sentences(line: &[u8]) -> impl Iterator<Item = Sentence<'_>> {
    let mut from = 0;
    let mut prefix = None;
    let standard = std::iter::from_fn(move || {
        let (start, length) = next(line, from)?;
        from = start + length;
        let prefix = *prefix.get_or_insert(start);
        Some(sentence(start, prefix, &line[start..start + length]))
    });
    let none = next(line, 0).is_none();
    standard.chain(none.then(|| paroscientific(line)).flatten())
}

/// Returns the position, not before `from`, and the length of the next sentence.
fn next(line: &[u8], from: usize) -> Option<(usize, usize)> {
    let marks = line.iter().enumerate().skip(from);
    let mut starts = marks.filter(|(_, byte)| matches!(byte, b'$' | b'!')).map(|(at, _)| at);
    let start = starts.find(|&at| is_address(&line[at + 1..]))?;
    let rest = &line[start + 1..];
    let end = rest.iter().position(|&b| matches!(b, b'*' | b'$' | b'!') || !is_text(b));
    let end = end.unwrap_or(rest.len());
    let sum = if rest.get(end) == Some(&b'*') { 3.min(rest.len() - end) } else { 0 };
    Some((start, 1 + end + sum))
}

/// Returns whether bytes start with the address of a sentence: letters, the first a capital.
fn is_address(bytes: &[u8]) -> bool {
    let length = bytes.iter().take_while(|b| b.is_ascii_uppercase() || b.is_ascii_digit()).count();
    let first = bytes.first().is_some_and(u8::is_ascii_uppercase);
    first && (4..=8).contains(&length) && bytes.get(length) == Some(&b',')
}

fn is_text(byte: u8) -> bool {
    byte.is_ascii_graphic() || byte == b' '
}

/// Parses `bytes` as a sentence.
fn sentence(start: usize, prefix: usize, bytes: &[u8]) -> Sentence<'_> {
    let inner = &bytes[1..];
    let star = inner.iter().position(|&byte| byte == b'*');
    let body = &inner[..star.unwrap_or(inner.len())];
    let sum = body.iter().fold(0, |sum, byte| sum ^ byte);
    let check = match star.map(|star| std::str::from_utf8(&inner[star + 1..]).unwrap_or_default()) {
        None => Check::None,
        Some(hex) if hex.len() == 2 && u8::from_str_radix(hex, 16) == Ok(sum) => Check::Right,
        Some(_) => Check::Wrong,
    };
    let body = std::str::from_utf8(body).unwrap_or_default().trim_ascii_end();
    Sentence { start, prefix, bytes, body, check }
}

/// Parses `*000114.7234`, the reading of Paroscientific sensor 01 for host 00.
fn paroscientific(line: &[u8]) -> Option<Sentence<'_>> {
    let start = line.windows(3).position(|three| three == b"*00")?;
    let bytes = line[start..].trim_ascii_end();
    let body = std::str::from_utf8(bytes.get(3..)?).ok()?;
    let number = body.get(2..)?.split(',').next()?;
    let is_number = body.as_bytes()[..2].iter().all(u8::is_ascii_digit)
        && number.contains('.')
        && number.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+'));
    is_number.then_some(Sentence { start, prefix: start, bytes, body, check: Check::None })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bodies(line: &str) -> Vec<(&str, Check)> {
        sentences(line.as_bytes()).map(|s| (s.body, s.check)).collect()
    }

    #[test]
    fn sentences_are_found_anywhere_in_a_line() {
        // As sent by a Phins.
        let line = "12:00:01 $PIXSE,ATITUD,-1.641,-0.490*6D$HEHDT,116.581,T*25 $HEHDT,116.5";
        assert_eq!(
            bodies(line),
            [
                ("PIXSE,ATITUD,-1.641,-0.490", Check::Right),
                ("HEHDT,116.581,T", Check::Right),
                ("HEHDT,116.5", Check::None),
            ]
        );
        assert_eq!(sentences(line.as_bytes()).last().map(|s| (s.start, s.prefix)), Some((59, 9)));
        assert_eq!(bodies("$HEHDT,116.582,T*25"), [("HEHDT,116.582,T", Check::Wrong)]);
        assert_eq!(bodies("$HEHDT,116.581,T*2"), [("HEHDT,116.581,T", Check::Wrong)]);
        for text in ["", "costs $5", "$abc,1", "$GPHDT", "*0001", "*00xx1.5", "5*001.2"] {
            assert_eq!(bodies(text), [], "{text}");
        }
        assert_eq!(bodies("0.5\t*000114.7234\r"), [("0114.7234", Check::None)]);
    }
}
