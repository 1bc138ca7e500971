//! Tables whose derivatives include the Coriolis forces of added mass.

use nalgebra::{Matrix6, Vector6};

use crate::Dof;
use crate::plant::{Factor, Product, kirchhoff};

/// Returns `−C_A(ν) ν` as products of two velocities, which compensates for an explicit C(M).
///
/// Every row of `C_A(ν) ν` is a quadratic form in ν, so that differences of its values at unit
/// velocities are exact.
pub(super) fn coriolis_products(added_mass: &Matrix6<f64>) -> Vec<(Dof, Product, f64)> {
    let force = |velocity: &Vector6<f64>| kirchhoff(&(added_mass * velocity), velocity);
    let unit = |dof: Dof| {
        let mut velocity = Vector6::zeros();
        velocity[dof.index()] = 1.0;
        velocity
    };
    let mut terms = Vec::new();
    for a in Dof::ALL {
        for b in Dof::ALL.into_iter().filter(|b| *b >= a) {
            let both = if a == b {
                force(&unit(a))
            } else {
                force(&(unit(a) + unit(b))) - force(&unit(a)) - force(&unit(b))
            };
            let factors = [a, b].map(|of| Factor { of, modulus: false });
            let Some(product) = Product::new(&factors) else { continue };
            let rows = Dof::ALL.into_iter().filter(|on| both[on.index()] != 0.0);
            terms.extend(rows.map(|on| (on, product, -both[on.index()])));
        }
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_products_sum_to_the_force() {
        let mut added = Matrix6::from_diagonal(&Vector6::new(5.0, 60.0, 70.0, 0.5, 8.0, 9.0));
        (added[(0, 4)], added[(4, 0)], added[(1, 5)], added[(5, 1)]) = (2.0, 2.0, -1.5, -1.5);
        let velocity = Vector6::new(1.5, 0.2, -0.1, 0.05, 0.1, 0.2);
        let mut sum = kirchhoff(&(added * velocity), &velocity);
        for (on, product, value) in coriolis_products(&added) {
            sum[on.index()] += value * product.value(&velocity);
        }
        assert!(sum.amax() < 1e-12, "{sum}");
    }
}
