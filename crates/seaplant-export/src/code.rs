//! Writes the equation of motion as code, in any language with products and moduli.

use seaplant::exchange::PlantModel;
use seaplant::plant::{Basis, NO_WAY, Product};
use seaplant::{Dof, ThrustCurve};

use crate::remarks::knows;

/// Syntax of a language.
pub(crate) struct Syntax {
    /// Returns an element of a vector, counted from 0: `nu`, 3 → `nu[3]`.
    pub(crate) element: fn(&str, usize) -> String,
    /// Returns the modulus of an expression.
    pub(crate) modulus: fn(&str) -> String,
    /// Returns the square root of an expression.
    pub(crate) root: fn(&str) -> String,
    /// Returns an element of a matrix, counted from 0.
    pub(crate) entry: fn(&str, usize, usize) -> String,
    /// Adds an expression to a variable.
    pub(crate) add: fn(&str, &str) -> String,
    /// Sets a variable to an expression.
    pub(crate) set: fn(&str, &str) -> String,
}

pub(crate) fn bracket(name: &str, k: usize) -> String {
    format!("{name}[{k}]")
}

/// Formats a number so that every language here reads the same value.
pub(crate) fn number(x: f64) -> String {
    format!("{x:?}")
}

/// Formats numbers separated by commas.
pub(crate) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(number).collect::<Vec<_>>().join(", ")
}

/// Formats lines of a block, each with an indent.
pub(crate) fn block(lines: &[String], indent: &str) -> String {
    lines.iter().map(|line| format!("{indent}{line}\n")).collect()
}

/// Returns the name of a coefficient in code: `yaw: |v|r` becomes `yaw_absv_r`.
pub(crate) fn identifier(name: &str) -> String {
    let mut text = String::new();
    let (mut is_open, mut is_apart) = (false, false);
    for c in name.chars() {
        match c {
            '|' if is_open => (is_open, is_apart) = (false, true),
            '|' => {
                is_open = true;
                if !text.ends_with('_') {
                    text.push('_');
                }
                text += "abs";
            }
            c if c.is_ascii_alphanumeric() => {
                if is_apart {
                    text.push('_');
                }
                is_apart = false;
                text.push(c.to_ascii_lowercase());
            }
            _ if text.is_empty() || text.ends_with('_') => {}
            _ => text.push('_'),
        }
    }
    let text = text.trim_end_matches('_').to_owned();
    if text.starts_with(|c: char| c.is_ascii_digit()) { format!("n{text}") } else { text }
}

/// Returns a unique identifier for each name.
pub(crate) fn identifiers<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut taken: Vec<String> = Vec::new();
    for name in names {
        let base = match identifier(name) {
            empty if empty.is_empty() => "unnamed".to_owned(),
            some => some,
        };
        let mut unique = base.clone();
        let mut k = 2;
        while taken.contains(&unique) {
            unique = format!("{base}_{k}");
            k += 1;
        }
        taken.push(unique);
    }
    taken
}

/// Returns the names of all coefficients, as in results.
pub(crate) fn names(model: &PlantModel) -> Vec<String> {
    model.plant.structure().names()
}

/// Returns the indices of the plant's axes.
pub(crate) fn axes(model: &PlantModel) -> Vec<usize> {
    model.plant.axes().iter().map(|dof| dof.index()).collect()
}

/// Returns ones at the plant's axes.
pub(crate) fn own(model: &PlantModel) -> [u8; 6] {
    Dof::ALL.map(|dof| u8::from(model.plant.axes().contains(&dof)))
}

impl Syntax {
    /// Returns M of all six axes from `theta`, set entry by entry.
    pub(crate) fn mass(&self, model: &PlantModel, target: &str) -> Vec<String> {
        let mut lines = Vec::new();
        for (k, term) in model.plant.structure().terms().iter().enumerate() {
            let Basis::Mass(i, j) = term else { continue };
            let theta = (self.element)("theta", k);
            lines.push((self.set)(&(self.entry)(target, i.index(), j.index()), &theta));
            if i != j {
                lines.push((self.set)(&(self.entry)(target, j.index(), i.index()), &theta));
            }
        }
        lines
    }

    fn product(&self, product: &Product) -> String {
        let factor = |factor: seaplant::plant::Factor| {
            let nu = (self.element)("nu", factor.of.index());
            if factor.modulus { (self.modulus)(&nu) } else { nu }
        };
        let factors = product.factors().map(factor);
        let power = usize::from(product.speed().unsigned_abs());
        let speeds = std::iter::repeat_with(|| self.speed(product.speed() < 0)).take(power);
        factors.chain(speeds).collect::<Vec<_>>().join(" * ")
    }

    /// Returns U, or the regularised 1/U.
    fn speed(&self, divides: bool) -> String {
        let nu = |k: usize| (self.element)("nu", k);
        let squares = (0..3).map(|k| format!("{0} * {0}", nu(k))).collect::<Vec<_>>().join(" + ");
        let speed = (self.root)(&squares);
        if divides { format!("({speed} / ({squares} + {}))", number(NO_WAY)) } else { speed }
    }

    /// Sets p, q and r in `nu` of rotations that the plant does not have to the rates that hold
    /// their angles, by `down`: [`seaplant::plant::Plant::with_held_angles`] in code.
    pub(crate) fn held(&self, model: &PlantModel) -> Vec<String> {
        let [roll, pitch, yaw] = [Dof::Roll, Dof::Pitch, Dof::Yaw].map(|dof| knows(model, dof));
        let nu = |k: usize| (self.element)("nu", k);
        let down = |k: usize| (self.element)("down", k);
        let (q, r) = (nu(4), nu(5));
        let (kx, ky, kz) = (down(0), down(1), down(2));
        let mut lines = Vec::new();
        let mut set = |k: usize, value: String| lines.push((self.set)(&nu(k), &value));
        match (pitch, yaw) {
            (true, true) if roll => {}
            (true, true) => {
                set(3, format!("{kx} * ({q} * {ky} + {r} * {kz}) / ({ky} * {ky} + {kz} * {kz})"));
            }
            (false, true) => {
                if !roll {
                    set(3, format!("{r} * {kx} / {kz}"));
                }
                set(4, format!("{r} * {ky} / {kz}"));
            }
            (true, false) => {
                if !roll {
                    set(3, number(0.0));
                }
                set(5, format!("-{q} * {ky} / {kz}"));
            }
            (false, false) => {
                if !roll {
                    set(3, number(0.0));
                }
                set(4, number(0.0));
                set(5, number(0.0));
            }
        }
        lines
    }

    /// Returns damping, restoring and constant forces of `theta`, `nu` and `down`, added to `n`.
    pub(crate) fn forces(&self, model: &PlantModel) -> Vec<String> {
        let mut lines = Vec::new();
        for (k, term) in model.plant.structure().terms().iter().enumerate() {
            let theta = (self.element)("theta", k);
            let n = |row: usize| (self.element)("n", row);
            let down = |row: usize| (self.element)("down", row);
            match *term {
                // Forces of effects are part of tau.
                Basis::Mass(..) | Basis::Effect(_) => {}
                Basis::Product(on, product) => {
                    let value = format!("{theta} * {}", self.product(&product));
                    lines.push((self.add)(&n(on.index()), &value));
                }
                Basis::One(on) => lines.push((self.add)(&n(on.index()), &theta)),
                Basis::WeightExcess => lines
                    .extend((0..3).map(|i| (self.add)(&n(i), &format!("-{theta} * {}", down(i))))),
                Basis::Lever(axis) => {
                    // −e × k: the rows of the next two axes in cyclic order.
                    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
                    let plus = format!("{theta} * {}", down(c));
                    let minus = format!("-{theta} * {}", down(b));
                    lines.push((self.add)(&n(3 + b), &plus));
                    lines.push((self.add)(&n(3 + c), &minus));
                }
            }
        }
        lines
    }
}

/// Describes the input of a thruster's curve, and its unit.
pub(crate) fn input_of(curve: &ThrustCurve) -> String {
    format!("{} [{}]", curve.input().name(), curve.input().unit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_have_names_that_languages_take() {
        let of = |name: &str| identifier(name);
        assert_eq!(of("mass.surge-pitch"), "mass_surge_pitch");
        assert_eq!(of("yaw: |v|r"), "yaw_absv_r");
        assert_eq!(of("surge: |u|u"), "surge_absu_u");
        assert_eq!(of("heave: 1"), "heave_1");
        assert_eq!(identifiers(["a b", "a-b", "Ä"]), ["a_b", "a_b_2", "unnamed"]);
    }

    #[test]
    fn numbers_come_back_the_same() {
        for x in [0.1 + 0.2, 1e-7, -12970.2, 1e21, 5e-324] {
            assert_eq!(number(x).parse::<f64>(), Ok(x));
        }
    }
}
