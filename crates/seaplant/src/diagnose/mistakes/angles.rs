//! Mistakes of angles and angular velocities, by kinematics.

use super::Mistake;
use crate::trial::Logged;
use crate::{Dof, Quantity};

/// Channels of roll, pitch and heading; and the axes of angular velocities.
const ANGLES: [&str; 3] = ["attitude.roll", "attitude.pitch", "attitude.heading"];
const TURNS: [Dof; 3] = [Dof::Roll, Dof::Pitch, Dof::Yaw];

/// A candidate mistake: the factors that correct the logged angles and rates.
struct Candidate {
    angles: [f64; 3],
    rates: [f64; 3],
    /// Its description, for named channels.
    what: &'static str,
}

const DEG: f64 = 57.295_779_513;

const SIGNS: &str = "reversed";
const CANDIDATES: [Candidate; 15] = [
    Candidate { angles: [1.0, 1.0, -1.0], rates: [1.0; 3], what: SIGNS },
    Candidate { angles: [1.0; 3], rates: [1.0, 1.0, -1.0], what: SIGNS },
    Candidate { angles: [1.0, -1.0, 1.0], rates: [1.0; 3], what: SIGNS },
    Candidate { angles: [1.0; 3], rates: [1.0, -1.0, 1.0], what: SIGNS },
    Candidate { angles: [-1.0, 1.0, 1.0], rates: [1.0; 3], what: SIGNS },
    Candidate { angles: [1.0; 3], rates: [-1.0, 1.0, 1.0], what: SIGNS },
    // Forward, port, up.
    Candidate { angles: [1.0, -1.0, -1.0], rates: [1.0; 3], what: SIGNS },
    Candidate { angles: [1.0; 3], rates: [1.0, -1.0, -1.0], what: SIGNS },
    Candidate {
        angles: [1.0 / DEG, 1.0 / DEG, 1.0],
        rates: [1.0; 3],
        what: "in deg and read as rad",
    },
    Candidate { angles: [1.0, 1.0, 1.0 / DEG], rates: [1.0; 3], what: "in deg and read as rad" },
    Candidate { angles: [1.0 / DEG; 3], rates: [1.0; 3], what: "in deg and read as rad" },
    Candidate { angles: [DEG, DEG, 1.0], rates: [1.0; 3], what: "in rad and read as deg" },
    Candidate { angles: [DEG; 3], rates: [1.0; 3], what: "in rad and read as deg" },
    Candidate { angles: [1.0; 3], rates: [1.0 / DEG; 3], what: "in deg/s and read as rad/s" },
    Candidate { angles: [1.0; 3], rates: [DEG; 3], what: "in rad/s and read as deg/s" },
];

const AS_IS: Candidate = Candidate { angles: [1.0; 3], rates: [1.0; 3], what: "" };

/// Interval over which changes of angles are compared, s, and the least number of intervals.
const SPAN_S: f64 = 5.0;
const LEAST_SPANS: usize = 12;

/// Share of the changes of angles, averaged, that correct rates explain at least: sensors with
/// errors of a tenth and lags explain 0.95 …
const RIGHT: f64 = 0.8;
/// … and least increase over the log as it is: one of three angles is a third.
const MORE: f64 = 0.25;

/// Candidates within this share of the best are reported with it.
const AS_GOOD: f64 = 0.02;

/// Finds the mistake without which rates explain angles far better; `right` are axes with rates
/// that forces explain.
pub(super) fn mistake(logs: &[&Logged], right: &[Dof]) -> Option<Mistake> {
    let as_is = explained(logs, &AS_IS)?;
    let mut tried: Vec<(f64, &Candidate)> = Vec::new();
    for one in &CANDIDATES {
        let channels = changes(one, logs);
        let is_same =
            |other: &Candidate| other.what == one.what && changes(other, logs) == channels;
        if !channels.is_empty() && !tried.iter().any(|(_, other)| is_same(other)) {
            tried.extend(explained(logs, one).map(|part| (part, one)));
        }
    }
    tried.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best = tried.first()?.0;
    if best < RIGHT || best < as_is + MORE {
        return None;
    }
    let mut alike: Vec<&Candidate> =
        tried.iter().filter(|(x, _)| *x > best - AS_GOOD).map(|(_, one)| *one).collect();
    // A rate that thrust explains has the correct sign, so that its angle has the wrong one.
    let is_of_right = |one: &&Candidate| {
        let is_right = |axis: usize| one.rates[axis] != 1.0 && right.contains(&TURNS[axis]);
        one.what == SIGNS && (0..3).any(is_right)
    };
    if !alike.iter().all(is_of_right) {
        alike.retain(|one| !is_of_right(one));
    }
    alike.truncate(2);
    let said = |one: &&Candidate| {
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
    Some(Mistake { axes: TURNS.to_vec(), message, thrusters: None })
}

/// Returns the logged channels that a candidate changes.
fn changes(one: &Candidate, logs: &[&Logged]) -> Vec<String> {
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

/// Returns the share of the changes of angles over intervals that rates explain, averaged over the
/// angles with a rate, each at least zero.
///
/// `φ̇ = p + (q sin φ + r cos φ) tan θ`, `θ̇ = q cos φ − r sin φ`, `ψ̇ = (q sin φ + r cos φ) / cos θ`
/// [Fossen2021, eq. 2.38].
fn explained(logs: &[&Logged], one: &Candidate) -> Option<f64> {
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
