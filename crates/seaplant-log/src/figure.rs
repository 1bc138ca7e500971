//! Numbers of samples and times that may be estimates.

/// A number, and whether it is known or estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Figure<T> {
    /// Counted, or stated by the file's index.
    Exact(T),
    /// Estimated from parts of the file.
    About(T),
}

impl<T: Copy> Figure<T> {
    /// The number.
    pub fn value(self) -> T {
        match self {
            Self::Exact(value) | Self::About(value) => value,
        }
    }

    /// Whether it is estimated.
    pub fn is_estimate(self) -> bool {
        matches!(self, Self::About(_))
    }

    /// A number that is `exact`, or not.
    pub(crate) fn new(value: T, exact: bool) -> Self {
        if exact { Self::Exact(value) } else { Self::About(value) }
    }
}

/// Which part of a group's records was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Portion {
    /// How many were read,
    pub(crate) read: usize,
    /// and how many the file holds.
    pub(crate) of: Figure<u64>,
}
