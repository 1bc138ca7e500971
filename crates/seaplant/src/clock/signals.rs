//! The signals of a recording that can be compared with another's.

use std::collections::BTreeMap;

use super::search::Named;
use crate::navigation::{Motion, Navigated, Recording, navigate};
use crate::quantity::{Attitude, Axis, World};
use crate::signal::differentiate_timed;
use crate::trial::force_along;
use crate::{Dof, Quantity, Sensors, Timed, Vehicle};

/// A motion that several instruments may measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum What {
    /// Body velocity, linear or angular.
    Along(Dof),
    /// Velocity north.
    North,
    /// Velocity east.
    East,
    /// Horizontal speed.
    Speed,
}

/// Collects the motions in a recording.
pub(super) fn motions(recording: &Recording, sensors: &Sensors) -> BTreeMap<What, Named> {
    let nav = navigate("", recording, sensors).or_else(|_| {
        // For a misaligned DVL that lacks an axis, the other instruments may suffice.
        let is_dvl = |what: &Quantity| matches!(what, Quantity::DvlVelocity(_));
        let rest = recording.iter().filter(|(what, _)| !is_dvl(what));
        let rest: Recording = rest.map(|(what, x)| (what.clone(), x.clone())).collect();
        navigate("", &rest, sensors)
    });
    let Ok(nav) = nav else { return BTreeMap::new() };
    let source = Source::new(recording);
    let mut found = BTreeMap::new();
    let mut add = |what: What, name: String, series: Option<Timed>| {
        found.extend(series.map(|series| (what, Named { name, series })));
    };
    for dof in Dof::ALL {
        match nav.measured.get(&dof) {
            Some(measured) => {
                add(What::Along(dof), source.velocity(dof), Some(measured.clone()));
            }
            None => add(What::Along(dof), source.position(dof), derived(&nav, &source, dof)),
        }
    }
    let horizontal = [Dof::Surge, Dof::Sway].map(|dof| nav.measured.get(&dof));
    let reckoned = source.has_heading && horizontal.iter().all(Option::is_some);
    if let Some([north, east, _]) = nav.displacement_ned.filter(|_| source.positioned || reckoned) {
        let from = if source.positioned { "position" } else { "velocity and heading" };
        let slopes = [north, east].map(|way| differentiate_timed(&way).ok());
        if let [Some(north), Some(east)] = &slopes {
            add(What::Speed, format!("the speed by {from}"), length(north, east));
        }
        let [north, east] = slopes;
        add(What::North, format!("the velocity north by {from}"), north);
        add(What::East, format!("the velocity east by {from}"), east);
    }
    if let [Some(surge), Some(sway)] = horizontal {
        add(What::Speed, "the horizontal speed".to_owned(), length(surge, sway));
    }
    found
}

/// Computes the force along each degree of freedom from a recording.
pub(super) fn forces(recording: &Recording, vehicle: &Vehicle) -> BTreeMap<Dof, Named> {
    let along = |dof: Dof| {
        let kind = if dof.is_rotation() { "moment" } else { "force" };
        let series = force_along(recording, vehicle, dof)?;
        Some((dof, Named { name: format!("the {kind} of the thrusters in {dof}"), series }))
    };
    Dof::ALL.into_iter().filter_map(along).collect()
}

/// Differentiates a position along a degree of freedom.
fn derived(nav: &Navigated, source: &Source, dof: Dof) -> Option<Timed> {
    if let Some(position) = nav.position.get(&dof) {
        return differentiate_timed(position).ok();
    }
    // Without heading, north would be taken for forward.
    match nav.by_position.get(&dof).filter(|_| source.has_heading && source.positioned)? {
        Motion::Velocity(velocity) => Some(velocity.clone()),
        Motion::Position(position) => differentiate_timed(position).ok(),
        Motion::Acceleration(_) => None,
    }
}

/// Returns `√(a² + b²)` at the times of the first.
fn length(a: &Timed, b: &Timed) -> Option<Timed> {
    let at = |(&t, &a): (&f64, &f64)| a.hypot(b.at(t));
    a.with_values("speed", a.time_s().iter().zip(a.values()).map(at).collect()).ok()
}

/// The instruments behind a motion, for its name.
struct Source {
    has_heading: bool,
    positioned: bool,
    has_dvl: bool,
    has_rate: [bool; 3],
    has_depth: bool,
}

impl Source {
    fn new(recording: &Recording) -> Self {
        let has = |what: Quantity| recording.contains_key(&what);
        let axes = [Axis::X, Axis::Y, Axis::Z];
        Self {
            has_heading: has(Quantity::Attitude(Attitude::Heading)),
            positioned: [World::North, World::East].map(Quantity::Position).into_iter().all(has),
            has_dvl: axes.map(Quantity::DvlVelocity).into_iter().any(has),
            has_rate: axes.map(|axis| has(Quantity::Rate(axis))),
            has_depth: has(Quantity::Depth),
        }
    }

    fn velocity(&self, dof: Dof) -> String {
        match dof {
            Dof::Roll | Dof::Pitch | Dof::Yaw if self.has_rate[dof.index() - 3] => {
                format!("rate.{dof}")
            }
            Dof::Surge | Dof::Sway | Dof::Heave if self.has_dvl => {
                format!("the {dof} velocity of the DVL")
            }
            _ => format!("velocity.{dof}"),
        }
    }

    fn position(&self, dof: Dof) -> String {
        match dof {
            Dof::Roll | Dof::Pitch => format!("the rate of attitude.{dof}"),
            Dof::Yaw => "the rate of attitude.heading".to_owned(),
            Dof::Heave if self.has_depth => "the rate of depth".to_owned(),
            _ => format!("the {dof} velocity by position"),
        }
    }
}
