//! From instrument readings to the velocity and position of the vehicle's origin.
//!
//! Frames: north-east-down in the world, forward-starboard-down on the body.
//! An attitude turns body vectors into world ones: `R = R_z(heading) R_y(pitch) R_x(roll)`.

use std::collections::BTreeMap;

use nalgebra::{Rotation3, Vector3};

use crate::quantity::{Attitude, Axis, World};
use crate::signal::{LowPass, differentiate, differentiate_timed, resample};
use crate::{Caveat, CaveatCode, Dof, Error, Grid, Quantity, Sensors, Timed};

/// What one trial's instruments and thrusters said, in SI units and radians.
pub type Recording = BTreeMap<Quantity, Timed>;

/// A velocity, or the position whose derivative it is.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Measured as velocity.
    Velocity(Timed),
    /// Measured as position; velocity is its derivative.
    Position(Timed),
}

/// How the vehicle's origin moved, in body axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Navigated {
    /// Velocity as an instrument measures it, corrected for how it sits.
    pub measured: BTreeMap<Dof, Timed>,
    /// Velocity by way of navigated position.
    pub by_position: BTreeMap<Dof, Motion>,
    /// Positions along a degree of freedom that were measured themselves:
    /// depth (heave), roll, pitch and unwrapped heading (yaw).
    pub position: BTreeMap<Dof, Timed>,
    /// Angular velocity `[p, q, r]` of the body, rad/s, where rates or attitude were logged.
    pub rates: Option<[Timed; 3]>,
    /// World-fixed displacement `[north, east, down]` since the start, m.
    pub displacement_ned: Option<[Timed; 3]>,
    /// What navigation had to do without.
    pub caveats: Vec<Caveat>,
}

/// Angular rates for the lever arm are read off the attitude below this frequency:
/// above it they are mostly the attitude sensor's noise.
const RATE_FILTER: LowPass = LowPass { cutoff_hz: 1.0, order: 2 };

/// Attitude as it varies with time; an angle that was not logged is zero.
struct AttitudeRecord {
    roll: Option<Timed>,
    pitch: Option<Timed>,
    heading: Option<Timed>,
    sensor_to_body: Rotation3<f64>,
}

impl AttitudeRecord {
    fn of(recording: &Recording, sensors: &Sensors) -> Self {
        let angle = |which| recording.get(&Quantity::Attitude(which)).map(unwrap);
        Self {
            roll: angle(Attitude::Roll),
            pitch: angle(Attitude::Pitch),
            heading: angle(Attitude::Heading),
            sensor_to_body: sensors.attitude.to_body(),
        }
    }

    fn parts(&self) -> [&Option<Timed>; 3] {
        [&self.roll, &self.pitch, &self.heading]
    }

    fn is_empty(&self) -> bool {
        self.parts().iter().all(|part| part.is_none())
    }

    /// Body to world.
    fn at(&self, t_s: f64) -> Rotation3<f64> {
        let [roll, pitch, heading] =
            self.parts().map(|angle| angle.as_ref().map_or(0.0, |angle| angle.at(t_s)));
        Rotation3::from_euler_angles(roll, pitch, heading) * self.sensor_to_body.inverse()
    }

    /// Angular velocity of the body in body axes, rad/s, on the times of the
    /// attitude channel with most samples; `None` without attitude.
    fn body_rates(&self) -> Result<Option<[Timed; 3]>, Error> {
        let longest = self.parts().into_iter().flatten().max_by_key(|angle| angle.len());
        let Some(longest) = longest.filter(|angle| angle.len() > 2) else { return Ok(None) };
        let grid = Grid::spanning(longest.first_s(), longest.last_s(), longest.period_s());
        let mut angles: [Vec<f64>; 3] = Default::default();
        let mut slopes: [Vec<f64>; 3] = Default::default();
        for (k, angle) in self.parts().into_iter().enumerate() {
            let x = match angle {
                Some(angle) => smooth_if_possible(resample(angle, grid)?, grid.period_s),
                None => vec![0.0; grid.len],
            };
            let believed = believed_part(angle.as_ref(), &x, grid.period_s)?;
            slopes[k] =
                differentiate(&x, grid.period_s)?.iter().map(|slope| believed * slope).collect();
            angles[k] = x;
        }
        let mut rates: [Vec<f64>; 3] = Default::default();
        for k in 0..grid.len {
            let (roll, pitch) = (angles[0][k], angles[1][k]);
            let (roll_slope, pitch_slope, heading_slope) =
                (slopes[0][k], slopes[1][k], slopes[2][k]);
            let sensor = Vector3::new(
                roll_slope - heading_slope * pitch.sin(),
                pitch_slope * roll.cos() + heading_slope * pitch.cos() * roll.sin(),
                -pitch_slope * roll.sin() + heading_slope * pitch.cos() * roll.cos(),
            );
            let body = self.sensor_to_body * sensor;
            rates.iter_mut().zip(body.iter()).for_each(|(rate, x)| rate.push(*x));
        }
        let [p, q, r] = rates.map(|rate| Timed::on_grid("angular rate", grid, rate));
        Ok(Some([p?, q?, r?]))
    }
}

/// The part of a smoothed angle's slope that is motion and not the sensor's noise:
/// `1 − (noise / slope)²` of root mean squares, Wiener's gain.
///
/// A vehicle that hardly turns would else be given the attitude sensor's noise times its
/// lever arm as velocity. Noise of one sample is read off third differences, whose
/// variance is 20 σ²; smoothed and differentiated it is
/// `2π σ f_c^{3/2} √(2 h ∫ x²/(1+x⁴)² dx)`, with the integral π√2/16.
fn believed_part(angle: Option<&Timed>, smooth: &[f64], period_s: f64) -> Result<f64, Error> {
    use std::f64::consts::{PI, SQRT_2};
    let Some(angle) = angle else { return Ok(0.0) };
    let mean_square = |x: &mut dyn Iterator<Item = f64>| {
        let (sum, n) = x.fold((0.0, 0_usize), |(sum, n), x| (sum + x * x, n + 1));
        sum / n.max(1) as f64
    };
    let thirds = angle.values().windows(4).map(|y| y[3] - 3.0 * y[2] + 3.0 * y[1] - y[0]);
    let sample = mean_square(&mut { thirds }) / 20.0;
    let passed = 2.0 * PI * RATE_FILTER.cutoff_hz.powf(1.5);
    let noise = sample * passed * passed * 2.0 * period_s * PI * SQRT_2 / 16.0;
    let slope = mean_square(&mut differentiate(smooth, period_s)?.into_iter());
    Ok(if slope > noise { 1.0 - noise / slope } else { 0.0 })
}

fn smooth_if_possible(x: Vec<f64>, period_s: f64) -> Vec<f64> {
    RATE_FILTER.zero_phase(&x, 1.0 / period_s).unwrap_or(x)
}

/// Removes the jumps of whole turns from an angle, rad.
///
/// ```
/// use seaplant::{Timed, navigation::unwrap};
/// let heading = Timed::new("heading", vec![0.0, 1.0, 2.0], vec![6.2, 0.1, 0.3])?;
/// assert!((unwrap(&heading).values()[1] - (0.1 + 2.0 * std::f64::consts::PI)).abs() < 1e-12);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn unwrap(angle: &Timed) -> Timed {
    use std::f64::consts::TAU;
    let mut turns = 0.0;
    let mut before = angle.values()[0];
    let unwrapped = angle.values().iter().map(|&x| {
        turns -= ((x - before) / TAU).round();
        before = x;
        x + turns * TAU
    });
    let unwrapped = unwrapped.collect();
    // Finite angles stay finite, and the times are the same.
    angle.with_values("angle", unwrapped).unwrap_or_else(|_| angle.clone())
}

/// Finds how the vehicle's origin moved.
///
/// `v_origin = R_bs v_dvl − ω × r_dvl`; depth of the origin = depth − (R r_depth)_z;
/// displacement integrates R v_origin by the trapezoidal rule.
///
/// Without rates ω is the derivative of the attitude; without attitude the vehicle is
/// taken as level and still, and a caveat says so if an instrument has a lever arm.
///
/// # Errors
/// [`Error::MissingChannel`] if a misaligned DVL lacks an axis that is needed;
/// [`Error::TooShort`] for a channel with fewer than two samples.
///
/// # Source
/// [Jason2, §3]; \[Kinsey2004\]: Doppler navigation in six degrees of freedom.
pub fn navigate(trial: &str, recording: &Recording, sensors: &Sensors) -> Result<Navigated, Error> {
    let mut nav = Navigated::default();
    let attitude = AttitudeRecord::of(recording, sensors);
    let rates = rates(recording, &attitude)?;

    for (dof, angle) in [Dof::Roll, Dof::Pitch, Dof::Yaw].into_iter().zip(attitude.parts()) {
        if let Some(angle) = angle {
            nav.position.insert(dof, angle.clone());
            nav.by_position.insert(dof, Motion::Position(angle.clone()));
        }
        if let Some(rate) = recording.get(&Quantity::Rate(axis_of(dof))) {
            nav.measured.insert(dof, rate.clone());
        }
    }
    dvl_at_origin(trial, recording, sensors, rates.as_ref(), &mut nav)?;
    for dof in Dof::ALL {
        if let Some(velocity) = recording.get(&Quantity::Velocity(dof)) {
            nav.measured.insert(dof, velocity.clone());
        }
    }
    depth_of_origin(recording, sensors, &attitude, &mut nav);
    world_position(recording, sensors, &attitude, &mut nav)?;
    nav.rates = rates;
    Ok(nav)
}

fn axis_of(dof: Dof) -> Axis {
    match dof {
        Dof::Surge | Dof::Roll => Axis::X,
        Dof::Sway | Dof::Pitch => Axis::Y,
        Dof::Heave | Dof::Yaw => Axis::Z,
    }
}

const AXES: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];
const TRANSLATIONS: [Dof; 3] = [Dof::Surge, Dof::Sway, Dof::Heave];

/// Measured rates where there are any, else those of the attitude.
fn rates(recording: &Recording, attitude: &AttitudeRecord) -> Result<Option<[Timed; 3]>, Error> {
    let measured = AXES.map(|axis| recording.get(&Quantity::Rate(axis)));
    let Some(base) = measured.iter().flatten().max_by_key(|rate| rate.len()) else {
        return attitude.body_rates();
    };
    let still = base.map(|_| 0.0);
    Ok(Some(measured.map(|rate| rate.unwrap_or(&still).clone())))
}

fn dvl_at_origin(
    trial: &str,
    recording: &Recording,
    sensors: &Sensors,
    rates: Option<&[Timed; 3]>,
    nav: &mut Navigated,
) -> Result<(), Error> {
    let beams = AXES.map(|axis| recording.get(&Quantity::DvlVelocity(axis)));
    if beams.iter().all(Option::is_none) {
        return Ok(());
    }
    let r_bs = sensors.dvl.to_body();
    let lever = sensors.dvl.position_body;
    if lever.norm() > 0.0 && rates.is_none() {
        let message = "the DVL has a lever arm but the log has neither attitude nor rates: the vehicle's turning is taken as zero and leaks into its velocity; map attitude.heading or rate.yaw";
        nav.caveats.push(Caveat::warning(CaveatCode::Navigation, message));
    }
    for (row, dof) in TRANSLATIONS.into_iter().enumerate() {
        let needs = |column: usize| r_bs[(row, column)].abs() > 1e-9;
        let needed: Vec<usize> = (0..3).filter(|&column| needs(column)).collect();
        if beams[row].is_none() && needed == [row] {
            continue;
        }
        let mut parts = Vec::with_capacity(needed.len());
        for &column in &needed {
            let Some(beam) = beams[column] else {
                return Err(Error::MissingChannel {
                    trial: trial.to_owned(),
                    what: Quantity::DvlVelocity(AXES[column]).to_string(),
                    advice: format!(
                        "the DVL is mounted at an angle, so that {dof} needs it; map it, or correct [sensor.dvl] rotation_deg"
                    ),
                });
            };
            parts.push((r_bs[(row, column)], beam));
        }
        let instrument = weighted_sum(&parts)?;
        let turning = |t: f64| {
            let omega = rates.map_or_else(Vector3::zeros, |rates| {
                Vector3::from_iterator(rates.iter().map(|rate| rate.at(t)))
            });
            omega.cross(&lever)[row]
        };
        let at_origin = instrument
            .time_s()
            .iter()
            .zip(instrument.values())
            .map(|(&t, v)| if lever.norm() > 0.0 { v - turning(t) } else { *v })
            .collect();
        nav.measured.insert(dof, instrument.with_values("DVL velocity", at_origin)?);
    }
    Ok(())
}

/// Σ weight · series, at the times that all have; where they share none, at the
/// first one's times with the others interpolated.
fn weighted_sum(parts: &[(f64, &Timed)]) -> Result<Timed, Error> {
    let first = parts[0].1;
    let shared: Vec<f64> = first
        .time_s()
        .iter()
        .copied()
        .filter(|t| {
            parts.iter().all(|(_, x)| x.time_s().binary_search_by(|u| u.total_cmp(t)).is_ok())
        })
        .collect();
    let times = if shared.is_empty() { first.time_s().to_vec() } else { shared };
    let values = times.iter().map(|&t| parts.iter().map(|(w, x)| w * x.at(t)).sum());
    let values: Vec<f64> = values.collect();
    Timed::new("DVL velocity", times, values)
}

fn depth_of_origin(
    recording: &Recording,
    sensors: &Sensors,
    attitude: &AttitudeRecord,
    nav: &mut Navigated,
) {
    let Some(depth) =
        recording.get(&Quantity::Depth).or_else(|| recording.get(&Quantity::Position(World::Down)))
    else {
        return;
    };
    let lever = if recording.contains_key(&Quantity::Depth) {
        sensors.depth.position_body
    } else {
        sensors.position.position_body
    };
    let below = |t: f64| (attitude.at(t) * lever).z;
    let values =
        depth.time_s().iter().zip(depth.values()).map(|(&t, z)| z - below(t)).collect::<Vec<_>>();
    // Finite readings less a bounded lever are finite, and the times are the same.
    let origin = depth.with_values("depth", values).unwrap_or_else(|_| depth.clone());
    nav.position.insert(Dof::Heave, origin.clone());
    nav.by_position.insert(Dof::Heave, Motion::Position(origin));
}

/// Displacement by dead reckoning, or as positioned, and the velocity that follows from it.
fn world_position(
    recording: &Recording,
    sensors: &Sensors,
    attitude: &AttitudeRecord,
    nav: &mut Navigated,
) -> Result<(), Error> {
    let position = |way| recording.get(&Quantity::Position(way));
    let positioned = position(World::North).zip(position(World::East));
    let displacement = match positioned {
        Some((north, east)) => {
            if attitude.heading.is_none() {
                let message = "position is logged without heading: north is taken as forward; map attitude.heading";
                nav.caveats.push(Caveat::warning(CaveatCode::Navigation, message));
            }
            Some(position_of_origin(north, east, sensors, attitude)?)
        }
        None => dead_reckon(&nav.measured, attitude)?,
    };
    let Some(displacement) = displacement else { return Ok(()) };
    let ned = [
        differentiate_timed(&displacement[0])?,
        differentiate_timed(&displacement[1])?,
        differentiate_timed(&displacement[2])?,
    ];
    let body: Vec<Vector3<f64>> = ned[0]
        .time_s()
        .iter()
        .enumerate()
        .map(|(k, &t)| {
            let world = Vector3::from_iterator(ned.iter().map(|v| v.values()[k]));
            attitude.at(t).inverse() * world
        })
        .collect();
    for (row, dof) in TRANSLATIONS.into_iter().enumerate() {
        let known = positioned.is_some() && dof != Dof::Heave || nav.measured.contains_key(&dof);
        if known && !nav.by_position.contains_key(&dof) {
            let velocity =
                ned[0].with_values("navigated velocity", body.iter().map(|v| v[row]).collect())?;
            nav.by_position.insert(dof, Motion::Velocity(velocity));
        }
    }
    nav.displacement_ned = Some(displacement);
    Ok(())
}

fn position_of_origin(
    north: &Timed,
    east: &Timed,
    sensors: &Sensors,
    attitude: &AttitudeRecord,
) -> Result<[Timed; 3], Error> {
    let lever = sensors.position.position_body;
    let (mut n, mut e) = (Vec::with_capacity(north.len()), Vec::with_capacity(north.len()));
    for (&t, x) in north.time_s().iter().zip(north.values()) {
        let offset = attitude.at(t) * lever;
        n.push(x - offset.x);
        e.push(east.at(t) - offset.y);
    }
    Ok([
        north.with_values("position north", n)?,
        north.with_values("position east", e)?,
        north.map(|_| 0.0),
    ])
}

/// Integrates body velocity to world-fixed displacement, `p(t) = ∫ R v dt`.
///
/// Translations that were not measured count as zero. `None` if none was.
fn dead_reckon(
    velocity: &BTreeMap<Dof, Timed>,
    attitude: &AttitudeRecord,
) -> Result<Option<[Timed; 3]>, Error> {
    let parts = TRANSLATIONS.map(|dof| velocity.get(&dof));
    let Some(base) = parts.iter().flatten().max_by_key(|part| part.len()) else { return Ok(None) };
    if attitude.is_empty() && parts.iter().flatten().count() < 2 {
        // One axis without attitude: displacement along that axis, which needs no frame.
        return Ok(None);
    }
    let world = |t: f64| {
        attitude.at(t)
            * Vector3::from_iterator(parts.iter().map(|part| part.map_or(0.0, |part| part.at(t))))
    };
    let mut displacement = [Vec::new(), Vec::new(), Vec::new()];
    let mut reached = Vector3::zeros();
    let mut before: Option<(f64, Vector3<f64>)> = None;
    for &t in base.time_s() {
        let v = world(t);
        if let Some((t_before, v_before)) = before {
            reached += 0.5 * (t - t_before) * (v + v_before);
        }
        before = Some((t, v));
        displacement.iter_mut().zip(reached.iter()).for_each(|(path, x)| path.push(*x));
    }
    let [n, e, d] = displacement.map(|path| base.with_values("displacement", path));
    Ok(Some([n?, e?, d?]))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::Sensor;

    fn every_tenth(n: usize, f: impl Fn(f64) -> f64) -> Timed {
        let t: Vec<f64> = (0..n).map(|k| 0.1 * k as f64).collect();
        let x = t.iter().map(|&t| f(t)).collect::<Vec<_>>();
        Timed::new("test", t, x).expect("valid")
    }

    #[test]
    fn a_dvl_ahead_of_a_turning_vehicle_sees_sway_that_is_not_there() {
        let sensors = Sensors {
            dvl: Sensor { position_body: Vector3::new(0.8, 0.0, 0.0), ..Default::default() },
            ..Default::default()
        };
        let recording = Recording::from([
            (Quantity::Rate(Axis::Z), every_tenth(50, |_| 0.5)),
            (Quantity::DvlVelocity(Axis::X), every_tenth(50, |_| 1.0)),
            // ω × r = (0, 0.5 · 0.8, 0).
            (Quantity::DvlVelocity(Axis::Y), every_tenth(50, |_| 0.4)),
        ]);
        let nav = navigate("turn", &recording, &sensors).expect("complete");
        assert!(nav.measured[&Dof::Sway].values().iter().all(|v| v.abs() < 1e-12));
        assert!(nav.measured[&Dof::Surge].values().iter().all(|v| (v - 1.0).abs() < 1e-12));
    }

    #[test]
    fn rates_follow_from_heading_where_none_are_logged() {
        let sensors = Sensors {
            dvl: Sensor { position_body: Vector3::new(0.8, 0.0, 0.0), ..Default::default() },
            ..Default::default()
        };
        let wrapped = |t: f64| (0.5 * t + 6.0).rem_euclid(2.0 * PI);
        let recording = Recording::from([
            (Quantity::Attitude(Attitude::Heading), every_tenth(100, wrapped)),
            (Quantity::DvlVelocity(Axis::Y), every_tenth(100, |_| 0.4)),
        ]);
        let nav = navigate("turn", &recording, &sensors).expect("complete");
        let sway = nav.measured[&Dof::Sway].values();
        // A ramp passes the rate filter unchanged, two seconds from its edges.
        assert!(sway[20..80].iter().all(|v| v.abs() < 1e-4), "{sway:?}");
    }

    #[test]
    fn a_turned_dvl_without_its_second_axis_is_refused() {
        let sensors = Sensors {
            dvl: Sensor { rotation_rad: [0.0, 0.0, 0.5], ..Default::default() },
            ..Default::default()
        };
        let recording =
            Recording::from([(Quantity::DvlVelocity(Axis::X), every_tenth(50, |_| 1.0))]);
        let message = navigate("t", &recording, &sensors).expect_err("y is missing").to_string();
        assert!(message.contains("dvl.velocity.y"), "{message}");
    }

    #[test]
    fn driving_east_along_a_quarter_circle_ends_north_east() {
        // Heading turns from 0 to 90° while surge is constant: radius = v/r.
        let end = 10.0 * FRAC_PI_2;
        let n = (end / 0.1) as usize + 1;
        let recording = Recording::from([
            (Quantity::Attitude(Attitude::Heading), every_tenth(n, |t| 0.1 * t)),
            (Quantity::Velocity(Dof::Surge), every_tenth(n, |_| 1.0)),
        ]);
        let nav = navigate("arc", &recording, &Sensors::default()).expect("complete");
        let [north, east, down] = nav.displacement_ned.expect("dead reckoned");
        let angle = 0.1 * north.last_s();
        assert!((north.values()[n - 1] - 10.0 * angle.sin()).abs() < 1e-3);
        assert!((east.values()[n - 1] - 10.0 * (1.0 - angle.cos())).abs() < 1e-3);
        assert_eq!(down.values()[n - 1], 0.0);
        // Back in body axes, by way of position, it is surge alone.
        let Motion::Velocity(surge) = &nav.by_position[&Dof::Surge] else { panic!("velocity") };
        assert!((surge.values()[n / 2] - 1.0).abs() < 1e-4);
    }

    #[test]
    fn pitching_about_the_origin_does_not_change_its_depth() {
        let sensors = Sensors {
            depth: Sensor { position_body: Vector3::new(2.0, 0.0, 0.5), ..Default::default() },
            ..Default::default()
        };
        let pitch = |t: f64| 0.2 * t.sin();
        // Bow up lifts a sensor ahead of the origin: depth falls by 2 sin θ.
        let seen = |t: f64| 30.0 - 2.0 * pitch(t).sin() + 0.5 * pitch(t).cos();
        let recording = Recording::from([
            (Quantity::Attitude(Attitude::Pitch), every_tenth(100, pitch)),
            (Quantity::Depth, every_tenth(100, seen)),
        ]);
        let nav = navigate("pitch", &recording, &sensors).expect("complete");
        assert!(nav.position[&Dof::Heave].values().iter().all(|z| (z - 30.0).abs() < 1e-12));
    }
}
