//! The way from one measurement to the next, with its sensitivities.

use nalgebra::{SMatrix, SVector, Vector3, Vector6};

use super::{Prepared, apply, times};

/// A short time with a constant force: at most 0.05 s, so that roll and pitch at some rad/s
/// carry no error of the integration.
#[derive(Clone, Debug, Default)]
pub(crate) struct Slice {
    /// Its beginning, s.
    pub(crate) from_s: f64,
    /// Its length, s.
    pub(crate) length_s: f64,
    /// k at its beginning, middle and end.
    pub(crate) down_body: [Vector3<f64>; 3],
    /// Velocities of axes that the plant does not have, at the same instants.
    pub(crate) others: [Vector6<f64>; 3],
    /// What the plant's effects read, at the same instants; empty if it has none.
    pub(crate) signals: [Vec<f64>; 3],
}

/// The force over a slice.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct HeldForce {
    /// τ, held, N and N m.
    pub(crate) force: Vector6<f64>,
    /// ∂τ by the numbers of the actuators.
    pub(crate) by: [Vector6<f64>; PUSHED_BY],
}

/// How many numbers of the actuators a force depends on: two of lag, delay, reverse-thrust ratio,
/// exponent, and two of slow changes.
pub(crate) const PUSHED_BY: usize = 7;

/// How each axis's disturbance fades: ḟ = −f/T.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decay<const N: usize> {
    /// 1/T, 1/s.
    pub(crate) rate: SVector<f64, N>,
}

/// Where a state goes over some slices, and how that changes.
pub(crate) struct Flow<const N: usize> {
    /// ν_r at the end.
    pub(crate) velocity: SVector<f64, N>,
    /// Its columns: by ν_r at the beginning (N), by the disturbance there (N), by each
    /// coefficient and by the numbers of the actuators, if these were asked for.
    pub(crate) columns: Vec<SVector<f64, N>>,
    /// What drives each column in the middle of a slice.
    sources: Vec<SVector<f64, N>>,
}

impl<const N: usize> Flow<N> {
    /// A flow with columns for the state alone.
    pub(crate) fn of_state() -> Self {
        Self::with_columns(2 * N)
    }

    /// A flow with columns for so many coefficients, and for the actuators, too.
    pub(crate) fn of_plant(coefficients: usize) -> Self {
        Self::with_columns(2 * N + coefficients + PUSHED_BY)
    }

    /// A flow with columns for the state and for so many coefficients.
    pub(crate) fn of_coefficients(count: usize) -> Self {
        Self::with_columns(2 * N + count)
    }

    /// A flow without derivatives.
    pub(crate) fn bare() -> Self {
        Self::with_columns(0)
    }

    fn with_columns(count: usize) -> Self {
        let columns = vec![SVector::zeros(); count];
        Self { velocity: SVector::zeros(), sources: columns.clone(), columns }
    }

    /// ∂ν(end)/∂ν(beginning), shape (N, N).
    pub(crate) fn by_velocity(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| self.columns[j][i])
    }

    /// ∂ν(end)/∂f(beginning), shape (N, N).
    pub(crate) fn by_disturbance(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| self.columns[N + j][i])
    }

    /// ∂ν(end)/∂θ at a given beginning, of the coefficients and the actuators.
    pub(crate) fn by_plant(&self) -> &[SVector<f64, N>] {
        &self.columns[2 * N..]
    }

    fn start(&mut self, velocity: &SVector<f64, N>) {
        self.velocity = *velocity;
        for (j, column) in self.columns.iter_mut().enumerate() {
            *column = SVector::zeros();
            if j < N {
                column[j] = 1.0;
            }
        }
    }
}

/// Follows a plant through slices by the classical Runge–Kutta method.
///
/// The columns are those of the motion linearised in the middle of each slice, `ẋ = A x + s`:
/// derivatives to the second order of h. That moves no estimate: the slope of a cost vanishes where its
/// errors are noise, whatever they are weighted with.
pub(crate) fn advance<const N: usize>(
    plant: &Prepared<N>,
    (slices, pushes): (&[Slice], &[HeldForce]),
    velocity: &SVector<f64, N>,
    disturbance: &SVector<f64, N>,
    decay: &Decay<N>,
    flow: &mut Flow<N>,
) {
    flow.start(velocity);
    let mut left = SVector::<f64, N>::repeat(1.0);
    for (slice, push) in slices.iter().zip(pushes) {
        let half = decay.rate.map(|rate| (-0.5 * rate * slice.length_s).exp());
        let middle = left.component_mul(&half);
        let lefts = [left, middle, middle.component_mul(&half)];
        step(plant, (slice, push), disturbance, &lefts, flow);
        left = lefts[2];
    }
}

/// Where in a slice each stage is, and which of its instants that is.
const STAGES: [(f64, usize); 4] = [(0.0, 0), (0.5, 1), (0.5, 1), (1.0, 2)];
/// How much each stage counts.
const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// A slice; `lefts` is what is left of the disturbance at its three instants.
fn step<const N: usize>(
    plant: &Prepared<N>,
    (slice, push): (&Slice, &HeldForce),
    disturbance: &SVector<f64, N>,
    lefts: &[SVector<f64, N>; 3],
    flow: &mut Flow<N>,
) {
    let h = slice.length_s;
    let force = plant.on_axes(&push.force);
    let mut rates = [SVector::<f64, N>::zeros(); 4];
    for (stage, (part, instant)) in STAGES.into_iter().enumerate() {
        let behind = if stage == 0 { SVector::zeros() } else { rates[stage - 1] * (part * h) };
        let six = plant.to_six(&(flow.velocity + behind), &slice.others[instant]);
        let force = force + disturbance.component_mul(&lefts[instant]);
        rates[stage] = plant.rate(&six, &slice.down_body[instant], &force, &slice.signals[instant]);
    }
    if !flow.columns.is_empty() {
        // The third stage is in the middle of the slice.
        let six = plant.to_six(&(flow.velocity + rates[1] * (0.5 * h)), &slice.others[1]);
        let signals = &slice.signals[1];
        let (transition, share) = linearised(&plant.slope(&six, signals), h);
        let (of_state, of_plant) = flow.sources.split_at_mut(2 * N);
        let mean_left = (lefts[0] + lefts[1] * 4.0 + lefts[2]) / 6.0;
        for j in 0..N {
            of_state[N + j] = plant.inverse().column(j) * mean_left[j];
        }
        if !of_plant.is_empty() {
            let (coefficients, actuators) = of_plant.split_at_mut(plant.count());
            let down = &slice.down_body[1];
            plant.by_coefficient(&six, down, &rates[2], signals, coefficients);
            for (source, by) in actuators.iter_mut().zip(&push.by) {
                *source = apply(plant.inverse(), &plant.on_axes(by));
            }
        }
        for (column, source) in flow.columns.iter_mut().zip(&flow.sources) {
            *column = apply(&transition, column) + apply(&share, source);
        }
    }
    for (rate, weight) in rates.iter().zip(WEIGHTS) {
        flow.velocity += rate * (weight * h);
    }
}

/// What `ẋ = A x + s` makes of x and of s over h: `e^(A h)` and `∫₀ʰ e^(A t) dt`, to the fourth power
/// of h.
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

    /// Central differences over 1e-6 of numbers of order one.
    const DIFFERENCE: f64 = 1e-7;

    /// Slices of a tenth of a second, so short that what lies in the middle of one stands for all of it
    /// as exactly as differences tell.
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
        let of = |k: usize| Slice {
            from_s: length_s * k as f64,
            length_s,
            down_body: [0.0, 0.5, 1.0].map(|part| down_body(0.1, pitch(k, part))),
            others: [Vector6::new(0.0, 0.1, 0.0, 0.2, 0.0, 0.3); 3],
            signals: [const { Vec::new() }; 3],
        };
        (0..SLICES).map(of).collect()
    }

    /// A force that depends on the first number of the actuators.
    fn push(lag: f64) -> HeldForce {
        let by = Vector6::new(-30.0, 0.0, 0.0, 0.0, 2.0, 0.0);
        let force = Vector6::new(20.0, 0.0, 0.0, 0.0, 0.3, 0.0) + lag * by;
        HeldForce { force, by: std::array::from_fn(|k| if k == 0 { by } else { Vector6::zeros() }) }
    }

    #[test]
    fn columns_are_the_derivatives_of_the_flow() {
        let decay = Decay { rate: SVector::from([0.3, 0.7]) };
        let slices = slices();
        let base = plant(6.6);
        let pushed = |plant: &Plant, velocity: [f64; 2], disturbance: [f64; 2], lag: f64| {
            let prepared = Prepared::<2>::new(plant).expect("two axes");
            let mut flow = Flow::of_plant(prepared.count());
            let (velocity, disturbance) = (velocity.into(), disturbance.into());
            let pushes = vec![push(lag); SLICES];
            advance(&prepared, (&slices, &pushes), &velocity, &disturbance, &decay, &mut flow);
            flow
        };
        let end = |plant: &Plant, velocity, disturbance| pushed(plant, velocity, disturbance, 0.0);
        let (velocity, disturbance) = ([0.5, -0.3], [1.0, 0.1]);
        let flow = end(&base, velocity, disturbance);
        let moved = |x: [f64; 2], j: usize, step: f64| {
            let mut moved = x;
            moved[j] += step;
            moved
        };
        for j in 0..2 {
            let at = |step| end(&base, moved(velocity, j, step), disturbance).velocity;
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((slope - flow.by_velocity().column(j)).amax() < DIFFERENCE);
            let at = |step| end(&base, velocity, moved(disturbance, j, step)).velocity;
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((slope - flow.by_disturbance().column(j)).amax() < DIFFERENCE);
        }
        let at = |step: f64| end(&plant(6.6 + step), velocity, disturbance).velocity;
        let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
        assert!((slope - flow.by_plant()[7]).amax() < DIFFERENCE);
        let at = |step: f64| pushed(&base, velocity, disturbance, step).velocity;
        let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
        assert!((slope - flow.by_plant()[8]).amax() < DIFFERENCE);
    }
}
