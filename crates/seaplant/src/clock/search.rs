//! The search for the offset of one pair of series.

use super::OffsetPair;
use super::correlate::{AtLag, correlations, peaks};
use super::lattice::{Smooth, step_s};
use super::profile::{Problem, Profile, whitened};
use crate::signal::differentiate_timed;
use crate::{Error, Grid, Timed};

/// Least overlap, as a fraction of the shorter series.
const LEAST_SHARED: f64 = 0.5;
/// Least overlap in instants and in seconds.
const LEAST_INSTANTS: f64 = 60.0;
const LEAST_S: f64 = 20.0;

/// Number of peaks of the correlation, plain and whitened, that are evaluated …
const PEAKS: usize = 12;
/// … and of those that are refined by ascent.
const CLIMBED: usize = 6;

/// Least log-likelihood gain of an offset beyond the greatest that chance gives over all searched
/// lags.
const LEAST_GAIN: f64 = 12.0;

/// Largest gain of a second offset relative to the best, beyond which both are ambiguous.
const GREATEST_SECOND: f64 = 0.7;

/// Lower bound of the standard error, as a fraction of the lattice's step.
const FLOOR_OF_STEP: f64 = 0.005;

/// Step of the curvature of the likelihood, as a fraction of the lattice's.
const STD_STEP: f64 = 0.25;

/// A series and its name in messages.
#[derive(Clone, Debug)]
pub(super) struct Named {
    pub(super) name: String,
    pub(super) series: Timed,
}

impl Problem {
    /// Models two measurements of one motion.
    pub(super) fn agreement(driver: &Named, response: &Named) -> Result<Self, Error> {
        let [one_s, other_s] = [driver, response].map(|named| named.series.period_s());
        let step_s = step_s(one_s.max(other_s), [&driver.series, &response.series]);
        let x = Smooth::new(&driver.name, &driver.series, step_s)?;
        let y = Smooth::new(&response.name, &response.series, step_s)?;
        let [from_s, to_s] = y.span_s();
        let grid = Grid::spanning(from_s, to_s, step_s);
        Ok(Self { grid, y: y.on(grid), z: Vec::new(), x })
    }

    /// Models velocity driven by force: `v̇ = α τ + β v|v| + μ v + ν`, every term smoothed alike.
    /// The model includes the lag of velocity behind force, so that only the time between logged
    /// and acting force counts as offset.
    pub(super) fn propulsion(force: &Named, velocity: &Named) -> Result<Self, Error> {
        /// Steps over which held force is averaged, per step of the lattice.
        const FINER: f64 = 4.0;
        let v = &velocity.series;
        // Held force is known between its samples.
        let step_s = step_s(v.period_s(), [v, &force.series]);
        let held = Grid::spanning(force.series.first_s(), force.series.last_s(), step_s / FINER);
        let force_means = Timed::on_grid(&force.name, held, force.series.held_means(held))?;
        let x = Smooth::new(&force.name, &force_means, step_s)?;
        let smooth = |series: &Timed| Smooth::new(&velocity.name, series, step_s);
        let rate = smooth(&differentiate_timed(v)?)?;
        let [from_s, to_s] = rate.span_s();
        let grid = Grid::spanning(from_s, to_s, step_s);
        let z = [smooth(&v.map(|v| v * v.abs()))?, smooth(v)?];
        Ok(Self { grid, y: rate.on(grid), z: z.map(|z| z.on(grid)).into(), x })
    }

    /// Searches the offset that explains the response best, wherever the two overlap enough.
    ///
    /// Candidates are the peaks of the normalised cross-correlation, plain and whitened; each is
    /// refined by ascent of the likelihood. `pair` names the two.
    ///
    /// Without an acceptable offset, the pair states the reason as the predicate of a sentence.
    pub(super) fn search(&self, pair: OffsetPair) -> OffsetPair {
        let [from_s, to_s] = self.x.span_s();
        let grid = Grid::spanning(from_s, to_s, self.grid.period_s);
        let x = self.x.on(grid);
        let known = |x: &[f64]| x.iter().filter(|x| !x.is_nan()).count() as f64;
        let shorter = known(&x).min(known(&self.y));
        let least = (LEAST_SHARED * shorter).max(LEAST_INSTANTS).max(LEAST_S / self.grid.period_s);
        if shorter < least {
            let s = shorter * self.grid.period_s;
            return pair.refused(format!("only {s:.0} s are without gaps: too little to compare"));
        }
        let (plain, found) = self.candidates(&x, least);
        let offset_s = |at: &AtLag| from_s - self.grid.start_s + at.lag as f64 * grid.period_s;
        if let Some(at) = mirrored(&plain) {
            let at_s = offset_s(at);
            return pair.refused(format!(
                "they have opposite signs at {at_s:.2} s: set negate = true for one of them"
            ));
        }
        let tops = self.tops(found.iter().map(offset_s));
        let least_gain = LEAST_GAIN + (plain.len() as f64).ln();
        match tops.first() {
            Some(best) => self.judge(pair, best, tops.get(1), least_gain),
            None => pair.refused("they are not correlated at any offset"),
        }
    }

    /// Returns the plain correlation at every lag, and the peaks of the plain and whitened ones.
    fn candidates(&self, x: &[f64], least: f64) -> (Vec<AtLag>, Vec<AtLag>) {
        let y = self.unexplained();
        let plain = correlations(&y, x, least);
        let mut found = peaks(&plain, PEAKS);
        if let Some([y, x]) = whitened(&y, x) {
            found.extend(peaks(&correlations(&y, &x, least), PEAKS));
        }
        (plain, found)
    }

    /// Returns the distinct maxima of the likelihood near given offsets, the highest first.
    fn tops(&self, near_s: impl Iterator<Item = f64>) -> Vec<Profile> {
        let step_s = self.grid.period_s;
        let at = |offset_s: f64| self.profile(&self.rows(offset_s, 2.0 * step_s)?, offset_s);
        let mut found: Vec<Profile> = near_s.filter_map(at).collect();
        found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut tops: Vec<Profile> = Vec::new();
        for (k, near) in found.into_iter().enumerate() {
            let top = if k < CLIMBED { self.climb(near) } else { near };
            let known = |known: &Profile| (known.offset_s - top.offset_s).abs() < step_s;
            if top.slope > 0.0 && !tops.iter().any(known) {
                tops.push(top);
            }
        }
        tops.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        tops
    }

    /// Ascends to a maximum of the likelihood and refines it to a small fraction of a step.
    fn climb(&self, from: Profile) -> Profile {
        /// Steps of the ascent relative to the lattice's, in order.
        const STEPS: [f64; 4] = [0.5, 0.25, 0.1, 0.03];
        /// Largest number of moves at one step size.
        const MOVES: usize = 8;
        let mut top = from;
        for part in STEPS {
            let step_s = part * self.grid.period_s;
            for _ in 0..MOVES {
                let Some(rows) = self.rows(top.offset_s, 2.0 * self.grid.period_s) else {
                    return top;
                };
                let offsets_s: [f64; 5] =
                    [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| top.offset_s + k * step_s);
                let scores = self.scan(&rows, &top, &offsets_s);
                let best = (0..5).max_by(|&a, &b| scores[a].total_cmp(&scores[b])).unwrap_or(2);
                let inside = (1..4).contains(&best);
                let offset_s = offsets_s[best]
                    + if inside { step_s * vertex(&scores[best - 1..=best + 1]) } else { 0.0 };
                match self.profile(&rows, offset_s) {
                    Some(profile) => top = profile,
                    None => return top,
                }
                if inside {
                    break;
                }
            }
        }
        top
    }

    /// Returns the pair with an offset if that is acceptable.
    fn judge(
        &self,
        pair: OffsetPair,
        best: &Profile,
        second: Option<&Profile>,
        least_gain: f64,
    ) -> OffsetPair {
        let step_s = self.grid.period_s;
        let Some(rows) = self.rows(best.offset_s, 2.0 * step_s) else {
            return pair.refused("they share too little to compare");
        };
        let correlation = self.correlation(&rows, best.offset_s);
        let second_peak = second.map_or(0.0, |second| (second.gain / best.gain).clamp(0.0, 1.0));
        let pair =
            OffsetPair { correlation: Some(correlation), second_peak: Some(second_peak), ..pair };
        let found = format!("they agree best at {:.2} s", best.offset_s);
        if best.gain < least_gain {
            let chance = "but no better than by chance";
            return pair.refused(format!("{found}, {chance} (correlation {correlation:.2})"));
        }
        if let Some(second) = second.filter(|_| second_peak > GREATEST_SECOND) {
            return pair.refused(format!("{found}, but {}", ambiguity(second, second_peak)));
        }
        let std_s = self.std_s(&rows, best, STD_STEP * step_s);
        let std_s = std_s.map(|std_s| std_s.hypot(FLOOR_OF_STEP * step_s));
        match std_s {
            Some(_) => OffsetPair { offset_s: Some(best.offset_s), std_s, ..pair },
            None => pair.refused(format!("{found}, but neighbouring offsets are as likely")),
        }
    }
}

fn ambiguity(second: &Profile, part: f64) -> String {
    let (at_s, percent) = (second.offset_s, 100.0 * part);
    format!(
        "they agree nearly as well at {at_s:.2} s ({percent:.0} % of the evidence), because the motion is periodic"
    )
}

/// Returns the lag of the most negative correlation, if it clearly exceeds the most positive.
fn mirrored(correlations: &[AtLag]) -> Option<&AtLag> {
    /// Least magnitude, and least ratio of magnitudes.
    const CLOSE: f64 = 0.7;
    const TIMES: f64 = 1.3;
    let order = |a: &&AtLag, b: &&AtLag| a.correlation.total_cmp(&b.correlation);
    let (lowest, highest) =
        (correlations.iter().min_by(order)?, correlations.iter().max_by(order)?);
    let is_mirrored = -lowest.correlation > (TIMES * highest.correlation).max(CLOSE);
    is_mirrored.then_some(lowest)
}

/// Returns the position between −1 and 1 of the maximum of the parabola through the values at −1, 0
/// and 1.
fn vertex(values: &[f64]) -> f64 {
    let bend = values[0] - 2.0 * values[1] + values[2];
    if bend < 0.0 { (0.5 * (values[0] - values[2]) / bend).clamp(-1.0, 1.0) } else { 0.0 }
}
