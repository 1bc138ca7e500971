//! What a trial will determine of a plant, before anything of it is estimated.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::actuator::Actuator;
use super::filter::{InstrumentNoise, Noise};
use super::problem::{CURRENT_STD, Point, Problem};
use super::schedule::Attitude;
use super::uncertainty::inverse;
use crate::plant::{Parameterisation, Plant};
use crate::{Dof, Error, TrialRecord};

/// Disturbance of an axis and noise of its velocity, as they are expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedNoise {
    /// Standard deviation of the disturbance, N or N m.
    pub disturbance: f64,
    /// Its correlation time, s.
    pub correlation_s: f64,
    /// Standard deviation of a sample of velocity, m/s or rad/s.
    pub velocity: f64,
}

/// Disturbances and instrument noise of a trial that is to be driven.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExpectedNoises {
    /// By axis; every axis of the plant needs one.
    pub axes: BTreeMap<Dof, ExpectedNoise>,
    /// Standard deviation of a sample of roll and of pitch, rad.
    pub attitude: f64,
    /// Noise of other instruments by their names in results (`position_noise`, `depth_noise`); those
    /// of the record's own differences where one is left out.
    pub instruments: BTreeMap<String, f64>,
}

/// Fisher information of a plant's coefficients and of the numbers of its actuator.
#[derive(Clone, Debug, PartialEq)]
pub struct Information {
    /// Coefficients as [`Structure::names`](crate::plant::Structure::names) has them, without held
    /// ones; then the numbers of the actuator: `lag`, `delay`, `log_reverse_ratio`,
    /// `log_thrust_scale`.
    pub names: Vec<String>,
    /// Shape (p, p), symmetric.
    pub matrix: DMatrix<f64>,
}

/// Thrusters as a trial is expected to show them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExpectedActuator {
    /// Expected numbers; those that are not zero are estimated.
    pub actuator: Actuator,
    /// True if known forces are to determine the scale of thrust, which is then estimated, too.
    pub has_scale: bool,
}

impl From<&Actuator> for ExpectedActuator {
    /// One whose scale of thrust is not estimated.
    fn from(actuator: &Actuator) -> Self {
        Self { actuator: *actuator, has_scale: false }
    }
}

/// The numbers of an actuator in their order.
const ACTUATOR_NAMES: [&str; Actuator::COUNT] = [
    "lag",
    "delay",
    "log_reverse_ratio",
    "log_lag_ratio",
    "thrust_exponent",
    "slew",
    "voltage_exponent",
    "dead_band",
    "thrust_change_within",
    "thrust_change_between",
    "thrust_change_loaded",
    "log_thrust_scale",
    "log_falling_lag_ratio",
];

impl Information {
    /// The information of independent trials together.
    ///
    /// # Errors
    /// [`Error::Plant`] if both are not of the same numbers.
    pub fn plus(&self, other: &Self) -> Result<Self, Error> {
        if self.names != other.names {
            let reason = "has information of other numbers; take both from the same plant";
            return Err(Error::Plant { axes: "the plant".to_owned(), reason: reason.to_owned() });
        }
        Ok(Self { names: self.names.clone(), matrix: &self.matrix + &other.matrix })
    }

    /// The inverse, scaled first; a number that nothing determines gets a variance that says so.
    pub fn covariance(&self) -> DMatrix<f64> {
        inverse(&self.matrix)
    }
}

/// Calculates the Fisher information that a trial has on a plant, for the likelihood that
/// [`fit_plant`](super::fit_plant) maximises.
///
/// ```text
/// J = Σ (∂e/∂θ)ᵀ S⁻¹ (∂e/∂θ) − J_c (J_cc + 1/σ_c²)⁻¹ J_cᵀ
/// ```
///
/// with e the innovations of the filter error method, S their covariance, both at the gains that
/// `noise` leads to, and c the trial's own current, known to σ_c = 1 m/s before. `record` holds the
/// motion that is expected, without noise. Numbers of `thrust` that are not zero are among θ, and
/// have [`information_before`]; so has the logarithm of the scale of all thrust, if known forces are
/// to determine it.
///
/// J has shape (p, p) and the units of 1/(θ_i θ_j).
///
/// # Errors
/// [`Error::Plant`] if `noise` lacks an axis, a number of it is not above zero, or the plant cannot be
/// simulated.
///
/// # Source
/// [Jategaonkar2015, ch. 5]; \[Goodwin1977\], for its use in the design of inputs.
///
/// # Example
/// ```
/// use std::collections::BTreeMap;
/// use seaplant::estimate::{Actuator, ExpectedNoise, ExpectedNoises, information};
/// use seaplant::plant::{Plant, Structure, Symmetry};
/// use seaplant::{Dof, Quantity, Timed, TrialRecord, TrialSetup, Vehicle};
/// let times: Vec<f64> = (0..600).map(|k| 0.1 * f64::from(k)).collect();
/// let series = |of: &dyn Fn(f64) -> f64| {
///     Timed::new("series", times.clone(), times.iter().map(|t| of(*t)).collect::<Vec<_>>())
/// };
/// let recording = BTreeMap::from([
///     (Quantity::Wrench(Dof::Surge), series(&|t| 50.0 * (0.5 * t).cos())?),
///     (Quantity::Velocity(Dof::Surge), series(&|t| (0.5 * t).sin())?),
/// ]);
/// let setup = TrialSetup { name: "surge".to_owned(), ..TrialSetup::default() };
/// let record = TrialRecord::new(&setup, &recording, &Vehicle::default(), &[Dof::Surge])?;
/// let plant = Plant::new(Structure::of(&[Dof::Surge], Symmetry::None)?, vec![100.0, 5.0, 20.0])?;
/// let own = ExpectedNoise { disturbance: 2.0, correlation_s: 10.0, velocity: 0.01 };
/// let noise = ExpectedNoises { axes: [(Dof::Surge, own)].into(), ..ExpectedNoises::default() };
/// let found = information(&plant, &Actuator::default(), &noise, &record)?;
/// assert_eq!(found.names[0], "mass.surge");
/// let std = found.covariance()[(0, 0)].sqrt();
/// assert!(std > 0.1 && std < 10.0, "{std} kg");
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn information(
    plant: &Plant,
    thrust: impl Into<ExpectedActuator>,
    noise: &ExpectedNoises,
    record: &TrialRecord,
) -> Result<Information, Error> {
    check(plant, noise)?;
    let thrust = &thrust.into();
    let attitude = Attitude::of(&[record], plant.structure());
    let problem = Problem::new(plant.structure(), &[record], None, false, attitude);
    let full_speed = Actuator::prompt(&[record]).full_speed;
    let point = Point {
        free: problem.physical.free(&DVector::from_row_slice(plant.coefficients())),
        actuator: Actuator { full_speed, ..thrust.actuator },
        currents: vec![[0.0; 2]],
        noise: expected(plant, noise, &problem),
        jitter_of: thrust.actuator,
    };
    let all = problem.slope_of_all(&point).map(|slope| slope.information).ok_or_else(|| {
        Error::Plant {
            axes: plant.structure().name(),
            reason: "its motion diverges from that of the record; use that of the same plant"
                .to_owned(),
        }
    })?;
    let places = places(plant, thrust);
    let first = plant.structure().terms().len() + Actuator::COUNT;
    let mut matrix = all.select_rows(&places).select_columns(&places);
    if problem.has_current {
        let cross = all.select_rows(&places).columns(first, 2).into_owned();
        let before = DMatrix::identity(2, 2) / CURRENT_STD.powi(2);
        let own = all.view((first, first), (2, 2)) + before;
        matrix -= &cross * inverse(&own) * cross.transpose();
    }
    let matrix = 0.5 * (&matrix + matrix.transpose());
    Ok(Information { names: names(plant, &places), matrix })
}

/// The information that a fit has before it measures anything, of the numbers of [`information`].
///
/// Coefficients have none; numbers of the actuator have the standard deviations that fits begin with.
pub fn information_before(plant: &Plant, thrust: impl Into<ExpectedActuator>) -> Information {
    let places = places(plant, &thrust.into());
    let names = names(plant, &places);
    let terms = plant.structure().terms().len();
    let of =
        |place: &usize| place.checked_sub(terms).map_or(0.0, |k| Actuator::PRIOR_STD[k].powi(-2));
    let diagonal = DVector::from_iterator(places.len(), places.iter().map(of));
    Information { names, matrix: DMatrix::from_diagonal(&diagonal) }
}

fn check(plant: &Plant, noise: &ExpectedNoises) -> Result<(), Error> {
    let refuse = |reason: String| Error::Plant { axes: plant.structure().name(), reason };
    for dof in plant.axes() {
        let Some(own) = noise.axes.get(dof) else {
            return Err(refuse(format!("lacks the expected noise of {dof}; state it")));
        };
        let all = [own.disturbance, own.correlation_s, own.velocity];
        if !all.iter().all(|x| *x > 0.0 && x.is_finite()) {
            return Err(refuse(format!(
                "expects a disturbance of {} over {} s and velocities to {} in {dof}; give numbers above zero",
                own.disturbance, own.correlation_s, own.velocity
            )));
        }
    }
    Ok(())
}

/// The indices of what is fitted, among coefficients and numbers of the actuator.
fn places(plant: &Plant, thrust: &ExpectedActuator) -> Vec<usize> {
    let structure = plant.structure();
    let terms = structure.terms();
    let free = (0..terms.len()).filter(|k| structure.held(&terms[*k]).is_none());
    let numbers = thrust.actuator.numbers();
    let is_estimated =
        |k: &usize| numbers[*k] != 0.0 || (thrust.has_scale && *k == Actuator::SCALE);
    let acts = (0..Actuator::COUNT).filter(is_estimated);
    free.chain(acts.map(|k| terms.len() + k)).collect()
}

fn names(plant: &Plant, places: &[usize]) -> Vec<String> {
    let own = plant.structure().names();
    let name = |place: &usize| match place.checked_sub(own.len()) {
        None => own[*place].clone(),
        Some(k) => ACTUATOR_NAMES[k].to_owned(),
    };
    places.iter().map(name).collect()
}

fn expected(plant: &Plant, noise: &ExpectedNoises, problem: &Problem) -> Noise {
    let of = |number: fn(&ExpectedNoise) -> f64| {
        let all: Vec<f64> = plant.axes().iter().map(|dof| number(&noise.axes[dof])).collect();
        DVector::from(all)
    };
    let mut instruments = problem.instruments;
    for (k, (name, _)) in InstrumentNoise::NAMES.iter().enumerate() {
        if let Some(std) = noise.instruments.get(*name) {
            instruments.numbers[k] = *std;
        }
    }
    Noise {
        disturbance: of(|own| own.disturbance),
        correlation_s: of(|own| own.correlation_s),
        velocity: of(|own| own.velocity),
        attitude: (problem.attitude == Attitude::State).then_some(noise.attitude),
        instruments,
        drift: None,
        swell: None,
        jitter_s: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Structure, Symmetry};
    use crate::{Quantity, Timed, TrialSetup, Vehicle};

    /// A boat on two axes that is driven by known forces, and what is measured of it.
    fn boat() -> (Plant, ExpectedNoises, TrialRecord) {
        let structure = Structure::of(&[Dof::Surge, Dof::Yaw], Symmetry::Diagonal).expect("axes");
        let plant =
            Plant::new(structure, vec![120.0, 30.0, 12.0, 40.0, 6.0, 15.0]).expect("a plant");
        let times: Vec<f64> = (0..1200).map(|k| 0.1 * f64::from(k)).collect();
        let series = |of: &dyn Fn(f64) -> f64| {
            let values: Vec<f64> = times.iter().map(|t| of(*t)).collect();
            Timed::new("series", times.clone(), values).expect("increasing")
        };
        let ahead = series(&|t| 60.0 * (0.3 * t).sin() + 30.0 * (0.9 * t).cos());
        let turn = series(&|t| 12.0 * (0.5 * t).cos());
        let force = [Some(ahead.clone()), None, None, None, None, Some(turn.clone())];
        let inputs = crate::motion::Inputs { force, ..Default::default() };
        let still = nalgebra::Vector6::zeros();
        let moved = crate::motion::simulate(&plant, &inputs, &still, &times).expect("stable");
        let velocity = |k: usize| {
            let values: Vec<f64> = moved.velocity.iter().map(|v| v[k]).collect();
            Timed::new("velocity", times.clone(), values).expect("increasing")
        };
        let recording = BTreeMap::from([
            (Quantity::Wrench(Dof::Surge), ahead),
            (Quantity::Wrench(Dof::Yaw), turn),
            (Quantity::Velocity(Dof::Surge), velocity(0)),
            (Quantity::Velocity(Dof::Yaw), velocity(5)),
        ]);
        let setup = TrialSetup { name: "both".to_owned(), ..TrialSetup::default() };
        let axes = [Dof::Surge, Dof::Yaw];
        let record = TrialRecord::new(&setup, &recording, &Vehicle::default(), &axes);
        let own = |disturbance: f64, velocity: f64| ExpectedNoise {
            disturbance,
            correlation_s: 8.0,
            velocity,
        };
        let axes = [(Dof::Surge, own(3.0, 0.01)), (Dof::Yaw, own(0.5, 0.005))];
        let noise = ExpectedNoises { axes: axes.into(), ..ExpectedNoises::default() };
        (plant, noise, record.expect("a record"))
    }

    /// Without measurement noise all innovations are zero at the truth, so that the second
    /// derivatives of the cost are the information, but for how S changes: some parts in a hundred.
    #[test]
    fn information_is_the_curvature_of_the_likelihood() {
        let (plant, noise, record) = boat();
        let found = information(&plant, &Actuator::default(), &noise, &record).expect("moves");
        let problem = Problem::new(plant.structure(), &[&record], None, false, Attitude::Known);
        let cost = |coefficients: &DVector<f64>, current: [f64; 2]| {
            let point = Point {
                free: problem.physical.free(coefficients),
                actuator: Actuator::default(),
                currents: vec![current],
                noise: expected(&plant, &noise, &problem),
                jitter_of: Actuator::default(),
            };
            problem.cost(&point)
        };
        let truth = DVector::from_row_slice(plant.coefficients());
        let (p, q) = (truth.len(), truth.len() + 2);
        let step = |k: usize| if k < p { 0.01 * truth[k] } else { 0.01 };
        let at = |moves: [(usize, f64); 2]| {
            let (mut numbers, mut current) = (truth.clone(), [0.0; 2]);
            for (k, sign) in moves {
                match k.checked_sub(p) {
                    None => numbers[k] += sign * step(k),
                    Some(which) => current[which] += sign * step(k),
                }
            }
            cost(&numbers, current)
        };
        let curvature = DMatrix::from_fn(q, q, |i, j| {
            let all = at([(i, 1.0), (j, 1.0)]) + at([(i, -1.0), (j, -1.0)])
                - at([(i, 1.0), (j, -1.0)])
                - at([(i, -1.0), (j, 1.0)]);
            all / (4.0 * step(i) * step(j))
        });
        let covariance = curvature.try_inverse().expect("determined");
        let predicted = found.covariance();
        for k in 0..p {
            let ratio = (predicted[(k, k)] / covariance[(k, k)]).sqrt();
            assert!((ratio - 1.0).abs() < 0.05, "{}: {ratio}", found.names[k]);
        }
    }

    #[test]
    fn information_of_two_trials_is_the_sum_and_held_coefficients_have_none() {
        let (plant, noise, record) = boat();
        let once = information(&plant, &Actuator::default(), &noise, &record).expect("moves");
        let twice = once.plus(&once).expect("of the same numbers");
        let (one, both) = (once.covariance(), twice.covariance());
        assert!((one[(0, 0)] / both[(0, 0)] - 2.0).abs() < 1e-9);
        let mass = plant.structure().terms()[0];
        let held = plant.structure().clone().holding(mass, 120.0).expect("a term");
        let held = Plant::new(held, plant.coefficients().to_vec()).expect("a plant");
        let found = information(&held, &Actuator::default(), &noise, &record).expect("moves");
        assert_eq!(found.names, once.names[1..]);
        assert!(once.plus(&found).is_err());
    }

    #[test]
    fn a_lag_is_a_number_with_a_width_before_it_is_measured() {
        let (plant, noise, record) = boat();
        let lagging = Actuator { lag_s: 0.2, ..Actuator::default() };
        let before = information_before(&plant, &lagging);
        assert_eq!(before.names.last().map(String::as_str), Some("lag"));
        assert_eq!(before.matrix[(6, 6)], 1.0);
        let found = information(&plant, &lagging, &noise, &record).expect("moves");
        let prompt = information(&plant, &Actuator::default(), &noise, &record).expect("moves");
        let (with, without) = (found.covariance()[(0, 0)], prompt.covariance()[(0, 0)]);
        assert!(with > without, "a lag to be estimated widens mass: {with} and {without}");
    }

    #[test]
    fn refuses_an_axis_of_which_nothing_is_expected() {
        let (plant, mut noise, record) = boat();
        noise.axes.remove(&Dof::Yaw);
        let error = information(&plant, &Actuator::default(), &noise, &record);
        let error = error.expect_err("no yaw").to_string();
        assert!(error.contains("noise of yaw"), "{error}");
    }
}
