use std::collections::BTreeMap;
use std::num::NonZero;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use pyo3::prelude::*;
use seaplant::IdentifyOptions;
use seaplant::Recording;
use seaplant::twin::{TwinCampaign, TwinTrial};
use seaplant_campaign::{
    SourcedTrial, SourcedVehicle, TwinFile, monte_carlo_of_several_axes, twin_files,
};
use seaplant_log::{MemoryColumn, MemoryTable};

use crate::campaign::parse_methods;
use crate::convert::{Failure, apart, apart_watched, json, parse};
use crate::log::Log;
use crate::trial::Trial;
use crate::vehicle::Vehicle;

/// Logs of a twin, and its truth.
#[pyclass(frozen, module = "seaplant._native")]
pub struct Twin(Arc<TwinCampaign>);

#[pymethods]
impl Twin {
    /// Makes the twin of a specification, as JSON.
    #[new]
    fn new(py: Python<'_>, spec: &str) -> PyResult<Self> {
        let spec = twin_of(spec)?;
        Ok(Self(Arc::new(apart(py, move || Ok(spec.make()?))?)))
    }

    /// Returns the vehicle as its analyst describes it.
    fn vehicle(&self) -> Vehicle {
        let vehicle = self.0.vehicle.clone();
        Vehicle(Arc::new(SourcedVehicle { vehicle, inputs: Vec::new(), doubt: None }))
    }

    /// Returns the trials, from logs that were not rounded to the decimals of a file.
    fn trials(&self, py: Python<'_>) -> PyResult<Vec<Trial>> {
        let twin = Arc::clone(&self.0);
        let of = |trial| Ok(Trial(Arc::new(trial)));
        let trials = apart(py, move || twin.trials.iter().map(|t| trial(t, &twin)).collect())?;
        Vec::into_iter(trials).map(of).collect()
    }

    /// Returns the log of each trial, in SI units, by the trial's name.
    fn logs(&self, py: Python<'_>) -> PyResult<Vec<(String, Log)>> {
        let twin = Arc::clone(&self.0);
        let of = |trial: &TwinTrial| Ok((trial.name.clone(), log(&trial.name, &trial.recording)?));
        let logs: Vec<(String, seaplant_log::Log)> =
            apart(py, move || twin.trials.iter().map(of).collect::<Result<_, Failure>>())?;
        Ok(logs.into_iter().map(|(name, log)| (name, Log(Arc::new(log)))).collect())
    }

    /// Returns its truth, as JSON.
    fn truth(&self) -> PyResult<String> {
        Ok(json(&self.0.truth)?)
    }

    /// Returns propeller speed, rad/s, and thrust, N, of one thruster on a test bench; empty for a
    /// complete vehicle.
    fn bollard_pull(&self) -> Vec<(f64, f64)> {
        self.0.bollard_pull.clone()
    }

    /// Returns its files, each with its path below the campaign's folder.
    fn files(&self, py: Python<'_>) -> PyResult<Vec<(String, String)>> {
        let twin = Arc::clone(&self.0);
        apart(py, move || {
            let files = twin_files(&twin).map_err(|error| Failure::Input(error.to_string()))?;
            Ok(files.into_iter().map(|file| (file.path, file.text)).collect())
        })
    }
}

/// Parses the specification of a twin, as JSON: with `vehicle` it has several axes, as in a file.
fn twin_of(spec: &str) -> Result<TwinFile, Failure> {
    let value: serde_json::Value = serde_json::from_str(spec)?;
    Ok(match value.get("vehicle") {
        Some(_) => TwinFile::SeveralAxes(Box::new(parse("twin", spec)?)),
        None => TwinFile::OneAxis(Box::new(parse("twin", spec)?)),
    })
}

fn trial(log: &TwinTrial, twin: &TwinCampaign) -> Result<SourcedTrial, Failure> {
    let trial = log.trial(twin)?;
    Ok(SourcedTrial { trial, inputs: Vec::new(), offsets: Vec::new(), start_s: 0.0 })
}

/// Converts a recording to a log whose columns are named after quantities.
fn log(name: &str, recording: &Recording) -> Result<seaplant_log::Log, Failure> {
    let mut tables: BTreeMap<Vec<u64>, MemoryTable> = BTreeMap::new();
    for (quantity, series) in recording {
        let times = series.time_s().iter().map(|time| time.to_bits()).collect();
        let table = tables.entry(times).or_insert_with(|| MemoryTable {
            name: quantity.to_string(),
            time_s: series.time_s().to_vec(),
            columns: Vec::new(),
        });
        table.columns.push(MemoryColumn {
            header: quantity.to_string(),
            unit: Some(quantity.kind().unit().to_owned()),
            values: series.values().to_vec(),
        });
    }
    Ok(seaplant_log::Log::of_tables(name, tables.into_values().collect())?)
}

/// Computes errors and coverage of methods over many twins, as JSON; `on_run` receives the number
/// of runs begun.
#[pyfunction]
pub fn monte_carlo(
    py: Python<'_>,
    spec: &str,
    methods: Vec<String>,
    runs: u64,
    threads: Option<usize>,
    on_run: Option<Bound<'_, PyAny>>,
) -> PyResult<String> {
    let spec = twin_of(spec)?;
    let mut options = IdentifyOptions::default();
    if !methods.is_empty() {
        options.methods = parse_methods(&methods)?;
    }
    let processors = thread::available_parallelism().map_or(1, NonZero::get);
    let threads = threads.unwrap_or(processors);
    let state = Arc::new((AtomicBool::new(false), AtomicU64::new(0)));
    let told = Arc::clone(&state);
    let study = move || {
        let go_on = |run| {
            told.1.fetch_max(run, Ordering::Relaxed);
            !told.0.load(Ordering::Relaxed)
        };
        match &spec {
            TwinFile::OneAxis(spec) => {
                spec.validate()?;
                json(&seaplant_campaign::monte_carlo(spec, &options, runs, threads, go_on)?)
            }
            TwinFile::SeveralAxes(_) if !methods.is_empty() => Err(Failure::Input(
                "method is of twins of single axes, and `vehicle` makes this one a whole vehicle, which is fitted by filter error: leave it out".to_owned(),
            )),
            TwinFile::SeveralAxes(spec) => json(&monte_carlo_of_several_axes(spec, runs, threads, go_on)?),
        }
    };
    let waited = apart_watched(py, study, |_| match &on_run {
        Some(on_run) => on_run.call1((state.1.load(Ordering::Relaxed),)).map(|_| ()),
        None => Ok(()),
    });
    // Running runs complete; no other begins.
    state.0.store(true, Ordering::Relaxed);
    waited
}

/// Returns the content of a twin's TOML file, as JSON.
#[pyfunction]
pub fn read_twin_spec(path: PathBuf) -> PyResult<String> {
    Ok(TwinFile::read(&path).map_err(Failure::from).and_then(|spec| json(&spec))?)
}
