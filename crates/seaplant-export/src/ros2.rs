//! Writes a package for ROS 2: the plant as a node, and its numbers as parameters.

use nalgebra::Matrix6;
use seaplant::Dof;
use seaplant::exchange::PlantModel;
use seaplant::plant::Product;

use crate::code::{identifiers, names, number, numbers, own};
use crate::gazebo::{escaped, xml_comment};
use crate::json::damping;
use crate::remarks::{Remarks, commented, constants, harmless, other_products};
use crate::template::fill;
use crate::{Error, Exported, ExportedFile, Exporter, c, python};

pub(crate) struct Ros2;

impl Exporter for Ros2 {
    fn name(&self) -> &'static str {
        "ros2"
    }

    fn about(&self) -> &'static str {
        "a ROS 2 package: a node that publishes the plant's motion, and a parameter file"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let mut remarks = c::remarks(model, "ros2");
        remarks.limits.extend([
            "matrices of the parameter file are flat, row by row, with zeros at axes that are not known: read axis_known first".to_owned(),
            "the node takes and gives body axes x forward, y port, z up and a world of east, north, up (REP 103); plant.py and the parameters have the frames above".to_owned(),
        ]);
        let file = |path: &str, text: String| ExportedFile {
            path: format!("{PACKAGE}/{path}"),
            bytes: text.into_bytes(),
        };
        let files = vec![
            file("package.xml", package(model, &remarks)),
            file("setup.py", filled(include_str!("templates/ros2/setup.py"))),
            file("setup.cfg", include_str!("templates/ros2/setup.cfg").to_owned()),
            file(&format!("resource/{PACKAGE}"), String::new()),
            file("launch/plant.launch.py", include_str!("templates/ros2/launch.py").to_owned()),
            file(&format!("config/{PACKAGE}.yaml"), parameters(model, &remarks)),
            file(&format!("{PACKAGE}/__init__.py"), String::new()),
            file(&format!("{PACKAGE}/plant.py"), python::module(model, &remarks)),
            file(&format!("{PACKAGE}/node.py"), include_str!("templates/ros2/node.py").to_owned()),
        ];
        Ok(Exported { files, notes: remarks.notes() })
    }
}

/// Name of the package and its folders.
const PACKAGE: &str = "seaplant_plant";

fn filled(template: &str) -> String {
    fill(template, &[("VERSION", env!("CARGO_PKG_VERSION").to_owned())])
}

fn package(model: &PlantModel, remarks: &Remarks<'_>) -> String {
    let licence = model.origin.licence.as_deref().unwrap_or("none stated");
    let places = [
        ("VERSION", env!("CARGO_PKG_VERSION").to_owned()),
        ("REMARKS", xml_comment(&remarks.lines())),
        ("VEHICLE", escaped(&model.name)),
        ("LICENCE", escaped(licence)),
    ];
    fill(include_str!("templates/ros2/package.xml"), &places)
}

fn parameters(model: &PlantModel, remarks: &Remarks<'_>) -> String {
    let mut text = commented(&remarks.lines(), "#");
    text += "/**:\n  ros__parameters:\n    seaplant:\n";
    for line in entries(model) {
        text += &format!("      {line}\n");
    }
    text
}

fn entries(model: &PlantModel) -> Vec<String> {
    let flat = |m: &Matrix6<f64>| numbers(m.transpose().iter().copied());
    let known = own(model).map(|x| (x == 1).to_string()).join(", ");
    let mut lines = vec![
        format!("vehicle: \"{}\"", harmless(&model.name).replace('"', "'")),
        "frame: \"body_frd\"".to_owned(),
        format!("axis_known: [{known}]"),
        format!("mass_matrix_si: [{}]", flat(&model.plant.mass_matrix_of_six())),
        format!("linear_damping_si: [{}]", flat(&damping(model, Product::linear))),
        format!("quadratic_damping_si: [{}]", flat(&damping(model, Product::quadratic))),
        format!("weight_minus_buoyancy_n: {}", number(model.weight_excess())),
        format!("righting_lever_nm: [{}]", numbers(model.lever())),
    ];
    if let Some(body) = &model.rigid_body {
        lines.push(format!("rigid_body_mass_matrix_si: [{}]", flat(&body.mass_matrix())));
    }
    lines.extend(coefficients(model));
    lines.extend(other_terms(model));
    if !model.thrusters.is_empty() {
        lines.push("thruster_names: [".to_owned() + &thruster_names(model) + "]");
        let columns = model.thrusters.iter().flat_map(|thruster| thruster.unit_wrench());
        lines.push(format!("thruster_wrench_per_newton: [{}]", numbers(columns)));
    }
    lines
}

fn thruster_names(model: &PlantModel) -> String {
    let quoted =
        model.thrusters.iter().map(|t| format!("\"{}\"", harmless(&t.name).replace('"', "'")));
    quoted.collect::<Vec<_>>().join(", ")
}

/// Returns every coefficient with its standard deviation.
fn coefficients(model: &PlantModel) -> Vec<String> {
    let names = names(model);
    let ids = identifiers(names.iter().map(String::as_str));
    let mut lines = vec!["coefficient:".to_owned()];
    let values = model.plant.coefficients();
    lines.extend(ids.iter().zip(values).map(|(id, value)| format!("  {id}: {}", number(*value))));
    if model.covariance.is_some() {
        lines.push("coefficient_std:".to_owned());
        let std = ids.iter().enumerate().filter_map(|(k, id)| Some((id, model.std(k)?)));
        lines.extend(std.map(|(id, std)| format!("  {id}: {}", number(std))));
    }
    lines
}

/// Returns the terms that are in no matrix.
fn other_terms(model: &PlantModel) -> Vec<String> {
    let products = other_products(model);
    let quoted: Vec<String> = products.iter().map(|(name, ..)| format!("\"{name}\"")).collect();
    let mut lines = Vec::new();
    if !products.is_empty() {
        lines.push(format!("other_term_names: [{}]", quoted.join(", ")));
        let values = numbers(products.iter().map(|(.., value)| *value));
        lines.push(format!("other_term_values_si: [{values}]"));
    }
    let constants = constants(model);
    if !constants.is_empty() {
        let of =
            |dof: Dof| constants.iter().find(|(on, _)| *on == dof).map_or(0.0, |(_, value)| *value);
        lines.push(format!("constant_force_si: [{}]", numbers(Dof::ALL.map(of))));
    }
    lines
}
