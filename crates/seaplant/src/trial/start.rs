//! The velocity that a simulation of a record starts from.

use crate::navigation::Motion;
use crate::signal::{LowPass, differentiate};
use crate::{AxisRecord, Error, Grid, Timed};

/// The velocity that a simulation starts from is read off the record below this
/// frequency: one raw sample may be all noise.
const START_FILTER: LowPass = LowPass { cutoff_hz: 0.5, order: 2 };

/// Seconds of record that the start is read off.
const START_S: f64 = 30.0;

/// The first velocity of a record, smoothed; or as it is where it is too short for that.
pub(crate) fn starting_velocity(axis: &AxisRecord, part: &Timed) -> Result<f64, Error> {
    let raw = part.values()[0];
    // Samples that come in bursts have a shorter period than there are samples for.
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

/// A grid has so many instants for each sample at most.
const MOST_FINER: f64 = 4.0;

/// The edge extension of [`START_FILTER`], and one.
const LEAST_TO_SMOOTH: usize = 10;
