//! Stretches of record that can be followed from one state, cut into integration steps.

use crate::navigation::Motion;
use crate::series::ROUNDING_S;
use crate::trial::starting_velocity;
use crate::{AxisRecord, Error, State, Timed};

/// The longest step of the integration, s: drag changes a vehicle's speed over seconds.
const LONGEST_STEP_S: f64 = 0.1;

/// What a stretch measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measured {
    /// m/s or rad/s.
    Velocity,
    /// m or rad.
    Position,
}

/// A span of constant force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// Its length, s.
    pub(super) span_s: f64,
    /// N or N m.
    pub(super) tau: f64,
}

/// A measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// Of what.
    pub(super) measured: Measured,
    /// Steps that lead to it from the one before; 16 bytes a sample are quicker to read
    /// than 24.
    pub(super) steps: u32,
    /// What it reads.
    pub(super) value: f64,
}

/// A stretch of record with an initial state of its own.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    /// Whether positions are among its samples.
    pub(super) has_position: bool,
    /// A first idea of its initial state.
    pub(super) start: State,
    /// All steps, in order.
    pub(super) steps: Vec<Step>,
    /// All samples, in order; no step leads to the first.
    pub(super) samples: Vec<Sample>,
    /// Time that one sample stands for, s.
    pub(super) period_s: f64,
}

impl Stretch {
    /// The stretches of a record that say more than their own initial state.
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

    /// Adds equal steps under one force.
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

    /// How many samples of one kind there are, and Σ of their squares; of position, of how
    /// far it went.
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

/// Position and velocity at the start explain this many samples whatever the plant.
const LEAST_SAMPLES: usize = 2;

/// What was measured of one stretch, each kind at its own times.
struct Readings {
    velocity: Option<Timed>,
    position: Option<Timed>,
}

impl Readings {
    /// Position joins velocity where both were measured; a velocity that is the derivative
    /// of position would say the same twice.
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

    /// Time that one sample stands for, s.
    fn period_s(&self) -> f64 {
        1.0 / self.all().map(|series| 1.0 / series.period_s()).sum::<f64>()
    }

    /// Every sample with what it is of and its time, in order of time.
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
