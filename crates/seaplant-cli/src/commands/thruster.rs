use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use seaplant::Severity;
use seaplant::results::{BollardPullResult, Parameter};
use seaplant_campaign::{BenchColumns, bollard_result, fit_bench, read_bench};
use seaplant_report::number::{Rounded, significant};
use seaplant_report::thrust_figure;

use crate::args::Thruster;
use crate::output::{Output, SEVERE, WARNING};
use crate::summary::{align, plain_table};
use crate::writing::{Permit, write_file};

pub fn run(arguments: &Thruster, output: Output) -> Result<ExitCode> {
    let columns = BenchColumns {
        input: arguments.input.clone(),
        input_unit: arguments.input_unit.clone(),
        force: arguments.force.clone(),
        force_unit: arguments.force_unit.clone(),
    };
    let bench = read_bench(&arguments.table, &columns, None)?;
    let fit = fit_bench(&bench, arguments.neutral)
        .with_context(|| arguments.table.display().to_string())?;
    let result = bollard_result(&bench, &fit);
    if let Some(path) = &arguments.plot {
        let figure = thrust_figure(&result)?;
        let inputs = [arguments.table.clone()];
        let permit = Permit { flag: "--overwrite", ..Permit::new(&inputs, arguments.overwrite) };
        write_file(path, image(path, figure)?.as_slice(), permit, is_picture)?;
    }
    let columns = format!("{} against {}", bench.force_column.trim(), bench.input_column.trim());
    output.give(&result, || words(&columns, bench.missing, &result))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns whether a file is a picture by this command; pixel formats cannot be recognised.
fn is_picture(bytes: &[u8]) -> bool {
    bytes.starts_with(b"<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"fig\"")
}

fn image(path: &Path, figure: seaplant_report::Figure) -> Result<Vec<u8>> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("svg") => Ok(figure.svg),
        Some("png") => Ok(figure.png),
        _ => bail!("cannot draw to {}; give a path that ends in .svg or .png", path.display()),
    }
}

fn words(columns: &str, missing: usize, fit: &BollardPullResult) -> String {
    let mut table = plain_table();
    let mut add = |name: &str, parameter: &Option<Parameter>| {
        if let Some(parameter) = parameter {
            let Rounded { value, std, low95, high95 } = Rounded::of(parameter);
            let interval = format!("[{low95}, {high95}]");
            table.add_row([name, &value, &format!("± {std}"), &interval, &parameter.unit]);
        }
    };
    add("forward", &fit.forward);
    add("reverse", &fit.reverse);
    add("deadband", &fit.deadband);
    align(&mut table, 1..4);
    let mut text = format!("{columns}, {} points", fit.points.len());
    if missing > 0 {
        text += &format!(", {missing} rows without both");
    }
    text += &format!(
        "\n{table}\nmisfit {} N rms, R² {:.4}\n\ncurve = {}\n",
        significant(fit.residual_rms, 3),
        fit.r_squared,
        curve_toml(fit)
    );
    for caveat in &fit.caveats {
        let style = if caveat.severity == Severity::Severe { SEVERE } else { WARNING };
        text += &format!("{style}caveat:{style:#} {}\n", caveat.message);
    }
    text
}

/// Returns the line for vehicle.toml.
fn curve_toml(fit: &BollardPullResult) -> String {
    let value = |parameter: &Option<Parameter>| parameter.as_ref().map_or(0.0, |p| p.value);
    let mut words = format!(
        "{{ kind = \"quadratic\", forward = {:.5e}, reverse = {:.5e}",
        value(&fit.forward),
        value(&fit.reverse)
    );
    match fit.input_unit.as_str() {
        "us" => words += ", input = \"pwm\"",
        "1" => words += ", input = \"command\"",
        _ => {}
    }
    if fit.deadband.is_some() {
        words += &format!(", deadband = {:.4}", value(&fit.deadband));
    }
    words + " }"
}
