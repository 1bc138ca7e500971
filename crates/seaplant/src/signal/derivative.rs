use crate::{Error, Timed};

/// Differentiates a uniform series by central differences, one-sided at the ends.
///
/// `v_k = (x_{k+1} − x_{k−1}) / 2h`, second order inside; equal to `numpy.gradient(x, h)`. Shape
/// (n,) in and out.
///
/// # Errors
/// [`Error::TooShort`] with fewer than two samples.
///
/// ```
/// let v = seaplant::signal::differentiate(&[0.0, 1.0, 4.0, 9.0], 1.0)?;
/// assert_eq!(v, [1.0, 2.0, 4.0, 5.0]);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn differentiate(x: &[f64], period_s: f64) -> Result<Vec<f64>, Error> {
    let last = last_of(x)?;
    let mut v = Vec::with_capacity(x.len());
    v.push((x[1] - x[0]) / period_s);
    v.extend(x.windows(3).map(|three| (three[2] - three[0]) / (2.0 * period_s)));
    if last > 0 {
        v.push((x[last] - x[last - 1]) / period_s);
    }
    Ok(v)
}

/// Differentiates a series at its own times by the parabola through each sample and its neighbours;
/// one-sided at the ends.
///
/// Equal to `numpy.gradient(x, t)`.
///
/// # Errors
/// [`Error::TooShort`] with fewer than two samples.
pub fn differentiate_timed(x: &Timed) -> Result<Timed, Error> {
    let (t, values) = (x.time_s(), x.values());
    let last = last_of(values)?;
    let point = |k: usize| [t[k], values[k]];
    let slope = |k: usize| {
        let (before, after) = (k.checked_sub(1).map(point), (k < last).then(|| point(k + 1)));
        slope_of_parabola(before, point(k), after)
    };
    x.with_values("the derivative", (0..=last).map(slope).collect())
}

/// Differentiates a series at its own times by the least-squares line through all samples within
/// `half_s` on either side; where there are fewer than four, by [`differentiate_timed`].
///
/// Noise and jitter of the time stamps average out.
///
/// # Errors
/// [`Error::TooShort`] with fewer than two samples.
pub(crate) fn slope_around(x: &Timed, half_s: f64) -> Result<Timed, Error> {
    let (t, values) = (x.time_s(), x.values());
    let last = last_of(values)?;
    let point = |k: usize| [t[k], values[k]];
    let (mut from, mut to) = (0, 0);
    let slope = |k: usize| {
        while t[from] < t[k] - half_s {
            from += 1;
        }
        while to <= last && t[to] <= t[k] + half_s {
            to += 1;
        }
        if to - from > 3 {
            return slope_of_line(&t[from..to], &values[from..to]);
        }
        let (before, after) = (k.checked_sub(1).map(point), (k < last).then(|| point(k + 1)));
        slope_of_parabola(before, point(k), after)
    };
    x.with_values("the slope", (0..=last).map(slope).collect())
}

/// Returns the slope of the least-squares line through samples at two or more times.
pub(crate) fn slope_of_line(time_s: &[f64], values: &[f64]) -> f64 {
    let n = time_s.len() as f64;
    let (t, x) = (time_s.iter().sum::<f64>() / n, values.iter().sum::<f64>() / n);
    let (mut top, mut bottom) = (0.0, 0.0);
    for (time_s, value) in time_s.iter().zip(values) {
        top += (time_s - t) * (value - x);
        bottom += (time_s - t).powi(2);
    }
    top / bottom
}

/// Returns the slope at a point `[t, x]` of the parabola through it and its neighbours; of the line
/// if one neighbour is missing, zero if both are.
pub(crate) fn slope_of_parabola(
    before: Option<[f64; 2]>,
    now: [f64; 2],
    after: Option<[f64; 2]>,
) -> f64 {
    let slope = |from: [f64; 2], to: [f64; 2]| (to[1] - from[1]) / (to[0] - from[0]);
    match (before, after) {
        (Some(before), Some(after)) => {
            let (early, late) = (now[0] - before[0], after[0] - now[0]);
            (late * slope(before, now) + early * slope(now, after)) / (early + late)
        }
        (None, Some(after)) => slope(now, after),
        (Some(before), None) => slope(before, now),
        (None, None) => 0.0,
    }
}

fn last_of(x: &[f64]) -> Result<usize, Error> {
    check_differentiable(x.len())?;
    Ok(x.len() - 1)
}

pub(crate) fn check_differentiable(found: usize) -> Result<(), Error> {
    if found < 2 {
        let name = "a series to differentiate".to_owned();
        return Err(Error::TooShort { name, found, needed: 2 });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_of_stamps_makes_no_slope() {
        // Samples of 0.3 t at 10 Hz with stamps that are late by up to a sample, some by 2 µs.
        let late = |k: i32| if k % 7 == 0 { 0.1 - 2e-6 } else { 0.0 };
        let stamps: Vec<f64> = (0..200).map(|k| 0.1 * f64::from(k) + late(k)).collect();
        let values: Vec<f64> = (0..200).map(|k| 0.03 * f64::from(k)).collect();
        let x = Timed::new("x", stamps, values).expect("valid");
        let raw = differentiate_timed(&x).expect("long enough");
        assert!(raw.values().iter().any(|v| (v - 0.3).abs() > 1000.0));
        let slope = slope_around(&x, 0.5).expect("long enough");
        assert!(slope.values().iter().all(|v| (v - 0.3).abs() < 0.07), "{slope:?}");
    }

    #[test]
    fn few_samples_give_the_slope_of_their_parabola() {
        let x = Timed::new("x", vec![0.0, 1.0, 2.5, 3.0], vec![0.0, 1.0, 4.0, 2.0]).expect("valid");
        assert_eq!(slope_around(&x, 0.5), differentiate_timed(&x));
    }

    #[test]
    fn two_samples_give_one_slope() {
        assert_eq!(differentiate(&[1.0, 3.0], 0.5).expect("two"), [4.0, 4.0]);
    }

    #[test]
    fn a_parabola_is_exact_at_uneven_times() {
        let t = [0.0, 0.1, 0.5, 0.6, 1.5];
        let x = Timed::new("x", t.to_vec(), t.iter().map(|t| t * t).collect::<Vec<_>>());
        let v = differentiate_timed(&x.expect("valid")).expect("five");
        let exact = t.map(|t| 2.0 * t);
        assert!(v.values()[1..4].iter().zip(&exact[1..4]).all(|(v, e)| (v - e).abs() < 1e-12));
    }
}
