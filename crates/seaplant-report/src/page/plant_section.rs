//! Section of one plant, of one axis or of several.

mod coefficients;
mod reasons;
mod scores;

use seaplant::results::{Parameter, PlantResult, Results};
use seaplant::{Caveat, Dof, Method, Role};
use serde::Serialize;

use super::card::stability;
use super::doubts::{Doubts, collected};
use super::table::Table;
use super::verdict::VerdictView;
use super::{ChartView, Pictures};
use crate::chart::Subject;
use crate::number::{ABSENT, Rounded};
use crate::words;

#[derive(Serialize)]
pub(crate) struct PlantSection {
    name: String,
    title: String,
    #[serde(flatten)]
    verdict: VerdictView,
    lead: String,
    /// True if figures of its motion are printed with the paper's tables.
    has_figures: bool,
    parameters: Vec<Table>,
    intervals: Vec<ChartView>,
    drag: Vec<ChartView>,
    motions: Vec<Motions>,
    scores: Vec<Table>,
    matrices: Vec<Table>,
    memory: Vec<ChartView>,
    spectra: Vec<ChartView>,
    details: Vec<Table>,
    /// Doubts about the plants of other methods.
    doubts: Doubts,
}

/// Trials of one role.
#[derive(Serialize)]
struct Motions {
    title: &'static str,
    role: &'static str,
    /// Note on which of the trials are drawn, if not all are.
    note: Option<String>,
    charts: Vec<ChartView>,
}

/// The plants of the same axes by each method: the recommended one, the paper's, then the rest.
struct Methods<'a>(Vec<(Method, &'a PlantResult)>);

pub(crate) fn view(
    name: &str,
    plant: &PlantResult,
    results: &Results,
    pictures: Pictures<'_>,
) -> PlantSection {
    let methods = Methods::of(name, plant, results);
    let charts = |subject| pictures.charts(|chart| chart.subject == subject && chart.plant == name);
    PlantSection {
        name: name.to_owned(),
        title: words::capitalised(&axes(plant)),
        verdict: VerdictView::of(&plant.verdict),
        lead: lead(plant),
        has_figures: plant.is_alone(),
        parameters: coefficients::by_axis(plant, &methods),
        intervals: charts(Subject::Intervals),
        drag: charts(Subject::Drag),
        motions: motions(
            |role| charts(Subject::Motion(role)),
            |role| pictures.drawn.note(name, role),
        ),
        scores: scores::tables(plant),
        matrices: coefficients::tables(plant),
        memory: charts(Subject::Memory),
        spectra: charts(Subject::Spectrum),
        details: reasons::tables(plant, &methods, results),
        doubts: methods.other_doubts(),
    }
}

impl<'a> Methods<'a> {
    fn of(name: &str, plant: &'a PlantResult, results: &'a Results) -> Self {
        let all = results.methods.get(name).into_iter().flatten();
        let others = all.filter(|(method, _)| **method != plant.method);
        let mut methods = vec![(plant.method, plant)];
        methods.extend(others.map(|(method, plant)| (*method, plant)));
        methods[1..].sort_by_key(|(method, _)| *method != Method::Paper);
        Self(methods)
    }

    /// Returns the name of each method with its plant, and whether it is the recommended one of several.
    fn iter(&self) -> impl Iterator<Item = (String, &'a PlantResult, bool)> {
        let recommended = (self.0.len() > 1).then(|| self.0[0].0);
        self.0.iter().map(move |(method, plant)| {
            (words::capitalised(&words::method(*method)), *plant, Some(*method) == recommended)
        })
    }

    /// Returns the other methods' doubts that the first screen lacks.
    fn other_doubts(&self) -> Doubts {
        let (_, recommended) = self.0[0];
        let mut found: Vec<(String, &Caveat)> = Vec::new();
        for (method, plant, _) in self.iter().skip(1) {
            let new = plant.caveats.iter().filter(|caveat| !recommended.caveats.contains(caveat));
            found.extend(new.map(|caveat| (method.clone(), caveat)));
        }
        collected(found)
    }
}

/// Formats `surge, sway, yaw`.
pub(super) fn axes(plant: &PlantResult) -> String {
    let names: Vec<&str> = plant.axes.iter().map(|dof| dof.name()).collect();
    names.join(", ")
}

fn lead(plant: &PlantResult) -> String {
    let method = words::method(plant.method);
    let mut lead = match &plant.alone {
        Some(alone) => {
            let terms = words::terms(&alone.terms);
            let stability = stability(plant.first_axis(), &alone.stability);
            format!("By {method}, with the terms {terms}. The model is {stability}.")
        }
        None => format!("By {method}, symmetry: {}.", plant.symmetry),
    };
    if let Some(told) = &plant.identifiability {
        let (rank, all) = (told.rank, told.coefficients);
        lead += &format!(" The motion determines {rank} of its {all} coefficients.");
    }
    lead + " Velocities are relative to the water; forces that damp are positive."
}

/// Returns the translations of a plant, or its rotations, which have other units.
fn axes_of_kind(plant: &PlantResult, is_rotation: bool) -> Vec<Dof> {
    plant.axes.iter().copied().filter(|dof| dof.is_rotation() == is_rotation).collect()
}

/// Adds the kind of axes to a caption where a plant has both translations and rotations.
fn of_kind(caption: &str, plant: &PlantResult, is_rotation: bool) -> String {
    let has_both = plant.axes.iter().any(|dof| dof.is_rotation() != is_rotation);
    match (has_both, is_rotation) {
        (false, _) => caption.to_owned(),
        (true, true) => format!("{caption}; rotations"),
        (true, false) => format!("{caption}; translations"),
    }
}

/// Returns the charts of each role that has some, the fitted trials first.
fn motions(
    of: impl Fn(Role) -> Vec<ChartView>,
    note: impl Fn(Role) -> Option<String>,
) -> Vec<Motions> {
    let titles = [
        (Role::Fit, "Fitted trials", "fitted"),
        (Role::HoldOut, "Held-out trials", "held-out"),
        (Role::Steady, "Steady trials", "steady"),
    ];
    let of_role =
        |(role, title, class)| Motions { title, role: class, note: note(role), charts: of(role) };
    titles.map(of_role).into_iter().filter(|group| !group.charts.is_empty()).collect()
}

/// Formats `12 970 ± 250 [12 460, 13 480]`.
pub(super) fn with_interval(parameter: Option<&Parameter>) -> String {
    parameter.map_or_else(
        || ABSENT.to_owned(),
        |parameter| {
            let Rounded { value, std, low95, high95 } = Rounded::of(parameter);
            format!("{value} ± {std} [{low95}, {high95}]")
        },
    )
}
