//! Identifies plant models of marine vehicles.

mod bollard;
mod caveat;
mod diagnose;
mod dof;
mod error;
pub mod estimate;
mod evaluate;
mod identify;
mod model;
pub mod navigation;
mod plant;
pub mod quantity;
pub mod regression;
pub mod results;
mod series;
pub mod signal;
mod simulate;
mod terms;
mod thrust;
mod trial;
pub mod twin;
mod vehicle;

pub use bollard::{BollardFit, fit_bollard_pull};
pub use caveat::{Caveat, CaveatCode, Severity};
pub use dof::{Dof, Units};
pub use error::Error;
pub use estimate::{Estimate, Fit, Method};
pub use evaluate::{Agreement, Comparison, PositionComparison, evaluate};
pub use identify::{IdentifyOptions, identify, score_plant};
pub use model::{Model, ThrustModel};
pub use navigation::{Motion, Navigated, Recording};
pub use plant::{LumpedParameters, PhysicalParameters, Stability};
pub use quantity::Quantity;
pub use series::{Gap, Grid, Timed};
pub use signal::{LowPass, Stretches};
pub use simulate::{Response, State, simulate};
pub use terms::{Term, Terms};
pub use thrust::{QuadraticThrust, ThrustCurve, ThrustTable, ThrusterInput};
pub use trial::{
    AxisRecord, Role, ThrusterTrack, Trial, TrialSetup, UniformAxis, UniformStretch,
    VelocitySource, lever_axes,
};
pub use vehicle::{Sensor, Sensors, Thruster, Vehicle};
