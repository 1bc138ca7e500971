//! Remarks in every exported file: units, frames, source, settings, uncertainty, doubts.

use seaplant::exchange::{Actuation, Judgement, PlantModel};
use seaplant::plant::Basis;
use seaplant::results::{Parameter, Trust};
use seaplant::{Dof, ThrustCurve};

use crate::code::input_of;

/// Frames of a format's numbers.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Frame {
    /// x forward, y starboard, z down; world north, east, down.
    Frd,
    /// x forward, y port, z up; world east, north, up.
    Flu,
}

impl Frame {
    const fn words(self) -> &'static str {
        match self {
            Self::Frd => {
                "body x forward, y starboard, z down (FRD), about the vehicle's origin; world north, east, down (NED)"
            }
            Self::Flu => {
                "body x forward, y port, z up (FLU), about the vehicle's origin; world east, north, up (ENU). The coefficients listed here are in axes x forward, y starboard, z down; the file's elements are turned"
            }
        }
    }
}

/// Remarks of an exporter on a plant.
pub(crate) struct Remarks<'a> {
    pub(crate) model: &'a PlantModel,
    /// Name of the format.
    pub(crate) format: &'a str,
    pub(crate) frame: Frame,
    /// Limitations and deviations of the format.
    pub(crate) limits: Vec<String>,
}

impl Remarks<'_> {
    /// Returns the notes for the terminal and the file: unknown axes, limits, notes, doubts.
    pub(crate) fn notes(&self) -> Vec<String> {
        let mut notes = unknown(self.model);
        notes.extend(self.limits.iter().cloned());
        if self.format != "json" {
            notes.extend(effects(self.model));
        }
        notes.extend(self.model.notes.iter().cloned());
        notes.extend(doubts(self.model));
        notes
    }

    /// Returns all lines, without comment marks; safe in any kind of comment.
    pub(crate) fn lines(&self) -> Vec<String> {
        let model = self.model;
        let mut lines = vec![
            format!(
                "{}: plant model written by Seaplant {} (seaplant export --to {})",
                model.name,
                env!("CARGO_PKG_VERSION"),
                self.format
            ),
            String::new(),
            format!("source: {}", model.origin.source),
        ];
        origin(model, &mut lines);
        lines.push("units: SI and radians".to_owned());
        lines.push(format!("frames: {}", self.frame.words()));
        lines.push(
            "equation: M nu'_r + C(M, nu_r) nu_r + damping + restoring = tau, nu_r = nu - R^T current; C follows from M; damping is positive where it brakes"
                .to_owned(),
        );
        lines.push(String::new());
        lines.extend(coefficients(model));
        vehicle(model, &mut lines);
        lines.push(String::new());
        lines.extend(model.judgements.iter().flat_map(judgement));
        lines.push("mind:".to_owned());
        lines.extend(self.notes().iter().map(|note| format!("  - {note}")));
        if !model.origin.settings.is_empty() {
            lines.push("settings of the identification:".to_owned());
            lines.extend(model.origin.settings.iter().map(|(k, v)| format!("  {k} = {v}")));
        }
        lines.iter().map(|line| harmless(line)).collect()
    }
}

/// Escapes a line so that it ends no comment and moves no cursor: names are untrusted.
pub(crate) fn harmless(line: &str) -> String {
    let plain: String = line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let turned: String = plain
        .chars()
        .filter(|c| !matches!(c, '\u{61c}' | '\u{200e}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}'))
        .collect();
    let safe = turned.replace("*/", "* /").replace("/*", "/ *").replace("\"\"\"", "'''");
    safe.replace('\\', "/").trim_end().to_owned()
}

fn unknown(model: &PlantModel) -> Vec<String> {
    let axes = model.unknown_axes();
    if axes.is_empty() {
        return Vec::new();
    }
    let names: Vec<&str> = axes.iter().map(|dof| dof.name()).collect();
    let which = names.join(", ");
    vec![format!(
        "NOT KNOWN: mass, damping and restoring of {which}: nothing was identified there. Entries of these axes are left out or marked; a zero there is not a measurement"
    )]
}

fn origin(model: &PlantModel, lines: &mut Vec<String>) {
    let origin = &model.origin;
    let mut push = |name: &str, value: &Option<String>| {
        if let Some(value) = value {
            lines.push(format!("{name}: {value}"));
        }
    };
    push("url", &origin.url);
    push("licence of the numbers", &origin.licence);
    push("identified by", &origin.command);
    push("identified with Seaplant", &origin.version);
}

fn coefficients(model: &PlantModel) -> Vec<String> {
    let mut lines = vec!["coefficients: value, standard deviation, 95 % interval, unit".to_owned()];
    let terms = model.plant.structure().terms().iter().zip(model.plant.coefficients());
    for (k, (term, value)) in terms.enumerate() {
        let error = match (model.std(k), model.interval(k)) {
            (Some(std), Some([low, high])) => {
                format!("± {} [{}, {}]", short(std), short(low), short(high))
            }
            _ => "± not stated".to_owned(),
        };
        let structure = model.plant.structure();
        let (name, unit) = (structure.name_of(term), structure.unit_of(term));
        lines.push(format!("  {name} = {value} {error} {unit}"));
    }
    lines
}

/// Formats four significant digits.
pub(crate) fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let magnitude = x.abs().log10().floor();
    if (-4.0..6.0).contains(&magnitude) {
        let decimals = (3.0 - magnitude).max(0.0) as usize;
        format!("{x:.decimals$}")
    } else {
        format!("{x:.3e}")
    }
}

fn vehicle(model: &PlantModel, lines: &mut Vec<String>) {
    if let Some(body) = &model.rigid_body {
        let r = body.centre_of_gravity_body();
        lines.push(format!(
            "rigid body: {} kg, centre of gravity ({}, {}, {}) m",
            body.mass_kg(),
            r.x,
            r.y,
            r.z
        ));
    } else {
        lines.push("rigid body: not known; only rigid body and added mass together are".to_owned());
    }
    for thruster in &model.thrusters {
        let (p, d) = (thruster.position_body, thruster.direction_body);
        let kind = match &thruster.curve {
            ThrustCurve::Quadratic { law, .. } => format!(
                "{} |s|^{} forward, {} |s|^{} reverse, deadband {}, neutral {}",
                law.forward, law.exponent, law.reverse, law.exponent, law.deadband, law.neutral
            ),
            ThrustCurve::Table { tables, .. } => format!("{} measured tables", tables.len()),
        };
        lines.push(format!(
            "thruster {}: at ({}, {}, {}) m, pushing ({}, {}, {}), {}, reads {}",
            thruster.name,
            p.x,
            p.y,
            p.z,
            d.x,
            d.y,
            d.z,
            kind,
            input_of(&thruster.curve)
        ));
    }
    lines.extend(actuation(model));
}

/// Returns lag, delay and reverse ratio, by axis.
pub(crate) fn actuation(model: &PlantModel) -> Vec<String> {
    let mut lines = Vec::new();
    for (dof, actuation) in &model.actuation {
        let all = [
            ("lag of propeller speed", &actuation.lag),
            ("lag of force", &actuation.force_lag),
            ("delay of thrust", &actuation.delay),
            ("reverse thrust over the curve's", &actuation.reverse_ratio),
        ];
        for (name, x) in all {
            lines.extend(x.as_ref().map(|x| told(dof, name, x)));
        }
        let own = actuation.lag_of.iter();
        lines.extend(own.map(|(name, lag)| told(dof, &format!("lag of {}", harmless(name)), lag)));
    }
    lines
}

fn told(dof: &Dof, name: &str, x: &Parameter) -> String {
    format!("{dof}: {name} {} ± {} {}", short(x.value), short(x.std), x.unit)
}

/// Returns the remark of a format without actuators on fitted lag, delay or reverse ratio.
pub(crate) fn without_actuation(model: &PlantModel) -> Option<String> {
    let found = actuation(model);
    (!found.is_empty()).then(|| {
        format!(
            "not applied here: {}; the formats c, rust, python, casadi, fmu and ros2 apply it, or apply it to thrust before it comes in",
            found.join("; ")
        )
    })
}

/// Returns the remark of a format that cannot represent rudders, fins, propellers of unknown
/// strength and wind: their forces are inputs with the others.
fn effects(model: &PlantModel) -> Option<String> {
    let structure = model.plant.structure();
    let terms = structure.terms().iter().zip(model.plant.coefficients());
    let of = |(term, value): (&Basis, &f64)| {
        let is_effect = matches!(term, Basis::Effect(_));
        is_effect.then(|| {
            format!("{} = {} {}", structure.name_of(term), short(*value), structure.unit_of(term))
        })
    };
    let found: Vec<String> = terms.filter_map(of).collect();
    let first = model.actuation.values().next();
    let gear = |actuation: &Actuation| {
        let delay = actuation.steering_delay.as_ref();
        let rate = actuation.steering_rate.as_ref();
        let delay = delay.map(|own| format!("{} s late", short(own.value)));
        let rate = rate.map(|own| format!("at no more than {} {}", short(own.value), own.unit));
        let both: Vec<String> = delay.into_iter().chain(rate).collect();
        (!both.is_empty()).then(|| {
            format!(", of which rudders and fins follow their orders {}", both.join(" and "))
        })
    };
    let gear = first.and_then(gear).unwrap_or_default();
    (!found.is_empty()).then(|| {
        format!(
            "LEFT OUT, for the format has no place for them: forces of rudders, fins, propellers and wind ({}){gear}; add them to the force that comes in, by their laws in the book, or simulate with `seaplant simulate`",
            found.join(", ")
        )
    })
}

/// Returns the objections to a plant from its verdicts and the signs of its drag, part by part;
/// empty for a usable one.
pub fn doubts(model: &PlantModel) -> Vec<String> {
    let of = |judgement: &Judgement| {
        let word = match judgement.verdict.trust {
            Trust::DoNotUse => "DO NOT USE",
            Trust::Doubtful => "DOUBTFUL",
            Trust::UsableWithCare | Trust::Usable => return None,
        };
        let axes: Vec<&str> = judgement.axes.iter().map(|dof| dof.name()).collect();
        Some(format!("{word}: {}: {}", axes.join("-"), judgement.verdict.reason))
    };
    let negative = model.negative_drag().into_iter().map(|reason| format!("DO NOT USE: {reason}"));
    model.judgements.iter().filter_map(of).chain(negative).collect()
}

fn judgement(of: &Judgement) -> Vec<String> {
    let axes: Vec<&str> = of.axes.iter().map(|dof| dof.name()).collect();
    let mut lines = vec![format!(
        "{} by {}: {} ({})",
        axes.join(", "),
        of.method,
        of.verdict.trust.name(),
        of.verdict.reason
    )];
    lines.extend(of.caveats.iter().map(|caveat| format!("  caveat: {}", caveat.message)));
    lines
}

/// Returns whether an axis is known.
pub(crate) fn knows(model: &PlantModel, dof: Dof) -> bool {
    model.plant.axes().contains(&dof)
}

/// Returns the products that are neither linear nor quadratic in one axis, by name and value.
pub(crate) fn other_products(
    model: &PlantModel,
) -> Vec<(String, Dof, seaplant::plant::Product, f64)> {
    use seaplant::plant::Product;
    let terms = model.plant.structure().terms().iter().zip(model.plant.coefficients());
    let usual = |product: &Product| {
        Dof::ALL.iter().any(|of| [Product::linear(*of), Product::quadratic(*of)].contains(product))
    };
    terms
        .filter_map(|(term, value)| match term {
            Basis::Product(on, product) if !usual(product) => {
                Some((term.to_string(), *on, *product, *value))
            }
            _ => None,
        })
        .collect()
}

/// Returns constant forces, by axis.
pub(crate) fn constants(model: &PlantModel) -> Vec<(Dof, f64)> {
    let terms = model.plant.structure().terms().iter().zip(model.plant.coefficients());
    terms
        .filter_map(|(term, value)| match term {
            Basis::One(on) => Some((*on, *value)),
            _ => None,
        })
        .collect()
}

/// Formats lines as comments, each after a mark.
pub(crate) fn commented(lines: &[String], mark: &str) -> String {
    lines.iter().map(|line| format!("{mark} {line}").trim_end().to_owned() + "\n").collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_ends_a_comment() {
        assert_eq!(harmless("a */ b \"\"\" c\n\u{1b}\u{202e}d \\"), "a * / b ''' c  d /");
    }

    #[test]
    fn short_numbers_keep_four_digits() {
        assert_eq!(short(12_970.21), "12970");
        assert_eq!(short(0.012_345), "0.01235");
        assert_eq!(short(1.2e-9), "1.200e-9");
    }
}
