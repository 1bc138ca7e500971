//! The verdict on a plant, as a whole and axis by axis.

use std::collections::{BTreeMap, BTreeSet};

use crate::judge::{Judge, statement, vouched};
use crate::results::{GoodFor, MayBeOff, PlantResult, PlantScore, Score, Trust, Verdict};
use crate::{Caveat, CaveatCode, Dof, Severity, Stability};

/// What a plant is judged by, beside its caveats and its errors on unseen trials.
#[derive(Default)]
pub(super) struct Evidence<'a> {
    /// Those of the caveats that are of one axis.
    pub(super) of_axes: Vec<(Dof, &'a Caveat)>,
    /// Why no axis may be trusted.
    pub(super) against_all: Option<&'static str>,
    /// Axes in which the plant lacks something that moves the vehicle, by the colour of their innovations.
    pub(super) lacking: BTreeSet<Dof>,
    /// True if thrust acts before its log says: what an axis lacks may then be thrust, which all axes lack.
    pub(super) is_early: bool,
    /// The motion that unseen trials confirm.
    pub(super) good_for: Option<GoodFor>,
    /// How far numbers of each axis may be off.
    pub(super) may_be_off: Vec<(Dof, MayBeOff)>,
}

/// Judges a plant of one axis that was identified alone. Takes the confirmed motion and the possible errors of
/// numbers from the present verdict.
pub(super) fn verdict(plant: &PlantResult) -> Verdict {
    let dof = plant.first_axis();
    let Verdict { good_for, may_be_off, .. } = plant.verdict.clone();
    let evidence = Evidence {
        of_axes: plant.caveats.iter().map(|caveat| (dof, caveat)).collect(),
        good_for,
        may_be_off: may_be_off.into_iter().map(|off| (dof, off)).collect(),
        ..Evidence::default()
    };
    Judgement { plant, evidence: &evidence }.verdicts().0
}

/// A plant with what it is judged by.
#[derive(Clone, Copy)]
pub(super) struct Judgement<'a> {
    pub(super) plant: &'a PlantResult,
    pub(super) evidence: &'a Evidence<'a>,
}

/// Errors of a plant on trials that it was not fitted to.
#[derive(Clone, Copy)]
struct Tested<'a> {
    score: &'a PlantScore,
    /// How sentences name the trials.
    trials: &'a str,
}

impl Judgement<'_> {
    /// Judges a plant by its stability, its caveats, its innovations and its error on unseen trials: as a whole, and
    /// axis by axis.
    ///
    /// What makes all of it doubtful or unfit to use counts for every axis. Where single axes are
    /// doubtful, the others may be used with care. Doubts of roll and pitch alone leave the plant usable with
    /// care: these axes are held near rest by weight and buoyancy, and their mass and drag hardly
    /// change the motion along the others, which held-out trials test by themselves. Where thrust acts
    /// before its log says, what an axis lacks may be thrust, which all axes then lack.
    pub(super) fn verdicts(self) -> (Verdict, BTreeMap<Dof, Verdict>) {
        let Self { plant, evidence } = self;
        let trials = self.trials();
        let score = plant.hold_out.as_ref().or(plant.left_out.as_ref());
        let tested = score.map(|score| Tested { score, trials: &trials });
        let own: BTreeMap<Dof, String> = tested.map_or_else(BTreeMap::new, |tested| {
            let of = |dof: &Dof| Some((*dof, self.doubt(*dof, tested)?));
            plant.axes.iter().filter_map(of).collect()
        });
        let whole = self.whole(tested, &own);
        let untested = tested.map(Tested::untested).unwrap_or_default();
        let is_of_all = whole.trust == Trust::DoNotUse || evidence.against_all.is_some();
        let doubtful = |reason| Verdict::new(Trust::Doubtful, reason, whole.codes.clone());
        let of = |&dof: &Dof| {
            let verdict = match own.get(&dof).cloned() {
                _ if is_of_all || own.is_empty() && untested.is_empty() => whole.clone(),
                Some(reason) => doubtful(reason),
                None if untested.contains(&dof) => doubtful(masked(&untested)),
                None => beside_doubtful(score.and_then(|score| score.by_axis.get(&dof)), &whole),
            };
            (dof, self.with_motion(Some(dof), verdict))
        };
        let by_axis = plant.axes.iter().map(of).collect();
        (self.with_motion(None, whole), by_axis)
    }

    /// Adds the motion that trials confirm, and how far numbers may be off; of one axis, or of all.
    fn with_motion(self, axis: Option<Dof>, verdict: Verdict) -> Verdict {
        let Evidence { good_for, may_be_off, .. } = self.evidence;
        let good_for = good_for.as_ref().map(|good_for| match axis {
            Some(dof) => good_for.of_axis(dof),
            None => good_for.clone(),
        });
        let own = may_be_off.iter().filter(|(dof, _)| axis.is_none_or(|axis| axis == *dof));
        let own = own.filter(|(_, off)| off.matters(verdict.trust));
        Verdict { good_for, may_be_off: own.map(|(_, off)| off.clone()).collect(), ..verdict }
    }

    /// Returns how sentences name the trials that test the plant.
    fn trials(self) -> String {
        match &self.plant.hold_out {
            None => "trials that were left out in turn".to_owned(),
            Some(_) if !self.plant.is_alone() => "held-out trials".to_owned(),
            Some(held) => match held.by_trial.len() {
                0 | 1 => "the held-out trial".to_owned(),
                n => format!("the {n} held-out trials"),
            },
        }
    }

    /// Judges the plant as a whole; `own` are the doubts of its axes.
    fn whole(self, tested: Option<Tested<'_>>, own: &BTreeMap<Dof, String>) -> Verdict {
        let Self { plant, evidence } = self;
        let judge = Judge(&plant.caveats);
        let doubtful = |reason: String| judge.verdict(Trust::Doubtful, reason);
        if let Some(alone) = plant.alone.as_ref().filter(|alone| !alone.stable) {
            let how = plant_is(&alone.stability, plant.first_axis());
            return judge.verdict(Trust::DoNotUse, format!("the model {how}"));
        }
        if let Some(verdict) = judge.severe() {
            return verdict;
        }
        let Some(tested) = tested.filter(|tested| !tested.score.by_axis.is_empty()) else {
            return doubtful("no held-out trial has tested it".to_owned());
        };
        let Tested { score, trials } = tested;
        if score.by_axis.values().any(|own| own.mean_abs_error.is_none()) {
            return judge.verdict(Trust::DoNotUse, format!("its simulation of {trials} diverges"));
        }
        if let Some(reason) = evidence.against_all {
            return doubtful(reason.to_owned());
        }
        let is_of_axis = |caveat: &Caveat| evidence.of_axes.iter().any(|(_, own)| *own == caveat);
        let is_unknown =
            |caveat: &&Caveat| caveat.code == CaveatCode::NotDetermined && !is_of_axis(caveat);
        if let Some(doubt) = judge.warnings().find(is_unknown) {
            return doubtful(statement(&doubt.message));
        }
        let lacks_thrust =
            |dof: &Dof| evidence.is_early && self.lacks(*dof, score.by_axis.get(dof));
        if let Some(reason) = doubt_of_all(&plant.axes, own, lacks_thrust) {
            return doubtful(reason.clone());
        }
        let untested = tested.untested();
        if !untested.is_empty() {
            return doubtful(masked(&untested));
        }
        let is_vouched = plant.axes.iter().all(|dof| tested.is_vouched(*dof));
        if evidence.good_for.as_ref().is_some_and(GoodFor::is_nothing) && !is_vouched {
            return doubtful(format!("none of {trials} by itself confirms it"));
        }
        self.confirmed(judge, tested, own)
    }

    /// Returns the verdict on a plant that unseen trials confirm.
    fn confirmed(
        self,
        judge: Judge<'_>,
        tested: Tested<'_>,
        own: &BTreeMap<Dof, String>,
    ) -> Verdict {
        let Self { plant, evidence } = self;
        // What all trials together have says nothing of those that are worse than without a plant.
        let is_hidden = |dof: Dof| !tested.falls_short(dof);
        let hides = evidence
            .good_for
            .as_ref()
            .filter(|good_for| good_for.not_as_in.iter().any(|worse| is_hidden(worse.axis)));
        let predicts = match tested.score.by_axis.get(&plant.first_axis()) {
            Some(score) if self.plant.is_alone() => {
                predicts_alone(plant.first_axis(), score, tested.trials)
            }
            _ => tested.predicts(own, hides),
        };
        let exceptions = hides.and_then(GoodFor::exceptions);
        let but = exceptions.map_or(String::new(), |trials| format!("; but not {trials}"));
        let doubts = own.iter().map(|(dof, reason)| format!("; {dof} is doubtful: {reason}"));
        let predicts = format!("{predicts}{but}{}", doubts.collect::<String>());
        if plant.hold_out.is_none() && judge.warnings().next().is_none() {
            let reason = format!("no trial was held out; it {predicts}");
            return judge.verdict(Trust::UsableWithCare, reason);
        }
        let has_exceptions = hides.is_some() || !own.is_empty();
        let best = if has_exceptions { Trust::UsableWithCare } else { Trust::Usable };
        judge.confirmed(best, &predicts)
    }

    /// Returns why an axis is doubtful, if it is.
    fn doubt(self, dof: Dof, tested: Tested<'_>) -> Option<String> {
        let warnings = || {
            let own = self.evidence.of_axes.iter().filter(|(on, _)| *on == dof);
            own.map(|(_, caveat)| *caveat).filter(|caveat| caveat.severity == Severity::Warning)
        };
        if let Some(caveat) = warnings().find(|caveat| is_doubt(caveat.code)) {
            return Some(statement(&caveat.message));
        }
        if let Some(reason) = tested.refuted(dof) {
            return Some(reason);
        }
        let warns = |code| warnings().any(|caveat| caveat.code == code);
        let score = tested.score.by_axis.get(&dof);
        if warns(CaveatCode::AnotherPlantFits) {
            let changes = [self.plant.fitted(dof), score];
            let mut changes = changes.into_iter().filter_map(|score| score?.change);
            if changes.any(|change| change.refutes()) {
                let reason = "what trials ask for is further off than a usable plant may be";
                return Some(reason.to_owned());
            }
        }
        if warns(CaveatCode::WideInterval)
            && let Some(reason) = self.beside_wide_interval(dof, warns)
        {
            return Some(reason.to_owned());
        }
        self.lacks(dof, score).then(|| lacks_something(dof))
    }

    /// Returns why an axis is doubtful whose interval is wide.
    fn beside_wide_interval(
        self,
        dof: Dof,
        warns: impl Fn(CaveatCode) -> bool,
    ) -> Option<&'static str> {
        // An interval that is wide enough to include the values that trials support is not contradicted
        // by them.
        let mut off = self.evidence.may_be_off.iter().filter(|(on, _)| *on == dof).peekable();
        let is_beyond = off.peek().is_none() || off.any(|(_, off)| off.is_beyond_interval());
        if warns(CaveatCode::NoBetterThanNull) {
            Some(
                "its interval is wide, and on a held-out trial it is no better than a model that never moves",
            )
        } else if is_beyond && warns(CaveatCode::AnotherPlantFits) {
            Some("its interval is wide, and the trials contradict it nevertheless")
        } else if warns(CaveatCode::ResidualsNotWhite) {
            Some("its interval is wide, and something moves the vehicle that the model lacks")
        } else {
            None
        }
    }

    /// Returns true if the plant lacks what matters in an axis. Of ten thousand samples a correlation of
    /// 0.02 is clear already; a plant that explains nearly all motion of unseen trials, from thrust alone, lacks
    /// little all the same.
    fn lacks(self, dof: Dof, score: Option<&Score>) -> bool {
        let explained = score.and_then(|score| score.r_squared).is_some_and(|r2| r2 > EXPLAINED);
        self.evidence.lacking.contains(&dof) && !explained
    }
}

/// Held-out motion that a plant explains to this part lacks little.
const EXPLAINED: f64 = 0.98;

/// Returns true for caveats that leave an axis unconfirmed even as warnings.
const fn is_doubt(code: CaveatCode) -> bool {
    use CaveatCode::{CoupledAxes, InstrumentElsewhere, NotDetermined};
    matches!(code, NotDetermined | CoupledAxes | InstrumentElsewhere)
}

impl Tested<'_> {
    /// Returns what unseen trials refute an axis by.
    fn refuted(self, dof: Dof) -> Option<String> {
        let score = self.score.by_axis.get(&dof)?;
        let is_vouched = self.is_vouched(dof);
        if is_vouched && score.is_worse_than_null() {
            return score.shortfall(dof, self.trials);
        }
        let is_explained = score.is_of_disturbance() || score.is_followed() || is_vouched;
        if is_explained { None } else { score.shortfall(dof, self.trials) }
    }

    fn is_vouched(self, dof: Dof) -> bool {
        let trials = || self.score.trials(dof).map(|(_, score)| score);
        self.score.by_axis.get(&dof).is_some_and(|score| vouched(score, trials()))
    }

    fn falls_short(self, dof: Dof) -> bool {
        self.score.by_axis.get(&dof).is_some_and(Score::falls_short)
    }

    /// Returns the axes that unseen trials do not test, if that is half of them or more: few tests passed by
    /// the others are no test of the plant.
    fn untested(self) -> Vec<Dof> {
        let is_untested = |(dof, score): &(&Dof, &Score)| {
            score.falls_short() && !score.is_followed() && !self.is_vouched(**dof)
        };
        let axes = self.score.by_axis.iter().filter(is_untested);
        let axes: Vec<Dof> = axes.map(|(dof, _)| *dof).collect();
        if 2 * axes.len() >= self.score.by_axis.len() { axes } else { Vec::new() }
    }

    /// Says how well a plant of several axes predicts trials; `own` are the doubts of axes, and `hides` the motion
    /// that trials confirm if others are worse than without a plant.
    fn predicts(self, own: &BTreeMap<Dof, String>, hides: Option<&GoodFor>) -> String {
        let axes = self.score.by_axis.iter().filter(|(dof, _)| !own.contains_key(dof));
        let (hidden, seen): (Vec<_>, Vec<_>) = axes.partition(|(_, score)| score.falls_short());
        let pooled = seen.iter().filter_map(|(_, score)| score.r_squared).min_by(f64::total_cmp);
        let seen_axes: Vec<Dof> = seen.iter().map(|(dof, _)| **dof).collect();
        let of_trials = hides.and_then(|good_for| self.least_r2(&seen_axes, good_for));
        // Rounded down: "or more" has to hold.
        let least = (100.0 * of_trials.or(pooled).unwrap_or(f64::INFINITY)).floor() / 100.0;
        let allowed = match hidden.iter().all(|(dof, _)| self.is_vouched(**dof)) {
            true => ", which ask for the same plant there where these are allowed for",
            false => "",
        };
        let names = |of: &[(&Dof, &Score)]| {
            of.iter().map(|(dof, _)| dof.to_string()).collect::<Vec<_>>().join(", ")
        };
        let all = if own.is_empty() { "every axis".to_owned() } else { names(&seen) };
        match (seen.is_empty(), hidden.is_empty()) {
            (_, true) => format!("predicts {all} of held-out trials with R² of {least:.2} or more"),
            (true, _) => {
                format!(
                    "forces that are not logged mask its prediction of whole held-out trials{allowed}"
                )
            }
            _ => format!(
                "predicts {} of held-out trials with R² of {least:.2} or more; over whole trials, forces that are not logged mask {}{allowed}",
                names(&seen),
                names(&hidden)
            ),
        }
    }

    /// Returns the least R² of some axes over the trials that confirm them.
    fn least_r2(self, axes: &[Dof], good_for: &GoodFor) -> Option<f64> {
        let r2 = axes.iter().filter_map(|dof| {
            let own = &good_for.motion.get(dof)?.trials;
            let of = |trial: &String| self.score.by_trial.get(trial)?.get(dof)?.r_squared;
            own.iter().filter_map(of).min_by(f64::total_cmp)
        });
        r2.min_by(f64::total_cmp)
    }
}

/// Returns the doubt of a single axis that makes a plant of some axes doubtful as a whole: of another axis than
/// roll and pitch, of one that lacks thrust, or of a plant without others.
fn doubt_of_all<'a>(
    axes: &[Dof],
    own: &'a BTreeMap<Dof, String>,
    lacks_thrust: impl Fn(&Dof) -> bool,
) -> Option<&'a String> {
    let is_tilt = |dof: &Dof| matches!(dof, Dof::Roll | Dof::Pitch);
    let has_others = axes.iter().any(|dof| !is_tilt(dof));
    let is_of_all = |dof: &Dof| !has_others || !is_tilt(dof) || lacks_thrust(dof);
    own.iter().find(|(dof, _)| is_of_all(dof)).map(|(_, reason)| reason)
}

/// Returns the verdict on an axis without a doubt of its own in a plant that is doubtful for others.
fn beside_doubtful(score: Option<&Score>, whole: &Verdict) -> Verdict {
    let r2 = score.filter(|score| !score.falls_short()).and_then(|score| score.r_squared);
    let predicted = match r2 {
        Some(r2) => format!("predicts held-out trials with R² of {r2:.2}"),
        None => "forces that are not logged mask it in held-out trials".to_owned(),
    };
    let reason = format!("{predicted}; other axes of the plant are doubtful");
    Verdict::new(Trust::UsableWithCare, reason, whole.codes.clone())
}

fn masked(axes: &[Dof]) -> String {
    let names: Vec<String> = axes.iter().map(Dof::to_string).collect();
    format!(
        "held-out trials do not test {}: forces that are not logged do as much there as the plant",
        names.join(", ")
    )
}

fn lacks_something(dof: Dof) -> String {
    format!(
        "what it fails to predict in {dof} is strongly correlated in time: the model lacks something, and its coefficients compensate for it"
    )
}

fn predicts_alone(dof: Dof, score: &Score, trials: &str) -> String {
    format!(
        "predicts {trials} with e = {} {} against {} for {}",
        score.mean_abs_error.map_or("none".to_owned(), spoken2),
        score.quantity.unit(dof),
        spoken2(score.null_error),
        score.quantity.null_model(),
    )
}

fn plant_is(stability: &Stability, dof: Dof) -> String {
    match stability {
        Stability::Stable => "is stable".to_owned(),
        Stability::Unstable => "is unstable: nothing opposes motion".to_owned(),
        other => format!("{other} {}", dof.units().velocity),
    }
}

/// Formats a number to two significant digits.
fn spoken2(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let decimals = (1 - x.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{x:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify;
    use crate::results::{LikelyChange, NullModel, NullScore, PlantChange};
    use crate::twin::{TwinSpec, make};
    use crate::{Estimate, IdentifyOptions, Method, Trial, TrialSetup};

    /// Returns a plant of the twin by equation error, without caveats.
    fn plant() -> PlantResult {
        let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 120.0, ..TwinSpec::jason2() };
        let dive = make(&spec).expect("valid");
        let trial = |log: &crate::twin::TwinTrial| {
            let (name, role, dofs) = (log.name.clone(), log.role, log.dofs.clone());
            let setup = TrialSetup { name, role, dofs, ..TrialSetup::default() };
            Trial::new(setup, &log.recording, &dive.vehicle).expect("complete")
        };
        let trials: Vec<Trial> = dive.trials.iter().map(trial).collect();
        let options =
            IdentifyOptions { methods: vec![Method::EquationError], ..IdentifyOptions::default() };
        let mut plant = identify(&dive.vehicle, &trials, &options).results.plants["surge"].clone();
        plant.caveats.clear();
        plant
    }

    fn judged(change: impl FnOnce(&mut PlantResult)) -> Verdict {
        let mut plant = plant();
        change(&mut plant);
        verdict(&plant)
    }

    /// Adds a held-out score in which only the errors matter.
    fn scored(plant: &mut PlantResult, e: Option<f64>, null: Option<f64>) {
        let held = plant.hold_out.as_mut().expect("the twin has one");
        let trials = held.by_trial.values_mut().flat_map(BTreeMap::values_mut);
        trials.for_each(|trial| trial.position_r_squared = None);
        let score = held.by_axis.get_mut(&Dof::Surge).expect("its axis");
        (score.mean_abs_error, score.offset_free_error, score.change) = (e, e, None);
        score.null_error = 0.11;
        let model = NullModel::SteadySpeed;
        score.best_null = null.map(|mean_abs_error| NullScore { model, mean_abs_error });
    }

    #[test]
    fn a_predicting_plant_is_usable_and_with_warnings_usable_with_care() {
        let found = judged(|plant| scored(plant, Some(0.021), Some(0.09)));
        assert_eq!(found.trust, Trust::Usable);
        assert!(found.reason.contains("e = 0.021 m/s against 0.11"), "{}", found.reason);
        let warning = Caveat::warning(CaveatCode::Collinear, "x");
        let found = judged(|plant| plant.caveats = vec![warning]);
        assert_eq!(
            (found.trust, found.codes),
            (Trust::UsableWithCare, vec![CaveatCode::Collinear])
        );
    }

    #[test]
    fn an_untested_or_undetermined_plant_is_doubtful() {
        assert_eq!(judged(|plant| plant.hold_out = None).trust, Trust::Doubtful);
        let wide = Caveat::warning(CaveatCode::NotDetermined, "the mass is anything: drive on");
        let found = judged(|plant| plant.caveats = vec![wide]);
        assert_eq!((found.trust, found.reason.as_str()), (Trust::Doubtful, "the mass is anything"));
    }

    #[test]
    fn a_plant_is_doubtful_where_trials_ask_for_one_that_is_further_off_than_usable_plants_are() {
        let asks = |mass: f64| {
            judged(|plant| {
                let part = |value| Estimate::new(value, 0.01, 1e4).into();
                let change = PlantChange { mass: part(mass), drag: part(0.0), explained: 0.5 };
                let held = plant.hold_out.as_mut().expect("the twin has one");
                held.by_axis.get_mut(&Dof::Surge).expect("its axis").change = Some(change);
                plant.caveats = vec![Caveat::warning(CaveatCode::AnotherPlantFits, "x")];
            })
        };
        assert_eq!(asks(-0.17).trust, Trust::Doubtful);
        assert_eq!(asks(-0.07).trust, Trust::UsableWithCare);
    }

    #[test]
    fn a_plant_must_beat_the_best_model_without_one() {
        let found = judged(|plant| scored(plant, Some(0.021), Some(0.022)));
        assert_eq!(found.trust, Trust::Doubtful);
        assert!(found.reason.contains("the steady speed for the thrust"), "{}", found.reason);
        assert_eq!(judged(|plant| scored(plant, Some(0.1), None)).trust, Trust::Doubtful);
    }

    #[test]
    fn a_followed_path_confirms_a_plant_despite_noise() {
        let found = judged(|plant| {
            scored(plant, Some(0.1), Some(0.1));
            let held = plant.hold_out.as_mut().expect("the twin has one");
            let trials = held.by_trial.values_mut().flat_map(BTreeMap::values_mut);
            trials.for_each(|trial| trial.position_r_squared = Some(0.99));
        });
        assert_eq!(found.trust, Trust::Usable);
    }

    #[test]
    fn severe_caveats_instability_and_divergence_forbid_use() {
        let severe = Caveat::severe(CaveatCode::WrongSign, "x");
        let found = judged(|p| p.caveats = vec![severe]);
        assert_eq!(found.trust, Trust::DoNotUse);
        assert_eq!(found.reason, "severe caveat: wrong sign");
        assert_eq!(
            judged(|p| p.alone.as_mut().expect("alone").stable = false).trust,
            Trust::DoNotUse
        );
        assert_eq!(judged(|p| scored(p, None, None)).trust, Trust::DoNotUse);
    }

    fn refuted(score: Score) -> Option<String> {
        let score = PlantScore { by_axis: [(Dof::Sway, score)].into(), ..PlantScore::default() };
        Tested { score: &score, trials: "held-out trials" }.refuted(Dof::Sway)
    }

    fn untested(score: PlantScore) -> Vec<Dof> {
        Tested { score: &score, trials: "held-out trials" }.untested()
    }

    /// A model that never moves has an error of 0.1.
    fn axis(error: f64, disturbance: f64) -> Score {
        Score {
            mean_abs_error: Some(error),
            null_error: 0.1,
            disturbance_error: Some(disturbance),
            r_squared: Some(1.0 - (error / 0.1).powi(2)),
            ..Score::default()
        }
    }

    /// A trial that knows mass and drag within these parts, and would have so much more mass.
    fn asks(mass: f64, drag_std: f64) -> Option<LikelyChange> {
        let part = |value, std| Estimate::new(value, std, 1e4).into();
        let (mass, drag) = (part(mass, 0.01), part(0.0, drag_std));
        Some(LikelyChange { mass, drag, whiteness: 1.0, surprise: 1.0 })
    }

    #[test]
    fn a_trial_that_asks_for_the_same_plant_vouches_for_it() {
        // Free, it is off by more than is known to disturb it.
        let axis = |likely_change| Score { likely_change, ..axis(0.09, 0.01) };
        assert!(refuted(axis(asks(0.0, 0.3))).is_some(), "drag is not known");
        assert!(refuted(axis(asks(0.2, 0.05))).is_some(), "it asks for another mass");
        let vouched = axis(asks(0.01, 0.05));
        assert_eq!(refuted(vouched), None);
        assert_eq!(untested(of_axes(&[vouched, vouched])), []);
        let coloured = LikelyChange { whiteness: 3.0, ..asks(0.0, 0.05).expect("some") };
        assert!(refuted(axis(Some(coloured))).is_some(), "the model lacks something");
        let disturbed = LikelyChange { surprise: 2.0, ..asks(0.0, 0.05).expect("some") };
        assert!(refuted(axis(Some(disturbed))).is_some(), "something else moves it");
    }

    fn of_axes(axes: &[Score]) -> PlantScore {
        let by_axis = Dof::ALL.into_iter().zip(axes.iter().copied()).collect();
        PlantScore { by_axis, ..PlantScore::default() }
    }

    #[test]
    fn a_plant_is_tested_where_most_of_its_axes_are() {
        let (good, masked) = (axis(0.01, 0.01), axis(0.09, 0.09));
        assert_eq!(untested(of_axes(&[good, good, masked])), []);
        assert_eq!(untested(of_axes(&[masked, good, good, masked])), [Dof::Surge, Dof::Roll]);
        // A swing that is followed for seconds is a test passed.
        let followed =
            Score { restarted_error: Some(0.01), kept_error: Some(0.1), ..axis(0.09, 0.09) };
        assert_eq!(untested(of_axes(&[masked, good, good, followed])), []);
    }

    #[test]
    fn doubts_of_roll_and_pitch_alone_leave_the_others_usable() {
        let whole = |axes: &[Dof], doubtful: &[Dof], lacks_thrust: Option<Dof>| {
            let own = doubtful.iter().map(|dof| (*dof, dof.to_string())).collect();
            doubt_of_all(axes, &own, |dof| lacks_thrust == Some(*dof)).cloned()
        };
        assert_eq!(whole(&Dof::ALL, &[], None), None);
        assert_eq!(whole(&Dof::ALL, &[Dof::Roll, Dof::Pitch], None), None);
        let pitch = Some("pitch".to_owned());
        assert_eq!(whole(&Dof::ALL, &[Dof::Roll, Dof::Pitch], Some(Dof::Pitch)), pitch);
        assert_eq!(whole(&Dof::ALL, &[Dof::Roll, Dof::Yaw], None), Some("yaw".to_owned()));
        assert_eq!(whole(&[Dof::Roll, Dof::Pitch], &[Dof::Pitch], None), pitch);
    }

    #[test]
    fn an_axis_is_refuted_by_an_error_that_nothing_else_explains() {
        let reason = refuted(axis(0.09, 0.01)).expect("0.09 of 0.1, and disturbances make 0.01");
        assert!(reason.contains("the error of sway is 0.09"), "{reason}");
        assert_eq!(refuted(axis(0.09, 0.09)), None);
        assert_eq!(refuted(axis(0.01, 0.0)), None);
        let followed =
            Score { restarted_error: Some(0.01), kept_error: Some(0.1), ..axis(0.09, 0.01) };
        assert_eq!(refuted(followed), None);
        let null = NullScore { model: NullModel::KeepsMeanSpeed, mean_abs_error: 0.042 };
        let flat = Score { best_null: Some(null), ..axis(0.04, 0.0) };
        let reason = refuted(flat).expect("explains nothing");
        assert!(reason.contains("0.0400 m/s, hardly less than that of"), "{reason}");
    }
}
