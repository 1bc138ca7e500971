//! Online identification of one axis from its records.

use super::logs::{OnlineFit, doubts, run};
use super::{Online, OnlineOptions, acting};
use crate::caveat::spoken;
use crate::estimate::axis_plant::{axis_structure, lumped_plant, term_of};
use crate::estimate::{Candidate, Decision, Estimate, Fit, Method, Nuisances, Records};
use crate::plant::own_terms;
use crate::regression::LeastSquares;
use crate::terms::Term;
use crate::{BetweenSamples, Caveat, CaveatCode, Dof, Error, Terms};

/// Identifies one degree of freedom as a plant of one axis.
///
/// With a filter error fit of the same records, `beside`, thrust is corrected by its nuisances
/// (lag, delay, inflow …), velocity through the water follows from its currents, and the fit is
/// scored likewise; else force is as logged, in still water.
///
/// # Errors
/// As [`Records::dof`]; [`Error::TooShort`] for records shorter than the start; those of
/// [`Online`].
///
/// # Source
/// \[Smallwood2003\]: adaptive identification of one axis.
pub fn fit_online<'a>(
    method: Method,
    records: impl Into<Records<'a>>,
    beside: Option<&Fit>,
    options: &OnlineOptions,
) -> Result<Fit, Error> {
    let records = records.into();
    let (dof, terms) = (records.dof()?, records.terms());
    let scheme = method.scheme().unwrap_or_default();
    let structure = axis_structure(dof, terms)?;
    let stretches = records.fit.iter().map(|axis| acting::stretches(axis, beside));
    let stretches = stretches.collect::<Result<Vec<_>, Error>>()?.concat();
    // A grid has no gaps other than those at which it was cut.
    let step_s = stretches.iter().flat_map(|stretch| stretch.steps_s()).fold(0.0, f64::max);
    let longest_step_s = options.longest_step_s.max(LONGER * step_s);
    let options = OnlineOptions { longest_step_s, ..*options };
    let online = Online::new(structure, scheme, options, None)?;
    let fit = run(online, &stretches, &options)?;
    let mut found = axis_fit(dof, method, terms, &fit);
    if let Some(beside) = beside {
        found.nuisances = input_nuisances(&beside.nuisances);
        let is_law =
            |one: &Decision| Candidate::between_samples([one.candidate]) != BetweenSamples::Held;
        let shapes = |one: &&Decision| one.admitted && is_law(one);
        found.structure = beside.structure.iter().filter(shapes).cloned().collect();
        found.caveats.push(borrowed_nuisances_caveat(dof, method, beside));
    }
    Ok(found)
}

/// Tolerance for rounding of the steps of a grid.
const LONGER: f64 = 1.0 + 1e-6;

/// Returns the nuisances of a fit between thrust and water, without those of noise.
fn input_nuisances(nuisances: &Nuisances) -> Nuisances {
    Nuisances {
        swell: None,
        disturbance: None,
        correlation_s: None,
        velocity_noise: None,
        position_noise: None,
        acceleration_noise: None,
        leak: None,
        leak_correlation_s: None,
        ..nuisances.clone()
    }
}

/// Returns the caveat that the estimates depend on results of another method.
fn borrowed_nuisances_caveat(dof: Dof, method: Method, beside: &Fit) -> Caveat {
    let of = |name: &str, x: Option<Estimate>| Some(format!("{name} {} s", spoken(x?.value)));
    let nuisances = &beside.nuisances;
    let named = [of("a lag of", nuisances.lag_s), of("a delay of", nuisances.delay_s)];
    let named: Vec<String> = named.into_iter().flatten().collect();
    let named = match named.as_slice() {
        [] => "neither lag nor delay".to_owned(),
        named => named.join(" and "),
    };
    let message = format!(
        "{method} takes thrust in {dof} as {} found it to act ({named}), its terms and the currents of its trials; what these are unsure of is in no interval of {method}",
        beside.method
    );
    Caveat::note(CaveatCode::TakenFromAnother, message)
}

fn axis_fit(dof: Dof, method: Method, terms: Terms, fit: &OnlineFit) -> Fit {
    let plant = &fit.estimate.plant;
    let all = plant.structure().terms();
    let own = own_terms(dof).map(|(term, sign)| (term.to_string(), sign));
    let names: Vec<String> = all.iter().map(|term| own[term_of(term) as usize].0.clone()).collect();
    let (lumped, covariance) = lumped_plant(plant, &fit.estimate.covariance);
    let inflation = all.iter().zip(&fit.estimate.inflation);
    let found = LeastSquares {
        lumped,
        covariance,
        t_freedom: fit.samples as f64,
        condition: (1.0 / fit.estimate.excitation.max(f64::MIN_POSITIVE)).sqrt(),
        inflation: inflation
            .map(|(term, x)| (term_of(term), *x))
            .filter(|(term, _)| *term != Term::Bias)
            .collect(),
        samples: fit.samples,
        effective_samples: fit.estimate.independent_samples,
        residual_rms: fit.estimate.residual[dof.index()] * lumped.alpha,
    };
    let caveats = doubts(dof.name(), &names, fit);
    let fitted = Fit::of_regression(dof, method, terms, found, Default::default(), caveats);
    let mut history = fit.history.result(&names, fit);
    for (name, sign) in &own {
        if let Some(values) = history.parameters.get_mut(name) {
            values.iter_mut().for_each(|value| *value *= sign);
        }
    }
    Fit { history: Some(history), ..fitted }
}
