//! Writes the controller as a C header for the exported plant.

use seaplant::Dof;

use crate::{AxisGains, Error, Gains, Law};

const TEMPLATE: &str = include_str!("../templates/control.h");

/// Laws that the header supports.
const KNOWN: &str = "pd, pid, exact or non-exact, not adaptive";

/// Returns the model's part: zero, or `M a + n(nu)` on the controlled axes.
fn model(law: Law) -> String {
    let (velocity, acceleration) = match law {
        Law::Exact => (
            "x[7 + i]",
            "acceleration[i] - (seaplant_kd[i] * rate[i] + seaplant_kp[i] * error[i]) / seaplant_controlled_mass[i]",
        ),
        Law::NonExact => ("seaplant_controlled[i] ? nu[i] : x[7 + i]", "acceleration[i]"),
        _ => return "    for (i = 0; i < 6; ++i)\n        model[i] = 0.0;\n".to_owned(),
    };
    format!(
        "    for (i = 0; i < 6; ++i) {{
        acceleration[i] = seaplant_controlled[i] ? {acceleration} : 0.0;
        nu[i] = {velocity};
    }}
    seaplant_mass(seaplant_theta, mass);
    seaplant_forces(seaplant_theta, nu, down, model);
    for (i = 0; i < 6; ++i)
        for (j = 0; j < 6; ++j)
            model[i] += mass[i][j] * acceleration[j];
"
    )
}

/// Returns the controller as a C header, `seaplant_control.h`.
///
/// It includes `seaplant_plant.h` from `seaplant export --to c` and computes the same forces as
/// [`crate::Controller`].
///
/// # Errors
/// [`Error::Unsuitable`] for the law of Slotine and Li and for adaptive models.
pub fn c_header(name: &str, gains: &Gains) -> Result<String, Error> {
    if gains.law == Law::SlotineLi || gains.adapts {
        let law = if gains.adapts { "adaptive" } else { gains.law.name() };
        return Err(Error::Unsuitable { format: "the C header", law, known: KNOWN });
    }
    let all = |pick: &dyn Fn(&AxisGains) -> f64, without: f64| {
        let of = |dof: Dof| format!("{:?}", gains.axes.get(&dof).map_or(without, pick));
        Dof::ALL.map(of).join(", ")
    };
    let own = Dof::ALL.map(|dof| u8::from(gains.axes.contains_key(&dof)).to_string());
    let feedback = match gains.law {
        Law::Exact => "",
        _ => {
            " - seaplant_kp[i] * error[i] - seaplant_kd[i] * rate[i]\n            - seaplant_ki[i] * memory->integral[i]"
        }
    };
    let places = [
        ("@LAW@", gains.law.name().to_owned()),
        ("@NAME@", harmless(name)),
        ("@VERSION@", env!("CARGO_PKG_VERSION").to_owned()),
        ("@NOTES@", notes(gains)),
        ("@PERIOD@", format!("{:?}", 1.0 / gains.sample_hz)),
        ("@KP@", all(&|axis| axis.kp, 0.0)),
        ("@KD@", all(&|axis| axis.kd, 0.0)),
        ("@KI@", all(&|axis| axis.ki, 0.0)),
        ("@MASSES@", all(&|axis| axis.mass, 1.0)),
        ("@LIMIT@", all(&|axis| axis.limit.unwrap_or(-1.0), -1.0)),
        ("@OWN@", own.join(", ")),
        ("@MODEL@", model(gains.law)),
        ("@FEEDBACK@", feedback.to_owned()),
    ];
    Ok(places
        .into_iter()
        .fold(TEMPLATE.to_owned(), |text, (place, value)| text.replace(place, &value)))
}

/// Escapes a text so that it ends no comment and contains no placeholder.
fn harmless(text: &str) -> String {
    text.replace("*/", "* /").replace(['@', '\n', '\r'], " ")
}

fn notes(gains: &Gains) -> String {
    let lines = gains.notes.iter().map(|note| format!(" * {}", harmless(note)));
    let margins = gains.axes.iter().map(|(dof, axis)| {
        format!(
            " * {dof}: {:.3} Hz, phase margin {:.0} degrees, at worst {:.0}",
            axis.bandwidth_hz, axis.margins.phase_deg, axis.worst.phase_deg
        )
    });
    margins.chain(lines).collect::<Vec<_>>().join("\n")
}
