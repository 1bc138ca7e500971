//! Formats a controller: by line on a terminal, by row on its page.

use seaplant::Dof;
use seaplant_control::{AxisGains, Gains};
use seaplant_report::ControlTable;
use seaplant_report::number::significant;

use super::Run;
use crate::output::WARNING;

/// Ratio of errors in and without a current from which it is reported.
const TOLD_BY_CURRENT: f64 = 5.0;

/// Significant digits of gains …
const OF_GAINS: i32 = 4;
/// … and of errors and times.
const OF_OTHERS: i32 = 3;

/// Returns K_p, K_d and K_i with their units.
fn gains_of(dof: Dof, axis: &AxisGains) -> Vec<(&'static str, String)> {
    let units = dof.units();
    let with = |x: f64, unit: String| format!("{} {unit}", significant(x, OF_GAINS));
    let mut all = vec![
        ("K_p", with(axis.kp, format!("{}/{}", units.force, units.position))),
        ("K_d", with(axis.kd, units.linear_drag.to_owned())),
    ];
    if axis.ki > 0.0 {
        all.push(("K_i", with(axis.ki, format!("{}/({} s)", units.force, units.position))));
    }
    all
}

/// Formats the controller for a terminal.
pub(super) fn words(gains: &Gains, runs: &[Run], paths: &[String], notes: &[String]) -> String {
    let mut text = String::new();
    for (dof, axis) in &gains.axes {
        let unit = dof.units().position;
        let named = gains_of(*dof, axis);
        let named: Vec<String> = named.iter().map(|(name, x)| format!("{name} {x}")).collect();
        text += &format!(
            "{dof}: {:.4} Hz, damping {:.2}: {}\n  phase margin {:.0}° (worst case {:.0}°), delay margin {:.2} s (worst case {:.2} s)\n",
            axis.bandwidth_hz,
            axis.damping,
            named.join(", "),
            axis.margins.phase_deg,
            axis.worst.phase_deg,
            axis.margins.delay_s,
            axis.worst.delay_s
        );
        if let Some(error) = axis.saturates_at {
            text += &format!("  saturates at an error of {error:.3} {unit}\n");
        }
        for run in runs {
            text += &format!(
                "  tracking error on a sine in {}: {:.4} {unit} RMS\n",
                run.name, run.tracked.rms[dof]
            );
        }
    }
    for path in paths {
        text += &format!("{path}\n");
    }
    for note in notes {
        text += &format!("{WARNING}note:{WARNING:#} {note}\n");
    }
    text
}

/// Formats the controller for the page.
pub(super) fn table(gains: &Gains, runs: &[Run]) -> ControlTable {
    let fixed = ["axis", "bandwidth", "damping", "gains", "phase margin (worst case)"];
    let more = ["delay margin (worst case)", "saturates at an error of"];
    let errors = runs.iter().map(|run| format!("RMS error of a sine in {}", run.name));
    let columns = fixed.into_iter().chain(more).map(str::to_owned).chain(errors).collect();
    let row = |(dof, axis): (&Dof, &AxisGains)| {
        let unit = dof.units().position;
        let metres = |x: f64| format!("{} {unit}", significant(x, OF_OTHERS));
        let named = gains_of(*dof, axis);
        let named: Vec<String> = named.iter().map(|(name, x)| format!("{name} {x}")).collect();
        let own = [
            dof.to_string(),
            format!("{} Hz", significant(axis.bandwidth_hz, OF_OTHERS)),
            format!("{:.2}", axis.damping),
            named.join(", "),
            format!("{:.0}° ({:.0}°)", axis.margins.phase_deg, axis.worst.phase_deg),
            format!("{:.2} s ({:.2} s)", axis.margins.delay_s, axis.worst.delay_s),
            axis.saturates_at.map_or("limit not known".to_owned(), metres),
        ];
        own.into_iter().chain(runs.iter().map(|run| metres(run.tracked.rms[dof]))).collect()
    };
    ControlTable { columns, rows: gains.axes.iter().map(row).collect() }
}

/// Notes that a law without integral and adaptation leaves the error that a current causes.
pub(super) fn in_current(gains: &Gains, runs: &[Run]) -> Option<String> {
    let [still, current] = runs else { return None };
    let stays = |(dof, axis): &(&Dof, &AxisGains)| {
        axis.ki == 0.0 && current.tracked.rms[*dof] > TOLD_BY_CURRENT * still.tracked.rms[*dof]
    };
    let axes: Vec<&str> = gains.axes.iter().filter(stays).map(|(dof, _)| dof.name()).collect();
    (!axes.is_empty() && !gains.adapts).then(|| {
        format!(
            "{}: the current of --current causes a constant error, because the law has no integral; use --law pid or --adaptive, or more bandwidth",
            axes.join(", ")
        )
    })
}
