//! Pages of charts other than the report: with its style and script, without its sections.

use minijinja::Value;
use minijinja::value::Serde;
use serde::Serialize;

use crate::Error;
use crate::chart::{Horizontal, Line, Panel, Values};
use crate::control::CurveChart;
use crate::figure::{Ink, curves_scene, inline_svg};
use crate::page::{Assets, ChartView, Table, environment};

/// Content of a page, from top to bottom.
#[derive(Default)]
pub(crate) struct ChartPage {
    /// First line of the page, by which it is recognised.
    pub(crate) mark: &'static str,
    /// Kind of page.
    pub(crate) kind: &'static str,
    pub(crate) title: String,
    pub(crate) lead: Vec<String>,
    pub(crate) table: Table,
    pub(crate) notes: Vec<String>,
    pub(crate) charts: Vec<LiveChart>,
    /// Files of a log as a campaign names them, if ranges of the charts can be marked as trials.
    pub(crate) logs: Option<String>,
}

/// A chart for the page's script, with its replacement in print and without script.
#[derive(Serialize)]
pub(crate) struct LiveChart {
    pub(crate) id: String,
    pub(crate) title: String,
    pub(crate) x: Horizontal,
    pub(crate) panels: Vec<Panel>,
    #[serde(skip)]
    pub(crate) description: String,
    #[serde(skip)]
    pub(crate) stills: Vec<String>,
}

/// Adds a button for marking trials to the charts of a log.
const MARKS: &str = include_str!("../templates/marks.js");

/// Height of a panel that is a chart by itself, px.
const ALONE_PX: u16 = 220;

#[derive(Serialize)]
struct View<'a> {
    assets: Assets,
    mark: &'static str,
    kind: &'static str,
    title: &'a str,
    lead: &'a [String],
    table_of_page: &'a Table,
    notes: &'a [String],
    charts: Vec<ChartView>,
    logs: Option<&'a str>,
}

impl ChartPage {
    /// Fills in the template.
    pub(crate) fn bytes(&self) -> Result<Vec<u8>, Error> {
        let marks = self.logs.as_ref().map(|_| MARKS);
        let view = View {
            assets: Assets::new(&self.charts, marks)?,
            mark: self.mark,
            kind: self.kind,
            title: &self.title,
            lead: &self.lead,
            table_of_page: &self.table,
            notes: &self.notes,
            charts: self.charts.iter().map(LiveChart::view).collect(),
            logs: self.logs.as_deref(),
        };
        let page = Value::from(Serde(view));
        Ok(environment()?.get_template("charts.html")?.render(page)?.into_bytes())
    }
}

impl LiveChart {
    fn view(&self) -> ChartView {
        ChartView {
            id: self.id.clone(),
            title: self.title.clone(),
            description: self.description.clone(),
            files: Vec::new(),
            stills: self.stills.clone(),
        }
    }

    /// Creates a chart of one panel.
    pub(crate) fn of_curve(id: String, curve: &CurveChart) -> Result<Self, Error> {
        let line = |name: &str, ink, y: &[f64]| Line::new(name, ink, Values::pack(y));
        let mut lines = vec![line(&curve.line.0, Ink::Simulated, &curve.line.1)];
        lines.extend(curve.beside.iter().map(|(name, y)| line(name, Ink::Measured, y)));
        let band = curve.band.iter().flatten();
        let ends = ["95 % band, lower end", "95 % band, upper end"];
        lines.extend(band.zip(ends).map(|(y, name)| line(name, Ink::Difference, y)));
        let panel = Panel {
            label: curve.y_label.clone(),
            height: ALONE_PX,
            x: Values::of_times(&curve.x),
            lines,
            ..Panel::default()
        };
        Ok(Self {
            id,
            title: curve.title.clone(),
            x: Horizontal {
                label: curve.x_label.to_owned(),
                unit: curve.x_unit,
                logarithmic: curve.is_logarithmic,
                names: Vec::new(),
            },
            panels: vec![panel],
            description: curve.caption.clone(),
            stills: vec![inline_svg(&curves_scene(curve)?)],
        })
    }

    /// Creates a chart for each curve.
    pub(crate) fn of_curves(curves: &[CurveChart]) -> Result<Vec<Self>, Error> {
        let numbered = curves.iter().enumerate();
        numbered.map(|(k, curve)| Self::of_curve(format!("chart-{}", k + 1), curve)).collect()
    }
}
