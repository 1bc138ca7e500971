//! Campaigns: trials read from logs, and identified.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use seaplant::results::{BollardPullResult, FileOffset, Identification, InputFile, Parameter};
use seaplant::{
    BollardFit, Caveat, CaveatCode, Dof, IdentifyOptions, Quantity, Role, Stage, Surface, Term,
    Terms, ThrusterInput, Trial, Vehicle, VelocitySource, fit_bollard_pull, identify_watched,
    stages,
};
use seaplant_log::Log;

use crate::bench::{Bench, read_bench};
use crate::campaign_file::{
    BollardPullEntry, CampaignFile, ChannelEntry, ChannelMap, LogEntry, TrialEntry,
};
use crate::known::check_known;
use crate::missing_code::STOPPED_US;
use crate::plant_file::{axes_of_plans, check_plans, plans};
use crate::recording::{SourcedTrial, read_trial, trial_of};
use crate::vehicle_file::{SourcedVehicle, read_vehicle};
use crate::{Error, toml_file};

/// A campaign, read and checked.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// The campaign file.
    pub path: PathBuf,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// The trials, in the file's order.
    pub trials: Vec<Trial>,
    /// Structure to identify, and methods.
    pub options: IdentifyOptions,
    /// Thrust curves fitted to bollard-pull data, if there are any.
    pub bollard_pull: Option<BollardPullResult>,
    /// Reason to doubt the vehicle.
    doubt: Option<Caveat>,
    /// That logs of trials say too little to be used.
    left_out: Vec<Caveat>,
    inputs: Vec<InputFile>,
    /// Origin of each trial, by its name.
    origins: BTreeMap<String, Origin>,
}

/// Origin of a trial.
#[derive(Clone, Debug)]
struct Origin {
    files: Vec<String>,
    offsets: Vec<FileOffset>,
    start_s: f64,
}

impl Campaign {
    /// Reads a campaign file, its vehicle and the logs of its trials.
    ///
    /// Paths in a file are relative to it.
    ///
    /// # Errors
    /// Every [`Error`]: each names the file, trial or channel, what was found, what was
    /// expected and what to do.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (file, input): (CampaignFile, _) = toml_file::read(path)?;
        let file = file.with_patterns(path)?;
        let vehicle = SourcedVehicle::open(&toml_file::resolve(path, &file.vehicle)?)?;
        let file = with_axes_alone(path, file, &vehicle.vehicle)?;
        let options = file.options(path)?;
        check_plans(path, &options.together, &vehicle.vehicle)?;
        file.check_time(path)?;
        check_trials(path, &file.trial, !file.plant.is_empty())?;
        let mut campaign = Self::without_trials(path, vehicle, options);
        campaign.inputs.insert(0, input);
        let mut refused = Vec::new();
        for entry in &file.trial {
            match campaign.read(&file, entry) {
                Ok(trial) => campaign.add(trial),
                Err(error) if error.is_of_log() => refused.push((entry, error)),
                Err(error) => return Err(error),
            }
        }
        for (entry, error) in refused {
            campaign.leave_out(entry, error)?;
        }
        if let Some(entry) = &file.bollard_pull {
            campaign.bollard_pull = Some(campaign.bollard(path, entry)?);
        }
        Ok(campaign)
    }

    /// Makes a campaign of a vehicle and trials in memory; messages call it `path`.
    ///
    /// # Errors
    /// [`Error::Value`] without trials, for two of one name, or for a plant of several axes that the
    /// vehicle cannot have.
    pub fn new(
        path: &Path,
        vehicle: SourcedVehicle,
        trials: Vec<SourcedTrial>,
        options: IdentifyOptions,
    ) -> Result<Self, Error> {
        check_names(path, trials.iter().map(|sourced| sourced.trial.name()))?;
        check_plans(path, &options.together, &vehicle.vehicle)?;
        let mut campaign = Self::without_trials(path, vehicle, options);
        trials.into_iter().for_each(|trial| campaign.add(trial));
        Ok(campaign)
    }

    fn without_trials(path: &Path, vehicle: SourcedVehicle, options: IdentifyOptions) -> Self {
        let SourcedVehicle { vehicle, inputs, doubt } = vehicle;
        Self {
            path: path.to_owned(),
            vehicle,
            trials: Vec::new(),
            options,
            bollard_pull: None,
            doubt,
            left_out: Vec::new(),
            inputs,
            origins: BTreeMap::new(),
        }
    }

    /// Identifies the plant, with the provenance and caveats that the results need.
    ///
    /// `command` is the command that reproduces it.
    pub fn identify(&self, command: &str) -> Identification {
        self.identify_watched(command, &mut |_| {})
    }

    /// Returns the fits that [`Self::identify`] makes, in order, with their estimated cost.
    pub fn stages(&self) -> Vec<Stage> {
        stages(&self.vehicle, &self.trials, &self.options)
    }

    /// Does the same as [`Self::identify`], calling back before each of its [`Self::stages`].
    pub fn identify_watched(
        &self,
        command: &str,
        watch: &mut (dyn FnMut(&Stage) + Send),
    ) -> Identification {
        let mut found = identify_watched(&self.vehicle, &self.trials, &self.options, watch);
        let results = &mut found.results;
        results.provenance.command = command.to_owned();
        results.provenance.inputs.clone_from(&self.inputs);
        results.bollard_pull.clone_from(&self.bollard_pull);
        results.caveats.extend(self.doubt.clone());
        results.caveats.extend(self.left_out.iter().cloned());
        for trial in &mut results.trials {
            if let Some(origin) = self.origins.get(&trial.name) {
                trial.files.clone_from(&origin.files);
                trial.offsets.clone_from(&origin.offsets);
            }
        }
        found
    }

    /// Returns the trials, each with the files that it was read from; samples are shared, not
    /// copied.
    pub fn sourced_trials(&self) -> Vec<SourcedTrial> {
        let of = |trial: &Trial| {
            let origin = self.origins.get(trial.name());
            let files = origin.map_or(&[][..], |origin| &origin.files);
            let inputs = self.inputs.iter().filter(|input| files.contains(&input.path));
            SourcedTrial {
                trial: trial.clone(),
                inputs: inputs.cloned().collect(),
                offsets: origin.map(|origin| origin.offsets.clone()).unwrap_or_default(),
                start_s: origin.map_or(0.0, |origin| origin.start_s),
            }
        };
        self.trials.iter().map(of).collect()
    }

    fn read(&self, file: &CampaignFile, entry: &TrialEntry) -> Result<SourcedTrial, Error> {
        let channels = all_channels(file, entry);
        let channels = channel_map(&self.path, channels, &self.vehicle)?;
        let logs = entry.log.files().iter();
        let logs = logs.map(|log| toml_file::resolve(&self.path, log));
        let logs = logs.collect::<Result<Vec<_>, Error>>()?;
        let plant_axes = axes_of_plans(&self.options.together);
        read_trial(&self.path, &logs, file, entry, &channels, &self.vehicle, &plant_axes)
    }

    /// Goes on without a trial that cannot be used, if others are left to fit all of its axes.
    fn leave_out(&mut self, entry: &TrialEntry, error: Error) -> Result<(), Error> {
        let is_left = |dof: &Dof| {
            let mut others = self.trials.iter().filter(|trial| trial.role() == Role::Fit);
            others.any(|trial| trial.axis(*dof, VelocitySource::Measured).is_ok())
        };
        match error {
            Error::Model { source, .. } if entry.dof.iter().all(is_left) => {
                let message = format!("trial `{}` is left out: {source}", entry.name);
                self.left_out.push(Caveat::warning(CaveatCode::TrialLeftOut, message));
                Ok(())
            }
            error => Err(error),
        }
    }

    fn add(&mut self, SourcedTrial { trial, inputs, offsets, start_s }: SourcedTrial) {
        let files = inputs.iter().map(|input| input.path.clone()).collect();
        self.origins.insert(trial.name().to_owned(), Origin { files, offsets, start_s });
        for input in inputs {
            if !self.inputs.contains(&input) {
                self.inputs.push(input);
            }
        }
        self.trials.push(trial);
    }

    fn bollard(
        &mut self,
        path: &Path,
        entry: &BollardPullEntry,
    ) -> Result<BollardPullResult, Error> {
        let bench = read_bench(&toml_file::resolve(path, &entry.file)?, &entry.columns, None)?;
        let fit = fit_bench(&bench, entry.neutral)
            .map_err(|error| Error::value(path, "bollard-pull", error.to_string()))?;
        self.inputs.push(bench.source.clone());
        Ok(bollard_result(&bench, &fit))
    }
}

/// Lists the files of a campaign, whether or not they exist: itself, its vehicle with its tables,
/// its logs; as far as they can be determined.
pub fn campaign_files(campaign: &Path) -> Vec<PathBuf> {
    let mut files = vec![campaign.to_owned()];
    let Ok((file, _)) = toml_file::read::<CampaignFile>(campaign) else { return files };
    let Ok(file) = file.with_patterns(campaign) else { return files };
    let resolved = |named: &Path| toml_file::resolve(campaign, named).ok();
    let logs = file.trial.iter().flat_map(|trial| trial.log.files());
    let bench = file.bollard_pull.iter().map(|entry| &entry.file);
    files.extend(logs.chain(bench).filter_map(|named| resolved(named)));
    if let Some(vehicle) = resolved(&file.vehicle) {
        let tables = SourcedVehicle::open(&vehicle).map(|vehicle| vehicle.inputs);
        files.extend(tables.unwrap_or_default().into_iter().map(|input| input.path.into()));
        files.push(vehicle);
    }
    files
}

/// Reads logs as one trial for a plant of some axes, by the vehicle, time column and channels of a
/// campaign.
///
/// The logs' paths are as given, not relative to the campaign.
///
/// # Errors
/// As [`Campaign::open`].
pub fn read_logs(campaign: &Path, logs: &[PathBuf], axes: &[Dof]) -> Result<Trial, Error> {
    let (file, _): (CampaignFile, _) = toml_file::read(campaign)?;
    file.check_time(campaign)?;
    let (vehicle, _) = read_vehicle(&toml_file::resolve(campaign, &file.vehicle)?)?;
    let names: Vec<String> = logs.iter().map(|log| log.display().to_string()).collect();
    let (dof, plant_axes) = match axes {
        [dof] => (vec![*dof], Vec::new()),
        several => (Vec::new(), vec![several.to_vec()]),
    };
    let entry = TrialEntry {
        name: names.join(", "),
        log: LogEntry::Several(logs.to_vec()),
        dof,
        role: Role::HoldOut,
        from_s: None,
        to_s: None,
        segments_s: Vec::new(),
        offset_s: BTreeMap::new(),
        sheet: None,
        channels: BTreeMap::new(),
        known: Vec::new(),
    };
    let channels = channel_map(campaign, all_channels(&file, &entry), &vehicle)?;
    Ok(read_trial(campaign, logs, &file, &entry, &channels, &vehicle, &plant_axes)?.trial)
}

/// Makes a trial of a log in memory; the entry's files are not read.
///
/// `plant_axes` are the axes of each plant of several axes that it may serve; messages call the
/// absent campaign file `path`.
///
/// # Errors
/// As [`Campaign::open`].
pub fn trial_of_log(
    path: &Path,
    log: Log,
    entry: &TrialEntry,
    vehicle: &Vehicle,
    plant_axes: &[Vec<Dof>],
) -> Result<SourcedTrial, Error> {
    check_trial(path, entry, !plant_axes.is_empty())?;
    let channels = channel_map(path, entry.channels.iter(), vehicle)?;
    trial_of(path, log, entry, &channels, vehicle, plant_axes)
}

/// Fits a thrust curve to a bollard-pull table; `neutral` defaults to 1500 us for pulse widths and
/// 0 otherwise.
///
/// # Errors
/// As [`fit_bollard_pull`].
pub fn fit_bench(bench: &Bench, neutral: Option<f64>) -> Result<BollardFit, seaplant::Error> {
    let stop = if bench.input == ThrusterInput::Pwm { STOPPED_US } else { 0.0 };
    fit_bollard_pull(&bench.points, neutral.unwrap_or(stop))
}

/// Converts a fitted thrust curve to its form in results.
pub fn bollard_result(bench: &Bench, fit: &BollardFit) -> BollardPullResult {
    let unit = bench.input.unit();
    let squared = if unit == "1" { "N".to_owned() } else { format!("N/({unit})²") };
    BollardPullResult {
        file: bench.source.path.clone(),
        input_unit: unit.to_owned(),
        neutral: fit.law.neutral,
        forward: fit.forward.map(|k| Parameter::new(k, &squared)),
        reverse: fit.reverse.map(|k| Parameter::new(k, &squared)),
        deadband: fit.deadband.map(|d| Parameter::new(d, unit)),
        residual_rms: fit.residual_rms,
        r_squared: fit.r_squared,
        points: fit.points.clone(),
        caveats: fit.caveats.clone(),
    }
}

impl CampaignFile {
    /// Returns the options of identification; messages call the file `path`.
    ///
    /// # Errors
    /// [`Error::Value`] for terms that make no model, and for an empty list of methods.
    pub fn options(&self, path: &Path) -> Result<IdentifyOptions, Error> {
        let terms = |key: &str, terms: &[Term]| {
            Terms::new(terms).map_err(|error| Error::value(path, key, error.to_string()))
        };
        self.check_settings(path)?;
        let mut options = IdentifyOptions {
            velocity: self.velocity,
            paper: self.paper,
            equation_error: self.equation_error,
            output_error: self.output_error,
            filter_error: self.filter_error.clone(),
            online: self.online,
            together: plans(path, &self.plant)?,
            steady: self.steady.options(),
            ..Default::default()
        };
        if let Some(methods) = &self.methods {
            if methods.is_empty() {
                return Err(Error::value(path, "methods", "is empty; leave it out or name one"));
            }
            options.methods.clone_from(methods);
        }
        if let Some(chosen) = &self.fit.terms {
            options.terms = Some(terms("fit.terms", chosen)?);
        }
        for (dof, entry) in self.fit.by_dof() {
            if let Some(entry) = entry {
                options.terms_of.insert(dof, terms(&format!("fit.{dof}.terms"), &entry.terms)?);
            }
        }
        Ok(options)
    }

    /// Rejects settings that no fit can use before any fit is made.
    fn check_settings(&self, path: &Path) -> Result<(), Error> {
        let steady = self.steady.options().check().map_err(|error| match error {
            seaplant::Error::Setting { name, found, expected } if name == "slope" => {
                seaplant::Error::Setting { name: "slope_m_s2".to_owned(), found, expected }
            }
            other => other,
        });
        let checked = [
            ("paper", self.paper.check()),
            ("equation-error", self.equation_error.check()),
            ("output-error", self.output_error.check()),
            ("online", self.online.check()),
            ("steady", steady),
        ];
        for (table, checked) in checked {
            checked.map_err(|error| match error {
                seaplant::Error::Setting { name, found, expected } => {
                    let reason = format!("is {found}; it must be {expected}");
                    Error::value(path, format!("{table}.{name}"), reason)
                }
                other => Error::value(path, table, other.to_string()),
            })?;
        }
        Ok(())
    }

    /// Rejects a clock that is contradictory or cannot be read.
    fn check_time(&self, path: &Path) -> Result<(), Error> {
        let Some(time) = &self.time else { return Ok(()) };
        let of_all = time.of_file(|_| false);
        of_all.check().map_err(|(key, why)| Error::value(path, format!("time.{key}"), why))?;
        time.file.iter().try_for_each(|(name, entry)| {
            let key = |key| format!("time.file.\"{name}\".{key}");
            entry.check().map_err(|(wrong, why)| Error::value(path, key(wrong), why))
        })
    }
}

fn check_trials(path: &Path, trials: &[TrialEntry], has_plant: bool) -> Result<(), Error> {
    check_names(path, trials.iter().map(|trial| trial.name.as_str()))?;
    for trial in trials {
        if trial.log.files().is_empty() {
            let reason = "names no log; add log = \"...\"";
            return Err(Error::value(path, format!("trial `{}`", trial.name), reason));
        }
        check_trial(path, trial, has_plant)?;
    }
    Ok(())
}

/// Turns plants of one axis into `dof` of the trials that name no axis of their own, unless a trial has
/// known forces, which only a `[[plant]]` uses.
///
/// # Errors
/// As [`plans`]; [`Error::Value`] if a plant has no trial, since each names other axes.
fn with_axes_alone(
    path: &Path,
    mut file: CampaignFile,
    vehicle: &Vehicle,
) -> Result<CampaignFile, Error> {
    plans(path, &file.plant)?;
    if file.trial.iter().any(|trial| !trial.known.is_empty()) {
        return Ok(file);
    }
    let alone: Vec<Dof> = file.plant.iter().filter_map(|plant| plant.only_axis(vehicle)).collect();
    file.plant.retain(|plant| plant.only_axis(vehicle).is_none());
    for trial in file.trial.iter_mut().filter(|trial| trial.dof.is_empty()) {
        trial.dof.clone_from(&alone);
    }
    let serves = |dof: &Dof| file.trial.iter().any(|trial| trial.dof.contains(dof));
    match alone.iter().find(|dof| !serves(dof)) {
        Some(dof) => {
            let reason = format!(
                "axes = [\"{dof}\"] has no trial, as each names other axes; add {dof} to the dof of its trials"
            );
            Err(Error::value(path, "plant", reason))
        }
        None => Ok(file),
    }
}

fn check_names<'a>(path: &Path, names: impl Iterator<Item = &'a str>) -> Result<(), Error> {
    let mut known = BTreeSet::new();
    for name in names {
        if !known.insert(name) {
            let reason = "is given twice; give each trial its own name";
            return Err(Error::value(path, format!("trial `{name}`"), reason));
        }
        if name.chars().any(char::is_control) {
            let reason = "its name holds a line break or another control character; leave it out";
            return Err(Error::value(path, format!("trial `{name}`"), reason));
        }
    }
    if known.is_empty() {
        return Err(Error::value(path, "trial", "there is none; add a [[trial]] with a log"));
    }
    Ok(())
}

/// Checks a trial's entry; `has_plant` is true if trials also serve a `[[plant]]`, so that they
/// need no axis of their own.
fn check_trial(path: &Path, trial: &TrialEntry, has_plant: bool) -> Result<(), Error> {
    let refuse = |reason: &str| Err(Error::value(path, format!("trial `{}`", trial.name), reason));
    if trial.dof.is_empty() && !has_plant {
        return refuse(
            "names no degree of freedom; add dof = [\"surge\"], say, or the axes of a plant of several",
        );
    }
    check_window(path, trial)?;
    check_known(path, trial)?;
    let mut twice: Vec<Dof> = trial.dof.clone();
    twice.sort();
    twice.dedup();
    if twice.len() < trial.dof.len() {
        return refuse("names a degree of freedom twice");
    }
    Ok(())
}

fn check_window(path: &Path, trial: &TrialEntry) -> Result<(), Error> {
    let refuse = |key: &str, reason: String| {
        Err(Error::value(path, format!("trial `{}`{key}", trial.name), reason))
    };
    for (key, bound) in [(", from_s", trial.from_s), (", to_s", trial.to_s)] {
        if let Some(bound) = bound.filter(|bound| !bound.is_finite()) {
            return refuse(key, format!("is {bound}; it must be a number of seconds"));
        }
    }
    if trial.from_s.zip(trial.to_s).is_some_and(|(from, to)| from >= to) {
        return refuse("", "ends before it starts; from_s must be less than to_s".to_owned());
    }
    if !trial.segments_s.is_empty() && trial.role != Role::Steady {
        let reason = "are used only with role = \"steady\"; add that, or leave them out";
        return refuse(", segments_s", reason.to_owned());
    }
    let is_forward = |[from, to]: [f64; 2]| from.is_finite() && to.is_finite() && from < to;
    if let Some([from, to]) = trial.segments_s.iter().find(|segment| !is_forward(**segment)) {
        let reason = format!(
            "hold [{from}, {to}], whose end is not after its start; write [start, end] in seconds"
        );
        return refuse(", segments_s", reason);
    }
    let mut sorted = trial.segments_s.clone();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
    if let Some(pair) = sorted.windows(2).find(|pair| pair[1][0] < pair[0][1]) {
        let ([from, to], [next, end]) = (pair[0], pair[1]);
        let reason = format!(
            "[{from}, {to}] and [{next}, {end}] overlap, so that samples would count twice; \
             part or join them"
        );
        return refuse(", segments_s", reason);
    }
    Ok(())
}

/// Iterates over the campaign's channels, overridden by the trial's own.
fn all_channels<'a>(
    file: &'a CampaignFile,
    trial: &'a TrialEntry,
) -> impl Iterator<Item = (&'a String, &'a ChannelEntry)> {
    file.channels.iter().chain(&trial.channels)
}

/// Returns channels by quantity, the last of each, checked against the vehicle.
fn channel_map<'a>(
    path: &Path,
    channels: impl Iterator<Item = (&'a String, &'a ChannelEntry)>,
    vehicle: &Vehicle,
) -> Result<ChannelMap, Error> {
    let mut map = ChannelMap::new();
    for (name, entry) in channels {
        let quantity = name.parse().map_err(|error: seaplant::Error| {
            let reason = near_quantity(name).map_or_else(
                || error.to_string(),
                |near| format!("is not a known quantity; did you mean `{near}`?"),
            );
            Error::value(path, format!("channels.\"{name}\""), reason)
        })?;
        map.insert(quantity, ChannelEntry::clone(entry));
    }
    if map.is_empty() {
        let reason = "is empty; map the log's columns, such as \"depth\" = { column = \"Z (m)\" }";
        return Err(Error::value(path, "channels", reason));
    }
    check_named(path, &map, vehicle)?;
    Ok(map)
}

/// Rejects channels of thrusters, rudders and fins that the vehicle does not have, which would
/// otherwise be ignored silently.
fn check_named(path: &Path, map: &ChannelMap, vehicle: &Vehicle) -> Result<(), Error> {
    let thrusters = vehicle.thrusters.iter().chain(&vehicle.propellers);
    let thrusters: Vec<&str> = thrusters.map(|t| t.name.as_str()).collect();
    let surfaces = |kind: Surface| -> Vec<&str> {
        let own = vehicle.fins.iter().filter(|fin| fin.kind == kind);
        own.map(|fin| fin.name.as_str()).collect()
    };
    for quantity in map.keys() {
        let (what, name, known) = match quantity {
            Quantity::Thruster { name, .. } | Quantity::Azimuth(name) => {
                ("thruster", name, thrusters.clone())
            }
            Quantity::SurfaceAngle { kind, name } => (kind.name(), name, surfaces(*kind)),
            _ => continue,
        };
        if known.contains(&name.as_str()) {
            continue;
        }
        let reason = match toml_file::nearest(name, known.iter().copied()) {
            Some(near) => format!("the vehicle has no {what} `{name}`; did you mean `{near}`?"),
            None if known.is_empty() => {
                format!("the vehicle has no {what}; add `{name}` to it, or leave this out")
            }
            None => format!(
                "the vehicle has no {what} `{name}` but {}; add it to the vehicle, or leave this out",
                known.join(", ")
            ),
        };
        return Err(Error::value(path, format!("channels.\"{quantity}\""), reason));
    }
    Ok(())
}

/// Returns the quantity that was probably meant.
fn near_quantity(name: &str) -> Option<String> {
    let thruster = name.strip_prefix("thruster.").and_then(|rest| rest.rsplit_once('.'));
    if let Some((thruster, input)) = thruster {
        let inputs = [
            ThrusterInput::Speed,
            ThrusterInput::Pwm,
            ThrusterInput::Command,
            ThrusterInput::Force,
        ];
        let near = toml_file::nearest(input, inputs.map(ThrusterInput::name))?;
        return Some(format!("thruster.{thruster}.{near}"));
    }
    let known = Quantity::all_but_named();
    let known: Vec<String> = known.iter().map(ToString::to_string).collect();
    toml_file::nearest(name, known.iter().map(String::as_str)).map(str::to_owned)
}
