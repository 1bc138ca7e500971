//! How firmly roll and pitch are held.

use crate::rig::Rig;

/// Period of commands, s.
pub(crate) const TICK_S: f64 = 0.1;
/// Damping ratio of the hold.
pub(crate) const DAMPING: f64 = 0.8;
/// Phase that thrusters may lose where the damping of an attitude hold acts, rad: a quarter of what
/// makes it unstable.
const LOST: f64 = 0.4;
/// Indices of roll and pitch.
pub(crate) const TILTS: [usize; 2] = [3, 4];

/// Returns the natural frequency with which roll and pitch are held, rad/s: as firm as the lag of the
/// thrusters allows, because the flow turns a moving hull broadside with a moment that grows with
/// the square of speed, `(m_i − m_j) v_i v_j`.
///
/// ```text
/// ω = φ / (2 ζ (T + D + Δt))     φ the phase that is lost at the rate 2 ζ ω of the damping
/// ```
pub(crate) fn upright_rad_s(rig: &Rig) -> f64 {
    LOST / (2.0 * DAMPING * (rig.lag_s + rig.delay_s + TICK_S))
}
