//! Identification from the unsteady trials of one degree of freedom: plants by all methods, and the
//! recommendation.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::Work;
use super::convert::{Scores, plant_result};
use crate::caveat::spoken;
use crate::diagnose::{
    Evidence, better_elsewhere, caveats, disagreement, disputed, outdone, predicts_as_well,
    short_against_long,
};
use crate::estimate::{Method, Records, simulated_speed};
use crate::judge::{
    Contender, Coupling, Drift, Judged, LAGS, NOT_WHITE, Nulls, Number, OffBecause, Scored, Tested,
    another_plant, box_pierce, choose, drag_at, feedback, impossible, intervals, left_out,
    may_be_off, one_speed, records, reversed, score, scoring, still, turned, vouched, widened,
    windows_of, working_speed,
};
use crate::results::{Failure, FittedModel, GoodFor, Identification, PlantChange, Results, Score};
use crate::trial::Beside;
use crate::{AxisRecord, Caveat, CaveatCode, Error, Fit, Model, Term, Trial, VelocitySource};

/// Method name in failures that concern all methods.
const ANY_METHOD: &str = "any method";

/// Data by which all methods are judged.
struct Bench {
    fitted: Vec<AxisRecord>,
    held_out: Vec<AxisRecord>,
    nulls: Nulls,
    /// Root mean square speed of the fitted trials, m/s or rad/s.
    speed: f64,
}

impl Bench {
    /// Returns the trials on which plants are tested: held-out ones, or else the fitted ones.
    fn tested(&self) -> &[AxisRecord] {
        if self.held_out.is_empty() { &self.fitted } else { &self.held_out }
    }

    /// Returns the typical speed, simulated by a model where speed was not measured.
    fn speed_of(&self, model: &Model) -> f64 {
        match self.fitted.iter().any(AxisRecord::knows_velocity) {
            true => self.speed,
            false => simulated_speed(model, &self.fitted),
        }
    }
}

impl Work<'_> {
    /// Identifies plants by all methods; returns the recommended fit.
    pub(super) fn unsteady(
        &self,
        found: &mut Identification,
        watch: &mut dyn FnMut(Method),
    ) -> Option<Fit> {
        if self.trials.fit.is_empty() {
            return None;
        }
        let bench = match self.bench() {
            Ok(bench) => bench,
            Err(error) => {
                found.results.failures.push(self.failure(ANY_METHOD, &error));
                return None;
            }
        };
        let (fits, batch) = self.fits(&bench, found, watch);
        let own = Work { batch: batch.as_ref(), ..*self };
        own.judge_all(fits, &bench, found)
    }

    /// Fits by every method, in the requested order; returns the filter error fit as well if its
    /// plant is physically possible.
    ///
    /// Methods that work sample by sample come last: they use the thrust model and currents of that
    /// fit.
    fn fits(
        &self,
        bench: &Bench,
        found: &mut Identification,
        watch: &mut dyn FnMut(Method),
    ) -> (Vec<(Fit, Vec<AxisRecord>)>, Option<Fit>) {
        let requested = self.methods();
        let (mut fits, mut batch) = (Vec::new(), None);
        for method in self.in_order() {
            watch(method);
            let work = Work { batch: batch.as_ref(), ..*self };
            match work.fit(method, self.options.terms_for(self.dof)) {
                Ok(fit) => {
                    if method == Method::FilterError && self.is_possible(&fit.0, bench) {
                        batch = Some(fit.0.clone());
                    }
                    fits.push(fit);
                }
                Err(error) => found.results.failures.push(self.failure(method.name(), &error)),
            }
        }
        fits.sort_by_key(|(fit, _)| requested.iter().position(|method| *method == fit.method));
        (fits, batch)
    }

    fn is_possible(&self, fit: &Fit, bench: &Bench) -> bool {
        let model = fit.model();
        let tested = score(&model, bench.tested(), &bench.nulls);
        tested.is_ok_and(|tested| {
            impossible(fit, self.vehicle, bench.speed_of(&model), &tested).is_none()
        })
    }

    /// Judges every fit; returns the recommended one.
    fn judge_all(
        &self,
        fits: Vec<(Fit, Vec<AxisRecord>)>,
        bench: &Bench,
        found: &mut Identification,
    ) -> Option<Fit> {
        let late = self.lateness(&fits);
        let mut judged = Vec::new();
        for (fit, axes) in fits {
            let method = fit.method;
            match self.judged(fit, axes, bench) {
                Ok(one) => judged.push(one),
                Err(error) => found.results.failures.push(self.failure(method.name(), &error)),
            }
        }
        self.recommend(judged, bench, &late, found)
    }

    /// Returns the requested methods; of the default ones, only those that the logs allow.
    fn methods(&self) -> Vec<Method> {
        let all = &self.options.methods;
        let axes = self.axes(&self.trials.fit, VelocitySource::Measured).unwrap_or_default();
        let is_blind = !axes.is_empty() && !axes.iter().any(AxisRecord::knows_velocity);
        match is_blind && *all == Method::DEFAULT {
            true => vec![Method::FilterError],
            false => all.clone(),
        }
    }

    /// Returns the methods in the order in which they are fitted.
    pub(super) fn in_order(&self) -> Vec<Method> {
        let mut order = self.methods();
        order.sort_by_key(|method| method.scheme().is_some());
        order
    }

    fn bench(&self) -> Result<Bench, Error> {
        let fitted = records(self.dof, &self.trials.fit)?;
        let held_out = records(self.dof, &self.trials.hold_out)?;
        let (nulls, speed) = (Nulls::of(&fitted), working_speed(&fitted));
        Ok(Bench { fitted, held_out, nulls, speed })
    }

    fn judged(&self, fit: Fit, axes: Vec<AxisRecord>, bench: &Bench) -> Result<Judged, Error> {
        let model = fit.model();
        let own = score(&model, &bench.fitted, &bench.nulls)?;
        let (mut hold_out, mut left) = (None, None);
        if !bench.held_out.is_empty() {
            hold_out = Some(score(&model, &bench.held_out, &bench.nulls)?);
        } else if fit.method != Method::Paper {
            let options = self.with_structure_of(&fit);
            let work = Work { options: &options, ..*self };
            left =
                left_out(&bench.fitted, &|rest| work.fit_alone(fit.method, rest, Some(fit.terms)))?;
        }
        let tested = hold_out.as_ref().unwrap_or(&own);
        let changes = [own.score.change, hold_out.as_ref().and_then(|one| one.score.change)];
        let changes = changes.map(|change| change.filter(|_| !has_drift(&fit)));
        // The intervals of the paper's method are kept unchanged, too.
        let fit = if fit.method == Method::Paper { fit } else { widened(fit, changes) };
        let speed = bench.speed_of(&model);
        let impossible = impossible(&fit, self.vehicle, speed, tested);
        Ok(Judged { fit, axes, own, hold_out, left_out: left, impossible })
    }

    fn recommend(
        &self,
        judged: Vec<Judged>,
        bench: &Bench,
        late: &BTreeMap<Method, Caveat>,
        found: &mut Identification,
    ) -> Option<Fit> {
        let terms = self.options.terms_for(self.dof);
        let fitted = Records { terms, ..Records::from(&bench.fitted) };
        let reversed = reversed(fitted, &self.options.equation_error);
        let of_thrust = [
            reversed.clone(),
            still(self.dof, &bench.fitted),
            feedback(self.dof, &bench.fitted),
            one_speed(self.dof, &bench.fitted),
        ];
        let of_thrust: Vec<Caveat> = of_thrust.into_iter().flatten().collect();
        let contender = |one: &'_ Judged| -> Option<String> {
            let reversed = reversed.as_ref().map(|caveat| caveat.message.clone());
            reversed.or(one.impossible.clone())
        };
        let contenders: Vec<Contender<'_>> = judged
            .iter()
            .map(|one| Contender {
                method: one.fit.method,
                impossible: contender(one),
                tested: one.tested(),
                fitted: Some(one.own()),
            })
            .collect();
        let chosen = choose(&contenders);
        if chosen.is_none() && !judged.is_empty() {
            found.results.failures.push(self.none_to_recommend(&contenders, reversed.as_ref()));
        }
        let recommended = chosen.map(|k| &judged[k]);
        for one in &judged {
            let mut doubts = of_thrust.clone();
            doubts.extend(late.get(&one.fit.method).cloned());
            let is_recommended = recommended.is_some_and(|r| r.fit.method == one.fit.method);
            match recommended {
                Some(_) if is_recommended => {
                    doubts.extend(self.beside_others(one, &judged, bench));
                    doubts.extend(self.of_record(one, bench));
                }
                Some(first) => doubts.extend(disagreement(&first.fit, &one.fit)),
                None => {}
            }
            let rivals = judged.iter().filter(|other| is_rival(other, one));
            let rivals: Vec<&Judged> = rivals.collect();
            if let Err(error) = self.add(one, &rivals, bench, doubts, is_recommended, found) {
                found.results.failures.push(self.failure(one.fit.method.name(), &error));
            }
        }
        let Results { plants, methods, .. } = &mut found.results;
        if let Some(plant) = plants.get_mut(self.dof.name()) {
            let others = methods.entry(self.dof.name().to_owned()).or_default();
            plant.caveats.extend(better_elsewhere(self.dof, plant, others));
        }
        let fit = recommended?.fit.clone();
        found.results.subsets.insert(self.dof, self.subsets(&fit));
        Some(fit)
    }

    fn none_to_recommend(
        &self,
        contenders: &[Contender<'_>],
        reversed: Option<&Caveat>,
    ) -> Failure {
        let message = reversed.map_or_else(
            || {
                let reason = |one: &Contender<'_>| {
                    Some(format!("{}: {}", one.method, one.impossible.as_ref()?))
                };
                let reasons: Vec<String> = contenders.iter().filter_map(reason).collect();
                format!(
                    "none of them gives a physical plant ({}); check thrust, its unit and its sign; run longer trials with more variation of thrust",
                    reasons.join("; ")
                )
            },
            |caveat| caveat.message.clone(),
        );
        Failure { dof: self.dof, method: ANY_METHOD.to_owned(), message }
    }

    /// Returns caveats on the recommended plant that follow from other methods' plants.
    fn beside_others(&self, one: &Judged, all: &[Judged], bench: &Bench) -> Vec<Caveat> {
        let others = || all.iter().filter(|other| other.fit.method != one.fit.method);
        let mut doubts: Vec<Caveat> = others()
            .filter(|other| other.fit.method != Method::Paper)
            .filter_map(|other| disputed(one, other, bench.speed))
            .collect();
        doubts.truncate(1);
        let first = all.first().filter(|first| first.fit.method != one.fit.method);
        if let Some(first) = first {
            let why = match &first.impossible {
                Some(why) => why.clone(),
                None if first.fit.method == Method::Paper => {
                    "that keeps a known fault, to compare with".to_owned()
                }
                None => "its errors on unseen trials are larger, by more than chance".to_owned(),
            };
            let message = format!(
                "{} is recommended in {} in place of {}: {why}",
                one.fit.method, self.dof, first.fit.method
            );
            doubts.push(Caveat::warning(CaveatCode::RecommendedByPrediction, message));
        }
        let follows = others().find(|other| other.fit.method == Method::FilterError);
        doubts.extend(follows.and_then(|other| short_against_long(one, other, bench.speed)));
        let simulates = others().find(|other| other.fit.method == Method::OutputError);
        doubts.extend(simulates.and_then(|other| outdone(one, other)));
        doubts
    }

    /// Returns caveats on the recommended plant that follow from the record.
    fn of_record(&self, one: &Judged, bench: &Bench) -> Vec<Caveat> {
        let model = one.fit.model();
        // What turning does to a sensor at a known place is no coupling.
        let lever = one.fit.nuisances.lever_m.map(|arm| arm.map_or(0.0, |arm| arm.value));
        let records: Cow<'_, [AxisRecord]> = match lever {
            [0.0, 0.0] => Cow::Borrowed(&bench.fitted),
            lever => bench.fitted.iter().map(|record| record.with_lever(lever)).collect(),
        };
        let Ok(fitted) = windows_of(&model, &records) else { return Vec::new() };
        let beside = |trial: &&&Trial| (trial.name().to_owned(), trial.beside().clone());
        let trials: Vec<&&Trial> = self.trials.fit.iter().collect();
        let beside: Vec<(String, Beside)> = trials.iter().map(beside).collect();
        let beside: Vec<(&str, &Beside)> =
            beside.iter().map(|(name, beside)| (name.as_str(), beside)).collect();
        let drift = Drift::of(&fitted);
        let coupling = Coupling::of(self.dof, &fitted, &beside);
        let all = [
            drift.and_then(|drift| drift.caveat(self.dof)),
            coupling
                .and_then(|coupling| coupling.caveat(self.dof))
                .or_else(|| turned(self.dof, &fitted, &beside)),
        ];
        all.into_iter().flatten().collect()
    }

    /// Returns the motion that trials outside the fit confirm.
    fn good_for(&self, scored: &Scored, bench: &Bench) -> GoodFor {
        let is_vouched = vouched(&scored.score, scored.of_trials());
        let felt = |record: &AxisRecord| -> Option<Vec<f64>> {
            let felt = record.acceleration.as_ref().filter(|_| !record.knows_velocity())?;
            Some(felt.windows().map(|mean| mean.mean).collect())
        };
        let of = |name: &str| {
            let record = bench.tested().iter().find(|record| record.trial == name);
            let moving = record.filter(|record| record.knows_velocity());
            (moving.and_then(|record| record.velocity().ok()), record.and_then(felt))
        };
        let tested = scored.trials.iter().map(|(name, trial)| {
            let (speed, acceleration) = of(name);
            let tested = Tested::new(name, self.dof, trial, (&scored.score, is_vouched));
            Tested { speed, acceleration, ..tested }
        });
        let tested: Vec<Tested<'_>> = tested.collect();
        GoodFor::new(&tested, &BTreeMap::new())
    }

    /// Returns mass and drag with all information on their accuracy.
    fn numbers(&self, one: &Judged, rivals: &[&Judged], bench: &Bench) -> Vec<Number> {
        let fit = &one.fit;
        let speed = bench.speed_of(&fit.model());
        let scores = [Some(&one.own), one.hold_out.as_ref()].into_iter().flatten();
        let changes: Vec<PlantChange> = scores
            .filter_map(|scored| scored.score.change)
            .filter(|change| change.is_confirmed() && !has_drift(fit))
            .collect();
        let of = |number: fn(&Fit, f64) -> f64| {
            let of = |other: &&Judged| {
                let because = OffBecause::Method { method: other.fit.method };
                (because, number(&other.fit, speed))
            };
            rivals.iter().map(of).collect()
        };
        let units = fit.dof.units();
        let name = if fit.dof.is_rotation() { "inertia" } else { "mass" };
        let drag = format!("drag at {} {}", spoken(speed), units.velocity);
        vec![
            Number {
                name: name.to_owned(),
                is_mass: true,
                estimate: fit.estimates().mass,
                changes: changes.iter().map(|change| change.mass).collect(),
                others: of(|fit, _| fit.estimates().mass.value),
            },
            Number {
                name: drag,
                is_mass: false,
                estimate: drag_at(fit, speed),
                changes: changes.iter().map(|change| change.drag).collect(),
                others: of(|fit, speed| drag_at(fit, speed).value),
            },
        ]
    }

    /// Returns a note if innovations are correlated over seconds, which most valid plants have; a
    /// warning where fitted terms may replace what is missing.
    fn not_white(&self, whiteness: f64, fit: &Fit) -> Option<Caveat> {
        let both = fit.terms.has(Term::Linear) && fit.terms.has(Term::Quadratic);
        let stand_in = match (both, fit.nuisances.inflow) {
            (_, Some(_)) => Some("inflow"),
            (true, None) => Some("linear drag"),
            (false, None) => None,
        };
        let mut message = format!(
            "what the {} model fails to predict is not white over {LAGS} samples: Box–Pierce is {whiteness:.1} times what chance makes; the model lacks something that moves the vehicle, and the intervals may be too narrow",
            self.dof
        );
        let code = CaveatCode::ResidualsNotWhite;
        (whiteness > NOT_WHITE).then(|| match stand_in {
            None => Caveat::note(code, message),
            Some(term) => {
                message += &format!("; {term} may be fitted in its stead");
                Caveat::warning(code, message)
            }
        })
    }

    fn add(
        &self,
        one: &Judged,
        rivals: &[&Judged],
        bench: &Bench,
        more: Vec<Caveat>,
        is_recommended: bool,
        found: &mut Identification,
    ) -> Result<(), Error> {
        let Judged { fit, axes, own, hold_out, left_out, .. } = one;
        let evidence = Evidence { fit, axes, trials: &self.trials.fit, vehicle: self.vehicle };
        let mut doubts = self.trials.left_out.clone();
        doubts.extend(caveats(&evidence)?);
        doubts.extend(more);
        doubts.extend(intervals(fit, bench.speed_of(&fit.model())));
        let whiteness = box_pierce(&fit.innovations);
        let plant_change = |scored: &Scored, which| {
            another_plant(self.dof, &scored.score, which, whiteness).filter(|_| !has_drift(fit))
        };
        let unseen = hold_out.as_ref().and_then(|scored| plant_change(scored, "held-out"));
        doubts.extend(unseen.or_else(|| plant_change(own, "fitted")));
        doubts.extend(whiteness.and_then(|whiteness| self.not_white(whiteness, fit)));
        let good_for = one.tested().map(|scored| self.good_for(scored, bench));
        let is_hidden =
            |score: &Score| score.mean_abs_error.is_some_and(|error| error < score.null_error);
        let held = hold_out.iter().filter(|scored| is_hidden(&scored.score));
        let worse = held.zip(&good_for).flat_map(|(_, good_for)| good_for.caveats(|_| true));
        doubts.extend(worse);
        let scores = Scores {
            fit: own.of_axis(self.dof),
            hold_out: hold_out.as_ref().map(|scored| scored.of_axis(self.dof)),
            left_out: left_out.as_ref().map(|scored| scored.of_axis(self.dof)),
        };
        doubts.extend(scoring(&scores.fit, scores.hold_out.as_ref()));
        doubts.sort_by_key(|caveat| std::cmp::Reverse(caveat.severity));
        doubts.dedup();
        let body = self.vehicle.rigid_body.as_ref();
        let mut plant = plant_result(fit, body, scores, doubts);
        plant.verdict.good_for = good_for;
        plant.verdict.may_be_off = may_be_off(&self.numbers(one, rivals, bench));
        let (dof, method, model) = (self.dof, fit.method, fit.model());
        found.models.push(FittedModel { dof, method, model });
        if is_recommended {
            found.results.plants.insert(plant.name(), plant.clone());
        }
        found.results.methods.entry(plant.name()).or_default().insert(method, plant);
        Ok(())
    }
}

/// Returns true if another fit is a valid rival: by another method, with equally good predictions.
fn is_rival(other: &Judged, one: &Judged) -> bool {
    let is_other = other.fit.method != one.fit.method && other.fit.method != Method::Paper;
    is_other && predicts_as_well(other, one)
}

/// Returns true if the model has a varying current: a simulation includes only its mean, and the
/// rest resembles a change of drag.
fn has_drift(fit: &Fit) -> bool {
    fit.nuisances.current_drift.is_some()
}
