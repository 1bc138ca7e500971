//! Conversion of thruster readings to the force along a degree of freedom.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Vector6;

use super::plausible::is_slower_than;
use super::{PlacedThruster, TrialSetup};
use crate::navigation::Recording;
use crate::series::{Cutter, Reader, median};
use crate::{
    AxisRecord, Dof, Error, Quantity, ThrustCurve, ThrustUncertainty, Thruster, ThrusterInput,
    Timed, Vehicle, VehicleEffect,
};

/// Use of a thruster beyond its measured curve.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Saturation {
    /// Name of the thruster.
    pub(super) thruster: String,
    /// Fraction of its samples.
    pub(super) part: f64,
}

/// A thruster's action on one degree of freedom: `τ = lever · k n|n|`.
#[derive(Clone, Debug, PartialEq)]
pub struct ThrusterTrack {
    /// Force along the degree of freedom per newton of thrust: 1, or a lever arm in m.
    pub lever: f64,
    /// Propeller speed n, held: rad/s, or the command beyond its deadband, for thrust by a square
    /// law of it; otherwise √N with the sign of thrust.
    pub speed: Timed,
    /// k for positive n.
    pub forward: f64,
    /// k for negative n.
    pub reverse: f64,
    /// Uncertainty of its coefficients.
    pub uncertainty: ThrustUncertainty,
    /// Supply voltage, if it was logged and neither the curve nor a measured speed or force accounts for it.
    pub supply: Option<Arc<Supply>>,
}

/// The supply voltage V of a thruster that is told a command or a pulse width.
#[derive(Clone, Debug, PartialEq)]
pub struct Supply {
    /// ln V.
    pub ln_volts: Timed,
    /// ln V of the measurement of its curve, if that is stated.
    pub of_curve: Option<f64>,
}

/// A possible error of thrust in one direction, common to the thrusters of one degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ThrustError {
    is_reverse: bool,
    /// Relative standard deviation.
    std: f64,
}

impl AxisRecord {
    /// Returns the uncertainty of its thrusters' coefficients: the largest of them.
    pub(crate) fn thrust_uncertainty(&self) -> ThrustUncertainty {
        ThrustUncertainty::greatest(self.thrusters.iter().map(|track| track.uncertainty))
    }

    /// Returns the possible errors of its thrusters' coefficients.
    pub(crate) fn thrust_errors(&self) -> Vec<ThrustError> {
        let ThrustUncertainty { forward, reverse } = self.thrust_uncertainty();
        let both = [(false, forward), (true, reverse)].into_iter();
        let errors = both.map(|(is_reverse, std)| ThrustError { is_reverse, std });
        errors.filter(|error| error.std > 0.0).collect()
    }

    /// Returns the record with an error of one standard deviation.
    ///
    /// # Errors
    /// As [`Timed::new`], if a force is not finite.
    pub(crate) fn with_thrust_off(&self, error: ThrustError) -> Result<Self, Error> {
        let off = |track: &ThrusterTrack| {
            let mut track = track.clone();
            let strength = if error.is_reverse { &mut track.reverse } else { &mut track.forward };
            *strength *= 1.0 + error.std;
            track
        };
        let thrusters: Vec<ThrusterTrack> = self.thrusters.iter().map(off).collect();
        Ok(Self { force: total_force(&thrusters)?, thrusters, ..self.clone() })
    }
}

/// Longest logging interval of thrust within which it hardly moves, s.
const SLOW_S: f64 = 0.15;

impl ThrusterTrack {
    /// Creates a thruster from its force: n = √|F| with the sign of F.
    pub fn of_force(lever: f64, force: &Timed) -> Self {
        let speed = force.map(|force| force.abs().sqrt().copysign(force));
        let uncertainty = ThrustUncertainty::default();
        Self { lever, speed, forward: 1.0, reverse: 1.0, uncertainty, supply: None }
    }

    pub(super) fn cut(&self, cutter: &mut Cutter, window_s: (f64, f64)) -> Option<Self> {
        Some(Self { speed: cutter.window_held(&self.speed, window_s)?, ..self.clone() })
    }

    pub(super) fn window(&self, from_s: f64, to_s: f64) -> Option<Self> {
        Some(Self { speed: self.speed.window_held(from_s, to_s)?, ..self.clone() })
    }

    /// Returns whether it was logged so slowly that its values between samples matter.
    pub(crate) fn is_slow(&self) -> bool {
        is_slower_than(&self.speed, SLOW_S)
    }

    /// Returns the sums over its samples of thrust² and of (thrust − mean of the samples before and after)², N².
    pub(super) fn beyond_neighbours(&self) -> [f64; 2] {
        let thrust = self.speed.map(|speed| self.thrust(speed));
        thrust.values().windows(3).fold([0.0; 2], |[all, beyond], f| {
            [all + f[1] * f[1], beyond + (f[1] - 0.5 * (f[0] + f[2])).powi(2)]
        })
    }

    /// Returns the thrust at a propeller speed, N.
    pub fn thrust(&self, speed: f64) -> f64 {
        let k = if speed < 0.0 { self.reverse } else { self.forward };
        k * speed * speed.abs()
    }
}

/// The force on one degree of freedom.
pub(super) struct Thrust {
    /// The force, held, N or N m.
    pub(super) force: Timed,
    /// The thrusters that produce it, or an equivalent one for a logged wrench.
    pub(super) tracks: Vec<ThrusterTrack>,
}

/// The thrust of one trial, by degree of freedom.
pub(super) struct Thrusts<'a> {
    trial: &'a str,
    recording: Recording,
    vehicle: &'a Vehicle,
    /// Converted thrusters by name, each with a lever arm of 1.
    known: BTreeMap<&'a str, ThrusterTrack>,
    saturated: Vec<Saturation>,
}

impl<'a> Thrusts<'a> {
    /// Keeps the channels that act on the trial's degrees of freedom.
    pub(super) fn new(
        setup: &'a TrialSetup,
        mut recording: Recording,
        vehicle: &'a Vehicle,
    ) -> Self {
        let acts = |name: &str| {
            let mut named = vehicle.thrusters.iter().filter(|thruster| thruster.name == name);
            named.any(|thruster| setup.dofs.iter().any(|dof| Vehicle::acts_on(thruster, *dof)))
        };
        recording.retain(|quantity, _| match quantity {
            Quantity::Thruster { name, .. } => acts(name),
            _ => true,
        });
        let (known, saturated) = (BTreeMap::new(), Vec::new());
        Self { trial: &setup.name, recording, vehicle, known, saturated }
    }

    /// Returns the thrusters driven beyond their curves.
    pub(super) fn into_saturated(self) -> Vec<Saturation> {
        self.saturated
    }

    /// Returns the force along `dof`.
    pub(super) fn along(&mut self, dof: Dof) -> Result<Thrust, Error> {
        let tracks = self.tracks(dof)?;
        Ok(Thrust { force: total_force(&tracks)?, tracks })
    }

    /// Returns the thrusters that act along `dof`, or the logged wrench.
    fn tracks(&mut self, dof: Dof) -> Result<Vec<ThrusterTrack>, Error> {
        if let Some(wrench) = self.recording.get(&Quantity::Wrench(dof)) {
            return Ok(vec![ThrusterTrack::of_force(1.0, wrench)]);
        }
        Ok(self.named_tracks(dof)?.into_iter().map(|(_, track)| track).collect())
    }

    /// Returns the thrusters that act along `dof`, with their action there.
    fn named_tracks(&mut self, dof: Dof) -> Result<Vec<(&'a Thruster, ThrusterTrack)>, Error> {
        let mut tracks = Vec::new();
        let acting = self.vehicle.thrusters.iter().filter(|t| Vehicle::acts_on(t, dof));
        for thruster in acting {
            let track = match self.known.get(thruster.name.as_str()) {
                Some(track) => track.clone(),
                None => {
                    let saturated = &mut self.saturated;
                    let track = track(self.trial, thruster, &self.recording, saturated)?;
                    self.known.insert(&thruster.name, track.clone());
                    track
                }
            };
            if thruster.azimuth_axis.is_some() {
                tracks.push((thruster, self.azimuth_track(thruster, &track, dof)?));
                continue;
            }
            let lever = thruster.unit_wrench()[dof.index()];
            let track = ThrusterTrack { lever, uncertainty: thruster.uncertainty, ..track };
            tracks.push((thruster, track));
        }
        if tracks.is_empty() {
            return Err(Error::MissingChannel {
                trial: self.trial.to_owned(),
                what: format!("thruster that acts in {dof}"),
                advice: self.advice(dof),
            });
        }
        Ok(tracks)
    }

    /// Formats the advice for a degree of freedom without force.
    fn advice(&self, dof: Dof) -> String {
        let acts = |known: &VehicleEffect| known.is_usual && known.effect.axes().contains(&dof);
        if self.vehicle.effects().iter().any(acts) {
            return format!(
                "rudders, fins and thrusters whose curve is to be estimated act in a plant of several axes: add a [[plant]] with {dof} among its axes, and leave {dof} out of dof"
            );
        }
        format!("give one in vehicle.toml, or map wrench.{dof}")
    }

    /// Returns the action of an azimuth thruster along `dof`.
    fn azimuth_track(
        &self,
        thruster: &Thruster,
        track: &ThrusterTrack,
        dof: Dof,
    ) -> Result<ThrusterTrack, Error> {
        let quantity = Quantity::Azimuth(thruster.name.clone());
        let azimuth = self.recording.get(&quantity).ok_or_else(|| Error::MissingChannel {
            trial: self.trial.to_owned(),
            what: quantity.to_string(),
            advice: "map it under [channels], or take azimuth_axis away from the thruster".into(),
        })?;
        let first = azimuth.first_s().max(track.speed.first_s());
        let mut times: Vec<f64> = [azimuth.time_s(), track.speed.time_s()].concat();
        times.retain(|t| *t >= first);
        times.sort_by(f64::total_cmp);
        times.dedup();
        let along = |&t: &f64| {
            let lever = thruster.at_azimuth(azimuth.held_at(t)).unit_wrench()[dof.index()];
            lever * track.thrust(track.speed.held_at(t))
        };
        let values = times.iter().map(along).collect::<Vec<f64>>();
        let force = Timed::new(&thruster.name, times, values)?;
        let (uncertainty, supply) = (thruster.uncertainty, track.supply.clone());
        Ok(ThrusterTrack { uncertainty, supply, ..ThrusterTrack::of_force(1.0, &force) })
    }

    /// Returns the thrust of one thruster, N, held.
    fn thruster_thrust(&mut self, name: &str) -> Option<Timed> {
        let thruster = self.vehicle.thrusters.iter().find(|known| known.name == name)?;
        let track = track(self.trial, thruster, &self.recording, &mut self.saturated).ok()?;
        Some(track.speed.map(|speed| track.thrust(speed)))
    }
}

/// Returns the thrust of one thruster of a recording, N, held.
pub(super) fn thrust_of(recording: &Recording, vehicle: &Vehicle, name: &str) -> Option<Timed> {
    let setup = TrialSetup { dofs: Dof::ALL.to_vec(), ..TrialSetup::default() };
    let of_thrust = recording.iter().filter(|(quantity, _)| quantity.is_of_thrust());
    let of_thrust = of_thrust.map(|(quantity, x)| (quantity.clone(), x.clone())).collect();
    Thrusts::new(&setup, of_thrust, vehicle).thruster_thrust(name)
}

/// Returns the force along `dof` of a recording, N or N m, held; `None` if it lacks a thruster that
/// acts there.
pub(crate) fn force_along(recording: &Recording, vehicle: &Vehicle, dof: Dof) -> Option<Timed> {
    let setup = TrialSetup { dofs: vec![dof], ..TrialSetup::default() };
    let of_thrust = recording.iter().filter(|(quantity, _)| quantity.is_of_thrust());
    let of_thrust = of_thrust.map(|(quantity, x)| (quantity.clone(), x.clone())).collect();
    Some(Thrusts::new(&setup, of_thrust, vehicle).along(dof).ok()?.force)
}

/// Forces on a vehicle of several axes.
pub(super) struct PlacedThrust {
    /// On each axis, held, N or N m; `None` if a thruster that acts there was not logged.
    pub(super) force: [Option<Timed>; 6],
    /// The thrusters that produce it; an axis without thrusters has a logged wrench.
    pub(super) thrusters: Vec<PlacedThruster>,
    /// The thrusters driven beyond their curves.
    pub(super) saturated: Vec<Saturation>,
}

/// Returns the forces of a recording on all axes.
pub(super) fn placed_thrust(recording: &Recording, vehicle: &Vehicle) -> PlacedThrust {
    let setup = TrialSetup { dofs: Dof::ALL.to_vec(), ..TrialSetup::default() };
    let of_thrust = recording.iter().filter(|(quantity, _)| quantity.is_of_thrust());
    let of_thrust = of_thrust.map(|(quantity, x)| (quantity.clone(), x.clone())).collect();
    let mut thrusts = Thrusts::new(&setup, of_thrust, vehicle);
    let (force, saturated) = ([const { None }; 6], Vec::new());
    let mut found = PlacedThrust { force, thrusters: Vec::new(), saturated };
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    for dof in Dof::ALL {
        let Ok(thrust) = thrusts.along(dof) else { continue };
        found.force[dof.index()] = Some(thrust.force);
        if thrusts.recording.contains_key(&Quantity::Wrench(dof)) {
            continue;
        }
        for (thruster, track) in thrusts.named_tracks(dof).unwrap_or_default() {
            let lever = track.lever;
            let known = places.get(thruster.name.as_str()).copied();
            // An azimuth thruster has a separate force series for each axis.
            let place = known.filter(|_| thruster.azimuth_axis.is_none()).unwrap_or_else(|| {
                let track = ThrusterTrack { lever: 1.0, ..track };
                let (name, wrench) = (thruster.name.clone(), Vector6::zeros());
                found.thrusters.push(PlacedThruster { name, track, wrench });
                found.thrusters.len() - 1
            });
            places.insert(&thruster.name, place);
            found.thrusters[place].wrench[dof.index()] = lever;
        }
    }
    found.saturated = thrusts.into_saturated();
    found
}

fn track(
    trial: &str,
    thruster: &Thruster,
    recording: &Recording,
    saturated: &mut Vec<Saturation>,
) -> Result<ThrusterTrack, Error> {
    let logged = |input| recording.get(&Quantity::Thruster { name: thruster.name.clone(), input });
    // Propeller speed by commands has no lag here, and is known beyond the deadband; a measured
    // force is preferred to a command.
    let input = match &thruster.curve {
        ThrustCurve::Quadratic { input: ThrusterInput::Speed, law } => {
            logged(ThrusterInput::Speed).zip(Some(law))
        }
        ThrustCurve::Quadratic { input, law } if logged(ThrusterInput::Force).is_none() => {
            logged(*input).zip(Some(law))
        }
        _ => None,
    };
    let supply = supply_of(thruster, recording);
    let Some((input, law)) = input else {
        let force = thruster_force(trial, thruster, recording, saturated)?;
        return Ok(ThrusterTrack { supply, ..ThrusterTrack::of_force(1.0, &force) });
    };
    Ok(ThrusterTrack {
        lever: 1.0,
        speed: input.map(|input| law.propeller_speed(input)),
        forward: law.forward,
        reverse: law.reverse,
        uncertainty: ThrustUncertainty::default(),
        supply,
    })
}

/// Part of the median supply voltage below which a sample is none: the supply was off, or not yet measured.
const LEAST_SUPPLY_PART: f64 = 0.3;

/// Returns the supply voltage of a thruster if nothing else accounts for it.
fn supply_of(thruster: &Thruster, recording: &Recording) -> Option<Arc<Supply>> {
    let force = Quantity::Thruster { name: thruster.name.clone(), input: ThrusterInput::Force };
    if !thruster.curve.follows_supply() || recording.contains_key(&force) {
        return None;
    }
    let volts = recording.get(&Quantity::SupplyVoltage)?;
    let least = LEAST_SUPPLY_PART * median(&mut volts.values().to_vec())?;
    let samples = volts.time_s().iter().zip(volts.values());
    let on = samples.filter(|(_, volts)| **volts > least.max(0.0));
    let (times, logs): (Vec<f64>, Vec<f64>) = on.map(|(t, volts)| (*t, volts.ln())).unzip();
    let ln_volts = Timed::new("supply.voltage", times, logs).ok()?;
    Some(Arc::new(Supply { ln_volts, of_curve: thruster.curve.voltage().map(f64::ln) }))
}

fn thruster_force(
    trial: &str,
    thruster: &Thruster,
    recording: &Recording,
    saturated: &mut Vec<Saturation>,
) -> Result<Timed, Error> {
    let channel = |input| Quantity::Thruster { name: thruster.name.clone(), input };
    if let Some(force) = recording.get(&channel(ThrusterInput::Force)) {
        return Ok(force.clone());
    }
    let missing = |what: String, advice: String| Error::MissingChannel {
        trial: trial.to_owned(),
        what,
        advice,
    };
    let wanted = channel(thruster.curve.input());
    let input = recording.get(&wanted).ok_or_else(|| {
        missing(wanted.to_string(), "map it under [channels]: its curve reads it".to_owned())
    })?;
    let voltage = recording.get(&Quantity::SupplyVoltage);
    if thruster.curve.needs_voltage() && voltage.is_none() {
        let advice = format!(
            "the curve of `{}` depends on it; map it, or keep the table of one voltage",
            thruster.name
        );
        return Err(missing(Quantity::SupplyVoltage.to_string(), advice));
    }
    let (low, high) = thruster.curve.range();
    let beyond = input.values().iter().filter(|x| !(low..=high).contains(*x)).count();
    let part = beyond as f64 / input.len() as f64;
    let known = saturated.iter().any(|known| known.thruster == thruster.name);
    if beyond > 0 && !known {
        saturated.push(Saturation { thruster: thruster.name.clone(), part });
    }
    let forces = input
        .time_s()
        .iter()
        .zip(input.values())
        .map(|(&t, &x)| thruster.curve.force(x, voltage.map(|voltage| voltage.at(t))))
        .collect();
    input.with_values(&thruster.name, forces)
}

/// Returns `τ = Σ lever · F`, held, at every time at which a thruster changes.
fn total_force(tracks: &[ThrusterTrack]) -> Result<Timed, Error> {
    let first = &tracks[0].speed;
    if tracks.iter().all(|track| track.speed.is_sampled_with(first)) {
        let at = |k: usize| {
            tracks.iter().map(|track| track.lever * track.thrust(track.speed.values()[k])).sum()
        };
        return first.with_shared_values("force", (0..first.len()).map(at).collect());
    }
    let times = all_times(tracks);
    let mut speeds: Vec<Reader<'_>> = tracks.iter().map(|track| track.speed.reader()).collect();
    let mut at = |&t: &f64| {
        let speeds = speeds.iter_mut().map(|speed| speed.held_at(t));
        tracks.iter().zip(speeds).map(|(track, n)| track.lever * track.thrust(n)).sum()
    };
    let values: Vec<f64> = times.iter().map(&mut at).collect();
    Timed::new("force", times, values)
}

/// Returns every time at which a thruster was logged, from the first at which all are known.
fn all_times(tracks: &[ThrusterTrack]) -> Vec<f64> {
    let start = tracks.iter().map(|track| track.speed.first_s()).fold(f64::MIN, f64::max);
    let all = tracks.iter().flat_map(|track| track.speed.time_s()).copied();
    let mut times: Vec<f64> = all.filter(|t| *t >= start).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}
