//! Integration of the motion between measurements, with its sensitivities.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector6};

use super::{Prepared, apply, times};
use crate::series::ROUNDING_S;

/// An interval of constant force, at most 0.05 s, short enough that the integration error of roll
/// and pitch at some rad/s is negligible.
#[derive(Clone, Debug, Default)]
pub(crate) struct Slice {
    /// Start, s.
    pub(crate) from_s: f64,
    /// Duration, s.
    pub(crate) length_s: f64,
    /// What is prescribed; slices in which that is the same share it.
    pub(crate) around: Arc<Around>,
    /// Values of the plant's signals at its start, middle and end; empty if it has none.
    pub(crate) signals: [Vec<f64>; 3],
    /// Index of the known forces that act, among those of the plant; `None` if none acts.
    pub(crate) load: Option<usize>,
}

/// Attitude and motion of what is not in the plant, at the start, middle and end of a slice.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Around {
    /// k.
    pub(crate) down_body: [Vector3<f64>; 3],
    /// Velocities of axes outside the plant.
    pub(crate) others: [Vector6<f64>; 3],
}

/// The force over a slice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldForce<'a> {
    /// τ by axis of the plant, constant, N and N m.
    pub(crate) force: &'a [f64],
    /// ∂τ by the actuator parameters, one after the other.
    by: &'a [f64],
}

impl HeldForce<'_> {
    /// Returns ∂τ by an actuator parameter.
    pub(crate) fn by(&self, parameter: usize) -> &[f64] {
        let axes = self.force.len();
        &self.by[parameter * axes..][..axes]
    }
}

/// The forces over some slices, one after the other.
#[derive(Clone, Debug)]
pub(crate) struct HeldForces {
    /// Number of axes of the plant.
    axes: usize,
    /// By slice: τ, and ∂τ by each actuator parameter.
    numbers: Vec<f64>,
}

impl HeldForces {
    /// Returns forces of zero.
    pub(crate) fn zeros(axes: usize, slices: usize) -> Self {
        Self { axes, numbers: vec![0.0; axes * (1 + PUSHED_BY) * slices] }
    }

    const fn stride(&self) -> usize {
        self.axes * (1 + PUSHED_BY)
    }

    /// Returns that over each slice.
    pub(crate) fn each(&self) -> impl Iterator<Item = HeldForce<'_>> {
        self.of(&self.numbers)
    }

    /// Returns that over each of a range of slices.
    pub(crate) fn over(&self, slices: Range<usize>) -> impl Iterator<Item = HeldForce<'_>> {
        self.of(&self.numbers[self.stride() * slices.start..self.stride() * slices.end])
    }

    fn of<'a>(&'a self, numbers: &'a [f64]) -> impl Iterator<Item = HeldForce<'a>> {
        numbers.chunks_exact(self.stride()).map(|own| {
            let (force, by) = own.split_at(self.axes);
            HeldForce { force, by }
        })
    }

    /// Returns τ over each slice, followed by its derivatives.
    pub(crate) fn each_mut(&mut self) -> impl Iterator<Item = (&mut [f64], &mut [f64])> {
        let (axes, stride) = (self.axes, self.stride());
        self.numbers.chunks_exact_mut(stride).map(move |own| own.split_at_mut(axes))
    }
}

/// Number of actuator parameters on which a force depends: three of lag, delay, reverse-thrust ratio,
/// two exponents, slew time, dead band, two of slow changes, one of load, and the scale of all.
pub(crate) const PUSHED_BY: usize = 13;

/// Decay of each axis's disturbance: ḟ = −f/T.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decay<const N: usize> {
    /// 1/T, 1/s.
    pub(crate) rate: SVector<f64, N>,
}

/// The state after some slices, and its derivatives.
///
/// The motion consists of the N entries of ν_r and, if M = N + 3, the world's down in body axes;
/// otherwise that is prescribed by the slices.
pub(crate) struct Flow<const N: usize, const M: usize> {
    /// The motion at the end.
    pub(crate) motion: SVector<f64, M>,
    /// What is left of the disturbance at the end, over what it was at the start.
    pub(crate) left: SVector<f64, N>,
    /// Derivatives of the motion by that at the start (M), by the disturbance there (N), and by each
    /// coefficient and actuator parameter, if requested.
    pub(crate) columns: Vec<SVector<f64, M>>,
    /// The requested actuator parameters.
    parameters: Vec<usize>,
    /// The forcing of each derivative in the middle of a slice.
    sources: Vec<SVector<f64, N>>,
    /// The decay over half of the last slice: most slices are as long as those before them.
    half: HalfDecay<N>,
}

/// What is left of a disturbance after half of a slice.
#[derive(Clone, Copy)]
struct HalfDecay<const N: usize> {
    rate: SVector<f64, N>,
    length_s: f64,
    left: SVector<f64, N>,
}

impl<const N: usize> HalfDecay<N> {
    /// Computes it anew for a slice of another length, or at other rates.
    fn over(&mut self, rate: &SVector<f64, N>, length_s: f64) -> SVector<f64, N> {
        if (length_s - self.length_s).abs() > ROUNDING_S || *rate != self.rate {
            let left = rate.map(|rate| (-0.5 * rate * length_s).exp());
            *self = Self { rate: *rate, length_s, left };
        }
        self.left
    }
}

impl<const N: usize, const M: usize> Flow<N, M> {
    /// Creates a flow with derivatives by the state.
    pub(crate) fn of_state() -> Self {
        Self::with_columns(M + N)
    }

    /// Creates a flow with derivatives by the state, the coefficients and some actuator parameters.
    pub(crate) fn of_plant(coefficients: usize, parameters: &[usize]) -> Self {
        let columns = M + N + coefficients + parameters.len();
        Self { parameters: parameters.to_vec(), ..Self::with_columns(columns) }
    }

    /// Creates a flow with derivatives by the state and the coefficients.
    pub(crate) fn of_coefficients(count: usize) -> Self {
        Self::with_columns(M + N + count)
    }

    /// Creates a flow without derivatives.
    pub(crate) fn bare() -> Self {
        Self::with_columns(0)
    }

    fn with_columns(count: usize) -> Self {
        Self {
            motion: SVector::zeros(),
            left: SVector::zeros(),
            columns: vec![SVector::zeros(); count],
            parameters: Vec::new(),
            sources: vec![SVector::zeros(); count.saturating_sub(M)],
            half: HalfDecay { rate: SVector::zeros(), length_s: 0.0, left: SVector::repeat(1.0) },
        }
    }

    /// Returns ∂x(end)/∂x(start) of the motion x, shape (M, M).
    pub(crate) fn by_motion(&self) -> SMatrix<f64, M, M> {
        SMatrix::from_fn(|i, j| self.columns[j][i])
    }

    /// Returns ∂x(end)/∂f(start), shape (M, N).
    pub(crate) fn by_disturbance(&self) -> SMatrix<f64, M, N> {
        SMatrix::from_fn(|i, j| self.columns[M + j][i])
    }

    /// Returns ∂x(end)/∂θ at a fixed start, θ being the coefficients and the requested actuator
    /// parameters.
    pub(crate) fn by_plant(&self) -> &[SVector<f64, M>] {
        &self.columns[M + N..]
    }

    fn start(&mut self, motion: &SVector<f64, M>) {
        self.motion = *motion;
        for (j, column) in self.columns.iter_mut().enumerate() {
            *column = SVector::zeros();
            if j < M {
                column[j] = 1.0;
            }
        }
    }
}

/// Integrates a plant's motion over slices by the classical Runge–Kutta method.
///
/// The derivatives are those of the motion linearised in the middle of each slice, `ẋ = A x + s`,
/// and of second order in h. Their error does not bias estimates: at the optimum the gradient
/// vanishes for errors that are noise, whatever their weights.
pub(crate) fn advance<'a, const N: usize, const M: usize>(
    plant: &Prepared<N>,
    (slices, pushes): (&[Slice], impl Iterator<Item = HeldForce<'a>>),
    motion: &SVector<f64, M>,
    disturbance: &SVector<f64, N>,
    decay: &Decay<N>,
    flow: &mut Flow<N, M>,
) {
    flow.start(motion);
    let mut left = SVector::<f64, N>::repeat(1.0);
    for (index, (slice, push)) in slices.iter().zip(pushes).enumerate() {
        let half = flow.half.over(&decay.rate, slice.length_s);
        let middle = left.component_mul(&half);
        let remaining = [left, middle, middle.component_mul(&half)];
        step(plant, (slice, push), (disturbance, &remaining), index == 0, flow);
        left = remaining[2];
    }
    flow.left = left;
}

/// Time of each stage as a fraction of the slice, and the index of that instant.
const STAGES: [(f64, usize); 4] = [(0.0, 0), (0.5, 1), (0.5, 1), (1.0, 2)];
/// Weight of each stage.
const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// Integrates one slice; `remaining` is the fraction of the disturbance left at its three instants,
/// and `is_first` is true where no derivative but that by the motion has begun.
fn step<const N: usize, const M: usize>(
    plant: &Prepared<N>,
    (slice, push): (&Slice, HeldForce<'_>),
    (disturbance, remaining): (&SVector<f64, N>, &[SVector<f64, N>; 3]),
    is_first: bool,
    flow: &mut Flow<N, M>,
) {
    let plant = plant.under(slice.load);
    let h = slice.length_s;
    let around = &*slice.around;
    let force = padded::<N>(push.force);
    let down_at = |motion: &SVector<f64, M>, instant: usize| {
        down_of::<N, M>(motion).unwrap_or(around.down_body[instant])
    };
    let mut rates = [SVector::<f64, M>::zeros(); 4];
    let mut acceleration = SVector::zeros();
    for (stage, (part, instant)) in STAGES.into_iter().enumerate() {
        let behind = if stage == 0 { SVector::zeros() } else { rates[stage - 1] * (part * h) };
        let motion = flow.motion + behind;
        let (mut six, down) = (around.others[instant], down_at(&motion, instant));
        plant.put(motion.as_slice(), &mut six);
        let force = force + disturbance.component_mul(&remaining[instant]);
        let own = plant.rate(&six, &down, &force, &slice.signals[instant]);
        rates[stage] = with_down(&own, || down.cross(&turn(&six)));
        if stage == 2 {
            acceleration = own;
        }
    }
    if !flow.columns.is_empty() {
        // The third stage is in the middle of the slice.
        let motion = flow.motion + rates[1] * (0.5 * h);
        let (mut six, down) = (around.others[1], down_at(&motion, 1));
        plant.put(motion.as_slice(), &mut six);
        let signals = &slice.signals[1];
        let (transition, share) = linearised(&slope::<N, M>(plant, &six, &down, signals), h);
        let share = SMatrix::<f64, M, N>::from_fn(|i, j| share[(i, j)]);
        let (of_motion, driven) = flow.columns.split_at_mut(M);
        let (of_disturbance, of_plant) = flow.sources.split_at_mut(N);
        let mean_left = (remaining[0] + remaining[1] * 4.0 + remaining[2]) / 6.0;
        for (j, source) in of_disturbance.iter_mut().enumerate() {
            *source = plant.inverse().column(j) * mean_left[j];
        }
        if !of_plant.is_empty() {
            let (coefficients, actuators) = of_plant.split_at_mut(plant.count());
            plant.by_coefficient(&six, &down, &acceleration, signals, coefficients);
            for (source, &parameter) in actuators.iter_mut().zip(&flow.parameters) {
                *source = apply(plant.inverse(), &padded::<N>(push.by(parameter)));
            }
        }
        let driven = driven.iter_mut().zip(&flow.sources);
        if is_first {
            of_motion
                .iter_mut()
                .enumerate()
                .for_each(|(j, own)| *own = transition.column(j).into());
            driven.for_each(|(column, source)| *column = apply(&share, source));
        } else {
            of_motion.iter_mut().for_each(|column| *column = apply(&transition, column));
            driven.for_each(|(column, source)| {
                *column = apply(&transition, column) + apply(&share, source);
            });
        }
    }
    for (rate, weight) in rates.iter().zip(WEIGHTS) {
        flow.motion += rate * (weight * h);
    }
}

/// Returns numbers of the axes of a plant, with zeros up to N.
fn padded<const N: usize>(of_axes: &[f64]) -> SVector<f64, N> {
    SVector::from_fn(|i, _| of_axes.get(i).copied().unwrap_or(0.0))
}

/// Returns the world's down in body axes, if it is part of the motion.
fn down_of<const N: usize, const M: usize>(motion: &SVector<f64, M>) -> Option<Vector3<f64>> {
    (M > N).then(|| Vector3::from_fn(|i, _| motion[N + i]))
}

/// Returns the velocity followed by the world's down in body axes, if that is part of the motion.
pub(crate) fn with_down<const N: usize, const M: usize>(
    velocity: &SVector<f64, N>,
    down: impl FnOnce() -> Vector3<f64>,
) -> SVector<f64, M> {
    let down = if M > N { down() } else { Vector3::zeros() };
    SVector::from_fn(|i, _| if i < N { velocity[i] } else { down[i - N] })
}

/// Returns ω.
fn turn(velocity: &Vector6<f64>) -> Vector3<f64> {
    velocity.fixed_rows::<3>(3).into_owned()
}

/// Returns ∂ẋ/∂x of the motion: of ν̇, and of `k̇ = k × ω`.
fn slope<const N: usize, const M: usize>(
    plant: &Prepared<N>,
    velocity: &Vector6<f64>,
    down: &Vector3<f64>,
    signals: &[f64],
) -> SMatrix<f64, M, M> {
    let of_velocity = plant.slope(velocity, signals);
    let mut slope = SMatrix::zeros();
    for j in 0..N {
        for i in 0..N {
            slope[(i, j)] = of_velocity[(i, j)];
        }
    }
    if M > N {
        let by_down = plant.slope_by_down();
        let (turned, by_turn): (Matrix3<f64>, Matrix3<f64>) =
            (-turn(velocity).cross_matrix(), down.cross_matrix());
        for j in 0..3 {
            for i in 0..N {
                slope[(i, N + j)] = by_down[(i, j)];
            }
            for i in 0..3 {
                slope[(N + i, N + j)] = turned[(i, j)];
            }
        }
        for (place, axis) in plant.axes().iter().enumerate() {
            if let Some(axis @ 3..) = axis {
                for i in 0..3 {
                    slope[(N + i, place)] = by_turn[(i, axis - 3)];
                }
            }
        }
    }
    slope
}

/// Returns the discrete transition of `ẋ = A x + s` over h: `e^(A h)` and `∫₀ʰ e^(A t) dt`, to the
/// fourth power of h.
fn linearised<const N: usize>(
    a: &SMatrix<f64, N, N>,
    h: f64,
) -> (SMatrix<f64, N, N>, SMatrix<f64, N, N>) {
    let (one, x) = (SMatrix::<f64, N, N>::identity(), a * h);
    let mut mean = one + x / 4.0;
    for power in [3.0, 2.0] {
        mean = one + times(&x, &mean) / power;
    }
    (one + times(&x, &mean), mean * h)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dof;
    use crate::motion::down_body;
    use crate::plant::{Plant, Structure, Symmetry};

    /// Error of central differences over 1e-6 of numbers of order one.
    const DIFFERENCE: f64 = 1e-7;

    /// Number of slices in a tenth of a second: short enough that the linearisation at their middle
    /// is exact to the accuracy of differences.
    const SLICES: usize = 1000;

    fn plant(lever: f64) -> Plant {
        let axes = [Dof::Surge, Dof::Pitch];
        let structure = Structure::of(&axes, Symmetry::PortStarboard).expect("two axes");
        // M11, M15, M55, surge u, |u|u, pitch q, |q|q, lever z.
        Plant::new(structure, vec![20.0, 0.9, 0.4, 13.0, 140.0, 0.8, 0.5, lever]).expect("possible")
    }

    fn slices() -> Vec<Slice> {
        let length_s = 0.1 / SLICES as f64;
        let pitch = |k: usize, part: f64| 0.2 + length_s * (k as f64 + part);
        let slice = |k: usize| Slice {
            from_s: length_s * k as f64,
            length_s,
            around: Arc::new(Around {
                down_body: [0.0, 0.5, 1.0].map(|part| down_body(0.1, pitch(k, part))),
                others: [Vector6::new(0.0, 0.1, 0.0, 0.2, 0.0, 0.3); 3],
            }),
            signals: [const { Vec::new() }; 3],
            load: None,
        };
        (0..SLICES).map(slice).collect()
    }

    /// Returns forces that depend on the first actuator parameter.
    fn pushes(lag: f64, slices: usize) -> HeldForces {
        let mut pushes = HeldForces::zeros(2, slices);
        for (force, by) in pushes.each_mut() {
            by[..2].copy_from_slice(&[-30.0, 2.0]);
            force.copy_from_slice(&[20.0 - 30.0 * lag, 0.3 + 2.0 * lag]);
        }
        pushes
    }

    /// Returns the motion at the end, from a motion, a disturbance and a lag.
    fn pushed<const M: usize>(
        plant: &Plant,
        motion: SVector<f64, M>,
        disturbance: SVector<f64, 2>,
        lag: f64,
    ) -> Flow<2, M> {
        let decay = Decay { rate: SVector::from([0.3, 0.7]) };
        let prepared = Prepared::<2>::new(plant).expect("two axes");
        let mut flow = Flow::of_plant(prepared.count(), &[0]);
        let pushes = pushes(lag, SLICES);
        let driven = (&slices()[..], pushes.each());
        advance(&prepared, driven, &motion, &disturbance, &decay, &mut flow);
        flow
    }

    fn check<const M: usize>(motion: SVector<f64, M>) {
        let (base, disturbance) = (plant(6.6), SVector::from([1.0, 0.1]));
        let flow = pushed(&base, motion, disturbance, 0.0);
        let near = |at: &dyn Fn(f64) -> SVector<f64, M>, column: &SVector<f64, M>, what: &str| {
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((slope - column).amax() < DIFFERENCE, "{what}: {slope} {column}");
        };
        for j in 0..M {
            let end = |step: f64| {
                let mut moved = motion;
                moved[j] += step;
                pushed(&base, moved, disturbance, 0.0).motion
            };
            near(&end, &flow.by_motion().column(j).into(), &format!("motion {j}"));
        }
        for j in 0..2 {
            let end = |step: f64| {
                let mut moved = disturbance;
                moved[j] += step;
                pushed(&base, motion, moved, 0.0).motion
            };
            near(&end, &flow.by_disturbance().column(j).into(), &format!("disturbance {j}"));
        }
        let of_lever = |step: f64| pushed(&plant(6.6 + step), motion, disturbance, 0.0).motion;
        near(&of_lever, &flow.by_plant()[7], "lever");
        let of_lag = |step: f64| pushed(&base, motion, disturbance, step).motion;
        near(&of_lag, &flow.by_plant()[8], "lag");
    }

    #[test]
    fn columns_are_the_derivatives_of_the_flow() {
        check(SVector::from([0.5, -0.3]));
        let down = down_body(0.1, 0.2);
        check(SVector::from([0.5, -0.3, down.x, down.y, down.z]));
    }

    #[test]
    fn the_worlds_down_turns_opposite_to_the_vehicle() {
        let (roll, pitch) = (0.4_f64, -0.3_f64);
        let down = down_body(roll, pitch);
        let motion = SVector::from([0.5, -0.3, down.x, down.y, down.z]);
        let flow = pushed(&plant(6.6), motion, SVector::zeros(), 0.0);
        // By Euler angles, with p and r from the slices and q from the plant.
        let mut angles = (roll, pitch);
        let after = |k: usize| {
            let part = &slices()[..k];
            let decay = Decay { rate: SVector::from([0.3, 0.7]) };
            let prepared = Prepared::<2>::new(&plant(6.6)).expect("two axes");
            let (mut bare, pushes) = (Flow::bare(), pushes(0.0, k));
            advance(
                &prepared,
                (part, pushes.each()),
                &motion,
                &SVector::zeros(),
                &decay,
                &mut bare,
            );
            bare.motion[1]
        };
        let h = 0.1 / 20.0;
        for k in 0..20 {
            let (p, q, r) = (0.2, after(50 * k + 25), 0.3);
            let across = q * angles.0.sin() + r * angles.0.cos();
            let turned = q * angles.0.cos() - r * angles.0.sin();
            angles = (angles.0 + h * (p + angles.1.tan() * across), angles.1 + h * turned);
        }
        let expected = down_body(angles.0, angles.1);
        // Euler's method in steps of 5 ms.
        let off = (down_of::<2, 5>(&flow.motion).expect("a part of it") - expected).norm();
        assert!(off < 2e-4, "{off}");
    }
}
