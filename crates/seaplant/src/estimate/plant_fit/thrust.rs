//! What a plant is off by where the scale of thrust is not known for sure.

use nalgebra::{DMatrix, DVector};

use super::filter::Slope;
use super::problem::Problem;
use super::uncertainty::inverse;
use super::{Actuator, Fitted, PlantFit};
use crate::caveat::spoken;
use crate::estimate::propellers::LOST_BETWEEN_SAMPLES;
use crate::plant::{Basis, Plant};
use crate::{Caveat, CaveatCode, Dof, Error, ThrustUncertainty};

/// A way in which thrust may be off, by a standard deviation: parts of it, forward and in reverse.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Off {
    forward: f64,
    reverse: f64,
}

/// A number of the actuator that is not fitted.
#[derive(Clone, Debug)]
pub(super) struct Unseen {
    /// What it is likeliest to be beyond what it is taken for, and the variance of that.
    pub(super) x: f64,
    pub(super) variance: f64,
    /// What coefficients move by for each unit of it, with the opposite sign.
    pub(super) by: DVector<f64>,
}

impl Unseen {
    /// The root of the second moment of what it may be.
    fn size(&self) -> f64 {
        (self.x * self.x + self.variance).sqrt()
    }

    /// The covariance of the coefficients that comes of it: the second moment of what they may be off by.
    pub(super) fn covariance(&self) -> DMatrix<f64> {
        let by = self.size() * &self.by;
        &by * by.transpose()
    }

    /// As results have it, of a plant with these coefficients.
    pub(super) fn of(&self, plant: &Plant) -> UnseenExponent {
        let terms = plant.structure().terms().iter().zip(plant.coefficients()).zip(self.by.iter());
        let masses = terms.filter(|((term, _), _)| matches!(term, Basis::Mass(i, j) if i == j));
        let parts = masses.map(|((_, mass), by)| (self.size() * by / mass).abs());
        let part = parts.fold(0.0, f64::max);
        UnseenExponent { exponent: 2.0 + self.x, std: self.variance.sqrt(), part }
    }
}

/// An exponent of thrust over propeller speed for which the trials speak, but too little for it to be fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnseenExponent {
    /// What is likeliest.
    pub exponent: f64,
    /// Its standard deviation.
    pub std: f64,
    /// The greatest part of a mass that it moves, by the root of its second moment about 2.
    pub part: f64,
}

impl Problem {
    /// What is left of the information on a number of the actuator beside all that is fitted, which moves by the second
    /// for each unit of it, with the opposite sign.
    fn left_of(
        &self,
        all: &DMatrix<f64>,
        covariance: &DMatrix<f64>,
        number: usize,
    ) -> (f64, DVector<f64>) {
        let p = self.structure.terms().len();
        let mut cross = all.column(p + number).into_owned();
        let kept = self.fits.iter().enumerate().filter(|(_, fits)| !**fits);
        kept.for_each(|(k, _)| cross[p + k] = 0.0);
        let moves = covariance * &cross;
        (all[(p + number, p + number)] - cross.dot(&moves), moves)
    }
}

impl Fitted {
    /// The covariance of the coefficients that comes of thrust whose scale is not known for sure:
    /// `Σ δδᵀ`, with δ what the optimum moves by; a part of θ itself where nothing else tells the scale.
    ///
    /// Residuals e stay as they are where force and all that a plant makes of it are as many times
    /// larger: `∂e/∂ln(scale) = −Σ θ ∂e/∂θ`, so that δ = C J θ, with J the information by all numbers
    /// and C the covariance of those that are fitted.
    pub(super) fn thrust_covariance(&self) -> Result<DMatrix<f64>, Error> {
        let (problem, point) = (&self.problem, &self.optimum.point);
        let p = problem.structure.terms().len();
        let mut sum = DMatrix::zeros(p, p);
        let of_curves = problem.thrust_uncertainty;
        let actuator = point.actuator;
        let loads = problem.schedules.iter().map(|own| actuator.under_mean_load(&own.thrust).abs());
        let loaded = loads.fold(0.0, f64::max);
        let off_by = [
            actuator.greatest_from_mean(),
            actuator.at_half_speed(),
            actuator.at_greatest_voltage(),
            loaded,
        ];
        if of_curves == ThrustUncertainty::default() && off_by == [0.0; 4] {
            return Ok(sum);
        }
        let Some(Slope { information: all, .. }) = problem.slope_of_all(point) else {
            return Ok(sum);
        };
        let covariance = inverse(&self.optimum.information);
        let ratio = p + Actuator::REVERSE;
        let ratio_variance = match problem.fits[Actuator::REVERSE] {
            true => f64::INFINITY,
            false => {
                let (left, _) = problem.left_of(&all, &covariance, Actuator::REVERSE);
                1.0 / left.max(f64::MIN_POSITIVE)
            }
        };
        let is_told = problem.fits[Actuator::SCALE];
        // Anywhere between right and as far off as that.
        let evenly = off_by.map(|greatest| greatest / 3_f64.sqrt());
        let ways = ways(of_curves, ratio_variance, is_told)
            .into_iter()
            .chain(evenly.map(|part| Off { forward: part, reverse: part }));
        let moves = covariance * &all;
        let plant = problem.plant(&point.free)?;
        for Off { forward, reverse } in ways {
            let mut looks_like = DVector::zeros(all.nrows());
            let terms = problem.structure.terms().iter().zip(plant.coefficients());
            for (x, (term, coefficient)) in looks_like.iter_mut().zip(terms) {
                // A gain scales thrust whatever that is.
                let is_gain = problem.structure.prior_std(term).is_some();
                *x = if is_gain { 0.0 } else { forward * coefficient };
            }
            looks_like[ratio] = forward - reverse;
            let mut by = (&moves * looks_like).rows(0, p).into_owned();
            for (x, term) in by.iter_mut().zip(problem.structure.terms()) {
                *x = if problem.structure.held(term).is_some() { 0.0 } else { *x };
            }
            sum += &by * by.transpose();
        }
        Ok(sum)
    }
}

impl Fitted {
    /// An exponent of thrust for which the trials speak, but too little for it to be fitted; `colour` is how many times
    /// larger coloured innovations make its variance.
    ///
    /// Beside all that is fitted the exponent is 2 + x with a variance v:
    ///
    /// ```text
    /// v = 1/(J_xx − J_xθ C J_θx + σ₀⁻²),   x = −v (g_x − J_xθ C g_θ),   δθ = −C J_θx x
    /// ```
    pub(super) fn unseen_exponent(&self, colour: f64) -> Option<Unseen> {
        const K: usize = Actuator::EXPONENT;
        let (problem, optimum) = (&self.problem, &self.optimum);
        if !problem.can_show[K] || problem.fits[K] {
            return None;
        }
        let p = problem.structure.terms().len();
        let Slope { information, gradient, .. } = problem.slope_of_all(&optimum.point)?;
        let covariance = inverse(&optimum.information);
        let (left, moves) = problem.left_of(&information, &covariance, K);
        let variance = 1.0 / (left.max(0.0) / colour + Actuator::PRIOR_STD[K].powi(-2));
        let (least, most) = Actuator::LIMITS[K];
        let x = -(gradient[p + K] - moves.dot(&gradient)) * variance / colour;
        if x * x < SPEAKS * variance {
            return None;
        }
        let mut by = moves.rows(0, p).into_owned();
        for (by, term) in by.iter_mut().zip(problem.structure.terms()) {
            *by = if problem.structure.held(term).is_some() { 0.0 } else { *by };
        }
        Some(Unseen { x: x.clamp(least, most), variance, by })
    }

    /// The covariance of the coefficients that comes of what cubics lose of thrust between its samples: mass and drag of
    /// an axis are too small by the same part, and a short lag may stand for it.
    pub(super) fn lost_between_samples(&self) -> Result<DMatrix<f64>, Error> {
        let (problem, point) = (&self.problem, &self.optimum.point);
        let (structure, plant) = (&problem.structure, problem.plant(&point.free)?);
        let p = structure.terms().len();
        let mut sum = DMatrix::zeros(p, p);
        if !point.actuator.is_smooth() {
            return Ok(sum);
        }
        for (dof, beyond) in structure.axes().iter().zip(&problem.beyond_neighbours) {
            let lost = LOST_BETWEEN_SAMPLES * beyond.powi(2);
            let terms = structure.terms().iter().zip(plant.coefficients());
            let by = terms.map(|(term, coefficient)| {
                let is_gain = structure.prior_std(term).is_some();
                let is_held = structure.held(term).is_some();
                let is_of_axis = structure.axes_of(term).contains(dof);
                if is_of_axis && !is_gain && !is_held { lost * coefficient } else { 0.0 }
            });
            let by = DVector::from_iterator(p, by);
            sum += &by * by.transpose();
        }
        // A lag takes from quick thrust, so from mass. Without it mass would be another by C[m, T] T / C[T, T].
        let (lag, lag_s) = (p + Actuator::LAG, point.actuator.lag_s);
        let is_short = lag_s < SHORT_LAG_PERIODS * problem.slow_period_s;
        if problem.fits[Actuator::LAG] && is_short {
            let covariance = inverse(&self.optimum.information);
            let by = DVector::from_fn(p, |k, _| {
                let term = &structure.terms()[k];
                let is_moved = matches!(term, Basis::Mass(..)) && structure.held(term).is_none();
                if is_moved { lag_s * covariance[(k, lag)] / covariance[(lag, lag)] } else { 0.0 }
            });
            sum += &by * by.transpose();
        }
        Ok(sum)
    }
}

/// A lag shorter than this part of the time between samples is as short as what cubics lose.
const SHORT_LAG_PERIODS: f64 = 0.25;

/// Thrust that is further from its neighbours is unknown between its samples: 1 − cos ωT of a sinusoid that is
/// sampled five times a period.
const RESTLESS: f64 = 0.7;

/// Returns a caveat if thrust that moves between its samples changes too much there.
pub(crate) fn restless_thrust(dof: Dof, beyond: f64) -> Option<Caveat> {
    (beyond > RESTLESS).then(|| {
        let message = format!(
            "thrust in {dof} changes so much between its samples that mass and drag are not known: a sample is {:.0} % of the thrust away from the mean of those before and after; log the thrusters faster, or move them more slowly",
            100.0 * beyond
        );
        Caveat::warning(CaveatCode::NotDetermined, message)
    })
}

/// A change of thrust from the mean to the greatest supply voltage above this part is a warning.
const VOLTAGE_PART: f64 = 0.05;

/// What another power of speed makes of thrust at half of full speed is told if it is more than this.
const ANOTHER_POWER_PERCENT: f64 = 1.0;

/// The trials speak for a number if its square is so many times its variance: chance makes as much once in twenty.
const SPEAKS: f64 = 4.0;

/// An exponent that is not fitted is told if it moves a mass by more than this part.
const UNSEEN_PART: f64 = 0.01;

impl PlantFit {
    /// Returns caveats on thrust that is no square law, so that its scale depends on the speed at which its curve is right,
    /// or that may be none.
    pub(crate) fn thrust_by_another_power(&self) -> Vec<Caveat> {
        let [exponent_std, dead_band_std] =
            [Actuator::EXPONENT, Actuator::DEAD_BAND].map(|k| self.actuator_std[k]);
        let (beyond_square, dead_band) = (self.actuator.beyond_square, self.actuator.dead_band);
        let at_half = 100.0 * self.actuator.at_half_speed().exp_m1();
        let exponent = exponent_std.map(|_| {
            let power = 2.0 + beyond_square;
            format!(
                "thrust grows with the power {power:.2} of propeller speed, while its curve says 2"
            )
        });
        let still = dead_band_std.map(|std| {
            let [part, half] = [dead_band, 1.96 * std].map(|x| spoken(100.0 * x));
            format!(
                "thrusters do not turn below {part} ± {half} % of their greatest speed or command, which their curve does not say"
            )
        });
        let unseen = self.unseen_exponent.filter(|unseen| unseen.part > UNSEEN_PART);
        let unseen = unseen.map(|unseen| {
            let message = format!(
                "the trials speak for thrust that grows with the power {:.2} ± {:.2} of propeller speed, where its curve says 2, but not clearly: that moves masses by up to {:.1} %, which the intervals include; measure thrust at several speeds and give it as a table, or drive longer at several speeds",
                unseen.exponent,
                1.96 * unseen.std,
                100.0 * unseen.part
            );
            Caveat::note(CaveatCode::ThrustScale, message)
        });
        let law = exponent.or(still).filter(|_| at_half > ANOTHER_POWER_PERCENT);
        let seen = law.map(|law| {
            let message = format!(
                "{law}: the curve is taken to be right at the greatest speed of the trials; if it is right at half of that, every mass, drag and lever is {at_half:.0} % off, which the intervals include; measure thrust at several speeds and give it as a table"
            );
            Caveat::warning(CaveatCode::ThrustScale, message)
        });
        seen.into_iter().chain(unseen).collect()
    }

    /// Returns a caveat if thrust changes in the course of the trials, so that its scale depends on when its curve is right.
    pub(crate) fn thrust_that_changes(&self) -> Option<Caveat> {
        let std = [Actuator::CHANGE_WITHIN, Actuator::CHANGE_BETWEEN].map(|k| self.actuator_std[k]);
        changing_thrust(&self.actuator, std)
    }

    /// Returns a caveat if thrust changes with supply voltage, so that its scale depends on the voltage at which
    /// curves are right.
    pub(crate) fn thrust_by_voltage(&self) -> Option<Caveat> {
        let (actuator, std) = (&self.actuator, self.actuator_std[Actuator::VOLTAGE]?);
        let [mean, greatest] = actuator.ln_voltage;
        let off = (actuator.voltage_exponent * (greatest - mean)).exp_m1();
        let scale = match mean < greatest {
            true => format!(
                "; mass and drag are right if the thruster curves hold at {} V, the mean of the trials; if they hold at {} V, the greatest, mass and drag are {:.0} % too {}, which the intervals include; state the voltage of the curves (`voltage_v`), or give curves of several voltages",
                spoken(mean.exp()),
                spoken(greatest.exp()),
                100.0 * off.abs(),
                if off < 0.0 { "small" } else { "large" },
            ),
            false => String::new(),
        };
        let message = format!(
            "thrust changes with the supply voltage, in proportion to its power {:.2} ± {:.2}; this was allowed for{scale}",
            actuator.voltage_exponent,
            1.96 * std,
        );
        Some(match off.abs() > VOLTAGE_PART {
            true => Caveat::warning(CaveatCode::ThrustScale, message),
            false => Caveat::note(CaveatCode::ThrustScale, message),
        })
    }
}

/// Says that thrust changes from the beginning of a trial to its end, or from the first trial to the last,
/// so that its scale depends on when its curve is right.
fn changing_thrust(
    actuator: &Actuator,
    [within_std, between_std]: [Option<f64>; 2],
) -> Option<Caveat> {
    let Actuator { log_change_within, log_change_between, .. } = *actuator;
    let of = |change: f64, std: Option<f64>, over: &str| {
        let said = format!(
            "by {:+.1} ± {:.1} % {over}",
            100.0 * change.exp_m1(),
            196.0 * std? * change.exp()
        );
        Some((change, said))
    };
    let found: Vec<(f64, String)> = [
        of(log_change_within, within_std, "from the beginning to the end of each trial"),
        of(log_change_between, between_std, "from the first trial to the last"),
    ]
    .into_iter()
    .flatten()
    .collect();
    let said: Vec<&str> = found.iter().map(|(_, said)| said.as_str()).collect();
    let all: f64 = found.iter().map(|(change, _)| change).sum();
    let to_mean = 0.5 * all;
    let each = found.iter().map(|(change, _)| *change);
    each.chain([all]).any(|change| change.exp_m1().abs() > CHANGING_PART).then(|| {
        let message = format!(
            "thrust changes {} beside what its log says, as with a battery that loses voltage; mass and drag are right if the thruster curve holds for the mean; if it holds at the beginning, they are {:+.0} % off, which the intervals include; log the voltage or the propeller speed",
            said.join(" and "),
            100.0 * (-to_mean).exp_m1(),
        );
        Caveat::warning(CaveatCode::PlantDrifts, message)
    })
}

/// A change of thrust below this part, in a trial, between trials or in both together, is none that a
/// user minds.
const CHANGING_PART: f64 = 0.05;

/// How thrust is off: both ways, or where known forces tell the scale of all, in reverse beside forward.
fn ways(stated: ThrustUncertainty, ratio_variance: f64, is_scale_told: bool) -> [Off; 2] {
    if !is_scale_told {
        return both_ways(stated, ratio_variance);
    }
    let of_ratio = stated.forward.powi(2) + stated.reverse.powi(2);
    let left = match ratio_variance {
        variance if variance.is_finite() => of_ratio * variance / (of_ratio + variance),
        _ => of_ratio,
    };
    let sure = Off { forward: 0.0, reverse: 0.0 };
    [Off { reverse: left.max(0.0).sqrt(), ..sure }, sure]
}

/// How both ways are off, in two independent ways: if motion tells their ratio, they are off together.
///
/// With P what is stated of them and r the variance of the ratio, `P − P h hᵀ P / (hᵀ P h + r)` and
/// `h = (−1, 1)`.
fn both_ways(stated: ThrustUncertainty, ratio_variance: f64) -> [Off; 2] {
    let [forward, reverse] = [stated.forward, stated.reverse].map(|std| std * std);
    let told = 1.0 / (forward + reverse + ratio_variance);
    let first = (forward - forward * forward * told).max(0.0).sqrt();
    let along = if first > 0.0 { forward * reverse * told / first } else { 0.0 };
    let second = (reverse - reverse * reverse * told - along * along).max(0.0).sqrt();
    [Off { forward: first, reverse: along }, Off { forward: 0.0, reverse: second }]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two small changes of the same sign leave the scale as open as a large one.
    #[test]
    fn thrust_that_changes_is_told_by_what_it_changes_in_all() {
        let told = |log_change_within: f64, log_change_between: f64| {
            let actuator =
                Actuator { log_change_within, log_change_between, ..Actuator::default() };
            changing_thrust(&actuator, [Some(0.001); 2])
        };
        assert_eq!(told(-0.03, -0.01), None);
        assert_eq!(told(-0.03, 0.03), None);
        let caveat = told(-0.04, -0.04).expect("eight percent");
        assert!(caveat.message.contains("they are +4 % off"), "{}", caveat.message);
        assert!(told(0.08, -0.08).is_some());
        let actuator = Actuator { log_change_within: -0.2, ..Actuator::default() };
        assert_eq!(changing_thrust(&actuator, [None; 2]), None);
    }

    #[test]
    fn a_ratio_that_motion_tells_ties_both_ways_together() {
        let stated = ThrustUncertainty { forward: 0.05, reverse: 0.2 };
        let independent = both_ways(stated, f64::INFINITY);
        assert_eq!(independent[0], Off { forward: 0.05, reverse: 0.0 });
        assert!((independent[1].reverse - 0.2).abs() < 1e-15);
        let [both, rest] = both_ways(stated, 1e-12);
        let common = 1.0 / (1.0_f64 / 0.05_f64.powi(2) + 1.0 / 0.2_f64.powi(2)).sqrt();
        assert!((both.forward - common).abs() < 1e-9 && (both.reverse - common).abs() < 1e-9);
        assert!(rest.forward == 0.0 && rest.reverse < 1e-5);
        let sure = Off { forward: 0.0, reverse: 0.0 };
        assert_eq!(both_ways(ThrustUncertainty::default(), 1e-6), [sure; 2]);
    }
}
