//! What a velocity sensor shows of a velocity.

/// What a velocity sensor makes of velocity before it is logged; by default nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocitySensor {
    /// First-order lag, s.
    pub lag_s: f64,
    /// It averages over so long a time, s.
    pub window_s: f64,
    /// It reads so many times the velocity.
    pub scale: f64,
}

impl Default for VelocitySensor {
    fn default() -> Self {
        Self { lag_s: 0.0, window_s: 0.0, scale: 1.0 }
    }
}

impl VelocitySensor {
    /// What it shows of a velocity: a lag `T ẏ = v − y`, an average of v over `[t − w, t]`, times
    /// its scale.
    ///
    /// `time_s` increases, `velocity` has as many values, in m/s or rad/s; between them velocity
    /// is linear, and before them constant.
    ///
    /// ```
    /// use seaplant::VelocitySensor;
    /// let averages = VelocitySensor { window_s: 1.0, ..VelocitySensor::default() };
    /// assert_eq!(averages.shows(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0]), [0.0, 0.5, 1.5]);
    /// ```
    pub fn shows(&self, time_s: &[f64], velocity: &[f64]) -> Vec<f64> {
        let mut shown = velocity.to_vec();
        if self.lag_s > 0.0 {
            lag(time_s, &mut shown, self.lag_s);
        }
        if self.window_s > 0.0 {
            shown = average(time_s, &shown, self.window_s);
        }
        if self.scale != 1.0 {
            shown.iter_mut().for_each(|v| *v *= self.scale);
        }
        shown
    }
}

/// A first-order lag of what is linear between samples, exactly.
fn lag(time_s: &[f64], values: &mut [f64], lag_s: f64) {
    let mut before = values.first().copied().unwrap_or(0.0);
    let mut shown = before;
    for k in 1..values.len() {
        let step = (time_s[k] - time_s[k - 1]) / lag_s;
        let (now, kept) = (values[k], (-step).exp());
        let slope = (now - before) / step;
        // y = v − slope of the lag times, once its start is forgotten.
        shown = now - slope + (shown - before + slope) * kept;
        (before, values[k]) = (now, shown);
    }
}

/// The average over the time before each sample of what is linear between samples.
fn average(time_s: &[f64], values: &[f64], window_s: f64) -> Vec<f64> {
    let mut passed = vec![0.0; values.len()];
    for k in 1..values.len() {
        let step_s = time_s[k] - time_s[k - 1];
        passed[k] = passed[k - 1] + 0.5 * step_s * (values[k] + values[k - 1]);
    }
    let mut from = 0;
    let of = |k: usize| {
        let start_s = time_s[k] - window_s;
        if start_s <= time_s[0] {
            return (passed[k] + values[0] * (time_s[0] - start_s)) / window_s;
        }
        while time_s[from + 1] < start_s {
            from += 1;
        }
        let (step_s, part_s) = (time_s[from + 1] - time_s[from], start_s - time_s[from]);
        let at_start = values[from] + (values[from + 1] - values[from]) * part_s / step_s;
        let before = passed[from] + 0.5 * part_s * (values[from] + at_start);
        (passed[k] - before) / window_s
    };
    (0..values.len()).map(of).collect()
}
