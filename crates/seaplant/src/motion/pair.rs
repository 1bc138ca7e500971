//! Products of one or two velocities, evaluated without branches.

use nalgebra::Vector6;

use crate::plant::{Product, sign};

/// Velocities on the six axes, followed by ones, which stand for factors that a product lacks. An index modulo the
/// length needs no check of bounds.
pub(super) type Extended = [f64; 8];

/// Index of a factor that a product lacks.
const NO_FACTOR: usize = 6;

pub(super) fn extended(velocity: &Vector6<f64>) -> Extended {
    std::array::from_fn(|k| if k < NO_FACTOR { velocity[k] } else { 1.0 })
}

/// A term that is a product of one or two velocities, which nearly all are; evaluated without branches.
#[derive(Clone, Copy)]
pub(super) struct Pair {
    /// Index among the axes on which it acts.
    pub(super) on: usize,
    coefficient: f64,
    /// Index of each factor among extended velocities.
    of: [usize; 2],
    /// The bits of each factor that count: all, or those of its modulus.
    bits: [u64; 2],
}

impl Pair {
    /// Returns a term as a pair; `None` for a product of more velocities, or with a power of speed.
    pub(super) fn new(on: usize, product: &Product, coefficient: f64) -> Option<Self> {
        let mut pair = Self { on, coefficient, of: [NO_FACTOR; 2], bits: [u64::MAX; 2] };
        let count = product.factors().count();
        if product.speed() != 0 || count > 2 {
            return None;
        }
        for (k, factor) in product.factors().enumerate() {
            pair.of[k] = factor.of.index();
            pair.bits[k] = if factor.modulus { !(1 << 63) } else { u64::MAX };
        }
        Some(pair)
    }

    fn factors(&self, velocity: &Extended) -> [f64; 2] {
        [0, 1].map(|k| f64::from_bits(velocity[self.of[k] % 8].to_bits() & self.bits[k]))
    }

    pub(super) fn value(&self, velocity: &Extended) -> f64 {
        let [one, other] = self.factors(velocity);
        self.coefficient * (one * other)
    }

    /// Adds the derivatives by the velocities to a row.
    pub(super) fn add_slope(&self, velocity: &Extended, row: &mut Extended) {
        let factors = self.factors(velocity);
        for (k, other) in [(0, factors[1]), (1, factors[0])] {
            let of = self.of[k] % 8;
            let slope = if self.bits[k] == u64::MAX { 1.0 } else { sign(velocity[of]) };
            row[of] += self.coefficient * slope * other;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dof;
    use crate::plant::Factor;

    #[test]
    fn a_pair_has_the_value_and_the_slope_of_its_product() {
        let [u, w] = [Dof::Surge, Dof::Heave].map(|of| Factor { of, modulus: false });
        let modulus = |factor: Factor| Factor { modulus: true, ..factor };
        let some =
            [vec![u], vec![modulus(w)], vec![modulus(u), u], vec![modulus(u), w], vec![u, w]];
        let velocity = Vector6::new(-0.7, 0.2, 0.0, 0.1, -0.3, 0.4);
        for factors in some {
            let product = Product::new(&factors).expect("one or two");
            let pair = Pair::new(0, &product, 3.0).expect("a pair");
            assert_eq!(pair.value(&extended(&velocity)), 3.0 * product.value(&velocity));
            let (mut own, mut expected) = (Extended::default(), [0.0; 6]);
            pair.add_slope(&extended(&velocity), &mut own);
            product.add_slope(&velocity, 3.0, &mut expected);
            assert_eq!(own[..6], expected);
        }
    }

    #[test]
    fn products_of_more_velocities_or_with_a_power_of_speed_are_no_pairs() {
        let u = Factor { of: Dof::Surge, modulus: false };
        let three = Product::new(&[u; 3]).expect("three");
        assert!(Pair::new(0, &three, 1.0).is_none());
        let over_speed = Product::new(&[u; 2]).and_then(|product| product.by_speed(-1));
        assert!(Pair::new(0, &over_speed.expect("a power"), 1.0).is_none());
    }
}
