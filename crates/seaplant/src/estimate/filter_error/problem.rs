//! Several trials, one likelihood: which unknowns are shared, and what is known before.

use nalgebra::{DMatrix, DVector};

use super::drive::Drive;
use super::kalman::{Likelihood, Start, Wanted, likelihood};
use super::parameters::{Active, Unknown, Values};
use super::schedule::Schedule;
use crate::navigation::Motion;
use crate::{AxisRecord, ThrusterTrack};

/// What is believed of an unknown before any log is read: a normal distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prior {
    pub(crate) unknown: Unknown,
    pub(crate) mean: f64,
    pub(crate) std: f64,
}

/// One trial, ready for the filter.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    pub(crate) trial: String,
    tracks: Vec<ThrusterTrack>,
    pub(crate) schedule: Schedule,
    start: Start,
}

/// The part of the greatest speed by which the first velocity may be off.
const START_PART: f64 = 0.3;

impl Record {
    pub(crate) fn of(axis: &AxisRecord) -> Self {
        let series = axis.motion.series();
        let velocity = axis.velocity().map_or_else(|_| Vec::new(), |v| v.values().to_vec());
        let fastest = velocity.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
        let early = &velocity[..velocity.len().min(5)];
        let first = early.iter().sum::<f64>() / early.len().max(1) as f64;
        let spread = (START_PART * fastest).max(f64::MIN_POSITIVE);
        let (position, position_spread) = match &axis.motion {
            Motion::Position(_) => (series.values()[0], spread * series.period_s().max(0.1)),
            Motion::Velocity(_) => (0.0, 1.0),
        };
        Self {
            trial: axis.trial.clone(),
            tracks: axis.tracks(),
            schedule: Schedule::of(axis),
            start: Start {
                velocity: first,
                velocity_variance: spread * spread,
                position,
                position_variance: position_spread * position_spread,
            },
        }
    }
}

/// Where in the vector of all fitted numbers each trial finds its own.
#[derive(Clone, Debug)]
pub(crate) struct Problem<'a> {
    pub(crate) records: &'a [Record],
    /// Fitted, and the same in every trial.
    pub(crate) shared: Vec<Unknown>,
    /// Fitted for each trial by itself.
    pub(crate) own: Vec<Unknown>,
    pub(crate) priors: &'a [Prior],
    /// Values of what is not fitted.
    pub(crate) fixed: Values,
    active: Active,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        records: &'a [Record],
        unknowns: &[Unknown],
        priors: &'a [Prior],
        fixed: Values,
    ) -> Self {
        // A current is of a place and a day; all else is of the vehicle.
        let is_own = |unknown: &Unknown| *unknown == Unknown::Current;
        let (own, shared): (Vec<Unknown>, Vec<Unknown>) =
            unknowns.iter().copied().partition(is_own);
        let active = Active::new(&[shared.clone(), own.clone()].concat());
        Self { records, shared, own, priors, fixed, active }
    }

    /// How many numbers are fitted.
    pub(crate) fn len(&self) -> usize {
        self.shared.len() + self.own.len() * self.records.len()
    }

    /// Where the j-th column of a trial stands among all numbers.
    fn place(&self, record: usize, column: usize) -> usize {
        if column < self.shared.len() { column } else { column + record * self.own.len() }
    }

    /// The unknown behind each fitted number.
    pub(crate) fn unknowns(&self) -> Vec<Unknown> {
        let own = self.records.iter().flat_map(|_| self.own.iter().copied());
        self.shared.iter().copied().chain(own).collect()
    }

    /// The values of one trial.
    pub(crate) fn values(&self, theta: &DVector<f64>, record: usize) -> Values {
        let mut values = self.fixed;
        for (j, unknown) in self.active.unknowns.iter().enumerate() {
            values.set(*unknown, theta[self.place(record, j)]);
        }
        values
    }

    /// The place of a trial's unknown among all numbers, if it is fitted.
    pub(crate) fn index(&self, unknown: Unknown, record: usize) -> Option<usize> {
        self.active.column(unknown).map(|j| self.place(record, j))
    }

    /// Cost alone.
    pub(crate) fn cost(&self, theta: &DVector<f64>) -> f64 {
        let of = |record: usize| self.likelihood(theta, record, Wanted::Cost).cost;
        (0..self.records.len()).map(of).sum::<f64>() + self.prior_cost(theta)
    }

    /// Cost, gradient and information of all trials and what was known before.
    pub(crate) fn evaluate(&self, theta: &DVector<f64>) -> (f64, DVector<f64>, DMatrix<f64>) {
        let n = self.len();
        let (mut cost, mut gradient, mut information) =
            (self.prior_cost(theta), DVector::zeros(n), DMatrix::zeros(n, n));
        for record in 0..self.records.len() {
            let one = self.likelihood(theta, record, Wanted::Sensitivities);
            cost += one.cost;
            for j in 0..self.active.len() {
                let row = self.place(record, j);
                gradient[row] += one.gradient[j];
                for i in 0..self.active.len() {
                    information[(self.place(record, i), row)] += one.information[(i, j)];
                }
            }
        }
        for (place, prior) in self.priors_in_place() {
            let off = theta[place] - prior.mean;
            gradient[place] += off / (prior.std * prior.std);
            information[(place, place)] += 1.0 / (prior.std * prior.std);
        }
        (cost, gradient, information)
    }

    /// Normalised innovations of one trial.
    pub(crate) fn innovations(&self, theta: &DVector<f64>, record: usize) -> Vec<f64> {
        self.likelihood(theta, record, Wanted::Innovations).innovations
    }

    fn likelihood(&self, theta: &DVector<f64>, record: usize, wanted: Wanted) -> Likelihood {
        let Record { tracks, schedule, start, .. } = &self.records[record];
        let values = self.values(theta, record);
        let drive = Drive::of(tracks, schedule, &values);
        likelihood(schedule, &drive, &self.active, &values, *start, wanted)
    }

    /// Cost of trials that were not fitted, at the values of those that were; a current is
    /// the mean of theirs.
    pub(crate) fn cost_of_others(&self, theta: &DVector<f64>, others: &[Record]) -> f64 {
        let mut values = self.values(theta, 0);
        let count = self.records.len();
        for unknown in &self.own {
            let of = |record| self.index(*unknown, record).map_or(0.0, |place| theta[place]);
            values.set(*unknown, (0..count).map(of).sum::<f64>() / count as f64);
        }
        let cost = |record: &Record| {
            let drive = Drive::of(&record.tracks, &record.schedule, &values);
            let Record { schedule, start, .. } = record;
            likelihood(schedule, &drive, &self.active, &values, *start, Wanted::Cost).cost
        };
        others.iter().map(cost).sum()
    }

    fn prior_cost(&self, theta: &DVector<f64>) -> f64 {
        let of = |(place, prior): (usize, Prior)| {
            0.5 * ((theta[place] - prior.mean) / prior.std).powi(2)
        };
        self.priors_in_place().map(of).sum()
    }

    fn priors_in_place(&self) -> impl Iterator<Item = (usize, Prior)> + '_ {
        let places = move |prior: &Prior| {
            let prior = *prior;
            let copies = if self.own.contains(&prior.unknown) { self.records.len() } else { 1 };
            (0..copies).filter_map(move |k| Some((self.index(prior.unknown, k)?, prior)))
        };
        self.priors.iter().flat_map(places)
    }

    /// How many measurements there are.
    pub(crate) fn samples(&self) -> usize {
        self.records.iter().map(|record| record.schedule.samples()).sum()
    }
}
