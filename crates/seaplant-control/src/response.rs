//! Responses of a closed loop, as curves with bands.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use seaplant::Dof;
use seaplant::plant::Plant;
use serde::{Deserialize, Serialize};

use crate::design::loop_of;
use crate::{Actuators, Controller, Design, Error, Gains, Path, Sea, track};

/// A curve with a band for the plant's uncertainty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Curve {
    /// With the estimated plant.
    pub estimate: Vec<f64>,
    /// The lower end of 95 % of the draws; empty without draws.
    pub low: Vec<f64>,
    /// The upper end; empty without draws.
    pub high: Vec<f64>,
}

/// Responses of the loop of one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Response {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// |L| of the open loop at rest.
    pub gain: Curve,
    /// Its phase, degrees.
    pub phase_deg: Curve,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// The reference step, m or rad.
    pub asked: Vec<f64>,
    /// The step response, with lag, delay and limits; none if the loop diverges.
    pub step: Option<Curve>,
}

/// Number of draws for simulated steps: a band of 95 % is defined by forty.
const STEPS: usize = 40;

/// Range of frequencies of a chart, relative to the bandwidth, up to half of the sampling rate.
const SPAN: (f64, f64) = (0.05, 20.0);
const FREQUENCIES: usize = 160;

/// Duration of a step response, as a multiple of 1/ω.
const TIMES: f64 = 14.0;

/// The size of a step, m and rad …
const SIZE: (f64, f64) = (0.5, 0.2);
/// … and the rate of the reference, as a multiple of ω.
const SUDDEN: f64 = 4.0;

/// Quantiles of draws at the ends of the band.
const BAND: (f64, f64) = (0.025, 0.975);

/// Computes the open loop over frequency, and a step in closed loop, of each controlled axis; bands
/// are those over `draws`.
///
/// # Errors
/// Those of [`track`] for the plant as estimated, other than a loop that runs away.
///
/// ```
/// use seaplant::Dof;
/// use seaplant::plant::{Plant, Structure, Symmetry};
/// use seaplant_control::{Actuators, Design, Law, Tuning, design, responses};
/// let plant = Plant::new(Structure::of(&[Dof::Surge], Symmetry::None)?, vec![100.0, 5.0, 20.0])?;
/// let asked = Design { law: Law::Pd, tuning: [(Dof::Surge, Tuning::new(0.1, 1.0))].into(), ..Design::default() };
/// let actuators = Actuators::default();
/// let gains = design(&plant, &[], &actuators, &asked)?;
/// let surge = &responses(&plant, &[], &actuators, &asked, &gains)?[&Dof::Surge];
/// let step = surge.step.as_ref().expect("stable");
/// assert!((step.estimate.last().expect("an end") - 0.5).abs() < 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn responses(
    plant: &Plant,
    draws: &[Plant],
    actuators: &Actuators,
    asked: &Design,
    gains: &Gains,
) -> Result<BTreeMap<Dof, Response>, Error> {
    let of = |dof: &Dof| Ok((*dof, response(plant, draws, actuators, asked, gains, *dof)?));
    gains.axes.keys().map(of).collect()
}

fn response(
    plant: &Plant,
    draws: &[Plant],
    actuators: &Actuators,
    asked: &Design,
    gains: &Gains,
    dof: Dof,
) -> Result<Response, Error> {
    let bandwidth_hz = gains.axes[&dof].bandwidth_hz;
    let highest = SPAN.1.min(0.5 * asked.sample_hz / bandwidth_hz);
    let ratio = (highest / SPAN.0).powf(1.0 / (FREQUENCIES - 1) as f64);
    let hz = |k: usize| bandwidth_hz * SPAN.0 * ratio.powi(k as i32);
    let frequency_hz: Vec<f64> = (0..FREQUENCIES).map(hz).collect();
    let of = |truth: &Plant| {
        loop_of(plant, truth, &gains.axes[&dof], asked, dof, 0.0).bode(&frequency_hz)
    };
    let (gain, phase): (Vec<_>, Vec<_>) = draws.iter().map(of).unzip();
    let own = of(plant);
    let step = |truth: &Plant| step(plant, truth, actuators, asked, gains, dof);
    let (time_s, wanted, stepped) = match step(plant) {
        Ok(found) => found,
        // A diverging loop: the chart shows the reference, and the notes explain.
        Err(Error::RunsAway) => (Vec::new(), Vec::new(), Vec::new()),
        Err(error) => return Err(error),
    };
    let others = draws.iter().take(STEPS).filter_map(|draw| Some(step(draw).ok()?.2)).collect();
    Ok(Response {
        frequency_hz,
        gain: Curve::new(own.0, gain),
        phase_deg: Curve::new(own.1, phase),
        step: (!time_s.is_empty()).then(|| Curve::new(stepped, others)),
        time_s,
        asked: wanted,
    })
}

/// Returns the duration of a step response, s.
pub(crate) fn duration_s(bandwidth_hz: f64) -> f64 {
    TIMES / (std::f64::consts::TAU * bandwidth_hz)
}

/// Times, reference and response.
type Stepped = (Vec<f64>, Vec<f64>, Vec<f64>);

fn step(
    plant: &Plant,
    truth: &Plant,
    actuators: &Actuators,
    asked: &Design,
    gains: &Gains,
    dof: Dof,
) -> Result<Stepped, Error> {
    let omega = std::f64::consts::TAU * gains.axes[&dof].bandwidth_hz;
    let size = if dof.is_rotation() { SIZE.1 } else { SIZE.0 };
    let path = Path::Step { size, rate: SUDDEN * omega };
    let mut controller = Controller::new(plant.clone(), gains.clone(), &asked.speed);
    let (paths, still) = ([(dof, path)].into(), Sea::default());
    let duration_s = duration_s(gains.axes[&dof].bandwidth_hz);
    let run = track(truth, &mut controller, actuators, &paths, &still, duration_s)?;
    let wanted: Vec<f64> = run.time_s.iter().map(|t| path.at(*t)[0]).collect();
    let reached = wanted.iter().zip(&run.error).map(|(x, e)| x + e[dof.index()]).collect();
    Ok((run.time_s, wanted, reached))
}

impl Curve {
    fn new(estimate: Vec<f64>, others: Vec<Vec<f64>>) -> Self {
        let (mut low, mut high) = (Vec::new(), Vec::new());
        if !others.is_empty() {
            for k in 0..estimate.len() {
                let mut at: Vec<f64> = others.iter().map(|other| other[k]).collect();
                at.sort_by(f64::total_cmp);
                let place = |part: f64| at[(part * (at.len() - 1) as f64).round() as usize];
                low.push(place(BAND.0));
                high.push(place(BAND.1));
            }
        }
        Self { estimate, low, high }
    }
}
