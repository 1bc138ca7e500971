//! Inputs of a prediction: a profile in TOML, or a table.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use seaplant::Quantity;
use seaplant::exchange::{Drive, Manoeuvre, PlantModel, SOLAS_RUDDER_RATE, Scenario};
use seaplant::motion::Wind;
use seaplant::quantity::{WindFrame, WindPart};
use seaplant::{Dof, Timed};
use seaplant_log::{Log, ReadOptions, Unit};
use serde::{Deserialize, Serialize};

use crate::units::dimension_of;
use crate::{Error, read_toml};

/// A profile of inputs, and the initial state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Duration, s.
    pub duration_s: f64,
    /// Time from one row of the result to the next, s.
    #[serde(default = "tenth")]
    pub sample_s: f64,
    /// Velocity of the water north and east, m/s.
    #[serde(default)]
    pub current_m_per_s: [f64; 2],
    /// The wind; still air if left out.
    #[serde(default)]
    pub wind: Option<SteadyWindEntry>,
    /// The initial state; at rest and level if left out.
    #[serde(default)]
    pub start: StartEntry,
    /// The inputs over time.
    #[serde(default)]
    pub hold: Vec<HoldEntry>,
    /// A standard manoeuvre of a ship, of which the characteristic numbers are reported instead of
    /// a motion. `hold` drives it, it begins with `start.velocity.surge`, and it is followed for
    /// `duration_s` at most.
    #[serde(default)]
    pub manoeuvre: Option<ManoeuvreEntry>,
}

/// A constant wind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SteadyWindEntry {
    /// Its speed, m/s.
    pub speed_m_per_s: f64,
    /// The direction it comes from, clockwise from north, or for a relative wind from the bow, deg.
    pub from_deg: f64,
    /// Over ground, or as measured on board.
    #[serde(default)]
    pub frame: WindFrameName,
}

/// The reference of a wind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WindFrameName {
    /// Over ground.
    #[default]
    True,
    /// As measured on board.
    Relative,
}

impl SteadyWindEntry {
    /// Returns the wind in the form that a simulation takes.
    ///
    /// # Errors
    /// [`seaplant::Error::NotFinite`] for a speed or direction that is no number.
    pub fn wind(&self) -> Result<Wind, seaplant::Error> {
        let frame = match self.frame {
            WindFrameName::True => WindFrame::True,
            WindFrameName::Relative => WindFrame::Relative,
        };
        Wind::steady(frame, self.speed_m_per_s, self.from_deg.to_radians())
    }
}

/// A standard manoeuvre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ManoeuvreEntry {
    /// The manoeuvre.
    pub kind: ManoeuvreKind,
    /// The rudder to turn.
    #[serde(default)]
    pub rudder: String,
    /// Its angle, deg.
    #[serde(default)]
    pub angle_deg: f64,
    /// The change of heading at which a zigzag reverses the rudder, deg.
    #[serde(default)]
    pub heading_deg: f64,
    /// The rudder's rate, deg/s; if left out that of the plant, or where it has none 65° in 28 s, the minimum that
    /// SOLAS requires of a ship.
    #[serde(default)]
    pub rudder_deg_per_s: Option<f64>,
}

/// The kind of manoeuvre.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ManoeuvreKind {
    /// The rudder is set to an angle and held.
    TurningCircle,
    /// The rudder is reversed each time the heading has changed by `heading_deg`.
    Zigzag,
    /// The ship is followed until it stops.
    Stop,
}

impl ManoeuvreEntry {
    /// Returns the manoeuvre, in radians.
    pub fn manoeuvre(&self) -> Manoeuvre {
        let angle = self.angle_deg.to_radians();
        match self.kind {
            ManoeuvreKind::TurningCircle => Manoeuvre::TurningCircle { angle },
            ManoeuvreKind::Zigzag => {
                Manoeuvre::Zigzag { angle, heading: self.heading_deg.to_radians() }
            }
            ManoeuvreKind::Stop => Manoeuvre::Stop,
        }
    }

    /// Returns the rudder's rate, rad/s: as stated, otherwise that of the plant, otherwise the minimum of SOLAS.
    pub fn rudder_rate(&self, model: &PlantModel) -> f64 {
        let stated = self.rudder_deg_per_s.map(f64::to_radians);
        stated.or_else(|| model.steering_gear().rate_rad_s()).unwrap_or(SOLAS_RUDDER_RATE)
    }

    /// Rejects angles that do not steer, and a rudder that does not turn.
    fn check(&self) -> Result<(), (&'static str, String)> {
        if self.kind == ManoeuvreKind::Stop {
            return Ok(());
        }
        if self.rudder.is_empty() {
            return Err(("rudder", "names no rudder; give that which is turned".to_owned()));
        }
        if !(self.angle_deg.abs() > 0.0 && self.angle_deg.abs() <= 90.0) {
            let reason = format!("is {}°; give one up to 90, to either side", self.angle_deg);
            return Err(("angle_deg", reason));
        }
        if let Some(rate) = self.rudder_deg_per_s.filter(|rate| !(*rate > 0.0 && rate.is_finite()))
        {
            return Err(("rudder_deg_per_s", format!("is {rate}°/s; give one above zero")));
        }
        let is_zigzag = self.kind == ManoeuvreKind::Zigzag;
        if is_zigzag && !(self.heading_deg > 0.0 && self.heading_deg <= 90.0) {
            let reason = format!("is {}°; give one above 0 and up to 90", self.heading_deg);
            return Err(("heading_deg", reason));
        }
        Ok(())
    }
}

const fn tenth() -> f64 {
    0.1
}

/// An initial state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartEntry {
    /// Velocity over ground by axis, m/s and rad/s.
    #[serde(default)]
    pub velocity: BTreeMap<Dof, f64>,
    /// Roll, deg.
    #[serde(default)]
    pub roll_deg: f64,
    /// Pitch, deg.
    #[serde(default)]
    pub pitch_deg: f64,
    /// Heading, deg.
    #[serde(default)]
    pub heading_deg: f64,
}

/// The inputs from a time on, until the next entry; those not named are zero.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HoldEntry {
    /// The start, s.
    #[serde(default)]
    pub from_s: f64,
    /// Force or moment by axis: a number in N or N m, or a fraction of the thrusters' maximum
    /// there, as `"60 %"`.
    #[serde(default)]
    pub force: BTreeMap<Dof, ForceEntry>,
    /// Inputs of thrusters by name: a number in the unit of the curve, or a fraction of maximum
    /// thrust, as `"60 %"`.
    #[serde(default)]
    pub thruster: BTreeMap<String, ForceEntry>,
    /// Angles of rudders and fins by name, deg.
    #[serde(default)]
    pub angle_deg: BTreeMap<String, f64>,
    /// Supply voltage, V.
    #[serde(default)]
    pub supply_v: Option<f64>,
}

/// A force or moment on an axis, or the input of a thruster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ForceEntry {
    /// N or N m; for a thruster, the unit of its curve.
    Si(f64),
    /// A fraction of the greatest thrust in that direction, as `60 %`.
    Percent(String),
}

impl ForceEntry {
    /// Returns the number before `%`.
    fn percent(text: &str) -> Option<f64> {
        let number = text.trim().strip_suffix('%')?.trim().parse::<f64>().ok()?;
        (number.abs() <= 100.0).then_some(number)
    }

    /// Returns the force in N or N m on an axis of a plant.
    ///
    /// # Errors
    /// [`seaplant::Error::Plant`] for a part of a force that the plant does not state.
    pub fn on(&self, model: &PlantModel, dof: Dof) -> Result<f64, seaplant::Error> {
        let text = match self {
            Self::Si(force) => return Ok(*force),
            Self::Percent(text) => text,
        };
        let refuse = |reason: String| seaplant::Error::Plant {
            axes: model.plant.structure().name(),
            reason: format!("a force in {dof} of `{text}` {reason}"),
        };
        let percent = Self::percent(text).ok_or_else(|| {
            refuse("is no part; write it as \"60 %\", of at most 100 %".to_owned())
        })?;
        let ends = model.force_limits(dof).ok_or_else(|| {
            let unit = dof.units().force;
            refuse(format!(
                "needs the greatest thrust there, which is not known; give {unit}, or state max_rpm or a measured table of the thrusters"
            ))
        })?;
        Ok(0.01 * percent.abs() * if percent < 0.0 { ends[0] } else { ends[1] })
    }
}

impl ForceEntry {
    /// Returns the input of a thruster of a plant, in the unit of its curve; `supply_v` is for
    /// curves of several voltages.
    ///
    /// # Errors
    /// [`seaplant::Error::Plant`] for a part of the thrust of a thruster that the plant lacks, or
    /// whose curve has no stated end.
    pub fn of_thruster(
        &self,
        model: &PlantModel,
        name: &str,
        supply_v: Option<f64>,
    ) -> Result<f64, seaplant::Error> {
        let text = match self {
            Self::Si(input) => return Ok(*input),
            Self::Percent(text) => text,
        };
        let refuse = |reason: &str| seaplant::Error::Plant {
            axes: model.plant.structure().name(),
            reason: format!("an input of thruster `{name}` of `{text}` {reason}"),
        };
        let percent = Self::percent(text)
            .ok_or_else(|| refuse("is no part; write it as \"60 %\", of at most 100 %"))?;
        let thruster = model.thrusters.iter().find(|thruster| thruster.name == name);
        let thruster = thruster.ok_or_else(|| {
            refuse("is of a thruster that the plant does not have; name one of its own")
        })?;
        model.input_for_part(thruster, 0.01 * percent, supply_v).ok_or_else(|| {
            refuse("needs the end of its curve, which is not known; give a number in the unit of the curve, or state max_rpm or a measured table")
        })
    }
}

/// Maximum number of rows of a prediction.
const MOST_ROWS: f64 = 1e6;

impl Profile {
    /// Reads a profile.
    ///
    /// # Errors
    /// [`Error::Toml`], [`Error::Io`], or [`Error::Value`] for times that are none.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let profile: Self = read_toml(path)?;
        profile.check(path)?;
        Ok(profile)
    }

    /// Rejects invalid times; messages call the profile `path`.
    ///
    /// # Errors
    /// [`Error::Value`].
    pub fn check(&self, path: &Path) -> Result<(), Error> {
        let refuse = |key: &str, reason: String| Err(Error::value(path, key, reason));
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !positive(self.duration_s) {
            return refuse("duration_s", format!("is {} s; give one above zero", self.duration_s));
        }
        if !positive(self.sample_s) || self.duration_s / self.sample_s > MOST_ROWS {
            let reason = format!(
                "is {} s; give one that makes at most a million rows of {} s",
                self.sample_s, self.duration_s
            );
            return refuse("sample_s", reason);
        }
        if let Some(Err((key, reason))) = self.manoeuvre.as_ref().map(ManoeuvreEntry::check) {
            return refuse(&format!("manoeuvre.{key}"), reason);
        }
        if let Some(SteadyWindEntry { speed_m_per_s, from_deg, .. }) = self.wind {
            if !(speed_m_per_s >= 0.0 && speed_m_per_s.is_finite()) {
                let reason = format!("is {speed_m_per_s}; give a speed in m/s, zero or more");
                return refuse("wind.speed_m_per_s", reason);
            }
            if !(-360.0..=360.0).contains(&from_deg) {
                let reason = format!("is {from_deg}; give degrees, where the wind comes from");
                return refuse("wind.from_deg", reason);
            }
        }
        let forces = self.hold.iter().flat_map(|hold| &hold.force);
        let forces = forces.map(|(dof, entry)| (format!("force.{dof}"), dof.units().force, entry));
        let inputs = self.hold.iter().flat_map(|hold| &hold.thruster);
        let inputs = inputs
            .map(|(name, entry)| (format!("thruster.{name}"), "the unit of its curve", entry));
        for (key, unit, entry) in forces.chain(inputs) {
            if let ForceEntry::Percent(text) = entry
                && ForceEntry::percent(text).is_none()
            {
                let reason = format!(
                    "is `{text}`; give a number in {unit}, or a part of at most 100 % as \"60 %\""
                );
                return refuse(&format!("hold.{key}"), reason);
            }
        }
        if self.hold.windows(2).any(|pair| pair[1].from_s <= pair[0].from_s) {
            return refuse("hold", "has entries whose from_s does not increase; sort them".into());
        }
        Ok(())
    }

    /// Returns the instants of the result, s.
    pub fn time_s(&self) -> Vec<f64> {
        let rows = (self.duration_s / self.sample_s + 1e-9).floor() as usize;
        (0..=rows).map(|k| self.sample_s * k as f64).collect()
    }

    /// Converts the profile to a scenario of a plant.
    ///
    /// # Errors
    /// As [`Profile::drive`].
    pub fn scenario(&self, model: &PlantModel) -> Result<Scenario, seaplant::Error> {
        let StartEntry { velocity, roll_deg, pitch_deg, heading_deg } = &self.start;
        Ok(Scenario {
            drive: self.drive(model)?,
            time_s: self.time_s(),
            velocity: velocity.clone(),
            attitude: [roll_deg, pitch_deg, heading_deg].map(|deg| deg.to_radians()),
            current: self.current_m_per_s,
            disturbed: false,
        })
    }

    /// Returns the inputs as series; thrusters that an entry does not name are at rest.
    ///
    /// # Errors
    /// [`seaplant::Error::NotFinite`] for an input that is no number; as [`ForceEntry::on`] and
    /// [`ForceEntry::of_thruster`].
    pub fn drive(&self, model: &PlantModel) -> Result<Drive, seaplant::Error> {
        let mut drive = Drive::default();
        for dof in Dof::ALL {
            let of = |hold: &HoldEntry| {
                hold.force.get(&dof).map(|force| force.on(model, dof)).transpose()
            };
            let forces: Vec<Option<f64>> = self.hold.iter().map(of).collect::<Result<_, _>>()?;
            if let Some(series) = self.series(&forces, 0.0)? {
                drive.wrench.insert(dof, series);
            }
        }
        let named = self.hold.iter().flat_map(|hold| hold.thruster.keys());
        for name in named {
            let known = model.thrusters.iter().find(|thruster| thruster.name == *name);
            let still = known.map_or(0.0, |thruster| thruster.curve.neutral());
            let of = |hold: &HoldEntry| {
                let entry = hold.thruster.get(name);
                entry.map(|entry| entry.of_thruster(model, name, hold.supply_v)).transpose()
            };
            let inputs: Vec<Option<f64>> = self.hold.iter().map(of).collect::<Result<_, _>>()?;
            if let Some(series) = self.series(&inputs, still)? {
                drive.thrusters.insert(name.clone(), series);
            }
        }
        let surfaces = self.hold.iter().flat_map(|hold| hold.angle_deg.keys());
        for name in surfaces {
            let angles = self.each(|hold| hold.angle_deg.get(name).map(|deg| deg.to_radians()));
            if let Some(series) = self.series(&angles, 0.0)? {
                drive.angles.insert(name.clone(), as_steps(&series)?);
            }
        }
        let first = self.hold.iter().find_map(|hold| hold.supply_v);
        drive.supply_v = self.series(&self.each(|hold| hold.supply_v), first.unwrap_or(0.0))?;
        drive.wind = self.wind.as_ref().map(SteadyWindEntry::wind).transpose()?;
        Ok(drive)
    }

    /// Returns a value of each entry.
    fn each(&self, of: impl Fn(&HoldEntry) -> Option<f64>) -> Vec<Option<f64>> {
        self.hold.iter().map(of).collect()
    }

    /// Returns a series of values by entry, with a default where an entry has none; `None` if no
    /// entry has one.
    fn series(
        &self,
        by_entry: &[Option<f64>],
        otherwise: f64,
    ) -> Result<Option<Timed>, seaplant::Error> {
        if by_entry.iter().all(Option::is_none) {
            return Ok(None);
        }
        let (mut times, mut values) = (Vec::new(), Vec::new());
        if self.hold[0].from_s > 0.0 {
            times.push(0.0);
            values.push(otherwise);
        }
        for (hold, value) in self.hold.iter().zip(by_entry) {
            times.push(hold.from_s);
            values.push(value.unwrap_or(otherwise));
        }
        Ok(Some(Timed::new("input", times, values)?))
    }
}

/// Time in which a surface moves from one angle to the next, s.
const STEP_S: f64 = 1e-3;

/// Converts a held series to straight lines with steps.
fn as_steps(held: &Timed) -> Result<Timed, seaplant::Error> {
    let (mut times, mut values) = (vec![held.first_s()], vec![held.values()[0]]);
    for (k, &t) in held.time_s().iter().enumerate().skip(1) {
        times.extend([t, t + STEP_S]);
        values.extend([held.values()[k - 1], held.values()[k]]);
    }
    Timed::new("angle", times, values)
}

/// Reads the inputs of a table that has no other columns: `wrench.AXIS`,
/// `thruster.NAME.speed|pwm|command|force`, `rudder.NAME.angle`, `fin.NAME.angle`,
/// `wind.true|relative.speed` and `.direction`, and `supply.voltage`, with time and units.
///
/// Returns `None` for a log that holds other columns, such as a measured motion.
///
/// # Errors
/// [`Error::Log`] for a file that cannot be read; [`Error::Value`] for a column of
/// inputs whose unit is missing or another's.
pub fn input_table(path: &Path) -> Result<Option<(Drive, Vec<f64>)>, Error> {
    let log = Log::open(&[(path.to_owned(), ReadOptions::default())]).map_err(|source| {
        Error::Log { trial: path.display().to_string(), source: Box::new(source) }
    })?;
    let is_input = |quantity: &Quantity| {
        matches!(
            quantity,
            Quantity::Thruster { .. }
                | Quantity::Wrench(_)
                | Quantity::SupplyVoltage
                | Quantity::SurfaceAngle { .. }
                | Quantity::Wind(..)
        )
    };
    let named = log.channels().iter().map(|channel| channel.name.parse::<Quantity>());
    let quantities: Vec<Quantity> = named.flatten().filter(is_input).collect();
    if quantities.is_empty() || quantities.len() < log.channels().len() {
        return Ok(None);
    }
    let mut drive = Drive::default();
    let first = log.channels().iter().filter_map(|channel| channel.time_s().first().copied());
    let start = first.fold(f64::INFINITY, f64::min);
    let mut time_s: Vec<f64> = Vec::new();
    let mut wind: BTreeMap<Quantity, Timed> = BTreeMap::new();
    for (channel, quantity) in log.channels().iter().zip(quantities) {
        let unit = in_unit(path, channel.unit.as_ref(), &quantity)?;
        let times: Vec<f64> = channel.time_s().iter().map(|t| t - start).collect();
        let values: Vec<f64> = channel.values().iter().map(|x| unit.to_si(*x)).collect();
        if times.len() > time_s.len() {
            time_s.clone_from(&times);
        }
        let series = Timed::new(&channel.name, times, values).map_err(Error::model(path))?;
        match quantity {
            Quantity::Thruster { name, .. } => drop(drive.thrusters.insert(name, series)),
            Quantity::Wrench(dof) => drop(drive.wrench.insert(dof, series)),
            Quantity::SurfaceAngle { name, .. } => drop(drive.angles.insert(name, series)),
            Quantity::Wind(..) => drop(wind.insert(quantity, series)),
            _ => drive.supply_v = Some(series),
        }
    }
    drive.wind = wind_of(path, &wind)?;
    Ok(Some((drive, time_s)))
}

/// Returns the wind of a table's columns.
///
/// # Errors
/// [`Error::Value`] for a speed without direction, or the other way round.
fn wind_of(path: &Path, columns: &BTreeMap<Quantity, Timed>) -> Result<Option<Wind>, Error> {
    for frame in [WindFrame::True, WindFrame::Relative] {
        let of = |part| columns.get(&Quantity::Wind(frame, part)).cloned();
        match (of(WindPart::Speed), of(WindPart::Direction)) {
            (Some(speed), Some(from)) => return Ok(Some(Wind { frame, speed, from })),
            (None, None) => {}
            (speed, _) => {
                let [has, lacks] = if speed.is_some() {
                    [WindPart::Speed, WindPart::Direction]
                } else {
                    [WindPart::Direction, WindPart::Speed]
                };
                let lacks = Quantity::Wind(frame, lacks);
                let reason = format!("needs `{lacks}` beside it; add that column");
                return Err(Error::value(path, Quantity::Wind(frame, has).to_string(), reason));
            }
        }
    }
    Ok(None)
}

fn in_unit(path: &Path, unit: Option<&Unit>, quantity: &Quantity) -> Result<Unit, Error> {
    let name = quantity.to_string();
    let Some(unit) = unit else {
        let expected = quantity.kind().unit();
        let reason = format!("has no unit; write it in the heading, as `{name} [{expected}]`");
        return Err(Error::value(path, name, reason));
    };
    unit.resolve(dimension_of(quantity.kind()))
        .map_err(|error| Error::value(path, name, error.to_string()))
}

#[cfg(test)]
mod tests {
    use seaplant::Estimate;
    use seaplant::exchange::Actuation;
    use seaplant::results::Parameter;

    use super::*;

    fn profile(text: &str) -> Profile {
        toml::from_str(text).expect("a profile")
    }

    #[test]
    fn inputs_that_an_entry_does_not_name_are_zero() {
        let profile = profile(
            "duration_s = 10.0\n[[hold]]\nfrom_s = 1.0\nforce.surge = 200.0\n[[hold]]\nfrom_s = 4.0\n",
        );
        let drive = profile.drive(&model()).expect("known");
        let surge = &drive.wrench[&Dof::Surge];
        let at = [0.5, 2.0, 5.0].map(|t| surge.held_at(t));
        assert_eq!(at, [0.0, 200.0, 0.0]);
        assert_eq!(profile.time_s().len(), 101);
    }

    #[test]
    fn a_manoeuvre_states_its_rudder_and_angles_that_steer() {
        let check = |text: &str| {
            let text = format!("duration_s = 60.0\n[manoeuvre]\n{text}");
            profile(&text).check(Path::new("p.toml")).expect_err("wrong").to_string()
        };
        assert!(check("kind = \"turning-circle\"\nangle_deg = 35").contains("manoeuvre.rudder"));
        let radians = check("kind = \"zigzag\"\nrudder = \"r\"\nangle_deg = 10");
        assert!(radians.contains("manoeuvre.heading_deg"), "{radians}");
        let most = check("kind = \"turning-circle\"\nrudder = \"r\"\nangle_deg = 350");
        assert!(most.contains("up to 90"), "{most}");
    }

    #[test]
    fn a_rudder_turns_at_its_stated_rate_or_that_of_the_plant_or_the_minimum_of_solas() {
        let entry = |text: &str| {
            let text = format!(
                "duration_s = 60.0\n[manoeuvre]\nkind = \"zigzag\"\nrudder = \"r\"\nangle_deg = 10\nheading_deg = 10\n{text}"
            );
            profile(&text)
        };
        let mut model = model();
        let rate = |text: &str, model: &PlantModel| {
            entry(text).manoeuvre.expect("given").rudder_rate(model).to_degrees()
        };
        assert!((rate("rudder_deg_per_s = 30", &model) - 30.0).abs() < 1e-12);
        assert!((rate("", &model) - 65.0 / 28.0).abs() < 1e-12);
        let found = Parameter::new(Estimate::new(15_f64.to_radians(), 0.01, 0.95), "rad/s");
        let geared = Actuation { steering_rate: Some(found), ..Actuation::default() };
        model.actuation.insert(Dof::Surge, geared);
        assert!((rate("rudder_deg_per_s = 30", &model) - 30.0).abs() < 1e-12);
        assert!((rate("", &model) - 15.0).abs() < 1e-12);
        let error = entry("rudder_deg_per_s = 0").check(Path::new("p.toml")).expect_err("stands");
        assert!(error.to_string().contains("manoeuvre.rudder_deg_per_s"), "{error}");
    }

    #[test]
    fn a_part_of_thrust_is_that_of_the_thrusters_on_the_axis() {
        let heavy = crate::read_plant_file(Path::new("published:bluerov2-heavy-von-benzon-2022"));
        let heavy = heavy.expect("a table").expect("a plant").model().expect("possible");
        let surge = |text: &str| {
            let profile = profile(&format!("duration_s = 1.0\n[[hold]]\nforce.surge = {text}"));
            profile.check(Path::new("p.toml")).map_err(|error| error.to_string())?;
            let drive = profile.drive(&heavy).map_err(|error| error.to_string())?;
            Ok::<f64, String>(drive.wrench[&Dof::Surge].held_at(0.5))
        };
        // Four thrusters of 30.4 N at 45°.
        let most = 4.0 * 30.4 * 0.5_f64.sqrt();
        assert!((surge("\"60 %\"").expect("known") - 0.6 * most).abs() < 1e-9);
        assert!((surge("\"-25%\"").expect("known") + 0.25 * most).abs() < 1e-9);
        assert_eq!(surge("7.0"), Ok(7.0));
        let error = surge("\"60 N\"").expect_err("no part");
        assert!(error.contains("hold.force.surge") && error.contains("60 %"), "{error}");
        assert!(surge("\"160 %\"").is_err());
        let open = "published:remus-100-prestero-2001";
        let open = crate::read_plant_file(Path::new(open)).expect("a table").expect("a plant");
        let entry = ForceEntry::Percent("60 %".to_owned());
        let error = entry.on(&open.model().expect("possible"), Dof::Surge).expect_err("unknown");
        assert!(error.to_string().contains("max_rpm"), "{error}");
    }

    #[test]
    fn a_part_of_a_thruster_is_an_input_of_its_curve() {
        let heavy = crate::read_plant_file(Path::new("published:bluerov2-heavy-von-benzon-2022"));
        let heavy = heavy.expect("a table").expect("a plant").model().expect("possible");
        let thruster = &heavy.thrusters[0];
        let [reverse, forward] = heavy.thrust_limits(thruster).expect("stated");
        let driven = |text: &str| {
            let entry =
                format!("duration_s = 1.0\n[[hold]]\nthruster.{:?} = {text}", thruster.name);
            let profile = profile(&entry);
            profile.check(Path::new("p.toml")).map_err(|error| error.to_string())?;
            let drive = profile.drive(&heavy).map_err(|error| error.to_string())?;
            Ok::<f64, String>(drive.thrusters[&thruster.name].held_at(0.5))
        };
        for (text, thrust) in [("\"60 %\"", 0.6 * forward), ("\"-25 %\"", 0.25 * reverse)] {
            let input = driven(text).expect("known");
            assert!((thruster.curve.force(input, None) - thrust).abs() < 1e-6 * forward, "{text}");
        }
        assert_eq!(driven("\"0 %\""), Ok(thruster.curve.neutral()));
        assert_eq!(driven("1600.0"), Ok(1600.0));
        let error = driven("\"160 %\"").expect_err("too much");
        assert!(error.contains(&format!("hold.thruster.{}", thruster.name)), "{error}");
        let entry = ForceEntry::Percent("60 %".to_owned());
        let error = entry.of_thruster(&heavy, "tail", None).expect_err("no such thruster");
        assert!(error.to_string().contains("`tail`"), "{error}");
    }

    #[test]
    fn wrong_times_are_refused_by_their_key() {
        let check =
            |text: &str| profile(text).check(Path::new("p.toml")).expect_err("wrong").to_string();
        assert!(check("duration_s = 0.0").contains("duration_s"));
        assert!(check("duration_s = 1e9\nsample_s = 0.1").contains("a million rows"));
        let twice = "duration_s = 1.0\n[[hold]]\nfrom_s = 1.0\n[[hold]]\nfrom_s = 1.0";
        assert!(check(twice).contains("does not increase"));
    }

    #[test]
    fn a_table_of_inputs_alone_is_distinguished_from_a_log() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).expect("written");
            path
        };
        let alone = write("in.csv", "time [s],wrench.surge [kN]\n5.0,0.1\n6.0,0.2\n");
        let (drive, time_s) = input_table(&alone).expect("read").expect("inputs alone");
        assert_eq!(drive.wrench[&Dof::Surge].held_at(1.0), 200.0);
        assert_eq!(time_s, [0.0, 1.0]);
        let log = write("log.csv", "time [s],wrench.surge [N],u [m/s]\n0,1,0\n1,2,0\n");
        assert_eq!(input_table(&log).expect("read"), None);
    }

    fn model() -> PlantModel {
        let file = crate::read_plant_file(Path::new("published:wam-v-vrx"));
        file.expect("a table").expect("a plant").model().expect("possible")
    }

    #[test]
    fn wind_comes_from_a_profile_or_from_columns() {
        let given = profile("duration_s = 1.0\nwind = { speed_m_per_s = 5.0, from_deg = 90.0 }");
        let wind = given.drive(&model()).expect("known").wind.expect("given");
        assert_eq!((wind.frame, wind.speed.at(0.5)), (WindFrame::True, 5.0));
        assert!((wind.from.at(0.5) - 90_f64.to_radians()).abs() < 1e-12);
        let wrong = profile("duration_s = 1.0\nwind = { speed_m_per_s = -5.0, from_deg = 90.0 }");
        let error = wrong.check(Path::new("p.toml")).expect_err("negative").to_string();
        assert!(error.contains("wind.speed_m_per_s"), "{error}");
        let folder = tempfile::tempdir().expect("a folder");
        let table = |text: &str| {
            let path = folder.path().join("in.csv");
            std::fs::write(&path, text).expect("written");
            input_table(&path)
        };
        let columns = "time [s],wind.relative.speed [kn],wind.relative.direction [deg]\n";
        let (drive, _) =
            table(&format!("{columns}0,10,180\n1,10,180\n")).expect("read").expect("inputs");
        let wind = drive.wind.expect("both columns");
        assert_eq!(wind.frame, WindFrame::Relative);
        assert!((wind.speed.at(0.5) - 5.144).abs() < 1e-3, "{}", wind.speed.at(0.5));
        let half = table("time [s],wind.true.speed [m/s]\n0,10\n1,10\n").expect_err("half");
        assert!(half.to_string().contains("wind.true.direction"), "{half}");
    }
}
