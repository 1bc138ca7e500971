//! Reasons to doubt a plant of a vehicle that is under way: of what its turns, its drift and its
//! rudders tell.

use super::Records;
use crate::caveat::spoken;
use crate::judge::range;
use crate::plant::Signal;
use crate::results::{PlantResult, ToldBy};
use crate::signal::rms;
use crate::{Caveat, CaveatCode, Dof, Fin, TrialRecord, Vehicle};

/// Slower than this a vehicle has no way on, m/s.
const UNDER_WAY: f64 = 0.1;

/// All of them.
pub(super) fn doubts(plant: &PlantResult, records: &Records<'_>, vehicle: &Vehicle) -> Vec<Caveat> {
    let mut all = Vec::new();
    all.extend(munk(plant, &records.fit));
    all.extend(one_speed(plant, &records.fit));
    all.extend(free_scale(plant, &records.fit));
    all.extend(drift_beyond(plant, records));
    all.extend(vehicle.fins.iter().filter_map(|fin| beyond_limit(fin, &records.fit)));
    all.extend(vehicle.fins.iter().filter_map(|fin| at_limit(fin, &records.fit)));
    all
}

/// Drift of more than this part of the speed makes a moment.
const DRIFTS: f64 = 0.02;

/// Munk's moment, `(m22 − m11) u v`, needs surge and sway where yaw is.
fn munk(plant: &PlantResult, records: &[&TrialRecord]) -> Option<Caveat> {
    let has = |dof| plant.axes.contains(&dof);
    let lacks: Vec<&str> =
        [Dof::Surge, Dof::Sway].into_iter().filter(|dof| !has(*dof)).map(Dof::name).collect();
    if !has(Dof::Yaw) || lacks.is_empty() {
        return None;
    }
    let (ahead, side) = (speed(records, Dof::Surge)?, speed(records, Dof::Sway)?);
    (ahead > UNDER_WAY && side > DRIFTS * ahead).then(|| {
        let message = format!(
            "{} is not among the plant's axes, but the vehicle drifts while it is under way ({} m/s sideways, {} m/s ahead): its yaw inertia and damping include part of Munk's moment, (m22 - m11) u v; fit surge, sway and yaw together",
            lacks.join(" and "),
            spoken(side),
            spoken(ahead)
        );
        Caveat::warning(CaveatCode::MunkMoment, message)
    })
}

/// Its root mean square, where it is known.
fn speed(records: &[&TrialRecord], dof: Dof) -> Option<f64> {
    let known = records.iter().filter_map(|record| record.velocity[dof.index()].as_ref());
    let mut values = known.flat_map(|series| series.values()).peekable();
    values.peek()?;
    Some(rms(values))
}

/// Speeds within this part of the greatest are one speed.
const ONE_SPEED_PART: f64 = 0.25;

/// Turns at one speed tell no term from the same one times u.
fn one_speed(plant: &PlantResult, records: &[&TrialRecord]) -> Option<Caveat> {
    let turns = [Dof::Surge, Dof::Yaw].iter().all(|dof| plant.axes.contains(dof));
    let of_surge = records.iter().filter_map(|record| record.velocity[0].as_ref());
    let mut speeds: Vec<f64> = of_surge.flat_map(|series| series.values()).copied().collect();
    speeds.sort_by(f64::total_cmp);
    let at = |part: f64| speeds.get((part * speeds.len() as f64) as usize).copied();
    let (low, high) = (at(0.05)?, at(0.95)?);
    (turns && low > UNDER_WAY && high - low < ONE_SPEED_PART * high).then(|| {
        let message = format!(
            "the trials turn at one speed, {} to {} m/s: what grows with speed cannot be separated from what does not (r and ur, v and uv, resistance and thrust, the mass in surge from Y_r); drive the same manoeuvres at half and at full speed, too",
            spoken(low),
            spoken(high)
        );
        Caveat::warning(CaveatCode::OneSpeed, message)
    })
}

/// Where only rudders of unknown lift steer, and hull forces hold `ur`, nothing but the rudder's
/// own drag ties the forces of sway and yaw to those of surge.
fn free_scale(plant: &PlantResult, records: &[&TrialRecord]) -> Option<Caveat> {
    let is_free =
        |name: &str| plant.parameters.get(name).is_some_and(|x| x.told_by == ToldBy::Data);
    let takes_scale = is_free("sway: Ur") || is_free("sway: ur");
    let is_pushed = |dof: Dof| records.iter().any(|record| record.is_driven(dof));
    let lifts: Vec<&String> =
        plant.parameters.keys().filter(|name| name.ends_with(".lift")).collect();
    let is_known = lifts.is_empty() || lifts.iter().any(|name| !is_free(name));
    if !takes_scale || is_known || is_pushed(Dof::Yaw) || is_pushed(Dof::Sway) {
        return None;
    }
    let message = format!(
        "no force of known size acts in sway and yaw: masses and damping there are proportional to `{}`, which is determined only by the drag and the position of the deflected rudder; what the hull and the propeller race do to the rudder biases the yaw inertia; predicted motion is not affected; state area_m2, lift_slope and flow of the rudder before you use single coefficients",
        lifts[0]
    );
    Some(Caveat::warning(CaveatCode::ThrustScale, message))
}

/// Beyond this angle of drift hull forces are those of cross flow, rad.
const FAR_DRIFT: f64 = 0.52;
/// Held-out trials that drift by so much more than those fitted ask for what the plant never saw.
const FURTHER: f64 = 1.25;
/// Drift below this is that of straight ahead, rad.
const SLIGHT: f64 = 0.09;

fn drift_beyond(plant: &PlantResult, records: &Records<'_>) -> Option<Caveat> {
    let planar = [Dof::Surge, Dof::Sway, Dof::Yaw];
    let is_planar = planar.iter().all(|dof| plant.axes.contains(dof));
    if !is_planar || records.fit.iter().any(|record| is_pushed_sideways(record)) {
        return None;
    }
    let greatest = |records: &[&TrialRecord]| {
        records.iter().map(|record| greatest_drift(record)).fold(0.0, f64::max)
    };
    let (fitted, held) = (greatest(&records.fit), greatest(&records.hold_out));
    if fitted > FAR_DRIFT {
        let message = format!(
            "the trials drift by up to {:.0}°, where forces across the hull are no longer polynomials of sway and yaw rate near straight motion; trust the plant at the angles of its trials, and add model = \"mmg\", or terms such as \"sway: |v|r\" or \"yaw: |v|r\", if errors there matter",
            fitted.to_degrees()
        );
        return Some(Caveat::note(CaveatCode::DriftBeyond, message));
    }
    (held > FURTHER * fitted.max(SLIGHT)).then(|| {
        let message = format!(
            "held-out trials drift by up to {:.0}°, and those that were fitted by up to {:.0}°: their errors are those of extrapolation; fit a trial that turns as tightly",
            held.to_degrees(),
            fitted.to_degrees()
        );
        Caveat::note(CaveatCode::DriftBeyond, message)
    })
}

/// Whether a vehicle has thrusters that move it sideways: it is not one that goes straight ahead.
fn is_pushed_sideways(record: &TrialRecord) -> bool {
    let greatest = |dof: Dof| {
        let force = record.force[dof.index()].as_ref();
        force.map_or(0.0, |force| force.values().iter().fold(0.0, |most: f64, x| most.max(x.abs())))
    };
    greatest(Dof::Sway) > SIDEWAYS_PART * greatest(Dof::Surge)
}

/// A force in sway of more than this part of that in surge is no error of alignment.
const SIDEWAYS_PART: f64 = 0.2;

fn greatest_drift(record: &TrialRecord) -> f64 {
    drifts(record).into_iter().fold(0.0, |most, drift| most.max(drift.abs()))
}

/// Drift angles of a record under way, rad.
fn drifts(record: &TrialRecord) -> Vec<f64> {
    let [Some(surge), Some(sway), ..] = &record.velocity else { return Vec::new() };
    let under_way = surge.time_s().iter().zip(surge.values()).filter(|(_, u)| **u > UNDER_WAY);
    under_way.map(|(&t, &u)| sway.at(t).atan2(u)).collect()
}

/// The drift angles under way of a vehicle that nothing pushes sideways, deg: a range that holds 95 % of
/// them.
pub(super) fn drift_angles(record: &TrialRecord) -> Option<[f64; 2]> {
    let angles = range(&drifts(record)).filter(|_| !is_pushed_sideways(record))?;
    Some(angles.map(f64::to_degrees))
}

/// The angles of a rudder or fin in all trials, rad.
fn angles<'a>(fin: &Fin, records: &'a [&TrialRecord]) -> impl Iterator<Item = f64> + 'a {
    let signal = Signal::Angle { kind: fin.kind, name: fin.name.clone() };
    let logged = records.iter().filter_map(move |record| record.signals.get(&signal));
    logged.flat_map(|series| series.values()).map(|x| x.abs())
}

/// An angle beyond the limit by more than this is no rounding.
const OVER: f64 = 1.02;

/// What is logged beyond a limit is an order.
fn beyond_limit(fin: &Fin, records: &[&TrialRecord]) -> Option<Caveat> {
    let limit = fin.limit_rad?;
    let greatest = angles(fin, records).fold(0.0, f64::max);
    (greatest > OVER * limit).then(|| {
        let message = format!(
            "`{}` is logged at up to {:.1}° and turns no further than {:.1}°: the log holds commands that it does not follow, so that its lift is estimated too low; log the measured angle, or limit the commands",
            fin.name,
            greatest.to_degrees(),
            limit.to_degrees()
        );
        Caveat::warning(CaveatCode::RudderSaturated, message)
    })
}

/// A rudder lies at an angle when it is within this part of it.
const AT_LIMIT: f64 = 0.98;
/// Most of the time.
const MOSTLY: f64 = 0.5;

/// A rudder that is hard over most of the time tells one force.
fn at_limit(fin: &Fin, records: &[&TrialRecord]) -> Option<Caveat> {
    let (what, angle) = match (fin.stall_rad, fin.limit_rad) {
        (Some(stall), limit) if limit.is_none_or(|limit| stall < limit) => {
            ("beyond its stall", stall)
        }
        (_, limit) => ("at its limit", limit?),
    };
    let (mut there, mut all) = (0_usize, 0_usize);
    for x in angles(fin, records) {
        there += usize::from(x > AT_LIMIT * angle);
        all += 1;
    }
    (there as f64 > MOSTLY * all as f64).then(|| {
        let message = format!(
            "`{}` lies {what} ({:.0}°) for {:.0} % of the trials: they determine its force there, but neither how that grows with the angle nor the hull's own forces; add zigzags and turns at smaller angles",
            fin.name,
            angle.to_degrees(),
            100.0 * there as f64 / all as f64
        );
        Caveat::warning(CaveatCode::RudderSaturated, message)
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::{Surface, Timed};

    fn record(velocity: [&dyn Fn(f64) -> f64; 2], rudder: impl Fn(f64) -> f64) -> TrialRecord {
        let times: Vec<f64> = (0..400).map(|k| 0.5 * f64::from(k)).collect();
        let of = |f: &dyn Fn(f64) -> f64| {
            let values: Vec<f64> = times.iter().map(|t| f(*t)).collect();
            Timed::new("log", times.clone(), values).expect("valid")
        };
        let angle = Signal::Angle { kind: Surface::Rudder, name: "rudder".to_owned() };
        TrialRecord {
            velocity: [Some(of(velocity[0])), Some(of(velocity[1])), None, None, None, None],
            signals: BTreeMap::from([(angle, of(&rudder))]),
            ..TrialRecord::until("turns", 199.0)
        }
    }

    fn rudder(limit_deg: f64, stall_deg: Option<f64>) -> Fin {
        let fin = Fin::new(Surface::Rudder, "rudder", [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
        Fin {
            limit_rad: Some(limit_deg.to_radians()),
            stall_rad: stall_deg.map(f64::to_radians),
            ..fin.expect("a rudder")
        }
    }

    #[test]
    fn an_order_beyond_the_limit_is_told_from_an_angle() {
        let hard = record([&|_| 1.0, &|_| 0.0], |t| 0.7 * (0.1 * t).sin());
        let caveat = beyond_limit(&rudder(35.0, None), &[&hard]).expect("40 degrees");
        assert!(caveat.message.contains("35.0°"), "{}", caveat.message);
        assert!(beyond_limit(&rudder(45.0, None), &[&hard]).is_none());
    }

    #[test]
    fn a_rudder_hard_over_tells_one_force() {
        let hard = record([&|_| 1.0, &|_| 0.0], |t| 0.61 * (0.1 * t).sin().signum());
        assert!(at_limit(&rudder(35.0, None), &[&hard]).is_some());
        assert!(at_limit(&rudder(60.0, None), &[&hard]).is_none());
        let stalled = at_limit(&rudder(60.0, Some(20.0)), &[&hard]).expect("35 beyond 20");
        assert!(stalled.message.contains("beyond its stall"), "{}", stalled.message);
    }

    #[test]
    fn drift_is_looked_for_where_there_is_way() {
        let turning = record([&|_| 1.0, &|t| -0.7 * (0.05 * t).sin()], |_| 0.0);
        assert!((greatest_drift(&turning) - 0.7_f64.atan()).abs() < 1e-3);
        let idle = record([&|_| 0.05, &|_| 0.3], |_| 0.0);
        assert_eq!(greatest_drift(&idle), 0.0);
    }

    #[test]
    fn a_vehicle_whose_thrusters_push_it_sideways_may_drift() {
        let pushed = |sway: f64| {
            let mut record = record([&|_| 1.0, &|_| 0.0], |_| 0.0);
            let held = |x: f64| Timed::new("force", vec![0.0, 199.0], vec![x, -x]).ok();
            (record.force[0], record.force[1]) = (held(100.0), held(sway));
            is_pushed_sideways(&record)
        };
        assert!(pushed(50.0));
        assert!(!pushed(10.0));
        assert!(!is_pushed_sideways(&record([&|_| 1.0, &|_| 0.3], |_| 0.0)));
    }
}
