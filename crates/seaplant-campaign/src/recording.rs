//! One trial's logs, brought to quantities in SI units, and made a trial.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use seaplant::results::InputFile;
use seaplant::{Caveat, CaveatCode, Quantity, Recording, Timed, Trial, TrialSetup, Vehicle};
use seaplant_log::{Channel, Log, ReadOptions, Stamp, TimeColumn, Unit};

use crate::Error;
use crate::campaign_file::{Between, CampaignFile, ChannelEntry, TrialEntry};
use crate::units::dimension_of;

/// Which column holds which quantity.
pub(crate) type ChannelMap = BTreeMap<Quantity, ChannelEntry>;

/// A trial, and the files that it was read from.
#[derive(Clone, Debug)]
pub struct SourcedTrial {
    /// The trial.
    pub trial: Trial,
    /// Its files.
    pub inputs: Vec<InputFile>,
    /// Where the trial's clock starts in that of its logs, s.
    pub start_s: f64,
}

/// Reads the logs of a trial; `logs` are where the entry's logs are.
pub(crate) fn read_trial(
    path: &Path,
    logs: &[PathBuf],
    file: &CampaignFile,
    entry: &TrialEntry,
    channels: &ChannelMap,
    vehicle: &Vehicle,
) -> Result<SourcedTrial, Error> {
    let files = read_options(path, logs, file, entry)?;
    let log = Log::open(&files)
        .map_err(|source| Error::Log { trial: entry.name.clone(), source: Box::new(source) })?;
    trial_of(path, log, entry, channels, vehicle)
}

/// Makes a trial of a log: its mapped columns brought to SI units, on a clock that starts
/// with the first sample of all of them.
pub(crate) fn trial_of(
    path: &Path,
    log: Log,
    entry: &TrialEntry,
    channels: &ChannelMap,
    vehicle: &Vehicle,
) -> Result<SourcedTrial, Error> {
    let mut caveats: Vec<Caveat> = log
        .notes()
        .iter()
        .map(|note| Caveat::note(CaveatCode::Log, format!("trial `{}`: {note}", entry.name)))
        .collect();
    let start_s = log
        .channels()
        .iter()
        .filter_map(|channel| channel.time_s().first().copied())
        .fold(f64::INFINITY, f64::min);
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
    let recording = recording(log, entry, channels, start_s, &mut caveats)?;
    let setup = TrialSetup {
        name: entry.name.clone(),
        role: entry.role,
        dofs: entry.dof.clone(),
        from_s: entry.from_s,
        to_s: entry.to_s,
        segments_s: entry.segments_s.clone(),
    };
    let trial = Trial::using_up(setup, recording, vehicle).map_err(Error::model(path))?;
    Ok(SourcedTrial { trial: trial.with_caveats(caveats), inputs, start_s })
}

/// The mapped columns of a log in SI units; what is not mapped is freed first, and each
/// column as soon as it is converted.
fn recording(
    log: Log,
    entry: &TrialEntry,
    channels: &ChannelMap,
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

    let mut clock = Clock { start_s, moved: Vec::new() };
    let mut recording = Recording::new();
    for (k, &(place, quantity, wanted)) in mapped.iter().enumerate() {
        let is_last = mapped[k + 1..].iter().all(|(other, _, _)| *other != place);
        let channel = if is_last { left[place].take() } else { left[place].clone() };
        let channel = channel.expect("only its last use takes a channel away");
        let series = to_si(entry, quantity, wanted, channel, &mut clock, caveats)?;
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
    /// Times on this clock, shared where they were.
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

fn read_options(
    path: &Path,
    logs: &[PathBuf],
    campaign: &CampaignFile,
    entry: &TrialEntry,
) -> Result<Vec<(PathBuf, ReadOptions)>, Error> {
    let files = entry.log.files();
    let time = campaign.time.as_ref();
    if let Some(stray) =
        entry.offset_s.keys().find(|name| !files.iter().any(|file| file == Path::new(name)))
    {
        let reason = "is not among the trial's log = [...]; write the file as it stands there";
        let key = format!("trial `{}`, offset_s.\"{stray}\"", entry.name);
        return Err(Error::value(path, key, reason));
    }
    let options = |file: &PathBuf| {
        let offset_s = entry.offset_s.iter().find(|(name, _)| file == Path::new(name));
        ReadOptions {
            time: time.and_then(|time| {
                let column = time.column.clone()?;
                Some(TimeColumn { column, unit: time.unit.clone() })
            }),
            offset_s: offset_s.map_or(0.0, |(_, offset_s)| *offset_s),
            equal_sampling_hz: time.and_then(|time| time.equal_sampling_hz),
            sheet: entry.sheet.as_ref().or(campaign.sheet.as_ref()).cloned(),
            stamp: time.and_then(|time| time.stamp).map_or_else(Stamp::default, Stamp::from),
        }
    };
    Ok(logs.iter().cloned().zip(files.iter().map(options)).collect())
}

fn to_si(
    entry: &TrialEntry,
    quantity: &Quantity,
    mapped: &ChannelEntry,
    channel: Channel,
    clock: &mut Clock,
    caveats: &mut Vec<Caveat>,
) -> Result<Timed, Error> {
    let unit = unit_of(entry, quantity, mapped, &channel, caveats)?;
    let sign = if mapped.negate { -1.0 } else { 1.0 };
    let (time_s, mut values) = channel.into_samples();
    values.iter_mut().for_each(|x| *x = sign * unit.to_si(*x));
    let series = Timed::new(&quantity.to_string(), clock.times(time_s), values)
        .map_err(Error::model(Path::new(&mapped.column)))?;
    Ok(match mapped.between {
        Between::Held => series,
        Between::Linear => series.interpolated(LONGEST_HELD_S),
    })
}

/// A straight line between samples is held over steps no longer than this, s: short beside
/// the seconds in which a vehicle gathers speed.
const LONGEST_HELD_S: f64 = 0.05;

/// The campaign's unit, else the header's; a header that says otherwise is noted.
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
