//! Writes scenes as SVG.

use std::fmt::Write;

use plotters_backend::BackendCoord;

use super::ink::{Ink, PAPER, hex, style_sheet};
use super::scene::{Anchor, Mark, PER_PIXEL, Scene, Text};
use crate::visible::{is_obeyed, numbered};

/// Writes a complete document, with its own title, description and styles.
pub(crate) fn document(scene: &Scene) -> String {
    let Scene { width, height, .. } = *scene;
    let per_pixel = PER_PIXEL.unsigned_abs();
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"fig\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {width} {height}\" role=\"img\">",
        width / per_pixel,
        height / per_pixel,
    );
    let (light, dark) = PAPER;
    _ = write!(
        svg,
        "<title>{}</title><desc>{}</desc><style>.paper{{fill:{}}}@media screen and (prefers-color-scheme:dark){{.paper{{fill:{}}}}}{}</style><rect class=\"paper\" width=\"{width}\" height=\"{height}\"/>",
        escape(&scene.title),
        escape(&scene.description),
        hex(light),
        hex(dark),
        style_sheet(),
    );
    write_marks(&mut svg, scene);
    svg.push_str("</svg>\n");
    svg
}

/// Writes SVG for a page that contains the styles, and the description as a caption.
pub(crate) fn inline(scene: &Scene) -> String {
    let Scene { width, height, .. } = *scene;
    let mut svg = format!(
        "<svg class=\"fig\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title}\"><title>{title}</title>",
        title = escape(&scene.title),
    );
    write_marks(&mut svg, scene);
    svg.push_str("</svg>");
    svg
}

fn write_marks(svg: &mut String, scene: &Scene) {
    for mark in &scene.marks {
        // Writing to a String cannot fail.
        _ = match mark {
            Mark::Line { ink, points } => write_line(svg, *ink, points),
            Mark::Area { ink, corner: (x, y), size: (width, height) } => {
                let class = ink.look().class;
                write!(
                    svg,
                    "<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>"
                )
            }
            Mark::Circle { ink, centre: (x, y), radius } => {
                let class = ink.look().class;
                write!(svg, "<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"/>")
            }
            Mark::Text(text) => write_text(svg, text),
        };
    }
}

/// Writes a line in relative steps, which take a third of the size of absolute points.
fn write_line(svg: &mut String, ink: Ink, points: &[BackendCoord]) -> std::fmt::Result {
    let Some(&(mut x, mut y)) = points.first() else { return Ok(()) };
    write!(svg, "<path class=\"{}\" d=\"M{x} {y}l", ink.look().class)?;
    if points.len() == 1 {
        svg.push_str("0 0");
    }
    for &(to_x, to_y) in &points[1..] {
        let (dx, dy) = (to_x - x, to_y - y);
        if dx >= 0 && !svg.ends_with('l') {
            svg.push(' ');
        }
        write!(svg, "{dx}")?;
        if dy >= 0 {
            svg.push(' ');
        }
        write!(svg, "{dy}")?;
        (x, y) = (to_x, to_y);
    }
    svg.push_str("\"/>");
    Ok(())
}

fn write_text(svg: &mut String, text: &Text) -> std::fmt::Result {
    let class = text.ink.look().class;
    let bold = if text.bold { " b" } else { "" };
    let anchor = match text.anchor {
        Anchor::Start => "",
        Anchor::Middle => " text-anchor=\"middle\"",
        Anchor::End => " text-anchor=\"end\"",
    };
    let (x, y) = text.at;
    let baseline = text.baseline.round() as i32;
    write!(svg, "<text class=\"{class}{bold}\" font-size=\"{}\"{anchor}", text.size)?;
    if text.upwards {
        write!(svg, " transform=\"translate({} {y})rotate(-90)\"", x + baseline)?;
    } else {
        write!(svg, " x=\"{x}\" y=\"{}\"", y + baseline)?;
    }
    write!(svg, ">{}</text>", escape(&text.text))
}

/// Escapes text for XML, which allows no control characters in any form: blanks among them become a
/// space; others, and changes of the direction of writing, are shown by their number.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            c if c.is_control() && c.is_whitespace() => escaped.push(' '),
            c if is_obeyed(c) => escaped += &numbered(c),
            c => escaped.push(c),
        }
    }
    escaped
}
