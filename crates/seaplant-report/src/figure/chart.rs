//! Panels, lines and keys common to all figures.

use std::convert::Infallible;

use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::Axis;
use super::font;
use super::ink::Ink;
use super::scene::{PER_PIXEL, Recorder, Scene};
use crate::Error;
use crate::decimate::{decimate, runs};

/// Number of points of one line: more than there are pixels across the page.
const MOST_POINTS: usize = 1500;

const TITLE_SIZE: i32 = 13;
const TEXT_SIZE: i32 = 12;
const TICK_SIZE: i32 = 11;

pub(crate) type Area<'a> = DrawingArea<Recorder<'a>, Shift>;
pub(crate) type Chart<'a, 'b> = ChartContext<'b, Recorder<'a>, Cartesian2d<Axis, Axis>>;

impl From<DrawingAreaErrorKind<Infallible>> for Error {
    fn from(cause: DrawingAreaErrorKind<Infallible>) -> Self {
        Self::Figure { cause: cause.to_string() }
    }
}

/// Converts pixels to scene units.
pub(crate) const fn px(pixels: i32) -> i32 {
    pixels * PER_PIXEL
}

fn text_style(size: i32, ink: Ink, bold: bool) -> TextStyle<'static> {
    let style = if bold { FontStyle::Bold } else { FontStyle::Normal };
    ("sans-serif", f64::from(px(size)), style).into_font().color(&ink.colour())
}

/// Labels of a panel.
pub(crate) struct Frame<'t> {
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    /// Absent if the panel below has the same axis.
    pub(crate) x_label: Option<&'t str>,
    pub(crate) y_label: &'t str,
}

/// Draws a scene by a closure.
pub(crate) fn drawn(
    (width, height): (u32, u32),
    title: String,
    description: String,
    draw: impl FnOnce(&Area<'_>, &str) -> Result<(), Error>,
) -> Result<Scene, Error> {
    let mut scene = Scene::new(width, height, title.clone(), description);
    draw(&Recorder(&mut scene).into_drawing_area(), &title)?;
    Ok(scene)
}

/// Writes a title and a key; returns the rest of the area for panels.
pub(crate) fn titled<'a>(
    area: &Area<'a>,
    title: &str,
    key: &[(Ink, &str)],
) -> Result<Area<'a>, Error> {
    let (head, rest) = area.split_vertically(px(if key.is_empty() { 26 } else { 46 }));
    let style = text_style(TITLE_SIZE, Ink::Text, true);
    head.draw(&plotters::element::Text::new(shortened(title), (px(10), px(8)), style))?;
    let mut x = px(10);
    let y = px(36);
    for (ink, label) in key {
        let sample: Vec<(i32, i32)> = vec![(x, y), (x + px(26), y)];
        match ink {
            Ink::Segment => {
                head.draw(&Rectangle::new([(x, y - px(5)), (x + px(26), y + px(5))], ink.fill()))?
            }
            Ink::Point => head.draw(&Circle::new((x + px(13), y), px(3), ink.stroke()))?,
            _ => head.draw(&PathElement::new(sample, ink.stroke()))?,
        }
        let style = text_style(TEXT_SIZE, Ink::Text, false).pos(Pos::new(HPos::Left, VPos::Center));
        head.draw(&plotters::element::Text::new((*label).to_owned(), (x + px(32), y), style))?;
        x += px(52) + (font::width(label, false) * f64::from(px(TEXT_SIZE))) as i32;
    }
    Ok(rest)
}

/// Shortens a title to fit its line.
fn shortened(title: &str) -> String {
    const LONGEST: usize = 76;
    if title.chars().count() <= LONGEST {
        return title.to_owned();
    }
    title.chars().take(LONGEST - 1).chain(['…']).collect()
}

/// Draws axes, ticks, grid and labels.
pub(crate) fn panel<'a, 'b>(area: &'b Area<'a>, frame: Frame<'_>) -> Result<Chart<'a, 'b>, Error> {
    let Frame { x, y, x_label, y_label } = frame;
    let (x_count, y_count) = (x.count(), y.count());
    let (x_axis, y_axis) = (x.clone(), y.clone());
    let below = if x_label.is_some() { 42 } else { 10 };
    let mut chart = ChartBuilder::on(area)
        .margin_left(px(10))
        .margin_right(px(16))
        .margin_top(px(6))
        .x_label_area_size(px(below))
        .y_label_area_size(px(62))
        .build_cartesian_2d(x, y)?;
    let show_x = x_label.is_some();
    let x_formatter = move |tick: &f64| if show_x { x_axis.label(*tick) } else { String::new() };
    let y_formatter = move |tick: &f64| y_axis.label(*tick);
    let mut mesh = chart.configure_mesh();
    mesh.x_labels(x_count)
        .y_labels(y_count)
        .x_label_formatter(&x_formatter)
        .y_label_formatter(&y_formatter)
        .x_max_light_lines(0)
        .y_max_light_lines(0)
        .bold_line_style(Ink::Grid.stroke())
        .light_line_style(TRANSPARENT)
        .axis_style(Ink::Frame.stroke())
        .label_style(text_style(TICK_SIZE, Ink::FaintText, false))
        .axis_desc_style(text_style(TEXT_SIZE, Ink::Text, false))
        .set_all_tick_mark_size(px(4))
        .y_desc(y_label);
    if let Some(x_label) = x_label {
        mesh.x_desc(x_label);
    }
    mesh.draw()?;
    Ok(chart)
}

/// Draws a series, decimated, with breaks at its gaps.
pub(crate) fn line(chart: &mut Chart<'_, '_>, ink: Ink, x: &[f64], y: &[f64]) -> Result<(), Error> {
    let runs = runs(x);
    let total: usize = runs.iter().map(std::ops::Range::len).sum();
    for run in runs {
        let share = (MOST_POINTS * run.len()).div_ceil(total.max(1)).max(8);
        let (Some(x), Some(y)) = (x.get(run.clone()), y.get(run)) else { continue };
        let points = decimate(x, y, share);
        chart.draw_series([PathElement::new(points, ink.stroke())])?;
    }
    Ok(())
}

/// Draws a straight line.
pub(crate) fn stroke(
    chart: &mut Chart<'_, '_>,
    ink: Ink,
    points: &[(f64, f64)],
) -> Result<(), Error> {
    chart.draw_series([PathElement::new(points.to_vec(), ink.stroke())])?;
    Ok(())
}

/// Writes text below and to the right of a point.
pub(crate) fn note(chart: &mut Chart<'_, '_>, at: (f64, f64), text: &str) -> Result<(), Error> {
    let style = text_style(TICK_SIZE, Ink::Text, false);
    let text = plotters::element::Text::new(text.to_owned(), (px(5), px(1)), style);
    chart.draw_series([EmptyElement::at(at) + text])?;
    Ok(())
}
