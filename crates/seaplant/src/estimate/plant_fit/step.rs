//! Change of the estimates that trials outside the fit indicate.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::actuator::Actuator;
use super::filter::{Drift, Noise, Swell};
use super::gains;
use super::problem::{Point, Problem};
use super::report::left_of_report;
use super::schedule::Attitude;
use super::uncertainty::{inverse, whiteness};
use super::{AxisNoise, PlantFit};
use crate::plant::Parameterisation;
use crate::{Dof, Error, Method, TrialRecord, VelocityReport};

/// The Newton step of the coefficients on trials outside the fit, and a test of the fit's noise on
/// them.
#[derive(Clone, Debug)]
pub(crate) struct LikelihoodStep {
    /// Step of each coefficient.
    pub(crate) change: DVector<f64>,
    /// Its covariance, from these trials alone.
    pub(crate) covariance: DMatrix<f64>,
    /// Box–Pierce statistic of each axis's innovations, as for a fit.
    pub(crate) whiteness: BTreeMap<Dof, f64>,
    /// Mean of `e²/S` over the innovations of each axis: 1 if the noise agrees with the fit.
    pub(crate) surprise: BTreeMap<Dof, f64>,
}

impl PlantFit {
    /// Computes the step of the coefficients on some trials; `None` for an output error fit.
    ///
    /// `−I⁻¹ g`, with gradient and information of the likelihood of these trials by the
    /// coefficients and by a separate current for each trial; disturbance, noise and actuator are
    /// those of the fit.
    ///
    /// # Errors
    /// [`Error::Plant`] if the plant cannot be simulated; as [`Actuator::signals`].
    pub(crate) fn likelihood_step(
        &self,
        records: &[&TrialRecord],
    ) -> Result<Option<LikelihoodStep>, Error> {
        if self.method == Method::OutputError {
            return Ok(None);
        }
        let corrected = |record: &&TrialRecord| {
            let signals = self.actuator.signals(record, &self.plant)?;
            let prompt = match self.report == VelocityReport::default() {
                true => (*record).clone(),
                false => record.with_translations_before(&self.report),
            };
            Ok(TrialRecord { signals, ..prompt })
        };
        let records: Vec<TrialRecord> =
            records.iter().map(corrected).collect::<Result<_, Error>>()?;
        let references: Vec<&TrialRecord> = records.iter().collect();
        let attitude = self.attitude_noise.map_or(Attitude::Known, |_| Attitude::State);
        let mut problem = Problem::new(self.plant.structure(), &references, None, false, attitude);
        problem.fits = [false; Actuator::COUNT];
        let mut point = Point {
            free: problem.physical.free(&DVector::from_row_slice(self.plant.coefficients())),
            actuator: self.actuator,
            currents: vec![self.mean_current(); records.len()],
            noise: self.noise(),
            jitter_of: self.actuator,
        };
        let Some((slope, _)) = problem.by_plant(&point) else { return Ok(None) };
        let (p, q) = (problem.structure.terms().len(), 2 * records.len());
        let first = p + Actuator::COUNT;
        let own = slope.information.view((first, first), (q, q)).into_owned();
        let step = -(inverse(&own) * slope.gradient.rows(first, q));
        point.currents.as_flattened_mut().iter_mut().zip(&step).for_each(|(x, by)| *x += by);
        let Some((slope, _)) = problem.by_plant(&point) else { return Ok(None) };
        // The scale of thrust is that of the fit, whose uncertainty is told apart.
        let mut information = slope.information;
        gains::hold_mean(&problem.structure, &mut information);
        let covariance = inverse(&information);
        let change = -(covariance.rows(0, p) * &slope.gradient);
        let covariance = covariance.view((0, 0), (p, p)).into_owned();
        let innovations = problem.innovations(&point)?;
        let of = |(axis, &dof): (usize, &Dof)| {
            let own =
                innovations.iter().flatten().filter(|innovation| innovation.axis == Some(axis));
            let squares: Vec<f64> = own.map(|innovation| innovation.normalised().powi(2)).collect();
            (dof, squares.iter().sum::<f64>() / squares.len() as f64)
        };
        let surprise = self.plant.axes().iter().enumerate().map(of).collect();
        let whiteness = whiteness(&problem, &point, left_of_report(&self.report, &records))?;
        Ok(Some(LikelihoodStep { change, covariance, whiteness, surprise }))
    }

    /// Returns disturbance and noise in the form that the filter takes.
    fn noise(&self) -> Noise {
        let axes = self.plant.axes();
        let of = |number: fn(&AxisNoise) -> (f64, f64)| {
            let own = axes.iter().map(|dof| number(&self.disturbances[dof]).0);
            DVector::from_iterator(axes.len(), own)
        };
        Noise {
            disturbance: of(|noise| noise.disturbance),
            correlation_s: of(|noise| noise.correlation_s),
            velocity: of(|noise| noise.velocity),
            attitude: self.attitude_noise.map(|(std, _)| std),
            instruments: self.instrument_noise(),
            drift: self.current_drift.map(|drift| Drift {
                std_m_s: drift.std_m_s.0,
                correlation_s: drift.correlation_s.0,
            }),
            swell: self.swell.as_ref().map(|swell| Swell {
                std: DVector::from_iterator(axes.len(), axes.iter().map(|dof| swell.force[dof].0)),
                frequency: TAU / swell.period_s.0,
                damping: swell.damping.0,
            }),
            jitter_s: self.thrust_jitter_s.map(|(std, _)| std),
        }
    }
}
