//! Which terms a plant has, on which axes.

use std::fmt;

use nalgebra::Vector6;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Basis, Effect, Instant, MOST_READ, Product, Signal};
use crate::{Dof, Error};

/// Which axes a vehicle's shape lets M couple.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Symmetry {
    /// Port is like starboard: surge, heave and pitch couple, and sway, roll and yaw.
    #[default]
    PortStarboard,
    /// Every axis may couple with every other.
    None,
    /// No axis couples by mass.
    Diagonal,
}

impl Symmetry {
    /// Whether M may couple two axes.
    pub fn couples(self, i: Dof, j: Dof) -> bool {
        let is_lengthwise = |dof| matches!(dof, Dof::Surge | Dof::Heave | Dof::Pitch);
        match self {
            _ if i == j => true,
            Self::PortStarboard => is_lengthwise(i) == is_lengthwise(j),
            Self::None => true,
            Self::Diagonal => false,
        }
    }

    /// As campaign files write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PortStarboard => "port-starboard",
            Self::None => "none",
            Self::Diagonal => "diagonal",
        }
    }
}

impl fmt::Display for Symmetry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The terms of a plant: the equation of motion without its numbers.
///
/// ```text
/// M ν̇_r + C(M, ν_r) ν_r + Σ products + g(η) = τ
/// ```
///
/// M is symmetric and couples what [`Symmetry`] allows; C follows from M and has no
/// parameters of its own.
///
/// ```
/// use seaplant::Dof;
/// use seaplant::plant::{Structure, Symmetry};
/// let planar = Structure::of(&[Dof::Surge, Dof::Sway, Dof::Yaw], Symmetry::PortStarboard)?;
/// let names: Vec<String> = planar.terms().iter().map(ToString::to_string).collect();
/// assert_eq!(names[..4], ["mass.surge", "mass.sway", "mass.sway-yaw", "mass.yaw"]);
/// assert_eq!(names[4..6], ["surge: u", "surge: |u|u"]);
/// assert_eq!(names.len(), 10);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    axes: Vec<Dof>,
    symmetry: Symmetry,
    terms: Vec<Basis>,
    effects: Vec<Effect>,
    /// What the effects read, each once.
    signals: Vec<Signal>,
    /// Where in `signals` those of each effect are.
    places: Vec<Vec<usize>>,
    /// Coefficients that are known, and stay as they are.
    held: Vec<(Basis, f64)>,
    /// Terms that are tried beside these, in place of the usual ones.
    tried: Option<Vec<Basis>>,
}

impl Structure {
    /// Mass as symmetry allows, linear and quadratic damping of each axis by itself, weight
    /// minus buoyancy where heave is one of the axes, and a righting lever where roll or
    /// pitch is.
    ///
    /// # Errors
    /// [`Error::Plant`] without axes, or with one twice.
    pub fn of(axes: &[Dof], symmetry: Symmetry) -> Result<Self, Error> {
        let mut sorted = axes.to_vec();
        sorted.sort();
        let refuse =
            |reason: &str| Error::Plant { axes: name_of_axes(axes), reason: reason.to_owned() };
        if sorted.is_empty() {
            return Err(refuse("has no axes; name them, as [\"surge\", \"sway\", \"yaw\"]"));
        }
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(refuse("has an axis twice; name each once"));
        }
        let mut terms = Vec::new();
        for (k, &i) in sorted.iter().enumerate() {
            let coupled = sorted[k..].iter().filter(|j| symmetry.couples(i, **j));
            terms.extend(coupled.map(|&j| Basis::Mass(i, j)));
        }
        for &on in &sorted {
            terms.push(Basis::Product(on, Product::linear(on)));
            terms.push(Basis::Product(on, Product::quadratic(on)));
        }
        if sorted.contains(&Dof::Heave) {
            terms.push(Basis::WeightExcess);
        }
        if sorted.contains(&Dof::Roll) || sorted.contains(&Dof::Pitch) {
            terms.push(Basis::Lever(2));
        }
        Ok(Self {
            axes: sorted,
            symmetry,
            terms,
            effects: Vec::new(),
            signals: Vec::new(),
            places: Vec::new(),
            held: Vec::new(),
            tried: None,
        })
    }

    /// The same with the terms that a search tries beside effects, in place of linear and
    /// quadratic damping of one axis by another.
    #[must_use]
    pub fn trying(self, tried: Vec<Basis>) -> Self {
        Self { tried: Some(tried), ..self }
    }

    /// The terms that a search tries in place of the usual ones, if they were stated.
    pub fn tried(&self) -> Option<&[Basis]> {
        self.tried.as_deref()
    }

    /// The same with one term more.
    ///
    /// # Errors
    /// [`Error::Plant`] if the term is there already, or reads or acts on an axis that the
    /// plant does not have.
    pub fn with(mut self, term: Basis) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Plant { axes: name_of_axes(&self.axes), reason };
        if self.terms.contains(&term) {
            return Err(refuse(format!("it has the term \"{term}\" already; leave it out")));
        }
        let reads: Vec<Dof> = match term {
            Basis::Product(_, product) => {
                let of_speed = (product.speed() != 0).then_some(Dof::Surge);
                product.factors().map(|factor| factor.of).chain(of_speed).collect()
            }
            _ => Vec::new(),
        };
        let acts = match term {
            Basis::Product(..) | Basis::One(_) | Basis::Mass(..) => term.axes(),
            Basis::Effect(k) if k >= self.effects.len() => {
                return Err(refuse(format!("it has no effect of number {}", k + 1)));
            }
            Basis::WeightExcess | Basis::Lever(_) | Basis::Effect(_) => Vec::new(),
        };
        let strange = acts.into_iter().chain(reads).find(|dof| !self.axes.contains(dof));
        if let Some(dof) = strange {
            return Err(refuse(format!(
                "the term \"{term}\" needs {dof}, which is not among its axes; add it to axes, or drop the term"
            )));
        }
        self.terms.push(term);
        Ok(self)
    }

    /// The same with one effect more, and its term if `as_term` says so.
    ///
    /// # Errors
    /// [`Error::Plant`] if it has one of that name, or if it acts on none of the axes.
    pub fn with_effect(mut self, effect: Effect, as_term: bool) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Plant { axes: name_of_axes(&self.axes), reason };
        let name = &effect.name;
        if self.effects.iter().any(|known| known.name == *name) {
            return Err(refuse(format!("it has `{name}` twice; give each its own name")));
        }
        if !effect.axes().iter().any(|dof| self.axes.contains(dof)) {
            return Err(refuse(format!("`{name}` acts on none of its axes; leave it out")));
        }
        let wanted = effect.signals();
        if wanted.len() > MOST_READ {
            let found = wanted.len();
            return Err(refuse(format!("`{name}` reads {found} signals, more than {MOST_READ}")));
        }
        let places = wanted.into_iter().map(|signal| self.place_of(signal)).collect();
        if as_term {
            self.terms.push(Basis::Effect(self.effects.len()));
        }
        self.places.push(places);
        self.effects.push(effect);
        Ok(self)
    }

    /// Where a signal stands among those that are read; it is taken in if it is new.
    fn place_of(&mut self, signal: Signal) -> usize {
        self.signals.iter().position(|known| *known == signal).unwrap_or_else(|| {
            self.signals.push(signal);
            self.signals.len() - 1
        })
    }

    /// The same with the coefficient of a term held at what is known of it.
    ///
    /// # Errors
    /// [`Error::Plant`] if it has no such term; if the number is not finite, or not positive
    /// where it must be; or for a mass that couples axes, or one of an axis that is coupled with
    /// one before it.
    pub fn holding(mut self, term: Basis, value: f64) -> Result<Self, Error> {
        let name = self.name_of(&term);
        let refuse = |reason: String| Error::Plant { axes: name_of_axes(&self.axes), reason };
        if self.index_of(&term).is_none() {
            let known = self.names().join(", ");
            return Err(refuse(format!("`{name}` cannot be held: it has {known}")));
        }
        let is_mass = matches!(term, Basis::Mass(..));
        if !value.is_finite() || is_mass && value <= 0.0 {
            return Err(refuse(format!(
                "`{name}` cannot be held at {value}; give a possible number"
            )));
        }
        if let Basis::Mass(i, j) = term {
            let is_first = |known: &Basis| matches!(known, Basis::Mass(a, b) if a != b && *b == i);
            if i != j || self.terms.iter().any(is_first) {
                return Err(refuse(format!(
                    "`{name}` cannot be held: of axes that M couples only the first one's mass can; hold that"
                )));
            }
        }
        self.held.retain(|(known, _)| *known != term);
        self.held.push((term, value));
        Ok(self)
    }

    /// What the coefficient of a term is held at, if it is.
    pub fn held(&self, term: &Basis) -> Option<f64> {
        self.held.iter().find(|(known, _)| known == term).map(|(_, value)| *value)
    }

    /// The same without effects that no term refers to; terms keep their order.
    pub(crate) fn pruned(&self) -> Self {
        let mut pruned = Self {
            terms: Vec::new(),
            effects: Vec::new(),
            signals: Vec::new(),
            places: Vec::new(),
            held: Vec::new(),
            tried: None,
            ..self.clone()
        };
        for term in &self.terms {
            let mut own = *term;
            if let Basis::Effect(k) = term {
                own = Basis::Effect(pruned.effects.len());
                let place = |of: &usize| pruned.place_of(self.signals[*of].clone());
                let places = self.places[*k].iter().map(place).collect();
                pruned.places.push(places);
                pruned.effects.push(self.effects[*k].clone());
            }
            pruned.terms.push(own);
            pruned.held.extend(self.held(term).map(|value| (own, value)));
        }
        pruned
    }

    /// Forces that read what was logged beside motion; a term refers to one by its number.
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// What the effects read, each once.
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// Whether an effect reads more than speed and thrust of thrusters whose force is known.
    pub(crate) fn reads_beside_thrusters(&self) -> bool {
        self.signals.iter().any(|signal| !signal.is_of_known_thruster())
    }

    /// The standard deviation of a coefficient about zero before anything is measured, if any.
    pub(crate) fn prior_std(&self, term: &Basis) -> Option<f64> {
        let Basis::Effect(k) = term else { return None };
        self.effects.get(*k)?.prior_std()
    }

    /// What an effect reads of the values of [`Self::signals`].
    pub(crate) fn read(&self, effect: usize, signals: &[f64]) -> [f64; MOST_READ] {
        let mut read = [0.0; MOST_READ];
        for (x, &at) in read.iter_mut().zip(&self.places[effect]) {
            *x = signals.get(at).copied().unwrap_or(0.0);
        }
        read
    }

    /// What a coefficient of one makes each effect push with, N and N m, each of shape (6,); zero
    /// of one that no term refers to.
    ///
    /// `velocity` is ν_r, shape (6,); `signals` are the values of [`Self::signals`].
    pub fn wrenches(&self, velocity: &Vector6<f64>, signals: &[f64]) -> Vec<Vector6<f64>> {
        let mut all = vec![Vector6::zeros(); self.effects.len()];
        for term in &self.terms {
            if let Basis::Effect(k) = *term {
                all[k] = self.effects[k].wrench(velocity, &self.read(k, signals)).0;
            }
        }
        all
    }

    /// The regressor of a term: [`Basis::regressor`], or `−` what its effect pushes with, as
    /// [`Self::wrenches`] gives it; shape (6,).
    pub fn regressor(&self, term: &Basis, at: &Instant, wrenches: &[Vector6<f64>]) -> Vector6<f64> {
        match term {
            Basis::Effect(k) => wrenches.get(*k).map_or_else(Vector6::zeros, |wrench| -wrench),
            _ => term.regressor(at),
        }
    }

    /// The name of a term in results: that of an effect, or the field's notation.
    pub fn name_of(&self, term: &Basis) -> String {
        match term {
            Basis::Effect(k) => {
                self.effects.get(*k).map_or_else(|| term.to_string(), |effect| effect.name.clone())
            }
            _ => term.to_string(),
        }
    }

    /// The term of a name in results, if it has it.
    pub fn term_named(&self, name: &str) -> Option<Basis> {
        self.terms.iter().find(|term| self.name_of(term) == name).copied()
    }

    /// The names of all terms, in their order.
    pub fn names(&self) -> Vec<String> {
        self.terms.iter().map(|term| self.name_of(term)).collect()
    }

    /// The axes of the plant on which a term acts.
    pub fn axes_of(&self, term: &Basis) -> Vec<Dof> {
        let all = match term {
            Basis::Effect(k) => self.effects.get(*k).map(Effect::axes).unwrap_or_default(),
            _ => term.axes(),
        };
        all.into_iter().filter(|dof| self.axes.contains(dof)).collect()
    }

    /// The unit of a term's coefficient.
    pub fn unit_of(&self, term: &Basis) -> String {
        match term {
            Basis::Effect(k) if *k < self.effects.len() => self.effects[*k].unit().to_owned(),
            _ => term.unit(),
        }
    }

    /// The same without some terms.
    pub fn without(&self, drop: impl Fn(&Basis) -> bool) -> Self {
        let terms = self.terms.iter().copied().filter(|term| !drop(term)).collect();
        Self { terms, ..self.clone() }
    }

    /// The axes, in SNAME order.
    pub fn axes(&self) -> &[Dof] {
        &self.axes
    }

    /// Which axes M may couple.
    pub fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// The terms; a plant has a coefficient for each.
    pub fn terms(&self) -> &[Basis] {
        &self.terms
    }

    /// The place of a term among [`Self::terms`].
    pub fn index_of(&self, term: &Basis) -> Option<usize> {
        self.terms.iter().position(|known| known == term)
    }

    /// `surge-sway-yaw`.
    pub fn name(&self) -> String {
        name_of_axes(&self.axes)
    }
}

fn name_of_axes(axes: &[Dof]) -> String {
    let names: Vec<&str> = axes.iter().map(|dof| dof.name()).collect();
    names.join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn port_starboard_symmetry_leaves_twelve_masses_of_twenty_one() {
        let masses = |symmetry| {
            let six = Structure::of(&Dof::ALL, symmetry).expect("six axes");
            six.terms().iter().filter(|term| matches!(term, Basis::Mass(..))).count()
        };
        assert_eq!(
            [Symmetry::PortStarboard, Symmetry::None, Symmetry::Diagonal].map(masses),
            [12, 21, 6]
        );
    }

    #[test]
    fn refuses_a_term_of_an_axis_that_is_not_there() {
        let planar = Structure::of(&[Dof::Surge, Dof::Sway], Symmetry::None).expect("two axes");
        let error = planar.with("sway: |r|r".parse().expect("a term")).expect_err("no yaw");
        assert!(error.to_string().contains("needs yaw"), "{error}");
    }

    #[test]
    fn refuses_an_axis_twice() {
        let error = Structure::of(&[Dof::Yaw, Dof::Yaw], Symmetry::None).expect_err("twice");
        assert!(error.to_string().contains("twice"), "{error}");
    }
}
