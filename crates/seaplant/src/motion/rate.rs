//! ν̇ of a plant and its derivatives, prepared for many evaluations.

use nalgebra::{DMatrix, Matrix6, SMatrix, SVector, Vector3, Vector6};

use super::pair::{Extended, Pair, extended};
use super::{Load, apply, times};
use crate::plant::{
    Basis, Instant, MOST_READ, Plant, Product, Structure, kirchhoff, kirchhoff_slope,
};
use crate::{Dof, Error};

/// M and all terms without acceleration on the left of the equation of motion, on at most `N` axes.
struct Forces<const N: usize> {
    axes: [Option<usize>; N],
    mass: Matrix6<f64>,
    pairs: Vec<Pair>,
    /// Other products of velocities: the index among the axes on which each acts, and its coefficient.
    products: Vec<(usize, Product, f64)>,
    weight_excess: f64,
    lever: Vector3<f64>,
    constant: SVector<f64, N>,
    effects: Vec<Acting>,
    structure: Structure,
    /// True if there is momentum along several axes: that along one axis does not act on it.
    turns_momentum: bool,
    /// True if weight or a righting lever acts.
    restores: bool,
}

/// An effect of a plant.
struct Acting {
    /// Its index in the structure.
    effect: usize,
    coefficient: f64,
    /// Of a fin in a race, the coefficient of its slipstream over that of its lift.
    race: f64,
}

impl<const N: usize> Forces<N> {
    fn new(plant: &Plant, axes: [Option<usize>; N]) -> Self {
        let mut forces = Self {
            axes,
            mass: Matrix6::zeros(),
            pairs: Vec::new(),
            products: Vec::new(),
            weight_excess: 0.0,
            lever: Vector3::zeros(),
            constant: SVector::zeros(),
            effects: Vec::new(),
            structure: plant.structure().clone(),
            turns_momentum: plant.axes().len() > 1,
            restores: false,
        };
        forces.set(plant.structure().terms(), plant.coefficients());
        forces
    }

    /// Adds known forces: mass and weight like those of the plant, and a force that is constant in
    /// body axes.
    fn add(&mut self, load: &Load) {
        self.mass += load.mass;
        self.weight_excess += load.weight_n;
        self.lever += load.lever;
        self.constant -= self.on_axes(&load.wrench);
        self.turns_momentum = true;
        self.restores = true;
    }

    /// Sets the coefficients of the same terms; the second call allocates nothing.
    fn set(&mut self, terms: &[Basis], coefficients: &[f64]) {
        self.pairs.clear();
        self.products.clear();
        self.effects.clear();
        for (term, &value) in terms.iter().zip(coefficients) {
            match *term {
                Basis::Mass(i, j) => {
                    self.mass[(i.index(), j.index())] = value;
                    self.mass[(j.index(), i.index())] = value;
                }
                Basis::Product(on, product) => {
                    let Some(place) = self.place(on) else { continue };
                    match Pair::new(place, &product, value) {
                        Some(pair) => self.pairs.push(pair),
                        None => self.products.push((place, product, value)),
                    }
                }
                Basis::WeightExcess => (self.weight_excess, self.restores) = (value, true),
                Basis::Lever(axis) => (self.lever[axis], self.restores) = (value, true),
                Basis::One(on) => {
                    if let Some(place) = self.place(on) {
                        self.constant[place] = value;
                    }
                }
                Basis::Effect(effect) => {
                    self.effects.push(Acting { effect, coefficient: value, race: 0.0 });
                }
            }
        }
        for at in 0..self.effects.len() {
            let of = |k: usize| {
                let own = self.effects.iter().find(|own| own.effect == k);
                own.map_or(0.0, |own| own.coefficient)
            };
            self.effects[at].race = self.structure.race(self.effects[at].effect, of);
        }
    }

    /// Returns n(ν_r, η) less the wrenches of effects, N and N m.
    fn at(
        &self,
        velocity: &Vector6<f64>,
        down_body: &Vector3<f64>,
        signals: &[f64],
    ) -> SVector<f64, N> {
        let mut n = self.constant;
        if self.turns_momentum {
            n += self.on_axes(&kirchhoff(&(self.mass * velocity), velocity));
        }
        let all = extended(velocity);
        for pair in &self.pairs {
            n[pair.on] += pair.value(&all);
        }
        for (place, product, value) in &self.products {
            n[*place] += value * product.value(velocity);
        }
        if self.restores {
            n -= self.on_axes(&self.change_by_down(down_body));
        }
        for own in &self.effects {
            let mut wrench = SVector::zeros();
            self.each_push(own, velocity, signals, |way, force, _| {
                wrench += self.on_axes(way) * force;
            });
            n -= wrench * own.coefficient;
        }
        n
    }

    /// Returns the change of the restoring force with a change of the world's down in body axes.
    fn change_by_down(&self, change: &Vector3<f64>) -> Vector6<f64> {
        let (force, moment) = (self.weight_excess * change, self.lever.cross(change));
        Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
    }

    /// Returns ∂n/∂ν of the axes, shape (N, N).
    fn slope(&self, velocity: &Vector6<f64>, signals: &[f64]) -> SMatrix<f64, N, N> {
        let mut slope = SMatrix::<f64, N, N>::zeros();
        if self.turns_momentum {
            let six = kirchhoff_slope(&self.mass, velocity);
            slope = SMatrix::from_fn(|i, j| match (self.axes[i], self.axes[j]) {
                (Some(on), Some(of)) => six[(on, of)],
                _ => 0.0,
            });
        }
        let all = extended(velocity);
        let mut rows = [Extended::default(); N];
        for pair in &self.pairs {
            pair.add_slope(&all, &mut rows[pair.on]);
        }
        for (i, row) in rows.iter().enumerate() {
            for (j, axis) in self.axes.iter().enumerate() {
                slope[(i, j)] += axis.map_or(0.0, |axis| row[axis]);
            }
        }
        for (place, product, value) in &self.products {
            let mut row = [0.0; 6];
            product.add_slope(velocity, *value, &mut row);
            for (entry, axis) in slope.row_mut(*place).iter_mut().zip(self.axes) {
                *entry += axis.map_or(0.0, |axis| row[axis]);
            }
        }
        for own in &self.effects {
            let mut by_velocity = SMatrix::<f64, N, N>::zeros();
            self.each_push(own, velocity, signals, |way, _, by| {
                let (way, by) = (self.on_axes(way), self.on_axes(&by));
                for (column, by) in by_velocity.column_iter_mut().zip(&by) {
                    column.into_iter().zip(&way).for_each(|(entry, way)| *entry += way * by);
                }
            });
            slope -= by_velocity * own.coefficient;
        }
        slope
    }

    /// Passes on each force of an effect per unit of its coefficient, as [`Effect::each_push`](crate::plant::Effect).
    fn each_push(
        &self,
        own: &Acting,
        velocity: &Vector6<f64>,
        signals: &[f64],
        along: impl FnMut(&Vector6<f64>, f64, Vector6<f64>),
    ) {
        let read = &mut [0.0; MOST_READ];
        let signals = self.structure.read(own.effect, signals, read);
        self.structure.effects()[own.effect].each_push(velocity, signals, own.race, along);
    }

    /// Returns the coefficient of the slipstream at a fin over that of its lift; 0 for other terms.
    fn race(&self, term: &Basis) -> f64 {
        let Basis::Effect(k) = term else { return 0.0 };
        self.effects.iter().find(|own| own.effect == *k).map_or(0.0, |own| own.race)
    }

    /// Returns the axes of a vector of six.
    fn on_axes(&self, six: &Vector6<f64>) -> SVector<f64, N> {
        SVector::from_fn(|i, _| self.axes[i].map_or(0.0, |axis| six[axis]))
    }

    fn place(&self, on: Dof) -> Option<usize> {
        self.axes.iter().position(|axis| *axis == Some(on.index()))
    }
}

/// Returns M⁻¹ of a plant with the mass of known forces, shape (axes, axes).
fn inverse_under(plant: &Plant, load: Option<&Load>) -> Result<DMatrix<f64>, Error> {
    let (mut mass, axes) = (plant.mass_matrix(), plant.axes());
    if let Some(load) = load {
        mass += DMatrix::from_fn(axes.len(), axes.len(), |i, j| {
            load.mass[(axes[i].index(), axes[j].index())]
        });
    }
    mass.try_inverse().ok_or_else(|| singular(plant))
}

fn singular(plant: &Plant) -> Error {
    let reason = "its mass matrix is singular".to_owned();
    Error::Plant { axes: plant.structure().name(), reason }
}

/// A plant of at most `N` axes, prepared for many evaluations; entries beyond its axes are zero.
pub(crate) struct Prepared<const N: usize> {
    inverse: SMatrix<f64, N, N>,
    terms: Vec<Basis>,
    forces: Forces<N>,
    /// The plant under each of the loads to which slices refer by index.
    loaded: Vec<Self>,
}

impl Prepared<6> {
    /// Prepares a plant with rates on all six axes, zero outside its own, under known forces.
    ///
    /// # Errors
    /// [`Error::Plant`] if M cannot be inverted.
    pub(crate) fn of_six(plant: &Plant, load: Option<&Load>) -> Result<Self, Error> {
        Self::on(std::array::from_fn(Some), plant, load)
    }

    /// Returns M, zero outside the plant's axes.
    pub(crate) fn mass(&self) -> &Matrix6<f64> {
        &self.forces.mass
    }
}

impl<const N: usize> Prepared<N> {
    /// Prepares a plant.
    ///
    /// # Errors
    /// [`Error::Plant`] if the plant has more than N axes or M cannot be inverted.
    pub(crate) fn new(plant: &Plant) -> Result<Self, Error> {
        Self::with_load(plant, None)
    }

    /// Prepares a plant for slices under known forces.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn with_loads(plant: &Plant, loads: &[Load]) -> Result<Self, Error> {
        let prepare = |load: &Load| Self::with_load(plant, Some(load));
        let loaded = loads.iter().map(prepare).collect::<Result<_, Error>>()?;
        Ok(Self { loaded, ..Self::new(plant)? })
    }

    /// Returns the plant under the known forces of a slice.
    pub(crate) fn under(&self, load: Option<usize>) -> &Self {
        load.and_then(|load| self.loaded.get(load)).unwrap_or(self)
    }

    fn with_load(plant: &Plant, load: Option<&Load>) -> Result<Self, Error> {
        let axes = std::array::from_fn(|i| plant.axes().get(i).map(|dof| dof.index()));
        Self::on(axes, plant, load)
    }

    fn on(axes: [Option<usize>; N], plant: &Plant, load: Option<&Load>) -> Result<Self, Error> {
        let mut forces = Forces::new(plant, axes);
        load.iter().for_each(|load| forces.add(load));
        let places: Option<Vec<usize>> =
            plant.axes().iter().map(|dof| forces.place(*dof)).collect();
        let places = places.ok_or_else(|| {
            let reason = format!("has more than {N} axes");
            Error::Plant { axes: plant.structure().name(), reason }
        })?;
        let of_axes = inverse_under(plant, load)?;
        let mut inverse = SMatrix::zeros();
        for (i, on) in places.iter().enumerate() {
            for (j, of) in places.iter().enumerate() {
                inverse[(*on, *of)] = of_axes[(i, j)];
            }
        }
        let terms = plant.structure().terms().to_vec();
        Ok(Self { inverse, terms, forces, loaded: Vec::new() })
    }

    /// Sets the coefficients of the same terms, without allocating; returns false if M cannot be
    /// inverted, and then only the forces have changed.
    pub(crate) fn renumber(&mut self, coefficients: &[f64]) -> bool
    where
        nalgebra::Const<N>: nalgebra::DimMin<nalgebra::Const<N>, Output = nalgebra::Const<N>>,
    {
        self.forces.set(&self.terms, coefficients);
        let mass = SMatrix::<f64, N, N>::from_fn(|i, j| match (self.axes()[i], self.axes()[j]) {
            (Some(i), Some(j)) => self.forces.mass[(i, j)],
            _ => f64::from(u8::from(i == j)),
        });
        let Some(mut inverse) = mass.try_inverse() else { return false };
        for place in (0..N).filter(|place| self.axes()[*place].is_none()) {
            inverse[(place, place)] = 0.0;
        }
        self.inverse = inverse;
        true
    }

    /// Returns the plant's axes of a vector of six.
    pub(crate) fn on_axes(&self, six: &Vector6<f64>) -> SVector<f64, N> {
        self.forces.on_axes(six)
    }

    /// Writes the entries of the plant's axes, and leaves the others.
    pub(crate) fn put(&self, x: &[f64], six: &mut Vector6<f64>) {
        for (axis, &x) in self.axes().iter().zip(x) {
            if let Some(axis) = axis {
                six[*axis] = x;
            }
        }
    }

    /// Returns the axis of ν at each index.
    pub(crate) fn axes(&self) -> &[Option<usize>; N] {
        &self.forces.axes
    }

    /// Returns M⁻¹, shape (N, N).
    pub(crate) fn inverse(&self) -> &SMatrix<f64, N, N> {
        &self.inverse
    }

    /// Returns the number of coefficients.
    pub(crate) fn count(&self) -> usize {
        self.terms.len()
    }

    /// Returns ν̇_r = M⁻¹ (τ − n); `velocity` has all six axes, `force` the plant's.
    pub(crate) fn rate(
        &self,
        velocity: &Vector6<f64>,
        down_body: &Vector3<f64>,
        force: &SVector<f64, N>,
        signals: &[f64],
    ) -> SVector<f64, N> {
        let n = self.forces.at(velocity, down_body, signals);
        apply(&self.inverse, &(force - n))
    }

    /// Returns ∂ν̇/∂ν of the plant's axes, shape (N, N).
    pub(crate) fn slope(&self, velocity: &Vector6<f64>, signals: &[f64]) -> SMatrix<f64, N, N> {
        times(&self.inverse, &-self.forces.slope(velocity, signals))
    }

    /// Returns ∂ν̇/∂k of the plant's axes, k being the world's down in body axes; shape (N, 3).
    pub(crate) fn slope_by_down(&self) -> SMatrix<f64, N, 3> {
        SMatrix::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(|change| {
            apply(&self.inverse, &self.on_axes(&self.forces.change_by_down(&change)))
        }))
    }

    /// Writes ∂ν̇/∂θ_k = −M⁻¹ Y_k(ν̇, ν, η) of every coefficient to `columns`.
    pub(crate) fn by_coefficient(
        &self,
        velocity: &Vector6<f64>,
        down_body: &Vector3<f64>,
        rate: &SVector<f64, N>,
        signals: &[f64],
        columns: &mut [SVector<f64, N>],
    ) {
        let forces = &self.forces;
        let mut acceleration = Vector6::zeros();
        self.put(rate.as_slice(), &mut acceleration);
        let at = Instant { acceleration, velocity: *velocity, down_body: *down_body };
        for (term, column) in self.terms.iter().zip(columns) {
            *column = match *term {
                // A product acts on one row only, so that a column of M⁻¹ suffices.
                Basis::Product(on, product) => match forces.place(on) {
                    Some(place) => self.inverse.column(place) * -product.value(velocity),
                    None => SVector::zeros(),
                },
                // Momentum along one axis does not act on it.
                Basis::Mass(..) if !forces.turns_momentum => {
                    apply(&self.inverse, &-self.on_axes(&term.inertial(&at.acceleration)))
                }
                _ => {
                    let race = forces.race(term);
                    let y = forces.structure.regressor_in_race(term, &at, signals, race);
                    apply(&self.inverse, &-self.on_axes(&y))
                }
            };
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::Surface;
    use crate::motion::down_body;
    use crate::plant::{Effect, EffectForce, Foil, Symmetry};

    /// The rudder's angle, rad.
    const SIGNALS: [f64; 1] = [0.2];

    /// Error of central differences over 1e-6 of numbers of order one to a hundred.
    const DIFFERENCE: f64 = 1e-6;

    pub(crate) fn vehicle() -> Plant {
        let mut structure = Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six");
        for term in ["sway: r", "yaw: v", "sway: |r|r", "yaw: |v|r", "surge: vr", "heave: 1"] {
            structure = structure.with(term.parse().expect("a term")).expect("fits");
        }
        let value = |term: &Basis| match term {
            Basis::Mass(i, j) if i == j => 10.0 + 3.0 * i.index() as f64,
            Basis::Mass(i, j) => 0.3 * (i.index() as f64) - 0.2 * (j.index() as f64),
            Basis::Product(on, product) => {
                1.5 + on.index() as f64 + product.factors().count() as f64
            }
            Basis::WeightExcess => -2.0,
            Basis::Lever(_) => 6.6,
            Basis::One(_) | Basis::Effect(_) => 0.7,
        };
        let coefficients = structure.terms().iter().map(value).collect();
        Plant::new(structure, coefficients).expect("possible")
    }

    /// Returns the vehicle with a rudder.
    fn with_rudder() -> Plant {
        let plant = vehicle();
        let foil = Foil {
            kind: Surface::Rudder,
            name: "rudder".to_owned(),
            position_m: [-0.7, 0.0, 0.1],
            axis: [0.0, 0.0, 1.0],
            stall_rad: None,
        };
        let lift = Effect {
            name: "rudder.lift".to_owned(),
            force: EffectForce::Lift { foil, propeller_ahead: None },
        };
        let structure = plant.structure().clone().with_effect(lift, true).expect("fits");
        let coefficients = plant.coefficients().iter().copied().chain([3.0]).collect();
        Plant::new(structure, coefficients).expect("possible")
    }

    fn motion() -> (Vector6<f64>, Vector3<f64>, SVector<f64, 6>) {
        let velocity = Vector6::new(0.8, -0.3, 0.2, 0.5, -0.9, 1.1);
        (velocity, down_body(0.3, -0.4), SVector::from([10.0, -5.0, 3.0, 0.5, -0.2, 2.0]))
    }

    #[test]
    fn derivatives_are_those_of_the_rate() {
        let plant = with_rudder();
        let prepared = Prepared::<6>::new(&plant).expect("six axes");
        let (velocity, down, force) = motion();
        let slope = prepared.slope(&velocity, &SIGNALS);
        for j in 0..6 {
            let at = |step: f64| {
                let mut moved = velocity;
                moved[j] += step;
                prepared.rate(&moved, &down, &force, &SIGNALS)
            };
            let found = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((found - slope.column(j)).amax() < DIFFERENCE, "{j}");
        }
        let slope = prepared.slope_by_down();
        for j in 0..3 {
            let at = |step: f64| {
                let mut moved = down;
                moved[j] += step;
                prepared.rate(&velocity, &moved, &force, &SIGNALS)
            };
            let found = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((found - slope.column(j)).amax() < DIFFERENCE, "down, {j}");
        }
        let rate = prepared.rate(&velocity, &down, &force, &SIGNALS);
        let mut columns = vec![SVector::zeros(); prepared.count()];
        prepared.by_coefficient(&velocity, &down, &rate, &SIGNALS, &mut columns);
        for (k, column) in columns.iter().enumerate() {
            let at = |step: f64| {
                let mut moved = plant.coefficients().to_vec();
                moved[k] += step;
                let moved = Plant::new(plant.structure().clone(), moved).expect("possible");
                Prepared::<6>::new(&moved).expect("six").rate(&velocity, &down, &force, &SIGNALS)
            };
            let found = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((found - column).amax() < DIFFERENCE, "{}", plant.structure().terms()[k]);
        }
    }

    #[test]
    fn momentum_along_one_axis_does_not_act_on_it() {
        let velocity = Vector6::new(0.7, -0.4, 0.2, 0.3, -0.5, 0.6);
        for axis in 0..6 {
            let mass = Matrix6::from_fn(|i, j| if i == axis && j == axis { 20.0 } else { 0.0 });
            assert_eq!(kirchhoff(&(mass * velocity), &velocity)[axis], 0.0);
            assert_eq!(kirchhoff_slope(&mass, &velocity)[(axis, axis)], 0.0);
        }
    }

    #[test]
    fn the_regressors_add_up_to_the_force() {
        let plant = with_rudder();
        let prepared = Prepared::<6>::new(&plant).expect("six axes");
        let (velocity, down, force) = motion();
        let rate = prepared.rate(&velocity, &down, &force, &SIGNALS);
        let at = Instant { acceleration: rate, velocity, down_body: down };
        let terms = plant.structure().terms().iter().zip(plant.coefficients());
        let regressor = |term| plant.structure().regressor(term, &at, &SIGNALS);
        let sum: Vector6<f64> = terms.map(|(term, value)| *value * regressor(term)).sum();
        assert!((sum - Vector6::from(force)).amax() < 1e-9);
    }
}
