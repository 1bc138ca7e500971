//! Motion along all axes, decimated: enough to decide whether one axis can be identified alone.

use std::collections::BTreeMap;

use super::{Navigated, TRANSLATIONS};
use crate::{Dof, Timed};

/// Longer series are decimated to about this many samples: a day's to one in two seconds.
const MOST_SAMPLES: usize = 50_000;

/// Velocities and attitude of the vehicle, as far as they were logged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beside {
    /// Body velocity along each axis, m/s or rad/s.
    pub velocity: BTreeMap<Dof, Timed>,
    /// Roll, rad.
    pub roll: Option<Timed>,
    /// Pitch, rad.
    pub pitch: Option<Timed>,
}

impl Beside {
    pub(super) fn new(nav: &Navigated) -> Self {
        let mut velocity = BTreeMap::new();
        for dof in TRANSLATIONS {
            velocity.extend(nav.measured.get(&dof).map(|v| (dof, decimated(v))));
        }
        for (dof, rate) in
            [Dof::Roll, Dof::Pitch, Dof::Yaw].into_iter().zip(nav.rates.iter().flatten())
        {
            // A rate that was not measured is stored as zero.
            if rate.values().iter().any(|rate| *rate != 0.0) {
                velocity.insert(dof, decimated(rate));
            }
        }
        let angle = |dof| nav.position.get(&dof).map(decimated);
        Self { velocity, roll: angle(Dof::Roll), pitch: angle(Dof::Pitch) }
    }
}

fn decimated(series: &Timed) -> Timed {
    let stride = series.len().div_ceil(MOST_SAMPLES);
    if stride == 1 {
        return series.clone();
    }
    let pick = |from: &[f64]| from.iter().step_by(stride).copied().collect::<Vec<_>>();
    // A subset of a valid series is valid.
    Timed::new("beside", pick(series.time_s()), pick(series.values()))
        .unwrap_or_else(|_| series.clone())
}
