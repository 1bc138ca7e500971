//! Parameters of ROS 2 nodes.

use nalgebra::Matrix6;
use seaplant::Dof;
use seaplant::exchange::PlantModel;
use seaplant::plant::Product;

use crate::code::{identifiers, names, number, numbers, own};
use crate::json::damping;
use crate::remarks::{commented, constants, harmless, other_products, without_actuation};
use crate::{Error, Exported, ExportedFile, Exporter, c};

pub(crate) struct Ros2;

impl Exporter for Ros2 {
    fn name(&self) -> &'static str {
        "ros2"
    }

    fn about(&self) -> &'static str {
        "a parameter file for ROS 2 nodes, units and frames in the names"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let mut remarks = c::remarks(model, "ros2");
        if !model.thrusters.is_empty() {
            remarks.limits.extend(without_actuation(model));
        }
        remarks.limits.push(
            "matrices are flat, row by row, with zeros at axes that are not known: read axis_known first".to_owned(),
        );
        let mut text = commented(&remarks.lines(), "#");
        text += "/**:\n  ros__parameters:\n    seaplant:\n";
        for line in entries(model) {
            text += &format!("      {line}\n");
        }
        let path = "seaplant_plant.yaml".to_owned();
        let file = ExportedFile { path, bytes: text.into_bytes() };
        Ok(Exported { files: vec![file], notes: remarks.notes() })
    }
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

/// Every coefficient with its standard deviation.
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

/// What stands in no matrix.
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
