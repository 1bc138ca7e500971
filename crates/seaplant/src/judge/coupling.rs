//! Test of whether an axis can be identified separately.

use super::change::{DRAG_PART, MASS_PART, PlantChange, plant_columns};
use super::linear::{ErrorRegression, Window};
use crate::trial::Beside;
use crate::{Caveat, CaveatCode, Dof};

/// Fraction of the simulation error that other axes must explain in cross-validation …
const EXPLAINED: f64 = 0.1;

/// … or most of it, even without an effect on the plant.
const MOSTLY: f64 = 0.5;

/// Changes of the plant beyond this many times the usual limits forbid its separate use.
const SEVERE_TIMES: f64 = 2.0;

/// Effect of other axes on this one.
struct Cause {
    name: &'static str,
    /// Acceleration, up to a factor, as a function of the motion and its rate of change.
    acceleration: fn(&Kinematics, &Kinematics) -> f64,
}

/// Velocities and angles at one instant, or their rates; NaN if not logged.
struct Kinematics {
    u: f64,
    v: f64,
    w: f64,
    p: f64,
    q: f64,
    r: f64,
    roll: f64,
    pitch: f64,
}

const fn cause(name: &'static str, acceleration: fn(&Kinematics, &Kinematics) -> f64) -> Cause {
    Cause { name, acceleration }
}

/// Returns the effects of other axes in the equation of motion in six degrees of freedom: Coriolis
/// forces, Munk moment, weight and buoyancy, cross-flow drag [Fossen2011, ch. 6 and 7].
const fn causes(dof: Dof) -> &'static [Cause] {
    const SURGE: &[Cause] = &[
        cause("v r", |at, _| at.v * at.r),
        cause("w q", |at, _| at.w * at.q),
        cause("r²", |at, _| at.r * at.r),
        cause("q²", |at, _| at.q * at.q),
        cause("pitch", |at, _| at.pitch.sin()),
        cause("u |v|", |at, _| at.u * at.v.abs()),
        cause("u |w|", |at, _| at.u * at.w.abs()),
        cause("q̇", |_, rate| rate.q),
    ];
    const SWAY: &[Cause] = &[
        cause("u r", |at, _| at.u * at.r),
        cause("w p", |at, _| at.w * at.p),
        cause("roll", |at, _| at.roll.sin() * at.pitch.cos()),
        cause("r", |at, _| at.r),
        cause("ṗ", |_, rate| rate.p),
        cause("ṙ", |_, rate| rate.r),
        cause("u v", |at, _| at.u * at.v),
    ];
    const HEAVE: &[Cause] = &[
        cause("u q", |at, _| at.u * at.q),
        cause("v p", |at, _| at.v * at.p),
        cause("q", |at, _| at.q),
        cause("q̇", |_, rate| rate.q),
        cause("u w", |at, _| at.u * at.w),
        cause("u²", |at, _| at.u * at.u),
        cause("tilt", |at, _| 1.0 - at.roll.cos() * at.pitch.cos()),
    ];
    const ROLL: &[Cause] = &[
        cause("roll", |at, _| at.roll.sin() * at.pitch.cos()),
        cause("v w", |at, _| at.v * at.w),
        cause("q r", |at, _| at.q * at.r),
        cause("v", |at, _| at.v),
        cause("v̇", |_, rate| rate.v),
        cause("u r", |at, _| at.u * at.r),
    ];
    const PITCH: &[Cause] = &[
        cause("pitch", |at, _| at.pitch.sin()),
        cause("u w of Munk's moment", |at, _| at.u * at.w),
        cause("p r", |at, _| at.p * at.r),
        cause("w", |at, _| at.w),
        cause("u̇", |_, rate| rate.u),
        cause("u q", |at, _| at.u * at.q),
    ];
    const YAW: &[Cause] = &[
        cause("u v of Munk's moment", |at, _| at.u * at.v),
        cause("u r", |at, _| at.u * at.r),
        cause("v", |at, _| at.v),
        cause("v̇", |_, rate| rate.v),
        cause("p q", |at, _| at.p * at.q),
        cause("r |u|", |at, _| at.r * at.u.abs()),
    ];
    match dof {
        Dof::Surge => SURGE,
        Dof::Sway => SWAY,
        Dof::Heave => HEAVE,
        Dof::Roll => ROLL,
        Dof::Pitch => PITCH,
        Dof::Yaw => YAW,
    }
}

/// Effects of other axes on one axis, in addition to its own plant.
#[derive(Clone, Debug)]
pub(crate) struct Coupling {
    causes: Vec<&'static str>,
    /// Fraction of the simulation error that they explain in cross-validation.
    pub(crate) explained: f64,
    /// Relative change of the mass with these effects included.
    pub(crate) mass: f64,
    /// Relative change of the drag.
    pub(crate) drag: f64,
}

impl Coupling {
    /// Explains the simulation error by a change of the plant alone, and by one together with the
    /// effects of other axes; `None` where these were not logged or are not determined.
    pub(crate) fn of(dof: Dof, windows: &[Window], beside: &[(&str, &Beside)]) -> Option<Self> {
        let known = logged_causes(dof, windows, beside);
        if known.is_empty() {
            return None;
        }
        let accelerations = |window: &Window| -> Option<Vec<Vec<f64>>> {
            let beside = beside.iter().find(|(trial, _)| *trial == window.trial)?.1;
            let at = motion_and_rates(window, dof, beside)?;
            let of = |cause: &&Cause| {
                at.iter().map(|(at, rate)| (cause.acceleration)(at, rate)).collect()
            };
            Some(known.iter().map(of).collect())
        };
        let with = ErrorRegression::of(windows, |window| {
            Some([plant_columns(window), accelerations(window)?].concat())
        });
        let without = ErrorRegression::of(windows, |window| {
            accelerations(window)?;
            Some(plant_columns(window))
        });
        let explained = 1.0 - with.cross_validated()? / without.cross_validated()?;
        let (with, without) = (with.solve()?, without.solve()?);
        let (with, without) =
            (PlantChange::of(&with, 1.0, 1.0)?, PlantChange::of(&without, 1.0, 1.0)?);
        Some(Self {
            causes: known.iter().map(|cause| cause.name).collect(),
            explained,
            mass: (1.0 + with.mass.value) / (1.0 + without.mass.value) - 1.0,
            drag: (1.0 + with.drag.value) / (1.0 + without.drag.value) - 1.0,
        })
    }

    /// Returns a caveat if the axis must not be identified separately because the others affect it
    /// and its plant.
    pub(crate) fn caveat(&self, dof: Dof) -> Option<Caveat> {
        let times = (self.mass.abs() / MASS_PART).max(self.drag.abs() / DRAG_PART);
        let speaks = self.explained > EXPLAINED && times > 1.0 || self.explained > MOSTLY;
        speaks.then(|| {
            let message = format!(
                "do not use {dof} alone: the motion of other axes ({}) explains {:.0} % of the error of the {dof} model, and with it the mass would be {:+.0} % and the drag {:+.0} % different; fit the axes together, or hold the others still",
                self.causes.join(", "),
                100.0 * self.explained,
                100.0 * self.mass,
                100.0 * self.drag
            );
            if times > SEVERE_TIMES {
                Caveat::severe(CaveatCode::CoupledAxes, message)
            } else {
                Caveat::warning(CaveatCode::CoupledAxes, message)
            }
        })
    }
}

/// Returns a caveat if turning with the speed of other axes accelerates a translation more than its own
/// speed changes.
///
/// A plant of one axis takes that for a disturbance: its mass is then that of a combined motion.
pub(crate) fn turned(dof: Dof, windows: &[Window], beside: &[(&str, &Beside)]) -> Option<Caveat> {
    let part = turning_part(dof, windows, beside).filter(|part| *part > 1.0)?;
    let message = format!(
        "do not use {dof} alone: turning while other axes move accelerates it {part:.1} times as much as its own speed changes, so that its mass is that of several axes; fit the axes together, or hold the others still"
    );
    Some(Caveat::warning(CaveatCode::CoupledAxes, message))
}

/// Returns the root mean square of `−(ω × v)` along a translation over that of its acceleration.
fn turning_part(dof: Dof, windows: &[Window], beside: &[(&str, &Beside)]) -> Option<f64> {
    let turning: fn(&Kinematics) -> f64 = match dof {
        Dof::Surge => |at| at.v * at.r - at.w * at.q,
        Dof::Sway => |at| at.w * at.p - at.u * at.r,
        Dof::Heave => |at| at.u * at.q - at.v * at.p,
        _ => return None,
    };
    let own = |rate: &Kinematics| [rate.u, rate.v, rate.w][dof.index()];
    let (mut turned, mut changed) = (0.0, 0.0);
    for window in windows {
        let (_, beside) = beside.iter().find(|(trial, _)| *trial == window.trial)?;
        for (at, rate) in motion_and_rates(window, dof, beside)? {
            turned += turning(&at).powi(2);
            changed += own(&rate).powi(2);
        }
    }
    Some((turned / changed).sqrt())
}

/// Returns the effects that were logged in every window and that vary.
fn logged_causes(dof: Dof, windows: &[Window], beside: &[(&str, &Beside)]) -> Vec<&'static Cause> {
    let instants: Vec<Vec<(Kinematics, Kinematics)>> = windows
        .iter()
        .filter_map(|window| {
            let beside = beside.iter().find(|(trial, _)| *trial == window.trial)?.1;
            motion_and_rates(window, dof, beside)
        })
        .collect();
    let varies = |cause: &&Cause| {
        let values = instants.iter().flatten();
        let mut values = values.map(|(at, rate)| (cause.acceleration)(at, rate)).peekable();
        let Some(&first) = values.peek() else { return false };
        let mut differs = false;
        for value in values {
            if !value.is_finite() {
                return false;
            }
            differs |= value != first;
        }
        differs
    };
    causes(dof).iter().filter(varies).collect()
}

/// Returns the motion at the instants of a window and its rates of change over the step that starts
/// there; `None` where it was not logged.
fn motion_and_rates(
    window: &Window,
    dof: Dof,
    beside: &Beside,
) -> Option<Vec<(Kinematics, Kinematics)>> {
    let (from_s, to_s) = (window.time_s[0], *window.time_s.last()?);
    let known =
        |series: &&crate::Timed| series.first_s() <= from_s + 1.0 && series.last_s() >= to_s - 1.0;
    let mut velocities = Dof::ALL.map(|other| {
        let series = beside.velocity.get(&other).filter(known);
        series.map(crate::Timed::reader)
    });
    let mut roll = beside.roll.as_ref().filter(known).map(crate::Timed::reader);
    let mut pitch = beside.pitch.as_ref().filter(known).map(crate::Timed::reader);
    let at = |(&t, &own): (&f64, &f64)| {
        let mut of = |other: Dof| {
            if other == dof {
                return own;
            }
            velocities[other.index()].as_mut().map_or(f64::NAN, |reader| reader.at(t))
        };
        Kinematics {
            u: of(Dof::Surge),
            v: of(Dof::Sway),
            w: of(Dof::Heave),
            p: of(Dof::Roll),
            q: of(Dof::Pitch),
            r: of(Dof::Yaw),
            roll: roll.as_mut().map_or(f64::NAN, |reader| reader.at(t)),
            pitch: pitch.as_mut().map_or(f64::NAN, |reader| reader.at(t)),
        }
    };
    let all: Vec<Kinematics> = window.time_s.iter().zip(&window.velocity).map(at).collect();
    let rate = |k: usize| {
        // No step starts at the last instant; its rate is not used.
        let next = (k + 1).min(all.len() - 1);
        let step_s = (window.time_s[next] - window.time_s[k]).max(f64::MIN_POSITIVE);
        all[k].rate_to(&all[next], step_s)
    };
    let rates: Vec<Kinematics> = (0..all.len()).map(rate).collect();
    Some(all.into_iter().zip(rates).collect())
}

impl Kinematics {
    fn rate_to(&self, next: &Self, step_s: f64) -> Self {
        let of = |value: fn(&Self) -> f64| (value(next) - value(self)) / step_s;
        Self {
            u: of(|at| at.u),
            v: of(|at| at.v),
            w: of(|at| at.w),
            p: of(|at| at.p),
            q: of(|at| at.q),
            r: of(|at| at.r),
            roll: of(|at| at.roll),
            pitch: of(|at| at.pitch),
        }
    }
}
