//! Parses the names of channels of ROS bags.

use crate::words::words;

/// The parts of a channel's name: `TOPIC/FIELD.FIELD`.
pub(super) struct Field<'a> {
    pub topic: &'a str,
    /// Part after the topic.
    pub path: &'a str,
    /// The words of both.
    pub words: Vec<String>,
}

impl<'a> Field<'a> {
    /// Parses a channel's name. Names in brackets may contain slashes.
    pub fn parse(column: &'a str) -> Option<Self> {
        let bracket = column.find('[').unwrap_or(column.len());
        let slash = column[..bracket].rfind('/')?;
        Some(Self { topic: &column[..slash], path: &column[slash + 1..], words: words(column) })
    }

    pub fn has(&self, word: &str) -> bool {
        self.words.iter().any(|own| own == word)
    }

    pub fn has_any(&self, known: &[&str]) -> bool {
        known.iter().any(|word| self.has(word))
    }

    /// Returns whether its last fields have these names, in whatever message.
    pub fn ends(&self, tail: &str) -> bool {
        let before = self.path.strip_suffix(tail);
        before.is_some_and(|before| before.is_empty() || before.ends_with('.'))
    }
}
