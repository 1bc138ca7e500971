//! Chart of excitation spectra and filter gains.

use seaplant::results::{Results, SpectrumFigure};

use super::motion::file;
use super::{Chart, Horizontal, Line, Panel, Subject, Values};
use crate::figure::{Amplitude, Ink, spectrum_view};
use crate::number::significant;

/// Number of frequencies: more than there are pixels across the page.
const MOST_POINTS: usize = 1500;

pub(super) fn chart(figure: &SpectrumFigure, results: &Results, id: String, stem: &str) -> Chart {
    let view = spectrum_view(figure, results);
    let bins = Bins::new(view.frequency_hz);
    let mut lines = vec![
        Line::new("force", Ink::Force, bins.greatest(&view.force)),
        Line::new("velocity", Ink::Velocity, bins.greatest(&view.velocity)),
    ];
    for gain in &view.gains {
        let y: Vec<f64> = bins.middle.iter().map(|f| gain.filter.zero_phase_gain(*f)).collect();
        lines.push(Line::new(gain.name.clone(), gain.ink, Values::pack(&y)));
    }
    let marks = view.excited_hz.map(|f| (f, format!("{} Hz", significant(f, 3))));
    Chart {
        subject: Subject::Spectrum,
        id,
        title: format!("{} · spectrum of force and velocity", figure.trial),
        description: view.description,
        files: ["svg", "png"].map(|kind| file(kind, stem)).to_vec(),
        plant: figure.dof.name().to_owned(),
        stills: vec![stem.to_owned()],
        x: Horizontal {
            label: "frequency".to_owned(),
            unit: "Hz",
            logarithmic: true,
            names: Vec::new(),
        },
        panels: vec![Panel {
            label: "Gain of filters; amplitude / greatest".to_owned(),
            height: 240,
            x: Values::List(bins.middle.iter().copied().map(Some).collect()),
            lines,
            marks: marks.into_iter().collect(),
            ..Panel::default()
        }],
    }
}

/// Frequencies in bins of equal ratio, for a logarithmic axis.
struct Bins {
    /// Index of the first frequency of each bin.
    starts: Vec<usize>,
    middle: Vec<f64>,
    count: usize,
}

impl Bins {
    /// Creates bins for ascending positive frequencies.
    fn new(frequency_hz: &[f64]) -> Self {
        let count = frequency_hz.len();
        let (&[first, ..], &[.., last]) = (frequency_hz, frequency_hz) else {
            return Self { starts: Vec::new(), middle: Vec::new(), count };
        };
        let part = |f: f64| ((f / first).ln() / (last / first).ln() * MOST_POINTS as f64) as usize;
        let is_new = |k: usize| k == 0 || part(frequency_hz[k]) != part(frequency_hz[k - 1]);
        let starts: Vec<usize> = (0..count).filter(|&k| is_new(k)).collect();
        let bins = Self { starts, middle: Vec::new(), count };
        let middle = bins.parts(frequency_hz).map(|part| part[part.len() / 2]).collect();
        Self { middle, ..bins }
    }

    fn parts<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = &'a [f64]> {
        let ends = self.starts.iter().skip(1).copied().chain([self.count]);
        self.starts.iter().zip(ends).map(|(start, end)| &values[*start..end])
    }

    /// Returns the greatest amplitude in each bin, so that a peak of one frequency survives.
    fn greatest(&self, amplitude: &Amplitude<'_>) -> Values {
        if amplitude.values.len() != self.count {
            // A trial too short for a spectrum.
            return Values::pack(&vec![f64::NAN; self.middle.len()]);
        }
        let greatest = |part: &[f64]| amplitude.part(part.iter().copied().fold(0.0, f64::max));
        Values::pack(&self.parts(amplitude.values).map(greatest).collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_spectra_are_thinned_and_keep_their_peaks() {
        let frequency_hz: Vec<f64> = (1..=400_000).map(|k| 5e-6 * f64::from(k)).collect();
        let mut amplitude = vec![0.1; 400_000];
        amplitude[314_159] = 1.0;
        let bins = Bins::new(&frequency_hz);
        assert!(bins.middle.len() <= MOST_POINTS + 1 && bins.middle.len() > MOST_POINTS / 3);
        assert!(bins.middle.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(bins.parts(&frequency_hz).map(<[f64]>::len).sum::<usize>(), 400_000);
        let k = bins.parts(&amplitude).position(|part| part.contains(&1.0)).expect("the peak");
        assert!((bins.middle[k] / frequency_hz[314_159] - 1.0).abs() < 0.01);
        assert!(
            matches!(bins.greatest(&Amplitude { values: &amplitude, greatest: 1.0 }), Values::Packed { count, .. } if count == bins.middle.len())
        );
    }

    #[test]
    fn few_frequencies_are_kept() {
        let bins = Bins::new(&[0.1, 0.2, 0.3]);
        assert_eq!(bins.middle, [0.1, 0.2, 0.3]);
        let nothing = Amplitude { values: &[], greatest: 0.0 };
        assert_eq!(Bins::new(&[]).greatest(&nothing), Values::List(Vec::new()));
        assert_eq!(bins.greatest(&nothing), Values::List(vec![None; 3]));
    }
}
