//! Figure of measured and simulated velocity, with their difference below.

use seaplant::Comparison;
use seaplant::results::ComparisonFigure;

use super::axis::Axis;
use super::chart::{Frame, drawn, line, panel, px, stroke, titled};
use super::ink::Ink;
use super::scene::Scene;
use crate::number::{count, or_absent, significant};
use crate::{Error, words};

const KEY: [(Ink, &str); 3] = [
    (Ink::Measured, "measured"),
    (Ink::Simulated, "simulated"),
    (Ink::Difference, "simulated − measured"),
];

/// # Source
/// [Jason2, fig. 3–6].
pub(super) fn scene(figure: &ComparisonFigure) -> Result<Scene, Error> {
    drawn((640, 430), title(figure), description(figure), |area, title| {
        let (above, below) = titled(area, title, &KEY)?.split_vertically(px(214));
        let Comparison { quantity, dof, time_s, measured, simulated, .. } = &figure.comparison;
        let unit = quantity.unit(*dof);
        let x = time_axis(time_s);
        let ends = x.ends();

        let y = Axis::around(measured.iter().chain(simulated).copied(), 6);
        let y_label = format!("{}, {unit}", quantity.name());
        let mut chart = panel(&above, Frame { x: x.clone(), y, x_label: None, y_label: &y_label })?;
        line(&mut chart, Ink::Measured, time_s, measured)?;
        line(&mut chart, Ink::Simulated, time_s, simulated)?;

        let difference: Vec<f64> = simulated.iter().zip(measured).map(|(s, m)| s - m).collect();
        let y = Axis::around(difference.iter().copied().chain([0.0]), 5);
        let y_label = format!("difference, {unit}");
        let mut chart = panel(&below, Frame { x, y, x_label: Some("time, s"), y_label: &y_label })?;
        stroke(&mut chart, Ink::Frame, &[(ends.start, 0.0), (ends.end, 0.0)])?;
        line(&mut chart, Ink::Difference, time_s, &difference)
    })
}

/// Creates an axis from the first instant to the last.
pub(super) fn time_axis(time_s: &[f64]) -> Axis {
    let first = time_s.first().copied().unwrap_or_default();
    Axis::between(first, time_s.last().copied().unwrap_or(first), 8)
}

fn title(figure: &ComparisonFigure) -> String {
    let Comparison { dof, trial, .. } = &figure.comparison;
    format!(
        "{} · {} · {} · {} trial",
        words::capitalised(dof.name()),
        trial,
        method(figure),
        words::role(figure.role),
    )
}

/// Describes the method of the plant, and whether its axes were fitted together.
fn method(figure: &ComparisonFigure) -> String {
    let together = if figure.plant.is_some() { ", axes together" } else { "" };
    words::method(figure.method) + together
}

/// Describes the figure in words and numbers.
pub(crate) fn description(figure: &ComparisonFigure) -> String {
    let Comparison { quantity, dof, trial, velocity, position, .. } = &figure.comparison;
    let units = dof.units();
    let mut text = format!(
        "Trial “{trial}”, {} by {}: mean |simulated − measured| e = {} {}; {} for {}; R² = {}; {} samples.",
        match figure.role {
            seaplant::Role::Fit => "on which the plant was fitted",
            seaplant::Role::HoldOut => "held out from the fit",
            seaplant::Role::Steady => "steady",
        },
        method(figure),
        significant(velocity.mean_abs_error, 3),
        quantity.unit(*dof),
        significant(velocity.null_error, 3),
        quantity.null_model(),
        or_absent(velocity.r_squared, 4),
        count(velocity.samples as u64),
    );
    if let Some(position) = position {
        text.push_str(&format!(
            " Position: e = {} {}, R² = {}.",
            significant(position.agreement.mean_abs_error, 3),
            units.position,
            or_absent(position.agreement.r_squared, 4),
        ));
    }
    text
}
