//! vehicle.toml.

mod curve;
mod fin;
mod sensor;
mod thruster;

use std::collections::BTreeSet;
use std::path::Path;

use schemars::JsonSchema;
use seaplant::results::InputFile;
use seaplant::{
    Caveat, CaveatCode, Fin, SEA_WATER_KG_M3, Surface, ThrustUncertainty, Thruster, Vehicle, exact,
};
use serde::{Deserialize, Serialize};

pub use curve::{
    CurveEntry, EstimateCurveEntry, OpenWaterEntry, PresetCurveEntry, QuadraticEntry, TableEntry,
    UncertaintyEntry, VoltageEntry,
};
pub use fin::{FinEntry, FlowEntry, LiftEntry, StraighteningEntry, WindEntry};
pub use sensor::{AttitudeEntry, DvlEntry, ImuEntry, PositionEntry, SensorEntries};
pub use thruster::ThrusterEntry;

use crate::plant_file::{BuoyancyEntry, RigidBodyEntry};
use crate::preset::VehiclePreset;
use crate::{Error, toml_file};

/// The content of a vehicle.toml.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleFile {
    /// A known vehicle, whose name and thrusters are used; the other keys override them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<VehiclePreset>,
    /// The vehicle's name; a known one has a name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Mass in air, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dry_mass_kg: Option<f64>,
    /// Length, width and height of the hull, m: to judge drag and added mass, and to state motion
    /// relative to the vehicle's size.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub size_m: Option<[f64; 3]>,
    /// Mass, centre of gravity and inertia in air, for plants of several axes: added mass is then
    /// separate, and is never below zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rigid_body: Option<RigidBodyEntry>,
    /// Displaced water and centre of buoyancy, to check restoring forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub buoyancy: Option<BuoyancyEntry>,
    /// The curve of every thruster that states none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thruster_curve: Option<CurveEntry>,
    /// The thrusters; one with the name of a known vehicle's thruster states only the differences.
    #[serde(default)]
    pub thruster: Vec<ThrusterEntry>,
    /// Rudders.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rudder: Vec<FinEntry>,
    /// Other fins: stern planes, bow planes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fin: Vec<FinEntry>,
    /// Areas exposed to wind, so that its coefficients have no dimension.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wind: Option<WindEntry>,
    /// Density of the water, kg/m³; 1025 if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub water_density_kg_m3: Option<f64>,
    /// Draught, m: with it dimensionless coefficients use length times draught, as for ships, else
    /// length squared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub draught_m: Option<f64>,
    /// The instruments; one that is left out is at the origin, aligned.
    #[serde(default)]
    pub sensor: SensorEntries,
}

/// Plausible densities of water, kg/m³.
const WATER_KG_M3: std::ops::RangeInclusive<f64> = 950.0..=1100.0;

/// Reads a vehicle.toml, and the curve tables that it refers to.
///
/// # Errors
/// [`Error::Io`], [`Error::Toml`], and [`Error::Value`] for what is well-formed and wrong.
pub fn read_vehicle(path: &Path) -> Result<(Vehicle, Vec<InputFile>), Error> {
    let SourcedVehicle { vehicle, inputs, .. } = SourcedVehicle::open(path)?;
    Ok((vehicle, inputs))
}

/// A vehicle and its provenance.
#[derive(Clone, Debug, PartialEq)]
pub struct SourcedVehicle {
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Its file, and the curve tables that it refers to.
    pub inputs: Vec<InputFile>,
    /// Reason to doubt it.
    pub doubt: Option<Caveat>,
}

impl SourcedVehicle {
    /// Does the same as [`read_vehicle`], with the reason to doubt the vehicle.
    ///
    /// # Errors
    /// As [`read_vehicle`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (file, input): (VehicleFile, _) = toml_file::read(path)?;
        let mut sourced = Self::from_file(file, path)?;
        sourced.inputs.insert(0, input);
        Ok(sourced)
    }

    /// Returns the vehicle of a file's content; paths in it are relative to `path`, which messages
    /// use.
    ///
    /// # Errors
    /// As [`read_vehicle`].
    pub fn from_file(file: VehicleFile, path: &Path) -> Result<Self, Error> {
        let (mut inputs, doubt) = (Vec::new(), file.caveat());
        let vehicle = file.into_vehicle(path, &mut inputs)?;
        Ok(Self { vehicle, inputs, doubt })
    }
}

impl VehicleFile {
    fn into_vehicle(self, path: &Path, inputs: &mut Vec<InputFile>) -> Result<Vehicle, Error> {
        self.check(path)?;
        let of_preset = || self.preset.map(|preset| preset.title().to_owned());
        let name = self
            .name
            .clone()
            .or_else(of_preset)
            .ok_or_else(|| Error::value(path, "vehicle", toml_file::missing(path, "name")))?;
        let entries = self.thrusters();
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
        let sensors = self.sensor.clone().into_sensors();
        let Self { dry_mass_kg, size_m, draught_m, .. } = self;
        let rigid_body = self.rigid_body.as_ref().map(|entry| entry.body(path, dry_mass_kg));
        let buoyancy = self.buoyancy.as_ref().map(|entry| entry.buoyancy(path));
        let (rigid_body, buoyancy) = (rigid_body.transpose()?, buoyancy.transpose()?);
        let mass_in_air = rigid_body.as_ref().map(seaplant::plant::RigidBody::mass_kg);
        Ok(Vehicle {
            name,
            dry_mass_kg: dry_mass_kg.or(mass_in_air),
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

    /// Checks names and sizes.
    fn check(&self, path: &Path) -> Result<(), Error> {
        let mut names = BTreeSet::new();
        if let Some(twice) = self.thruster.iter().find(|entry| !names.insert(&entry.name)) {
            let reason = "is given twice; give each thruster its own name";
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
        if self.draught_m.is_some_and(|x| !(x > 0.0 && x.is_finite())) {
            return Err(Error::value(path, "draught_m", "must be a positive number of m"));
        }
        self.sensor.check(path)
    }

    /// Returns the thrusters of the preset, as far as the file does not override them, and then
    /// those that the file adds.
    ///
    /// ```
    /// # use seaplant_campaign::VehicleFile;
    /// let file: VehicleFile = toml::from_str("preset = \"bluerov2\"")?;
    /// assert_eq!(file.thrusters()[4].direction, Some([0.0, 0.0, 1.0]));
    /// # Ok::<(), toml::de::Error>(())
    /// ```
    pub fn thrusters(&self) -> Vec<ThrusterEntry> {
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

    /// Returns the caveat on thrusters that were not measured on this vehicle.
    fn caveat(&self) -> Option<Caveat> {
        let preset = self.preset?;
        let measured = |name: &str| {
            self.thruster.iter().any(|entry| entry.name == name && entry.position_m.is_some())
        };
        let assumed = preset.thrusters().iter().filter(|known| !measured(known.name)).count();
        let message = format!(
            "the positions of {assumed} thrusters are those of the preset {}, not measured, and moments \
             in roll, pitch and yaw depend on them: measure your vehicle and state position_m",
            preset.key()
        );
        (assumed > 0).then(|| Caveat::note(CaveatCode::PresetGeometry, message))
    }

    /// Returns whether the curve of a thruster is that of open water.
    fn is_open_water(&self, name: Option<&String>) -> bool {
        let entries = self.thrusters();
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
                let reason = "is used twice; give each rudder, fin and thruster its own name, other than `wind`";
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
                && !self.thrusters().iter().any(|known| known.name == *ahead)
            {
                let reason = format!("the vehicle has no thruster `{ahead}` ahead of it");
                return Err(Error::value(path, format!("{key}, slipstream"), reason));
            }
            fins.push(entry.fin(kind, path)?);
        }
        Ok(fins)
    }
}
