//! Several trials, one likelihood: which unknowns are shared, and what is known before.

use nalgebra::{DMatrix, DVector};

use super::drive::Drive;
use super::kalman::{Likelihood, Start, Wanted, likelihood};
use super::minimise::limits;
use super::parameters::{Active, Unknown, Values};
use super::schedule::Measurements;
use crate::{AxisRecord, ThrusterTrack, Timed};

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
    turning: Option<Timed>,
    pub(crate) measurements: Measurements,
    start: Start,
    /// Trials of one kind may have a plant of their own: see [`Problem::apart`].
    pub(crate) kind: Kind,
}

/// What a trial is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The vehicle is moved to and fro.
    Unsteady,
    /// It runs at constant thrust.
    Steady,
}

/// The part of the greatest speed by which the first velocity may be off.
const START_PART: f64 = 0.3;

impl Record {
    pub(crate) fn of(axis: &AxisRecord, kind: Kind) -> Self {
        let velocity = axis.velocity().map_or_else(|_| Vec::new(), |v| v.values().to_vec());
        let fastest = velocity.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
        let early = &velocity[..velocity.len().min(5)];
        let first = early.iter().sum::<f64>() / early.len().max(1) as f64;
        let spread = (START_PART * fastest).max(f64::MIN_POSITIVE);
        let measurements = Measurements::of(axis);
        let position = measurements.position();
        // It may have moved between the first velocity and the first position.
        let wait_s = position.map_or(0.0, |p| p.first_s() - measurements.first_s());
        let sample_s = position.map_or(0.0, |p| p.period_s().max(0.1));
        let start = Start {
            velocity: first,
            velocity_variance: spread * spread,
            position: position.map_or(0.0, |p| p.values()[0] - wait_s * first),
            position_variance: (spread * sample_s.max(wait_s)).powi(2).max(f64::MIN_POSITIVE),
        };
        Self {
            trial: axis.trial.clone(),
            tracks: axis.tracks(),
            turning: axis.turning.clone(),
            measurements,
            start,
            kind,
        }
    }
}

/// Whose a number is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Home {
    All,
    Kind(Kind),
    Trial(usize),
}

/// Where in the vector of all fitted numbers each trial finds its own.
#[derive(Clone, Debug)]
pub(crate) struct Problem<'a> {
    pub(crate) records: &'a [Record],
    /// The fitted unknowns of each record, in the order of its columns.
    active: Active,
    /// For each record, where its columns stand among all numbers.
    places: Vec<Vec<usize>>,
    /// The unknown behind each number.
    numbers: Vec<Unknown>,
    pub(crate) priors: &'a [Prior],
    /// Values of what is not fitted.
    pub(crate) fixed: Values,
    /// The logarithm of the shortest time in which a disturbance may forget, s.
    quickest: f64,
}

impl<'a> Problem<'a> {
    /// All trials share every unknown that is not of a trial.
    pub(crate) fn new(
        records: &'a [Record],
        unknowns: &[Unknown],
        priors: &'a [Prior],
        fixed: Values,
    ) -> Self {
        Self::apart(records, unknowns, &[], priors, fixed)
    }

    /// As [`Problem::new`], but steady trials have some unknowns by themselves.
    pub(crate) fn apart(
        records: &'a [Record],
        unknowns: &[Unknown],
        apart: &[Unknown],
        priors: &'a [Prior],
        fixed: Values,
    ) -> Self {
        // Shared ones first, so that they keep their places whatever the trials.
        let (own, shared): (Vec<Unknown>, Vec<Unknown>) =
            unknowns.iter().copied().partition(|unknown| unknown.is_of_trial());
        let active = Active::new(&[shared, own].concat());
        let mut numbers: Vec<Unknown> = Vec::new();
        let mut homes: Vec<(Unknown, Home)> = Vec::new();
        let mut places = vec![Vec::new(); records.len()];
        for &unknown in &active.unknowns {
            for (k, record) in records.iter().enumerate() {
                let home = match unknown {
                    _ if unknown.is_of_trial() => Home::Trial(k),
                    _ if apart.contains(&unknown) => Home::Kind(record.kind),
                    _ => Home::All,
                };
                let known = homes.iter().position(|known| *known == (unknown, home));
                places[k].push(known.unwrap_or(numbers.len()));
                if known.is_none() {
                    homes.push((unknown, home));
                    numbers.push(unknown);
                }
            }
        }
        Self { records, active, places, numbers, priors, fixed, quickest: 0.0 }
    }

    /// The same problem with one more number, the last, that all trials share.
    pub(crate) fn with_shared(&self, unknown: Unknown) -> Self {
        let mut wider = self.clone();
        wider.active = Active::new(&[&self.active.unknowns[..], &[unknown]].concat());
        wider.places.iter_mut().for_each(|places| places.push(self.numbers.len()));
        wider.numbers.push(unknown);
        wider
    }

    /// The same problem with disturbances as quick as that.
    pub(crate) fn with_quickest(self, quickest: f64) -> Self {
        Self { quickest, ..self }
    }

    /// Where a number means something.
    pub(crate) fn limits(&self, unknown: Unknown) -> (f64, f64) {
        let (low, high) = limits(unknown);
        (if unknown == Unknown::LogCorrelation { self.quickest } else { low }, high)
    }

    /// How many numbers are fitted.
    pub(crate) fn len(&self) -> usize {
        self.numbers.len()
    }

    /// The unknown behind each fitted number.
    pub(crate) fn numbers(&self) -> &[Unknown] {
        &self.numbers
    }

    /// The fitted unknowns.
    pub(crate) fn unknowns(&self) -> &[Unknown] {
        &self.active.unknowns
    }

    /// The values of one trial.
    pub(crate) fn values(&self, theta: &DVector<f64>, record: usize) -> Values {
        let mut values = self.fixed;
        for (unknown, place) in self.active.unknowns.iter().zip(&self.places[record]) {
            values.set(*unknown, theta[*place]);
        }
        values
    }

    /// The place of a trial's unknown among all numbers, if it is fitted.
    pub(crate) fn index(&self, unknown: Unknown, record: usize) -> Option<usize> {
        self.active.column(unknown).map(|j| self.places[record][j])
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
            for (j, &row) in self.places[record].iter().enumerate() {
                gradient[row] += one.gradient[j];
                for (i, &column) in self.places[record].iter().enumerate() {
                    information[(column, row)] += one.information[(i, j)];
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
        self.likelihood_of(&self.records[record], &self.values(theta, record), wanted)
    }

    fn likelihood_of(&self, record: &Record, values: &Values, wanted: Wanted) -> Likelihood {
        let Record { tracks, turning, measurements, start, .. } = record;
        let drive = Drive::new(tracks, turning.as_ref(), values, measurements.first_s());
        likelihood(measurements, drive, &self.active, values, *start, wanted)
    }

    /// A trial that was not fitted, at the values of those that were; what each trial has by
    /// itself is left to be found.
    pub(crate) fn of_another<'b>(&'b self, theta: &DVector<f64>, other: &'b Record) -> Problem<'b> {
        let own = self.active.unknowns.iter().copied().filter(|unknown| unknown.is_of_trial());
        let own: Vec<Unknown> = own.collect();
        Problem::new(std::slice::from_ref(other), &own, self.priors, self.values(theta, 0))
    }

    fn prior_cost(&self, theta: &DVector<f64>) -> f64 {
        let of = |(place, prior): (usize, Prior)| {
            0.5 * ((theta[place] - prior.mean) / prior.std).powi(2)
        };
        self.priors_in_place().map(of).sum()
    }

    fn priors_in_place(&self) -> impl Iterator<Item = (usize, Prior)> + '_ {
        self.numbers.iter().enumerate().flat_map(|(place, number)| {
            let of_number = self.priors.iter().filter(|prior| prior.unknown == *number);
            of_number.map(move |prior| (place, *prior))
        })
    }

    /// How many measurements there are.
    pub(crate) fn samples(&self) -> usize {
        self.records.iter().map(|record| record.measurements.samples()).sum()
    }
}
