//! The initial velocity of a simulation of a record.

use crate::navigation::Motion;
use crate::signal::{LowPass, differentiate};
use crate::{AxisRecord, Error, Grid, Timed};

/// Low-pass filter for the initial velocity of a simulation: a single raw sample may be dominated
/// by noise.
const START_FILTER: LowPass = LowPass { cutoff_hz: 0.5, order: 2 };

/// Duration of the filtered part of the record, s.
const START_S: f64 = 30.0;

/// Returns the first velocity of a record, smoothed unless it is too short.
pub(crate) fn starting_velocity(axis: &AxisRecord, part: &Timed) -> Result<f64, Error> {
    let raw = part.values()[0];
    // Samples in bursts have a shorter median period than their number allows.
    let mean_s = (part.last_s() - part.first_s()) / part.len() as f64;
    let period = part.period_s().max(mean_s / MOST_FINER);
    if part.len() < LEAST_TO_SMOOTH || 2.5 * START_FILTER.cutoff_hz * period > 1.0 {
        return Ok(raw);
    }
    let to_s = (part.first_s() + START_S).min(part.last_s());
    let grid = Grid::spanning(part.first_s(), to_s, period);
    let values = match &axis.motion {
        Motion::Velocity(velocity) => velocity.interpolate(grid),
        Motion::Position(position) => differentiate(&position.interpolate(grid), period)?,
        Motion::Acceleration(_) => return Err(Error::NoVelocity),
    };
    if values.len() < LEAST_TO_SMOOTH {
        return Ok(raw);
    }
    Ok(START_FILTER.zero_phase(&values, 1.0 / period)?[0])
}

/// Largest number of grid instants per sample.
const MOST_FINER: f64 = 4.0;

/// One sample more than the edge extension of [`START_FILTER`].
const LEAST_TO_SMOOTH: usize = 10;
