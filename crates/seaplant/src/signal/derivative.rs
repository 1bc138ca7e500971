use crate::{Error, Timed};

/// The derivative of a uniform series by central differences, one-sided at the ends.
///
/// `v_k = (x_{k+1} − x_{k−1}) / 2h`, second order inside; equal to
/// `numpy.gradient(x, h)`. Shape (n,) in and out.
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

/// The derivative of a series at its own times, by the parabola through each sample
/// and its neighbours; one-sided at the ends.
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

/// The slope at a point `[t, x]` of the parabola through it and its neighbours, of which
/// one may lack; zero if both do.
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
    fn two_samples_have_one_slope() {
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
