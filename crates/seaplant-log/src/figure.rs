//! Numbers of samples and times that may be estimates.

/// A number that is either known or estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Figure<T> {
    /// Counted, or stated by the file's index.
    Exact(T),
    /// Estimated from parts of the file.
    About(T),
}

impl<T: Copy> Figure<T> {
    /// Returns the number.
    pub fn value(self) -> T {
        match self {
            Self::Exact(value) | Self::About(value) => value,
        }
    }

    /// Returns whether the number is estimated.
    pub fn is_estimate(self) -> bool {
        matches!(self, Self::About(_))
    }

    /// Creates an exact or an estimated number.
    pub(crate) fn new(value: T, exact: bool) -> Self {
        if exact { Self::Exact(value) } else { Self::About(value) }
    }
}

/// Part of a group's records that was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Portion {
    /// Number of records read.
    pub(crate) read: usize,
    /// Number of records in the file.
    pub(crate) of: Figure<u64>,
}
