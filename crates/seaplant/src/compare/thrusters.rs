//! What each thruster gives from dive to dive, and what has become of it.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Compared, DifferenceTest, Gaussian, Stated, by_holm, gaussian, homogeneity};
use crate::results::{Parameter, Results, ThrusterEstimate};
use crate::{Caveat, CaveatCode};

/// A thruster over several fits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrusterHistory {
    /// What it gives over what its curve says, in each fit; absent where the trials do not determine it.
    pub gains: Vec<Option<Stated>>,
    /// The same of thrust below zero, where that is another.
    pub reverse: Vec<Option<Stated>>,
    /// Whether the gains differ; absent of fewer than two.
    pub test: Option<DifferenceTest>,
    /// What is wrong with it, and from when.
    pub changes: Vec<ThrusterChange>,
}

/// What has become of a thruster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrusterChange {
    /// The fit that shows it first, from 0.
    pub from: usize,
    /// The cause.
    pub cause: ThrusterCause,
    /// The gain before; of the first fit, 1.
    pub before: f64,
    /// The gain from then on.
    pub after: f64,
    /// In words.
    pub message: String,
}

/// Why a thruster does not do what it did, or what its curve says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ThrusterCause {
    /// It gives less: its propeller is fouled or chipped, or its motor or ESC limited.
    Loss,
    /// It gives more: cleaned, or with another propeller.
    More,
    /// It stands still.
    StandsStill,
    /// It pushes the other way since then.
    Reversed,
    /// It pushes the other way in all fits: its direction in the vehicle file is wrong.
    DirectionWrong,
    /// It and another do what the log of the other says.
    Exchanged,
}

/// A gain below this is of a thruster that stands still …
const STILL: f64 = 0.2;
/// … and one below this of one that pushes the other way.
const TURNED_ROUND: f64 = -0.5;

/// A change of less is no reason to look at a thruster.
const LEAST_CHANGE: f64 = 0.05;

/// A gain that is so far from 1 is not that of another thruster of its kind.
const UNLIKE: f64 = 0.12;

/// So many standard deviations are no chance: of eight thrusters one is so far off once in 2000 dives.
const CLEARLY: f64 = 4.0;

/// What the fit of one dive says of its thrusters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DiveThrusters {
    /// What each gives over what its curve says.
    pub estimates: BTreeMap<String, ThrusterEstimate>,
    /// Pairs of which each does what the log of the other says.
    pub exchanged: Vec<[String; 2]>,
}

impl DiveThrusters {
    /// Those of all plants of a fit; of a thruster that several estimate, the surest.
    pub fn of_results(results: &Results) -> Self {
        let mut all = Self::default();
        for plant in results.plants.values() {
            for (name, own) in &plant.thruster_estimates {
                let surer = |known: &ThrusterEstimate| known.gain.std <= own.gain.std;
                if !all.estimates.get(name).is_some_and(surer) {
                    all.estimates.insert(name.clone(), own.clone());
                }
            }
            let is_new = |pair: &&[String; 2]| !all.exchanged.contains(pair);
            let new: Vec<[String; 2]> =
                plant.thrusters_exchanged.iter().filter(is_new).cloned().collect();
            all.exchanged.extend(new);
        }
        all
    }
}

/// Follows each thruster over dives of one vehicle, in order: those that two dives or more have a gain of.
///
/// A gain that differs from those since the last change by more than 5 % and four standard deviations is a
/// change; in the first dive, one more than 12 % from 1.
///
/// ```
/// use seaplant::{DiveThrusters, ThrusterCause, follow_thrusters};
/// let dive = |gain: f64| -> Result<DiveThrusters, serde_json::Error> {
///     let gain = serde_json::json!({ "value": gain, "std": 0.02, "low95": gain - 0.04, "high95": gain + 0.04, "unit": "1" });
///     let bow = serde_json::json!({ "gain": gain, "is_fitted": true });
///     serde_json::from_value(serde_json::json!({ "estimates": { "bow": bow }, "exchanged": [] }))
/// };
/// let followed = follow_thrusters(&[dive(1.0)?, dive(0.99)?, dive(0.8)?]);
/// let change = &followed["bow"].changes[0];
/// assert_eq!((change.from, change.cause), (2, ThrusterCause::Loss));
/// # Ok::<(), serde_json::Error>(())
/// ```
pub fn follow_thrusters(dives: &[DiveThrusters]) -> BTreeMap<String, ThrusterHistory> {
    let mut histories: BTreeMap<String, ThrusterHistory> = BTreeMap::new();
    let names: BTreeSet<&String> = dives.iter().flat_map(|dive| dive.estimates.keys()).collect();
    for name in names {
        let estimates: Vec<Option<&ThrusterEstimate>> =
            dives.iter().map(|dive| dive.estimates.get(name)).collect();
        if estimates.iter().flatten().count() > 1 {
            histories.insert(name.clone(), history(name, dives, &estimates));
        }
    }
    let tests = histories.values_mut().filter_map(|own| own.test.as_mut()).collect();
    by_holm(tests);
    histories
}

/// The history of each thruster of what is compared.
pub(super) fn histories(compared: &[Compared<'_>]) -> BTreeMap<String, ThrusterHistory> {
    let of = |one: &Compared<'_>| fit_of(one).map(DiveThrusters::of_results).unwrap_or_default();
    follow_thrusters(&compared.iter().map(of).collect::<Vec<_>>())
}

/// Returns a caveat if fits that have estimates of thrusters are of vehicles with different thrusters.
pub fn other_thrusters(compared: &[Compared<'_>]) -> Option<Caveat> {
    let of = |fit: &Results| -> BTreeSet<String> {
        fit.thrusters.iter().map(|own| own.name.clone()).collect()
    };
    let all: Vec<(usize, BTreeSet<String>)> = compared
        .iter()
        .enumerate()
        .filter_map(|(k, one)| Some((k + 1, fit_of(one)?)))
        .filter(|(_, fit)| !DiveThrusters::of_results(fit).estimates.is_empty())
        .map(|(k, fit)| (k, of(fit)))
        .collect();
    let (first, names) = all.first()?;
    let (other, others) = all.iter().find(|(_, others)| others != names)?;
    let alone = |of: &BTreeSet<String>, without: &BTreeSet<String>| {
        let names: Vec<String> = of.difference(without).map(|name| format!("`{name}`")).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    };
    let message = format!(
        "the fits are of vehicles with other thrusters: only [{first}] has {}, only [{other}] has {}; gains are compared by name, so name the thrusters of one vehicle alike in its vehicle files",
        alone(names, others),
        alone(others, names)
    );
    Some(Caveat::warning(CaveatCode::NotComparable, message))
}

fn fit_of<'a>(compared: &Compared<'a>) -> Option<&'a Results> {
    match compared {
        Compared::Fit(fit) => Some(fit),
        Compared::Table(_) => None,
    }
}

fn stated(parameter: &Parameter) -> Stated {
    Stated {
        value: parameter.value,
        std: Some(parameter.std),
        interval95: Some([parameter.low95, parameter.high95]),
        unit: parameter.unit.clone(),
    }
}

fn history(
    name: &str,
    dives: &[DiveThrusters],
    estimates: &[Option<&ThrusterEstimate>],
) -> ThrusterHistory {
    let gains: Vec<Option<Stated>> =
        estimates.iter().map(|own| Some(stated(&own.as_ref()?.gain))).collect();
    let reverse =
        estimates.iter().map(|own| Some(stated(own.as_ref()?.reverse.as_ref()?))).collect();
    let known: Vec<Gaussian> = gains.iter().flatten().filter_map(gaussian).collect();
    let mut changes = changes(name, estimates);
    changes.extend(exchanges(name, dives));
    changes.sort_by_key(|change| change.from);
    ThrusterHistory { gains, reverse, test: homogeneity(&known), changes }
}

/// Gains that are as one until another is clearly different.
struct Since {
    from: usize,
    sum: f64,
    weight: f64,
}

impl Since {
    fn new(from: usize, gain: &Parameter) -> Self {
        let weight = gain.std.max(f64::MIN_POSITIVE).powi(-2);
        Self { from, sum: weight * gain.value, weight }
    }

    fn mean(&self) -> f64 {
        self.sum / self.weight
    }

    /// The change to another gain, if that is clear.
    fn change(&self, gain: &Parameter) -> Option<f64> {
        let by = gain.value - self.mean();
        let std = (gain.std.powi(2) + 1.0 / self.weight).sqrt();
        (by.abs() > LEAST_CHANGE.max(CLEARLY * std)).then_some(by)
    }
}

fn changes(name: &str, estimates: &[Option<&ThrusterEstimate>]) -> Vec<ThrusterChange> {
    let known = estimates.iter().enumerate();
    let known: Vec<(usize, &Parameter)> =
        known.filter_map(|(k, own)| Some((k, &own.as_ref()?.gain))).collect();
    let Some((first, rest)) = known.split_first() else { return Vec::new() };
    let is_turned = |gain: &Parameter| gain.value < TURNED_ROUND;
    if known.iter().all(|(_, gain)| is_turned(gain)) {
        let cause = ThrusterCause::DirectionWrong;
        return vec![change(name, (first.0, cause), (1.0, first.1))];
    }
    let mut all = Vec::new();
    let mut since = Since::new(first.0, first.1);
    // What is wrong from the first is beside 1.
    if (first.1.value - 1.0).abs() > UNLIKE.max(CLEARLY * first.1.std) {
        all.push(change(name, (first.0, cause(first.1.value, 1.0)), (1.0, first.1)));
    }
    for (k, gain) in rest {
        if since.change(gain).is_some() {
            let before = since.mean();
            all.push(change(name, (*k, cause(gain.value, before)), (before, gain)));
            since = Since::new(*k, gain);
        } else {
            let own = Since::new(since.from, gain);
            since = Since {
                from: since.from,
                sum: since.sum + own.sum,
                weight: since.weight + own.weight,
            };
        }
    }
    all
}

fn cause(after: f64, before: f64) -> ThrusterCause {
    match after {
        _ if after < TURNED_ROUND => ThrusterCause::Reversed,
        _ if after < STILL => ThrusterCause::StandsStill,
        _ if after < before => ThrusterCause::Loss,
        _ => ThrusterCause::More,
    }
}

fn change(
    name: &str,
    (from, cause): (usize, ThrusterCause),
    (before, gain): (f64, &Parameter),
) -> ThrusterChange {
    let (after, half) = (gain.value, 1.96 * gain.std);
    let look = match cause {
        ThrusterCause::Loss => {
            "as one does whose propeller is fouled or chipped, or whose motor or ESC is limited"
        }
        ThrusterCause::More => "as one does that was cleaned, or has another propeller",
        ThrusterCause::StandsStill => {
            "it stands still: look at its motor, its propeller and its channel"
        }
        ThrusterCause::Reversed => {
            "it pushes the other way since then: look at the sign of its channel, its ESC and its propeller"
        }
        _ => {
            "it pushes the other way in all dives: its direction in the vehicle file is wrong, or its channel is to be negated"
        }
    };
    let message = format!(
        "thruster `{name}` gives {after:.3} ± {half:.3} of its curve beside the others from [{}] on, {before:.3} before: {look}",
        from + 1
    );
    ThrusterChange { from, cause, before, after, message }
}

/// That a thruster and another are exchanged, from which fit on.
fn exchanges(name: &str, dives: &[DiveThrusters]) -> Vec<ThrusterChange> {
    let mut all = Vec::new();
    let mut last: Option<&String> = None;
    for (from, dive) in dives.iter().enumerate() {
        let mut pairs = dive.exchanged.iter().filter(|pair| pair.iter().any(|own| own == name));
        let now = pairs.next().and_then(|pair| pair.iter().find(|own| *own != name));
        if let Some(other) = now.filter(|_| now != last) {
            let message = format!(
                "thrusters `{name}` and `{other}` are exchanged from [{}] on: each does what the log of the other says",
                from + 1
            );
            let cause = ThrusterCause::Exchanged;
            all.push(ThrusterChange { from, cause, before: 1.0, after: 1.0, message });
        }
        last = now;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn causes(gains: &[f64]) -> Vec<(usize, ThrusterCause)> {
        let estimate = |value: &f64| {
            let gain = Parameter {
                value: *value,
                std: 0.02,
                low95: value - 0.04,
                high95: value + 0.04,
                unit: "1".to_owned(),
            };
            ThrusterEstimate { gain, reverse: None, of_curve: None, is_fitted: true }
        };
        let all: Vec<ThrusterEstimate> = gains.iter().map(estimate).collect();
        let all: Vec<Option<&ThrusterEstimate>> = all.iter().map(Some).collect();
        changes("T3", &all).into_iter().map(|change| (change.from, change.cause)).collect()
    }

    #[test]
    fn a_change_is_named_by_cause_and_by_the_dive_that_shows_it_first() {
        use ThrusterCause::{DirectionWrong, Loss, More, Reversed, StandsStill};
        assert_eq!(causes(&[1.0, 0.99, 0.8, 0.79]), [(2, Loss)]);
        assert_eq!(causes(&[1.0, 0.01, 1.0]), [(1, StandsStill), (2, More)]);
        assert_eq!(causes(&[1.01, -0.98]), [(1, Reversed)]);
        assert_eq!(causes(&[-1.0, -0.99, -1.02]), [(0, DirectionWrong)]);
        assert_eq!(causes(&[0.8, 0.81]), [(0, Loss)]);
    }

    #[test]
    fn thrusters_that_differ_by_chance_or_little_have_not_changed() {
        assert_eq!(causes(&[1.0, 1.04, 0.96, 1.03]), []);
        assert_eq!(causes(&[0.93, 0.94]), []);
    }
}
