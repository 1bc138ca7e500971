//! vehicle.toml, as far as a log tells it.

use seaplant::{Quantity, ThrusterInput};
use seaplant_log::Log;

use super::mapping::{Mapped, Mapping};
use super::write::{Page, quoted};
use crate::inspect::short;

/// The file's text, and what is left to decide.
pub(super) fn write(log: &Log, mapping: &Mapping) -> (String, Vec<String>) {
    let questions = questions(mapping);
    let mut page = Page::default();
    page.comment("The vehicle, begun from its log. Lines with `measure:` or `decide:` need you.");
    page.list("Still open:", &questions);
    page.line("");
    page.explained("name = \"vehicle\"", "decide: what the report calls it");
    page.explained(
        "# dry_mass_kg = 0.0",
        "measure: mass in air; a fitted mass below it is doubtful",
    );
    thrusters(&mut page, log, mapping);
    sensors(&mut page, mapping);
    (page.text, questions)
}

fn questions(mapping: &Mapping) -> Vec<String> {
    let names: Vec<String> = mapping.thrusters().iter().map(|(name, _)| quoted(name)).collect();
    let mut found = vec!["give name, and dry_mass_kg if it is known".to_owned()];
    if !names.is_empty() {
        found.push(format!(
            "give position_m, direction and curve of each thruster ({}), or delete those that no trial uses",
            names.join(", ")
        ));
    } else if !mapping.has(|quantity| matches!(quantity, Quantity::Wrench(_))) {
        found.push(
            "no column looks like a thruster's; add a [[thruster]] for each, and map it in campaign.toml"
                .to_owned(),
        );
    }
    let placed = |quantity: &Quantity| {
        matches!(
            quantity,
            Quantity::DvlVelocity(_)
                | Quantity::Depth
                | Quantity::Position(_)
                | Quantity::Attitude(_)
        )
    };
    if mapping.has(placed) {
        found.push("give where the sensors sit, if not at the origin and aligned".to_owned());
    }
    found
}

fn thrusters(page: &mut Page, log: &Log, mapping: &Mapping) {
    let thrusters = mapping.thrusters();
    if thrusters.is_empty() {
        return;
    }
    page.line("");
    page.comment("Thrusters. Take the `#` from the three lines of each and fill them in:");
    page.comment("  position_m   from the vehicle's origin, m: x forward, y starboard, z down");
    page.comment(
        "  direction    the way that positive input pushes the vehicle: [1.0, 0.0, 0.0] is",
    );
    page.comment("               forward, [0.0, 1.0, 0.0] to starboard, [0.0, 0.0, 1.0] down");
    page.comment("  curve        from input to thrust in N, one of");
    for example in curves(thrusters[0].1) {
        page.comment(&format!("    {example}"));
    }
    page.comment(
        "`seaplant thruster TABLE` fits the numbers of a quadratic curve to bollard-pull data.",
    );
    for (name, mapped) in &thrusters {
        page.line("");
        page.line("[[thruster]]");
        let code = format!("name = {}", quoted(name));
        page.explained(&code, &format!("column {}", seen(log, mapping, mapped)));
        page.explained("# position_m = [x, y, z]", "measure: m from the origin");
        page.explained("# direction = [0.0, 0.0, 0.0]", "decide: which way it pushes");
        page.explained(&format!("# {}", likely_curve(mapped)), "measure: its thrust");
    }
}

/// The column and the range of its values in all sessions.
fn seen(log: &Log, mapping: &Mapping, mapped: &Mapped) -> String {
    let all = mapping.sessions.iter().flatten();
    let same = all.filter(|other| other.quantity() == mapped.quantity());
    let ends = same.filter_map(|other| {
        let channel = &log.channels()[other.channel];
        channel.min().zip(channel.max())
    });
    let fold = |(low, high): (f64, f64), (min, max): (f64, f64)| (low.min(min), high.max(max));
    let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), fold);
    let column = quoted(&mapped.address);
    if low == high {
        return format!("{column}, always {}: delete it if no trial uses it", short(low));
    }
    format!("{column}, {} to {}", short(low), short(high))
}

fn input_of(mapped: &Mapped) -> ThrusterInput {
    match mapped.quantity() {
        Quantity::Thruster { input, .. } => *input,
        _ => ThrusterInput::Force,
    }
}

fn likely_curve(mapped: &Mapped) -> &'static str {
    match input_of(mapped) {
        ThrusterInput::Speed => "curve = { kind = \"quadratic\", forward = 0.0, reverse = 0.0 }",
        ThrusterInput::Pwm => {
            "curve = { kind = \"table\", input = \"pwm\", file = \"bollard-pull.csv\" }"
        }
        ThrusterInput::Command => {
            "curve = { kind = \"table\", input = \"command\", file = \"bollard-pull.csv\" }"
        }
        // Its thrust is logged; the curve must stand, and is not read.
        ThrusterInput::Force => "curve = { kind = \"quadratic\", forward = 1.0, reverse = 1.0 }",
    }
}

/// Three ways to write a curve for such an input.
fn curves(mapped: &Mapped) -> [String; 3] {
    let (input, unit, points) = match input_of(mapped) {
        ThrusterInput::Pwm => ("pwm", "us from 1500", "[1100, F1], [1500, 0], [1900, F2]"),
        ThrusterInput::Command => ("command", "", "[-1, F1], [0, 0], [1, F2]"),
        ThrusterInput::Speed | ThrusterInput::Force => {
            ("speed", "rad/s", "[-100, F1], [0, 0], [100, F2]")
        }
    };
    let per = if unit.is_empty() { "N".to_owned() } else { format!("N/({unit})²") };
    [
        format!("curve = {{ kind = \"table\", input = \"{input}\", file = \"bollard-pull.csv\" }}"),
        format!("curve = {{ kind = \"table\", input = \"{input}\", points = [{points}] }}"),
        format!(
            "curve = {{ kind = \"quadratic\", input = \"{input}\", forward = K1, reverse = K2 }}   ({per})"
        ),
    ]
}

fn sensors(page: &mut Page, mapping: &Mapping) {
    let has = |wanted: fn(&Quantity) -> bool| mapping.has(wanted);
    let dvl = has(|quantity| matches!(quantity, Quantity::DvlVelocity(_)));
    let depth = has(|quantity| matches!(quantity, Quantity::Depth));
    let attitude = has(|quantity| matches!(quantity, Quantity::Attitude(_)));
    let position = has(|quantity| matches!(quantity, Quantity::Position(_)));
    let place = "# position_m = [0.0, 0.0, 0.0]";
    let turned = "# rotation_deg = [0.0, 0.0, 0.0]";
    let turned_why = "measure: roll, pitch, yaw from the vehicle's axes to its own";
    let origin = "measure: m from the origin; at the origin if left out";
    if dvl || depth || attitude || position {
        page.line("");
        page.comment("Sensors. What is left out is 0: at the origin, aligned.");
    }
    if dvl {
        page.line("\n[sensor.dvl]");
        page.explained(place, origin);
        page.explained(turned, turned_why);
    }
    if depth {
        page.line("\n[sensor.depth]");
        page.explained(place, origin);
    }
    if attitude {
        page.line("\n[sensor.attitude]");
        page.explained(turned, turned_why);
    }
    if position {
        page.line("\n[sensor.position]");
        page.explained(place, origin);
    }
}
