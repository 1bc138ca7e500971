//! Turns what an identification found into files: a report that opens in any browser
//! without a network, figures, tables, and the numbers as JSON and CSV.
//!
//! [`render`] makes all of them in memory; writing them is the caller's.

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

use seaplant::results::{BollardPullResult, Identification};

pub use error::Error;
pub use figure::Figure;
pub use json::{parse_results, results_schema};
pub use verdict::{Trust, Verdict, verdict};

/// A file to write.
#[derive(Clone, Debug, PartialEq)]
pub struct Artifact {
    /// Where, relative to the output folder: lower-case ASCII, with `/` between folders.
    pub path: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Makes every file of a report: `results.json`, `report.html`, `figures/*.svg` and
/// `*.png`, `series/*.csv`, `tables/*.csv`.
///
/// Paths are unique and safe on every system, whatever the trials are called.
///
/// # Errors
/// [`Error::Json`], [`Error::Template`], [`Error::Figure`], [`Error::Png`] or
/// [`Error::Csv`], of which none is the fault of the results.
pub fn render(identification: &Identification) -> Result<Vec<Artifact>, Error> {
    let Identification { results, figures } = identification;
    let plates = figure::plates(results, figures)?;
    let mut artifacts = vec![
        Artifact { path: "results.json".to_owned(), bytes: json::bytes(results)? },
        Artifact { path: "report.html".to_owned(), bytes: page::html(results, &plates)?.into() },
    ];
    for plate in plates {
        let stem = format!("figures/{}", plate.stem);
        artifacts.push(Artifact { path: format!("{stem}.svg"), bytes: plate.figure.svg });
        artifacts.push(Artifact { path: format!("{stem}.png"), bytes: plate.figure.png });
    }
    artifacts.extend(csv_files::tables(results)?);
    artifacts.extend(csv_files::series(figures)?);
    Ok(artifacts)
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
