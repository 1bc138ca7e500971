//! The part of the summary on a steering model.

use std::fmt::Write;

use seaplant::estimate::RudderLaw;
use seaplant::results::{NomotoResult, SecondOrder};
use seaplant_report::number::decimals;

use super::{align, parameter_row, plain_table, push_caveats};
use crate::output::STRONG;

/// Formats a steering model: K, T and its prediction error.
pub(super) fn block(model: &NomotoResult) -> String {
    let order = if model.order == 2 { "second" } else { "first" };
    let law = match model.rudder_law {
        RudderLaw::Proportional => "",
        RudderLaw::Sine => ", by ½ sin 2δ",
    };
    let mut text = format!(
        "{STRONG}yaw rate by rudder {}{STRONG:#}, Nomoto of the {order} order{law}\n",
        model.rudder
    );
    let mut all = vec![("K", &model.gain), ("T", &model.time)];
    if let Some(SecondOrder { time_sum, time_product, zero_time }) = &model.second {
        all.extend([("T1 + T2", time_sum), ("T1 T2", time_product), ("T3", zero_time)]);
    }
    all.extend(model.cubic.as_ref().map(|cubic| ("r³", cubic)));
    let mut table = plain_table();
    for (name, parameter) in all {
        table.add_row(parameter_row(name, parameter, None));
    }
    align(&mut table, 1..4);
    let _ = writeln!(text, "{}", table.to_string().trim_end());
    let held: Vec<f64> = model.hold_out_r2.values().flatten().copied().collect();
    let worst = held.iter().copied().reduce(f64::min);
    let held = worst.map_or(String::new(), |r2| format!(", held out {} at worst", decimals(r2, 3)));
    let _ = writeln!(text, "  R² of yaw rate {}{held}", decimals(model.fit_r2, 3));
    push_caveats(&mut text, &model.caveats);
    text.push('\n');
    text
}
