//! Figure of a controller's lines over time or frequency, with a band.

use super::axis::Axis;
use super::chart::{Frame, drawn, line, panel, stroke, titled};
use super::ink::Ink;
use super::scene::Scene;
use crate::Error;
use crate::control::CurveChart;

pub(crate) fn scene(chart: &CurveChart) -> Result<Scene, Error> {
    let mut key = vec![(Ink::Simulated, chart.line.0.as_str())];
    key.extend(chart.beside.iter().map(|(name, _)| (Ink::Measured, name.as_str())));
    key.extend(chart.band.iter().map(|_| (Ink::Difference, "95 % band")));
    drawn((640, 240), chart.title.clone(), chart.caption.clone(), |area, title| {
        let rest = titled(area, title, &key)?;
        let beside = chart.beside.iter().flat_map(|(_, y)| y);
        let band = chart.band.iter().flatten().flatten();
        let all = chart.line.1.iter().chain(beside).chain(band).copied();
        let (first, last) = (chart.x.first().copied(), chart.x.last().copied());
        let (first, last) = (first.unwrap_or(0.0), last.unwrap_or(1.0));
        let x = match chart.is_logarithmic {
            true => Axis::decades(first, last),
            false => Axis::between(first, last, 8),
        };
        let frame = Frame {
            x,
            y: Axis::around(all, 6),
            x_label: Some(&format!("{}, {}", chart.x_label, chart.x_unit)),
            y_label: &chart.y_label,
        };
        let mut drawing = panel(&rest, frame)?;
        let mut draw = |ink, y: &[f64]| match chart.is_logarithmic {
            // Growing steps, as on a logarithmic axis, are not gaps.
            true => {
                let points: Vec<_> = chart.x.iter().copied().zip(y.iter().copied()).collect();
                stroke(&mut drawing, ink, &points)
            }
            false => line(&mut drawing, ink, &chart.x, y),
        };
        for end in chart.band.iter().flatten() {
            draw(Ink::Difference, end)?;
        }
        if let Some((_, y)) = &chart.beside {
            draw(Ink::Measured, y)?;
        }
        draw(Ink::Simulated, &chart.line.1)
    })
}
