//! The regressors of the equation of motion.

use nalgebra::{Matrix6, Vector3, Vector6};

use crate::Dof;

/// Motion at an instant, as the argument of regressors; body frame, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// ν̇_r, relative to the water; m/s² and rad/s².
    pub acceleration: Vector6<f64>,
    /// ν_r, relative to the water; m/s and rad/s.
    pub velocity: Vector6<f64>,
    /// k = Rᵀ e₃: the world's down in body axes, a unit vector.
    pub down_body: Vector3<f64>,
}

/// A velocity that a term multiplies, or its modulus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Factor {
    /// The axis.
    pub of: Dof,
    /// True if it is |ν|.
    pub modulus: bool,
}

/// A product of one to four velocities, such as `|u|u` or `ur`, times a power of the speed U
/// through the water, such as `Uv` or `vvr/U`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Product {
    factors: [Option<Factor>; Self::MOST],
    speed: i8,
}

impl Product {
    /// The greatest degree that a term may have.
    pub const MOST: usize = 4;

    /// The greatest power of U, positive or negative.
    pub const MOST_SPEED: i8 = 2;

    /// Creates a product of velocities; `None` unless there are one to four factors.
    pub fn new(factors: &[Factor]) -> Option<Self> {
        if factors.is_empty() || factors.len() > Self::MOST {
            return None;
        }
        let mut sorted = factors.to_vec();
        // |v|r and r|v| are one term.
        sorted.sort_by_key(|factor| (!factor.modulus, factor.of));
        let mut all = [None; Self::MOST];
        for (place, factor) in all.iter_mut().zip(sorted) {
            *place = Some(factor);
        }
        Some(Self { factors: all, speed: 0 })
    }

    /// Multiplies by a power of `U = √(u² + v² + w²)`; `None` for one beyond ±2.
    ///
    /// A product divided by U tends to zero with speed: below 0.01 m/s, `1/U` is replaced by
    /// `U/(U² + (0.01 m/s)²)`.
    ///
    /// # Source
    /// [Yasukawa2015, eq. (9)]: hull forces by v' = v/U and r' = rL/U.
    pub fn by_speed(self, power: i8) -> Option<Self> {
        (power.abs() <= Self::MOST_SPEED).then_some(Self { speed: power, ..self })
    }

    /// Returns the power of U.
    pub const fn speed(&self) -> i8 {
        self.speed
    }

    /// Returns the product `ν`.
    pub const fn linear(of: Dof) -> Self {
        Self { factors: [Some(Factor { of, modulus: false }), None, None, None], speed: 0 }
    }

    /// Returns the product `|ν| ν`.
    pub const fn quadratic(of: Dof) -> Self {
        let modulus = Some(Factor { of, modulus: true });
        Self { factors: [modulus, Some(Factor { of, modulus: false }), None, None], speed: 0 }
    }

    /// Returns the factors, moduli first.
    pub fn factors(&self) -> impl Iterator<Item = Factor> + '_ {
        self.factors.iter().flatten().copied()
    }

    /// Returns the product at a velocity.
    pub fn value(&self, velocity: &Vector6<f64>) -> f64 {
        let product = match self.factors {
            // Nearly all products have one or two factors.
            [Some(one), None, ..] => one.value(velocity),
            [Some(one), Some(other), None, ..] => one.value(velocity) * other.value(velocity),
            _ => self.factors().map(|factor| factor.value(velocity)).product(),
        };
        if self.speed == 0 { product } else { product * self.power_of_speed(velocity) }
    }

    /// Returns the power of U; out of line, since its root and division are hoisted out of loops over products
    /// otherwise, most of which have none.
    #[inline(never)]
    fn power_of_speed(&self, velocity: &Vector6<f64>) -> f64 {
        Speed::new(velocity).power(self.speed).0
    }

    /// Returns the product with its last non-modulus factor evaluated at another velocity.
    fn value_with_last(&self, velocity: &Vector6<f64>, reference: &Vector6<f64>) -> f64 {
        // Moduli come first.
        let last = self.factors().filter(|factor| !factor.modulus).count();
        let moduli = self.factors().count() - last;
        let at = |(k, factor): (usize, Factor)| match k + 1 == moduli + last && last > 0 {
            true => factor.value(reference),
            false => factor.value(velocity),
        };
        let product: f64 = self.factors().enumerate().map(at).product();
        if self.speed == 0 { product } else { product * self.power_of_speed(velocity) }
    }

    /// Adds `weight · ∂product/∂ν` to a row.
    pub fn add_slope(&self, velocity: &Vector6<f64>, weight: f64, row: &mut [f64; 6]) {
        let mut weight = weight;
        if self.speed != 0 {
            let speed = Speed::new(velocity);
            let (scale, slope) = speed.power(self.speed);
            let product: f64 = self.factors().map(|factor| factor.value(velocity)).product();
            for (x, along) in row.iter_mut().zip(speed.slope) {
                *x += weight * product * slope * along;
            }
            weight *= scale;
        }
        for (k, factor) in self.factors().enumerate() {
            let others = self.factors().enumerate().filter(|(j, _)| *j != k);
            let others: f64 = others.map(|(_, other)| other.value(velocity)).product();
            let index = factor.of.index();
            let slope = if factor.modulus { sign(velocity[index]) } else { 1.0 };
            row[index] += weight * slope * others;
        }
    }
}

/// Speed through the water.
struct Speed {
    /// U, m/s.
    value: f64,
    /// ∂U/∂(u, v, w).
    slope: [f64; 3],
}

/// The square of a speed below which a hull's drift angle is undefined, (m/s)².
pub const NO_WAY: f64 = 1e-4;

impl Speed {
    fn new(velocity: &Vector6<f64>) -> Self {
        let along = [velocity[0], velocity[1], velocity[2]];
        let value = along.iter().map(|x| x * x).sum::<f64>().sqrt();
        Self { value, slope: along.map(|x| if value > 0.0 { x / value } else { 0.0 }) }
    }

    /// Returns a power of U and its derivative by U.
    fn power(&self, power: i8) -> (f64, f64) {
        let n = i32::from(power.abs());
        let (base, slope) = if power > 0 {
            (self.value, 1.0)
        } else {
            let square = self.value * self.value;
            let sum = square + NO_WAY;
            (self.value / sum, (NO_WAY - square) / (sum * sum))
        };
        (base.powi(n), f64::from(n) * base.powi(n - 1) * slope)
    }
}

/// Returns −1, 0 or 1.
pub(crate) fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

impl Factor {
    fn value(self, velocity: &Vector6<f64>) -> f64 {
        let x = velocity[self.of.index()];
        if self.modulus { x.abs() } else { x }
    }
}

/// The regressor of one coefficient in
/// `M ν̇_r + C(M, ν_r) ν_r + D(ν_r) ν_r + … + g(η) = τ`: one to six rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Basis {
    /// An entry of the symmetric M, with its Coriolis force.
    Mass(Dof, Dof),
    /// Damping, or another product of velocities, on one axis.
    Product(Dof, Product),
    /// Weight minus buoyancy: `−k` on the translations.
    WeightExcess,
    /// A component of `W r_G − B r_B`: `−r × k` on the rotations.
    Lever(usize),
    /// A constant force on one axis.
    One(Dof),
    /// The structure's effect of this index: `−` its wrench, from
    /// [`super::Structure::regressor`].
    Effect(usize),
}

impl Basis {
    /// Returns the regressor `Y_k(ν̇, ν, η)`: the contribution of a unit coefficient to the left
    /// side of the equation of motion, on all six axes.
    ///
    /// # Source
    /// [Fossen2021, ch. 6]; C from M by Kirchhoff's equations.
    pub fn regressor(&self, at: &Instant) -> Vector6<f64> {
        let Instant { acceleration, velocity, down_body } = at;
        match *self {
            Self::Mass(i, j) => {
                let (i, j) = (i.index(), j.index());
                let mut y = kirchhoff(&times_unit(i, j, velocity), velocity);
                y += times_unit(i, j, acceleration);
                y
            }
            Self::Product(on, product) => on_axis(on, product.value(velocity)),
            Self::WeightExcess => {
                Vector6::new(-down_body.x, -down_body.y, -down_body.z, 0.0, 0.0, 0.0)
            }
            Self::Lever(axis) => {
                let mut lever = Vector3::zeros();
                lever[axis] = 1.0;
                let moment = -lever.cross(down_body);
                Vector6::new(0.0, 0.0, 0.0, moment.x, moment.y, moment.z)
            }
            Self::One(on) => on_axis(on, 1.0),
            Self::Effect(_) => Vector6::zeros(),
        }
    }

    /// Returns the part of the regressor due to acceleration; zero except for M.
    pub(crate) fn inertial(&self, acceleration: &Vector6<f64>) -> Vector6<f64> {
        match *self {
            Self::Mass(i, j) => times_unit(i.index(), j.index(), acceleration),
            _ => Vector6::zeros(),
        }
    }

    /// Returns the regressor of a reference motion: `Y_k` of `M ν̇_s + C(M, ν) ν_s + D(ν) ν_s +
    /// g(η)`.
    ///
    /// `at.acceleration` is ν̇_s, `reference` is ν_s; in a product of velocities the last factor
    /// without a modulus is that of the reference. With ν_s = ν this is [`Self::regressor`].
    ///
    /// # Source
    /// \[Slotine1987\]; in six axes [Fossen2021, ch. 16].
    ///
    /// # Example
    /// ```
    /// use nalgebra::{Vector3, Vector6};
    /// use seaplant::plant::{Basis, Instant};
    /// let drag: Basis = "surge: |u|u".parse()?;
    /// let (acceleration, velocity) = (Vector6::zeros(), Vector6::x() * 2.0);
    /// let at = Instant { acceleration, velocity, down_body: Vector3::z() };
    /// assert_eq!(drag.reference_regressor(&at, &Vector6::x())[0], 2.0);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn reference_regressor(&self, at: &Instant, reference: &Vector6<f64>) -> Vector6<f64> {
        match *self {
            Self::Mass(i, j) => {
                let momentum = times_unit(i.index(), j.index(), &at.velocity);
                kirchhoff(&momentum, reference) + self.inertial(&at.acceleration)
            }
            Self::Product(on, product) => {
                on_axis(on, product.value_with_last(&at.velocity, reference))
            }
            _ => self.regressor(at),
        }
    }

    /// Returns the axes on which it can act; see [`super::Structure::axes_of`] for an effect.
    pub fn axes(&self) -> Vec<Dof> {
        match *self {
            Self::Mass(i, j) if i == j => vec![i],
            Self::Mass(i, j) => vec![i, j],
            Self::Product(on, _) | Self::One(on) => vec![on],
            Self::WeightExcess => vec![Dof::Surge, Dof::Sway, Dof::Heave],
            Self::Lever(_) => vec![Dof::Roll, Dof::Pitch, Dof::Yaw],
            Self::Effect(_) => Vec::new(),
        }
    }

    /// Returns the unit of its coefficient; see [`super::Structure::unit_of`] for an effect.
    pub fn unit(&self) -> String {
        let force = |on: Dof| on.units().force;
        match self {
            Self::Mass(i, j) => {
                match usize::from(i.is_rotation()) + usize::from(j.is_rotation()) {
                    0 => "kg",
                    1 => "kg m",
                    _ => "kg m²",
                }
            }
            .to_owned(),
            Self::Product(on, product) => format!("{}/{}", force(*on), velocity_unit(product)),
            Self::WeightExcess => "N".to_owned(),
            Self::Lever(_) => "N m".to_owned(),
            Self::One(on) => force(*on).to_owned(),
            Self::Effect(_) => "1".to_owned(),
        }
    }
}

/// Formats the unit of a product of velocities: `(m/s)²`, `(m/s)(rad/s)`, ….
fn velocity_unit(product: &Product) -> String {
    let rotations = product.factors().filter(|factor| factor.of.is_rotation()).count();
    let translations = product.factors().count() as i32 - rotations as i32;
    let translations = translations + i32::from(product.speed());
    let power = |unit: &str, n: i32| match n {
        0 => String::new(),
        1 => format!("({unit})"),
        2 => format!("({unit})²"),
        3 => format!("({unit})³"),
        4 => format!("({unit})⁴"),
        -1 => format!("({unit})⁻¹"),
        _ => format!("({unit})⁻²"),
    };
    let text = power("m/s", translations) + &power("rad/s", rotations as i32);
    if translations != 0 && rotations > 0 { format!("({text})") } else { text }
}

fn on_axis(on: Dof, value: f64) -> Vector6<f64> {
    let mut y = Vector6::zeros();
    y[on.index()] = value;
    y
}

/// Returns `E x`, where E is the symmetric matrix with ones at (i, j) and (j, i).
fn times_unit(i: usize, j: usize, x: &Vector6<f64>) -> Vector6<f64> {
    let mut y = Vector6::zeros();
    y[i] += x[j];
    if i != j {
        y[j] += x[i];
    }
    y
}

/// Returns `C(M, ν) ν` for the momentum p = M ν: `[ω × a; v × a + ω × b]` with p = [a; b].
///
/// # Source
/// Kirchhoff's equations; [Fossen2021, ch. 6].
pub(crate) fn kirchhoff(momentum: &Vector6<f64>, velocity: &Vector6<f64>) -> Vector6<f64> {
    let part = |x: &Vector6<f64>, from: usize| Vector3::new(x[from], x[from + 1], x[from + 2]);
    let (a, b) = (part(momentum, 0), part(momentum, 3));
    let (v, omega) = (part(velocity, 0), part(velocity, 3));
    let (force, moment) = (omega.cross(&a), v.cross(&a) + omega.cross(&b));
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}

/// Returns `∂(C(M, ν) ν)/∂ν`, shape (6, 6).
pub(crate) fn kirchhoff_slope(mass: &Matrix6<f64>, velocity: &Vector6<f64>) -> Matrix6<f64> {
    let momentum = mass * velocity;
    let mut slope = Matrix6::zeros();
    for j in 0..6 {
        let mut unit = Vector6::zeros();
        unit[j] = 1.0;
        let column =
            kirchhoff(&momentum, &unit) + kirchhoff(&mass.column(j).into_owned(), velocity);
        slope.set_column(j, &column);
    }
    slope
}

/// Returns the terms of m, d_Q, d_L and b of `m v̇ + d_Q v|v| + d_L v + b = τ` in an axis, each with the sign of its
/// coefficient there.
///
/// The constant force of heave is weight minus buoyancy: a buoyant vehicle has an upward force, so that b is
/// −(W − B).
pub(crate) fn own_terms(dof: Dof) -> [(Basis, f64); 4] {
    let bias = match dof {
        Dof::Heave => (Basis::WeightExcess, -1.0),
        _ => (Basis::One(dof), 1.0),
    };
    let drag = [Product::quadratic(dof), Product::linear(dof)];
    let [quadratic, linear] = drag.map(|product| (Basis::Product(dof, product), 1.0));
    [(Basis::Mass(dof, dof), 1.0), quadratic, linear, bias]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of sums of products of numbers of order one to a thousand.
    const ROUNDING: f64 = 1e-9;

    /// The published forces have two decimals, N and N m.
    const PUBLISHED: f64 = 5e-3;

    #[test]
    fn coriolis_forces_are_those_of_kirchhoffs_equations() {
        // Published: added mass diag(5, 60, 70, 0.5, 8, 9) in a general motion.
        let mass = [5.0, 60.0, 70.0, 0.5, 8.0, 9.0];
        let velocity = Vector6::new(1.5, 0.2, -0.1, 0.05, 0.1, 0.2);
        let at = Instant { acceleration: Vector6::zeros(), velocity, down_body: Vector3::z() };
        let mut force = Vector6::zeros();
        for (dof, m) in Dof::ALL.into_iter().zip(mass) {
            force += m * Basis::Mass(dof, dof).regressor(&at);
        }
        let expected = Vector6::new(-3.1, 1.85, -0.15, -0.18, 9.665, 16.54);
        assert!((force - expected).amax() < PUBLISHED, "{force}");
    }

    #[test]
    fn coriolis_forces_do_no_work() {
        let velocity = Vector6::new(1.5, 0.2, -0.1, 0.7, -0.4, 0.2);
        let at = Instant { acceleration: Vector6::zeros(), velocity, down_body: Vector3::z() };
        for i in Dof::ALL {
            for j in Dof::ALL.into_iter().filter(|j| *j >= i) {
                let power = Basis::Mass(i, j).regressor(&at).dot(&velocity);
                assert!(power.abs() < ROUNDING, "{i} {j}: {power}");
            }
        }
    }

    #[test]
    fn a_low_centre_of_gravity_gives_a_righting_moment() {
        // Heeled to starboard, bow up: k = (−sin θ, cos θ sin φ, cos θ cos φ).
        let (roll, pitch) = (0.3_f64, 0.2_f64);
        let down_body =
            Vector3::new(-pitch.sin(), pitch.cos() * roll.sin(), pitch.cos() * roll.cos());
        let at = Instant { acceleration: Vector6::zeros(), velocity: Vector6::zeros(), down_body };
        let y = Basis::Lever(2).regressor(&at);
        // The regressor is on the left of the equation of motion, opposite to the moment on the
        // body.
        assert!(y[3] > 0.0 && y[4] > 0.0 && y[5] == 0.0, "{y}");
    }

    #[test]
    fn a_heavy_vehicle_sinks() {
        let at = Instant {
            acceleration: Vector6::zeros(),
            velocity: Vector6::zeros(),
            down_body: Vector3::z(),
        };
        assert_eq!(Basis::WeightExcess.regressor(&at)[2], -1.0);
    }

    #[test]
    fn units_follow_the_axes() {
        let factor = |of, modulus| Factor { of, modulus };
        let mixed = Product::new(&[factor(Dof::Yaw, false), factor(Dof::Sway, true)]);
        let unit = |basis: Basis| basis.unit();
        assert_eq!(unit(Basis::Product(Dof::Yaw, mixed.expect("two"))), "N m/((m/s)(rad/s))");
        assert_eq!(unit(Basis::Product(Dof::Surge, Product::quadratic(Dof::Surge))), "N/(m/s)²");
        assert_eq!(unit(Basis::Mass(Dof::Sway, Dof::Yaw)), "kg m");
        let unit_of = |text: &str| unit(text.parse().expect("a term"));
        assert_eq!(unit_of("sway: Uv"), "N/(m/s)²");
        assert_eq!(unit_of("yaw: rrr/U"), "N m/((m/s)⁻¹(rad/s)³)");
        assert_eq!(unit_of("surge: vvvv/UU"), "N/(m/s)²");
    }

    #[test]
    fn slopes_of_products_with_speed_are_those_of_their_values() {
        let velocity = Vector6::new(1.1, -0.3, 0.1, 0.2, 0.1, 0.15);
        for text in ["sway: Uv", "yaw: vvr/U", "surge: vvvv/UU", "yaw: |v|r", "sway: UUr"] {
            let Ok(Basis::Product(_, product)) = text.parse() else { panic!("{text}") };
            let mut row = [0.0; 6];
            product.add_slope(&velocity, 2.0, &mut row);
            for (j, slope) in row.into_iter().enumerate() {
                let at = |step: f64| {
                    let mut moved = velocity;
                    moved[j] += step;
                    2.0 * product.value(&moved)
                };
                let found = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((found - slope).abs() < 1e-8, "{text} by {j}: {found} {slope}");
            }
        }
    }

    #[test]
    fn a_product_divided_by_speed_vanishes_at_rest() {
        let Ok(Basis::Product(_, product)) = "yaw: rrr/U".parse() else { panic!("a term") };
        assert_eq!(product.value(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.5)), 0.0);
        let under_way = product.value(&Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.5));
        assert!((under_way - 0.125).abs() < 2e-5, "{under_way}");
    }
}
