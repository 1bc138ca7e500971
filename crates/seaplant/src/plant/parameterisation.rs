//! Maps from free parameters to coefficients, including physically possible ones only.

use nalgebra::{DMatrix, DVector, Matrix6};

use super::{Basis, Product, Structure};
use crate::Dof;

/// A map from free parameters, which an optimiser varies, to the coefficients of a structure.
pub trait Parameterisation {
    /// Returns the coefficients, in the order of the structure's terms; shape (p,).
    fn coefficients(&self, free: &DVector<f64>) -> DVector<f64>;
    /// Returns `∂coefficients/∂free`, shape (p, number of free parameters).
    fn jacobian(&self, free: &DVector<f64>) -> DMatrix<f64>;
    /// Returns free parameters of the nearest possible coefficients; shape (p,).
    fn free(&self, coefficients: &DVector<f64>) -> DVector<f64>;
    /// Returns the lower bound of each free parameter, if any.
    fn lowest(&self) -> Vec<Option<f64>>;
}

/// The identity map: for regressions and for a single axis.
#[derive(Clone, Debug)]
pub struct Plain;

impl Parameterisation for Plain {
    fn coefficients(&self, free: &DVector<f64>) -> DVector<f64> {
        free.clone()
    }

    fn jacobian(&self, free: &DVector<f64>) -> DMatrix<f64> {
        DMatrix::identity(free.len(), free.len())
    }

    fn free(&self, coefficients: &DVector<f64>) -> DVector<f64> {
        coefficients.clone()
    }

    fn lowest(&self) -> Vec<Option<f64>> {
        Vec::new()
    }
}

/// A map to coefficients that are physically possible for all free parameters.
///
/// `M = M_RB + L Lᵀ` if the rigid body is known, so that added mass is positive semidefinite;
/// otherwise `M = L Lᵀ` with e^ℓ on the diagonal of L, so that M is positive definite. Damping of
/// an axis by its own velocity is not negative. Other coefficients are free.
///
/// # Source
/// \[Wensing2018\] for the idea; log-Cholesky factors are those of \[Pinheiro1996\].
#[derive(Clone, Debug)]
pub struct Physical {
    blocks: Vec<Block>,
    rigid_body: Option<Matrix6<f64>>,
    lowest: Vec<Option<f64>>,
    /// Coefficients with fixed values.
    held: Vec<Option<f64>>,
    count: usize,
}

/// A set of axes that M couples with each other.
#[derive(Clone, Debug)]
struct Block {
    axes: Vec<Dof>,
    /// Indices of M_ij among the coefficients, by row and column ≤ row.
    indices: Vec<Vec<usize>>,
}

/// Lower bound of the eigenvalues of M, or of added mass, in a start, relative to their scale: at
/// zero the derivative of the factor vanishes.
const LEAST_PART: f64 = 0.01;

impl Physical {
    /// Creates the map for a structure with full blocks of M, like those of
    /// [`Structure::of`].
    pub fn new(structure: &Structure, rigid_body: Option<Matrix6<f64>>) -> Self {
        let is_own_damping = |term: &Basis| {
            matches!(term, Basis::Product(on, product)
                if [Product::linear(*on), Product::quadratic(*on)].contains(product))
        };
        let is_positive = |term: &Basis| {
            matches!(term, Basis::Effect(k)
            if structure.effects()[*k].is_positive())
        };
        let lowest = |term| (is_own_damping(term) || is_positive(term)).then_some(0.0);
        Self {
            blocks: blocks(structure),
            rigid_body,
            lowest: structure.terms().iter().map(lowest).collect(),
            held: structure.terms().iter().map(|term| structure.held(term)).collect(),
            count: structure.terms().len(),
        }
    }

    /// Returns the factor L of a block from its free parameters.
    fn factor(&self, block: &Block, free: &DVector<f64>) -> DMatrix<f64> {
        let n = block.axes.len();
        DMatrix::from_fn(n, n, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Less => 0.0,
            std::cmp::Ordering::Equal if self.rigid_body.is_none() => {
                free[block.indices[i][j]].exp()
            }
            _ => free[block.indices[i][j]],
        })
    }

    /// Sets the first entry of the factor of a block whose first mass is known: `L₁₁² = M₁₁ −
    /// M_RB,₁₁`.
    fn hold_first(&self, block: &Block, free: &mut DVector<f64>) {
        let index = block.indices[0][0];
        let Some(mass) = self.held[index] else { return };
        let first = block.axes[0];
        let corner = (mass - self.rigid_part(first, first)).max(0.0).sqrt();
        free[index] = if self.rigid_body.is_none() { corner.ln() } else { corner };
    }

    fn rigid_part(&self, i: Dof, j: Dof) -> f64 {
        self.rigid_body.map_or(0.0, |mass| mass[(i.index(), j.index())])
    }
}

fn blocks(structure: &Structure) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for &axis in structure.axes() {
        let coupled = |block: &&mut Block| {
            let first = block.axes[0];
            structure.index_of(&Basis::Mass(first.min(axis), first.max(axis))).is_some()
        };
        match blocks.iter_mut().find(coupled) {
            Some(block) => block.axes.push(axis),
            None => blocks.push(Block { axes: vec![axis], indices: Vec::new() }),
        }
    }
    for block in &mut blocks {
        let index = |i: usize, j: usize| {
            structure.index_of(&Basis::Mass(block.axes[j], block.axes[i])).unwrap_or(usize::MAX)
        };
        block.indices =
            (0..block.axes.len()).map(|i| (0..=i).map(|j| index(i, j)).collect()).collect();
    }
    blocks
}

impl Parameterisation for Physical {
    fn coefficients(&self, free: &DVector<f64>) -> DVector<f64> {
        let mut coefficients = free.clone();
        for block in &self.blocks {
            let factor = self.factor(block, free);
            let mass = &factor * factor.transpose();
            for (i, row) in block.indices.iter().enumerate() {
                for (j, &index) in row.iter().enumerate() {
                    coefficients[index] =
                        mass[(i, j)] + self.rigid_part(block.axes[i], block.axes[j]);
                }
            }
        }
        for (x, held) in coefficients.iter_mut().zip(&self.held) {
            *x = held.unwrap_or(*x);
        }
        coefficients
    }

    fn jacobian(&self, free: &DVector<f64>) -> DMatrix<f64> {
        let mut jacobian = DMatrix::identity(self.count, self.count);
        for block in &self.blocks {
            let factor = self.factor(block, free);
            let all: Vec<usize> = block.indices.iter().flatten().copied().collect();
            for &index in &all {
                jacobian[(index, index)] = 0.0;
            }
            for (a, row) in block.indices.iter().enumerate() {
                for (c, &from) in row.iter().enumerate() {
                    // ∂L = e_a e_cᵀ · slope, so that ∂M = ∂L Lᵀ + L ∂Lᵀ: row and column a.
                    let slope =
                        if a == c && self.rigid_body.is_none() { factor[(a, a)] } else { 1.0 };
                    for b in 0..block.axes.len() {
                        let index = block.indices[a.max(b)][a.min(b)];
                        let twice = if a == b { 2.0 } else { 1.0 };
                        jacobian[(index, from)] += twice * slope * factor[(b, c)];
                    }
                }
            }
        }
        for (k, _) in self.held.iter().enumerate().filter(|(_, held)| held.is_some()) {
            jacobian.column_mut(k).fill(0.0);
        }
        jacobian
    }

    fn free(&self, coefficients: &DVector<f64>) -> DVector<f64> {
        let mut coefficients = coefficients.clone();
        for (x, held) in coefficients.iter_mut().zip(&self.held) {
            *x = held.unwrap_or(*x);
        }
        let mut free = coefficients.clone();
        for (x, lowest) in free.iter_mut().zip(&self.lowest) {
            *x = lowest.map_or(*x, |lowest| x.max(lowest));
        }
        for block in &self.blocks {
            let n = block.axes.len();
            let rigid = |i: usize, j: usize| self.rigid_part(block.axes[i], block.axes[j]);
            let scale = DVector::from_fn(n, |i, _| {
                let own = if self.rigid_body.is_some() { rigid(i, i) } else { 0.0 };
                let own = own.max(coefficients[block.indices[i][i]].abs());
                if own > 0.0 { own.sqrt() } else { 1.0 }
            });
            let added = DMatrix::from_fn(n, n, |i, j| {
                let index = block.indices[i.max(j)][i.min(j)];
                (coefficients[index] - rigid(i, j)) / (scale[i] * scale[j])
            });
            let factor = lifted(added);
            for (i, row) in block.indices.iter().enumerate() {
                for (j, &index) in row.iter().enumerate() {
                    let x = factor[(i, j)] * scale[i];
                    free[index] = if i == j && self.rigid_body.is_none() { x.ln() } else { x };
                }
            }
            self.hold_first(block, &mut free);
        }
        free
    }

    fn lowest(&self) -> Vec<Option<f64>> {
        self.lowest.clone()
    }
}

/// Returns the Cholesky factor of a symmetric matrix with its eigenvalues bounded from below.
fn lifted(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    let eigen = matrix.symmetric_eigen();
    let values = eigen.eigenvalues.map(|value| value.max(LEAST_PART));
    let vectors = &eigen.eigenvectors;
    let lifted = vectors * DMatrix::from_diagonal(&values) * vectors.transpose();
    // The eigenvalues are positive, so the factor exists but for rounding.
    lifted.cholesky().map_or_else(|| DMatrix::identity(n, n), |factor| factor.l())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{RigidBody, Symmetry};

    /// Relative error of differences over steps of 1e-6.
    const DIFFERENCE: f64 = 1e-6;

    fn six() -> Structure {
        Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six axes")
    }

    fn body() -> Matrix6<f64> {
        let inertia = [[0.26, 0.0, 0.0], [0.0, 0.23, 0.0], [0.0, 0.0, 0.37]];
        RigidBody::new(13.5, [0.0, 0.0, 0.05], inertia).expect("a body").mass_matrix()
    }

    fn free_numbers(count: usize) -> DVector<f64> {
        DVector::from_fn(count, |k, _| 0.3 + 0.1 * (k as f64 * 1.7).sin())
    }

    #[test]
    fn the_jacobian_is_that_of_the_coefficients() {
        let structure = six();
        for rigid in [None, Some(body())] {
            let physical = Physical::new(&structure, rigid);
            let free = free_numbers(structure.terms().len());
            let jacobian = physical.jacobian(&free);
            for k in 0..free.len() {
                let at = |step: f64| {
                    let mut moved = free.clone();
                    moved[k] += step;
                    physical.coefficients(&moved)
                };
                let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((slope - jacobian.column(k)).amax() < DIFFERENCE, "{k}");
            }
        }
    }

    #[test]
    fn possible_coefficients_are_recovered_from_their_free_parameters() {
        let structure = six();
        for rigid in [None, Some(body())] {
            let physical = Physical::new(&structure, rigid);
            // Well inside the feasible set: three times the mass of the rigid body.
            let mut free = free_numbers(structure.terms().len());
            for (k, term) in structure.terms().iter().enumerate() {
                if matches!(term, Basis::Mass(i, j) if i == j) {
                    free[k] = 5.0;
                }
            }
            let coefficients = physical.coefficients(&free);
            let again = physical.coefficients(&physical.free(&coefficients));
            assert!((again - &coefficients).amax() < 1e-9 * coefficients.amax());
        }
    }

    #[test]
    fn known_coefficients_do_not_change() {
        let surge = Basis::Mass(Dof::Surge, Dof::Surge);
        let structure = six().holding(surge, 20.0).expect("the first of its block");
        for rigid in [None, Some(body())] {
            let physical = Physical::new(&structure, rigid);
            let light = DVector::from_element(structure.terms().len(), 3.0);
            let free = physical.free(&light);
            let index = structure.index_of(&surge).expect("there");
            assert!((physical.coefficients(&free)[index] - 20.0).abs() < 1e-12);
            assert_eq!(physical.jacobian(&free).column(index).amax(), 0.0);
        }
        let pitch = six().holding(Basis::Mass(Dof::Pitch, Dof::Pitch), 1.0);
        assert!(pitch.expect_err("coupled with surge").to_string().contains("only the first"));
    }

    #[test]
    fn added_mass_is_never_negative() {
        let structure = six();
        let physical = Physical::new(&structure, Some(body()));
        let light = DVector::from_element(structure.terms().len(), -1.0);
        let coefficients = physical.coefficients(&physical.free(&light));
        let surge = structure.index_of(&Basis::Mass(Dof::Surge, Dof::Surge)).expect("there");
        assert!(coefficients[surge] >= 13.5);
        let drag = Basis::Product(Dof::Surge, Product::linear(Dof::Surge));
        assert_eq!(coefficients[structure.index_of(&drag).expect("there")], 0.0);
    }
}
