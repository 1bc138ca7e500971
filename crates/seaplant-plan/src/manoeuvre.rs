//! Library of manoeuvres.

use std::collections::BTreeMap;
use std::ops::Range;

use schemars::JsonSchema;
use seaplant::motion::KnownForce;
use seaplant::plant::{Basis, Plant, Product};
use seaplant::{Dof, axes_by_name};
use serde::{Deserialize, Serialize};

use crate::hold::{TILTS, upright_rad_s};
use crate::limits::Limits;
use crate::rig::Rig;
use crate::wave::{Wave, seed_of};
use crate::weight::HungWeight;

/// The kind of manoeuvre.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Harmonics with a low crest factor, on one axis.
    Multisine,
    /// The same on all axes at once, each with other harmonics.
    AllAxes,
    /// Levels as a pilot holds them on a joystick.
    Joystick,
    /// Equally long both ways, then rest.
    Doublet,
    /// Ahead, with alternating heading.
    Zigzag,
    /// Ahead while turning one way, then the other.
    Circle,
    /// Ahead while turning faster and faster, one way, then the other.
    Spiral,
    /// Ahead until steady, stop, astern, stop.
    StopAndGo,
    /// Down until steady, and up.
    AscentAndDescent,
    /// Tilted, then released.
    Release,
    /// Thrusters that act against each other while the vehicle surges.
    OpposingThrusters,
    /// Hover, with a known weight hung on and taken off.
    HoverWithWeight,
    /// One sinusoid and joystick steps together, as in the paper, for comparison.
    SinusoidAndJoystick,
    /// Harmonics with Schroeder's phases, which sweep through their frequencies, for comparison.
    Sweep,
}

impl Kind {
    /// Returns the name in words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Multisine => "multisine",
            Self::AllAxes => "multisine of all axes",
            Self::Joystick => "joystick steps",
            Self::Doublet => "doublets",
            Self::Zigzag => "zigzag",
            Self::Circle => "circles",
            Self::Spiral => "spirals",
            Self::StopAndGo => "stop and go",
            Self::AscentAndDescent => "ascent and descent",
            Self::Release => "tilt and release",
            Self::OpposingThrusters => "opposing thrusters",
            Self::HoverWithWeight => "hover with weight",
            Self::SinusoidAndJoystick => "sinusoid and joystick",
            Self::Sweep => "sweep",
        }
    }
}

/// A manoeuvre: forces in time, and the controller of the axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Manoeuvre {
    /// Its name in files: `surge-multisine-20s`.
    pub name: String,
    /// The kind of manoeuvre.
    pub kind: Kind,
    /// The axes that are driven.
    #[serde(deserialize_with = "axes_by_name")]
    #[schemars(with = "Vec<Dof>")]
    pub axes: Vec<Dof>,
    /// The longest period in it, s.
    pub period_s: f64,
    /// Force on each axis, N and N m.
    pub waves: BTreeMap<Dof, Wave>,
    /// Thrust that cancels, by thruster, and its time course, for opposing thrusters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opposing: Option<(Vec<f64>, Wave)>,
    /// The weight that hangs on the vehicle in the first half of every period.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight: Option<HungWeight>,
    /// Natural frequency of the controller of each axis, rad/s; zero for an axis without control.
    pub hold_rad_s: [f64; 6],
}

impl Manoeuvre {
    /// Scales all forces by a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let waves = self.waves.iter().map(|(dof, wave)| (*dof, wave.scaled(factor))).collect();
        let opposing = self.opposing.clone().map(|(of, wave)| (of, wave.scaled(factor)));
        Self { waves, opposing, ..self.clone() }
    }

    /// Holds the place along some axes more firmly, by a factor on their natural frequencies, but not more than
    /// axes that are not driven.
    pub(crate) fn held_firmer(&self, axes: Range<usize>, factor: f64) -> Self {
        let mut hold_rad_s = self.hold_rad_s;
        for own in &mut hold_rad_s[axes] {
            *own = (*own * factor).min(own.max(HELD));
        }
        Self { hold_rad_s, ..self.clone() }
    }

    /// Returns when the weight hangs on the vehicle in a run of some seconds.
    pub(crate) fn known(&self, seconds: f64) -> Vec<KnownForce> {
        self.weight.map_or(Vec::new(), |weight| weight.hung(self.period_s, seconds))
    }
}

/// Natural frequency of the controller of axes that are not driven, rad/s …
const HELD: f64 = 0.6;
/// … and of driven axes, as a fraction of the manoeuvre's lowest frequency.
const DRIVEN_PART: f64 = 0.3;
/// Period in which a weight is hung on and taken off, s …
const WEIGHT_PERIOD_S: f64 = 120.0;
/// … and natural frequency of the controller that holds depth under it, rad/s.
const LIFT_RAD_S: f64 = 1.0;
/// Harmonics of a multisine.
const HARMONICS: [u32; 6] = [1, 2, 3, 4, 6, 9];
/// Fraction of the greatest force that drives an axis, the rest being for the controller …
const DRIVEN_FORCE: f64 = 0.8;
/// … and as a fraction of the drag at the greatest speed.
const DRIVEN_SPEED: f64 = 1.4;
/// Least and greatest periods, s.
const PERIODS_S: [f64; 2] = [4.0, 120.0];
/// A fast and a slow multisine, in turns of the axis's time constant.
const TURNS: [f64; 3] = [1.5, 4.0, 10.0];

/// Force and time constant of an axis within its limits.
struct AxisScale {
    dof: Dof,
    force: f64,
    /// `m / (d_L + 2 d_Q v)` at the speed that the force produces, s.
    time_s: f64,
}

impl AxisScale {
    fn new(plant: &Plant, rig: &Rig, limits: &Limits, dof: Dof) -> Option<Self> {
        let most = rig.most[dof.index()];
        let value = |term: Basis| plant.coefficient(&term).unwrap_or(0.0).max(0.0);
        let mass = plant.coefficient(&Basis::Mass(dof, dof)).filter(|_| most > 0.0)?;
        let linear = value(Basis::Product(dof, Product::linear(dof)));
        let quadratic = value(Basis::Product(dof, Product::quadratic(dof)));
        let fastest = if dof.is_rotation() { limits.rate_rad_s } else { limits.speed_m_s };
        let drag = |v: f64| linear * v + quadratic * v * v;
        let tilting = matches!(dof, Dof::Roll | Dof::Pitch);
        let righting = plant.coefficient(&Basis::Lever(2)).unwrap_or(0.0).max(0.0);
        let wanted = match tilting {
            true => righting * limits.tilt_rad + mass * limits.rate_rad_s.powi(2) / limits.tilt_rad,
            false => DRIVEN_SPEED * drag(fastest) + mass * fastest / PERIODS_S[0],
        };
        let force = (DRIVEN_FORCE * most).min(wanted);
        let (mut low, mut high) = (0.0, fastest);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if drag(middle) < force { low = middle } else { high = middle }
        }
        let damping = (linear + 2.0 * quadratic * high).max(1e-3 * mass);
        let time_s = match tilting && righting > 0.0 {
            true => (mass / righting).sqrt(),
            false => mass / damping,
        };
        Some(Self { dof, force, time_s })
    }

    fn period_s(&self, turns: f64) -> f64 {
        (std::f64::consts::TAU * turns * self.time_s).clamp(PERIODS_S[0], PERIODS_S[1])
    }
}

/// Collects manoeuvres of one plant.
struct Library {
    held: [f64; 6],
    seed: u64,
    made: Vec<Manoeuvre>,
}

impl Library {
    fn add(&mut self, kind: Kind, period_s: f64, waves: Vec<(Dof, Wave)>, free: &[Dof]) {
        let axes: Vec<Dof> = waves.iter().map(|(dof, _)| *dof).collect();
        let name = name_of(kind, &axes, period_s);
        if self.made.iter().any(|made| made.name == name) {
            return;
        }
        let mut hold_rad_s = self.held;
        for dof in &axes {
            let own = &mut hold_rad_s[dof.index()];
            let weak = DRIVEN_PART * std::f64::consts::TAU / period_s;
            *own = own.min(if dof.is_rotation() && *dof != Dof::Yaw { 0.0 } else { weak });
        }
        for dof in free {
            hold_rad_s[dof.index()] = 0.0;
        }
        let waves = waves.into_iter().collect();
        let (opposing, weight) = (None, None);
        self.made.push(Manoeuvre {
            name,
            kind,
            axes,
            period_s,
            waves,
            opposing,
            weight,
            hold_rad_s,
        });
    }

    /// Hovers with a weight; depth is held more firmly, so that the vehicle does not sink far under it.
    fn of_weight(&mut self, weight: HungWeight) {
        self.add(Kind::HoverWithWeight, WEIGHT_PERIOD_S, vec![], &[]);
        if let Some(made) = self.made.last_mut() {
            made.name = format!("hover-with-{:.0}-newtons", weight.weight_n);
            (made.axes, made.weight) = (vec![Dof::Heave], Some(weight));
            made.hold_rad_s[2] = made.hold_rad_s[2].max(LIFT_RAD_S);
        }
    }

    fn of_axis(&mut self, scale: &AxisScale) {
        let AxisScale { dof, force, .. } = *scale;
        let name = dof.name();
        for turns in TURNS {
            let period_s = scale.period_s(turns);
            let seed = seed_of(self.seed, &format!("{name} {turns}"));
            let wave = Wave::multisine(force, period_s, &HARMONICS, seed);
            self.add(Kind::Multisine, period_s, vec![(dof, wave)], &[]);
        }
        let long = scale.period_s(TURNS[2]);
        let hold_s = [0.08 * long, 0.3 * long];
        let seed = seed_of(self.seed, &format!("{name} joystick"));
        self.add(Kind::Joystick, long, vec![(dof, Wave::joystick(force, hold_s, seed))], &[]);
        for turns in [TURNS[0], TURNS[2]] {
            let period_s = scale.period_s(turns);
            self.add(Kind::Doublet, period_s, vec![(dof, doublet(force, period_s))], &[]);
        }
        let long_steps = stop_and_go(force, 1.5 * long);
        match dof {
            Dof::Surge => self.add(Kind::StopAndGo, 1.5 * long, vec![(dof, long_steps)], &[]),
            Dof::Heave => {
                self.add(Kind::AscentAndDescent, 1.5 * long, vec![(dof, long_steps)], &[]);
            }
            Dof::Roll | Dof::Pitch => {
                let period_s = 6.0 * scale.period_s(TURNS[0]);
                self.add(Kind::Release, period_s, vec![(dof, release(force, period_s))], &[]);
            }
            Dof::Sway | Dof::Yaw => {}
        }
    }

    fn of_turns(&mut self, surge: &AxisScale, yaw: &AxisScale) {
        let constant =
            |value: f64, period_s: f64| Wave::Steps { steps: vec![[0.0, value]], period_s };
        let period_s = yaw.period_s(TURNS[1]);
        let ahead = constant(0.6 * surge.force, period_s);
        let zigzag = vec![(Dof::Surge, ahead), (Dof::Yaw, doublet(0.7 * yaw.force, period_s))];
        self.add(Kind::Zigzag, period_s, zigzag, &[Dof::Surge, Dof::Sway]);
        let period_s = 4.0 * yaw.period_s(TURNS[2]).min(30.0);
        let about = |levels: &[f64]| {
            let each = period_s / (2 * levels.len()) as f64;
            let both = levels.iter().copied().chain(levels.iter().map(|x| -x));
            let steps = both.enumerate().map(|(k, x)| [k as f64 * each, x * yaw.force]).collect();
            Wave::Steps { steps, period_s }
        };
        let ahead = constant(0.6 * surge.force, period_s);
        let free = [Dof::Surge, Dof::Sway, Dof::Yaw];
        let circle = vec![(Dof::Surge, ahead.clone()), (Dof::Yaw, about(&[0.5]))];
        self.add(Kind::Circle, period_s, circle, &free);
        let spiral = vec![(Dof::Surge, ahead), (Dof::Yaw, about(&[0.2, 0.4, 0.7, 1.0]))];
        self.add(Kind::Spiral, period_s, spiral, &free);
    }

    /// Distributes the harmonics of one base over the axes in turn, so that their sensitivities
    /// differ.
    fn of_all(&mut self, scales: &[AxisScale], turns: f64) {
        let slowest = scales.iter().map(|scale| scale.period_s(turns)).fold(0.0, f64::max);
        let n = scales.len() as u32;
        let wave = |(k, scale): (usize, &AxisScale)| {
            let own = (0..5).map(|row| 1 + k as u32 + n * row).collect::<Vec<_>>();
            let seed = seed_of(self.seed, &format!("all {} {turns}", scale.dof));
            (scale.dof, Wave::multisine(0.7 * scale.force, slowest, &own, seed))
        };
        let waves = scales.iter().enumerate().map(wave).collect();
        self.add(Kind::AllAxes, slowest, waves, &[]);
    }

    fn of_opposing(&mut self, rig: &Rig, surge: &AxisScale) {
        let Some(thrusts) = rig.cancelling.first() else { return };
        let room = thrusts.iter().zip(&rig.allowed).filter(|(x, _)| x.abs() > 1e-6);
        let most = room
            .map(|(x, ends)| ends[0].abs().min(ends[1].abs()) / x.abs())
            .fold(f64::INFINITY, f64::min);
        let period_s = surge.period_s(TURNS[1]);
        let seed = seed_of(self.seed, "opposing");
        let wave = Wave::multisine(0.5 * surge.force, period_s, &HARMONICS, seed);
        self.add(Kind::OpposingThrusters, period_s, vec![(Dof::Surge, wave)], &[]);
        if let Some(made) = self.made.last_mut() {
            let against = Wave::multisine(0.4 * most, 0.7 * period_s, &[1, 2, 3], seed ^ 1);
            made.opposing = Some((thrusts.iter().copied().collect(), against));
        }
    }
}

fn name_of(kind: Kind, axes: &[Dof], period_s: f64) -> String {
    let axes: Vec<&str> = axes.iter().map(|dof| dof.name()).collect();
    let axes = if kind == Kind::AllAxes { "all".to_owned() } else { axes.join("-") };
    let kind = if kind == Kind::AllAxes { "multisine" } else { kind.name() };
    format!("{axes}-{}-{:.0}s", kind.replace(' ', "-"), period_s)
}

fn doublet(force: f64, period_s: f64) -> Wave {
    let steps = vec![[0.0, force], [0.4 * period_s, -force], [0.8 * period_s, 0.0]];
    Wave::Steps { steps, period_s }
}

fn stop_and_go(force: f64, period_s: f64) -> Wave {
    let rows = [(0.0, 1.0), (0.3, 0.0), (0.5, -1.0), (0.8, 0.0)];
    Wave::Steps { steps: rows.map(|(t, x)| [t * period_s, x * force]).to_vec(), period_s }
}

fn release(force: f64, period_s: f64) -> Wave {
    let rows = [(0.0, 1.0), (0.15, 0.0), (0.5, -1.0), (0.65, 0.0)];
    Wave::Steps { steps: rows.map(|(t, x)| [t * period_s, x * force]).to_vec(), period_s }
}

/// Returns all manoeuvres that a vehicle's thrusters can drive, at the greatest forces that limits
/// may allow.
pub(crate) fn library(
    plant: &Plant,
    rig: &Rig,
    limits: &Limits,
    weight: Option<HungWeight>,
    seed: u64,
) -> Vec<Manoeuvre> {
    let scales: Vec<AxisScale> =
        rig.pushed().filter_map(|dof| AxisScale::new(plant, rig, limits, dof)).collect();
    let mut library = Library { held: held(rig), seed, made: Vec::new() };
    scales.iter().for_each(|scale| library.of_axis(scale));
    let of = |dof: Dof| scales.iter().find(|scale| scale.dof == dof);
    if let (Some(surge), Some(yaw)) = (of(Dof::Surge), of(Dof::Yaw)) {
        library.of_turns(surge, yaw);
    }
    if scales.len() > 1 {
        library.of_all(&scales, TURNS[1]);
        library.of_all(&scales, TURNS[2]);
    }
    if let Some(surge) = of(Dof::Surge) {
        library.of_opposing(rig, surge);
    }
    if let Some(weight) = weight {
        library.of_weight(weight);
    }
    library.made
}

/// Returns the force that drives an axis within the limits, N or N m; `None` for an axis without
/// thrust.
pub(crate) fn driving_force(plant: &Plant, rig: &Rig, limits: &Limits, dof: Dof) -> Option<f64> {
    AxisScale::new(plant, rig, limits, dof).map(|scale| scale.force)
}

/// Returns manoeuvres without a plan: each axis by itself, by the paper's sinusoid and joystick, or by a
/// sweep.
pub(crate) fn unplanned(
    kind: Kind,
    plant: &Plant,
    rig: &Rig,
    limits: &Limits,
    seed: u64,
) -> Vec<Manoeuvre> {
    let mut library = Library { held: held(rig), seed, made: Vec::new() };
    for dof in rig.pushed() {
        let Some(scale) = AxisScale::new(plant, rig, limits, dof) else { continue };
        let seed = seed_of(seed, &format!("{} {dof}", kind.name()));
        let period_s = scale.period_s(TURNS[1]);
        let wave = match kind {
            Kind::Sweep => Wave::sweep(scale.force, scale.period_s(TURNS[2]), SWEPT),
            _ => {
                // The paper's joystick has 500 N, and its sinusoid 1800 N.
                let rate = std::f64::consts::TAU / period_s;
                let sine = Wave::Sines { sines: vec![[0.78 * scale.force, rate, 0.0]] };
                let joystick = Wave::joystick(0.22 * scale.force, [5.0, 20.0], seed);
                Wave::Sum { waves: vec![sine, joystick] }
            }
        };
        library.add(kind, period_s, vec![(dof, wave)], &[]);
    }
    library.made
}

/// Harmonics of a sweep.
const SWEPT: u32 = 12;

fn held(rig: &Rig) -> [f64; 6] {
    let firm = |k: usize| if TILTS.contains(&k) { upright_rad_s(rig).max(HELD) } else { HELD };
    std::array::from_fn(|k| if rig.most[k] > 0.0 { firm(k) } else { 0.0 })
}

/// Returns variants of a useful manoeuvre with other periods; a weight keeps the pace of those who hang
/// it on.
pub(crate) fn refinements(manoeuvre: &Manoeuvre) -> Vec<Manoeuvre> {
    if manoeuvre.weight.is_some() {
        return Vec::new();
    }
    REFINED.iter().map(|factor| stretched(manoeuvre, *factor)).collect()
}

/// Factors of the period.
const REFINED: [f64; 2] = [0.7, 1.4];

fn stretched(manoeuvre: &Manoeuvre, factor: f64) -> Manoeuvre {
    let period_s = manoeuvre.period_s * factor;
    Manoeuvre {
        name: name_of(manoeuvre.kind, &manoeuvre.axes, period_s),
        period_s,
        waves: manoeuvre.waves.iter().map(|(dof, own)| (*dof, own.stretched(factor))).collect(),
        opposing: manoeuvre.opposing.as_ref().map(|(of, own)| (of.clone(), own.stretched(factor))),
        ..manoeuvre.clone()
    }
}
