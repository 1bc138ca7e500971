//! Inks: colour in light and dark mode, width and dashes.

use std::fmt::Write;

use plotters::style::{RGBAColor, ShapeStyle};

/// Meaning of a mark. Lines in one panel also differ in width or dashes, so that they are
/// distinguishable without colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ink {
    Text,
    FaintText,
    Frame,
    Grid,
    Measured,
    Simulated,
    Difference,
    Force,
    Velocity,
    Gain,
    PaperGain,
    Excited,
    Point,
    Forward,
    Reverse,
    Segment,
    Other1,
    Other2,
    Other3,
    Other4,
}

/// Look of an ink.
pub(crate) struct Look {
    /// Its CSS class.
    pub(crate) class: &'static str,
    pub(crate) light: [u8; 3],
    pub(crate) dark: [u8; 3],
    /// Width, px.
    pub(crate) width: f32,
    /// Dashes, px; empty for a solid line.
    pub(crate) dashes: &'static [f32],
}

const fn look(class: &'static str, light: u32, dark: u32, width: f32) -> Look {
    Look { class, light: bytes(light), dark: bytes(dark), width, dashes: &[] }
}

const fn bytes(rgb: u32) -> [u8; 3] {
    [(rgb >> 16) as u8, (rgb >> 8) as u8, rgb as u8]
}

/// Background colour of a figure, light and dark.
pub(crate) const PAPER: ([u8; 3], [u8; 3]) = (bytes(0xffffff), bytes(0x161c22));

impl Ink {
    pub(crate) const ALL: [Self; 20] = [
        Self::Text,
        Self::FaintText,
        Self::Frame,
        Self::Grid,
        Self::Measured,
        Self::Simulated,
        Self::Difference,
        Self::Force,
        Self::Velocity,
        Self::Gain,
        Self::PaperGain,
        Self::Excited,
        Self::Point,
        Self::Forward,
        Self::Reverse,
        Self::Segment,
        Self::Other1,
        Self::Other2,
        Self::Other3,
        Self::Other4,
    ];

    /// Returns the look. The colours are Okabe and Ito's, darker on white and lighter on black.
    pub(crate) const fn look(self) -> Look {
        match self {
            Self::Text => look("ft", 0x26323c, 0xdde4ea, 0.0),
            Self::FaintText => look("ff", 0x5d6b76, 0x9aa8b4, 0.0),
            Self::Frame => look("fa", 0x8a97a1, 0x66737e, 1.0),
            Self::Grid => look("fg", 0xe6eaed, 0x2a333b, 1.0),
            Self::Measured => look("fm", 0x7fb2dd, 0x4f86b5, 3.2),
            Self::Simulated => look("fs", 0xb23a00, 0xff9d5c, 1.3),
            Self::Difference => look("fd", 0x44525e, 0xb4c0ca, 1.1),
            Self::Force => look("fo", 0x0b6fae, 0x6db3e8, 2.0),
            Self::Velocity => Look { dashes: &[5.0, 2.5], ..look("fv", 0xb23a00, 0xff9d5c, 1.6) },
            Self::Gain => look("fn", 0x00795a, 0x35c79f, 1.2),
            Self::PaperGain => Look { dashes: &[2.0, 3.0], ..look("fp", 0x26323c, 0xdde4ea, 1.8) },
            Self::Excited => Look { dashes: &[1.0, 3.0], ..look("fe", 0x44525e, 0xb4c0ca, 1.2) },
            Self::Point => look("fi", 0x0b6fae, 0x6db3e8, 1.4),
            Self::Forward => look("fw", 0xb23a00, 0xff9d5c, 1.8),
            Self::Reverse => Look { dashes: &[6.0, 3.0], ..look("fr", 0xb23a00, 0xff9d5c, 1.8) },
            Self::Segment => look("fz", 0xfbe7b8, 0x4a4020, 0.0),
            Self::Other1 => Look { dashes: &[6.0, 3.0], ..look("o1", 0x00795a, 0x35c79f, 1.4) },
            Self::Other2 => Look { dashes: &[2.0, 2.0], ..look("o2", 0x8a3f77, 0xe094c8, 1.6) },
            Self::Other3 => {
                Look { dashes: &[8.0, 3.0, 2.0, 3.0], ..look("o3", 0x26323c, 0xdde4ea, 1.4) }
            }
            Self::Other4 => Look { dashes: &[12.0, 4.0], ..look("o4", 0x7a5200, 0xf0c061, 1.2) },
        }
    }

    /// Returns the ink as a colour for plotters, which has no inks of its own.
    pub(crate) const fn colour(self) -> RGBAColor {
        RGBAColor(self as u8, 0, 0, 1.0)
    }

    /// Returns the ink of a colour that [`Ink::colour`] returned.
    pub(crate) fn of_colour((red, _, _): (u8, u8, u8)) -> Self {
        Self::ALL.get(usize::from(red)).copied().unwrap_or(Self::Text)
    }

    pub(crate) const fn stroke(self) -> ShapeStyle {
        ShapeStyle { color: self.colour(), filled: false, stroke_width: 1 }
    }

    pub(crate) const fn fill(self) -> ShapeStyle {
        ShapeStyle { color: self.colour(), filled: true, stroke_width: 1 }
    }
}

/// Returns the style sheet of every figure, in tenths of a pixel.
pub(crate) fn style_sheet() -> String {
    let mut light = String::new();
    let mut dark = String::new();
    for ink in Ink::ALL {
        let Look { class, light: at_day, dark: at_night, width, dashes } = ink.look();
        let (paint, rest) = match ink {
            Ink::Text | Ink::FaintText | Ink::Segment => ("fill", String::new()),
            _ => ("stroke", format!(";stroke-width:{}{}", 10.0 * width, dash_array(dashes))),
        };
        _ = write!(light, ".{class}{{{paint}:{}{rest}}}", hex(at_day));
        _ = write!(dark, ".{class}{{{paint}:{}}}", hex(at_night));
    }
    format!(
        ".fig path,.fig circle{{fill:none;stroke-linejoin:round}}.fig text{{font-family:system-ui,-apple-system,\"Segoe UI\",Roboto,\"Noto Sans\",\"DejaVu Sans\",sans-serif;font-variant-numeric:tabular-nums}}.fig .b{{font-weight:600}}{light}@media screen and (prefers-color-scheme:dark){{{dark}}}"
    )
}

fn dash_array(dashes: &[f32]) -> String {
    if dashes.is_empty() {
        return String::new();
    }
    let lengths: Vec<String> = dashes.iter().map(|length| (10.0 * length).to_string()).collect();
    format!(";stroke-dasharray:{}", lengths.join(" "))
}

pub(crate) fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_ink_comes_back_from_its_colour() {
        for ink in Ink::ALL {
            let RGBAColor(red, green, blue, _) = ink.colour();
            assert_eq!(Ink::of_colour((red, green, blue)), ink);
        }
    }

    #[test]
    fn lines_of_one_panel_differ_without_colour() {
        let differ = |a: Ink, b: Ink| {
            let (a, b) = (a.look(), b.look());
            a.width != b.width || a.dashes != b.dashes
        };
        assert!(differ(Ink::Measured, Ink::Simulated) && differ(Ink::Forward, Ink::Reverse));
        let spectrum = [Ink::Force, Ink::Velocity, Ink::Gain, Ink::PaperGain, Ink::Excited];
        for (k, &a) in spectrum.iter().enumerate() {
            assert!(spectrum[k + 1..].iter().all(|&b| differ(a, b)), "{a:?}");
        }
    }
}
