//! Section on steering models: response of yaw rate to a rudder.

use seaplant::estimate::RudderLaw;
use seaplant::results::{NomotoResult, Parameter, SecondOrder};
use serde::Serialize;

use super::doubts::{Doubts, collected};
use super::table::{Row, Table};
use crate::number::Rounded;

/// All models of a vehicle's rudders.
#[derive(Serialize)]
pub(crate) struct SteeringSection {
    tables: Vec<Table>,
    doubts: Doubts,
}

/// Returns the section; `None` without a model.
pub(crate) fn view(models: &[NomotoResult]) -> Option<SteeringSection> {
    let caveats = models.iter().flat_map(|model| {
        model.caveats.iter().map(|caveat| (title(model), caveat)).collect::<Vec<_>>()
    });
    (!models.is_empty()).then(|| SteeringSection {
        tables: models.iter().map(table).collect(),
        doubts: collected(caveats.collect()),
    })
}

fn title(model: &NomotoResult) -> String {
    let order = if model.order == 2 { "second" } else { "first" };
    format!("Rudder {}, Nomoto of the {order} order", model.rudder)
}

fn table(model: &NomotoResult) -> Table {
    let mut all = vec![("K", &model.gain), ("T", &model.time)];
    if let Some(SecondOrder { time_sum, time_product, zero_time }) = &model.second {
        all.extend([("T₁ + T₂", time_sum), ("T₁ T₂", time_product), ("T₃", zero_time)]);
    }
    all.extend(model.cubic.as_ref().map(|cubic| ("α of r³", cubic)));
    all.push(("δ₀", &model.neutral_angle));
    let row = |(name, x): (&str, &Parameter)| {
        let Rounded { value, std, low95, high95 } = Rounded::of(x);
        let interval = format!("[{low95}, {high95}]");
        Row::new([name.to_owned(), value, std, interval, x.unit.clone()])
    };
    let head = ["", "value", "std", "95 % interval", "unit"];
    Table::new(&title(model), head, all.into_iter().map(row).collect()).noted(&note(model))
}

/// Returns the note below the numbers: stability and prediction error.
fn note(model: &NomotoResult) -> String {
    let course = if model.is_stable {
        "A straight course is kept."
    } else {
        "A straight course is not kept."
    };
    let of = |(trial, r2): (&String, &Option<f64>)| match r2 {
        Some(r2) => format!("{r2:.3} on {trial}"),
        None => format!("none on {trial}, where it diverges"),
    };
    let held: Vec<String> = model.hold_out_r2.iter().map(of).collect();
    let held = if held.is_empty() {
        "no held-out trial has tested it".to_owned()
    } else {
        format!("held out {}", held.join(", "))
    };
    let law = match model.rudder_law {
        RudderLaw::Proportional => "",
        RudderLaw::Sine => " δ is replaced by ½ sin 2δ, which explains more.",
    };
    format!("{course}{law} R² of yaw rate, simulated freely: {:.3} fitted; {held}.", model.fit_r2)
}
