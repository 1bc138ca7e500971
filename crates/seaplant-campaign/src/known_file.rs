//! Entries of known forces in a campaign: `[[trial.known]]`.

use schemars::JsonSchema;
use seaplant::Vehicle;
use seaplant::motion::{KnownForce, KnownKind};
use seaplant::plant::GRAVITY;
use serde::{Deserialize, Serialize};

/// A force that is known: a weight that hangs on the vehicle, or a line with a scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownEntry {
    /// What makes it.
    pub kind: KnownKindEntry,
    /// Of a weight: its weight in water, N; or give its mass and its volume or density.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight_n: Option<f64>,
    /// Of a weight: its mass, kg, which moves with the vehicle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// Of a weight: the water that it displaces, m³.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume_m3: Option<f64>,
    /// Of a weight: its density, kg/m³; lead has 11 340, steel 7850.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_kg_m3: Option<f64>,
    /// Of a line: its pull, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<f64>,
    /// Of a line: where it pulls, in the vehicle's axes: forward, starboard, down.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// Standard deviation of the weight or the pull, N; 0 if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std_n: Option<f64>,
    /// Where it acts, from the vehicle's origin: forward, starboard, down, m; the origin if it is left
    /// out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_m: Option<[f64; 3]>,
    /// When it begins, in seconds after the first sample of the trial's logs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// When it ends, likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
}

/// What makes a known force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum KnownKindEntry {
    /// A weight that is fixed to the vehicle.
    Weight,
    /// A line that pulls along a direction of the vehicle's axes.
    Line,
}

/// Heavier than this, kg, or with a stronger pull than its weight, is a wrong unit.
const MOST_KG: f64 = 1e5;

/// What is wrong with an entry: a key, and why.
pub(crate) type Wrong = (&'static str, String);

impl KnownEntry {
    /// Writes a known force as a campaign has it.
    pub(crate) fn of(known: &KnownForce) -> Self {
        let (mut weight, mut line) = (None, None);
        match known.kind {
            KnownKind::Weight { weight_n, mass_kg } => weight = Some((weight_n, mass_kg)),
            KnownKind::Line { force_n, direction } => line = Some((force_n, direction)),
        }
        Self {
            kind: if line.is_some() { KnownKindEntry::Line } else { KnownKindEntry::Weight },
            weight_n: weight.map(|(weight_n, _)| weight_n),
            mass_kg: weight.map(|(_, mass_kg)| mass_kg),
            volume_m3: None,
            density_kg_m3: None,
            force_n: line.map(|(force_n, _)| force_n),
            direction: line.map(|(_, direction)| direction),
            std_n: (known.std_n > 0.0).then_some(known.std_n),
            position_m: Some(known.position_m),
            from_s: Some(known.from_s),
            to_s: Some(known.to_s),
        }
    }

    /// Checks what needs no log; `window_s` has the beginning and the end of the trial where they are
    /// stated.
    pub(crate) fn check(&self, window_s: [Option<f64>; 2]) -> Result<(), Wrong> {
        let numbers = [
            ("weight_n", self.weight_n),
            ("mass_kg", self.mass_kg),
            ("volume_m3", self.volume_m3),
            ("density_kg_m3", self.density_kg_m3),
            ("force_n", self.force_n),
            ("std_n", self.std_n),
            ("from_s", self.from_s),
            ("to_s", self.to_s),
        ];
        for (key, number) in numbers {
            let is_time = key.ends_with("_s");
            let Some(x) = number.filter(|x| !(x.is_finite() && (is_time || *x >= 0.0))) else {
                continue;
            };
            let expected = if is_time { "a number of seconds" } else { "a number from zero up" };
            return Err((key, format!("is {x}; give {expected}")));
        }
        for (key, three) in [("direction", self.direction), ("position_m", self.position_m)] {
            if three.is_some_and(|three| !three.iter().all(|x| x.is_finite())) {
                return Err((key, "holds what is no number; give three numbers".to_owned()));
            }
        }
        self.check_times(window_s)?;
        self.check_kind()
    }

    fn check_times(&self, [start, end]: [Option<f64>; 2]) -> Result<(), Wrong> {
        let (Some(from), Some(to)) = (self.from_s, self.to_s) else {
            let key = if self.from_s.is_none() { "from_s" } else { "to_s" };
            let reason = "is missing; say from when to when the force acts, by from_s and to_s in seconds after the first sample of the logs";
            return Err((key, reason.to_owned()));
        };
        if to <= from {
            return Err(("to_s", format!("is {to}, not after from_s = {from}; give a later time")));
        }
        let begins_late = end.is_some_and(|end| from >= end);
        let ends_early = start.is_some_and(|start| to <= start);
        if begins_late || ends_early {
            let reason = format!(
                "is {from}, and to_s {to}: outside the trial, whose own from_s and to_s leave that out; correct either"
            );
            return Err(("from_s", reason));
        }
        Ok(())
    }

    fn check_kind(&self) -> Result<(), Wrong> {
        let of_weight = [
            ("weight_n", self.weight_n.is_some()),
            ("mass_kg", self.mass_kg.is_some()),
            ("volume_m3", self.volume_m3.is_some()),
            ("density_kg_m3", self.density_kg_m3.is_some()),
        ];
        let of_line =
            [("force_n", self.force_n.is_some()), ("direction", self.direction.is_some())];
        let (wrong, kind) = match self.kind {
            KnownKindEntry::Weight => (of_line.to_vec(), "weight"),
            KnownKindEntry::Line => (of_weight.to_vec(), "line"),
        };
        if let Some((key, _)) = wrong.into_iter().find(|(_, is_given)| *is_given) {
            return Err((key, format!("is not for kind = \"{kind}\"; leave it out")));
        }
        match self.kind {
            KnownKindEntry::Line => self.check_line(),
            KnownKindEntry::Weight => self.check_weight(),
        }
    }

    fn check_line(&self) -> Result<(), Wrong> {
        let missing = |key, what: &str| Err((key, format!("is missing; give {what}")));
        match (self.force_n, self.direction) {
            (None, _) => missing("force_n", "the pull of the line in newtons"),
            (_, None) => missing(
                "direction",
                "where the line pulls in the vehicle's axes, as [-1, 0, 0] for astern",
            ),
            (_, Some(direction)) if direction == [0.0; 3] => Err((
                "direction",
                "is [0, 0, 0], which points nowhere; give where the line pulls, as [-1, 0, 0] for astern"
                    .to_owned(),
            )),
            (Some(force), _) if force == 0.0 || force > MOST_KG * GRAVITY => {
                Err(("force_n", format!("is {force}; give the pull of the line in newtons")))
            }
            _ => Ok(()),
        }
    }

    fn check_weight(&self) -> Result<(), Wrong> {
        if let Some(mass) = self.mass_kg.filter(|mass| *mass == 0.0 || *mass > MOST_KG) {
            return Err(("mass_kg", format!("is {mass}; give the mass of the weight in kg")));
        }
        let by_water = [self.volume_m3, self.density_kg_m3].iter().flatten().count();
        match (self.weight_n, self.mass_kg, by_water) {
            (None, None, _) => Err((
                "weight_n",
                "is missing; give the weight in water in newtons and mass_kg, or mass_kg with volume_m3 or density_kg_m3"
                    .to_owned(),
            )),
            (Some(_), _, 1..) | (None, _, 2..) => Err((
                if self.volume_m3.is_some() { "volume_m3" } else { "density_kg_m3" },
                "says the weight in water a second time; give one of weight_n, volume_m3 and density_kg_m3"
                    .to_owned(),
            )),
            (None, Some(_), 0) => Err((
                "mass_kg",
                "says nothing of the weight in water; add weight_n, volume_m3 or density_kg_m3"
                    .to_owned(),
            )),
            (Some(_), None, 0) => Err((
                "mass_kg",
                "is missing; the mass of a weight moves with the vehicle, as its weight in water does not say"
                    .to_owned(),
            )),
            (Some(0.0), _, 0) => {
                Err(("weight_n", "is 0, which pulls at nothing; weigh it in water".to_owned()))
            }
            (Some(weight), Some(mass), 0) if weight > mass * GRAVITY => Err((
                "weight_n",
                format!(
                    "is {weight}, more than {mass} kg weigh in air ({:.1} N); check the units",
                    mass * GRAVITY
                ),
            )),
            (None, Some(_), 1) if self.density_kg_m3 == Some(0.0) => {
                Err(("density_kg_m3", "is 0; give the density of the weight".to_owned()))
            }
            _ => Ok(()),
        }
    }

    /// The force, of an entry that is checked.
    pub(crate) fn force(&self, vehicle: &Vehicle) -> Result<KnownForce, Wrong> {
        let water = vehicle.water_density_kg_m3;
        let mass_kg = self.mass_kg.unwrap_or_default();
        let kind = match self.kind {
            KnownKindEntry::Line => {
                let along = self.direction.unwrap_or_default();
                let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
                let force_n = self.force_n.unwrap_or_default();
                KnownKind::Line { force_n, direction: along.map(|x| x / length) }
            }
            KnownKindEntry::Weight => {
                let of_density = self.density_kg_m3.map(|density| mass_kg / density);
                let of_volume = self.volume_m3.or(of_density);
                let by_water = of_volume.map(|volume| GRAVITY * (mass_kg - water * volume));
                let weight_n = self.weight_n.or(by_water).unwrap_or_default();
                if weight_n == 0.0 {
                    let reason = "makes a weight that neither sinks nor floats, which says nothing of thrust; hang on a heavier one";
                    return Err(("mass_kg", reason.to_owned()));
                }
                KnownKind::Weight { weight_n, mass_kg }
            }
        };
        Ok(KnownForce {
            kind,
            position_m: self.position_m.unwrap_or_default(),
            std_n: self.std_n.unwrap_or_default(),
            from_s: self.from_s.unwrap_or_default(),
            to_s: self.to_s.unwrap_or_default(),
        })
    }
}
