//! Tables and series as CSV, at full precision.

use std::io::{self, Write};

use seaplant::results::{Alone, Parameter, PlantResult, Results};
use seaplant::{Comparison, Dof, PositionComparison};

use crate::{Artifact, Error};

type Writer = csv::Writer<Vec<u8>>;

/// Returns tables 5 and 6; the second only if there are steady trials.
pub(crate) fn tables(results: &Results) -> Result<Vec<Artifact<'static>>, Error> {
    let mut tables = vec![artifact("tables/table-5.csv", table_5(results)?)?];
    if !results.steady.is_empty() {
        tables.push(artifact("tables/table-6.csv", table_6(results)?)?);
    }
    Ok(tables)
}

fn artifact(path: &str, writer: Writer) -> Result<Artifact<'static>, Error> {
    let bytes = writer.into_inner().map_err(|cause| csv::Error::from(cause.into_error()))?;
    Ok(Artifact::of_bytes(path, bytes))
}

/// Writes every sample of velocity, or every mean of acceleration.
pub(crate) fn write_motion(comparison: &Comparison, out: impl Write) -> io::Result<()> {
    let units = comparison.dof.units();
    let unit = comparison.quantity.unit(comparison.dof);
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record([
        "time_s".to_owned(),
        format!("force [{}]", units.force),
        format!("measured [{unit}]"),
        format!("simulated [{unit}]"),
        format!("difference [{unit}]"),
    ])?;
    let motion = comparison.measured.iter().zip(&comparison.simulated);
    for ((time, force), (measured, simulated)) in
        comparison.time_s.iter().zip(&comparison.force).zip(motion)
    {
        writer.serialize([*time, *force, *measured, *simulated, simulated - measured])?;
    }
    writer.flush()
}

/// Writes every sample of position.
pub(crate) fn write_position(
    position: &PositionComparison,
    dof: Dof,
    out: impl Write,
) -> io::Result<()> {
    let unit = dof.units().position;
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record([
        "time_s".to_owned(),
        format!("measured [{unit}]"),
        format!("simulated [{unit}]"),
        format!("difference [{unit}]"),
    ])?;
    let motion = position.measured.iter().zip(&position.simulated);
    for (time, (measured, simulated)) in position.time_s.iter().zip(motion) {
        writer.serialize([*time, *measured, *simulated, simulated - measured])?;
    }
    writer.flush()
}

fn table_5(results: &Results) -> Result<Writer, Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut head = vec![
        "dof",
        "method",
        "recommended",
        "alpha",
        "beta",
        "mu",
        "bias",
        "e_fit",
        "e_fit_null",
        "e_hold_out",
        "e_hold_out_null",
        "stable",
    ]
    .into_iter()
    .map(str::to_owned)
    .collect::<Vec<_>>();
    for name in ["mass", "quadratic_drag", "linear_drag", "bias_force"] {
        head.extend(["", "_std", "_low95", "_high95", "_unit"].map(|end| format!("{name}{end}")));
    }
    writer.write_record(head)?;
    for dof in Dof::ALL {
        let recommended = results.plants.get(dof.name()).map(|plant| plant.method);
        for (method, plant, alone) in results.methods_of(dof) {
            if let Some(row) = row_5(dof, recommended == Some(method), plant, alone) {
                writer.write_record(row)?;
            }
        }
    }
    Ok(writer)
}

fn row_5(dof: Dof, recommended: bool, plant: &PlantResult, alone: &Alone) -> Option<Vec<String>> {
    let (lumped, parameters) = (&alone.lumped, plant.by_axis.get(&dof)?);
    let (fit, hold_out) = (plant.fitted(dof), plant.held_out(dof));
    let method = plant.method.name().to_owned();
    let mut row = vec![dof.name().to_owned(), method, recommended.to_string()];
    row.extend([lumped.alpha, lumped.beta, lumped.mu, lumped.bias].map(|x| x.to_string()));
    row.extend([
        or_empty(fit.and_then(|score| score.mean_abs_error)),
        or_empty(fit.map(|score| score.null_error)),
        or_empty(hold_out.and_then(|score| score.mean_abs_error)),
        or_empty(hold_out.map(|score| score.null_error)),
        alone.stable.to_string(),
    ]);
    row.extend(parameter_cells(Some(&parameters.mass)));
    for parameter in [&parameters.quadratic_drag, &parameters.linear_drag, &parameters.bias_force] {
        row.extend(parameter_cells(parameter.as_ref()));
    }
    Some(row)
}

fn parameter_cells(parameter: Option<&Parameter>) -> [String; 5] {
    parameter.map_or_else(Default::default, |p| {
        let number = |x: f64| x.to_string();
        [number(p.value), number(p.std), number(p.low95), number(p.high95), p.unit.clone()]
    })
}

/// Formats a name as a cell that no spreadsheet takes for a formula.
fn text_cell(text: &str) -> String {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']) {
        format!("'{text}")
    } else {
        text.to_owned()
    }
}

fn or_empty(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

fn table_6(results: &Results) -> Result<Writer, Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "dof",
        "trial",
        "from_s",
        "to_s",
        "force",
        "force_part",
        "velocity",
        "velocity_std",
        "quadratic_drag",
        "quadratic_drag_std",
        "quadratic_drag_low95",
        "quadratic_drag_high95",
        "quadratic_drag_unit",
        "e",
        "e_joint",
    ])?;
    for (dof, steady) in &results.steady {
        for segment in &steady.segments {
            let mut row = vec![dof.name().to_owned(), text_cell(&segment.trial)];
            row.extend(
                [
                    segment.from_s,
                    segment.to_s,
                    segment.force,
                    segment.force_part,
                    segment.velocity,
                    segment.velocity_std,
                ]
                .map(|x| x.to_string()),
            );
            row.extend(parameter_cells(Some(&segment.quadratic_drag)));
            row.extend([segment.mean_abs_error.to_string(), or_empty(segment.joint_error)]);
            writer.write_record(row)?;
        }
    }
    Ok(writer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_no_formula() {
        for name in ["=1+1", "+1", "-1", "@SUM(A1)", "\tx", "\r=1"] {
            assert_eq!(text_cell(name), format!("'{name}"));
        }
        for name in ["surge 1", "a=b", "", "1-2", "ü"] {
            assert_eq!(text_cell(name), name);
        }
    }
}
