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
