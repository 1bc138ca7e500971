//! Fisher information of each manoeuvre for plants drawn from the prior.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::DMatrix;
use seaplant::estimate::{
    Actuator, ExpectedActuator, ExpectedNoises, Information, information, information_before,
};
use seaplant::plant::Plant;
use seaplant::{Role, TrialRecord, TrialSetup, Vehicle, parallel};

use crate::Error;
use crate::battery::Battery;
use crate::drive::{Driven, Pilot, Sea, drive};
use crate::limits::Limits;
use crate::logging::Logging;
use crate::manoeuvre::Manoeuvre;
use crate::rig::Rig;
use crate::wave::seed_of;

/// Duration of the run from which the information of a manoeuvre is computed, s.
pub(crate) const WEIGHED_S: f64 = 120.0;

/// A manoeuvre within its limits, and its information per second.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) manoeuvre: Manoeuvre,
    /// Information per second for each drawn plant.
    pub(crate) rates: Vec<DMatrix<f64>>,
    /// Least and greatest velocity of each axis of the prior's plant, m/s and rad/s.
    pub(crate) velocity: [[f64; 2]; 6],
    /// Mean electrical power, W, where a battery is given.
    pub(crate) watts: Option<f64>,
    /// Factor by which limits reduced the forces, and the limit that did.
    pub(crate) factor: f64,
    pub(crate) limit: &'static str,
    /// True once runs have shown that they leave a margin to every limit.
    pub(crate) is_sure: bool,
}

/// Data common to all candidates.
pub(crate) struct Bench<'a> {
    pub(crate) plants: &'a [Plant],
    pub(crate) vehicle: &'a Vehicle,
    pub(crate) rig: &'a Rig,
    pub(crate) limits: &'a Limits,
    pub(crate) battery: Option<Battery>,
    /// True if a known weight is to determine the scale of thrust.
    pub(crate) has_scale: bool,
    pub(crate) logging: &'a Logging,
    pub(crate) noises: &'a ExpectedNoises,
    pub(crate) current: [f64; 2],
    pub(crate) seed: u64,
}

/// Factors on the forces of a manoeuvre; the first that respects the limits is used.
const FACTORS: [f64; 10] = [1.0, 0.85, 0.7, 0.55, 0.42, 0.3, 0.2, 0.12, 0.06, 0.03];

/// Greatest use of a limit while the information is computed: other disturbances and plants use
/// more.
const LEFT: f64 = 0.85;

/// Vehicles, each in its own sea, that tell how widely the use of a limit varies …
pub(crate) const MARGIN_RUNS: usize = 32;
/// … for so long, s.
pub(crate) const MARGIN_S: f64 = 180.0;
/// Standard deviations from the median of that use to the limit, by the half of the runs above the
/// median: 999 of 1000 runs stay within it by a normal law. Runs that use less of a limit are no danger.
const MARGIN: f64 = 3.09;
/// Factor by which forces are reduced until the margin is left.
const REDUCED: f64 = 0.85;
/// Part of its forces below which a manoeuvre is given up.
const WEAKEST: f64 = 0.08;
/// Factor on the natural frequency with which a place is held, where a limit asks for it.
const FIRMER: f64 = 1.4;

/// Least fraction of an excitation that limits must leave while the information is computed.
const KEPT: f64 = 0.97;

/// Information per second for each drawn plant, the least and greatest velocity of each axis, and the
/// power.
type Weighed = (Vec<DMatrix<f64>>, [[f64; 2]; 6], Option<f64>);

impl Bench<'_> {
    /// Returns the thrusters' parameters in the form of a fit.
    fn actuator(&self) -> ExpectedActuator {
        let actuator = Actuator {
            lag_s: self.rig.lag_s,
            delay_s: self.rig.delay_s,
            log_reverse_ratio: self.rig.reverse_ratio.ln(),
            ..Actuator::default()
        };
        ExpectedActuator { actuator, has_scale: self.has_scale }
    }

    /// Returns the prior information of a fit.
    pub(crate) fn before(&self) -> Information {
        information_before(&self.plants[0], self.actuator())
    }

    /// Computes the information of manoeuvres, each at the greatest forces that limits allow;
    /// manoeuvres that limits prevent get a factor of zero.
    pub(crate) fn candidates(&self, manoeuvres: &[Manoeuvre]) -> Result<Vec<Candidate>, Error> {
        let made = parallel::of_each(manoeuvres.len(), |k| self.candidate(&manoeuvres[k]));
        made.into_iter().collect()
    }

    fn candidate(&self, manoeuvre: &Manoeuvre) -> Result<Candidate, Error> {
        let mut limit = "thrust_part";
        // Without forces of its own, a hover cannot be driven more weakly.
        let tries = if manoeuvre.waves.is_empty() { 1 } else { FACTORS.len() };
        for factor in FACTORS.into_iter().take(tries) {
            let scaled = manoeuvre.scaled(factor);
            match self.within_limits(&scaled) {
                Ok(()) => {
                    let (rates, velocity, watts) = self.weighed(&scaled)?;
                    let limit = if factor < 1.0 { limit } else { "thrust_part" };
                    return Ok(Candidate {
                        manoeuvre: scaled,
                        rates,
                        velocity,
                        watts,
                        factor,
                        limit,
                        is_sure: false,
                    });
                }
                Err(broken) => limit = broken,
            }
        }
        let rates = Vec::new();
        let velocity = [[0.0; 2]; 6];
        let manoeuvre = manoeuvre.clone();
        let watts = None;
        Ok(Candidate { manoeuvre, rates, velocity, watts, factor: 0.0, limit, is_sure: true })
    }

    /// Returns the disturbances of one of the runs of a manoeuvre.
    pub(crate) fn sea(&self, manoeuvre: &Manoeuvre, run: u64) -> Sea<'_> {
        let Self { noises, logging, current, .. } = *self;
        Sea { noises, logging, current, seed: seed_of(self.seed ^ run, &manoeuvre.name) }
    }

    /// Drives a manoeuvre with every plant in disturbances.
    ///
    /// # Errors
    /// The limit that a run violates.
    fn within_limits(&self, manoeuvre: &Manoeuvre) -> Result<(), &'static str> {
        let pilot = Pilot::new(&self.plants[0], self.rig, self.limits, manoeuvre);
        for (k, plant) in self.plants.iter().enumerate() {
            // A diverging motion violates the limit of speed first.
            let sea = self.sea(manoeuvre, k as u64);
            let driven = drive(plant, &pilot, WEIGHED_S, Some(sea)).map_err(|_| "speed_m_s")?;
            if driven.part < KEPT || driven.worst.part > LEFT {
                return Err(driven.worst.of);
            }
        }
        Ok(())
    }

    /// Holds the place of a candidate more firmly where that is at a limit, and reduces its forces where that is not
    /// enough, until its runs leave a margin to every limit; a factor of zero if none do.
    pub(crate) fn with_margin(
        &self,
        candidate: &Candidate,
        plants: &[Plant],
    ) -> Result<Candidate, Error> {
        let mut reduced = Candidate { is_sure: true, ..candidate.clone() };
        let weakest = if candidate.manoeuvre.waves.is_empty() { 1.0 } else { WEAKEST };
        while reduced.factor >= weakest * candidate.factor {
            let Some(limit) = self.without_margin(&reduced.manoeuvre, plants) else {
                if reduced.manoeuvre != candidate.manoeuvre {
                    (reduced.rates, reduced.velocity, reduced.watts) =
                        self.weighed(&reduced.manoeuvre)?;
                }
                return Ok(reduced);
            };
            reduced.limit = limit;
            // Weight in water and currents take a vehicle from its place, however weakly it is driven.
            let firmer = reduced.manoeuvre.held_firmer(place_of(limit), FIRMER);
            if firmer == reduced.manoeuvre {
                reduced.manoeuvre = firmer.scaled(REDUCED);
                reduced.factor *= REDUCED;
            } else {
                reduced.manoeuvre = firmer;
            }
        }
        Ok(Candidate { factor: 0.0, ..reduced })
    }

    /// Returns the limit to which the runs of a manoeuvre leave no margin, if any.
    fn without_margin(&self, manoeuvre: &Manoeuvre, plants: &[Plant]) -> Option<&'static str> {
        let pilot = Pilot::new(&self.plants[0], self.rig, self.limits, manoeuvre);
        let mut uses: BTreeMap<&'static str, Vec<f64>> = BTreeMap::new();
        for (k, plant) in plants.iter().cycle().take(MARGIN_RUNS).enumerate() {
            // A diverging motion violates the limit of speed first.
            let sea = self.sea(manoeuvre, (k as u64) << 32);
            let Ok(driven) = drive(plant, &pilot, MARGIN_S, Some(sea)) else {
                return Some("speed_m_s");
            };
            for worst in driven.uses {
                if worst.part >= 1.0 {
                    return Some(worst.of);
                }
                uses.entry(worst.of).or_default().push(worst.part);
            }
        }
        let close = uses.into_iter().find(|(_, uses)| upper_bound(uses.clone()) > 1.0);
        close.map(|(of, _)| of)
    }

    /// Computes the information of a manoeuvre for each of the plants.
    fn weighed(&self, manoeuvre: &Manoeuvre) -> Result<Weighed, Error> {
        let mut rates = Vec::with_capacity(self.plants.len());
        let (mut velocity, mut watts) = ([[0.0_f64; 2]; 6], None);
        for (k, plant) in self.plants.iter().enumerate() {
            let (driven, rate) = self.rate(manoeuvre, plant, k as u64)?;
            if k == 0 {
                let power = |of: &Battery| of.watts(self.rig, &driven, self.limits.thrust_part);
                watts = self.battery.as_ref().map(power);
                for state in &driven.states {
                    for (axis, [low, high]) in velocity.iter_mut().enumerate() {
                        *low = low.min(state[6 + axis]);
                        *high = high.max(state[6 + axis]);
                    }
                }
            }
            rates.push(rate);
        }
        Ok((rates, velocity, watts))
    }

    /// Computes the information per second of a run of a manoeuvre.
    ///
    /// It is driven in the disturbances that are expected, because these move a light vehicle, too. A plant with an axis that
    /// no thruster pushes is driven without: how far a disturbance of an assumed size moves that axis would tell its
    /// mass, and a fit, which estimates that size, does not know it.
    pub(crate) fn rate(
        &self,
        manoeuvre: &Manoeuvre,
        plant: &Plant,
        run: u64,
    ) -> Result<(Driven, DMatrix<f64>), Error> {
        let pilot = Pilot::new(&self.plants[0], self.rig, self.limits, manoeuvre);
        let are_all_pushed = plant.axes().iter().all(|dof| self.rig.most[dof.index()] > 0.0);
        let sea = are_all_pushed.then(|| self.sea(manoeuvre, run));
        let driven = drive(plant, &pilot, WEIGHED_S, sea)?;
        let record = self.record(manoeuvre, &driven)?;
        let found = information(plant, self.actuator(), self.noises, &record)?;
        Ok((driven, found.matrix / WEIGHED_S))
    }

    /// Returns the record of a run.
    fn record(&self, manoeuvre: &Manoeuvre, driven: &Driven) -> Result<TrialRecord, Error> {
        let depth_m = self.limits.start_depth_m;
        let recording = self.logging.recording(self.rig, driven, self.plants[0].axes(), depth_m)?;
        let (name, known) = (manoeuvre.name.clone(), manoeuvre.known(WEIGHED_S));
        let setup = TrialSetup { name, role: Role::Fit, known, ..TrialSetup::default() };
        Ok(TrialRecord::new(&setup, &recording, self.vehicle, self.plants[0].axes())?)
    }
}

/// Returns the axes along which a limit keeps a vehicle in its place.
fn place_of(limit: &str) -> Range<usize> {
    match limit {
        "box_m" | "tether_m" => 0..2,
        "depth_m" => 2..3,
        _ => 0..0,
    }
}

/// Returns what 999 of 1000 values stay below, by the spread of those above the median.
fn upper_bound(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let median = 0.5 * (values[middle.saturating_sub(1)] + values[middle]);
    let above = &values[middle..];
    let variance = above.iter().map(|x| (x - median).powi(2)).sum::<f64>() / above.len() as f64;
    median + MARGIN * variance.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_far_below_the_median_does_not_widen_the_margin() {
        let normal = [-1.5, -0.9, -0.5, -0.2, 0.2, 0.5, 0.9, 1.5];
        let skewed = [-9.0, -5.0, -3.0, -0.2, 0.2, 0.5, 0.9, 1.5];
        assert_eq!(upper_bound(normal.to_vec()), upper_bound(skewed.to_vec()));
        // √((0.2² + 0.5² + 0.9² + 1.5²) / 4) = 0.915
        assert!((upper_bound(normal.to_vec()) - MARGIN * 0.915).abs() < 0.01);
    }
}
