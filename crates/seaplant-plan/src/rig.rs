//! Thrusters: allocation of a wrench, and inputs for a thrust.

use nalgebra::{DMatrix, DVector, Vector6};
use seaplant::exchange::PlantModel;
use seaplant::{Dof, Thruster, ThrusterInput};

use crate::Error;

/// Thrusters of a plant with their greatest thrusts.
#[derive(Clone, Debug)]
pub(crate) struct Rig {
    pub(crate) thrusters: Vec<Thruster>,
    /// The wrench of one newton of each, shape (6, n).
    pub(crate) wrenches: DMatrix<f64>,
    /// The thrusts of one newton or newton metre on each axis, shape (n, 6).
    pub(crate) share: DMatrix<f64>,
    /// The greatest allowed thrust in reverse and ahead, N.
    pub(crate) allowed: Vec<[f64; 2]>,
    /// Thrusts that cancel on all axes, as columns of unit maximum; most vehicles have none.
    pub(crate) cancelling: Vec<DVector<f64>>,
    /// The greatest force each way on every axis by itself; zero for axes without thrust.
    pub(crate) most: [f64; 6],
    /// Time constant of the thrusters, s.
    pub(crate) lag_s: f64,
    /// Delay of the thrusters, s.
    pub(crate) delay_s: f64,
    /// Ratio of reverse thrust to the curves.
    pub(crate) reverse_ratio: f64,
}

/// Relative singular values below this count as zero.
const RANK: f64 = 1e-6;

/// Relative accuracy to which a wrench must be produced.
const PUSHED: f64 = 1e-3;

impl Rig {
    /// Collects the thrusters of a plant; `full_input` ends curves that state no end, from neutral
    /// in their own unit.
    pub(crate) fn new(
        model: &PlantModel,
        thrust_part: f64,
        full_input: Option<f64>,
    ) -> Result<Self, Error> {
        let thrusters = model.thrusters.clone();
        if thrusters.is_empty() {
            return Err(Error::NoMotion {
                reason: format!(
                    "`{}` has no thrusters with a known curve; add [[thruster]] with position, direction and curve",
                    model.name
                ),
            });
        }
        let ends = |thruster: &Thruster| {
            let by_input = full_input.map(|full| {
                let still = thruster.curve.neutral();
                [still - full, still + full].map(|input| thruster.curve.force(input, None))
            });
            model.thrust_limits(thruster).or(by_input).ok_or_else(|| Error::FullInput {
                name: thruster.name.clone(),
                unit: thruster.curve.input().unit(),
            })
        };
        let full = thrusters.iter().map(ends).collect::<Result<Vec<_>, _>>()?;
        let allowed: Vec<[f64; 2]> =
            full.iter().map(|ends| ends.map(|end| thrust_part * end)).collect();
        let n = thrusters.len();
        let wrenches = DMatrix::from_fn(6, n, |axis, k| thrusters[k].unit_wrench()[axis]);
        // Thrusters do not act on axes that the plant lacks: the hull holds them.
        let own = |axis: usize| model.plant.axes().iter().any(|dof| dof.index() == axis);
        let of_plant =
            DMatrix::from_fn(6, n, |axis, k| if own(axis) { wrenches[(axis, k)] } else { 0.0 });
        let share = of_plant.clone().pseudo_inverse(RANK * of_plant.amax().max(f64::MIN_POSITIVE));
        let share = share.map_err(|reason| Error::NoMotion { reason: reason.to_owned() })?;
        let most = std::array::from_fn(|axis| greatest(&of_plant, &share, &allowed, axis));
        if most.iter().all(|force| *force == 0.0) {
            let reason = format!(
                "the thrusters of `{}` push none of its axes by itself; check their positions and directions",
                model.name
            );
            return Err(Error::NoMotion { reason });
        }
        let cancelling = null_space(&of_plant);
        let actuation = || model.actuation.values();
        let greatest_of = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let lags = actuation().flat_map(|own| own.lag.iter().chain(own.lag_of.values()));
        let lag_s = greatest_of(&mut lags.map(|lag| lag.value));
        let delay_s = greatest_of(&mut actuation().filter_map(|a| Some(a.delay.as_ref()?.value)));
        let ratio = actuation().find_map(|a| Some(a.reverse_ratio.as_ref()?.value));
        let reverse_ratio = ratio.unwrap_or(1.0);
        Ok(Self {
            thrusters,
            wrenches,
            share,
            allowed,
            cancelling,
            most,
            lag_s,
            delay_s,
            reverse_ratio,
        })
    }

    /// Iterates over the axes with thrust.
    pub(crate) fn pushed(&self) -> impl Iterator<Item = Dof> + '_ {
        Dof::ALL.into_iter().filter(|dof| self.most[dof.index()] > 0.0)
    }

    /// Returns the thrusts of the controller and as much of an excitation as the thrusters can add,
    /// N.
    pub(crate) fn thrusts(&self, hold: &Vector6<f64>, excited: &DVector<f64>) -> DVector<f64> {
        let held = &self.share * hold;
        let room = |k: usize, x: f64| self.allowed[k][usize::from(x > 0.0)].abs();
        let part = |of: &DVector<f64>, left: &dyn Fn(usize, f64) -> f64| {
            let parts = of.iter().enumerate().filter(|(_, x)| **x != 0.0);
            parts.map(|(k, x)| left(k, *x) / x.abs()).fold(1.0, f64::min).max(0.0)
        };
        let held = &held * part(&held, &room);
        let left = |k: usize, x: f64| room(k, x) - held[k] * x.signum();
        &held + excited * part(excited, &left)
    }

    /// Returns the input for a thrust, in the unit of the curve.
    pub(crate) fn input(&self, k: usize, thrust: f64) -> f64 {
        let curve = &self.thrusters[k].curve;
        // A thrust beyond the curve is never allowed.
        curve.input_for(thrust, None).unwrap_or_else(|| curve.neutral())
    }

    /// Returns the wrench of some inputs, including the dynamics of the thrusters, N and N m.
    pub(crate) fn wrench(&self, inputs: &[f64]) -> Vector6<f64> {
        let mut wrench = Vector6::zeros();
        for (k, (thruster, input)) in self.thrusters.iter().zip(inputs).enumerate() {
            let thrust = thruster.curve.force(*input, None);
            let thrust = if thrust < 0.0 { self.reverse_ratio * thrust } else { thrust };
            wrench += self.wrenches.fixed_view::<6, 1>(0, k) * thrust;
        }
        wrench
    }

    /// Returns true if every thruster takes a command from −1 to 1 or a pulse width.
    pub(crate) fn takes_servo_output(&self) -> bool {
        let servo = [ThrusterInput::Command, ThrusterInput::Pwm];
        self.thrusters.iter().all(|thruster| servo.contains(&thruster.curve.input()))
    }
}

/// Returns the greatest force each way on an axis and no other; zero if it is impossible.
fn greatest(
    wrenches: &DMatrix<f64>,
    share: &DMatrix<f64>,
    allowed: &[[f64; 2]],
    axis: usize,
) -> f64 {
    let thrusts = share.column(axis);
    let made = wrenches * thrusts;
    if (made[axis] - 1.0).abs() > PUSHED {
        return 0.0;
    }
    let weakest = |ends: &[f64; 2]| ends[0].abs().min(ends[1].abs());
    let each = thrusts.iter().zip(allowed).filter(|(x, _)| x.abs() > PUSHED * thrusts.amax());
    each.map(|(x, ends)| weakest(ends) / x.abs()).fold(f64::INFINITY, f64::min)
}

/// Returns thrusts without a wrench: eigenvectors of WᵀW with eigenvalue zero.
fn null_space(wrenches: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let eigen = (wrenches.transpose() * wrenches).symmetric_eigen();
    let top = eigen.eigenvalues.amax();
    let is_none = |k: &usize| eigen.eigenvalues[*k] < RANK * top;
    let unit = |k: usize| {
        let column = eigen.eigenvectors.column(k).into_owned();
        let largest = column[column.iamax()];
        column / largest
    };
    (0..wrenches.ncols()).filter(is_none).map(unit).collect()
}
