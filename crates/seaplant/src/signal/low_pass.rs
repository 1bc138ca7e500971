use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// A Butterworth low-pass filter.
///
/// ```
/// use seaplant::signal::LowPass;
/// let paper = LowPass { cutoff_hz: 0.125, order: 2 };
/// assert!((paper.zero_phase_gain(0.125) - 0.5).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LowPass {
    /// Frequency at which a single pass halves power, Hz.
    pub cutoff_hz: f64,
    /// The order of a single pass, 1 to 8.
    pub order: usize,
}

/// Beyond this order, sections with a low cut-off lose more digits than promised.
const HIGHEST_ORDER: usize = 8;

/// No vehicle moves faster than this, Hz.
const HIGHEST_CUTOFF_HZ: f64 = 1000.0;

impl LowPass {
    /// Checks the settings that do not depend on the sampling rate.
    ///
    /// # Errors
    /// [`Error::Setting`] unless 0 < `cutoff_hz` ≤ 1000 and the order is 1 to 8.
    ///
    /// ```
    /// use seaplant::signal::LowPass;
    /// assert!(LowPass { cutoff_hz: 0.125, order: 2 }.check().is_ok());
    /// assert!(LowPass { cutoff_hz: -1.0, order: 2 }.check().is_err());
    /// ```
    pub fn check(&self) -> Result<(), Error> {
        let Self { cutoff_hz, order } = *self;
        if !(cutoff_hz > 0.0 && cutoff_hz <= HIGHEST_CUTOFF_HZ) {
            let expected = format!("above 0 and at most {HIGHEST_CUTOFF_HZ} Hz");
            return Err(Error::setting("cutoff_hz", cutoff_hz, expected));
        }
        if !(1..=HIGHEST_ORDER).contains(&order) {
            return Err(Error::setting("order", order, format!("from 1 to {HIGHEST_ORDER}")));
        }
        Ok(())
    }

    /// Smooths a series with the filter run forward, then backward.
    ///
    /// Phase cancels and gain squares: at `cutoff_hz` the amplitude is ½.
    /// The edges are extended by odd reflection and the filter starts in its
    /// steady state there, as `scipy.signal.sosfiltfilt` does by default.
    ///
    /// `x` has shape (n,) and any unit; the result has the same.
    ///
    /// # Errors
    /// [`Error::Cutoff`] unless 0 < `cutoff_hz` < `sample_hz` / 2 and the order
    /// is 1 to 8. [`Error::TooShort`] if n ≤ 3 (`order` + 1), the edge extension.
    ///
    /// # Source
    /// [Jason2, §3]: velocity, 2nd order, 1/8 Hz.
    ///
    /// # Example
    /// ```
    /// # use seaplant::signal::LowPass;
    /// let y = LowPass { cutoff_hz: 0.125, order: 2 }.zero_phase(&[2.0; 64], 10.0)?;
    /// assert!(y.iter().all(|y| (y - 2.0).abs() < 1e-9));
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn zero_phase(&self, x: &[f64], sample_hz: f64) -> Result<Vec<f64>, Error> {
        let mut y = x.to_vec();
        self.zero_phase_in_place(&mut y, sample_hz)?;
        Ok(y)
    }

    /// Smooths in place, as [`LowPass::zero_phase`].
    pub(crate) fn zero_phase_in_place(&self, x: &mut [f64], sample_hz: f64) -> Result<(), Error> {
        let sections = self.sections(sample_hz)?;
        self.check_length(x.len())?;
        let overlap = settling(&sections).max(self.edge());
        if x.len() / (4 * LANES) > overlap {
            smooth_in_lanes(&sections, x, self.edge(), overlap);
        } else {
            smooth(&sections, x.as_chunks_mut::<1>().0, self.edge());
        }
        Ok(())
    }

    /// Smooths several series of one length, row by row and in place, as [`LowPass::zero_phase`].
    ///
    /// # Errors
    /// As [`LowPass::zero_phase`].
    pub(crate) fn zero_phase_rows<const N: usize>(
        &self,
        rows: &mut [[f64; N]],
        sample_hz: f64,
    ) -> Result<(), Error> {
        let sections = self.sections(sample_hz)?;
        self.check_length(rows.len())?;
        smooth(&sections, rows, self.edge());
        Ok(())
    }

    /// Returns the number of samples after which a change has decayed below rounding.
    ///
    /// # Errors
    /// [`Error::Cutoff`].
    pub(crate) fn settling_rows(&self, sample_hz: f64) -> Result<usize, Error> {
        Ok(settling(&self.sections(sample_hz)?))
    }

    /// Returns the number of samples by which each end is extended.
    fn edge(&self) -> usize {
        3 * (self.order + 1)
    }

    fn check_length(&self, found: usize) -> Result<(), Error> {
        let needed = self.edge() + 1;
        if found < needed {
            let name = format!("a series to smooth at order {}", self.order);
            return Err(Error::TooShort { name, found, needed });
        }
        Ok(())
    }

    /// Returns the gain of [`LowPass::zero_phase`] at a frequency: `1 / (1 + (f/f_c)^(2 order))`.
    ///
    /// This is the squared gain of the analogue prototype; the digital filter is within 1 % of it
    /// up to a tenth of the sampling rate.
    pub fn zero_phase_gain(&self, frequency_hz: f64) -> f64 {
        1.0 / (1.0 + (frequency_hz / self.cutoff_hz).powi(2 * self.order as i32))
    }

    /// Designs the filter as second-order sections by the bilinear transform, with its frequency
    /// prewarped to `cutoff_hz`.
    ///
    /// With K = tan(π f_c / f_s), the pole pair of angle θ gives
    /// `K²(1 + 2z⁻¹ + z⁻²) / ((1 + 2K cos θ + K²) + 2(K² − 1)z⁻¹ + (1 − 2K cos θ + K²)z⁻²)`.
    fn sections(&self, sample_hz: f64) -> Result<Vec<Section>, Error> {
        let Self { cutoff_hz, order } = *self;
        let valid = cutoff_hz > 0.0 && cutoff_hz < 0.5 * sample_hz && sample_hz.is_finite();
        if !valid || !(1..=HIGHEST_ORDER).contains(&order) {
            return Err(Error::Cutoff { cutoff_hz, sample_hz, order, highest: HIGHEST_ORDER });
        }
        let k = (PI * cutoff_hz / sample_hz).tan();
        let mut sections = Vec::with_capacity(order.div_ceil(2));
        if order % 2 == 1 {
            let a0 = 1.0 + k;
            sections.push(Section { b: [k / a0, k / a0, 0.0], a: [(k - 1.0) / a0, 0.0] });
        }
        for pair in 0..order / 2 {
            // Angles count from the negative real axis; a real pole lies on it.
            let theta = PI * (2 * pair + 1 + order % 2) as f64 / (2 * order) as f64;
            let damping = 2.0 * k * theta.cos();
            let a0 = 1.0 + damping + k * k;
            let b = k * k / a0;
            let a = [2.0 * (k * k - 1.0) / a0, (1.0 - damping + k * k) / a0];
            sections.push(Section { b: [b, 2.0 * b, b], a });
        }
        Ok(sections)
    }
}

/// `y_k = b₀ x_k + b₁ x_{k−1} + b₂ x_{k−2} − a₁ y_{k−1} − a₂ y_{k−2}`.
///
/// Each sample depends on the one before, so a single series leaves the processor idle most of the
/// time: `filtfilt`, the reference of the tests, took more than three times as long for the four
/// columns of a regression as this does for all at once.
#[derive(Clone, Copy, Debug)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// Number of overlapping parts of a long series that are smoothed at once.
const LANES: usize = 4;

/// −ln of the relative size of rounding.
const SETTLED: f64 = 42.0;

impl Section {
    /// Returns the modulus of its slower pole.
    fn slowest_pole(&self) -> f64 {
        let [a1, a2] = self.a;
        let spread = 0.25 * a1 * a1 - a2;
        if spread < 0.0 { a2.sqrt() } else { 0.5 * a1.abs() + spread.sqrt() }
    }
}

fn settling(sections: &[Section]) -> usize {
    let slowest = sections.iter().map(Section::slowest_pole).fold(0.0, f64::max);
    (SETTLED / -slowest.ln()).ceil() as usize
}

/// The running state of a section.
struct Pass<const N: usize> {
    section: Section,
    x: [[f64; N]; 2],
    y: [[f64; N]; 2],
}

impl<const N: usize> Pass<N> {
    /// Starts in the steady state of the first row.
    fn steady(section: Section, first: [f64; N]) -> Self {
        let Section { b, a } = section;
        let gain = b.iter().sum::<f64>() / (1.0 + a[0] + a[1]);
        Self { section, x: [first; 2], y: [first.map(|x| gain * x); 2] }
    }

    fn over<'a>(&mut self, rows: impl Iterator<Item = &'a mut [f64; N]>) {
        let Section { b: [b0, b1, b2], a: [a1, a2] } = self.section;
        let ([mut x1, mut x2], [mut y1, mut y2]) = (self.x, self.y);
        for row in rows {
            let x = *row;
            // In this order only a product and a difference depend on the row before.
            let y = std::array::from_fn(|n| {
                (b0 * x[n] + b1 * x1[n] + b2 * x2[n] - a2 * y2[n]) - a1 * y1[n]
            });
            (x2, x1, y2, y1) = (x1, x, y1, y);
            *row = y;
        }
        (self.x, self.y) = ([x1, x2], [y1, y2]);
    }
}

/// Smooths rows that are extended by their odd reflections about the first and the last.
fn smooth<const N: usize>(sections: &[Section], rows: &mut [[f64; N]], edge: usize) {
    let (first, last) = (rows[0], rows[rows.len() - 1]);
    let mirror = |end: [f64; N], row: &[f64; N]| std::array::from_fn(|n| 2.0 * end[n] - row[n]);
    let head = rows[1..=edge].iter().rev().map(|row| mirror(first, row)).collect();
    let tail = rows.iter().rev().skip(1).take(edge).map(|row| mirror(last, row)).collect();
    there_and_back(sections, head, rows, tail);
}

/// Runs every section forward, then every section backward; head and tail are extensions whose
/// outputs are discarded.
fn there_and_back<const N: usize>(
    sections: &[Section],
    mut head: Vec<[f64; N]>,
    rows: &mut [[f64; N]],
    mut tail: Vec<[f64; N]>,
) {
    for section in sections {
        let mut pass = Pass::steady(*section, head[0]);
        pass.over(head.iter_mut());
        pass.over(rows.iter_mut());
        pass.over(tail.iter_mut());
    }
    for section in sections {
        let mut pass = Pass::steady(*section, tail[tail.len() - 1]);
        pass.over(tail.iter_mut().rev());
        pass.over(rows.iter_mut().rev());
    }
}

/// Smooths as [`smooth`], in parts that overlap so far that their truncation is below rounding.
fn smooth_in_lanes(sections: &[Section], x: &mut [f64], edge: usize, overlap: usize) {
    let len = (x.len() + 2 * overlap * (LANES - 1)).div_ceil(LANES);
    let start: [usize; LANES] = std::array::from_fn(|n| n * (x.len() - len) / (LANES - 1));
    let (first, last) = (x[0], x[x.len() - 1]);
    let head = |k: usize| {
        let back = edge - k;
        let before = |start: usize| x[start - back];
        start.map(|start| if start == 0 { 2.0 * first - x[back] } else { before(start) })
    };
    let tail = |k: usize| {
        start.map(|start| match x.get(start + len + k) {
            Some(x) => *x,
            None => 2.0 * last - x[x.len() - 2 - k],
        })
    };
    let (head, tail) = ((0..edge).map(head).collect(), (0..edge).map(tail).collect());
    let mut rows: Vec<[f64; LANES]> =
        (0..len).map(|k| std::array::from_fn(|n| x[start[n] + k])).collect();
    there_and_back(sections, head, &mut rows, tail);
    for (n, &start) in start.iter().enumerate() {
        let from = if n == 0 { 0 } else { overlap };
        let smoothed = rows[from..].iter().map(|row| row[n]);
        x[start + from..start + len].iter_mut().zip(smoothed).for_each(|(x, y)| *x = y);
    }
}

#[cfg(test)]
mod tests {
    use filtfilt::{FilterPadding, SosFilter, sosfiltfilt};
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn refuses_a_cutoff_beyond_half_the_sampling_rate() {
        let refused = LowPass { cutoff_hz: 1.5, order: 2 }.zero_phase(&[0.0; 99], 2.0);
        assert!(matches!(refused, Err(Error::Cutoff { .. })));
    }

    #[test]
    fn refuses_a_series_shorter_than_its_edges() {
        let filter = LowPass { cutoff_hz: 0.1, order: 2 };
        assert!(matches!(
            filter.zero_phase(&[0.0; 9], 1.0),
            Err(Error::TooShort { needed: 10, .. })
        ));
        assert!(filter.zero_phase(&[0.0; 10], 1.0).is_ok());
    }

    #[test]
    fn halves_a_sine_at_the_cutoff() {
        let filter = LowPass { cutoff_hz: 0.125, order: 2 };
        let x: Vec<f64> = (0..4000).map(|k| (2.0 * PI * 0.125 * 0.1 * k as f64).sin()).collect();
        let y = filter.zero_phase(&x, 10.0).expect("long enough");
        // Whole periods in the middle, far from the edges.
        let ratio = |k: usize| y[k] / x[k];
        assert!((ratio(2020) - 0.5).abs() < 1e-3, "{}", ratio(2020));
    }

    /// Tolerance for signals of magnitude one.
    const SAME: f64 = 1e-10;

    fn by_filtfilt(filter: LowPass, x: &[f64], sample_hz: f64) -> Vec<f64> {
        let sections: Vec<SosFilter<f64>> = filter
            .sections(sample_hz)
            .expect("a valid cutoff")
            .iter()
            .map(|section| SosFilter::new(section.b, [1.0, section.a[0], section.a[1]]))
            .collect();
        sosfiltfilt(&sections, x, FilterPadding::Odd).expect("long enough")
    }

    fn worst(a: &[f64], b: &[f64]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn rows_are_smoothed_as_single_series() {
        let filter = LowPass { cutoff_hz: 0.5, order: 3 };
        let tone = |rad_s: f64| (0..700).map(|k| (rad_s * f64::from(k)).cos()).collect::<Vec<_>>();
        let (slow, fast) = (tone(0.02), tone(0.9));
        let mut smooth: Vec<[f64; 2]> = slow.iter().zip(&fast).map(|(&a, &b)| [a, b]).collect();
        filter.zero_phase_rows(&mut smooth, 10.0).expect("long enough");
        for (n, x) in [slow, fast].iter().enumerate() {
            let lane: Vec<f64> = smooth.iter().map(|row| row[n]).collect();
            assert!(worst(&lane, &filter.zero_phase(x, 10.0).expect("long enough")) < SAME);
        }
    }

    proptest! {
        #[test]
        fn equals_filtfilt_in_lanes_or_not(
            order in 1..=HIGHEST_ORDER,
            cutoff_hz in 0.02..4.5_f64,
            x in prop::collection::vec(-1.0..1.0_f64, 28..6000),
        ) {
            let filter = LowPass { cutoff_hz, order };
            let y = filter.zero_phase(&x, 10.0).expect("long enough");
            let worst = worst(&y, &by_filtfilt(filter, &x, 10.0));
            prop_assert!(worst < 1e-8, "{worst:e}");
        }

        #[test]
        fn commutes_with_reversal_of_time(x in prop::collection::vec(-1.0..1.0_f64, 400)) {
            let filter = LowPass { cutoff_hz: 1.0, order: 2 };
            let forward = filter.zero_phase(&x, 10.0).expect("long enough");
            let turned: Vec<f64> = x.iter().rev().copied().collect();
            let backward = filter.zero_phase(&turned, 10.0).expect("long enough");
            // Forward-backward starts differ at the edges; 100 samples are 60 time constants.
            for k in 100..300 {
                prop_assert!((forward[k] - backward[399 - k]).abs() < 1e-9);
            }
        }
    }
}
