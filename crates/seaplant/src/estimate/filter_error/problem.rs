//! Several trials, one likelihood: which unknowns are shared, and what is known before.

use nalgebra::{DMatrix, DVector};

use super::driven::{DrivenStep, KeptSteps, driven, law_of};
use super::kalman::{Innovation, Likelihood, Start, Wanted, likelihood};
use super::parameters::{Active, Sensor, Shape, Unknown, Values};
use super::schedule::{Instrument, Measurements};
use super::spikes::spikes;
use crate::estimate::propellers::Drive;
use crate::navigation::{MeanAcceleration, MeanOver};
use crate::{AxisRecord, ThrusterTrack, Timed};

/// What is believed of an unknown before any log is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prior {
    pub(crate) unknown: Unknown,
    pub(crate) belief: Belief,
}

/// A distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Belief {
    /// A normal distribution.
    Normal { mean: f64, std: f64 },
    /// Nothing is believed below a limit; above it, a normal distribution of the logarithm.
    AtMost { limit: f64, log_std: f64 },
}

impl Belief {
    /// What a value costs, with the first and the second derivative, of which the second is
    /// that of a parabola.
    fn cost(self, x: f64) -> (f64, f64, f64) {
        match self {
            Self::Normal { mean, std } => {
                let precision = 1.0 / (std * std);
                let off = x - mean;
                (0.5 * precision * off * off, precision * off, precision)
            }
            Self::AtMost { limit, log_std } => {
                let above = (x / limit).ln();
                if above.is_nan() || above <= 0.0 {
                    return (0.0, 0.0, 0.0);
                }
                let precision = 1.0 / (log_std * log_std);
                (0.5 * precision * above * above, precision * above / x, precision / (x * x))
            }
        }
    }
}

/// One trial, ready for the filter.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    pub(crate) trial: String,
    tracks: Vec<ThrusterTrack>,
    turning: Option<Timed>,
    parts: Vec<Part>,
    /// Mean velocity, m/s or rad/s; `None` if none was measured.
    pub(crate) mean_velocity: Option<f64>,
    /// Trials of one kind may have a plant of their own: see [`Problem::apart`].
    pub(crate) kind: Kind,
}

/// What can be followed from one state at the start.
#[derive(Clone, Debug)]
struct Part {
    measurements: Measurements,
    start: Start,
    steps: KeptSteps,
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
        let velocity = axis.velocity().ok();
        let speeds = velocity.iter().flat_map(|velocity| velocity.values());
        let fastest = speeds.fold(0.0_f64, |max, v| max.max(v.abs()));
        let gained = axis.acceleration.as_ref().filter(|_| velocity.is_none()).map(most_gained);
        // Where nobody measured the first velocity, it may be any that is seen to be gained.
        let spread = gained.unwrap_or(START_PART * fastest).max(f64::MIN_POSITIVE);
        let part = |measurements| Part::of(measurements, velocity.as_ref(), spread);
        let mean = |velocity: &Timed| velocity.values().iter().sum::<f64>() / velocity.len() as f64;
        Self {
            trial: axis.trial.clone(),
            tracks: axis.tracks(),
            turning: axis.turning.clone(),
            parts: Measurements::parts_of(axis).into_iter().map(part).collect(),
            mean_velocity: velocity.as_ref().map(mean),
            kind,
        }
    }

    /// Evenly spread pieces that hold a part of it; `None` if velocity was not measured, so that a
    /// piece has nothing to start from.
    pub(crate) fn spread(&self, part: f64) -> Option<Self> {
        let pieces = self.parts.iter().map(|own| own.pieces(part)).collect::<Option<Vec<_>>>()?;
        Some(Self { parts: pieces.concat(), ..self.clone() })
    }

    /// How many measurements there are.
    pub(crate) fn samples(&self) -> usize {
        self.parts.iter().map(|part| part.measurements.samples()).sum()
    }

    /// How often an instrument measures, s; `None` if there is none.
    pub(crate) fn period_s(&self, instrument: Instrument) -> Option<f64> {
        let series =
            self.parts.iter().filter_map(|part| part.measurements.of_instrument(instrument));
        let longest = series.max_by_key(|series| series.len())?;
        Some(longest.period_s()).filter(|period_s| *period_s > 0.0)
    }

    /// Strikes out the spikes among measurements, of which these are the innovations; how many
    /// there were.
    pub(crate) fn strike_out(&mut self, innovations: &[Innovation]) -> usize {
        let (mut rest, mut count) = (innovations, 0);
        for part in &mut self.parts {
            let (own, others) = rest.split_at(part.measurements.samples().min(rest.len()));
            let found = spikes(own);
            count += found.len();
            part.measurements.strike_out(&found);
            part.steps = KeptSteps::default();
            rest = others;
        }
        count
    }
}

/// The most that velocity changes by within so long, s …
const GAINED_OVER_S: f64 = 10.0;

/// … by mean accelerations without their own mean, m/s.
fn most_gained(felt: &MeanAcceleration) -> f64 {
    let (values, count) = (felt.mean.values(), felt.mean.len().max(1) as f64);
    let offset = values.iter().sum::<f64>() / count;
    let (mut velocity, mut past) = (0.0, std::collections::VecDeque::new());
    let mut most = 0.0_f64;
    for MeanOver { from_s, to_s, mean } in felt.windows() {
        velocity += (mean - offset) * (to_s - from_s);
        past.push_back((to_s, velocity));
        while past.front().is_some_and(|(t, _)| *t < to_s - GAINED_OVER_S) {
            past.pop_front();
        }
        most = past.iter().fold(most, |most, (_, v)| most.max((velocity - v).abs()));
    }
    most
}

impl Part {
    /// A part that starts at about the first velocities after its first measurement.
    fn of(measurements: Measurements, velocity: Option<&Timed>, spread: f64) -> Self {
        let early = velocity.map_or(&[][..], |velocity| {
            let from = velocity.time_s().partition_point(|t| *t < measurements.first_s());
            let early = velocity.values().get(from..).unwrap_or_default();
            &early[..early.len().min(5)]
        });
        let first = early.iter().sum::<f64>() / early.len().max(1) as f64;
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
        Self { measurements, start, steps: KeptSteps::default() }
    }

    /// Evenly spread pieces that hold a part of it, each with a start of its own.
    fn pieces(&self, part: f64) -> Option<Vec<Self>> {
        let velocity = self.measurements.velocity()?;
        let (from_s, length_s) = (velocity.first_s(), velocity.last_s() - velocity.first_s());
        let count = (part * length_s / PIECE_S).ceil().max(1.0);
        let spread = self.start.velocity_variance.sqrt();
        let piece = |k: usize| {
            let middle_s = from_s + (k as f64 + 0.5) * length_s / count;
            let half_s = 0.5 * part * length_s / count;
            let measurements = self.measurements.window(middle_s - half_s, middle_s + half_s);
            Self::of(measurements, Some(velocity), spread)
        };
        let pieces = (0..count as usize).map(piece);
        Some(pieces.filter(|piece| piece.measurements.samples() >= LEAST_OF_PIECE).collect())
    }
}

/// How long the pieces of a long record are, s: many time constants of a vehicle.
const PIECE_S: f64 = 120.0;

/// A piece with fewer measurements says nothing.
const LEAST_OF_PIECE: usize = 30;

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
        let mut fixed = fixed;
        fixed.shape = shape_with(fixed.shape, unknowns);
        Self { records, active, places, numbers, priors, fixed }
    }

    /// The same problem with one more number, the last, that all trials share.
    pub(crate) fn with_shared(&self, unknown: Unknown) -> Self {
        let mut wider = self.clone();
        wider.active = Active::new(&[&self.active.unknowns[..], &[unknown]].concat());
        wider.places.iter_mut().for_each(|places| places.push(self.numbers.len()));
        wider.numbers.push(unknown);
        wider
    }

    /// Whether logged propeller speeds are taken to move linearly between samples.
    pub(crate) fn is_linear(&self) -> bool {
        self.fixed.shape.linear
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

    /// Whether neither velocity nor position was measured: acceleration alone says what moves.
    pub(crate) fn goes_by_acceleration(&self) -> bool {
        let has = |unknown| self.index(unknown, 0).is_some();
        has(Unknown::LogAccelerationNoise)
            && !has(Unknown::LogVelocityNoise)
            && !has(Unknown::LogPositionNoise)
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
            let (_, slope, curvature) = prior.belief.cost(theta[place]);
            gradient[place] += slope;
            information[(place, place)] += curvature;
        }
        (cost, gradient, information)
    }

    /// The gradients of parts of the trials, each about that long, s; each of shape (n,).
    pub(crate) fn scores(&self, theta: &DVector<f64>, length_s: f64) -> Vec<DVector<f64>> {
        let of = |record: usize| {
            let parts = self.likelihood(theta, record, Wanted::Scores(length_s)).scores;
            let placed = move |part: DVector<f64>| {
                let mut score = DVector::zeros(self.len());
                for (x, &place) in part.iter().zip(&self.places[record]) {
                    score[place] += x;
                }
                score
            };
            parts.into_iter().map(placed)
        };
        (0..self.records.len()).flat_map(of).collect()
    }

    /// Innovations of one trial.
    pub(crate) fn innovations(&self, theta: &DVector<f64>, record: usize) -> Vec<Innovation> {
        self.likelihood(theta, record, Wanted::Innovations).innovations
    }

    fn likelihood(&self, theta: &DVector<f64>, record: usize, wanted: Wanted) -> Likelihood {
        self.likelihood_of(&self.records[record], &self.values(theta, record), wanted)
    }

    fn likelihood_of(&self, record: &Record, values: &Values, wanted: Wanted) -> Likelihood {
        let Record { tracks, turning, parts, .. } = record;
        let of = |Part { measurements, start, steps }: &Part| {
            let all = || {
                let first_s = measurements.first_s();
                driven(measurements, Drive::new(tracks, turning.as_ref(), &law_of(values), first_s))
            };
            let pass = |steps: &mut dyn Iterator<Item = DrivenStep>| {
                likelihood(measurements, steps, &self.active, values, *start, wanted)
            };
            match steps.get(values, measurements.samples(), || all().collect()) {
                Some(kept) => pass(&mut kept.iter().copied()),
                None => pass(&mut all()),
            }
        };
        let all = parts.iter().map(of).reduce(Likelihood::and);
        all.unwrap_or_else(|| Likelihood::of_nothing(&self.active, wanted))
    }

    /// A trial that was not fitted, at the values of those that were; what each trial has by
    /// itself, and its noise, is left to be found, from the start that comes with it.
    pub(crate) fn of_another<'b>(
        &'b self,
        theta: &DVector<f64>,
        other: &'b Record,
    ) -> (Problem<'b>, DVector<f64>) {
        let is_own = |unknown: &Unknown| unknown.is_of_trial() || unknown.is_noise();
        let measures = |unknown: &Unknown| match unknown {
            Unknown::LogVelocityNoise => other.period_s(Instrument::Velocity).is_some(),
            Unknown::LogPositionNoise => other.period_s(Instrument::Position).is_some(),
            Unknown::LogAccelerationNoise | Unknown::LogLeak | Unknown::AccelerationOffset => {
                other.period_s(Instrument::Acceleration).is_some()
            }
            _ => true,
        };
        let own: Vec<Unknown> =
            self.active.unknowns.iter().copied().filter(|u| is_own(u) && measures(u)).collect();
        let fitted = self.values(theta, 0);
        let problem = Problem::new(std::slice::from_ref(other), &own, self.priors, fitted);
        // A current is of a place and a heading: that of another trial is no start.
        let start = |unknown: &Unknown| {
            if unknown.is_of_trial() { 0.0 } else { fitted.get(*unknown) }
        };
        let start = DVector::from_iterator(problem.len(), problem.numbers.iter().map(start));
        (problem, start)
    }

    fn prior_cost(&self, theta: &DVector<f64>) -> f64 {
        let of = |(place, prior): (usize, Prior)| prior.belief.cost(theta[place]).0;
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
        self.records.iter().map(Record::samples).sum()
    }
}

/// What the unknowns say of the shape of a model.
fn shape_with(shape: Shape, unknowns: &[Unknown]) -> Shape {
    let has = |unknown: Unknown| unknowns.contains(&unknown);
    let sensor = if has(Unknown::LogSensorLag) {
        Sensor::Lag
    } else if has(Unknown::LogSensorWindow) {
        Sensor::Window
    } else {
        shape.sensor
    };
    let swell = shape.swell || has(Unknown::LogSwell);
    let drift = shape.drift || has(Unknown::LogDrift);
    Shape { sensor, swell, drift, exponent: has(Unknown::Exponent), ..shape }
}
