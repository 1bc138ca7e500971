//! Writes a scenario for Stonefish, as far as its geometry-based model permits.

use std::fmt::Write;

use nalgebra::Vector3;
use seaplant::exchange::PlantModel;
use seaplant::plant::Product;
use seaplant::{Dof, Thruster};

use crate::code::{identifiers, number, numbers};
use crate::gazebo::{escaped, model_name, unlimited, xml_comment};
use crate::json::damping;
use crate::link::{DENSITY, Link};
use crate::remarks::{Frame, Remarks, harmless, short, without_actuation};
use crate::{Error, Exported, ExportedFile, Exporter};

pub(crate) struct Stonefish;

/// Speed at which drag equals that of the plant, m/s.
const SPEED: f64 = 1.0;

impl Exporter for Stonefish {
    fn name(&self) -> &'static str {
        "stonefish"
    }

    fn about(&self) -> &'static str {
        "a scenario for Stonefish: mass, inertia and drag as near as its model allows"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let link = Link::from_model(model, "stonefish")?;
        let mut limits = link.notes.clone();
        limits.extend(missing(model, &link));
        limits.extend(without_actuation(model));
        let remarks = Remarks { model, format: "stonefish", frame: Frame::Frd, limits };
        let text = scenario(model, &link, &xml_comment(&remarks.lines()));
        let path = format!("{}.scn", model_name(model));
        let file = ExportedFile { path, bytes: text.into_bytes() };
        Ok(Exported { files: vec![file], notes: remarks.notes() })
    }
}

fn missing(model: &PlantModel, link: &Link) -> Vec<String> {
    let added: Vec<String> = (0..3).map(|k| short(link.added[(k, k)])).collect();
    let mut notes = vec![
        format!(
            "Stonefish computes added mass from the shape, one number for all directions, and cannot be given any: the identified {} kg in surge, sway and heave are lost",
            added.join(", ")
        ),
        inertia_note(model, link),
        "no Coriolis forces of added mass, and no coupling of axes in mass or damping".to_owned(),
        format!(
            "Stonefish computes drag from the faces of the shape; it grows with the cube of speed, that of the plant with the square: both agree at {SPEED} m/s; damping of rotations follows from the faces, too"
        ),
        "for the plant itself, drive the body by the header of the format c with hydrodynamics off"
            .to_owned(),
        "written by Stonefish's sources of July 2026 (b21eb8e); no Stonefish has run it".to_owned(),
    ];
    notes.extend(unlimited(model));
    if !model.thrusters.is_empty() {
        notes.push(
            "thrusters are push actuators that take newtons: put the curves above before them"
                .to_owned(),
        );
    }
    notes
}

/// Returns the inertia of the body with the identified added inertia, kg m².
fn wanted(link: &Link) -> [f64; 3] {
    [0, 1, 2].map(|k| link.inertia[(k, k)] + link.added[(3 + k, 3 + k)])
}

/// Computes the added inertia that Stonefish assigns to a submerged box, kg m².
///
/// It fits an ellipsoid about the corners, whose semi-axes are √3 times half of the sides, and takes
/// 0, `π ρ b² a³/12` and `π ρ c² a³/12`.
fn own_added_inertia(sides: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = sides.map(|side| 0.5 * 3_f64.sqrt() * side);
    let about = |across: f64| std::f64::consts::PI / 12.0 * DENSITY * across.powi(2) * a.powi(3);
    [0.0, about(b), about(c)]
}

/// Minimum fraction of an inertia that remains for the body where Stonefish adds more than the
/// total.
const LEAST_PART: f64 = 0.01;

/// Returns the inertia to write: with Stonefish's addition it equals that of the plant.
fn inertia(link: &Link, sides: [f64; 3]) -> [f64; 3] {
    let (wanted, added) = (wanted(link), own_added_inertia(sides));
    [0, 1, 2].map(|k| (wanted[k] - added[k]).max(LEAST_PART * wanted[k]))
}

fn inertia_note(model: &PlantModel, link: &Link) -> String {
    let sides = link.sides(model);
    let (wanted, added) = (wanted(link), own_added_inertia(sides));
    let words = |of: [f64; 3]| of.map(short).join(", ");
    let more = (0..3).any(|k| added[k] > (1.0 - LEAST_PART) * wanted[k]);
    let more = if more { "; about some axis it adds more than the vehicle has" } else { "" };
    format!(
        "Stonefish adds {} kg m² of inertia about x, y and z, from an ellipsoid about the box; the inertia below is less by that, so that both make the {} kg m² that were identified{more}",
        words(added),
        words(wanted)
    )
}

/// Returns water at rest, without which a scenario does not load.
fn environment() -> String {
    format!(
        "  <environment>
    <ned latitude=\"0.0\" longitude=\"0.0\"/>
    <ocean>
      <water density=\"{}\" jerlov=\"0.2\"/>
      <waves height=\"0.0\"/>
    </ocean>
    <atmosphere>
      <sun azimuth=\"0.0\" elevation=\"60.0\"/>
    </atmosphere>
  </environment>
",
        number(DENSITY)
    )
}

fn scenario(model: &PlantModel, link: &Link, comment: &str) -> String {
    let name = model_name(model);
    let sides = link.sides(model);
    let inertia = inertia(link, sides);
    let xyz = |v: &Vector3<f64>| numbers([v.x, v.y, v.z]).replace(',', "");
    let of_box = link.centre_of_gravity - link.centre_of_buoyancy;
    let [viscous, quadratic] = drag(model, sides);
    let mut text = format!("<?xml version=\"1.0\"?>\n{comment}<scenario>\n");
    text += &environment();
    let _ = write!(
        text,
        "  <materials>
    <material name=\"hull\" density=\"{}\" restitution=\"0.1\"/>
  </materials>
  <looks>
    <look name=\"hull\" rgb=\"0.9 0.7 0.1\" roughness=\"0.5\"/>
  </looks>
  <robot name=\"{}\" fixed=\"false\" self_collisions=\"false\">
    <!-- The box is the displaced water; its centre is that of buoyancy. -->
    <base_link name=\"base_link\" type=\"box\" physics=\"submerged\">
      <dimensions xyz=\"{}\"/>
      <origin xyz=\"0.0 0.0 0.0\" rpy=\"0.0 0.0 0.0\"/>
      <material name=\"hull\"/>
      <look name=\"hull\"/>
      <mass value=\"{}\"/>
      <inertia xyz=\"{}\"/>
      <cg xyz=\"{}\" rpy=\"0.0 0.0 0.0\"/>
      <hydrodynamics viscous_drag=\"{}\" quadratic_drag=\"{}\"/>
    </base_link>
",
        number(DENSITY),
        escaped(&name),
        numbers(sides).replace(',', ""),
        number(link.mass_kg),
        numbers(inertia).replace(',', ""),
        xyz(&of_box),
        viscous,
        quadratic
    );
    let names = identifiers(model.thrusters.iter().map(|t| t.name.as_str()));
    for (thruster, id) in model.thrusters.iter().zip(&names) {
        let at = thruster.position_body - link.centre_of_buoyancy;
        let _ = write!(
            text,
            "    <!-- {} -->
    <actuator name=\"{id}\" type=\"push\">
{}      <origin xyz=\"{}\" rpy=\"{}\"/>
      <link name=\"base_link\"/>
    </actuator>
",
            harmless(&thruster.name).replace("--", "- -"),
            limits(model, thruster),
            xyz(&at),
            numbers(turned(&thruster.direction_body)).replace(',', "")
        );
    }
    text + "    <world_transform xyz=\"0.0 0.0 5.0\" rpy=\"0.0 0.0 0.0\"/>\n  </robot>\n</scenario>\n"
}

/// Returns the greatest thrust either way, where it is known.
fn limits(model: &PlantModel, thruster: &Thruster) -> String {
    let line = |[low, high]: [f64; 2]| {
        let (low, high) = (number(low), number(high));
        format!("      <specs lower_limit=\"{low}\" upper_limit=\"{high}\"/>\n")
    };
    model.thrust_limits(thruster).map_or(String::new(), line)
}

/// Returns roll, pitch and yaw that turn x to a direction.
fn turned(direction: &Vector3<f64>) -> [f64; 3] {
    [0.0, -direction.z.atan2(direction.x.hypot(direction.y)), direction.y.atan2(direction.x)]
}

/// Returns the coefficients of skin and pressure drag by axis: `½ ρ C A v³` and `ρ C A v` of a
/// box's faces. Unknown axes have 0.
fn drag(model: &PlantModel, sides: [f64; 3]) -> [String; 2] {
    let linear = damping(model, Product::linear);
    let quadratic = damping(model, Product::quadratic);
    let [a, b, c] = sides;
    let face = [b * c, a * c, a * b];
    let skin = [2.0 * (a * b + a * c), 2.0 * (a * b + b * c), 2.0 * (a * c + b * c)];
    let of = |f: &dyn Fn(usize) -> f64| {
        let known = |k: usize| model.plant.axes().contains(&Dof::ALL[k]);
        numbers((0..3).map(|k| if known(k) { f(k) } else { 0.0 })).replace(',', "")
    };
    [
        of(&|k| linear[(k, k)] / (DENSITY * skin[k])),
        of(&|k| 2.0 * quadratic[(k, k)] / (DENSITY * face[k] * SPEED)),
    ]
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;

    fn rexrov() -> PlantModel {
        let table = include_str!("../../seaplant-campaign/plants/rexrov.toml");
        let file: seaplant::exchange::PlantFile = toml::from_str(table).expect("a table");
        file.model().expect("possible")
    }

    #[test]
    fn inertia_with_stonefishs_addition_is_that_of_the_plant() {
        let model = rexrov();
        let link = Link::from_model(&model, "stonefish").expect("a body");
        // From RexROV's table: I + M_A about its origin, and an ellipsoid of √3 times half of the
        // box.
        let half: [f64; 3] = link.sides(&model).map(|side| 0.5 * side);
        let about = |across: f64| {
            3_f64.sqrt().powi(5) * std::f64::consts::PI / 12.0
                * 1000.0
                * across.powi(2)
                * half[0].powi(3)
        };
        let expected =
            [525.39 + 534.9, 794.20 + 842.69 - about(half[1]), 691.23 + 224.32 - about(half[2])];
        let written = inertia(&link, link.sides(&model));
        for (found, expected) in written.into_iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
        }
    }

    #[test]
    fn a_scenario_has_what_loading_needs() {
        let made = Stonefish.files(&rexrov()).expect("made");
        let text = String::from_utf8(made.files[0].bytes.clone()).expect("text");
        let at = |tag: &str| text.find(tag).unwrap_or_else(|| panic!("{tag}"));
        // Elements that the parser requires, and thrusters within their limits.
        let order = ["<environment>", "<ned latitude=", "<materials>", "<robot ", "<base_link "];
        assert!(order.windows(2).all(|pair| at(pair[0]) < at(pair[1])));
        at("<world_transform ");
    }

    #[test]
    fn push_actuators_point_in_the_direction_of_thrust() {
        for d in [Vector3::z(), -Vector3::x(), Vector3::new(0.6, -0.48, 0.64)] {
            let [roll, pitch, yaw] = turned(&d);
            let x = Rotation3::from_euler_angles(roll, pitch, yaw) * Vector3::x();
            assert!((x - d).norm() < 1e-12, "{d}");
        }
    }
}
