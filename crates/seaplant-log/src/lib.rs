//! Reads the logs of marine vehicles into named, timed, unit-bearing channels.
//!
//! [`read()`] turns one file into a [`Log`], [`Log::open`] the several files of a trial;
//! [`read_table`] reads a table without time, such as one of bollard pull. Nothing is decided
//! silently: [`Log::notes`] reports every assumption and every value that was dropped.
//!
//! # Example
//! ```
//! use seaplant_log::{Dimension, ReadOptions, read};
//!
//! # let path = std::env::temp_dir().join("seaplant-log-example.csv");
//! std::fs::write(&path, "time (s),T1 (us),depth (m)\n0.0,1500,2.10\n0.5,1588,2.11\n1.0,1588,\n")?;
//! let log = read(&path, &ReadOptions::default())?;
//!
//! let depth = log.channel("depth")?;
//! assert_eq!(depth.time_s(), [0.0, 0.5]); // the last row has no depth
//! assert_eq!(depth.missing, 1);
//!
//! let pulse = log.channel("T1 (us)")?;
//! assert_eq!(pulse.unit.as_ref().map(|unit| unit.dimension()), Some(Dimension::PulseWidth));
//! # std::fs::remove_file(&path)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod assemble;
mod bag_folder;
mod cell;
mod column;
mod content;
mod dimension;
mod epoch;
mod error;
mod excerpt;
mod figure;
mod format;
mod framing;
mod glance;
mod grid;
mod guard;
mod hashed;
mod heading;
mod input;
mod layout;
mod limits;
mod log;
mod lookup;
mod memory;
mod note;
mod options;
mod order;
mod progress;
mod quaternion;
mod read;
mod readers;
mod second_header;
mod separators;
mod spelling;
mod survey;
mod symbol;
mod table;
mod tabular;
mod time;
mod unit;
mod unpack;
mod wrap;

pub use bag_folder::is_bag;
pub use dimension::Dimension;
pub use epoch::Epoch;
pub use error::Error;
pub use figure::Figure;
pub use glance::Thoroughness;
pub use guard::is_guarded;
pub use log::{Channel, Gap, Log, Source};
pub use memory::{MemoryColumn, MemoryTable, calendar_second, time_column};
pub use note::Note;
pub use options::{ReadOptions, Stamp, TimeColumn};
pub use progress::{Progress, progress};
pub use read::{read, read_bytes};
pub use survey::{Parts, Survey, SurveyedChannel, SurveyedFile, survey};
pub use table::{Table, TableColumn, read_table};
pub use unit::Unit;
