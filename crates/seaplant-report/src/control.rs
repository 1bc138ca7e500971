//! A controller as one page that opens in any browser without a network.

use crate::Error;
use crate::chart_page::{ChartPage, LiveChart};
use crate::page::{Row, Table};

/// What is drawn of a controller: one or two lines over a common axis, with a band.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveChart {
    /// Above it.
    pub title: String,
    /// Below it, in words and numbers.
    pub caption: String,
    /// What runs to the right.
    pub x_label: &'static str,
    /// Its unit.
    pub x_unit: &'static str,
    /// Whether it runs by decades.
    pub is_logarithmic: bool,
    /// What runs upwards, with its unit.
    pub y_label: String,
    /// To the right.
    pub x: Vec<f64>,
    /// What the line is called, and where it goes.
    pub line: (String, Vec<f64>),
    /// A line beside it.
    pub beside: Option<(String, Vec<f64>)>,
    /// The lower and upper end of a 95 % band.
    pub band: Option<[Vec<f64>; 2]>,
}

/// The numbers of a controller, a row for each axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControlTable {
    /// What each column holds; the first names the axis.
    pub columns: Vec<String>,
    /// Of each axis, with units; as many as there are columns.
    pub rows: Vec<Vec<String>>,
}

impl ControlTable {
    fn table(&self) -> Table {
        let rows = self.rows.iter().map(|row| Row::new(row.clone())).collect();
        Table::new("Gains and margins", self.columns.clone(), rows).left(self.columns.len())
    }
}

/// The page of a controller: its numbers, what to mind, then its charts.
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

/// What every such page begins with.
const MARK: &str = "<!DOCTYPE html><!-- seaplant control -->";

/// Whether a file begins as such a page.
pub fn is_control_page(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK.as_bytes())
}
