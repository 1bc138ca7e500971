//! Font of the PNG files, and the text widths for the layout of every figure.

use std::sync::LazyLock;

use ttf_parser::Face;

/// DejaVu Sans is wider than the fonts that browsers choose, so that text that fits in it also fits
/// in theirs.
static REGULAR: LazyLock<Face<'static>> = LazyLock::new(|| parse(dejavu::sans::regular()));
static BOLD: LazyLock<Face<'static>> = LazyLock::new(|| parse(dejavu::sans::bold()));

fn parse(bytes: &'static [u8]) -> Face<'static> {
    Face::parse(bytes, 0).expect("the font is part of this crate's sources, and a test reads it")
}

pub(crate) fn face(bold: bool) -> &'static Face<'static> {
    if bold { &BOLD } else { &REGULAR }
}

/// Returns the width of a line of text in units of its size.
pub(crate) fn width(text: &str, bold: bool) -> f64 {
    let face = face(bold);
    let advance = |c: char| {
        let glyph = face.glyph_index(c).unwrap_or_default();
        f64::from(face.glyph_hor_advance(glyph).unwrap_or_default())
    };
    text.chars().map(advance).sum::<f64>() / f64::from(face.units_per_em())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_faces_are_fonts_with_the_signs_of_this_field() {
        for bold in [false, true] {
            for sign in "aZ09−²ωτα·–≈ṽ".chars() {
                assert!(face(bold).glyph_index(sign).is_some(), "{sign}");
            }
            assert!((4.0..9.0).contains(&width("measured", bold)));
        }
    }
}
