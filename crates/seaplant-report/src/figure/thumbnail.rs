//! Thumbnail of a prediction: measured and simulated velocity, and their difference.

use std::collections::BTreeMap;
use std::fmt::Write;

use seaplant::results::{ComparisonFigure, Results, Series};
use seaplant::{Comparison, Dof, Role};

use crate::decimate::decimate;
use crate::number::significant;
use crate::words::escaped;

/// Width, height of velocity, and height of the difference below it, in the drawing's units.
const SIZE: (f64, f64, f64) = (320.0, 76.0, 30.0);

/// Number of points of a line; a card is a few hundred pixels wide.
const POINTS: usize = 400;

/// Thumbnail of each degree of freedom: the recommended plant's prediction of the first held-out
/// trial, else of the first fitted one. Axes of a plant of several are keyed by its name.
#[derive(Default)]
pub(crate) struct Thumbnails(BTreeMap<(Option<String>, Dof), Thumbnail>);

/// A thumbnail with its caption.
struct Thumbnail {
    role: Role,
    svg: String,
    caption: String,
}

impl Thumbnails {
    /// Adds a series, if it is preferable to the present one.
    pub(crate) fn add(&mut self, series: &Series, results: &Results) {
        let Series::Comparison(figure) = series else { return };
        let dof = figure.comparison.dof;
        let is_recommended = figure.plant.is_some()
            || results.plants.get(dof.name()).is_some_and(|plant| plant.method == figure.method);
        let key = (figure.plant.clone(), dof);
        let is_better = match self.0.get(&key) {
            None => true,
            Some(known) => known.role != Role::HoldOut && figure.role == Role::HoldOut,
        };
        if is_recommended && is_better {
            self.0.insert(key, Thumbnail::new(figure));
        }
    }

    /// Returns the drawing and its caption; `plant` is the name of a plant of several axes.
    pub(crate) fn of(&self, plant: Option<&str>, dof: Dof) -> Option<(&str, &str)> {
        let known = self.0.get(&(plant.map(str::to_owned), dof));
        known.map(|known| (known.svg.as_str(), known.caption.as_str()))
    }
}

impl Thumbnail {
    fn new(figure: &ComparisonFigure) -> Self {
        let Comparison { dof, trial, time_s, measured, simulated, .. } = &figure.comparison;
        let unit = dof.units().velocity;
        let most = |x: &[f64]| x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let top = most(measured).max(most(simulated));
        let difference: Vec<f64> = simulated.iter().zip(measured).map(|(s, m)| s - m).collect();
        let what = if figure.role == Role::HoldOut { "held out" } else { "fitted" };
        let caption = format!(
            "{trial}, {what}, ±{} {unit}: measured (grey), simulated; below, their difference at the same scale",
            significant(top, 2)
        );
        let (width, height, below) = SIZE;
        let mut svg = format!(
            "<svg viewBox=\"0 0 {width} {}\" role=\"img\" aria-label=\"{}\" preserveAspectRatio=\"none\">",
            height + below,
            escaped(&caption)
        );
        let middles = [0.5 * height, height + 0.5 * below];
        for middle in middles {
            // Writing to a string cannot fail.
            let _ = write!(svg, "<path class=\"zero\" d=\"M0 {middle}H{width}\"/>");
        }
        let lines = [
            ("measured", measured.as_slice(), middles[0]),
            ("simulated", simulated.as_slice(), middles[0]),
            ("difference", difference.as_slice(), middles[1]),
        ];
        for (class, y, middle) in lines {
            let path = path(time_s, y, middle, top, 0.5 * (height - 4.0));
            let _ = write!(svg, "<path class=\"{class}\" d=\"{path}\"/>");
        }
        svg += "</svg>";
        Self { role: figure.role, svg, caption }
    }
}

/// Returns a line about a height; `top` is drawn `reach` above it.
fn path(time_s: &[f64], y: &[f64], middle: f64, top: f64, reach: f64) -> String {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else { return String::new() };
    let across = if last > first { SIZE.0 / (last - first) } else { 0.0 };
    let up = if top > 0.0 { reach / top } else { 0.0 };
    let (floor, ceiling) = (1.0, SIZE.1 + SIZE.2 - 1.0);
    let mut path = String::new();
    for (k, (t, y)) in decimate(time_s, y, POINTS).into_iter().enumerate() {
        let letter = if k == 0 { 'M' } else { 'L' };
        let height = (middle - up * y).clamp(floor, ceiling);
        let _ = write!(path, "{letter}{:.1} {height:.1}", across * (t - first));
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_goes_from_edge_to_edge_and_up_for_positive_values() {
        let path = path(&[10.0, 20.0], &[0.0, 2.0], 38.0, 2.0, 36.0);
        assert_eq!(path, "M0.0 38.0L320.0 2.0");
    }

    #[test]
    fn a_record_without_time_or_motion_is_flat() {
        assert_eq!(super::path(&[], &[], 38.0, 0.0, 36.0), "");
        assert_eq!(super::path(&[1.0, 1.0], &[0.0, 0.0], 38.0, 0.0, 36.0), "M0.0 38.0L0.0 38.0");
    }
}
