//! Makes a controller for a plant.

mod charts;
mod words;

use std::collections::BTreeMap;
use std::process::ExitCode;

use anyhow::{Result, bail};
use seaplant::Dof;
use seaplant::exchange::{Draws, PlantModel};
use seaplant::plant::{Basis, Product};
use seaplant_control::{
    Actuators, Controller, Design, Gains, LqrWeights, Path, Sea, Tracked, Tuning, ardusub,
    c_header, check_usable, design, doubts_of_model, responses, track,
};
use seaplant_export::{Permission, export, exporter};
use seaplant_report::control_page;
use serde_json::{Value, json};

use self::charts::charts;
use self::words::{in_current, table, words};
use super::plant::{file_of, read_plant};
use super::predict::quantity;
use crate::args::Control;
use crate::output::Output;
use crate::writing::{File, Made, Permit, Target};

/// Duration of each of the two runs, s.
const RUN_S: f64 = 120.0;

/// Amplitude of the reference sine in translations and rotations, m and rad …
const AMPLITUDE: (f64, f64) = (0.5, 0.3);
/// … and its frequency, as a fraction of the bandwidth.
const SINE_PART: f64 = 0.5;

/// Noise of the instruments in the runs: velocity, m/s and rad/s, and position, m and rad.
const NOISE: (f64, f64) = (0.003, 0.002);

pub fn run(arguments: &Control, output: Output) -> Result<ExitCode> {
    let model = read_plant(&arguments.plant, arguments.method)?;
    if !arguments.anyway {
        check_usable(&model)?;
    }
    let actuators = actuators(arguments, &model)?;
    let asked = asked(arguments, &model)?;
    let draws = model.draws(Draws { count: arguments.draws.into(), seed: arguments.seed })?;
    let mut gains = design(&model.plant, &draws, &actuators, &asked)?;
    let doubts = doubts_of_model(&model, &gains);
    gains.notes.extend(doubts);
    let runs = runs(arguments, &model, &actuators, &asked, &gains)?;
    let responses = responses(&model.plant, &draws, &actuators, &asked, &gains)?;
    let (mut files, mut notes) = match &arguments.out {
        Some(_) => files(arguments, &model, &gains)?,
        None => (Vec::new(), Vec::new()),
    };
    notes.splice(
        0..0,
        gains.notes.iter().cloned().chain(saturation(&runs)).chain(in_current(&gains, &runs)),
    );
    if arguments.out.is_some() {
        let charts = charts(&gains, &responses, &runs);
        let bytes = control_page(&model.name, &table(&gains, &runs), &notes, &charts)?;
        files.push(File { path: "control.html".to_owned(), bytes });
    }
    if let Some(folder) = &arguments.out {
        let inputs = [file_of(&arguments.plant)];
        let permit = Permit::new(&inputs, arguments.force);
        Target { folder, made: Some(Made::Export), permit }.write(&files)?;
    }
    let paths: Vec<_> = files
        .iter()
        .filter_map(|file| Some(arguments.out.as_ref()?.join(&file.path).display().to_string()))
        .collect();
    let result = json!({ "gains": gains, "responses": responses, "runs": runs_json(&runs), "files": paths, "notes": notes });
    output.give(&result, || words(&gains, &runs, &paths, &notes))?;
    Ok(ExitCode::SUCCESS)
}

fn actuators(arguments: &Control, model: &PlantModel) -> Result<Actuators> {
    let mut actuators = Actuators::of_model(model);
    for text in &arguments.limits {
        let (dof, limit) = quantity(text, "--limit", |dof| dof.units().force)?;
        actuators.limit[dof.index()] = Some(limit);
    }
    for text in &arguments.lags {
        let (dof, s) = quantity(text, "--lag", |_| "s")?;
        actuators.lag_s[dof.index()] = s;
    }
    for text in &arguments.delays {
        let (dof, s) = quantity(text, "--delay", |_| "s")?;
        actuators.delay_s[dof.index()] = s;
    }
    Ok(actuators)
}

fn asked(arguments: &Control, model: &PlantModel) -> Result<Design> {
    let mut tuning = BTreeMap::new();
    for text in &arguments.bandwidths {
        let (dof, hz) = quantity(text, "--bandwidth", |_| "Hz")?;
        let of = Tuning { integral_s: arguments.integral_s, ..Tuning::new(hz, arguments.damping) };
        tuning.insert(dof, of);
    }
    for text in &arguments.regulators {
        let (dof, regulated) = regulator(text, model)?;
        tuning.insert(dof, Tuning { integral_s: arguments.integral_s, ..regulated });
    }
    if tuning.is_empty() {
        let axes: Vec<&str> = model.plant.axes().iter().map(|dof| dof.name()).collect();
        bail!(
            "no axis to control; give a bandwidth, as --bandwidth \"{} 0.05 Hz\", of any of {}",
            axes[0],
            axes.join(", ")
        );
    }
    Ok(Design {
        law: arguments.law,
        adapts: arguments.adaptive,
        tuning,
        sample_hz: arguments.sample_hz,
        adaptation_s: arguments.adaptation_s,
        anyway: arguments.anyway,
        ..Design::default()
    })
}

/// Parses `surge 0.1 m 400 N`.
fn regulator(text: &str, model: &PlantModel) -> Result<(Dof, Tuning)> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let [axis, error, length, force, rest @ ..] = words.as_slice() else {
        bail!("--lqr `{text}` is incomplete; write it as \"surge 0.1 m 400 N\"");
    };
    let (dof, error) =
        quantity(&format!("{axis} {error} {length}"), "--lqr", |dof| dof.units().position)?;
    let force = format!("{axis} {force} {}", rest.join(" "));
    let (_, force) = quantity(&force, "--lqr", |dof| dof.units().force)?;
    let value = |term: Basis| model.plant.coefficient(&term);
    let Some(mass) = value(Basis::Mass(dof, dof)) else {
        bail!("the plant has no {dof}; leave it out of --lqr");
    };
    let damping = value(Basis::Product(dof, Product::linear(dof))).unwrap_or(0.0);
    Ok((dof, LqrWeights { error, force }.tuning(mass, damping)?))
}

/// Tracking runs on the nominal plant: in still water and in a current.
struct Run {
    name: &'static str,
    tracked: Tracked,
}

fn runs(
    arguments: &Control,
    model: &PlantModel,
    actuators: &Actuators,
    asked: &Design,
    gains: &Gains,
) -> Result<Vec<Run>> {
    let sine = |(dof, tuning): (&Dof, &Tuning)| {
        let amplitude = if dof.is_rotation() { AMPLITUDE.1 } else { AMPLITUDE.0 };
        let rate = SINE_PART * std::f64::consts::TAU * tuning.bandwidth_hz;
        (*dof, Path::Sine { amplitude, rate })
    };
    let paths: BTreeMap<Dof, Path> = asked.tuning.iter().map(sine).collect();
    let [north, east] = arguments.current[..] else {
        bail!("--current takes two numbers, north and east, as 0.2,-0.1");
    };
    let still = Sea {
        current_ned: [0.0; 3],
        velocity_noise: NOISE.0,
        position_noise: NOISE.1,
        seed: arguments.seed,
    };
    let current = Sea { current_ned: [north, east, 0.0], ..still };
    let mut runs = Vec::new();
    for (name, sea) in [("still water", still), ("current", current)] {
        let mut controller = Controller::new(model.plant.clone(), gains.clone(), &asked.speed);
        match track(&model.plant, &mut controller, actuators, &paths, &sea, RUN_S) {
            Ok(tracked) => runs.push(Run { name, tracked }),
            // A requested unstable loop cannot follow a reference.
            Err(_) if arguments.anyway => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(runs)
}

/// Fraction of time at a limit from which it is reported.
const TOLD_SATURATED: f64 = 0.01;

fn saturation(runs: &[Run]) -> impl Iterator<Item = String> + '_ {
    let told = runs.iter().filter(|run| run.tracked.saturated > TOLD_SATURATED);
    told.map(|run| {
        format!(
            "in {} some axis is at its limit for {:.0} % of the time, where margins do not hold; reduce the bandwidth, or follow slower paths",
            run.name,
            100.0 * run.tracked.saturated
        )
    })
}

fn runs_json(runs: &[Run]) -> Value {
    let of = |run: &Run| {
        let error = |dof: &Dof| run.tracked.error.iter().map(|e| e[dof.index()]).collect();
        let errors: BTreeMap<Dof, Vec<f64>> =
            run.tracked.rms.keys().map(|dof| (*dof, error(dof))).collect();
        json!({ "name": run.name, "rms": run.tracked.rms, "greatest": run.tracked.greatest,
                "saturated": run.tracked.saturated, "time_s": run.tracked.time_s,
                "error": errors })
    };
    runs.iter().map(of).collect()
}

fn files(
    arguments: &Control,
    model: &PlantModel,
    gains: &Gains,
) -> Result<(Vec<File>, Vec<String>)> {
    let text = |path: &str, text: String| File { path: path.to_owned(), bytes: text.into_bytes() };
    let mut files = vec![
        text("control.toml", toml::to_string(gains)?),
        text("control.json", serde_json::to_string_pretty(gains)? + "\n"),
    ];
    let mut notes = Vec::new();
    match c_header(&model.name, gains) {
        Ok(header) => {
            files.push(text("seaplant_control.h", header));
            let permission =
                if arguments.anyway { Permission::Anyway } else { Permission::Checked };
            let plant = export(exporter("c")?, model, permission)?;
            files.extend(
                plant.files.into_iter().map(|file| File { path: file.path, bytes: file.bytes }),
            );
        }
        Err(error) => notes.push(error.to_string()),
    }
    let (parameters, more) = ardusub(gains);
    if !parameters.is_empty() {
        files.push(text("ardusub.param", parameters));
    }
    notes.extend(more);
    Ok((files, notes))
}
