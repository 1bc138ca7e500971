//! The charts of a controller's page.

use std::collections::BTreeMap;

use seaplant::Dof;
use seaplant_control::{AxisGains, Curve, Gains, Response};
use seaplant_report::CurveChart;

use super::Run;

/// Draws for each axis the open loop, a step, and the error while it follows a sine.
pub(super) fn charts(
    gains: &Gains,
    responses: &BTreeMap<Dof, Response>,
    runs: &[Run],
) -> Vec<CurveChart> {
    let of = |(dof, response): (&Dof, &Response)| {
        let mut charts = bode(*dof, response, &gains.axes[dof]);
        charts.extend(step(*dof, response));
        charts.extend(tracking(*dof, runs));
        charts
    };
    responses.iter().flat_map(of).collect()
}

fn band(curve: &Curve, as_drawn: impl Fn(f64) -> f64) -> Option<[Vec<f64>; 2]> {
    let end = |end: &[f64]| end.iter().map(|x| as_drawn(*x)).collect();
    (!curve.low.is_empty()).then(|| [end(&curve.low), end(&curve.high)])
}

fn bode(dof: Dof, response: &Response, axis: &AxisGains) -> Vec<CurveChart> {
    let decibels = |x: f64| 20.0 * x.log10();
    let chart = |what: &str, caption: String, unit: &str| CurveChart {
        title: format!("{dof}: {what} of the open loop"),
        caption,
        x_label: "frequency",
        x_unit: "Hz",
        is_logarithmic: true,
        y_label: format!("{what}, {unit}"),
        x: response.frequency_hz.clone(),
        line: (what.to_owned(), Vec::new()),
        beside: None,
        band: None,
    };
    let gain = response.gain.estimate.iter().map(|x| decibels(*x)).collect();
    let crossing = format!(
        "At rest. The gain is one at {:.3} Hz, at the worse of rest and typical speed.",
        axis.margins.crossover_hz
    );
    let phase = format!(
        "Phase margin {:.0}° for the estimated plant; {:.0}° for the worst plant drawn from its uncertainty.",
        axis.margins.phase_deg, axis.worst.phase_deg
    );
    let (upper, lower) = (chart("gain", crossing, "dB"), chart("phase", phase, "degrees"));
    vec![
        CurveChart {
            line: (upper.line.0.clone(), gain),
            band: band(&response.gain, decibels),
            ..upper
        },
        CurveChart {
            line: (lower.line.0.clone(), response.phase_deg.estimate.clone()),
            band: band(&response.phase_deg, |x| x),
            ..lower
        },
    ]
}

fn step(dof: Dof, response: &Response) -> Option<CurveChart> {
    let step = response.step.as_ref()?;
    let unit = dof.units().position;
    let highest = step.estimate.iter().copied().fold(0.0, f64::max);
    let wanted = response.asked.last().copied().unwrap_or(1.0);
    Some(CurveChart {
        title: format!("{dof}: a step"),
        caption: format!(
            "With lag, delay and limits, in still water: it overshoots by {:.0} %.",
            100.0 * (highest / wanted - 1.0).max(0.0)
        ),
        x_label: "time",
        x_unit: "s",
        is_logarithmic: false,
        y_label: format!("displacement, {unit}"),
        x: response.time_s.clone(),
        line: ("vehicle".to_owned(), step.estimate.clone()),
        beside: Some(("setpoint".to_owned(), response.asked.clone())),
        band: band(step, |x| x),
    })
}

/// Draws the error in still water, and in a current.
fn tracking(dof: Dof, runs: &[Run]) -> Option<CurveChart> {
    let unit = dof.units().position;
    let error = |run: &Run| -> Vec<f64> {
        run.tracked.error.iter().map(|error| error[dof.index()]).collect()
    };
    let [first, rest @ ..] = runs else { return None };
    let told: Vec<String> = runs
        .iter()
        .map(|run| format!("{:.4} {unit} in {}", run.tracked.rms[&dof], run.name))
        .collect();
    Some(CurveChart {
        title: format!("{dof}: error while it follows a sine"),
        caption: format!("Root mean square {}.", told.join(", ")),
        x_label: "time",
        x_unit: "s",
        is_logarithmic: false,
        y_label: format!("error, {unit}"),
        x: first.tracked.time_s.clone(),
        line: (first.name.to_owned(), error(first)),
        beside: rest.first().map(|run| (run.name.to_owned(), error(run))),
        band: None,
    })
}
