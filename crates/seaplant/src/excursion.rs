//! The amplitude of a vehicle's motion relative to its size.

use crate::signal::amplitude_spectrum;
use crate::{AxisRecord, Dof, Error, Role, Vehicle};

/// The typical excursion of one record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Excursion {
    /// Distance per oscillation, m or rad: V T of the dominant oscillation, or the distance
    /// travelled in a steady run.
    pub(crate) stroke: f64,
    /// The Keulegan–Carpenter number: the stroke over the size of the hull across it.
    pub(crate) keulegan_carpenter: Option<f64>,
}

impl Excursion {
    /// Computes `KC = V T / D`: V is the amplitude of a sinusoid with the velocity's root mean
    /// square, T the dominant period of velocity, and D the square root of the projected area of
    /// the hull.
    ///
    /// # Errors
    /// [`Error::TooShort`] for a record without a stretch.
    ///
    /// # Source
    /// [KeuleganCarpenter1958].
    pub(crate) fn of(
        axis: &AxisRecord,
        role: Role,
        vehicle: &Vehicle,
    ) -> Result<Option<Self>, Error> {
        let uniform = axis.uniform(0)?;
        let Some(longest) = uniform.stretches.iter().max_by_key(|stretch| stretch.v.len()) else {
            return Ok(None);
        };
        let v = &longest.v;
        let way: f64 = v.iter().map(|v| v.abs()).sum::<f64>() / uniform.sample_hz;
        let rms = (v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64).sqrt();
        let period_s = amplitude_spectrum(v, uniform.sample_hz).dominant_hz().map(|hz| 1.0 / hz);
        let stroke = match role {
            Role::Steady => Some(way),
            Role::Fit | Role::HoldOut => period_s.map(|period_s| 2_f64.sqrt() * rms * period_s),
        };
        Ok(stroke.map(|stroke| Self {
            stroke,
            keulegan_carpenter: size_across(vehicle, axis.dof).map(|size| stroke / size),
        }))
    }
}

/// Returns the size of the hull across a translation, m.
fn size_across(vehicle: &Vehicle, dof: Dof) -> Option<f64> {
    vehicle.frontal_area_m2(dof).map(f64::sqrt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Timed;
    use crate::navigation::Motion;

    #[test]
    fn a_sine_of_half_a_metre_has_the_textbook_keulegan_carpenter_number() {
        // z = A sin ωt has V T = 2π A, so that KC = 2π A / D.
        let (amplitude, omega) = (0.5, 0.3925);
        let time_s: Vec<f64> = (0..4800).map(|k| 0.1 * f64::from(k)).collect();
        let v: Vec<f64> = time_s.iter().map(|t| amplitude * omega * (omega * t).cos()).collect();
        let axis = AxisRecord {
            dof: Dof::Heave,
            trial: "heave".to_owned(),
            force: Timed::new("force", time_s.clone(), vec![0.0; v.len()]).expect("valid"),
            thrusters: Vec::new(),
            motion: Motion::Velocity(Timed::new("velocity", time_s, v).expect("valid")),
            lever_rates: None,
            turning: None,
            position: None,
            acceleration: None,
            cuts: Vec::new(),
        };
        let vehicle = Vehicle { size_m: Some([3.4, 2.2, 2.4]), ..Vehicle::default() };
        let found =
            Excursion::of(&axis, Role::Fit, &vehicle).expect("long enough").expect("moving");
        let expected = 2.0 * std::f64::consts::PI * amplitude / (3.4_f64 * 2.2).sqrt();
        let kc = found.keulegan_carpenter.expect("the size is known");
        // The period is that of a bin of the spectrum, 1/960 Hz wide.
        assert!((kc / expected - 1.0).abs() < 0.02, "{kc} {expected}");
        let steady = Excursion::of(&axis, Role::Steady, &vehicle).expect("as before");
        // Mean |cos| is 2/π.
        let way = 480.0 * amplitude * omega * 2.0 / std::f64::consts::PI;
        assert!((steady.expect("moving").stroke / way - 1.0).abs() < 0.01);
    }
}
