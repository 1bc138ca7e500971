//! The steps of a trial: where the filter predicts to, and what was measured there.

use std::collections::BTreeSet;

use crate::estimate::propellers::steps_between;
use crate::navigation::{MeanAcceleration, MeanOver, Motion};
use crate::series::ROUNDING_S;
use crate::{AxisRecord, Timed};

/// A new state explains so many samples whatever the plant.
const LEAST_SAMPLES: usize = 3;

/// What was measured at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Measured {
    /// m/s or rad/s.
    pub(crate) velocity: Option<f64>,
    /// m or rad.
    pub(crate) position: Option<f64>,
    /// What a metre of unknown lever arm adds to the velocity, for two axes.
    pub(crate) lever: [f64; 2],
    /// A mean acceleration, m/s², and over how long, s.
    pub(crate) acceleration: Option<(f64, f64)>,
    /// Whether a mean acceleration begins here.
    pub(crate) opens: bool,
}

/// What measures a degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Instrument {
    /// m/s or rad/s.
    Velocity,
    /// m or rad.
    Position,
    /// m/s².
    Acceleration,
}

impl Instrument {
    pub(crate) const ALL: [Self; 3] = [Self::Velocity, Self::Position, Self::Acceleration];
}

/// The end of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stop {
    /// When, s.
    pub(crate) time_s: f64,
    /// Length of the step that ends here, s; 0 at the first instant.
    pub(crate) length_s: f64,
    /// What was measured here.
    pub(crate) measured: Measured,
}

/// What a record measured of one degree of freedom, each instrument at its own times.
#[derive(Clone, Debug)]
pub(crate) struct Measurements {
    velocity: Option<Timed>,
    position: Option<Timed>,
    acceleration: Option<MeanAcceleration>,
    /// For each sample of velocity; empty where the vehicle's turning is not known.
    lever: Vec<[f64; 2]>,
}

impl Measurements {
    pub(crate) fn of(axis: &AxisRecord) -> Self {
        let (velocity, position) = match &axis.motion {
            Motion::Velocity(velocity) => (Some(velocity.clone()), axis.believable_position()),
            Motion::Position(position) => (None, Some(position.clone())),
            Motion::Acceleration(_) => (None, None),
        };
        let acceleration = axis.acceleration.clone();
        let lever = velocity.as_ref().zip(axis.lever_rates.as_ref()).map(|(velocity, [a, b])| {
            velocity.time_s().iter().map(|&t| [a.at(t), b.at(t)]).collect()
        });
        Self { velocity, position, acceleration, lever: lever.unwrap_or_default() }
    }

    /// [`Measurements::of`] a record, apart where it must be followed from a new state: after
    /// long gaps, gaps of force and turns that nobody saw.
    pub(crate) fn parts_of(axis: &AxisRecord) -> Vec<Self> {
        let (whole, mut spans) = (Self::of(axis), axis.parts());
        // One instrument may start before the other, or go on after it.
        if let Some(first) = spans.first_mut() {
            first.0 = f64::NEG_INFINITY;
        }
        if let Some(last) = spans.last_mut() {
            last.1 = f64::INFINITY;
        }
        let parts = spans.into_iter().map(|(from_s, to_s)| whole.window(from_s, to_s));
        parts.filter(|part| part.samples() >= LEAST_SAMPLES).collect()
    }

    pub(crate) fn window(&self, from_s: f64, to_s: f64) -> Self {
        let cut = |series: &Timed| series.window(from_s, to_s);
        let velocity = self.velocity.as_ref().and_then(cut);
        let before = |velocity: &Timed| velocity.time_s().partition_point(|t| *t < from_s);
        let rows = self.velocity.as_ref().zip(velocity.as_ref());
        let rows = rows.map(|(all, part)| before(all)..before(all) + part.len());
        let lever = rows.and_then(|rows| self.lever.get(rows)).unwrap_or_default();
        let acceleration = self.acceleration.as_ref().and_then(|all| all.window(from_s, to_s));
        let position = self.position.as_ref().and_then(cut);
        Self { lever: lever.to_vec(), position, acceleration, velocity }
    }

    pub(crate) fn velocity(&self) -> Option<&Timed> {
        self.velocity.as_ref()
    }

    pub(crate) fn position(&self) -> Option<&Timed> {
        self.position.as_ref()
    }

    /// What one instrument measured.
    pub(crate) fn of_instrument(&self, instrument: Instrument) -> Option<&Timed> {
        match instrument {
            Instrument::Velocity => self.velocity(),
            Instrument::Position => self.position(),
            Instrument::Acceleration => self.acceleration.as_ref().map(|all| &all.mean),
        }
    }

    /// Leaves out samples by their instrument and number; at least two of each stay.
    pub(crate) fn strike_out(&mut self, samples: &BTreeSet<(Instrument, usize)>) {
        let is_out = |instrument, k| samples.contains(&(instrument, k));
        let kept = |series: &Timed, instrument| {
            let (t, x) = (series.time_s(), series.values());
            let kept = (0..series.len()).filter(|k| !is_out(instrument, *k));
            let (t, x): (Vec<f64>, Vec<f64>) = kept.map(|k| (t[k], x[k])).unzip();
            (t.len() > 1).then(|| Timed::new("what is left of a series", t, x).ok())?
        };
        if let Some(velocity) = &self.velocity
            && let Some(left) = kept(velocity, Instrument::Velocity)
        {
            let mut numbered = 0..;
            self.lever.retain(|_| numbered.next().is_none_or(|k| !is_out(Instrument::Velocity, k)));
            self.velocity = Some(left);
        }
        if let Some(position) = &self.position
            && let Some(left) = kept(position, Instrument::Position)
        {
            self.position = Some(left);
        }
    }

    /// How many measurements there are.
    pub(crate) fn samples(&self) -> usize {
        Instrument::ALL.into_iter().filter_map(|one| self.of_instrument(one)).map(Timed::len).sum()
    }

    /// When the first was taken, s.
    pub(crate) fn first_s(&self) -> f64 {
        let both = [&self.velocity, &self.position].into_iter().flatten().map(Timed::first_s);
        let opened = self.acceleration.iter().map(|all| all.from_s[0]);
        both.chain(opened).fold(f64::INFINITY, f64::min)
    }

    /// The steps through all of them: every measurement is the end of one, and none is
    /// longer than 0.1 s.
    pub(crate) fn steps(&self) -> impl Iterator<Item = Stop> + '_ {
        let mut before = None;
        self.in_order().flat_map(move |(to_s, measured)| {
            steps_between(before.replace(to_s), to_s).map(move |(time_s, length_s)| {
                let measured = if time_s == to_s { measured } else { Measured::default() };
                Stop { time_s, length_s, measured }
            })
        })
    }

    fn in_order(&self) -> impl Iterator<Item = (f64, Measured)> + '_ {
        fn samples(series: Option<&Timed>) -> impl Iterator<Item = (usize, (f64, f64))> + '_ {
            let (t, x) = series.map_or((&[][..], &[][..]), |x| (x.time_s(), x.values()));
            (t.iter().copied()).zip(x.iter().copied()).enumerate()
        }
        let mut velocity = samples(self.velocity()).peekable();
        let mut position = samples(self.position()).peekable();
        let mut felt = self.acceleration.iter().flat_map(edges).peekable();
        std::iter::from_fn(move || {
            let next =
                |sample: Option<&(usize, (f64, f64))>| sample.map_or(f64::INFINITY, |s| s.1.0);
            let felt_s = felt.peek().map_or(f64::INFINITY, |edge| edge.0);
            let time_s = next(velocity.peek()).min(next(position.peek())).min(felt_s);
            let mut measured = Measured::default();
            let is_now = |sample: &(usize, (f64, f64))| sample.1.0 <= time_s + ROUNDING_S;
            if let Some((k, (_, v))) = velocity.next_if(is_now) {
                measured.velocity = Some(v);
                measured.lever = self.lever.get(k).copied().unwrap_or_default();
            }
            measured.position = position.next_if(is_now).map(|(_, (_, p))| p);
            if let Some((_, mean)) = felt.next_if(|edge| edge.0 <= time_s + ROUNDING_S) {
                measured.acceleration = mean;
                measured.opens = true;
            }
            time_s.is_finite().then_some((time_s, measured))
        })
    }
}

/// The ends of the windows of mean accelerations, each with its mean and length, and the beginnings
/// of those that do not follow another.
fn edges(all: &MeanAcceleration) -> impl Iterator<Item = (f64, Option<(f64, f64)>)> + '_ {
    let mut before_s = f64::NEG_INFINITY;
    all.windows().flat_map(move |MeanOver { from_s, to_s, mean }| {
        let follows = from_s - before_s <= ROUNDING_S;
        before_s = to_s;
        let begins = (!follows).then_some((from_s, None));
        begins.into_iter().chain([(to_s, Some((mean, to_s - from_s)))])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::propellers::LONGEST_STEP_S;

    fn series(time_s: &[f64], values: &[f64]) -> Timed {
        Timed::new("test", time_s.to_vec(), values.to_vec()).expect("valid")
    }

    #[test]
    fn two_instruments_are_met_in_order_and_once_where_they_meet() {
        let measurements = Measurements {
            velocity: Some(series(&[0.0, 0.1, 0.4], &[1.0, 2.0, 3.0])),
            acceleration: None,
            position: Some(series(&[-0.05, 0.1 + 1e-9, 0.5], &[10.0, 11.0, 12.0])),
            lever: vec![[0.1, 0.0], [0.2, 0.0], [0.3, 0.0]],
        };
        let stops: Vec<Stop> = measurements.steps().collect();
        let seen: Vec<(Option<f64>, Option<f64>)> =
            stops.iter().map(|s| (s.measured.velocity, s.measured.position)).collect();
        let nothing = (None, None);
        assert_eq!(
            seen,
            [
                (None, Some(10.0)),
                (Some(1.0), None),
                (Some(2.0), Some(11.0)),
                nothing,
                nothing,
                (Some(3.0), None),
                (None, Some(12.0))
            ]
        );
        assert_eq!(measurements.samples(), 6);
        assert_eq!(stops[2].measured.lever, [0.2, 0.0]);
        let travelled: f64 = stops.iter().map(|stop| stop.length_s).sum();
        assert!((travelled - 0.55).abs() < 1e-12);
        assert!(
            stops.windows(2).all(|w| (w[1].time_s - w[0].time_s - w[1].length_s).abs() < 1e-12)
        );
        assert!(stops.iter().all(|stop| stop.length_s < LONGEST_STEP_S + 1e-6));
    }

    #[test]
    fn a_gap_of_years_is_not_stepped_through() {
        let seconds = |from_s: f64| (0..50).map(move |k| from_s + 0.1 * f64::from(k));
        let times: Vec<f64> = seconds(0.0).chain(seconds(1.7e9)).collect();
        let still = |times: &[f64]| series(times, &vec![0.5; times.len()]);
        let axis = AxisRecord {
            dof: crate::Dof::Heave,
            trial: "a".to_owned(),
            force: series(&[0.0], &[1.0]),
            thrusters: Vec::new(),
            motion: Motion::Velocity(still(&times)),
            lever_rates: Some([still(&times), still(&times)]),
            turning: None,
            position: None,
            acceleration: None,
            cuts: Vec::new(),
        };
        let parts = Measurements::parts_of(&axis);
        assert_eq!(parts.iter().map(Measurements::samples).collect::<Vec<_>>(), [50, 50]);
        for part in parts {
            let stops: Vec<Stop> = part.steps().collect();
            assert!(stops.len() <= 100, "{}", stops.len());
            assert!(
                stops
                    .iter()
                    .filter(|stop| stop.measured.velocity.is_some())
                    .all(|stop| stop.measured.lever == [0.5; 2])
            );
        }
    }

    #[test]
    fn what_is_struck_out_is_not_measured() {
        let mut measurements = Measurements {
            velocity: Some(series(&[0.0, 0.1, 0.2], &[1.0, 9.0, 3.0])),
            acceleration: None,
            position: Some(series(&[0.0, 0.2], &[10.0, 12.0])),
            lever: vec![[0.1, 0.0], [0.2, 0.0], [0.3, 0.0]],
        };
        measurements.strike_out(&BTreeSet::from([(Instrument::Velocity, 1)]));
        let left: Vec<f64> =
            measurements.steps().filter_map(|stop| stop.measured.velocity).collect();
        assert_eq!(left, [1.0, 3.0]);
        assert_eq!((measurements.samples(), measurements.lever[1]), (4, [0.3, 0.0]));
    }
}
