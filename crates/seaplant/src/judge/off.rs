//! Possible errors of the numbers of a plant.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::change::Part;
use super::intervals::{KNOWN_DRAG, KNOWN_MASS};
use super::verdict::Trust;
use crate::{Estimate, Method};

/// Possible error of a number, with its cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MayBeOff {
    /// Name of the number: "mass", or "surge: drag at 0.4 m/s" for a plant of several axes.
    pub number: String,
    /// Relative error: 0.3 where the truth may be 30 % more or less, 2 where it may be three times
    /// as much or a third; absent where it may have any value.
    pub part: Option<f64>,
    /// Cause.
    pub because: OffBecause,
    /// Relative error up to which the number counts as usable.
    pub limit: f64,
}

/// Cause of a possible error of a number.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum OffBecause {
    /// Its 95 % interval.
    Interval,
    /// The change that would minimise the errors of simulated trials.
    AnotherPlantFits,
    /// Another method with equally good predictions.
    Method {
        /// Method.
        method: Method,
    },
    /// Another place of the velocity sensor, with other couplings, which explains the trials as well or has the centre
    /// of mass nearer to where it is expected.
    SensorPlace,
    /// Another scale of thrust, with which the vehicle has as much added mass as published ones.
    ThrustScale,
}

/// A number with all information on its accuracy.
pub(crate) struct Number {
    pub(crate) name: String,
    pub(crate) is_mass: bool,
    pub(crate) estimate: Estimate,
    /// Changes that trials support.
    pub(crate) changes: Vec<Part>,
    /// Values of plants that explain the trials as well, with what sets these apart.
    pub(crate) others: Vec<(OffBecause, f64)>,
}

impl Number {
    /// Returns the greatest possible error with its cause.
    fn greatest_error(&self) -> MayBeOff {
        let Estimate { value, low95, high95, .. } = self.estimate;
        let half = 0.5 * (high95 - low95) / value.abs();
        let by_interval = (half, OffBecause::Interval);
        // A change whose interval includes zero may be chance.
        let is_sure = |change: &&Part| change.low95 > 0.0 || change.high95 < 0.0;
        let changes = self.changes.iter().filter(is_sure);
        let changes = changes.map(|change| (change.value.abs(), OffBecause::AnotherPlantFits));
        let factor = |other: f64| match other / value {
            ratio if ratio > 0.0 => ratio.max(1.0 / ratio) - 1.0,
            _ => f64::INFINITY,
        };
        let others = self.others.iter();
        let others = others.map(|(because, x)| (factor(*x), because.clone()));
        let all = [by_interval].into_iter().chain(changes).chain(others);
        let order = |part: f64| if part.is_nan() { f64::INFINITY } else { part };
        let most = all.map(|(part, because)| (order(part), because));
        let (part, because) = most
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::INFINITY, OffBecause::Interval));
        // An interval that includes zero excludes no factor.
        let is_open = part >= 1.0 && because == OffBecause::Interval || !part.is_finite();
        let (number, part) = (self.name.clone(), (!is_open).then_some(part));
        MayBeOff { number, part, because, limit: self.limit() }
    }

    fn limit(&self) -> f64 {
        if self.is_mass { KNOWN_MASS } else { KNOWN_DRAG }
    }
}

/// Returns the possible errors of numbers, whatever the plant's trust.
pub(crate) fn may_be_off<'a>(numbers: impl IntoIterator<Item = &'a Number>) -> Vec<MayBeOff> {
    numbers.into_iter().map(Number::greatest_error).collect()
}

impl MayBeOff {
    /// Returns true if the error is to be reported: for a doubtful plant always, else if it exceeds
    /// the limit. A narrow interval says nothing of a plant that is not to be used.
    pub(crate) fn matters(&self, trust: Trust) -> bool {
        trust == Trust::Doubtful || self.part.is_none_or(|part| part > self.limit)
    }

    /// Returns true if the cause is other than the number's interval.
    pub(crate) fn is_beyond_interval(&self) -> bool {
        self.because != OffBecause::Interval
    }

    /// Formats as "by 30 % (its 95 % interval)".
    pub fn how_much(&self) -> String {
        let by = match self.part {
            None => "by any factor".to_owned(),
            Some(part) if part >= 1.0 => format!("by a factor of {:.1}", 1.0 + part),
            Some(part) => format!("by {:.0} %", (100.0 * part).max(1.0)),
        };
        let because = match &self.because {
            OffBecause::Interval => "its 95 % interval".to_owned(),
            OffBecause::AnotherPlantFits => "what trials would have".to_owned(),
            OffBecause::Method { method } => format!("by {method}"),
            OffBecause::ThrustScale => "by the scale of thrust".to_owned(),
            OffBecause::SensorPlace => "by the place of the velocity sensor".to_owned(),
        };
        format!("{by} ({because})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::Verdict;

    fn number(half: f64) -> Number {
        let estimate =
            Estimate { value: 10.0, std: half / 2.0, low95: 10.0 - half, high95: 10.0 + half };
        let name = "mass".to_owned();
        Number { name, is_mass: true, estimate, changes: Vec::new(), others: Vec::new() }
    }

    fn said(numbers: &[Number], trust: Trust) -> String {
        let mut verdict = Verdict::new(trust, "", Vec::new());
        verdict.may_be_off = may_be_off(numbers);
        verdict.may_be_off.retain(|off| off.matters(trust));
        let said = verdict.spoken_off().unwrap_or_default();
        said.strip_prefix("may be off: ").unwrap_or_default().to_owned()
    }

    #[test]
    fn a_doubtful_plant_reports_all_possible_errors() {
        assert_eq!(said(&[number(0.5)], Trust::Doubtful), "mass by 5 % (its 95 % interval)");
        assert_eq!(said(&[number(0.5)], Trust::UsableWithCare), "");
        assert_eq!(said(&[number(0.5)], Trust::DoNotUse), "");
        assert_eq!(said(&[number(2.0)], Trust::UsableWithCare), "mass by 20 % (its 95 % interval)");
        let open = said(&[number(30.0)], Trust::Doubtful);
        assert_eq!(open, "mass by any factor (its 95 % interval)");
    }

    #[test]
    fn numbers_that_are_off_alike_are_reported_together() {
        let drag = || Number { name: "drag".to_owned(), ..number(2.0) };
        let all = [number(2.0), drag(), number(0.5)];
        let expected = "mass, drag by 20 % (its 95 % interval); mass by 5 % (its 95 % interval)";
        assert_eq!(said(&all, Trust::Doubtful), expected);
    }

    #[test]
    fn reports_the_cause_of_the_greatest_error() {
        let part = |value| Part { value, std: 0.01, low95: value - 0.02, high95: value + 0.02 };
        let changed = Number { changes: vec![part(0.01), part(-0.4)], ..number(0.5) };
        assert_eq!(said(&[changed], Trust::Doubtful), "mass by 40 % (what trials would have)");
        let chance = Number { changes: vec![part(0.01)], ..number(0.5) };
        assert!(!may_be_off(&[chance]).iter().any(MayBeOff::is_beyond_interval));
        let by = || OffBecause::Method { method: Method::OutputError };
        let disputed = Number { others: vec![(by(), 30.0)], ..number(0.5) };
        assert_eq!(said(&[disputed], Trust::Doubtful), "mass by a factor of 3.0 (by output-error)");
        let absurd = Number { others: vec![(by(), -30.0)], ..number(0.5) };
        assert_eq!(said(&[absurd], Trust::Doubtful), "mass by any factor (by output-error)");
    }
}
