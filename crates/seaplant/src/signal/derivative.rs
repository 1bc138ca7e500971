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
    let (t, x_values) = (x.time_s(), x.values());
    let last = last_of(x_values)?;
    let slope = |k: usize| (x_values[k + 1] - x_values[k]) / (t[k + 1] - t[k]);
    let v = (0..=last)
        .map(|k| match k {
            0 => slope(0),
            k if k == last => slope(k - 1),
            k => {
                let (before, after) = (t[k] - t[k - 1], t[k + 1] - t[k]);
                (after * slope(k - 1) + before * slope(k)) / (before + after)
            }
        })
        .collect();
    x.with_values("the derivative", v)
}

fn last_of(x: &[f64]) -> Result<usize, Error> {
    if x.len() < 2 {
        let name = "a series to differentiate".to_owned();
        return Err(Error::TooShort { name, found: x.len(), needed: 2 });
    }
    Ok(x.len() - 1)
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
