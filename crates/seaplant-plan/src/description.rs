//! Formats numbers and manoeuvres.

use std::collections::BTreeMap;

use seaplant::{Dof, spoken};

use crate::manoeuvre::{Kind, Manoeuvre};

/// Formats one line for the deck: `surge, 6 min: multisine of 20 s, −0.6 to 0.7 m/s`.
pub(crate) fn manoeuvre(
    manoeuvre: &Manoeuvre,
    minutes: f64,
    velocity: &BTreeMap<Dof, [f64; 2]>,
) -> String {
    let axes: Vec<&str> = manoeuvre.axes.iter().map(|dof| dof.name()).collect();
    let axes =
        if manoeuvre.kind == Kind::AllAxes { "all axes".to_owned() } else { axes.join(" and ") };
    let range = |(dof, [low, high]): (&Dof, &[f64; 2])| {
        let unit = dof.units().velocity;
        let of = if velocity.len() > 1 { format!("{dof} ") } else { String::new() };
        format!("{of}{} to {} {unit}", spoken(*low), spoken(*high))
    };
    let ranges: Vec<String> = velocity.iter().map(range).collect();
    let how = match manoeuvre.kind {
        Kind::Multisine | Kind::AllAxes => format!("multisine of {} s", spoken(manoeuvre.period_s)),
        Kind::Joystick => "joystick steps, as long one way as the other".to_owned(),
        Kind::Doublet => format!("doublets of {} s", spoken(manoeuvre.period_s)),
        Kind::Zigzag => format!("zigzag of {} s while going ahead", spoken(manoeuvre.period_s)),
        Kind::Circle => "circles, first one way, then the other".to_owned(),
        Kind::Spiral => "spirals, tighter and tighter, both ways".to_owned(),
        Kind::StopAndGo => "ahead until steady, stop, astern until steady, stop".to_owned(),
        Kind::AscentAndDescent => "down until steady, stop, up until steady, stop".to_owned(),
        Kind::Release => "tilt, let go and let it swing out".to_owned(),
        Kind::SinusoidAndJoystick => "a sinusoid and joystick steps".to_owned(),
        Kind::Sweep => format!("sweep of {} s", spoken(manoeuvre.period_s)),
        Kind::HoverWithWeight => format!(
            "hover; the weight of {} N hangs for {half} s and is off for {half} s in turn",
            spoken(manoeuvre.weight.map_or(0.0, |weight| weight.weight_n)),
            half = spoken(0.5 * manoeuvre.period_s)
        ),
        Kind::OpposingThrusters => "thrusters against each other while surging".to_owned(),
    };
    format!("{axes}, {} min: {how}; {}", spoken(minutes), ranges.join(", "))
}
