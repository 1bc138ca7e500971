//! Thrusters that do not push as their curves say: gains beside each other, the scale that they leave open, and those
//! that stand still or push the other way in one of several trials.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::Fitted;
use super::descent::Tolerance;
use super::differences::{Difference, LEAST_MINDED, has_scale, needed, term_of, thruster_of};
use super::filter::Slope;
use super::search;
use super::uncertainty::inverse;
use crate::plant::{Basis, Plant, Structure};
use crate::series::median;
use crate::{Dof, Error, ThrusterFault, TrialRecord};

/// The least standard deviation between thrusters of one kind: no two are more alike.
const LEAST_SPREAD: f64 = 0.01;

/// A gain so many spreads from the median, and by so much, is not like the others.
const OUTLYING: f64 = 4.0;
const LEAST_OUTLYING: f64 = 0.1;

/// Spread of normal numbers over their median distance from the median.
const NORMAL: f64 = 1.4826;

/// A thruster may stand still in a trial whose gain there, to first order from a plant that was fitted
/// as if it did not, is so much less …
const STILL: f64 = -0.35;

/// … and push the other way if it is as much less as this.
const TURNED_ROUND: f64 = -1.2;

/// A gain is known well enough for that if its standard deviation is less.
const KNOWN: f64 = 0.2;

/// So many thrusters at most stand still in trials.
const MOST_FAULTS: usize = 3;

/// A gain of one thruster in one trial beside that in all.
struct OfTrial {
    trial: usize,
    thruster: String,
    /// Twice what the likelihood gains by it.
    worth: f64,
    gain: f64,
}

impl Fitted {
    /// The same without the thrust of thrusters that stand still in one of several trials, or push the
    /// other way there, and the records with these; none where all act as logged.
    pub(super) fn with_thrusters_that_act(
        mut self,
        records: &[&TrialRecord],
    ) -> Result<(Self, Vec<TrialRecord>), Error> {
        let mut found: Vec<TrialRecord> = Vec::new();
        let group = Difference::Gain.terms(&self.problem.structure);
        if group.len() < 2 || records.len() < 2 {
            return Ok((self, found));
        }
        self = self.with_speeds_as_they_are(records)?;
        while self.faults.len() < MOST_FAULTS {
            let Some(worst) = self.worst_of_trials(&group)? else { break };
            let gain = if worst.gain < 1.0 + TURNED_ROUND { -1.0 } else { 0.0 };
            let now = || records.iter().map(|record| (*record).clone()).collect();
            let mut tried = if found.is_empty() { now() } else { found.clone() };
            tried[worst.trial] = tried[worst.trial].with_gain(&worst.thruster, gain)?;
            let seen: Vec<&TrialRecord> = tried.iter().collect();
            let seen = self.speeds_as_they_are(&seen)?;
            let problem = self.problem.of(&seen.iter().collect::<Vec<_>>());
            let point = self.optimum.point.clone();
            let Ok(optimum) = problem.descent(point, Tolerance::COARSE) else { break };
            let iterations = self.optimum.iterations + optimum.iterations;
            let optimum = super::descent::Optimum { iterations, ..optimum };
            let acting = self.moved_to(problem, optimum);
            // The fault itself colours innovations; what counts is what is left of that.
            let gained = 2.0 * (self.optimum.cost - acting.optimum.cost);
            if gained < search::ADMITTED * acting.colour_of(&group)? {
                break;
            }
            self = acting;
            let trial = tried[worst.trial].trial.clone();
            self.faults.push(ThrusterFault { trial, thruster: worst.thruster, gain });
            found = tried;
        }
        Ok((self, found))
    }

    /// Returns the thruster that most clearly stands still or pushes the other way in a trial, and not in
    /// all trials: one gain is wrong in all of them.
    fn worst_of_trials(&self, group: &[Basis]) -> Result<Option<OfTrial>, Error> {
        let structure = search::with_all(&self.problem.structure, group)?;
        let wide = self.problem.with_terms(structure);
        let point = search::widened(&wide, &self.problem, &self.optimum.point);
        let Some((all, parts)) = wide.by_trial(&point) else { return Ok(None) };
        let (p, n) = (self.problem.structure.terms().len(), group.len());
        let is_fitted = |k: &usize| wide.fits.get(k - p - n).is_none_or(|fits| *fits);
        let others = (p + n..all.gradient.len()).filter(is_fitted);
        let rest: Vec<usize> = (0..p).chain(others).collect();
        let of_rest = inverse(&all.information.select_rows(&rest).select_columns(&rest));
        let mut worst: Option<OfTrial> = None;
        for (k, term) in group.iter().enumerate() {
            let Some(thruster) = thruster_of(&wide.structure, term) else { continue };
            let thruster = &thruster.name;
            let of_trial = |(trial, part): (usize, &Slope)| {
                let cross = part.information.column(p + k).select_rows(&rest);
                let left = part.information[(p + k, p + k)] - cross.dot(&(&of_rest * &cross));
                let by = -part.gradient[p + k] / left;
                let (worth, gain) = (by * by * left, 1.0 + by);
                let of = OfTrial { trial, thruster: thruster.clone(), worth, gain };
                (left > KNOWN.powi(-2)).then_some(of)
            };
            let known: Vec<OfTrial> = parts.iter().enumerate().filter_map(of_trial).collect();
            let is_wrong = |of: &OfTrial| of.gain < 1.0 + STILL && of.worth > search::ADMITTED;
            if known.iter().all(is_wrong) {
                continue;
            }
            let wrong = known.into_iter().filter(is_wrong).chain(worst);
            worst = wrong.max_by(|a, b| a.worth.total_cmp(&b.worth));
        }
        Ok(worst)
    }

    /// What each thruster gives beside the others, to first order from a plant in which all give what
    /// their curves say; none of a plant with gains, and of motion left to itself.
    pub(super) fn gains_to_first_order(&self) -> Result<BTreeMap<String, GainBeside>, Error> {
        let structure = &self.problem.structure;
        let group = Difference::Gain.terms(structure);
        let has_gains = structure.terms().iter().any(|term| is_gain(structure, term));
        if group.len() < 2 || has_gains || self.problem.is_free {
            return Ok(BTreeMap::new());
        }
        let beside = search::beside(&self.problem, &self.optimum.point, &group)?;
        let covariance = inverse(&beside.left) * self.colour_of(&group)?;
        let known = beside_most(&beside.step(), &with_common(covariance, structure));
        let of = |(term, known): (&Basis, Option<[f64; 2]>)| {
            let [excess, std] = known?;
            let (gain, is_fitted, of_curve) = (1.0 + excess, false, None);
            let gain = GainBeside { gain, std, is_fitted, of_curve };
            Some((thruster_of(structure, term)?.name.clone(), gain))
        };
        Ok(group.iter().zip(known).filter_map(of).collect())
    }

    /// The same without gains of thrusters that turn out to be alike, but for those that were asked for: what they
    /// stood for, such as the delay of thrust, was found after them.
    pub(super) fn without_gains_of_alike(self, asked: &Structure) -> Result<Self, Error> {
        let plant = self.problem.plant(&self.optimum.point.free)?;
        let structure = plant.structure();
        let is_found = |term: &Basis| is_gain(structure, term) && asked.index_of(term).is_none();
        let group: Vec<Basis> = structure.terms().iter().copied().filter(is_found).collect();
        let is_minded = |term: &Basis| {
            plant.coefficient(term).is_some_and(|excess| excess.abs() > LEAST_MINDED)
        };
        if group.is_empty() || group.iter().any(is_minded) {
            return Ok(self);
        }
        let problem = self.problem.with_terms(structure.without(|term| group.contains(term)));
        let start = search::widened(&problem, &self.problem, &self.optimum.point);
        let Ok(optimum) = problem.descent(start, Tolerance::COARSE) else { return Ok(self) };
        let lost = 2.0 * (optimum.cost - self.optimum.cost);
        let iterations = self.optimum.iterations + optimum.iterations;
        let optimum = super::descent::Optimum { iterations, ..optimum };
        let alike = Self { problem, optimum, ..self.clone() };
        Ok(if lost < needed(group.len()) * alike.colour_of(&group)? { alike } else { self })
    }

    /// The greatest colour of the innovations of the axes that terms act on, at least 1.
    pub(super) fn colour_of(&self, terms: &[Basis]) -> Result<f64, Error> {
        let white = self.whiteness()?;
        let axes = terms.iter().flat_map(|term| self.problem.structure.axes_of(term));
        Ok(axes.map(|dof: Dof| white(dof)).fold(1.0, f64::max))
    }
}

/// What a thruster gives over what its curve says, where most others give what theirs say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainBeside {
    /// The part of the curve's thrust ahead, and in reverse as well unless the plant has another there.
    pub gain: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Whether the plant has it; else the trials do not ask for it, and it is known to first order.
    pub is_fitted: bool,
    /// Thrust over what its curve says, others being as they are, and its standard deviation; where known
    /// forces reveal the scale.
    pub of_curve: Option<[f64; 2]>,
}

/// The scale of thrust that known forces reveal.
pub(super) struct OfScale {
    pub(super) scale: f64,
    /// Covariance of its logarithm with the coefficients …
    pub(super) covariance: DVector<f64>,
    /// … and its variance.
    pub(super) variance: f64,
}

impl GainBeside {
    /// The same of the log of a thruster that pushes the other way, which has this gain in reverse beyond that.
    pub(super) fn reversed(self, beyond: f64) -> Self {
        let of_curve = self.of_curve.map(|[gain, std]| [-gain - beyond, std]);
        Self { gain: -self.gain - beyond, is_fitted: true, of_curve, ..self }
    }

    /// The same with the scale of thrust, of a plant in which all thrusters give what their curves say times
    /// that.
    pub(super) fn scaled(self, of: Option<&OfScale>) -> Self {
        let of_curve = of.map(|of| {
            let std = of.scale * self.std.hypot(of.variance.sqrt());
            [of.scale, std]
        });
        Self { of_curve, ..self }
    }
}

/// The gains that a plant has of its thrusters beside each other; none of a plant without gains both ways.
pub(super) fn of_plant(
    plant: &Plant,
    covariance: &DMatrix<f64>,
    of_scale: Option<&OfScale>,
) -> Option<BTreeMap<String, GainBeside>> {
    let structure = plant.structure();
    let fitted: Vec<Basis> =
        structure.terms().iter().copied().filter(|term| is_gain(structure, term)).collect();
    if fitted.is_empty() {
        return None;
    }
    // One without a coefficient gives what its curve says.
    let all = [fitted, Difference::Gain.terms(structure)].concat();
    let places: Vec<Option<usize>> = all.iter().map(|term| structure.index_of(term)).collect();
    let scale = of_scale.map_or(1.0, |of| of.scale);
    let value = |k: usize| places[k].map_or(0.0, |at| plant.coefficients()[at]);
    let between =
        |i: usize, j: usize| places[i].zip(places[j]).map_or(0.0, |(i, j)| covariance[(i, j)]);
    let n = all.len();
    let excess = DVector::from_fn(n, |k, _| value(k) / scale);
    let own = DMatrix::from_fn(n, n, |i, j| between(i, j) / (scale * scale));
    let known = beside_most(&excess, &with_common(own, structure));
    let of = |(k, known): (usize, Option<[f64; 2]>)| {
        let [excess, std] = known?;
        let of_curve = of_scale.map(|of| {
            let cross = places[k].map_or(0.0, |at| of.covariance[at]);
            let variance = scale * scale * of.variance + between(k, k) + 2.0 * scale * cross;
            [scale + value(k), variance.max(0.0).sqrt()]
        });
        let gain = GainBeside { gain: 1.0 + excess, std, is_fitted: true, of_curve };
        Some((thruster_of(structure, &all[k])?.name.clone(), gain))
    };
    Some(known.into_iter().enumerate().filter_map(of).collect())
}

/// The information on gains beside each other: what all have in common is the scale of thrust, unless a
/// coefficient is held.
fn with_common(mut covariance: DMatrix<f64>, structure: &Structure) -> DMatrix<f64> {
    if !has_scale(structure) {
        covariance.iter_mut().for_each(|x| *x += 1.0);
    }
    inverse(&covariance)
}

/// Moves what gains exceed 1 by, along directions that the trials do not determine, such as all thrusters of
/// heave together, to where most of them exceed it least: each with its standard deviation beside
/// the others, none of one that only such directions move.
fn beside_most(excess: &DVector<f64>, information: &DMatrix<f64>) -> Vec<Option<[f64; 2]>> {
    let eigen = information.clone().symmetric_eigen();
    let n = excess.len();
    let is_open = |k: &usize| eigen.eigenvalues[*k] < UNDETERMINED.powi(-2);
    let (open, known): (Vec<usize>, Vec<usize>) = (0..n).partition(is_open);
    let open = eigen.eigenvectors.select_columns(&open);
    let mut left = excess - &open * (open.transpose() * excess);
    if open.ncols() > 0 {
        left = nearest_of_most(&left, &open);
    }
    let std = |i: usize| {
        let of = |k: &usize| eigen.eigenvectors[(i, *k)].powi(2) / eigen.eigenvalues[*k];
        known.iter().map(of).sum::<f64>().sqrt()
    };
    let own = |i: usize| 1.0 - open.row(i).norm_squared();
    (0..n).map(|i| (own(i) > LEAST_OWN).then(|| [left[i], std(i)])).collect()
}

/// `x + V u` with the least `Σ |x_i + (V u)_i|`, by least squares with weights made anew.
fn nearest_of_most(x: &DVector<f64>, open: &DMatrix<f64>) -> DVector<f64> {
    let mut left = x.clone();
    for _ in 0..REWEIGHTED {
        let weights = left.map(|x| 1.0 / x.abs().max(NOTHING));
        let weighted = DMatrix::from_diagonal(&weights) * open;
        let u = inverse(&(open.transpose() * &weighted)) * (weighted.transpose() * x);
        left = x - open * u;
    }
    left
}

/// A direction of gains whose standard deviation would be more is not determined: it is hardly less than
/// before anything is measured.
const UNDETERMINED: f64 = 0.15;

/// A thruster that determined directions move by less than this part of it has no gain of its own: of two
/// with an open common gain, each has half, and which of them is weak is not determined.
const LEAST_OWN: f64 = 0.6;

/// A gain that is so little from 1 is 1.
const NOTHING: f64 = 1e-4;

/// How often weights are made anew.
const REWEIGHTED: usize = 40;

/// Adds to information on the coefficients of a plant that its thrusters give what they gave in the mean: thrust as
/// many times larger on all of them looks like mass and drag as many times larger.
pub(super) fn hold_mean(structure: &Structure, information: &mut DMatrix<f64>) {
    let terms = structure.terms().iter().enumerate();
    let places: Vec<usize> =
        terms.filter(|(_, term)| is_gain(structure, term)).map(|(k, _)| k).collect();
    if has_scale(structure) {
        return;
    }
    let own = (places.len() as f64 * HELD_WITHIN).powi(-2);
    for &i in &places {
        places.iter().for_each(|j| information[(i, *j)] += own);
    }
}

/// Standard deviation of a mean gain that is held.
const HELD_WITHIN: f64 = 1e-3;

/// A plant with thrusters whose gains are those of their curves in the mean.
pub(super) struct Scaled {
    pub(super) plant: Plant,
    /// Covariance of its coefficients, and the part of it that is of the scale of thrust.
    pub(super) covariance: DMatrix<f64>,
    pub(super) thrust_covariance: DMatrix<f64>,
    /// What forces are as many times as great as before.
    pub(super) scale: f64,
}

impl Scaled {
    /// Scales all forces of a plant such that the gains of its thrusters are 1 in the mean, but for
    /// those far off; none of a plant without such gains, or with a coefficient that is held.
    ///
    /// Motion stays the same. How far that mean is from the true one is the spread of n gains over √n.
    ///
    /// # Errors
    /// [`Error::Plant`] if the scaled coefficients are not finite.
    pub(super) fn of(
        plant: &Plant,
        (covariance, of_thrust): (&DMatrix<f64>, &DMatrix<f64>),
    ) -> Result<Option<Self>, Error> {
        let structure = plant.structure();
        let fitted: Vec<Basis> =
            structure.terms().iter().copied().filter(|term| is_gain(structure, term)).collect();
        if fitted.is_empty() || has_scale(structure) {
            return Ok(None);
        }
        let usual = Difference::Gain.terms(structure);
        let wide = search::with_all(structure, &usual)?;
        let all: Vec<f64> = fitted
            .iter()
            .chain(&usual)
            .map(|term| plant.coefficient(term).unwrap_or(0.0))
            .collect();
        let (mean, std) = mean_of_alike(&all);
        let scale = 1.0 / (1.0 + mean);
        let n = wide.terms().len();
        let mut coefficients = DVector::zeros(n);
        // How each moves with the scale.
        let (mut by_scale, mut scales) = (DVector::zeros(n), DVector::repeat(n, scale));
        for (k, term) in wide.terms().iter().enumerate() {
            let before = plant.coefficients().get(k).copied().unwrap_or(0.0);
            match Difference::of_term(&wide, term) {
                // A lag or a dead band does not scale.
                Some(Difference::Own(_)) => (coefficients[k], scales[k]) = (before, 1.0),
                of => {
                    let beyond = if of == Some(Difference::Gain) { 1.0 } else { 0.0 };
                    by_scale[k] = scale * (before + beyond);
                    coefficients[k] = by_scale[k] - beyond;
                }
            }
        }
        let widened = |own: &DMatrix<f64>| {
            let mut wider = own.clone().resize(n, n, 0.0);
            wider.component_mul_assign(&(&scales * scales.transpose()));
            wider
        };
        let of_scale = &by_scale * by_scale.transpose() * (std * std);
        Ok(Some(Self {
            plant: Plant::new(wide, coefficients.iter().copied().collect())?,
            covariance: widened(covariance) + &of_scale,
            thrust_covariance: widened(of_thrust) + of_scale,
            scale,
        }))
    }

    /// The same in terms of the log of a thruster that pushes the other way; its gain, if it has none of its own, has
    /// a standard deviation.
    ///
    /// With gains 1 + e ahead and 1 + e + e_r in reverse of the thrust as it acts,
    ///
    /// ```text
    /// e' = −2 − e − e_r,   e_r' = e_r
    /// ```
    ///
    /// # Errors
    /// [`Error::Plant`] if the coefficients are not finite.
    pub(super) fn with_reversed(mut self, thruster: &str, std: f64) -> Result<Self, Error> {
        let term = |of| term_of(self.plant.structure(), thruster, of);
        let in_reverse = term(Difference::InReverse);
        let Some(both) = term(Difference::Gain) else { return Ok(self) };
        let is_new = self.plant.structure().index_of(&both).is_none();
        let structure = match is_new {
            true => self.plant.structure().clone().with(both)?,
            false => self.plant.structure().clone(),
        };
        let n = structure.terms().len();
        let mut coefficients = DVector::from_row_slice(self.plant.coefficients());
        if is_new {
            coefficients = coefficients.push(0.0);
            for covariance in [&mut self.covariance, &mut self.thrust_covariance] {
                *covariance = covariance.clone().resize(n, n, 0.0);
            }
        }
        let Some(own) = structure.index_of(&both) else { return Ok(self) };
        let mut turned = DMatrix::identity(n, n);
        turned[(own, own)] = -1.0;
        if let Some(other) = in_reverse.and_then(|term| structure.index_of(&term)) {
            turned[(own, other)] = -1.0;
        }
        coefficients = &turned * coefficients;
        coefficients[own] -= 2.0;
        self.covariance = &turned * self.covariance * turned.transpose();
        self.thrust_covariance = &turned * self.thrust_covariance * turned.transpose();
        if is_new {
            self.covariance[(own, own)] += std * std;
        }
        self.plant = Plant::new(structure, coefficients.iter().copied().collect())?;
        Ok(self)
    }
}

/// Whether a term is the gain of a thruster both ways.
fn is_gain(structure: &Structure, term: &Basis) -> bool {
    Difference::of_term(structure, term) == Some(Difference::Gain)
}

/// What a thruster gives in reverse over what it gives ahead.
pub(super) fn in_reverse(plant: &Plant, thruster: &str) -> f64 {
    let own = term_of(plant.structure(), thruster, Difference::InReverse);
    own.and_then(|term| plant.coefficient(&term)).unwrap_or(0.0)
}

/// The mean of numbers that are alike, but for those far off, and its standard deviation.
fn mean_of_alike(values: &[f64]) -> (f64, f64) {
    let middle = median(&mut values.to_vec()).unwrap_or(0.0);
    let mut distances: Vec<f64> = values.iter().map(|x| (x - middle).abs()).collect();
    let spread = (NORMAL * median(&mut distances).unwrap_or(0.0)).max(LEAST_SPREAD);
    let far = (OUTLYING * spread).max(LEAST_OUTLYING);
    let alike: Vec<f64> = values.iter().copied().filter(|x| (x - middle).abs() <= far).collect();
    let n = alike.len().max(1) as f64;
    (alike.iter().sum::<f64>() / n, spread / n.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dead_thruster_does_not_move_the_mean_of_the_others() {
        let alike = [0.03, -0.02, 0.05, -0.04, 0.0, 0.01, -0.03];
        let (mean, std) = mean_of_alike(&[&alike[..], &[-1.0]].concat());
        assert!(mean.abs() < 1e-15, "{mean}");
        assert!((0.005..0.03).contains(&std), "{std}");
    }

    #[test]
    fn thrusters_that_are_exactly_alike_are_not_known_to_be() {
        assert_eq!(mean_of_alike(&[0.0; 4]), (0.0, 0.5 * LEAST_SPREAD));
    }

    /// Six thrusters in two groups, of each of which the common gain is open.
    fn two_groups() -> DMatrix<f64> {
        let in_group = |i: usize, j: usize| if (i < 3) == (j < 3) { 1.0 / 3.0 } else { 0.0 };
        let common = DMatrix::from_fn(6, 6, in_group);
        (DMatrix::identity(6, 6) - &common) * 1e4 + common * 10.0
    }

    #[test]
    fn gains_are_beside_the_others_of_a_group_whose_common_gain_is_open() {
        // One of the first group is weak, and the fit left half of that to all of the second.
        let excess = DVector::from_row_slice(&[0.1, -0.1, 0.1, 0.1, 0.1, 0.1]);
        let known = beside_most(&excess, &two_groups());
        for (k, known) in known.iter().enumerate() {
            let [excess, std] = known.expect("determined beside the others");
            let truth = if k == 1 { -0.2 } else { 0.0 };
            assert!((excess - truth).abs() < 1e-3 && (std - 0.00816).abs() < 1e-4, "{known:?}");
        }
    }

    #[test]
    fn a_thruster_without_others_beside_it_has_no_gain_of_its_own() {
        let information = DMatrix::from_diagonal(&DVector::from_row_slice(&[1e4, 1e4, 11.0]));
        let known = beside_most(&DVector::from_row_slice(&[0.02, -0.02, 0.3]), &information);
        assert!(known[0].is_some() && known[1].is_some() && known[2].is_none(), "{known:?}");
    }
}
