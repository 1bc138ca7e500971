//! Converts the results of an identification to files: a report that opens in any browser without a
//! network, figures, tables, and the numbers as JSON and CSV.
//!
//! [`render`] yields them one by one; the caller decides where they are written.

mod chart;
mod chart_page;
mod control;
mod csv_files;
mod decimate;
mod drawn;
mod error;
mod figure;
mod json;
mod life_page;
mod log_page;
pub mod number;
mod page;
mod paths;
mod prediction;
mod visible;
mod words;

#[cfg(test)]
mod fixture;
#[cfg(test)]
mod report_tests;

use std::io::{self, Write};

use seaplant::results::{BollardPullResult, Results, Series};
use seaplant::{Comparison, Dof, PositionComparison};

pub use control::{ControlTable, CurveChart, control_page, is_control_page};
pub use error::Error;
pub use figure::Figure;
pub use json::{parse_results, results_schema};
pub use life_page::{is_life_page, life_page};
pub use log_page::{Track, is_log_page, log_page};
pub use prediction::{is_prediction_page, prediction_page};
pub use visible::is_obeyed;

/// A file to write.
#[derive(Debug)]
pub struct Artifact<'a> {
    /// Path relative to the output folder: lower-case ASCII, with `/` between folders.
    pub path: String,
    content: Content<'a>,
}

#[derive(Debug)]
enum Content<'a> {
    Bytes(Vec<u8>),
    /// Tables that are too long to hold in memory.
    Motion(&'a Comparison),
    Position(&'a PositionComparison, Dof),
}

impl Artifact<'_> {
    fn of_bytes(path: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { path: path.into(), content: Content::Bytes(bytes.into()) }
    }

    /// Writes the content.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_to(&self, mut out: impl Write) -> io::Result<()> {
        match &self.content {
            Content::Bytes(bytes) => out.write_all(bytes),
            Content::Motion(motion) => csv_files::write_motion(motion, out),
            Content::Position(position, dof) => csv_files::write_position(position, *dof, out),
        }
    }
}

/// Makes every file of a report and gives each to `put`: `results.json`, `report.html`,
/// `figures/*.svg`, `*.png` of recommended methods, `series/*.csv`, `tables/*.csv`.
///
/// `series` are the series to draw, such as
/// [`Identification::series`](seaplant::results::Identification::series); at most one of them is
/// held at a time. Paths are unique and safe on every system, whatever the names of the trials.
///
/// # Errors
/// [`Error::Json`], [`Error::Template`], [`Error::Figure`], [`Error::Png`] or
/// [`Error::Csv`], of which none is the fault of the results; those of `put`.
pub fn render<E: From<Error>>(
    results: &Results,
    series: impl IntoIterator<Item = Series>,
    mut put: impl FnMut(&Artifact<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let mut stems = paths::Paths::default();
    let mut figures = figure::FigureSet::default();
    let mut charts = chart::Charts::default();
    let mut thumbnails = figure::Thumbnails::default();
    let drawn = drawn::Drawn::select(results);
    for series in series {
        let stem = stem(&series, &mut stems);
        if let Series::Comparison(figure) = &series {
            let comparison = &figure.comparison;
            let path = format!("series/{stem}.csv");
            put(&Artifact { path, content: Content::Motion(comparison) })?;
            if let Some(position) = &comparison.position {
                let path = format!("series/{stem}.position.csv");
                let content = Content::Position(position, comparison.dof);
                put(&Artifact { path, content })?;
            }
        }
        if drawn.has(&series) {
            figures.draw(&series, results, &stem)?;
            charts.add(&series, results, &stem);
        }
        thumbnails.add(&series, results);
    }
    let placed = figures.placed(results)?;
    put(&Artifact::of_bytes("results.json", json::bytes(results)?))?;
    let charts = charts.all(results);
    put(&Artifact::of_bytes(
        "report.html",
        page::html(
            results,
            page::Pictures {
                charts: &charts,
                placed: &placed,
                thumbnails: &thumbnails,
                drawn: &drawn,
            },
        )?,
    ))?;
    drop(charts);
    for drawn in placed {
        let stem = format!("figures/{}", drawn.stem);
        put(&Artifact::of_bytes(format!("{stem}.svg"), drawn.svg))?;
        if let Some(png) = drawn.png {
            put(&Artifact::of_bytes(format!("{stem}.png"), png))?;
        }
    }
    csv_files::tables(results)?.iter().try_for_each(put)
}

/// Returns the stem of a series' files, without folder and extension.
fn stem(series: &Series, taken: &mut paths::Paths) -> String {
    match series {
        Series::Comparison(figure) => {
            let Comparison { dof, trial, .. } = &figure.comparison;
            let of = figure.plant.as_deref().unwrap_or(figure.method.name());
            taken.unique(&[trial, dof.name(), of])
        }
        Series::Spectrum(figure) => taken.unique(&[&figure.trial, figure.dof.name(), "spectrum"]),
        Series::Steady(figure) => taken.unique(&[&figure.trial, figure.dof.name(), "steady"]),
    }
}

/// Draws thrust against the square of the input, with the fitted lines.
///
/// # Errors
/// [`Error::Figure`] or [`Error::Png`].
///
/// # Source
/// [Jason2, fig. 2].
pub fn thrust_figure(bollard_pull: &BollardPullResult) -> Result<Figure, Error> {
    figure::thrust(bollard_pull)?.paint()
}
