//! Plants of one axis, as structures and as lumped parameters.

use nalgebra::{DMatrix, Matrix4};

use crate::plant::{Basis, Plant, Product, Structure, Symmetry};
use crate::terms::Term;
use crate::{Dof, Error, LumpedParameters, Terms};

/// Returns the structure of one axis with the requested terms.
pub(super) fn axis_structure(dof: Dof, terms: Terms) -> Result<Structure, Error> {
    let (linear, quadratic) = (Product::linear(dof), Product::quadratic(dof));
    let structure = Structure::of(&[dof], Symmetry::Diagonal)?.without(|term| match term {
        Basis::Product(_, product) if *product == linear => !terms.has(Term::Linear),
        Basis::Product(_, product) if *product == quadratic => !terms.has(Term::Quadratic),
        Basis::WeightExcess | Basis::Lever(_) | Basis::Effect(_) => true,
        _ => false,
    });
    if terms.has(Term::Bias) { structure.with(Basis::One(dof)) } else { Ok(structure) }
}

/// Returns the lumped parameter of a term of one axis.
pub(super) fn term_of(term: &Basis) -> Term {
    match term {
        Basis::Mass(..) => Term::Force,
        Basis::Product(_, product)
            if product.factors().count() + usize::from(product.speed() != 0) == 1 =>
        {
            Term::Linear
        }
        Basis::Product(..) => Term::Quadratic,
        _ => Term::Bias,
    }
}

/// Returns the lumped parameters of a plant of one axis, and their covariance; effects have none.
pub(super) fn lumped_plant(
    plant: &Plant,
    covariance: &DMatrix<f64>,
) -> (LumpedParameters, Matrix4<f64>) {
    let terms = plant.structure().terms().iter().enumerate();
    let own = terms.filter(|(_, term)| !matches!(term, Basis::Effect(_)));
    let places: Vec<(usize, usize)> = own.map(|(a, term)| (a, term_of(term) as usize)).collect();
    // Converts m, d_Q, d_L and b to α, β, μ and bias; the same formulas convert back.
    let (mut physical, mut of_physical) = ([0.0; 4], Matrix4::zeros());
    for &(a, i) in &places {
        physical[i] = plant.coefficients()[a];
        for &(b, j) in &places {
            of_physical[(i, j)] = covariance[(a, b)];
        }
    }
    let [alpha, beta, mu, bias] = physical;
    let physical = LumpedParameters { alpha, beta, mu, bias };
    let lumped = LumpedParameters {
        alpha: 1.0 / alpha,
        beta: -beta / alpha,
        mu: -mu / alpha,
        bias: -bias / alpha,
    };
    (lumped, physical.physical_covariance(&of_physical))
}
