//! Writes a module for NumPy.

use seaplant::exchange::PlantModel;

use crate::actuators::{CurveSyntax, Fitted, neutral};
use crate::code::{Syntax, block, bracket, input_of, names, numbers, own};
use crate::remarks::{Remarks, commented, harmless};
use crate::template::fill;
use crate::{Error, Exported, ExportedFile, Exporter, c};

pub(crate) struct Python;

const SYNTAX: Syntax = Syntax {
    element: bracket,
    modulus: |x| format!("abs({x})"),
    root: |x| format!("({x}) ** 0.5"),
    entry: |name, i, j| format!("{name}[{i}, {j}]"),
    add: |place, value| format!("{place} += {value}"),
    set: |place, value| format!("{place} = {value}"),
};

const CURVES: CurveSyntax = CurveSyntax {
    input: "x",
    supply_v: "volts",
    list: |all| format!("[{all}]"),
    interpolated: "np.interp",
};

impl Exporter for Python {
    fn name(&self) -> &'static str {
        "python"
    }

    fn about(&self) -> &'static str {
        "one NumPy module: derivative, step, draws of the coefficients, thrusters with lag and delay"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = c::remarks(model, "python");
        let bytes = module(model, &remarks).into_bytes();
        let path = "seaplant_plant.py".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}

/// Returns the module as text.
pub(crate) fn module(model: &PlantModel, remarks: &Remarks<'_>) -> String {
    let places = [
        ("REMARKS", commented(&remarks.lines(), "#").trim_end().to_owned()),
        ("NAMES", name_list(model)),
        ("THETA", numbers(model.plant.coefficients().iter().copied())),
        ("COVARIANCE", covariance(model)),
        ("OWN", own(model).map(|x| x.to_string()).join(", ")),
        ("MASS", block(&SYNTAX.mass(model, "mass"), "    ")),
        ("FORCES", block(&SYNTAX.forces(model), "    ")),
        ("HELD", block(&SYNTAX.held(model), "    ")),
        ("ACTUATORS", actuators(model)),
    ];
    fill(include_str!("templates/plant.py"), &places).trim_end().to_owned() + "\n"
}

/// Returns the names of coefficients as a Python list.
pub(crate) fn name_list(model: &PlantModel) -> String {
    let quoted: Vec<String> = names(model).iter().map(|name| format!("\"{name}\"")).collect();
    format!("[{}]", quoted.join(", "))
}

fn covariance(model: &PlantModel) -> String {
    let Some(covariance) = &model.covariance else { return "None".to_owned() };
    let rows = covariance.row_iter();
    let rows = rows.map(|row| format!("        [{}],\n", numbers(row.iter().copied())));
    format!("np.array(\n    [\n{}    ]\n)", rows.collect::<String>())
}

fn actuators(model: &PlantModel) -> String {
    if model.thrusters.is_empty() {
        return String::new();
    }
    let mut text = "\n\nTHRUSTERS = [\n".to_owned();
    for thruster in &model.thrusters {
        let name = harmless(&thruster.name).replace('"', "'");
        text += &format!("    \"{name}\",  # input {}\n", input_of(&thruster.curve));
    }
    text += &format!(
        "]\n\nNEUTRAL = [{}]\n\"\"\"Inputs with which propellers stand still.\"\"\"\n",
        neutral(model)
    );
    text += "\nALLOCATION = np.array(\n    [\n";
    for thruster in &model.thrusters {
        text += &format!("        [{}],\n", numbers(thruster.unit_wrench()));
    }
    text += "    ]\n)\n\"\"\"The wrench of one newton of each thruster, a row each.\"\"\"\n";
    text += POWER;
    text += "\n\nCURVES = [\n";
    for thruster in &model.thrusters {
        text += &format!("    lambda x, volts: {},\n", CURVES.thrust(&thruster.curve));
    }
    text + "]\n" + &fill(WRENCH, &Fitted::from_model(model).places(["        [", "],\n"]))
}

const POWER: &str = "

def power(forward, reverse, exponent, deadband, neutral, x):
    s = max(0.0, abs(x - neutral) - deadband) ** exponent
    return -reverse * s if x < neutral else forward * s
";

const WRENCH: &str = "

def wrench(inputs, supply_v=None):
    \"\"\"tau (6,) of all thrusters from their inputs, without lag and delay.\"\"\"
    thrust = np.array([curve(x, supply_v) for curve, x in zip(CURVES, inputs, strict=True)])
    return thrust @ ALLOCATION


LAG_S = np.array(
    [
@LAG@    ]
)
FORCE_LAG_S = np.array([@FORCE_LAG@])
DELAY_S = np.array([@DELAY@])
REVERSE_RATIO = np.array([@RATIO@])
\"\"\"Between inputs and thrust, by axis, lags also by thruster, as fitted; 0, 0, 0 and 1 where nothing was
found.\"\"\"


class Actuators:
    \"\"\"Thrusters with lag, delay and reverse ratio; `inputs` are those before the start.

    A propeller follows its delayed input by lag ds/dt = input - s; thrust in reverse is that of the
    curve times the ratio; the force of all thrusters on an axis follows theirs by its own lag.
    \"\"\"

    def __init__(self, inputs):
        self.now = 0.0
        self.past = [(0.0, np.array(inputs, dtype=float))]
        self.speed = np.tile(self.past[0][1], (6, 1))
        self.force = None

    def wrench(self, inputs, h, supply_v=None):
        \"\"\"tau (6,) for the next h seconds, over which the inputs are held; 0.02 s or less.\"\"\"
        self.past.append((self.now, np.array(inputs, dtype=float)))
        tau = np.zeros(6)
        left = np.where(LAG_S > 0.0, np.exp(-0.5 * h / np.where(LAG_S > 0.0, LAG_S, 1.0)), 0.0)
        for axis, (delay, ratio) in enumerate(zip(DELAY_S, REVERSE_RATIO, strict=True)):
            goal = self.before(self.now + 0.5 * h - delay)
            behind = self.speed[axis] - goal
            middle = goal + behind * left[axis]
            self.speed[axis] = goal + behind * left[axis] ** 2
            thrust = [curve(x, supply_v) for curve, x in zip(CURVES, middle, strict=True)]
            thrust = np.array([ratio * f if f < 0.0 else f for f in thrust])
            tau[axis] = thrust @ ALLOCATION[:, axis]
        before = tau if self.force is None else self.force
        slow = FORCE_LAG_S > 0.0
        fade = np.where(slow, np.exp(-0.5 * h / np.where(slow, FORCE_LAG_S, 1.0)), 0.0)
        self.force = tau + (before - tau) * fade * fade
        tau = tau + (before - tau) * fade
        self.now += h
        while len(self.past) > 1 and self.past[1][0] < self.now - DELAY_S.max():
            self.past.pop(0)
        return tau

    def before(self, time):
        \"\"\"The inputs that were in force at a time.\"\"\"
        return next((x for since, x in reversed(self.past) if since <= time), self.past[0][1])
";
