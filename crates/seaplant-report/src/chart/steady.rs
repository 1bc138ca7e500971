//! Chart of steady stretches in their record.

use seaplant::results::{Results, SteadyFigure};

use super::motion::{file, position_name};
use super::values::Cut;
use super::{Chart, Horizontal, Line, Panel, Subject};
use crate::figure::{Ink, steady_description, steady_segments};

pub(super) fn chart(figure: &SteadyFigure, results: &Results, id: String, stem: &str) -> Chart {
    let segments = steady_segments(figure, results);
    let bands: Vec<[f64; 2]> = segments.iter().map(|s| [s.from_s, s.to_s]).collect();
    let units = figure.dof.units();
    let cut = Cut::new(&figure.time_s);
    let mean_velocity: Vec<f64> = figure
        .time_s
        .iter()
        .map(|t| segments.iter().find(|s| (s.from_s..=s.to_s).contains(t)))
        .map(|segment| segment.map_or(f64::NAN, |segment| segment.velocity))
        .collect();
    let panel = |label: &str, unit: &str, cut: &Cut, lines| Panel {
        label: format!("{label}, {unit}"),
        height: 150,
        x: cut.times(),
        lines,
        bands: bands.clone(),
        ..Panel::default()
    };
    let mut panels = Vec::new();
    if !figure.position.is_empty() {
        let cut = Cut::new(&figure.position_time_s);
        let lines = vec![Line::new("measured", Ink::Measured, cut.pack(&figure.position))];
        panels.push(panel(position_name(figure.dof), units.position, &cut, lines));
    }
    let lines = vec![
        Line::new("measured", Ink::Measured, cut.pack(&figure.velocity)),
        Line::new("mean of the stretch", Ink::Simulated, cut.pack(&mean_velocity)),
    ];
    panels.push(panel("Velocity", units.velocity, &cut, lines));
    let force = vec![Line::new("force", Ink::Force, cut.pack(&figure.force))];
    panels.push(Panel { height: 130, ..panel("Force", units.force, &cut, force) });
    Chart {
        subject: Subject::Steady,
        id,
        title: format!("{} · steady stretches", figure.trial),
        description: steady_description(figure, &segments),
        files: ["svg", "png"].map(|kind| file(kind, stem)).to_vec(),
        plant: figure.dof.name().to_owned(),
        stills: vec![stem.to_owned()],
        x: Horizontal::seconds("time"),
        panels,
    }
}
