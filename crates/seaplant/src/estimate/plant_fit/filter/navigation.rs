//! Navigation states, driven by motion without feedback: current, position, heading, and the
//! velocity integrated by an accelerometer.
//!
//! ```text
//! ċ = −c/T_c + w_c            deviation of the current from its mean, north and east ([`current`](super::current))
//! ṗ = R(η) ν_r + u_c + c      position, north and east
//! ż = k · ν_r                 depth; k is the world's down in body axes
//! ψ̇ = (q k_y + r k_z) / (k_y² + k_z²)
//! ġ = ν̇_r + ω × ν_r + b       velocity gained since the last mean acceleration
//! ḃ = −b/T_b + w_b            offset of the accelerometer, and gravity that leaks into it
//! ẏ = (ν_r − y)/T_y           velocity that its sensor shows with a lag ([`SensorLag`](super::super::sensor_lag))
//! ```
//!
//! The two states of swell on each axis ([`Swell`](super::Swell)) follow these. Its force is held over
//! a step; it is the only navigation state that moves the vehicle.
//!
//! A step is linear in the navigation states before it and in the motion before and after it, so
//! that derivatives and covariance follow from those of motion.

use nalgebra::{Matrix3x2, SMatrix, SVector, Vector2, Vector3, Vector6};

use super::Sweep;
use super::follower::Change;
use super::noise::Swell;
use super::state::{Covariance, State, Transition, symmetrise};
use crate::Dof;
use crate::estimate::plant_fit::schedule::FilterInstant;
use crate::estimate::plant_fit::sensor_lag::LagStep;
use crate::motion::{apply, times, times_sparse_transposed, times_transposed};

/// Maximum number of navigation states: 12 of position and instruments, two of swell on each of six
/// axes. An axis whose velocity is measured, with a lag or without, needs no states of its position.
pub(in crate::estimate::plant_fit) const MOST: usize = 24;

/// Index of each navigation state that a trial needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::estimate::plant_fit) struct Layout {
    /// Index of north; east follows.
    pub(in crate::estimate::plant_fit) position: Option<usize>,
    pub(in crate::estimate::plant_fit) depth: Option<usize>,
    pub(in crate::estimate::plant_fit) heading: Option<usize>,
    /// Integrated velocity along each body axis.
    pub(in crate::estimate::plant_fit) gained: [Option<usize>; 3],
    /// Accelerometer offset along each body axis.
    pub(in crate::estimate::plant_fit) offset: [Option<usize>; 3],
    /// Velocity along each body axis as a sensor with a lag shows it.
    pub(in crate::estimate::plant_fit) lagged: [Option<usize>; 3],
    /// Its rate of change, where the sensor averages over a window.
    pub(in crate::estimate::plant_fit) slope: [Option<usize>; 3],
    /// Number of states, including the two of the current, without those of swell.
    pub(in crate::estimate::plant_fit) count: usize,
}

impl Layout {
    /// Assigns indices for the available positions, depth, heading and mean accelerations.
    pub(in crate::estimate::plant_fit) fn of(
        has_position: bool,
        has_depth: bool,
        has_heading: bool,
        accelerations: [bool; 3],
    ) -> Self {
        let mut count = 2;
        let mut take = |wanted: bool, states: usize| {
            let first = count;
            count += if wanted { states } else { 0 };
            wanted.then_some(first)
        };
        let position = take(has_position, 2);
        let depth = take(has_depth, 1);
        let heading = take(has_heading, 1);
        let gained = accelerations.map(|has| take(has, 1));
        let offset = accelerations.map(|has| take(has, 1));
        Self {
            position,
            depth,
            heading,
            gained,
            offset,
            lagged: [None; 3],
            slope: [None; 3],
            count,
        }
    }

    /// Adds one or two states for each translation whose sensor lags.
    pub(in crate::estimate::plant_fit) fn with_lagged(
        self,
        is_window: bool,
        lags: impl Fn(Dof) -> bool,
    ) -> Self {
        let mut all = self;
        for (axis, dof) in [Dof::Surge, Dof::Sway, Dof::Heave].into_iter().enumerate() {
            if lags(dof) {
                all.lagged[axis] = Some(all.count);
                all.slope[axis] = is_window.then_some(all.count + 1);
                all.count += if is_window { 2 } else { 1 };
            }
        }
        all
    }

    /// Returns true if there are states other than the current.
    pub(super) fn is_more_than_current(&self) -> bool {
        self.count > 2
    }
}

/// A measurement of a navigation state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate::plant_fit) struct Reading {
    /// Index of the state.
    pub(in crate::estimate::plant_fit) state: usize,
    /// The index of its standard deviation in [`InstrumentNoise`].
    pub(in crate::estimate::plant_fit) number: usize,
    /// Axis, in SNAME order, to which its innovations are assigned.
    pub(in crate::estimate::plant_fit) axis: Option<usize>,
    pub(in crate::estimate::plant_fit) value: f64,
    /// Variance relative to the square of that number.
    pub(in crate::estimate::plant_fit) spread: f64,
}

/// Noise of the sensors that measure navigation states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate::plant_fit) struct InstrumentNoise {
    /// Standard deviations, indexed by the constants below; the last entry is the offset's
    /// correlation time, s.
    pub(in crate::estimate::plant_fit) numbers: [f64; InstrumentNoise::COUNT],
    /// True for the entries that at least one trial needs.
    pub(in crate::estimate::plant_fit) active: [bool; InstrumentNoise::COUNT],
}

impl InstrumentNoise {
    /// Index of position noise, m.
    pub(in crate::estimate::plant_fit) const POSITION: usize = 0;
    /// Index of depth noise, m.
    pub(in crate::estimate::plant_fit) const DEPTH: usize = 1;
    /// Index of heading noise, rad.
    pub(in crate::estimate::plant_fit) const HEADING: usize = 2;
    /// First index of the noise of mean acceleration along each axis, m/s².
    pub(in crate::estimate::plant_fit) const ACCELERATION: usize = 3;
    /// Index of the accelerometer offset's standard deviation, m/s².
    pub(in crate::estimate::plant_fit) const OFFSET: usize = 6;
    /// Index of the offset's correlation time, s.
    pub(in crate::estimate::plant_fit) const OFFSET_CORRELATION: usize = 7;
    pub(in crate::estimate::plant_fit) const COUNT: usize = 8;

    /// Names in results, with units.
    pub(in crate::estimate) const NAMES: [(&'static str, &'static str); Self::COUNT] = [
        ("position_noise", "m"),
        ("depth_noise", "m"),
        ("heading_noise", "rad"),
        ("acceleration_noise_x", "m/s²"),
        ("acceleration_noise_y", "m/s²"),
        ("acceleration_noise_z", "m/s²"),
        ("gravity_leak", "m/s²"),
        ("gravity_leak_correlation", "s"),
    ];

    /// Noise without any active entry.
    pub(in crate::estimate::plant_fit) const NONE: Self =
        Self { numbers: [1.0; Self::COUNT], active: [false; Self::COUNT] };

    /// Returns the number of active entries.
    pub(in crate::estimate::plant_fit) fn count(&self) -> usize {
        self.active.iter().filter(|active| **active).count()
    }

    /// Returns the indices of the active entries.
    pub(in crate::estimate::plant_fit) fn needed(&self) -> impl Iterator<Item = usize> + '_ {
        (0..Self::COUNT).filter(|k| self.active[*k])
    }

    /// Returns the index of an entry among the active ones.
    pub(super) fn place(&self, number: usize) -> usize {
        self.active[..number].iter().filter(|active| **active).count()
    }

    fn offset_fade(&self, h: f64) -> f64 {
        (-h / self.numbers[Self::OFFSET_CORRELATION]).exp()
    }
}

/// Initial variance of position, m².
const FIRST_OF_POSITION: f64 = 100.0;
/// Initial variance of depth, m².
const FIRST_OF_DEPTH: f64 = 1.0;
/// Initial variance of heading, rad².
const FIRST_OF_HEADING: f64 = 0.1;
/// Initial variance of a velocity that its sensor shows with a lag, (m/s)².
const FIRST_OF_LAGGED: f64 = 0.01;

/// Linear map of a step of the navigation states:
/// `oᵢ⁺ = fadeᵢ oᵢ + weight o_from + before x + after x⁺`.
#[derive(Clone, Debug)]
pub(super) struct Rows<const M: usize, const K: usize> {
    fades: [f64; K],
    from: [Option<(usize, f64)>; K],
    /// Matrices for motion before and after the step; `None` where motion changes no state.
    pub(super) moved: Option<Box<[SMatrix<f64, K, M>; 2]>>,
    /// Change of motion over the step by each navigation state before it; `None` without swell.
    pub(super) pushing: Option<Box<SMatrix<f64, M, K>>>,
}

impl<const M: usize, const K: usize> Rows<M, K> {
    fn identity() -> Self {
        Self { fades: [1.0; K], from: [None; K], moved: None, pushing: None }
    }

    /// Returns an entry of A, the part of the map that acts on navigation states.
    pub(super) fn entry(&self, row: usize, column: usize) -> f64 {
        let fade = if row == column { self.fades[row] } else { 0.0 };
        fade + self.from[row].map_or(0.0, |(j, weight)| if j == column { weight } else { 0.0 })
    }

    /// Computes X Aᵀ, where A is the part of the map that acts on navigation states; X has shape
    /// (R, K).
    fn map_transposed<const R: usize>(&self, x: &SMatrix<f64, R, K>) -> SMatrix<f64, R, K> {
        let mut product = *x;
        for (i, (&fade, from)) in self.fades.iter().zip(&self.from).enumerate() {
            let column = &mut product.data.0[i];
            if fade != 1.0 {
                column.iter_mut().for_each(|x| *x *= fade);
            }
            if let Some((j, weight)) = from {
                column.iter_mut().zip(&x.data.0[*j]).for_each(|(a, b)| *a += weight * b);
            }
        }
        product
    }
}

/// Velocity and attitude at one end of a step.
struct Kinematics {
    /// Velocity through the water on all six axes; as measured on those that are not axes of the
    /// plant.
    velocity: Vector6<f64>,
    down: Vector3<f64>,
    /// North and east unit vectors in body axes.
    horizontal: Matrix3x2<f64>,
}

impl Kinematics {
    fn translation(&self) -> Vector3<f64> {
        self.velocity.fixed_rows::<3>(0).into_owned()
    }

    fn turning(&self) -> Vector3<f64> {
        self.velocity.fixed_rows::<3>(3).into_owned()
    }

    /// Returns cos² of pitch, with a lower limit.
    fn across(&self) -> f64 {
        (self.down.y.powi(2) + self.down.z.powi(2)).max(LEAST_LEVEL)
    }

    /// Returns the derivative of ψ̇ by the body rates [p q r].
    fn heading_by_turning(&self) -> Vector3<f64> {
        Vector3::new(0.0, self.down.y, self.down.z) / self.across()
    }
}

/// Lower limit of cos² of pitch, near which heading is undefined.
const LEAST_LEVEL: f64 = 1e-3;

impl<const N: usize, const M: usize, const K: usize> Sweep<'_, N, M, K> {
    /// Sets the initial navigation states.
    pub(super) fn set_initial_navigation(&self, state: &mut State<N, M, K>) {
        let (layout, first) = (&self.schedule.layout, &self.schedule.first_navigation);
        state.navigation[..layout.count].copy_from_slice(&first[..layout.count]);
    }

    /// Sets the initial covariance of the navigation states.
    pub(super) fn set_initial_navigation_covariance(&self, covariance: &mut Covariance<N, M, K>) {
        let layout = &self.schedule.layout;
        let mut set = |state: usize, variance: f64| covariance.oo[(state, state)] = variance;
        if let Some(north) = layout.position {
            set(north, FIRST_OF_POSITION);
            set(north + 1, FIRST_OF_POSITION);
        }
        layout.depth.into_iter().for_each(|state| set(state, FIRST_OF_DEPTH));
        layout.heading.into_iter().for_each(|state| set(state, FIRST_OF_HEADING));
        let faster = (self.schedule.sensor.time_s).max(f64::MIN_POSITIVE).powi(-2);
        layout.lagged.into_iter().flatten().for_each(|state| set(state, FIRST_OF_LAGGED));
        let slopes = layout.slope.into_iter().flatten();
        slopes.for_each(|state| set(state, FIRST_OF_LAGGED * faster));
        let offset = self.noise.instruments.numbers[InstrumentNoise::OFFSET];
        layout.offset.into_iter().flatten().for_each(|state| set(state, offset.powi(2)));
        for (axis, states) in self.swell_states() {
            let std = self.noise.swell.as_ref().map_or(0.0, |swell| swell.std[axis]);
            states.into_iter().for_each(|state| set(state, std.powi(2)));
        }
    }

    /// Starts velocities that sensors show with a lag as those that the vehicle has.
    pub(super) fn start_lagged(&self, motion: &SVector<f64, M>, navigation: &mut [f64; K]) {
        for (axis, state) in self.schedule.layout.lagged.into_iter().enumerate() {
            if let Some((state, place)) = state.zip(self.place_of(axis)) {
                navigation[state] = motion[place];
            }
        }
    }

    /// Returns the step of a sensor that lags, of `h` seconds.
    fn lagging(&self, h: f64) -> LagStep {
        self.schedule.sensor.step(h)
    }

    /// Returns the two states of swell on each axis, by index among the plant's axes.
    pub(super) fn swell_states(&self) -> impl Iterator<Item = (usize, [usize; 2])> + use<N, M, K> {
        let first = self.schedule.layout.count;
        let axes = self.noise.swell.as_ref().map_or(0, |swell| swell.std.len());
        (0..axes).map(move |axis| (axis, [first + 2 * axis, first + 2 * axis + 1]))
    }

    /// Returns the force on each axis at the beginning of a step of which a part decays like the
    /// disturbance and has the impulse of disturbance and swell, N or N m.
    pub(super) fn acting(&self, mean: &State<N, M, K>, h: f64) -> SVector<f64, N> {
        let mut acting = mean.disturbance;
        for (axis, [state, _]) in self.swell_states() {
            acting[axis] += mean.navigation[state] / self.mean_of_decay(axis, h);
        }
        acting
    }

    /// Returns the mean of `exp(−t/T)` of an axis's disturbance over a step.
    fn mean_of_decay(&self, axis: usize, h: f64) -> f64 {
        let x = h / self.noise.correlation_s[axis];
        if x < 1e-9 { 1.0 } else { -(-x).exp_m1() / x }
    }

    /// Adds the process noise of an accelerometer's offsets and of swell over a step.
    pub(super) fn add_navigation_process(&self, h: f64, process: &mut Covariance<N, M, K>) {
        let instruments = &self.noise.instruments;
        let std = instruments.numbers[InstrumentNoise::OFFSET];
        let of_offset = std.powi(2) * (1.0 - instruments.offset_fade(h).powi(2));
        let offsets = self.schedule.layout.offset.into_iter().flatten();
        offsets.for_each(|state| process.oo[(state, state)] = of_offset);
        for (axis, states) in self.swell_states() {
            let added = self.noise.swell.as_ref().map_or(0.0, |swell| swell.process(axis, h));
            states.into_iter().for_each(|state| process.oo[(state, state)] = added);
        }
    }

    /// Returns the derivative of a step by the logarithm of the force of swell on one axis.
    pub(super) fn swell_force_change(&self, swell: &Swell, axis: usize, h: f64) -> Change {
        let by = 2.0 * swell.process(axis, h);
        let own = self.swell_states().filter(|(other, _)| *other == axis);
        let process = own.flat_map(|(_, states)| states.map(|state| (state, by))).collect();
        Change { process, ..Change::default() }
    }

    /// Returns the derivative of a step by the logarithm of frequency or damping of swell, which changes
    /// what its states turn by.
    pub(super) fn swell_shape_change(
        &self,
        swell: &Swell,
        [by_cos, by_sin]: [f64; 2],
        h: f64,
    ) -> Change {
        let added = |(axis, states): (usize, [usize; 2])| {
            states.map(|state| (state, swell.process_change(axis, h)))
        };
        let turned = |(_, [s, other]): (usize, [usize; 2])| {
            let change = |row, from, by| MapChange { row, from, by };
            [
                change(s, s, by_cos),
                change(s, other, -by_sin),
                change(other, s, by_sin),
                change(other, other, by_cos),
            ]
        };
        let process = self.swell_states().flat_map(added).collect();
        let map = self.swell_states().flat_map(turned).collect();
        Change { process, map, ..Change::default() }
    }

    /// Returns the derivative of a step by the logarithm of one entry of the sensor noise.
    pub(super) fn sensor_change(&self, number: usize, h: f64) -> Change {
        let instruments = &self.noise.instruments;
        let (std, rho) = (instruments.numbers[InstrumentNoise::OFFSET], instruments.offset_fade(h));
        let offsets = || self.schedule.layout.offset.into_iter().flatten();
        let all = |by: f64| offsets().map(|state| (state, by)).collect();
        match number {
            InstrumentNoise::OFFSET => {
                let process = all(2.0 * std.powi(2) * (1.0 - rho.powi(2)));
                Change { process, ..Change::default() }
            }
            InstrumentNoise::OFFSET_CORRELATION => {
                let by = rho * h / instruments.numbers[InstrumentNoise::OFFSET_CORRELATION];
                let process = all(-2.0 * std.powi(2) * rho * by);
                let map =
                    offsets().map(|state| MapChange { row: state, from: state, by }).collect();
                Change { process, map, ..Change::default() }
            }
            _ => Change::default(),
        }
    }

    /// Returns the linear map of a step of the navigation states; `None` where it is the identity.
    pub(super) fn rows(
        &self,
        instant: &FilterInstant,
        ends: &Ends<'_, N, M>,
        by_disturbance: &SMatrix<f64, M, N>,
    ) -> Option<Rows<M, K>> {
        let (layout, h) = (&self.schedule.layout, instant.length_s);
        if self.noise.drift.is_none() && self.states() == 2 {
            return None;
        }
        let mut rows = Rows::identity();
        self.set_swell(h, by_disturbance, &mut rows);
        if !layout.is_more_than_current() {
            return Some(rows);
        }
        let mut moved = [SMatrix::<f64, K, M>::zeros(); 2];
        let kinematics = self.kinematics(instant, ends);
        for ((moved, end), sign) in moved.iter_mut().zip(&kinematics).zip([-1.0, 1.0]) {
            let mut set = |state: usize, row: SVector<f64, M>| {
                moved.set_row(state, &(row * (0.5 * h)).transpose());
            };
            for k in 0..2 {
                let Some(north) = layout.position else { break };
                let along = end.horizontal.column(k).into_owned();
                set(north + k, self.by(along, Vector3::zeros()));
            }
            if let Some(depth) = layout.depth {
                let mut row = self.by(end.down, Vector3::zeros());
                if M > N {
                    (0..3).for_each(|i| row[N + i] = end.velocity[i]);
                }
                set(depth, row);
            }
            if let Some(heading) = layout.heading {
                let by_turning = end.heading_by_turning();
                let mut row = self.by(Vector3::zeros(), by_turning);
                if M > N {
                    let own = by_turning.dot(&end.turning());
                    let across = end.across();
                    let of = |i: usize| end.velocity[3 + i] - 2.0 * end.down[i] * own;
                    (1..3).for_each(|i| row[N + i] = of(i) / across);
                }
                set(heading, row);
            }
            for axis in 0..3 {
                let Some(gained) = layout.gained[axis] else { continue };
                let unit = Vector3::from_fn(|i, _| if i == axis { 1.0 } else { 0.0 });
                // (ω × v)ᵢ = eᵢ·(ω × v) = (eᵢ × ω)·v = (v × eᵢ)·ω
                let by_velocity = unit.cross(&end.turning()) + unit * (2.0 * sign / h);
                set(gained, self.by(by_velocity, end.translation().cross(&unit)));
            }
        }
        for (axis, state) in layout.lagged.into_iter().enumerate() {
            let Some((state, place)) = state.zip(self.place_of(axis)) else { continue };
            let LagStep { transition, taken } = self.lagging(h);
            let slope = layout.slope[axis];
            rows.fades[state] = transition[(0, 0)];
            rows.from[state] = slope.map(|slope| (slope, transition[(0, 1)]));
            for (row, own) in [Some(state), slope].into_iter().flatten().enumerate() {
                for (moved, taken) in moved.iter_mut().zip(taken) {
                    moved[(own, place)] = taken[row];
                }
            }
            if let Some(slope) = slope {
                rows.fades[slope] = transition[(1, 1)];
                rows.from[slope] = Some((state, transition[(1, 0)]));
            }
        }
        for k in 0..2 {
            let Some(north) = layout.position else { break };
            rows.from[north + k] = Some((k, h));
        }
        for axis in 0..3 {
            let Some((gained, offset)) = layout.gained[axis].zip(layout.offset[axis]) else {
                continue;
            };
            rows.from[gained] = Some((offset, h));
            rows.fades[offset] = self.noise.instruments.offset_fade(h);
        }
        rows.moved = Some(Box::new(moved));
        Some(rows)
    }

    /// Sets the part of a step's map that swell makes.
    fn set_swell(&self, h: f64, by_disturbance: &SMatrix<f64, M, N>, rows: &mut Rows<M, K>) {
        let Some(swell) = &self.noise.swell else { return };
        let [cos, sin] = swell.turn(h);
        let mut pushing = SMatrix::<f64, M, K>::zeros();
        for (axis, [s, other]) in self.swell_states() {
            (rows.fades[s], rows.fades[other]) = (cos, cos);
            (rows.from[s], rows.from[other]) = (Some((other, -sin)), Some((s, sin)));
            let by_force = by_disturbance.column(axis) / self.mean_of_decay(axis, h);
            pushing.set_column(s, &by_force);
        }
        rows.pushing = Some(Box::new(pushing));
    }

    /// Propagates the mean of the navigation states over a step.
    pub(super) fn move_navigation(
        &self,
        instant: &FilterInstant,
        ends: &Ends<'_, N, M>,
        navigation: &mut [f64; K],
    ) {
        let (layout, h) = (&self.schedule.layout, instant.length_s);
        if layout.is_more_than_current() {
            let [before, after] = self.kinematics(instant, ends);
            let mean = |of: &dyn Fn(&Kinematics) -> f64| 0.5 * h * (of(&before) + of(&after));
            if let Some(north) = layout.position {
                for k in 0..2 {
                    let along = |end: &Kinematics| end.horizontal.column(k).dot(&end.translation());
                    navigation[north + k] += mean(&along) + h * (self.current[k] + navigation[k]);
                }
            }
            if let Some(depth) = layout.depth {
                navigation[depth] += mean(&|end| end.down.dot(&end.translation()));
            }
            if let Some(heading) = layout.heading {
                let turning = |end: &Kinematics| end.heading_by_turning().dot(&end.turning());
                navigation[heading] += mean(&turning);
            }
            let turned = [&before, &after].map(|x| x.turning().cross(&x.translation()));
            let turned = (turned[0] + turned[1]) * (0.5 * h);
            for (axis, (gained, offset)) in layout.gained.iter().zip(layout.offset).enumerate() {
                let Some((gained, offset)) = gained.zip(offset) else { continue };
                navigation[gained] += after.velocity[axis] - before.velocity[axis] + turned[axis];
                navigation[gained] += h * navigation[offset];
                navigation[offset] *= self.noise.instruments.offset_fade(h);
            }
            for (axis, state) in layout.lagged.into_iter().enumerate() {
                let Some(state) = state else { continue };
                let LagStep { transition, taken } = self.lagging(h);
                let slope = layout.slope[axis].map_or(0.0, |slope| navigation[slope]);
                let shown = transition * Vector2::new(navigation[state], slope)
                    + taken[0] * before.velocity[axis]
                    + taken[1] * after.velocity[axis];
                navigation[state] = shown[0];
                layout.slope[axis].into_iter().for_each(|slope| navigation[slope] = shown[1]);
            }
        }
        if let Some(swell) = &self.noise.swell {
            let [cos, sin] = swell.turn(h);
            for (_, [s, other]) in self.swell_states() {
                let (own, across) = (navigation[s], navigation[other]);
                navigation[s] = cos * own - sin * across;
                navigation[other] = sin * own + cos * across;
            }
        }
    }

    /// Returns a row of derivatives by motion from those by translation and rotation rates.
    fn by(&self, translation: Vector3<f64>, turning: Vector3<f64>) -> SVector<f64, M> {
        let mut row = SVector::zeros();
        for (place, axis) in self.plant.axes().iter().enumerate() {
            row[place] = match axis {
                Some(axis @ 0..3) => translation[*axis],
                Some(axis) => turning[axis - 3],
                None => 0.0,
            };
        }
        row
    }

    fn kinematics(&self, instant: &FilterInstant, ends: &Ends<'_, N, M>) -> [Kinematics; 2] {
        let slices = &self.schedule.slices[instant.slices.clone()];
        let of = |motion: &SVector<f64, M>, others: &Vector6<f64>, down: Vector3<f64>| {
            let mut velocity = *others;
            self.plant.put(motion.as_slice(), &mut velocity);
            let down = match M > N {
                true => Vector3::from_fn(|i, _| motion[N + i]),
                false => down,
            };
            (velocity, down)
        };
        let (first, last) = (&slices[0], &slices[slices.len() - 1]);
        let (velocity, down) = of(ends.before, &first.around.others[0], first.around.down_body[0]);
        let before = Kinematics { velocity, down, horizontal: instant.water_before };
        let (velocity, down) = of(ends.after, &last.around.others[2], last.around.down_body[2]);
        [before, Kinematics { velocity, down, horizontal: instant.water }]
    }
}

/// Motion before and after a step.
pub(super) struct Ends<'a, const N: usize, const M: usize> {
    pub(super) before: &'a SVector<f64, M>,
    pub(super) after: &'a SVector<f64, M>,
}

/// Derivative of the map of navigation states: state `row` after a step, by state `from` before it.
#[derive(Clone, Copy)]
pub(super) struct MapChange {
    pub(super) row: usize,
    pub(super) from: usize,
    pub(super) by: f64,
}

impl<const N: usize, const M: usize, const K: usize> State<N, M, K> {
    /// Propagates a deviation of the navigation states, after that of motion.
    pub(super) fn step_navigation(&mut self, before: &SVector<f64, M>, rows: &Rows<M, K>) {
        let mut after =
            rows.map_transposed(&SMatrix::<f64, 1, K>::from_row_slice(&self.navigation));
        if let Some(moved) = &rows.moved {
            after += (apply(&moved[0], before) + apply(&moved[1], &self.motion)).transpose();
        }
        self.navigation = after.transpose().data.0[0];
    }

    /// Resets a navigation state to zero.
    pub(super) fn reset(&mut self, state: usize) {
        self.navigation[state] = 0.0;
    }
}

/// Covariance between states before a step (rows) and after it (columns).
pub(super) struct Crossed<const N: usize, const M: usize, const K: usize> {
    /// Motion before, motion after: (M, M).
    pub(super) xx: SMatrix<f64, M, M>,
    /// Motion before, disturbance after: (M, N).
    pub(super) xf: SMatrix<f64, M, N>,
    /// Navigation states before (columns), with motion and disturbance after.
    pub(super) xo: SMatrix<f64, M, K>,
    pub(super) fo: SMatrix<f64, N, K>,
}

impl<const N: usize, const M: usize, const K: usize> Covariance<N, M, K> {
    /// Computes [`Self::crossed`] where navigation states change over the step.
    pub(super) fn crossed_if_needed(&self, step: &Transition<N, M, K>) -> Option<Crossed<N, M, K>> {
        step.rows.is_some().then(|| self.crossed(step))
    }

    /// Computes the covariance between states before and after a step.
    pub(super) fn crossed(&self, step: &Transition<N, M, K>) -> Crossed<N, M, K> {
        let (a, b) = (&step.by_motion, &step.by_disturbance);
        let mut crossed = Crossed {
            xx: times_transposed(&self.xx, a) + times_transposed(&self.xf, b),
            xf: self.xf,
            xo: times(a, &self.xo) + times(b, &self.fo),
            fo: self.fo,
        };
        if let Some(pushing) = step.pushing() {
            crossed.xx += times_transposed(&self.xo, pushing);
            crossed.xo += times(pushing, &self.oo);
        }
        for j in 0..N {
            crossed.xf.column_mut(j).scale_mut(step.fade[j]);
            crossed.fo.row_mut(j).scale_mut(step.fade[j]);
        }
        crossed
    }

    /// Computes the covariance between navigation states before a step (rows) and after it
    /// (columns).
    pub(super) fn with_after(
        &self,
        crossed: &Crossed<N, M, K>,
        rows: &Rows<M, K>,
    ) -> SMatrix<f64, K, K> {
        let mut found = rows.map_transposed(&self.oo);
        if let Some(moved) = &rows.moved {
            found += times_sparse_transposed(&self.xo.transpose(), &moved[0]);
            found += times_sparse_transposed(&crossed.xo.transpose(), &moved[1]);
        }
        found
    }

    /// Propagates the covariance of the navigation states, after that of motion and disturbance;
    /// `before` is the covariance before the step.
    pub(super) fn predict_navigation(
        &mut self,
        before: &Self,
        crossed: &Crossed<N, M, K>,
        (rows, process): (&Rows<M, K>, &Self),
    ) {
        let with_after = before.with_after(crossed, rows);
        self.xo = rows.map_transposed(&crossed.xo);
        self.fo = rows.map_transposed(&crossed.fo);
        self.oo = rows.map_transposed(&with_after.transpose());
        if let Some(moved) = &rows.moved {
            let [by_before, by_after] = &**moved;
            self.xo += times_sparse_transposed(&crossed.xx.transpose(), by_before);
            self.xo += times_sparse_transposed(&self.xx, by_after);
            self.fo += times_sparse_transposed(&crossed.xf.transpose(), by_before);
            self.fo += times_sparse_transposed(&self.xf.transpose(), by_after);
            let mut of_before = rows.map_transposed(&before.xo);
            of_before += times_sparse_transposed(&before.xx, by_before);
            of_before += times_sparse_transposed(&crossed.xx, by_after);
            self.oo += times_sparse_transposed(&of_before.transpose(), by_before);
            self.oo += times_sparse_transposed(&self.xo.transpose(), by_after);
        }
        self.oo += process.oo;
        symmetrise(&mut self.oo);
    }

    /// Adds the effect of a changed map of navigation states; `nominal` is the covariance before
    /// the step.
    pub(super) fn add_map_changes(
        &mut self,
        changes: &[MapChange],
        nominal: &Self,
        crossed: &Crossed<N, M, K>,
        rows: &Rows<M, K>,
    ) {
        let with_after = nominal.with_after(crossed, rows);
        for &MapChange { row, from, by } in changes {
            let (xo, fo) = (crossed.xo.column(from) * by, crossed.fo.column(from) * by);
            self.xo.set_column(row, &(self.xo.column(row) + xo));
            self.fo.set_column(row, &(self.fo.column(row) + fo));
            for j in 0..self.count {
                self.oo[(row, j)] += by * with_after[(from, j)];
                self.oo[(j, row)] += by * with_after[(from, j)];
            }
        }
    }

    /// Resets a navigation state to zero with zero variance.
    pub(super) fn reset(&mut self, state: usize) {
        self.xo.column_mut(state).fill(0.0);
        self.fo.column_mut(state).fill(0.0);
        self.oo.column_mut(state).fill(0.0);
        self.oo.row_mut(state).fill(0.0);
    }
}
