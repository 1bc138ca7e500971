//! Actuators other than thrusters with known curves: rudders, fins, propellers of unknown strength;
//! and wind.

use nalgebra::{Vector3, Vector6};

use super::{Thruster, Vehicle};
use crate::Surface;
use crate::plant::{
    Effect, EffectForce, Foil, MOST_READ, OpenWater, PropellerAhead, Pusher, RudderFlow,
    ThrusterNumber, WakeByDrift,
};
use crate::{Dof, Error};

/// A rudder or fin, in the body frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Fin {
    /// The type of surface.
    pub kind: Surface,
    /// Name in channels and messages.
    pub name: String,
    /// Point of application of its force, m.
    pub position_body: Vector3<f64>,
    /// Unit vector of the axis of rotation; a positive angle rotates by the right-hand rule.
    pub axis_body: Vector3<f64>,
    /// Its area, m².
    pub area_m2: Option<f64>,
    /// `∂C_L/∂α`, 1/rad, if known; otherwise the force coefficient is estimated.
    pub lift_slope: Option<f64>,
    /// Stall angle of attack, rad, beyond which lift is constant.
    pub stall_rad: Option<f64>,
    /// Largest angle of rotation, rad.
    pub limit_rad: Option<f64>,
    /// The thruster in whose slipstream it is.
    pub slipstream: Option<String>,
    /// Changes of its inflow by hull and propeller, behind a thruster with an open-water curve.
    pub flow: Option<RudderFlow>,
}

/// The open-water curve of a propeller, as in a vehicle file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PropellerCurve {
    /// Diameter, m.
    pub diameter_m: f64,
    /// K_T = k₀ + k₁ J + k₂ J².
    pub k_t: [f64; 3],
    /// Wake fraction in straight motion, 0 to below 1.
    pub wake: f64,
    /// Variation of the wake with drift angle, if any.
    pub wake_by_drift: Option<WakeByDrift>,
    /// Thrust deduction fraction; estimated if unknown.
    pub thrust_deduction: Option<f64>,
}

impl PropellerCurve {
    /// Checks the curve.
    ///
    /// # Errors
    /// [`Error::Thruster`] with the invalid key, for a thruster of this name.
    pub fn checked(self, name: &str) -> Result<Self, Error> {
        let refuse = |reason: &str| {
            Err(Error::Thruster { name: name.to_owned(), reason: reason.to_owned() })
        };
        let is_part = |x: f64| (0.0..1.0).contains(&x);
        if !(self.diameter_m > 0.0 && self.diameter_m.is_finite()) {
            return refuse("its diameter_m must be a positive number");
        }
        if !(self.k_t[0] > 0.0 && self.k_t.iter().all(|k| k.is_finite())) {
            return refuse(
                "its k_t must be three numbers, K_T = k0 + k1 J + k2 J^2, the first above 0",
            );
        }
        if !is_part(self.wake) {
            return refuse("its wake must be a fraction from 0 to below 1");
        }
        if let Some(WakeByDrift { rate, greatest }) = self.wake_by_drift
            && ![rate, greatest[0], greatest[1]].iter().all(|x| *x >= 0.0 && x.is_finite())
        {
            return refuse("its wake_by_drift must hold numbers that are not below 0");
        }
        if self.thrust_deduction.is_some_and(|t| !is_part(t)) {
            return refuse(
                "its thrust_deduction must be a fraction from 0 to below 1; leave it out to estimate it",
            );
        }
        Ok(self)
    }
}

impl Fin {
    /// Checks and creates a fin; `axis` may have any length but zero.
    ///
    /// # Errors
    /// [`Error::Fin`] if a number is not finite or is impossible, or if the axis is zero or points
    /// ahead.
    ///
    /// # Example
    /// ```
    /// use seaplant::{Fin, Surface};
    /// let rudder = Fin::new(Surface::Rudder, "stern", [-1.4, 0.0, 0.0], [0.0, 0.0, 2.0])?;
    /// assert_eq!(rudder.axis_body.z, 1.0);
    /// let ahead = Fin::new(Surface::Fin, "bow", [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    /// assert!(ahead.unwrap_err().to_string().contains("ahead"));
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn new(
        kind: Surface,
        name: &str,
        position_m: [f64; 3],
        axis: [f64; 3],
    ) -> Result<Self, Error> {
        let refuse = |reason: &str| {
            let what = kind.name();
            Err(Error::Fin { what, name: name.to_owned(), reason: reason.to_owned() })
        };
        let axis_body = Vector3::from(axis);
        if !position_m.iter().chain(&axis).all(|x| x.is_finite()) {
            return refuse("its position or axis is not finite");
        }
        let length = axis_body.norm();
        if length == 0.0 {
            return refuse("its axis is [0, 0, 0]; give what it turns about, such as [0, 0, 1]");
        }
        let axis_body = axis_body / length;
        if axis_body.x.abs() > MOST_AHEAD {
            return refuse(
                "its axis points ahead, so that it cannot steer; give what it turns about, such as [0, 0, 1]",
            );
        }
        Ok(Self {
            kind,
            name: name.to_owned(),
            position_body: position_m.into(),
            axis_body,
            area_m2: None,
            lift_slope: None,
            stall_rad: None,
            limit_rad: None,
            slipstream: None,
            flow: None,
        })
    }

    /// Checks the optional fields.
    ///
    /// # Errors
    /// [`Error::Fin`] for an impossible area, slope or angle.
    pub fn checked(self) -> Result<Self, Error> {
        let refuse = |reason: String| {
            Err(Error::Fin { what: self.kind.name(), name: self.name.clone(), reason })
        };
        let positive = [("area_m2", self.area_m2), ("lift_slope", self.lift_slope)];
        for (key, value) in positive {
            if value.is_some_and(|x| !(x > 0.0 && x.is_finite())) {
                return refuse(format!("its {key} must be a positive number"));
            }
        }
        for (key, angle) in [("stall_deg", self.stall_rad), ("limit_deg", self.limit_rad)] {
            if angle.is_some_and(|x| !(x > 0.0 && x <= std::f64::consts::FRAC_PI_2)) {
                return refuse(format!("its {key} must be above 0 and at most 90"));
            }
        }
        if let Some(flow) = self.flow {
            if self.slipstream.is_none() {
                return refuse(
                    "has a flow but no slipstream; name the thruster ahead of it".to_owned(),
                );
            }
            let not_negative = [
                ("wake_ratio", flow.wake_ratio),
                ("race_factor", flow.race_factor),
                ("diameter_to_span", flow.diameter_to_span),
                ("straightening", flow.straightening[0].min(flow.straightening[1])),
                ("hull_increase", flow.hull_increase),
            ];
            if let Some((key, _)) = not_negative.iter().find(|(_, x)| !(*x >= 0.0 && x.is_finite()))
            {
                return refuse(format!("the {key} of its flow must not be negative"));
            }
            let numbers = [flow.flow_at_m, flow.hull_at_m, flow.steering_deduction];
            if numbers.iter().any(|x| !x.is_finite()) || flow.steering_deduction >= 1.0 {
                return refuse(
                    "its flow's steering_deduction must be below 1, and all its numbers finite"
                        .to_owned(),
                );
            }
        }
        if self.lift_slope.is_some() && self.area_m2.is_none() {
            return refuse("has a lift_slope but no area_m2; add it".to_owned());
        }
        Ok(self)
    }

    fn foil(&self) -> Foil {
        Foil {
            kind: self.kind,
            name: self.name.clone(),
            position_m: self.position_body.into(),
            axis: self.axis_body.into(),
            stall_rad: self.stall_rad,
        }
    }
}

/// Largest forward component of an axis: beyond it the fin has no chord.
const MOST_AHEAD: f64 = 0.95;

/// Areas exposed to wind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Windage {
    /// Frontal area above the water, m².
    pub frontal_area_m2: Option<f64>,
    /// Lateral area above the water, m².
    pub lateral_area_m2: Option<f64>,
    /// Length over all, m.
    pub length_m: Option<f64>,
}

/// Density of air at 15 °C at sea level, kg/m³.
const AIR_KG_M3: f64 = 1.225;

impl Windage {
    /// Returns wind forces in surge, sway and yaw, with dimensionless coefficients if areas are
    /// known.
    ///
    /// # Source
    /// [Fossen2021, ch. 10].
    fn effects(&self) -> Vec<Effect> {
        let half = |area: Option<f64>| area.map_or(1.0, |area| 0.5 * AIR_KG_M3 * area);
        let turning = match (self.lateral_area_m2, self.length_m) {
            (Some(area), Some(length)) => 0.5 * AIR_KG_M3 * area * length,
            _ => 1.0,
        };
        let wind = |on: Dof, scale: f64| {
            let force = EffectForce::Wind { on, scale };
            Effect { name: format!("wind.{on}"), force }
        };
        let force = EffectForce::WindAcross { scale: turning };
        vec![
            wind(Dof::Surge, half(self.frontal_area_m2)),
            wind(Dof::Sway, half(self.lateral_area_m2)),
            wind(Dof::Yaw, turning),
            Effect { name: "wind.yaw-across".to_owned(), force },
        ]
    }
}

impl Thruster {
    fn pusher(&self) -> Pusher {
        Pusher {
            name: self.name.clone(),
            position_m: self.position_body.into(),
            direction: self.direction_body.into(),
        }
    }
}

/// A thruster acts on an axis if its wrench there is above this fraction of the greatest.
const SHARED_PART: f64 = 0.2;

/// An effect of a vehicle on its plants.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleEffect {
    /// The effect.
    pub effect: Effect,
    /// True if a plant includes it initially; otherwise a search tries it.
    pub is_usual: bool,
    /// Its coefficient, if stated in the vehicle file.
    pub known: Option<f64>,
}

/// Places where a hull may have its lift, by part of the way to its ends: between two of them, both have it.
/// The farther they are apart, the more both overstate c x².
const PLACES_OF_LIFT: [(&str, f64); 9] = [
    ("bow", 1.0),
    ("far-ahead", 0.75),
    ("ahead", 0.5),
    ("just-ahead", 0.25),
    ("amidships", 0.0),
    ("just-astern", -0.25),
    ("astern", -0.5),
    ("far-astern", -0.75),
    ("stern", -1.0),
];

impl Vehicle {
    /// Returns the effects of rudders, hulls, fins, propellers of unknown strength and wind, each with one
    /// coefficient.
    pub fn effects(&self) -> Vec<VehicleEffect> {
        let mut all = Vec::new();
        let mut push = |name: String, force: EffectForce, is_usual: bool, known: Option<f64>| {
            all.push(VehicleEffect { effect: Effect { name, force }, is_usual, known });
        };
        for thruster in &self.propellers {
            if let Some(curve) = self.open_water(thruster) {
                let force = EffectForce::OpenWater { curve };
                let deduction = thruster.open_water.and_then(|curve| curve.thrust_deduction);
                push(format!("{}.thrust", thruster.name), force, true, deduction.map(|t| 1.0 - t));
                continue;
            }
            let (propeller, name) = (thruster.name.clone(), &thruster.name);
            let position_m = thruster.position_body.into();
            let direction = thruster.direction_body.into();
            let thrust =
                EffectForce::Thrust { propeller: propeller.clone(), position_m, direction };
            push(format!("{name}.thrust"), thrust, true, None);
            let advance = EffectForce::Advance { propeller, position_m, direction };
            push(format!("{name}.advance"), advance, false, None);
            let d = thruster.direction_body;
            let moment = thruster.position_body.cross(&d);
            let along = [d.x, d.y, d.z, moment.x, moment.y, moment.z];
            let mut astern = |what: &str, way: [f64; 6]| {
                let force = EffectForce::Astern { propeller: name.clone(), way };
                push(format!("{name}.{what}"), force, false, None);
            };
            astern("astern", along);
            astern("astern-sway", [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
            astern("astern-yaw", [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        }
        for fin in &self.fins {
            let (foil, name) = (fin.foil(), &fin.name);
            let known = fin.area_m2.zip(fin.lift_slope);
            let known = known.map(|(area, slope)| 0.5 * self.water_density_kg_m3 * area * slope);
            let ahead = |name: &String| self.propellers.iter().find(|known| known.name == *name);
            let behind = fin.slipstream.as_ref().and_then(ahead);
            if let (Some(flow), Some(behind)) =
                (fin.flow, behind.and_then(|thruster| self.open_water(thruster)))
            {
                push(
                    format!("{name}.lift"),
                    EffectForce::Steering { foil, behind, flow },
                    true,
                    known,
                );
                continue;
            }
            let ahead = fin.slipstream.as_ref().map(|propeller| PropellerAhead {
                propeller: propeller.clone(),
                squared: self.propellers.iter().any(|known| known.name == *propeller),
            });
            let lift = EffectForce::Lift { foil: foil.clone(), propeller_ahead: ahead.clone() };
            push(format!("{name}.lift"), lift, true, known);
            if let Some(ahead) = ahead {
                let force = EffectForce::Slipstream { foil, propeller_ahead: ahead };
                push(format!("{name}.slipstream"), force, true, None);
            }
        }
        for (what, along) in [("lift", Dof::Sway), ("vertical-lift", Dof::Heave)] {
            let Some(end_m) = self.end_of_hull_m(along) else { continue };
            for (place, part) in PLACES_OF_LIFT {
                let force = EffectForce::HullLift { along, at_m: part * end_m };
                push(format!("hull.{what}-{place}"), force, false, None);
            }
        }
        let pushers = self.thrusters.iter().filter(|own| own.azimuth_axis.is_none());
        let thrusters: Vec<Pusher> = pushers.map(Thruster::pusher).collect();
        if (1..=MOST_READ).contains(&thrusters.len()) {
            for (name, ahead) in [("thrusters.inflow", false), ("thrusters.inflow-ahead", true)] {
                let thrusters = thrusters.clone();
                push(name.to_owned(), EffectForce::Inflow { thrusters, ahead }, false, None);
            }
        }
        for thruster in self.thrusters_with_shared_axes() {
            for (what, reverse) in [("excess-thrust", false), ("excess-reverse-thrust", true)] {
                let force = EffectForce::Gain { thruster: thruster.clone(), reverse };
                push(format!("{}.{what}", thruster.name), force, false, None);
            }
        }
        // One thruster alone has the numbers of all.
        for thruster in thrusters.iter().filter(|_| thrusters.len() > 1) {
            for number in ThrusterNumber::ALL {
                let force = EffectForce::Own { thruster: thruster.clone(), number };
                push(format!("{}.excess-{}", thruster.name, number.key()), force, false, None);
            }
        }
        let of_wind = self.windage.unwrap_or_default().effects().into_iter();
        all.extend(of_wind.map(|effect| VehicleEffect { effect, is_usual: false, known: None }));
        all
    }

    /// Returns thrusters with known curves that share an axis with another: motion cannot
    /// distinguish the gain of a single one from mass and drag.
    fn thrusters_with_shared_axes(&self) -> Vec<Pusher> {
        let fixed = self.thrusters.iter().filter(|own| own.azimuth_axis.is_none());
        let all: Vec<Pusher> = fixed.map(Thruster::pusher).collect();
        let ways: Vec<_> = all.iter().map(|own| own.way().abs()).collect();
        let shares = |k: usize| {
            (0..6).any(|axis| {
                let greatest = ways.iter().map(|way| way[axis]).fold(0.0, f64::max);
                let pushes = |way: &Vector6<f64>| way[axis] > SHARED_PART * greatest;
                let others = ways.iter().enumerate().filter(|(j, _)| *j != k);
                greatest > 0.0 && pushes(&ways[k]) && others.map(|(_, way)| way).any(pushes)
            })
        };
        let found = all.iter().enumerate().filter(|(k, _)| shares(*k));
        found.map(|(_, thruster)| thruster.clone()).collect()
    }

    /// Returns how far ahead and astern lift of the hull along an axis is to be tried, where fins steer or no thruster
    /// pushes along it: as far as the farthest fin or thruster is off.
    fn end_of_hull_m(&self, along: Dof) -> Option<f64> {
        let thrusters = || self.thrusters.iter().chain(&self.propellers);
        let pushes = |own: &Thruster| {
            own.azimuth_axis.is_some() || own.direction_body[along.index()].abs() > SHARED_PART
        };
        if self.fins.is_empty() && thrusters().any(pushes) {
            return None;
        }
        let fins = self.fins.iter().map(|fin| fin.position_body.x.abs());
        let all = fins.chain(thrusters().map(|own| own.position_body.x.abs()));
        all.reduce(f64::max).filter(|end_m| *end_m > 0.0)
    }

    fn open_water(&self, thruster: &Thruster) -> Option<OpenWater> {
        let PropellerCurve { diameter_m, k_t, wake, wake_by_drift, .. } = thruster.open_water?;
        Some(OpenWater {
            propeller: thruster.name.clone(),
            position_m: thruster.position_body.into(),
            direction: thruster.direction_body.into(),
            diameter_m,
            k_t,
            wake,
            wake_by_drift,
            density_kg_m3: self.water_density_kg_m3,
        })
    }
}
