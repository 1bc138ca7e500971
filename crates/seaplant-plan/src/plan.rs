//! From a prior, goals and limits to a plan.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use seaplant::estimate::ExpectedNoises;
use seaplant::exchange::Draws;
use seaplant::plant::{Basis, Plant, Product};
use seaplant::{Dof, Vehicle};
use serde::{Deserialize, Serialize};

use crate::allocate::{Allocation, Criterion, Program, Target, inverse};
use crate::drive::{Pilot, Sea, drive};
use crate::goal::{Goal, HALF_95, Scale};
use crate::limits::Limits;
use crate::logging::Logging;
use crate::manoeuvre::{Kind, Manoeuvre, driving_force, library, refinements, unplanned};
use crate::prior::Prior;
use crate::rig::Rig;
use crate::wave::seed_of;
use crate::weigh::{Bench, Candidate};
use crate::{Error, parallel};

/// The schema of [`Plan`] in files.
pub const PLAN_SCHEMA: &str = "seaplant/trial-plan/1";

/// What a plan is made for; every field has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Request {
    /// What is to be known; mass to 5 % and drag to 10 % of every axis that is pushed if empty.
    pub goals: Vec<Goal>,
    /// What the minutes are to make small.
    pub criterion: Criterion,
    /// Minutes of driving; as many as the goals need if left out.
    pub minutes: Option<f64>,
    /// What must not be exceeded.
    pub limits: Limits,
    /// What is logged.
    pub logging: Logging,
    /// Standard deviation of the disturbance on each axis, as a part of the force that drives it within
    /// the limits; that of the trials where results state one.
    pub disturbance_part: f64,
    /// Its correlation time, s.
    pub disturbance_correlation_s: f64,
    /// The current that is expected, north and east, m/s.
    pub current_m_s: [f64; 2],
    /// The input of full thrust from neutral, for curves that state no end, in their own unit.
    pub full_input: Option<f64>,
    /// How many plants that the vehicle may have the plan is averaged over.
    pub draws: usize,
    /// Runs in disturbances that check the limits.
    pub checks: usize,
    /// Whether the minutes are compared with those of what is driven without a plan.
    pub compare: bool,
    /// Where all random numbers start.
    pub seed: u64,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            goals: Vec::new(),
            criterion: Criterion::default(),
            minutes: None,
            limits: Limits::default(),
            logging: Logging::default(),
            disturbance_part: 0.03,
            disturbance_correlation_s: 10.0,
            current_m_s: [0.0; 2],
            full_input: None,
            draws: 4,
            checks: 100,
            compare: false,
            seed: 1,
        }
    }
}

/// A plan: what to drive for how long, and what will be known then.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Plan {
    /// [`PLAN_SCHEMA`].
    pub schema: String,
    /// What the vehicle is called.
    pub vehicle: String,
    /// The axes of its plant.
    pub axes: Vec<Dof>,
    /// Where the believed plant comes from, and how well it is known.
    pub prior: String,
    /// What was asked for.
    pub request: Request,
    /// What to drive, in order.
    pub manoeuvres: Vec<Planned>,
    /// Minutes of driving.
    pub minutes: f64,
    /// Minutes that the goals need with these shares; none if no time is enough.
    pub minutes_needed: Option<f64>,
    /// What will be known of the goals.
    pub goals: Vec<Forecast>,
    /// What will be known of every coefficient.
    pub coefficients: Vec<Forecast>,
    /// How near the minutes are to the best ones.
    pub certificate: Certificate,
    /// Minutes that each kind of unplanned driving needs for the same goals, axis by axis in equal
    /// parts, where that was asked for; none of one for which no time is enough.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub unplanned: BTreeMap<Kind, Option<f64>>,
    /// Half 95 % intervals of the goals against minutes.
    pub chart: Chart,
    /// Runs in disturbances.
    pub check: LimitCheck,
    /// What to mend before the dive.
    pub doubts: Vec<String>,
    /// What a reader must know besides.
    pub notes: Vec<String>,
}

/// A manoeuvre with its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Planned {
    /// What to drive.
    pub manoeuvre: Manoeuvre,
    /// For how long.
    pub minutes: f64,
    /// Its share of the time before it was rounded.
    pub share: f64,
    /// Least and greatest velocity of each driven axis, m/s and rad/s.
    pub velocity: BTreeMap<Dof, [f64; 2]>,
    /// The limit that keeps it from stronger forces.
    pub limited_by: String,
    /// In words.
    pub words: String,
}

/// What will be known of a number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Forecast {
    /// Which.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// As it is believed.
    pub value: f64,
    /// Half of its 95 % interval today; none of what nothing is known.
    pub before: Option<f64>,
    /// Half of its 95 % interval after the trial, by the trial and what trials told before.
    pub after: f64,
    /// What it is to be, of a goal.
    pub goal: Option<f64>,
}

impl Forecast {
    /// Whether a goal is met.
    pub fn is_met(&self) -> bool {
        self.goal.is_none_or(|goal| self.after <= goal * (1.0 + ROUNDED))
    }
}

/// Minutes are whole halves: so much wider than its goal an interval still meets it.
const ROUNDED: f64 = 0.02;

/// How near the minutes are to the best ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Certificate {
    /// What was made small.
    pub criterion: Criterion,
    /// By which part intervals could be narrower with other shares of these manoeuvres, at most.
    pub gap: f64,
    /// How many manoeuvres were weighed.
    pub candidates: usize,
}

/// Half 95 % intervals against minutes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Chart {
    /// Minutes.
    pub minutes: Vec<f64>,
    /// Of each goal, as a part of its value.
    pub parts: BTreeMap<String, Vec<f64>>,
}

/// Runs in disturbances, each with another plant that the vehicle may have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitCheck {
    /// How many.
    pub runs: usize,
    /// How many went beyond a limit.
    pub broken: usize,
    /// The greatest part of a limit that was used.
    pub greatest: f64,
    /// Which limit that was.
    pub of: String,
}

/// Time comes in these, minutes.
const STEP_MIN: f64 = 0.5;
/// A manoeuvre of a share below this is left out if intervals widen by less than this part without it.
const WORTH: f64 = 0.02;
/// A manoeuvre of more than this share is refined.
const REFINED: f64 = 0.08;
/// Between which the time is sought that goals need, minutes.
const TIMES_MIN: [f64; 2] = [2.0, 600.0];
/// The time of which information is weighed first, minutes.
const FIRST_MIN: f64 = 30.0;
/// Drag is wanted at this part of the greatest speed that limits and thrust allow.
const DRAG_AT: f64 = 0.7;
/// A goal whose interval would be wider than so many times what is wanted with every manoeuvre at full
/// time is not excited.
const NOT_EXCITED: f64 = 20.0;

/// Plans a trial.
///
/// # Errors
/// [`Error::Limit`] and [`Error::Setting`] for what cannot be, [`Error::NoMotion`] if limits forbid
/// every manoeuvre, [`Error::Goal`] and [`Error::NotExcited`] for a goal without a coefficient or
/// without a manoeuvre, with the limit that is in the way.
///
/// # Example
/// ```
/// use seaplant::{QuadraticThrust, ThrustCurve, Thruster, ThrusterInput, Vehicle};
/// use seaplant_plan::{Prior, Request, plan};
/// let law = QuadraticThrust { forward: 40.0, reverse: 30.0, ..QuadraticThrust::default() };
/// let curve = ThrustCurve::Quadratic { input: ThrusterInput::Command, law };
/// let vehicle = Vehicle {
///     name: "sled".to_owned(),
///     dry_mass_kg: Some(100.0),
///     size_m: Some([1.2, 0.5, 0.5]),
///     thrusters: vec![Thruster::new("main", [0.0; 3], [1.0, 0.0, 0.0], curve)?],
///     ..Vehicle::default()
/// };
/// let prior = Prior::of_vehicle(&vehicle, &[])?;
/// let request = Request { draws: 2, checks: 2, ..Request::default() };
/// let made = plan(&prior, &vehicle, &request)?;
/// assert!(made.minutes_needed.is_some() && made.certificate.gap < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn plan(prior: &Prior, vehicle: &Vehicle, request: &Request) -> Result<Plan, Error> {
    check(request)?;
    let rig = Rig::new(&prior.model, request.limits.thrust_part, request.full_input)?;
    let plants = prior.plants(Draws { count: request.draws, seed: request.seed })?;
    let noises = noises(prior, &rig, request);
    let bench = Bench {
        plants: &plants,
        vehicle,
        rig: &rig,
        limits: &request.limits,
        logging: &request.logging,
        noises: &noises,
        current: request.current_m_s,
        seed: request.seed,
    };
    let tried = bench.candidates(&library(&plants[0], &rig, &request.limits, request.seed))?;
    let (mut used, refused): (Vec<Candidate>, Vec<Candidate>) =
        tried.into_iter().partition(|candidate| candidate.factor > 0.0);
    if used.is_empty() {
        return Err(no_motion(&refused, request));
    }
    let work = Work::new(prior, &bench, request)?;
    work.check_goals(&used, &refused)?;
    let mut seconds = 60.0 * request.minutes.unwrap_or(FIRST_MIN);
    let mut allocation = work.program(&used, seconds).solve()?;
    let more: Vec<Manoeuvre> = used
        .iter()
        .zip(&allocation.shares)
        .filter(|(_, share)| **share > REFINED)
        .flat_map(|(candidate, _)| refinements(&candidate.manoeuvre))
        .filter(|new| used.iter().all(|old| old.manoeuvre.name != new.name))
        .collect();
    used.extend(bench.candidates(&more)?.into_iter().filter(|candidate| candidate.factor > 0.0));
    allocation = work.program(&used, seconds).solve()?;
    let needed = work.seconds_needed(&used, &allocation.shares);
    if request.minutes.is_none() {
        let most = 60.0 * TIMES_MIN[1];
        seconds = needed.unwrap_or(most);
        if work.knows_already() {
            allocation = work.program(&used, seconds).solve()?;
        }
    }
    work.finished(&used, &allocation, seconds, needed)
}

fn check(request: &Request) -> Result<(), Error> {
    request.limits.check()?;
    request.logging.check()?;
    let refuse = |name, found: String, expected| Err(Error::Setting { name, found, expected });
    if let Some(minutes) = request.minutes
        && !(1.0..=1440.0).contains(&minutes)
    {
        return refuse("minutes", minutes.to_string(), "from 1 to 1440");
    }
    if !(request.disturbance_part > 0.0 && request.disturbance_part <= 1.0) {
        let found = request.disturbance_part.to_string();
        return refuse("disturbance_part", found, "above 0 and at most 1");
    }
    if !(request.disturbance_correlation_s >= 0.2 && request.disturbance_correlation_s <= 300.0) {
        let found = request.disturbance_correlation_s.to_string();
        return refuse("disturbance_correlation_s", found, "from 0.2 to 300 s");
    }
    if !(1..=64).contains(&request.draws) {
        return refuse("draws", request.draws.to_string(), "from 1 to 64");
    }
    if !request.current_m_s.iter().all(|x| x.is_finite() && x.abs() < 5.0) {
        let found = format!("{:?}", request.current_m_s);
        return refuse("current_m_s", found, "north and east, below 5 m/s each");
    }
    if let Some(full) = request.full_input
        && !(full > 0.0 && full.is_finite())
    {
        return refuse("full_input", full.to_string(), "above 0");
    }
    Ok(())
}

impl Plan {
    /// What the plan expects of disturbances and instruments.
    pub(crate) fn noises(&self, prior: &Prior, rig: &Rig) -> ExpectedNoises {
        noises(prior, rig, &self.request)
    }
}

/// What disturbs each axis, as trials told, or as a part of the force that drives it.
fn noises(prior: &Prior, rig: &Rig, request: &Request) -> ExpectedNoises {
    let plant = &prior.model.plant;
    let of = |dof: &Dof| {
        let known = prior.model.disturbances.get(dof).map(|own| (own.std, own.correlation_s));
        let driving = driving_force(plant, rig, &request.limits, *dof);
        let force = driving.unwrap_or_else(|| resistance(plant, *dof, &request.limits));
        let part = request.disturbance_part * force;
        (*dof, known.unwrap_or((part, request.disturbance_correlation_s)))
    };
    let disturbances = plant.axes().iter().map(of).collect();
    request.logging.noises(&disturbances)
}

/// The force that an axis that nothing pushes resists with at its limits.
fn resistance(plant: &Plant, dof: Dof, limits: &Limits) -> f64 {
    let value = |term: Basis| plant.coefficient(&term).unwrap_or(0.0).abs();
    let v = if dof.is_rotation() { limits.rate_rad_s } else { limits.speed_m_s };
    let drag = value(Basis::Product(dof, Product::linear(dof))) * v
        + value(Basis::Product(dof, Product::quadratic(dof))) * v * v;
    let tilts = matches!(dof, Dof::Roll | Dof::Pitch);
    let righting = if tilts { value(Basis::Lever(2)) * limits.tilt_rad } else { 0.0 };
    drag.max(righting).max(1e-3 * value(Basis::Mass(dof, dof)))
}

fn no_motion(refused: &[Candidate], request: &Request) -> Error {
    let mut limits: Vec<&str> = refused.iter().map(|candidate| candidate.limit).collect();
    limits.sort_unstable();
    limits.dedup();
    let said = limits.iter().map(|limit| said_limit(limit, &request.limits)).collect::<Vec<_>>();
    Error::NoMotion { reason: format!("{}; widen these", said.join(", ")) }
}

/// A limit with its value.
fn said_limit(name: &str, limits: &Limits) -> String {
    match name {
        "box_m" => format!("box_m = [{}, {}]", limits.box_m[0], limits.box_m[1]),
        "depth_m" => format!("depth_m = [{}, {}]", limits.depth_m[0], limits.depth_m[1]),
        "speed_m_s" => format!("speed_m_s = {}", limits.speed_m_s),
        "rate_rad_s" => format!("rate_rad_s = {}", limits.rate_rad_s),
        "tilt_rad" => format!("tilt_rad = {}", limits.tilt_rad),
        "tether_m" => format!("tether_m = {}", limits.tether_m.unwrap_or(f64::INFINITY)),
        _ => format!("thrust_part = {}", limits.thrust_part),
    }
}

/// What all steps after the weighing share.
struct Work<'a> {
    prior: &'a Prior,
    bench: &'a Bench<'a>,
    request: &'a Request,
    scale: Scale<'a>,
    goals: Vec<Goal>,
    targets: Vec<Target>,
    names: Vec<String>,
    /// What is known before: of a fit's actuator, and by trials before.
    before: DMatrix<f64>,
}

impl<'a> Work<'a> {
    fn new(prior: &'a Prior, bench: &'a Bench<'a>, request: &'a Request) -> Result<Self, Error> {
        let first = bench.before();
        let terms = bench.plants[0].structure().terms().len();
        let scale = Scale {
            plants: bench.plants,
            rig: bench.rig,
            speed: (DRAG_AT * request.limits.speed_m_s, DRAG_AT * request.limits.rate_rad_s),
            thrust_part: prior.thrust_part,
            more: first.names.len() - terms,
        };
        let goals = if request.goals.is_empty() { scale.usual() } else { request.goals.clone() };
        let targets = goals.iter().map(|goal| scale.target(goal)).collect::<Result<_, _>>()?;
        let mut before = first.matrix;
        if let Some(known) = today(prior, &first.names) {
            before += known;
        }
        Ok(Self { prior, bench, request, scale, goals, targets, names: first.names, before })
    }

    fn knows_already(&self) -> bool {
        self.prior.known.is_some()
    }

    fn program(&self, used: &[Candidate], seconds: f64) -> Program {
        Program {
            rates: used.iter().map(|candidate| candidate.rates.clone()).collect(),
            before: self.before.clone(),
            targets: self.targets.clone(),
            criterion: self.request.criterion,
            seconds,
        }
    }

    /// Refuses goals that no manoeuvre serves, with the limit that is in the way.
    fn check_goals(&self, used: &[Candidate], refused: &[Candidate]) -> Result<(), Error> {
        let all = self.program(used, 60.0 * TIMES_MIN[1] * used.len() as f64);
        let shares = vec![1.0 / used.len() as f64; used.len()];
        let ratios = all.ratios(&shares);
        for (k, goal) in self.goals.iter().enumerate() {
            let wide = ratios.as_ref().is_none_or(|ratios| ratios[k].sqrt() > NOT_EXCITED);
            if !wide {
                continue;
            }
            let axes = self.axes_of(&goal.name);
            let unpushed = axes.iter().find(|dof| self.bench.rig.most[dof.index()] == 0.0);
            if ratios.is_none() && unpushed.is_none() && refused.is_empty() {
                continue;
            }
            let limits = &self.request.limits;
            let reason = match unpushed {
                Some(dof) => format!("the thrusters do not push {dof} by itself"),
                None => {
                    let own = refused.iter().chain(used);
                    let own = own.filter(|candidate| {
                        candidate.manoeuvre.axes.iter().any(|dof| axes.contains(dof))
                    });
                    let mut in_way: Vec<String> =
                        own.map(|candidate| said_limit(candidate.limit, limits)).collect();
                    in_way.sort();
                    in_way.dedup();
                    format!("{} is in the way", in_way.join(" or "))
                }
            };
            return Err(Error::NotExcited { goal: goal.name.clone(), limit: reason });
        }
        Ok(())
    }

    /// The axes that a goal is about.
    fn axes_of(&self, name: &str) -> Vec<Dof> {
        let structure = self.bench.plants[0].structure();
        match structure.term_named(name) {
            Some(term) => structure.axes_of(&term),
            None => name.split('.').filter_map(|word| word.parse().ok()).collect(),
        }
    }

    /// The time at which all goals are met, shares being as they are.
    fn seconds_needed(&self, used: &[Candidate], shares: &[f64]) -> Option<f64> {
        let meets = |minutes: f64| {
            let ratios = self.program(used, 60.0 * minutes).ratios(shares);
            ratios.is_some_and(|ratios| ratios.iter().all(|ratio| *ratio <= 1.0))
        };
        let [mut low, mut high] = TIMES_MIN;
        if !meets(high) {
            return None;
        }
        if meets(low) {
            return Some(60.0 * low);
        }
        for _ in 0..40 {
            let middle = (low * high).sqrt();
            if meets(middle) { high = middle } else { low = middle }
        }
        Some(60.0 * high)
    }

    fn finished(
        &self,
        used: &[Candidate],
        allocation: &Allocation,
        seconds: f64,
        needed: Option<f64>,
    ) -> Result<Plan, Error> {
        let shares = self.worth_driving(used, &allocation.shares, seconds);
        let minutes = rounded(&shares, seconds / 60.0);
        let total: f64 = minutes.iter().sum();
        let shares: Vec<f64> = minutes.iter().map(|x| x / total).collect();
        let program = self.program(used, 60.0 * total);
        let singular = || Error::Allocation { reason: "the information is singular".to_owned() };
        let goals = self.forecasts(&program, &shares).ok_or_else(singular)?;
        let coefficients = self.of_coefficients(&program, &shares).ok_or_else(singular)?;
        let chart = self.chart(used, &shares, total);
        let driven = used.iter().zip(&minutes).zip(&allocation.shares);
        let mut manoeuvres: Vec<Planned> = driven
            .filter(|((_, minutes), _)| **minutes > 0.0)
            .map(|((candidate, minutes), share)| self.planned(candidate, *minutes, *share))
            .collect();
        // The long and slow first: what fails then is seen early.
        manoeuvres.sort_by(|a, b| b.minutes.total_cmp(&a.minutes));
        let check = self.limit_check(&manoeuvres)?;
        let unplanned = match self.request.compare {
            true => self.unplanned()?,
            false => BTreeMap::new(),
        };
        let of_plan: Vec<&Manoeuvre> = manoeuvres.iter().map(|one| &one.manoeuvre).collect();
        let axes = self.bench.plants[0].axes().to_vec();
        let lag_s = self.bench.rig.lag_s;
        let doubts = self.request.logging.doubts(&axes, lag_s, &of_plan);
        let notes = self.notes(&goals, needed, total);
        Ok(Plan {
            schema: PLAN_SCHEMA.to_owned(),
            vehicle: self.prior.model.name.clone(),
            axes,
            prior: self.prior.words.clone(),
            request: self.request.clone(),
            manoeuvres,
            minutes: total,
            minutes_needed: needed.map(|seconds| seconds / 60.0),
            goals,
            coefficients,
            certificate: Certificate {
                criterion: self.request.criterion,
                gap: allocation.gap,
                candidates: used.len(),
            },
            unplanned,
            chart,
            check,
            doubts,
            notes,
        })
    }

    /// Shares without those that hardly narrow an interval, the least first.
    fn worth_driving(&self, used: &[Candidate], shares: &[f64], seconds: f64) -> Vec<f64> {
        let program = self.program(used, seconds);
        let widest = |shares: &[f64]| {
            let ratios = program.ratios(shares)?;
            Some(ratios.into_iter().fold(0.0, f64::max))
        };
        let mut kept = shares.to_vec();
        let mut order: Vec<usize> = (0..shares.len()).filter(|k| shares[*k] < WORTH).collect();
        order.sort_by(|a, b| shares[*a].total_cmp(&shares[*b]));
        for k in order {
            let (share, before) = (kept[k], widest(&kept));
            kept[k] = 0.0;
            let after = widest(&kept);
            let is_needed = match (before, after) {
                (Some(before), Some(after)) => after > before * (1.0 + WORTH),
                _ => true,
            };
            if is_needed {
                kept[k] = share;
            }
        }
        let sum: f64 = kept.iter().sum();
        kept.iter().map(|share| share / sum).collect()
    }

    fn forecasts(&self, program: &Program, shares: &[f64]) -> Option<Vec<Forecast>> {
        let ratios = program.ratios(shares)?;
        let today = today(self.prior, &self.names);
        let believed = &self.bench.plants[0];
        let of = |(k, goal): (usize, &Goal)| {
            let own = self.scale.combination(believed, &goal.name).ok()?;
            let target = &self.targets[k];
            let off = if own.scales { self.prior.thrust_part * own.value } else { 0.0 };
            let with = |variance: f64| HALF_95 * (variance + off * off).sqrt();
            let before = today.as_ref().and_then(|_| self.variance_today(&own.weights));
            Some(Forecast {
                name: goal.name.clone(),
                unit: own.unit,
                value: own.value,
                before: before.map(with),
                after: with(ratios[k] * target.std * target.std),
                goal: Some(with(target.std * target.std)),
            })
        };
        self.goals.iter().enumerate().map(of).collect()
    }

    /// The variance that a combination has by the trials before.
    fn variance_today(&self, weights: &DVector<f64>) -> Option<f64> {
        let (names, covariance) = self.prior.known.as_ref()?;
        let places: Vec<(usize, f64)> = self
            .names
            .iter()
            .zip(weights.iter())
            .filter(|(_, weight)| **weight != 0.0)
            .map(|(name, weight)| {
                names.iter().position(|own| own == name).map(|place| (place, *weight))
            })
            .collect::<Option<_>>()?;
        let pairs = places.iter().flat_map(|a| places.iter().map(move |b| (a, b)));
        Some(pairs.map(|((i, a), (j, b))| a * b * covariance[(*i, *j)]).sum::<f64>().max(0.0))
    }

    fn of_coefficients(&self, program: &Program, shares: &[f64]) -> Option<Vec<Forecast>> {
        let believed = &self.bench.plants[0];
        let terms = believed.structure().terms();
        let mut matrix = self.before.clone();
        for (share, rates) in shares.iter().zip(&program.rates) {
            matrix += &rates[0] * (share * program.seconds);
        }
        let covariance = inverse(&matrix)?;
        let of = |(k, name): (usize, &String)| {
            let value = believed.coefficients().get(k).copied();
            let off = value.map_or(0.0, |value| self.prior.thrust_part * value);
            let weights = DVector::from_fn(self.names.len(), |i, _| f64::from(u8::from(i == k)));
            let before = self.variance_today(&weights);
            let with = |variance: f64| HALF_95 * (variance + off * off).sqrt();
            Forecast {
                name: name.clone(),
                unit: terms
                    .get(k)
                    .map_or("s".to_owned(), |term| believed.structure().unit_of(term)),
                value: value.unwrap_or(self.bench.rig.lag_s),
                before: before.map(with),
                after: with(covariance[(k, k)]),
                goal: None,
            }
        };
        Some(self.names.iter().enumerate().take(terms.len()).map(of).collect())
    }

    fn chart(&self, used: &[Candidate], shares: &[f64], total: f64) -> Chart {
        let minutes: Vec<f64> = (1..=20).map(|k| 0.1 * total * f64::from(k)).collect();
        let mut parts: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for at in &minutes {
            let found = self.forecasts(&self.program(used, 60.0 * at), shares).unwrap_or_default();
            for forecast in found.into_iter().filter(|forecast| forecast.value != 0.0) {
                let part = forecast.after / forecast.value.abs();
                parts.entry(forecast.name).or_default().push(part);
            }
        }
        Chart { minutes, parts }
    }

    /// Minutes that driving without a plan needs.
    fn unplanned(&self) -> Result<BTreeMap<Kind, Option<f64>>, Error> {
        let bench = self.bench;
        let of = |kind: Kind| {
            let all = unplanned(kind, &bench.plants[0], bench.rig, bench.limits, self.request.seed);
            let mut driven = bench.candidates(&all)?;
            driven.retain(|candidate| candidate.factor > 0.0);
            let count = driven.len().max(1);
            let shares = vec![1.0 / count as f64; driven.len()];
            let seconds = self.seconds_needed(&driven, &shares);
            Ok((kind, seconds.map(|seconds| seconds / 60.0)))
        };
        [Kind::SinusoidAndJoystick, Kind::Sweep].into_iter().map(of).collect()
    }

    fn planned(&self, candidate: &Candidate, minutes: f64, share: f64) -> Planned {
        let manoeuvre = candidate.manoeuvre.clone();
        let velocity: BTreeMap<Dof, [f64; 2]> =
            manoeuvre.axes.iter().map(|dof| (*dof, candidate.velocity[dof.index()])).collect();
        let words = crate::spoken::of_manoeuvre(&manoeuvre, minutes, &velocity);
        let limited_by = candidate.limit.to_owned();
        Planned { manoeuvre, minutes, share, velocity, limited_by, words }
    }

    /// Drives every manoeuvre many times, each time with another plant and other disturbances.
    fn limit_check(&self, manoeuvres: &[Planned]) -> Result<LimitCheck, Error> {
        let runs = self.request.checks;
        let seed = seed_of(self.request.seed, "check");
        let plants = self.prior.draws(runs.clamp(1, 64), seed)?;
        let run = |k: usize| {
            let planned = &manoeuvres[k % manoeuvres.len()];
            let pilot = Pilot::new(
                &self.bench.plants[0],
                self.bench.rig,
                self.bench.limits,
                &planned.manoeuvre,
            );
            let noises = self.bench.noises;
            let sea = Sea { noises, current: self.request.current_m_s, seed: seed ^ k as u64 };
            let seconds = (60.0 * planned.minutes).min(LONGEST_CHECK_S);
            drive(&plants[k % plants.len()], &pilot, seconds, Some(sea)).map(|driven| driven.worst)
        };
        let all = parallel::of_each(runs, run);
        let mut check = LimitCheck { runs, broken: 0, greatest: 0.0, of: "none".to_owned() };
        for worst in all {
            match worst {
                Ok(worst) => {
                    check.broken += usize::from(worst.part > 1.0);
                    if worst.part > check.greatest {
                        (check.greatest, check.of) = (worst.part, worst.of.to_owned());
                    }
                }
                // A motion that runs away is beyond every limit.
                Err(_) => check.broken += 1,
            }
        }
        Ok(check)
    }

    fn notes(&self, goals: &[Forecast], needed: Option<f64>, total: f64) -> Vec<String> {
        let mut notes = Vec::new();
        let missed: Vec<&str> =
            goals.iter().filter(|goal| !goal.is_met()).map(|goal| goal.name.as_str()).collect();
        if !missed.is_empty() {
            let time = match needed {
                Some(seconds) => format!("they need {:.0} min", (seconds / 60.0).ceil()),
                None => format!("{:.0} min would not be enough", TIMES_MIN[1]),
            };
            notes.push(format!("{:.1} min do not reach {}: {time}", total, missed.join(", ")));
        }
        if self.prior.thrust_part > 0.0 {
            notes.push(format!(
                "thrust is uncertain by {:.1} %, which no motion narrows; intervals include it",
                100.0 * self.prior.thrust_part
            ));
        }
        if let Some(minutes) = self.request.minutes
            && total > minutes + STEP_MIN
        {
            notes.push(format!(
                "no manoeuvre is driven for less than a minute, so that {minutes} min become {total}; ask for fewer goals to have fewer manoeuvres"
            ));
        }
        notes.push(
            "intervals are those that the filter error method states for the usual terms; couplings in damping that a search adds widen them".to_owned(),
        );
        if self.request.logging.position_hz == 0.0 {
            notes.push(
                "position is not logged: on board, the box is kept by the position that the vehicle estimates from velocity".to_owned(),
            );
        }
        notes
    }
}

/// A run of the check lasts no longer, s.
const LONGEST_CHECK_S: f64 = 180.0;

/// What trials told before, as information on some numbers.
fn today(prior: &Prior, names: &[String]) -> Option<DMatrix<f64>> {
    let (known, covariance) = prior.known.as_ref()?;
    let information = inverse(covariance)?;
    let place = |name: &String| known.iter().position(|own| own == name);
    let places: Vec<Option<usize>> = names.iter().map(place).collect();
    Some(DMatrix::from_fn(names.len(), names.len(), |i, j| match (places[i], places[j]) {
        (Some(a), Some(b)) => information[(a, b)],
        _ => 0.0,
    }))
}

/// Whole steps of time for shares of it, at least two of one that is driven.
fn rounded(shares: &[f64], minutes: f64) -> Vec<f64> {
    let steps = (minutes / STEP_MIN).round().max(LEAST_STEPS);
    let exact: Vec<f64> = shares.iter().map(|share| share * steps).collect();
    let least = |x: &f64| if *x > 0.0 { x.floor().max(LEAST_STEPS) } else { 0.0 };
    let mut whole: Vec<f64> = exact.iter().map(least).collect();
    let mut order: Vec<usize> = (0..exact.len()).filter(|k| exact[*k] > 0.0).collect();
    order.sort_by(|a, b| (exact[*b] - whole[*b]).total_cmp(&(exact[*a] - whole[*a])));
    let left = (steps - whole.iter().sum::<f64>()).max(0.0) as usize;
    for k in order.iter().cycle().take(if order.is_empty() { 0 } else { left }) {
        whole[*k] += 1.0;
    }
    whole.iter().map(|x| x * STEP_MIN).collect()
}

/// A manoeuvre lasts at least so many steps of time.
const LEAST_STEPS: f64 = 2.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minutes_are_whole_halves_and_nothing_is_driven_for_seconds() {
        let minutes = rounded(&[0.505, 0.31, 0.185, 0.0], 10.0);
        assert_eq!(minutes.iter().sum::<f64>(), 10.0);
        assert_eq!(minutes[3], 0.0);
        assert!(minutes[..3].iter().all(|x| *x >= 1.0 && (x / STEP_MIN).fract() == 0.0));
    }
}
