//! Terms in the field's notation: `yaw: |v|r`.

use std::fmt;
use std::str::FromStr;

use super::{Basis, Factor, Product};
use crate::{Dof, Error};

const LETTERS: [char; 6] = ['u', 'v', 'w', 'p', 'q', 'r'];

impl fmt::Display for Product {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (0..self.speed()).try_for_each(|_| write!(f, "U"))?;
        for factor in self.factors() {
            let letter = LETTERS[factor.of.index()];
            if factor.modulus { write!(f, "|{letter}|") } else { write!(f, "{letter}") }?;
        }
        if self.speed() < 0 {
            write!(f, "/")?;
        }
        (self.speed()..0).try_for_each(|_| write!(f, "U"))
    }
}

impl fmt::Display for Basis {
    /// Formats the name of a coefficient in results: `mass.surge`, `mass.surge-pitch`, `yaw: |v|r`,
    /// `weight-minus-buoyancy`, `lever.z`, `sway: 1`; for an effect its index, whose name is that
    /// of [`super::Structure::name_of`].
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mass(i, j) if i == j => write!(f, "mass.{i}"),
            Self::Mass(i, j) => write!(f, "mass.{i}-{j}"),
            Self::Product(on, product) => write!(f, "{on}: {product}"),
            Self::WeightExcess => write!(f, "weight-minus-buoyancy"),
            Self::Lever(axis) => write!(f, "lever.{}", ['x', 'y', 'z'][*axis]),
            Self::One(on) => write!(f, "{on}: 1"),
            Self::Effect(k) => write!(f, "effect {}", k + 1),
        }
    }
}

impl FromStr for Basis {
    type Err = Error;

    /// Parses `AXIS: PRODUCT`, the product being one to four of u v w p q r, each between bars or
    /// not, with U or UU before or /U or /UU behind, or 1.
    ///
    /// ```
    /// use seaplant::plant::Basis;
    /// let term: Basis = "yaw: v|r|".parse()?;
    /// assert_eq!(term.to_string(), "yaw: |r|v");
    /// assert_eq!("sway: rvv/U".parse::<Basis>()?.to_string(), "sway: vvr/U");
    /// let error = "yaw: v|x|".parse::<Basis>().unwrap_err().to_string();
    /// assert!(error.contains("at character 8"), "{error}");
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    fn from_str(text: &str) -> Result<Self, Error> {
        let refuse = |at: usize, reason: String| Error::PlantTerm {
            text: text.to_owned(),
            at: text[..at].chars().count() + 1,
            reason,
        };
        let Some(colon) = text.find(':') else {
            return Err(refuse(0, "names no axis; write it as \"yaw: |v|r\"".to_owned()));
        };
        let on: Dof = text[..colon].trim().parse().map_err(|_| {
            let found = text[..colon].trim();
            refuse(0, format!("has no axis `{found}`; use surge, sway, heave, roll, pitch or yaw"))
        })?;
        if text[colon + 1..].trim() == "1" {
            return Ok(Self::One(on));
        }
        let (mut factors, mut speed, mut divides) = (Vec::new(), 0_i8, false);
        let mut rest =
            text[colon + 1..].char_indices().map(|(at, c)| (colon + 1 + at, c)).peekable();
        while let Some((at, c)) = rest.next() {
            let factor = match c {
                ' ' | '*' | '·' => continue,
                '/' if !divides => {
                    divides = true;
                    continue;
                }
                'U' if speed.abs() < Product::MOST_SPEED && (divides || speed >= 0) => {
                    speed += if divides { -1 } else { 1 };
                    continue;
                }
                c if divides || c == 'U' => {
                    let reason = "divides by what is not U, or has U more than twice; write it as \"vvr/U\" or \"Uv\"";
                    return Err(refuse(at, reason.to_owned()));
                }
                '|' => {
                    let of = rest.next().ok_or_else(|| refuse(at, OPEN.to_owned()))?;
                    let of = letter(of.1).ok_or_else(|| refuse(of.0, unknown(of.1)))?;
                    if rest.next().is_none_or(|(_, c)| c != '|') {
                        return Err(refuse(at, OPEN.to_owned()));
                    }
                    Factor { of, modulus: true }
                }
                c => {
                    let of = letter(c).ok_or_else(|| refuse(at, unknown(c)))?;
                    Factor { of, modulus: false }
                }
            };
            if factors.len() == Product::MOST {
                let most = Product::MOST;
                return Err(refuse(
                    at,
                    format!("has more than {most} velocities; use at most {most}"),
                ));
            }
            factors.push(factor);
        }
        let product = Product::new(&factors).ok_or_else(|| {
            refuse(colon + 1, "has no velocity; write one to four of u v w p q r".to_owned())
        })?;
        let product = product.by_speed(speed).ok_or_else(|| {
            refuse(colon + 1, "has a greater power of U than 2; write U or UU".to_owned())
        })?;
        Ok(Self::Product(on, product))
    }
}

const OPEN: &str = "opens a bar that is not closed after one letter; write |r|";

fn letter(c: char) -> Option<Dof> {
    let index = LETTERS.iter().position(|known| *known == c)?;
    Some(Dof::ALL[index])
}

fn unknown(c: char) -> String {
    format!("has no velocity `{c}`; use u v w p q r, between bars for a modulus")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        text.parse::<Basis>().expect_err("wrong").to_string()
    }

    #[test]
    fn parsing_inverts_formatting() {
        let with_speed = ["sway: Uv", "yaw: vvr/U", "surge: vvvv/UU", "sway: UUr"];
        let plain = ["yaw: |v|r", "sway: ur", "heave: 1", "surge: |u|u", "yaw: vvv", "pitch: q"];
        for text in plain.into_iter().chain(with_speed) {
            let term: Basis = text.parse().expect("a term");
            assert_eq!(term.to_string(), text);
        }
        let spaced: Basis = "yaw:v |r|".parse().expect("a term");
        assert_eq!(spaced.to_string(), "yaw: |r|v");
    }

    #[test]
    fn an_invalid_term_reports_its_position() {
        assert!(error("yaw v").contains("names no axis"), "{}", error("yaw v"));
        assert!(error("yar: v").contains("at character 1"), "{}", error("yar: v"));
        assert!(error("yaw: x").contains("at character 6"), "{}", error("yaw: x"));
        assert!(error("yaw: v|r").contains("at character 7"), "{}", error("yaw: v|r"));
        assert!(error("yaw: uvwpq").contains("at character 10"), "{}", error("yaw: uvwpq"));
        assert!(error("yaw: v/r").contains("divides"), "{}", error("yaw: v/r"));
        assert!(error("yaw: UUUv").contains("at character 8"), "{}", error("yaw: UUUv"));
        assert!(error("yaw:").contains("no velocity"), "{}", error("yaw:"));
    }
}
