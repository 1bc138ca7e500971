//! Whether the trials support masses that the stated symmetry excludes.

use super::{Records, Scored};
use crate::estimate::{CoupledFit, fit_coupled};
use crate::plant::{Signal, Symmetry};
use crate::{Caveat, CaveatCode, CoupledPlan, Vehicle};

/// Held-out trials have to be simulated this much better, Σ ln(1 − R²) over the axes: what chance
/// changes is a few hundredths.
const BETTER_HELD_OUT: f64 = 0.2;

/// That a plant without symmetry fits far better, in likelihood beyond what its further numbers cost
/// by Schwarz's criterion and in held-out trials; only of a plant that is doubtful.
///
/// # Source
/// G. Schwarz, "Estimating the dimension of a model", *Annals of Statistics* 6, 1978.
pub(super) fn too_much(
    plan: &CoupledPlan,
    fit: &CoupledFit,
    misfit: f64,
    records: &Records<'_>,
    vehicle: &Vehicle,
) -> Option<Caveat> {
    if plan.symmetry == Symmetry::None || plan.axes.len() < 2 {
        return None;
    }
    let all = || records.fit.iter().chain(&records.hold_out);
    let is_logged = |signal: &Signal| all().all(|record| record.signals.contains_key(signal));
    let open = CoupledPlan { symmetry: Symmetry::None, ..plan.clone() };
    let open = open.structure(vehicle, is_logged).ok()?;
    let more = open.terms().len().saturating_sub(fit.plant.structure().terms().len());
    let open = fit_coupled(&open, &records.fit, vehicle.rigid_body.as_ref(), false).ok()?;
    let gain = open.log_likelihood - fit.log_likelihood;
    let price = 0.5 * more as f64 * (fit.samples.max(2) as f64).ln();
    if gain < price || records.hold_out.is_empty() {
        return None;
    }
    let open = Scored::new(open, records).ok()?;
    (open.misfit() < misfit - BETTER_HELD_OUT).then(|| {
        let message = format!(
            "the masses look coupled beyond the stated symmetry: without it the trials are likelier by {gain:.0} in log-likelihood, and held-out trials are simulated better; in campaign.toml set `symmetry = \"none\"` in [[plant]]"
        );
        Caveat::warning(CaveatCode::LikelyMistake, message)
    })
}
