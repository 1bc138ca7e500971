//! Reasons to doubt a fit, from its numbers and its trials.

mod comparison;
mod mistakes;
mod plausible;

pub(crate) use comparison::{
    Strokes, better_elsewhere, disagreement, disputed, outdone, predicts_as_well,
    reverse_elsewhere, short_against_long, steady_against_unsteady,
};

pub(crate) use mistakes::{Mistake, certain, light_translations, mistakes};
pub(crate) use plausible::{implausible, impossible_mass};

use std::collections::BTreeMap;

use crate::caveat::spoken;
use crate::estimate::{DelayedFit, EquationError, Fit, Method, Records};
use crate::results::{PlantResult, Results};
use crate::signal::{LowPass, Spectrum, amplitude_spectrum};
use crate::trial::{ReadyAxis, ReadyStretch};
use crate::{
    AxisRecord, Caveat, CaveatCode, Dof, Error, Stability, State, Term, ThrustUncertainty, Trial,
    Vehicle,
};

/// Gain of a filter at the excited frequency below which there is a caveat.
const PASSED_PART: f64 = 0.97;

/// Variance inflation above which two terms are nearly collinear.
const HIGH_INFLATION: f64 = 10.0;

/// Number of independent samples below which intervals are unreliable.
const FEW_SAMPLES: f64 = 20.0;

/// Ratio of drag to thrust below which the trial determines drag poorly.
const WEAK_DRAG_PART: f64 = 0.1;

/// The data for the diagnosis of a fit.
pub(crate) struct Evidence<'a> {
    /// The fit.
    pub fit: &'a Fit,
    /// The records to which it was fitted.
    pub axes: &'a [AxisRecord],
    /// Their trials.
    pub trials: &'a [&'a Trial],
    /// The vehicle.
    pub vehicle: &'a Vehicle,
}

/// Returns all caveats of one fit.
pub(crate) fn caveats(evidence: &Evidence<'_>) -> Result<Vec<Caveat>, Error> {
    let mut caveats = evidence.fit.caveats.clone();
    for trial in evidence.trials {
        caveats.extend(trial.caveats(evidence.fit.dof));
    }
    caveats.extend(signs(evidence.fit));
    let (dof, mass) = (evidence.fit.dof, evidence.fit.estimates().mass);
    caveats.extend(below_dry_mass(dof, mass.value, mass.high95, evidence.vehicle));
    caveats.extend(conditioning(evidence.fit));
    caveats.extend(short(evidence));
    caveats.extend(excitation(evidence)?);
    caveats.extend(one_way_bias(evidence));
    if evidence.fit.method == Method::Paper {
        caveats.extend(attenuation(evidence)?);
    }
    Ok(caveats)
}

/// Returns the caveat that the scale of thrust, and with it all parameters, may be wrong.
pub(crate) fn thrust_scale(vehicle: &Vehicle, results: &Results) -> Caveat {
    let unknown = ThrustUncertainty::default();
    let known = vehicle.thrusters.iter().filter(|thruster| thruster.uncertainty != unknown).count();
    let intervals = if known == 0 {
        "and the intervals do not include that: state thrust_uncertainty of each thruster to include it"
    } else if known < vehicle.thrusters.len() {
        "and the intervals include that only for thrusters with a thrust_uncertainty"
    } else {
        "which the intervals include"
    };
    if vehicle.dry_mass_kg.is_none() && vehicle.size_m.is_none() && known == 0 {
        let message = "nothing confirms the scale of thrust, because the vehicle file states neither mass nor size: if thrust is ten times too large, as in a wrong unit, so are mass, drag and bias force; state dry_mass_kg and size_m, and thrust_uncertainty of each thruster";
        return Caveat::warning(CaveatCode::ThrustScale, message);
    }
    let message = format!(
        "the scale of thrust is taken from the vehicle file, and motion alone does not determine it: if all thrusters give 10 % less than their curves say, mass, drag and bias force are 10 % less too, {intervals}{}",
        beside_dry_mass(vehicle, results)
    );
    Caveat::note(CaveatCode::ThrustScale, message)
}

/// Formats the masses as multiples of the mass in air, with those of known vehicles, from which
/// they differ if the scale of thrust is wrong: added mass of bodies is in [Newman1977, ch. 4],
/// that of open frames in [Jason2, table 5].
fn beside_dry_mass(vehicle: &Vehicle, results: &Results) -> String {
    let Some(dry) = vehicle.dry_mass_kg else { return String::new() };
    let of = |plant: &PlantResult| -> Vec<(Dof, f64)> {
        plant.by_axis.iter().map(|(dof, own)| (*dof, own.mass.value)).collect()
    };
    let alone = results.alone().flat_map(|(_, plant, _)| of(plant));
    let together = results.together().flat_map(|(_, plant)| of(plant));
    let masses: BTreeMap<Dof, f64> = alone.chain(together).collect();
    let times = masses.iter().filter(|(dof, mass)| !dof.is_rotation() && **mass > 0.0);
    let times: Vec<String> =
        times.map(|(dof, mass)| format!("{} ({dof})", spoken(mass / dry))).collect();
    if times.is_empty() {
        return String::new();
    }
    format!(
        "; the effective mass is {} times the stated {} kg in air, where closed hulls have 1 to 2.5 times and open frames up to 6",
        times.join(", "),
        spoken(dry)
    )
}

fn signs(fit: &Fit) -> Vec<Caveat> {
    let estimates = fit.estimates();
    let wrong = [
        (
            "mass",
            Some(estimates.mass),
            "thrust or velocity has the wrong sign, or thrust explains nothing",
        ),
        (
            "quadratic drag",
            estimates.d_quadratic,
            "the trial is too slow, or a lag, delay or current distorts it",
        ),
        ("linear drag", estimates.d_linear, "a delay between thrust and motion has this effect"),
    ];
    let mut caveats: Vec<Caveat> = wrong
        .into_iter()
        .filter_map(|(name, estimate, cause)| {
            let estimate = estimate.filter(|estimate| estimate.value <= 0.0)?;
            let message = format!(
                "the {name} in {} is not positive ({}), which is unphysical: {cause}",
                fit.dof,
                spoken(estimate.value)
            );
            Some(if estimate.high95 < 0.0 || name == "mass" {
                Caveat::severe(CaveatCode::WrongSign, message)
            } else {
                Caveat::warning(CaveatCode::WrongSign, message)
            })
        })
        .collect();
    let stability = fit.lumped.stability();
    if stability != Stability::Stable {
        let unit = match stability {
            Stability::StableBelow { .. } | Stability::UnstableAtRest { .. } => {
                format!(" {}", fit.dof.units().velocity)
            }
            _ => String::new(),
        };
        let message = format!(
            "the {} plant is not stable ({stability}{unit}): do not simulate it outside of its trials",
            fit.dof
        );
        caveats.push(Caveat::warning(CaveatCode::Unstable, message));
    }
    caveats
}

/// Returns a caveat for a mass below that of the vehicle in air; `high95` is the upper end of its
/// interval.
pub(crate) fn below_dry_mass(
    dof: Dof,
    mass: f64,
    high95: f64,
    vehicle: &Vehicle,
) -> Option<Caveat> {
    let dry = vehicle.dry_mass_kg.filter(|_| !dof.is_rotation())?;
    (mass < dry).then(|| {
        let message = format!(
            "the {dof} mass of {} kg is below the {} kg of the vehicle in air, and water can only add to that: check the thrust curve and units",
            spoken(mass),
            spoken(dry)
        );
        if high95 < dry {
            Caveat::severe(CaveatCode::MassBelowDryMass, message)
        } else {
            Caveat::warning(CaveatCode::MassBelowDryMass, message)
        }
    })
}

fn conditioning(fit: &Fit) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    if let Some((term, inflation)) = fit.inflation.iter().find(|(_, vif)| *vif > HIGH_INFLATION) {
        let message = format!(
            "in {} the {} term can hardly be separated from the others (variance inflation {inflation:.0}): add a trial with another speed or frequency, or drop a term",
            fit.dof,
            term.name()
        );
        caveats.push(Caveat::warning(CaveatCode::Collinear, message));
    }
    if fit.effective_samples < FEW_SAMPLES {
        let message = format!(
            "the {} fit rests on about {:.0} independent samples (of {} rows): its intervals are approximate; use a longer trial",
            fit.dof, fit.effective_samples, fit.samples
        );
        caveats.push(Caveat::warning(CaveatCode::FewEffectiveSamples, message));
    }
    caveats
}

/// Duration of motion below which intervals are likely too narrow, s.
const SHORT_S: f64 = 60.0;

fn short(evidence: &Evidence<'_>) -> Option<Caveat> {
    let total_s: f64 = evidence.axes.iter().map(AxisRecord::seconds).sum();
    (total_s < SHORT_S).then(|| {
        let message = format!(
            "the {} fit rests on {} s of motion: its intervals are likely too narrow; log several minutes",
            evidence.fit.dof,
            spoken(total_s)
        );
        Caveat::warning(CaveatCode::ShortTrial, message)
    })
}

/// Sums over all rows of a fit's trials, for the diagnosis of their excitation.
#[derive(Default)]
struct Drive {
    rows: usize,
    positive: usize,
    negative: usize,
    ahead: usize,
    astern: usize,
    thrust: f64,
    drag: f64,
    forces: Vec<f64>,
}

fn drive(evidence: &Evidence<'_>) -> Result<Drive, Error> {
    let plant = evidence.fit.lumped;
    let mut all = Drive::default();
    for axis in evidence.axes {
        for ready in axis.ready(0)?.stretches {
            let (tau, v) = (ready.force(ready.grid), speeds(evidence, axis, &ready)?);
            for (&tau, &v) in tau.iter().zip(&v) {
                all.rows += 1;
                all.positive += usize::from(tau > 0.0);
                all.negative += usize::from(tau < 0.0);
                all.ahead += usize::from(v > 0.0);
                all.astern += usize::from(v < 0.0);
                all.thrust += (plant.alpha * tau).abs();
                all.drag += ((plant.beta * v.abs() + plant.mu) * v).abs();
            }
            if all.forces.is_empty() {
                all.forces = tau;
            } else {
                all.forces.extend(tau);
            }
        }
    }
    Ok(all)
}

/// Returns measured velocity, otherwise that of the plant from rest.
fn speeds(
    evidence: &Evidence<'_>,
    axis: &AxisRecord,
    ready: &ReadyStretch,
) -> Result<Vec<f64>, Error> {
    if axis.knows_velocity() {
        return ready.velocity(ready.grid);
    }
    let times_s: Vec<f64> = ready.grid.times().collect();
    Ok(evidence.fit.model().respond(axis, State::default(), &times_s)?.velocity)
}

fn excitation(evidence: &Evidence<'_>) -> Result<Vec<Caveat>, Error> {
    let fit = evidence.fit;
    let mut drive = drive(evidence)?;
    let mut caveats = Vec::new();
    let few = drive.rows / 50;
    if drive.positive.min(drive.negative) < few.max(1) {
        let way = if drive.positive > drive.negative { "positive" } else { "negative" };
        let message = format!(
            "thrust in {} is {way} nearly always: forward and reverse drag cannot be compared, and a bias force cannot be separated from drag; drive in both directions",
            fit.dof
        );
        caveats.push(Caveat::warning(CaveatCode::OneSignedThrust, message));
    }
    if is_two_level(&mut drive.forces) {
        let message = format!(
            "thrust in {} takes two values only, so that a wrong thrust curve would not be noticed: use more levels of thrust",
            fit.dof
        );
        caveats.push(Caveat::note(CaveatCode::TwoLevelThrust, message));
    }
    if drive.drag < WEAK_DRAG_PART * drive.thrust {
        let message = format!(
            "drag in {} is {:.0} % of thrust on average: the trial determines the mass well and the drag poorly; add long runs at speed",
            fit.dof,
            100.0 * drive.drag / drive.thrust
        );
        caveats.push(Caveat::warning(CaveatCode::WeakDrag, message));
    }
    Ok(caveats)
}

/// Returns whether 95 % of the forces lie within 2 % of the range of one of two levels.
fn is_two_level(forces: &mut [f64]) -> bool {
    let n = forces.len();
    if n < 8 {
        return false;
    }
    let mut in_order = |k: usize| *forces.select_nth_unstable_by(k, f64::total_cmp).1;
    let (low, high) = (in_order(n / 20), in_order(n - 1 - n / 20));
    let near = 0.02 * (high - low);
    let off = forces.iter().filter(|f| **f > low + near && **f < high - near).count();
    high > low && off < n / 20
}

fn one_way_bias(evidence: &Evidence<'_>) -> Option<Caveat> {
    let fit = evidence.fit;
    let bias = fit.estimates().bias_force.filter(|bias| !bias.covers(0.0))?;
    if !matches!(fit.dof, Dof::Surge | Dof::Sway) || headings_are_reversed(evidence.trials) {
        return None;
    }
    let message = format!(
        "a bias force of {} {} was found in {}, on one heading only: a current has the same effect, and then the drag is wrong, too; repeat the trial on the opposite heading",
        spoken(bias.value),
        fit.dof.units().force,
        fit.dof
    );
    Some(Caveat::warning(CaveatCode::BiasOneDirection, message))
}

/// Returns whether mean headings of two trials differ by more than 120°.
fn headings_are_reversed(trials: &[&Trial]) -> bool {
    let means: Vec<f64> = trials.iter().filter_map(|trial| trial.mean_heading_rad()).collect();
    means.iter().any(|a| means.iter().any(|b| (a - b).cos() < -0.5))
}

/// Returns caveats on the attenuation of the excited motion by the paper's filter.
fn attenuation(evidence: &Evidence<'_>) -> Result<Vec<Caveat>, Error> {
    let Some(filter) = evidence.fit.filters.velocity else { return Ok(Vec::new()) };
    let mut worst: Option<(f64, f64, &str)> = None;
    for axis in evidence.axes {
        let Some(frequency_hz) = dominant_force_hz(axis)? else { continue };
        let gain = filter.zero_phase_gain(frequency_hz);
        if worst.is_none_or(|(least, _, _)| gain < least) {
            worst = Some((gain, frequency_hz, &axis.trial));
        }
    }
    let Some((gain, frequency_hz, trial)) = worst.filter(|(gain, _, _)| *gain < PASSED_PART) else {
        return Ok(Vec::new());
    };
    let LowPass { cutoff_hz, .. } = filter;
    let factor = 1.0 / gain;
    let dof = evidence.fit.dof;
    let mass = if dof.is_rotation() { "inertia" } else { "mass" };
    let attenuates = format!(
        "the {cutoff_hz} Hz filter passes {:.0} % of the motion at {frequency_hz:.3} Hz, where trial `{trial}` is excited, but all of the thrust: expect the {dof} {mass} to be {factor:.2} times too large; use equation-error, which filters both alike",
        100.0 * gain
    );
    let unequal = format!(
        "v|v| in {dof} is formed from the attenuated velocity, so that the drag is wrong as well, by an amount that depends on the trial"
    );
    Ok(vec![
        Caveat::warning(CaveatCode::FilterAttenuatesExcitation, attenuates),
        Caveat::warning(CaveatCode::UnequalFiltering, unequal),
    ])
}

/// Returns the dominant frequency of a record's force, Hz.
fn dominant_force_hz(axis: &AxisRecord) -> Result<Option<f64>, Error> {
    Ok(force_spectrum(&axis.ready(0)?).dominant_hz())
}

/// Returns the spectrum of force in the longest stretch of a record.
pub(crate) fn force_spectrum(ready: &ReadyAxis) -> Spectrum {
    let tau = ready.longest().map(|stretch| stretch.force(stretch.grid));
    amplitude_spectrum(&tau.unwrap_or_default(), ready.sample_hz)
}

/// Candidate delays: first, last and step, s.
const DELAYS_S: (f64, f64, f64) = (-0.5, 1.5, 0.05);

/// Required likelihood ratio of a delay: twice the log-likelihood ratio of one parameter exceeds it
/// by chance once in a thousand fits.
const LIKELIHOOD_RATIO: f64 = 10.8;

/// Delays below this have negligible effect, s.
const HARMLESS_S: f64 = 0.08;

/// Returns the delay of thrust behind its log, s, if it is significant: a thruster lag, a delay or
/// an offset of clocks has this effect.
///
/// The scan is by equation error, for a fit by any method.
pub(crate) fn lateness(records: Records<'_>, by: &EquationError) -> Option<f64> {
    let (from, to, step) = DELAYS_S;
    let steps = ((to - from) / step).round() as usize;
    let delays_s = (0..=steps).map(|k| from + k as f64 * step);
    let as_logged = by.fit(records).ok()?;
    let DelayedFit { delay_s, fit: best } = by.fit_best_delay(records, delays_s).ok()?;
    let likelihood = (as_logged.residual_rms / best.residual_rms).ln();
    let ratio = as_logged.effective_samples * 2.0 * likelihood;
    (ratio > LIKELIHOOD_RATIO && delay_s.abs() > HARMLESS_S).then_some(delay_s)
}

/// Formats the caveat of [`lateness`]; `timely` is the same fit with the delay.
pub(crate) fn lateness_caveat(fit: &Fit, delay_s: f64, timely: Option<&Fit>) -> Caveat {
    let units = fit.dof.units();
    let physical = fit.physical();
    let when = if delay_s > 0.0 { "later" } else { "earlier" };
    let mut message = format!(
        "the {} motion fits best if thrust acts {:.2} s {when} than it was logged (a thruster lag, a delay in the log, or clocks that differ)",
        fit.dof,
        delay_s.abs(),
    );
    let Some(timely) = timely.map(Fit::physical) else {
        return Caveat::warning(CaveatCode::LagOrDelay, message);
    };
    message += &format!(
        ": with that the mass would be {} in place of {} {}",
        spoken(timely.mass),
        spoken(physical.mass),
        units.mass
    );
    if fit.terms.has(Term::Quadratic) {
        message += &format!(
            ", and quadratic drag {} in place of {} {}",
            spoken(timely.d_quadratic),
            spoken(physical.d_quadratic),
            units.quadratic_drag
        );
    }
    Caveat::warning(CaveatCode::LagOrDelay, message)
}
