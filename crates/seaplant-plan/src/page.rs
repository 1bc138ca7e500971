//! Draws the chart of intervals against minutes, and writes a page to print for the deck.

use std::fmt::Write as _;

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{Environment, UndefinedBehavior, Value};
use seaplant::spoken;
use serde::Serialize;

use crate::Error;
use crate::plan::Plan;
use crate::words::goal_rows;

/// Size of the chart and of its margins, px.
const SIZE: (f64, f64) = (760.0, 360.0);
const LEFT: f64 = 64.0;
const RIGHT: f64 = 170.0;
const ABOVE: f64 = 16.0;
const BELOW: f64 = 46.0;

/// Colours that are distinguishable in print and with red-green colour blindness.
const COLOURS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#5c5c5c", "#7a3e9d"];

/// Draws half 95 % intervals of the goals, in per cent of their values, against minutes of driving,
/// as SVG.
///
/// The vertical axis is logarithmic; a dot marks the goal at the planned minutes.
pub fn chart_svg(plan: &Plan) -> String {
    let (width, height) = SIZE;
    let all = || plan.chart.parts.values().flatten().copied().filter(|x| *x > 0.0);
    let low = all().fold(f64::INFINITY, f64::min);
    let high = all().fold(0.0, f64::max);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\" role=\"img\" aria-label=\"half 95 % intervals against minutes\">"
    );
    if !(low.is_finite() && high > 0.0) {
        svg.push_str("</svg>");
        return svg;
    }
    let (bottom, top) = (low.log10().floor(), high.log10().ceil().max(low.log10().floor() + 1.0));
    let last = plan.chart.minutes.last().copied().unwrap_or(1.0);
    let x = |minutes: f64| LEFT + (width - LEFT - RIGHT) * minutes / last;
    let y = |part: f64| {
        let place = (part.log10() - bottom) / (top - bottom);
        height - BELOW - (height - ABOVE - BELOW) * place.clamp(0.0, 1.0)
    };
    // Writing to a string cannot fail.
    for decade in bottom as i32..=top as i32 {
        let part = 10_f64.powi(decade);
        let _ = write!(
            svg,
            "<line x1=\"{LEFT}\" x2=\"{}\" y1=\"{1:.1}\" y2=\"{1:.1}\" stroke=\"#ccc\"/><text x=\"{2}\" y=\"{3:.1}\" text-anchor=\"end\">{4} %</text>",
            width - RIGHT,
            y(part),
            LEFT - 6.0,
            y(part) + 4.0,
            spoken(100.0 * part)
        );
    }
    for k in 0..=4 {
        let minutes = last * f64::from(k) / 4.0;
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            x(minutes),
            height - BELOW + 18.0,
            spoken(minutes)
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">minutes of driving</text><line x1=\"{2:.1}\" x2=\"{2:.1}\" y1=\"{ABOVE}\" y2=\"{3}\" stroke=\"#888\" stroke-dasharray=\"4 3\"/>",
        x(0.5 * last),
        height - 8.0,
        x(plan.minutes),
        height - BELOW
    );
    let goal = |name: &str| {
        let goal = plan.goals.iter().find(|goal| goal.name == name)?;
        Some(goal.goal? / goal.value.abs())
    };
    let mut ends: Vec<(f64, usize, &String)> = Vec::new();
    for (k, (name, parts)) in plan.chart.parts.iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        let points = plan.chart.minutes.iter().zip(parts);
        let line: Vec<String> =
            points.map(|(t, part)| format!("{:.1},{:.1}", x(*t), y(*part))).collect();
        let _ = write!(
            svg,
            "<polyline fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" points=\"{}\"/>",
            line.join(" ")
        );
        if let Some(part) = goal(name) {
            let _ = write!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"4\" fill=\"{colour}\"/>",
                x(plan.minutes),
                y(part)
            );
        }
        ends.push((parts.last().map_or(0.0, |part| y(*part)), k, name));
    }
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = ABOVE;
    for (at, k, name) in ends {
        let at = at.max(below + 14.0);
        below = at;
        let _ = write!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\" fill=\"{}\">{}</text>",
            width - RIGHT + 8.0,
            at + 4.0,
            COLOURS[k % COLOURS.len()],
            escaped(name)
        );
    }
    svg.push_str("</svg>");
    svg
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Values for the template of the deck page.
#[derive(Serialize)]
struct Deck<'a> {
    plan: &'a Plan,
    goal_head: [&'static str; 7],
    goal_rows: Vec<[String; 7]>,
    chart: String,
    tilt_deg: f64,
}

/// Returns a page without scripts or network to print for the deck: manoeuvres with boxes to tick,
/// predicted intervals, the chart, the limits, and doubts to resolve before the dive.
///
/// # Errors
/// [`Error::Page`] if the template cannot be filled in.
pub fn deck_page(plan: &Plan) -> Result<String, Error> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_filter("plain", |x: f64| format!("{}", (100.0 * x).round() / 100.0));
    environment.add_template("deck.html", include_str!("../templates/deck.html"))?;
    let (goal_head, goal_rows) = goal_rows(plan);
    let deck = Deck {
        plan,
        goal_head,
        goal_rows,
        chart: chart_svg(plan),
        tilt_deg: plan.request.limits.tilt_rad.to_degrees(),
    };
    Ok(environment.get_template("deck.html")?.render(Value::from(Serde(deck)))?)
}
