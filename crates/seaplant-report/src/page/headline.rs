//! One-line verdict on the vehicle.

use seaplant::exchange::Judgement;
use seaplant::results::{Results, Trust, Verdict};
use serde::Serialize;

use super::verdict::class;
use crate::words;

/// Verdict on some axes, in a clause.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct Finding {
    pub(super) axes: String,
    pub(super) trust: &'static str,
    pub(super) trust_class: String,
    /// Empty for usable axes.
    pub(super) reason: String,
}

/// Axes with equal verdict.
struct Alike {
    trust: Trust,
    reason: String,
    axes: Vec<String>,
}

/// Returns the verdicts on the vehicle's axes, the best first; axes with equal verdict are grouped.
pub(crate) fn findings(results: &Results) -> Vec<Finding> {
    let mut all: Vec<Alike> = Vec::new();
    for (axes, Verdict { trust, reason, .. }) in judged(results) {
        // Warnings on a usable plant follow below; the reason for doubt is stated here.
        let reason = match trust {
            Trust::Usable | Trust::UsableWithCare => String::new(),
            Trust::Doubtful | Trust::DoNotUse => format!("because {reason}"),
        };
        match all.iter_mut().find(|known| known.trust == trust && known.reason == reason) {
            Some(known) => known.axes.push(axes),
            None => all.push(Alike { trust, reason, axes: vec![axes] }),
        }
    }
    all.sort_by_key(|alike| std::cmp::Reverse(alike.trust));
    let mut findings: Vec<Finding> = all.into_iter().map(Alike::finding).collect();
    if let Some(first) = findings.first_mut() {
        first.axes = words::capitalised(&first.axes);
    }
    findings
}

impl Alike {
    fn finding(self) -> Finding {
        let axes = match self.axes.as_slice() {
            [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
            axes => axes.concat(),
        };
        Finding {
            axes,
            trust: self.trust.name(),
            trust_class: class(self.trust),
            reason: self.reason,
        }
    }
}

/// Returns each axis with its verdict; the axes of a plant with only a common verdict are one
/// entry.
fn judged(results: &Results) -> Vec<(String, Verdict)> {
    // Unless a method is requested, every axis has its recommended plant.
    let judgements = Judgement::of_results(results, None).unwrap_or_default();
    let of = |judgement: &Judgement| {
        let plant = results.plants.values().find(|plant| plant.axes == judgement.axes);
        match plant.map(|plant| &plant.verdicts).filter(|verdicts| !verdicts.is_empty()) {
            Some(verdicts) => verdicts
                .iter()
                .map(|(dof, verdict)| (dof.name().to_owned(), verdict.clone()))
                .collect(),
            None => {
                let names: Vec<&str> = judgement.axes.iter().map(|dof| dof.name()).collect();
                vec![(names.join("-"), judgement.verdict.clone())]
            }
        }
    };
    judgements.iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture;

    #[test]
    fn the_headline_names_each_axis_with_its_verdict() {
        let headline = findings(&fixture::identification().results);
        let said: Vec<(&str, &str)> =
            headline.iter().map(|finding| (finding.axes.as_str(), finding.trust)).collect();
        // Surge by itself; sway and yaw in one plant, with yaw doubtful.
        assert_eq!(
            said,
            [("Sway", "usable with care"), ("yaw", "doubtful"), ("surge", "do not use")]
        );
        assert_eq!(headline[0].reason, "");
        assert!(headline[1].reason.starts_with("because "), "{headline:?}");
    }
}
