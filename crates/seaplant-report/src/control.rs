//! Writes a controller as one page that opens in any browser without a network.

use crate::Error;
use crate::chart_page::{ChartPage, LiveChart};
use crate::page::{Row, Table};

/// A chart of a controller: one or two lines over a common axis, with a band.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveChart {
    /// Title above it.
    pub title: String,
    /// Caption below it, in words and numbers.
    pub caption: String,
    /// Label of the horizontal axis.
    pub x_label: &'static str,
    /// Its unit.
    pub x_unit: &'static str,
    /// True for a logarithmic horizontal axis.
    pub is_logarithmic: bool,
    /// Label of the vertical axis, with its unit.
    pub y_label: String,
    /// Horizontal values.
    pub x: Vec<f64>,
    /// Name and values of the line.
    pub line: (String, Vec<f64>),
    /// Name and values of a second line.
    pub beside: Option<(String, Vec<f64>)>,
    /// The lower and upper end of a 95 % band.
    pub band: Option<[Vec<f64>; 2]>,
}

/// The numbers of a controller, a row for each axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControlTable {
    /// Headings of the columns; the first names the axis.
    pub columns: Vec<String>,
    /// Cells of each axis, with units; as many as there are columns.
    pub rows: Vec<Vec<String>>,
}

impl ControlTable {
    fn table(&self) -> Table {
        let rows = self.rows.iter().map(|row| Row::new(row.clone())).collect();
        Table::new("Gains and margins", self.columns.clone(), rows).left(self.columns.len())
    }
}

/// Writes the page of a controller: its numbers, warnings, then its charts.
///
/// # Errors
/// [`Error::Figure`], [`Error::Template`], [`Error::Json`].
///
/// ```
/// use seaplant_report::{ControlTable, control_page, is_control_page};
/// let table = ControlTable {
///     columns: ["axis", "bandwidth"].map(str::to_owned).into(),
///     rows: vec![["surge", "0.1 Hz"].map(str::to_owned).into()],
/// };
/// let page = control_page("BlueROV2", &table, &[], &[])?;
/// assert!(is_control_page(&page));
/// # Ok::<(), seaplant_report::Error>(())
/// ```
pub fn control_page(
    name: &str,
    table: &ControlTable,
    notes: &[String],
    charts: &[CurveChart],
) -> Result<Vec<u8>, Error> {
    let page = ChartPage {
        mark: MARK,
        kind: "Controller",
        title: name.to_owned(),
        table: table.table(),
        notes: notes.to_vec(),
        charts: LiveChart::of_curves(charts)?,
        ..ChartPage::default()
    };
    page.bytes()
}

/// First bytes of every such page.
const MARK: &str = "<!DOCTYPE html><!-- seaplant control -->";

/// Returns whether a file begins like such a page.
pub fn is_control_page(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK.as_bytes())
}
