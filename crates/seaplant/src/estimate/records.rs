//! Input of the methods for one axis.

use crate::{AxisRecord, Dof, Error, Terms};

/// The records of one degree of freedom, by purpose.
///
/// A slice or a vector of records converts to records that are all fitted, with the method's
/// default terms: `FilterError::default().fit(&records)`. Steady records are used by the filter error
/// method only.
#[derive(Clone, Copy, Debug)]
pub struct Records<'a> {
    /// Records to fit.
    pub fit: &'a [AxisRecord],
    /// Runs at constant thrust: fitted together with the others if they agree with them.
    pub steady: &'a [AxisRecord],
    /// Terms of the plant, unless the method chooses them: mass, quadratic drag and bias force
    /// ([`Terms::default`]); for filter error, mass, quadratic drag and those that the logs
    /// support.
    pub terms: Option<Terms>,
}

impl<'a, T: AsRef<[AxisRecord]> + ?Sized> From<&'a T> for Records<'a> {
    fn from(fit: &'a T) -> Self {
        let fit = fit.as_ref();
        Self { fit, steady: &[], terms: None }
    }
}

impl Records<'_> {
    /// Returns the records with the terms of the plant.
    pub fn with_terms(self, terms: Terms) -> Self {
        Self { terms: Some(terms), ..self }
    }

    /// Returns the degree of freedom of the records.
    ///
    /// # Errors
    /// [`Error::NoRecord`] without records to fit; [`Error::OtherAxis`] if not all are of one axis.
    pub fn dof(&self) -> Result<Dof, Error> {
        let first = self.fit.first().ok_or(Error::NoRecord)?;
        let mut all = self.fit.iter().chain(self.steady);
        match all.find(|record| record.dof != first.dof) {
            None => Ok(first.dof),
            Some(other) => Err(Error::OtherAxis {
                dof: first.dof,
                other: other.dof,
                trial: other.trial.clone(),
            }),
        }
    }

    pub(super) fn terms(&self) -> Terms {
        self.terms.unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::{EquationError, FilterError};
    use crate::twin::{TwinSpec, make};
    use crate::{Trial, TrialSetup, VelocitySource};

    fn record(dof: Dof) -> AxisRecord {
        let spec = TwinSpec { dofs: [dof].into(), duration_s: 240.0, ..TwinSpec::jason2() };
        let twin = make(&spec).expect("can be made");
        let setup = TrialSetup { dofs: vec![dof], ..Default::default() };
        let trial = Trial::new(setup, &twin.trials[0].recording, &twin.vehicle).expect("complete");
        trial.axis(dof, VelocitySource::Measured).expect("measured")
    }

    #[test]
    fn refuses_records_of_no_axis_or_two() {
        let nothing: Vec<AxisRecord> = Vec::new();
        assert_eq!(FilterError::default().fit(&nothing), Err(Error::NoRecord));
        let (surge, sway) = ([record(Dof::Surge)], [record(Dof::Sway)]);
        let two = [surge[0].clone(), sway[0].clone()];
        let refused = EquationError::default().fit(&two).expect_err("two axes");
        let name = &sway[0].trial;
        assert_eq!(
            refused.to_string(),
            format!(
                "the records to fit surge with hold one of sway, of trial `{name}`; fit each degree of freedom by its own records, or several of them as one plant of these axes"
            )
        );
        // Steady runs of another axis would be fitted to the wrong plant.
        let records = Records { steady: &sway, ..Records::from(&surge) };
        assert!(matches!(FilterError::default().fit(records), Err(Error::OtherAxis { .. })));
    }

    #[test]
    fn fit_with_best_delay_needs_a_delay() {
        let records = [record(Dof::Surge)];
        let refused = EquationError::default().fit_best_delay(&records, [].into_iter());
        let refused = refused.expect_err("nothing to try");
        assert_eq!(refused.to_string(), "delays_s is empty; it must be one delay or more");
    }

    #[test]
    fn fits_the_given_terms() {
        let records = [record(Dof::Surge)];
        let terms: Terms = "force,quadratic,linear,bias".parse().expect("a plant");
        let of = |records| EquationError::default().fit(records).expect("exciting").terms;
        assert_eq!(of(Records::from(&records)), Terms::default());
        assert_eq!(of(Records::from(&records).with_terms(terms)), terms);
    }
}
