//! Exported plants.

use serde_json::Value;

use crate::workshop::{Workshop, assert_within};

const FORMATS: [&str; 11] = [
    "c",
    "rust",
    "python",
    "casadi",
    "octave",
    "fmu",
    "gazebo",
    "uuv-simulator",
    "stonefish",
    "ros2",
    "json",
];

/// Makes the sled with its results, surge alone.
fn identified() -> Workshop {
    let workshop = Workshop::quick();
    workshop.change("vehicle.toml", "name = \"sled\"\n", "name = \"sled\"\ndry_mass_kg = 300.0\n");
    workshop.success(&["identify", "campaign.toml", "--quiet"]);
    workshop
}

#[test]
fn a_single_axis_is_exported_in_every_format_with_the_others_as_not_known() {
    let workshop = identified();
    for format in FORMATS {
        let out = format!("out/{format}");
        let said = workshop.json(&["export", "results", "--to", format, "--out", &out, "--json"]);
        let notes = said["notes"].to_string();
        assert!(notes.contains("NOT KNOWN: mass, damping and restoring of sway"), "{format}");
        let files = said["files"].as_array().expect("files");
        assert!(!files.is_empty(), "{format}");
        let first = workshop.join(files[0].as_str().expect("a path"));
        let bytes = std::fs::read(&first).expect("written");
        if format != "fmu" {
            let text = String::from_utf8(bytes).expect("UTF-8");
            for words in ["NOT KNOWN", "units: SI", "frames:", "identified by: seaplant identify"] {
                assert!(text.contains(words), "{format}: {words}");
            }
        }
    }
    let json: Value = serde_json::from_str(&workshop.read("out/json/plant.json")).expect("JSON");
    let mass = &json["derived"]["mass_matrix"];
    assert!(mass[0][0].is_f64() && mass[0][1].is_null() && mass[5][5].is_null(), "{mass}");
}

#[test]
fn a_plant_that_should_not_be_used_stays_unless_it_is_forced_to_carry_its_reasons() {
    let workshop = identified();
    let results = workshop.read("results/results.json");
    let mut json: Value = serde_json::from_str(&results).expect("JSON");
    let verdict = &mut json["plants"]["surge"]["verdict"];
    (verdict["trust"], verdict["reason"]) = ("do-not-use".into(), "it has wheels".into());
    workshop.write("bad.json", json.to_string());
    let message = workshop.failure(&["export", "bad.json", "--to", "c", "--out", "out"]);
    assert!(message.contains("it has wheels") && message.contains("--anyway"), "{message}");
    workshop.success(&["export", "bad.json", "--to", "c", "--out", "out", "--anyway"]);
    let header = workshop.read("out/seaplant_plant.h");
    assert!(header.contains("DO NOT USE: surge: it has wheels"), "{header}");
}

#[test]
fn a_doubtful_plant_says_so_wherever_it_goes() {
    let workshop = identified();
    let results = workshop.read("results/results.json");
    let mut json: Value = serde_json::from_str(&results).expect("JSON");
    let verdict = &mut json["plants"]["surge"]["verdict"];
    (verdict["trust"], verdict["reason"]) = ("doubtful".into(), "its drag is anything".into());
    workshop.write("doubtful.json", json.to_string());
    let doubt = "DOUBTFUL: surge: its drag is anything";
    let said = workshop.success(&["export", "doubtful.json", "--to", "c", "--out", "out"]);
    assert!(said.contains(doubt), "{said}");
    assert!(workshop.read("out/seaplant_plant.h").contains(doubt));
    let said =
        workshop.success(&["simulate", "doubtful.json", "--step", "surge 50 N", "--for", "5"]);
    assert!(said.contains(doubt), "{said}");
}

#[test]
fn formats_coexist_and_edited_files_are_kept() {
    let workshop = Workshop::empty();
    let plant = "published:wam-v-vrx";
    let export = |format| vec!["export", plant, "--to", format, "--out", "out"];
    workshop.success(&export("c"));
    workshop.success(&export("ros2"));
    workshop.success(&export("c"));
    assert!(workshop.join("out/seaplant_plant/config/seaplant_plant.yaml").exists());
    workshop.change("out/seaplant_plant.h", "#include <math.h>", "#include <tgmath.h>");
    let message = workshop.failure(&export("c"));
    assert!(message.contains("not as Seaplant wrote it"), "{message}");
    let mut forced = export("c");
    forced.push("--force");
    workshop.success(&forced);
    assert!(workshop.read("out/seaplant_plant.h").contains("#include <math.h>"));
}

#[test]
fn exported_json_is_the_same_plant_again() {
    let workshop = identified();
    workshop.success(&["export", "results", "--to", "json", "--out", "out"]);
    let run = |plant: &str| {
        let step = ["simulate", plant, "--step", "surge 300 N", "--for", "20", "--draws", "40"];
        workshop.json(&[&step[..], &["--json"]].concat())
    };
    let (there, again) = (run("results"), run("out/plant.json"));
    // Sums in another order round differently.
    for path in ["velocity.200.0", "band95.200.0.0", "band95.200.0.1"] {
        let of = |said: &Value| {
            let key = |at: &Value, key: &str| match key.parse::<usize>() {
                Ok(k) => at[k].clone(),
                Err(_) => at[key].clone(),
            };
            path.split('.').fold(said.clone(), |at, k| key(&at, k)).as_f64().expect("a number")
        };
        assert_within(path, of(&again), of(&there), 1e-9);
    }
}

#[test]
fn an_invalid_plant_is_refused_by_name() {
    let workshop = Workshop::empty();
    let refused = |plant: &str| workshop.failure(&["export", plant, "--to", "c", "--out", "out"]);
    assert!(refused("published:rexrow").contains("did you mean `rexrov`"));
    assert!(refused("nothing.json").contains("give the results.json of a fit"));
    workshop.write("half.toml", "schema = \"seaplant/plant/1\"\nname = \"x\"\nsource = \"y\"\n");
    assert!(refused("half.toml").contains("mass_matrix is missing"), "{}", refused("half.toml"));
    workshop.write("odd.toml", "schema = \"seaplant/plant/1\"\nname = \"x\"\nsorce = \"y\"\n");
    assert!(refused("odd.toml").contains("did you mean `source`"), "{}", refused("odd.toml"));
    workshop.write(
        "new.json",
        "{ \"schema\": \"seaplant/plant/9\", \"name\": \"x\", \"source\": \"y\" }",
    );
    assert!(refused("new.json").contains("seaplant/plant/9"), "{}", refused("new.json"));
}
