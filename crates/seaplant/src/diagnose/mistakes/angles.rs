//! Mistakes of angles and rates of turn, by how rates turn angles.

use super::Mistake;
use crate::trial::Logged;
use crate::{Dof, Quantity};

/// Roll, pitch, heading; and the rates about the body's axes.
const ANGLES: [&str; 3] = ["attitude.roll", "attitude.pitch", "attitude.heading"];
const TURNS: [Dof; 3] = [Dof::Roll, Dof::Pitch, Dof::Yaw];

/// A mistake: by what the logged angles and rates are to be multiplied to be right.
struct Try {
    angles: [f64; 3],
    rates: [f64; 3],
    /// What it is, of channels named.
    what: &'static str,
}

const DEG: f64 = 57.295_779_513;

const SIGNS: &str = "reversed";
const TRIES: [Try; 15] = [
    Try { angles: [1.0, 1.0, -1.0], rates: [1.0; 3], what: SIGNS },
    Try { angles: [1.0; 3], rates: [1.0, 1.0, -1.0], what: SIGNS },
    Try { angles: [1.0, -1.0, 1.0], rates: [1.0; 3], what: SIGNS },
    Try { angles: [1.0; 3], rates: [1.0, -1.0, 1.0], what: SIGNS },
    Try { angles: [-1.0, 1.0, 1.0], rates: [1.0; 3], what: SIGNS },
    Try { angles: [1.0; 3], rates: [-1.0, 1.0, 1.0], what: SIGNS },
    // Forward, port, up.
    Try { angles: [1.0, -1.0, -1.0], rates: [1.0; 3], what: SIGNS },
    Try { angles: [1.0; 3], rates: [1.0, -1.0, -1.0], what: SIGNS },
    Try { angles: [1.0 / DEG, 1.0 / DEG, 1.0], rates: [1.0; 3], what: "in deg and read as rad" },
    Try { angles: [1.0, 1.0, 1.0 / DEG], rates: [1.0; 3], what: "in deg and read as rad" },
    Try { angles: [1.0 / DEG; 3], rates: [1.0; 3], what: "in deg and read as rad" },
    Try { angles: [DEG, DEG, 1.0], rates: [1.0; 3], what: "in rad and read as deg" },
    Try { angles: [DEG; 3], rates: [1.0; 3], what: "in rad and read as deg" },
    Try { angles: [1.0; 3], rates: [1.0 / DEG; 3], what: "in deg/s and read as rad/s" },
    Try { angles: [1.0; 3], rates: [DEG; 3], what: "in rad/s and read as deg/s" },
];

const AS_IS: Try = Try { angles: [1.0; 3], rates: [1.0; 3], what: "" };

/// Spans over which turns are compared, s, and how many are needed.
const SPAN_S: f64 = 5.0;
const LEAST_SPANS: usize = 12;

/// Rates that are right explain this part of how angles change, all of them averaged: sensors that
/// are off by a tenth and lag explain 0.95 …
const RIGHT: f64 = 0.8;
/// … and more than the log as it is by this: one of three angles is a third.
const MORE: f64 = 0.25;

/// Tries within this part of the best are named with it.
const AS_GOOD: f64 = 0.02;

/// The mistake under which rates explain angles far better; `right` are axes whose rate forces explain.
pub(super) fn mistake(logs: &[&Logged], right: &[Dof]) -> Option<Mistake> {
    let as_is = explained(logs, &AS_IS)?;
    let mut tried: Vec<(f64, &Try)> = Vec::new();
    for one in &TRIES {
        let channels = changes(one, logs);
        let is_same = |other: &Try| other.what == one.what && changes(other, logs) == channels;
        if !channels.is_empty() && !tried.iter().any(|(_, other)| is_same(other)) {
            tried.extend(explained(logs, one).map(|part| (part, one)));
        }
    }
    tried.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best = tried.first()?.0;
    if best < RIGHT || best < as_is + MORE {
        return None;
    }
    let mut alike: Vec<&Try> =
        tried.iter().filter(|(x, _)| *x > best - AS_GOOD).map(|(_, one)| *one).collect();
    // The sign of a rate that thrust explains is right, and that of its angle is not.
    let is_of_right = |one: &&Try| {
        let is_right = |axis: usize| one.rates[axis] != 1.0 && right.contains(&TURNS[axis]);
        one.what == SIGNS && (0..3).any(is_right)
    };
    if !alike.iter().all(is_of_right) {
        alike.retain(|one| !is_of_right(one));
    }
    alike.truncate(2);
    let said = |one: &&Try| {
        let channels = changes(one, logs);
        let verb = if channels.len() > 1 { "look" } else { "looks" };
        let line = match one.what {
            SIGNS => "set `negate = true` there under [channels] (if it is set, remove it)",
            _ => "correct the `unit` under [channels]",
        };
        format!("{} {verb} {}: in campaign.toml {line}", channels.join(", "), one.what)
    };
    let said: Vec<String> = alike.iter().map(said).collect();
    let message = format!(
        "{}; if so, rates explain {:.0} % of the changes of roll, pitch and heading in place of {:.0} %",
        said.join("; or "),
        100.0 * best,
        100.0 * as_is.max(0.0)
    );
    Some(Mistake { axes: TURNS.to_vec(), message })
}

/// The channels that a try changes, of those that are logged.
fn changes(one: &Try, logs: &[&Logged]) -> Vec<String> {
    let mut channels = Vec::new();
    for axis in 0..3 {
        if one.angles[axis] != 1.0 && logs.iter().any(|log| log.angles[axis].is_some()) {
            channels.push(ANGLES[axis].to_owned());
        }
        let source = logs.iter().find_map(|log| log.source[TURNS[axis].index()].as_ref());
        match source.filter(|_| one.rates[axis] != 1.0) {
            Some(Quantity::Attitude(_)) | None => {}
            Some(rate) => channels.push(rate.to_string()),
        }
    }
    channels
}

/// The part of the changes of angles over spans that rates explain, averaged over the angles that have
/// a rate; none explains less than nothing.
///
/// `φ̇ = p + (q sin φ + r cos φ) tan θ`, `θ̇ = q cos φ − r sin φ`, `ψ̇ = (q sin φ + r cos φ) / cos θ`
/// [Fossen2021, eq. 2.38].
fn explained(logs: &[&Logged], one: &Try) -> Option<f64> {
    let (mut missed, mut moved, mut spans) = ([0.0; 3], [0.0; 3], 0);
    let has_rate = |axis: usize| {
        let is_rate = |log: &&Logged| {
            let source = log.source[TURNS[axis].index()].as_ref();
            log.angles[axis].is_some()
                && source.is_some_and(|source| !matches!(source, Quantity::Attitude(_)))
        };
        logs.iter().all(is_rate)
    };
    let axes: Vec<usize> = (0..3).filter(|axis| has_rate(*axis)).collect();
    for log in logs {
        let angle = |axis: usize, k: usize| {
            one.angles[axis] * log.angles[axis].as_ref().map_or(0.0, |x| x[k])
        };
        let rate = |axis: usize, k: usize| {
            let rate = log.velocity[TURNS[axis].index()].as_ref();
            one.rates[axis] * rate.map_or(0.0, |x| x[k])
        };
        let turned = |k: usize| {
            let [p, q, r] = [0, 1, 2].map(|axis| rate(axis, k));
            let (sin, cos) = angle(0, k).sin_cos();
            let about = q * sin + r * cos;
            let pitch = angle(1, k);
            [p + about * pitch.tan(), q * cos - r * sin, about / pitch.cos()]
        };
        let length = (SPAN_S / log.grid.period_s) as usize;
        for from in (0..log.grid.len.saturating_sub(length)).step_by(length) {
            let to = from + length;
            if !log.is_whole[from..=to].iter().all(|x| *x) {
                continue;
            }
            spans += 1;
            let ends = [turned(from), turned(to)];
            let inside = (from + 1..to)
                .map(turned)
                .fold([0.0; 3], |sum, own| [sum[0] + own[0], sum[1] + own[1], sum[2] + own[2]]);
            for &axis in &axes {
                let way = inside[axis] + 0.5 * (ends[0][axis] + ends[1][axis]);
                let change = angle(axis, to) - angle(axis, from);
                missed[axis] += (change - way * log.grid.period_s).powi(2);
                moved[axis] += change * change;
            }
        }
    }
    let parts = axes.iter().map(|axis| (1.0 - missed[*axis] / moved[*axis]).clamp(0.0, 1.0));
    let sum: f64 = parts.sum();
    (spans >= LEAST_SPANS && !axes.is_empty() && sum.is_finite()).then(|| sum / axes.len() as f64)
}
