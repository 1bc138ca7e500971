//! The way from one measurement to the next, with its sensitivities.

use nalgebra::{SMatrix, SVector, Vector3, Vector6};

use super::Prepared;

/// A short time with a constant force: at most 0.05 s, so that roll and pitch at some rad/s
/// carry no error of the integration.
#[derive(Clone, Debug)]
pub(crate) struct Slice {
    /// Its length, s.
    pub(crate) length_s: f64,
    /// τ, held, N and N m.
    pub(crate) force: Vector6<f64>,
    /// k at its beginning, middle and end.
    pub(crate) down_body: [Vector3<f64>; 3],
    /// Velocities of axes that the plant does not have, at the same instants.
    pub(crate) others: [Vector6<f64>; 3],
    /// What the plant's effects read, at the same instants; empty if it has none.
    pub(crate) signals: [Vec<f64>; 3],
}

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
    /// coefficient, if these were asked for.
    pub(crate) columns: Vec<SVector<f64, N>>,
    stages: [Vec<SVector<f64, N>>; 4],
}

impl<const N: usize> Flow<N> {
    /// A flow with columns for so many coefficients.
    pub(crate) fn new(coefficients: usize) -> Self {
        Self::with_columns(2 * N + coefficients)
    }

    /// A flow without derivatives.
    pub(crate) fn bare() -> Self {
        Self::with_columns(0)
    }

    fn with_columns(count: usize) -> Self {
        let columns = vec![SVector::zeros(); count];
        Self {
            velocity: SVector::zeros(),
            columns: columns.clone(),
            stages: std::array::from_fn(|_| columns.clone()),
        }
    }

    /// ∂ν(end)/∂ν(beginning), shape (N, N).
    pub(crate) fn by_velocity(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| self.columns[j][i])
    }

    /// ∂ν(end)/∂f(beginning), shape (N, N).
    pub(crate) fn by_disturbance(&self) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|i, j| self.columns[N + j][i])
    }

    /// ∂ν(end)/∂θ at a given beginning.
    pub(crate) fn by_coefficient(&self) -> &[SVector<f64, N>] {
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

/// Follows a plant through slices by the classical Runge–Kutta method; the columns are the
/// exact derivatives of its steps.
pub(crate) fn advance<const N: usize>(
    plant: &Prepared<N>,
    slices: &[Slice],
    velocity: &SVector<f64, N>,
    disturbance: &SVector<f64, N>,
    decay: &Decay<N>,
    flow: &mut Flow<N>,
) {
    flow.start(velocity);
    let mut elapsed_s = 0.0;
    for slice in slices {
        step(plant, slice, disturbance, decay, elapsed_s, flow);
        elapsed_s += slice.length_s;
    }
}

/// Where in a slice each stage is, and which of its instants that is.
const STAGES: [(f64, usize); 4] = [(0.0, 0), (0.5, 1), (0.5, 1), (1.0, 2)];
/// How much each stage counts.
const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

fn step<const N: usize>(
    plant: &Prepared<N>,
    slice: &Slice,
    disturbance: &SVector<f64, N>,
    decay: &Decay<N>,
    elapsed_s: f64,
    flow: &mut Flow<N>,
) {
    let h = slice.length_s;
    let force = plant.on_axes(&slice.force);
    let mut rates = [SVector::<f64, N>::zeros(); 4];
    let mut slopes = [SMatrix::<f64, N, N>::zeros(); 4];
    for (stage, (part, instant)) in STAGES.into_iter().enumerate() {
        let behind = if stage == 0 { SVector::zeros() } else { rates[stage - 1] * (part * h) };
        let six = plant.to_six(&(flow.velocity + behind), &slice.others[instant]);
        let (down, signals) = (&slice.down_body[instant], &slice.signals[instant]);
        let left = decay.rate.map(|rate| (-rate * (elapsed_s + part * h)).exp());
        rates[stage] = plant.rate(&six, down, &(force + disturbance.component_mul(&left)), signals);
        if flow.columns.is_empty() {
            continue;
        }
        slopes[stage] = plant.slope(&six, signals);
        let sources = &mut flow.stages[stage];
        for j in 0..N {
            sources[N + j] = plant.inverse().column(j) * left[j];
        }
        if sources.len() > 2 * N {
            plant.by_coefficient(&six, down, &rates[stage], signals, &mut sources[2 * N..]);
        }
    }
    for (j, column) in flow.columns.iter_mut().enumerate() {
        let mut sum = SVector::zeros();
        let mut slope = SVector::<f64, N>::zeros();
        for (stage, (part, _)) in STAGES.into_iter().enumerate() {
            let at = if stage == 0 { *column } else { *column + slope * (part * h) };
            slope = slopes[stage] * at + flow.stages[stage][j];
            sum += slope * (WEIGHTS[stage] * h);
        }
        *column += sum;
    }
    for (rate, weight) in rates.iter().zip(WEIGHTS) {
        flow.velocity += rate * (weight * h);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dof;
    use crate::motion::down_body;
    use crate::plant::{Plant, Structure, Symmetry};

    /// Central differences over 1e-6 of numbers of order one.
    const DIFFERENCE: f64 = 1e-7;

    fn plant(lever: f64) -> Plant {
        let axes = [Dof::Surge, Dof::Pitch];
        let structure = Structure::of(&axes, Symmetry::PortStarboard).expect("two axes");
        // M11, M15, M55, surge u, |u|u, pitch q, |q|q, lever z.
        Plant::new(structure, vec![20.0, 0.9, 0.4, 13.0, 140.0, 0.8, 0.5, lever]).expect("possible")
    }

    fn slices() -> Vec<Slice> {
        let of = |k: usize| Slice {
            length_s: 0.05,
            force: Vector6::new(20.0, 0.0, 0.0, 0.0, 0.3, 0.0),
            down_body: [0.0, 0.5, 1.0].map(|part| down_body(0.1, 0.2 + 0.05 * (k as f64 + part))),
            others: [Vector6::new(0.0, 0.1, 0.0, 0.2, 0.0, 0.3); 3],
            signals: [const { Vec::new() }; 3],
        };
        (0..2).map(of).collect()
    }

    #[test]
    fn columns_are_the_derivatives_of_the_flow() {
        let decay = Decay { rate: SVector::from([0.3, 0.7]) };
        let slices = slices();
        let base = plant(6.6);
        let end = |plant: &Plant, velocity: [f64; 2], disturbance: [f64; 2], count: usize| {
            let prepared = Prepared::<2>::new(plant).expect("two axes");
            let mut flow = Flow::new(count);
            let (velocity, disturbance) = (velocity.into(), disturbance.into());
            advance(&prepared, &slices, &velocity, &disturbance, &decay, &mut flow);
            flow
        };
        let (velocity, disturbance) = ([0.5, -0.3], [1.0, 0.1]);
        let flow = end(&base, velocity, disturbance, 8);
        let moved = |x: [f64; 2], j: usize, step: f64| {
            let mut moved = x;
            moved[j] += step;
            moved
        };
        for j in 0..2 {
            let at = |step| end(&base, moved(velocity, j, step), disturbance, 0).velocity;
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((slope - flow.by_velocity().column(j)).amax() < DIFFERENCE);
            let at = |step| end(&base, velocity, moved(disturbance, j, step), 0).velocity;
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((slope - flow.by_disturbance().column(j)).amax() < DIFFERENCE);
        }
        let at = |step: f64| end(&plant(6.6 + step), velocity, disturbance, 0).velocity;
        let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
        assert!((slope - flow.by_coefficient()[7]).amax() < DIFFERENCE);
    }
}
