//! Options of reading a log.

use std::path::Path;

use crate::Error;

/// How to read a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadOptions {
    /// The time column and its unit; `None` to recognise both by name and header.
    pub time: Option<TimeColumn>,
    /// Added to every time, s, to bring several files to one clock.
    pub offset_s: f64,
    /// The rate of a table without a time column: row k is at k / `equal_sampling_hz`.
    pub equal_sampling_hz: Option<f64>,
    /// The sheet of a workbook; `None` for the first.
    pub sheet: Option<String>,
    /// The clock of messages that carry a stamp of their own.
    pub stamp: Stamp,
}

impl ReadOptions {
    /// Checks that a file can be read so.
    ///
    /// # Errors
    /// [`Error::Option`].
    pub(crate) fn check(&self, path: &Path) -> Result<(), Error> {
        let refuse = |option, found: String, expected| {
            Err(Error::Option { path: path.to_owned(), option, found, expected })
        };
        if !self.offset_s.is_finite() {
            let found = self.offset_s.to_string();
            return refuse("the time offset", found, "a finite number of seconds");
        }
        match self.equal_sampling_hz {
            Some(rate) if !(rate.is_finite() && rate > 0.0) => {
                refuse("the sampling rate", rate.to_string(), "a positive number of hertz")
            }
            Some(rate) if self.time.is_some() => {
                let expected = "left out where a time column is named";
                refuse("the sampling rate", rate.to_string(), expected)
            }
            _ => Ok(()),
        }
    }
}

/// Which of a message's two times counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Stamp {
    /// That in the message's header, of the measurement; of messages without one, that of receipt.
    #[default]
    Header,
    /// That at which the recorder received it.
    Receive,
}

/// Where a log's time is.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeColumn {
    /// The column, found as [`Log::channel`](crate::Log::channel) finds channels; `None` to recognise
    /// it by its name.
    pub column: Option<String>,
    /// Its unit, in place of the one that the header states.
    pub unit: Option<String>,
}
