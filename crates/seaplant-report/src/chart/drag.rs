//! Drag as a force over speed, with its interval.

use seaplant::Dof;
use seaplant::results::DragCurve;

use super::{Chart, Horizontal, Line, Panel, Subject, Values};
use crate::figure::Ink;
use crate::number::{Decimals, significant};
use crate::paths::Paths;

/// Draws the drag of an axis of the named plant.
pub(super) fn chart(dof: Dof, plant: &str, curve: &DragCurve, ids: &mut Paths) -> Chart {
    let units = dof.units();
    let values = |pick: fn(&seaplant::Estimate) -> f64| {
        Values::pack(&curve.force.iter().map(pick).collect::<Vec<_>>())
    };
    let line = Line {
        interval: Some([values(|x| x.low95), values(|x| x.high95)]),
        ..Line::new("drag", Ink::Simulated, values(|x| x.value))
    };
    let said = |k: usize| {
        let (v, x) = (curve.speed[k], &curve.force[k]);
        let decimals = Decimals::of_std(x.value, x.std);
        format!(
            "{} {} at {} {} ({} to {})",
            decimals.write(x.value),
            units.force,
            significant(v, 2),
            units.velocity,
            decimals.write(x.low95),
            decimals.write(x.high95)
        )
    };
    let last = curve.speed.len() - 1;
    Chart {
        subject: Subject::Drag,
        id: ids.unique(&["drag", plant, dof.name()]),
        title: format!("Drag in {dof}"),
        description: format!(
            "Drag along this axis alone, up to the greatest speed of the trials, with 95 % intervals: {}, {}. The force may be well known where linear and quadratic drag are not told apart; beyond these speeds nothing is known of it.",
            said(last / 2),
            said(last)
        ),
        files: Vec::new(),
        plant: plant.to_owned(),
        stills: Vec::new(),
        x: Horizontal { label: "speed".to_owned(), unit: units.velocity, ..Horizontal::default() },
        panels: vec![Panel {
            label: format!("Drag, {}", units.force),
            height: 170,
            x: Values::pack(&curve.speed),
            lines: vec![line],
            ..Panel::default()
        }],
    }
}
