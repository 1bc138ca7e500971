//! Writes one header in C, with no dependency but math.h: the reference for every other format.

use seaplant::exchange::PlantModel;
use seaplant::{ThrustCurve, ThrustTable};

use crate::actuators::{Fitted, law_numbers};
use crate::code::{Syntax, block, bracket, input_of, names, number, numbers, own};
use crate::remarks::{Frame, Remarks, commented, harmless, without_actuation};
use crate::template::fill;
use crate::{Error, Exported, ExportedFile, Exporter};

pub(crate) struct C;

pub(crate) const SYNTAX: Syntax = Syntax {
    element: bracket,
    modulus: |x| format!("fabs({x})"),
    root: |x| format!("sqrt({x})"),
    entry: |name, i, j| format!("{name}[{i}][{j}]"),
    add: |place, value| format!("{place} += {value};"),
    set: |place, value| format!("{place} = {value};"),
};

impl Exporter for C {
    fn name(&self) -> &'static str {
        "c"
    }

    fn about(&self) -> &'static str {
        "one C header: derivative, RK4 step, thrusters with lag and delay"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = remarks(model, "c");
        let bytes = header(model, &remarks).into_bytes();
        let path = "seaplant_plant.h".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}

pub(crate) fn remarks<'a>(model: &'a PlantModel, format: &'a str) -> Remarks<'a> {
    // Without thrusters the header contains no lag.
    let limits = if model.thrusters.is_empty() { without_actuation(model) } else { None };
    Remarks { model, format, frame: Frame::Frd, limits: limits.into_iter().collect() }
}

/// Returns the header as text.
pub(crate) fn header(model: &PlantModel, remarks: &Remarks<'_>) -> String {
    let places = [
        ("REMARKS", commented(&remarks.lines(), " *").trim_end().to_owned()),
        ("COUNT", model.plant.coefficients().len().to_string()),
        ("THRUSTERS", model.thrusters.len().to_string()),
        ("OWN", own(model).map(|x| x.to_string()).join(", ")),
        ("THETA", theta(model)),
        ("STD", std(model)),
        ("MASS", block(&SYNTAX.mass(model, "mass"), "    ")),
        ("FORCES", block(&SYNTAX.forces(model), "    ")),
        ("HELD", block(&SYNTAX.held(model), "    ")),
        ("ACTUATORS", actuators(model)),
    ];
    fill(include_str!("templates/plant.h"), &places)
}

fn theta(model: &PlantModel) -> String {
    let lines =
        model.plant.coefficients().iter().zip(names(model)).zip(model.plant.structure().terms());
    lines
        .map(|((value, name), term)| {
            format!("    {}, /* {name} [{}] */\n", number(*value), term.unit())
        })
        .collect()
}

fn std(model: &PlantModel) -> String {
    if model.covariance.is_none() {
        return String::new();
    }
    let all: Vec<f64> =
        (0..model.plant.coefficients().len()).filter_map(|k| model.std(k)).collect();
    format!(
        "/* Their standard deviations. */\nstatic const double seaplant_std[SEAPLANT_COEFFICIENTS] = {{{}}};\n",
        numbers(all)
    )
}

/// Returns thrust curves and allocation; empty for a plant without thrusters.
fn actuators(model: &PlantModel) -> String {
    if model.thrusters.is_empty() {
        return String::new();
    }
    let mut text = "\n/* The wrench of one newton of each thruster. */\nstatic const double seaplant_allocation[SEAPLANT_THRUSTERS][6] = {\n".to_owned();
    for thruster in &model.thrusters {
        let name = harmless(&thruster.name);
        text += &format!("    {{{}}}, /* {name} */\n", numbers(thruster.unit_wrench()));
    }
    text += "};\n\n";
    text += INTERPOLATE;
    for (k, thruster) in model.thrusters.iter().enumerate() {
        text += &curve(k, &harmless(&thruster.name), &thruster.curve);
    }
    let cases: String = (0..model.thrusters.len())
        .map(|k| format!("    case {k}: return seaplant_thrust_{k}(input, supply_v);\n"))
        .collect();
    let mut places = vec![("CASES", cases)];
    places.extend(Fitted::from_model(model).places(["    {", "},\n"]));
    text + &fill(WRENCH, &places)
}

const INTERPOLATE: &str = "static inline double seaplant_interpolate(const double input[], const double force[], int count, double x)
{
    int k = 1;
    if (!(x > input[0]))
        return force[0];
    while (k < count && x > input[k])
        ++k;
    if (k == count)
        return force[count - 1];
    return force[k - 1] + (x - input[k - 1]) / (input[k] - input[k - 1]) * (force[k] - force[k - 1]);
}

static inline double seaplant_power(double forward, double reverse, double exponent, double deadband, double neutral, double x)
{
    double s = fabs(x - neutral) - deadband;
    if (!(s > 0.0))
        return 0.0;
    s = pow(s, exponent);
    return x < neutral ? -reverse * s : forward * s;
}
";

const WRENCH: &str = "
/* Thrust [N] of one thruster; `supply_v` [V] is read only by curves of several voltages. */
static inline double seaplant_thrust(int thruster, double input, double supply_v)
{
    switch (thruster) {
@CASES@    default: return 0.0;
    }
}

/* tau of all thrusters from their inputs, without lag and delay. */
static inline void seaplant_wrench(const double input[], double supply_v, double tau[6])
{
    int i, k;
    for (i = 0; i < 6; ++i)
        tau[i] = 0.0;
    for (k = 0; k < SEAPLANT_THRUSTERS; ++k)
        for (i = 0; i < 6; ++i)
            tau[i] += seaplant_allocation[k][i] * seaplant_thrust(k, input[k], supply_v);
}

/* Between inputs and thrust, as it was fitted for each axis; 0, 0, 0 and 1 where nothing was found.
   A propeller follows its delayed input by lag ds/dt = input - s; thrust in reverse is that of the
   curve times the ratio; the force of all thrusters on an axis follows theirs by its own lag. */
static const double seaplant_lag_s[6][SEAPLANT_THRUSTERS] = {
@LAG@};
static const double seaplant_force_lag_s[6] = {@FORCE_LAG@};
static const double seaplant_delay_s[6] = {@DELAY@};
static const double seaplant_reverse_ratio[6] = {@RATIO@};

/* Inputs that are kept for the delay: it is cut short where it exceeds so many steps. */
#define SEAPLANT_PAST 256

typedef struct {
    double speed[SEAPLANT_THRUSTERS][6];
    double force[6];
    int is_driven;
    double past[SEAPLANT_PAST][SEAPLANT_THRUSTERS];
    double since[SEAPLANT_PAST];
    double now;
    long count;
} seaplant_actuators;

/* Actuators whose inputs have always been these. */
static inline void seaplant_actuators_begin(seaplant_actuators *of, const double input[])
{
    int i, k;
    for (k = 0; k < SEAPLANT_THRUSTERS; ++k) {
        of->past[0][k] = input[k];
        for (i = 0; i < 6; ++i)
            of->speed[k][i] = input[k];
    }
    for (i = 0; i < 6; ++i)
        of->force[i] = 0.0;
    of->is_driven = 0;
    of->since[0] = 0.0;
    of->now = 0.0;
    of->count = 1;
}

/* The inputs that were in force at a time. */
static inline const double *seaplant_past(const seaplant_actuators *of, double time)
{
    long at = of->count - 1;
    while (at > 0 && at > of->count - SEAPLANT_PAST && of->since[at % SEAPLANT_PAST] > time)
        --at;
    return of->past[at % SEAPLANT_PAST];
}

/* tau for the next h seconds, over which the inputs are held; steps of 0.02 s or less follow a lag. */
static inline void seaplant_actuate(seaplant_actuators *of, const double input[], double supply_v,
                                    double h, double tau[6])
{
    int i, k;
    of->since[of->count % SEAPLANT_PAST] = of->now;
    for (k = 0; k < SEAPLANT_THRUSTERS; ++k)
        of->past[of->count % SEAPLANT_PAST][k] = input[k];
    ++of->count;
    for (i = 0; i < 6; ++i) {
        const double *goal = seaplant_past(of, of->now + 0.5 * h - seaplant_delay_s[i]);
        double force_lag = seaplant_force_lag_s[i];
        double thrust, middle, force = 0.0;
        for (k = 0; k < SEAPLANT_THRUSTERS; ++k) {
            double lag = seaplant_lag_s[i][k], behind = of->speed[k][i] - goal[k];
            middle = goal[k] + (lag > 0.0 ? behind * exp(-0.5 * h / lag) : 0.0);
            of->speed[k][i] = goal[k] + (lag > 0.0 ? behind * exp(-h / lag) : 0.0);
            thrust = seaplant_thrust(k, middle, supply_v);
            if (thrust < 0.0)
                thrust *= seaplant_reverse_ratio[i];
            force += seaplant_allocation[k][i] * thrust;
        }
        middle = of->is_driven ? of->force[i] - force : 0.0;
        tau[i] = force + (force_lag > 0.0 ? middle * exp(-0.5 * h / force_lag) : 0.0);
        of->force[i] = force + (force_lag > 0.0 ? middle * exp(-h / force_lag) : 0.0);
    }
    of->is_driven = 1;
    of->now += h;
}
";

fn curve(k: usize, name: &str, curve: &ThrustCurve) -> String {
    let head = format!(
        "\n/* {name}: input {} */\nstatic inline double seaplant_thrust_{k}(double input, double supply_v)\n{{\n",
        input_of(curve)
    );
    let body = match curve {
        ThrustCurve::Quadratic { law, .. } => format!(
            "    (void)supply_v;\n    (void)seaplant_interpolate;\n    return seaplant_power({}, input);\n",
            law_numbers(law)
        ),
        ThrustCurve::Table { tables, .. } => tables_body(tables),
    };
    head + &body + "}\n"
}

fn tables_body(tables: &[ThrustTable]) -> String {
    let mut text = String::new();
    for (t, table) in tables.iter().enumerate() {
        let (inputs, forces): (Vec<f64>, Vec<f64>) = table.points().unzip();
        text += &format!("    static const double input_{t}[] = {{{}}};\n", numbers(inputs));
        text += &format!("    static const double force_{t}[] = {{{}}};\n", numbers(forces));
    }
    let of = |t: usize| {
        let count = tables[t].points().count();
        format!("seaplant_interpolate(input_{t}, force_{t}, {count}, input)")
    };
    text += "    (void)seaplant_power;\n";
    if tables.len() == 1 {
        return text + &format!("    (void)supply_v;\n    return {};\n", of(0));
    }
    let volts = |t: usize| number(tables[t].voltage.unwrap_or(0.0));
    text += &format!("    if (!(supply_v > {}))\n        return {};\n", volts(0), of(0));
    for t in 1..tables.len() {
        let (low, high) = (volts(t - 1), volts(t));
        text += &format!(
            "    if (supply_v <= {high})\n        return {} + (supply_v - {low}) / ({high} - {low}) * ({} - {});\n",
            of(t - 1),
            of(t),
            of(t - 1)
        );
    }
    text + &format!("    return {};\n", of(tables.len() - 1))
}
