//! Measurements that no vehicle makes.

use std::collections::BTreeSet;

use super::kalman::Innovation;
use super::problem::{Problem, Record};
use super::schedule::Instrument;

/// An error of prediction beyond this many of its standard deviations is looked at.
const SUSPECT: f64 = 4.0;

/// Above this part of all samples they are no spikes but the noise of the instrument.
const MOST: f64 = 0.05;

/// The samples of a record that are spikes: far from what was predicted, and the next one is
/// where it would be without them.
///
/// A filter takes a part K of an error over into its next prediction. After a spike e the next
/// error is −K e; after a jump of the vehicle it is (1 − K) e. Halfway decides.
pub(crate) fn spikes(innovations: &[Innovation]) -> BTreeSet<(Instrument, usize)> {
    let mut found = BTreeSet::new();
    for instrument in [Instrument::Velocity, Instrument::Position] {
        let own: Vec<&Innovation> =
            innovations.iter().filter(|innovation| innovation.instrument == instrument).collect();
        for (k, pair) in own.windows(2).enumerate() {
            let [now, next] = [pair[0], pair[1]];
            let returns = next.error / now.error < 0.5 - now.gain;
            if now.normalised().abs() > SUSPECT && returns {
                found.insert((instrument, k));
            }
        }
    }
    let is_noise = found.len() as f64 > MOST * innovations.len() as f64;
    if is_noise { BTreeSet::new() } else { found }
}

/// Strikes the spikes out of records; how many there were.
pub(crate) fn strike_out(
    records: &mut [Record],
    innovations: impl Fn(usize, &Record) -> Vec<Innovation>,
) -> usize {
    let mut count = 0;
    for (k, record) in records.iter_mut().enumerate() {
        let innovations = innovations(k, record);
        count += record.strike_out(&innovations);
    }
    count
}

/// The innovations of a record that a problem was not made for.
pub(crate) fn innovations_of_another(
    problem: &Problem<'_>,
    theta: &nalgebra::DVector<f64>,
    other: &Record,
) -> Vec<Innovation> {
    let (own, start) = problem.of_another(theta, other);
    own.innovations(&start, 0)
}
