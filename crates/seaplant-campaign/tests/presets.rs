//! Known vehicles and thrusters in a vehicle.toml.

use seaplant::{ThrustCurve, Vehicle};
use seaplant_campaign::{BenchColumns, read_bench, read_vehicle};

use crate::common::{Folder, data};

const CURVE: &str = "thruster_curve = { kind = \"preset\", name = \"t200\", voltage_v = 16.0 }\n";

fn vehicle(text: &str) -> Result<Vehicle, String> {
    let folder = Folder::new();
    let path = folder.write("vehicle.toml", text);
    let message = |error: seaplant_campaign::Error| {
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    };
    read_vehicle(&path).map(|(vehicle, _)| vehicle).map_err(message)
}

#[test]
fn a_known_vehicle_needs_no_more_than_its_name_and_a_voltage() {
    for (preset, name, thrusters) in
        [("bluerov2", "BlueROV2", 6), ("bluerov2-heavy", "BlueROV2 Heavy", 8)]
    {
        let vehicle = vehicle(&format!("preset = \"{preset}\"\n{CURVE}")).unwrap();
        assert_eq!((vehicle.name.as_str(), vehicle.thrusters.len()), (name, thrusters));
        // 5.25 kgf at full throttle.
        let thrust = vehicle.thrusters[0].curve.force(1900.0, None);
        assert!((thrust - 5.25 * 9.80665).abs() < 1e-9);
        assert_eq!(vehicle.thrusters[0].uncertainty.forward, 0.05);
    }
}

#[test]
fn the_file_overrides_the_preset() {
    let text = format!(
        "preset = \"bluerov2\"\nname = \"Nemo\"\n{CURVE}\
         [[thruster]]\nname = \"motor 1\"\nreversed = true\n\
         [[thruster]]\nname = \"motor 5\"\nposition_m = [0.0, 0.2, 0.1]\n\
         [[thruster]]\nname = \"tunnel\"\nposition_m = [0.3, 0.0, 0.0]\n\
         direction = [0.0, 1.0, 0.0]\ncurve = {{ kind = \"quadratic\", forward = 0.04, reverse = 0.03 }}\n"
    );
    let nemo = vehicle(&text).unwrap();
    let names: Vec<&str> = nemo.thrusters.iter().map(|t| t.name.as_str()).collect();
    let motors = ["motor 1", "motor 2", "motor 3", "motor 4", "motor 5", "motor 6", "tunnel"];
    assert_eq!((nemo.name.as_str(), names), ("Nemo", motors.to_vec()));
    let plain = vehicle(&format!("preset = \"bluerov2\"\n{CURVE}")).unwrap();
    assert_eq!(nemo.thrusters[0].direction_body, -plain.thrusters[0].direction_body);
    assert_eq!(nemo.thrusters[0].position_body, plain.thrusters[0].position_body);
    let position_m: [f64; 3] = nemo.thrusters[4].position_body.into();
    assert_eq!(position_m, [0.0, 0.2, 0.1]);
    assert_eq!(nemo.thrusters[4].direction_body, plain.thrusters[4].direction_body);
    assert!(matches!(nemo.thrusters[6].curve, ThrustCurve::Quadratic { .. }));
}

#[test]
fn values_that_no_preset_has_must_be_stated() {
    let refused = |text: &str| vehicle(text).unwrap_err();
    assert!(refused("preset = \"bluerov2\"").contains(
        "thruster `motor 1`: missing field `curve`\nadd it, or a thruster_curve for all thrusters"
    ));
    let lone = format!("name = \"a\"\n{CURVE}[[thruster]]\nname = \"up\"\n");
    assert!(
        refused(&lone)
            .contains("thruster `up`: missing field `position_m`\nadd `position_m = ...` there")
    );
    assert!(refused(CURVE).contains("missing field `name`"), "{}", refused(CURVE));
    let unknown = refused("preset = \"bluerov3\"");
    assert!(unknown.contains("bluerov3") && unknown.contains("bluerov2-heavy"), "{unknown}");
    let high = CURVE.replace("16.0", "48.0");
    assert!(refused(&format!("preset = \"bluerov2\"\n{high}")).contains("voltage_v is 48"));
}

#[test]
fn the_law_of_the_t200_is_near_published_tables() {
    // Relative to the largest thrust: the law is the same for all voltages.
    for (volts, part) in [(12, 0.03), (16, 0.03), (20, 0.09)] {
        let Some(path) = data(&format!("t200-static/T200-Thrusters-{volts}V.csv")) else { return };
        let bench = read_bench(&path, &BenchColumns::default(), None).unwrap();
        let curve = CURVE.replace("16.0", &format!("{volts}.0"));
        let vehicle = vehicle(&format!("preset = \"bluerov2\"\n{curve}")).unwrap();
        let largest = bench.points.iter().map(|point| point.1).fold(0.0, f64::max);
        for (pulse, thrust) in &bench.points {
            let found = vehicle.thrusters[0].curve.force(*pulse, None);
            let off = (found - thrust).abs();
            assert!(off < part * largest, "{volts} V, {pulse} us: {found} N for {thrust} N");
        }
    }
}
