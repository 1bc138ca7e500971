//! Writes a description for uuv_simulator, for Gazebo classic and ROS 1.

use std::fmt::Write;

use nalgebra::{Matrix6, Vector3};
use seaplant::Dof;
use seaplant::exchange::PlantModel;
use seaplant::plant::{Basis, Factor, Product};

use crate::code::{number, numbers};
use crate::flu;
use crate::gazebo::{escaped, model_name, xml_comment};
use crate::json::damping;
use crate::link::{DENSITY, Link};
use crate::remarks::{Frame, Remarks, without_actuation};
use crate::{Error, Exported, ExportedFile, Exporter};

pub(crate) struct UuvSimulator;

impl Exporter for UuvSimulator {
    fn name(&self) -> &'static str {
        "uuv-simulator"
    }

    fn about(&self) -> &'static str {
        "a URDF with the plugin of uuv_simulator (Gazebo classic, ROS 1)"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let link = Link::from_model(model, "uuv-simulator")?;
        let mut limits = link.notes.clone();
        limits.extend(missing(model, &link));
        limits.extend(without_actuation(model));
        let remarks = Remarks { model, format: "uuv-simulator", frame: Frame::Frd, limits };
        let text = urdf(model, &link, &xml_comment(&remarks.lines()));
        let path = format!("{}.urdf", model_name(model));
        let file = ExportedFile { path, bytes: text.into_bytes() };
        Ok(Exported { files: vec![file], notes: remarks.notes() })
    }
}

/// Returns ν_j if a product is `u ν_j`, which the damping of forward speed represents.
fn forward_speed(product: &Product) -> Option<Dof> {
    let factors: Vec<Factor> = product.factors().collect();
    match factors.as_slice() {
        _ if product.speed() != 0 => None,
        [a, b] if !a.modulus && !b.modulus && a.of == Dof::Surge => Some(b.of),
        _ => None,
    }
}

fn missing(model: &PlantModel, link: &Link) -> Vec<String> {
    let mut notes = Vec::new();
    for (term, value) in model.plant.structure().terms().iter().zip(model.plant.coefficients()) {
        let held = match term {
            Basis::Product(on, product) => {
                forward_speed(product).is_some()
                    || *product == Product::quadratic(*on)
                    || Dof::ALL.iter().any(|of| *product == Product::linear(*of))
            }
            Basis::One(_) => false,
            // The remarks of every format without a place for it mention it.
            _ => true,
        };
        if !held {
            notes.push(format!("left out, because the plugin has no such term: {term} = {value}"));
        }
    }
    notes.push(
        "the plugin filters accelerations before it multiplies them with added mass, so that added mass lags".to_owned(),
    );
    if link.centre_of_gravity.norm() > 0.0 {
        notes.push(
            "Gazebo classic applies the plugin's forces at the centre of gravity, while the numbers here are about the origin; put both in one place if their difference matters".to_owned(),
        );
    }
    if !model.thrusters.is_empty() {
        notes.push(
            "thrusters are not written: uuv_thruster_ros_plugin takes their places and a conversion function; use those of the comment above".to_owned(),
        );
    }
    notes
}

fn rows(matrix: &Matrix6<f64>) -> String {
    let row = |i: usize| {
        format!(
            "        {}",
            (0..6).map(|j| number(matrix[(i, j)] + 0.0)).collect::<Vec<_>>().join(" ")
        )
    };
    format!("\n{}\n      ", (0..6).map(row).collect::<Vec<_>>().join("\n"))
}

fn xyz(at: &Vector3<f64>) -> String {
    numbers([at.x, at.y, at.z]).replace(',', "")
}

fn urdf(model: &PlantModel, link: &Link, comment: &str) -> String {
    let inertia = flu::inertia(&link.inertia);
    let entry = |i: usize, j: usize| number(inertia[(i, j)] + 0.0);
    let [length, width, height] = link.sides(model);
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n{comment}<robot name=\"{}\">\n",
        escaped(&model_name(model))
    );
    let _ = write!(
        text,
        "  <link name=\"base_link\">
    <inertial>
      <mass value=\"{}\"/>
      <origin xyz=\"{}\" rpy=\"0 0 0\"/>
      <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>
    </inertial>
  </link>
",
        number(link.mass_kg),
        xyz(&flu::vector(&link.centre_of_gravity)),
        entry(0, 0),
        entry(0, 1),
        entry(0, 2),
        entry(1, 1),
        entry(1, 2),
        entry(2, 2)
    );
    let _ = write!(
        text,
        "  <gazebo>
    <plugin name=\"uuv_plugin\" filename=\"libuuv_underwater_object_ros_plugin.so\">
      <fluid_density>{}</fluid_density>
      <flow_velocity_topic>hydrodynamics/current_velocity</flow_velocity_topic>
      <link name=\"base_link\">
      <neutrally_buoyant>0</neutrally_buoyant>
      <volume>{}</volume>
      <box><width>{}</width><length>{}</length><height>{}</height></box>
      <!-- z up, unlike the matrices below. -->
      <center_of_buoyancy>{}</center_of_buoyancy>
      <hydrodynamic_model>
      <type>fossen</type>
      <!-- The plugin turns to x forward, y starboard, z down by itself: added mass positive, damping negative. -->
      <added_mass>{}</added_mass>
      <linear_damping>{}</linear_damping>
      <linear_damping_forward_speed>{}</linear_damping_forward_speed>
      <quadratic_damping>{}</quadratic_damping>
      </hydrodynamic_model>
      </link>
    </plugin>
  </gazebo>
</robot>
",
        number(DENSITY),
        number(link.volume),
        number(width),
        number(length),
        number(height),
        xyz(&flu::vector(&link.centre_of_buoyancy)),
        rows(&link.added),
        rows(&-damping(model, Product::linear)),
        rows(&-of_forward_speed(model)),
        rows(&-own_quadratic(model))
    );
    text
}

fn of_forward_speed(model: &PlantModel) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    for (term, value) in model.plant.structure().terms().iter().zip(model.plant.coefficients()) {
        let Basis::Product(on, product) = term else { continue };
        if let Some(of) = forward_speed(product) {
            matrix[(on.index(), of.index())] = *value;
        }
    }
    matrix
}

/// Returns the diagonal, the only entries that the plugin reads.
fn own_quadratic(model: &PlantModel) -> Matrix6<f64> {
    Matrix6::from_diagonal(&damping(model, Product::quadratic).diagonal())
}
