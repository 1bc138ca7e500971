//! The vehicle as data, for the use of a plant elsewhere.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::plant::{Buoyancy, RigidBody};
use crate::thrust::{check_exponent, check_supply};
use crate::{Error, QuadraticThrust, ThrustCurve, ThrustTable, ThrusterInput};

/// The rigid body of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigidBodyResult {
    /// Mass in air, kg.
    pub mass_kg: f64,
    /// Centre of gravity from the vehicle's origin, m.
    pub centre_of_gravity_m: [f64; 3],
    /// Inertia about the centre of gravity, kg m².
    pub inertia_kg_m2: [[f64; 3]; 3],
}

impl RigidBodyResult {
    /// Returns the data of a rigid body.
    pub fn of(body: &RigidBody) -> Self {
        let inertia = body.inertia();
        Self {
            mass_kg: body.mass_kg(),
            centre_of_gravity_m: body.centre_of_gravity_body().into(),
            inertia_kg_m2: std::array::from_fn(|i| std::array::from_fn(|j| inertia[(i, j)])),
        }
    }

    /// Creates the rigid body.
    ///
    /// # Errors
    /// As [`RigidBody::new`].
    pub fn body(&self) -> Result<RigidBody, Error> {
        RigidBody::new(self.mass_kg, self.centre_of_gravity_m, self.inertia_kg_m2)
    }
}

/// Displacement of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BuoyancyResult {
    /// Mass of the displaced water, kg.
    pub displaced_kg: f64,
    /// Centre of buoyancy from the vehicle's origin, m.
    pub centre_m: [f64; 3],
}

impl BuoyancyResult {
    /// Returns the data of a buoyancy.
    pub fn of(buoyancy: &Buoyancy) -> Self {
        Self { displaced_kg: buoyancy.displaced_kg, centre_m: buoyancy.centre_body.into() }
    }

    /// Creates the buoyancy.
    ///
    /// # Errors
    /// As [`Buoyancy::new`].
    pub fn buoyancy(&self) -> Result<Buoyancy, Error> {
        Buoyancy::new(self.displaced_kg, self.centre_m)
    }
}

/// A thrust curve as data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind", deny_unknown_fields)]
pub enum CurveResult {
    /// `F = ± c |s|^p`, with c and the sign by that of s = sign(x − neutral) max(0, |x − neutral| − deadband).
    Quadratic {
        /// The input.
        input: ThrusterInput,
        /// c for s > 0, N per unit of input to the power p.
        forward: f64,
        /// c for s < 0, N per unit of input to the power p.
        reverse: f64,
        /// The exponent p.
        #[serde(default = "square", skip_serializing_if = "is_square")]
        exponent: f64,
        /// Half-width of the band around neutral without thrust.
        #[serde(default)]
        deadband: f64,
        /// The input of zero thrust.
        #[serde(default)]
        neutral: f64,
        /// Supply voltage of the measurement, V.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        voltage: Option<f64>,
    },
    /// Measured points, linearly interpolated.
    Table {
        /// The input.
        input: ThrusterInput,
        /// One for each supply voltage.
        tables: Vec<CurveTable>,
    },
}

/// Measured points at one supply voltage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CurveTable {
    /// Supply voltage, V.
    #[serde(default)]
    pub voltage: Option<f64>,
    /// Points (input, N).
    pub points: Vec<(f64, f64)>,
}

const fn square() -> f64 {
    2.0
}

fn is_square(exponent: &f64) -> bool {
    *exponent == square()
}

impl CurveResult {
    /// Returns the data of a curve.
    pub fn of(curve: &ThrustCurve) -> Self {
        match curve {
            ThrustCurve::Quadratic { input, law } => Self::Quadratic {
                input: *input,
                forward: law.forward,
                reverse: law.reverse,
                exponent: law.exponent,
                deadband: law.deadband,
                neutral: law.neutral,
                voltage: law.voltage,
            },
            ThrustCurve::Table { input, tables } => {
                let table_data = |table: &ThrustTable| CurveTable {
                    voltage: table.voltage,
                    points: table.points().collect(),
                };
                Self::Table { input: *input, tables: tables.iter().map(table_data).collect() }
            }
        }
    }

    /// Creates the curve.
    ///
    /// # Errors
    /// [`Error::ThrustTable`] for invalid points, a law with a number that is not finite, or a supply voltage that is
    /// not above zero.
    pub fn curve(&self) -> Result<ThrustCurve, Error> {
        match self {
            Self::Quadratic { input, forward, reverse, exponent, deadband, neutral, voltage } => {
                let numbers = [*forward, *reverse, *exponent, *deadband, *neutral];
                if !numbers.iter().all(|x| x.is_finite()) {
                    let reason = "holds a number that is not finite".to_owned();
                    return Err(Error::ThrustTable { reason });
                }
                let [forward, reverse, exponent, deadband, neutral] = numbers;
                let voltage = *voltage;
                check_supply(voltage)?;
                check_exponent(exponent)?;
                let law =
                    QuadraticThrust { forward, reverse, exponent, deadband, neutral, voltage };
                Ok(ThrustCurve::Quadratic { input: *input, law })
            }
            Self::Table { input, tables } => {
                let table_of =
                    |table: &CurveTable| ThrustTable::new(table.voltage, table.points.clone());
                ThrustCurve::tables(*input, tables.iter().map(table_of).collect::<Result<_, _>>()?)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_and_bodies_are_recovered_from_their_data() {
        let table = ThrustTable::new(Some(16.0), vec![(1100.0, -40.0), (1900.0, 50.0)]);
        let tables = vec![table.expect("rises")];
        let measured = ThrustCurve::tables(ThrusterInput::Pwm, tables).expect("one");
        let law = QuadraticThrust {
            forward: 0.04,
            reverse: 0.03,
            exponent: 1.8,
            deadband: 5.0,
            neutral: 1.0,
            voltage: Some(16.0),
        };
        let quadratic = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
        for curve in [measured, quadratic] {
            assert_eq!(CurveResult::of(&curve).curve(), Ok(curve));
        }
        let inertia = [[0.26, 0.0, 0.0], [0.0, 0.23, 0.0], [0.0, 0.0, 0.37]];
        let body = RigidBody::new(13.5, [0.0, 0.0, 0.02], inertia).expect("a body");
        assert_eq!(RigidBodyResult::of(&body).body(), Ok(body));
    }

    #[test]
    fn refuses_a_curve_with_numbers_that_are_not_finite() {
        let law = |forward, voltage| CurveResult::Quadratic {
            input: ThrusterInput::Speed,
            forward,
            reverse: 0.0,
            exponent: 2.0,
            deadband: 0.0,
            neutral: 0.0,
            voltage,
        };
        assert!(law(f64::NAN, None).curve().is_err() && law(1.0, Some(16.0)).curve().is_ok());
        for volts in [0.0, -16.0, f64::NAN] {
            assert!(law(1.0, Some(volts)).curve().is_err());
            assert!(ThrustTable::new(Some(volts), vec![(0.0, 0.0), (1.0, 9.0)]).is_err());
        }
    }
}
