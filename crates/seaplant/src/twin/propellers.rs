//! The pair of propellers that drives a degree of freedom: speed and thrust.

use super::motion::STEP_S;
use super::random::{Streams, ornstein_uhlenbeck};
use super::vehicle::pair;
use super::{Disturbance, Plan, RPM, TICK_HZ, TwinSpec};
use crate::{QuadraticThrust, Vehicle};

/// Standard deviation of propeller speed, rad/s, and its correlation time, s.
const JITTER_RAD_S: f64 = 5.0 * RPM;
pub(super) const JITTER_CORRELATION_S: f64 = 0.5;

/// The pair of propellers that drives one degree of freedom.
pub(super) struct Propellers {
    screw: Screw,
    /// Force or moment per newton of each: 1, or ± the arm.
    weights: [f64; 2],
    jitter: [Vec<f64>; 2],
    motor: Motor,
    delay_s: f64,
    /// Fraction of thrust lost at the start of the trial, and per second during it.
    sag: (f64, f64),
    current_speeds: [f64; 2],
}

/// Thrust of a propeller as a function of its speed.
#[derive(Clone, Copy)]
pub(super) struct Screw {
    law: QuadraticThrust,
    max_speed: f64,
    /// Thrust lost per speed of propeller and of inflow, N s²/(rad m).
    inflow: f64,
    /// The loss while the propeller pushes in the direction of motion only.
    inflow_one_sided: f64,
    /// p − 2 of F ∝ |n|^p.
    beyond_square: f64,
}

/// Response of propeller speed to commands.
#[derive(Clone, Copy)]
pub(super) struct Motor {
    /// Time constants of speeding up and of slowing down, s.
    up_s: f64,
    down_s: f64,
    /// Largest rate of speed, rad/s².
    most: f64,
    dead_band: DeadBand,
}

/// Commands at which a propeller does not turn.
#[derive(Clone, Copy)]
struct DeadBand {
    /// Part of the greatest command, and that, rad/s.
    part: f64,
    max_speed: f64,
}

impl DeadBand {
    fn of(spec: &TwinSpec) -> Self {
        let part = spec.strength_of(Disturbance::DeadBand, spec.strength.dead_band);
        Self { part, max_speed: spec.thrusters.max_speed() }
    }

    /// Returns the speed that a command leads to in the end: as it says at the greatest.
    fn speed(&self, command: f64) -> f64 {
        if self.part == 0.0 {
            return command;
        }
        let beyond = (command.abs() - self.part * self.max_speed).max(0.0);
        (beyond / (1.0 - self.part)).copysign(command)
    }
}

/// Propeller speeds at the start, the middle and the end of a step, rad/s.
pub(super) type StageSpeeds = [[f64; 2]; 3];

impl TwinSpec {
    /// Returns the loss of thrust by inflow, per propeller speed and speed through water, N s²/(rad
    /// m).
    ///
    /// `F = k n|n| − k_in |n| v`, so that 1 m/s reduces thrust by `strength.inflow_loss` of the
    /// greatest forward thrust.
    ///
    /// # Source
    /// [Fossen2021, ch. 9]: thrust is bilinear in propeller speed and speed of advance.
    pub(super) fn inflow(&self) -> f64 {
        self.inflow_of(Disturbance::Inflow, self.strength.inflow_loss)
    }

    /// Returns the loss of propellers that push in the direction of motion, if only such lose
    /// thrust.
    pub(super) fn inflow_one_sided(&self) -> f64 {
        self.inflow_of(Disturbance::InflowOneSided, self.strength.inflow_one_sided_loss)
    }

    fn inflow_of(&self, disturbance: Disturbance, loss: f64) -> f64 {
        let loss = self.strength_of(disturbance, loss);
        loss * self.thrusters.forward * self.thrusters.max_speed()
    }

    /// Returns p of F ∝ |n|^p.
    pub(super) fn exponent(&self) -> f64 {
        if self.has(Disturbance::ThrustExponent) { self.strength.thrust_exponent } else { 2.0 }
    }

    /// Returns thrust at rest in the water with a fresh battery, N.
    ///
    /// `F = k n|n| |n / n_max|^(p − 2)`, which equals the square law at the greatest speed; of a command within the
    /// dead band, none.
    pub(super) fn true_thrust(&self, command: f64) -> f64 {
        let speed = DeadBand::of(self).speed(command);
        let part = speed / self.thrusters.max_speed();
        beyond_square(self.thrusters.law().force(speed), part, self.exponent() - 2.0)
    }

    /// Returns the time constants of propellers that speed up and slow down, s.
    pub(super) fn lags(&self) -> (f64, f64) {
        if self.has(Disturbance::LagTwoWay) {
            return (self.strength.lag_up_s, self.strength.lag_down_s);
        }
        let lag_s = self.strength_of(Disturbance::Lag, self.strength.lag_s);
        (lag_s, lag_s)
    }
}

/// Converts the force of a square law at a fraction of the greatest speed to another exponent.
fn beyond_square(force: f64, part_of_greatest: f64, power: f64) -> f64 {
    if power == 0.0 || force == 0.0 { force } else { force * part_of_greatest.abs().powf(power) }
}

impl Screw {
    pub(super) fn new(spec: &TwinSpec) -> Self {
        Self {
            law: spec.thrusters.law(),
            max_speed: spec.thrusters.max_speed(),
            inflow: spec.inflow(),
            inflow_one_sided: spec.inflow_one_sided(),
            beyond_square: spec.exponent() - 2.0,
        }
    }

    /// Returns the speed for a thrust by the square law, limited to the greatest.
    pub(super) fn speed_for(&self, thrust: f64) -> f64 {
        let coefficient = if thrust < 0.0 { self.law.reverse } else { self.law.forward };
        (thrust.abs() / coefficient).sqrt().min(self.max_speed).copysign(thrust)
    }

    /// Returns thrust at a speed of the propeller, advancing at `along` through the water, N.
    pub(super) fn thrust(&self, speed: f64, along: f64) -> f64 {
        let mut lost = self.inflow * speed.abs() * along;
        if speed * along > 0.0 {
            lost += self.inflow_one_sided * speed.abs() * along;
        }
        let part = speed / self.max_speed;
        beyond_square(self.law.force(speed), part, self.beyond_square) - lost
    }
}

impl Motor {
    pub(super) fn new(spec: &TwinSpec) -> Self {
        let (up_s, down_s) = spec.lags();
        let slew_s = spec.strength_of(Disturbance::Slew, spec.strength.slew_s);
        let most = if slew_s > 0.0 { spec.thrusters.max_speed() / slew_s } else { f64::INFINITY };
        Self { up_s, down_s, most, dead_band: DeadBand::of(spec) }
    }

    /// Returns the speed that a command leads to in the end.
    pub(super) fn turned_by(&self, command: f64) -> f64 {
        self.dead_band.speed(command)
    }

    /// Returns whether speed follows commands immediately.
    fn is_prompt(&self) -> bool {
        self.up_s == 0.0 && self.down_s == 0.0 && self.most.is_infinite()
    }

    /// Returns the speed after `dt`, from `speed` with the command `wanted`.
    ///
    /// `ṅ = (n_wanted − n)/T`, within ± the largest rate; T has one value while |n| grows and
    /// another while it falls. The solution is exact, by intervals.
    pub(super) fn after(&self, dt: f64, mut speed: f64, wanted: f64) -> f64 {
        let mut left = dt;
        // At most four intervals: slowing down and speeding up, each first at the rate limit.
        while left > 0.0 && speed != wanted {
            let slows = speed != 0.0 && (wanted - speed) * speed < 0.0;
            // A reversing propeller passes zero speed.
            let aim = if slows && wanted * speed < 0.0 { 0.0 } else { wanted };
            let lag_s = if slows { self.down_s } else { self.up_s };
            (speed, left) = self.solve_interval(speed, wanted, aim, lag_s, left);
        }
        speed
    }

    /// Solves one interval of [`Self::after`]; returns the speed after it, and the remaining time.
    fn solve_interval(
        &self,
        speed: f64,
        wanted: f64,
        aim: f64,
        lag_s: f64,
        left: f64,
    ) -> (f64, f64) {
        let gap = wanted - speed;
        let rate_limit_ends = self.most * lag_s;
        // Rounding must not restart the rate limit at its own end.
        if self.most.is_finite() && gap.abs() > rate_limit_ends * (1.0 + 1e-12) {
            let (to_aim, to_limit_end) = ((aim - speed).abs(), gap.abs() - rate_limit_ends);
            let needs = to_aim.min(to_limit_end) / self.most;
            if needs > left {
                return (speed + (self.most * left).copysign(gap), 0.0);
            }
            let reached =
                if to_aim <= to_limit_end { aim } else { wanted - rate_limit_ends.copysign(gap) };
            return (reached, left - needs);
        }
        if lag_s == 0.0 {
            return (aim, left);
        }
        let needs = if aim == wanted { f64::INFINITY } else { lag_s * (gap / wanted).ln() };
        if needs > left { (wanted - (-left / lag_s).exp() * gap, 0.0) } else { (aim, left - needs) }
    }
}

impl Propellers {
    pub(super) fn new(
        spec: &TwinSpec,
        vehicle: &Vehicle,
        plan: &Plan,
        streams: &Streams<'_>,
    ) -> Self {
        let dof = plan.dof;
        let jitter = |purpose| {
            let ticks = plan.ticks();
            ornstein_uhlenbeck(streams.stream(purpose), JITTER_RAD_S, JITTER_CORRELATION_S, ticks)
        };
        let sag = spec.strength_of(Disturbance::BatterySag, spec.strength.sag_part);
        let (before, after) = plan.spent;
        Self {
            screw: Screw::new(spec),
            weights: pair(dof).map(|at| vehicle.thrusters[at].unit_wrench()[dof.index()]),
            jitter: ["first jitter", "second jitter"].map(jitter),
            motor: Motor::new(spec),
            delay_s: spec.strength_of(Disturbance::Delay, spec.strength.delay_s),
            sag: (sag * before, sag * (after - before) / plan.duration_s),
            current_speeds: [0.0; 2],
        }
    }

    /// Returns the limited propeller speeds for a force, with jitter, rad/s.
    pub(super) fn allocate(&self, force: f64, tick: usize) -> [f64; 2] {
        let total: f64 = self.weights.iter().map(|w| w * w).sum();
        [0, 1].map(|i| {
            let thrust = force * self.weights[i] / total;
            self.screw.speed_for(thrust) + self.jitter[i][tick]
        })
    }

    /// Advances propeller speeds by a step, with commands from one delay ago.
    pub(super) fn advance(&mut self, commands: &[Vec<f64>; 2], t_s: f64) -> StageSpeeds {
        // A step lies within one tick; a millionth of one allows for rounding.
        let tick = (TICK_HZ * (t_s - self.delay_s) + 1e-6).floor();
        let wanted = [0, 1].map(|i| if tick < 0.0 { 0.0 } else { commands[i][tick as usize] });
        let wanted = wanted.map(|command| self.motor.turned_by(command));
        let Motor { up_s, down_s, most, .. } = self.motor;
        let after = |part: f64| {
            if up_s == down_s && most.is_infinite() {
                let keep = if up_s > 0.0 { (-part * STEP_S / up_s).exp() } else { 0.0 };
                return [0, 1].map(|i| wanted[i] + keep * (self.current_speeds[i] - wanted[i]));
            }
            [0, 1].map(|i| self.motor.after(part * STEP_S, self.current_speeds[i], wanted[i]))
        };
        let start = if self.motor.is_prompt() { wanted } else { self.current_speeds };
        let stages = [start, after(0.5), after(1.0)];
        self.current_speeds = stages[2];
        stages
    }

    /// Returns force or moment of the pair at a time, at a velocity `v` through the water.
    pub(super) fn force(&self, speeds: [f64; 2], v: f64, t_s: f64) -> f64 {
        let thrust = |(w, n): (f64, f64)| w * self.screw.thrust(n, w * v);
        let (before, per_s) = self.sag;
        (1.0 - before - per_s * t_s) * self.weights.into_iter().zip(speeds).map(thrust).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dof;
    use crate::twin::plans;

    /// Returns the propellers of the first surge trial under some disturbances.
    fn propellers(
        disturbances: &str,
        change: impl FnOnce(&mut TwinSpec),
    ) -> (TwinSpec, Propellers) {
        let mut spec = TwinSpec {
            disturbances: Disturbance::parse_list(disturbances).expect("known"),
            ..TwinSpec::jason2()
        };
        change(&mut spec);
        let plan = plans(&spec).remove(0);
        assert_eq!(plan.dof, Dof::Surge);
        let streams = Streams { seed: 1, trial: &plan.name };
        let vehicle = spec.true_vehicle().expect("valid");
        let propellers = Propellers::new(&spec, &vehicle, &plan, &streams);
        (spec, propellers)
    }

    /// Returns the speeds at the end of each step under two constant commands.
    fn turned(disturbances: &str, levels: [f64; 2], steps: usize) -> Vec<[f64; 2]> {
        let (_, mut propellers) = propellers(disturbances, |_| ());
        let commands = levels.map(|level| vec![level; steps.div_ceil(5)]);
        (0..steps).map(|step| propellers.advance(&commands, step as f64 * STEP_S)[2]).collect()
    }

    /// Propellers that turn at any command.
    const ALWAYS: DeadBand = DeadBand { part: 0.0, max_speed: 100.0 };

    #[test]
    fn a_propeller_rests_within_its_dead_band_and_is_as_fast_as_told_at_the_greatest_command() {
        let dead_band = DeadBand { part: 0.1, max_speed: 100.0 };
        let told = [-100.0, -9.0, 0.0, 10.0, 55.0, 100.0];
        let turns = [-100.0, 0.0, 0.0, 0.0, 50.0, 100.0];
        for (command, speed) in told.into_iter().zip(turns) {
            assert!((dead_band.speed(command) - speed).abs() < ROUNDING, "{command}");
        }
        let full = TwinSpec::jason2().thrusters.max_speed();
        let path = turned("dead-band", [0.05 * full, -full], 2);
        assert!(path[1][0] == 0.0 && (path[1][1] + full).abs() < ROUNDING, "{path:?}");
    }

    /// Rounding over some hundred steps, rad/s.
    const ROUNDING: f64 = 1e-9;

    #[test]
    fn a_lagging_propeller_follows_exponentially() {
        let path = turned("lag", [100.0, -50.0], 30);
        // After 0.6 s, two time constants.
        let left = (-2.0_f64).exp();
        assert!((path[29][0] - 100.0 * (1.0 - left)).abs() < ROUNDING);
        assert!((path[29][1] + 50.0 * (1.0 - left)).abs() < ROUNDING);
    }

    #[test]
    fn a_propeller_slows_down_with_its_own_time_constant() {
        let motor = Motor { up_s: 0.15, down_s: 0.45, most: f64::INFINITY, dead_band: ALWAYS };
        let speeds_up = motor.after(0.3, 0.0, 100.0);
        assert!((speeds_up - 100.0 * (1.0 - (-2.0_f64).exp())).abs() < ROUNDING);
        let slows_down = motor.after(0.9, -100.0, -20.0);
        assert!((slows_down + 20.0 + 80.0 * (-2.0_f64).exp()).abs() < ROUNDING);
        // It approaches −100, passes zero after 0.45 ln 2 s, and continues with the other time
        // constant.
        let stops_s = 0.45 * 2.0_f64.ln();
        assert!(motor.after(stops_s, 100.0, -100.0).abs() < ROUNDING);
        let reverses = motor.after(stops_s + 0.15, 100.0, -100.0);
        assert!((reverses + 100.0 * (1.0 - (-1.0_f64).exp())).abs() < ROUNDING, "{reverses}");
    }

    #[test]
    fn intervals_of_any_length_lead_to_the_same_speed() {
        let most = 300.0;
        for motor in [
            Motor { up_s: 0.15, down_s: 0.45, most, dead_band: ALWAYS },
            Motor { up_s: 0.3, down_s: 0.3, most, dead_band: ALWAYS },
            Motor { up_s: 0.0, down_s: 0.2, most, dead_band: ALWAYS },
            Motor { up_s: 0.2, down_s: 0.0, most: f64::INFINITY, dead_band: ALWAYS },
        ] {
            for (from, to) in [(0.0, 170.0), (150.0, -90.0), (-30.0, -160.0), (120.0, 0.0)] {
                let once = motor.after(0.7, from, to);
                let often = (0..70).fold(from, |speed, _| motor.after(0.01, speed, to));
                assert!((once - often).abs() < ROUNDING, "{from} to {to}: {once}, {often}");
            }
        }
    }

    #[test]
    fn equal_time_constants_make_one_lag() {
        let motor = Motor { up_s: 0.3, down_s: 0.3, most: f64::INFINITY, dead_band: ALWAYS };
        for dt in [0.01, 0.2, 0.5, 2.0] {
            let exact = -80.0 + (-dt / 0.3_f64).exp() * 180.0;
            assert!((motor.after(dt, 100.0, -80.0) - exact).abs() < ROUNDING);
        }
    }

    #[test]
    fn a_rate_limited_propeller_reaches_full_speed_in_its_slew_time() {
        let full = TwinSpec::jason2().thrusters.max_speed();
        let path = turned("slew", [full, -0.5 * full], 60);
        // 0.6 s are 30 steps; half of it for half the speed.
        assert!((path[14][0] / full - 0.5).abs() < ROUNDING);
        assert!(path[28][0] < full - ROUNDING && path[30][0] == full);
        assert!((path[14][1] / full + 0.5).abs() < ROUNDING && path[59][1] == -0.5 * full);
    }

    #[test]
    fn inflow_of_1_m_s_takes_a_quarter_of_the_greatest_thrust() {
        let (spec, propellers) = propellers("inflow", |_| ());
        let full = [spec.thrusters.max_speed(); 2];
        let part = propellers.force(full, 1.0, 0.0) / propellers.force(full, 0.0, 0.0);
        assert!((part - 0.75).abs() < 1e-12);
    }

    #[test]
    fn one_sided_inflow_reduces_thrust_along_the_motion_only() {
        let (spec, propellers) = propellers("inflow-one-sided", |_| ());
        let full = spec.thrusters.max_speed();
        let part =
            |n: f64, v: f64| propellers.force([n; 2], v, 0.0) / propellers.force([n; 2], 0.0, 0.0);
        assert!((part(full, 1.0) - 0.75).abs() < 1e-12);
        assert_eq!((part(full, -1.0), part(-full, 1.0)), (1.0, 1.0));
        // In reverse it gives 0.0328 / 0.0402 of the force, with the same loss.
        assert!((part(-full, -1.0) - (1.0 - 0.25 * 0.0402 / 0.0328)).abs() < 1e-12);
    }

    #[test]
    fn thrust_of_another_exponent_equals_the_curve_at_full_speed() {
        let (spec, bent) = propellers("thrust-exponent", |_| ());
        let (_, square) = propellers("none", |_| ());
        let full = spec.thrusters.max_speed();
        for (part, ratio) in [(1.0, 1.0), (0.5, 0.5_f64.powf(-0.2)), (-0.25, 0.25_f64.powf(-0.2))] {
            let thrust = |of: &Propellers| of.force([part * full; 2], 0.0, 0.0);
            assert!((thrust(&bent) / thrust(&square) - ratio).abs() < 1e-12, "{part}");
        }
        assert_eq!(bent.force([0.0; 2], 0.3, 0.0), 0.0);
    }

    #[test]
    fn thrust_sags_through_all_trials_of_a_degree_of_freedom() {
        let spec = TwinSpec {
            disturbances: Disturbance::parse_list("battery-sag").expect("known"),
            ..TwinSpec::jason2()
        };
        let vehicle = spec.true_vehicle().expect("valid");
        let part_at = |plan: &Plan, t_s: f64| {
            let streams = Streams { seed: 1, trial: &plan.name };
            let propellers = Propellers::new(&spec, &vehicle, plan, &streams);
            propellers.force([100.0; 2], 0.0, t_s) / (2.0 * spec.thrusters.law().force(100.0))
        };
        let plans = plans(&spec);
        // 480 s of fit and 300 s of hold-out lose 15 % together.
        assert!((part_at(&plans[0], 0.0) - 1.0).abs() < 1e-12);
        let between = 1.0 - 0.15 * 480.0 / 780.0;
        assert!((part_at(&plans[0], 480.0) - between).abs() < 1e-12);
        assert!((part_at(&plans[1], 0.0) - between).abs() < 1e-12);
        assert!((part_at(&plans[1], 300.0) - 0.85).abs() < 1e-12);
        assert!((part_at(&plans[2], 0.0) - 1.0).abs() < 1e-12, "sway has a fresh battery");
        let last = plans.iter().rfind(|plan| plan.dof == Dof::Heave).expect("a steady run");
        assert!((part_at(last, last.duration_s) - 0.85).abs() < 1e-12);
    }
}
