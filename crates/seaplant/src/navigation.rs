//! Conversion of instrument readings to velocity and position of the vehicle's origin.
//!
//! Frames: north-east-down in the world, forward-starboard-down on the body.
//! An attitude rotates body vectors to the world: `R = R_z(heading) R_y(pitch) R_x(roll)`.

mod acceleration;
mod attitude;
mod beside;
mod gravity;
mod ground;
mod gyro;
mod gyro_bias;
mod tilt;
mod track;
mod turns;

use std::collections::BTreeMap;

use nalgebra::Vector3;

pub use acceleration::MeanAcceleration;
pub(crate) use acceleration::MeanOver;
use acceleration::{Accelerometer, Around, LONGEST_MEAN_S};
use attitude::AttitudeRecord;
pub(crate) use attitude::unwrap;
pub use beside::Beside;
use tilt::{heave_path, yaw_path};
use track::Track;

use crate::quantity::{Axis, World};
use crate::series::Reader;
use crate::{Caveat, CaveatCode, Dof, Error, Gap, Quantity, Sensors, Timed};

/// The measurements and thruster inputs of one trial, in SI units and radians.
pub type Recording = BTreeMap<Quantity, Timed>;

/// A motion as measured: as velocity, as position, or as acceleration.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Measured as velocity.
    Velocity(Timed),
    /// Measured as position; velocity is its derivative.
    Position(Timed),
    /// Measured by an accelerometer alone, as [`MeanAcceleration::mean`]; velocity is unknown.
    Acceleration(Timed),
}

/// Motion of the vehicle's origin, in body axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Navigated {
    /// Measured velocity, corrected for the position and alignment of the instrument.
    pub measured: BTreeMap<Dof, Timed>,
    /// Velocity from navigated position.
    pub by_position: BTreeMap<Dof, Motion>,
    /// Acceleration along the translations without a velocity measurement: from [`navigate`], `ν̇ +
    /// ω × v` of the origin, sample by sample.
    pub acceleration: BTreeMap<Dof, MeanAcceleration>,
    /// Measured positions along a degree of freedom: the path along the body's vertical axis from
    /// depth (heave), roll, pitch, and the angle about that axis from heading (yaw).
    pub position: BTreeMap<Dof, Timed>,
    /// Depth of the origin, m, where it was measured.
    pub depth: Option<Timed>,
    /// Measured heading, unwrapped, rad: its slope is the yaw rate of a level vehicle only.
    pub heading: Option<Timed>,
    /// Gaps of heading in which the vehicle may have turned around: headings before and after
    /// differ by an unknown number of turns.
    pub heading_cuts: Vec<Gap>,
    /// Angular velocity `[p, q, r]` of the body, rad/s, where rates or attitude were logged.
    pub rates: Option<[Timed; 3]>,
    /// Lever arms from the vehicle's origin to the instruments that measure translations, m; of
    /// those away from the origin.
    pub levers: BTreeMap<Dof, Vector3<f64>>,
    /// True if surge and sway were measured along the world's axes, and turned by the attitude of their times.
    pub is_turned: bool,
    /// Acceleration `−(ω × v)` of a rigid body along each translation, m/s²; of those whose log has
    /// rates and another velocity.
    pub turning: BTreeMap<Dof, Timed>,
    /// Motion along all axes, including those not requested.
    pub beside: Beside,
    /// World-fixed displacement `[north, east, down]` since the start, m.
    pub displacement_ned: Option<[Timed; 3]>,
    /// Instruments that navigation lacked.
    pub caveats: Vec<Caveat>,
}

impl Navigated {
    /// Returns the lever arm of the instrument that measures a translation, m; none at the origin,
    /// or where it was not corrected for lack of ω.
    pub(crate) fn lever(&self, dof: Dof) -> Option<Vector3<f64>> {
        self.levers.get(&dof).copied().filter(|_| self.rates.is_some())
    }

    /// Returns the readings of this instrument for a given translation of the origin.
    pub(crate) fn readings(&self, dof: Dof, origin: &Timed) -> Option<Timed> {
        let mut turning = Turning::new(self.rates.as_ref(), self.lever(dof)?, dof.index());
        let read = |(t, v): (&f64, &f64)| v + turning.at(*t);
        let read = origin.time_s().iter().zip(origin.values()).map(read).collect();
        origin.with_values("velocity", read).ok()
    }
}

/// Returns ω × r along a body axis, m/s, at the times of the rate with most samples.
pub(crate) fn turning(rates: &[Timed; 3], lever: Vector3<f64>, axis: usize) -> Option<Timed> {
    let mut turning = Turning::new(Some(rates), lever, axis);
    let base = rates.iter().max_by_key(|rate| rate.len())?;
    let values = base.time_s().iter().map(|t| turning.at(*t)).collect();
    base.with_values("what turning adds", values).ok()
}

/// Computes the motion of the vehicle's origin.
///
/// `v_origin = R_bs v_dvl − ω × r_dvl`; depth of the origin = depth − (R r_depth)_z;
/// displacement integrates R v_origin by the trapezoidal rule.
///
/// Without rates ω is the derivative of the attitude; without attitude the vehicle is assumed level
/// and not turning, with a caveat if an instrument has a lever arm.
///
/// # Errors
/// [`Error::MissingChannel`] if a misaligned DVL lacks an axis that is needed;
/// [`Error::TooShort`] for a channel with fewer than two samples.
///
/// # Source
/// [Jason2, §3]; \[Kinsey2004\]: Doppler navigation in six degrees of freedom.
pub fn navigate(trial: &str, recording: &Recording, sensors: &Sensors) -> Result<Navigated, Error> {
    let navigation = Navigation::new(trial, recording.clone(), sensors)?;
    let displacement_ned = navigation.track().map(|track| track.displacement()).transpose()?;
    Ok(Navigated { displacement_ned, ..navigation.along(&Dof::ALL, OfTurning::Kept)? })
}

/// Runs [`navigate`] for some degrees of freedom only, without displacement; consumes the
/// recording, which frees the memory of each channel after its use.
pub(crate) fn navigate_along(
    trial: &str,
    recording: Recording,
    sensors: &Sensors,
    dofs: &[Dof],
) -> Result<Navigated, Error> {
    Navigation::new(trial, recording, sensors)?.along(dofs, OfTurning::Removed)
}

/// Treatment of −(ω × v) in accelerations, v being the measured velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
enum OfTurning {
    Removed,
    Kept,
}

/// Navigation without the results that depend on displacement.
struct Navigation {
    trial: String,
    attitude: AttitudeRecord,
    /// North and east of the sensor that measures position, if any.
    positioned: Option<[Timed; 2]>,
    /// Lever arm of that sensor.
    lever: Vector3<f64>,
    /// The accelerometer's readings, if any.
    accelerometer: Accelerometer,
    sensors: Sensors,
    nav: Navigated,
}

impl Navigation {
    fn new(trial: &str, mut recording: Recording, sensors: &Sensors) -> Result<Self, Error> {
        let mut caveats = gyro::remove_dead(trial, &mut recording);
        let accelerometer = Accelerometer::take(&mut recording);
        let attitude = AttitudeRecord::take(&mut recording, sensors);
        caveats.extend(gyro_bias::subtract_biases(trial, &mut recording, &attitude));
        let rates = rates(&recording, &attitude)?;
        let heading_cuts = attitude.cuts.clone();
        let mut nav = Navigated { caveats, rates, heading_cuts, ..Navigated::default() };
        for (dof, angle) in [Dof::Roll, Dof::Pitch, Dof::Yaw].into_iter().zip(attitude.parts()) {
            if let Some(angle) = angle {
                nav.position.insert(dof, angle.clone());
                nav.by_position.insert(dof, Motion::Position(angle.clone()));
            }
            if let Some(rate) = recording.remove(&Quantity::Rate(axis_of(dof))) {
                nav.measured.insert(dof, rate);
            }
        }
        dvl_at_origin(trial, &mut recording, sensors, &mut nav)?;
        for dof in Dof::ALL {
            if let Some(velocity) = recording.remove(&Quantity::Velocity(dof)) {
                nav.measured.insert(dof, velocity);
                nav.levers.remove(&dof);
            }
        }
        ground::velocities(&mut recording, sensors, &attitude, &mut nav)?;
        ground::positions(&mut recording)?;
        depth_of_origin(&recording, sensors, &attitude, &mut nav);
        let mut position = |way| recording.remove(&Quantity::Position(way));
        let positioned = position(World::North).zip(position(World::East)).map(<[Timed; 2]>::from);
        if positioned.is_some() && attitude.heading.is_none() {
            let message = "position is logged without heading: north is taken as forward; map attitude.heading";
            nav.caveats.push(Caveat::warning(CaveatCode::Navigation, message));
        }
        let (trial, lever) = (trial.to_owned(), sensors.position.position_body);
        Ok(Self { trial, attitude, positioned, lever, accelerometer, sensors: *sensors, nav })
    }

    /// Returns the displacement as positioned or by dead reckoning; `None` if neither is available.
    fn track(&self) -> Option<Track<'_>> {
        match &self.positioned {
            Some([north, east]) => Some(Track::positioned(north, east, self.lever, &self.attitude)),
            None => Track::reckoned(&self.nav.measured, &self.attitude),
        }
    }

    /// Adds velocity from position, and keeps only some degrees of freedom.
    fn along(self, dofs: &[Dof], of_turning: OfTurning) -> Result<Navigated, Error> {
        let lacks = |&(_, dof): &(usize, Dof)| {
            let known = self.positioned.is_some() && dof != Dof::Heave
                || self.nav.measured.contains_key(&dof);
            known && dofs.contains(&dof) && !self.nav.by_position.contains_key(&dof)
        };
        let rows = TRANSLATIONS.into_iter().enumerate().filter(lacks).collect::<Vec<_>>();
        let mut velocities = Vec::new();
        if let Some(track) = self.track().filter(|_| !rows.is_empty()) {
            let numbers: Vec<usize> = rows.iter().map(|(row, _)| *row).collect();
            velocities = track.body_velocity(&numbers)?;
        }
        let Self { attitude, mut nav, trial, accelerometer, sensors, .. } = self;
        let found = rows.into_iter().zip(velocities);
        nav.by_position.extend(found.map(|((_, dof), v)| (dof, Motion::Velocity(v))));
        nav.depth = nav.position.get(&Dof::Heave).cloned();
        if let Some(depth) = nav.position.get(&Dof::Heave).filter(|_| dofs.contains(&Dof::Heave)) {
            let (path, doubt) = heave_path(&trial, depth, &attitude, &nav);
            nav.position.insert(Dof::Heave, path.clone());
            nav.by_position.insert(Dof::Heave, Motion::Position(path));
            nav.caveats.extend(doubt);
        }
        if let Some(heading) = &attitude.heading {
            nav.heading = Some(heading.clone());
            let path = yaw_path(heading, &attitude);
            nav.position.insert(Dof::Yaw, path.clone());
            nav.by_position.insert(Dof::Yaw, Motion::Position(path));
        }
        for &dof in dofs {
            if let Some(turning) = turning_along(dof, &nav) {
                nav.turning.insert(dof, turning);
            }
        }
        nav.beside = Beside::new(&nav);
        let unmeasured = |dof: &&Dof| !accelerometer.is_empty() && !nav.measured.contains_key(dof);
        let accelerometer_axes: Vec<Dof> = dofs.iter().filter(unmeasured).copied().collect();
        for dof in accelerometer_axes {
            let is_removed = of_turning == OfTurning::Removed;
            let turning = nav.turning.get(&dof).filter(|_| is_removed);
            // Plants of several axes choose their own averaging windows.
            let longest_s = if is_removed { LONGEST_MEAN_S } else { 0.0 };
            let around = Around { rates: nav.rates.as_ref(), turning, longest_s };
            let mut doubts = Vec::new();
            let found =
                accelerometer.along(dof, &trial, &sensors, &attitude, &around, &mut doubts)?;
            if let Some(found) = found {
                doubts.extend(around.unknown_turning(&trial, dof).filter(|_| is_removed));
                nav.acceleration.insert(dof, found);
            }
            doubts.retain(|doubt| !nav.caveats.contains(doubt));
            nav.caveats.extend(doubts);
        }
        nav.measured.retain(|dof, _| dofs.contains(dof));
        nav.by_position.retain(|dof, _| dofs.contains(dof));
        nav.position.retain(|dof, _| dofs.contains(dof));
        Ok(nav)
    }
}

/// Returns `−(ω × v)` along a translation, at the times of one of the other velocities.
fn turning_along(dof: Dof, nav: &Navigated) -> Option<Timed> {
    let [p, q, r] = nav.rates.as_ref()?;
    let [u, v, w] = TRANSLATIONS.map(|dof| nav.measured.get(&dof));
    let (plus, minus) = match dof {
        Dof::Surge => ((r, v), (q, w)),
        Dof::Sway => ((p, w), (r, u)),
        Dof::Heave => ((q, u), (p, v)),
        Dof::Roll | Dof::Pitch | Dof::Yaw => return None,
    };
    let base = plus.1.or(minus.1)?;
    let product = |(rate, speed): (&Timed, Option<&Timed>), t: f64| {
        speed.map_or(0.0, |speed| rate.at(t) * speed.at(t))
    };
    let at = |&t: &f64| product(plus, t) - product(minus, t);
    base.with_values("turning", base.time_s().iter().map(at).collect()).ok()
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

/// Returns measured rates, and those of the attitude for axes without.
fn rates(recording: &Recording, attitude: &AttitudeRecord) -> Result<Option<[Timed; 3]>, Error> {
    let rotation =
        |axis| [Dof::Roll, Dof::Pitch, Dof::Yaw].into_iter().find(|dof| axis_of(*dof) == axis);
    let measured = AXES.map(|axis| {
        let velocity = || recording.get(&Quantity::Velocity(rotation(axis)?));
        recording.get(&Quantity::Rate(axis)).or_else(velocity)
    });
    let Some(base) = measured.iter().flatten().max_by_key(|rate| rate.len()) else {
        return attitude.body_rates();
    };
    if let [Some(p), Some(q), Some(r)] = measured {
        return Ok(Some([p.clone(), q.clone(), r.clone()]));
    }
    let derived = attitude.body_rates()?.unwrap_or_else(|| AXES.map(|_| base.map(|_| 0.0)));
    let pairs = std::array::from_fn(|k| measured[k].unwrap_or(&derived[k]).clone());
    Ok(Some(pairs))
}

fn dvl_at_origin(
    trial: &str,
    recording: &mut Recording,
    sensors: &Sensors,
    nav: &mut Navigated,
) -> Result<(), Error> {
    let mut beams = AXES.map(|axis| recording.remove(&Quantity::DvlVelocity(axis)));
    if beams.iter().all(Option::is_none) {
        return Ok(());
    }
    let r_bs = sensors.dvl.to_body();
    let lever = sensors.dvl.position_body;
    if lever.norm() > 0.0 && nav.rates.is_none() {
        let message = "the DVL has a lever arm but the log has neither attitude nor rates: the vehicle's turning is taken as zero, which makes its velocity wrong; map attitude.heading or rate.yaw";
        nav.caveats.push(Caveat::warning(CaveatCode::Navigation, message));
    }
    let needs = |row: usize, column: usize| r_bs[(row, column)].abs() > 1e-9;
    for (row, dof) in TRANSLATIONS.into_iter().enumerate() {
        let needed: Vec<usize> = (0..3).filter(|&column| needs(row, column)).collect();
        if beams[row].is_none() && needed == [row] {
            continue;
        }
        let mut parts = Vec::with_capacity(needed.len());
        for &column in &needed {
            let Some(beam) = &beams[column] else {
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
        let turning = Turning::new(nav.rates.as_ref(), lever, row);
        nav.measured.insert(dof, weighted_sum(&parts, turning)?);
        if lever.norm() > 0.0 {
            nav.levers.insert(dof, lever);
        }
        for (column, beam) in beams.iter_mut().enumerate() {
            if !(row + 1..3).any(|later| needs(later, column)) {
                *beam = None;
            }
        }
    }
    Ok(())
}

/// The lever-arm velocity (ω × r) along one body axis.
struct Turning<'a> {
    rates: Option<[Reader<'a>; 3]>,
    lever: Vector3<f64>,
    row: usize,
}

impl<'a> Turning<'a> {
    fn new(rates: Option<&'a [Timed; 3]>, lever: Vector3<f64>, row: usize) -> Self {
        let moved = rates.filter(|_| lever.norm() > 0.0);
        Self { rates: moved.map(|rates| rates.each_ref().map(Timed::reader)), lever, row }
    }

    /// Returns it at times that never decrease.
    fn at(&mut self, t_s: f64) -> f64 {
        let Some(rates) = &mut self.rates else { return 0.0 };
        let omega = Vector3::from_iterator(rates.iter_mut().map(|rate| rate.at(t_s)));
        omega.cross(&self.lever)[self.row]
    }
}

/// Returns Σ weight · series − turning, at the times that all share; if they share none, at the
/// first one's times with the others interpolated.
fn weighted_sum(parts: &[(f64, &Timed)], mut turning: Turning<'_>) -> Result<Timed, Error> {
    const NAME: &str = "DVL velocity";
    let first = parts[0].1;
    if parts.iter().all(|(_, x)| x.is_sampled_with(first)) {
        let time_s = first.time_s();
        let at = |k: usize| {
            let sum: f64 = parts.iter().map(|(w, x)| w * x.values()[k]).sum();
            sum - turning.at(time_s[k])
        };
        return first.with_shared_values(NAME, (0..first.len()).map(at).collect());
    }
    let shared: Vec<f64> = first
        .time_s()
        .iter()
        .copied()
        .filter(|t| {
            parts.iter().all(|(_, x)| x.time_s().binary_search_by(|u| u.total_cmp(t)).is_ok())
        })
        .collect();
    let times = if shared.is_empty() { first.time_s().to_vec() } else { shared };
    let mut parts: Vec<(f64, Reader<'_>)> = parts.iter().map(|(w, x)| (*w, x.reader())).collect();
    let mut at = |&t: &f64| {
        let sum: f64 = parts.iter_mut().map(|(w, x)| *w * x.at(t)).sum();
        sum - turning.at(t)
    };
    let values: Vec<f64> = times.iter().map(&mut at).collect();
    Timed::new(NAME, times, values)
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
    let mut attitude = attitude.reader();
    let mut below = |t: f64| (attitude.at(t) * lever).z;
    let values = depth.time_s().iter().zip(depth.values()).map(|(&t, z)| z - below(t)).collect();
    // Finite readings less a bounded lever arm are finite, and the times are the same.
    let origin = depth.with_values("depth", values).unwrap_or_else(|_| depth.clone());
    nav.position.insert(Dof::Heave, origin.clone());
    nav.by_position.insert(Dof::Heave, Motion::Position(origin));
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::Sensor;
    use crate::quantity::Attitude;

    fn every_tenth(n: usize, f: impl Fn(f64) -> f64) -> Timed {
        let t: Vec<f64> = (0..n).map(|k| 0.1 * k as f64).collect();
        let x = t.iter().map(|&t| f(t)).collect::<Vec<_>>();
        Timed::new("test", t, x).expect("valid")
    }

    #[test]
    fn a_dvl_ahead_of_a_turning_vehicle_measures_apparent_sway() {
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
    fn a_gyro_in_yaw_leaves_roll_and_pitch_to_the_attitude() {
        let recording = Recording::from([
            (Quantity::Rate(Axis::Z), every_tenth(300, |t| 0.3 * t.cos())),
            (Quantity::Attitude(Attitude::Pitch), every_tenth(300, |t| 0.2 * t.sin())),
        ]);
        let [p, q, r] = rates_of(&recording).expect("known");
        let inside = (30..270).map(|k| 0.1 * f64::from(k));
        for t in inside {
            // The rate filter attenuates 1 rad/s by 1 %.
            assert!((q.at(t) - 0.2 * t.cos()).abs() < 0.01, "{t}");
            assert!((r.at(t) - 0.3 * t.cos()).abs() < 0.01 && p.at(t).abs() < 1e-12);
        }
    }

    fn rates_of(recording: &Recording) -> Option<[Timed; 3]> {
        navigate("t", recording, &Sensors::default()).expect("complete").rates
    }

    #[test]
    fn refuses_a_misaligned_dvl_without_its_second_axis() {
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
        // Converted back to body axes, the displacement is surge alone.
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
