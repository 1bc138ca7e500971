//! Writes vehicle.toml as far as a log determines it.

use seaplant::{Quantity, Surface, ThrusterInput};
use seaplant_log::{Channel, Log};

use super::write::{Page, quoted};
use crate::columns::{self, Mapped, Mapping};
use crate::preset::VehiclePreset;
use crate::remarks::short;

/// Returns the file's text, and the decisions left to the user.
pub(super) fn write(
    log: &Log,
    mapping: &Mapping,
    stated: Option<VehiclePreset>,
) -> (String, Vec<String>) {
    let preset = stated.or_else(|| vehicle(log, mapping));
    let source = match stated {
        Some(_) => "as --preset says; its thrusters sit where the preset has them",
        None => "decide: by ArduSub's FRAME_CONFIG; is it this vehicle?",
    };
    let mut questions = questions(mapping, preset, stated.is_some());
    questions.extend(preset.and_then(|preset| unmapped(mapping, preset)));
    if preset.is_none() {
        questions.extend(likely_preset(mapping));
    }
    let mut page = Page::default();
    page.comment("A first version of the vehicle, from its log. Lines with `measure:` or `decide:` need you.");
    page.list("Still open:", &questions);
    page.line("");
    match preset {
        Some(preset) => {
            page.explained(&format!("preset = {}", quoted(preset.key())), source);
            known_vehicle(&mut page, log, mapping, preset);
        }
        None => page.explained("name = \"vehicle\"", "decide: its name in the report"),
    }
    page.explained(
        "# dry_mass_kg = 0.0",
        "measure: mass in air; a fitted mass below it is doubtful",
    );
    match preset {
        Some(preset) => reversed_thrusters(&mut page, log, preset),
        None => thrusters(&mut page, log, mapping),
    }
    surfaces(&mut page, mapping);
    sensors(&mut page, mapping);
    (page.text, questions)
}

/// Writes the name, the thrusters and their curve for a known vehicle.
fn known_vehicle(page: &mut Page, log: &Log, mapping: &Mapping, preset: VehiclePreset) {
    page.explained(&format!("name = {}", quoted(preset.title())), "decide: its name in the report");
    let supply = mapping.all().into_iter().find(|m| *m.quantity() == Quantity::SupplyVoltage);
    let typical = supply.and_then(|mapped| typical_voltage(&log.channels()[mapped.channel]));
    let (voltage, why) = match (typical, supply) {
        (Some(voltage), Some(mapped)) => {
            (voltage, format!("the median of {}, rounded", quoted(&mapped.address)))
        }
        _ => (16.0, "measure: the supply voltage under load".to_owned()),
    };
    let curve = format!(
        "thruster_curve = {{ kind = \"preset\", name = \"t200\", voltage_v = {voltage:?} }}"
    );
    page.explained(&curve, &format!("{why}; by the logged one if it is left out"));
}

/// Returns the median voltage, to half a volt, if the curve was measured at it.
fn typical_voltage(channel: &Channel) -> Option<f64> {
    let unit = channel.unit.as_ref()?;
    let mut values = channel.values().to_vec();
    let middle = values.len() / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let volts = (2.0 * unit.to_si(*median)).round() / 2.0;
    (10.0..=20.0).contains(&volts).then_some(volts)
}

/// Writes the motors that the autopilot reverses.
fn reversed_thrusters(page: &mut Page, log: &Log, preset: VehiclePreset) {
    page.line("");
    page.comment(
        "Thrusters sit and push as the preset has them, in ArduSub's order. measure: where",
    );
    page.comment(
        "yours sit, and state it: a [[thruster]] of the same name with position_m = [x, y, z],",
    );
    page.comment(
        "m from the origin: x forward, y starboard, z down. decide: which way each pushes. A",
    );
    page.comment(
        "thruster whose propeller is of the other hand has its strong side at pulses below",
    );
    page.comment("1500 us; then give it a curve of its own.");
    for thruster in preset.thrusters() {
        if columns::is_reversed(log, thruster.name) {
            page.line("");
            page.line("[[thruster]]");
            page.line(&format!("name = {}", quoted(thruster.name)));
            page.explained("reversed = true", "the autopilot reverses its input");
        }
    }
}

/// Describes thrusters of the preset without a column of their name.
fn unmapped(mapping: &Mapping, preset: VehiclePreset) -> Option<String> {
    let mapped: Vec<&str> = mapping.thrusters().into_iter().map(|(name, _)| name).collect();
    let known = preset.thrusters();
    let missing: Vec<&str> =
        known.iter().map(|of| of.name).filter(|name| !mapped.contains(name)).collect();
    let others: Vec<String> = mapped
        .iter()
        .filter(|name| known.iter().all(|of| of.name != **name))
        .map(|name| quoted(name))
        .collect();
    let renamed = if others.is_empty() {
        String::new()
    } else {
        format!("; columns were mapped to {}, which the preset does not have", others.join(", "))
    };
    (!missing.is_empty()).then(|| {
        format!(
            "the preset's thrusters are called {}: map the column of each under [channels] of campaign.toml, as \"thruster.{}.pwm\"{renamed}",
            missing.join(", "),
            missing[0]
        )
    })
}

/// Returns a preset with as many motors as the log has.
fn likely_preset(mapping: &Mapping) -> Option<String> {
    let pulses =
        mapping.thrusters().into_iter().filter(|(_, of)| input_of(of) == ThrusterInput::Pwm);
    let count = pulses.count();
    let same = VehiclePreset::ALL.into_iter().find(|preset| preset.thrusters().len() == count)?;
    Some(format!(
        "{count} motors: if this is a {}, run `seaplant init` again with --preset {}",
        same.title(),
        same.key()
    ))
}

fn questions(mapping: &Mapping, preset: Option<VehiclePreset>, is_stated: bool) -> Vec<String> {
    let names: Vec<String> = mapping.thrusters().iter().map(|(name, _)| quoted(name)).collect();
    let mut found = vec!["give name, and dry_mass_kg if it is known".to_owned()];
    if let Some(preset) = preset {
        let is_it = if is_stated { String::new() } else { format!("is it a {}? ", preset.title()) };
        found.push(format!("{is_it}its thrusters sit where the preset has them: measure yours"));
    } else if !names.is_empty() {
        found.push(format!(
            "give position_m, direction and curve of each thruster ({}), or delete those that no trial uses, here and under [channels] of campaign.toml",
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
                | Quantity::Attitude(_)
                | Quantity::Acceleration(_)
        ) || is_of_receiver(quantity)
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
    page.comment("Thrusters. Remove the `#` from the three lines of each and fill them in:");
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

/// Writes rudders and fins.
fn surfaces(page: &mut Page, mapping: &Mapping) {
    for mapped in mapping.all() {
        let Quantity::SurfaceAngle { kind, name } = mapped.quantity() else { continue };
        page.line("");
        page.line(&format!("[[{}]]", kind.name()));
        let code = format!("name = {}", quoted(name));
        page.explained(&code, &format!("column {}", quoted(&mapped.address)));
        page.explained("position_m = [0.0, 0.0, 0.0]", "measure: m from the origin, x forward");
        let axis = match kind {
            Surface::Rudder => "axis = [0.0, 0.0, -1.0]",
            Surface::Fin => "axis = [0.0, 1.0, 0.0]",
        };
        page.explained(axis, "decide: a positive angle turns its leading edge about this");
        page.explained("# slipstream = \"propeller\"", "decide: the thruster ahead of it");
    }
}

/// Returns the column and the range of its values in all sessions.
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
        return format!(
            "{column}, always {}: delete it, here and in campaign.toml, if no trial uses it",
            short(low)
        );
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
        // The thrust itself is logged; the curve is required but not used.
        ThrusterInput::Force => "curve = { kind = \"quadratic\", forward = 1.0, reverse = 1.0 }",
    }
}

/// Returns three examples of a curve for such an input.
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

/// Returns whether a satellite antenna or another positioning system measures it.
pub(super) fn is_of_receiver(quantity: &Quantity) -> bool {
    matches!(
        quantity,
        Quantity::Position(_)
            | Quantity::Latitude
            | Quantity::Longitude
            | Quantity::WorldVelocity(_)
            | Quantity::GroundSpeed
            | Quantity::GroundCourse
    )
}

fn sensors(page: &mut Page, mapping: &Mapping) {
    let has = |wanted: fn(&Quantity) -> bool| mapping.has(wanted);
    let dvl = has(|quantity| matches!(quantity, Quantity::DvlVelocity(_)));
    let depth = has(|quantity| matches!(quantity, Quantity::Depth));
    let attitude = has(|quantity| matches!(quantity, Quantity::Attitude(_)));
    let position = has(is_of_receiver);
    let imu = has(|quantity| matches!(quantity, Quantity::Acceleration(_)));
    let place = "# position_m = [0.0, 0.0, 0.0]";
    let turned = "# rotation_deg = [0.0, 0.0, 0.0]";
    let turned_why = "measure: roll, pitch, yaw from the vehicle's axes to its own";
    let origin = "measure: m from the origin; at the origin if left out";
    if dvl || depth || attitude || position || imu {
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
    if imu {
        page.line("\n[sensor.imu]");
        page.explained(place, origin);
        page.explained(turned, turned_why);
        page.explained("# averages = true", "if each sample is the mean since the one before");
    }
}

/// Returns the known vehicle, if any of its motors is mapped.
fn vehicle(log: &Log, mapping: &Mapping) -> Option<VehiclePreset> {
    let preset = columns::preset(log)?;
    let has = |name: &str| preset.thrusters().iter().any(|thruster| thruster.name == name);
    mapping.thrusters().iter().any(|(name, _)| has(name)).then_some(preset)
}
