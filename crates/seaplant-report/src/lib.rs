//! Turns what an identification found into files: a report that opens in any browser
//! without a network, figures, tables, and the numbers as JSON and CSV.
//!
//! [`render`] hands them out one by one; where they are written is the caller's.

mod csv_files;
mod decimate;
mod error;
mod figure;
mod json;
pub mod number;
mod page;
mod paths;
mod verdict;
mod words;

#[cfg(test)]
mod fixture;
#[cfg(test)]
mod report_tests;

use std::io::{self, Write};

use seaplant::results::{BollardPullResult, ComparisonFigure, Results, Series};

pub use error::Error;
pub use figure::Figure;
pub use json::{parse_results, results_schema};
pub use verdict::{Trust, Verdict, verdict};

/// A file to write.
#[derive(Debug)]
pub struct Artifact<'a> {
    /// Where, relative to the output folder: lower-case ASCII, with `/` between folders.
    pub path: String,
    content: Content<'a>,
}

#[derive(Debug)]
enum Content<'a> {
    Bytes(Vec<u8>),
    /// A table that is too long to be made in memory.
    Series(&'a ComparisonFigure),
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
            Content::Series(figure) => csv_files::write_series(figure, out),
        }
    }
}

/// Makes every file of a report and gives each to `put`: `results.json`, `report.html`,
/// `figures/*.svg` and `*.png`, `series/*.csv`, `tables/*.csv`.
///
/// `series` are what is drawn, such as
/// [`Identification::series`](seaplant::results::Identification::series); no more than one
/// of them is held at a time. Paths are unique and safe on every system, whatever the trials
/// are called.
///
/// # Errors
/// [`Error::Json`], [`Error::Template`], [`Error::Figure`], [`Error::Png`] or
/// [`Error::Csv`], of which none is the fault of the results; those of `put`.
pub fn render<E: From<Error>>(
    results: &Results,
    series: impl IntoIterator<Item = Series>,
    mut put: impl FnMut(&Artifact<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let mut names = csv_files::Names::default();
    let mut album = figure::Album::default();
    for series in series {
        if let Series::Comparison(figure) = &series {
            put(&Artifact { path: names.of(figure), content: Content::Series(figure) })?;
        }
        album.draw(&series, results)?;
    }
    let plates = album.plates(results)?;
    put(&Artifact::of_bytes("results.json", json::bytes(results)?))?;
    put(&Artifact::of_bytes("report.html", page::html(results, &plates)?))?;
    for plate in plates {
        let stem = format!("figures/{}", plate.stem);
        put(&Artifact::of_bytes(format!("{stem}.svg"), plate.figure.svg))?;
        put(&Artifact::of_bytes(format!("{stem}.png"), plate.figure.png))?;
    }
    csv_files::tables(results)?.iter().try_for_each(put)
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
