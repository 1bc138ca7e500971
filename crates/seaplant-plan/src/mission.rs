//! The reference mission: forces in time, and the accuracy of the velocity that a plant predicts.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector6};
use schemars::JsonSchema;
use seaplant::motion::{Inputs, simulate};
use seaplant::plant::Plant;
use seaplant::{Dof, Timed, parallel};
use serde::{Deserialize, Serialize};

use crate::Error;

/// A mission on which velocity is to be predicted: forces from rest in still water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mission {
    /// Instants, s, shape (n,): a force acts from its instant until the next; the last is the end.
    pub time_s: Vec<f64>,
    /// Force on each axis, N and N m, shape (n,) each; zero on axes that are not named.
    pub force: BTreeMap<Dof, Vec<f64>>,
}

/// Column of the instants.
const TIME: &str = "time [s]";
/// Interval at which velocities are compared, s.
const EVERY_S: f64 = 0.5;
/// Longest mission, s.
const MOST_S: f64 = 3600.0;
/// Relative change of a coefficient for a derivative …
const STEP: f64 = 1e-4;
/// … of one that is at least this fraction of the greatest.
const LEAST: f64 = 1e-3;

impl Mission {
    /// Reads a table with the column `time [s]` and a column for each driven axis, as `surge [N]` and
    /// `yaw [N m]`.
    ///
    /// # Errors
    /// [`Error::Mission`] with the line, for an unknown column or a cell that is not a number, and as
    /// [`Mission::check`].
    ///
    /// # Example
    /// ```
    /// use seaplant_plan::Mission;
    /// let mission = Mission::of_csv("time [s],surge [N]\n0,20\n30,0\n45,0\n")?;
    /// assert_eq!(mission.time_s, [0.0, 30.0, 45.0]);
    /// # Ok::<(), seaplant_plan::Error>(())
    /// ```
    pub fn of_csv(text: &str) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Mission { reason };
        let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let heads: Vec<String> = table.headers()?.iter().map(str::to_owned).collect();
        let axis = |head: &str| {
            Dof::ALL.into_iter().find(|dof| head == format!("{dof} [{}]", dof.units().force))
        };
        let mut axes = Vec::new();
        for (k, head) in heads.iter().enumerate().filter(|(_, head)| *head != TIME) {
            let dof = axis(head).ok_or_else(|| {
                refuse(format!(
                    "line 1, column {}: found `{head}`; expected `{TIME}` or an axis with its force, as `surge [N]` and `yaw [N m]`",
                    k + 1
                ))
            })?;
            axes.push((k, dof));
        }
        let Some(time) = heads.iter().position(|head| head == TIME) else {
            return Err(refuse(format!("line 1 has no column `{TIME}`")));
        };
        let mut mission = Self { time_s: Vec::new(), force: BTreeMap::new() };
        for row in table.records() {
            let row = row?;
            let line = row.position().map_or(0, csv::Position::line);
            let number = |k: usize| {
                let cell = row.get(k).unwrap_or("");
                cell.parse::<f64>().map_err(|_| {
                    refuse(format!(
                        "line {line}, `{}`: found `{cell}`; expected a number",
                        heads[k]
                    ))
                })
            };
            mission.time_s.push(number(time)?);
            for (k, dof) in &axes {
                mission.force.entry(*dof).or_default().push(number(*k)?);
            }
        }
        mission.check()?;
        Ok(mission)
    }

    /// Checks that instants increase over 1 s to an hour, and that every force has as many values.
    ///
    /// # Errors
    /// [`Error::Mission`] with what was found.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |reason: String| Err(Error::Mission { reason });
        let ([first, .., last], true) = (self.time_s.as_slice(), !self.force.is_empty()) else {
            return refuse(
                "it needs two instants or more, and the force on one axis or more".to_owned(),
            );
        };
        if let Some(pair) = self.time_s.windows(2).find(|pair| !increases(pair)) {
            return refuse(format!("instants increase; found {} s after {} s", pair[1], pair[0]));
        }
        let length = last - first;
        if !(1.0..=MOST_S).contains(&length) {
            return refuse(format!("it lasts {length} s; expected 1 to {MOST_S} s"));
        }
        for (dof, force) in &self.force {
            if force.len() != self.time_s.len() {
                let (found, needed) = (force.len(), self.time_s.len());
                return refuse(format!(
                    "{dof} has {found} forces for {needed} instants; give one each"
                ));
            }
            if let Some(wrong) = force.iter().find(|x| !x.is_finite()) {
                return refuse(format!("{dof}: found a force of {wrong}; expected a number"));
            }
        }
        Ok(())
    }

    /// Returns the velocity of an axis during the mission.
    fn velocity(&self, plant: &Plant, dof: Dof) -> Result<Vec<f64>, seaplant::Error> {
        let mut inputs = Inputs::default();
        for (dof, force) in &self.force {
            inputs.force[dof.index()] =
                Some(Timed::new("mission", self.time_s.clone(), force.clone())?);
        }
        let (first, last) = (self.time_s[0], self.time_s[self.time_s.len() - 1]);
        let count = ((last - first) / EVERY_S).floor() as usize;
        let times: Vec<f64> = (0..=count).map(|k| first + EVERY_S * k as f64).collect();
        let motion = simulate(plant, &inputs, &Vector6::zeros(), &times)?;
        Ok(motion.velocity.iter().map(|v| v[dof.index()]).collect())
    }

    /// Returns the root mean square of an axis's velocity, and G, shape (p, r), with which
    /// `tr Gᵀ C G` is the mean square of its error where coefficients have the covariance C:
    /// `G Gᵀ = mean_t J_tᵀ J_t`, J = ∂v/∂θ by central differences.
    ///
    /// # Errors
    /// As [`simulate`].
    pub(crate) fn weights(&self, plant: &Plant, dof: Dof) -> Result<(f64, DMatrix<f64>), Error> {
        let own = self.velocity(plant, dof)?;
        let size = (own.iter().map(|v| v * v).sum::<f64>() / own.len() as f64).sqrt();
        let slopes = slopes(plant, |plant| self.velocity(plant, dof))?;
        let p = slopes.len();
        let mean = |i: usize, j: usize| slopes[i].dot(&slopes[j]) / own.len() as f64;
        let eigen = DMatrix::from_fn(p, p, mean).symmetric_eigen();
        let mut weights = eigen.eigenvectors;
        for (mut column, value) in weights.column_iter_mut().zip(&eigen.eigenvalues) {
            column *= value.max(0.0).sqrt();
        }
        Ok((size, weights))
    }
}

/// Returns true if two instants are finite and the second is later.
fn increases(pair: &[f64]) -> bool {
    pair[1] > pair[0] && pair.iter().all(|t| t.is_finite())
}

/// Returns the derivatives of some numbers by each coefficient of a plant, by central differences.
///
/// # Errors
/// The error of the numbers, or of a changed plant whose M is not positive definite.
pub(crate) fn slopes<E: From<seaplant::Error> + Send>(
    plant: &Plant,
    numbers: impl Fn(&Plant) -> Result<Vec<f64>, E> + Sync,
) -> Result<Vec<DVector<f64>>, E> {
    let theta = plant.coefficients();
    let greatest = theta.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let by = |k: usize| {
        let step = STEP * theta[k].abs().max(LEAST * greatest);
        let at = |sign: f64| {
            let mut moved = theta.to_vec();
            moved[k] += sign * step;
            numbers(&Plant::new(plant.structure().clone(), moved)?)
        };
        let change = DVector::from_vec(at(1.0)?) - DVector::from_vec(at(-1.0)?);
        Ok(change / (2.0 * step))
    };
    parallel::of_each(theta.len(), by).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use seaplant::plant::{Structure, Symmetry};

    use super::*;

    fn sled() -> Plant {
        let surge = Structure::of(&[Dof::Surge], Symmetry::None).expect("an axis");
        Plant::new(surge, vec![100.0, 0.0, 20.0]).expect("a plant")
    }

    /// Once it is steady, v = √(τ/d_Q), so that ∂v/∂d_Q = −v / (2 d_Q), and mass does not count.
    #[test]
    fn a_steady_mission_is_as_accurate_as_drag() {
        let time_s = vec![0.0, 3000.0];
        let mission = Mission { time_s, force: [(Dof::Surge, vec![80.0, 80.0])].into() };
        let (size, weights) = mission.weights(&sled(), Dof::Surge).expect("a motion");
        assert!((size - 2.0).abs() < 0.01, "{size}");
        let by_drag = weights.row(2).norm();
        assert!((by_drag - 2.0 / 40.0).abs() < 0.001, "{by_drag}");
        assert!(weights.row(0).norm() < 0.1 * by_drag, "{weights}");
    }

    #[test]
    fn tables_are_refused_with_line_and_column() {
        let error = |text: &str| Mission::of_csv(text).expect_err(text).to_string();
        let found = error("time [s],thrust [N]\n0,1\n9,1\n");
        assert!(found.contains("line 1, column 2: found `thrust [N]`"), "{found}");
        let found = error("time [s],surge [kN]\n0,1\n9,1\n");
        assert!(found.contains("found `surge [kN]`; expected `time [s]` or an axis"), "{found}");
        let found = error("time [s],surge [N]\n0,1\n9,fast\n");
        assert!(found.contains("line 3, `surge [N]`: found `fast`"), "{found}");
        let found = error("time [s],surge [N]\n9,1\n0,1\n");
        assert!(found.contains("found 0 s after 9 s"), "{found}");
        assert!(error("surge [N]\n0\n1\n").contains("no column `time [s]`"));
        assert!(error("time [s],surge [N]\n0,1\n").contains("two instants"));
    }
}
