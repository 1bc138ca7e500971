//! Complete terminal output. `INSTA_UPDATE=always cargo test -p seaplant-cli snapshots` updates the
//! files; review the difference before committing.

use insta::assert_snapshot;

use crate::workshop::Workshop;

/// Returns the output of a command to a terminal without colour.
fn said(workshop: &Workshop, words: &[&str]) -> String {
    workshop.success(words)
}

#[test]
fn identify_tells_parameters_scores_and_doubts() {
    let workshop = Workshop::quick();
    assert_snapshot!(said(&workshop, &["identify", "campaign.toml"]));
}

#[test]
fn inspect_tells_of_each_channel_and_of_what_is_odd() {
    let workshop = Workshop::empty();
    let mut text = "time (s),prop (rpm),heading (rad),depth (m),empty\n".to_owned();
    for k in 0..200_u32 {
        let t = 0.1 * f64::from(k) + if k > 120 { 30.0 } else { 0.0 };
        let heading = (10.0 * f64::from(k)) % 360.0;
        text += &format!("{t:.1},{},{heading},4.25,\n", 300 * u32::from(k > 50));
    }
    workshop.write("dive.csv", text);
    assert_snapshot!(said(&workshop, &["inspect", "dive.csv"]));
}

#[test]
fn init_says_what_is_left_to_do() {
    let workshop = Workshop::new();
    assert_snapshot!(said(&workshop, &["init", "log.csv", "--out", "begun"]));
    assert_snapshot!("init_campaign", workshop.read("begun/campaign.toml"));
    assert_snapshot!("init_vehicle", workshop.read("begun/vehicle.toml"));
}

#[test]
fn errors_name_the_place_and_what_to_do() {
    let broken = |name: &str, from: &str, to: &str| {
        let workshop = Workshop::new();
        workshop.change(name, from, to);
        workshop.refusal()
    };
    let errors = [
        broken("campaign.toml", "velocity.surge", "velcity.surge"),
        broken("campaign.toml", "dof = [", "dofs = ["),
        broken("campaign.toml", "dof = [\"surge\"]", "dof = [\"surge\"]\nfrom_s = 9\nto_s = 3"),
        broken("campaign.toml", "\"speed\"", "\"sped\""),
        broken("vehicle.toml", "name = \"sled\"", "name = \"sled\"\ndry_mass_kg = -3"),
        broken("vehicle.toml", "kind = \"quadratic\"", "kind = \"cubic\""),
        broken("log.csv", "speed [m/s]", "speed [furlong]"),
        broken("log.csv", "prop [rpm]", "prop"),
    ];
    assert_snapshot!(errors.join("\n\n"));
}
