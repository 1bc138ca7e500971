//! How far a plant's free motion is from what was measured.

use std::collections::BTreeMap;

use nalgebra::Vector6;

use super::plant_of_result;
use crate::estimate::Actuator;
use crate::motion::{Inputs, Simulated, simulate};
use crate::plant::Plant;
use crate::results::{AxisScore, CoupledPlant, CoupledScore};
use crate::{CoupledRecord, Dof, Error, Timed, Trial};

/// Sums that make a score.
#[derive(Clone, Copy, Default)]
struct Sums {
    n: usize,
    error: f64,
    null: f64,
    squares: f64,
    sum: f64,
    of_squares: f64,
    diverged: bool,
}

impl Sums {
    fn add(&mut self, model: Option<f64>, measured: f64) {
        self.n += 1;
        self.null += measured.abs();
        self.sum += measured;
        self.of_squares += measured * measured;
        match model {
            Some(model) => {
                self.error += (model - measured).abs();
                self.squares += (model - measured).powi(2);
            }
            None => self.diverged = true,
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            n: self.n + other.n,
            error: self.error + other.error,
            null: self.null + other.null,
            squares: self.squares + other.squares,
            sum: self.sum + other.sum,
            of_squares: self.of_squares + other.of_squares,
            diverged: self.diverged || other.diverged,
        }
    }

    fn score(self) -> AxisScore {
        let n = self.n.max(1) as f64;
        let spread = self.of_squares - self.sum * self.sum / n;
        let of = |x: f64| (!self.diverged).then_some(x);
        AxisScore {
            mean_abs_error: of(self.error / n),
            null_error: self.null / n,
            r2: of(1.0 - self.squares / spread).filter(|r2| r2.is_finite()),
            samples: self.n,
        }
    }
}

/// The error of a coupled plant of results on trials, each simulated freely from its start.
///
/// Water is taken to move as in the trials that the plant was fitted to, in their mean.
///
/// # Errors
/// That of the first trial, if none was read for the plant's axes; as [`plant_of_result`].
pub fn score_coupled(result: &CoupledPlant, trials: &[&Trial]) -> Result<CoupledScore, Error> {
    let plant = plant_of_result(result)?;
    let number = |name: &str| result.nuisances.get(name).map_or(0.0, |x| x.value);
    let actuator = Actuator { lag_s: number("lag"), delay_s: number("delay") };
    let mean = |direction: &str| {
        let own = result.nuisances.iter().filter(|(name, _)| name.starts_with(direction));
        let weighted = own.map(|(_, x)| (x.value, 1.0 / (x.std * x.std).max(f64::MIN_POSITIVE)));
        let (sum, weight) = weighted.fold((0.0, 0.0), |(s, w), (x, own)| (s + own * x, w + own));
        if weight > 0.0 { sum / weight } else { 0.0 }
    };
    let current = [mean("current north: "), mean("current east: ")];
    let read: Vec<_> = trials.iter().map(|trial| trial.coupled(&result.axes)).collect();
    let records: Vec<&CoupledRecord> =
        read.iter().filter_map(|x| x.as_ref().ok().copied()).collect();
    if let (true, Some(Err(error))) = (records.is_empty(), read.into_iter().next()) {
        return Err(error);
    }
    score(&plant, actuator, &records, |_| current)
}

/// Simulates trials freely from their start, with thrust as it acts, and compares velocities.
///
/// # Errors
/// [`Error::Plant`] if M is singular; a simulation that runs away is no error but has no score.
pub(super) fn score(
    plant: &Plant,
    actuator: Actuator,
    records: &[&CoupledRecord],
    current: impl Fn(&CoupledRecord) -> [f64; 2],
) -> Result<CoupledScore, Error> {
    let mut score = CoupledScore::default();
    let mut all: BTreeMap<Dof, Sums> = BTreeMap::new();
    for record in records {
        let sums = of_trial(plant, actuator, record, current(record))?;
        for (dof, sums) in &sums {
            let total = all.entry(*dof).or_default();
            *total = total.plus(*sums);
        }
        let by_axis = sums.into_iter().map(|(dof, sums)| (dof, sums.score())).collect();
        score.trials.insert(record.trial.clone(), by_axis);
    }
    score.by_axis = all.into_iter().map(|(dof, sums)| (dof, sums.score())).collect();
    Ok(score)
}

fn of_trial(
    plant: &Plant,
    actuator: Actuator,
    record: &CoupledRecord,
    current: [f64; 2],
) -> Result<BTreeMap<Dof, Sums>, Error> {
    let (from, to) = record.window_s;
    let velocity = |dof: Dof| record.velocity[dof.index()].as_ref();
    let measured: Vec<(Dof, Timed)> = plant
        .axes()
        .iter()
        .filter_map(|&dof| Some((dof, velocity(dof)?.window(from, to)?)))
        .collect();
    let mut times: Vec<f64> =
        measured.iter().flat_map(|(_, series)| series.time_s()).copied().collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let first = times.first().copied().unwrap_or(from);
    let start =
        Vector6::from_fn(|k, _| record.velocity[k].as_ref().map_or(0.0, |series| series.at(first)));
    let mut force = record.force.clone();
    for series in force.iter_mut().flatten() {
        *series = actuator.applied(series)?;
    }
    let inputs = Inputs {
        force,
        velocity: record.velocity.clone(),
        attitude: record.attitude.clone(),
        current,
        signals: record.signals.clone(),
        wind: None,
    };
    let simulated = match simulate(plant, &inputs, &start, &times) {
        Ok(simulated) => Some(simulated),
        Err(Error::Diverged { .. }) => None,
        Err(other) => return Err(other),
    };
    let mut sums: BTreeMap<Dof, Sums> = BTreeMap::new();
    for (dof, series) in &measured {
        let mut at = 0;
        let own = sums.entry(*dof).or_default();
        for (t, y) in series.time_s().iter().zip(series.values()) {
            while times[at] < *t {
                at += 1;
            }
            let model = |found: &Simulated| found.velocity[at][dof.index()];
            own.add(simulated.as_ref().map(model), *y);
        }
    }
    Ok(sums)
}
