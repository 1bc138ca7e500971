//! Plants of several axes, from logs to report.

use serde_json::{Map, Value};

use crate::workshop::{Workshop, seaplant};

/// A boat in three axes: m11, m22, m23, m33; quadratic drag in surge, linear and quadratic in sway
/// and yaw.
const BOAT: [f64; 4] = [120.0, 180.0, 12.0, 40.0];
const DRAG: [f64; 5] = [60.0, 90.0, 250.0, 20.0, 45.0];

/// Relative tolerance of an estimate from two and a half minutes.
const PART: f64 = 0.05;

const VEHICLE: &str = "name = \"boat\"\n";

const CAMPAIGN: &str = r#"vehicle = "vehicle.toml"
methods = ["paper"]
[[trial]]
name = "one"
log = "one.csv"
dof = ["surge"]
[[trial]]
name = "two"
log = "two.csv"
dof = ["surge"]
role = "hold-out"
[[plant]]
axes = ["surge", "sway", "yaw"]
[channels]
"wrench.surge" = { column = "x" }
"wrench.sway" = { column = "y" }
"wrench.yaw" = { column = "n" }
"velocity.surge" = { column = "u" }
"velocity.sway" = { column = "v" }
"rate.yaw" = { column = "r" }
"attitude.heading" = { column = "heading" }
"#;

/// Computes ν̇ by the equations of a surface vessel.
fn rate([u, v, r]: [f64; 3], [x, y, n]: [f64; 3]) -> [f64; 3] {
    let [m11, m22, m23, m33] = BOAT;
    let [du, dv, dvv, dr, drr] = DRAG;
    let a = m22 * v + m23 * r;
    let surge = x + a * r - du * u * u.abs();
    let sway = y - m11 * u * r - dv * v - dvv * v * v.abs();
    let yaw = n - a * u + m11 * u * v - dr * r - drr * r * r.abs();
    let determinant = m22 * m33 - m23 * m23;
    [surge / m11, (m33 * sway - m23 * yaw) / determinant, (m22 * yaw - m23 * sway) / determinant]
}

/// Simulates the boat driven freely for 150 s in steps of 0.1 s, a log row each.
fn log(phase: f64) -> String {
    const FINE: usize = 50;
    let mut text =
        "time [s],x [N],y [N],n [N m],u [m/s],v [m/s],r [rad/s],heading [rad]\n".to_owned();
    let (mut nu, mut heading) = ([0.0_f64; 3], 0.4_f64);
    for k in 0..1500_u32 {
        let t = f64::from(k) * 0.1;
        let wave = |a: f64, w: f64, p: f64| a * (w * t + p * phase).sin();
        let tau = [
            wave(60.0, 0.31, 1.0) + wave(40.0, 0.083, 2.0) + 20.0,
            wave(50.0, 0.23, 3.0) + wave(30.0, 0.71, 1.5),
            wave(20.0, 0.41, 2.5) + wave(12.0, 0.117, 0.7),
        ];
        let jitter = |n: f64| 0.002 * (f64::from(k) * n).sin();
        let [u, v, r] = nu;
        text += &format!(
            "{t:.1},{:.4},{:.4},{:.4},{:.5},{:.5},{:.5},{:.5}\n",
            tau[0],
            tau[1],
            tau[2],
            u + jitter(12.9898),
            v + jitter(78.233),
            r + jitter(37.719),
            heading + jitter(93.989)
        );
        for _ in 0..FINE {
            let h = 0.1 / FINE as f64;
            let first = rate(nu, tau);
            let middle = rate(std::array::from_fn(|i| nu[i] + 0.5 * h * first[i]), tau);
            heading += h * nu[2];
            nu = std::array::from_fn(|i| nu[i] + h * middle[i]);
        }
    }
    text
}

fn boat(campaign: &str) -> Workshop {
    let workshop = Workshop::empty();
    workshop.write("vehicle.toml", VEHICLE);
    workshop.write("campaign.toml", campaign);
    workshop.write("one.csv", log(0.0));
    workshop.write("two.csv", log(1.0));
    workshop
}

fn identify(workshop: &Workshop) -> assert_cmd::assert::Assert {
    seaplant().arg("identify").arg(workshop.join("campaign.toml")).assert()
}

/// Returns standard output and error of a failing run.
fn refused(workshop: &Workshop) -> String {
    let refused = identify(workshop).failure();
    let output = refused.get_output();
    [&output.stdout, &output.stderr].map(|said| String::from_utf8_lossy(said).into_owned()).concat()
}

#[test]
fn a_boat_that_turns_while_it_advances_has_all_its_coefficients_recovered() {
    let workshop = boat(CAMPAIGN);
    let shown = identify(&workshop).success();
    let shown = String::from_utf8_lossy(&shown.get_output().stdout).into_owned();
    assert!(shown.contains("surge, sway, yaw together, by filter-error"), "{shown}");
    // Three axes together, then surge by itself.
    for (words, times) in
        [("  mass  ", 3), ("  inertia ", 1), ("  measured ", 4), (" alone: R² ", 3)]
    {
        assert_eq!(shown.matches(words).count(), times, "{words}: {shown}");
    }
    assert!(shown.contains("mass.sway-yaw") && !shown.contains("mass.surge"), "{shown}");
    let results = std::fs::read_to_string(workshop.join("results/results.json")).expect("there");
    let results: Value = serde_json::from_str(&results).expect("JSON");
    let plant = &results["plants"]["surge-sway-yaw"];
    let [m11, m22, m23, m33] = BOAT;
    let [du, _, dvv, _, drr] = DRAG;
    let expected = [
        ("mass.surge", m11),
        ("mass.sway", m22),
        ("mass.sway-yaw", m23),
        ("mass.yaw", m33),
        ("surge: |u|u", du),
        ("sway: |v|v", dvv),
        ("yaw: |r|r", drr),
    ];
    for (name, expected) in expected {
        let x = &plant["parameters"][name];
        let value = x["value"].as_f64().unwrap_or_else(|| panic!("no {name}"));
        let is_inside =
            x["low95"].as_f64() <= Some(expected) && x["high95"].as_f64() >= Some(expected);
        assert!(is_inside || (value / expected - 1.0).abs() < PART, "{name}: {value}, {expected}");
    }
    for axis in ["surge", "sway", "yaw"] {
        let r2 = plant["hold_out"]["by_axis"][axis]["r_squared"].as_f64().expect("a score");
        assert!(r2 > 0.99, "{axis}: {r2}");
    }
    let report = std::fs::read_to_string(workshop.join("results/report.html")).expect("there");
    assert!(report.contains("Mass matrix M"), "no section of the plant");
    assert_eq!(report.matches("<figure class=\"thumbnail\">").count(), 3, "a picture of each axis");
    for axis in ["surge", "sway", "yaw"] {
        assert!(plant["verdicts"][axis]["trust"].is_string(), "{axis} is judged by itself");
        let series = format!("results/series/two.{axis}.surge-sway-yaw.csv");
        assert!(workshop.join(&series).is_file(), "{series}");
    }
}

#[test]
fn a_term_that_does_not_exist_shows_its_place() {
    let wrong =
        CAMPAIGN.replace("\"yaw\"]\n[channels]", "\"yaw\"]\nterms = [\"yaw: v|x|\"]\n[channels]");
    let said = refused(&boat(&wrong));
    assert!(said.contains("yaw: v|x|") && said.contains("at character 8"), "{said}");
}

#[test]
fn an_axis_without_motion_is_refused_with_advice() {
    let wrong = CAMPAIGN.replace("\"surge\", \"sway\", \"yaw\"]", "\"surge\", \"sway\", \"roll\"]");
    let said = refused(&boat(&wrong));
    assert!(said.contains("velocity for roll") && said.contains("rate.roll"), "{said}");
}

#[test]
fn a_rigid_body_that_cannot_be_is_refused() {
    let workshop = boat(CAMPAIGN);
    let body = "[rigid_body]\nmass_kg = 50.0\ncentre_of_gravity_m = [0, 0, 0]\n\
        inertia_kg_m2 = [[1, 0, 0], [0, 1, 0], [0, 0, 9]]\n";
    workshop.write("vehicle.toml", format!("{VEHICLE}{body}"));
    let said = refused(&workshop);
    assert!(said.contains("rigid_body") && said.contains("sum of the others"), "{said}");
}

#[test]
fn a_table_of_several_axes_is_scored_with_its_axes_together() {
    let workshop = boat(CAMPAIGN);
    let [m11, m22, m23, m33] = BOAT;
    let [du, dv, dvv, dr, drr] = DRAG;
    let table = |du: f64| {
        format!(
            "schema = \"seaplant/plant/1\"\nname = \"boat\"\nsource = \"the truth\"\n\
             axes = [\"surge\", \"sway\", \"yaw\"]\n\
             mass_matrix = [[{m11}, 0.0, 0.0], [0.0, {m22}, {m23}], [0.0, {m23}, {m33}]]\n\
             linear_damping = [0.0, {dv}, {dr}]\nquadratic_damping = [{du}, {dvv}, {drr}]\n"
        )
    };
    workshop.write("truth.toml", table(du));
    workshop.write("wrong.toml", table(4.0 * du));
    let scores = |plant: &str| {
        let said = workshop.json(&["validate", plant, "campaign.toml", "--json"]);
        assert_eq!(said.as_array().map(Vec::len), Some(1), "{said}");
        let axes = ["surge", "sway", "yaw"];
        assert_eq!(said[0]["axes"], serde_json::json!(axes));
        let score = &said[0]["score"];
        let trials = score["by_trial"].as_object().expect("trials");
        assert_eq!(trials.len(), 2, "{score}");
        for trial in trials.values() {
            assert_eq!(trial.as_object().map(Map::len), Some(3), "{trial}");
        }
        axes.map(|axis| score["by_axis"][axis]["r_squared"].as_f64().expect("a score"))
    };
    let right = scores("truth.toml");
    assert!(right.iter().all(|r2| *r2 > 0.99), "{right:?}");
    let wrong = scores("wrong.toml");
    assert!(wrong[0] < 0.9, "{wrong:?}");
    let said = workshop.success(&["validate", "truth.toml", "campaign.toml"]);
    assert!(said.contains("sway, together"), "{said}");
}

#[test]
fn a_log_is_simulated_with_all_axes_of_its_plant() {
    let workshop = boat(CAMPAIGN);
    identify(&workshop).success();
    let words = ["simulate", "results", "two.csv", "--dof", "yaw", "--out", "two-simulated.csv"];
    let all = workshop.json(&[&words[..], &["--json"]].concat());
    let all = all.as_array().expect("an axis each");
    assert_eq!(all.len(), 3);
    let mut samples = 0;
    for (one, axis) in all.iter().zip(["surge", "sway", "yaw"]) {
        assert_eq!(one["dof"], axis);
        assert!(one["r_squared"].as_f64() > Some(0.99), "{axis}");
        // The first seconds give the initial state.
        let own = one["time_s"].as_array().map_or(0, Vec::len);
        assert!((1400..=1500).contains(&own), "{axis}: {own}");
        samples += own;
    }
    let rows = workshop.read("two-simulated.csv");
    assert!(rows.starts_with("time [s],axis,force [N or N m],measured"), "{rows}");
    assert_eq!(rows.lines().count(), 1 + samples);
    // Surge also has a one-axis plant.
    let open = workshop.failure(&["simulate", "results", "two.csv"]);
    assert_eq!(open, "the results hold surge, surge-sway-yaw; choose one with --dof");
    let method = ["simulate", "results", "two.csv", "--dof", "yaw", "--method", "paper"];
    let refused = workshop.failure(&method);
    assert!(refused.contains("no surge-sway-yaw plant by paper, but by"), "{refused}");
}

#[test]
fn masses_below_that_in_air_are_not_to_be_used() {
    let workshop = boat(CAMPAIGN);
    // As with thrust in kgf: both masses are less than half of the boat's own.
    workshop.write("vehicle.toml", "name = \"boat\"\ndry_mass_kg = 400.0\n");
    identify(&workshop).failure();
    let results: Value =
        serde_json::from_str(&workshop.read("results/results.json")).expect("JSON");
    let plant = &results["plants"]["surge-sway-yaw"];
    for axis in ["surge", "sway"] {
        assert_eq!(plant["verdicts"][axis]["trust"], "do-not-use", "{axis}");
    }
    let caveats = plant["caveats"].as_array().expect("caveats");
    let of_mass = |c: &&Value| c["code"] == "mass-below-dry-mass" && c["severity"] == "severe";
    assert_eq!(caveats.iter().filter(of_mass).count(), 2, "{caveats:?}");
}
