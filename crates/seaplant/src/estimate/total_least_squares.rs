//! Total least squares, for velocity noise on both sides of the equation.

use super::filtered::{Filtered, filter_rows, margin_rows};
use super::{EquationError, Filters, Fit, Method, Records, Stretch};
use crate::caveat::spoken;
use crate::navigation::Motion;
use crate::regression::{NoiseShape, Regression, Row, TotalSolution};
use crate::signal::differentiate;
use crate::{AxisRecord, Caveat, CaveatCode, Error, Grid, Timed, UniformStretch};

/// Total least squares, with the filters of equation error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TotalLeastSquares(pub EquationError);

impl TotalLeastSquares {
    /// Fits the plant by mixed least squares and total least squares on the equation of motion.
    ///
    /// The rows are those of [`EquationError::fit`], with noise in v|v| and v as well as in v̇;
    /// force and the constant are exact. With C the covariance of the noise in a row, it minimises
    /// `Σ e² / zᵀCz`, `e = v̇ − F Φ`, `z = [β, μ, −1]`. C follows from independent errors of the
    /// samples of velocity or position: a unit impulse in place of the samples, passed through
    /// interpolation, differentiation and filters, gives the response of v and v̇, and that of v|v|
    /// is 2|v| times that of v. The scale of the noise cancels. The kernel of v̇ is odd and that of
    /// v even, so that their errors are uncorrelated.
    ///
    /// The scale that would explain all residuals is compared with the one that the samples show in
    /// third and higher differences, from which motion vanishes. If the residual is far larger, it
    /// is not sensor noise, and a caveat says so: least squares is then nearer to the truth.
    ///
    /// # Errors
    /// As [`EquationError::fit`].
    ///
    /// # Source
    /// \[VanHuffel1991\]: total least squares, with exact columns by QR; intervals:
    /// \[Fuller1987\], with batch means in place of independent rows.
    pub fn fit<'a>(&self, records: impl Into<Records<'a>>) -> Result<Fit, Error> {
        let records = records.into();
        let filtered = Filtered::of(records, &self.0)?;
        let (dof, terms) = (filtered.dof, filtered.terms);
        let rows = filtered.add_to(Regression::new(filtered.duration_s(), terms))?;
        let shape = noise_shape(&filtered)?;
        let TotalSolution { found, implied_noise } = rows.solve_total(dof, &shape)?;
        let seen = measured_noise(records.fit);
        let doubt = seen.and_then(|seen| more_than_noise(&records.fit[0], implied_noise, seen));
        let Filtered { filters, mut caveats, .. } = filtered;
        caveats.extend(doubt);
        Ok(Fit::of_regression(dof, Method::TotalLeastSquares, terms, found, filters, caveats))
    }
}

/// Computes the covariance of a row for unit noise of each sample, averaged over all rows.
fn noise_shape(filtered: &Filtered<'_>) -> Result<NoiseShape, Error> {
    let mut shape = NoiseShape::default();
    let all = filtered.stretches.iter().map(|stretch| stretch.ready.grid.len).sum::<usize>();
    for (stretch, rows) in filtered.stretches.iter().zip(filtered.rows()?) {
        let [of_v, of_v_dot] = gains(stretch, &filtered.filters)?;
        let per_row = 1.0 / all as f64;
        for [_, _, v, _] in rows {
            shape.quadratic += per_row * 4.0 * v * v * of_v;
            shape.quadratic_linear += per_row * 2.0 * v.abs() * of_v;
            shape.linear += per_row * of_v;
            shape.v_dot += per_row * of_v_dot;
        }
    }
    Ok(shape)
}

/// Number of impulses, at consecutive samples, since samples need not lie on the grid.
const IMPULSES: usize = 8;

/// Computes the variances of filtered v and v̇ for samples of variance one.
fn gains(stretch: &Stretch<'_>, filters: &Filters) -> Result<[f64; 2], Error> {
    let period_s = stretch.ready.grid.period_s;
    let source_s = stretch.axis.motion.series().period_s();
    let per_source = (source_s / period_s).ceil() as usize;
    let reach = margin_rows(filters, stretch.sample_hz)? + IMPULSES * per_source.max(1);
    let grid = Grid { start_s: 0.0, period_s, len: 2 * reach + 1 };
    let source = Grid::spanning(0.0, 2.0 * reach as f64 * period_s, source_s);
    let mut sums = [0.0; 2];
    let mut rows: Vec<Row> = Vec::new();
    for impulse in 0..IMPULSES {
        let mut samples = vec![0.0; source.len];
        samples[source.len / 2 + impulse] = 1.0;
        let series = Timed::on_grid("an impulse", source, samples)?.interpolate(grid);
        let v = match stretch.axis.motion {
            Motion::Velocity(_) => series,
            Motion::Position(_) => differentiate(&series, period_s)?,
            Motion::Acceleration(_) => return Err(Error::NoVelocity),
        };
        let still = UniformStretch { grid, tau: vec![0.0; grid.len], v };
        filter_rows(still, stretch.sample_hz, filters, &mut rows)?;
        for [_, _, v, v_dot] in &rows {
            sums[0] += v * v;
            sums[1] += v_dot * v_dot;
        }
    }
    // A row contains the noise of this many samples.
    let samples_per_row = period_s / source_s;
    Ok(sums.map(|sum| sum / IMPULSES as f64 * samples_per_row))
}

/// Estimates the standard deviation of the samples' noise from their differences: a difference of
/// order p has C(2p, p) times its variance. Motion decreases with the order, so that the smallest
/// of several estimates is used.
///
/// `None` for too few samples.
fn measured_noise(axes: &[AxisRecord]) -> Option<f64> {
    let (mut least, mut pooled) = (f64::INFINITY, 0.0);
    let mut differences: Vec<Vec<f64>> =
        axes.iter().map(|axis| axis.motion.series().values().to_vec()).collect();
    let mut gain = 1.0;
    for order in 1..=HIGHEST_DIFFERENCE {
        for series in &mut differences {
            *series = series.windows(2).map(|pair| pair[1] - pair[0]).collect();
        }
        // C(2p, p) = C(2p − 2, p − 1) · 2 (2p − 1) / p.
        gain *= 2.0 * (2.0 * order as f64 - 1.0) / order as f64;
        let count = differences.iter().map(Vec::len).sum::<usize>();
        if count < LEAST_DIFFERENCES {
            return None;
        }
        pooled = differences.iter().flatten().map(|x| x * x).sum::<f64>() / count as f64;
        if order >= LOWEST_DIFFERENCE {
            least = least.min(pooled / gain);
        }
    }
    (pooled > 0.0).then(|| least.sqrt())
}

/// Lowest order of differences: third differences remove what changes smoothly over four samples …
const LOWEST_DIFFERENCE: usize = 3;
/// … and highest order, which removes what changes over seven.
const HIGHEST_DIFFERENCE: usize = 6;

/// Minimum number of differences, for a standard deviation accurate to a tenth.
const LEAST_DIFFERENCES: usize = 50;

/// Residuals that exceed the expected noise by this factor have another cause. Rounded propeller
/// speeds alone double them in the yaw of a simulated twin without disturbance.
const MORE_THAN_NOISE: f64 = 2.5;

fn more_than_noise(first: &AxisRecord, implied: f64, seen: f64) -> Option<Caveat> {
    let units = first.dof.units();
    let (what, unit) = match first.motion {
        Motion::Velocity(_) => ("velocity", units.velocity),
        Motion::Position(_) => ("position", units.position),
        Motion::Acceleration(_) => ("acceleration", units.acceleration),
    };
    (implied > MORE_THAN_NOISE * seen).then(|| {
        let message = format!(
            "the {} residuals would need noise of {} {unit} in {what} and its samples show {}: something other than noise (a tether, a current, a lag, a wrong thrust curve) moves the vehicle, and total least squares takes it for noise; compare with equation-error and filter-error",
            first.dof,
            spoken(implied),
            spoken(seen)
        );
        Caveat::warning(CaveatCode::MoreThanNoise, message)
    })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::twin::{TwinSpec, make};
    use crate::{Dof, Role, Trial, TrialSetup, VelocitySource};

    fn of_twin(dof: Dof) -> AxisRecord {
        let made = make(&TwinSpec { seed: 2, ..TwinSpec::jason2() }).expect("can be made");
        let trial = made.trials.iter().find(|t| t.dofs == [dof] && t.role == Role::Fit);
        let trial = trial.expect("one to fit");
        let setup = TrialSetup { name: trial.name.clone(), dofs: vec![dof], ..Default::default() };
        let trial = Trial::new(setup, &trial.recording, &made.vehicle).expect("complete");
        trial.axis(dof, VelocitySource::Measured).expect("measured")
    }

    /// Relative error: 4800 samples give a standard deviation accurate to 1 %, and a little motion
    /// remains.
    const NOISE: f64 = 0.06;

    #[test]
    fn estimates_sensor_noise_from_differences() {
        // Doppler 3 mm/s, heading 0.1°.
        for (dof, std) in [(Dof::Surge, 0.003), (Dof::Yaw, 0.1_f64.to_radians())] {
            let found = measured_noise(&[of_twin(dof)]).expect("long enough");
            assert!((found / std - 1.0).abs() < NOISE, "{dof}: {found} and {std}");
        }
    }

    #[test]
    fn impulse_response_gives_the_variance_of_filtered_noise() {
        // Noise alone passed through the same filters has the variances of its rows.
        let axis = of_twin(Dof::Surge);
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let errors: Vec<f64> = (0..40_000).map(|_| rng.random_range(-1.0..1.0)).collect();
        let variance = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        let grid = Grid { start_s: 0.0, period_s: 0.1, len: errors.len() };
        let noise = Timed::on_grid("noise", grid, errors).expect("finite");
        let force = noise.with_values("no force", vec![0.0; grid.len]).expect("finite");
        let axis = AxisRecord { motion: Motion::Velocity(noise), force, ..axis };
        let axes = [axis];
        let filtered = Filtered::of(Records::from(&axes), &EquationError::default()).expect("long");
        let [of_v, of_v_dot] = gains(&filtered.stretches[0], &filtered.filters).expect("a filter");
        let rows = &filtered.rows().expect("a filter")[0];
        let mean =
            |j: usize| rows.iter().map(|row| row[j] * row[j]).sum::<f64>() / rows.len() as f64;
        // About 4000 independent rows: three times 2 %.
        for (name, found, seen) in
            [("v", of_v, mean(2) / variance), ("v_dot", of_v_dot, mean(3) / variance)]
        {
            assert!((found / seen - 1.0).abs() < 0.07, "{name}: {found} and {seen}");
        }
    }
}
