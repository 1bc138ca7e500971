//! Plans of trials: manoeuvres, minutes for each, and predicted intervals.
//!
//! ```text
//! prior      hull formulas, a published table, or results with their covariance
//! library    multisines, joystick steps, doublets, zigzag, circles, spirals, stop and go, release …
//! limits     each manoeuvre as strong as thrust, speed, depth, a box and attitude allow
//! weighing   Fisher information of each by the filter of the fit, for plants that may be
//! minutes    a convex program with a certified gap
//! ```
//!
//! [`plan()`] does all of it; [`rehearse`] drives the plan with a simulated vehicle and returns its
//! logs; after the dive [`outcome`] compares the plan with them; [`commands_csv`], [`commands_bag`],
//! [`lua_script`] and [`deck_page`] make files to play and to print.

mod allocate;
mod bag;
mod battery;
mod description;
mod drive;
mod error;
mod files;
mod follow;
mod forecast;
mod goal;
mod hold;
mod limits;
mod logging;
mod lua;
mod manoeuvre;
mod margin;
mod minutes;
mod mission;
mod outcome;
mod page;
mod plan;
mod prior;
mod record;
mod rehearse;
mod request;
mod rig;
mod scale;
mod wave;
mod weigh;
mod weight;
mod words;
mod work;

pub use allocate::{Allocation, Criterion, Power, Program, Target};
pub use bag::commands_bag;
pub use battery::Battery;
pub use error::Error;
pub use files::commands_csv;
pub use forecast::{Chart, Forecast};
pub use goal::{Goal, Width};
pub use limits::Limits;
pub use logging::Logging;
pub use lua::lua_script;
pub use manoeuvre::{Kind, Manoeuvre};
pub use margin::ControllerGoal;
pub use mission::Mission;
pub use outcome::{check_outcome, outcome};
pub use page::{chart_svg, deck_page};
pub use plan::{Certificate, LimitCheck, PLAN_SCHEMA, Plan, Planned};
pub use prior::Prior;
pub use rehearse::{Rehearsal, rehearse};
pub use request::Request;
pub use wave::Wave;
pub use weight::HungWeight;
pub use words::words;
pub use work::plan;
