//! The terms and axes of a plant.

use std::fmt;

use nalgebra::Vector6;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Basis, Effect, Instant, MOST_READ, Product, Signal};
use crate::{Dof, Error};

/// The axes that M may couple by the symmetry of the vehicle.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Symmetry {
    /// Port–starboard symmetry: surge, heave and pitch couple, and sway, roll and yaw.
    #[default]
    PortStarboard,
    /// No symmetry: every axis may couple with every other.
    None,
    /// No axis couples by mass.
    Diagonal,
}

impl Symmetry {
    /// Returns whether M may couple two axes.
    pub fn couples(self, i: Dof, j: Dof) -> bool {
        let is_lengthwise = |dof| matches!(dof, Dof::Surge | Dof::Heave | Dof::Pitch);
        match self {
            _ if i == j => true,
            Self::PortStarboard => is_lengthwise(i) == is_lengthwise(j),
            Self::None => true,
            Self::Diagonal => false,
        }
    }

    /// Returns the name in campaign files.
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

/// The terms of a plant: the equation of motion without coefficients.
///
/// ```text
/// M ν̇_r + C(M, ν_r) ν_r + Σ products + g(η) = τ
/// ```
///
/// M is symmetric and couples the axes allowed by [`Symmetry`]; C follows from M and has no
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
    /// The distinct signals of all effects.
    signals: Vec<Signal>,
    /// Indices of each effect's signals in `signals`.
    signal_indices: Vec<Vec<usize>>,
    /// Coefficients with fixed values.
    held: Vec<(Basis, f64)>,
    /// Candidate terms of a search, instead of the default ones.
    tried: Option<Vec<Basis>>,
}

impl Structure {
    /// Creates the default structure: mass as symmetry allows, linear and quadratic damping of each
    /// axis by its own velocity, weight minus buoyancy if heave is one of the axes, and a righting
    /// lever if roll or pitch is.
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
            signal_indices: Vec::new(),
            held: Vec::new(),
            tried: None,
        })
    }

    /// Sets the candidate terms of a search in addition to effects, instead of linear and quadratic
    /// damping of one axis by another.
    #[must_use]
    pub fn trying(self, tried: Vec<Basis>) -> Self {
        Self { tried: Some(tried), ..self }
    }

    /// Returns the candidate terms of a search, if they were set.
    pub fn tried(&self) -> Option<&[Basis]> {
        self.tried.as_deref()
    }

    /// Adds a term.
    ///
    /// # Errors
    /// [`Error::Plant`] if the term is present already, or depends or acts on an axis outside the
    /// plant.
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

    /// Adds an effect, and its term if `as_term`.
    ///
    /// # Errors
    /// [`Error::Plant`] if the name is present already, if the effect acts on none of the axes, or if lift of the hull
    /// acts along another axis than sway or heave.
    pub fn with_effect(mut self, effect: Effect, as_term: bool) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Plant { axes: name_of_axes(&self.axes), reason };
        let name = &effect.name;
        if self.effects.iter().any(|known| known.name == *name) {
            return Err(refuse(format!("it has `{name}` twice; give each its own name")));
        }
        if let Some((along, _)) = effect.hull_lift()
            && !matches!(along, Dof::Sway | Dof::Heave)
        {
            let reason = format!("`{name}` is lift of the hull along {along}; state sway or heave");
            return Err(refuse(reason));
        }
        if !effect.axes().iter().any(|dof| self.axes.contains(dof)) {
            return Err(refuse(format!("`{name}` acts on none of its axes; leave it out")));
        }
        let wanted = effect.signals();
        if wanted.len() > MOST_READ {
            let found = wanted.len();
            return Err(refuse(format!("`{name}` reads {found} signals, more than {MOST_READ}")));
        }
        let signal_indices =
            wanted.into_iter().map(|signal| self.index_of_signal(signal)).collect();
        if as_term {
            self.terms.push(Basis::Effect(self.effects.len()));
        }
        self.signal_indices.push(signal_indices);
        self.effects.push(effect);
        Ok(self)
    }

    /// Returns the index of a signal, which is added if it is new.
    fn index_of_signal(&mut self, signal: Signal) -> usize {
        self.signals.iter().position(|known| *known == signal).unwrap_or_else(|| {
            self.signals.push(signal);
            self.signals.len() - 1
        })
    }

    /// Fixes the coefficient of a term.
    ///
    /// # Errors
    /// [`Error::Plant`] if the term is absent; if the number is not finite, or not positive where
    /// it must be; or for a mass that couples axes, or one of an axis that is coupled with one
    /// before it.
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

    /// Returns the fixed value of a term's coefficient, if any.
    pub fn held(&self, term: &Basis) -> Option<f64> {
        self.held.iter().find(|(known, _)| known == term).map(|(_, value)| *value)
    }

    /// Removes effects to which no term refers; terms keep their order.
    pub(crate) fn pruned(&self) -> Self {
        let mut pruned = Self {
            terms: Vec::new(),
            effects: Vec::new(),
            signals: Vec::new(),
            signal_indices: Vec::new(),
            held: Vec::new(),
            tried: None,
            ..self.clone()
        };
        for term in &self.terms {
            let mut own = *term;
            if let Basis::Effect(k) = term {
                own = Basis::Effect(pruned.effects.len());
                let place = |of: &usize| pruned.index_of_signal(self.signals[*of].clone());
                let signal_indices = self.signal_indices[*k].iter().map(place).collect();
                pruned.signal_indices.push(signal_indices);
                pruned.effects.push(self.effects[*k].clone());
            }
            pruned.terms.push(own);
            pruned.held.extend(self.held(term).map(|value| (own, value)));
        }
        pruned
    }

    /// Returns the forces that depend on logged signals; a term refers to one by its index.
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// Returns the distinct signals of all effects.
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// Returns whether an effect depends on signals other than speed and thrust of thrusters with
    /// known curves.
    pub(crate) fn reads_beside_thrusters(&self) -> bool {
        self.signals.iter().any(|signal| !signal.is_of_known_thruster())
    }

    /// Returns the prior standard deviation of a coefficient about zero, if any.
    pub(crate) fn prior_std(&self, term: &Basis) -> Option<f64> {
        let Basis::Effect(k) = term else { return None };
        self.effects.get(*k)?.prior_std()
    }

    /// Selects the signals of an effect from the values of [`Self::signals`]; writes them to `read`.
    pub(crate) fn read<'a>(
        &self,
        effect: usize,
        signals: &[f64],
        read: &'a mut [f64; MOST_READ],
    ) -> &'a [f64] {
        let indices = &self.signal_indices[effect];
        for (x, &at) in read.iter_mut().zip(indices) {
            *x = signals.get(at).copied().unwrap_or(0.0);
        }
        &read[..indices.len()]
    }

    /// Returns the regressor of a term: [`Basis::regressor`], or `−` the wrench of its effect for a
    /// unit coefficient; shape (6,). Of a fin in a race, lift and slipstream are each by itself.
    ///
    /// `signals` are the values of [`Self::signals`], and a missing one is zero.
    pub fn regressor(&self, term: &Basis, at: &Instant, signals: &[f64]) -> Vector6<f64> {
        self.regressor_in_race(term, at, signals, 0.0)
    }

    /// The same, with the coefficient of a fin's slipstream over that of its lift.
    pub(crate) fn regressor_in_race(
        &self,
        term: &Basis,
        at: &Instant,
        signals: &[f64],
        race: f64,
    ) -> Vector6<f64> {
        let Basis::Effect(k) = *term else { return term.regressor(at) };
        let Some(effect) = self.effects.get(k) else { return Vector6::zeros() };
        -effect.wrench(&at.velocity, self.read(k, signals, &mut [0.0; MOST_READ]), race)
    }

    /// Returns the coefficient of the slipstream at a fin over that of its lift, for an effect of a fin in a race, by
    /// the coefficients of effects; 0 unless both are above zero.
    pub(crate) fn race(&self, effect: usize, coefficient: impl Fn(usize) -> f64) -> f64 {
        let Some((foil, _)) = self.effects.get(effect).and_then(Effect::in_race) else {
            return 0.0;
        };
        let of_foil = |is_lift: bool| -> f64 {
            let is_own = |other: &Effect| {
                is_lift == matches!(other.force, super::EffectForce::Lift { .. })
                    && other.in_race().is_some_and(|(of, _)| of == foil)
            };
            self.effects.iter().position(is_own).map_or(0.0, &coefficient)
        };
        let (lift, slipstream) = (of_foil(true), of_foil(false));
        if lift > 0.0 && slipstream > 0.0 { slipstream / lift } else { 0.0 }
    }

    /// Returns the name of a term in results: that of an effect, or the field's notation.
    pub fn name_of(&self, term: &Basis) -> String {
        match term {
            Basis::Effect(k) => {
                self.effects.get(*k).map_or_else(|| term.to_string(), |effect| effect.name.clone())
            }
            _ => term.to_string(),
        }
    }

    /// Returns the term with a name in results, if present.
    pub fn term_named(&self, name: &str) -> Option<Basis> {
        self.terms.iter().find(|term| self.name_of(term) == name).copied()
    }

    /// Returns the names of all terms, in order.
    pub fn names(&self) -> Vec<String> {
        self.terms.iter().map(|term| self.name_of(term)).collect()
    }

    /// Returns the axes of the plant on which a term acts.
    pub fn axes_of(&self, term: &Basis) -> Vec<Dof> {
        let all = match term {
            Basis::Effect(k) => self.effects.get(*k).map(Effect::axes).unwrap_or_default(),
            _ => term.axes(),
        };
        all.into_iter().filter(|dof| self.axes.contains(dof)).collect()
    }

    /// Returns the axis along which a term that is lift of the hull acts, and its place, x in m.
    pub(crate) fn lift_of_hull(&self, term: &Basis) -> Option<(Dof, f64)> {
        let Basis::Effect(k) = term else { return None };
        self.effects.get(*k)?.hull_lift()
    }

    /// Returns whether a term is the force of a rudder, fin or propeller of unknown strength, or of wind: lift of the
    /// hull is damping.
    pub(crate) fn pushes(&self, term: &Basis) -> bool {
        matches!(term, Basis::Effect(_)) && self.lift_of_hull(term).is_none()
    }

    /// Returns the unit of a term's coefficient.
    pub fn unit_of(&self, term: &Basis) -> String {
        match term {
            Basis::Effect(k) if *k < self.effects.len() => self.effects[*k].unit().to_owned(),
            _ => term.unit(),
        }
    }

    /// Removes terms.
    pub fn without(&self, drop: impl Fn(&Basis) -> bool) -> Self {
        let terms = self.terms.iter().copied().filter(|term| !drop(term)).collect();
        Self { terms, ..self.clone() }
    }

    /// Returns the axes, in SNAME order.
    pub fn axes(&self) -> &[Dof] {
        &self.axes
    }

    /// Returns the symmetry, which limits the coupling by M.
    pub fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// Returns the terms; a plant has a coefficient for each.
    pub fn terms(&self) -> &[Basis] {
        &self.terms
    }

    /// Returns the index of a term in [`Self::terms`].
    pub fn index_of(&self, term: &Basis) -> Option<usize> {
        self.terms.iter().position(|known| known == term)
    }

    /// Returns the names of the axes: `surge-sway-yaw`.
    pub fn name(&self) -> String {
        name_of_axes(&self.axes)
    }
}

/// Returns the name of a plant of some axes: `surge`, `surge-sway-yaw`.
pub(crate) fn name_of_axes(axes: &[Dof]) -> String {
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
    fn refuses_a_term_of_an_absent_axis() {
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
