//! The part of the summary on plants of several axes.

use std::collections::BTreeMap;
use std::fmt::Write;

use seaplant::estimate::RudderLaw;
use seaplant::results::{
    Coefficient, NomotoResult, Parameter, PlantResult, Score, SecondOrder, ThrusterEstimate, ToldBy,
};
use seaplant::{Dof, Estimate};
use seaplant_report::number::{Rounded, decimals, or_absent};

use super::{
    align, beside_truth, parameter_row, plain_table, push_caveats, push_good_for, spoken_verdict,
};
use crate::output::{FAINT, STRONG};

/// True coefficients by name; an absent one is zero.
type Truth = BTreeMap<String, f64>;

/// Formats a block for each plant: coefficients of each axis, couplings, drag at a speed of each axis,
/// predictions.
pub(super) fn block(
    plant: &PlantResult,
    drag: &[(Dof, (f64, Estimate))],
    truth: Option<&Truth>,
) -> String {
    let mut text = String::new();
    let names: Vec<&str> = plant.axes.iter().map(|dof| dof.name()).collect();
    let _ = writeln!(
        text,
        "{STRONG}{}{STRONG:#} together, by {}: {}",
        names.join(", "),
        plant.method,
        spoken_verdict(&plant.verdict)
    );
    push_good_for(&mut text, &plant.verdict);
    let _ = writeln!(text, "{}", coefficients(plant, truth));
    push_drag(&mut text, drag);
    text += &thrusters(plant);
    let where_ = if plant.hold_out.is_some() { "held out" } else { "on its own trials" };
    let _ = writeln!(text, "  simulated from forces alone, {where_}:\n{}", scores(plant));
    push_caveats(&mut text, &plant.caveats);
    text.push('\n');
    text
}

/// Adds the drag of each axis as a force, which is known where its parts are not.
fn push_drag(text: &mut String, drag: &[(Dof, (f64, Estimate))]) {
    if drag.is_empty() {
        return;
    }
    let mut table = plain_table();
    for (dof, (speed, force)) in drag {
        let units = dof.units();
        let name = format!("drag in {dof} at {speed} {}", units.velocity);
        table.add_row(parameter_row(&name, &Parameter::new(*force, units.force), None));
    }
    align(&mut table, 1..4);
    let _ = writeln!(text, "{}", table.to_string().trim_end());
}

/// Formats a steering model: K, T and its prediction error.
pub(super) fn steering(model: &NomotoResult) -> String {
    let order = if model.order == 2 { "second" } else { "first" };
    let law = match model.rudder_law {
        RudderLaw::Proportional => "",
        RudderLaw::Sine => ", by ½ sin 2δ",
    };
    let mut text = format!(
        "{STRONG}yaw rate by rudder {}{STRONG:#}, Nomoto of the {order} order{law}\n",
        model.rudder
    );
    let mut all = vec![("K", &model.gain), ("T", &model.time)];
    if let Some(SecondOrder { time_sum, time_product, zero_time }) = &model.second {
        all.extend([("T1 + T2", time_sum), ("T1 T2", time_product), ("T3", zero_time)]);
    }
    all.extend(model.cubic.as_ref().map(|cubic| ("r³", cubic)));
    let mut table = plain_table();
    for (name, x) in all {
        let Rounded { value, std, low95, high95 } = Rounded::of(x);
        let interval = format!("[{low95}, {high95}]");
        table.add_row(vec![
            format!("  {name}"),
            value,
            format!("± {std}"),
            interval,
            x.unit.clone(),
        ]);
    }
    align(&mut table, 1..4);
    let _ = writeln!(text, "{}", table.to_string().trim_end());
    let held: Vec<f64> = model.hold_out_r2.values().flatten().copied().collect();
    let worst = held.iter().copied().reduce(f64::min);
    let held = worst.map_or(String::new(), |r2| format!(", held out {} at worst", decimals(r2, 3)));
    let _ = writeln!(text, "  R² of yaw rate {}{held}", decimals(model.fit_r2, 3));
    push_caveats(&mut text, &model.caveats);
    text.push('\n');
    text
}

/// Lists coefficients axis by axis: mass, damping, then others; those of several axes are last.
fn coefficients(plant: &PlantResult, truth: Option<&Truth>) -> String {
    let mut table = plain_table();
    for place in plant.axes.iter().map(|&dof| Some(dof)).chain([None]) {
        let mut rows: Vec<(&String, &Coefficient)> =
            plant.parameters.iter().filter(|(_, x)| only_axis(x) == place).collect();
        rows.sort_by_key(|(name, _)| (!name.starts_with("mass."), name.chars().count()));
        if !rows.is_empty() {
            let heading = place.map_or("several axes", Dof::name);
            table.add_row([format!("  {STRONG}{heading}{STRONG:#}")]);
        }
        for (name, x) in rows {
            let truth = truth.map(|truth| truth.get(name).copied().unwrap_or(0.0));
            table.add_row(row(name, x, truth));
        }
    }
    align(&mut table, 1..4);
    table.to_string().trim_end().to_owned()
}

/// Lists what each thruster gives, if the plant has gains or known forces reveal the scale of thrust.
fn thrusters(plant: &PlantResult) -> String {
    let all = &plant.thruster_estimates;
    let is_told = |own: &ThrusterEstimate| own.is_fitted || own.of_curve.is_some();
    if !all.values().any(is_told) {
        return String::new();
    }
    let mut table = plain_table();
    table.add_row([
        format!("  {STRONG}thrusters{STRONG:#}"),
        "beside most".to_owned(),
        "of its curve".to_owned(),
    ]);
    let half = |x: &Parameter| {
        let Rounded { value, low95, high95, .. } = Rounded::of(x);
        format!("{value} [{low95}, {high95}]")
    };
    for (name, own) in all {
        let of_curve = own.of_curve.as_ref().map_or(String::new(), half);
        table.add_row([format!("    {name}"), half(&own.gain), of_curve]);
    }
    format!("{}\n", table.to_string().trim_end())
}

/// Returns the axis that a coefficient acts on; `None` for one that acts on several.
fn only_axis(x: &Coefficient) -> Option<Dof> {
    match x.on[..] {
        [only] => Some(only),
        _ => None,
    }
}

fn row(name: &str, x: &Coefficient, truth: Option<f64>) -> Vec<String> {
    let Rounded { value, std, low95, high95 } = Rounded::of(&Parameter {
        value: x.value,
        std: x.std,
        low95: x.low95,
        high95: x.high95,
        unit: x.unit.clone(),
    });
    let remark = match x.told_by {
        ToldBy::Data => String::new(),
        ToldBy::Limit => format!("{FAINT}not above zero{FAINT:#}"),
        ToldBy::Stated => format!("{FAINT}stated, not fitted{FAINT:#}"),
        ToldBy::Nothing => format!("{FAINT}hardly determined by these trials{FAINT:#}"),
    };
    let mut row = vec![
        format!("    {name}"),
        value,
        format!("± {std}"),
        format!("[{low95}, {high95}]"),
        x.unit.clone(),
    ];
    row.extend(truth.map(|truth| beside_truth(x.value, truth)));
    row.push(remark);
    row
}

fn scores(plant: &PlantResult) -> String {
    let score = plant.hold_out.as_ref().unwrap_or(&plant.fit);
    let mut table = plain_table();
    for (dof, Score { mean_abs_error, null_error, r_squared, .. }) in &score.by_axis {
        let alone = plant.single_axes.get(dof).map(|score| match score.r_squared {
            Some(r2) => format!("alone {}", decimals(r2, 3)),
            None => "alone it diverges".to_owned(),
        });
        let unit = dof.units().velocity;
        table.add_row(vec![
            format!("    {dof}"),
            format!("e = {}", or_absent(*mean_abs_error, 3)),
            format!("{unit}, {} for a model that never moves", or_absent(Some(*null_error), 3)),
            r_squared.map_or(String::new(), |r2| format!("R² {}", decimals(r2, 3))),
            alone.unwrap_or_default(),
        ]);
    }
    align(&mut table, 1..2);
    table.to_string().trim_end().to_owned()
}
