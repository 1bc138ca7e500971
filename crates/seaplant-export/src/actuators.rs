//! Code for thrusters, shared by the templates of several languages.

use seaplant::exchange::{Actuation, PlantModel};
use seaplant::results::Parameter;
use seaplant::{Dof, QuadraticThrust, ThrustCurve, ThrustTable, Thruster};

use crate::code::{number, numbers};

/// Fitted parameters of the actuators, by axis; defaults 0, 0, 0 and 1.
pub(crate) struct Fitted {
    /// By axis, of each thruster.
    pub(crate) lag_s: [Vec<f64>; 6],
    pub(crate) force_lag_s: [f64; 6],
    pub(crate) delay_s: [f64; 6],
    pub(crate) reverse_ratio: [f64; 6],
}

impl Fitted {
    pub(crate) fn from_model(model: &PlantModel) -> Self {
        let axes = |of: fn(&Actuation) -> &Option<Parameter>, otherwise: f64| {
            Dof::ALL.map(|dof| {
                let found = model.actuation.get(&dof).and_then(|actuation| of(actuation).as_ref());
                found.map_or(otherwise, |parameter| parameter.value)
            })
        };
        Self {
            lag_s: Dof::ALL.map(|dof| {
                let of = |thruster: &Thruster| {
                    model.actuation.get(&dof).map_or(0.0, |own| own.lag_s(&thruster.name))
                };
                model.thrusters.iter().map(of).collect()
            }),
            force_lag_s: axes(|x| &x.force_lag, 0.0),
            delay_s: axes(|x| &x.delay, 0.0),
            reverse_ratio: axes(|x| &x.reverse_ratio, 1.0),
        }
    }

    /// Returns the template's placeholders with these numbers, for a language that begins a row and ends it like
    /// this.
    pub(crate) fn places(&self, [begin, end]: [&str; 2]) -> [(&'static str, String); 4] {
        let row = |lags: &Vec<f64>| format!("{begin}{}{end}", numbers(lags.iter().copied()));
        [
            ("LAG", self.lag_s.iter().map(row).collect()),
            ("FORCE_LAG", numbers(self.force_lag_s)),
            ("DELAY", numbers(self.delay_s)),
            ("RATIO", numbers(self.reverse_ratio)),
        ]
    }
}

/// Returns the inputs at which propellers are at rest.
pub(crate) fn neutral(model: &PlantModel) -> String {
    numbers(model.thrusters.iter().map(|thruster| thruster.curve.neutral()))
}

/// Returns the arguments of a power law before its input.
pub(crate) fn law_numbers(law: &QuadraticThrust) -> String {
    numbers([law.forward, law.reverse, law.exponent, law.deadband, law.neutral])
}

/// Syntax of a thrust curve in a language.
pub(crate) struct CurveSyntax {
    /// The name of the thruster's input.
    pub(crate) input: &'static str,
    /// The name of the supply voltage.
    pub(crate) supply_v: &'static str,
    /// A list of expressions.
    pub(crate) list: fn(&str) -> String,
    /// Name of the function of `x`, points and values that interpolates linearly and holds its
    /// ends.
    pub(crate) interpolated: &'static str,
}

impl CurveSyntax {
    /// Returns the thrust of an input as an expression: `power(…)` or an interpolation.
    pub(crate) fn thrust(&self, curve: &ThrustCurve) -> String {
        match curve {
            ThrustCurve::Quadratic { law, .. } => {
                format!("power({}, {})", law_numbers(law), self.input)
            }
            ThrustCurve::Table { tables, .. } => self.of_tables(tables),
        }
    }

    fn of_tables(&self, tables: &[ThrustTable]) -> String {
        let of = |table: &ThrustTable| {
            let (inputs, forces): (Vec<f64>, Vec<f64>) = table.points().unzip();
            self.interpolation(self.input, &numbers(inputs), &numbers(forces))
        };
        if let [table] = tables {
            return of(table);
        }
        let volts = tables.iter().map(|table| number(table.voltage.unwrap_or(0.0)));
        let volts = volts.collect::<Vec<_>>().join(", ");
        let all = tables.iter().map(of).collect::<Vec<_>>().join(", ");
        self.interpolation(self.supply_v, &volts, &all)
    }

    fn interpolation(&self, x: &str, points: &str, values: &str) -> String {
        format!("{}({x}, {}, {})", self.interpolated, (self.list)(points), (self.list)(values))
    }
}
