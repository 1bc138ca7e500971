//! A controller as one page that opens in any browser without a network.

use crate::Error;
use crate::figure::{curves_scene, inline_svg, style_sheet};
use crate::words::escaped;

/// What is drawn of a controller: one or two lines over a common axis, with a band.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveChart {
    /// Above it.
    pub title: String,
    /// Below it, in words and numbers.
    pub caption: String,
    /// What runs to the right, with its unit; of frequencies by decades.
    pub x_label: String,
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
    fn html(&self) -> String {
        let cells = |cells: &[String], tag: &str| -> String {
            let cell = |text: &String| format!("<{tag}>{}</{tag}>", escaped(text));
            format!("<tr>{}</tr>\n", cells.iter().map(cell).collect::<String>())
        };
        let rows: String = self.rows.iter().map(|row| cells(row, "td")).collect();
        format!("<div class=\"wide\"><table>\n{}{rows}</table></div>\n", cells(&self.columns, "th"))
    }
}

/// The page of a controller: its numbers, what to mind, then its charts.
///
/// # Errors
/// [`Error::Figure`].
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
    let list = |lines: &[String]| -> String {
        lines.iter().map(|line| format!("<li>{}</li>\n", escaped(line))).collect()
    };
    let mut figures = String::new();
    for chart in charts {
        figures += &format!(
            "<figure>{}<figcaption>{}</figcaption></figure>\n",
            inline_svg(&curves_scene(chart)?),
            escaped(&chart.caption)
        );
    }
    let name = escaped(name);
    let mind = match notes {
        [] => String::new(),
        notes => format!("<h2>Mind</h2>\n<ul>\n{}</ul>\n", list(notes)),
    };
    let page = format!(
        "{MARK}\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>{name}: controller</title>\n<style>{STYLE}\n{}</style></head>\n<body><h1>{name}: a controller</h1>\n{}{mind}<div class=\"charts\">\n{figures}</div></body></html>\n",
        style_sheet(),
        table.html()
    );
    Ok(page.into_bytes())
}

/// Charts stand side by side where there is room, and a wide table scrolls by itself.
const STYLE: &str = "body{font-family:sans-serif;max-width:76rem;margin:1rem auto;padding:0 1rem}\
h1{font-size:1.5rem}h2{font-size:1.2rem}ul,h1{max-width:48rem}\
.wide{overflow-x:auto}table{border-collapse:collapse;font-size:.9rem}\
th,td{padding:.3rem .7rem;text-align:left;vertical-align:top;border-bottom:1px solid #ddd}\
td{white-space:nowrap}\
.charts{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,30rem),1fr));gap:1rem}\
figure{margin:0}figure svg{max-width:100%;height:auto}figcaption{font-size:.9rem}";

/// What every such page begins with.
const MARK: &str = "<!DOCTYPE html><!-- seaplant control -->";

/// Whether a file begins as such a page.
pub fn is_control_page(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK.as_bytes())
}
