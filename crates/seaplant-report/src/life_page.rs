//! Writes what each thruster gives from dive to dive as one page that opens in any browser without a network.

use std::collections::BTreeMap;

use seaplant::{Stated, ThrusterHistory};

use crate::Error;
use crate::chart::{Horizontal, Line, Panel, Values};
use crate::chart_page::{ChartPage, LiveChart};
use crate::control::CurveChart;
use crate::figure::{Ink, curves_scene, inline_svg};
use crate::number::{ABSENT, significant};
use crate::page::{Row, Table};

/// First bytes of every such page.
const MARK: &str = "<!DOCTYPE html><!-- seaplant life -->";

/// Height of the panel of a thruster, px.
const PANEL_PX: u16 = 120;

/// Writes the page of a vehicle's thrusters: what has changed, the gain of each in each dive, a chart.
///
/// # Errors
/// [`Error::Figure`], [`Error::Template`], [`Error::Json`].
///
/// ```
/// use std::collections::BTreeMap;
/// use seaplant_report::{is_life_page, life_page};
/// let page = life_page("BlueROV2", &["May".to_owned(), "June".to_owned()], &BTreeMap::new(), &[])?;
/// assert!(is_life_page(&page));
/// # Ok::<(), seaplant_report::Error>(())
/// ```
pub fn life_page(
    vehicle: &str,
    dives: &[String],
    thrusters: &BTreeMap<String, ThrusterHistory>,
    notes: &[String],
) -> Result<Vec<u8>, Error> {
    let changes = thrusters.values().flat_map(|own| &own.changes);
    let changes: Vec<String> = changes.map(|change| change.message.clone()).collect();
    let listed = dives.iter().enumerate().map(|(k, dive)| format!("[{}] {dive}", k + 1));
    let page = ChartPage {
        mark: MARK,
        kind: "Thrusters over dives",
        title: vehicle.to_owned(),
        lead: listed.collect(),
        table: table(dives, thrusters),
        notes: [&changes[..], notes].concat(),
        charts: vec![chart(dives, thrusters)?],
        ..ChartPage::default()
    };
    page.bytes()
}

/// Returns whether a file begins like such a page.
pub fn is_life_page(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK.as_bytes())
}

fn table(dives: &[String], thrusters: &BTreeMap<String, ThrusterHistory>) -> Table {
    let head = std::iter::once("thruster".to_owned());
    let head = head.chain((1..=dives.len()).map(|k| format!("[{k}]")));
    let cell = |gain: &Option<Stated>| match gain {
        Some(Stated { value, interval95: Some([low, high]), .. }) => {
            format!("{value:.3} [{low:.3}, {high:.3}]")
        }
        Some(gain) => significant(gain.value, 3),
        None => ABSENT.to_owned(),
    };
    let row = |(name, own): (&String, &ThrusterHistory)| {
        Row::new(std::iter::once(name.clone()).chain(own.gains.iter().map(cell)))
            .strong_if(!own.changes.is_empty())
    };
    Table::new("Thrust over that of the curve", head, thrusters.iter().map(row).collect()).noted(
        "With 95 % intervals, where most other thrusters give what their curves say; those with a change are bold.",
    )
}

fn chart(
    dives: &[String],
    thrusters: &BTreeMap<String, ThrusterHistory>,
) -> Result<LiveChart, Error> {
    let stills = thrusters.iter().map(|(name, own)| still(name, own));
    Ok(LiveChart {
        id: "life".to_owned(),
        title: "Thrust over that of the curve".to_owned(),
        x: Horizontal {
            names: (1..=dives.len()).map(|k| format!("[{k}]")).collect(),
            ..Horizontal::default()
        },
        panels: thrusters.iter().map(|(name, own)| panel(name, own)).collect(),
        description:
            "Estimates with 95 % intervals, a panel for each thruster. The thin line is the thrust of the curve."
                .to_owned(),
        stills: stills.collect::<Result<_, _>>()?,
    })
}

fn ends(gain: &Stated) -> [f64; 3] {
    let [low, high] = gain.interval95.unwrap_or([gain.value; 2]);
    [gain.value, low, high]
}

fn panel(name: &str, own: &ThrusterHistory) -> Panel {
    let values = |k: usize| {
        let of = |gain: &Option<Stated>| gain.as_ref().map_or(f64::NAN, |gain| ends(gain)[k]);
        Values::pack(&own.gains.iter().map(of).collect::<Vec<f64>>())
    };
    let line =
        Line { interval: Some([values(1), values(2)]), ..Line::new("gain", Ink::Point, values(0)) };
    Panel {
        label: name.to_owned(),
        height: PANEL_PX,
        x: Values::pack(&(0..own.gains.len()).map(|k| k as f64).collect::<Vec<f64>>()),
        lines: vec![line],
        levels: vec![1.0],
        marks: own.changes.iter().map(|change| (change.from as f64, String::new())).collect(),
        ..Panel::default()
    }
}

/// The same for print, of the dives that determine the gain.
fn still(name: &str, own: &ThrusterHistory) -> Result<String, Error> {
    let known = own.gains.iter().enumerate();
    let known: Vec<(f64, [f64; 3])> =
        known.filter_map(|(k, gain)| Some(((k + 1) as f64, ends(gain.as_ref()?)))).collect();
    let values = |k: usize| known.iter().map(|(_, ends)| ends[k]).collect::<Vec<f64>>();
    let scene = curves_scene(&CurveChart {
        title: name.to_owned(),
        caption: String::new(),
        x_label: "dive",
        x_unit: "",
        is_logarithmic: false,
        y_label: "thrust over that of the curve".to_owned(),
        x: known.iter().map(|(x, _)| *x).collect(),
        line: ("gain".to_owned(), values(0)),
        beside: None,
        band: Some([values(1), values(2)]),
    })?;
    Ok(inline_svg(&scene))
}
