//! The steps through a part of a trial with the thrust over each, kept while the actuators stay.

use std::sync::{Arc, Mutex, PoisonError};

use super::drive::{Drive, Push, SHAPING};
use super::parameters::Values;
use super::schedule::{Measurements, Stop};

/// A step and the thrust over it.
pub(super) type DrivenStep = (Stop, Push);

/// Longer parts are computed again in each pass: what is kept of them would fill the memory.
const MOST_KEPT: usize = 100_000;

/// The steps of the actuators that two passes asked for; most passes of a fit ask for the same.
#[derive(Debug, Default)]
pub(super) struct KeptSteps(Mutex<Kept>);

#[derive(Debug, Default)]
struct Kept {
    /// The actuators of the last pass.
    last: Option<ActuatorNumbers>,
    steps: Option<(ActuatorNumbers, Arc<[DrivenStep]>)>,
}

/// All that thrust depends on besides the log.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ActuatorNumbers {
    shaping: [f64; SHAPING.len()],
    full_speed: f64,
    linear: bool,
    exponent: bool,
}

impl ActuatorNumbers {
    fn new(values: &Values) -> Self {
        Self {
            shaping: SHAPING.map(|unknown| values.get(unknown)),
            full_speed: values.shape.full_speed,
            linear: values.shape.linear,
            exponent: values.shape.exponent,
        }
    }
}

/// A copy has nothing to keep yet: its measurements may change.
impl Clone for KeptSteps {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl KeptSteps {
    /// Returns the steps if they are kept, or are kept from now on.
    pub(super) fn get(
        &self,
        values: &Values,
        samples: usize,
        steps: impl FnOnce() -> Arc<[DrivenStep]>,
    ) -> Option<Arc<[DrivenStep]>> {
        let numbers = ActuatorNumbers::new(values);
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let before = kept.last.replace(numbers);
        match &kept.steps {
            Some((of, steps)) if *of == numbers => return Some(Arc::clone(steps)),
            _ if before != Some(numbers) || samples > MOST_KEPT => return None,
            _ => {}
        }
        let steps = steps();
        kept.steps = Some((numbers, Arc::clone(&steps)));
        Some(steps)
    }
}

/// The steps through all measurements, with the thrust over each.
pub(super) fn driven(
    measurements: &Measurements,
    mut drive: Drive<'_>,
) -> impl Iterator<Item = DrivenStep> {
    measurements.steps().map(move |stop| {
        let push = if stop.length_s > 0.0 { drive.until(&stop) } else { Push::default() };
        (stop, push)
    })
}
