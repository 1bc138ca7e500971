//! Known forces of a campaign: `[[trial.known]]`.

use std::path::Path;

use schemars::JsonSchema;
use seaplant::Vehicle;
use seaplant::motion::{KnownForce, KnownKind};
use seaplant::plant::GRAVITY;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::campaign_file::TrialEntry;

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
type Wrong = (&'static str, String);

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

    /// Checks what needs no log.
    fn check(&self, trial: &TrialEntry) -> Result<(), Wrong> {
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
        self.check_times(trial)?;
        self.check_kind()
    }

    fn check_times(&self, trial: &TrialEntry) -> Result<(), Wrong> {
        let (Some(from), Some(to)) = (self.from_s, self.to_s) else {
            let key = if self.from_s.is_none() { "from_s" } else { "to_s" };
            let reason = "is missing; say from when to when the force acts, by from_s and to_s in seconds after the first sample of the logs";
            return Err((key, reason.to_owned()));
        };
        if to <= from {
            return Err(("to_s", format!("is {to}, not after from_s = {from}; give a later time")));
        }
        let begins_late = trial.to_s.is_some_and(|end| from >= end);
        let ends_early = trial.from_s.is_some_and(|start| to <= start);
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
    fn force(&self, vehicle: &Vehicle) -> Result<KnownForce, Wrong> {
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

/// Checks the known forces of a trial as far as that needs no log.
///
/// # Errors
/// [`Error::Value`] with the key and the line of the file.
pub(crate) fn check_known(path: &Path, trial: &TrialEntry) -> Result<(), Error> {
    if let Some(dof) = trial.dof.first().filter(|_| !trial.known.is_empty()) {
        let reason = format!(
            "is used by [[plant]] only; in place of dof = [\"{dof}\"] write [[plant]] with axes = [\"{dof}\"]"
        );
        return Err(Error::value(path, format!("trial `{}`, known", trial.name), reason));
    }
    let of = |(k, entry): (usize, &KnownEntry)| {
        entry.check(trial).map_err(|wrong| refused(path, trial, k, wrong))
    };
    trial.known.iter().enumerate().try_for_each(of)
}

/// Makes the known forces of a trial whose logs last from their first sample to `last_s`.
///
/// # Errors
/// [`Error::Value`] for a time after the last sample, or a weight that pulls at nothing.
pub(crate) fn known_forces(
    path: &Path,
    trial: &TrialEntry,
    vehicle: &Vehicle,
    last_s: f64,
) -> Result<Vec<KnownForce>, Error> {
    let of = |(k, entry): (usize, &KnownEntry)| {
        let force = entry.force(vehicle).map_err(|wrong| refused(path, trial, k, wrong))?;
        if force.from_s >= last_s || force.to_s <= 0.0 {
            let reason = format!(
                "is {}, and to_s {}: outside the logs, which last from 0 to {last_s:.1} s",
                force.from_s, force.to_s
            );
            return Err(refused(path, trial, k, ("from_s", reason)));
        }
        Ok(force)
    };
    trial.known.iter().enumerate().map(of).collect()
}

fn refused(path: &Path, trial: &TrialEntry, k: usize, (key, reason): Wrong) -> Error {
    let number = if trial.known.len() > 1 { format!("{} ", k + 1) } else { String::new() };
    Error::value(path, format!("trial `{}`, known {number}{key}", trial.name), reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Standard gravity times kilograms, N.
    const ROUNDING: f64 = 1e-9;

    fn trial(known: &str) -> Result<TrialEntry, toml::de::Error> {
        toml::from_str(&format!(
            "name = \"hover\"\nlog = \"a.csv\"\nfrom_s = 10\nto_s = 200\n[[known]]\n{known}"
        ))
    }

    fn refusal(known: &str) -> String {
        let trial = trial(known).expect("TOML");
        check_known(Path::new("campaign.toml"), &trial).expect_err("wrong").to_string()
    }

    #[test]
    fn known_forces_that_cannot_be_are_refused_by_their_key() {
        let times = "from_s = 20\nto_s = 60\n";
        let cases = [
            ("kind = \"weight\"\nweight_n = -5\nmass_kg = 2\n", "known weight_n: is -5"),
            (
                "kind = \"weight\"\nmass_kg = 2\n",
                "known mass_kg: says nothing of the weight in water",
            ),
            ("kind = \"weight\"\nweight_n = 9\n", "known mass_kg: is missing"),
            ("kind = \"weight\"\nweight_n = 90\nmass_kg = 2\n", "more than 2 kg weigh in air"),
            ("kind = \"weight\"\nforce_n = 9\n", "is not for kind = \"weight\""),
            ("kind = \"weight\"\nmass_kg = 2\nvolume_m3 = 0.001\nweight_n = 9\n", "a second time"),
            ("kind = \"line\"\nforce_n = 50\n", "known direction: is missing"),
            ("kind = \"line\"\nforce_n = 50\ndirection = [0, 0, 0]\n", "points nowhere"),
            ("kind = \"line\"\ndirection = [1, 0, 0]\n", "known force_n: is missing"),
            ("kind = \"line\"\nforce_n = 50\ndirection = [1, 0, 0]\nstd_n = -1\n", "std_n: is -1"),
        ];
        for (known, words) in cases {
            let message = refusal(&format!("{known}{times}"));
            assert!(message.contains(words), "{message}");
        }
        let line = "kind = \"line\"\nforce_n = 50\ndirection = [1, 0, 0]\n";
        for (times, words) in [
            ("from_s = 60\nto_s = 20\n", "known to_s: is 20, not after from_s = 60"),
            ("to_s = 20\n", "known from_s: is missing"),
            ("from_s = 200\nto_s = 260\n", "outside the trial"),
            ("from_s = 0\nto_s = 10\n", "outside the trial"),
        ] {
            let message = refusal(&format!("{line}{times}"));
            assert!(message.contains(words), "{message}");
        }
        let error = trial("kind = \"balloon\"\n").expect_err("an unknown kind").to_string();
        assert!(error.contains("expected `weight` or `line`"), "{error}");
    }

    #[test]
    fn a_known_force_of_a_single_axis_asks_for_a_plant() {
        let mut trial = trial("kind = \"weight\"\n").expect("TOML");
        trial.dof = vec![seaplant::Dof::Heave];
        let error = check_known(Path::new("campaign.toml"), &trial).expect_err("refused");
        assert!(error.to_string().contains("write [[plant]] with axes = [\"heave\"]"), "{error}");
    }

    #[test]
    fn weight_in_water_follows_from_mass_and_density_or_volume() {
        let vehicle = Vehicle { water_density_kg_m3: 1000.0, ..Vehicle::default() };
        let times = "from_s = 20\nto_s = 60\n";
        for by in ["density_kg_m3 = 8000", "volume_m3 = 0.00025"] {
            let trial = trial(&format!("kind = \"weight\"\nmass_kg = 2\n{by}\n{times}"));
            let trial = trial.expect("TOML");
            check_known(Path::new("campaign.toml"), &trial).expect("right");
            let forces = known_forces(Path::new("campaign.toml"), &trial, &vehicle, 200.0);
            let forces = forces.expect("right");
            assert!((forces[0].size_n() - 1.75 * GRAVITY).abs() < ROUNDING, "{forces:?}");
            let after = known_forces(Path::new("campaign.toml"), &trial, &vehicle, 15.0);
            assert!(after.expect_err("late").to_string().contains("outside the logs"));
        }
    }

    #[test]
    fn a_known_force_is_written_as_it_is_read() {
        let text = "kind = \"line\"\nforce_n = 50.0\ndirection = [0.0, 0.6, 0.8]\nstd_n = 2.0\nposition_m = [1.0, 0.0, 0.0]\nfrom_s = 20.0\nto_s = 60.0\n";
        let trial = trial(text).expect("TOML");
        let force = trial.known[0].force(&Vehicle::default()).expect("right");
        assert_eq!(KnownEntry::of(&force), trial.known[0]);
    }
}
