use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use seaplant::{Method, Terms};
use seaplant_campaign::{CampaignFile, SourcedTrial};

use crate::convert::{Failure, apart, parse};
use crate::results::Results;
use crate::trial::Trial;
use crate::vehicle::Vehicle;

/// A vehicle, its trials, and the structure to identify.
#[pyclass(frozen, module = "seaplant._native")]
pub struct Campaign(Arc<seaplant_campaign::Campaign>);

/// Name in messages of a campaign without a file.
const NAME: &str = "campaign";

#[pymethods]
impl Campaign {
    /// Reads a campaign.toml, its vehicle and the logs of its trials; methods and terms, if given,
    /// override those of the file.
    #[staticmethod]
    fn open(
        py: Python<'_>,
        path: PathBuf,
        methods: Vec<String>,
        terms: Option<String>,
    ) -> PyResult<Self> {
        let (methods, terms) = (parse_methods(&methods)?, parse_terms(terms)?);
        let campaign = apart(py, move || {
            let mut campaign = seaplant_campaign::Campaign::open(&path)?;
            if !methods.is_empty() {
                campaign.options.methods = methods;
            }
            if let Some(terms) = terms {
                campaign.options.terms = Some(terms);
                campaign.options.terms_of.clear();
            }
            Ok(campaign)
        })?;
        Ok(Self(Arc::new(campaign)))
    }

    /// Creates a campaign of trials; `settings` are the tables of a campaign.toml.
    #[staticmethod]
    fn of(
        vehicle: PyRef<'_, Vehicle>,
        trials: Vec<PyRef<'_, Trial>>,
        settings: &str,
    ) -> PyResult<Self> {
        let file: CampaignFile = parse(NAME, settings)?;
        let path = Path::new(NAME);
        let options = file.options(path).map_err(Failure::from)?;
        let trials = trials.iter().map(|trial| SourcedTrial::clone(&trial.0)).collect();
        let vehicle = vehicle.0.as_ref().clone();
        let campaign = seaplant_campaign::Campaign::new(path, vehicle, trials, options);
        Ok(Self(Arc::new(campaign.map_err(Failure::from)?)))
    }

    /// Identifies the plant; `command` is the command that reproduces it.
    fn identify(&self, py: Python<'_>, command: String) -> PyResult<Results> {
        let campaign = Arc::clone(&self.0);
        let found = apart(py, move || Ok(campaign.identify(&command)))?;
        Ok(Results(Arc::new(found)))
    }

    /// Returns its trials.
    fn trials(&self) -> Vec<Trial> {
        let of = |sourced| Trial(Arc::new(sourced));
        self.0.sourced_trials().into_iter().map(of).collect()
    }
}

/// Parses names of methods, each once; `all` stands for all.
pub fn parse_methods(names: &[String]) -> Result<Vec<Method>, Failure> {
    let mut methods = Vec::new();
    for name in names {
        let named = if name == "all" { Method::ALL.to_vec() } else { vec![name.parse()?] };
        let new = |method: &Method| !methods.contains(method);
        let new: Vec<Method> = named.into_iter().filter(new).collect();
        methods.extend(new);
    }
    Ok(methods)
}

fn parse_terms(terms: Option<String>) -> Result<Option<Terms>, Failure> {
    Ok(terms.map(|terms| terms.parse()).transpose()?)
}

/// Checks names of methods, each once; `all` stands for all.
#[pyfunction]
pub fn method_names(names: Vec<String>) -> PyResult<Vec<&'static str>> {
    Ok(parse_methods(&names)?.into_iter().map(Method::name).collect())
}
