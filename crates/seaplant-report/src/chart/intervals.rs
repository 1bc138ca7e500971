//! Chart of each parameter with its interval, by method.

use seaplant::results::{Parameter, Parameters, PlantResult, Results};
use seaplant::{Dof, Method};

use super::{Chart, Horizontal, Line, Panel, Subject, Values};
use crate::figure::Ink;
use crate::number::significant;
use crate::paths::Paths;
use crate::words;

/// Returns `None` if only one method was used: there is nothing to compare.
pub(super) fn chart(dof: Dof, plant: &str, results: &Results, ids: &mut Paths) -> Option<Chart> {
    let own = results.plants.get(plant)?;
    let (recommended, is_alone) = (own.method, own.is_alone());
    let mut methods: Vec<(&Method, &PlantResult)> = results.methods.get(plant)?.iter().collect();
    if methods.len() < 2 {
        return None;
    }
    methods.sort_by_key(|(method, _)| **method != recommended);
    let truth = results.truth_of(dof);
    type Pick = fn(&Parameters) -> Option<&Parameter>;
    let parameters: [(&str, Pick, Option<f64>); 4] = [
        (words::mass(dof), |p| Some(&p.mass), truth.map(|t| t.mass)),
        ("Quadratic drag", |p| p.quadratic_drag.as_ref(), truth.map(|t| t.quadratic_drag)),
        ("Linear drag", |p| p.linear_drag.as_ref(), truth.map(|t| t.linear_drag)),
        (words::bias_force(dof), |p| p.bias_force.as_ref(), truth.map(|t| t.bias_force)),
    ];
    let panels = parameters.into_iter().filter_map(|(name, pick, truth)| {
        let found: Vec<Option<&Parameter>> =
            methods.iter().map(|(_, plant)| pick(plant.by_axis.get(&dof)?)).collect();
        panel(name, &found, truth)
    });
    let names = methods.iter().map(|(method, _)| words::capitalised(&words::method(**method)));
    let of_truth = if truth.is_some() { " The thin line is the truth." } else { "" };
    Some(Chart {
        subject: Subject::Intervals,
        id: ids.unique(&["intervals", plant, dof.name()]),
        title: format!("Parameters of {dof} by method"),
        description: format!(
            "Estimates with 95 % intervals, the recommended method first.{of_truth} Intervals that do not overlap are methods that contradict each other: at least one of them understates its uncertainty."
        ),
        files: match is_alone {
            true => vec![("CSV".to_owned(), "tables/table-5.csv".to_owned())],
            false => Vec::new(),
        },
        plant: plant.to_owned(),
        stills: Vec::new(),
        x: Horizontal { names: names.collect(), ..Horizontal::default() },
        panels: panels.collect(),
    })
}

fn panel(name: &str, found: &[Option<&Parameter>], truth: Option<f64>) -> Option<Panel> {
    let unit = &found.iter().flatten().next()?.unit;
    let values = |pick: fn(&Parameter) -> f64| {
        Values::pack(&found.iter().map(|p| p.map_or(f64::NAN, pick)).collect::<Vec<_>>())
    };
    let line = Line {
        interval: Some([values(|p| p.low95), values(|p| p.high95)]),
        ..Line::new("estimate", Ink::Point, values(|p| p.value))
    };
    let truth = truth.filter(|truth| *truth != 0.0);
    let label =
        truth.map_or_else(String::new, |truth| format!(" (truth {})", significant(truth, 4)));
    Some(Panel {
        label: format!("{name}, {unit}{label}"),
        height: 150,
        x: Values::pack(&(0..found.len()).map(|k| k as f64).collect::<Vec<_>>()),
        lines: vec![line],
        levels: truth.into_iter().collect(),
        ..Panel::default()
    })
}
