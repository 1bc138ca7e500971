//! Elements of a figure, as plotters draws it.

use std::convert::Infallible;

use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontStyle, FontTransform,
};

use super::font;
use super::ink::Ink;

/// Scene units per pixel: plotters uses integers, for which pixels are too coarse.
pub(crate) const PER_PIXEL: i32 = 10;

/// A figure before it is written: marks in tenths of a pixel, y down.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) title: String,
    /// Description in words and numbers.
    pub(crate) description: String,
    pub(crate) marks: Vec<Mark>,
}

/// A drawn element.
#[derive(Clone, Debug)]
pub(crate) enum Mark {
    Line { ink: Ink, points: Vec<BackendCoord> },
    Area { ink: Ink, corner: BackendCoord, size: (i32, i32) },
    Circle { ink: Ink, centre: BackendCoord, radius: i32 },
    Text(Text),
}

/// A line of text.
#[derive(Clone, Debug)]
pub(crate) struct Text {
    pub(crate) text: String,
    pub(crate) ink: Ink,
    pub(crate) bold: bool,
    pub(crate) size: f64,
    /// Position of the text's start, middle or end, about which it is rotated.
    pub(crate) at: BackendCoord,
    pub(crate) anchor: Anchor,
    /// Distance from there to the baseline, downwards in the text's own frame.
    pub(crate) baseline: f64,
    /// True if it reads upwards.
    pub(crate) upwards: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Scene {
    /// Creates an empty scene of this size in pixels.
    pub(crate) fn new(width: u32, height: u32, title: String, description: String) -> Self {
        let per_pixel = PER_PIXEL.unsigned_abs();
        let (width, height) = (width * per_pixel, height * per_pixel);
        Self { width, height, title, description, marks: Vec::new() }
    }
}

/// A plotters backend that draws into a scene.
pub(crate) struct Recorder<'a>(pub(crate) &'a mut Scene);

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl Recorder<'_> {
    fn add(&mut self, colour: BackendColor, mark: impl FnOnce(Ink) -> Mark) -> Drawn {
        if colour.alpha > 0.0 {
            self.0.marks.push(mark(Ink::of_colour(colour.rgb)));
        }
        Ok(())
    }
}

impl DrawingBackend for Recorder<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.0.width, self.0.height)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, colour: BackendColor) -> Drawn {
        self.add(colour, |ink| Mark::Area { ink, corner: at, size: (1, 1) })
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let ((left, top), (right, bottom)) = (upper_left, bottom_right);
        if fill {
            let size = (right - left, bottom - top);
            return self.add(style.color(), |ink| Mark::Area { ink, corner: upper_left, size });
        }
        let round = [upper_left, (right, top), bottom_right, (left, bottom), upper_left];
        self.draw_path(round, style)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let mut points: Vec<BackendCoord> = path.into_iter().collect();
        points.dedup();
        self.add(style.color(), |ink| Mark::Line { ink, points })
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        centre: BackendCoord,
        radius: u32,
        style: &S,
        _fill: bool,
    ) -> Drawn {
        let radius = i32::try_from(radius).unwrap_or(i32::MAX);
        self.add(style.color(), |ink| Mark::Circle { ink, centre, radius })
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let size = style.size();
        let anchor = match style.anchor().h_pos {
            HPos::Left => Anchor::Start,
            HPos::Center => Anchor::Middle,
            HPos::Right => Anchor::End,
        };
        let baseline = size
            * match style.anchor().v_pos {
                VPos::Top => 0.78,
                VPos::Center => 0.36,
                VPos::Bottom => -0.22,
            };
        let bold = matches!(style.style(), FontStyle::Bold);
        let upwards = matches!(style.transform(), FontTransform::Rotate270);
        let text = text.to_owned();
        self.add(style.color(), |ink| {
            Mark::Text(Text { text, ink, bold, size, at, anchor, baseline, upwards })
        })
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let bold = matches!(style.style(), FontStyle::Bold);
        let width = (font::width(text, bold) * style.size()).ceil();
        Ok((width as u32, style.size().ceil() as u32))
    }
}
