//! Proposals of `init`: files that can be read back, mapped correctly, with open questions in place
//! of guesses.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use seaplant::{Dof, Role};
use seaplant_campaign::{
    Campaign, CampaignFile, Proposal, VehicleFile, VehiclePreset, propose, read_toml, read_vehicle,
};
use seaplant_log::ReadOptions;

use crate::common::{Folder, csv, data, noise, open};

fn propose_in(folder: &Folder, files: &[PathBuf]) -> (Proposal, CampaignFile) {
    let proposal = propose(&open(files), files, folder.path(), &ReadOptions::default(), None);
    folder.write("vehicle.toml", &proposal.vehicle_toml);
    let path = folder.write("campaign.toml", &proposal.campaign_toml);
    let campaign =
        read_toml(&path).unwrap_or_else(|error| panic!("{error}\n{}", proposal.campaign_toml));
    (proposal, campaign)
}

fn columns(campaign: &CampaignFile) -> BTreeMap<&str, &str> {
    campaign.channels.iter().map(|(k, v)| (k.as_str(), v.column.as_str())).collect()
}

/// Returns the vehicle file with the minimum that a user adds.
fn filled(vehicle_toml: &str, direction: &str) -> String {
    let curve = "curve = { kind = \"quadratic\", input = \"pwm\", forward = 1e-4, reverse = 1e-4 }";
    let line = |line: &str| match line {
        line if line.starts_with("# position_m = [x") => "position_m = [0.0, 0.0, 0.0]".to_owned(),
        line if line.starts_with("# direction =") => format!("direction = {direction}"),
        line if line.starts_with("# curve =") => curve.to_owned(),
        line => line.to_owned(),
    };
    vehicle_toml.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// Returns a log of a vehicle that dives by two thrusters for 40 s, rests for a minute, and dives
/// again.
fn dive() -> String {
    let works = |t: f64| (20.0..60.0).contains(&t) || (120.0..150.0).contains(&t);
    let pulse = move |t: f64| if works(t) { 1500.0 + 80.0 * (0.8 * t).sin() } else { 1500.0 };
    let depth = move |t: f64| {
        let jitter = 0.001 * noise((t * 10.0) as usize);
        if works(t) { 3.0 - 0.3 * (0.8 * t).sin() + jitter } else { 3.0 + jitter }
    };
    let roll = |t: f64| 0.001 * noise((t * 10.0) as usize + 7);
    let zero = |_| 0.0;
    csv(
        10.0,
        200.0,
        &[
            ("up port [us]", &pulse),
            ("up stbd [us]", &pulse),
            ("Depth [m]", &depth),
            ("roll [rad]", &roll),
            ("X [m]", &zero),
        ],
    )
}

#[test]
fn columns_are_mapped_by_name_and_unit() {
    let folder = Folder::new();
    let log = folder.write("dive.csv", &dive());
    let (proposal, campaign) = propose_in(&folder, &[log]);
    let expected = [
        ("attitude.roll", "roll [rad]"),
        ("depth", "Depth [m]"),
        ("thruster.up port.pwm", "up port [us]"),
        ("thruster.up stbd.pwm", "up stbd [us]"),
    ];
    assert_eq!(columns(&campaign), BTreeMap::from(expected));
    let reason = "\"X [m]\": constant at 0, so not measured";
    assert!(proposal.campaign_toml.contains(reason), "{}", proposal.campaign_toml);
}

#[test]
fn trials_are_where_thrusters_work() {
    let folder = Folder::new();
    let log = folder.write("dive.csv", &dive());
    let (_, campaign) = propose_in(&folder, &[log]);
    let [first, second] = &campaign.trial[..] else { panic!("{:?}", campaign.trial) };
    assert_eq!((first.from_s, first.to_s), (Some(18.0), Some(70.0)));
    assert_eq!((second.from_s, second.to_s), (Some(118.0), Some(160.0)));
    assert_eq!((&first.dof[..], &second.dof[..]), (&[Dof::Heave][..], &[Dof::Heave][..]));
    assert_eq!((first.role, second.role), (Role::Fit, Role::HoldOut));
    assert_eq!((first.name.as_str(), second.name.as_str()), ("dive 1", "dive 2"));
}

#[test]
fn windows_count_from_the_logs_first_sample() {
    let folder = Folder::new();
    let shifted: String = dive()
        .lines()
        .map(|line| {
            match line.split_once(',').and_then(|(t, rest)| Some((t.parse::<f64>().ok()?, rest))) {
                Some((t, rest)) => format!("{},{rest}\n", t + 1000.0),
                None => format!("{line}\n"),
            }
        })
        .collect();
    let log = folder.write("dive.csv", &shifted);
    let (_, campaign) = propose_in(&folder, &[log]);
    assert_eq!((campaign.trial[0].from_s, campaign.trial[0].to_s), (Some(18.0), Some(70.0)));
}

#[test]
fn values_that_the_log_lacks_are_named_when_the_files_are_read() {
    let folder = Folder::new();
    let log = folder.write("dive.csv", &dive());
    let (proposal, _) = propose_in(&folder, &[log]);
    let vehicle = folder.path().join("vehicle.toml");
    let message = read_vehicle(&vehicle).expect_err("thrusters are open").to_string();
    assert!(message.contains("missing field `position_m`"), "{message}");
    let without = |key: &str| {
        let text = filled(&proposal.vehicle_toml, "[0.0, 0.0, -1.0]");
        let text =
            text.lines().filter(|line| !line.starts_with(key)).collect::<Vec<_>>().join("\n");
        let path = folder.write("vehicle.toml", &text);
        read_vehicle(&path).expect_err(key).to_string()
    };
    for key in ["direction", "curve"] {
        let message = without(key);
        assert!(message.contains(&format!("missing field `{key}`")), "{message}");
    }
}

#[test]
fn a_direction_that_was_not_decided_is_refused() {
    let folder = Folder::new();
    let log = folder.write("dive.csv", &dive());
    let (proposal, _) = propose_in(&folder, &[log]);
    let path = folder.write("vehicle.toml", &filled(&proposal.vehicle_toml, "[0.0, 0.0, 0.0]"));
    let message = read_vehicle(&path).expect_err("no direction").to_string();
    assert!(message.contains("direction"), "{message}");
}

#[test]
fn filled_in_the_files_are_a_campaign() {
    let folder = Folder::new();
    let log = folder.write("logs/dive.csv", &dive());
    let (proposal, _) = propose_in(&folder, &[log]);
    let path = folder.write("vehicle.toml", &filled(&proposal.vehicle_toml, "[0.0, 0.0, -1.0]"));
    let vehicle: VehicleFile = read_toml(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(vehicle.thruster.len(), 2);
    let campaign = Campaign::open(&folder.path().join("campaign.toml"));
    let campaign = campaign.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(campaign.trials.len(), 2);
}

#[test]
fn every_open_question_is_in_its_file() {
    let folder = Folder::new();
    let log = folder.write("dive.csv", &dive());
    let (proposal, _) = propose_in(&folder, &[log]);
    assert!(proposal.open_questions.len() >= 3);
    for question in &proposal.open_questions {
        let (file, question) = question.split_once(": ").expect("names its file");
        let text = match file {
            "vehicle.toml" => &proposal.vehicle_toml,
            _ => &proposal.campaign_toml,
        };
        assert!(text.contains(question), "{question}");
    }
}

#[test]
fn files_of_one_recording_make_one_trial() {
    let folder = Folder::new();
    let wave = |t: f64| 0.3 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    let speed = |t: f64| 900.0 * (0.5 * t).sin();
    let mut files = Vec::new();
    for dive in ["one", "two"] {
        let thrust = csv(10.0, 60.0, &[("port [rpm]", &speed), ("status", &speed)]);
        let dvl = csv(5.0, 60.0, &[("velocity x [m/s]", &wave), ("status", &wave)]);
        files.push(folder.write(&format!("{dive}/dvl.csv"), &dvl));
        files.push(folder.write(&format!("{dive}/thrusters.csv"), &thrust));
        files
            .push(folder.write(&format!("{dive}/depth.csv"), &csv(1.0, 60.0, &[("Z [m]", &wave)])));
    }
    files.remove(5);
    let (_, campaign) = propose_in(&folder, &files);
    let [one, two] = &campaign.trial[..] else { panic!("{:?}", campaign.trial) };
    assert_eq!((one.name.as_str(), two.name.as_str()), ("one", "two"));
    let logs: Vec<&Path> = one.log.files().iter().map(PathBuf::as_path).collect();
    assert_eq!(logs, ["one/dvl.csv", "one/thrusters.csv", "one/depth.csv"].map(Path::new));
    assert_eq!(columns(&campaign)["dvl.velocity.x"], "velocity x [m/s]");
    assert_eq!(columns(&campaign)["thruster.port.speed"], "port [rpm]");
    assert!(campaign.channels["depth"].optional, "the second dive has no depth");
}

#[test]
fn a_column_of_several_files_is_named_with_its_file() {
    let folder = Folder::new();
    let wave = |t: f64| 0.3 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    let files = [
        folder.write("ins.csv", &csv(5.0, 60.0, &[("u [m/s]", &wave), ("a", &wave), ("b", &wave)])),
        folder.write("dvl.csv", &csv(5.0, 60.0, &[("u [m/s]", &wave), ("c", &wave), ("d", &wave)])),
    ];
    let (_, campaign) = propose_in(&folder, &files);
    assert_eq!(campaign.trial.len(), 1);
    assert_eq!(columns(&campaign)["velocity.surge"], "ins.csv:u [m/s]");
    assert_eq!(columns(&campaign)["dvl.velocity.x"], "dvl.csv:u [m/s]");
}

#[test]
fn a_column_that_is_called_otherwise_in_one_log_is_mapped_there() {
    let folder = Folder::new();
    let wave = |t: f64| 3.0 + 0.3 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    let pulse = |t: f64| 1500.0 + 80.0 * (0.5 * t).sin();
    let columns =
        |depth: &str| csv(5.0, 60.0, &[("T1 [us]", &pulse), ("T2 [us]", &pulse), (depth, &wave)]);
    let files =
        [folder.write("a.csv", &columns("depth [m]")), folder.write("b.csv", &columns("Z [m]"))];
    let (_, campaign) = propose_in(&folder, &files);
    assert_eq!(campaign.channels["depth"].column, "depth [m]");
    assert!(campaign.trial[0].channels.is_empty());
    assert_eq!(campaign.trial[1].channels["depth"].column, "Z [m]");
}

#[test]
fn of_several_candidates_the_plainest_is_mapped_and_the_others_are_named() {
    let folder = Folder::new();
    let wave = |t: f64| 3.0 + 0.3 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    let text = csv(5.0, 60.0, &[("z [m]", &wave), ("depth [m]", &wave), ("depth raw [m]", &wave)]);
    let (proposal, campaign) = propose_in(&folder, &[folder.write("a.csv", &text)]);
    assert_eq!(columns(&campaign)["depth"], "depth [m]");
    let others = "other candidates: \"z [m]\", \"depth raw [m]\"";
    assert!(proposal.campaign_toml.contains(others), "{}", proposal.campaign_toml);
}

#[test]
fn names_and_units_of_many_loggers_are_known() {
    let wave = |t: f64| 0.3 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    for (column, quantity) in [
        ("heading_deg", "attitude.heading"),
        ("yaw rate [deg/s]", "rate.yaw"),
        ("gyro_z [rad/s]", "rate.yaw"),
        ("GyroX [rad/s]", "rate.roll"),
        ("psi [rad]", "attitude.heading"),
        ("phi [rad]", "attitude.roll"),
        ("theta [deg]", "attitude.pitch"),
        ("surge [m/s]", "velocity.surge"),
        ("u [m/s]", "velocity.surge"),
        ("v [m/s]", "velocity.sway"),
        ("w [m/s]", "velocity.heave"),
        ("p [rad/s]", "rate.roll"),
        ("DVL vx [m/s]", "dvl.velocity.x"),
        ("vy [m/s]", "dvl.velocity.y"),
        ("northing [m]", "position.north"),
        ("y [m]", "position.east"),
        ("batt [V]", "supply.voltage"),
        ("tau_x [N]", "wrench.surge"),
        ("N [N m]", "wrench.yaw"),
        ("motor1 rpm", "thruster.motor1.speed"),
        ("port thruster [%]", "thruster.port thruster.command"),
        ("motor cmd", "thruster.motor.command"),
        ("prop thrust [N]", "thruster.prop thrust.force"),
        ("rudder [rad]", "rudder.rudder.angle"),
        ("port_rudder_deg", "rudder.port rudder.angle"),
        ("sternplane [deg]", "fin.fin.angle"),
        ("true wind speed [kn]", "wind.true.speed"),
        ("latitude [deg]", "position.latitude"),
        ("cog [deg]", "ground.course"),
        ("vn [m/s]", "velocity.north"),
    ] {
        let folder = Folder::new();
        let log = folder.write("a.csv", &csv(5.0, 60.0, &[(column, &wave)]));
        let (_, campaign) = propose_in(&folder, &[log]);
        assert_eq!(columns(&campaign), BTreeMap::from([(quantity, column)]));
    }
}

#[test]
fn a_force_without_an_axis_is_that_of_the_axis_that_is_measured() {
    let wave = |t: f64| 0.3 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    for (motion, force, quantity) in [
        (["u [m/s]", "r [rad/s]"], "tau (N)", "wrench.surge"),
        (["w [m/s]", "r [rad/s]"], "force [kN]", "wrench.heave"),
        (["heading_deg", "u [m/s]"], "tau [N m]", "wrench.yaw"),
        (["p [rad/s]", "depth [m]"], "total torque [N m]", ""),
    ] {
        let folder = Folder::new();
        let text = csv(5.0, 60.0, &[(motion[0], &wave), (motion[1], &wave), (force, &wave)]);
        let (proposal, campaign) = propose_in(&folder, &[folder.write("a.csv", &text)]);
        let found = columns(&campaign).into_iter().find(|(_, column)| *column == force);
        assert_eq!(found.map_or("", |(quantity, _)| quantity), quantity, "{force}");
        let asked = proposal.open_questions.iter().any(|q| q.contains("its name has no axis"));
        assert_eq!(asked, !quantity.is_empty(), "{:?}", proposal.open_questions);
    }
}

#[test]
fn columns_that_only_resemble_a_quantity_are_left_out() {
    let wave = |t: f64| 0.3 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    for column in [
        "depth setpoint [m]",
        "vx_ned [m/s]",
        "beam1 velocity [m/s]",
        "altitude [m]",
        "depth [V]",
        "battery [%]",
        "heading std [deg]",
    ] {
        let folder = Folder::new();
        let log = folder.write("a.csv", &csv(5.0, 60.0, &[(column, &wave)]));
        let (proposal, campaign) = propose_in(&folder, &[log]);
        assert!(campaign.channels.is_empty(), "{column}: {:?}", campaign.channels);
        assert!(proposal.campaign_toml.contains(&format!("#   - \"{column}\": ")));
    }
}

#[test]
fn a_unit_that_is_not_stated_is_requested() {
    let folder = Folder::new();
    let wave = |t: f64| 0.3 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    let pulse = |t: f64| (1500.0 + 80.0 * (0.5 * t).sin()).round();
    let text = csv(5.0, 60.0, &[("heading", &wave), ("servo1", &pulse)]);
    let (proposal, campaign) = propose_in(&folder, &[folder.write("a.csv", &text)]);
    assert_eq!(campaign.channels["attitude.heading"].unit, None);
    assert_eq!(campaign.channels["thruster.servo1.pwm"].unit.as_deref(), Some("us"));
    let asked =
        proposal.open_questions.iter().any(|q| q.contains("\"heading\": no unit is stated"));
    assert!(asked, "{:?}", proposal.open_questions);
}

#[test]
fn no_name_can_break_out_of_its_string() {
    let folder = Folder::new();
    let text =
        "time [s],\"T1\"\"]\n[[trial]]\nname = \\ [us]\",\"de'\"\"pth # [m]\",\"☃ = 1 [m]\"\n";
    let rows = (0..50).map(|k| format!("{k},{},{},{}\n", 1500 + k, noise(k), noise(k + 1)));
    let log =
        folder.write("a \"quoted\" $HOME #.csv", &format!("{text}{}", rows.collect::<String>()));
    let (proposal, campaign) = propose_in(&folder, std::slice::from_ref(&log));
    assert_eq!(campaign.trial.len(), 1, "{}", proposal.campaign_toml);
    let _: VehicleFile = {
        let filled = filled(&proposal.vehicle_toml, "[1.0, 0.0, 0.0]");
        read_toml(&folder.write("vehicle.toml", &filled))
            .unwrap_or_else(|e| panic!("{e}\n{filled}"))
    };
}

#[test]
fn a_log_without_thrusters_or_motion_still_makes_files() {
    let folder = Folder::new();
    let wave = |t: f64| noise((t * 10.0) as usize);
    let log = folder.write("a.csv", &csv(5.0, 60.0, &[("foo", &wave)]));
    let (proposal, campaign) = propose_in(&folder, &[log]);
    assert!(campaign.channels.is_empty());
    assert!(proposal.open_questions.iter().any(|q| q.contains("no column is recognised")));
    assert!(proposal.open_questions.iter().any(|q| q.contains("looks like a thruster's")));
}

#[test]
fn the_twins_logs_are_mapped_as_the_twin_maps_them() {
    let twin = seaplant::twin::make(&seaplant::twin::TwinSpec::default()).expect("the default");
    let folder = Folder::new();
    let made = seaplant_campaign::twin_files(&twin).expect("every number is finite");
    let files: Vec<PathBuf> = made
        .iter()
        .map(|file| (file, folder.write(&file.path, &file.text)))
        .filter(|(file, _)| file.path.starts_with("logs/"))
        .map(|(_, path)| path)
        .collect();
    let truth: CampaignFile =
        read_toml(&folder.path().join("campaign.toml")).unwrap_or_else(|error| panic!("{error}"));
    let (_, campaign) = propose_in(&folder, &files);
    assert_eq!(campaign.channels, truth.channels);
    assert_eq!(campaign.trial.len(), truth.trial.len());
    for (found, truth) in campaign.trial.iter().zip(&truth.trial) {
        assert_eq!((&found.log, &found.dof), (&truth.log, &truth.dof), "{}", truth.name);
        assert_eq!(found.role == Role::HoldOut, truth.role == Role::HoldOut, "{}", truth.name);
    }
}

#[test]
fn the_pool_logs_are_mapped() {
    let names = ["depth_test", "depth_test_2", "yaw_test", "yaw_test_2"];
    let files: Vec<_> = names.iter().filter_map(|n| data(&format!("bolt-auv/{n}.csv"))).collect();
    if files.len() < names.len() {
        return;
    }
    let folder = Folder::new();
    let (proposal, campaign) = propose_in(&folder, &files);
    let mut expected = BTreeMap::from([
        ("depth".to_owned(), "Z (m)".to_owned()),
        ("attitude.roll".to_owned(), "Roll (rad)".to_owned()),
        ("attitude.pitch".to_owned(), "Pitch (rad)".to_owned()),
        ("attitude.heading".to_owned(), "Yaw (rad)".to_owned()),
    ]);
    expected.extend((1..=8).map(|k| (format!("thruster.T{k}.pwm"), format!("T{k} (us)"))));
    let found: BTreeMap<String, String> =
        campaign.channels.iter().map(|(k, v)| (k.clone(), v.column.clone())).collect();
    assert_eq!(found, expected);
    let dofs: Vec<Dof> = campaign.trial.iter().map(|trial| trial.dof[0]).collect();
    assert_eq!(dofs, [Dof::Heave, Dof::Heave, Dof::Yaw, Dof::Yaw]);
    let roles: Vec<Role> = campaign.trial.iter().map(|trial| trial.role).collect();
    assert_eq!(roles, [Role::Fit, Role::HoldOut, Role::Fit, Role::HoldOut]);
    folder.write("vehicle.toml", &filled(&proposal.vehicle_toml, "[0.0, 0.0, 1.0]"));
    let heave = proposal.campaign_toml.replace("dof = [\"yaw\"]", "dof = [\"heave\"]");
    let path = folder.write("campaign.toml", &heave);
    Campaign::open(&path).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn the_tankers_logs_are_mapped() {
    let Some(path) = data("esso-osaka/random_06-Aug-2020_16_24_25_4.csv") else { return };
    let (proposal, campaign) = propose_in(&Folder::new(), &[path]);
    let expected = [
        ("velocity.surge", "u_velo [m/s]"),
        ("velocity.sway", "vm_velo [m/s]"),
        ("attitude.heading", "psi_hat [rad]"),
        ("rate.yaw", "r_angvelo [rad/s]"),
        ("position.north", "x_position_mid [m]"),
        ("position.east", "y_position_mid [m]"),
        ("thruster.n_prop.speed", "n_prop [rps]"),
        ("rudder.rudder.angle", "delta_rudder [rad]"),
        ("wind.relative.speed", "wind_velo_relative_mid [m/s]"),
        ("wind.relative.direction", "wind_dir_relative_mid [rad]"),
        ("wind.true.speed", "wind_velo_true [m/s]"),
        ("wind.true.direction", "wind_dir_true [rad]"),
    ];
    assert_eq!(columns(&campaign), BTreeMap::from(expected));
    assert_eq!(campaign.trial[0].dof, [Dof::Surge]);
    assert!(proposal.open_questions.iter().any(|q| q.contains("turns the bow to starboard")));
    assert!(proposal.vehicle_toml.contains("[[rudder]]"), "{}", proposal.vehicle_toml);
}

#[test]
fn a_log_of_ardusub_is_known() {
    let Some(log) = data("formats/ardusub/small.BIN") else { return };
    let folder = Folder::new();
    let (proposal, campaign) = propose_in(&folder, &[log]);
    let found = columns(&campaign);
    for (quantity, column) in [
        ("attitude.heading", "ATT.Yaw"),
        ("rate.yaw", "RATE.Y"),
        ("depth", "BARO[1].Alt"),
        ("supply.voltage", "BAT[0].Volt"),
        ("thruster.motor 1.pwm", "RCOU.C1"),
        ("thruster.motor 6.pwm", "RCOU.C6"),
        ("acceleration.x", "IMU[0].AccX"),
        ("acceleration.z", "IMU[0].AccZ"),
    ] {
        assert_eq!(found.get(quantity), Some(&column), "{}", proposal.campaign_toml);
    }
    assert!(!found.contains_key("thruster.motor 7.pwm"));
    assert!(campaign.channels["depth"].negate);

    let (vehicle, _) = read_vehicle(&folder.path().join("vehicle.toml")).unwrap();
    assert_eq!((vehicle.name.as_str(), vehicle.thrusters.len()), ("BlueROV2", 6));
    // In the settings of the log, MOT_1_DIRECTION is -1 and MOT_3_DIRECTION is 1.
    let forward = |k: usize| vehicle.thrusters[k].direction_body.x > 0.0;
    assert!(forward(0) && forward(2));
    assert!(proposal.vehicle_toml.contains("voltage_v = 17.5"), "{}", proposal.vehicle_toml);
    // The files are complete: open decisions do not prevent reading them.
    Campaign::open(&folder.path().join("campaign.toml")).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn a_log_of_px4_is_known() {
    let Some(log) = data("formats/ulog/sample_px4_events.ulg") else { return };
    let folder = Folder::new();
    let (proposal, campaign) = propose_in(&folder, &[log]);
    let found = columns(&campaign);
    for (quantity, column) in [
        ("attitude.roll", "vehicle_attitude.roll"),
        ("attitude.heading", "vehicle_attitude.yaw"),
        ("acceleration.x", "sensor_combined.accelerometer_m_s2[0]"),
        ("position.north", "vehicle_local_position.x"),
        ("thruster.motor 1.command", "actuator_motors.control[0]"),
        ("supply.voltage", "battery_status.voltage_v"),
    ] {
        assert_eq!(found.get(quantity), Some(&column), "{}", proposal.campaign_toml);
    }
    // CA_ROTOR_COUNT is 4.
    assert!(found.contains_key("thruster.motor 4.command"));
    assert!(!found.contains_key("thruster.motor 5.command"));
}

#[test]
fn an_accelerometer_is_mapped_only_without_a_velocity() {
    let folder = Folder::new();
    let table = |velocity: &str| {
        let row = |k: i32| {
            let t = 0.1 * f64::from(k);
            format!("{t:.1},{},{:.3},{:.3}\n", 1500 + 10 * (k % 7), t.sin(), 0.1 * t.cos())
        };
        let head = format!("time [s],T1 pwm (us),accel x [m/s2],{velocity}\n");
        head + &(0..200).map(row).collect::<String>()
    };
    for (name, velocity, mapped) in [("a.csv", "u [m/s]", false), ("b.csv", "pitch [rad]", true)] {
        let file = folder.write(name, &table(velocity));
        let (proposal, campaign) = propose_in(&folder, &[file]);
        let found = columns(&campaign).contains_key("acceleration.x");
        assert_eq!(found, mapped, "{}", proposal.campaign_toml);
    }
}

#[test]
fn telemetry_of_ardusub_is_known() {
    let Some(log) = data("formats/ardusub/small.tlog") else { return };
    let folder = Folder::new();
    let (proposal, campaign) = propose_in(&folder, &[log]);
    let found = columns(&campaign);
    for (quantity, column) in [
        ("attitude.heading", "ATTITUDE.yaw"),
        ("rate.yaw", "ATTITUDE.yawspeed"),
        ("depth", "GLOBAL_POSITION_INT.relative_alt"),
        ("thruster.motor 8.pwm", "SERVO_OUTPUT_RAW.servo8_raw"),
        ("acceleration.y", "RAW_IMU.yacc"),
    ] {
        assert_eq!(found.get(quantity), Some(&column), "{}", proposal.campaign_toml);
    }
    let (vehicle, _) = read_vehicle(&folder.path().join("vehicle.toml")).unwrap();
    assert_eq!((vehicle.name.as_str(), vehicle.thrusters.len()), ("BlueROV2 Heavy", 8));
    Campaign::open(&folder.path().join("campaign.toml")).unwrap_or_else(|error| panic!("{error}"));
}

/// Returns a recording of twelve ensembles, in every frame in turn.
fn every_frame() -> Vec<u8> {
    let seed =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../seaplant-log/fuzz/corpus/pd0/seed.pd0");
    std::fs::read(seed).expect("the corpus is there")
}

/// Sets the frame of all ensembles to the ship's axes.
fn in_ships_axes(mut bytes: Vec<u8>) -> Vec<u8> {
    let mut at = 0;
    while at + 2 < bytes.len() {
        if bytes[at..at + 2] != [0x7f, 0x7f] {
            at += 1;
            continue;
        }
        let number =
            |bytes: &[u8], k: usize| usize::from(u16::from_le_bytes([bytes[k], bytes[k + 1]]));
        let (size, leader) = (number(&bytes, at + 2), at + number(&bytes, at + 6));
        // The frame is in bits 3 and 4 of this byte of the fixed leader; 2 is the ship's.
        bytes[leader + 25] = bytes[leader + 25] & !0x18 | 0x10;
        let sum = bytes[at..at + size].iter().fold(0_u16, |sum, b| sum.wrapping_add((*b).into()));
        bytes[at + size..at + size + 2].copy_from_slice(&sum.to_le_bytes());
        at += size + 2;
    }
    bytes
}

fn propose_pd0(bytes: Vec<u8>) -> (Proposal, CampaignFile) {
    let folder = Folder::new();
    let path = folder.path().join("dvl.pd0");
    std::fs::write(&path, bytes).expect("a file can be written");
    propose_in(&folder, &[path])
}

#[test]
fn a_dvl_in_ship_coordinates_is_turned_to_the_vehicles_velocity() {
    let (proposal, campaign) = propose_pd0(in_ships_axes(every_frame()));
    let text = &proposal.campaign_toml;
    for (quantity, column, negate) in [
        ("dvl.velocity.x", "bottom_track.ship.velocity_forward", true),
        ("dvl.velocity.y", "bottom_track.ship.velocity_starboard", true),
        ("dvl.velocity.z", "bottom_track.ship.velocity_up", false),
    ] {
        let channel = campaign.channels.get(quantity).unwrap_or_else(|| panic!("{text}"));
        assert_eq!((channel.column.as_str(), channel.negate), (column, negate), "{text}");
    }
    assert!(!campaign.channels.contains_key("velocity.surge"), "{text}");
}

#[test]
fn velocities_of_a_dvl_in_other_frames_are_reported() {
    let (proposal, campaign) = propose_pd0(every_frame());
    let text = &proposal.campaign_toml;
    assert!(campaign.channels.keys().all(|quantity| !quantity.contains("velocity")), "{text}");
    for (column, reason) in [
        ("bottom_track.instrument.velocity_x", "in the instrument's axes"),
        ("bottom_track.beam.velocity_1", "along a beam of the instrument"),
        ("bottom_track.earth.velocity_north", "a velocity along the world's axes"),
        ("speed_of_sound", "the speed of sound"),
    ] {
        let mut lines = text.lines().filter(|line| line.contains(reason));
        assert!(lines.any(|line| line.contains(column)), "{column}: {text}");
    }
}

#[test]
fn velocities_that_an_autopilot_has_along_north_are_reported() {
    let mut log = Flash::default();
    log.define(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
    log.define(1, 28, "NKF1", "QffffB", "TimeUS,VN,VE,VD,PN,C");
    log.define(2, 15, "VISO", "Qf", "TimeUS,PX");
    for k in 0..100_u64 {
        let time_us = (1_000_000 + 100_000 * k).to_le_bytes();
        let value = (noise(k as usize) as f32).to_le_bytes();
        log.record(1, &[&time_us, &value, &value, &value, &value, &[0]]);
        log.record(2, &[&time_us, &value]);
    }
    let folder = Folder::new();
    let path = folder.path().join("log.BIN");
    std::fs::write(&path, log.0).expect("a file can be written");
    let (proposal, campaign) = propose_in(&folder, &[path]);
    assert_eq!(columns(&campaign), BTreeMap::from([("position.north", "NKF1.PN")]));
    let text = proposal.campaign_toml;
    let world = "\"NKF1.VN\", \"NKF1.VE\", \"NKF1.VD\": a velocity along the world's axes";
    assert!(text.contains(world), "{text}");
    assert!(text.contains("\"VISO.PX\": how far the vehicle moved"), "{text}");
}

/// A DataFlash log under construction.
#[derive(Default)]
struct Flash(Vec<u8>);

impl Flash {
    fn record(&mut self, number: u8, body: &[&[u8]]) {
        self.0.extend([0xa3, 0x95, number]);
        body.iter().for_each(|part| self.0.extend(*part));
    }

    fn define(&mut self, number: u8, length: u8, name: &str, letters: &str, columns: &str) {
        let padded = |text: &str, size: usize| {
            let mut bytes = text.as_bytes().to_vec();
            bytes.resize(size, 0);
            bytes
        };
        let (name, letters) = (padded(name, 4), padded(letters, 16));
        self.record(128, &[&[number, length], &name, &letters, &padded(columns, 64)]);
    }
}

/// Returns the [`dive`] as ArduSub logs it, by motors 5 and 6 of a vectored frame.
fn dive_of_ardusub() -> Vec<u8> {
    let mut log = Flash::default();
    log.define(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
    log.define(1, 31, "PARM", "QNf", "TimeUS,Name,Value");
    log.define(2, 23, "RCOU", "QHHHHHH", "TimeUS,C1,C2,C3,C4,C5,C6");
    log.define(3, 15, "BARO", "Qf", "TimeUS,Alt");
    for (name, value) in [("FRAME_CONFIG", 1.0_f32), ("MOT_6_DIRECTION", -1.0)] {
        let mut padded = name.as_bytes().to_vec();
        padded.resize(16, 0);
        log.record(1, &[&0_u64.to_le_bytes(), &padded, &value.to_le_bytes()]);
    }
    for k in 0..2000_u64 {
        let t = k as f64 / 10.0;
        let works = (20.0..60.0).contains(&t) || (120.0..150.0).contains(&t);
        let push = if works { 80.0 * (0.8 * t).sin() } else { 0.0 };
        let down = if works { -0.3 * (0.8 * t).sin() } else { 0.0 };
        let time_us = (1_000_000 + 100_000 * k).to_le_bytes();
        let idle = 1500_u16.to_le_bytes();
        let [five, six] = [1500.0 + push, 1500.0 - push].map(|pulse| (pulse as u16).to_le_bytes());
        log.record(2, &[&time_us, &idle, &idle, &idle, &idle, &five, &six]);
        let height = -(3.0 + down + 0.001 * noise(k as usize)) as f32;
        log.record(3, &[&time_us, &height.to_le_bytes()]);
    }
    log.0
}

#[test]
fn a_dive_of_ardusub_needs_nothing_but_its_log() {
    let folder = Folder::new();
    let log = folder.path().join("dive.BIN");
    std::fs::write(&log, dive_of_ardusub()).expect("a file can be written");
    let (proposal, campaign) = propose_in(&folder, &[log]);
    let windows: Vec<_> = campaign.trial.iter().map(|trial| (trial.from_s, trial.to_s)).collect();
    assert_eq!(windows, [(Some(18.0), Some(70.0)), (Some(118.0), Some(160.0))]);
    assert!(campaign.trial.iter().all(|trial| trial.dof == [Dof::Heave]));
    assert_eq!(campaign.trial[1].role, Role::HoldOut);
    assert!(proposal.vehicle_toml.contains("voltage_v = 16.0 }"), "{}", proposal.vehicle_toml);
    let campaign = Campaign::open(&folder.path().join("campaign.toml"));
    let campaign = campaign.unwrap_or_else(|error| panic!("{error}"));
    // Motor 6 is reversed, so both act downwards at once.
    let down = |k: usize| campaign.vehicle.thrusters[k].direction_body.z;
    assert_eq!((down(4), down(5)), (1.0, -1.0));
    let found = campaign.identify("seaplant identify campaign.toml");
    let caveats = &found.results.caveats;
    let assumed = "the positions of 6 thrusters are those of the preset bluerov2";
    assert!(caveats.iter().any(|caveat| caveat.message.starts_with(assumed)), "{caveats:?}");
}

/// Returns a log of a boat with two throttles by ArduPilot.
fn boat_of_ardupilot() -> Vec<u8> {
    let mut log = Flash::default();
    log.define(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
    log.define(1, 31, "PARM", "QNf", "TimeUS,Name,Value");
    log.define(2, 17, "RCOU", "QHHH", "TimeUS,C1,C2,C3");
    log.define(3, 23, "ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw");
    log.define(4, 20, "XKF1", "QBff", "TimeUS,C,VN,VE");
    log.define(5, 19, "WIND", "Qff", "TimeUS,DrTru,SpdTru");
    for (name, value) in [("SERVO1_FUNCTION", 74.0_f32), ("SERVO3_FUNCTION", 73.0)] {
        let mut padded = name.as_bytes().to_vec();
        padded.resize(16, 0);
        log.record(1, &[&0_u64.to_le_bytes(), &padded, &value.to_le_bytes()]);
    }
    for k in 0..1200_u64 {
        let t = k as f64 / 10.0;
        let time_us = (1_000_000 + 100_000 * k).to_le_bytes();
        let pulse = |x: f64| ((1500.0 + 300.0 * x) as u16).to_le_bytes();
        let [right, left] = [(0.5 * t).sin(), (0.31 * t).cos()];
        log.record(2, &[&time_us, &pulse(right), &1500_u16.to_le_bytes(), &pulse(left)]);
        let heading = (40.0 * (0.05 * t).sin()) as f32;
        log.record(3, &[&time_us, &[0; 8], &heading.to_le_bytes()]);
        let speed = |x: f64| (0.5 + 0.4 * x + 0.01 * noise(k as usize)) as f32;
        let (north, east) = (speed((0.3 * t).sin()), speed((0.2 * t).cos()));
        log.record(4, &[&time_us, &[0], &north.to_le_bytes(), &east.to_le_bytes()]);
        let [from, wind] = [90.0 + 10.0 * (0.1 * t).sin(), 4.0 + (0.07 * t).sin()];
        log.record(5, &[&time_us, &(from as f32).to_le_bytes(), &(wind as f32).to_le_bytes()]);
    }
    log.0
}

#[test]
fn a_boat_of_ardupilot_brings_its_throttles_its_way_over_ground_and_the_wind() {
    let folder = Folder::new();
    let log = folder.path().join("boat.BIN");
    std::fs::write(&log, boat_of_ardupilot()).expect("a file can be written");
    let (_, campaign) = propose_in(&folder, &[log]);
    let mapped = columns(&campaign);
    for (quantity, column) in [
        ("thruster.throttle right.pwm", "RCOU.C1"),
        ("thruster.throttle left.pwm", "RCOU.C3"),
        ("attitude.heading", "ATT.Yaw"),
        ("velocity.north", "XKF1.VN"),
        ("velocity.east", "XKF1.VE"),
        ("wind.true.speed", "WIND.SpdTru"),
        ("wind.true.direction", "WIND.DrTru"),
    ] {
        assert_eq!(mapped.get(quantity), Some(&column), "{mapped:?}");
    }
}

/// Writes a table of pulse widths of several motors, not named after ArduSub's.
fn pulses(folder: &Folder, motors: usize) -> PathBuf {
    let names: Vec<String> = (1..=motors).map(|k| format!("thruster {k} [us]")).collect();
    let pulse = |t: f64| 1500.0 + 80.0 * (0.8 * t).sin();
    let depth = |t: f64| 3.0 - 0.3 * (0.8 * t).sin();
    let mut columns: Vec<(&str, &dyn Fn(f64) -> f64)> = vec![("Depth [m]", &depth)];
    columns.extend(names.iter().map(|name| (name.as_str(), &pulse as &dyn Fn(f64) -> f64)));
    folder.write("pulses.csv", &csv(10.0, 60.0, &columns))
}

#[test]
fn eight_motors_bring_the_preset_that_has_as_many() {
    let folder = Folder::new();
    let (proposal, _) = propose_in(&folder, &[pulses(&folder, 8)]);
    let questions = proposal.open_questions.join("\n");
    assert!(questions.contains("8 motors: if this is a BlueROV2 Heavy"), "{questions}");
    assert!(questions.contains("--preset bluerov2-heavy"), "{questions}");
    let (proposal, _) = propose_in(&folder, &[pulses(&folder, 3)]);
    assert!(!proposal.open_questions.join("\n").contains("--preset"));
}

#[test]
fn a_preset_that_is_stated_makes_the_vehicle() {
    let folder = Folder::new();
    let log = pulses(&folder, 8);
    let preset = Some(VehiclePreset::BlueRov2Heavy);
    let options = ReadOptions::default();
    let files = std::slice::from_ref(&log);
    let proposal = propose(&open(files), files, folder.path(), &options, preset);
    let path = folder.write("vehicle.toml", &proposal.vehicle_toml);
    let (vehicle, _) = read_vehicle(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(vehicle.thrusters.len(), 8);
    // The columns have other names than the preset's motors, so the user must map them.
    let questions = proposal.open_questions.join("\n");
    assert!(questions.contains("map the column of each under [channels]"), "{questions}");
    assert!(!questions.contains("is it a"), "{questions}");
    assert!(proposal.vehicle_toml.contains("# as --preset says"));
}

/// Returns a log of a vehicle that is driven freely in `moving`, at rest in the other axes.
fn free_driving(moving: &[&str]) -> String {
    let wave = |column: &str, size: f64, period_s: f64| {
        let size = if moving.contains(&column) { size } else { 0.001 };
        move |t: f64| {
            let gust = noise((t * 10.0) as usize + period_s as usize);
            size * (t * std::f64::consts::TAU / period_s).sin() + 1e-4 * gust
        }
    };
    let (surge, sway) = (wave("u", 0.5, 17.0), wave("v", 0.3, 23.0));
    let (heave, yaw) = (wave("w", 0.3, 29.0), wave("r", 0.4, 31.0));
    let tilt = |t: f64| 0.05 * (0.9 * t).sin();
    let push = move |t: f64| 0.4 + 0.3 * (t * std::f64::consts::TAU / 17.0).sin();
    csv(
        10.0,
        120.0,
        &[
            ("T1 [1]", &push),
            ("dvl vx [m/s]", &surge),
            ("dvl vy [m/s]", &sway),
            ("dvl vz [m/s]", &heave),
            ("yaw rate [rad/s]", &yaw),
            ("roll [rad]", &tilt),
            ("pitch [rad]", &tilt),
            ("heading [rad]", &yaw),
        ],
    )
}

#[test]
fn a_log_that_moves_and_measures_all_axes_is_proposed_a_plant_of_six() {
    let folder = Folder::new();
    let log = folder.write("free.csv", &free_driving(&["u", "v", "w", "r"]));
    let (proposal, campaign) = propose_in(&folder, &[log]);
    let axes: Vec<&[Dof]> = campaign.plant.iter().map(|plant| &plant.axes[..]).collect();
    assert_eq!(axes, [&Dof::ALL[..]], "{}", proposal.campaign_toml);
    assert!(proposal.campaign_toml.contains("axes = \"six\""));
    assert!(campaign.trial[0].dof.is_empty(), "{}", proposal.campaign_toml);
}

#[test]
fn a_log_that_moves_one_axis_and_measures_all_names_the_plant_of_six_as_an_alternative() {
    let folder = Folder::new();
    let log = folder.write("surge.csv", &free_driving(&["u"]));
    let (proposal, campaign) = propose_in(&folder, &[log]);
    assert!(campaign.plant.is_empty());
    assert_eq!(campaign.trial[0].dof, [Dof::Surge]);
    assert!(proposal.campaign_toml.contains("\n# axes = \"six\"\n"), "{}", proposal.campaign_toml);
}

#[test]
fn axes_that_move_together_are_one_plant() {
    let folder = Folder::new();
    let log = folder.write("planar.csv", &free_driving(&["u", "v", "r"]));
    let (proposal, campaign) = propose_in(&folder, &[log]);
    assert_eq!(campaign.plant[0].axes, [Dof::Surge, Dof::Sway, Dof::Yaw]);
    assert!(proposal.campaign_toml.contains("axes = \"planar\""), "{}", proposal.campaign_toml);
}

#[test]
fn numbers_of_quaternions_lists_and_propellers_are_no_motion() {
    let wave = |t: f64| 0.5 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    let speed = |t: f64| 300.0 * (0.5 * t).sin();
    let folder = Folder::new();
    let text = csv(
        5.0,
        60.0,
        &[
            ("quaternion_w", &wave),
            ("motor_speed", &speed),
            ("motor_speed_2", &wave),
            ("thrusters.layout.data_offset", &|_| 0.0),
            ("propeller velocity [m/s]", &wave),
            ("u [m/s]", &wave),
        ],
    );
    let (proposal, campaign) = propose_in(&folder, &[folder.write("a.csv", &text)]);
    let expected = [
        ("thruster.motor.speed", "motor_speed"),
        ("thruster.motor_speed_2.speed", "motor_speed_2"),
        ("velocity.surge", "u [m/s]"),
    ];
    assert_eq!(columns(&campaign), BTreeMap::from(expected), "{}", proposal.campaign_toml);
    assert!(proposal.open_questions.iter().any(|question| question.contains("\"rpm\"")));
}

#[test]
fn files_that_overlap_by_the_calendar_are_one_run_whatever_columns_they_share() {
    let wave = |t: f64| 0.3 * (0.5 * t).sin() + 0.001 * noise((t * 10.0) as usize);
    let folder = Folder::new();
    let stamped = |start: u64, column: &str| {
        let mut text = format!("header_seq,header_stamp_secs,header_stamp_nsecs,{column}\n");
        for k in 0..300u64 {
            let (seconds, rest) = (start + k / 5, k % 5 * 200_000_000);
            text += &format!("{k},{seconds},{rest},{}\n", wave(k as f64 / 5.0));
        }
        text
    };
    let mut files = Vec::new();
    for (run, start) in [("run1", 1_700_000_000), ("run2", 1_700_003_600)] {
        for motor in 0..14 {
            let column = format!("thruster_{motor}_command");
            let text = stamped(start + motor % 3, &column);
            files.push(folder.write(&format!("{run}/thruster_{motor}.csv"), &text));
        }
    }
    let (proposal, campaign) = propose_in(&folder, &files[..14]);
    assert_eq!(campaign.trial.len(), 1, "{}", proposal.campaign_toml);
    assert_eq!(campaign.trial[0].log.files().len(), 14);
    let (_, both) = propose_in(&folder, &files);
    assert_eq!(both.trial.len(), 2, "two runs of another hour are two trials");
}

#[test]
fn angles_that_can_only_be_degrees_are_mapped_without_a_question() {
    let roll = |t: f64| -18.0 + 18.0 * (0.3 * t).sin();
    let pitch = |t: f64| 1.5 * (0.4 * t).sin();
    let yaw = |t: f64| (340.0 + 2.0 * t) % 359.9;
    let folder = Folder::new();
    let text = csv(10.0, 60.0, &[("roll", &roll), ("pitch", &pitch), ("yaw", &yaw)]);
    let (proposal, campaign) = propose_in(&folder, &[folder.write("a.csv", &text)]);
    for angle in ["roll", "pitch", "heading"] {
        let entry = &campaign.channels[&format!("attitude.{angle}")];
        assert_eq!(entry.unit.as_deref(), Some("deg"), "{}", proposal.campaign_toml);
    }
    assert!(!proposal.campaign_toml.contains("no unit is stated"), "{}", proposal.campaign_toml);

    let small = |t: f64| 0.3 * (0.3 * t).sin();
    let text = csv(10.0, 60.0, &[("roll", &small), ("pitch", &small), ("yaw", &small)]);
    let (proposal, _) = propose_in(&folder, &[folder.write("b.csv", &text)]);
    assert!(proposal.campaign_toml.contains("no unit is stated"), "may be either");
}

#[test]
fn a_quaternion_of_a_table_is_an_attitude() {
    let half = |t: f64| 0.4 * (0.2 * t).sin();
    let folder = Folder::new();
    let text = csv(
        10.0,
        60.0,
        &[
            ("imu_orientation_x", &|t| 0.01 * half(t)),
            ("imu_orientation_y", &|_| 0.0),
            ("imu_orientation_z", &|t| half(t).sin()),
            ("imu_orientation_w", &|t| half(t).cos()),
        ],
    );
    let (proposal, campaign) = propose_in(&folder, &[folder.write("a.csv", &text)]);
    let columns = columns(&campaign);
    assert_eq!(columns["attitude.heading"], "imu_orientation.yaw", "{}", proposal.campaign_toml);
    assert_eq!(columns["attitude.roll"], "imu_orientation.roll");
    let asked = proposal.open_questions.iter().any(|question| question.contains("negate = true"));
    assert!(asked, "{:?}", proposal.open_questions);
}
