//! The chart of intervals against minutes, and a page to print for the deck.

use std::fmt::Write as _;

use crate::plan::Plan;
use crate::spoken::spoken;
use crate::words::goal_rows;

/// What every such page begins with.
const MARK: &str = "<!DOCTYPE html><!-- seaplant plan -->";

/// Size of the chart, and of what is around its field, px.
const SIZE: (f64, f64) = (760.0, 360.0);
const LEFT: f64 = 64.0;
const RIGHT: f64 = 170.0;
const ABOVE: f64 = 16.0;
const BELOW: f64 = 46.0;

/// Colours that stay apart in print and for eyes that confuse red and green.
const COLOURS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#5c5c5c", "#7a3e9d"];

/// Half 95 % intervals of the goals, in per cent of their values, against minutes of driving, as SVG.
///
/// The vertical axis is logarithmic; a dot marks what is wanted, at the planned minutes.
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

/// A page without scripts or network to print for the deck: what to drive with boxes to tick, what
/// will be known, the chart, the limits, what to mend before the dive.
pub fn deck_page(plan: &Plan) -> String {
    let mut page = format!(
        "{MARK}\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Plan: {0}</title><style>
body{{font:15px/1.4 sans-serif;max-width:52rem;margin:1.5rem auto;padding:0 1rem;color:#111;background:#fff}}
table{{border-collapse:collapse;width:100%;margin:.6rem 0}}th,td{{text-align:left;padding:.25rem .5rem;border-bottom:1px solid #bbb;vertical-align:top}}
td.box{{width:1.2rem;font-size:1.3rem;line-height:1}}svg{{max-width:100%;height:auto}}.doubt{{border-left:4px solid #d55e00;padding-left:.6rem}}
@media print{{body{{margin:0;font-size:12px}}h2{{break-after:avoid}}tr,svg{{break-inside:avoid}}}}</style></head><body>
<h1>Plan: {0}</h1><p>{1} min of driving. {2}.</p>",
        escaped(&plan.vehicle),
        spoken(plan.minutes),
        escaped(&plan.prior)
    );
    for doubt in &plan.doubts {
        let _ = write!(
            page,
            "<p class=\"doubt\"><strong>Before the dive:</strong> {}.</p>",
            escaped(doubt)
        );
    }
    page.push_str("<h2>What to drive</h2><table><tr><th></th><th>no.</th><th>manoeuvre</th><th>file</th><th>time, remarks</th></tr>");
    for (k, planned) in plan.manoeuvres.iter().enumerate() {
        let _ = write!(
            page,
            "<tr><td class=\"box\">☐</td><td>{}</td><td>{}</td><td>{}</td><td></td></tr>",
            k + 1,
            escaped(&planned.words),
            escaped(&planned.manoeuvre.name)
        );
    }
    page.push_str("</table><h2>What will be known</h2><table><tr>");
    let (head, rows) = goal_rows(plan);
    for cell in head {
        let _ = write!(page, "<th>{cell}</th>");
    }
    page.push_str("</tr>");
    for row in rows {
        page.push_str("<tr>");
        for cell in row {
            let _ = write!(page, "<td>{}</td>", escaped(&cell));
        }
        page.push_str("</tr>");
    }
    let limits = &plan.request.limits;
    let _ = write!(
        page,
        "</table>{}<h2>Limits</h2><p>Depth {} to {} m, begin at {} m. Within {} m north and south and {} m east and west of the beginning{}. At most {} m/s, {} rad/s, {:.0}° of roll and pitch, {:.0} % of thrust. {} of {} simulated runs in disturbances broke a limit; at most {:.0} % of {} was used.</p>",
        chart_svg(plan),
        limits.depth_m[0],
        limits.depth_m[1],
        limits.start_depth_m,
        limits.box_m[0],
        limits.box_m[1],
        limits.tether_m.map_or(String::new(), |m| format!(", {m} m of tether")),
        limits.speed_m_s,
        limits.rate_rad_s,
        limits.tilt_rad.to_degrees(),
        100.0 * limits.thrust_part,
        plan.check.broken,
        plan.check.runs,
        100.0 * plan.check.greatest,
        escaped(&plan.check.of)
    );
    page.push_str("<h2>Notes</h2><ul>");
    for note in &plan.notes {
        let _ = write!(page, "<li>{}</li>", escaped(note));
    }
    page.push_str("</ul></body></html>\n");
    page
}
