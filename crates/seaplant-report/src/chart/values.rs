//! Number series for the page's script: exact if short, packed if long.

use std::io::Write;
use std::ops::Range;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use serde::Serialize;

use crate::decimate::runs;

/// Number of values up to which they are written exactly.
const FEW: usize = 64;

/// Maximum number of points; longer records are reduced to minimum and maximum of each part. A
/// browser zooms through this many without effort.
const MOST_POINTS: usize = 1 << 17;

/// Code of a missing number.
const MISSING: u16 = u16::MAX;

/// A series of numbers; values that are not finite are missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Values {
    /// Exact values.
    List(Vec<Option<f64>>),
    /// Start, equal steps; if these are only nearly equal, `off` is added to each.
    Steps {
        from: f64,
        step: f64,
        count: usize,
        #[serde(skip_serializing_if = "Option::is_none")]
        off: Option<Box<Values>>,
    },
    /// Codes: 0xffff for missing, else `low + step · k`; differences of successive k modulo 65536,
    /// all high bytes before the low ones, deflated, in base 64.
    Packed { low: f64, step: f64, count: usize, data: String },
}

impl Default for Values {
    fn default() -> Self {
        Self::List(Vec::new())
    }
}

impl Values {
    /// Packs a long series, to 1/65534 of its range.
    pub(crate) fn pack(values: &[f64]) -> Self {
        let finite = |x: &f64| x.is_finite().then_some(*x);
        if values.len() <= FEW {
            return Self::List(values.iter().map(finite).collect());
        }
        let ends = values.iter().filter_map(finite);
        let (low, high) =
            ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let step = if high > low { (high - low) / f64::from(MISSING - 1) } else { 1.0 };
        let (mut high_bytes, mut low_bytes) = (Vec::new(), Vec::new());
        let mut before = 0_u16;
        for x in values {
            let code = finite(x).map_or(MISSING, |x| ((x - low) / step).round() as u16);
            let [high, low] = code.wrapping_sub(before).to_be_bytes();
            high_bytes.push(high);
            low_bytes.push(low);
            before = code;
        }
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
        let packed = encoder
            .write_all(&high_bytes)
            .and_then(|()| encoder.write_all(&low_bytes))
            .and_then(|()| encoder.finish())
            .expect("memory takes what is written to it");
        let low = if low.is_finite() { low } else { 0.0 };
        Self::Packed { low, step, count: values.len(), data: STANDARD.encode(packed) }
    }

    /// Packs instants, to a tenth of the shortest step or better.
    pub(crate) fn of_times(times: &[f64]) -> Self {
        let (&[from, ..], &[.., last]) = (times, times) else { return Self::default() };
        if times.len() <= FEW {
            return Self::pack(times);
        }
        let count = times.len();
        let step = (last - from) / (count - 1) as f64;
        let steps = times.iter().enumerate();
        let off: Vec<f64> = steps.map(|(k, t)| t - (from + k as f64 * step)).collect();
        let (low, high) = off.iter().fold((0.0_f64, 0.0_f64), |(l, h), &x| (l.min(x), h.max(x)));
        let shortest = times.windows(2).map(|pair| pair[1] - pair[0]).fold(step, f64::min);
        if high - low < 1e-3 * shortest {
            Self::Steps { from, step, count, off: None }
        } else if (high - low) / f64::from(MISSING) < 0.1 * shortest {
            Self::Steps { from, step, count, off: Some(Box::new(Self::pack(&off))) }
        } else {
            Self::List(times.iter().copied().map(Some).collect())
        }
    }
}

/// Reduction of the series of a record, common to all of them.
#[derive(Debug)]
pub(crate) struct Cut {
    /// Runs of samples without a gap.
    runs: Vec<Range<usize>>,
    /// Number of samples that are reduced to two points; 1 means no reduction.
    pub(crate) samples_a_part: usize,
    times: Vec<f64>,
}

impl Cut {
    pub(crate) fn new(times: &[f64]) -> Self {
        Self::to_points(times, MOST_POINTS)
    }

    pub(crate) fn to_points(times: &[f64], most: usize) -> Self {
        let samples_a_part = if times.len() <= most { 1 } else { (2 * times.len()).div_ceil(most) };
        let mut cut = Self { runs: runs(times), samples_a_part, times: Vec::new() };
        cut.times = cut.points(|part, points| {
            let first = times[part.start];
            let middle = times[part.start + part.len() / 2];
            points.push(first);
            if part.len() > 1 {
                points.push(middle);
            }
        });
        // In a gap, where a line breaks, an instant has no value.
        let at_gaps = cut.times.iter().enumerate().filter(|(_, t)| t.is_nan()).map(|(k, _)| k);
        for k in at_gaps.collect::<Vec<_>>() {
            cut.times[k] = 0.5 * (cut.times[k - 1] + cut.times[k + 1]);
        }
        cut
    }

    /// Returns the points of every part, with a missing number between runs.
    fn points(&self, mut give: impl FnMut(Range<usize>, &mut Vec<f64>)) -> Vec<f64> {
        let mut points = Vec::new();
        for (k, run) in self.runs.iter().enumerate() {
            if k > 0 {
                points.push(f64::NAN);
            }
            let mut start = run.start;
            while start < run.end {
                let end = run.end.min(start + self.samples_a_part);
                give(start..end, &mut points);
                start = end;
            }
        }
        points
    }

    /// Returns the instants of the points.
    pub(crate) fn times(&self) -> Values {
        Values::of_times(&self.times)
    }

    /// Returns the points of a series: minimum and maximum of each part, in their order.
    pub(crate) fn pack(&self, values: &[f64]) -> Values {
        Values::pack(&self.thinned(values))
    }

    fn thinned(&self, values: &[f64]) -> Vec<f64> {
        self.points(|part, points| {
            let part = &values[part];
            let by_value = |a: &usize, b: &usize| part[*a].total_cmp(&part[*b]);
            let least = (0..part.len()).min_by(by_value).unwrap_or_default();
            let greatest = (0..part.len()).max_by(by_value).unwrap_or_default();
            points.push(part[least.min(greatest)]);
            if part.len() > 1 {
                points.push(part[least.max(greatest)]);
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    /// Unpacks values as the page's script does.
    fn unpacked(values: &Values) -> Vec<f64> {
        match values {
            Values::List(list) => list.iter().map(|x| x.unwrap_or(f64::NAN)).collect(),
            Values::Steps { from, step, count, off } => {
                let off = off.as_ref().map_or_else(|| vec![0.0; *count], |off| unpacked(off));
                off.iter().enumerate().map(|(k, off)| from + k as f64 * step + off).collect()
            }
            Values::Packed { low, step, count, data } => {
                let packed = STANDARD.decode(data).expect("base 64");
                let mut bytes = Vec::new();
                flate2::read::DeflateDecoder::new(&*packed)
                    .read_to_end(&mut bytes)
                    .expect("deflated");
                let mut code = 0_u16;
                let mut next = |k: usize| {
                    code = code.wrapping_add(u16::from_be_bytes([bytes[k], bytes[count + k]]));
                    if code == MISSING { f64::NAN } else { low + step * f64::from(code) }
                };
                (0..*count).map(&mut next).collect()
            }
        }
    }

    #[test]
    fn many_numbers_come_back_to_a_part_of_their_range() {
        let mut values: Vec<f64> = (0..1000).map(|k| -3.0 + (0.1 * f64::from(k)).sin()).collect();
        values[500] = f64::NAN;
        let back = unpacked(&Values::pack(&values));
        assert_eq!(back.len(), 1000);
        for (x, y) in values.iter().zip(&back) {
            assert!((x - y).abs() <= 2.0 / 65534.0 || (x.is_nan() && y.is_nan()), "{x} {y}");
        }
    }

    #[test]
    fn a_constant_and_nothing_but_gaps_survive() {
        assert_eq!(unpacked(&Values::pack(&[4.5; 100])), [4.5; 100]);
        assert!(unpacked(&Values::pack(&[f64::NAN; 100])).iter().all(|x| x.is_nan()));
        assert_eq!(Values::pack(&[]), Values::List(Vec::new()));
    }

    #[test]
    fn lines_break_at_gaps() {
        let cut = Cut::new(&[0.0, 1.0, 2.0, 50.0, 51.0]);
        assert_eq!(unpacked(&cut.times()), [0.0, 1.0, 2.0, 26.0, 50.0, 51.0]);
        let values = unpacked(&cut.pack(&[1.0, 2.0, 3.0, 4.0, 5.0]));
        assert!(values[3].is_nan());
        assert_eq!((&values[..3], &values[4..]), (&[1.0, 2.0, 3.0][..], &[4.0, 5.0][..]));
    }

    #[test]
    fn peaks_of_one_sample_survive_the_cut() {
        let times: Vec<f64> = (0..10_000).map(|k| 0.1 * f64::from(k)).collect();
        let mut values = vec![0.0; 10_000];
        values[777] = 9.0;
        values[4321] = -7.0;
        let cut = Cut::to_points(&times, 1000);
        let (x, y) = (unpacked(&cut.times()), cut.thinned(&values));
        assert_eq!(x.len(), y.len());
        assert!(x.len() <= 1000 && cut.samples_a_part == 20);
        assert!(x.windows(2).all(|pair| pair[0] < pair[1]));
        for (peak, at) in [(9.0, 77.7), (-7.0, 432.1)] {
            let k = y.iter().position(|&y| y == peak).expect("the peak is there");
            assert!((x[k] - at).abs() <= 2.0, "{peak} at {}", x[k]);
        }
    }

    #[test]
    fn equal_steps_are_recognised() {
        let times: Vec<f64> = (0..4800).map(|k| 1.7e9 + 0.1 * f64::from(k)).collect();
        let Values::Steps { from, step, count, off: None } = Cut::new(&times).times() else {
            panic!("steps are equal")
        };
        assert_eq!((from, count), (1.7e9, 4800));
        assert!((step - 0.1).abs() < 1e-6);
    }

    #[test]
    fn unequal_steps_keep_their_order() {
        let jitter = |k: u32| 0.1 * f64::from(k) + 0.04 * (7.0 * f64::from(k)).sin();
        let times: Vec<f64> = (0..4800).map(jitter).collect();
        let packed = Cut::new(&times).times();
        assert!(matches!(packed, Values::Steps { off: Some(_), .. }));
        let back = unpacked(&packed);
        assert!(back.iter().zip(&times).all(|(a, b)| (a - b).abs() < 2e-3));
        assert!(back.windows(2).all(|pair| pair[0] < pair[1]));

        let bursts: Vec<f64> =
            (0..200).map(|k| f64::from(k) * 1e-6 + f64::from(k / 100) * 1e4).collect();
        assert!(matches!(Values::of_times(&bursts), Values::List(_)));
    }
}
