//! Sections of a record that can be simulated from one initial state, divided into integration
//! steps.

use crate::estimate::propellers::LONGEST_STEP_S;
use crate::navigation::Motion;
use crate::series::ROUNDING_S;
use crate::trial::starting_velocity;
use crate::{AxisRecord, Error, State, Timed};

/// Kind of measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measured {
    /// Velocity, m/s or rad/s.
    Velocity,
    /// Position, m or rad.
    Position,
}

/// A time span of constant force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// Length, s.
    pub(super) span_s: f64,
    /// Force, N or N m.
    pub(super) tau: f64,
}

/// A measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// Kind of measurement.
    pub(super) measured: Measured,
    /// Number of steps since the previous sample; with 16 bytes a sample is faster to read than
    /// with 24.
    pub(super) steps: u32,
    /// Measured value.
    pub(super) value: f64,
}

/// A section of a record with its own initial state.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    /// True if its samples include positions.
    pub(super) has_position: bool,
    /// First estimate of the initial state.
    pub(super) start: State,
    /// All steps, in order of time.
    pub(super) steps: Vec<Step>,
    /// All samples, in order of time; no step precedes the first.
    pub(super) samples: Vec<Sample>,
    /// Time per sample, s.
    pub(super) period_s: f64,
}

impl Stretch {
    /// Returns the sections of a record with more samples than their initial state explains.
    ///
    /// # Errors
    /// [`Error::TooShort`] for a single position.
    pub(super) fn all_of(axis: &AxisRecord) -> Result<Vec<Self>, Error> {
        let series = axis.motion.series();
        let velocity = axis.velocity()?;
        let mut stretches = Vec::new();
        for (from_s, to_s) in axis.parts() {
            let parts = series.window(from_s, to_s).zip(velocity.window(from_s, to_s));
            let Some((part, velocity)) = parts else { continue };
            if part.len() > LEAST_SAMPLES {
                let velocity = starting_velocity(axis, &velocity)?;
                stretches.push(Self::of(axis, &Readings::of(axis, part), velocity));
            }
        }
        Ok(stretches)
    }

    fn of(axis: &AxisRecord, readings: &Readings, velocity: f64) -> Self {
        let first_position = readings.position.as_ref().map(|position| position.values()[0]);
        let mut stretch = Self {
            has_position: first_position.is_some(),
            start: State { position: first_position.unwrap_or(0.0), velocity },
            steps: Vec::with_capacity(readings.len()),
            samples: Vec::with_capacity(readings.len()),
            period_s: readings.period_s(),
        };
        let (changes, taus) = (axis.force.time_s(), axis.force.values());
        let mut t = readings.first_s();
        let mut next = changes.partition_point(|&change| change <= t + ROUNDING_S);
        for (measured, until, value) in readings.in_order() {
            let before = stretch.steps.len();
            while until - t > ROUNDING_S {
                let change = changes.get(next).filter(|change| **change < until - ROUNDING_S);
                let stop = change.copied().unwrap_or(until);
                stretch.hold(taus[next.max(1) - 1], stop - t);
                t = stop;
                while changes.get(next).is_some_and(|change| *change <= t + ROUNDING_S) {
                    next += 1;
                }
            }
            let steps = (stretch.steps.len() - before) as u32;
            stretch.samples.push(Sample { measured, steps, value });
        }
        stretch
    }

    /// Adds equal steps at constant force.
    fn hold(&mut self, tau: f64, span_s: f64) {
        let count = ((span_s - ROUNDING_S) / LONGEST_STEP_S).ceil().max(1.0);
        let step = Step { span_s: span_s / count, tau };
        self.steps.extend(std::iter::repeat_n(step, count as usize));
    }

    pub(super) fn measures(&self, measured: Measured) -> bool {
        match measured {
            Measured::Velocity => self.samples.iter().any(|s| s.measured == measured),
            Measured::Position => self.has_position,
        }
    }

    /// Returns Σ of the squared samples of one kind and their number; for position, of the
    /// displacement.
    pub(super) fn squares(&self, measured: Measured) -> (f64, usize) {
        let rest = match measured {
            Measured::Velocity => 0.0,
            Measured::Position => self.start.position,
        };
        let of_kind = self.samples.iter().filter(|sample| sample.measured == measured);
        of_kind
            .fold((0.0, 0), |(sum, count), sample| (sum + (sample.value - rest).powi(2), count + 1))
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.samples.len() as f64 * self.period_s
    }
}

/// Number of samples that an initial state explains for any plant.
const LEAST_SAMPLES: usize = 2;

/// Measurements of one section, each kind at its own times.
struct Readings {
    velocity: Option<Timed>,
    position: Option<Timed>,
}

impl Readings {
    /// Uses position in addition to velocity where both were measured, but not together with a
    /// velocity differentiated from it.
    fn of(axis: &AxisRecord, motion: Timed) -> Self {
        match axis.motion {
            Motion::Position(_) => Self { velocity: None, position: Some(motion) },
            Motion::Acceleration(_) => Self { velocity: None, position: None },
            Motion::Velocity(_) => {
                let inside = |x: &Timed| x.window(motion.first_s(), motion.last_s());
                let position = axis.believable_position().as_ref().and_then(inside);
                let position = position.filter(|position| position.len() > LEAST_SAMPLES);
                Self { velocity: Some(motion), position }
            }
        }
    }

    fn all(&self) -> impl Iterator<Item = &Timed> {
        self.velocity.iter().chain(&self.position)
    }

    fn len(&self) -> usize {
        self.all().map(Timed::len).sum()
    }

    fn first_s(&self) -> f64 {
        self.all().map(Timed::first_s).fold(f64::INFINITY, f64::min)
    }

    /// Returns the time per sample, s.
    fn period_s(&self) -> f64 {
        1.0 / self.all().map(|series| 1.0 / series.period_s()).sum::<f64>()
    }

    /// Returns kind, time and value of each sample, in order of time.
    fn in_order(&self) -> impl Iterator<Item = (Measured, f64, f64)> {
        let mut velocity = samples(Measured::Velocity, self.velocity.as_ref()).peekable();
        let mut position = samples(Measured::Position, self.position.as_ref()).peekable();
        std::iter::from_fn(move || match (velocity.peek(), position.peek()) {
            (Some((_, velocity_s, _)), Some((_, position_s, _))) if position_s < velocity_s => {
                position.next()
            }
            (Some(_), _) => velocity.next(),
            _ => position.next(),
        })
    }
}

fn samples(
    measured: Measured,
    series: Option<&Timed>,
) -> impl Iterator<Item = (Measured, f64, f64)> + '_ {
    series.into_iter().flat_map(move |series| {
        series
            .time_s()
            .iter()
            .zip(series.values())
            .map(move |(&t_s, &value)| (measured, t_s, value))
    })
}
