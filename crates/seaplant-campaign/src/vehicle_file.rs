//! vehicle.toml.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use seaplant::plant::{RudderFlow, WakeByDrift};
use seaplant::results::InputFile;
use seaplant::{
    Caveat, CaveatCode, Fin, PropellerCurve, QuadraticThrust, SEA_WATER_KG_M3, Sensor, Sensors,
    Surface, ThrustCurve, ThrustTable, ThrustUncertainty, Thruster, ThrusterInput, Vehicle,
    Windage, exact,
};
use serde::{Deserialize, Serialize};

use crate::bench::{BenchColumns, read_bench};
use crate::campaign_file::EstimateWord;
use crate::plant_file::{BuoyancyEntry, RigidBodyEntry};
use crate::preset::{CurvePreset, PRESET_STD, VehiclePreset};
use crate::{Error, toml_file};

/// What a vehicle.toml says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleFile {
    /// A known vehicle, whose name and thrusters it takes; what stands here goes before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<VehiclePreset>,
    /// What the vehicle is called; a known one has a name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Mass in air, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dry_mass_kg: Option<f64>,
    /// Length, width and height of the hull, m: to judge drag and added mass by, and to say
    /// how far the vehicle goes for its size.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub size_m: Option<[f64; 3]>,
    /// Mass, centre of gravity and inertia in air, for plants of several axes: what the water adds
    /// is then told apart, and is never below zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rigid_body: Option<RigidBodyEntry>,
    /// Displaced water and centre of buoyancy, to check restoring forces by.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub buoyancy: Option<BuoyancyEntry>,
    /// The curve of every thruster that states none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thruster_curve: Option<CurveEntry>,
    /// The thrusters; one that is called as one of a known vehicle states what is otherwise.
    #[serde(default)]
    pub thruster: Vec<ThrusterEntry>,
    /// Rudders.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rudder: Vec<FinEntry>,
    /// Other fins: stern planes, bow planes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fin: Vec<FinEntry>,
    /// What the wind meets, so that its coefficients have no dimension.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind: Option<WindEntry>,
    /// Density of the water, kg/m³; 1025 if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub water_density_kg_m3: Option<f64>,
    /// Draught, m: with it coefficients without dimension are by length times draught, as of
    /// ships, else by length squared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub draught_m: Option<f64>,
    /// The instruments; one that is left out sits at the origin, aligned.
    #[serde(default)]
    pub sensor: SensorEntries,
}

/// A thruster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThrusterEntry {
    /// How channels call it: `thruster.NAME.speed`.
    pub name: String,
    /// Where it pushes, m: x forward, y starboard, z down.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub position_m: Option<[f64; 3]>,
    /// The way that positive thrust pushes the vehicle; any length but zero.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub direction: Option<[f64; 3]>,
    /// What `thruster.NAME.azimuth` turns it about, by the right hand: [0, 0, 1] turns it to
    /// starboard; `direction` is that at zero azimuth.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub azimuth_axis: Option<[f64; 3]>,
    /// Whether positive input pushes against `direction`, as of motors that ArduPilot reverses
    /// (`MOT_1_DIRECTION` is -1).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reversed: bool,
    /// From input to force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<CurveEntry>,
    /// How well its strength is known; carried into mass and drag. Thrusters of one degree of
    /// freedom are taken to be off together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thrust_uncertainty: Option<UncertaintyEntry>,
}

/// A rudder or fin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FinEntry {
    /// How channels call it: `rudder.NAME.angle`, `fin.NAME.angle`.
    pub name: String,
    /// Where its force acts, m: x forward, y starboard, z down.
    #[serde(deserialize_with = "exact::numbers")]
    pub position_m: [f64; 3],
    /// What it turns about: a positive angle turns its leading edge about this by the right hand.
    /// [0, 0, -1] is a rudder whose positive angle turns the bow to starboard.
    #[serde(deserialize_with = "exact::numbers")]
    pub axis: [f64; 3],
    /// Its area, m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area_m2: Option<f64>,
    /// `∂C_L/∂α`, 1/rad; estimated if it is left out or `\"estimate\"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lift_slope: Option<LiftEntry>,
    /// The angle of attack beyond which lift grows no more, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stall_deg: Option<f64>,
    /// The greatest angle that it turns to, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_deg: Option<f64>,
    /// The thruster in whose race it stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slipstream: Option<String>,
    /// What hull and race do to its flow, where that is known: behind a thruster whose curve is
    /// `open-water`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flow: Option<FlowEntry>,
}

/// The flow at a rudder behind a ship, by the MMG standard method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowEntry {
    /// ε: `(1 − w_R)/(1 − w_P)`.
    pub wake_ratio: f64,
    /// κ: how far the race has been sped up where the rudder is.
    pub race_factor: f64,
    /// η: the propeller's diameter over the rudder's span.
    pub diameter_to_span: f64,
    /// γ_R: one number, or two, for flow at the rudder from starboard and from port.
    pub straightening: StraighteningEntry,
    /// l_R: at which x the sideways flow is that of the hull, m.
    pub flow_at_m: f64,
    /// t_R: the part of the rudder's drag that the hull takes back.
    #[serde(default)]
    pub steering_deduction: f64,
    /// a_H: what the hull adds to the rudder's side force, as a part of it.
    #[serde(default)]
    pub hull_increase: f64,
    /// x_H: at which x it adds that, m; 0 if it adds nothing.
    #[serde(default)]
    pub hull_at_m: f64,
}

/// Flow straightening of both sides, or of each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, or two: [from starboard, from port]")]
pub enum StraighteningEntry {
    /// Of both.
    Both(f64),
    /// Of flow from starboard, and of flow from port.
    Each([f64; 2]),
}

impl FlowEntry {
    fn flow(self) -> RudderFlow {
        let straightening = match self.straightening {
            StraighteningEntry::Both(x) => [x; 2],
            StraighteningEntry::Each(each) => each,
        };
        RudderFlow {
            wake_ratio: self.wake_ratio,
            race_factor: self.race_factor,
            diameter_to_span: self.diameter_to_span,
            straightening,
            flow_at_m: self.flow_at_m,
            steering_deduction: self.steering_deduction,
            hull_increase: self.hull_increase,
            hull_at_m: self.hull_at_m,
        }
    }
}

/// A lift slope, or `"estimate"`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a lift slope in 1/rad or \"estimate\"")]
pub enum LiftEntry {
    /// So much, 1/rad.
    Stated(f64),
    /// As the trials tell.
    Told(EstimateWord),
}

impl FinEntry {
    fn fin(&self, kind: Surface, path: &Path) -> Result<Fin, Error> {
        let lift_slope = match self.lift_slope {
            Some(LiftEntry::Stated(slope)) => Some(slope),
            Some(LiftEntry::Told(_)) | None => None,
        };
        let fin = Fin::new(kind, &self.name, self.position_m, self.axis).and_then(|fin| {
            Fin {
                area_m2: self.area_m2,
                lift_slope,
                stall_rad: self.stall_deg.map(f64::to_radians),
                limit_rad: self.limit_deg.map(f64::to_radians),
                slipstream: self.slipstream.clone(),
                flow: self.flow.map(FlowEntry::flow),
                ..fin
            }
            .checked()
        });
        fin.map_err(Error::model(path))
    }
}

/// What the wind meets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WindEntry {
    /// Area above the water from ahead, m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frontal_area_m2: Option<f64>,
    /// Area above the water from the side, m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lateral_area_m2: Option<f64>,
    /// Length over all, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_m: Option<f64>,
}

impl WindEntry {
    fn windage(&self, path: &Path) -> Result<Windage, Error> {
        let Self { frontal_area_m2, lateral_area_m2, length_m } = *self;
        let all = [
            ("frontal_area_m2", frontal_area_m2),
            ("lateral_area_m2", lateral_area_m2),
            ("length_m", length_m),
        ];
        let wrong = all.iter().find(|(_, x)| x.is_some_and(|x| !(x > 0.0 && x.is_finite())));
        if let Some((key, _)) = wrong {
            let reason = "must be a positive number; leave it out if it is not known";
            return Err(Error::value(path, format!("wind.{key}"), reason));
        }
        Ok(Windage { frontal_area_m2, lateral_area_m2, length_m })
    }
}

/// Densities that water has, kg/m³.
const WATER_KG_M3: std::ops::RangeInclusive<f64> = 950.0..=1100.0;

/// Standard deviations of thrust, as parts of it: 0.05 for 5 %.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct UncertaintyEntry {
    /// Of positive thrust.
    pub forward: f64,
    /// Of negative thrust.
    pub reverse: f64,
}

/// A thrust curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum CurveEntry {
    /// Force by the square of the input.
    Quadratic(QuadraticEntry),
    /// Force by measured points.
    Table(TableEntry),
    /// The published curve of a known thruster.
    Preset(PresetCurveEntry),
    /// Of unknown strength, `k n|n|`, to be estimated by a plant of several axes.
    Estimate(EstimateCurveEntry),
    /// Of a propeller whose open-water curve is known, for plants of several axes.
    OpenWater(OpenWaterEntry),
}

/// `T = (1 − t) ρ n² D⁴ K_T(J)`, `J = u (1 − w)/(n D)`, `K_T = k0 + k1 J + k2 J²`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpenWaterEntry {
    /// Diameter D, m.
    pub diameter_m: f64,
    /// k0, k1, k2.
    #[serde(deserialize_with = "exact::numbers")]
    pub k_t: [f64; 3],
    /// Wake fraction w: 0 for a propeller that no hull shades.
    pub wake: f64,
    /// How the wake changes with drift: `{ rate = C1, greatest = [C2 of flow from starboard, C2 of
    /// flow from port] }`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wake_by_drift: Option<WakeByDrift>,
    /// Thrust deduction fraction t; estimated if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thrust_deduction: Option<f64>,
}

impl OpenWaterEntry {
    fn curve(&self, path: &Path, thruster: &str) -> Result<PropellerCurve, Error> {
        let Self { diameter_m, k_t, wake, wake_by_drift, thrust_deduction } = *self;
        PropellerCurve { diameter_m, k_t, wake, wake_by_drift, thrust_deduction }
            .checked(thruster)
            .map_err(Error::model(path))
    }
}

/// A curve that is not known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EstimateCurveEntry {
    /// What is logged as n: speed (rad/s) or command (−1 to 1).
    #[serde(default = "speed")]
    pub input: ThrusterInput,
}

/// The published curve of a known thruster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PresetCurveEntry {
    /// Which.
    pub name: CurvePreset,
    /// The supply voltage, V; that which is logged as supply.voltage if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voltage_v: Option<f64>,
}

/// `F = forward s|s|` or `reverse s|s|`, s being the input beyond the deadband.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuadraticEntry {
    /// N per squared unit of input, for positive input: N/(rad/s)² for a speed.
    pub forward: f64,
    /// N per squared unit of input, for negative input.
    pub reverse: f64,
    /// What is logged: speed (rad/s), pwm (us) or command (−1 to 1).
    #[serde(default = "speed")]
    pub input: ThrusterInput,
    /// Inputs this close to neutral give no thrust; rad/s, us or a ratio.
    #[serde(default)]
    pub deadband: f64,
    /// The input that means stop: 0 by default, 1500 for pwm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub neutral: Option<f64>,
}

const fn speed() -> ThrusterInput {
    ThrusterInput::Speed
}

/// Points, or a file of them; several files for several supply voltages.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TableEntry {
    /// What is logged: speed (rad/s), pwm (us) or command (−1 to 1).
    pub input: Option<ThrusterInput>,
    /// Points `[input, force in N]`, input in rad/s, us or as a ratio.
    #[serde(deserialize_with = "exact::rows_of_numbers", skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
    /// A table with a column of inputs and one of forces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Which columns of it; told by their units and names if not said.
    #[serde(skip_serializing_if = "BenchColumns::is_default")]
    pub columns: BenchColumns,
    /// Tables measured at several supply voltages, in place of one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub voltages: Vec<VoltageEntry>,
}

/// A table measured at one supply voltage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VoltageEntry {
    /// Supply voltage, V.
    pub voltage_v: f64,
    /// The table.
    pub file: PathBuf,
}

/// The instruments.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SensorEntries {
    /// Doppler velocity log.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dvl: Option<DvlEntry>,
    /// Depth sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<PositionEntry>,
    /// Roll, pitch and heading.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude: Option<AttitudeEntry>,
    /// Positioning antenna, beacon or marker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<PositionEntry>,
    /// Accelerometer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu: Option<ImuEntry>,
}

/// An accelerometer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ImuEntry {
    /// Where it sits, m, body frame.
    #[serde(deserialize_with = "exact::numbers")]
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw that turn the vehicle's axes into the instrument's, deg.
    #[serde(deserialize_with = "exact::numbers")]
    pub rotation_deg: [f64; 3],
    /// Standard deviation of one sample, m/s².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_m_s2: Option<f64>,
    /// Whether each logged sample is the mean since the one before; else it is what was measured at
    /// its instant.
    pub averages: bool,
}

/// A Doppler velocity log.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DvlEntry {
    /// Where it sits, m, body frame.
    #[serde(deserialize_with = "exact::numbers")]
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw that turn the vehicle's axes into the instrument's, deg.
    #[serde(deserialize_with = "exact::numbers")]
    pub rotation_deg: [f64; 3],
    /// Standard deviation of one sample, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_m_s: Option<f64>,
}

/// An instrument that measures position.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PositionEntry {
    /// Where it sits, m, body frame.
    #[serde(deserialize_with = "exact::numbers")]
    pub position_m: [f64; 3],
    /// Standard deviation of one sample, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_m: Option<f64>,
}

/// An instrument that measures attitude.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AttitudeEntry {
    /// Roll, pitch, yaw that turn the vehicle's axes into the instrument's, deg.
    #[serde(deserialize_with = "exact::numbers")]
    pub rotation_deg: [f64; 3],
    /// Standard deviation of one sample, deg.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_deg: Option<f64>,
}

/// Reads a vehicle.toml, and the curve tables that it names.
///
/// # Errors
/// [`Error::Io`], [`Error::Toml`], and [`Error::Value`] for what is well-formed and wrong.
pub fn read_vehicle(path: &Path) -> Result<(Vehicle, Vec<InputFile>), Error> {
    let SourcedVehicle { vehicle, inputs, .. } = SourcedVehicle::open(path)?;
    Ok((vehicle, inputs))
}

/// A vehicle, and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct SourcedVehicle {
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Its file, and the curve tables that this names.
    pub inputs: Vec<InputFile>,
    /// What gives reason to doubt it.
    pub doubt: Option<Caveat>,
}

impl SourcedVehicle {
    /// [`read_vehicle`], with what gives reason to doubt the vehicle.
    ///
    /// # Errors
    /// As [`read_vehicle`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (file, input): (VehicleFile, _) = toml_file::read(path)?;
        let mut sourced = Self::of(file, path)?;
        sourced.inputs.insert(0, input);
        Ok(sourced)
    }

    /// The vehicle of a file's content; `path` is where paths in it are relative to, and what
    /// messages call it.
    ///
    /// # Errors
    /// As [`read_vehicle`].
    pub fn of(file: VehicleFile, path: &Path) -> Result<Self, Error> {
        let (mut inputs, doubt) = (Vec::new(), file.caveat());
        let vehicle = file.into_vehicle(path, &mut inputs)?;
        Ok(Self { vehicle, inputs, doubt })
    }
}

impl VehicleFile {
    fn into_vehicle(self, path: &Path, inputs: &mut Vec<InputFile>) -> Result<Vehicle, Error> {
        let mut names = BTreeSet::new();
        if let Some(twice) = self.thruster.iter().find(|entry| !names.insert(&entry.name)) {
            let reason = "stands twice; give each thruster its own name";
            return Err(Error::value(path, format!("thruster `{}`", twice.name), reason));
        }
        let of_vehicle = self.name.iter().map(|name| ("name".to_owned(), name));
        let of_thrusters =
            self.thruster.iter().map(|entry| (format!("thruster `{}`", entry.name), &entry.name));
        if let Some((key, _)) =
            of_vehicle.chain(of_thrusters).find(|(_, name)| name.chars().any(char::is_control))
        {
            let reason = "holds a line break or another control character; leave it out";
            return Err(Error::value(path, key, reason));
        }
        if self.dry_mass_kg.is_some_and(|mass| !(mass > 0.0 && mass.is_finite())) {
            return Err(Error::value(path, "dry_mass_kg", "must be a positive number of kg"));
        }
        if self.size_m.is_some_and(|size| size.iter().any(|x| !(*x > 0.0 && x.is_finite()))) {
            let reason =
                "must be length, width and height of the hull, three positive numbers of m";
            return Err(Error::value(path, "size_m", reason));
        }
        let of_preset = || self.preset.map(|preset| preset.title().to_owned());
        if self.draught_m.is_some_and(|x| !(x > 0.0 && x.is_finite())) {
            return Err(Error::value(path, "draught_m", "must be a positive number of m"));
        }
        let name = self
            .name
            .clone()
            .or_else(of_preset)
            .ok_or_else(|| Error::value(path, "vehicle", toml_file::missing(path, "name")))?;
        let entries = self.entries();
        let (mut thrusters, mut propellers) = (Vec::new(), Vec::new());
        for entry in &entries {
            let mut thruster = self.thruster(entry, path, inputs)?;
            let curve = entry.curve.as_ref().or(self.thruster_curve.as_ref());
            if let Some(CurveEntry::OpenWater(curve)) = curve {
                thruster.open_water = Some(curve.curve(path, &entry.name)?);
            }
            let is_estimated =
                matches!(curve, Some(CurveEntry::Estimate(_) | CurveEntry::OpenWater(_)));
            if is_estimated { propellers.push(thruster) } else { thrusters.push(thruster) }
        }
        let fins = self.fins(path)?;
        let windage = self.wind.as_ref().map(|entry| entry.windage(path)).transpose()?;
        let water_density_kg_m3 = self.water_density_kg_m3.unwrap_or(SEA_WATER_KG_M3);
        if !WATER_KG_M3.contains(&water_density_kg_m3) {
            let reason = format!("is {water_density_kg_m3}; water has 950 to 1100 kg/m³");
            return Err(Error::value(path, "water_density_kg_m3", reason));
        }
        self.sensor.check(path)?;
        let sensors = self.sensor.clone().into_sensors();
        let Self { dry_mass_kg, size_m, draught_m, .. } = self;
        let rigid_body = self.rigid_body.as_ref().map(|entry| entry.body(path, dry_mass_kg));
        let buoyancy = self.buoyancy.as_ref().map(|entry| entry.buoyancy(path));
        let (rigid_body, buoyancy) = (rigid_body.transpose()?, buoyancy.transpose()?);
        Ok(Vehicle {
            name,
            dry_mass_kg,
            size_m,
            draught_m,
            rigid_body,
            buoyancy,
            thrusters,
            propellers,
            fins,
            windage,
            water_density_kg_m3,
            sensors,
        })
    }

    /// Whether the curve of a thruster is that of open water.
    fn is_open_water(&self, name: Option<&String>) -> bool {
        let entries = self.entries();
        let thruster = name.and_then(|name| entries.iter().find(|known| known.name == *name));
        let curve = thruster.map(|entry| entry.curve.as_ref().or(self.thruster_curve.as_ref()));
        matches!(curve, Some(Some(CurveEntry::OpenWater(_))))
    }

    /// Rudders and fins, each with a name of its own.
    fn fins(&self, path: &Path) -> Result<Vec<Fin>, Error> {
        let rudders = self.rudder.iter().map(|entry| (Surface::Rudder, entry));
        let all = rudders.chain(self.fin.iter().map(|entry| (Surface::Fin, entry)));
        let mut names: BTreeSet<&String> = self.thruster.iter().map(|entry| &entry.name).collect();
        let mut fins = Vec::new();
        for (kind, entry) in all {
            let key = format!("{} `{}`", kind.name(), entry.name);
            if !names.insert(&entry.name) || entry.name == "wind" {
                let reason = "is called as something else; give each rudder, fin and thruster its own name, and none of them `wind`";
                return Err(Error::value(path, key, reason));
            }
            if entry.name.is_empty() || entry.name.chars().any(char::is_control) {
                let reason = "its name is empty or holds a control character; give it another";
                return Err(Error::value(path, key, reason));
            }
            if entry.flow.is_some() && !self.is_open_water(entry.slipstream.as_ref()) {
                let reason = "needs a slipstream: a thruster whose curve has kind = \"open-water\"; name it, or leave flow out";
                return Err(Error::value(path, format!("{key}, flow"), reason));
            }
            if let Some(ahead) = &entry.slipstream
                && !self.entries().iter().any(|known| known.name == *ahead)
            {
                let reason = format!("the vehicle has no thruster `{ahead}` ahead of it");
                return Err(Error::value(path, format!("{key}, slipstream"), reason));
            }
            fins.push(entry.fin(kind, path)?);
        }
        Ok(fins)
    }

    /// The thrusters of a known vehicle, as far as the file does not say otherwise, and then
    /// those that it adds.
    fn entries(&self) -> Vec<ThrusterEntry> {
        let known = self.preset.map(VehiclePreset::thrusters).unwrap_or_default();
        let stated = |name: &str| self.thruster.iter().find(|entry| entry.name == name).cloned();
        let completed = known.iter().map(|known| {
            let stated = stated(known.name).unwrap_or_else(|| ThrusterEntry::called(known.name));
            ThrusterEntry {
                position_m: stated.position_m.or(Some(known.position_m)),
                direction: stated.direction.or(Some(known.direction)),
                ..stated
            }
        });
        let is_known = |entry: &&ThrusterEntry| known.iter().any(|known| known.name == entry.name);
        let added = self.thruster.iter().filter(|entry| !is_known(entry)).cloned();
        completed.chain(added).collect()
    }

    fn thruster(
        &self,
        entry: &ThrusterEntry,
        path: &Path,
        inputs: &mut Vec<InputFile>,
    ) -> Result<Thruster, Error> {
        let lacks = |key: &str| {
            let reason = toml_file::missing(path, key);
            Error::value(path, format!("thruster `{}`", entry.name), reason)
        };
        let position_m = entry.position_m.ok_or_else(|| lacks("position_m"))?;
        let direction = entry.direction.ok_or_else(|| lacks("direction"))?;
        let direction = if entry.reversed { direction.map(|d| -d) } else { direction };
        let curve =
            entry.curve.as_ref().or(self.thruster_curve.as_ref()).ok_or_else(|| {
                match self.preset {
                    Some(_) => {
                        let reason =
                            "missing field `curve`\nadd it, or a thruster_curve for all thrusters";
                        Error::value(path, format!("thruster `{}`", entry.name), reason)
                    }
                    None => lacks("curve"),
                }
            })?;
        let (curve_entry, curve) = (curve, curve.read(path, &entry.name, inputs)?);
        let usual = curve_entry.usual_uncertainty();
        let UncertaintyEntry { forward, reverse } = entry.thrust_uncertainty.unwrap_or(usual);
        Thruster::new(&entry.name, position_m, direction, curve)
            .and_then(|t| match entry.azimuth_axis {
                Some(axis) => t.turned_about(axis),
                None => Ok(t),
            })
            .and_then(|t| t.with_uncertainty(ThrustUncertainty { forward, reverse }))
            .map_err(Error::model(path))
    }

    /// Thrusters that nobody measured on this vehicle.
    fn caveat(&self) -> Option<Caveat> {
        let preset = self.preset?;
        let measured = |name: &str| {
            self.thruster.iter().any(|entry| entry.name == name && entry.position_m.is_some())
        };
        let assumed = preset.thrusters().iter().filter(|known| !measured(known.name)).count();
        let message = format!(
            "{assumed} thrusters are taken to sit where the preset {} has them; roll, pitch and yaw \
             go by that: measure your vehicle and state position_m",
            preset.key()
        );
        (assumed > 0).then(|| Caveat::note(CaveatCode::PresetGeometry, message))
    }
}

impl ThrusterEntry {
    /// One of which nothing but the name is said.
    fn called(name: &str) -> Self {
        let name = name.to_owned();
        Self {
            name,
            position_m: None,
            direction: None,
            azimuth_axis: None,
            reversed: false,
            curve: None,
            thrust_uncertainty: None,
        }
    }
}

impl SensorEntries {
    /// A standard deviation of zero or less would give an instrument any weight.
    fn check(&self, path: &Path) -> Result<(), Error> {
        let stated = [
            ("dvl.std_m_s", self.dvl.as_ref().and_then(|dvl| dvl.std_m_s)),
            ("depth.std_m", self.depth.as_ref().and_then(|depth| depth.std_m)),
            ("attitude.std_deg", self.attitude.as_ref().and_then(|attitude| attitude.std_deg)),
            ("position.std_m", self.position.as_ref().and_then(|position| position.std_m)),
            ("imu.std_m_s2", self.imu.as_ref().and_then(|imu| imu.std_m_s2)),
        ];
        for (key, std) in stated {
            if std.is_some_and(|std| !(std > 0.0 && std.is_finite())) {
                let reason = "must be a positive number; leave it out if it is not known";
                return Err(Error::value(path, format!("sensor.{key}"), reason));
            }
        }
        Ok(())
    }

    fn into_sensors(self) -> Sensors {
        let sensor = |position_m: [f64; 3], rotation_deg: [f64; 3], std| Sensor {
            position_body: position_m.into(),
            rotation_rad: rotation_deg.map(f64::to_radians),
            std,
        };
        let (dvl, depth) = (self.dvl.unwrap_or_default(), self.depth.unwrap_or_default());
        let (attitude, position) =
            (self.attitude.unwrap_or_default(), self.position.unwrap_or_default());
        let (level, imu) = ([0.0; 3], self.imu.unwrap_or_default());
        Sensors {
            dvl: sensor(dvl.position_m, dvl.rotation_deg, dvl.std_m_s),
            depth: sensor(depth.position_m, level, depth.std_m),
            attitude: sensor(
                [0.0; 3],
                attitude.rotation_deg,
                attitude.std_deg.map(f64::to_radians),
            ),
            position: sensor(position.position_m, level, position.std_m),
            imu: sensor(imu.position_m, imu.rotation_deg, imu.std_m_s2),
            imu_averages: imu.averages,
        }
    }
}

impl CurveEntry {
    /// How well the strength of a curve is known of which nothing is said: of a preset, no
    /// better than one thruster is like another.
    fn usual_uncertainty(&self) -> UncertaintyEntry {
        match self {
            Self::Preset(_) => UncertaintyEntry { forward: PRESET_STD, reverse: PRESET_STD },
            Self::Quadratic(_) | Self::Table(_) | Self::Estimate(_) | Self::OpenWater(_) => {
                UncertaintyEntry::default()
            }
        }
    }

    fn read(
        &self,
        path: &Path,
        thruster: &str,
        inputs: &mut Vec<InputFile>,
    ) -> Result<ThrustCurve, Error> {
        let key = format!("thruster `{thruster}`, curve");
        match self {
            Self::Quadratic(entry) => entry.curve(path, &key),
            Self::Table(entry) => entry.curve(path, &key, inputs),
            Self::Preset(PresetCurveEntry { name, voltage_v }) => {
                name.curve(*voltage_v).map_err(|reason| Error::value(path, key, reason))
            }
            // Only what it reads matters: the plant's own terms hold its thrust.
            Self::OpenWater(_) => {
                let law =
                    QuadraticThrust { forward: 1.0, reverse: 1.0, ..QuadraticThrust::default() };
                Ok(ThrustCurve::Quadratic { input: ThrusterInput::Speed, law })
            }
            Self::Estimate(EstimateCurveEntry { input }) => match input {
                ThrusterInput::Speed | ThrusterInput::Command => {
                    let (forward, reverse) = (1.0, 1.0);
                    let law = QuadraticThrust { forward, reverse, ..QuadraticThrust::default() };
                    Ok(ThrustCurve::Quadratic { input: *input, law })
                }
                ThrusterInput::Pwm | ThrusterInput::Force => {
                    let reason = "is to be estimated from a speed or a command; map one of these, pulse widths by scale and offset as a command from -1 to 1";
                    Err(Error::value(path, key, reason))
                }
            },
        }
    }
}

/// No thruster gives so much thrust for its input, in SI units.
const LARGEST: f64 = 1e9;

/// The pulse width that stops a hobby speed controller, us.
const STOPPED_US: f64 = 1500.0;

impl QuadraticEntry {
    fn curve(&self, path: &Path, key: &str) -> Result<ThrustCurve, Error> {
        if self.input == ThrusterInput::Force {
            let reason = "input = \"force\" needs no curve; use speed, pwm or command";
            return Err(Error::value(path, key, reason));
        }
        let numbers = [self.forward, self.reverse, self.deadband];
        if numbers.iter().any(|x| !(x.is_finite() && *x >= 0.0)) || self.forward == 0.0 {
            let reason = "forward must be positive, reverse and deadband not negative; the sign of reverse thrust comes from the input";
            return Err(Error::value(path, key, reason));
        }
        if numbers.iter().any(|x| *x > LARGEST) {
            let reason = format!("holds a number above {LARGEST:e}; check its unit");
            return Err(Error::value(path, key, reason));
        }
        let neutral = match self.input {
            ThrusterInput::Pwm => STOPPED_US,
            _ => 0.0,
        };
        let law = QuadraticThrust {
            forward: self.forward,
            reverse: self.reverse,
            deadband: self.deadband,
            neutral: self.neutral.unwrap_or(neutral),
        };
        Ok(ThrustCurve::Quadratic { input: self.input, law })
    }
}

impl TableEntry {
    /// A measured table may repeat an input; of points that are written down one is wrong.
    fn check_points(&self, path: &Path, key: &str) -> Result<(), Error> {
        if self.points.iter().flatten().any(|x| x.abs() > LARGEST) {
            let reason = format!("holds a number above {LARGEST:e}; check its unit");
            return Err(Error::value(path, key, reason));
        }
        let mut inputs: Vec<f64> = self.points.iter().map(|[input, _]| *input).collect();
        inputs.sort_by(f64::total_cmp);
        if let Some(twice) = inputs.windows(2).find(|pair| pair[0] == pair[1]) {
            let reason = format!("points hold input {} twice; give each input one force", twice[0]);
            return Err(Error::value(path, key, reason));
        }
        Ok(())
    }

    fn curve(
        &self,
        path: &Path,
        key: &str,
        inputs: &mut Vec<InputFile>,
    ) -> Result<ThrustCurve, Error> {
        let given = [!self.points.is_empty(), self.file.is_some(), !self.voltages.is_empty()];
        if given.iter().filter(|given| **given).count() != 1 {
            let reason =
                "give one of points = [[input, N], ...], file = \"...\" or voltages = [...]";
            return Err(Error::value(path, key, reason));
        }
        let bad = |source: seaplant::Error| Error::value(path, key, source.to_string());
        let mut found = self.input;
        let mut from_file = |file: &Path, voltage| -> Result<ThrustTable, Error> {
            let bench = read_bench(&toml_file::resolve(path, file)?, &self.columns, self.input)?;
            inputs.push(bench.source.clone());
            found = Some(bench.input);
            ThrustTable::new(voltage, bench.points).map_err(bad)
        };
        let tables = if let Some(file) = &self.file {
            vec![from_file(file, None)?]
        } else if self.voltages.is_empty() {
            self.check_points(path, key)?;
            let points = self.points.iter().map(|[x, force]| (*x, *force)).collect();
            vec![ThrustTable::new(None, points).map_err(bad)?]
        } else {
            let of = |entry: &VoltageEntry| from_file(&entry.file, Some(entry.voltage_v));
            self.voltages.iter().map(of).collect::<Result<_, _>>()?
        };
        let input = found.ok_or_else(|| {
            Error::value(path, key, "points need input = \"speed\", \"pwm\" or \"command\"")
        })?;
        ThrustCurve::tables(input, tables).map_err(bad)
    }
}
