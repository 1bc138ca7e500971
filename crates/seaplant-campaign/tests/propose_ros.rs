//! Proposals of `init` for ROS bags: quantities in our frame, thrusters by their topics.

use std::collections::BTreeMap;

use seaplant_campaign::{CampaignFile, ChannelEntry, propose, read_toml};
use seaplant_log::ReadOptions;

use crate::common::{Folder, noise, open};
use crate::mcap::McapFile;

/// Encodes the stamp and an empty frame name, and the padding before the numbers that follow.
fn header(t: f64) -> Vec<u8> {
    let (seconds, nanos) = (t as u32, (t.fract() * 1e9) as u32);
    let head = [seconds.to_le_bytes(), nanos.to_le_bytes(), 1_u32.to_le_bytes()].concat();
    [head, vec![0; 4]].concat()
}

fn numbers(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Returns distinct varying numbers.
fn moving(t: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|k| 0.3 * (0.4 * t + k as f64).sin() + 0.01 * noise((10.0 * t) as usize))
        .collect()
}

fn imu(t: f64) -> Vec<u8> {
    let q = [0.1 * t.sin(), 0.1 * t.cos(), 0.2 * (0.3 * t).sin(), 0.9];
    [
        header(t),
        numbers(&q),
        numbers(&[0.0; 9]),
        numbers(&moving(t, 3)),
        numbers(&[0.0; 9]),
        numbers(&moving(t, 12)),
    ]
    .concat()
}

fn odometry(t: f64) -> Vec<u8> {
    let q = [0.1 * t.sin(), 0.1 * t.cos(), 0.2 * (0.3 * t).sin(), 0.9];
    let frames = [header(t), 1_u32.to_le_bytes().to_vec(), vec![0; 4]].concat();
    let pose = [numbers(&moving(t, 3)), numbers(&q), numbers(&[0.0; 36])].concat();
    [frames, pose, numbers(&moving(t, 6)), numbers(&[0.0; 36])].concat()
}

fn twist(t: f64) -> Vec<u8> {
    [header(t), numbers(&moving(t, 6))].concat()
}

/// Topics as (name, type, content by time), recorded for a minute at 10 Hz.
type Topics<'a> = &'a [(&'a str, &'a str, &'a dyn Fn(f64) -> Vec<u8>)];

fn proposed(topics: Topics<'_>) -> (String, CampaignFile) {
    let mut file = McapFile::new();
    for (id, (topic, kind, _)) in (0..).zip(topics) {
        file.channel(id, topic, kind, ("", ""), "cdr");
    }
    for k in 0..600 {
        let t = 100.0 + f64::from(k) / 10.0;
        for (id, (_, _, content)) in (0..).zip(topics) {
            file.cdr(id, (t * 1e9) as u64, &content(t));
        }
    }
    let folder = Folder::new();
    let log = folder.path().join("dive.mcap");
    std::fs::write(&log, file.finish()).expect("a file can be written");
    let files = [log];
    let proposal = propose(&open(&files), &files, folder.path(), &ReadOptions::default(), None);
    let path = folder.write("campaign.toml", &proposal.campaign_toml);
    let campaign =
        read_toml(&path).unwrap_or_else(|error| panic!("{error}\n{}", proposal.campaign_toml));
    (proposal.campaign_toml, campaign)
}

/// Returns quantities and columns, `-` before those that are negated, the unit after if one is
/// stated.
fn mapped(campaign: &CampaignFile) -> BTreeMap<String, String> {
    let entry = |(quantity, channel): (&String, &ChannelEntry)| {
        let ChannelEntry { column, unit, negate, .. } = channel;
        let unit = unit.as_ref().map(|unit| format!(" [{unit}]")).unwrap_or_default();
        (quantity.clone(), format!("{}{column}{unit}", if *negate { "-" } else { "" }))
    };
    campaign.channels.iter().map(entry).collect()
}

fn expect(campaign: &CampaignFile, expected: &[(&str, &str)]) {
    let owned = |(quantity, column): &(&str, &str)| ((*quantity).to_owned(), (*column).to_owned());
    assert_eq!(mapped(campaign), expected.iter().map(owned).collect());
}

#[test]
fn an_imu_is_turned_from_rep_103_to_ours() {
    let (text, campaign) = proposed(&[("/imu/data", "sensor_msgs/msg/Imu", &imu)]);
    expect(
        &campaign,
        &[
            ("attitude.roll", "/imu/data/orientation.roll"),
            ("attitude.pitch", "-/imu/data/orientation.pitch"),
            ("attitude.heading", "-/imu/data/orientation.yaw"),
            ("rate.roll", "/imu/data/angular_velocity.x"),
            ("rate.pitch", "-/imu/data/angular_velocity.y"),
            ("rate.yaw", "-/imu/data/angular_velocity.z"),
            // Nothing measures velocity.
            ("acceleration.x", "/imu/data/linear_acceleration.x"),
            ("acceleration.y", "-/imu/data/linear_acceleration.y"),
            ("acceleration.z", "-/imu/data/linear_acceleration.z"),
        ],
    );
    let quaternion = "\"/imu/data/orientation.x\", \"/imu/data/orientation.y\", \
                      \"/imu/data/orientation.z\", \"/imu/data/orientation.w\": of a quaternion";
    assert!(text.contains(quaternion), "{text}");
}

#[test]
fn odometry_has_its_pose_in_the_world_and_its_twist_on_the_body() {
    let topic = "/mavros/local_position/odom";
    let (_, campaign) = proposed(&[
        (topic, "nav_msgs/msg/Odometry", &odometry),
        ("/mavros/imu/data", "sensor_msgs/msg/Imu", &imu),
        ("/mavros/local_position/velocity_local", "geometry_msgs/msg/TwistStamped", &twist),
        ("/cmd_vel", "geometry_msgs/msg/TwistStamped", &twist),
    ]);
    let of = |field: &str| format!("{topic}/{field}");
    expect(
        &campaign,
        &[
            // North and east turn with the heading of the same message.
            ("attitude.roll", &of("pose.pose.orientation.roll")),
            ("attitude.pitch", &format!("-{}", of("pose.pose.orientation.pitch"))),
            ("attitude.heading", &format!("-{}", of("pose.pose.orientation.yaw"))),
            ("position.north", &of("pose.pose.position.x")),
            ("position.east", &format!("-{}", of("pose.pose.position.y"))),
            ("position.down", &format!("-{}", of("pose.pose.position.z"))),
            ("velocity.surge", &of("twist.twist.linear.x")),
            ("velocity.sway", &format!("-{}", of("twist.twist.linear.y"))),
            ("velocity.heave", &format!("-{}", of("twist.twist.linear.z"))),
            ("rate.roll", "/mavros/imu/data/angular_velocity.x"),
            ("rate.pitch", "-/mavros/imu/data/angular_velocity.y"),
            ("rate.yaw", "-/mavros/imu/data/angular_velocity.z"),
        ],
    );
}

#[test]
fn a_dvl_goes_before_a_filter() {
    let (text, campaign) = proposed(&[
        ("/odometry", "nav_msgs/msg/Odometry", &odometry),
        ("/dvl/twist", "geometry_msgs/msg/TwistStamped", &twist),
    ]);
    let found = mapped(&campaign);
    assert_eq!(found["dvl.velocity.x"], "/dvl/twist/twist.linear.x");
    assert_eq!(found["dvl.velocity.y"], "-/dvl/twist/twist.linear.y");
    assert_eq!(found["dvl.velocity.z"], "-/dvl/twist/twist.linear.z");
    assert!(!found.contains_key("velocity.surge"), "{text}");
    assert!(text.contains("of a filter, which smooths and lags"), "{text}");
    assert!(text.contains("decide: y to port and z up"), "{text}");
}

#[test]
fn velocities_along_the_worlds_axes_are_named_and_left() {
    let topic = "/mavros/local_position/velocity_local";
    let (text, campaign) = proposed(&[(topic, "geometry_msgs/msg/TwistStamped", &twist)]);
    expect(&campaign, &[]);
    assert!(text.contains(&format!("\"{topic}/twist.linear.x\"")), "{text}");
    assert!(text.contains("a velocity along the world's axes"), "{text}");
}

#[test]
fn each_thruster_may_have_a_topic() {
    let rest = |_: f64| numbers(&[0.0]);
    let works = |t: f64| numbers(&[0.8 * t.sin()]);
    let (_, campaign) = proposed(&[
        ("/rov/thrusters/0/input", "std_msgs/msg/Float64", &works),
        ("/rov/thrusters/1/input", "std_msgs/msg/Float64", &rest),
    ]);
    expect(
        &campaign,
        &[
            ("thruster.thruster 0.command", "/rov/thrusters/0/input/data [1]"),
            ("thruster.thruster 1.command", "/rov/thrusters/1/input/data [1]"),
        ],
    );
}

#[test]
fn a_thruster_in_no_known_unit_is_requested() {
    let works = |t: f64| numbers(&[80.0 * t.sin()]);
    let (text, campaign) = proposed(&[("/thruster_1/cmd", "std_msgs/msg/Float64", &works)]);
    expect(&campaign, &[]);
    let question = "column \"/thruster_1/cmd/data\": a thruster's input, it seems, whose unit cannot be inferred";
    assert!(text.contains(question), "{text}");
}

#[test]
fn outputs_of_mavros_are_motors_and_the_pilots_channels_are_none() {
    let pulses = |t: f64| {
        let works = (1500.0 + 80.0 * t.sin()) as u16;
        let channels = [works, 1500, 0].map(u16::to_le_bytes).concat();
        [header(t), 3_u32.to_le_bytes().to_vec(), channels].concat()
    };
    let (text, campaign) = proposed(&[("/mavros/rc/out", "mavros_msgs/msg/RCOut", &pulses)]);
    expect(
        &campaign,
        &[
            ("thruster.motor 1.pwm", "/mavros/rc/out/channels[0]"),
            ("thruster.motor 2.pwm", "/mavros/rc/out/channels[1]"),
        ],
    );
    assert!(text.contains("does this output drive that motor?"), "{text}");
    assert!(text.contains("\"/mavros/rc/out/channels[2]\": an output that is not used"), "{text}");
}

#[test]
fn a_wrench_of_all_thrusters_is_a_wrench() {
    let wrench = |t: f64| [header(t), numbers(&moving(t, 6))].concat();
    let topic = "/thruster_manager/input";
    let (_, campaign) = proposed(&[(topic, "geometry_msgs/msg/WrenchStamped", &wrench)]);
    let of = |field: &str| format!("{topic}/wrench.{field}");
    expect(
        &campaign,
        &[
            ("wrench.surge", &of("force.x")),
            ("wrench.sway", &format!("-{}", of("force.y"))),
            ("wrench.heave", &format!("-{}", of("force.z"))),
            ("wrench.roll", &of("torque.x")),
            ("wrench.pitch", &format!("-{}", of("torque.y"))),
            ("wrench.yaw", &format!("-{}", of("torque.z"))),
        ],
    );
}
