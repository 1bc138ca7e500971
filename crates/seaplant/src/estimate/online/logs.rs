//! Online identification from logs: trials in sequence, sample by sample.

use nalgebra::Vector6;

use super::{
    Change, Online, OnlineEstimate, OnlineHistory, OnlineOptions, PlantChanged, Sample, Scheme,
};
use crate::motion::{down_body, interpolated_attitude};
use crate::plant::{Basis, RigidBody, Signal, Structure};
use crate::{Caveat, CaveatCode, Dof, Error, Grid, Timed, TrialRecord};

/// Result of online identification of some trials.
#[derive(Clone, Debug)]
pub struct OnlineFit {
    /// The last estimate.
    pub estimate: OnlineEstimate,
    /// History of the coefficients.
    pub history: CoefficientHistory,
    /// Detected changes of the plant, with the trial.
    pub changes: Vec<(String, Change)>,
    /// Number of samples.
    pub samples: usize,
    /// True if the selected scheme started; else the estimate is that of least squares.
    pub has_started: bool,
}

/// Coefficients over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoefficientHistory {
    /// Duration of the motion so far, s.
    pub time_s: Vec<f64>,
    /// Coefficients at each instant, one list per term.
    pub values: Vec<Vec<f64>>,
}

/// A section of a trial without gaps.
#[derive(Clone)]
pub(super) struct Stretch {
    pub(super) trial: String,
    pub(super) samples: Vec<Sample>,
}

impl Stretch {
    /// Returns the steps between its samples, s.
    pub(super) fn steps_s(&self) -> impl Iterator<Item = f64> + '_ {
        self.samples.windows(2).map(|pair| pair[1].time_s - pair[0].time_s)
    }
}

/// Number of instants in a history.
const INSTANTS: usize = 240;

/// Minimum number of samples of a section.
pub(super) const LEAST_SAMPLES: usize = 30;

/// A coefficient has settled when it stays within this fraction of its last value …
const SETTLED_PART: f64 = 0.05;

/// … from before this fraction of the motion.
const SETTLED_BY: f64 = 0.9;

/// Information below which a combination of coefficients counts as undetermined.
const LEAST_EXCITATION: f64 = 1e-4;

/// Identifies a plant of several axes from records, sample by sample.
///
/// # Errors
/// As [`fit_online`](super::fit_online); [`Error::MissingChannel`] if a record lacks a signal that
/// the plant's effects use; [`Error::Plant`] for axes without a known force, which the adaptive
/// observer needs.
pub fn fit_online_plant(
    structure: &Structure,
    scheme: Scheme,
    records: &[&TrialRecord],
    rigid_body: Option<&RigidBody>,
    options: &OnlineOptions,
) -> Result<OnlineFit, Error> {
    if scheme == Scheme::Adaptive {
        check_forces(structure, records)?;
    }
    let online = Online::new(structure.clone(), scheme, *options, rigid_body)?;
    let stretches: Vec<Stretch> =
        records.iter().map(|record| of_record(record, structure)).collect::<Result<_, Error>>()?;
    run(online, &stretches, options)
}

/// Checks that a known force acts on each axis with an effect of unknown size. Otherwise that
/// effect and all other coefficients of the axis can grow in proportion without a change of the
/// motion.
fn check_forces(structure: &Structure, records: &[&TrialRecord]) -> Result<(), Error> {
    let is_driven = |dof: Dof| records.iter().any(|record| record.is_driven(dof));
    let acts = |term: &Basis, dof: Dof| structure.axes_of(term).contains(&dof);
    let effects = || structure.terms().iter().filter(|term| structure.pushes(term));
    let is_held = |term: &&Basis| structure.held(term).is_some();
    let is_open = |dof: Dof| {
        let mut all = structure.terms().iter().filter(is_held);
        effects().any(|term| acts(term, dof))
            && !is_driven(dof)
            && !all.any(|term| acts(term, dof) && !matches!(term, Basis::Mass(i, j) if i != j))
    };
    let open: Vec<&str> =
        structure.axes().iter().filter(|dof| is_open(**dof)).map(|dof| dof.name()).collect();
    if open.is_empty() {
        return Ok(());
    }
    let reason = format!(
        "no force of known size acts on {}, and the adaptive observer needs one there: use recursive or filter-error, or state area_m2 and lift_slope of the rudder, a thrust curve, or hold one mass of each of these axes",
        open.join(" and ")
    );
    Err(Error::Plant { axes: structure.name(), reason })
}

/// Returns the grid whose intervals start at the middles of those of another.
fn after(grid: Grid) -> Grid {
    Grid { start_s: grid.start_s + 0.5 * grid.period_s, ..grid }
}

/// Limits of the grid's period, s.
const PERIOD_S: [f64; 2] = [0.02, 1.0];

/// Maximum period for the sake of a slow sensor, s: roll and pitch of a small vehicle change within
/// it.
const SLOW_S: f64 = 0.2;

/// Returns the grid of the slowest velocity: more samples would be interpolated ones, with less
/// noise than stated.
fn grid_of(record: &TrialRecord, structure: &Structure) -> Grid {
    let series = || structure.axes().iter().filter_map(|dof| record.velocity[dof.index()].as_ref());
    let fastest_s = series().map(Timed::period_s).fold(f64::INFINITY, f64::min);
    let is_no_slower = |one: &&Timed| one.period_s() <= fastest_s.max(SLOW_S);
    let slowest =
        series().filter(is_no_slower).max_by(|a, b| a.period_s().total_cmp(&b.period_s()));
    let (from_s, to_s) = record.window_s;
    let Some(slowest) = slowest else { return Grid::spanning(from_s, to_s, PERIOD_S[1]) };
    let first = slowest.time_s().iter().find(|t| **t >= from_s && **t <= to_s);
    let period_s = slowest.period_s().clamp(PERIOD_S[0], PERIOD_S[1]);
    Grid::spanning(first.copied().unwrap_or(from_s), to_s, period_s)
}

fn of_record(record: &TrialRecord, structure: &Structure) -> Result<Stretch, Error> {
    let grid = grid_of(record, structure);
    let columns = |of: &dyn Fn(usize) -> Option<Vec<f64>>| -> Vec<Vec<f64>> {
        (0..6).map(|i| of(i).unwrap_or_else(|| vec![0.0; grid.len])).collect()
    };
    let velocity = columns(&|i| Some(record.velocity[i].as_ref()?.interpolate(grid)));
    let force = columns(&|i| Some(record.force[i].as_ref()?.held_means(after(grid))));
    let signals: Vec<Vec<f64>> = structure
        .signals()
        .iter()
        .map(|signal| column(record, signal, grid))
        .collect::<Result<_, _>>()?;
    let [roll, pitch, _] = record.attitude.each_ref();
    let angle = |series: Option<&Timed>, t: f64| interpolated_attitude(series, t);
    let sample = |(k, time_s): (usize, f64)| Sample {
        time_s,
        velocity: Vector6::from_fn(|i, _| velocity[i][k]),
        down_body: down_body(angle(roll.as_ref(), time_s), angle(pitch.as_ref(), time_s)),
        force: Vector6::from_fn(|i, _| force[i][k]),
        signals: std::array::from_fn(|i| signals.get(i).map_or(0.0, |signal| signal[k])),
    };
    let samples = grid.times().enumerate().map(sample).collect();
    Ok(Stretch { trial: record.trial.clone(), samples })
}

/// Returns a signal as samples hold it: for an input, its mean until the next sample.
fn column(record: &TrialRecord, signal: &Signal, grid: Grid) -> Result<Vec<f64>, Error> {
    let series = record.signals.get(signal).ok_or_else(|| Error::MissingChannel {
        trial: record.trial.clone(),
        what: signal.to_string(),
        advice: "map it, or leave the effect that reads it out".to_owned(),
    })?;
    Ok(if signal.is_held() { series.held_means(after(grid)) } else { series.interpolate(grid) })
}

/// Processes sections in sequence.
pub(super) fn run(
    mut online: Online,
    stretches: &[Stretch],
    options: &OnlineOptions,
) -> Result<OnlineFit, Error> {
    let total: usize = stretches.iter().map(|stretch| stretch.samples.len()).sum();
    let every = total.div_ceil(INSTANTS).max(1);
    let mut history = CoefficientHistory::default();
    let (mut changes, mut samples) = (Vec::new(), 0);
    for stretch in stretches {
        online.restart();
        for sample in &stretch.samples {
            if let Some(change) = online.update(sample)? {
                changes.push((stretch.trial.clone(), change));
            }
            samples += 1;
            if samples % every == 0 && online.elapsed_s >= options.start_s {
                history.push(online.elapsed_s, online.coefficients());
            }
        }
    }
    if online.elapsed_s < 1.5 * options.start_s {
        let hz = samples as f64 / online.elapsed_s.max(f64::MIN_POSITIVE);
        return Err(Error::TooShort {
            name: "the motion to identify online from".to_owned(),
            found: samples,
            needed: (1.5 * options.start_s * hz).ceil() as usize,
        });
    }
    let estimate = online.estimate()?;
    history.push(online.elapsed_s, estimate.plant.coefficients());
    let has_started = online.has_started();
    Ok(OnlineFit { estimate, history, changes, samples, has_started })
}

impl CoefficientHistory {
    fn push(&mut self, time_s: f64, coefficients: &[f64]) {
        self.time_s.push(time_s);
        self.values.resize(coefficients.len(), Vec::new());
        self.values.iter_mut().zip(coefficients).for_each(|(all, x)| all.push(*x));
    }

    /// Returns the time, s of motion, after which a coefficient stays within 5 % of its last value;
    /// `None` if that is only within the last tenth.
    pub fn settled_s(&self, k: usize) -> Option<f64> {
        let (values, last) = (self.values.get(k)?, *self.values.get(k)?.last()?);
        let is_off = |x: &f64| (x - last).abs() > SETTLED_PART * last.abs();
        let from = values.iter().rposition(is_off).map_or(0, |at| at + 1);
        let (time_s, end_s) = (*self.time_s.get(from)?, *self.time_s.last()?);
        (time_s <= SETTLED_BY * end_s).then_some(time_s)
    }

    /// Converts to data, by the names of the terms.
    pub(crate) fn result(&self, names: &[String], fit: &OnlineFit) -> OnlineHistory {
        let named = |of: &dyn Fn(usize) -> Vec<f64>| {
            names.iter().cloned().enumerate().map(|(k, name)| (name, of(k))).collect()
        };
        let settled = |(k, name): (usize, &String)| (name.clone(), self.settled_s(k));
        OnlineHistory {
            time_s: self.time_s.clone(),
            parameters: named(&|k| self.values[k].clone()),
            settled_s: names.iter().enumerate().map(settled).collect(),
            excitation: fit.estimate.excitation,
            changes: fit.changes.iter().map(|(trial, change)| changed(trial, change)).collect(),
            noticeable_change: fit.estimate.noticeable_change,
        }
    }
}

fn changed(trial: &str, change: &Change) -> PlantChanged {
    let Change { since_s, noticed_s, statistic } = *change;
    PlantChanged { trial: trial.to_owned(), since_s, noticed_s, statistic }
}

/// Returns the estimator's caveats.
pub(crate) fn doubts(what: &str, names: &[String], fit: &OnlineFit) -> Vec<Caveat> {
    let mut all = Vec::new();
    for (trial, change) in &fit.changes {
        let message = format!(
            "the {what} plant seems to change at {:.0} s of trial `{trial}` (noticed at {:.0} s): a payload, a fault, or a disturbance that began; the estimates hold for the time after it",
            change.since_s, change.noticed_s
        );
        all.push(Caveat::warning(CaveatCode::PlantDrifts, message));
    }
    if fit.estimate.excitation < LEAST_EXCITATION {
        let worst = worst(names, &fit.estimate.inflation);
        let message = format!(
            "the motion does not excite every combination of the {what} coefficients: the one determined least has {:.1e} of the information that its coefficients have one by one, and {LEAST_EXCITATION:.0e} is needed; {worst} are determined least: vary speed and direction, or leave terms out",
            fit.estimate.excitation
        );
        all.push(Caveat::warning(CaveatCode::Collinear, message));
    }
    if !fit.has_started {
        let message = format!(
            "{:.0} s of {what} motion do not determine every mass to 3 %, which the method starts from: the estimate is that of recursive least squares, its start; drive longer, or with more acceleration",
            fit.estimate.elapsed_s
        );
        all.push(Caveat::warning(CaveatCode::ShortTrial, message));
    }
    let unsettled = |k: &usize| fit.history.settled_s(*k).is_none();
    let late: Vec<&str> = (0..names.len()).filter(unsettled).map(|k| names[k].as_str()).collect();
    if !late.is_empty() {
        let message = format!(
            "{} of {what} still moved by more than 5 % in the last tenth of {:.0} s of motion; a longer record would show where they settle",
            late.join(", "),
            fit.estimate.elapsed_s
        );
        all.push(Caveat::note(CaveatCode::ShortTrial, message));
    }
    all
}

/// Returns the two coefficients with the greatest variance inflation.
fn worst(names: &[String], inflation: &[f64]) -> String {
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by(|a, b| inflation[*b].total_cmp(&inflation[*a]));
    order.iter().take(2).map(|k| names[*k].as_str()).collect::<Vec<_>>().join(" and ")
}
