//! Validation of the twin's specification.

use std::collections::BTreeSet;

use super::vehicle::DRIVEN;
use super::{TwinSpec, percent};
use crate::Error;

/// Shortest duration of a trial, s.
const SHORTEST_S: f64 = 20.0;
/// Longest duration of a trial, limited by memory: a day, s.
const LONGEST_S: f64 = 86_400.0;

/// Largest plausible depth, mass or force of a vehicle.
const LARGEST: f64 = 1e9;

/// Largest jitter at which time stamps of a 10 Hz instrument stay in order, s.
const MOST_JITTER_S: f64 = 0.045;

impl TwinSpec {
    /// Returns the twin of Jason 2: tables 4 and 5 of the paper.
    pub fn jason2() -> Self {
        Self::default()
    }

    /// Checks the specification.
    ///
    /// # Errors
    /// [`Error::TwinSpec`] with the setting, its value and its valid values.
    pub fn validate(&self) -> Result<(), Error> {
        self.check_dofs()?;
        self.check_durations()?;
        let positive = [
            ("dry_mass_kg", self.dry_mass_kg),
            ("start_depth_m", self.start_depth_m),
            ("thrusters.forward", self.thrusters.forward),
            ("thrusters.reverse", self.thrusters.reverse),
            ("thrusters.max_rpm", self.thrusters.max_rpm),
        ];
        positive.iter().try_for_each(|(name, value)| above_zero(name, *value))?;
        self.check_plants()?;
        self.check_excitation()?;
        self.check_steady()?;
        self.check_strength()
    }

    fn check_dofs(&self) -> Result<(), Error> {
        let expected = "some of surge, sway, heave and yaw: the twin has no thrusters for others";
        if self.dofs.is_empty() {
            return Err(refused("list of dofs", "empty", expected));
        }
        let named = self.dofs.iter().chain(self.plants.keys()).chain(self.excitation.keys());
        match named.into_iter().find(|dof| !DRIVEN.contains(dof)) {
            Some(dof) => Err(refused("list of dofs", &format!("with {dof}"), expected)),
            None => Ok(()),
        }
    }

    fn check_durations(&self) -> Result<(), Error> {
        let durations = [
            ("duration_s", self.duration_s),
            ("hold_out_s", self.hold_out_s),
            ("steady.duration_s", self.steady.duration_s),
        ];
        let wrong = durations.iter().find(|(_, s)| !(SHORTEST_S..=LONGEST_S).contains(s));
        wrong.map_or(Ok(()), |(name, s)| {
            Err(refused(name, &s.to_string(), &format!("from {SHORTEST_S} s to a day")))
        })
    }

    fn check_plants(&self) -> Result<(), Error> {
        for dof in &self.dofs {
            let Some(plant) = self.plants.get(dof) else {
                return Err(refused(&format!("plant of {dof}"), "missing", "given in plants"));
            };
            above_zero(&format!("plants.{dof}.mass"), plant.mass)?;
            not_negative(&format!("plants.{dof}.d_quadratic"), plant.d_quadratic)?;
            not_negative(&format!("plants.{dof}.d_linear"), plant.d_linear)?;
            finite(&format!("plants.{dof}.bias_force"), plant.bias_force)?;
            if plant.d_quadratic + plant.d_linear == 0.0 {
                let name = format!("drag of {dof}");
                return Err(refused(&name, "zero", "above 0, or the vehicle never slows down"));
            }
        }
        Ok(())
    }

    fn check_excitation(&self) -> Result<(), Error> {
        for dof in &self.dofs {
            let Some(excitation) = self.excitation.get(dof) else {
                let name = format!("excitation of {dof}");
                return Err(refused(&name, "missing", "given in excitation"));
            };
            not_negative(&format!("excitation.{dof}.amplitude"), excitation.amplitude)?;
            not_negative(&format!("excitation.{dof}.joystick"), excitation.joystick)?;
            above_zero(&format!("excitation.{dof}.frequency_rad_s"), excitation.frequency_rad_s)?;
        }
        Ok(())
    }

    fn check_steady(&self) -> Result<(), Error> {
        above_zero("steady.d_quadratic", self.steady.d_quadratic)?;
        finite("steady.bias_force", self.steady.bias_force)?;
        for (way, parts) in [("down", &self.steady.down), ("up", &self.steady.up)] {
            let name = format!("steady.{way} thrust");
            if let Some(part) = parts.iter().find(|part| !(**part > 0.0 && **part <= 1.0)) {
                let expected = "above 0 and at most 1, a part of the greatest thrust";
                return Err(refused(&name, &part.to_string(), expected));
            }
            // Percentages name the runs and seed their noise.
            let named: BTreeSet<String> = parts.iter().map(|&part| percent(part)).collect();
            if named.len() < parts.len() {
                return Err(refused(&name, "given twice", "different in each run, by 0.1 %"));
            }
        }
        Ok(())
    }

    fn check_strength(&self) -> Result<(), Error> {
        let s = &self.strength;
        let times = [
            ("tether_correlation_s", s.tether_correlation_s),
            ("current_correlation_s", s.current_correlation_s),
            ("swell_period_s", s.swell_period_s),
            ("drift_correlation_s", s.drift_correlation_s),
            ("gap_s", s.gap_s),
            ("gap_interval_s", s.gap_interval_s),
        ];
        times.iter().try_for_each(|(name, s)| above_zero(&format!("strength.{name}"), *s))?;
        let sizes = [
            ("tether_n", s.tether_n),
            ("current_std_m_s", s.current_std_m_s),
            ("lag_s", s.lag_s),
            ("delay_s", s.delay_s),
            ("lever_rate_rad_s", s.lever_rate_rad_s),
            ("swell_n", s.swell_n),
            ("inflow_loss", s.inflow_loss),
            ("lag_up_s", s.lag_up_s),
            ("lag_down_s", s.lag_down_s),
            ("slew_s", s.slew_s),
            ("inflow_one_sided_loss", s.inflow_one_sided_loss),
            ("swell_std_n", s.swell_std_n),
            ("drift_std_m_s", s.drift_std_m_s),
            ("averaging_s", s.averaging_s),
            ("velocity_lag_s", s.velocity_lag_s),
            ("spike_m_s", s.spike_m_s),
            ("spike_heading_deg", s.spike_heading_deg),
        ];
        sizes
            .iter()
            .try_for_each(|(name, size)| not_negative(&format!("strength.{name}"), *size))?;
        let any = [
            ("current_m_s", s.current_m_s),
            ("lever_m", s.lever_m),
            ("heading_drift_deg_min", s.heading_drift_deg_min),
        ];
        any.iter().try_for_each(|(name, size)| finite(&format!("strength.{name}"), *size))?;
        self.check_bounded_strength()
    }

    /// Checks strengths with bounds.
    fn check_bounded_strength(&self) -> Result<(), Error> {
        let s = &self.strength;
        let bounded = [
            ("thrust_exponent", s.thrust_exponent, 1.0..=3.0, "from 1 to 3"),
            ("dead_band", s.dead_band, 0.0..=0.5, "from 0 to 0.5"),
            ("sag_part", s.sag_part, 0.0..=0.9, "from 0 to 0.9"),
            ("swell_damping", s.swell_damping, 0.001..=0.9, "from 0.001 to 0.9"),
            ("dvl_scale_error", s.dvl_scale_error, -0.5..=0.5, "from −0.5 to 0.5"),
            ("spike_part", s.spike_part, 0.0..=0.5, "from 0 to 0.5"),
            (
                "stamp_jitter_s",
                s.stamp_jitter_s,
                0.0..=MOST_JITTER_S,
                "from 0 to 0.045, so that stamps at 10 Hz keep their order",
            ),
            ("thrust_log_s", s.thrust_log_s, 0.1..=10.0, "from 0.1 to 10 s"),
        ];
        let wrong = bounded.into_iter().find(|(_, value, bounds, _)| !bounds.contains(value));
        wrong.map_or(Ok(()), |(name, value, _, expected)| {
            Err(refused(&format!("strength.{name}"), &value.to_string(), expected))
        })
    }
}

impl TwinSpec {
    /// Refuses a trial in which the vehicle rises by more than its depth, m.
    pub(super) fn refuse_surfacing(&self, rises: f64, trial: &str) -> Result<(), Error> {
        if self.start_depth_m > rises {
            return Ok(());
        }
        let expected = format!("{:.0} or more: trial `{trial}` rises that far", rises + 1.0);
        Err(refused("start_depth_m", &self.start_depth_m.to_string(), &expected))
    }
}

pub(super) fn refused(name: &str, found: &str, expected: &str) -> Error {
    Error::TwinSpec {
        name: name.to_owned(),
        found: found.to_owned(),
        expected: expected.to_owned(),
    }
}

pub(super) fn above_zero(name: &str, value: f64) -> Result<(), Error> {
    let fine = value > 0.0 && value <= LARGEST;
    if fine { Ok(()) } else { Err(refused(name, &value.to_string(), "above 0, and finite")) }
}

pub(super) fn not_negative(name: &str, value: f64) -> Result<(), Error> {
    let fine = (0.0..=LARGEST).contains(&value);
    if fine { Ok(()) } else { Err(refused(name, &value.to_string(), "0 or more, and finite")) }
}

fn finite(name: &str, value: f64) -> Result<(), Error> {
    let fine = value.abs() <= LARGEST;
    if fine { Ok(()) } else { Err(refused(name, &value.to_string(), "a finite number")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dof;

    fn message(change: impl FnOnce(&mut TwinSpec)) -> String {
        let mut spec = TwinSpec::jason2();
        change(&mut spec);
        spec.validate().expect_err("cannot be").to_string()
    }

    #[test]
    fn accepts_jason_2() {
        assert_eq!(TwinSpec::jason2().validate(), Ok(()));
    }

    #[test]
    fn refuses_a_negative_mass() {
        let message = message(|spec| spec.plants.get_mut(&Dof::Sway).expect("sway").mass = -3.0);
        assert_eq!(message, "the twin's plants.sway.mass is -3; it must be above 0, and finite");
    }

    #[test]
    fn refuses_a_trial_of_no_length() {
        let message = message(|spec| spec.duration_s = 0.0);
        assert_eq!(message, "the twin's duration_s is 0; it must be from 20 s to a day");
    }

    #[test]
    fn refuses_a_value_that_is_not_a_number() {
        assert!(message(|spec| spec.strength.tether_n = f64::NAN).contains("tether_n is NaN"));
    }

    #[test]
    fn refuses_strengths_out_of_bounds() {
        let said = |change: fn(&mut crate::twin::DisturbanceStrength)| {
            message(|spec| change(&mut spec.strength))
        };
        assert_eq!(
            said(|s| s.thrust_exponent = 0.0),
            "the twin's strength.thrust_exponent is 0; it must be from 1 to 3"
        );
        assert!(said(|s| s.stamp_jitter_s = 0.05).contains("keep their order"));
        assert!(said(|s| s.swell_damping = f64::NAN).contains("swell_damping is NaN"));
        assert!(said(|s| s.sag_part = 1.0).contains("from 0 to 0.9"));
        assert!(said(|s| s.dvl_scale_error = -1.0).contains("from −0.5 to 0.5"));
        assert!(said(|s| s.spike_part = -0.1).contains("spike_part is -0.1"));
        assert!(said(|s| s.gap_s = 0.0).contains("above 0"));
        assert!(said(|s| s.lag_down_s = -0.1).contains("0 or more"));
        assert!(said(|s| s.thrust_log_s = 0.0).contains("from 0.1 to 10 s"));
        assert!(said(|s| s.heading_drift_deg_min = f64::INFINITY).contains("a finite number"));
    }

    #[test]
    fn refuses_a_plant_without_drag() {
        let change = |spec: &mut TwinSpec| {
            spec.plants.get_mut(&Dof::Yaw).expect("yaw").d_quadratic = 0.0;
        };
        assert!(message(change).contains("never slows down"));
    }

    #[test]
    fn refuses_to_roll() {
        let message = message(|spec| {
            spec.dofs.insert(Dof::Roll);
        });
        assert!(message.contains("with roll; it must be some of surge"), "{message}");
    }

    #[test]
    fn refuses_more_than_full_thrust() {
        assert!(message(|spec| spec.steady.up.push(1.2)).contains("steady.up thrust is 1.2"));
    }

    #[test]
    fn refuses_two_runs_of_one_name() {
        assert!(message(|spec| spec.steady.down.push(0.3)).contains("given twice"));
        let mut spec = TwinSpec::jason2();
        spec.steady.down.push(0.305);
        assert_eq!(spec.validate(), Ok(()));
    }
}
