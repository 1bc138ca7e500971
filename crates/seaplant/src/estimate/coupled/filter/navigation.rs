//! Navigation states, which motion drives and which drive nothing: current, position, heading, and
//! the velocity that an accelerometer gains.
//!
//! ```text
//! ċ = −c/T_c + w_c            the current beside its mean, north and east
//! ṗ = R(η) ν_r + u_c + c      position, north and east
//! ż = k · ν_r                 depth; k is the world's down in body axes
//! ψ̇ = (q k_y + r k_z) / (k_y² + k_z²)
//! ġ = ν̇_r + ω × ν_r + b       velocity gained since the last mean acceleration
//! ḃ = −b/T_b + w_b            offset of the accelerometer, and gravity that leaks into it
//! ```
//!
//! A step is linear in the state before it and in the motion after it, so that derivatives and
//! covariance follow from those of motion.

use nalgebra::{Matrix3x2, SMatrix, SVector, Vector3, Vector6};

use super::Pass;
use super::state::{Covariance, State, Transition, symmetrise};
use crate::estimate::coupled::schedule::Stop;
use crate::motion::{apply, times, times_sparse_transposed, times_transposed};

/// The most of these states.
pub(in crate::estimate::coupled) const MOST: usize = 12;

/// The index of each navigation state that a trial needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::estimate::coupled) struct Layout {
    /// North; east is next to it.
    pub(in crate::estimate::coupled) position: Option<usize>,
    pub(in crate::estimate::coupled) depth: Option<usize>,
    pub(in crate::estimate::coupled) heading: Option<usize>,
    /// Velocity gained along each body axis.
    pub(in crate::estimate::coupled) gained: [Option<usize>; 3],
    /// The accelerometer's offset there.
    pub(in crate::estimate::coupled) offset: [Option<usize>; 3],
    /// The number of states, the two of the current among them.
    pub(in crate::estimate::coupled) count: usize,
}

impl Layout {
    /// States for positions, depth, heading and mean accelerations that were measured.
    pub(in crate::estimate::coupled) fn of(
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
        Self { position, depth, heading, gained, offset, count }
    }

    /// Returns true if there are states beside the current.
    pub(super) fn is_more_than_current(&self) -> bool {
        self.count > 2
    }
}

/// A measurement of a navigation state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate::coupled) struct Reading {
    /// Which state.
    pub(in crate::estimate::coupled) state: usize,
    /// The index of its standard deviation in [`InstrumentNoise`].
    pub(in crate::estimate::coupled) number: usize,
    /// The axis, in SNAME order, whose innovations it counts to.
    pub(in crate::estimate::coupled) axis: Option<usize>,
    pub(in crate::estimate::coupled) value: f64,
    /// Its variance beside the square of that number.
    pub(in crate::estimate::coupled) spread: f64,
}

/// Noise of the instruments that measure these states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate::coupled) struct InstrumentNoise {
    /// Standard deviations by the constants below; the last is the offset's correlation time, s.
    pub(in crate::estimate::coupled) numbers: [f64; InstrumentNoise::COUNT],
    /// Which of them some trial needs.
    pub(in crate::estimate::coupled) active: [bool; InstrumentNoise::COUNT],
}

impl InstrumentNoise {
    /// Of a fix, m.
    pub(in crate::estimate::coupled) const POSITION: usize = 0;
    /// Of depth, m.
    pub(in crate::estimate::coupled) const DEPTH: usize = 1;
    /// Of heading, rad.
    pub(in crate::estimate::coupled) const HEADING: usize = 2;
    /// Of a mean acceleration along each axis, m/s².
    pub(in crate::estimate::coupled) const ACCELERATION: usize = 3;
    /// Of the accelerometer's offset, m/s² …
    pub(in crate::estimate::coupled) const OFFSET: usize = 6;
    /// … and its correlation time, s.
    pub(in crate::estimate::coupled) const OFFSET_CORRELATION: usize = 7;
    pub(in crate::estimate::coupled) const COUNT: usize = 8;

    /// Their names in results, and units.
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

    /// None of them.
    pub(in crate::estimate::coupled) const NONE: Self =
        Self { numbers: [1.0; Self::COUNT], active: [false; Self::COUNT] };

    /// The number of them that are needed.
    pub(in crate::estimate::coupled) fn count(&self) -> usize {
        self.active.iter().filter(|active| **active).count()
    }

    /// The indices of those that are needed.
    pub(in crate::estimate::coupled) fn needed(&self) -> impl Iterator<Item = usize> + '_ {
        (0..Self::COUNT).filter(|k| self.active[*k])
    }

    /// The index of a number among those that are needed.
    pub(super) fn place(&self, number: usize) -> usize {
        self.active[..number].iter().filter(|active| **active).count()
    }

    fn fade_of_offset(&self, h: f64) -> f64 {
        (-h / self.numbers[Self::OFFSET_CORRELATION]).exp()
    }
}

/// The variance of a state that nothing is known of before it is first measured: of position, m²,
const FIRST_OF_POSITION: f64 = 100.0;
/// of depth, m²,
const FIRST_OF_DEPTH: f64 = 1.0;
/// and of heading, rad².
const FIRST_OF_HEADING: f64 = 0.1;

/// A step of these states: `oᵢ⁺ = fadeᵢ oᵢ + weight o_from + before x + after x⁺`.
#[derive(Clone, Debug)]
pub(super) struct Rows<const M: usize> {
    fades: [f64; MOST],
    from: [Option<(usize, f64)>; MOST],
    /// By the motion before the step and after it; none where only the current changes.
    moved: Option<Box<[SMatrix<f64, MOST, M>; 2]>>,
}

impl<const M: usize> Rows<M> {
    fn fading(fade_of_current: f64) -> Self {
        let mut fades = [1.0; MOST];
        (fades[0], fades[1]) = (fade_of_current, fade_of_current);
        Self { fades, from: [None; MOST], moved: None }
    }

    /// X Aᵀ: what becomes of covariances with these states, shape (R, 12), by these states alone.
    fn carried<const R: usize>(&self, x: &SMatrix<f64, R, MOST>) -> SMatrix<f64, R, MOST> {
        let mut carried = *x;
        for (i, (&fade, from)) in self.fades.iter().zip(&self.from).enumerate() {
            let column = &mut carried.data.0[i];
            if fade != 1.0 {
                column.iter_mut().for_each(|x| *x *= fade);
            }
            if let Some((j, weight)) = from {
                column.iter_mut().zip(&x.data.0[*j]).for_each(|(a, b)| *a += weight * b);
            }
        }
        carried
    }
}

/// Velocity and attitude at an end of a step.
struct Posture {
    /// Velocity through the water of all axes; of those that are no axes of the plant as measured.
    velocity: Vector6<f64>,
    down: Vector3<f64>,
    /// North and east in body axes.
    horizontal: Matrix3x2<f64>,
}

impl Posture {
    fn translation(&self) -> Vector3<f64> {
        self.velocity.fixed_rows::<3>(0).into_owned()
    }

    fn turning(&self) -> Vector3<f64> {
        self.velocity.fixed_rows::<3>(3).into_owned()
    }

    /// cos² of pitch.
    fn across(&self) -> f64 {
        (self.down.y.powi(2) + self.down.z.powi(2)).max(LEAST_LEVEL)
    }

    /// ψ̇ by pitch and yaw rate.
    fn heading_by_turning(&self) -> Vector3<f64> {
        Vector3::new(0.0, self.down.y, self.down.z) / self.across()
    }
}

/// cos² of pitch where heading has no meaning.
const LEAST_LEVEL: f64 = 1e-3;

impl<const N: usize, const M: usize> Pass<'_, N, M> {
    /// The first of these states.
    pub(super) fn first_navigation(&self, state: &mut State<N, M>) {
        let (layout, first) = (&self.schedule.layout, &self.schedule.first_navigation);
        state.navigation[..layout.count].copy_from_slice(&first[..layout.count]);
    }

    /// Their covariance at first.
    pub(super) fn first_covariance_of_navigation(&self, covariance: &mut Covariance<N, M>) {
        let layout = &self.schedule.layout;
        let mut set = |state: usize, variance: f64| covariance.oo[(state, state)] = variance;
        if let Some(north) = layout.position {
            set(north, FIRST_OF_POSITION);
            set(north + 1, FIRST_OF_POSITION);
        }
        layout.depth.into_iter().for_each(|state| set(state, FIRST_OF_DEPTH));
        layout.heading.into_iter().for_each(|state| set(state, FIRST_OF_HEADING));
        let offset = self.noise.instruments.numbers[InstrumentNoise::OFFSET];
        layout.offset.into_iter().flatten().for_each(|state| set(state, offset.powi(2)));
    }

    /// Adds the process noise of the current and of an accelerometer's offsets over a step.
    pub(super) fn process_of_navigation(&self, h: f64, process: &mut Covariance<N, M>) {
        let of_water = self.noise.of_water().process(h);
        (0..2).for_each(|k| process.oo[(k, k)] = of_water);
        let instruments = &self.noise.instruments;
        let std = instruments.numbers[InstrumentNoise::OFFSET];
        let of_offset = std.powi(2) * (1.0 - instruments.fade_of_offset(h).powi(2));
        let offsets = self.schedule.layout.offset.into_iter().flatten();
        offsets.for_each(|state| process.oo[(state, state)] = of_offset);
    }

    /// Sets the derivative of a step's process noise by the logarithm of a number of the instruments'
    /// noise; returns the derivative of the offsets' decay, if it has one.
    pub(super) fn process_change_of_instruments(
        &self,
        number: usize,
        h: f64,
        process: &mut Covariance<N, M>,
    ) -> Option<FadeChange> {
        let instruments = &self.noise.instruments;
        let (std, rho) =
            (instruments.numbers[InstrumentNoise::OFFSET], instruments.fade_of_offset(h));
        let offsets = self.schedule.layout.offset;
        let mut set = |variance: f64| {
            offsets.into_iter().flatten().for_each(|state| process.oo[(state, state)] = variance);
        };
        match number {
            InstrumentNoise::OFFSET => set(2.0 * std.powi(2) * (1.0 - rho.powi(2))),
            InstrumentNoise::OFFSET_CORRELATION => {
                let by = rho * h / instruments.numbers[InstrumentNoise::OFFSET_CORRELATION];
                set(-2.0 * std.powi(2) * rho * by);
                return Some(FadeChange { states: offsets, by });
            }
            _ => {}
        }
        None
    }

    /// The linear map of a step of these states; none where it is the identity.
    pub(super) fn rows(&self, stop: &Stop, ends: &Ends<'_, N, M>) -> Option<Rows<M>> {
        let (layout, h) = (&self.schedule.layout, stop.length_s);
        let fade = self.noise.of_water().fade(h);
        if !layout.is_more_than_current() {
            return (fade != 1.0).then(|| Rows::fading(fade));
        }
        let mut rows = Rows::fading(fade);
        let mut moved = [SMatrix::<f64, MOST, M>::zeros(); 2];
        let postures = self.postures(stop, ends);
        for ((moved, posture), sign) in moved.iter_mut().zip(&postures).zip([-1.0, 1.0]) {
            let mut set = |state: usize, row: SVector<f64, M>| {
                moved.set_row(state, &(row * (0.5 * h)).transpose());
            };
            for k in 0..2 {
                let Some(north) = layout.position else { break };
                let along = posture.horizontal.column(k).into_owned();
                set(north + k, self.by(along, Vector3::zeros()));
            }
            if let Some(depth) = layout.depth {
                let mut row = self.by(posture.down, Vector3::zeros());
                if M > N {
                    (0..3).for_each(|i| row[N + i] = posture.velocity[i]);
                }
                set(depth, row);
            }
            if let Some(heading) = layout.heading {
                let by_turning = posture.heading_by_turning();
                let mut row = self.by(Vector3::zeros(), by_turning);
                if M > N {
                    let own = by_turning.dot(&posture.turning());
                    let across = posture.across();
                    let of = |i: usize| posture.velocity[3 + i] - 2.0 * posture.down[i] * own;
                    (1..3).for_each(|i| row[N + i] = of(i) / across);
                }
                set(heading, row);
            }
            for axis in 0..3 {
                let Some(gained) = layout.gained[axis] else { continue };
                let unit = Vector3::from_fn(|i, _| if i == axis { 1.0 } else { 0.0 });
                // (ω × v)ᵢ = eᵢ·(ω × v) = (eᵢ × ω)·v = (v × eᵢ)·ω
                let by_velocity = unit.cross(&posture.turning()) + unit * (2.0 * sign / h);
                set(gained, self.by(by_velocity, posture.translation().cross(&unit)));
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
            rows.fades[offset] = self.noise.instruments.fade_of_offset(h);
        }
        rows.moved = Some(Box::new(moved));
        Some(rows)
    }

    /// Moves the mean of these states over a step.
    pub(super) fn move_navigation(
        &self,
        stop: &Stop,
        ends: &Ends<'_, N, M>,
        navigation: &mut [f64; MOST],
    ) {
        let (layout, h) = (&self.schedule.layout, stop.length_s);
        let fade = self.noise.of_water().fade(h);
        if layout.is_more_than_current() {
            let [before, after] = self.postures(stop, ends);
            let mean = |of: &dyn Fn(&Posture) -> f64| 0.5 * h * (of(&before) + of(&after));
            if let Some(north) = layout.position {
                for k in 0..2 {
                    let along = |posture: &Posture| {
                        posture.horizontal.column(k).dot(&posture.translation())
                    };
                    navigation[north + k] += mean(&along) + h * (self.current[k] + navigation[k]);
                }
            }
            if let Some(depth) = layout.depth {
                navigation[depth] += mean(&|posture| posture.down.dot(&posture.translation()));
            }
            if let Some(heading) = layout.heading {
                let turning =
                    |posture: &Posture| posture.heading_by_turning().dot(&posture.turning());
                navigation[heading] += mean(&turning);
            }
            let turned = [&before, &after].map(|x| x.turning().cross(&x.translation()));
            let turned = (turned[0] + turned[1]) * (0.5 * h);
            for (axis, (gained, offset)) in layout.gained.iter().zip(layout.offset).enumerate() {
                let Some((gained, offset)) = gained.zip(offset) else { continue };
                navigation[gained] += after.velocity[axis] - before.velocity[axis] + turned[axis];
                navigation[gained] += h * navigation[offset];
                navigation[offset] *= self.noise.instruments.fade_of_offset(h);
            }
        }
        navigation[0] *= fade;
        navigation[1] *= fade;
    }

    /// A row of derivatives by translations and rates that are axes of the plant.
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

    fn postures(&self, stop: &Stop, ends: &Ends<'_, N, M>) -> [Posture; 2] {
        let slices = &self.schedule.slices[stop.slices.clone()];
        let of = |motion: &SVector<f64, M>, others: &Vector6<f64>, down: Vector3<f64>| {
            let velocity = SVector::<f64, N>::from_fn(|i, _| motion[i]);
            let down = match M > N {
                true => Vector3::from_fn(|i, _| motion[N + i]),
                false => down,
            };
            (self.plant.to_six(&velocity, others), down)
        };
        let (first, last) = (&slices[0], &slices[slices.len() - 1]);
        let (velocity, down) = of(ends.before, &first.others[0], first.down_body[0]);
        let before = Posture { velocity, down, horizontal: stop.water_before };
        let (velocity, down) = of(ends.after, &last.others[2], last.down_body[2]);
        [before, Posture { velocity, down, horizontal: stop.water }]
    }
}

/// Motion at both ends of a step.
pub(super) struct Ends<'a, const N: usize, const M: usize> {
    pub(super) before: &'a SVector<f64, M>,
    pub(super) after: &'a SVector<f64, M>,
}

/// States of which another part is left after a step.
#[derive(Clone, Copy)]
pub(super) struct FadeChange {
    pub(super) states: [Option<usize>; 3],
    pub(super) by: f64,
}

impl<const N: usize, const M: usize> State<N, M> {
    /// Moves these states, after motion.
    pub(super) fn step_navigation(&mut self, before: &SVector<f64, M>, rows: &Rows<M>) {
        let mut after = rows.carried(&SMatrix::<f64, 1, MOST>::from_row_slice(&self.navigation));
        if let Some(moved) = &rows.moved {
            after += (apply(&moved[0], before) + apply(&moved[1], &self.motion)).transpose();
        }
        self.navigation = after.transpose().data.0[0];
    }

    /// Begins one of these states anew from zero.
    pub(super) fn forget(&mut self, state: usize) {
        self.navigation[state] = 0.0;
    }
}

/// Covariance of what was before a step with what is after it.
pub(super) struct Crossed<const N: usize, const M: usize> {
    /// Of motion with motion after it, (M, M).
    pub(super) xx: SMatrix<f64, M, M>,
    /// Of motion with the disturbance after it.
    pub(super) xf: SMatrix<f64, M, N>,
    /// Of motion and disturbance after it with these states.
    pub(super) xo: SMatrix<f64, M, MOST>,
    pub(super) fo: SMatrix<f64, N, MOST>,
}

impl<const N: usize, const M: usize> Covariance<N, M> {
    /// The same, where the step moves more than motion and disturbance.
    pub(super) fn crossed_over(&self, step: &Transition<N, M>) -> Option<Crossed<N, M>> {
        step.rows.is_some().then(|| self.crossed(step))
    }

    /// Covariance of what is before a step with what is after it.
    pub(super) fn crossed(&self, step: &Transition<N, M>) -> Crossed<N, M> {
        let (a, b) = (&step.by_motion, &step.by_disturbance);
        let mut crossed = Crossed {
            xx: times_transposed(&self.xx, a) + times_transposed(&self.xf, b),
            xf: self.xf,
            xo: times(a, &self.xo) + times(b, &self.fo),
            fo: self.fo,
        };
        for j in 0..N {
            crossed.xf.column_mut(j).scale_mut(step.fade[j]);
            crossed.fo.row_mut(j).scale_mut(step.fade[j]);
        }
        crossed
    }

    /// Covariance of each of these states before a step (row) with each after it.
    fn with_after(&self, crossed: &Crossed<N, M>, rows: &Rows<M>) -> SMatrix<f64, MOST, MOST> {
        let mut found = rows.carried(&self.oo);
        if let Some(moved) = &rows.moved {
            found += times_sparse_transposed(&self.xo.transpose(), &moved[0]);
            found += times_sparse_transposed(&crossed.xo.transpose(), &moved[1]);
        }
        found
    }

    /// Moves the covariance of these states over a step, that of motion and disturbance being moved
    /// already; `before` is what it was.
    pub(super) fn navigated(
        &mut self,
        before: &Self,
        crossed: &Crossed<N, M>,
        (rows, process): (&Rows<M>, &Self),
    ) {
        let with_after = before.with_after(crossed, rows);
        self.xo = rows.carried(&crossed.xo);
        self.fo = rows.carried(&crossed.fo);
        self.oo = rows.carried(&with_after.transpose());
        if let Some(moved) = &rows.moved {
            let [by_before, by_after] = &**moved;
            self.xo += times_sparse_transposed(&crossed.xx.transpose(), by_before);
            self.xo += times_sparse_transposed(&self.xx, by_after);
            self.fo += times_sparse_transposed(&crossed.xf.transpose(), by_before);
            self.fo += times_sparse_transposed(&self.xf.transpose(), by_after);
            let mut of_before = rows.carried(&before.xo);
            of_before += times_sparse_transposed(&before.xx, by_before);
            of_before += times_sparse_transposed(&crossed.xx, by_after);
            self.oo += times_sparse_transposed(&of_before.transpose(), by_before);
            self.oo += times_sparse_transposed(&self.xo.transpose(), by_after);
        }
        self.oo += process.oo;
        symmetrise(&mut self.oo);
    }

    /// Adds what another part that is left of some states makes of it; `nominal` is the covariance
    /// before the step.
    pub(super) fn fade_otherwise(
        &mut self,
        change: &FadeChange,
        nominal: &Self,
        crossed: &Crossed<N, M>,
        rows: &Rows<M>,
    ) {
        let with_after = nominal.with_after(crossed, rows);
        for i in change.states.into_iter().flatten() {
            let (xo, fo) = (crossed.xo.column(i) * change.by, crossed.fo.column(i) * change.by);
            self.xo.set_column(i, &(self.xo.column(i) + xo));
            self.fo.set_column(i, &(self.fo.column(i) + fo));
            for j in 0..MOST {
                self.oo[(i, j)] += change.by * with_after[(i, j)];
                self.oo[(j, i)] += change.by * with_after[(i, j)];
            }
        }
    }

    /// Begins one of these states anew, known to be zero.
    pub(super) fn forget(&mut self, state: usize) {
        self.xo.column_mut(state).fill(0.0);
        self.fo.column_mut(state).fill(0.0);
        self.oo.column_mut(state).fill(0.0);
        self.oo.row_mut(state).fill(0.0);
    }
}
