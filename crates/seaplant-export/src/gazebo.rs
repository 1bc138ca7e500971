//! Writes a model for gz-sim, with added mass in the physics engine.

use std::fmt::Write;

use nalgebra::{Matrix6, Vector3};
use seaplant::exchange::PlantModel;
use seaplant::plant::{Basis, Factor, GRAVITY, Product};
use seaplant::{Dof, ThrustCurve, Thruster};

use crate::code::{identifier, identifiers, number};
use crate::flu;
use crate::link::{DENSITY, Link};
use crate::remarks::{Frame, Remarks, constants, harmless, without_actuation};
use crate::{Error, Exported, ExportedFile, Exporter};

pub(crate) struct Gazebo;

impl Exporter for Gazebo {
    fn name(&self) -> &'static str {
        "gazebo"
    }

    fn about(&self) -> &'static str {
        "a model for gz-sim: fluid_added_mass, Hydrodynamics, Buoyancy, Thruster, and a world"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let link = Link::from_model(model, "gazebo")?;
        let mut limits = link.notes.clone();
        limits.extend(missing(model));
        limits.extend(without_actuation(model));
        let remarks = Remarks { model, format: "gazebo", frame: Frame::Flu, limits };
        let comment = xml_comment(&remarks.lines());
        let name = model_name(model);
        let file = |path: String, text: String| ExportedFile { path, bytes: text.into_bytes() };
        Ok(Exported {
            files: vec![
                file(format!("{name}/model.sdf"), sdf(model, &link, &comment, &name)),
                file(format!("{name}/model.config"), config(model, &name)),
                file("world.sdf".to_owned(), world(&comment, &name)),
            ],
            notes: remarks.notes(),
        })
    }
}

/// Returns a name that is valid for files and topics.
pub(crate) fn model_name(model: &PlantModel) -> String {
    let name = identifier(&model.name);
    if name.is_empty() { "vehicle".to_owned() } else { name }
}

/// Formats lines as one XML comment.
pub(crate) fn xml_comment(lines: &[String]) -> String {
    // Two hyphens end a comment.
    let safe = |line: &String| format!("  {}", line.replace("--", "- -"));
    let inner: String = lines.iter().map(|line| safe(line).trim_end().to_owned() + "\n").collect();
    format!("<!--\n{inner}-->\n")
}

/// Escapes text between tags.
pub(crate) fn escaped(text: &str) -> String {
    harmless(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

const ROWS: [char; 6] = ['x', 'y', 'z', 'k', 'm', 'n'];
const COLUMNS: [char; 6] = ['U', 'V', 'W', 'P', 'Q', 'R'];

/// Returns the tag of a product: `xU`, `xUabsU`, `nUV`; `None` for three velocities or two moduli.
fn tag(on: Dof, product: &Product) -> Option<String> {
    let row = ROWS[on.index()];
    let factors: Vec<Factor> = product.factors().collect();
    let letter = |factor: &Factor| COLUMNS[factor.of.index()];
    match factors.as_slice() {
        _ if product.speed() != 0 => None,
        [one] if !one.modulus => Some(format!("{row}{}", letter(one))),
        // Moduli come first.
        [a, b] if a.modulus && !b.modulus => Some(format!("{row}{}abs{}", letter(b), letter(a))),
        [a, b] if !a.modulus && !b.modulus => Some(format!("{row}{}{}", letter(a), letter(b))),
        _ => None,
    }
}

/// Lists what the plugins cannot represent.
fn missing(model: &PlantModel) -> Vec<String> {
    let mut notes = Vec::new();
    for (term, value) in model.plant.structure().terms().iter().zip(model.plant.coefficients()) {
        let Basis::Product(on, product) = term else { continue };
        if tag(*on, product).is_none() {
            notes.push(format!(
                "left out, because Hydrodynamics has no such term: {term} = {value}"
            ));
        }
    }
    for (dof, value) in constants(model) {
        notes.push(format!(
            "left out, for Hydrodynamics has no constant force: {dof}: 1 = {value} {}",
            dof.units().force
        ));
    }
    if !model.thrusters.is_empty() {
        notes.push(
            "Thruster has one coefficient for both ways and no deadband: command forces (cmd_thrust, N) and put the curves above before them".to_owned(),
        );
    }
    notes.extend(unlimited(model));
    notes.push(
        "fluid_added_mass needs the DART engine, which is gz-sim's own; it carries the Coriolis forces of added mass, so that Hydrodynamics has those disabled".to_owned(),
    );
    notes
}

/// Notes thrusters whose greatest thrust is unknown.
pub(crate) fn unlimited(model: &PlantModel) -> Option<String> {
    let is_open = |thruster: &&Thruster| model.thrust_limits(thruster).is_none();
    let names: Vec<&str> =
        model.thrusters.iter().filter(is_open).map(|thruster| thruster.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "the greatest thrust of {} is not known, so that the simulator does not limit it; state max_rpm, or a measured table",
            names.join(", ")
        )
    })
}

fn sdf(model: &PlantModel, link: &Link, comment: &str, name: &str) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n{comment}<sdf version=\"1.10\">\n  <model name=\"{name}\">\n    <link name=\"base_link\">\n"
    );
    text += &inertial(link);
    let sides = link.sides(model).map(number).join(" ");
    let at = pose(&flu::vector(&link.centre_of_buoyancy));
    let _ = write!(
        text,
        "      <!-- The displaced water: its volume and centre are what Buoyancy reads. -->
      <collision name=\"displaced_water\">
        <pose>{at}</pose>
        <geometry><box><size>{sides}</size></box></geometry>
      </collision>
      <visual name=\"hull\">
        <pose>{at}</pose>
        <geometry><box><size>{sides}</size></box></geometry>
      </visual>
    </link>
"
    );
    let names = identifiers(model.thrusters.iter().map(|t| t.name.as_str()));
    for (thruster, id) in model.thrusters.iter().zip(&names) {
        text += &propeller(thruster, id);
    }
    text += &hydrodynamics(model);
    for (thruster, id) in model.thrusters.iter().zip(&names) {
        text += &thruster_plugin(model, thruster, id, name);
    }
    text + "  </model>\n</sdf>\n"
}

fn pose(at: &Vector3<f64>) -> String {
    format!("{} {} {} 0 0 0", number(at.x), number(at.y), number(at.z))
}

fn inertial(link: &Link) -> String {
    let inertia = flu::inertia(&link.inertia);
    let entries = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
    let places = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    let inertia: String = entries
        .iter()
        .zip(places)
        .map(|(tag, (i, j))| format!("          <{tag}>{}</{tag}>\n", number(inertia[(i, j)])))
        .collect();
    format!(
        "      <inertial>\n        <mass>{}</mass>\n        <pose>{}</pose>\n        <inertia>\n{inertia}        </inertia>\n        <!-- Positive, about the link's origin. -->\n        <fluid_added_mass>\n{}        </fluid_added_mass>\n      </inertial>\n",
        number(link.mass_kg),
        pose(&flu::vector(&link.centre_of_gravity)),
        added_mass(&flu::matrix(&link.added))
    )
}

fn added_mass(added: &Matrix6<f64>) -> String {
    const LETTERS: [char; 6] = ['x', 'y', 'z', 'p', 'q', 'r'];
    let mut text = String::new();
    for i in 0..6 {
        for j in i..6 {
            let tag = format!("{}{}", LETTERS[i], LETTERS[j]);
            // Adding 0 removes the sign of −0.
            let _ = writeln!(text, "          <{tag}>{}</{tag}>", number(added[(i, j)] + 0.0));
        }
    }
    text
}

fn hydrodynamics(model: &PlantModel) -> String {
    let mut text = "    <!-- Damping: force = coefficient · velocities, negative where it brakes; abs is a modulus. -->
    <plugin filename=\"gz-sim-hydrodynamics-system\" name=\"gz::sim::systems::Hydrodynamics\">
      <link_name>base_link</link_name>
      <disable_added_mass>true</disable_added_mass>
      <disable_coriolis>true</disable_coriolis>
"
    .to_owned();
    for (term, value) in model.plant.structure().terms().iter().zip(model.plant.coefficients()) {
        let Basis::Product(on, product) = term else { continue };
        let Some(tag) = tag(*on, product) else { continue };
        let value = number(-flu::of_product(*on, product) * value + 0.0);
        let _ = writeln!(text, "      <{tag}>{value}</{tag}>");
    }
    for dof in model.unknown_axes() {
        let _ = writeln!(text, "      <!-- {dof}: damping is not known. -->");
    }
    text + "    </plugin>\n"
}

/// Mass of a propeller, negligible: M is that of the vehicle as identified.
const PROPELLER_KG: f64 = 1e-3;

fn propeller(thruster: &Thruster, id: &str) -> String {
    let axis = flu::vector(&thruster.direction_body);
    format!(
        "    <link name=\"{id}_propeller\">
      <pose>{}</pose>
      <inertial>
        <mass>{}</mass>
        <inertia><ixx>1e-6</ixx><iyy>1e-6</iyy><izz>1e-6</izz></inertia>
      </inertial>
    </link>
    <joint name=\"{id}_joint\" type=\"revolute\">
      <parent>base_link</parent>
      <child>{id}_propeller</child>
      <axis><xyz>{} {} {}</xyz><limit><lower>-1e16</lower><upper>1e16</upper></limit></axis>
    </joint>
",
        pose(&flu::vector(&thruster.position_body)),
        number(PROPELLER_KG),
        number(axis.x),
        number(axis.y),
        number(axis.z)
    )
}

/// Diameter for which the coefficients are written, m; only C ρ D⁴ matters.
const DIAMETER: f64 = 0.1;

/// Thrust that no vehicle reaches, N: Thruster clips at 1000 N by default.
const UNLIMITED: f64 = 1e9;

fn thruster_plugin(model: &PlantModel, thruster: &Thruster, id: &str, name: &str) -> String {
    let scale = DENSITY * DIAMETER.powi(4);
    let coefficient = match &thruster.curve {
        ThrustCurve::Quadratic { input: seaplant::ThrusterInput::Speed, law }
            if law.exponent == 2.0 =>
        {
            law.forward
        }
        // The speed of commands, pulse widths and forces is unknown, and only visual.
        _ => 1e-3,
    };
    let [low, high] = model.thrust_limits(thruster).unwrap_or([-UNLIMITED, UNLIMITED]);
    format!(
        "    <!-- {}: publish newtons to /model/{name}/joint/{id}_joint/cmd_thrust -->
    <plugin filename=\"gz-sim-thruster-system\" name=\"gz::sim::systems::Thruster\">
      <namespace>{name}</namespace>
      <joint_name>{id}_joint</joint_name>
      <fluid_density>{}</fluid_density>
      <propeller_diameter>{}</propeller_diameter>
      <thrust_coefficient>{}</thrust_coefficient>
      <velocity_control>true</velocity_control>
      <max_thrust_cmd>{}</max_thrust_cmd>
      <min_thrust_cmd>{}</min_thrust_cmd>
    </plugin>
",
        harmless(&thruster.name).replace("--", "- -"),
        number(DENSITY),
        number(DIAMETER),
        number(coefficient / scale),
        number(high),
        number(low)
    )
}

fn config(model: &PlantModel, name: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<model>\n  <name>{name}</name>\n  <version>1.0</version>\n  <sdf version=\"1.10\">model.sdf</sdf>\n  <description>{}: plant identified or published as stated in model.sdf</description>\n</model>\n",
        escaped(&model.name)
    )
}

fn world(comment: &str, name: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>
{comment}<!-- GZ_SIM_RESOURCE_PATH=. gz sim world.sdf -->
<sdf version=\"1.10\">
  <world name=\"{name}_world\">
    <gravity>0 0 -{}</gravity>
    <physics name=\"fine\" type=\"dart\"><max_step_size>0.002</max_step_size><real_time_factor>1</real_time_factor></physics>
    <plugin filename=\"gz-sim-physics-system\" name=\"gz::sim::systems::Physics\"/>
    <plugin filename=\"gz-sim-user-commands-system\" name=\"gz::sim::systems::UserCommands\"/>
    <plugin filename=\"gz-sim-scene-broadcaster-system\" name=\"gz::sim::systems::SceneBroadcaster\"/>
    <plugin filename=\"gz-sim-apply-link-wrench-system\" name=\"gz::sim::systems::ApplyLinkWrench\"/>
    <plugin filename=\"gz-sim-buoyancy-system\" name=\"gz::sim::systems::Buoyancy\">
      <!-- The volume in model.sdf is for this density. -->
      <uniform_fluid_density>{}</uniform_fluid_density>
      <enable>{name}::base_link</enable>
    </plugin>
    <light type=\"directional\" name=\"sun\"><direction>-0.5 0.1 -0.9</direction></light>
    <include><uri>model://{name}</uri></include>
  </world>
</sdf>
",
        number(GRAVITY),
        number(DENSITY)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sdf_of(curve: serde_json::Value) -> (String, Vec<String>) {
        let file: seaplant::exchange::PlantFile = serde_json::from_value(serde_json::json!({
            "schema": "seaplant/plant/1", "name": "sled", "source": "worked by hand",
            "axes": ["surge"], "mass_matrix": [100.0],
            "thruster": [{
                "name": "main", "position_m": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0],
                "curve": curve
            }]
        }))
        .expect("a table");
        let made = Gazebo.files(&file.model().expect("possible")).expect("made");
        (String::from_utf8(made.files[0].bytes.clone()).expect("text"), made.notes)
    }

    #[test]
    fn thrust_is_limited_to_what_the_vehicle_states_and_never_by_default() {
        let law = |input: &str| serde_json::json!({ "kind": "quadratic", "input": input, "forward": 2000.0, "reverse": 1500.0 });
        let (text, _) = sdf_of(law("command"));
        assert!(text.contains("<max_thrust_cmd>2000.0</max_thrust_cmd>"), "{text}");
        assert!(text.contains("<min_thrust_cmd>-1500.0</min_thrust_cmd>"), "{text}");
        let (text, notes) = sdf_of(law("speed"));
        assert!(text.contains("<max_thrust_cmd>1000000000.0</max_thrust_cmd>"), "{text}");
        assert!(notes.iter().any(|note| note.contains("thrust of main is not known")), "{notes:?}");
    }
}
