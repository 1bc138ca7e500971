//! `simulate` with inputs alone: predicts the response of a plant.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, bail};
use seaplant::Dof;
use seaplant::exchange::{Consequence, Draws, Drive, Outcome, PlantModel, Prediction, Scenario};
use seaplant_campaign::{ForceEntry, HoldEntry, Profile, StartEntry, input_table};
use seaplant_export::doubts;
use seaplant_report::number::significant;
use seaplant_report::{is_prediction_page, prediction_page};
use serde_json::json;

use super::plant::{file_of, read_plant};
use crate::args::Simulate;
use crate::output::{FAINT, Output, STRONG, WARNING};
use crate::sketch::bar;
use crate::summary::{align, plain_table};
use crate::writing::{Permit, check_writable, write_file};

/// Inputs without a measured motion.
pub enum InputsAlone {
    /// Forces and thrusters over time, in TOML or from the command line.
    Profile(Profile),
    /// A table, and the instants of its rows.
    Table(Drive, Vec<f64>),
}

/// Returns the inputs, if they are inputs alone and no log of a motion.
pub fn inputs_alone(arguments: &Simulate) -> Result<Option<InputsAlone>> {
    let only = match arguments.logs.as_slice() {
        [] if arguments.steps.is_empty() => {
            bail!(
                "no inputs are given for the plant; give a profile, a table of inputs, a log, or --step \"surge 200 N\" --for 60"
            )
        }
        [] => return Ok(Some(InputsAlone::Profile(stepped(arguments)?))),
        [only] => only,
        _ => return Ok(None),
    };
    if only.extension().is_some_and(|ending| ending == "toml") {
        let mut profile = Profile::read(only)?;
        if let Some(duration_s) = arguments.duration_s {
            profile.duration_s = duration_s;
            profile.check(only)?;
        }
        return Ok(Some(InputsAlone::Profile(profile)));
    }
    // The reader of logs reports errors of a file that is no table.
    let table = if arguments.campaign.is_none() { input_table(only).ok().flatten() } else { None };
    Ok(table.map(|(drive, time_s)| InputsAlone::Table(drive, time_s)))
}

/// Makes a profile of one hold.
fn stepped(arguments: &Simulate) -> Result<Profile> {
    let mut force = BTreeMap::new();
    for step in &arguments.steps {
        let (dof, value) = step_force(step)?;
        if force.insert(dof, value).is_some() {
            bail!("--step gives {dof} twice; give each axis once");
        }
    }
    let profile = Profile {
        duration_s: arguments.duration_s.unwrap_or_default(),
        sample_s: 0.1,
        current_m_per_s: [0.0; 2],
        wind: None,
        start: StartEntry::default(),
        hold: vec![HoldEntry { force, ..HoldEntry::default() }],
        manoeuvre: None,
    };
    profile.check(Path::new("--for"))?;
    Ok(profile)
}

/// Parses `surge 200 N`, or `surge 60 %` of the thrusters' maximum.
fn step_force(text: &str) -> Result<(Dof, ForceEntry)> {
    const FLAG: &str = "--step";
    match text.trim_end().strip_suffix('%') {
        Some(part) => {
            let (dof, percent) = quantity(&format!("{} %", part.trim_end()), FLAG, |_| "%")?;
            if percent.abs() > 100.0 {
                bail!("{FLAG} \"{text}\" is more than all; give at most 100 %");
            }
            Ok((dof, ForceEntry::Percent(format!("{percent} %"))))
        }
        None => {
            let (dof, value) = quantity(text, FLAG, |dof| dof.units().force)?;
            Ok((dof, ForceEntry::Si(value)))
        }
    }
}

/// Parses `surge 200 N`: an axis, a number, and the axis's unit.
pub(super) fn quantity(
    text: &str,
    flag: &str,
    unit: impl Fn(Dof) -> &'static str,
) -> Result<(Dof, f64)> {
    let refuse = |reason: String| anyhow!("{flag} \"{text}\" {reason}");
    let mut words = text.split_whitespace();
    let dof: Dof = words.next().unwrap_or_default().parse().map_err(|_| {
        refuse("names no axis; begin with surge, sway, heave, roll, pitch or yaw".to_owned())
    })?;
    let expected = unit(dof);
    let value = words.next().and_then(|word| word.parse::<f64>().ok()).filter(|x| x.is_finite());
    let value = value
        .ok_or_else(|| refuse(format!("has no number; write it as \"{dof} 1.0 {expected}\"")))?;
    let found = words.collect::<Vec<_>>().join(" ");
    let same = |a: &str, b: &str| a.replace(['·', ' ', '.'], "") == b.replace(' ', "");
    if found.is_empty() {
        return Err(refuse(format!("has no unit; write \"{dof} {value} {expected}\"")));
    }
    if !same(&found, expected) {
        return Err(refuse(format!(
            "is in `{found}`, and {dof} is in {expected}; write \"{dof} {value} {expected}\""
        )));
    }
    Ok((dof, value))
}

pub fn run(arguments: &Simulate, inputs: InputsAlone, output: Output) -> Result<ExitCode> {
    let model = read_plant(&arguments.results, arguments.method)?;
    if let InputsAlone::Profile(profile) = &inputs
        && let Some(entry) = &profile.manoeuvre
    {
        return super::manoeuvre::run(arguments, profile, entry, &model, output);
    }
    let mut read = arguments.logs.clone();
    read.push(file_of(&arguments.results));
    let permit = Permit::new(&read, arguments.force);
    let page =
        arguments.out.as_ref().is_some_and(|path| path.extension().is_some_and(|e| e == "html"));
    let is_ours = |bytes: &[u8]| {
        if page { is_prediction_page(bytes) } else { bytes.starts_with(HEADER.as_bytes()) }
    };
    if let Some(path) = &arguments.out {
        check_writable(path, permit, is_ours).with_context(|| path.display().to_string())?;
    }
    let scenario = scenario(arguments, inputs, &model)?;
    let draws = Draws { count: usize::from(arguments.draws), seed: arguments.seed };
    let Outcome { prediction, consequences: follows, mut notes } = model.run(&scenario, draws)?;
    notes.extend(doubts(&model));
    if let Some(path) = &arguments.out {
        let bytes = match page {
            true => prediction_page(&model, &prediction, &lines(&follows, &notes))?,
            false => csv(&prediction).into_bytes(),
        };
        write_file(path, &bytes, permit, is_ours)?;
    }
    let result = json!({
        "vehicle": model.name,
        "axes": model.plant.axes(),
        "seed": draws.seed,
        "draws": draws.count,
        "time_s": prediction.time_s,
        "pose": prediction.pose,
        "velocity": prediction.velocity,
        "band95": prediction.band,
        "consequences": follows,
        "notes": notes,
    });
    output.give(&result, || words(&model, &prediction, &follows, &notes))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the scenario to simulate.
fn scenario(arguments: &Simulate, given: InputsAlone, model: &PlantModel) -> Result<Scenario> {
    let mut scenario = match given {
        InputsAlone::Profile(profile) => profile.scenario(model)?,
        InputsAlone::Table(drive, time_s) => Scenario { drive, time_s, ..Scenario::default() },
    };
    match arguments.current.as_slice() {
        [] => {}
        [north, east] => scenario.current = [*north, *east],
        other => bail!("--current has {} numbers and needs two, north,east in m/s", other.len()),
    }
    for text in &arguments.start {
        let (dof, v) = quantity(text, "--from", |dof| dof.units().velocity)?;
        scenario.velocity.insert(dof, v);
    }
    scenario.disturbed = arguments.disturbed;
    Ok(scenario)
}

/// First line of every CSV file of a prediction.
const HEADER: &str = "time [s],north [m],east [m],down [m],roll [rad],pitch [rad],heading [rad]";

fn csv(prediction: &Prediction) -> String {
    let mut text = HEADER.to_owned();
    for dof in Dof::ALL {
        let _ = write!(text, ",{dof} [{}]", dof.units().velocity);
    }
    if !prediction.band.is_empty() {
        for dof in Dof::ALL {
            let unit = dof.units().velocity;
            let _ = write!(text, ",{dof} low95 [{unit}],{dof} high95 [{unit}]");
        }
    }
    text.push('\n');
    for (k, t) in prediction.time_s.iter().enumerate() {
        // Rounding removes the error of summing tenths.
        let _ = write!(text, "{}", (t * 1e9).round() / 1e9);
        let band = prediction.band.get(k).into_iter().flatten().flatten();
        let all = prediction.pose[k].iter().chain(&prediction.velocity[k]).chain(band);
        all.for_each(|x| _ = write!(text, ",{x}"));
        text.push('\n');
    }
    text
}

/// Formats a consequence with its interval.
fn told(of: &Consequence) -> [String; 5] {
    let interval = of.interval95.map_or(String::new(), |[low, high]| {
        format!("[{}, {}]", significant(low, 3), significant(high, 3))
    });
    let axis = of.axis.to_string();
    [axis, of.name.clone(), significant(of.value, 3), interval, of.unit.clone()]
}

fn lines(follows: &[Consequence], notes: &[String]) -> Vec<String> {
    let of = |x: &Consequence| {
        let [axis, name, value, interval, unit] = told(x);
        format!("{axis}, {name}: {value} {unit} {interval}").trim_end().to_owned()
    };
    follows.iter().map(of).chain(notes.iter().cloned()).collect()
}

fn words(
    model: &PlantModel,
    prediction: &Prediction,
    follows: &[Consequence],
    notes: &[String],
) -> String {
    let until = prediction.time_s.last().copied().unwrap_or(0.0);
    let mut text = format!("{STRONG}{}{STRONG:#}, {} s\n", model.name, significant(until, 4));
    let last = prediction.velocity.len() - 1;
    for &dof in model.plant.axes() {
        let k = dof.index();
        let series: Vec<f64> = prediction.velocity.iter().map(|row| row[k]).collect();
        let end = significant(series[last], 3);
        let band = prediction.band.get(last).map_or(String::new(), |band| {
            format!(" [{}, {}]", significant(band[k][0], 3), significant(band[k][1], 3))
        });
        let unit = dof.units().velocity;
        let _ = writeln!(
            text,
            "  {dof:<6} {}  {FAINT}at the end{FAINT:#} {end}{band} {unit}",
            bar(&series)
        );
    }
    if !follows.is_empty() {
        let mut table = plain_table();
        for row in follows.iter().map(told) {
            table.add_row(row);
        }
        align(&mut table, 2..3);
        let _ = writeln!(text, "\nEach axis alone:\n{}", table.to_string().trim_end());
    }
    text.push('\n');
    for note in notes {
        let _ = writeln!(text, "{WARNING}note:{WARNING:#} {note}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_read_with_their_units() {
        let read = |text: &str| quantity(text, "--step", |dof| dof.units().force);
        assert_eq!(read("surge 200 N").expect("plain"), (Dof::Surge, 200.0));
        assert_eq!(read("yaw -5 N m").expect("plain"), (Dof::Yaw, -5.0));
        assert_eq!(read("yaw 5 N·m").expect("plain"), (Dof::Yaw, 5.0));
        let error = |text: &str| read(text).expect_err("wrong").to_string();
        assert!(error("yaw 5 N").contains("yaw is in N m"), "{}", error("yaw 5 N"));
        assert!(error("surge N").contains("has no number"));
        assert!(error("200 N").contains("names no axis"));
        let part = |text: &str| step_force(text).map_err(|error| error.to_string());
        let percent = |text: &str| ForceEntry::Percent(text.to_owned());
        assert_eq!(part("surge 60 %"), Ok((Dof::Surge, percent("60 %"))));
        assert_eq!(part("yaw -5%"), Ok((Dof::Yaw, percent("-5 %"))));
        assert_eq!(part("surge 200 N"), Ok((Dof::Surge, ForceEntry::Si(200.0))));
        assert!(part("surge 160 %").expect_err("too much").contains("at most 100 %"));
    }
}
