//! Random numbers and processes.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Draws from the standard normal distribution.
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}

/// Draws a first-order Gauss–Markov process, stationary from the start; `correlation` is its
/// correlation time in steps.
///
/// `f_{k+1} = a f_k + σ √(1 − a²) n_k` with a = exp(−1 / `correlation`).
pub fn gauss_markov(mut rng: ChaCha8Rng, std: f64, correlation: f64, count: usize) -> Vec<f64> {
    let keep = (-1.0 / correlation).exp();
    let renew = (1.0 - keep * keep).sqrt();
    let mut x = normal(&mut rng);
    let mut path = Vec::with_capacity(count);
    for _ in 0..count {
        path.push(std * x);
        x = keep * x + renew * normal(&mut rng);
    }
    path
}

/// Draws a stochastic cycle, stationary from the start: a process in a narrow band about one
/// frequency, of which a step turns by `angle`, rad, and leaves the part ρ = `keep`.
///
/// `z_{k+1} = ρ e^{i angle} z_k + σ √(1 − ρ²) n_k` with complex z and n, of which z's real part is drawn.
pub fn stochastic_cycle(
    mut rng: ChaCha8Rng,
    std: f64,
    (angle, keep): (f64, f64),
    count: usize,
) -> Vec<f64> {
    let (sin, cos) = angle.sin_cos();
    let renew = (1.0 - keep * keep).sqrt();
    let (mut x, mut y) = (normal(&mut rng), normal(&mut rng));
    let mut path = Vec::with_capacity(count);
    for _ in 0..count {
        path.push(std * x);
        (x, y) = (
            keep * (cos * x - sin * y) + renew * normal(&mut rng),
            keep * (sin * x + cos * y) + renew * normal(&mut rng),
        );
    }
    path
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn a_cycle_has_its_standard_deviation_and_turns_by_its_angle() {
        let (angle, keep) = (0.3, 0.98);
        let path = stochastic_cycle(ChaCha8Rng::seed_from_u64(1), 2.0, (angle, keep), 200_000);
        let lagged = |lag: usize| {
            let pairs = path.iter().zip(&path[lag..]);
            pairs.map(|(a, b)| a * b).sum::<f64>() / (path.len() - lag) as f64
        };
        // 200 000 steps of which about fifty say as much as one.
        assert!((lagged(0) / 4.0 - 1.0).abs() < 0.06, "{}", lagged(0));
        for lag in [1, 5, 20] {
            let expected = keep.powi(lag as i32) * (angle * lag as f64).cos();
            assert!((lagged(lag) / lagged(0) - expected).abs() < 0.03, "{lag}: {expected}");
        }
    }
}
