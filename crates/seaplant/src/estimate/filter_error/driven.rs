//! The steps through a part of a trial with the thrust over each, kept while the actuators stay.

use std::sync::{Arc, Mutex, PoisonError};

use super::parameters::{Unknown, Values};
use super::schedule::{Measurements, Stop};
use crate::estimate::propellers::{Drive, DriveLaw, Push};

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
    last: Option<DriveLaw>,
    steps: Option<(DriveLaw, Arc<[DrivenStep]>)>,
}

/// The unknowns that shape thrust, in the order of [`DriveNumber`](crate::estimate::propellers::DriveNumber).
pub(super) const SHAPING: [Unknown; 7] = [
    Unknown::Lag,
    Unknown::LogLagRatio,
    Unknown::Slew,
    Unknown::Delay,
    Unknown::LogReverseRatio,
    Unknown::LogForwardRatio,
    Unknown::Exponent,
];

/// All that thrust depends on besides the log.
pub(super) fn law_of(values: &Values) -> DriveLaw {
    DriveLaw {
        lag_s: values.get(Unknown::Lag),
        log_lag_ratio: values.get(Unknown::LogLagRatio),
        slew_s: values.get(Unknown::Slew),
        delay_s: values.get(Unknown::Delay),
        log_reverse_ratio: values.get(Unknown::LogReverseRatio),
        beyond_square: values.get(Unknown::Exponent),
        full_speed: values.shape.full_speed,
        is_linear: values.shape.linear,
        has_exponent: values.shape.exponent,
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
        let law = law_of(values);
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let before = kept.last.replace(law);
        match &kept.steps {
            Some((of, steps)) if *of == law => return Some(Arc::clone(steps)),
            _ if before != Some(law) || samples > MOST_KEPT => return None,
            _ => {}
        }
        let steps = steps();
        kept.steps = Some((law, Arc::clone(&steps)));
        Some(steps)
    }
}

/// The steps through all measurements, with the thrust over each.
pub(super) fn driven(
    measurements: &Measurements,
    mut drive: Drive<'_>,
) -> impl Iterator<Item = DrivenStep> {
    measurements.steps().map(move |stop| {
        let push = if stop.length_s > 0.0 {
            drive.until(stop.time_s, stop.length_s)
        } else {
            Push::default()
        };
        (stop, push)
    })
}
