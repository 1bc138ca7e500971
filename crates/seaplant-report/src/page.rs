//! Writes the report: one HTML file without dependencies.

mod advice;
mod card;
mod doubts;
mod headline;
mod online_section;
mod paper_section;
mod plan_section;
mod plant_section;
mod provenance;
mod steering_section;
mod table;
mod verdict;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior, Value, escape_formatter};
use seaplant::Dof;
use seaplant::results::{PlantResult, Results};
use serde::Serialize;
use sha2::{Digest, Sha256};

pub(crate) use table::{Row, Table};

use crate::chart::{Chart, Sheet};
use crate::drawn::Drawn;
use crate::figure::{PlacedFigure, Subject, Thumbnails, style_sheet};
use crate::number::with_minus;
use crate::visible::{visible, visible_json};
use crate::{Error, words};

/// Templates by the names with which they include each other.
const TEMPLATES: [(&str, &str); 12] = [
    ("report.html", include_str!("../templates/report.html")),
    ("charts.html", include_str!("../templates/charts.html")),
    ("head.html", include_str!("../templates/head.html")),
    ("scripts.html", include_str!("../templates/scripts.html")),
    ("macros.html", include_str!("../templates/macros.html")),
    ("summary.html", include_str!("../templates/summary.html")),
    ("plant.html", include_str!("../templates/plant.html")),
    ("online.html", include_str!("../templates/online.html")),
    ("steering.html", include_str!("../templates/steering.html")),
    ("plan.html", include_str!("../templates/plan.html")),
    ("paper.html", include_str!("../templates/paper.html")),
    ("provenance.html", include_str!("../templates/provenance.html")),
];

/// The library of charts, then the scripts that use it.
const SCRIPTS: [&str; 2] =
    [include_str!("../vendor/uplot/uPlot.iife.min.js"), include_str!("../templates/report.js")];

/// Licence that accompanies every copy of the library.
const CHART_LICENCE: &str = include_str!("../vendor/uplot/LICENSE");

/// Style of the library's drawings.
const CHART_STYLE: &str = include_str!("../vendor/uplot/uPlot.min.css");

const STYLE: &str = include_str!("../templates/report.css");

/// A figure on the page.
#[derive(Serialize)]
struct FigureView {
    svg: String,
    caption: String,
    stem: String,
}

impl FigureView {
    fn new(figure: &PlacedFigure) -> Self {
        Self {
            svg: figure.inline.clone(),
            caption: figure.caption.clone(),
            stem: figure.stem.clone(),
        }
    }
}

/// Place of a chart on the page, which the script fills.
#[derive(Serialize)]
pub(crate) struct ChartView {
    pub(crate) id: String,
    pub(crate) title: String,
    pub(crate) description: String,
    pub(crate) files: Vec<(String, String)>,
    /// Replacement in print and without script, if the page does not show it anyway.
    pub(crate) stills: Vec<String>,
}

/// Content of every page: styles, scripts, and the data of its charts.
#[derive(Serialize)]
pub(crate) struct Assets {
    style: &'static str,
    figure_style: String,
    chart_style: &'static str,
    chart_licence: &'static str,
    scripts: Vec<&'static str>,
    /// Hashes of the scripts that the browser may run, and no others.
    script_hashes: Vec<String>,
    sheet: String,
}

impl Assets {
    /// Collects those of a page with these charts, and a script of its own if it has one.
    pub(crate) fn new(charts: &[impl Serialize], own: Option<&'static str>) -> Result<Self, Error> {
        let scripts: Vec<&str> = SCRIPTS.into_iter().chain(own).collect();
        let hash = |script: &&str| STANDARD.encode(Sha256::digest(script));
        Ok(Self {
            style: STYLE,
            figure_style: style_sheet(),
            chart_style: CHART_STYLE,
            chart_licence: CHART_LICENCE,
            script_hashes: scripts.iter().map(hash).collect(),
            scripts,
            // Within an element, only its end may begin with this.
            sheet: visible_json(&Sheet::new(charts))?.replace('<', "\\u003c"),
        })
    }
}

/// Charts of a report, and the static figures.
#[derive(Clone, Copy)]
pub(crate) struct Pictures<'a> {
    pub(crate) charts: &'a [Chart],
    pub(crate) placed: &'a [PlacedFigure],
    pub(crate) thumbnails: &'a Thumbnails,
    pub(crate) drawn: &'a Drawn,
}

impl Pictures<'_> {
    fn charts(&self, wanted: impl Fn(&Chart) -> bool) -> Vec<ChartView> {
        let of_stem = |stem: &String| {
            self.placed
                .iter()
                .find(|figure| figure.stem == *stem)
                .map(|figure| figure.inline.clone())
        };
        let view = |chart: &Chart| ChartView {
            id: chart.id.clone(),
            title: chart.title.clone(),
            description: chart.description.clone(),
            files: chart.files.clone(),
            stills: chart.stills.iter().filter_map(of_stem).collect(),
        };
        self.charts.iter().filter(|chart| wanted(chart)).map(view).collect()
    }

    fn figures(&self, wanted: impl Fn(&PlacedFigure) -> bool) -> Vec<FigureView> {
        self.placed.iter().filter(|figure| wanted(figure)).map(FigureView::new).collect()
    }
}

/// All values of the templates.
#[derive(Serialize)]
struct Page<'a> {
    assets: Assets,
    vehicle: &'a str,
    headline: Vec<headline::Finding>,
    line: String,
    failures: Vec<(String, &'a str)>,
    cards: Vec<card::Card>,
    has_truth: bool,
    doubts: doubts::Doubts,
    /// True if some axes were identified together.
    has_together: bool,
    plants: Vec<plant_section::PlantSection>,
    online: Vec<online_section::OnlinePlant>,
    steering: Option<steering_section::SteeringSection>,
    plan: Option<plan_section::PlanSection>,
    paper: paper_section::PaperSection,
    thrust: Vec<FigureView>,
    provenance: provenance::Provenance,
}

impl<'a> Page<'a> {
    fn new(results: &'a Results, pictures: Pictures<'_>) -> Result<Self, Error> {
        Ok(Self {
            assets: Assets::new(pictures.charts, None)?,
            vehicle: &results.vehicle,
            headline: headline::findings(results),
            line: provenance::line(results),
            failures: failures(results),
            cards: card::all(results, pictures.thumbnails),
            has_truth: results.truth.is_some(),
            doubts: doubts::of_campaign(results),
            has_together: results.together().next().is_some(),
            plants: plants(results)
                .map(|(name, plant)| plant_section::view(name, plant, results, pictures))
                .collect(),
            online: online_section::views(results),
            steering: steering_section::view(&results.steering),
            plan: results.plan.as_ref().map(plan_section::view),
            paper: paper_section::view(results, pictures),
            thrust: pictures.figures(|figure| figure.subject == Subject::Thrust),
            provenance: provenance::view(results),
        })
    }
}

/// Fills in the templates.
pub(crate) fn html(results: &Results, pictures: Pictures<'_>) -> Result<String, Error> {
    let page = Value::from(Serde(Page::new(results, pictures)?));
    Ok(environment()?.get_template("report.html")?.render(page)?)
}

pub(crate) fn environment() -> Result<Environment<'static>, Error> {
    let mut environment = Environment::new();
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.set_formatter(|out, state, value| match value.as_str() {
        Some(text) if !value.is_safe() => escape_formatter(out, state, &visible(text).into()),
        _ => escape_formatter(out, state, value),
    });
    environment.add_filter("math", math);
    environment.add_filter("prose", prose);
    for (name, source) in TEMPLATES {
        environment.add_template(name, source)?;
    }
    Ok(environment)
}

/// Returns the plants of several axes, then those of each axis alone, with their names.
fn plants(results: &Results) -> impl Iterator<Item = (&str, &PlantResult)> {
    let together = results.together().map(|(name, plant)| (name.as_str(), plant));
    together.chain(results.alone().map(|(dof, plant, _)| (dof.name(), plant)))
}

/// Returns the failures: where, and why.
fn failures(results: &Results) -> Vec<(String, &str)> {
    let place = |dof: Dof, methods: &str| format!("{}, {methods}", words::capitalised(dof.name()));
    let reasons = results.reasons().into_iter();
    reasons.map(|(dof, methods, why)| (place(dof, &methods), why)).collect()
}

/// Escapes a message and formats text between backticks as code.
fn prose(text: &str) -> Value {
    let escaped = minijinja::HtmlEscape(&with_minus(&visible(text))).to_string();
    let mut html = String::with_capacity(escaped.len());
    let parts: Vec<&str> = escaped.split('`').collect();
    for (k, part) in parts.iter().enumerate() {
        match k % 2 {
            1 if k + 1 < parts.len() => html.extend(["<code>", part, "</code>"]),
            1 => html.extend(["`", part]),
            _ => html.push_str(part),
        }
    }
    Value::from_safe_string(html)
}

/// Escapes text and formats subscripts of the paper's symbols.
fn math(text: &str) -> Value {
    let escaped = minijinja::HtmlEscape(&visible(text)).to_string();
    let symbols =
        escaped.replace("d_Q", "<i>d</i><sub>Q</sub>").replace("d_L", "<i>d</i><sub>L</sub>");
    Value::from_safe_string(symbols)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prose_sets_code_and_escapes() {
        let html = |text| prose(text).to_string();
        assert_eq!(html("give `a <b>` and c"), "give <code>a &lt;b&gt;</code> and c");
        assert_eq!(html("one ` alone"), "one ` alone");
        assert_eq!(html("turned\u{202e}"), "turned\\u{202e}");
    }

    #[test]
    fn math_lowers_subscripts_and_escapes() {
        assert_eq!(math("<d_Q>").to_string(), "&lt;<i>d</i><sub>Q</sub>&gt;");
    }
}
