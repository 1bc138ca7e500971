//! Mistakes that pairs of instruments show without forces: angles and rates, depth and velocity;
//! and a rotated velocity sensor on a vehicle without lateral force.

use super::Mistake;
use super::angles;
use super::change::Change;
use super::units::{self, What};
use crate::trial::Logged;
use crate::{Dof, Quantity, Sensors};

/// Interval over which two measurements of one motion are compared, s.
const SPAN_S: f64 = 5.0;

/// Least squared correlation of two measurements of one motion.
const ALIKE: f64 = 0.8;

/// Least number of intervals.
const LEAST_SPANS: usize = 12;

/// Finds the mistakes that instruments show without forces; `right` are axes with velocities that
/// forces explain.
pub(super) fn mistakes(logs: &[&Logged], sensors: &Sensors, right: &[Dof]) -> Vec<Mistake> {
    let of_angles = angles::mistake(logs, right);
    let of_depth = depth_beside_velocity(logs, right);
    of_angles.into_iter().chain(of_depth).chain(turned(logs, sensors)).collect()
}

/// Returns the ratio of the second motion to the first, if they are correlated.
fn ratio(pairs: &[(f64, f64)]) -> Option<f64> {
    if pairs.len() < LEAST_SPANS {
        return None;
    }
    let n = pairs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let sum =
        |of: &dyn Fn(f64, f64) -> f64| -> f64 { pairs.iter().map(|(a, b)| of(a - x, b - y)).sum() };
    let (xx, xy, yy) = (sum(&|a, _| a * a), sum(&|a, b| a * b), sum(&|_, b| b * b));
    (xy * xy > ALIKE * xx * yy && xx > 0.0).then_some(xy.signum() * (yy / xx).sqrt())
}

/// Returns, for each interval of all trials, the integral of a velocity and the change of a
/// position.
fn moved(
    logs: &[&Logged],
    of: impl Fn(&Logged) -> Option<(Vec<f64>, &Vec<f64>)>,
) -> Vec<(f64, f64)> {
    let mut pairs = Vec::new();
    for log in logs {
        let Some((velocity, position)) = of(log) else { continue };
        let length = (SPAN_S / log.grid.period_s) as usize;
        for from in (0..log.grid.len.saturating_sub(length)).step_by(length) {
            let to = from + length;
            if log.is_whole[from..=to].iter().all(|x| *x) {
                let ends = 0.5 * (velocity[from] + velocity[to]);
                let way = velocity[from + 1..to].iter().sum::<f64>() + ends;
                pairs.push((way * log.grid.period_s, position[to] - position[from]));
            }
        }
    }
    pairs
}

/// Finds depth that moves in another direction, or by another factor, than vertical velocity.
fn depth_beside_velocity(logs: &[&Logged], right: &[Dof]) -> Option<Mistake> {
    let source = logs.iter().find_map(|log| log.source[Dof::Heave.index()].clone())?;
    if matches!(source, Quantity::Depth) {
        return None;
    }
    let source = source.to_string();
    let is_right = right.contains(&Dof::Heave);
    let message = contradiction(depth_by_velocity(logs)?, is_right, &source)?;
    Some(Mistake { axes: vec![Dof::Heave], message, thrusters: None })
}

/// Returns how many times as far depth moves as vertical velocity says.
fn depth_by_velocity(logs: &[&Logged]) -> Option<f64> {
    ratio(&moved(logs, |log| Some((down(log)?, log.depth.as_ref()?))))
}

/// Finds units of depth or vertical velocity that contradict each other. Where one of both readings makes the
/// heave mass of the plant impossible for a vehicle of that mass in air, depth is the one that is wrong, which
/// harms no plant.
pub(super) fn unit_of_velocity(
    logs: &[&Logged],
    heave_kg: Option<f64>,
    dry_kg: Option<f64>,
) -> Option<Mistake> {
    let times = depth_by_velocity(logs)?.abs();
    let is_depth = heave_kg.zip(dry_kg).is_some_and(|(mass, dry)| {
        units::is_usual(mass, dry) && !units::is_usual(mass / times, dry)
    });
    let is_unit = (times - 1.0).abs() > units::NEAR;
    depth_beside_velocity(logs, &[]).filter(|_| is_unit && !is_depth)
}

/// Returns downward velocity in the world's frame: `−u sin θ + (v sin φ + w cos φ) cos θ`.
fn down(log: &Logged) -> Option<Vec<f64>> {
    let heave = log.velocity[Dof::Heave.index()].as_ref()?;
    let at = |series: &Option<Vec<f64>>, k: usize| series.as_ref().map_or(0.0, |x| x[k]);
    let downward = |(k, w): (usize, &f64)| {
        let [roll, pitch] = [0, 1].map(|which| at(&log.angles[which], k));
        let [u, v] = [Dof::Surge, Dof::Sway].map(|dof| at(&log.velocity[dof.index()], k));
        (v * roll.sin() + w * roll.cos()) * pitch.cos() - u * pitch.sin()
    };
    Some(heave.iter().enumerate().map(downward).collect())
}

/// Formats the mistake if depth moves `times` as far as a velocity, which may be known to be right.
fn contradiction(times: f64, is_right: bool, velocity: &str) -> Option<String> {
    let head = format!("depth moves {times:.3} times as far as {velocity} says");
    if (-1.0 - units::NEAR..-1.0 + units::NEAR).contains(&times) {
        let (which, channels) = match is_right {
            true => ("depth looks reversed (it is positive down)", "\"depth\"".to_owned()),
            false => ("one of the two looks reversed", format!("\"depth\" or for \"{velocity}\"")),
        };
        return Some(format!(
            "{head}: {which}; in campaign.toml set `negate = true` for {channels} under [channels] (if it is set, remove it)"
        ));
    }
    let size = times.abs();
    let mut readings: Vec<String> = Vec::new();
    let mut add = |unit: Option<&str>, of: &dyn Fn(&str) -> String| readings.extend(unit.map(of));
    add(What::Length.unit_of(size), &|unit| format!("\"depth\" is in {unit}"));
    add(What::Velocity.unit_of(size), &|unit| {
        format!("\"{velocity}\" is in m/s and read as {unit}")
    });
    add(What::Velocity.unit_of(1.0 / size), &|unit| format!("\"{velocity}\" is in {unit}"));
    add(What::Length.unit_of(1.0 / size), &|unit| format!("\"depth\" is in m and read as {unit}"));
    let sign = if times < 0.0 { ", and one of the two is reversed (`negate`)" } else { "" };
    (!readings.is_empty()).then(|| {
        format!(
            "{head}: its unit looks wrong, as if {}{sign}; in campaign.toml correct `unit` under [channels]",
            readings.join(", or ")
        )
    })
}

/// Mounting angle that surge alone cannot reveal, as it only scales it, deg.
const MOUNT_DEG: f64 = 45.0;
const NEAR_MOUNT_DEG: f64 = 8.0;

/// Largest share of the variance of velocity across its principal direction.
const ACROSS: f64 = 0.02;

/// Finds a velocity along a line at an angle to the bow, without lateral force.
fn turned(logs: &[&Logged], sensors: &Sensors) -> Option<Mistake> {
    let is_pushed = |log: &&Logged| {
        let side = Dof::Sway.index();
        let ahead = Dof::Surge.index();
        let acts = |axis: usize| {
            log.wrench[axis].as_ref().is_some_and(|x| x.iter().any(|x| *x != 0.0))
                || log.thrusters.iter().any(|thruster| thruster.wrench[axis] != 0.0)
        };
        acts(ahead) && !acts(side)
    };
    if !logs.iter().all(is_pushed) {
        return None;
    }
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    for log in logs {
        let (Some(u), Some(v)) = (&log.velocity[0], &log.velocity[1]) else { continue };
        let step = (SPAN_S / log.grid.period_s) as usize;
        // Changes of velocity exclude a constant current.
        for k in (step..log.grid.len).filter(|k| log.is_whole[k - step] && log.is_whole[*k]) {
            let (du, dv) = (u[k] - u[k - step], v[k] - v[k - step]);
            (uu, uv, vv) = (uu + du * du, uv + du * dv, vv + dv * dv);
        }
    }
    let half = (0.25 * (uu - vv) * (uu - vv) + uv * uv).sqrt();
    let (most, least) = (0.5 * (uu + vv) + half, 0.5 * (uu + vv) - half);
    let degrees = -0.5 * (2.0 * uv).atan2(uu - vv).to_degrees();
    let mount = MOUNT_DEG.copysign(degrees);
    let is_mount = (degrees - mount).abs() < NEAR_MOUNT_DEG;
    (most > 0.0 && least < ACROSS * most && is_mount).then(|| {
        let change = Change::Turned(mount);
        let message = format!(
            "{}: nothing pushes sideways, and {:.1} % of the changes of horizontal velocity are along one line {:.0}° from ahead; {}",
            change.words(logs),
            100.0 * most / (most + least),
            degrees.abs(),
            change.advice(logs, sensors)
        );
        Mistake { axes: vec![Dof::Surge, Dof::Sway], message, thrusters: None }
    })
}
