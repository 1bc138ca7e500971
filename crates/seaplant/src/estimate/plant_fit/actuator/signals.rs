//! Signals of thrusters as they act, for effects that depend on them.

use std::collections::BTreeMap;

use super::super::differences::{Own, own_numbers};
use super::{Actuator, MOST_DEAD_BAND};
use crate::estimate::propellers::DriveNumber;
use crate::motion::Slice;
use crate::plant::{Plant, Signal, ThrusterNumber};
use crate::{Error, PlacedThruster, ThrusterTrack, Timed, TrialRecord};

impl Actuator {
    /// The signals of a record: mean values over slices, with the sign of thrust.
    ///
    /// They are the speed that each propeller of a plant has in place of the one that is logged, rad/s, its thrust by
    /// the numbers of all, N, and the change of what it gives of that by each number λ of its own, with its gain g:
    /// `g (F(λ) − F(0))/λ`, or the derivative where it has none.
    ///
    /// # Errors
    /// As [`Self::acting`].
    pub(crate) fn signals(
        &self,
        record: &TrialRecord,
        plant: &Plant,
    ) -> Result<BTreeMap<Signal, Timed>, Error> {
        let mut signals = match self.steering.is_prompt() {
            true => record.signals.clone(),
            false => record.with_surfaces_behind(record, &self.steering)?.signals,
        };
        let own_numbers = own_numbers(plant);
        let none: [Option<Timed>; 6] = [const { None }; 6];
        for PlacedThruster { name, track, .. } in &record.thrusters {
            let mut alone = none.clone();
            alone[0] = Some(track.speed.clone());
            let Own { lag_s, dead_band, gain } = own_numbers.get(name).copied().unwrap_or_default();
            let late = Self { lag_s: (self.lag_s + lag_s).max(0.0), ..*self };
            let dead_band = (self.dead_band + dead_band).clamp(0.0, MOST_DEAD_BAND);
            let own = Self { dead_band, ..late };
            let slices = if own.lag_s > self.lag_s { &own } else { self }.slices(&alone);
            let times = slices.iter().map(|slice| slice.from_s).collect::<Vec<f64>>();
            let of = |values: Vec<f64>| Timed::new(name, times.clone(), values);
            let mut driven = self.driven(track, &slices);
            signals.insert(Signal::Thrust(name.clone()), of(driven.thrust.clone())?);
            let changes = [
                (ThrusterNumber::Lag, late, late.lag_s - self.lag_s),
                (ThrusterNumber::DeadBand, own, own.dead_band - late.dead_band),
            ];
            for (number, to, beyond) in changes {
                let mut by = std::mem::take(&mut driven.by[number as usize]);
                if beyond.abs() > LEAST_BEYOND {
                    let after = to.driven(track, &slices);
                    let both = after.thrust.iter().zip(&driven.thrust);
                    by = both.map(|(after, before)| (after - before) / beyond).collect();
                    driven = after;
                }
                let scale = self.log_scale.exp();
                for (by, thrust) in by.iter_mut().zip(&driven.thrust) {
                    *by *= scale + gain[usize::from(*thrust < 0.0)];
                }
                let thruster = name.clone();
                signals.insert(Signal::ThrustBy { number, thruster }, of(by)?);
            }
            signals.insert(Signal::PropellerSpeed(name.clone()), of(driven.speeds)?);
        }
        Ok(signals)
    }

    /// Returns speed and thrust of a thruster over some slices.
    fn driven(&self, track: &ThrusterTrack, slices: &[Slice]) -> Driven {
        let mut driven = Driven::default();
        self.drive(track, slices, true, |push| {
            driven.speeds.push(push.gamma.iter().sum::<f64>().copysign(push.tau));
            driven.thrust.push(push.tau);
            for (all, number) in driven.by.iter_mut().zip([DriveNumber::Lag, DriveNumber::DeadBand])
            {
                all.push(push.tau_by[number as usize]);
            }
        });
        driven
    }
}

/// Speed and thrust of a thruster over slices.
#[derive(Default)]
struct Driven {
    /// Mean size of propeller speed, with the sign of thrust.
    speeds: Vec<f64>,
    thrust: Vec<f64>,
    /// Derivatives of thrust by each [`ThrusterNumber`].
    by: [Vec<f64>; ThrusterNumber::ALL.len()],
}

/// A number of a thruster that is less beyond that of all is that of all.
const LEAST_BEYOND: f64 = 1e-6;
