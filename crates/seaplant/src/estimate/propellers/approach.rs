//! A propeller on its way to the speed asked for, in closed form.

use super::drive::{DriveLaw, DriveNumber};

/// A number with its derivatives by what shapes propeller speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Changing {
    pub(super) x: f64,
    /// By lag, the logarithms of both lag ratios, slew time, delay and dead band.
    pub(super) by: [f64; DriveNumber::OF_SPEED],
}

impl Changing {
    pub(super) const fn constant(x: f64) -> Self {
        Self { x, by: [0.0; DriveNumber::OF_SPEED] }
    }

    pub(super) fn times(self, factor: f64) -> Self {
        Self { x: factor * self.x, by: self.by.map(|by| factor * by) }
    }

    /// A function of other numbers, by the chain rule.
    #[inline]
    fn of<const K: usize>(x: f64, partials: [(f64, &Changing); K]) -> Self {
        let mut by = [0.0; DriveNumber::OF_SPEED];
        for (slope, other) in partials {
            for (sum, part) in by.iter_mut().zip(other.by) {
                *sum += slope * part;
            }
        }
        Self { x, by }
    }
}

/// A part of a step in which a propeller turns one way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Its length, s.
    pub(super) length_s: f64,
    /// Whether the propeller turns in reverse.
    pub(super) reversed: bool,
    /// `∫ n dt`.
    pub(super) path: Changing,
    /// `∫ n² dt`.
    pub(super) square: Changing,
}

/// How propellers follow the speed asked for.
pub(super) struct Propulsion {
    /// By whether it slows down, and whether its speed falls.
    lags: [[Lag; 2]; 2],
    /// The greatest rate, rad/s², with its derivative by the slew time; `None` if there is none.
    rate: Option<(f64, f64)>,
}

/// A lag with what remains of a difference in speed after a whole step.
struct Lag {
    lag_s: Changing,
    whole: Decay,
}

/// What remains of a difference in speed after a while.
#[derive(Clone, Copy, Debug)]
struct Decay {
    /// How long, s.
    after_s: f64,
    /// E = e^(−t/T).
    left: f64,
    /// E t/T.
    left_times: f64,
}

impl Decay {
    /// At no lag, or at no time, the limits.
    fn after(t: f64, lag_s: f64) -> Self {
        if t <= 0.0 {
            return Self { after_s: 0.0, left: 1.0, left_times: 0.0 };
        }
        let ratio = t / lag_s.max(f64::MIN_POSITIVE);
        let left = (-ratio).exp();
        // Beyond this the product is below the smallest number, and ratio may be infinite.
        Self { after_s: t, left, left_times: if ratio < 700.0 { left * ratio } else { 0.0 } }
    }
}

impl Lag {
    fn new(lag_s: Changing) -> Self {
        Self { lag_s, whole: Decay::after(0.0, lag_s.x) }
    }

    fn decay(&self, t: f64) -> Decay {
        if t == self.whole.after_s { self.whole } else { Decay::after(t, self.lag_s.x) }
    }
}

/// No propeller crosses zero, leaves its greatest rate and arrives more than once in a step
/// towards one speed.
const MOST_PARTS: usize = 6;

impl Propulsion {
    pub(super) fn of(law: &DriveLaw) -> Self {
        let DriveLaw { lag_s, slew_s, full_speed: full, .. } = *law;
        let ratios = [law.log_lag_ratio.exp(), law.log_falling_lag_ratio.exp()];
        let lag = |slows: bool, falls: bool| {
            let [slowing, falling] =
                [(slows, ratios[0]), (falls, ratios[1])].map(|(has, x)| if has { x } else { 1.0 });
            let ratio = slowing * falling;
            let mut lag = Changing::constant(lag_s * ratio);
            lag.by[DriveNumber::Lag as usize] = ratio;
            for (number, has) in
                [(DriveNumber::LagRatio, slows), (DriveNumber::FallingLagRatio, falls)]
            {
                lag.by[number as usize] = if has { lag.x } else { 0.0 };
            }
            Lag::new(lag)
        };
        let rate = (slew_s > 0.0 && full > 0.0).then(|| (full / slew_s, -full / (slew_s * slew_s)));
        Self { lags: [false, true].map(|slows| [false, true].map(|falls| lag(slows, falls))), rate }
    }

    /// Prepares for steps of a length, s.
    #[inline]
    pub(super) fn step(&mut self, h: f64) {
        for lag in self.lags.as_flattened_mut() {
            if lag.whole.after_s != h {
                lag.whole = Decay::after(h, lag.lag_s.x);
            }
        }
    }

    /// Brings a propeller through a step, part by part; the speed that it then has.
    #[inline]
    pub(super) fn through(
        &self,
        from: Changing,
        asked: Changing,
        h: f64,
        mut part: impl FnMut(&Segment),
    ) -> Changing {
        let (mut speed, mut left_s) = (from, h);
        for k in 0..MOST_PARTS {
            let piece = self.piece(&speed, &asked);
            let is_last = k + 1 == MOST_PARTS;
            let length_s = if is_last { left_s } else { piece.until(&speed, &asked).min(left_s) };
            let (segment, after) = piece.over(speed, asked, length_s);
            part(&segment);
            speed = after;
            left_s -= length_s;
            if left_s <= 0.0 {
                break;
            }
            speed = self.beyond(&piece, speed, &asked);
        }
        speed
    }

    /// How fast a propeller's speed changes, rad/s²; 0 of one that follows at once.
    pub(super) fn slope(&self, speed: &Changing, asked: &Changing) -> f64 {
        let slope = self.piece(speed, asked).slope(speed, asked);
        if slope.is_finite() { slope } else { 0.0 }
    }

    /// How a propeller moves next.
    #[inline]
    fn piece(&self, speed: &Changing, asked: &Changing) -> Piece<'_> {
        let slows = speed.x * asked.x < 0.0 || speed.x.abs() > asked.x.abs();
        let offset = asked.x - speed.x;
        let lag = &self.lags[usize::from(slows)][usize::from(offset < 0.0)];
        match self.rate {
            Some((rate, by_slew))
                if offset.abs() > AT_RATE * rate * lag.lag_s.x && offset != 0.0 =>
            {
                Piece::Linear {
                    rate: rate.copysign(offset),
                    by_slew: by_slew * offset.signum(),
                    lag,
                }
            }
            _ => Piece::Exponential(lag),
        }
    }

    /// The speed just after a piece has ended within a step, where its slope may jump.
    ///
    /// At a standstill the next piece may be of another lag; the instant of the standstill
    /// depends on the unknowns, so that what follows does by the ratio of the slopes.
    fn beyond(&self, piece: &Piece<'_>, speed: Changing, asked: &Changing) -> Changing {
        if speed.x.abs() > STANDSTILL * asked.x.abs() {
            return speed;
        }
        // Exactly at rest and on its way: the sign of the speed asked for.
        let nudge = asked.x * f64::EPSILON;
        let before = piece.slope(&speed, asked);
        let at_rest = Changing { x: nudge, ..speed };
        let after = self.piece(&at_rest, asked).slope(&at_rest, asked);
        if before == 0.0 || !before.is_finite() || !after.is_finite() {
            return at_rest;
        }
        Changing { x: nudge, ..speed.times(after / before) }
    }
}

/// A propeller that the lag lets go slower than its greatest rate by rounding alone does so.
const AT_RATE: f64 = 1.0 + 1e-9;

/// Below this part of the speed asked for a propeller is at a standstill: rounding.
const STANDSTILL: f64 = 1e-12;

/// A part of a propeller's way.
enum Piece<'a> {
    /// At the greatest rate, up to where the lag asks for less.
    Linear { rate: f64, by_slew: f64, lag: &'a Lag },
    /// `n(t) = asked + (start − asked) e^(−t/T)`.
    Exponential(&'a Lag),
}

impl Piece<'_> {
    /// How long it lasts, s.
    #[inline]
    fn until(&self, speed: &Changing, asked: &Changing) -> f64 {
        let turns = asked.x * speed.x < 0.0;
        match self {
            Self::Linear { rate, lag, .. } => {
                let arrives = ((asked.x - speed.x) / rate - lag.lag_s.x).max(0.0);
                if turns { arrives.min(-speed.x / rate) } else { arrives }
            }
            // Without lag it has the speed asked for at once, however it turned before.
            Self::Exponential(lag) if turns && lag.lag_s.x > 0.0 => {
                lag.lag_s.x * (1.0 - speed.x / asked.x).ln()
            }
            Self::Exponential(_) => f64::INFINITY,
        }
    }

    fn slope(&self, speed: &Changing, asked: &Changing) -> f64 {
        match self {
            Self::Linear { rate, .. } => *rate,
            Self::Exponential(lag) => (asked.x - speed.x) / lag.lag_s.x,
        }
    }

    /// What a propeller does over a part of a step, and the speed after it.
    #[inline]
    fn over(&self, n: Changing, asked: Changing, t: f64) -> (Segment, Changing) {
        match self {
            Self::Linear { rate, by_slew, .. } => {
                let r = *rate;
                let mut slope = Changing::constant(r);
                slope.by[DriveNumber::Slew as usize] = *by_slew;
                let after = Changing::of(n.x + r * t, [(1.0, &n), (t, &slope)]);
                let path = n.x * t + 0.5 * r * t * t;
                let square = n.x * n.x * t + n.x * r * t * t + r * r * t * t * t / 3.0;
                let by_n = 2.0 * n.x * t + r * t * t;
                let by_r = n.x * t * t + 2.0 * r * t * t * t / 3.0;
                let segment = Segment {
                    length_s: t,
                    reversed: n.x + after.x < 0.0,
                    path: Changing::of(path, [(t, &n), (0.5 * t * t, &slope)]),
                    square: Changing::of(square, [(by_n, &n), (by_r, &slope)]),
                };
                (segment, after)
            }
            Self::Exponential(lag) => exponential(lag, n, asked, t),
        }
    }
}

/// With o = start − asked: `∫ n = asked t + o T (1 − E)`,
/// `∫ n² = asked² t + 2 asked o T (1 − E) + ½ o² T (1 − E²)`.
#[inline]
fn exponential(lag: &Lag, start: Changing, asked: Changing, t: f64) -> (Segment, Changing) {
    let Decay { left, left_times, .. } = lag.decay(t);
    let (a, o, lag_s) = (asked.x, start.x - asked.x, lag.lag_s.x);
    let (gone, gone2) = (1.0 - left, 1.0 - left * left);
    // Slopes by (asked, start, T); o depends on the first two.
    let chain = |x: f64, by_asked: f64, by_o: f64, by_t: f64| {
        Changing::of(x, [(by_asked - by_o, &asked), (by_o, &start), (by_t, &lag.lag_s)])
    };
    let by_t = if left_times == 0.0 { 0.0 } else { o * left_times / lag_s.max(f64::MIN_POSITIVE) };
    let after = chain(a + o * left, 1.0, left, by_t);
    let segment = Segment {
        length_s: t,
        reversed: if lag_s > 0.0 { start.x + after.x < 0.0 } else { after.x < 0.0 },
        path: chain(a * t + o * lag_s * gone, t, lag_s * gone, o * (gone - left_times)),
        square: chain(
            a * a * t + lag_s * o * (2.0 * a * gone + 0.5 * o * gone2),
            2.0 * a * t + 2.0 * o * lag_s * gone,
            lag_s * (2.0 * a * gone + o * gone2),
            2.0 * a * o * (gone - left_times) + 0.5 * o * o * (gone2 - 2.0 * left * left_times),
        ),
    };
    (segment, after)
}
