//! Gains from bandwidth and damping, checked against lag, delay and plant uncertainty.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, Vector6};
use schemars::JsonSchema;
use seaplant::Dof;
use seaplant::plant::{Basis, Plant, Product};
use serde::{Deserialize, Serialize};

use crate::linear::{LinearGains, growth, righting, slope};
use crate::margins::{Loop, Margins};
use crate::{Error, Law, limits};

/// Name and version of the file of gains.
pub const GAINS_SCHEMA: &str = "seaplant/control/1";

/// Dynamics between command and force, by axis in SNAME order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Actuators {
    /// First-order lag of force, s.
    pub lag_s: [f64; 6],
    /// Delay, s.
    pub delay_s: [f64; 6],
    /// Greatest force either way, N and N m; none means unlimited.
    pub limit: [Option<f64>; 6],
}

impl Default for Actuators {
    fn default() -> Self {
        Self { lag_s: [0.0; 6], delay_s: [0.0; 6], limit: [None; 6] }
    }
}

/// Desired behaviour of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// Natural frequency of the closed loop, Hz.
    pub bandwidth_hz: f64,
    /// Its damping ratio.
    pub damping: f64,
    /// Integral time K_p/K_i, s; 10/ω for PID if not given.
    #[serde(default)]
    pub integral_s: Option<f64>,
}

impl Tuning {
    /// Creates a tuning from a natural frequency, Hz, and a damping ratio.
    pub fn new(bandwidth_hz: f64, damping: f64) -> Self {
        Self { bandwidth_hz, damping, integral_s: None }
    }

    fn omega(&self) -> f64 {
        TAU * self.bandwidth_hz
    }
}

/// Weights of the linear quadratic regulator of an axis: an error and a force of equal cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LqrWeights {
    /// The error, m or rad.
    pub error: f64,
    /// The force of equal cost, N or N m.
    pub force: f64,
}

impl LqrWeights {
    /// Returns the natural frequency and damping that minimise `∫ (e/error)² + (τ/force)² dt`.
    ///
    /// With `m ë + d ė = τ` the optimum is K_p = force/error and
    /// `K_d = −d + √(d² + 2 m K_p)`.
    ///
    /// # Errors
    /// [`Error::Setting`] for a weight that is not above zero.
    ///
    /// ```
    /// use seaplant_control::LqrWeights;
    /// // Without drag the damping of the closed loop is √½.
    /// let tuning = LqrWeights { error: 0.1, force: 40.0 }.tuning(100.0, 0.0)?;
    /// assert!((tuning.damping - 0.5_f64.sqrt()).abs() < 1e-12);
    /// # Ok::<(), seaplant_control::Error>(())
    /// ```
    pub fn tuning(&self, mass: f64, damping: f64) -> Result<Tuning, Error> {
        above_zero("the error of the regulator", self.error)?;
        above_zero("the force of the regulator", self.force)?;
        let kp = self.force / self.error;
        let kd = (damping * damping + 2.0 * mass * kp).sqrt() - damping;
        let omega = (kp / mass).sqrt();
        Ok(Tuning::new(omega / TAU, 0.5 * kd / (mass * omega)))
    }
}

/// Specification of a controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The law.
    pub law: Law,
    /// True if its model adapts.
    pub adapts: bool,
    /// Tuning of each controlled axis; others are not controlled.
    pub tuning: BTreeMap<Dof, Tuning>,
    /// Sample rate, Hz.
    pub sample_hz: f64,
    /// Time constant of the adaptation, s.
    pub adaptation_s: f64,
    /// Typical speed of each axis, m/s and rad/s, at which margins are computed in addition to
    /// rest.
    pub speed: [f64; 6],
    /// True to accept a loop with too small a margin.
    pub anyway: bool,
}

impl Default for Design {
    fn default() -> Self {
        Self {
            law: Law::default(),
            adapts: false,
            tuning: BTreeMap::new(),
            sample_hz: 10.0,
            adaptation_s: 60.0,
            speed: [0.5, 0.5, 0.5, 0.3, 0.3, 0.3],
            anyway: false,
        }
    }
}

/// The gains of one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisGains {
    /// K_p, N/m or N m/rad.
    pub kp: f64,
    /// K_d, N/(m/s) or N m/(rad/s).
    pub kd: f64,
    /// K_i, N/(m s) or N m/(rad s); zero except for PID.
    pub ki: f64,
    /// Λ of s = ė + Λ e, 1/s.
    pub lambda: f64,
    /// Mass for which the gains are designed, kg or kg m².
    pub mass: f64,
    /// Natural frequency, Hz.
    pub bandwidth_hz: f64,
    /// Damping ratio.
    pub damping: f64,
    /// First-order lag in the design, s.
    pub lag_s: f64,
    /// Delay in the design, s.
    pub delay_s: f64,
    /// Greatest force either way, N or N m; absent if unknown.
    #[serde(default)]
    pub limit: Option<f64>,
    /// Error at which the proportional part alone reaches the limit, m or rad.
    #[serde(default)]
    pub saturates_at: Option<f64>,
    /// Margins with the estimated plant: the worse of rest and typical speed.
    pub margins: Margins,
    /// Smallest margins over plants drawn from its uncertainty.
    pub worst: Margins,
}

/// Gains with their margins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// [`GAINS_SCHEMA`].
    pub schema: String,
    /// The law.
    pub law: Law,
    /// True if its model adapts.
    pub adapts: bool,
    /// Sample rate, Hz.
    pub sample_hz: f64,
    /// Time constant of the adaptation, s.
    pub adaptation_s: f64,
    /// Number of draws behind the worst case; 0 if the uncertainty is unknown.
    pub draws: usize,
    /// Fraction of them with an unstable loop.
    pub probability_unstable: f64,
    /// Warnings.
    pub notes: Vec<String>,
    /// The gains by axis.
    pub axes: BTreeMap<Dof, AxisGains>,
}

/// Default integral time of PID, times ω.
const INTEGRAL_TIMES: f64 = 10.0;

/// Smallest accepted phase margin, degrees.
const LEAST_PHASE_DEG: f64 = 30.0;

/// Phase margin over draws below which a warning is given, degrees.
const TOLD_PHASE_DEG: f64 = 20.0;

/// Computes and checks the gains of a design.
///
/// `draws` are plants drawn from the uncertainty.
///
/// # Errors
/// [`Error::Setting`] and [`Error::NoAxis`] for what cannot be, or would take hours to simulate: a
/// sampling rate outside 0.1 to 1000 Hz, a delay of hundreds of samples, a bandwidth whose step
/// response takes more than 200 000 steps; [`Error::Bandwidth`], [`Error::Integral`] and
/// [`Error::Unstable`] with the number that would do, unless the design says anyway.
///
/// # Source
/// \[Smallwood2004\] for the laws of one axis, [Fossen2021, ch. 15 and 16] for six.
pub fn design(
    plant: &Plant,
    draws: &[Plant],
    actuators: &Actuators,
    asked: &Design,
) -> Result<Gains, Error> {
    check(plant, actuators, asked)?;
    limits::check(plant, asked, actuators)?;
    checked(plant, draws, actuators, asked)
}

/// Does the same as [`design`] for settings that were checked.
fn checked(
    plant: &Plant,
    draws: &[Plant],
    actuators: &Actuators,
    asked: &Design,
) -> Result<Gains, Error> {
    let mut axes = BTreeMap::new();
    for (&dof, tuning) in &asked.tuning {
        let gains = axis(plant, draws, actuators, asked, dof, tuning);
        if !asked.anyway {
            refuse_slim(plant, actuators, asked, (dof, tuning), &gains)?;
        }
        axes.insert(dof, gains);
    }
    let mut gains = Gains {
        schema: GAINS_SCHEMA.to_owned(),
        law: asked.law,
        adapts: asked.adapts,
        sample_hz: asked.sample_hz,
        adaptation_s: asked.adaptation_s,
        draws: draws.len(),
        probability_unstable: 0.0,
        notes: Vec::new(),
        axes,
    };
    let period_s = 1.0 / asked.sample_hz;
    let growth = |truth: &Plant, gains: &Gains| {
        grows(plant, truth, gains, actuators, asked).unwrap_or(f64::INFINITY)
    };
    let own = growth(plant, &gains);
    if own > STABLE && !asked.anyway {
        let part = stable_part(plant, actuators, asked);
        return Err(Error::Unstable { growth: own, period_s, part });
    }
    let unstable = draws.iter().filter(|draw| growth(draw, &gains) > STABLE).count();
    gains.probability_unstable = unstable as f64 / draws.len().max(1) as f64;
    gains.notes = notes(plant, &gains, own);
    Ok(gains)
}

/// Computes the margins of each axis of a vehicle under the controller of a design for another plant.
///
/// Each is the worse of rest and typical speed. Gains are those of [`design`] for `plant`, which need
/// not suit it.
///
/// # Errors
/// [`Error::Setting`] and [`Error::NoAxis`], as [`design`].
///
/// # Example
/// ```
/// use seaplant::Dof;
/// use seaplant::plant::{Plant, Structure, Symmetry};
/// use seaplant_control::{Actuators, Design, Law, Tuning, margins};
/// let of = |mass| Plant::new(Structure::of(&[Dof::Surge], Symmetry::None)?, vec![mass, 5.0, 20.0]);
/// let (plant, lighter) = (of(100.0)?, of(70.0)?);
/// let actuators = Actuators { lag_s: [0.3; 6], ..Actuators::default() };
/// let asked = Design { law: Law::Pd, tuning: [(Dof::Surge, Tuning::new(0.1, 1.0))].into(), ..Design::default() };
/// let of = |truth| margins(&plant, truth, &actuators, &asked);
/// // The same gains move it faster, and the lag of thrust costs more phase.
/// assert!(of(&lighter)?[&Dof::Surge].phase_deg < of(&plant)?[&Dof::Surge].phase_deg);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn margins(
    plant: &Plant,
    truth: &Plant,
    actuators: &Actuators,
    asked: &Design,
) -> Result<BTreeMap<Dof, Margins>, Error> {
    check(plant, actuators, asked)?;
    limits::check(plant, asked, actuators)?;
    let of = |(&dof, tuning): (&Dof, &Tuning)| {
        let gains = gains_of(plant, actuators, asked, dof, tuning);
        (dof, margins_with(plant, truth, &gains, asked, dof))
    };
    Ok(asked.tuning.iter().map(of).collect())
}

fn above_zero(name: &str, x: f64) -> Result<(), Error> {
    if x > 0.0 && x.is_finite() {
        return Ok(());
    }
    let expected = "a finite number above zero".to_owned();
    Err(Error::Setting { name: name.to_owned(), found: x.to_string(), expected })
}

fn check(plant: &Plant, actuators: &Actuators, asked: &Design) -> Result<(), Error> {
    above_zero("the sampling rate, Hz,", asked.sample_hz)?;
    above_zero("the adaptation time, s,", asked.adaptation_s)?;
    if asked.tuning.is_empty() {
        let (name, found) = ("the list of axes".to_owned(), "empty".to_owned());
        return Err(Error::Setting { name, found, expected: "at least one".to_owned() });
    }
    for (dof, tuning) in &asked.tuning {
        if !plant.axes().contains(dof) {
            let known: Vec<&str> = plant.axes().iter().map(|dof| dof.name()).collect();
            return Err(Error::NoAxis { dof: *dof, known: known.join(", ") });
        }
        above_zero(&format!("the {dof} bandwidth, Hz,"), tuning.bandwidth_hz)?;
        above_zero(&format!("the {dof} damping"), tuning.damping)?;
        tuning.integral_s.map_or(Ok(()), |s| above_zero(&format!("the {dof} integral time"), s))?;
        let i = dof.index();
        let late = [actuators.lag_s[i], actuators.delay_s[i]];
        if let Some(wrong) = late.into_iter().find(|s| !(*s >= 0.0 && s.is_finite())) {
            let (name, found) = (format!("the {dof} lag or delay"), format!("{wrong} s"));
            return Err(Error::Setting { name, found, expected: "zero or more".to_owned() });
        }
        actuators.limit[i].map_or(Ok(()), |x| above_zero(&format!("the {dof} force limit"), x))?;
    }
    Ok(())
}

/// Computes the gains of an axis with its margins.
fn axis(
    plant: &Plant,
    draws: &[Plant],
    actuators: &Actuators,
    asked: &Design,
    dof: Dof,
    tuning: &Tuning,
) -> AxisGains {
    let mut gains = gains_of(plant, actuators, asked, dof, tuning);
    let of = |truth: &Plant| margins_with(plant, truth, &gains, asked, dof);
    let margins = of(plant);
    let worst = draws.iter().map(of).fold(margins, lesser);
    (gains.margins, gains.worst) = (margins, worst);
    gains
}

/// Computes the gains of an axis, without its margins.
fn gains_of(
    plant: &Plant,
    actuators: &Actuators,
    asked: &Design,
    dof: Dof,
    tuning: &Tuning,
) -> AxisGains {
    let i = dof.index();
    let mass = plant.coefficient(&Basis::Mass(dof, dof)).unwrap_or(0.0);
    let (omega, zeta) = (tuning.omega(), tuning.damping);
    let kp = mass * omega * omega;
    let kd = 2.0 * zeta * omega * mass;
    let is_pid = asked.law == Law::Pid;
    let ki = if is_pid { kp / tuning.integral_s.unwrap_or(INTEGRAL_TIMES / omega) } else { 0.0 };
    // −K s − K_e e with s = ė + Λ e has the same K_p and K_d as the other laws.
    let lambda =
        if zeta > 1.0 { omega * (zeta - (zeta * zeta - 1.0).sqrt()) } else { zeta * omega };
    let limit = actuators.limit[i];
    let none = Margins { phase_deg: 180.0, gain: 1e6, delay_s: 1e6, crossover_hz: 0.0 };
    AxisGains {
        kp,
        kd,
        ki,
        lambda,
        mass,
        bandwidth_hz: tuning.bandwidth_hz,
        damping: zeta,
        lag_s: actuators.lag_s[i],
        delay_s: actuators.delay_s[i],
        limit,
        saturates_at: limit.map(|limit| limit / kp),
        margins: none,
        worst: none,
    }
}

fn lesser(a: Margins, b: Margins) -> Margins {
    let least = if b.phase_deg < a.phase_deg { b } else { a };
    Margins { gain: a.gain.min(b.gain), delay_s: a.delay_s.min(b.delay_s), ..least }
}

/// Returns the own damping of an axis at a speed: the slope of its force.
fn own_slope(plant: &Plant, dof: Dof, speed: f64) -> f64 {
    let value = |product| plant.coefficient(&Basis::Product(dof, product)).unwrap_or(0.0);
    value(Product::linear(dof)) + 2.0 * value(Product::quadratic(dof)) * speed.abs()
}

/// Computes the margins of an axis of a vehicle with a controller for a plant: the worse of rest
/// and speed.
fn margins_with(
    plant: &Plant,
    truth: &Plant,
    gains: &AxisGains,
    asked: &Design,
    dof: Dof,
) -> Margins {
    let at = |speed: f64| loop_of(plant, truth, gains, asked, dof, speed).margins();
    lesser(at(0.0), at(asked.speed[dof.index()]))
}

/// Returns the loop of an axis of a vehicle with a controller for a plant, linearised at a speed.
pub(crate) fn loop_of(
    plant: &Plant,
    truth: &Plant,
    gains: &AxisGains,
    asked: &Design,
    dof: Dof,
    speed: f64,
) -> Loop {
    let place = truth.axes().iter().position(|axis| *axis == dof);
    let free = truth.mass_matrix().try_inverse().zip(place);
    let lever = |plant: &Plant| plant.coefficient(&Basis::Lever(2)).unwrap_or(0.0);
    let taken = if asked.law.is_model_based() { lever(plant) } else { 0.0 };
    let left = lever(truth) - taken;
    // The force that exact linearisation cancels also acts through lag and delay.
    let slope = if asked.law == Law::Exact { own_slope(plant, dof, speed) } else { 0.0 };
    Loop {
        mass: free.map_or(gains.mass, |(inverse, k)| 1.0 / inverse[(k, k)]),
        damping: own_slope(truth, dof, speed),
        righting: if matches!(dof, Dof::Roll | Dof::Pitch) { left } else { 0.0 },
        kp: gains.kp,
        kd: gains.kd - slope,
        ki: gains.ki,
        lag_s: gains.lag_s,
        delay_s: gains.delay_s,
        period_s: 1.0 / asked.sample_hz,
    }
}

fn refuse_slim(
    plant: &Plant,
    actuators: &Actuators,
    asked: &Design,
    (dof, tuning): (Dof, &Tuning),
    gains: &AxisGains,
) -> Result<(), Error> {
    let phase = |tuning: &Tuning| axis(plant, &[], actuators, asked, dof, tuning).margins.phase_deg;
    let phase_deg = gains.margins.phase_deg;
    if phase_deg >= LEAST_PHASE_DEG {
        return Ok(());
    }
    if let Some(asked_s) = tuning.integral_s.filter(|_| asked.law == Law::Pid) {
        let without = Tuning { integral_s: Some(1e9), ..*tuning };
        if phase(&without) >= LEAST_PHASE_DEG {
            let ok = |s: f64| phase(&Tuning { integral_s: Some(s), ..*tuning }) >= LEAST_PHASE_DEG;
            let least_s = bisected(asked_s, 1e9, ok);
            return Err(Error::Integral { dof, asked_s, least_s });
        }
    }
    let ok = |hz: f64| phase(&Tuning { bandwidth_hz: hz, ..*tuning }) >= LEAST_PHASE_DEG;
    let asked_hz = tuning.bandwidth_hz;
    let reachable_hz = greatest_below(asked_hz, ok);
    let late = format!(
        "a lag of {:.2} s, a delay of {:.2} s and {} samples a second",
        gains.lag_s, gains.delay_s, asked.sample_hz
    );
    let least_deg = LEAST_PHASE_DEG;
    Err(Error::Bandwidth { dof, asked_hz, phase_deg, least_deg, late, reachable_hz })
}

/// Returns the number nearest to `bad` that is good, on a logarithmic scale; `good` if there is
/// none nearer.
fn bisected(bad: f64, good: f64, is_good: impl Fn(f64) -> bool) -> f64 {
    let (mut bad, mut good) = (bad.ln(), good.ln());
    for _ in 0..40 {
        let middle = 0.5 * (bad + good);
        if is_good(middle.exp()) { good = middle } else { bad = middle }
    }
    good.exp()
}

/// Number of trials per decade below a bad number, and number of decades.
const TRIED: (i32, i32) = (12, 4);

/// Returns the greatest number below `bad` that is good; `None` if there is none within four
/// decades.
///
/// Being good is not monotonic: a slow integral on a damped axis also has little phase margin.
fn greatest_below(bad: f64, is_good: impl Fn(f64) -> bool) -> Option<f64> {
    let (in_a_decade, decades) = TRIED;
    let at = |k: i32| bad * 10_f64.powf(-f64::from(k) / f64::from(in_a_decade));
    let first = (1..=in_a_decade * decades).find(|k| is_good(at(*k)))?;
    Some(bisected(at(first - 1), at(first), is_good))
}

/// Returns the growth per step of a vehicle's disturbance under a controller for a plant: the
/// greater of rest and typical speed.
fn grows(
    plant: &Plant,
    truth: &Plant,
    gains: &Gains,
    actuators: &Actuators,
    asked: &Design,
) -> Option<f64> {
    let n = plant.axes().len();
    let of = |pick: &dyn Fn(&AxisGains) -> f64| {
        DMatrix::from_fn(n, n, |i, j| {
            let own = gains.axes.get(&plant.axes()[i]).filter(|_| i == j);
            own.map_or(0.0, pick)
        })
    };
    let mut worst = 0.0_f64;
    for speed in [Vector6::zeros(), Vector6::from(asked.speed)] {
        let mut kd = of(&|axis| axis.kd);
        if asked.law == Law::Exact {
            for (i, dof) in plant.axes().iter().enumerate() {
                if gains.axes.contains_key(dof) {
                    kd[(i, i)] -= own_slope(plant, *dof, speed[dof.index()]);
                }
            }
        }
        let linear = LinearGains { kp: of(&|axis| axis.kp), kd, ki: of(&|axis| axis.ki) };
        let mut left = righting(truth);
        if asked.law.is_model_based() {
            // The model cancels its own righting moment of controlled axes.
            let taken = righting(plant);
            for (i, dof) in plant.axes().iter().enumerate() {
                if gains.axes.contains_key(dof) {
                    left[(i, i)] -= taken[(i, i)];
                }
            }
        }
        let forces = (&slope(truth, &speed), &left);
        worst = worst.max(growth(truth, forces, &linear, actuators, 1.0 / asked.sample_hz)?);
    }
    Some(worst)
}

/// Growth above which the loop counts as unstable: unused integrals, and positions of uncontrolled
/// axes, remain constant.
const STABLE: f64 = 1.0 + 1e-6;

/// Returns the greatest fraction of the bandwidths with which the loop is stable, if there is one.
fn stable_part(plant: &Plant, actuators: &Actuators, asked: &Design) -> Option<f64> {
    let is_good = |part: f64| {
        let mut less = asked.clone();
        less.tuning.values_mut().for_each(|tuning| tuning.bandwidth_hz *= part);
        less.anyway = true;
        checked(plant, &[], actuators, &less)
            .ok()
            .and_then(|gains| grows(plant, plant, &gains, actuators, &less))
            .is_some_and(|growth| growth <= STABLE)
    };
    greatest_below(1.0, is_good)
}

fn notes(plant: &Plant, gains: &Gains, own: f64) -> Vec<String> {
    let mut notes = Vec::new();
    for (dof, axis) in &gains.axes {
        if axis.margins.phase_deg < LEAST_PHASE_DEG {
            notes.push(format!(
                "{dof}: the phase margin is {:.0}°; the loop hardly damps its own oscillation",
                axis.margins.phase_deg
            ));
        }
        if axis.worst.phase_deg < TOLD_PHASE_DEG {
            notes.push(format!(
                "{dof}: for the worst plant drawn from its uncertainty the phase margin falls to {:.0}°",
                axis.worst.phase_deg
            ));
        }
    }
    let with = |is_so: &dyn Fn(&AxisGains) -> bool| {
        let axes = gains.axes.iter().filter(|(_, axis)| is_so(axis));
        let names: Vec<&str> = axes.map(|(dof, _)| dof.name()).collect();
        (!names.is_empty()).then(|| names.join(", "))
    };
    if let Some(axes) = with(&|axis| axis.limit.is_none()) {
        notes.push(format!(
            "{axes}: the greatest force is not known, so that saturation is not counted with; give it by --limit"
        ));
    }
    if let Some(axes) = with(&|axis| axis.lag_s == 0.0 && axis.delay_s == 0.0) {
        notes.push(format!(
            "{axes}: neither lag nor delay of thrust is known; real margins are smaller"
        ));
    }
    if own > STABLE {
        notes.push(format!("the closed loop is unstable: disturbances grow by {own:.3} a step"));
    }
    if gains.probability_unstable > 0.0 {
        notes.push(format!(
            "with {:.0} % of {} draws of the plant the loop is unstable",
            100.0 * gains.probability_unstable,
            gains.draws
        ));
    }
    if gains.draws == 0 {
        notes.push("the plant has no covariance: worst cases are those of the estimate".to_owned());
    }
    let alone: Vec<&str> = plant
        .axes()
        .iter()
        .filter(|dof| !gains.axes.contains_key(dof))
        .map(|dof| dof.name())
        .collect();
    if !alone.is_empty() {
        notes.push(format!("not controlled: {}", alone.join(", ")));
    }
    notes
}

/// Reads gains from a file in which [`Gains`] were written as TOML.
///
/// # Errors
/// [`Error::Gains`] with the key that is wrong.
pub fn gains_of_toml(text: &str) -> Result<Gains, Error> {
    let refuse = |reason: String| Error::Gains { reason };
    let gains: Gains = toml::from_str(text).map_err(|error| refuse(error.to_string()))?;
    if gains.schema != GAINS_SCHEMA {
        return Err(refuse(format!(
            "have schema `{}`; this version reads `{GAINS_SCHEMA}`",
            gains.schema
        )));
    }
    Ok(gains)
}
