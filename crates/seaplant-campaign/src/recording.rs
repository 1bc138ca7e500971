//! Converts a trial's logs to quantities in SI units, and to a trial.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use seaplant::results::{FileOffset, InputFile};
use seaplant::{
    Caveat, CaveatCode, ClockOffset, Dof, Quantity, Recording, Timed, Trial, TrialSetup, Vehicle,
};
use seaplant_log::{Channel, Log, ReadOptions, Stamp, TimeColumn, Unit};

use crate::Error;
use crate::campaign_file::{
    Between, CampaignFile, ChannelEntry, ChannelMap, OffsetEntry, TrialEntry,
};
use crate::clocks::{self, Alignment};
use crate::doubts::{check_time_units, doubts};
use crate::known::known_forces;
use crate::missing_code::{stop_without_pulse, without_codes};
use crate::units::dimension_of;

/// A trial, and the files that it was read from.
#[derive(Clone, Debug)]
pub struct SourcedTrial {
    /// The trial.
    pub trial: Trial,
    /// Its files.
    pub inputs: Vec<InputFile>,
    /// Clock offsets estimated from the data.
    pub offsets: Vec<FileOffset>,
    /// Time in the logs' clock at which the trial's clock starts, s.
    pub start_s: f64,
}

/// Reads the logs of a trial; `logs` are their paths.
pub(crate) fn read_trial(
    path: &Path,
    logs: &[PathBuf],
    file: &CampaignFile,
    entry: &TrialEntry,
    channels: &ChannelMap,
    vehicle: &Vehicle,
    plant_axes: &[Vec<Dof>],
) -> Result<SourcedTrial, Error> {
    let files = read_options(path, logs, file, entry)?;
    let log = Log::open(&files)
        .map_err(|source| Error::Log { trial: entry.name.clone(), source: Box::new(source) })?;
    trial_of(path, log, entry, channels, vehicle, plant_axes)
}

/// Makes a trial of a log: its mapped columns in SI units, on a clock that starts with the first
/// sample of all of them.
pub(crate) fn trial_of(
    path: &Path,
    mut log: Log,
    entry: &TrialEntry,
    channels: &ChannelMap,
    vehicle: &Vehicle,
    plant_axes: &[Vec<Dof>],
) -> Result<SourcedTrial, Error> {
    check_time_units(path, entry, &log)?;
    let mut caveats = doubts(entry, &log, channels);
    let offsets = align(&mut log, path, entry, channels, vehicle)?;
    caveats.extend(offsets.iter().map(|offset| told(entry, offset)));
    let start_s = log
        .channels()
        .iter()
        .filter_map(|channel| channel.time_s().first().copied())
        .fold(f64::INFINITY, f64::min);
    let lasts = log.channels().iter().filter_map(|channel| channel.time_s().last().copied());
    let last_s = lasts.fold(f64::NEG_INFINITY, f64::max) - start_s;
    let mut inputs = Vec::new();
    for source in log.sources() {
        let (path, sha256) = (source.path.display().to_string(), source.sha256.clone());
        inputs.push(InputFile { path, bytes: source.bytes, sha256 });
    }
    let misplaced = |(quantity, mapped): &(&Quantity, &ChannelEntry)| {
        mapped.between == Between::Linear && !quantity.is_of_thrust()
    };
    if let Some((quantity, _)) = channels.iter().find(misplaced) {
        let key = format!("channels.\"{quantity}\".between");
        let reason = "is for thrusters and wrenches; leave it out for what is measured";
        return Err(Error::value(path, key, reason));
    }
    let recording = recording(log, entry, channels, vehicle, start_s, &mut caveats)?;
    check_gaps(path, entry, &recording)?;
    let setup = TrialSetup {
        name: entry.name.clone(),
        role: entry.role,
        dofs: entry.dof.clone(),
        from_s: entry.from_s,
        to_s: entry.to_s,
        segments_s: entry.segments_s.clone(),
        together: plant_axes.to_vec(),
        known: known_forces(path, entry, vehicle, last_s)?,
    };
    let trial = Trial::using_up(setup, recording, vehicle).map_err(Error::model(path))?;
    Ok(SourcedTrial { trial: trial.with_caveats(caveats), inputs, offsets, start_s })
}

/// Longest gap, s: the filter error method predicts through a gap, and after a day without a
/// measurement no information is left.
const LONGEST_GAP_S: f64 = 86_400.0;

/// Rejects a trial that holds two dives.
fn check_gaps(path: &Path, entry: &TrialEntry, recording: &Recording) -> Result<(), Error> {
    let [from, to] =
        [entry.from_s.unwrap_or(f64::NEG_INFINITY), entry.to_s.unwrap_or(f64::INFINITY)];
    for (quantity, series) in recording.iter().filter(|(quantity, _)| !quantity.is_of_thrust()) {
        let times = series.time_s();
        let is_long = |pair: &&[f64]| pair[1].min(to) - pair[0].max(from) > LONGEST_GAP_S;
        if let Some([before, after]) = times.windows(2).find(is_long) {
            let reason = format!(
                "{quantity} has no sample from {before:.1} to {after:.1} s, which is more than a \
                 day; make a trial of each part by from_s and to_s"
            );
            return Err(Error::value(path, format!("trial `{}`", entry.name), reason));
        }
    }
    Ok(())
}

/// Estimates the offsets that the campaign requests, and shifts these clocks.
fn align(
    log: &mut Log,
    path: &Path,
    entry: &TrialEntry,
    channels: &ChannelMap,
    vehicle: &Vehicle,
) -> Result<Vec<FileOffset>, Error> {
    let files = entry.log.files();
    let name = |file: usize| files[file].display().to_string();
    let key = |name: &str| format!("trial `{}`, offset_s.\"{name}\"", entry.name);
    let is_asked = |file: usize| {
        let offset = entry.offset_s.iter().find(|(name, _)| is_named(entry, &files[file], name));
        matches!(offset, Some((_, OffsetEntry::Told(_))))
    };
    let asked: Vec<usize> = (0..files.len()).filter(|&file| is_asked(file)).collect();
    let Some(&first) = asked.first() else { return Ok(Vec::new()) };
    if asked.len() == files.len() {
        let reason = "every file of the trial has an offset; leave out that of the reference clock";
        return Err(Error::value(path, key(&name(first)), reason));
    }
    let is_aligned = (0..files.len()).map(|file| !asked.contains(&file)).collect();
    let recordings = recordings_of_files(log, entry, channels, vehicle)?;
    let mut alignment = Alignment { vehicle, recordings, is_aligned };
    let found = alignment
        .estimate_all(&asked)
        .map_err(|(file, error)| Error::value(path, key(&name(file)), error.to_string()))?;
    for (file, offset) in &found {
        log.shift(*file, offset.offset_s);
    }
    let named = |(file, clock): (usize, ClockOffset)| FileOffset { file: name(file), clock };
    Ok(found.into_iter().map(named).collect())
}

/// Returns the signals of each file: the columns that the campaign maps, and those recognised by
/// name.
fn recordings_of_files(
    log: &Log,
    entry: &TrialEntry,
    channels: &ChannelMap,
    vehicle: &Vehicle,
) -> Result<Vec<Recording>, Error> {
    let mut recordings = clocks::recordings(log);
    let clock = Clock { start_s: 0.0, moved: Vec::new() };
    let mut conversion = Conversion { entry, vehicle, clock, caveats: &mut Vec::new() };
    for (quantity, mapped) in channels {
        // An error is reported where the trial's own recording is made.
        let Ok(channel) = log.channel(&mapped.column) else { continue };
        let series = conversion.convert(quantity, mapped, channel.clone())?;
        recordings[channel.source].insert(quantity.clone(), series);
    }
    Ok(recordings)
}

/// Returns the caveat on an estimated offset.
fn told(entry: &TrialEntry, FileOffset { file, clock }: &FileOffset) -> Caveat {
    /// Larger offsets of clocks change mass and drag significantly, s.
    const CLOSE_S: f64 = 0.1;
    let message = format!(
        "trial `{}`: the clock of {file} is shifted by {}; state the offset if you know it",
        entry.name,
        clocks::in_words(clock)
    );
    if clock.std_s > CLOSE_S {
        Caveat::warning(CaveatCode::ClockOffset, message)
    } else {
        Caveat::note(CaveatCode::ClockOffset, message)
    }
}

/// Converts the mapped columns of a log to SI units; unmapped ones are freed first, and each column
/// as soon as it is converted.
fn recording(
    log: Log,
    entry: &TrialEntry,
    channels: &ChannelMap,
    vehicle: &Vehicle,
    start_s: f64,
    caveats: &mut Vec<Caveat>,
) -> Result<Recording, Error> {
    let mut mapped = Vec::new();
    for (quantity, wanted) in channels {
        match log.place(&wanted.column) {
            Ok(place) => mapped.push((place, quantity, wanted)),
            Err(_) if wanted.optional => {}
            Err(source) => {
                return Err(Error::Channel {
                    trial: entry.name.clone(),
                    quantity: quantity.to_string(),
                    source: Box::new(source),
                });
            }
        }
    }
    let mut left: Vec<Option<Channel>> = log.into_channels().into_iter().map(Some).collect();
    let is_mapped = |place: usize| mapped.iter().any(|(mapped, _, _)| *mapped == place);
    let unmapped = left.iter_mut().enumerate().filter(|(place, _)| !is_mapped(*place));
    unmapped.for_each(|(_, channel)| *channel = None);

    let clock = Clock { start_s, moved: Vec::new() };
    let mut conversion = Conversion { entry, vehicle, clock, caveats };
    let mut recording = Recording::new();
    for (k, &(place, quantity, wanted)) in mapped.iter().enumerate() {
        let is_last = mapped[k + 1..].iter().all(|(other, _, _)| *other != place);
        let channel = if is_last { left[place].take() } else { left[place].clone() };
        let channel = channel.expect("only its last use takes a channel away");
        let series = conversion.convert(quantity, wanted, channel)?;
        recording.insert(quantity.clone(), series);
    }
    Ok(recording)
}

/// The trial's clock, which starts with its first sample.
struct Clock {
    start_s: f64,
    /// Times in the log's clock, and the same in this one.
    moved: Vec<[Arc<[f64]>; 2]>,
}

impl Clock {
    /// Returns times on this clock, shared where they were shared.
    fn times(&mut self, time_s: Arc<[f64]>) -> Arc<[f64]> {
        if self.start_s == 0.0 {
            return time_s;
        }
        if let Some([_, moved]) = self.moved.iter().find(|[known, _]| Arc::ptr_eq(known, &time_s)) {
            return Arc::clone(moved);
        }
        let moved: Arc<[f64]> = time_s.iter().map(|t| t - self.start_s).collect();
        self.moved.push([time_s, Arc::clone(&moved)]);
        moved
    }
}

/// Returns whether a file is given by its path or the end of it: `dvl.csv` for `surge-1/dvl.csv`.
fn is_named(entry: &TrialEntry, file: &Path, name: &str) -> bool {
    let is_whole = entry.log.files().iter().any(|file| file == Path::new(name));
    if is_whole { file == Path::new(name) } else { file.ends_with(name) }
}

fn read_options(
    path: &Path,
    logs: &[PathBuf],
    campaign: &CampaignFile,
    entry: &TrialEntry,
) -> Result<Vec<(PathBuf, ReadOptions)>, Error> {
    let files = entry.log.files();
    let time = campaign.time.as_ref();
    for name in entry.offset_s.keys() {
        let reason = match files.iter().filter(|file| is_named(entry, file, name)).count() {
            0 => "is not among the trial's log = [...]; write the file as it is written there",
            1 => continue,
            _ => {
                "is the end of several paths in log = [...]; write the file as it is written there"
            }
        };
        let key = format!("trial `{}`, offset_s.\"{name}\"", entry.name);
        return Err(Error::value(path, key, reason));
    }
    let options = |file: &PathBuf| {
        let offset_s = entry.offset_s.iter().find(|(name, _)| is_named(entry, file, name));
        let own = time.map(|time| time.of_file(|name| is_named(entry, file, name)));
        let own = own.unwrap_or_default();
        let has_column = own.column.is_some() || own.unit.is_some();
        ReadOptions {
            time: has_column.then_some(TimeColumn { column: own.column, unit: own.unit }),
            offset_s: match offset_s {
                Some((_, OffsetEntry::Stated(offset_s))) => *offset_s,
                Some((_, OffsetEntry::Told(_))) | None => 0.0,
            },
            equal_sampling_hz: own.equal_sampling_hz,
            sheet: entry.sheet.as_ref().or(campaign.sheet.as_ref()).cloned(),
            stamp: time.and_then(|time| time.stamp).map_or_else(Stamp::default, Stamp::from),
        }
    };
    Ok(logs.iter().cloned().zip(files.iter().map(options)).collect())
}

/// Upper limit of plausible values in SI units; larger numbers would overflow when raised to the
/// fourth power.
const LARGEST: f64 = 1e12;

/// Context of converting columns, and the resulting caveats.
struct Conversion<'a> {
    entry: &'a TrialEntry,
    vehicle: &'a Vehicle,
    clock: Clock,
    caveats: &'a mut Vec<Caveat>,
}

impl Conversion<'_> {
    /// Converts a column to SI units, on the trial's clock.
    fn convert(
        &mut self,
        quantity: &Quantity,
        mapped: &ChannelEntry,
        channel: Channel,
    ) -> Result<Timed, Error> {
        let trial = &self.entry.name;
        let unit = unit_of(self.entry, quantity, mapped, &channel, self.caveats)?;
        let sign = if mapped.negate { -1.0 } else { 1.0 };
        let (scale, offset) = (mapped.scale.unwrap_or(1.0), mapped.offset.unwrap_or(0.0));
        let (time_s, mut values) = without_codes(trial, quantity, channel, self.caveats);
        values.iter_mut().for_each(|x| *x = sign * unit.to_si(scale * *x + offset));
        self.caveats.extend(stop_without_pulse(trial, quantity, self.vehicle, &mut values));
        // Outliers of measured velocity are removed later, with a caveat.
        let is_cleaned = matches!(quantity, Quantity::DvlVelocity(_) | Quantity::Velocity(_));
        if let Some(row) = values.iter().position(|x| x.abs() > LARGEST).filter(|_| !is_cleaned) {
            return Err(Error::Implausible {
                trial: trial.clone(),
                quantity: quantity.to_string(),
                column: mapped.column.clone(),
                found: format!("{:e} {}", values[row], quantity.kind().unit()),
                time_s: time_s[row],
            });
        }
        let series = Timed::new(&quantity.to_string(), self.clock.times(time_s), values)
            .map_err(Error::model(Path::new(&mapped.column)))?;
        Ok(match mapped.between {
            Between::Held => series,
            Between::Linear => series.interpolated(LONGEST_HELD_S),
        })
    }
}

/// Longest step over which a linearly interpolated input is held, s: short compared with the
/// seconds in which a vehicle gathers speed.
const LONGEST_HELD_S: f64 = 0.05;

/// Returns the campaign's unit, else the header's; a different header is noted.
fn unit_of(
    entry: &TrialEntry,
    quantity: &Quantity,
    mapped: &ChannelEntry,
    channel: &Channel,
    caveats: &mut Vec<Caveat>,
) -> Result<Unit, Error> {
    let wanted = dimension_of(quantity.kind());
    let refuse = |source| Error::Channel {
        trial: entry.name.clone(),
        quantity: format!("{quantity}, column `{}`", channel.column),
        source: Box::new(source),
    };
    match (&mapped.unit, &channel.unit) {
        (Some(stated), header) => {
            let unit = Unit::parse_as(stated, wanted).map_err(refuse)?;
            if let Some(header) = header
                && header.resolve(wanted).map_or(true, |header| header.factor() != unit.factor())
            {
                let message = format!(
                    "trial `{}`: the header of `{}` says {}, the campaign {stated}; the campaign's is used",
                    entry.name,
                    channel.column,
                    header.symbol()
                );
                caveats.push(Caveat::warning(CaveatCode::SuspiciousUnit, message));
            }
            Ok(unit)
        }
        (None, Some(header)) => header.resolve(wanted).map_err(refuse),
        (None, None) => Err(Error::NoUnit {
            trial: entry.name.clone(),
            quantity: quantity.to_string(),
            column: channel.column.clone(),
            example: quantity.kind().unit().to_owned(),
        }),
    }
}
