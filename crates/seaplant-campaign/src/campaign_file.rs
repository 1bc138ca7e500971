//! campaign.toml.

use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use seaplant::estimate::online::OnlineOptions;
use seaplant::estimate::steady::SteadyOptions;
use seaplant::estimate::{EquationError, FilterError, OutputError, Paper};
use seaplant::{Dof, Method, Quantity, Role, Term, VelocitySource, exact};
use seaplant_log::{Dimension, Stamp, Unit};
use serde::{Deserialize, Serialize};

use crate::bench::BenchColumns;
use crate::known_file::KnownEntry;
use crate::plant_file::PlantEntry;

/// The content of a campaign.toml.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct CampaignFile {
    /// The vehicle file.
    pub vehicle: PathBuf,
    /// The time column of the logs; recognised by name if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<TimeEntry>,
    /// The sheet of each workbook; its first if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sheet: Option<String>,
    /// The trials.
    pub trial: Vec<TrialEntry>,
    /// The column of each quantity, for all trials that do not override it.
    #[serde(default)]
    pub channels: BTreeMap<String, ChannelEntry>,
    /// The methods; the first gives the recommended plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub methods: Option<Vec<Method>>,
    /// The source of velocity for every method: `measured`, by the DVL or rate sensor, or
    /// `position`, as its derivative. By default the paper's method derives it, others do not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<VelocitySource>,
    /// The terms to fit, everywhere or by degree of freedom.
    #[serde(default, skip_serializing_if = "FitEntry::is_default")]
    pub fit: FitEntry,
    /// Plants of several axes; without any, each axis has its own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plant: Vec<PlantEntry>,
    /// Settings of the paper's method.
    #[serde(default, skip_serializing_if = "is_default")]
    pub paper: Paper,
    /// Settings of equation error.
    #[serde(default, skip_serializing_if = "is_default")]
    pub equation_error: EquationError,
    /// Settings of output error.
    #[serde(default, skip_serializing_if = "is_default")]
    pub output_error: OutputError,
    /// Settings of filter error.
    #[serde(default, skip_serializing_if = "is_default")]
    pub filter_error: FilterError,
    /// Settings of the methods that work sample by sample.
    #[serde(default, skip_serializing_if = "is_default")]
    pub online: OnlineOptions,
    /// The criteria of steadiness.
    #[serde(default, skip_serializing_if = "is_default")]
    pub steady: SteadyEntry,
    /// Bollard-pull data of the thrusters, for the report's figure of thrust.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bollard_pull: Option<BollardPullEntry>,
}

/// Column of each quantity.
pub(crate) type ChannelMap = BTreeMap<Quantity, ChannelEntry>;

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// The time column of a log.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TimeEntry {
    /// The time column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// Its unit, if the header does not state it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// The rate of a log without a time column, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equal_sampling_hz: Option<f64>,
    /// The time of a ROS message to use; the header's if left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stamp: Option<StampEntry>,
    /// Files with another time column, by the path in `log` or the end of it.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub file: BTreeMap<String, FileTimeEntry>,
}

/// The time column of one file; it overrides that of all files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FileTimeEntry {
    /// The time column.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// Its unit, if the header does not state it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// The rate of a log without a time column, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equal_sampling_hz: Option<f64>,
}

impl TimeEntry {
    /// Returns the settings of one file.
    pub(crate) fn of_file(&self, is_named: impl Fn(&str) -> bool) -> FileTimeEntry {
        let own = self.file.iter().find(|(name, _)| is_named(name)).map(|(_, entry)| entry.clone());
        own.unwrap_or_else(|| FileTimeEntry {
            column: self.column.clone(),
            unit: self.unit.clone(),
            equal_sampling_hz: self.equal_sampling_hz,
        })
    }
}

impl FileTimeEntry {
    /// Rejects a clock that is contradictory or cannot be read.
    ///
    /// # Errors
    /// The key that is wrong, and why.
    pub(crate) fn check(&self) -> Result<(), (&'static str, String)> {
        if let Some(unit) = &self.unit {
            if self.equal_sampling_hz.is_some() {
                let reason = "is the unit of a time column; leave it out beside equal_sampling_hz";
                return Err(("unit", reason.to_owned()));
            }
            if let Err(error) = Unit::parse_as(unit, Dimension::Time) {
                return Err(("unit", error.to_string()));
            }
        }
        match self.equal_sampling_hz {
            Some(rate) if !(rate > 0.0 && rate.is_finite()) => Err((
                "equal_sampling_hz",
                format!("is {rate}; it must be a positive number of hertz"),
            )),
            Some(_) if self.column.is_some() => Err((
                "equal_sampling_hz",
                "is for logs without a time column; leave out one of the two".to_owned(),
            )),
            _ => Ok(()),
        }
    }
}

/// The choice between a message's two times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StampEntry {
    /// The time in its header; for messages without one, the time of receipt.
    Header,
    /// The time at which it was recorded.
    Receive,
}

impl From<StampEntry> for Stamp {
    fn from(entry: StampEntry) -> Self {
        match entry {
            StampEntry::Header => Self::Header,
            StampEntry::Receive => Self::Receive,
        }
    }
}

/// A trial: one stretch of one log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrialEntry {
    /// Its name in tables and messages.
    pub name: String,
    /// Its log file, or files that were logged simultaneously; or a pattern such as `runs/*.csv`,
    /// for a trial of each file or folder that it matches.
    pub log: LogEntry,
    /// The degrees of freedom to fit one at a time; may be left out if there is a `[[plant]]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dof: Vec<Dof>,
    /// Its purpose: fit (the default), hold-out or steady.
    #[serde(default)]
    pub role: Role,
    /// Its start, in seconds after the first sample of its logs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// Its end, in seconds after the first sample of its logs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
    /// Steady stretches `[from, to]`, likewise; detected if left out.
    #[serde(
        default,
        deserialize_with = "exact::rows_of_numbers",
        skip_serializing_if = "Vec::is_empty"
    )]
    pub segments_s: Vec<[f64; 2]>,
    /// Seconds to add to the clock of a file, by its path as in `log` or the end of it; or
    /// `"estimate"`, to estimate them from motion that several files measure.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub offset_s: BTreeMap<String, OffsetEntry>,
    /// The sheet of a workbook, in place of the campaign's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sheet: Option<String>,
    /// Columns with other names in this trial.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub channels: BTreeMap<String, ChannelEntry>,
    /// Forces that are known: weights hung on, lines with a scale. They fix the scale of thrust.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub known: Vec<KnownEntry>,
}

/// The offset of a clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number of seconds or \"estimate\"")]
pub enum OffsetEntry {
    /// A number of seconds.
    Stated(f64),
    /// Estimated from the data.
    Told(EstimateWord),
}

/// `"estimate"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EstimateWord {
    /// Estimate it from signals that must agree in time.
    Estimate,
}

/// One file or several.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a file name or a list of them")]
pub enum LogEntry {
    /// One file.
    One(PathBuf),
    /// Several files that were logged simultaneously.
    Several(Vec<PathBuf>),
}

impl LogEntry {
    /// Returns all files.
    pub fn files(&self) -> &[PathBuf] {
        match self {
            Self::One(file) => std::slice::from_ref(file),
            Self::Several(files) => files,
        }
    }
}

/// The column of a quantity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table such as { column = \"depth [m]\" }")]
pub struct ChannelEntry {
    /// Its header, with or without the unit; `FILE:COLUMN` where several files have it.
    pub column: String,
    /// Its unit, if the header does not state it or is wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// The value of one raw count, in `unit`; 1 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// The value added to counts times `scale`, in `unit`; 0 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// True to reverse its sign: for a height in place of a depth, a heading to port.
    #[serde(default, skip_serializing_if = "is_default")]
    pub negate: bool,
    /// True if a trial can do without it.
    #[serde(default, skip_serializing_if = "is_default")]
    pub optional: bool,
    /// The input of a thruster between its samples: each held until the next, or interpolated
    /// linearly.
    #[serde(default, skip_serializing_if = "is_default")]
    pub between: Between,
}

/// A signal between its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Between {
    /// Each sample is held until the next: commands, and logs of every change.
    #[default]
    Held,
    /// Linear interpolation: a smooth signal that was logged slowly.
    Linear,
}

/// The terms to fit: force, quadratic, linear, bias.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[expect(missing_docs, reason = "each is a degree of freedom by name")]
pub struct FitEntry {
    /// The terms in every degree of freedom that is not named below.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terms: Option<Vec<Term>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surge: Option<DofEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sway: Option<DofEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heave: Option<DofEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll: Option<DofEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pitch: Option<DofEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yaw: Option<DofEntry>,
}

/// The terms to fit in one degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DofEntry {
    /// force, quadratic, linear, bias.
    pub terms: Vec<Term>,
}

impl FitEntry {
    fn is_default(&self) -> bool {
        is_default(self)
    }

    /// Returns each degree of freedom with its own choice, if it has one.
    pub fn by_dof(&self) -> [(Dof, Option<&DofEntry>); 6] {
        [
            (Dof::Surge, self.surge.as_ref()),
            (Dof::Sway, self.sway.as_ref()),
            (Dof::Heave, self.heave.as_ref()),
            (Dof::Roll, self.roll.as_ref()),
            (Dof::Pitch, self.pitch.as_ref()),
            (Dof::Yaw, self.yaw.as_ref()),
        ]
    }
}

/// The criteria of steadiness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SteadyEntry {
    /// Length of the window that must be steady, s.
    pub window_s: f64,
    /// The greatest drift of velocity in it, m/s² or rad/s².
    pub slope_m_s2: f64,
    /// The greatest standard deviation of thrust in it, as a fraction of the trial's maximum.
    pub thrust_part: f64,
}

impl SteadyEntry {
    pub(crate) fn options(&self) -> SteadyOptions {
        let Self { window_s, slope_m_s2, thrust_part } = *self;
        SteadyOptions { window_s, slope: slope_m_s2, thrust_part }
    }
}

impl Default for SteadyEntry {
    fn default() -> Self {
        let SteadyOptions { window_s, slope, thrust_part } = SteadyOptions::default();
        Self { window_s, slope_m_s2: slope, thrust_part }
    }
}

/// A bollard-pull table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BollardPullEntry {
    /// The table.
    pub file: PathBuf,
    /// Its columns; recognised by their units and names if left out.
    #[serde(default, skip_serializing_if = "BenchColumns::is_default")]
    pub columns: BenchColumns,
    /// The input at zero thrust: 0 by default, 1500 for pulse widths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub neutral: Option<f64>,
}
