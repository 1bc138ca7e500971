//! Figure of steady stretches in their record.

use plotters::element::Rectangle;
use seaplant::Dof;
use seaplant::results::{Results, SegmentResult, SteadyFigure};

use super::axis::Axis;
use super::chart::{Area, Frame, drawn, line, panel, px, stroke, titled};
use super::comparison::time_axis;
use super::ink::Ink;
use super::scene::Scene;
use crate::number::{chosen, significant};
use crate::{Error, words};

const KEY: [(Ink, &str); 3] = [
    (Ink::Measured, "measured"),
    (Ink::Segment, "steady stretch"),
    (Ink::Simulated, "its mean velocity"),
];

/// # Source
/// [Jason2, eq. (8), table 6].
pub(super) fn scene(figure: &SteadyFigure, results: &Results) -> Result<Scene, Error> {
    let segments = segments(figure, results);
    let name = words::capitalised(figure.dof.name());
    let title = format!("{name} · {} · steady stretches", figure.trial);
    let has_position = !figure.position.is_empty();
    let height = if has_position { 400 } else { 260 };
    drawn((640, height), title, description(figure, &segments), |area, title| {
        let rest = titled(area, title, &KEY)?;
        let x = time_axis(&figure.time_s);
        if !has_position {
            return velocity_panel(&rest, figure, &segments, x);
        }
        let (above, below) = rest.split_vertically(px(150));
        position_panel(&above, figure, &segments, x.clone())?;
        velocity_panel(&below, figure, &segments, x)
    })
}

/// Returns the steady stretches of the figure's trial.
pub(crate) fn segments<'a>(figure: &SteadyFigure, results: &'a Results) -> Vec<&'a SegmentResult> {
    let steady = results.steady.get(&figure.dof);
    let all = steady.into_iter().flat_map(|steady| &steady.segments);
    all.filter(|segment| segment.trial == figure.trial).collect()
}

fn position_panel(
    area: &Area<'_>,
    figure: &SteadyFigure,
    segments: &[&SegmentResult],
    x: Axis,
) -> Result<(), Error> {
    let what = match figure.dof {
        Dof::Heave => "depth",
        Dof::Yaw => "heading",
        _ => "position",
    };
    let y_label = format!("{what}, {}", figure.dof.units().position);
    let y = Axis::around(figure.position.iter().copied(), 5);
    let ends = y.ends();
    let mut chart = panel(area, Frame { x, y, x_label: None, y_label: &y_label })?;
    chart.draw_series(segments.iter().map(|s| {
        Rectangle::new([(s.from_s, ends.start), (s.to_s, ends.end)], Ink::Segment.fill())
    }))?;
    line(&mut chart, Ink::Measured, &figure.position_time_s, &figure.position)
}

fn velocity_panel(
    area: &Area<'_>,
    figure: &SteadyFigure,
    segments: &[&SegmentResult],
    x: Axis,
) -> Result<(), Error> {
    let y_label = format!("velocity, {}", figure.dof.units().velocity);
    let y = Axis::around(figure.velocity.iter().copied().chain([0.0]), 6);
    let ends = y.ends();
    let mut chart = panel(area, Frame { x, y, x_label: Some("time, s"), y_label: &y_label })?;
    chart.draw_series(segments.iter().map(|s| {
        Rectangle::new([(s.from_s, ends.start), (s.to_s, ends.end)], Ink::Segment.fill())
    }))?;
    line(&mut chart, Ink::Measured, &figure.time_s, &figure.velocity)?;
    for s in segments {
        stroke(&mut chart, Ink::Simulated, &[(s.from_s, s.velocity), (s.to_s, s.velocity)])?;
    }
    Ok(())
}

/// Describes the figure in words and numbers.
pub(crate) fn description(figure: &SteadyFigure, segments: &[&SegmentResult]) -> String {
    let units = figure.dof.units();
    if segments.is_empty() {
        return format!("Trial “{}”: no stretch counts as steady.", figure.trial);
    }
    let all: Vec<String> = segments
        .iter()
        .map(|s| {
            format!(
                "{} to {} s at {} {} and {} {}",
                chosen(s.from_s),
                chosen(s.to_s),
                significant(s.force, 3),
                units.force,
                significant(s.velocity, 3),
                units.velocity,
            )
        })
        .collect();
    format!("Trial “{}”: steady from {}.", figure.trial, all.join("; "))
}
