//! Options of reading a log.

use std::path::Path;

use crate::Error;

/// Options of reading a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadOptions {
    /// The time column and its unit; `None` to recognise both by name and header.
    pub time: Option<TimeColumn>,
    /// Added to every time, s, to align several files to one clock.
    pub offset_s: f64,
    /// Rate of a table without a time column: row k is at k / `equal_sampling_hz`.
    pub equal_sampling_hz: Option<f64>,
    /// The sheet of a workbook; `None` for the first.
    pub sheet: Option<String>,
    /// The clock of messages that carry a stamp of their own.
    pub stamp: Stamp,
}

impl ReadOptions {
    /// Checks that the options can be applied to a file.
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

/// Choice between a message's two times.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Stamp {
    /// The time in the message's header, of the measurement; for messages without a header, the
    /// time of receipt.
    #[default]
    Header,
    /// The time at which the recorder received it.
    Receive,
}

/// Time column of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeColumn {
    /// The column, found as [`Log::channel`](crate::Log::channel) finds channels; `None` to recognise
    /// it by its name.
    pub column: Option<String>,
    /// Its unit, in place of the one in the header.
    pub unit: Option<String>,
}
