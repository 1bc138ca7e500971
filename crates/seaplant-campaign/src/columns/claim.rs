//! Candidate quantities of columns, and reasons why a column is not needed.

use seaplant::Quantity;

/// A candidate quantity of a column.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Claim {
    pub quantity: Quantity,
    /// Strength of evidence; the largest wins where several columns claim a quantity.
    pub strength: u8,
    /// Unit to state, if the header does not.
    pub unit: Option<&'static str>,
    /// True if its sign is reversed.
    pub negate: bool,
    /// Reason, such as "by its name and unit".
    pub why: String,
    /// Question that the user must decide.
    pub doubt: Option<String>,
}

/// Question about a force whose name has no axis.
pub(super) const NO_AXIS: &str =
    "its name has no axis: is it along or about this one? if not, write wrench.DOF";
/// Why the description of a list of numbers is not mapped.
pub(super) const LAYOUT: &str = "of the shape of a list, not a measurement";
/// Why the numbers of a quaternion are not mapped.
pub(super) const QUATERNION: &str = "of a quaternion, whose angles have channels of their own";
pub(super) const NO_UNIT: &str = "no unit is stated; add unit = \"...\"";
pub(super) const ACCELERATION: &str =
    "an acceleration, but not along x, y or z of an accelerometer";
/// Why an accelerometer is not mapped.
pub(super) const VELOCITY_SAYS_MORE: &str =
    "an acceleration, and velocity is logged, which says more";
pub(super) const COMMANDED: &str = "a command, not a measurement";
pub(super) const WORLD_VELOCITY: &str =
    "a velocity along the world's axes; Seaplant reads the body's, or derives it from position";
/// Why most channels of an autopilot are not mapped.
pub(super) const NOT_NEEDED: &str = "internal to the autopilot, and not needed";
