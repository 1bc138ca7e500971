use std::path::{Path, PathBuf};

/// Reason why a campaign could not be read or run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system would not give a file.
    #[error("cannot read {}: {source}; check the spelling (a path inside a file is relative to that file)", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A pipe, a socket or a device where a file is needed.
    #[error("{} is a pipe or a device, not a regular file; save its content to a file and name that", path.display())]
    NotAFile {
        /// Its path.
        path: PathBuf,
    },
    /// A file that is implausibly large for its kind.
    #[error("{} is larger than {} MB, too large for this kind of file; name another", path.display(), most >> 20)]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The most that is read, bytes.
        most: u64,
    },
    /// A file that is not valid TOML of its form.
    #[error("{}: {message}{advice}", path.display())]
    Toml {
        /// The file.
        path: PathBuf,
        /// The error, with line, column and the line itself.
        message: String,
        /// Probable correction.
        advice: String,
    },
    /// A value that is well-formed and invalid.
    #[error("{}: {key}: {reason}{excerpt}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Its key.
        key: String,
        /// The error, with advice.
        reason: String,
        /// The line of the file, with a mark under the key; empty if it is in none.
        excerpt: String,
    },
    /// A log without a channel that a trial needs.
    #[error("trial `{trial}`, {quantity}: {source}")]
    Channel {
        /// The trial.
        trial: String,
        /// The quantity that was mapped.
        quantity: String,
        /// The reason.
        source: Box<seaplant_log::Error>,
    },
    /// A channel has no unit.
    #[error(
        "trial `{trial}`, {quantity}: column `{column}` states no unit; write it in the header, as `{column} [{example}]`, or in the campaign, as {{ column = \"{column}\", unit = \"{example}\" }}"
    )]
    NoUnit {
        /// The trial.
        trial: String,
        /// The quantity that was mapped.
        quantity: String,
        /// The column.
        column: String,
        /// A valid unit.
        example: String,
    },
    /// A physically impossible number.
    #[error(
        "trial `{trial}`, {quantity}: column `{column}` holds {found} at {time_s} s, which no vehicle has; check the unit, and drop faulty samples"
    )]
    Implausible {
        /// The trial.
        trial: String,
        /// The quantity that was mapped.
        quantity: String,
        /// The column.
        column: String,
        /// The number, with its SI unit.
        found: String,
        /// Its time, s in the log's clock.
        time_s: f64,
    },
    /// A log could not be read.
    #[error("trial `{trial}`: {source}")]
    Log {
        /// The trial.
        trial: String,
        /// The reason.
        source: Box<seaplant_log::Error>,
    },
    /// A table could not be read.
    #[error(transparent)]
    Table(Box<seaplant_log::Error>),
    /// An error of the identification itself.
    #[error("{}: {source}", path.display())]
    Model {
        /// The campaign or vehicle file.
        path: PathBuf,
        /// The reason.
        source: seaplant::Error,
    },
}

impl Error {
    /// Whether a log says too little of a trial, which others may make up for.
    pub(crate) const fn is_of_log(&self) -> bool {
        use seaplant::Error as Cause;
        matches!(self, Self::Model { source: Cause::TooShort { .. } | Cause::NoOverlap { .. }, .. })
    }

    pub(crate) fn model(path: &Path) -> impl FnOnce(seaplant::Error) -> Self + '_ {
        move |source| Self::Model { path: path.to_owned(), source }
    }
}
