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

/// The page of a controller: what it is in lines, what to mind, then its charts.
///
/// # Errors
/// [`Error::Figure`].
///
/// ```
/// use seaplant_report::{control_page, is_control_page};
/// let page = control_page("BlueROV2", &["surge: 0.1 Hz".to_owned()], &[], &[])?;
/// assert!(is_control_page(&page));
/// # Ok::<(), seaplant_report::Error>(())
/// ```
pub fn control_page(
    name: &str,
    lines: &[String],
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
        "{MARK}\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{name}: controller</title>\n<style>body{{font-family:sans-serif;max-width:44rem;margin:1rem auto;padding:0 1rem}}figure{{margin:0 0 1rem}}\n{}</style></head>\n<body><h1>{name}: a controller</h1>\n<ul>\n{}</ul>\n{mind}{figures}</body></html>\n",
        style_sheet(),
        list(lines)
    );
    Ok(page.into_bytes())
}

/// What every such page begins with.
const MARK: &str = "<!DOCTYPE html><!-- seaplant control -->";

/// Whether a file begins as such a page.
pub fn is_control_page(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK.as_bytes())
}
