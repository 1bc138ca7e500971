//! Thrust limits of a vehicle by its curves.

use super::PlantModel;
use crate::{Dof, ThrustCurve, Thruster, ThrusterInput};

/// One revolution a minute, rad/s.
const RPM: f64 = std::f64::consts::PI / 30.0;

impl PlantModel {
    /// Returns the greatest thrust of a thruster in reverse (negative) and forward, N.
    ///
    /// The range of a table is its own, that of a law of commands −1 to 1, and that of a law of
    /// propeller speed ± `max_rpm`; `None` without a known range.
    pub fn thrust_limits(&self, thruster: &Thruster) -> Option<[f64; 2]> {
        let ends = |input: f64| {
            let at = |x: f64| thruster.curve.force(x, None);
            [at(-input), at(input)]
        };
        match &thruster.curve {
            ThrustCurve::Table { tables, .. } => {
                let forces = || tables.iter().flat_map(|table| table.points()).map(|(_, f)| f);
                Some([forces().fold(0.0, f64::min), forces().fold(0.0, f64::max)])
            }
            ThrustCurve::Quadratic { input: ThrusterInput::Command, .. } => Some(ends(1.0)),
            ThrustCurve::Quadratic { input: ThrusterInput::Speed, .. } => {
                self.max_rpm.map(|rpm| ends(rpm * RPM))
            }
            ThrustCurve::Quadratic { .. } => None,
        }
    }

    /// Returns the input for a fraction of the greatest thrust, from −1 (full reverse) to 1 (full
    /// forward), in the unit of the curve.
    ///
    /// `supply_v` \[V\] is for curves of several voltages. The range of a curve is that of
    /// [`Self::thrust_limits`]; `None` without a known range, or if the curve gives no thrust in
    /// that direction.
    ///
    /// # Example
    /// ```
    /// use seaplant::exchange::PlantFile;
    /// let file: PlantFile = serde_json::from_value(serde_json::json!({
    ///     "schema": "seaplant/plant/1", "name": "sled", "source": "worked by hand",
    ///     "axes": ["surge"], "mass_matrix": [100.0],
    ///     "thruster": [{
    ///         "name": "main", "position_m": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0],
    ///         "curve": { "kind": "quadratic", "input": "command", "forward": 50.0, "reverse": 30.0 }
    ///     }]
    /// })).expect("a table");
    /// let model = file.model()?;
    /// // A quarter of 50 N: half of the command, as thrust is proportional to its square.
    /// let half = model.input_for_part(&model.thrusters[0], 0.25, None).expect("known");
    /// assert!((half - 0.5).abs() < 1e-9);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn input_for_part(
        &self,
        thruster: &Thruster,
        part: f64,
        supply_v: Option<f64>,
    ) -> Option<f64> {
        let curve = &thruster.curve;
        let ends = match curve {
            ThrustCurve::Table { .. } => curve.range().into(),
            ThrustCurve::Quadratic { input: ThrusterInput::Command, .. } => [-1.0, 1.0],
            ThrustCurve::Quadratic { input: ThrusterInput::Speed, .. } => {
                [-self.max_rpm? * RPM, self.max_rpm? * RPM]
            }
            ThrustCurve::Quadratic { .. } => return None,
        };
        if part == 0.0 {
            return Some(curve.neutral());
        }
        let mut thrusts = ends.into_iter().map(|end| curve.force(end, supply_v));
        let greatest = thrusts.find(|thrust| thrust * part > 0.0)?;
        curve.input_for(part.abs() * greatest, supply_v)
    }

    /// Returns the greatest force or moment of all thrusters on an axis, negative and positive, N
    /// and N m; `None` if none acts on it, or if one of unknown greatest thrust does.
    ///
    /// # Example
    /// ```
    /// use seaplant::Dof;
    /// use seaplant::exchange::PlantFile;
    /// let file: PlantFile = serde_json::from_value(serde_json::json!({
    ///     "schema": "seaplant/plant/1", "name": "sled", "source": "worked by hand",
    ///     "axes": ["surge"], "mass_matrix": [100.0],
    ///     "thruster": [{
    ///         "name": "main", "position_m": [0.0, 0.0, 0.0], "direction": [-1.0, 0.0, 0.0],
    ///         "curve": { "kind": "quadratic", "input": "command", "forward": 50.0, "reverse": 30.0 }
    ///     }]
    /// })).expect("a table");
    /// let model = file.model()?;
    /// assert_eq!(model.force_limits(Dof::Surge), Some([-50.0, 30.0]));
    /// assert_eq!(model.force_limits(Dof::Yaw), None);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn force_limits(&self, dof: Dof) -> Option<[f64; 2]> {
        let ratio = self.actuation.get(&dof).and_then(|found| found.reverse_ratio.as_ref());
        let ratio = ratio.map_or(1.0, |ratio| ratio.value);
        let mut total = [0.0; 2];
        for thruster in self.thrusters.iter().filter(|own| crate::Vehicle::acts_on(own, dof)) {
            let lever = thruster.unit_wrench()[dof.index()];
            let [reverse, forward] = self.thrust_limits(thruster)?;
            let mut ends = [lever * ratio * reverse, lever * forward];
            ends.sort_by(f64::total_cmp);
            total = [total[0] + ends[0], total[1] + ends[1]];
        }
        (total[0] < 0.0 && total[1] > 0.0).then_some(total)
    }
}
