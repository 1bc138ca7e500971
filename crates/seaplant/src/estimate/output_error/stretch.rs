//! Stretches of record without a gap in force, cut into integration steps.

use crate::evaluate::{between_gaps, starting_velocity};
use crate::navigation::Motion;
use crate::{AxisRecord, Error, State, Timed};

/// The longest step of the integration, s: drag changes a vehicle's speed over seconds.
const LONGEST_STEP_S: f64 = 0.1;

/// Times nearer than this are one: decimal time stamps are rounded.
const ROUNDING_S: f64 = 1e-7;

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
    /// What was measured.
    pub(super) value: f64,
    /// Steps that lead to it from the one before.
    pub(super) steps: usize,
}

/// A stretch of record with an initial state of its own.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    /// What its samples are.
    pub(super) measured: Measured,
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
        for (from_s, to_s) in between_gaps(axis, series) {
            let parts = series.window(from_s, to_s).zip(velocity.window(from_s, to_s));
            let Some((part, velocity)) = parts else { continue };
            if part.len() > LEAST_SAMPLES {
                let velocity = starting_velocity(axis, &velocity)?;
                stretches.push(Self::of(axis, &part, velocity));
            }
        }
        Ok(stretches)
    }

    fn of(axis: &AxisRecord, part: &Timed, velocity: f64) -> Self {
        let (measured, position) = match axis.motion {
            Motion::Velocity(_) => (Measured::Velocity, 0.0),
            Motion::Position(_) => (Measured::Position, part.values()[0]),
        };
        let mut stretch = Self {
            measured,
            start: State { position, velocity },
            steps: Vec::with_capacity(part.len()),
            samples: Vec::with_capacity(part.len()),
            period_s: part.period_s(),
        };
        let (changes, taus) = (axis.force.time_s(), axis.force.values());
        let mut t = part.first_s();
        let mut next = changes.partition_point(|&change| change <= t + ROUNDING_S);
        for (&until, &value) in part.time_s().iter().zip(part.values()) {
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
            stretch.samples.push(Sample { value, steps: stretch.steps.len() - before });
        }
        stretch
    }

    /// Adds equal steps under one force.
    fn hold(&mut self, tau: f64, span_s: f64) {
        let count = ((span_s - ROUNDING_S) / LONGEST_STEP_S).ceil().max(1.0);
        let step = Step { span_s: span_s / count, tau };
        self.steps.extend(std::iter::repeat_n(step, count as usize));
    }

    /// Σ of squares of what was measured; of position, of how far it went.
    pub(super) fn squares(&self) -> f64 {
        let from = self.start.position;
        self.samples.iter().map(|sample| (sample.value - from).powi(2)).sum()
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.samples.len() as f64 * self.period_s
    }
}

/// Position and velocity at the start explain this many samples whatever the plant.
const LEAST_SAMPLES: usize = 2;
