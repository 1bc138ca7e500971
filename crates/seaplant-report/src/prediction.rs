//! Writes a prediction as one page that opens in any browser without a network.

use seaplant::Dof;
use seaplant::exchange::{PlantModel, Prediction};

use crate::chart_page::{ChartPage, LiveChart};
use crate::control::CurveChart;
use crate::number::significant;
use crate::{Error, words};

/// Writes the page of a prediction: a chart of the velocity of each axis, and warnings.
///
/// # Errors
/// [`Error::Figure`], [`Error::Template`], [`Error::Json`].
pub fn prediction_page(
    model: &PlantModel,
    prediction: &Prediction,
    lines: &[String],
) -> Result<Vec<u8>, Error> {
    let curves: Vec<CurveChart> =
        model.plant.axes().iter().map(|&dof| velocity(prediction, dof)).collect();
    let unknown: Vec<&str> = model.unknown_axes().iter().map(|dof: &Dof| dof.name()).collect();
    let unknown = (!unknown.is_empty())
        .then(|| format!("Axes without a plant, which do not move: {}.", unknown.join(", ")));
    let page = ChartPage {
        mark: MARK,
        kind: "Predicted motion",
        title: model.name.clone(),
        lead: unknown.into_iter().collect(),
        notes: lines.to_vec(),
        charts: LiveChart::of_curves(&curves)?,
        ..ChartPage::default()
    };
    page.bytes()
}

/// Returns the chart of an axis' velocity with its band.
fn velocity(prediction: &Prediction, dof: Dof) -> CurveChart {
    let of = |row: &[f64; 6]| row[dof.index()];
    let velocity: Vec<f64> = prediction.velocity.iter().map(of).collect();
    let ends: [Vec<f64>; 2] =
        [0, 1].map(|end| prediction.band.iter().map(|row| row[dof.index()][end]).collect());
    CurveChart {
        title: words::capitalised(dof.name()),
        caption: description(dof, &velocity, &ends),
        x_label: "time",
        x_unit: "s",
        is_logarithmic: false,
        y_label: format!("velocity, {}", dof.units().velocity),
        x: prediction.time_s.clone(),
        line: ("predicted".to_owned(), velocity),
        beside: None,
        band: (!prediction.band.is_empty()).then_some(ends),
    }
}

fn description(dof: Dof, velocity: &[f64], ends: &[Vec<f64>; 2]) -> String {
    let unit = dof.units().velocity;
    let last = velocity.last().map_or_else(String::new, |v| significant(*v, 4));
    let band = match (ends[0].last(), ends[1].last()) {
        (Some(low), Some(high)) => {
            format!(", 95 % band {} to {}", significant(*low, 4), significant(*high, 4))
        }
        _ => String::new(),
    };
    format!("{dof}: {last} {unit} at the end{band}.")
}

/// First bytes of every such page.
const MARK: &str = "<!DOCTYPE html><!-- seaplant simulate -->";

/// Returns whether a file begins like such a page.
pub fn is_prediction_page(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK.as_bytes())
}
