//! Reads plant files, and the published tables included in the program.

use std::path::{Path, PathBuf};

use seaplant::exchange::{PLANT_SCHEMA, PlantFile};

use crate::toml_file::{nearest, parse};
use crate::{Error, read_bounded, read_toml};

/// The published tables, by name.
const PUBLISHED: [(&str, &str); 8] = [
    (
        "bluerov2-heavy-von-benzon-2022",
        include_str!("../plants/bluerov2-heavy-von-benzon-2022.toml"),
    ),
    ("bluerov2-wu-2018", include_str!("../plants/bluerov2-wu-2018.toml")),
    ("heron-clearpath", include_str!("../plants/heron-clearpath.toml")),
    ("kvlcc2-l7-yasukawa-2015", include_str!("../plants/kvlcc2-l7-yasukawa-2015.toml")),
    ("otter-mss", include_str!("../plants/otter-mss.toml")),
    ("remus-100-prestero-2001", include_str!("../plants/remus-100-prestero-2001.toml")),
    ("rexrov", include_str!("../plants/rexrov.toml")),
    ("wam-v-vrx", include_str!("../plants/wam-v-vrx.toml")),
];

/// Prefix by which a published table is requested in place of a file.
const PREFIX: &str = "published:";

/// Returns the names of the published tables.
pub fn published_names() -> Vec<&'static str> {
    PUBLISHED.iter().map(|(name, _)| *name).collect()
}

/// Returns `published:NAME` of the table that a path without the prefix resembles, for messages
/// about an absent file.
///
/// ```
/// use seaplant_campaign::nearest_published;
/// let near = nearest_published("bluerov2-wu".as_ref());
/// assert_eq!(near.as_deref(), Some("published:bluerov2-wu-2018"));
/// assert_eq!(nearest_published("results/results.json".as_ref()), None);
/// ```
pub fn nearest_published(path: &Path) -> Option<String> {
    let is_name = path.extension().is_none() && path.components().count() == 1;
    let near = nearest(path.to_str().filter(|_| is_name)?, published_names())?;
    Some(format!("{PREFIX}{near}"))
}

/// Returns the path of a published table by its name, with or without `published:`; `None` for
/// another name without it.
pub(crate) fn published_path(name: &str) -> Option<PathBuf> {
    match name.starts_with(PREFIX) {
        true => Some(PathBuf::from(name)),
        false => {
            published_names().contains(&name).then(|| PathBuf::from(format!("{PREFIX}{name}")))
        }
    }
}

/// Reads a plant by a path: a plant file in TOML or JSON, or `published:NAME`; `None` for a JSON
/// file of another schema, such as results.
///
/// # Errors
/// [`Error::Value`] for a table that is none; [`Error::Toml`] or [`Error::Io`] for a file that
/// cannot be read.
pub fn read_plant_file(path: &Path) -> Result<Option<PlantFile>, Error> {
    if let Some(name) = path.to_str().and_then(|text| text.strip_prefix(PREFIX)) {
        return published(path, name).map(Some);
    }
    if path.extension().is_some_and(|ending| ending == "toml") {
        return read_toml(path).map(Some);
    }
    const MOST_BYTES: u64 = 1 << 30;
    let bytes = read_bounded(path, MOST_BYTES)?;
    let Ok(value) = serde_json::from_slice::<serde_json::Value>(&bytes) else { return Ok(None) };
    let schema = value.get("schema").and_then(|schema| schema.as_str()).unwrap_or_default();
    // Another version of the schema is also refused by name.
    let family = PLANT_SCHEMA.trim_end_matches(|c: char| c.is_ascii_digit());
    if !schema.starts_with(family) {
        return Ok(None);
    }
    crate::of_json(path, value).map(Some)
}

fn published(path: &Path, name: &str) -> Result<PlantFile, Error> {
    match PUBLISHED.iter().find(|(known, _)| *known == name) {
        Some((_, text)) => parse(path, text),
        None => {
            let near = nearest(name, published_names());
            let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            let reason =
                format!("there is no such table; use {}{hint}", published_names().join(", "));
            Err(Error::value(path, "published", reason))
        }
    }
}

#[cfg(test)]
mod tests {
    use seaplant::Dof;
    use seaplant::plant::{Basis, Product};

    use super::*;

    #[test]
    fn every_published_table_is_a_plant_with_a_licence() {
        for name in published_names() {
            let path = format!("{PREFIX}{name}");
            let file = read_plant_file(Path::new(&path)).expect("a table").expect("a plant");
            assert!(file.licence.is_some() && file.url.is_some(), "{name}");
            file.model().expect(name);
        }
    }

    #[test]
    fn drag_of_one_vehicle_differs_by_eight_times_between_tables() {
        let drag = |name: &str| {
            let path = format!("{PREFIX}{name}");
            let file = read_plant_file(Path::new(&path)).expect("a table").expect("a plant");
            let term = Basis::Product(Dof::Surge, Product::quadratic(Dof::Surge));
            file.model().expect("possible").plant.coefficient(&term).expect("surge")
        };
        let ratio = drag("bluerov2-heavy-von-benzon-2022") / drag("bluerov2-wu-2018");
        assert!((7.5..8.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_torpedo_turns_as_its_thesis_has_it() {
        use nalgebra::{Vector3, Vector6};
        let file = read_plant_file(Path::new("published:remus-100-prestero-2001"));
        let plant = file.expect("a table").expect("a plant").model().expect("possible").plant;
        let moment = |velocity: Vector6<f64>, rudder: f64| {
            plant.resistance_with(&velocity, &Vector3::z(), &[rudder, 0.0])[5]
        };
        let ahead = |v: f64, r: f64| Vector6::new(1.5, v, 0.0, 0.0, 0.0, r);
        // N_uuδ = −6.15, N_uv = −24.0; on the left-hand side signs are reversed.
        let straight = moment(ahead(0.0, 0.0), 0.0);
        let by_rudder = (moment(ahead(0.0, 0.0), 1e-4) - straight) / 1e-4;
        assert!((by_rudder - 6.15 * 1.5 * 1.5).abs() < 0.02, "{by_rudder}");
        let by_drift = (moment(ahead(1e-4, 0.0), 0.0) - straight) / 1e-4;
        assert!((by_drift - 24.0 * 1.5).abs() < 0.05, "{by_drift}");
    }

    #[test]
    fn a_tanker_is_pushed_as_by_the_mmg_method() {
        use nalgebra::{Vector3, Vector6};
        use seaplant::plant::Signal;
        let file = read_plant_file(Path::new("published:kvlcc2-l7-yasukawa-2015"));
        let plant = file.expect("a table").expect("a plant").model().expect("possible").plant;
        // [u, v, r, revolutions a second, rudder in rad] and [X, Y, N], by `forces` of
        // examples/ship/simulate.py with D_P = 0.216.
        let known = [
            ([1.0, -0.2, 0.05, 12.0, 0.3], [10.584_295, 181.566_035, 101.762_363]),
            ([1.1, 0.15, -0.04, 10.0, -0.2], [-11.666_393, -135.171_473, -89.428_295]),
        ];
        let mass = plant.mass_matrix_of_six();
        let (m11, m22, m23) = (mass[(0, 0)], mass[(1, 1)], mass[(1, 5)]);
        for ([u, v, r, n, delta], force) in known {
            let read = |signal: &Signal| match signal {
                Signal::Drive(_) => n * std::f64::consts::TAU,
                _ => delta,
            };
            let signals: Vec<f64> = plant.structure().signals().iter().map(read).collect();
            let velocity = Vector6::new(u, v, 0.0, 0.0, 0.0, r);
            let found = -plant.resistance_with(&velocity, &Vector3::z(), &signals);
            let turning = [m22 * v * r + m23 * r * r, -m11 * u * r, -m23 * u * r];
            for ((axis, force), turning) in [0, 1, 5].into_iter().zip(force).zip(turning) {
                let off = found[axis] - force - turning;
                // It uses angles of drift at propeller and rudder, and Seaplant their sines.
                assert!(off.abs() < 3e-3 * force.abs() + 0.25, "{axis}: {off} of {force}");
            }
        }
    }

    #[test]
    fn tables_state_how_fast_their_propellers_turn() {
        for (name, rpm) in [("otter-mss", 992.4), ("wam-v-vrx", 5507.0)] {
            let path = format!("{PREFIX}{name}");
            let mut file = read_plant_file(Path::new(&path)).expect("a table").expect("a plant");
            assert_eq!(file.model().expect("possible").max_rpm, Some(rpm), "{name}");
            file.thrusters[0].max_rpm = Some(-1.0);
            let error = file.model().expect_err("turned round").to_string();
            assert!(error.contains("max_rpm is -1"), "{error}");
        }
    }

    #[test]
    fn an_unknown_table_brings_the_near_one() {
        let error = read_plant_file(Path::new("published:bluerov2-wu")).expect_err("unknown");
        assert!(error.to_string().contains("did you mean `bluerov2-wu-2018`"), "{error}");
    }
}
