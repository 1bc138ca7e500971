//! Confused units, and their effect on masses.

use super::Mistake;
use super::weak::Explained;
use crate::axes::listed;
use crate::caveat::spoken;
use crate::plant::RigidBody;
use crate::trial::Logged;
use crate::{Dof, Vehicle};

/// The quantity of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum What {
    Length,
    Velocity,
}

/// Relative tolerance of a ratio of units.
pub(super) const NEAR: f64 = 0.1;

impl What {
    /// Returns the unit whose numbers are `times` those in m or m/s.
    pub(super) fn unit_of(self, times: f64) -> Option<&'static str> {
        let all: &[(f64, &'static str)] = match self {
            Self::Length => &[(1000.0, "mm"), (100.0, "cm"), (3.28084, "ft")],
            Self::Velocity => &SPEEDS,
        };
        let is_near = |(of, _): &&(f64, &str)| (times / of - 1.0).abs() < NEAR;
        all.iter().find(is_near).map(|(_, unit)| *unit)
    }
}

const SPEEDS: [(f64, &str); 5] =
    [(1.943_844, "kn"), (3.280_84, "ft/s"), (3.6, "km/h"), (100.0, "cm/s"), (1000.0, "mm/s")];

/// Newtons per unit of force.
const FORCES: [(f64, &str); 2] = [(9.806_65, "kgf"), (4.448_222, "lbf")];

/// One (rad/s)², in rpm².
const SQUARE_OF_RPM: f64 = 91.189;

/// Least ratio of effective mass to mass in air, as curves are accurate to a tenth …
const LEAST_TIMES: f64 = 0.8;
/// … and greatest ratio [Jason2, table 5].
const MOST_TIMES: f64 = 8.0;

/// Usual range of that ratio, with the error of curves; and its typical value.
const USUAL_TIMES: (f64, f64) = (0.9, 6.5);
const MIDDLE_TIMES: f64 = 1.6;

/// Largest number of readings to report.
const MOST_READINGS: usize = 4;

/// Largest unexplained share of the change of velocity for a usable mass estimate.
const MOST_LEFT: f64 = 0.5;

/// Returns the mass of a vehicle in air, kg, if its file states one.
pub(super) fn mass_in_air(vehicle: &Vehicle) -> Option<f64> {
    let rigid = vehicle.rigid_body.as_ref().map(RigidBody::mass_kg);
    rigid.or(vehicle.dry_mass_kg)
}

/// Returns true if a mass is usual for a vehicle of some mass in air.
pub(super) fn is_usual(mass_kg: f64, dry_kg: f64) -> bool {
    (USUAL_TIMES.0..USUAL_TIMES.1).contains(&(mass_kg / dry_kg))
}

/// Returns the effective mass along each translation whose motion forces explain, kg.
fn masses(axes: &[(Dof, Explained)]) -> impl Iterator<Item = (Dof, f64)> {
    let is_known = |(dof, found): &&(Dof, Explained)| {
        !dof.is_rotation() && found.alpha > 0.0 && found.unexplained < MOST_LEFT
    };
    axes.iter().filter(is_known).map(|(dof, found)| (*dof, 1.0 / found.alpha))
}

/// Returns the translations along which a vehicle moves as if it were lighter than it is in air.
pub(super) fn light(dry_kg: f64, axes: &[(Dof, Explained)]) -> Vec<Dof> {
    let is_light = |(_, mass): &(Dof, f64)| *mass < LEAST_TIMES * dry_kg;
    masses(axes).filter(is_light).map(|(dof, _)| dof).collect()
}

/// Finds units of force or speed with which impossible masses become possible.
pub(super) fn mistakes(
    vehicle: &Vehicle,
    logs: &[&Logged],
    axes: &[(Dof, Explained)],
) -> Vec<Mistake> {
    let Some(dry) = mass_in_air(vehicle) else { return Vec::new() };
    let times: Vec<(Dof, f64)> = masses(axes).map(|(dof, mass)| (dof, mass / dry)).collect();
    let is_wrench = logs.iter().any(|log| log.wrench.iter().any(Option::is_some));
    let is_off = |times: f64| !(LEAST_TIMES..MOST_TIMES).contains(&times);
    let off: Vec<(Dof, f64)> = times.iter().copied().filter(|(_, times)| is_off(*times)).collect();
    if off.is_empty() {
        return Vec::new();
    }
    // The scale of thrusters and of the velocity sensor is common to all axes; wrenches have their
    // own.
    let suspect = if is_wrench { off } else { times };
    let readings = readings(&suspect, is_wrench);
    let Some(message) = message(&suspect, &readings, logs, dry) else { return Vec::new() };
    let axes = match is_wrench {
        true => suspect.iter().map(|(dof, _)| *dof).collect(),
        // Thrusters along these axes also turn the vehicle about the others.
        false => axes.iter().map(|(dof, _)| *dof).collect(),
    };
    vec![Mistake { axes, message, thrusters: None }]
}

/// A possibly wrong unit, and the factor of masses that corrects it.
struct Reading {
    times: f64,
    what: String,
    advice: String,
}

/// Returns all readings with possible masses, the likeliest first.
fn readings(off: &[(Dof, f64)], is_wrench: bool) -> Vec<Reading> {
    let mut all = Vec::new();
    let of_force = |unit: &str, is_small: bool| match (is_wrench, is_small) {
        (true, true) => format!("`unit = \"{unit}\"` for the wrench"),
        (true, false) => format!("`unit = \"N\"` for the wrench in place of {unit}"),
        (false, true) => format!(
            "multiply the thrust curves in vehicle.toml by what a {unit} is in N (`force_unit = \"{unit}\"` of a table)"
        ),
        (false, false) => format!("state the thrust curves in vehicle.toml in N, not as {unit}"),
    };
    for (times, unit) in FORCES {
        let what = format!("force is in {unit} and read as N");
        all.push(Reading { times, what, advice: of_force(unit, true) });
        let what = format!("force is in N and read as {unit}");
        all.push(Reading { times: 1.0 / times, what, advice: of_force(unit, false) });
    }
    if !is_wrench {
        for (times, what) in [
            (SQUARE_OF_RPM, "thrust curves are per rpm² and read as per (rad/s)²"),
            (1.0 / SQUARE_OF_RPM, "propeller speed is in rpm and read as rad/s"),
        ] {
            let advice = "correct the curves in vehicle.toml, or the `unit` of the thrusters' speeds in campaign.toml".to_owned();
            all.push(Reading { times, what: what.to_owned(), advice });
        }
    }
    for (times, unit) in SPEEDS {
        let what = format!("velocity is in {unit} and read as m/s");
        let advice = format!("`unit = \"{unit}\"` for the velocity in campaign.toml");
        all.push(Reading { times, what, advice });
        let what = format!("velocity is in m/s and read as {unit}");
        let advice = "`unit = \"m/s\"` for the velocity in campaign.toml".to_owned();
        all.push(Reading { times: 1.0 / times, what, advice });
    }
    let (least, most) = USUAL_TIMES;
    all.retain(|reading| off.iter().all(|(_, x)| (least..most).contains(&(reading.times * x))));
    let far = |reading: &Reading| -> f64 {
        off.iter().map(|(_, x)| (reading.times * x / MIDDLE_TIMES).ln().abs()).sum()
    };
    all.sort_by(|a, b| far(a).total_cmp(&far(b)));
    all.truncate(MOST_READINGS);
    all
}

fn message(off: &[(Dof, f64)], readings: &[Reading], logs: &[&Logged], dry: f64) -> Option<String> {
    let axes: Vec<Dof> = off.iter().map(|(dof, _)| *dof).collect();
    let times: Vec<String> = off.iter().map(|(_, times)| spoken(*times)).collect();
    let said = |reading: &Reading| {
        let masses: Vec<String> = off.iter().map(|(_, x)| spoken(reading.times * x)).collect();
        format!("{} ({} times: {})", reading.what, masses.join(", "), reading.advice)
    };
    let said: Vec<String> = readings.iter().map(said).collect();
    let wrench = axes.iter().find(|dof| logs.iter().any(|log| log.wrench[dof.index()].is_some()));
    let channel =
        wrench.map_or_else(String::new, |dof| format!(" (\"wrench.{dof}\" in campaign.toml)"));
    (!said.is_empty()).then(|| {
        format!(
            "a unit looks wrong: least squares gives {} times the {} kg of the vehicle in air in {}{channel}, and vehicles in water have 1 to 6 times; as if {}",
            times.join(", "),
            spoken(dry),
            listed(&axes),
            said.join(", or ")
        )
    })
}

/// Largest distance of a thruster from the origin, in lengths of the hull.
const FAR_TIMES: f64 = 3.0;

/// Largest length of a vehicle, relative to a cube of water of its mass.
const LONGEST_TIMES: f64 = 20.0;

/// Finds a thruster far outside the vehicle.
pub(super) fn far_thruster(vehicle: &Vehicle) -> Option<Mistake> {
    let by_mass = vehicle.dry_mass_kg.map(|mass| LONGEST_TIMES * (mass / 1000.0).cbrt());
    let by_size = vehicle.size_m.map(|size| FAR_TIMES * size.into_iter().fold(0.0, f64::max));
    let most_m = by_size.or(by_mass)?;
    let far = vehicle.thrusters.iter().find(|t| t.position_body.norm() > most_m)?;
    let at_m = far.position_body.norm();
    let message = format!(
        "a unit looks wrong: thruster `{}` is {} m from the origin, more than a vehicle of that {} reaches ({} m): its place looks as if stated in mm (then {} m); in vehicle.toml state `position_m` in m",
        far.name,
        spoken(at_m),
        if by_size.is_some() { "size" } else { "mass" },
        spoken(most_m),
        spoken(at_m / 1000.0)
    );
    Some(Mistake { axes: vec![Dof::Roll, Dof::Pitch, Dof::Yaw], message, thrusters: None })
}
