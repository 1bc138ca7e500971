//! Campaigns and vehicles that are refused, each with its message.

use seaplant::results::Results;
use seaplant_campaign::Campaign;

use crate::common::{Folder, csv, said};

const VEHICLE: &str = r#"name = "sled"
[[thruster]]
name = "prop"
position_m = [0.0, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]
curve = { kind = "quadratic", forward = 0.04, reverse = 0.04 }
"#;

const CAMPAIGN: &str = r#"vehicle = "vehicle.toml"
[[trial]]
name = "run 1"
log = "log.csv"
dof = ["surge"]
[channels]
"thruster.prop.speed" = { column = "prop" }
"velocity.surge" = { column = "speed" }
"#;

/// Returns the message for a sled whose files have each first text replaced by the second; folders
/// are omitted.
fn refusal(of_vehicle: [&str; 2], of_campaign: [&str; 2]) -> String {
    let folder = Folder::new();
    let columns: [(&str, &dyn Fn(f64) -> f64); 2] =
        [("prop [rad/s]", &|t| 90.0 * t.sin()), ("speed [m/s]", &|t| (t - 0.7).sin())];
    folder.write("log.csv", &csv(10.0, 30.0, &columns));
    for (name, text, [from, to]) in
        [("vehicle.toml", VEHICLE, of_vehicle), ("campaign.toml", CAMPAIGN, of_campaign)]
    {
        assert!(text.contains(from), "{name} does not hold {from:?}");
        folder.write(name, &text.replacen(from, to, 1));
    }
    let error = Campaign::open(&folder.path().join("campaign.toml")).expect_err("it is refused");
    said(&error, &folder)
}

const AS_IT_IS: [&str; 2] = ["name", "name"];

fn of_vehicle(from: &str, to: &str) -> String {
    refusal([from, to], AS_IT_IS)
}

fn of_campaign(from: &str, to: &str) -> String {
    refusal(AS_IT_IS, [from, to])
}

fn of_curve(curve: &str) -> String {
    of_vehicle("{ kind = \"quadratic\", forward = 0.04, reverse = 0.04 }", curve)
}

const DOF: &str = "dof = [\"surge\"]";
const PLANT: &str = "[[plant]]\naxes = [\"surge\"]\n[channels]";

/// Returns the results of a simulated sled for a changed campaign.
fn results(changes: &[[&str; 2]]) -> Results {
    let folder = Folder::new();
    let (mut speed, mut rows) = (0.0_f64, String::from("time [s],prop [rad/s],speed [m/s]\n"));
    for k in 0..600_u32 {
        let t = 0.05 * f64::from(k);
        let prop = 90.0 * (0.9 * t).sin() + 40.0 * (0.37 * t).sin();
        rows += &format!("{t:.2},{prop},{speed}\n");
        speed += 0.05 * (0.04 * prop * prop.abs() - 60.0 * speed * speed.abs()) / 120.0;
    }
    folder.write("log.csv", &rows);
    folder.write("vehicle.toml", VEHICLE);
    let methods = "methods = [\"equation-error\", \"output-error\"]\n";
    let text = changes.iter().fold(CAMPAIGN.to_owned(), |text, [from, to]| text.replace(from, to));
    folder.write("campaign.toml", &format!("{methods}{text}"));
    let campaign = Campaign::open(&folder.path().join("campaign.toml")).expect("complete");
    campaign.identify("test").results
}

#[test]
fn a_plant_of_one_axis_is_the_dof_of_its_trials() {
    let by_dof = results(&[]);
    let by_plant = results(&[[DOF, ""], ["[channels]", PLANT]]);
    let by_both = results(&[["[channels]", PLANT]]);
    for other in [by_plant, by_both] {
        assert_eq!(other.plants["surge"].parameters, by_dof.plants["surge"].parameters);
        assert_eq!(other.methods, by_dof.methods);
        assert_eq!(other.together().count(), 0);
    }
}

#[test]
fn a_plant_of_one_axis_without_a_trial_is_refused() {
    let sway = PLANT.replace("surge", "sway");
    let message = refusal(AS_IT_IS, ["[channels]", &sway]);
    assert!(message.contains("axes = [\"sway\"] has no trial"), "{message}");
    let twice = PLANT.replace("[channels]", PLANT);
    let message = refusal([AS_IT_IS[0], AS_IT_IS[1]], ["[channels]", &twice]);
    assert!(message.contains("surge is an axis of two plants"), "{message}");
}

#[test]
fn a_trial_must_end_after_it_starts() {
    assert_eq!(
        of_campaign(DOF, "dof = [\"surge\"]\nfrom_s = 9.0\nto_s = 3.0"),
        "campaign.toml: trial `run 1`: ends before it starts; from_s must be less than to_s"
    );
}

#[test]
fn a_trial_needs_a_degree_of_freedom() {
    assert_eq!(
        of_campaign(DOF, "dof = []"),
        "campaign.toml: trial `run 1`: names no degree of freedom; add dof = [\"surge\"], say, or the axes of a plant of several"
    );
    let twice = of_campaign(DOF, "dof = [\"surge\", \"surge\"]");
    assert_eq!(twice, "campaign.toml: trial `run 1`: names a degree of freedom twice");
}

#[test]
fn a_degree_of_freedom_without_thrust_is_refused() {
    assert_eq!(
        of_campaign(DOF, "dof = [\"surge\", \"sway\"]"),
        "campaign.toml: trial `run 1` has no thruster that acts in sway; give one in \
         vehicle.toml, or map wrench.sway"
    );
}

#[test]
fn a_trial_needs_a_log_and_a_name_of_its_own() {
    let none = of_campaign("\"log.csv\"", "[]");
    assert_eq!(none, "campaign.toml: trial `run 1`: names no log; add log = \"...\"");
    let again = "[[trial]]\nname = \"run 1\"\nlog = \"log.csv\"\ndof = [\"surge\"]\n[channels]";
    let twice = of_campaign("[channels]", again);
    assert_eq!(twice, "campaign.toml: trial `run 1`: is given twice; give each trial its own name");
}

#[test]
fn an_offset_belongs_to_a_file_of_the_trial() {
    assert_eq!(
        of_campaign(DOF, "dof = [\"surge\"]\noffset_s = { \"lg.csv\" = 2.0 }"),
        "campaign.toml: trial `run 1`, offset_s.\"lg.csv\": is not among the trial's log = [...]; \
         write the file as it is written there"
    );
}

#[test]
fn terms_must_make_a_plant() {
    assert_eq!(
        of_campaign("[channels]", "[fit]\nterms = [\"force\", \"bias\"]\n[channels]"),
        "campaign.toml: fit.terms: the terms [force, bias] do not make a plant model; keep \
         `force` and at least one of quadratic and linear"
    );
}

#[test]
fn a_list_is_requested_where_one_is_due() {
    let dof = of_campaign(DOF, "dof = \"surge\"");
    assert!(dof.starts_with("campaign.toml: TOML parse error at line 5, column 7\n"), "{dof}");
    assert!(dof.ends_with("expected a sequence\nwrite a list: [...]"), "{dof}");
    let trial = of_campaign("[[trial]]", "[trial]");
    assert!(trial.ends_with("write its name in double brackets: [[...]]"), "{trial}");
}

#[test]
fn a_campaign_without_trials_gets_advice() {
    let text = CAMPAIGN.split_once("[channels]").expect("it has channels").0;
    let message = of_campaign(text, "vehicle = \"vehicle.toml\"\n");
    let advice = "missing field `trial`\nadd [[trial]] with what belongs to it";
    assert!(message.ends_with(advice), "{message}");
}

#[test]
fn a_time_column_that_is_not_there_brings_the_near_one() {
    assert_eq!(
        of_campaign("[channels]", "[time]\ncolumn = \"tme\"\n[channels]"),
        "trial `run 1`: no column \"tme\" in log.csv; did you mean \"time [s]\"? the columns are \
         \"time [s]\", \"prop [rad/s]\", \"speed [m/s]\""
    );
}

#[test]
fn channels_must_be_mapped() {
    let channels = CAMPAIGN.split_once("[channels]\n").expect("it has channels").1;
    assert_eq!(
        of_campaign(channels, ""),
        "campaign.toml: channels: is empty; map the log's columns, such as \"depth\" = { column = \
         \"Z (m)\" }"
    );
}

#[test]
fn an_optional_channel_may_be_absent() {
    let folder = Folder::new();
    let columns: [(&str, &dyn Fn(f64) -> f64); 2] =
        [("prop [rad/s]", &|t| 90.0 * t.sin()), ("speed [m/s]", &|t| (t - 0.7).sin())];
    folder.write("log.csv", &csv(10.0, 30.0, &columns));
    folder.write("vehicle.toml", VEHICLE);
    let depth = "\"depth\" = { column = \"Z\", optional = true }\n";
    let path = folder.write("campaign.toml", &format!("{CAMPAIGN}{depth}"));
    let campaign = Campaign::open(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(campaign.trials.len(), 1);
}

#[test]
fn a_thruster_is_unique_and_has_a_direction() {
    let (_, thruster) = VEHICLE.split_once("[[thruster]]").expect("it has one");
    let twice = of_vehicle("[[thruster]]", &format!("[[thruster]]{thruster}[[thruster]]"));
    assert_eq!(
        twice,
        "vehicle.toml: thruster `prop`: is given twice; give each thruster its own name"
    );
    assert_eq!(
        of_vehicle("direction = [1.0", "direction = [0.0"),
        "vehicle.toml: thruster `prop`: its direction is [0, 0, 0]; give the way it pushes"
    );
}

#[test]
fn a_mass_is_positive() {
    assert_eq!(
        of_vehicle("name = \"sled\"", "name = \"sled\"\ndry_mass_kg = -3.0"),
        "vehicle.toml: dry_mass_kg: must be a positive number of kg"
    );
}

#[test]
fn a_thrust_coefficient_is_a_positive_number() {
    assert_eq!(
        of_curve("{ kind = \"quadratic\", forward = -0.04, reverse = 0.04 }"),
        "vehicle.toml: thruster `prop`, curve: forward must be positive, reverse and deadband not \
         negative; the sign of reverse thrust comes from the input"
    );
    let text = of_curve("{ kind = \"quadratic\", forward = \"4e-2\", reverse = 0.04 }");
    assert!(text.ends_with("expected f64\nwrite a number, without quotation marks"), "{text}");
}

#[test]
fn a_curve_is_of_a_known_kind_with_known_keys() {
    let cubic = of_curve("{ kind = \"cubic\" }");
    let known = "unknown variant `cubic`, expected one of `quadratic`, `table`, `preset`, `estimate`, `open-water`";
    assert!(cubic.ends_with(known), "{cubic}");
    let misspelt =
        of_curve("{ kind = \"quadratic\", forward = 1.0, reverse = 1.0, deadbnd = 3.0 }");
    assert!(misspelt.ends_with("did you mean `deadband`?"), "{misspelt}");
}

#[test]
fn the_supply_voltage_of_a_curve_is_one_that_matters() {
    let quadratic = |rest: &str| {
        of_curve(&format!("{{ kind = \"quadratic\", forward = 1.0, reverse = 1.0, {rest} }}"))
    };
    let none = quadratic("input = \"pwm\", voltage_v = 0.0");
    assert!(none.ends_with("voltage_v is 0, and must be above 0 and at most 10000 V"), "{none}");
    let speed = quadratic("voltage_v = 16.0");
    assert!(speed.contains("voltage_v is for curves of pwm or command"), "{speed}");
    let twice = of_curve(
        "{ kind = \"table\", input = \"pwm\", voltage_v = 16.0, voltages = [{ voltage_v = 12.0, file = \"a.csv\" }] }",
    );
    assert!(twice.contains("voltage_v is stated beside voltages"), "{twice}");
}

#[test]
fn a_table_of_thrust_comes_from_one_place_and_rises() {
    assert_eq!(
        of_curve("{ kind = \"table\", input = \"speed\" }"),
        "vehicle.toml: thruster `prop`, curve: give one of points = [[input, N], ...], file = \
         \"...\" or voltages = [...]"
    );
    assert_eq!(
        of_curve("{ kind = \"table\", points = [[0, 0], [10, 3]] }"),
        "vehicle.toml: thruster `prop`, curve: points need input = \"speed\", \"pwm\" or \"command\""
    );
    assert_eq!(
        of_curve("{ kind = \"table\", input = \"speed\", points = [[0, 0], [10, 3], [5, 9]] }"),
        "vehicle.toml: thruster `prop`, curve: a thrust table falls from 9 N to 3 N at input 10, \
         while thrust must rise with the input; check its columns and units"
    );
    let absent = of_curve("{ kind = \"table\", input = \"speed\", file = \"pull.csv\" }");
    assert!(absent.starts_with("cannot read pull.csv: "), "{absent}");
    assert_eq!(
        of_curve("{ kind = \"table\", input = \"speed\", file = \"log.csv\" }"),
        "log.csv: force: no column states a unit of force; name one and its unit (N, kgf, lbf)"
    );
}

#[test]
fn a_file_that_is_not_text_is_no_campaign() {
    let folder = Folder::new();
    let path = folder.write("campaign.toml", "");
    std::fs::write(&path, b"\xff\xfe\x00").expect("a file can be written");
    let message = Campaign::open(&path).expect_err("not text").to_string();
    let end = ": is not UTF-8 text; give a TOML file here, and logs under log = [...]";
    assert!(message.ends_with(end), "{message}");
}

const OPEN_WATER: &str =
    "{ kind = \"open-water\", diameter_m = 0.2, k_t = [0.3, -0.3, -0.1], wake = 0.3 }";

#[test]
fn an_open_water_curve_has_possible_numbers() {
    let with = |from: &str, to: &str| of_curve(&OPEN_WATER.replacen(from, to, 1));
    let message = with("diameter_m = 0.2", "diameter_m = 0.0");
    assert!(message.contains("diameter_m must be a positive number"), "{message}");
    let message = with("[0.3, -0.3, -0.1]", "[0.0, -0.3, -0.1]");
    assert!(message.contains("k_t") && message.contains("above 0"), "{message}");
    let message = with("wake = 0.3", "wake = 1.0");
    assert!(message.contains("wake must be a fraction"), "{message}");
    let message = with("wake = 0.3", "wake = 0.3, thrust_deduction = 1.5");
    assert!(message.contains("leave it out to estimate it"), "{message}");
    let message =
        with("wake = 0.3", "wake = 0.3, wake_by_drift = { rate = -1, greatest = [1, 1] }");
    assert!(message.contains("wake_by_drift"), "{message}");
}

#[test]
fn a_flow_at_a_rudder_needs_a_propeller_by_its_open_water_curve() {
    let rudder = |flow: &str, curve: &str| {
        let vehicle = format!(
            "{curve}\n[[rudder]]\nname = \"helm\"\nposition_m = [-1, 0, 0]\naxis = [0, 0, -1]\nslipstream = \"prop\"\nflow = {{ {flow} }}"
        );
        of_curve(&vehicle)
    };
    let flow = "wake_ratio = 1.1, race_factor = 0.5, diameter_to_span = 0.6, straightening = 0.5, flow_at_m = -1.4";
    let quadratic = "{ kind = \"quadratic\", forward = 0.04, reverse = 0.04 }";
    let message = rudder(flow, quadratic);
    assert!(message.contains("helm") && message.contains("open-water"), "{message}");
    let message = rudder(&flow.replace("0.5, flow", "-0.5, flow"), OPEN_WATER);
    assert!(message.contains("straightening of its flow must not be negative"), "{message}");
    let message = rudder(&flow.replace("0.5, flow", "\"all\", flow"), OPEN_WATER);
    assert!(message.contains("from starboard, from port"), "{message}");
}

#[test]
fn a_model_of_ships_is_known_and_of_the_plane() {
    let plant = |axes: &str, model: &str| {
        of_campaign(
            "[channels]",
            &format!("[[plant]]\naxes = {axes}\nmodel = \"{model}\"\n[channels]"),
        )
    };
    let message = plant("[\"sway\", \"yaw\"]", "mmg");
    assert!(message.contains("surge") && message.contains("mmg"), "{message}");
    let message = plant("[\"surge\", \"sway\", \"yaw\"]", "nomoto");
    assert!(message.contains("abkowitz"), "{message}");
}
