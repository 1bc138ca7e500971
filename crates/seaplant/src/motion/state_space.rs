//! A plant as `ẋ = f(x, u)`, with its Jacobians.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3, Vector6};

use super::Prepared;
use super::attitude::{body_from_world, down_body, euler_rates};
use super::held::{HeldTurn, held_turn};
use super::known::{KnownForce, Load};
use crate::plant::Plant;
use crate::{Dof, Error};

/// x = [η; ν]: north, east, down, roll, pitch, heading, then velocity over ground in body axes.
pub type State = SVector<f64, 12>;

/// Names of the states, in order.
pub const STATE_NAMES: [&str; 12] =
    ["north", "east", "down", "roll", "pitch", "heading", "u", "v", "w", "p", "q", "r"];

/// A plant as `ẋ = f(x, u)`, prepared for many evaluations.
///
/// x, shape (12,), is north, east, down, m; roll, pitch, heading, rad; velocity over ground in body
/// axes u, v, w, m/s, and p, q, r, rad/s. The input τ, shape (6,), is the force and moment on the
/// body, N and N m. A current, shape (3,), is the velocity of the water north, east and down, m/s,
/// constant and irrotational. Translations outside the plant keep their velocity; rotations outside
/// it keep their angle, and their rates in x are ignored.
///
/// # Example
/// ```
/// use nalgebra::{Vector3, Vector6};
/// use seaplant::Dof;
/// use seaplant::motion::{State, StateSpace};
/// use seaplant::plant::{Plant, Structure, Symmetry};
/// let surge = Structure::of(&[Dof::Surge], Symmetry::None)?;
/// let space = StateSpace::new(&Plant::new(surge, vec![100.0, 5.0, 20.0])?)?;
/// let (mut x, mut tau) = (State::zeros(), Vector6::zeros());
/// (x[6], tau[0]) = (1.0, 50.0);
/// let rate = space.rate(&x, &tau, &Vector3::zeros())?;
/// assert_eq!((rate[0], rate[6]), (1.0, 0.25));
/// // −(d_L + 2 d_Q |u|) / m
/// let (a, b) = space.jacobians(&x, &tau, &Vector3::zeros())?;
/// assert!((a[(6, 6)] + 0.45).abs() < 1e-12 && (b[(6, 0)] - 0.01).abs() < 1e-12);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub struct StateSpace {
    six_axes: Prepared<6>,
    own: [bool; 6],
    axes: String,
}

/// Attitude, and vectors of the world in body axes.
struct Pose {
    /// Rotation from the world to the body.
    to_body: Matrix3<f64>,
    down: Vector3<f64>,
    water: Vector3<f64>,
    angles: [f64; 3],
}

impl StateSpace {
    /// Prepares a plant.
    ///
    /// # Errors
    /// [`Error::Plant`] if M cannot be inverted.
    pub fn new(plant: &Plant) -> Result<Self, Error> {
        let own = Dof::ALL.map(|dof| plant.axes().contains(&dof));
        Ok(Self { six_axes: Prepared::of_six(plant, None)?, own, axes: plant.structure().name() })
    }

    /// The plant under known forces that act together, whatever their times are.
    ///
    /// # Errors
    /// As [`StateSpace::new`].
    pub fn under(plant: &Plant, known: &[KnownForce]) -> Result<Self, Error> {
        let six_axes = Prepared::of_six(plant, Some(&Load::of(known)))?;
        Ok(Self { six_axes, ..Self::new(plant)? })
    }

    /// Returns `ẋ = f(x, τ)`: m/s, rad/s, m/s², rad/s²; shape (12,).
    ///
    /// # Errors
    /// [`Error::Plant`] if an argument is not finite, or if the vehicle points straight up or down,
    /// where roll and heading are undefined.
    pub fn rate(
        &self,
        x: &State,
        tau: &Vector6<f64>,
        current: &Vector3<f64>,
    ) -> Result<State, Error> {
        let pose = self.pose(x, tau, current)?;
        let (nu, held) = self.velocity(x, &pose);
        let omega = held.omega;
        let acceleration = self.six_axes.rate(&self.relative(&nu, &pose), &pose.down, tau, &[])
            - self.on_own(&omega.cross(&pose.water));
        let mut rate = State::zeros();
        rate.fixed_rows_mut::<3>(0).copy_from(&(pose.to_body.tr_mul(&nu.fixed_rows::<3>(0))));
        rate.fixed_rows_mut::<3>(3).copy_from(&(turning(&pose) * omega));
        rate.fixed_rows_mut::<6>(6).copy_from(&acceleration);
        Ok(rate)
    }

    /// Returns `∂f/∂x`, shape (12, 12), and `∂f/∂τ`, shape (12, 6).
    ///
    /// # Errors
    /// As [`StateSpace::rate`].
    pub fn jacobians(
        &self,
        x: &State,
        tau: &Vector6<f64>,
        current: &Vector3<f64>,
    ) -> Result<(SMatrix<f64, 12, 12>, SMatrix<f64, 12, 6>), Error> {
        let pose = self.pose(x, tau, current)?;
        let (nu, held) = self.velocity(x, &pose);
        let (v, omega) = (nu.fixed_rows::<3>(0).into_owned(), held.omega);
        let by_velocity = self.six_axes.slope(&self.relative(&nu, &pose), &[]);
        let by_down = self.six_axes.slope_by_down();
        let mut a = SMatrix::<f64, 12, 12>::zeros();
        a.fixed_view_mut::<3, 3>(0, 6).copy_from(&pose.to_body.transpose());
        a.fixed_view_mut::<3, 3>(3, 9).copy_from(&turning(&pose));
        a.fixed_view_mut::<6, 6>(6, 6).copy_from(&by_velocity);
        for k in 0..3 {
            // The derivative by an angle rotates a vector of the world, in body axes, about this
            // axis.
            let about = self.turns_about(&pose, k);
            let turned = |of: &Vector3<f64>| -about.cross(of);
            let by_angle = by_velocity * self.on_own(&-turned(&pose.water))
                + by_down * turned(&pose.down)
                - self.on_own(&omega.cross(&turned(&pose.water)));
            a.fixed_view_mut::<6, 1>(6, 3 + k).copy_from(&by_angle);
            let position = pose.to_body.tr_mul(&about.cross(&v));
            a.fixed_view_mut::<3, 1>(0, 3 + k).copy_from(&position);
            let mut turns = a.fixed_view_mut::<6, 1>(6, 9 + k);
            turns -= self.on_own(&Vector3::ith(k, 1.0).cross(&pose.water));
        }
        a.fixed_view_mut::<3, 2>(3, 3).copy_from(&turning_slope(&pose, &omega));
        self.hold(&mut a, &held, &pose);
        let mut b = SMatrix::<f64, 12, 6>::zeros();
        b.fixed_view_mut::<6, 6>(6, 0).copy_from(self.six_axes.inverse());
        Ok((a, b))
    }

    /// Returns the input τ for constant velocity, ν̇ = 0, at a state; zero outside the plant's
    /// axes; N and N m, shape (6,).
    ///
    /// # Errors
    /// As [`StateSpace::rate`].
    pub fn holding_input(&self, x: &State, current: &Vector3<f64>) -> Result<Vector6<f64>, Error> {
        let free = self.rate(x, &Vector6::zeros(), current)?;
        Ok(-(self.six_axes.mass() * free.fixed_rows::<6>(6)))
    }

    /// Returns the indices of the states that the plant moves: its velocities, the angles of its
    /// rotations, and the positions that depend on these by the Jacobian `a`.
    pub fn moved(&self, a: &SMatrix<f64, 12, 12>) -> Vec<usize> {
        // Index k is a pose or a velocity of axis k mod 6.
        let follows: Vec<usize> = (3..12).filter(|k| self.own[k % 6]).collect();
        let moves = |row: usize| follows.iter().any(|&column| a[(row, column)] != 0.0);
        (0..3).filter(|&row| moves(row)).chain(follows.iter().copied()).collect()
    }

    fn pose(&self, x: &State, tau: &Vector6<f64>, current: &Vector3<f64>) -> Result<Pose, Error> {
        let refuse =
            |reason: &str| Err(Error::Plant { axes: self.axes.clone(), reason: reason.to_owned() });
        let is_finite = |of: &[f64]| of.iter().all(|x| x.is_finite());
        if ![x.as_slice(), tau.as_slice(), current.as_slice()].into_iter().all(is_finite) {
            return refuse("the state, the input or the current is not finite; give numbers");
        }
        let angles = [x[3], x[4], x[5]];
        if angles[1].cos().abs() < STRAIGHT {
            return refuse(
                "the vehicle points straight up or down, where roll and heading are not defined; use an export, whose attitude is a quaternion",
            );
        }
        let to_body = body_from_world(angles);
        let down = down_body(angles[0], angles[1]);
        Ok(Pose { water: to_body * current, to_body, down, angles })
    }

    /// Returns velocity through the water on the plant's axes, unchanged on others.
    fn relative(&self, nu: &Vector6<f64>, pose: &Pose) -> Vector6<f64> {
        nu - self.on_own(&pose.water)
    }

    /// Returns a vector's entries on the plant's translations, as a vector of six.
    fn on_own(&self, of: &Vector3<f64>) -> Vector6<f64> {
        Vector6::from_fn(|k, _| if k < 3 && self.own[k] { of[k] } else { 0.0 })
    }

    /// Returns velocity over ground with the rates that hold angles, and the derivatives of these.
    fn velocity(&self, x: &State, pose: &Pose) -> (Vector6<f64>, HeldTurn) {
        let mut nu = x.fixed_rows::<6>(6).into_owned();
        let turns = [self.own[3], self.own[4], self.own[5]];
        let held = held_turn(turns, &nu.fixed_rows::<3>(3).into_owned(), &pose.down);
        nu.fixed_rows_mut::<3>(3).copy_from(&held.omega);
        (nu, held)
    }

    /// Applies the chain rule to ∂f/∂x: rates depend on those of the plant and on attitude.
    fn hold(&self, a: &mut SMatrix<f64, 12, 12>, held: &HeldTurn, pose: &Pose) {
        let by_turn = a.fixed_view::<12, 3>(0, 9).into_owned();
        a.fixed_view_mut::<12, 3>(0, 9).copy_from(&(by_turn * held.by_rates));
        for k in 0..2 {
            let tilted = -self.turns_about(pose, k).cross(&pose.down);
            let mut by_angle = a.fixed_view_mut::<12, 1>(0, 3 + k);
            by_angle += by_turn * (held.by_down * tilted);
        }
    }

    /// Returns the axis, in the body frame, about which roll, pitch or heading rotates.
    fn turns_about(&self, pose: &Pose, k: usize) -> Vector3<f64> {
        let (sine, cosine) = pose.angles[0].sin_cos();
        match k {
            0 => Vector3::x(),
            1 => Vector3::new(0.0, cosine, -sine),
            _ => pose.down,
        }
    }
}

/// Cosine of pitch below which Euler angles are lost in rounding.
const STRAIGHT: f64 = 1e-9;

/// Returns the matrix from p, q, r to the rates of roll, pitch and heading.
fn turning(pose: &Pose) -> Matrix3<f64> {
    let [roll, pitch, _] = pose.angles;
    euler_rates(roll, pitch)
}

/// Returns the derivative of those rates by roll and pitch.
fn turning_slope(pose: &Pose, omega: &Vector3<f64>) -> SMatrix<f64, 3, 2> {
    let [roll, pitch, _] = pose.angles;
    let (s, c) = roll.sin_cos();
    let (sine, cosine) = pitch.sin_cos();
    let across = omega.y * s + omega.z * c;
    let along = omega.y * c - omega.z * s;
    let squared = cosine * cosine;
    SMatrix::<f64, 3, 2>::new(
        along * sine / cosine,
        across / squared,
        -across,
        0.0,
        along / cosine,
        across * sine / squared,
    )
}

#[cfg(test)]
mod tests {
    use super::super::rate::tests::vehicle;
    use super::*;
    use crate::plant::{Structure, Symmetry};

    /// Error of central differences over 1e-6 of numbers of order one to a hundred.
    const DIFFERENCE: f64 = 1e-6;

    fn point() -> (State, Vector6<f64>, Vector3<f64>) {
        let x = [1.0, 2.0, 3.0, 0.3, -0.4, 2.0, 0.8, -0.3, 0.2, 0.5, -0.9, 1.1];
        let tau = Vector6::new(10.0, -5.0, 3.0, 0.5, -0.2, 2.0);
        (State::from(x), tau, Vector3::new(0.3, -0.2, 0.1))
    }

    /// Returns a plant of these axes.
    fn space_of(axes: &[Dof]) -> StateSpace {
        let structure = Structure::of(axes, Symmetry::Diagonal).expect("axes");
        let coefficients = (0..structure.terms().len()).map(|k| 2.0 + k as f64).collect();
        StateSpace::new(&Plant::new(structure, coefficients).expect("possible")).expect("regular")
    }

    #[test]
    fn jacobians_are_those_of_the_rate() {
        check_jacobians(&StateSpace::new(&vehicle()).expect("six axes"));
    }

    #[test]
    fn jacobians_include_the_rates_that_hold_angles() {
        use Dof::{Heave, Pitch, Roll, Surge, Sway, Yaw};
        let sets: [&[Dof]; 4] =
            [&[Surge, Sway, Heave, Pitch, Yaw], &[Surge, Sway, Yaw], &[Surge, Pitch], &[Roll, Yaw]];
        sets.into_iter().for_each(|axes| check_jacobians(&space_of(axes)));
    }

    #[test]
    fn angles_of_rotations_outside_the_plant_stay_constant() {
        let (x, tau, current) = point();
        let space = space_of(&[Dof::Surge, Dof::Pitch, Dof::Yaw]);
        let rate = space.rate(&x, &tau, &current).expect("a point");
        assert!(rate[3].abs() < 1e-12 && rate[4].abs() > 0.1 && rate[5].abs() > 0.1, "{rate}");
        let mut other = x;
        other[9] = 5.0;
        assert_eq!(rate, space.rate(&other, &tau, &current).expect("a point"));
    }

    fn check_jacobians(space: &StateSpace) {
        let (x, tau, current) = point();
        let (a, b) = space.jacobians(&x, &tau, &current).expect("a point");
        for k in 0..12 {
            let at = |step: f64| {
                let mut moved = x;
                moved[k] += step;
                space.rate(&moved, &tau, &current).expect("near")
            };
            let found = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((found - a.column(k)).amax() < DIFFERENCE, "{}", STATE_NAMES[k]);
        }
        for k in 0..6 {
            let at = |step: f64| {
                let mut moved = tau;
                moved[k] += step;
                space.rate(&x, &moved, &current).expect("near")
            };
            let found = (at(1e-3) - at(-1e-3)) / 2e-3;
            assert!((found - b.column(k)).amax() < DIFFERENCE, "{k}");
        }
    }

    #[test]
    fn a_vehicle_at_rest_in_the_water_drifts_with_it() {
        let plant = vehicle();
        let space = StateSpace::new(&plant).expect("six axes");
        let (mut x, _, current) = point();
        x.fixed_rows_mut::<6>(6).fill(0.0);
        let water = body_from_world([x[3], x[4], x[5]]) * current;
        x.fixed_rows_mut::<3>(6).copy_from(&water);
        let still = plant.resistance(&Vector6::zeros(), &down_body(x[3], x[4]));
        let rate = space.rate(&x, &still, &current).expect("a point");
        assert!((rate.fixed_rows::<3>(0) - current).amax() < 1e-12);
        assert!(rate.fixed_rows::<6>(6).amax() < 1e-12);
    }

    #[test]
    fn the_holding_input_holds() {
        let space = StateSpace::new(&vehicle()).expect("six axes");
        let (x, _, current) = point();
        let tau = space.holding_input(&x, &current).expect("a point");
        let rate = space.rate(&x, &tau, &current).expect("a point");
        assert!(rate.fixed_rows::<6>(6).amax() < 1e-12);
    }

    #[test]
    fn refuses_a_vehicle_that_points_straight_down() {
        let space = StateSpace::new(&vehicle()).expect("six axes");
        let (mut x, tau, current) = point();
        x[4] = std::f64::consts::FRAC_PI_2;
        let error = space.rate(&x, &tau, &current).expect_err("vertical").to_string();
        assert!(error.contains("straight up or down"), "{error}");
        x[4] = f64::NAN;
        assert!(space.rate(&x, &tau, &current).is_err());
    }

    #[test]
    fn states_that_the_plant_does_not_move_are_excluded() {
        let space = space_of(&[Dof::Surge, Dof::Yaw]);
        let (none, still) = (Vector6::zeros(), Vector3::zeros());
        let (a, _) = space.jacobians(&State::zeros(), &none, &still).expect("a point");
        let names: Vec<&str> = space.moved(&a).into_iter().map(|k| STATE_NAMES[k]).collect();
        assert_eq!(names, ["north", "heading", "u", "r"]);
    }
}
