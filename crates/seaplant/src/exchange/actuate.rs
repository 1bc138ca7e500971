//! Forces on a plant from thruster inputs: curves, lag, delay, allocation.

use std::collections::BTreeMap;

use super::{Actuation, PlantModel};
use crate::motion::Wind;
use crate::plant::Signal;
use crate::{Dof, Error, SteeringGear, Thruster, Timed, Vehicle};

/// The inputs of a plant, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drive {
    /// Inputs of thrusters, in the unit of their curves, held between changes.
    pub thrusters: BTreeMap<String, Timed>,
    /// Supply voltage, V, for curves that depend on it.
    pub supply_v: Option<Timed>,
    /// Force or moment on an axis in addition to the thrusters, N or N m, held between changes.
    pub wrench: BTreeMap<Dof, Timed>,
    /// Orders of rudders and fins, rad, or angles where no gear of them is known; linear between samples.
    pub angles: BTreeMap<String, Timed>,
    /// The wind; still air if absent.
    pub wind: Option<Wind>,
    /// True if propellers run at the first inputs before these begin; otherwise they are at rest
    /// until then.
    pub already_turning: bool,
}

/// Parts of thrust that differ by less are alike: by the rounding of a file.
const ALIKE: f64 = 1e-6;

/// Time step for lagging propellers, s: that of the simulation.
pub(crate) const GRID_S: f64 = 0.02;

impl PlantModel {
    /// Returns the force on each axis, held between its times; `None` on axes without force.
    ///
    /// Propeller speed `s` follows its input by `lag ṡ = input − s`, after the delay, with the lag of the
    /// thruster if it has its own; reverse
    /// thrust is that of the curve times the reverse ratio; and the force of all thrusters on the
    /// axis has its own lag, each as fitted for the axis. Before its first input a propeller is at
    /// rest, unless [`Drive::already_turning`]. Forces in addition to the thrusters act
    /// immediately.
    ///
    /// # Errors
    /// [`Error::Thruster`] for an input of an unknown thruster, or a curve of several voltages
    /// without supply voltage.
    pub fn forces(&self, drive: &Drive, until_s: f64) -> Result<[Option<Timed>; 6], Error> {
        for name in drive.thrusters.keys().filter(|name| !self.is_propeller(name)) {
            self.thruster(name)?;
        }
        let mut forces = std::array::from_fn(|_| None);
        for dof in Dof::ALL {
            let acting: Vec<(&Thruster, &Timed)> = drive
                .thrusters
                .iter()
                .filter_map(|(name, input)| Some((self.thruster(name).ok()?, input)))
                .filter(|(thruster, _)| Vehicle::acts_on(thruster, dof))
                .collect();
            let known = drive.wrench.get(&dof);
            if acting.is_empty() && known.is_none() {
                continue;
            }
            let actuation = self.actuation.get(&dof).cloned().unwrap_or_default();
            let (supply_v, already_turning) = (drive.supply_v.as_ref(), drive.already_turning);
            let run = Run { dof, acting, known, supply_v, actuation, already_turning };
            forces[dof.index()] = Some(run.force(until_s)?);
        }
        Ok(forces)
    }

    /// Returns the gear of rudders and fins, which all axes share; a prompt one where none was found.
    pub fn steering_gear(&self) -> SteeringGear {
        let mut gears = self.actuation.values().map(Actuation::steering_gear);
        gears.find(|gear| !gear.is_prompt()).unwrap_or_default()
    }

    /// Returns the signals of the plant's effects; missing angles and thruster inputs are zero, and
    /// the air is still: wind is a separate input, [`Inputs::wind`](crate::motion::Inputs::wind).
    ///
    /// # Errors
    /// [`Error::Fin`] for the angle of an unknown surface; as [`Timed::new`] if an angle is not finite.
    pub fn signals(&self, drive: &Drive) -> Result<BTreeMap<Signal, Timed>, Error> {
        let wanted = self.plant.structure().signals();
        let surfaces: Vec<&str> = wanted
            .iter()
            .filter_map(|signal| match signal {
                Signal::Angle { name, .. } => Some(name.as_str()),
                _ => None,
            })
            .collect();
        if let Some(name) = drive.angles.keys().find(|name| !surfaces.contains(&name.as_str())) {
            let known = if surfaces.is_empty() { "none".to_owned() } else { surfaces.join(", ") };
            let reason = format!("the plant has no such rudder or fin; it has {known}");
            return Err(Error::Fin { what: "rudder", name: name.clone(), reason });
        }
        let still = Timed::new("input", vec![0.0], vec![0.0])?;
        let gear = self.steering_gear();
        let series = |signal: &Signal| {
            let given = match signal {
                Signal::Angle { name, .. } => {
                    drive.angles.get(name).map(|order| gear.behind(order)).transpose()?
                }
                Signal::Drive(name) => {
                    drive.thrusters.get(name).map(|input| match self.thruster(name) {
                        Ok(thruster) => input.map(|x| thruster.curve.force(x, None)),
                        Err(_) => input.clone(),
                    })
                }
                Signal::PropellerSpeed(name) => {
                    let input = drive.thrusters.get(name).zip(self.thruster(name).ok());
                    input.map(|(input, thruster)| input.map(|x| thruster.curve.propeller_speed(x)))
                }
                Signal::Thrust(name) => {
                    let input = drive.thrusters.get(name).zip(self.thruster(name).ok());
                    input.map(|(input, thruster)| input.map(|x| thruster.curve.force(x, None)))
                }
                Signal::ThrustBy { .. } | Signal::AirForward | Signal::AirStarboard => None,
            };
            Ok((signal.clone(), given.unwrap_or_else(|| still.clone())))
        };
        wanted.iter().map(series).collect()
    }

    /// The thrust along an axis over what a vehicle's curves say; 1 of a published table, which is no more of its
    /// curves than of a vehicle's.
    ///
    /// # Errors
    /// [`Error::Plant`] if it depends on the thruster along the axis, on its way or on its input.
    pub fn thrust_along_over(&self, vehicle: &Vehicle, dof: Dof) -> Result<f64, Error> {
        // Only what was identified says how far its axes were driven.
        let known = self.thrusters.iter().filter(|_| !self.driven.is_empty());
        let over = known.filter(|own| Vehicle::acts_on(own, dof)).filter_map(|own| {
            let same = vehicle.thrusters.iter().find(|other| other.name == own.name)?;
            (own.curve.input() == same.curve.input()).then(|| own.curve.over(&same.curve))
        });
        let over: Vec<Option<[f64; 2]>> = over.collect();
        let ratios: Vec<f64> = over.iter().flatten().flatten().copied().collect();
        let first = ratios.first().copied().unwrap_or(1.0);
        let is_alike = |ratio: &f64| (ratio / first - 1.0).abs() < ALIKE;
        match over.iter().all(Option::is_some) && ratios.iter().all(is_alike) {
            true => Ok(first),
            false => Err(Error::Plant {
                axes: dof.to_string(),
                reason: "its thrusters follow other curves in the plant than in the vehicle file, by more than one factor; state those of the plant in the vehicle file, or a [[plant]] of its axes in the campaign".to_owned(),
            }),
        }
    }

    /// Returns whether an effect depends on wind.
    pub fn reads_wind(&self) -> bool {
        self.plant.structure().signals().iter().any(Signal::is_of_wind)
    }

    /// Returns whether the strength of a thruster was estimated.
    fn is_propeller(&self, name: &str) -> bool {
        let signals = self.plant.structure().signals();
        let known = self.thrusters.iter().any(|thruster| thruster.name == name);
        !known && signals.iter().any(|signal| matches!(signal, Signal::Drive(own) if own == name))
    }

    fn thruster(&self, name: &str) -> Result<&Thruster, Error> {
        self.thrusters.iter().find(|thruster| thruster.name == name).ok_or_else(|| {
            let known: Vec<&str> = self.thrusters.iter().map(|t| t.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            let reason = format!("the plant has no such thruster; it has {known}");
            Error::Thruster { name: name.to_owned(), reason }
        })
    }
}

/// Returns the first-order response to a constant goal after a time `h`.
pub(crate) fn after(x: f64, goal: f64, h: f64, lag_s: f64) -> f64 {
    if lag_s > 0.0 { goal + (x - goal) * (-h / lag_s).exp() } else { goal }
}

/// The forces on one axis.
struct Run<'a> {
    dof: Dof,
    acting: Vec<(&'a Thruster, &'a Timed)>,
    known: Option<&'a Timed>,
    supply_v: Option<&'a Timed>,
    actuation: Actuation,
    already_turning: bool,
}

impl Run<'_> {
    fn force(&self, until_s: f64) -> Result<Timed, Error> {
        let value = |x: &Option<crate::results::Parameter>| x.as_ref().map(|x| x.value);
        let of = |(thruster, _): &(&Thruster, &Timed)| self.actuation.lag_s(&thruster.name);
        let lags_s: Vec<f64> = self.acting.iter().map(of).collect();
        let force_lag_s = value(&self.actuation.force_lag).unwrap_or(0.0).max(0.0);
        let delay_s = value(&self.actuation.delay).unwrap_or(0.0);
        let ratio = value(&self.actuation.reverse_ratio).unwrap_or(1.0);
        let greatest_s = lags_s.iter().copied().fold(force_lag_s, f64::max);
        let times = self.times(greatest_s, delay_s, until_s);
        let before = |(thruster, input): &(&Thruster, &Timed)| match self.already_turning {
            true => input.values()[0],
            false => thruster.curve.neutral(),
        };
        let mut speeds: Vec<f64> = self.acting.iter().map(before).collect();
        let mut forces = Vec::with_capacity(times.len());
        let mut lagging = (!self.already_turning).then_some(0.0);
        for (k, &t) in times.iter().enumerate() {
            let h = times.get(k + 1).map_or(0.0, |next| next - t);
            let mut force = 0.0;
            let propellers = self.acting.iter().zip(&lags_s).zip(&mut speeds);
            for (((thruster, input), &lag_s), speed) in propellers {
                // In the middle of a step: at its ends a delay's rounding may select either side.
                let goal = self.input_at(thruster, input, t + 0.5 * h - delay_s);
                let thrust = self.thrust(thruster, after(*speed, goal, 0.5 * h, lag_s), t)?;
                *speed = after(*speed, goal, h, lag_s);
                let thrust = if thrust < 0.0 { ratio * thrust } else { thrust };
                force += thruster.unit_wrench()[self.dof.index()] * thrust;
            }
            let before = lagging.unwrap_or(force);
            lagging = Some(after(before, force, h, force_lag_s));
            let known = self.known.map_or(0.0, |known| known.held_at(t));
            forces.push(known + after(before, force, 0.5 * h, force_lag_s));
        }
        Timed::new("force", times, forces)
    }

    /// Returns the input at a time.
    fn input_at(&self, thruster: &Thruster, input: &Timed, t: f64) -> f64 {
        let stands = !self.already_turning && t < input.first_s();
        if stands { thruster.curve.neutral() } else { input.held_at(t) }
    }

    fn thrust(&self, thruster: &Thruster, input: f64, t: f64) -> Result<f64, Error> {
        let volts = self.supply_v.map(|supply| supply.held_at(t));
        if thruster.curve.needs_voltage() && volts.is_none() {
            let reason = "its curve needs the supply voltage; give supply.voltage".to_owned();
            return Err(Error::Thruster { name: thruster.name.clone(), reason });
        }
        Ok(thruster.curve.force(input, volts) * self.by_voltage(thruster, volts))
    }

    /// Returns thrust at a supply voltage over that of a curve which does not depend on it.
    fn by_voltage(&self, thruster: &Thruster, volts: Option<f64>) -> f64 {
        let value = |x: &Option<crate::results::Parameter>| x.as_ref().map(|x| x.value);
        let Actuation { voltage_exponent, mean_voltage, .. } = &self.actuation;
        let own = thruster.curve.voltage().or_else(|| value(mean_voltage));
        let known = volts.filter(|_| thruster.curve.follows_supply()).zip(own);
        let known = known.filter(|(volts, own)| *volts > 0.0 && *own > 0.0);
        let exponent = value(voltage_exponent).unwrap_or(0.0);
        known.map_or(1.0, |(volts, own)| (volts / own).powf(exponent))
    }

    /// Returns the times of all changes, and a grid for lagging propellers.
    fn times(&self, lag_s: f64, delay_s: f64, until_s: f64) -> Vec<f64> {
        let inputs = self.acting.iter().flat_map(|(_, input)| input.time_s());
        let mut times: Vec<f64> = inputs.map(|t| t + delay_s).collect();
        times.extend(self.known.iter().flat_map(|known| known.time_s()));
        times.extend(self.supply_v.iter().flat_map(|supply| supply.time_s()));
        let first = times.iter().copied().fold(f64::INFINITY, f64::min) - delay_s.max(0.0);
        times.push(first);
        if lag_s > 0.0 {
            let steps = ((until_s - first) / GRID_S).ceil().max(0.0) as usize;
            times.extend((0..=steps).map(|k| first + GRID_S * k as f64));
        }
        times.sort_by(f64::total_cmp);
        times.dedup_by(|b, a| *b - *a < 1e-9);
        times
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::PlantFile;
    use crate::results::Parameter;
    use crate::{Estimate, QuadraticThrust, ThrustCurve, ThrusterInput};

    fn boat() -> PlantModel {
        let file: PlantFile = serde_json::from_value(serde_json::json!({
            "schema": "seaplant/plant/1", "name": "boat", "source": "worked by hand",
            "axes": ["surge", "yaw"], "mass_matrix": [100.0, 20.0],
            "linear_damping": [10.0, 5.0],
            "thruster": [
                { "name": "port", "position_m": [0.0, -0.5, 0.0], "direction": [1.0, 0.0, 0.0],
                  "curve": { "kind": "quadratic", "input": "speed", "forward": 0.04, "reverse": 0.03 } },
                { "name": "starboard", "position_m": [0.0, 0.5, 0.0], "direction": [1.0, 0.0, 0.0],
                  "curve": { "kind": "quadratic", "input": "speed", "forward": 0.04, "reverse": 0.03 } }
            ],
            "actuation": { "yaw": { "lag": { "value": 0.5, "std": 0.1, "low95": 0.3, "high95": 0.7, "unit": "s" } } }
        }))
        .expect("a table");
        file.model().expect("possible")
    }

    fn held(x: f64) -> Timed {
        Timed::new("input", vec![0.0], vec![x]).expect("one")
    }

    fn drive(port: f64, starboard: f64) -> Drive {
        let all = [("port", port), ("starboard", starboard)];
        let thrusters = all.map(|(name, x)| (name.to_owned(), held(x))).into();
        Drive { thrusters, ..Drive::default() }
    }

    #[test]
    fn thrust_is_allocated_by_curve_and_lever() {
        let turning = Drive { already_turning: true, ..drive(100.0, -100.0) };
        let forces = boat().forces(&turning, 1.0).expect("known");
        let surge = forces[0].as_ref().expect("pushed");
        assert!((surge.held_at(0.5) - (400.0 - 300.0)).abs() < 1e-9);
        let yaw = forces[5].as_ref().expect("turned");
        assert!((yaw.held_at(0.5) - 0.5 * (400.0 + 300.0)).abs() < 1e-9);
        assert!(forces[1].is_none());
    }

    #[test]
    fn thrust_follows_supply_voltage() {
        let mut model = boat();
        let number = |value| Some(Parameter::new(Estimate::new(value, 0.0, 1.0), "1"));
        for (thruster, voltage) in model.thrusters.iter_mut().zip([None, Some(12.0)]) {
            let law = QuadraticThrust { forward: 40.0, reverse: 30.0, voltage, ..<_>::default() };
            thruster.curve = ThrustCurve::Quadratic { input: ThrusterInput::Command, law };
        }
        let actuation = Actuation {
            voltage_exponent: number(2.0),
            mean_voltage: number(15.0),
            ..Actuation::default()
        };
        model.actuation.insert(Dof::Surge, actuation);
        let force = |supply_v: Option<Timed>| {
            let drive = Drive { already_turning: true, supply_v, ..drive(0.5, 0.5) };
            model.forces(&drive, 1.0).expect("known")[0].as_ref().expect("pushed").held_at(0.5)
        };
        assert!((force(None) - 20.0).abs() < 1e-9);
        // 18 V of 15 V, and of the 12 V that the other curve states.
        let expected = 10.0 * (1.2_f64.powi(2) + 1.5_f64.powi(2));
        assert!((force(Some(held(18.0))) - expected).abs() < 1e-9);
    }

    #[test]
    fn a_lagging_propeller_follows_its_input() {
        let mut drive = drive(0.0, 0.0);
        let port = Timed::new("input", vec![0.0, 1.0], vec![0.0, 100.0]).expect("two");
        drive.thrusters.insert("port".to_owned(), port);
        let forces = boat().forces(&drive, 3.0).expect("known");
        let yaw = forces[5].as_ref().expect("turned");
        // Lag 0.5 s, after 0.5 s: 63 % of the speed, 40 % of the force. Each step has the force in
        // its middle.
        for (times, force) in yaw.time_s().windows(2).zip(yaw.values()) {
            let since = 0.5 * (times[0] + times[1]) - 1.0;
            let expected = 0.5 * 400.0 * (1.0 - (-since.max(0.0) / 0.5).exp()).powi(2);
            assert!((force - expected).abs() < 1e-6, "{since}: {force}, {expected}");
        }
    }

    #[test]
    fn a_propeller_with_a_lag_of_its_own_follows_its_input_by_that() {
        let mut model = boat();
        let own = Parameter::new(Estimate::new(0.2, 0.0, 1.0), "s");
        let yaw = model.actuation.get_mut(&Dof::Yaw).expect("stated");
        yaw.lag_of.insert("port".to_owned(), own);
        let forces = model.forces(&drive(100.0, -100.0), 3.0).expect("known");
        let yaw = forces[5].as_ref().expect("turned");
        for (times, force) in yaw.time_s().windows(2).zip(yaw.values()) {
            let since = 0.5 * (times[0] + times[1]);
            let [port, starboard] = [0.2, 0.5].map(|lag_s: f64| 1.0 - (-since / lag_s).exp());
            let expected = 0.5 * (400.0 * port.powi(2) + 300.0 * starboard.powi(2));
            assert!((force - expected).abs() < 1e-6, "{since}: {force}, {expected}");
        }
        assert_eq!(model.lag_along(Dof::Yaw), 0.35);
        assert_eq!(model.lag_along(Dof::Surge), 0.0);
    }

    #[test]
    fn a_lagging_force_follows_its_thrusters() {
        let mut model = boat();
        let mut yaw = model.actuation.remove(&Dof::Yaw).expect("stated");
        yaw.force_lag = yaw.lag.take();
        model.actuation.insert(Dof::Yaw, yaw);
        let mut drive = drive(0.0, 0.0);
        let port = Timed::new("input", vec![0.0, 1.0], vec![0.0, 100.0]).expect("two");
        drive.thrusters.insert("port".to_owned(), port);
        drive.wrench.insert(Dof::Yaw, held(7.0));
        let forces = model.forces(&drive, 3.0).expect("known");
        let yaw = forces[5].as_ref().expect("turned");
        // Lag 0.5 s, 0.5 s after the step: 63 % of the force; the additional force acts
        // immediately.
        let expected = 7.0 + 0.5 * 400.0 * (1.0 - (-1.0_f64).exp());
        assert!((yaw.at(1.49) / expected - 1.0).abs() < 0.02, "{}", yaw.at(1.49));
        assert!((yaw.held_at(0.5) - 7.0).abs() < 1e-9);
    }

    #[test]
    fn before_a_step_at_the_start_propellers_are_at_rest() {
        let forces = |already_turning: bool| {
            let drive = Drive { already_turning, ..drive(100.0, 100.0) };
            let mut model = boat();
            let yaw = model.actuation.remove(&Dof::Yaw).expect("stated");
            model.actuation.insert(Dof::Surge, yaw);
            model.forces(&drive, 3.0).expect("known")[0].clone().expect("pushed")
        };
        let surge = forces(false);
        for (times, force) in surge.time_s().windows(2).zip(surge.values()) {
            let middle = 0.5 * (times[0] + times[1]);
            let expected = 800.0 * (1.0 - (-middle / 0.5).exp()).powi(2);
            assert!((force - expected).abs() < 1e-6, "{middle}: {force}, {expected}");
        }
        assert!(forces(true).values().iter().all(|force| (force - 800.0).abs() < 1e-9));
    }

    #[test]
    fn a_propeller_is_at_rest_until_its_delayed_input() {
        let mut model = boat();
        let mut delayed = model.actuation.remove(&Dof::Yaw).expect("stated");
        delayed.delay = delayed.lag.take();
        model.actuation.insert(Dof::Surge, delayed);
        let forces = model.forces(&drive(100.0, 100.0), 3.0).expect("known");
        let surge = forces[0].as_ref().expect("pushed");
        assert_eq!((surge.held_at(0.49), surge.held_at(0.51)), (0.0, 800.0));
    }

    #[test]
    fn an_unknown_thruster_is_refused_by_name() {
        let mut drive = drive(1.0, 1.0);
        drive.thrusters.insert("bow".to_owned(), held(1.0));
        let error = boat().forces(&drive, 1.0).expect_err("unknown").to_string();
        assert!(error.contains("bow") && error.contains("port, starboard"), "{error}");
    }

    #[test]
    fn a_rudder_follows_its_orders_by_the_gear_of_the_plant() {
        let file: PlantFile = serde_json::from_value(serde_json::json!({
            "schema": "seaplant/plant/1", "name": "ship", "source": "worked by hand",
            "axes": ["surge", "yaw"],
            "effects": [{ "name": "rudder.lift", "force": { "kind": "lift", "foil": {
                "kind": "rudder", "name": "rudder", "position_m": [-1.5, 0.0, 0.0],
                "axis": [0.0, 0.0, 1.0], "stall_rad": null } } }],
            "coefficients": {
                "mass.surge": { "value": 260.0 }, "mass.yaw": { "value": 180.0 },
                "surge: u": { "value": 8.0 }, "yaw: r": { "value": 200.0 },
                "rudder.lift": { "value": 60.0 }
            }
        }))
        .expect("a table");
        let mut model = file.model().expect("possible");
        let order = Timed::new("order", vec![0.0, 1.0, 1.001, 9.0], vec![0.0, 0.0, 0.3, 0.3]);
        let angles = BTreeMap::from([("rudder".to_owned(), order.expect("valid"))]);
        let drive = Drive { angles, ..Drive::default() };
        let signal = Signal::Angle { kind: crate::Surface::Rudder, name: "rudder".to_owned() };
        let at = |model: &PlantModel, t: f64| model.signals(&drive).expect("known")[&signal].at(t);
        assert!((at(&model, 2.0) - 0.3).abs() < 1e-9);
        let number = |value, unit| Some(Parameter::new(Estimate::new(value, 0.0, 1.0), unit));
        let geared = Actuation {
            steering_delay: number(0.5, "s"),
            steering_rate: number(0.2, "rad/s"),
            ..Actuation::default()
        };
        // Another axis says nothing of it.
        model.actuation.insert(Dof::Surge, Actuation::default());
        model.actuation.insert(Dof::Yaw, geared);
        for (t, angle) in [(1.4, 0.0), (2.0, 0.1), (2.5, 0.2), (3.5, 0.3)] {
            assert!((at(&model, t) - angle).abs() < 1e-3, "{t}: {}", at(&model, t));
        }
    }
}
