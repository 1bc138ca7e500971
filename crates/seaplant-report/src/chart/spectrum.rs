//! What was excited, and what the filters let through.

use seaplant::results::{Results, SpectrumFigure};

use super::motion::file;
use super::{Chart, Horizontal, Line, Panel, Subject, Values};
use crate::figure::{Ink, spectrum_view};
use crate::number::significant;

pub(super) fn chart(figure: &SpectrumFigure, results: &Results, id: String, stem: &str) -> Chart {
    let view = spectrum_view(figure, results);
    let mut lines = vec![
        Line::new("force", Ink::Force, Values::of(&view.force)),
        Line::new("velocity", Ink::Velocity, Values::of(&view.velocity)),
    ];
    for gain in &view.gains {
        let y: Vec<f64> =
            view.frequency_hz.iter().map(|f| gain.filter.zero_phase_gain(*f)).collect();
        lines.push(Line::new(gain.name.clone(), gain.ink, Values::of(&y)));
    }
    let marks = view.excited_hz.map(|f| (f, format!("{} Hz", significant(f, 3))));
    Chart {
        subject: Subject::Spectrum,
        dof: figure.dof,
        id,
        title: format!("{} · spectrum of force and velocity", figure.trial),
        description: view.description,
        files: ["svg", "png"].map(|kind| file(kind, stem)).to_vec(),
        still: Some(stem.to_owned()),
        x: Horizontal {
            label: "frequency".to_owned(),
            unit: "Hz",
            logarithmic: true,
            names: Vec::new(),
        },
        panels: vec![Panel {
            label: "Gain of filters; amplitude / greatest".to_owned(),
            height: 240,
            x: Values::List(view.frequency_hz.iter().copied().map(Some).collect()),
            lines,
            marks: marks.into_iter().collect(),
            ..Panel::default()
        }],
    }
}
