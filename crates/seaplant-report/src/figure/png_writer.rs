//! Writes scenes as PNG in light mode, on white.

use png::{BitDepth, ColorType, Compression, Encoder, Filter};
use tiny_skia::{
    Color, FillRule, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, StrokeDash,
    Transform,
};
use ttf_parser::OutlineBuilder;

use super::font;
use super::ink::{Ink, PAPER};
use super::scene::{Anchor, Mark, PER_PIXEL, Scene, Text};
use crate::Error;

/// Image pixels per pixel of the page: sharp on dense screens and in documents.
const DENSITY: f32 = 2.0;

pub(crate) fn document(scene: &Scene) -> Result<Vec<u8>, Error> {
    let scale = DENSITY / PER_PIXEL as f32;
    let pixels = |units: u32| (units as f32 * scale).round() as u32;
    let mut pixmap = Pixmap::new(pixels(scene.width), pixels(scene.height)).ok_or_else(|| {
        Error::Figure { cause: format!("{} × {} units are too many", scene.width, scene.height) }
    })?;
    let ([red, green, blue], _) = PAPER;
    pixmap.fill(Color::from_rgba8(red, green, blue, 255));
    let transform = Transform::from_scale(scale, scale);
    for mark in &scene.marks {
        draw(&mut pixmap, mark, transform);
    }
    encode(&pixmap)
}

fn paint(ink: Ink) -> Paint<'static> {
    let [red, green, blue] = ink.look().light;
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(red, green, blue, 255);
    paint
}

fn stroke(ink: Ink) -> Stroke {
    let look = ink.look();
    let units = PER_PIXEL as f32;
    let dashes: Vec<f32> = look.dashes.iter().map(|length| length * units).collect();
    Stroke {
        width: look.width * units,
        line_join: LineJoin::Round,
        dash: StrokeDash::new(dashes, 0.0),
        ..Stroke::default()
    }
}

fn draw(pixmap: &mut Pixmap, mark: &Mark, transform: Transform) {
    match mark {
        Mark::Line { ink, points } => {
            let stroke = stroke(*ink);
            // Dashes continue from piece to piece only within a path.
            let most = if stroke.dash.is_some() { points.len() } else { PIECE };
            let mut rest = points.as_slice();
            loop {
                let (piece, is_last) = (&rest[..rest.len().min(most)], rest.len() <= most);
                if let Some(path) = polyline(piece) {
                    pixmap.stroke_path(&path, &paint(*ink), &stroke, transform, None);
                }
                if is_last {
                    return;
                }
                // The last segment is drawn twice, for its join with the next.
                rest = &rest[most - 2..];
            }
        }
        Mark::Area { ink, corner: (x, y), size: (width, height) } => {
            let area = Rect::from_xywh(*x as f32, *y as f32, *width as f32, *height as f32);
            if let Some(area) = area {
                pixmap.fill_rect(area, &paint(*ink), transform, None);
            }
        }
        Mark::Circle { ink, centre: (x, y), radius } => {
            let circle = PathBuilder::from_circle(*x as f32, *y as f32, *radius as f32);
            if let Some(circle) = circle {
                pixmap.stroke_path(&circle, &paint(*ink), &stroke(*ink), transform, None);
            }
        }
        Mark::Text(text) => {
            if let Some(outline) = outline(text) {
                let fill = FillRule::Winding;
                pixmap.fill_path(&outline, &paint(text.ink), fill, transform, None);
            }
        }
    }
}

/// Number of points of a stroke that are drawn at once: the time of a stroke grows with the square
/// of its overlapping part.
const PIECE: usize = 48;

fn polyline(points: &[(i32, i32)]) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (k, &(x, y)) in points.iter().enumerate() {
        if k == 0 {
            path.move_to(x as f32, y as f32);
        } else {
            path.line_to(x as f32, y as f32);
        }
    }
    path.finish()
}

/// Returns the outlines of a line of text in its position; `None` if nothing of it is visible.
fn outline(text: &Text) -> Option<Path> {
    let face = font::face(text.bold);
    let scale = text.size as f32 / f32::from(face.units_per_em());
    let width = (font::width(&text.text, text.bold) * text.size) as f32;
    let mut pen = Pen {
        path: PathBuilder::new(),
        scale,
        x: match text.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -0.5 * width,
            Anchor::End => -width,
        },
        y: text.baseline as f32,
    };
    for c in text.text.chars() {
        let glyph = face.glyph_index(c).unwrap_or_default();
        face.outline_glyph(glyph, &mut pen);
        pen.x += scale * f32::from(face.glyph_hor_advance(glyph).unwrap_or_default());
    }
    let turn = if text.upwards { -90.0 } else { 0.0 };
    let place = Transform::from_translate(text.at.0 as f32, text.at.1 as f32)
        .pre_concat(Transform::from_rotate(turn));
    pen.path.finish()?.transform(place)
}

/// Converts outlines from font units, y up, to the text's frame, y down.
struct Pen {
    path: PathBuilder,
    scale: f32,
    x: f32,
    y: f32,
}

impl Pen {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + self.scale * x, self.y - self.scale * y)
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

fn encode(pixmap: &Pixmap) -> Result<Vec<u8>, Error> {
    // Everything is on an opaque background, so premultiplied colours equal plain ones.
    let (pixels, _) = pixmap.data().as_chunks::<4>();
    let opaque: Vec<[u8; 3]> =
        pixels.iter().map(|[red, green, blue, _]| [*red, *green, *blue]).collect();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, pixmap.width(), pixmap.height());
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    // Most rows equal those above them.
    encoder.set_filter(Filter::Up);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(opaque.as_flattened())?;
    writer.finish()?;
    Ok(bytes)
}
