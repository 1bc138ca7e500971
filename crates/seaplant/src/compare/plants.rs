//! Comparison of plants of several axes.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::{Compared, Gaussian, ParameterDifference, Stated, gaussian, homogeneity};
use crate::exchange::PlantModel;
use crate::plant::{Basis, Product};
use crate::{Dof, Method};

/// A plant of several axes: of a table, or of a fit.
pub(super) struct ComparedPlant<'a> {
    pub(super) model: Cow<'a, PlantModel>,
    /// The method of each axis; absent for tables.
    methods: BTreeMap<Dof, Method>,
}

impl<'a> ComparedPlant<'a> {
    /// Creates the plant; `None` for a fit without such a plant, or without one by the method.
    pub(super) fn new(compared: Compared<'a>, method: Option<Method>) -> Option<Self> {
        let fit = match compared {
            Compared::Table(model) => {
                return Some(Self { model: Cow::Borrowed(model), methods: BTreeMap::new() });
            }
            Compared::Fit(fit) => fit,
        };
        let plants = fit.together().map(|(_, plant)| plant);
        let found = plants.filter(|plant| method.is_none_or(|method| method == plant.method));
        let methods: BTreeMap<Dof, Method> =
            found.flat_map(|plant| plant.axes.iter().map(|dof| (*dof, plant.method))).collect();
        let model = PlantModel::of_results(fit, "", None).ok().filter(|_| !methods.is_empty())?;
        Some(Self { model: Cow::Owned(model), methods })
    }

    /// Returns whether the plant has an axis.
    pub(super) fn has(&self, dof: Dof) -> bool {
        let is_table = matches!(self.model, Cow::Borrowed(_));
        self.methods.contains_key(&dof) || (is_table && self.model.plant.axes().contains(&dof))
    }

    pub(super) fn method(&self, dof: Dof) -> Option<Method> {
        self.methods.get(&dof).copied()
    }

    /// Returns a coefficient by its name.
    fn stated(&self, name: &str) -> Option<Stated> {
        let structure = self.model.plant.structure();
        let at = structure.names().iter().position(|known| known == name)?;
        Some(stated(&self.model, at, 1.0, structure.unit_of(&structure.terms()[at])))
    }

    /// Returns the names of coefficients that are not those of a single axis.
    fn names(&self) -> impl Iterator<Item = String> + '_ {
        let structure = self.model.plant.structure();
        let terms = structure.terms().iter().filter(|term| !is_of_one_axis(term));
        terms.map(|term| structure.name_of(term))
    }
}

/// Returns a coefficient of a model, times `sign`.
pub(super) fn stated(model: &PlantModel, at: usize, sign: f64, unit: String) -> Stated {
    let interval = model.interval(at).map(|ends| ends.map(|end| sign * end));
    Stated {
        value: sign * model.plant.coefficients()[at],
        std: model.std(at),
        interval95: interval.map(|[a, b]| [a.min(b), a.max(b)]),
        unit,
    }
}

/// Returns whether a term is the mass, drag or bias of one axis.
fn is_of_one_axis(term: &Basis) -> bool {
    match *term {
        Basis::Mass(i, j) => i == j,
        Basis::Product(on, product) => {
            [Product::linear(on), Product::quadratic(on)].contains(&product)
        }
        Basis::One(_) | Basis::WeightExcess => true,
        Basis::Lever(_) | Basis::Effect(_) => false,
    }
}

/// Compares every coefficient of plants of several axes except those of single axes; empty for
/// fewer than two such plants.
pub(super) fn coefficients(
    plants: &[Option<ComparedPlant<'_>>],
) -> BTreeMap<String, ParameterDifference> {
    if plants.iter().flatten().count() < 2 {
        return BTreeMap::new();
    }
    let names: BTreeSet<String> = plants.iter().flatten().flat_map(ComparedPlant::names).collect();
    let difference = |name: String| {
        let estimates: Vec<Option<Stated>> =
            plants.iter().map(|plant| plant.as_ref()?.stated(&name)).collect();
        let known: Vec<Gaussian> = estimates.iter().flatten().filter_map(gaussian).collect();
        let test = homogeneity(&known);
        (name, ParameterDifference { estimates, test })
    };
    names.into_iter().map(difference).collect()
}

#[cfg(test)]
mod tests {
    use super::super::differences;
    use super::*;

    fn table(yaw: f64, std: Option<f64>) -> PlantModel {
        let file: crate::exchange::PlantFile = serde_json::from_value(serde_json::json!({
            "schema": "seaplant/plant/1", "name": "boat", "source": "worked by hand",
            "axes": ["sway", "yaw"],
            "coefficients": { "mass.sway": { "value": 100.0, "std": std },
                              "mass.yaw": { "value": 20.0, "std": std },
                              "mass.sway-yaw": { "value": yaw, "std": std },
                              "yaw: v": { "value": 4.0, "std": std } }
        }))
        .expect("a table");
        file.model().expect("possible")
    }

    #[test]
    fn couplings_of_several_axes_are_compared_by_name() {
        let (one, two, bare) = (table(3.0, Some(1.0)), table(9.0, Some(1.0)), table(9.0, None));
        let found = differences(&[&one, &two, &bare].map(Compared::Table), None);
        let names: Vec<&str> = found.coefficients.keys().map(String::as_str).collect();
        assert_eq!(names, ["mass.sway-yaw", "yaw: v"]);
        let coupling = &found.coefficients["mass.sway-yaw"];
        // (9 − 3)² / (1² + 1²), which is significant.
        let test = coupling.test.expect("two state errors");
        assert!((test.q - 18.0).abs() < 1e-9 && test.differs, "{test:?}");
        assert_eq!(coupling.estimates[2].as_ref().expect("stated").std, None);
        assert!(!found.coefficients["yaw: v"].test.expect("two").differs);
        assert!(found.dofs.contains_key(&Dof::Sway) && found.dofs.contains_key(&Dof::Yaw));
    }
}
