//! Caveats from the comparison of fits, trials or degrees of freedom.

use std::collections::BTreeMap;

use crate::caveat::{estimated, spoken};
use crate::estimate::steady::SteadyFit;
use crate::estimate::{Estimate, Fit, Method};
use crate::judge::{Judged, drag_at, is_better, predicts_better};
use crate::results::{PlantResult, SteadyResult, TrialResult};
use crate::{Caveat, CaveatCode, Dof, Role};

/// Returns a caveat if two fits of one degree of freedom differ by more than their intervals allow.
///
/// The caveat applies to the fit that is not recommended if that one has a known fault, otherwise
/// to both.
pub(crate) fn disagreement(recommended: &Fit, other: &Fit) -> Option<Caveat> {
    let (a, b) = (recommended.estimates(), other.estimates());
    let pairs = [
        ("mass", Some(a.mass), Some(b.mass)),
        ("quadratic drag", a.d_quadratic, b.d_quadratic),
        ("linear drag", a.d_linear, b.d_linear),
    ];
    let apart = pairs.into_iter().find_map(|(name, a, b)| {
        let (a, b) = a.zip(b)?;
        // Differences below 5 % are irrelevant, however precise both estimates are.
        differ(a, b, 0.05).then_some((name, a, b))
    })?;
    let (name, a, b) = apart;
    let message = format!(
        "{} and {} disagree on the {name} in {}: {} against {}; the intervals do not include the cause of this",
        recommended.method,
        other.method,
        recommended.dof,
        estimated(a.value, a.std),
        estimated(b.value, b.std)
    );
    Some(Caveat::warning(CaveatCode::MethodsDisagree, message))
}

/// Relative difference of masses above which a dispute is reported …
const OTHER_MASS: f64 = 0.2;
/// … and that of drags.
const OTHER_DRAG: f64 = 0.3;

/// Returns whether a physically possible plant predicts unseen trials as well as another.
pub(crate) fn predicts_as_well(one: &Judged, other: &Judged) -> bool {
    let is_worse = one.tested().zip(other.tested()).map(|(own, than)| predicts_better(than, own));
    one.impossible.is_none() && is_worse == Some(false)
}

/// Returns a caveat if another method predicts unseen trials as well as the recommended one with a
/// different plant; drags are compared at `speed`.
pub(crate) fn disputed(one: &Judged, other: &Judged, speed: f64) -> Option<Caveat> {
    if !predicts_as_well(other, one) {
        return None;
    }
    let pair = [&one.fit, &other.fit];
    let all = [masses(pair, OTHER_MASS), drags(pair, speed, OTHER_DRAG)];
    let Apart { what, unit, own: x, other: y } = all.into_iter().flatten().next()?;
    let message = format!(
        "{} predicts trials that it has not seen as well as {}, and finds another {what} in {}: {} against {} {unit}; the trials do not show which is right",
        other.fit.method,
        one.fit.method,
        one.fit.dof,
        estimated(y.value, y.std),
        estimated(x.value, x.std)
    );
    let factor = (y.value / x.value).max(x.value / y.value);
    let is_open = !(factor > 0.0 && factor < ANOTHER_PLANT);
    let code = if is_open { CaveatCode::NotDetermined } else { CaveatCode::MethodsDisagree };
    Some(Caveat::warning(code, message))
}

/// A number of which two fits have different estimates.
struct Apart {
    what: String,
    unit: &'static str,
    own: Estimate,
    other: Estimate,
}

/// Returns true if two estimates differ by more than a part of the first, and than their intervals allow.
fn differ(x: Estimate, y: Estimate, part: f64) -> bool {
    let off = (x.value - y.value).abs();
    off > part * x.value.abs() && off > 2.0 * x.std.hypot(y.std)
}

/// Compares the masses of two fits.
fn masses([one, other]: [&Fit; 2], part: f64) -> Option<Apart> {
    let (own, other) = (one.estimates().mass, other.estimates().mass);
    let what = if one.dof.is_rotation() { "inertia" } else { "mass" }.to_owned();
    differ(own, other, part).then(|| Apart { what, unit: one.dof.units().mass, own, other })
}

/// Compares the drags of two fits at a speed.
fn drags([one, other]: [&Fit; 2], speed: f64, part: f64) -> Option<Apart> {
    let (own, other) = (drag_at(one, speed), drag_at(other, speed));
    let units = one.dof.units();
    let what = format!("drag at {} {}", spoken(speed), units.velocity);
    differ(own, other, part).then_some(Apart { what, unit: units.force, own, other })
}

/// Compares the quadratic drags of two fits that both have one.
fn quadratic_drags([one, other]: [&Fit; 2], part: f64) -> Option<Apart> {
    let (own, other) = one.estimates().d_quadratic.zip(other.estimates().d_quadratic)?;
    let (what, unit) = ("quadratic drag".to_owned(), one.dof.units().quadratic_drag);
    differ(own, other, part).then_some(Apart { what, unit, own, other })
}

/// Returns a caveat if the filter error method finds clearly another mass or drag than the recommended one: it
/// follows motion from sample to sample, and others follow whole trials or acceleration. Where these differ, the
/// model lacks what lasts for seconds. Drags are compared at `speed`, at half of it, and by their quadratic part.
pub(crate) fn short_against_long(
    one: &Judged,
    filter_error: &Judged,
    speed: f64,
) -> Option<Caveat> {
    if filter_error.impossible.is_some() {
        return None;
    }
    let pair = [&one.fit, &filter_error.fit];
    let all = [
        masses(pair, LASTING_MASS),
        drags(pair, speed, LASTING_DRAG),
        drags(pair, 0.5 * speed, LASTING_DRAG),
        quadratic_drags(pair, LASTING_DRAG),
    ];
    let Apart { what, unit, own, other } = all.into_iter().flatten().next()?;
    let message = format!(
        "what {} shows within seconds and over whole trials asks for different plants: {what} is {} {unit} by filter error and {} by {}; the model lacks something that lasts for seconds, such as drag that follows motion late, and mass and drag may be off by as much",
        one.fit.dof,
        estimated(other.value, other.std),
        estimated(own.value, own.std),
        one.fit.method
    );
    Some(Caveat::warning(CaveatCode::NotDetermined, message))
}

/// Relative difference of the masses of two horizons above which a plant lacks something …
const LASTING_MASS: f64 = 0.05;
/// … and that of their drags.
const LASTING_DRAG: f64 = 0.2;

/// Ratio of masses or drags of plants that predict equally well, above which the plant is not
/// determined.
const ANOTHER_PLANT: f64 = 1.5;

/// Returns a caveat if a plant simulates its own fitted trials clearly worse than output error's.
pub(crate) fn outdone(one: &Judged, by: &Judged) -> Option<Caveat> {
    let error = |judged: &Judged| judged.own().score.offset_free_error;
    let (own, others) = error(one).zip(error(by))?;
    let is_clear = others < CLEARLY_BETTER * own;
    (is_clear && is_better(&by.own().parts, &one.own().parts)).then(|| {
        let message = format!(
            "{} simulates the {} trials that it was fitted to clearly worse than {}: e = {} against {} {} with offsets removed; its fit may have stopped at a local optimum",
            one.fit.method,
            one.fit.dof,
            by.fit.method,
            spoken(own),
            spoken(others),
            one.fit.dof.units().velocity
        );
        Caveat::warning(CaveatCode::AnotherPredictsBetter, message)
    })
}

/// Ratio of errors below which another plant is clearly better.
const CLEARLY_BETTER: f64 = 0.85;

/// Returns a caveat if another method predicts the held-out trials clearly better.
pub(crate) fn better_elsewhere(
    dof: Dof,
    recommended: &PlantResult,
    others: &BTreeMap<Method, PlantResult>,
) -> Option<Caveat> {
    let error = |plant: &PlantResult| plant.held_out(dof)?.offset_free_error;
    let own = error(recommended)?;
    let (method, best) = others
        .iter()
        .filter_map(|(method, plant)| Some((*method, error(plant)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best < CLEARLY_BETTER * own).then(|| {
        let message = format!(
            "{method} predicts the held-out {dof} trials better than {}: e = {} against {} {} with offsets removed; compare both before you choose",
            recommended.method,
            spoken(best),
            spoken(own),
            dof.units().velocity
        );
        Caveat::warning(CaveatCode::AnotherPredictsBetter, message)
    })
}

/// Adds caveats on reverse thrust to other degrees of freedom if one shows a wrong ratio: pairs of
/// thrusters with opposite thrusts hide it in their scale.
pub(crate) fn reverse_elsewhere(
    plants: &mut BTreeMap<String, PlantResult>,
    steady: &mut BTreeMap<Dof, SteadyResult>,
) {
    const NAME: &str = "reverse_ratio";
    let off = Dof::ALL.into_iter().find_map(|dof| {
        let ratio = plants.get(dof.name())?.nuisances.get(NAME)?;
        (ratio.low95 > 1.0 || ratio.high95 < 1.0).then_some((dof, ratio.value))
    });
    let Some((seen_in, ratio)) = off else { return };
    for (dof, steady) in steady {
        let message = format!(
            "in {seen_in} reverse thrust is {} times what its curve says; steady {dof} drag uses the curve unchanged, so that its drag and bias force are wrong: correct the reverse curve and identify again",
            spoken(ratio)
        );
        steady.caveats.push(Caveat::warning(CaveatCode::ReverseThrust, message));
    }
    for (dof, plant) in plants.iter_mut().filter(|(_, plant)| !plant.nuisances.contains_key(NAME)) {
        let message = format!(
            "in {seen_in} reverse thrust is {} times what its curve says; {dof} does not show it, as where one thruster pushes ahead while another pushes astern, so its mass and drag may be off by up to {:.0} %: correct the reverse curve and identify again",
            spoken(ratio),
            100.0 * (ratio - 1.0).abs()
        );
        plant.caveats.push(Caveat::warning(CaveatCode::ReverseThrust, message));
    }
}

/// Strokes of the vehicle in unsteady and steady trials.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Strokes {
    unsteady: Option<Stroke>,
    steady: Option<Stroke>,
}

/// The greatest stroke of several trials.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stroke {
    length: f64,
    keulegan_carpenter: Option<f64>,
}

impl Strokes {
    pub(crate) fn of(dof: Dof, trials: &[TrialResult]) -> Self {
        let greatest = |role: Role| {
            let axes = trials.iter().filter(|trial| trial.role == role);
            let strokes = axes.filter_map(|trial| {
                let axis = trial.axes.get(&dof)?;
                Some(Stroke { length: axis.stroke?, keulegan_carpenter: axis.keulegan_carpenter })
            });
            strokes.max_by(|a, b| a.length.total_cmp(&b.length))
        };
        Self { unsteady: greatest(Role::Fit), steady: greatest(Role::Steady) }
    }
}

impl Stroke {
    fn spoken(self, unit: &str) -> String {
        match self.keulegan_carpenter {
            Some(number) => format!(
                "{} {unit} (Keulegan–Carpenter number {})",
                spoken(self.length),
                spoken(number)
            ),
            None => format!("{} {unit}", spoken(self.length)),
        }
    }
}

/// Returns a caveat if unsteady and steady drag differ by more than their intervals allow, by the
/// test in the fit if there is one.
pub(crate) fn steady_against_unsteady(
    fit: &Fit,
    steady: &SteadyFit,
    strokes: &Strokes,
) -> Option<Caveat> {
    // The drag of the plant, even if the test fitted its own: one drag has one number.
    let unsteady = fit.estimates().d_quadratic?;
    let (runs, sure) = match fit.steady_test {
        Some(test) => (test.steady.d_quadratic?, !test.agrees),
        None => {
            let joint = steady.joint?.d_quadratic;
            let off = (unsteady.value - joint.value).abs();
            (joint, off > 2.0 * unsteady.std.hypot(joint.std))
        }
    };
    let off = (unsteady.value - runs.value).abs();
    (sure && off > 0.05 * runs.value.abs()).then(|| {
        let mut message = format!(
            "quadratic drag in {} is {} when the vehicle oscillates and {} in steady runs",
            fit.dof,
            estimated(unsteady.value, unsteady.std),
            estimated(runs.value, runs.std)
        );
        let unit = fit.dof.units().position;
        if let Some((to_and_fro, along)) = strokes.unsteady.zip(strokes.steady) {
            message += &format!(
                "; when it oscillates it travels {} through its own wake, and {} in the longest run",
                to_and_fro.spoken(unit),
                along.spoken(unit)
            );
        }
        message += ": drag depends on this, so use the value that is closer to the intended use (the plant here is from the oscillation)";
        Caveat::warning(CaveatCode::SteadyUnsteadyDisagree, message)
    })
}
