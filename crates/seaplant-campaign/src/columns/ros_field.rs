//! Names of channels of ROS bags, taken apart.

use crate::words::words;

/// A channel by its parts: `TOPIC/FIELD.FIELD`.
pub(super) struct Field<'a> {
    pub topic: &'a str,
    /// What follows the topic.
    pub path: &'a str,
    /// The words of both.
    pub words: Vec<String>,
}

impl<'a> Field<'a> {
    /// Names in brackets may have slashes, too.
    pub fn of(column: &'a str) -> Option<Self> {
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

    /// Whether it is so called, below whatever message holds it.
    pub fn ends(&self, tail: &str) -> bool {
        let before = self.path.strip_suffix(tail);
        before.is_some_and(|before| before.is_empty() || before.ends_with('.'))
    }
}
