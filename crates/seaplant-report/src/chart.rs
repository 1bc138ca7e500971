//! Charts with zoom, as data for the page's script.
//!
//! The script knows nothing of vehicles: a chart is a stack of panels with a common horizontal
//! axis, and a panel is lines, markers and bands with names and inks.

mod drag;
mod innovations;
mod intervals;
mod memory;
mod motion;
mod spectrum;
mod steady;
mod together;
mod values;

use std::collections::BTreeMap;

use seaplant::results::{Results, Series};
use seaplant::{Dof, Role};
use serde::Serialize;

use crate::figure::{Ink, hex};
use crate::paths::Paths;
use motion::Motions;
use together::Togethers;
pub(crate) use values::{Cut, Values};

/// Subject of a chart, which determines its place on the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subject {
    Motion(Role),
    /// Autocorrelation of the simulation's error.
    Memory,
    Spectrum,
    Steady,
    /// Parameters by method.
    Intervals,
    /// Drag over speed.
    Drag,
}

/// One chart.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Chart {
    #[serde(skip)]
    pub(crate) subject: Subject,
    /// Name of its plant.
    #[serde(skip)]
    pub(crate) plant: String,
    /// Unique on the page.
    pub(crate) id: String,
    pub(crate) title: String,
    /// Description in words and numbers.
    pub(crate) description: String,
    /// Files of the report with the same content: label and path.
    #[serde(skip)]
    pub(crate) files: Vec<(String, String)>,
    /// Figures of the same content, by file name, that are nowhere else on the page.
    #[serde(skip)]
    pub(crate) stills: Vec<String>,
    pub(crate) x: Horizontal,
    pub(crate) panels: Vec<Panel>,
}

/// Common axis of panels.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Horizontal {
    pub(crate) label: String,
    /// Unit such as "s"; empty if there is none.
    pub(crate) unit: &'static str,
    pub(crate) logarithmic: bool,
    /// Names of 0, 1, 2 …, for an axis of items.
    pub(crate) names: Vec<String>,
}

impl Horizontal {
    pub(crate) fn seconds(label: &str) -> Self {
        Self { label: label.to_owned(), unit: "s", ..Self::default() }
    }
}

/// A panel of superimposed lines.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Panel {
    pub(crate) label: String,
    /// Height, px.
    pub(crate) height: u16,
    pub(crate) x: Values,
    pub(crate) lines: Vec<Line>,
    /// Highlighted ranges of x.
    pub(crate) bands: Vec<[f64; 2]>,
    /// Highlighted values of x, each with a word.
    pub(crate) marks: Vec<(f64, String)>,
    /// Values of y with a thin horizontal line.
    pub(crate) levels: Vec<f64>,
}

/// One line, or points with intervals.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) ink: &'static str,
    pub(crate) y: Values,
    /// Ends of an interval at each point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) interval: Option<[Values; 2]>,
    /// True if it is initially visible.
    pub(crate) shown: bool,
}

impl Line {
    pub(crate) fn new(name: impl Into<String>, ink: Ink, y: Values) -> Self {
        let (name, ink) = (name.into(), ink.look().class);
        Self { name, ink, y, interval: None, shown: true }
    }

    pub(crate) fn shown_if(mut self, shown: bool) -> Self {
        self.shown = shown;
        self
    }
}

/// Charts of a report, from series that are processed one at a time.
#[derive(Default)]
pub(crate) struct Charts {
    motions: Motions,
    together: Togethers,
    others: Vec<Chart>,
    ids: Paths,
}

impl Charts {
    /// Adds the content of a series, which may then be dropped.
    ///
    /// `stem` is the name of its files, without folder and extension.
    pub(crate) fn add(&mut self, series: &Series, results: &Results, stem: &str) {
        match series {
            Series::Comparison(figure) => match &figure.plant {
                Some(plant) => self.together.add(plant, figure, stem),
                None => self.motions.add(figure, results, stem),
            },
            Series::Spectrum(figure) => {
                let id = self.ids.unique(&["spectrum", figure.dof.name(), &figure.trial]);
                self.others.push(spectrum::chart(figure, results, id, stem));
            }
            Series::Steady(figure) => {
                let id = self.ids.unique(&["steady", figure.dof.name(), &figure.trial]);
                self.others.push(steady::chart(figure, results, id, stem));
            }
        }
    }

    /// Returns all charts, including those of the parameters.
    pub(crate) fn all(self, results: &Results) -> Vec<Chart> {
        let Self { motions, together, others, mut ids } = self;
        let mut charts = motions.charts(&mut ids);
        charts.extend(together.charts(&mut ids));
        charts.extend(others);
        let driven = results.driven();
        let greatest = |dof: Dof| driven.get(&dof).map_or(0.0, |driven| driven.speed_max);
        for (name, plant) in &results.plants {
            for &dof in &plant.axes {
                let curve = plant.drag_to(dof, greatest(dof));
                charts.extend(curve.map(|curve| drag::chart(dof, name, &curve, &mut ids)));
                charts.extend(intervals::chart(dof, name, results, &mut ids));
            }
            charts.extend(innovations::chart(name, plant, &mut ids));
        }
        charts
    }
}

/// Data for the page's script.
#[derive(Serialize)]
pub(crate) struct Sheet<'a, T> {
    pub(crate) charts: &'a [T],
    pub(crate) inks: BTreeMap<&'static str, InkView>,
}

/// Look of a line in light and dark mode.
#[derive(Serialize)]
pub(crate) struct InkView {
    light: String,
    dark: String,
    width: f32,
    dashes: &'static [f32],
}

impl<'a, T: Serialize> Sheet<'a, T> {
    pub(crate) fn new(charts: &'a [T]) -> Self {
        let view = |ink: Ink| {
            let look = ink.look();
            let (light, dark) = (hex(look.light), hex(look.dark));
            (look.class, InkView { light, dark, width: look.width, dashes: look.dashes })
        };
        Self { charts, inks: Ink::ALL.into_iter().map(view).collect() }
    }
}
