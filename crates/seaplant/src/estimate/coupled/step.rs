//! What trials that a plant was not fitted to would have of it.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, SVector};

use super::actuator::Actuator;
use super::filter::{Drift, Noise};
use super::fit::{Point, Problem};
use super::report::left_of_report;
use super::schedule::Attitude;
use super::uncertainty::{inverse, whiteness};
use super::{AxisNoise, CoupledFit};
use crate::motion::with_places;
use crate::plant::Parameterisation;
use crate::{CoupledRecord, Dof, Error, Method, VelocityReport};

/// By how much some trials would have the coefficients of a fit greater, and how well its noise
/// explains what it does not predict of them.
#[derive(Clone, Debug)]
pub(crate) struct LikelihoodStep {
    /// Of each coefficient.
    pub(crate) change: DVector<f64>,
    /// Its covariance, of these trials alone.
    pub(crate) covariance: DMatrix<f64>,
    /// Box and Pierce's statistic of each axis's innovations, as of a fit.
    pub(crate) whiteness: BTreeMap<Dof, f64>,
    /// The mean of `e²/S` over each axis's innovations: 1 where the noise is that of the fit.
    pub(crate) surprise: BTreeMap<Dof, f64>,
}

impl CoupledFit {
    /// What trials ask for; nothing of a fit that takes all misfit for the measurement's.
    ///
    /// `−I⁻¹ g` with slope and information of the likelihood of these trials, by the coefficients
    /// and by a current of each trial's own; disturbances, noise and thrust are those of the fit.
    ///
    /// # Errors
    /// [`Error::Plant`] if the fit's plant cannot be simulated; as [`Actuator::signals`].
    pub(crate) fn likelihood_step(
        &self,
        records: &[&CoupledRecord],
    ) -> Result<Option<LikelihoodStep>, Error> {
        if self.method == Method::OutputError {
            return Ok(None);
        }
        let seen = |record: &&CoupledRecord| {
            let signals = self.actuator.signals(record)?;
            let prompt = match self.report == VelocityReport::default() {
                true => (*record).clone(),
                false => record.with_translations_before(&self.report),
            };
            Ok(CoupledRecord { signals, ..prompt })
        };
        let records: Vec<CoupledRecord> = records.iter().map(seen).collect::<Result<_, Error>>()?;
        match self.attitude_noise {
            Some(_) => self.step_of::<6, 9>(&records),
            None => with_places!(self.plant.axes().len(), N => self.step_of::<N, N>(&records)),
        }
    }

    fn step_of<const N: usize, const M: usize>(
        &self,
        records: &[CoupledRecord],
    ) -> Result<Option<LikelihoodStep>, Error> {
        let seen: Vec<&CoupledRecord> = records.iter().collect();
        let attitude = if M > N { Attitude::State } else { Attitude::Known };
        let mut problem = Problem::new(self.plant.structure(), &seen, None, false, attitude);
        problem.fits = [false; Actuator::COUNT];
        let mut point = Point {
            free: problem.physical.free(&DVector::from_row_slice(self.plant.coefficients())),
            actuator: self.actuator,
            currents: vec![self.mean_current(); records.len()],
            noise: self.noise::<N, M>(),
        };
        let Some((slope, _)) = problem.by_plant(&point) else { return Ok(None) };
        let (p, q) = (problem.structure.terms().len(), 2 * records.len());
        let first = p + Actuator::COUNT;
        let own = slope.information.view((first, first), (q, q)).into_owned();
        let step = -(inverse(&own) * slope.gradient.rows(first, q));
        point.currents.as_flattened_mut().iter_mut().zip(&step).for_each(|(x, by)| *x += by);
        let Some((slope, _)) = problem.by_plant(&point) else { return Ok(None) };
        let covariance = inverse(&slope.information);
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
        let whiteness = whiteness(&problem, &point, left_of_report(&self.report, records))?;
        Ok(Some(LikelihoodStep { change, covariance, whiteness, surprise }))
    }

    /// Disturbance and noise as a filter takes them.
    fn noise<const N: usize, const M: usize>(&self) -> Noise<N, M> {
        let axes = self.plant.axes();
        let of = |number: fn(&AxisNoise) -> (f64, f64)| {
            // What a place without an axis holds does not matter, as long as it is a number.
            let own = |i: usize| self.disturbances.get(axes.get(i)?);
            SVector::from_fn(|i, _| own(i).map_or(1.0, |noise| number(noise).0))
        };
        Noise {
            disturbance: of(|noise| noise.disturbance),
            correlation_s: of(|noise| noise.correlation_s),
            velocity: of(|noise| noise.velocity),
            attitude: self.attitude_noise.map_or(0.0, |(std, _)| std),
            instruments: self.instrument_noise(),
            drift: self.current_drift.map(|drift| Drift {
                std_m_s: drift.std_m_s.0,
                correlation_s: drift.correlation_s.0,
            }),
        }
    }
}
