//! Known forces of a trial, from its entries.

use std::path::Path;

use seaplant::Vehicle;
use seaplant::motion::KnownForce;

use crate::Error;
use crate::campaign_file::TrialEntry;
use crate::known_file::{KnownEntry, Wrong};

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
        entry.check([trial.from_s, trial.to_s]).map_err(|wrong| refused(path, trial, k, wrong))
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
    use seaplant::plant::GRAVITY;

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
