//! Commands as a ROS 2 bag in the MCAP format.

use seaplant::ThrusterInput;

use crate::Error;
use crate::files::{Played, played};
use crate::plan::{Plan, Planned};
use crate::prior::Prior;

/// Opcodes of MCAP records.
const HEADER: u8 = 0x01;
const FOOTER: u8 = 0x02;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const STATISTICS: u8 = 0x0B;
const DATA_END: u8 = 0x0F;
/// First and last bytes of a file.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// The message that carries an input.
const TYPE: &str = "std_msgs/msg/Float64";

/// Writes the commands of a manoeuvre as a ROS 2 bag, which `ros2 bag play` plays: a topic
/// `/thrusters/NAME/KIND` of `std_msgs/msg/Float64` for each thruster, every 0.1 s, with KIND
/// `speed` (rad/s), `pwm` (µs), `command` (−1 to 1) or `force` (N).
///
/// As [`commands_csv`](crate::commands_csv): open loop, and neutral at the end. Time begins at zero.
///
/// # Errors
/// As [`plan`](crate::plan()), for a prior that is not that of the plan.
///
/// # Source
/// MCAP format specification, version 0; definition and encoding of messages as ROS 2 records them
/// (`ros2msg`, CDR in little-endian order).
pub fn commands_bag(prior: &Prior, plan: &Plan, planned: &Planned) -> Result<Vec<u8>, Error> {
    let played = played(prior, plan, planned)?;
    Ok(bag(&played))
}

fn bag(played: &Played) -> Vec<u8> {
    let mut file = MAGIC.to_vec();
    record(&mut file, HEADER, &[text("ros2"), text("seaplant")].concat());
    let schema = [&1_u16.to_le_bytes()[..], &text(TYPE), &text("ros2msg"), &text("float64 data")];
    record(&mut file, SCHEMA, &schema.concat());
    for (k, (name, input)) in played.thrusters.iter().enumerate() {
        let (topic, no_metadata) = (text(&topic(name, *input)), 0_u32.to_le_bytes());
        let ids = [number(k).to_le_bytes(), 1_u16.to_le_bytes()].concat();
        record(&mut file, CHANNEL, &[&ids, &topic, &text("cdr"), &no_metadata[..]].concat());
    }
    let count = played.thrusters.len();
    for (row, t) in played.time_s.iter().enumerate() {
        let time_ns = nanoseconds(*t).to_le_bytes();
        for (k, inputs) in played.inputs.iter().enumerate() {
            let head =
                [&number(k).to_le_bytes()[..], &(row as u32).to_le_bytes(), &time_ns, &time_ns];
            let cdr = [&[0, 1, 0, 0][..], &inputs[row].to_le_bytes()];
            record(&mut file, MESSAGE, &[head.concat(), cdr.concat()].concat());
        }
    }
    record(&mut file, DATA_END, &0_u32.to_le_bytes());
    let summary = file.len() as u64;
    let end = played.time_s.last().copied().unwrap_or(0.0);
    let rows = played.time_s.len() as u64;
    let mut counts = Vec::new();
    for k in 0..count {
        counts.extend(number(k).to_le_bytes());
        counts.extend(rows.to_le_bytes());
    }
    let statistics = [
        &(rows * count as u64).to_le_bytes()[..],
        &1_u16.to_le_bytes(),
        &(count as u32).to_le_bytes(),
        // Attachments, metadata, chunks.
        &[0; 12],
        &0_u64.to_le_bytes(),
        &nanoseconds(end).to_le_bytes(),
        &(counts.len() as u32).to_le_bytes(),
        &counts,
    ];
    record(&mut file, STATISTICS, &statistics.concat());
    // Without an index of the summary and without a checksum.
    let footer = [&summary.to_le_bytes()[..], &0_u64.to_le_bytes(), &0_u32.to_le_bytes()];
    record(&mut file, FOOTER, &footer.concat());
    file.extend(MAGIC);
    file
}

/// Returns the identifier of a channel.
fn number(k: usize) -> u16 {
    k as u16 + 1
}

fn nanoseconds(seconds: f64) -> u64 {
    (1e9 * seconds).round() as u64
}

fn record(file: &mut Vec<u8>, kind: u8, content: &[u8]) {
    file.push(kind);
    file.extend((content.len() as u64).to_le_bytes());
    file.extend(content);
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}

/// Names a topic as ROS permits: letters, digits and underscores, no digit first.
fn topic(name: &str, input: ThrusterInput) -> String {
    let letters = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
    let name: String = letters.collect();
    let first = if name.starts_with(|c: char| c.is_ascii_digit()) { "t" } else { "" };
    format!("/thrusters/{first}{name}/{}", input.name())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_have_names_that_ros_permits() {
        assert_eq!(topic("port bow", ThrusterInput::Pwm), "/thrusters/port_bow/pwm");
        assert_eq!(topic("1", ThrusterInput::Speed), "/thrusters/t1/speed");
    }
}
