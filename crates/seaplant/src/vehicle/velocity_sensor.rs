//! The dynamics of a velocity sensor.

/// The dynamics of a velocity sensor; none by default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocitySensor {
    /// First-order lag, s.
    pub lag_s: f64,
    /// Averaging window, s.
    pub window_s: f64,
    /// Scale factor.
    pub scale: f64,
}

impl Default for VelocitySensor {
    fn default() -> Self {
        Self { lag_s: 0.0, window_s: 0.0, scale: 1.0 }
    }
}

impl VelocitySensor {
    /// Returns the sensor's output for a velocity: a lag `T ẏ = v − y`, an average of v over `[t −
    /// w, t]`, and the scale factor.
    ///
    /// `time_s` increases, `velocity` has as many values, in m/s or rad/s, linear between instants
    /// and constant before the first.
    ///
    /// ```
    /// use seaplant::VelocitySensor;
    /// let averages = VelocitySensor { window_s: 1.0, ..VelocitySensor::default() };
    /// assert_eq!(averages.shows(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0]), [0.0, 0.5, 1.5]);
    /// ```
    pub fn shows(&self, time_s: &[f64], velocity: &[f64]) -> Vec<f64> {
        let mut output = velocity.to_vec();
        if self.lag_s > 0.0 {
            lag(time_s, &mut output, self.lag_s);
        }
        if self.window_s > 0.0 {
            output = average(time_s, &output, self.window_s);
        }
        if self.scale != 1.0 {
            output.iter_mut().for_each(|v| *v *= self.scale);
        }
        output
    }
}

/// Applies a first-order lag exactly to a signal that is linear between samples.
fn lag(time_s: &[f64], values: &mut [f64], lag_s: f64) {
    let mut before = values.first().copied().unwrap_or(0.0);
    let mut output = before;
    for k in 1..values.len() {
        let step = (time_s[k] - time_s[k - 1]) / lag_s;
        let (now, decay) = (values[k], (-step).exp());
        let slope = (now - before) / step;
        // The steady response to a ramp is y = v − slope × lag.
        output = now - slope + (output - before + slope) * decay;
        (before, values[k]) = (now, output);
    }
}

/// Averages a signal that is linear between samples over the time before each.
fn average(time_s: &[f64], values: &[f64], window_s: f64) -> Vec<f64> {
    let mut integral = vec![0.0; values.len()];
    for k in 1..values.len() {
        let step_s = time_s[k] - time_s[k - 1];
        integral[k] = integral[k - 1] + 0.5 * step_s * (values[k] + values[k - 1]);
    }
    let mut from = 0;
    let window_mean = |k: usize| {
        let start_s = time_s[k] - window_s;
        if start_s <= time_s[0] {
            return (integral[k] + values[0] * (time_s[0] - start_s)) / window_s;
        }
        while time_s[from + 1] < start_s {
            from += 1;
        }
        let (step_s, part_s) = (time_s[from + 1] - time_s[from], start_s - time_s[from]);
        let at_start = values[from] + (values[from + 1] - values[from]) * part_s / step_s;
        let before = integral[from] + 0.5 * part_s * (values[from] + at_start);
        (integral[k] - before) / window_s
    };
    (0..values.len()).map(window_mean).collect()
}
