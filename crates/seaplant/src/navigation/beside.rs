//! What all axes did, thinned out: enough to tell whether one can be identified without the rest.

use std::collections::BTreeMap;

use super::{Navigated, TRANSLATIONS};
use crate::{Dof, Timed};

/// Longer series are thinned to about so many samples: of a day, one in two seconds is left.
const MOST_SAMPLES: usize = 50_000;

/// Velocities and attitude of the whole vehicle, as far as they were logged.
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
    pub(super) fn of(nav: &Navigated) -> Self {
        let mut velocity = BTreeMap::new();
        for dof in TRANSLATIONS {
            velocity.extend(nav.measured.get(&dof).map(|v| (dof, thinned(v))));
        }
        for (dof, rate) in
            [Dof::Roll, Dof::Pitch, Dof::Yaw].into_iter().zip(nav.rates.iter().flatten())
        {
            // A rate that nobody measured is written as zero.
            if rate.values().iter().any(|rate| *rate != 0.0) {
                velocity.insert(dof, thinned(rate));
            }
        }
        let angle = |dof| nav.position.get(&dof).map(thinned);
        Self { velocity, roll: angle(Dof::Roll), pitch: angle(Dof::Pitch) }
    }
}

fn thinned(series: &Timed) -> Timed {
    let stride = series.len().div_ceil(MOST_SAMPLES);
    if stride == 1 {
        return series.clone();
    }
    let pick = |from: &[f64]| from.iter().step_by(stride).copied().collect::<Vec<_>>();
    // A part of a series that was checked is finite and in order.
    Timed::new("beside", pick(series.time_s()), pick(series.values()))
        .unwrap_or_else(|_| series.clone())
}
