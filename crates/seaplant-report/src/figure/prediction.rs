//! The velocity of one axis as predicted, with its band.

use seaplant::Dof;
use seaplant::exchange::Prediction;

use super::axis::Axis;
use super::chart::{Frame, drawn, line, panel, titled};
use super::comparison::time_axis;
use super::ink::Ink;
use super::scene::Scene;
use crate::number::significant;
use crate::{Error, words};

const KEY: [(Ink, &str); 2] = [(Ink::Simulated, "predicted"), (Ink::Difference, "95 % band")];

pub(crate) fn scene(prediction: &Prediction, dof: Dof) -> Result<Scene, Error> {
    let of = |values: &[[f64; 6]]| values.iter().map(|row| row[dof.index()]).collect::<Vec<_>>();
    let velocity = of(&prediction.velocity);
    let ends: [Vec<f64>; 2] =
        [0, 1].map(|end| prediction.band.iter().map(|row| row[dof.index()][end]).collect());
    let key = if prediction.band.is_empty() { &KEY[..1] } else { &KEY[..] };
    let unit = dof.units().velocity;
    let title = words::capitalised(dof.name());
    drawn((640, 240), title, description(dof, &velocity, &ends), |area, title| {
        let rest = titled(area, title, key)?;
        let all = velocity.iter().chain(&ends[0]).chain(&ends[1]).copied();
        let y_label = format!("velocity, {unit}");
        let (x, y) = (time_axis(&prediction.time_s), Axis::around(all.chain([0.0]), 6));
        let mut chart = panel(&rest, Frame { x, y, x_label: Some("time, s"), y_label: &y_label })?;
        for end in ends.iter().filter(|end| !end.is_empty()) {
            line(&mut chart, Ink::Difference, &prediction.time_s, end)?;
        }
        line(&mut chart, Ink::Simulated, &prediction.time_s, &velocity)
    })
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
