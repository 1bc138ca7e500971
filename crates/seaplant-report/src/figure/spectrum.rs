//! Figure of excitation spectra and filter gains.

use std::ops::Range;

use seaplant::Method;
use seaplant::estimate::Filters;
use seaplant::results::{PlantResult, Results, SpectrumFigure};
use seaplant::signal::LowPass;
use seaplant::signal::Spectrum;

use super::axis::Axis;
use super::chart::{Frame, drawn, line, note, panel, stroke, titled};
use super::ink::Ink;
use super::scene::Scene;
use crate::number::significant;
use crate::{Error, words};

/// Highest frequency, Hz: no vehicle of a tonne responds above it.
const HIGHEST_HZ: f64 = 2.0;
/// Lowest frequency, Hz: below it the Hann window spreads the mean.
const LOWEST_HZ: f64 = 0.004;
/// Number of points of a gain curve.
const GAIN_POINTS: usize = 200;

/// Top of the panel.
const HIGHEST_PART: f64 = 1.12;

/// A filter whose gain is drawn.
pub(crate) struct Gain {
    pub(crate) ink: Ink,
    pub(crate) name: String,
    pub(crate) filter: LowPass,
}

/// Content of a figure of spectra.
pub(crate) struct View<'a> {
    /// Frequencies within the shown span.
    pub(crate) frequency_hz: &'a [f64],
    pub(crate) force: Amplitude<'a>,
    pub(crate) velocity: Amplitude<'a>,
    pub(crate) gains: Vec<Gain>,
    pub(crate) excited_hz: Option<f64>,
    /// Description in words and numbers.
    pub(crate) description: String,
}

/// Amplitudes within the shown span; borrowed, because spectra of long records are large.
pub(crate) struct Amplitude<'a> {
    pub(crate) values: &'a [f64],
    /// Greatest amplitude; 0 for a signal at rest.
    pub(crate) greatest: f64,
}

impl<'a> Amplitude<'a> {
    fn new(spectrum: &'a Spectrum, ends: &Range<f64>) -> Self {
        let values = &spectrum.amplitude[shown(&spectrum.frequency_hz, ends)];
        Self { values, greatest: greatest(&spectrum.amplitude) }
    }

    /// Returns an amplitude relative to the greatest.
    pub(crate) fn part(&self, amplitude: f64) -> f64 {
        if self.greatest > 0.0 { amplitude / self.greatest } else { 0.0 }
    }
}

/// Returns the range of ascending frequencies within a span.
fn shown(frequency_hz: &[f64], ends: &Range<f64>) -> Range<usize> {
    let from = frequency_hz.partition_point(|f| *f < ends.start);
    from..frequency_hz.partition_point(|f| *f < ends.end)
}

/// Returns the content of a figure as numbers.
pub(crate) fn view<'a>(figure: &'a SpectrumFigure, results: &Results) -> View<'a> {
    let (excited_hz, gains) = (excited_hz(figure, results), gains(figure, results));
    let ends = frequency_axis(figure).ends();
    View {
        frequency_hz: &figure.force.frequency_hz[shown(&figure.force.frequency_hz, &ends)],
        force: Amplitude::new(&figure.force, &ends),
        velocity: Amplitude::new(&figure.velocity, &ends),
        description: description(figure, excited_hz, &gains),
        gains,
        excited_hz,
    }
}

/// # Source
/// Draws [Jason2, §3]: the 1/8 Hz filter, against the frequencies of table 4.
pub(super) fn scene(figure: &SpectrumFigure, results: &Results) -> Result<Scene, Error> {
    let excited = excited_hz(figure, results);
    let gains = gains(figure, results);
    let name = words::capitalised(figure.dof.name());
    let title = format!("{name} · {} · spectrum of force and velocity", figure.trial);
    drawn((640, 330), title, description(figure, excited, &gains), |area, title| {
        let below = titled(area, title, &key(&gains, excited))?;
        let x = frequency_axis(figure);
        let ends = x.ends();
        let frame = Frame {
            x,
            y: Axis::between(0.0, HIGHEST_PART, 6),
            x_label: Some("frequency, Hz"),
            y_label: "gain; amplitude / greatest",
        };
        let mut chart = panel(&below, frame)?;
        if let Some(f) = excited.filter(|f| ends.contains(f)) {
            stroke(&mut chart, Ink::Excited, &[(f, 0.0), (f, HIGHEST_PART)])?;
            note(&mut chart, (f, HIGHEST_PART), &format!("{} Hz", significant(f, 3)))?;
        }
        for (ink, spectrum) in [(Ink::Force, &figure.force), (Ink::Velocity, &figure.velocity)] {
            let (f, part) = parts(spectrum, &ends);
            line(&mut chart, ink, &f, &part)?;
        }
        for gain in &gains {
            stroke(&mut chart, gain.ink, &gain.curve(&ends))?;
        }
        Ok(())
    })
}

fn key(gains: &[Gain], excited: Option<f64>) -> Vec<(Ink, &str)> {
    let mut key = vec![(Ink::Force, "force"), (Ink::Velocity, "velocity")];
    key.extend(gains.iter().map(|gain| (gain.ink, gain.name.as_str())));
    key.extend(excited.map(|_| (Ink::Excited, "excitation")));
    key
}

/// Returns relative amplitudes over a span of frequencies.
fn parts(spectrum: &Spectrum, ends: &Range<f64>) -> (Vec<f64>, Vec<f64>) {
    let amplitude = Amplitude::new(spectrum, ends);
    let parts = amplitude.values.iter().map(|value| amplitude.part(*value)).collect();
    (spectrum.frequency_hz[shown(&spectrum.frequency_hz, ends)].to_vec(), parts)
}

impl Gain {
    fn curve(&self, ends: &Range<f64>) -> Vec<(f64, f64)> {
        let ratio = ends.end / ends.start;
        (0..=GAIN_POINTS)
            .map(|k| ends.start * ratio.powf(k as f64 / GAIN_POINTS as f64))
            .map(|f| (f, self.filter.zero_phase_gain(f)))
            .collect()
    }
}

fn frequency_axis(figure: &SpectrumFigure) -> Axis {
    let highest = figure.force.frequency_hz.last().copied().filter(|f| *f > 10.0 * LOWEST_HZ);
    Axis::decades(LOWEST_HZ, highest.map_or(HIGHEST_HZ, |f| f.min(HIGHEST_HZ)))
}

fn excited_hz(figure: &SpectrumFigure, results: &Results) -> Option<f64> {
    let trial = results.trials.iter().find(|trial| trial.name == figure.trial)?;
    trial.axes.get(&figure.dof)?.dominant_hz
}

/// Returns the filter of the recommended method, or of equation error if that has none, and the
/// paper's.
fn gains(figure: &SpectrumFigure, results: &Results) -> Vec<Gain> {
    let of = |method| results.method_of(figure.dof, method);
    let filter = |plant: &PlantResult| {
        let Filters { velocity, every_term } = plant.alone.as_ref()?.regression.filters;
        every_term.or(velocity).map(|filter| (plant.method, filter))
    };
    let recommended = results.plant_of(figure.dof, None).ok();
    let recommended = recommended.filter(|plant| plant.method != Method::Paper);
    let equal = recommended.and_then(filter).or_else(|| of(Method::EquationError).and_then(filter));
    let paper = of(Method::Paper).and_then(filter);
    let equal = equal.map(|(method, filter)| Gain {
        ink: Ink::Gain,
        name: format!("gain, {}", words::method(method)),
        filter,
    });
    let paper = paper.map(|(_, filter)| Gain {
        ink: Ink::PaperGain,
        name: "gain, paper".to_owned(),
        filter,
    });
    equal.into_iter().chain(paper).collect()
}

fn greatest(amplitude: &[f64]) -> f64 {
    amplitude.iter().copied().filter(|a| a.is_finite()).fold(0.0, f64::max)
}

fn description(figure: &SpectrumFigure, excited: Option<f64>, gains: &[Gain]) -> String {
    let units = figure.dof.units();
    let mut text = format!(
        "Trial “{}”: amplitude of force (greatest {} {}) and of velocity (greatest {} {}), each divided by its greatest.",
        figure.trial,
        significant(greatest(&figure.force.amplitude), 3),
        units.force,
        significant(greatest(&figure.velocity.amplitude), 3),
        units.velocity,
    );
    let Some(f) = excited else { return text };
    text.push_str(&format!(" Force is greatest at {} Hz", significant(f, 3)));
    let passed: Vec<String> = gains
        .iter()
        .map(|gain| {
            format!(
                "{} {}",
                gain.name.replacen("gain, ", "", 1),
                significant(gain.filter.zero_phase_gain(f), 2)
            )
        })
        .collect();
    if passed.is_empty() {
        text.push('.');
    } else {
        text.push_str(&format!(", where the filters pass: {}.", passed.join(", ")));
    }
    text
}
