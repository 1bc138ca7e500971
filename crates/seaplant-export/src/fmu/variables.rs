//! Variables of the FMU; a value reference is an index into its array.

use seaplant::Dof;
use seaplant::exchange::PlantModel;

use crate::code::{identifiers, input_of, names, number};
use crate::remarks::{harmless, knows, short};

/// Purpose of a variable.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Time,
    Input,
    /// Read each step.
    Tunable,
    /// Read at initialisation.
    Fixed,
    Output,
}

pub(super) struct Variable {
    pub(super) name: String,
    pub(super) about: String,
    pub(super) unit: &'static str,
    pub(super) kind: Kind,
    pub(super) start: f64,
}

/// All variables, and the start of each group.
pub(super) struct Variables {
    pub(super) all: Vec<Variable>,
    /// Index of each axis's force; none for an axis that is not known.
    pub(super) wrench: [Option<usize>; 6],
    pub(super) current: usize,
    /// Indices of the thrusters' inputs, and of the supply voltage if a curve needs it.
    pub(super) thrusters: Option<(usize, Option<usize>)>,
    /// Initial pose, then initial velocity.
    pub(super) start: usize,
    pub(super) theta: usize,
    /// Pose, then velocity.
    pub(super) output: usize,
}

const POSE: [(&str, &str); 6] = [
    ("north", "m"),
    ("east", "m"),
    ("down", "m"),
    ("roll", "rad"),
    ("pitch", "rad"),
    ("heading", "rad"),
];
const VELOCITY: [&str; 6] = ["u", "v", "w", "p", "q", "r"];
const WRENCH: [&str; 6] = ["force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z"];

/// Returns units as FMI's unit definitions name them.
fn force_unit(dof: Dof) -> &'static str {
    if dof.is_rotation() { "N.m" } else { "N" }
}

fn velocity_unit(dof: Dof) -> &'static str {
    if dof.is_rotation() { "rad/s" } else { "m/s" }
}

impl Variables {
    pub(super) fn from_model(model: &PlantModel) -> Self {
        let mut list = List::default();
        list.push("time", "time".to_owned(), "s", Kind::Time, 0.0);
        let wrench = Dof::ALL.map(|dof| {
            knows(model, dof).then(|| {
                let about = format!("{dof}: force or moment on the body, beside thrusters");
                list.push(WRENCH[dof.index()], about, force_unit(dof), Kind::Input, 0.0)
            })
        });
        let current = list.0.len();
        for name in ["current_north", "current_east", "current_down"] {
            list.push(name, "velocity of the water".to_owned(), "m/s", Kind::Input, 0.0);
        }
        let thrusters = thrusters(model, &mut list);
        let start = list.0.len();
        for (name, unit) in POSE {
            let about = format!("{name} at the beginning");
            list.push(&format!("start_{name}"), about, unit, Kind::Fixed, 0.0);
        }
        for dof in Dof::ALL {
            let name = VELOCITY[dof.index()];
            let held = match (knows(model, dof), dof.is_rotation()) {
                (true, _) => "",
                (false, false) => ", held: the axis is not known",
                (false, true) => ", not read: the axis is not known, and its angle stays",
            };
            let about = format!("{name} over ground at the beginning{held}");
            list.push(&format!("start_{name}"), about, velocity_unit(dof), Kind::Fixed, 0.0);
        }
        let theta = coefficients(model, &mut list);
        let output = list.0.len();
        for (name, unit) in POSE {
            list.push(name, format!("{name} of the vehicle's origin"), unit, Kind::Output, 0.0);
        }
        for dof in Dof::ALL {
            let name = VELOCITY[dof.index()];
            let held = match (knows(model, dof), dof.is_rotation()) {
                (true, _) => "",
                (false, false) => "; not known, stays as it was",
                (false, true) => "; not known, holds its angle",
            };
            let about = format!("{dof} velocity over ground in body axes{held}");
            list.push(name, about, velocity_unit(dof), Kind::Output, 0.0);
        }
        Self { all: list.0, wrench, current, thrusters, start, theta, output }
    }

    pub(super) fn starts(&self) -> String {
        self.all.iter().map(|v| format!("    {}, /* {} */\n", number(v.start), v.name)).collect()
    }

    /// Returns a letter for each variable, which determines when it may be set.
    pub(super) fn kinds(&self) -> String {
        let letter = |kind: Kind| match kind {
            Kind::Time => 't',
            Kind::Input => 'i',
            Kind::Tunable => 'p',
            Kind::Fixed => 'f',
            Kind::Output => 'o',
        };
        self.all.iter().map(|variable| letter(variable.kind)).collect()
    }

    /// Returns the lines that set tau from the inputs.
    pub(super) fn tau(&self) -> String {
        let line = |(k, place): (usize, &Option<usize>)| {
            Some(format!("    tau[{k}] = fmu->value[{}];\n", (*place)?))
        };
        self.wrench.iter().enumerate().filter_map(line).collect()
    }
}

#[derive(Default)]
struct List(Vec<Variable>);

impl List {
    /// Adds a variable and returns its index.
    fn push(
        &mut self,
        name: &str,
        about: String,
        unit: &'static str,
        kind: Kind,
        start: f64,
    ) -> usize {
        self.0.push(Variable { name: name.to_owned(), about, unit, kind, start });
        self.0.len() - 1
    }
}

fn thrusters(model: &PlantModel, list: &mut List) -> Option<(usize, Option<usize>)> {
    if model.thrusters.is_empty() {
        return None;
    }
    let first = list.0.len();
    let ids = identifiers(model.thrusters.iter().map(|thruster| thruster.name.as_str()));
    for (thruster, id) in model.thrusters.iter().zip(ids) {
        let about = format!("thruster {}: {}", harmless(&thruster.name), input_of(&thruster.curve));
        let start = thruster.curve.neutral();
        list.push(&format!("thruster_{id}"), about, "", Kind::Input, start);
    }
    let needs = model.thrusters.iter().any(|thruster| thruster.curve.needs_voltage());
    let voltage = needs
        .then(|| list.push("supply_voltage", "of the thrusters".to_owned(), "V", Kind::Input, 0.0));
    Some((first, voltage))
}

fn coefficients(model: &PlantModel, list: &mut List) -> usize {
    let first = list.0.len();
    let names = names(model);
    let ids = identifiers(names.iter().map(String::as_str));
    for (k, (name, id)) in names.iter().zip(ids).enumerate() {
        let unit = model.plant.structure().terms()[k].unit();
        let error = model.std(k).map_or(String::new(), |std| format!(", std {}", short(std)));
        let about = format!("coefficient {name} [{unit}]{error}");
        let value = model.plant.coefficients()[k];
        list.push(&format!("theta_{id}"), about, "", Kind::Tunable, value);
    }
    first
}
