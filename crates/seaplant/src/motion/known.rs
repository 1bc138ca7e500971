//! Known forces: weights hung on a vehicle, and lines with a scale.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use crate::series::union;

/// A known force on the vehicle over an interval of time.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownForce {
    /// Type of force.
    pub kind: KnownKind,
    /// Point of application, from the origin in body axes, m.
    pub position_m: [f64; 3],
    /// Standard deviation of its magnitude, N.
    pub std_n: f64,
    /// Start, in the recording's time, s.
    pub from_s: f64,
    /// End, in the recording's time, s.
    pub to_s: f64,
}

/// Type of a known force.
#[derive(Clone, Debug, PartialEq)]
pub enum KnownKind {
    /// A weight fixed to the vehicle; it acts along the world's down.
    Weight {
        /// Weight in water, N; negative if it floats.
        weight_n: f64,
        /// Mass, kg; it moves with the vehicle.
        mass_kg: f64,
    },
    /// A line that pulls in a constant direction in body axes.
    Line {
        /// Its tension, N.
        force_n: f64,
        /// Direction of the pull in body axes, a unit vector.
        direction: [f64; 3],
    },
}

impl KnownForce {
    /// Returns its magnitude, N; negative for a weight that floats.
    pub fn size_n(&self) -> f64 {
        match self.kind {
            KnownKind::Weight { weight_n, .. } => weight_n,
            KnownKind::Line { force_n, .. } => force_n,
        }
    }

    /// Returns the force with another magnitude, N, and the same mass.
    pub(crate) fn with_size(&self, size_n: f64) -> Self {
        let kind = match self.kind {
            KnownKind::Weight { mass_kg, .. } => KnownKind::Weight { weight_n: size_n, mass_kg },
            KnownKind::Line { direction, .. } => KnownKind::Line { force_n: size_n, direction },
        };
        Self { kind, ..self.clone() }
    }

    /// Returns whether two forces differ only in time.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let size = |force: &Self| (force.kind.clone(), force.position_m, force.std_n);
        size(self) == size(other)
    }

    fn acts_at(&self, time_s: f64) -> bool {
        self.from_s <= time_s && time_s < self.to_s
    }
}

/// Returns the instants at which any known force begins or ends, in order.
pub(crate) fn changes(known: &[KnownForce]) -> Vec<f64> {
    let ends: Vec<[f64; 2]> = known.iter().map(|force| [force.from_s, force.to_s]).collect();
    union(ends.iter().map(<[f64; 2]>::as_slice))
}

/// Returns the known forces that act at an instant.
pub(crate) fn acting(known: &[KnownForce], time_s: f64) -> Vec<KnownForce> {
    known.iter().filter(|force| force.acts_at(time_s)).cloned().collect()
}

/// The sum of the known forces at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Load {
    /// Their rigid-body mass matrix about the origin.
    pub(crate) mass: Matrix6<f64>,
    /// Σ W, N.
    pub(crate) weight_n: f64,
    /// Σ W r, N m.
    pub(crate) lever: Vector3<f64>,
    /// Force and moment of lines in body axes, N and N m.
    pub(crate) wrench: Vector6<f64>,
}

impl Load {
    /// Sums the known forces at an instant; `None` if none acts.
    pub(crate) fn at(known: &[KnownForce], time_s: f64) -> Option<Self> {
        let acting = acting(known, time_s);
        (!acting.is_empty()).then(|| Self::of(&acting))
    }

    /// Sums known forces that act together.
    pub(crate) fn of(acting: &[KnownForce]) -> Self {
        let mut load = Self::default();
        for force in acting {
            let r = Vector3::from(force.position_m);
            match force.kind {
                KnownKind::Weight { weight_n, mass_kg } => {
                    load.mass += point_mass(mass_kg, &r);
                    load.weight_n += weight_n;
                    load.lever += r * weight_n;
                }
                KnownKind::Line { force_n, direction } => {
                    let pull = Vector3::from(direction) * force_n;
                    let moment = r.cross(&pull);
                    load.wrench +=
                        Vector6::new(pull.x, pull.y, pull.z, moment.x, moment.y, moment.z);
                }
            }
        }
        load
    }

    /// Returns force and moment at an attitude, without inertia of the mass, N and N m.
    pub(crate) fn wrench(&self, down_body: &Vector3<f64>) -> Vector6<f64> {
        let (force, moment) = (down_body * self.weight_n, self.lever.cross(down_body));
        self.wrench + Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
    }
}

/// Returns M of a point mass: `m [1, −S(r); S(r), −S(r)²]`.
///
/// # Source
/// [Fossen2021, ch. 3].
fn point_mass(mass_kg: f64, position_m: &Vector3<f64>) -> Matrix6<f64> {
    let s = position_m.cross_matrix();
    let mut mass = Matrix6::zeros();
    mass.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    mass.fixed_view_mut::<3, 3>(0, 3).copy_from(&-s);
    mass.fixed_view_mut::<3, 3>(3, 0).copy_from(&s);
    mass.fixed_view_mut::<3, 3>(3, 3).copy_from(&-(s * s));
    mass * mass_kg
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROUNDING: f64 = 1e-12;

    fn weight() -> KnownForce {
        KnownForce {
            kind: KnownKind::Weight { weight_n: 20.0, mass_kg: 2.5 },
            position_m: [0.4, 0.0, 0.2],
            std_n: 0.0,
            from_s: 10.0,
            to_s: 20.0,
        }
    }

    #[test]
    fn a_weight_pulls_down_and_pitches_the_bow_down() {
        let load = Load::at(&[weight()], 10.0).expect("acts");
        let level = load.wrench(&Vector3::z());
        // W k = (0, 0, 20); r × W k = (0, −0.4 · 20, 0).
        assert!((level - Vector6::new(0.0, 0.0, 20.0, 0.0, -8.0, 0.0)).amax() < ROUNDING);
        // Bow up by 30°: k = (−½, 0, √3/2), and the weight pulls astern.
        let pitched = load.wrench(&Vector3::new(-0.5, 0.0, 0.75_f64.sqrt()));
        assert!((pitched[0] + 10.0).abs() < ROUNDING, "{pitched}");
    }

    #[test]
    fn a_weight_adds_its_mass_first_moment_and_inertia() {
        let mass = Load::at(&[weight()], 15.0).expect("acts").mass;
        assert!((mass - mass.transpose()).amax() < ROUNDING);
        let expected = [
            ((0, 0), 2.5),
            ((2, 2), 2.5),
            // ω × r at rest: heave of the weight by pitch is −x q, surge z q.
            ((0, 4), 2.5 * 0.2),
            ((2, 4), -2.5 * 0.4),
            ((1, 5), 2.5 * 0.4),
            ((3, 3), 2.5 * 0.04),
            ((4, 4), 2.5 * 0.2),
            ((5, 5), 2.5 * 0.16),
            ((3, 5), -2.5 * 0.08),
        ];
        for (place, value) in expected {
            assert!((mass[place] - value).abs() < ROUNDING, "{place:?}: {}", mass[place]);
        }
    }

    #[test]
    fn a_line_pulls_along_its_direction_and_has_a_moment() {
        let line = KnownForce {
            kind: KnownKind::Line { force_n: 50.0, direction: [-1.0, 0.0, 0.0] },
            position_m: [-0.5, 0.1, 0.0],
            ..weight()
        };
        let load = Load::at(&[line], 12.0).expect("acts");
        assert_eq!(load.mass, Matrix6::zeros());
        let wrench = load.wrench(&Vector3::z());
        assert!((wrench - Vector6::new(-50.0, 0.0, 0.0, 0.0, 0.0, 5.0)).amax() < ROUNDING);
    }

    #[test]
    fn a_weight_acts_in_its_interval_only() {
        let known = [weight()];
        assert_eq!(Load::at(&known, 9.9), None);
        assert!(Load::at(&known, 10.0).is_some() && Load::at(&known, 19.9).is_some());
        assert_eq!(Load::at(&known, 20.0), None);
        assert_eq!(changes(&known), [10.0, 20.0]);
    }
}
