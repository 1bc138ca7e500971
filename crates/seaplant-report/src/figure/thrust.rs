//! Figure of thrust against the square of the propeller's speed.

use plotters::element::Circle;
use seaplant::QuadraticThrust;
use seaplant::results::{BollardPullResult, Parameter};

use super::axis::Axis;
use super::chart::{Frame, drawn, panel, px, stroke, titled};
use super::ink::Ink;
use super::scene::Scene;
use crate::Error;
use crate::number::{Rounded, significant};

/// Number of points of a fitted curve.
const CURVE_POINTS: usize = 100;

/// # Source
/// [Jason2, fig. 2].
pub(crate) fn scene(bollard_pull: &BollardPullResult) -> Result<Scene, Error> {
    let BollardPullResult { neutral, points, forward, reverse, .. } = bollard_pull;
    let squared = |input: f64| (input - neutral) * (input - neutral).abs();
    let mut key = vec![(Ink::Point, "measured")];
    key.extend(forward.as_ref().map(|_| (Ink::Forward, "fitted, forward")));
    key.extend(reverse.as_ref().map(|_| (Ink::Reverse, "fitted, reverse")));
    let title = "Thrust against the square of the input".to_owned();
    drawn((640, 400), title, description(bollard_pull), |area, title| {
        let rest = titled(area, title, &key)?;
        let x = Axis::around(points.iter().map(|p| squared(p.0)).chain([0.0]), 8);
        let y = Axis::around(points.iter().map(|p| p.1).chain([0.0]), 8);
        let (x_ends, y_ends) = (x.ends(), y.ends());
        let x_label = x_label(bollard_pull);
        let mut chart =
            panel(&rest, Frame { x, y, x_label: Some(&x_label), y_label: "thrust, N" })?;
        stroke(&mut chart, Ink::Frame, &[(x_ends.start, 0.0), (x_ends.end, 0.0)])?;
        stroke(&mut chart, Ink::Frame, &[(0.0, y_ends.start), (0.0, y_ends.end)])?;
        for (ink, fitted, sign) in [(Ink::Forward, forward, 1.0), (Ink::Reverse, reverse, -1.0)] {
            if fitted.is_some() {
                let inputs = inputs(bollard_pull, sign);
                let force = |input| curve(bollard_pull).force(input);
                let line: Vec<_> = inputs.map(|input| (squared(input), force(input))).collect();
                stroke(&mut chart, ink, &line)?;
            }
        }
        let circle = |p: &(f64, f64)| Circle::new((squared(p.0), p.1), px(3), Ink::Point.stroke());
        chart.draw_series(points.iter().map(circle))?;
        Ok(())
    })
}

/// Iterates over inputs from neutral to the farthest measured one, on one side.
fn inputs(bollard_pull: &BollardPullResult, sign: f64) -> impl Iterator<Item = f64> {
    let neutral = bollard_pull.neutral;
    let offsets = bollard_pull.points.iter().map(|p| sign * (p.0 - neutral));
    let reach = offsets.filter(|offset| offset.is_finite()).fold(0.0, f64::max);
    (0..=CURVE_POINTS).map(move |k| neutral + sign * reach * k as f64 / CURVE_POINTS as f64)
}

fn curve(bollard_pull: &BollardPullResult) -> QuadraticThrust {
    let value = |parameter: &Option<Parameter>| parameter.as_ref().map_or(0.0, |p| p.value);
    QuadraticThrust {
        forward: value(&bollard_pull.forward),
        reverse: value(&bollard_pull.reverse),
        deadband: value(&bollard_pull.deadband),
        neutral: bollard_pull.neutral,
        ..QuadraticThrust::default()
    }
}

fn x_label(bollard_pull: &BollardPullResult) -> String {
    let BollardPullResult { input_unit, neutral, .. } = bollard_pull;
    if input_unit == "rad/s" && *neutral == 0.0 {
        return "ω|ω|, (rad/s)²".to_owned();
    }
    let unit = if input_unit == "us" { "µs" } else { input_unit };
    format!("x|x|, ({unit})², where x = input − {}", significant(*neutral, 4))
}

fn description(bollard_pull: &BollardPullResult) -> String {
    let mut text = format!("Bollard pull from {}", bollard_pull.file);
    let fitted = [
        ("forward", &bollard_pull.forward),
        ("reverse", &bollard_pull.reverse),
        ("deadband", &bollard_pull.deadband),
    ];
    for (name, parameter) in fitted {
        if let Some(parameter) = parameter {
            let Rounded { value, std, .. } = Rounded::of(parameter);
            text.push_str(&format!("; {name} {value} ± {std} {}", parameter.unit));
        }
    }
    text.push_str(&format!(
        "; misfit {} N, R² = {}, {} points.",
        significant(bollard_pull.residual_rms, 2),
        significant(bollard_pull.r_squared, 4),
        bollard_pull.points.len(),
    ));
    text
}
