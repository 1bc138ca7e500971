//! Names of methods, caveats and filters in prose.

use seaplant::estimate::Filters;
use seaplant::results::Verdict;
use seaplant::signal::LowPass;
use seaplant::{CaveatCode, Dof, Method, Role, ScoredMotion, Severity, Term};

use crate::number::{chosen, with_minus};
use crate::visible::visible;

/// Returns "equation error", "the paper's method".
pub(crate) fn method(method: Method) -> String {
    match method {
        Method::Paper => "the paper’s method".to_owned(),
        Method::Ekf => "joint Kalman filter".to_owned(),
        other => other.name().replace('-', " "),
    }
}

/// Capitalises the first letter, unless it is a symbol as in "v|v|".
pub(crate) fn capitalised(text: &str) -> String {
    let mut chars = text.chars();
    if !text.chars().nth(1).is_some_and(|second| second.is_alphabetic() || second == ' ') {
        return text.to_owned();
    }
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}

pub(crate) fn role(role: Role) -> &'static str {
    match role {
        Role::Fit => "fitted",
        Role::HoldOut => "held out",
        Role::Steady => "steady",
    }
}

/// Names the error of a model without a plant.
pub(crate) const fn still(quantity: ScoredMotion) -> &'static str {
    match quantity {
        ScoredMotion::Velocity => "Never moving",
        ScoredMotion::Acceleration => "Never accelerating",
    }
}

pub(crate) const fn severity(severity: Severity) -> &'static str {
    match severity {
        Severity::Note => "note",
        Severity::Warning => "warning",
        Severity::Severe => "severe",
    }
}

/// Returns a heading for a caveat: by default, its code in `results.json`.
pub(crate) fn caveat(code: CaveatCode) -> String {
    let better = match code {
        CaveatCode::BiasOneDirection => "Bias tested in one direction only",
        CaveatCode::ClockOffset => "Clock offset estimated from the data",
        CaveatCode::InstrumentElsewhere => "Instrument sits or points elsewhere than stated",
        CaveatCode::Collinear => "Terms hard to separate",
        CaveatCode::LagOrDelay => "Thruster lag or delay",
        CaveatCode::Log => "Log repaired",
        CaveatCode::NoBetterThanNull => "No better than standing still",
        CaveatCode::OneSignedThrust => "Thrust never changes sign",
        CaveatCode::ScoredOnFit => "Scored on its own trial",
        CaveatCode::SteadyUnsteadyDisagree => "Steady and unsteady drag disagree",
        CaveatCode::ThrustScale => "Scale of thrust not observable",
        CaveatCode::ThrustScaleKnown => "Scale of thrust fixed",
        CaveatCode::PresetGeometry => "Thrusters not measured",
        CaveatCode::TwoLevelThrust => "Thrust at two levels only",
        _ => "",
    };
    if !better.is_empty() {
        return better.to_owned();
    }
    let name = serde_json::to_value(code).ok();
    let name = name.as_ref().and_then(|name| name.as_str()).unwrap_or("caveat");
    capitalised(&name.replace('-', " "))
}

pub(crate) const fn mass(dof: Dof) -> &'static str {
    if dof.is_rotation() { "Inertia" } else { "Mass" }
}

/// Returns I for rotations, m for translations.
pub(crate) const fn mass_symbol(dof: Dof) -> &'static str {
    if dof.is_rotation() { "I" } else { "m" }
}

pub(crate) const fn bias_force(dof: Dof) -> &'static str {
    if dof.is_rotation() { "Bias moment" } else { "Bias force" }
}

pub(crate) const fn term_symbol(term: Term) -> &'static str {
    match term {
        Term::Force => "τ",
        Term::Quadratic => "v|v|",
        Term::Linear => "v",
        Term::Bias => "1",
    }
}

pub(crate) fn terms(terms: &[Term]) -> String {
    terms.iter().map(|term| term_symbol(*term)).collect::<Vec<_>>().join(", ")
}

pub(crate) fn filters(filters: &Filters) -> String {
    let one = |what: &str, filter: Option<LowPass>| {
        filter.map(|LowPass { cutoff_hz, order }| {
            format!("{what} {} Hz, order {order}", chosen(cutoff_hz))
        })
    };
    let all: Vec<String> = [one("v", filters.velocity), one("all", filters.every_term)]
        .into_iter()
        .flatten()
        .collect();
    if all.is_empty() { "none".to_owned() } else { all.join("; ") }
}

/// Escapes text for an element or an attribute, after [`visible`].
pub(crate) fn escaped(text: &str) -> String {
    let text = visible(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;")
}

/// Writes the motion that unseen trials confirm; nothing if none was tested.
pub(crate) fn good_for(verdict: &Verdict) -> String {
    let words = verdict.spoken_good_for().map(|words| capitalised(&with_minus(&words)));
    words.unwrap_or_default()
}

/// Writes by how much numbers may be off; nothing if none is named.
pub(crate) fn may_be_off(verdict: &Verdict) -> String {
    verdict.spoken_off().map_or_else(String::new, |off| capitalised(&off))
}
