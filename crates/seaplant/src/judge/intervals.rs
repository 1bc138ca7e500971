//! Whether mass and drag of an axis are known well enough for a usable plant.

use super::working::drag_at;
use crate::caveat::spoken;
use crate::{Caveat, CaveatCode, Dof, Estimate, Fit, Term};

/// Ratio of the ends of a mass interval above which mass is undetermined.
const WIDEST_MASS: f64 = 2.0;
/// Relative half-width of the interval above which drag at working speed is undetermined.
const WIDEST_DRAG: f64 = 0.5;
/// Relative error of the mass that is acceptable for a usable plant …
pub(super) const KNOWN_MASS: f64 = 0.10;
/// … and relative error of the drag.
pub(super) const KNOWN_DRAG: f64 = 0.20;

/// Advice for narrower intervals.
const MORE: &str = "drive longer, faster, and at more than one frequency";

/// Mass of an axis and its drag at a speed, if it has drag.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub(crate) dof: Dof,
    pub(crate) mass: Estimate,
    /// The typical speed of the trials, m/s or rad/s.
    pub(crate) speed: f64,
    pub(crate) drag: Option<Estimate>,
}

impl Known {
    fn of_axis(fit: &Fit, speed: f64) -> Self {
        let (mass, drag) = (fit.estimates().mass, Some(drag_at(fit, speed)));
        Self { dof: fit.dof, mass, speed, drag }
    }

    fn mass_name(&self) -> String {
        format!("the {} {}", self.dof, if self.dof.is_rotation() { "inertia" } else { "mass" })
    }

    fn drag_name(&self) -> String {
        let Self { dof, speed, .. } = self;
        format!("drag in {dof} at {} {}", spoken(*speed), dof.units().velocity)
    }

    fn is_mass_told(&self) -> bool {
        self.mass.low95 > 0.0 && self.mass.high95 <= WIDEST_MASS * self.mass.low95
    }

    fn is_drag_told(&self) -> bool {
        self.drag.is_none_or(|drag| half(&drag) <= WIDEST_DRAG)
    }

    /// Returns caveats on what the trials do not determine.
    pub(crate) fn undetermined(&self) -> Vec<Caveat> {
        let units = self.dof.units();
        let anything = |what: String, x: Estimate, unit: &str| {
            let (low, high) = (spoken(x.low95), spoken(x.high95));
            let message = format!("{what} is anything from {low} to {high} {unit}: {MORE}");
            Caveat::warning(CaveatCode::NotDetermined, message)
        };
        let mass =
            (!self.is_mass_told()).then(|| anything(self.mass_name(), self.mass, units.mass));
        let drag = self.drag.filter(|_| !self.is_drag_told());
        let drag = drag.map(|drag| anything(self.drag_name(), drag, units.force));
        mass.into_iter().chain(drag).collect()
    }

    /// Returns what is determined, and less well than a user takes the numbers of a usable plant for.
    fn wide(&self) -> Vec<String> {
        let part = |what: String, x: Estimate| format!("{what} to ± {:.0} %", 100.0 * half(&x));
        let mass = Some(self.mass).filter(|mass| self.is_mass_told() && half(mass) > KNOWN_MASS);
        let drag = self.drag.filter(|drag| self.is_drag_told() && half(drag) > KNOWN_DRAG);
        let mass = mass.map(|mass| part(self.mass_name(), mass));
        mass.into_iter().chain(drag.map(|drag| part(self.drag_name(), drag))).collect()
    }
}

/// Returns a caveat if masses and drag are known less well than a user takes those of a usable plant for; of what is
/// not known at all [`Known::undetermined`] tells.
///
/// The scale of thrust, which moves all of them together and no driving narrows, is to be left out of them: another
/// caveat tells it.
pub(crate) fn wide(axes: &[Known]) -> Option<Caveat> {
    let all: Vec<String> = axes.iter().flat_map(Known::wide).collect();
    let message = format!("less is known than of a usable plant: {}; {MORE}", all.join(", "));
    (!all.is_empty()).then(|| Caveat::warning(CaveatCode::WideInterval, message))
}

/// Returns caveats on a plant of one axis for intervals that are too wide for a usable plant; `speed` is the typical
/// speed.
pub(crate) fn intervals(fit: &Fit, speed: f64) -> Vec<Caveat> {
    let sure = fit.of_sure_thrust();
    let mut caveats = Known::of_axis(fit, speed).undetermined();
    let known = Known::of_axis(&sure, speed);
    caveats.extend(wide(&[known]));
    let quadratic = sure.estimates().d_quadratic.filter(|_| fit.terms.has(Term::Linear));
    let alone = quadratic.filter(|drag| half(drag) > KNOWN_DRAG);
    if let Some((drag, quadratic)) = known.drag.zip(alone)
        && half(&drag) <= KNOWN_DRAG
    {
        let message = format!(
            "{} is known to ± {:.0} %, but quadratic drag by itself to ± {:.0} % only, because linear drag can replace it: do not use the model at other speeds; drive at more of them",
            known.drag_name(),
            100.0 * half(&drag),
            100.0 * half(&quadratic)
        );
        caveats.push(Caveat::warning(CaveatCode::WideInterval, message));
    }
    caveats
}

/// Half of an interval, as a part of the number.
fn half(x: &Estimate) -> f64 {
    let part = 0.5 * (x.high95 - x.low95) / x.value.abs();
    if part.is_nan() { f64::INFINITY } else { part }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(mass_part: f64, drag_part: f64) -> Known {
        let of = |value: f64, part: f64| Estimate::new(value, part * value / 1.96, 1e6);
        let drag = Some(of(40.0, drag_part));
        Known { dof: Dof::Yaw, mass: of(8.0, mass_part), speed: 0.5, drag }
    }

    #[test]
    fn wide_intervals_are_told_once_and_undetermined_numbers_apart() {
        let told = |known: Known| known.undetermined().len();
        assert_eq!((told(known(0.05, 0.1)), wide(&[known(0.05, 0.1)])), (0, None));
        let both = [known(0.15, 0.1), known(0.05, 0.3)];
        let message = wide(&both).expect("both are wide").message;
        let expected = "the yaw inertia to ± 15 %, drag in yaw at 0.500 rad/s to ± 30 %; drive";
        assert!(message.contains(expected), "{message}");
        assert_eq!((told(known(0.4, 0.6)), wide(&[known(0.4, 0.6)])), (2, None));
        let nothing =
            Known { drag: Some(Estimate::new(0.0, f64::INFINITY, 1e6)), ..known(0.0, 0.0) };
        assert_eq!(told(nothing), 1);
        assert_eq!(told(Known { drag: None, ..known(0.05, 0.0) }), 0);
    }
}
