//! Prior plants of a vehicle before the trial.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use seaplant::exchange::{Actuation, Draws, Origin, PlantModel};
use seaplant::plant::{Basis, GRAVITY, Plant, Product, RigidBody, Structure, Symmetry};
use seaplant::random::normal;
use seaplant::results::Parameter;
use seaplant::{Dof, Vehicle, spoken};

use crate::Error;

/// A plant with prior uncertainty.
#[derive(Clone, Debug)]
pub struct Prior {
    /// The plant with the terms of a fit, with thrusters.
    pub model: PlantModel,
    /// Names and covariance of coefficients from earlier trials; none without results.
    pub known: Option<(Vec<String>, DMatrix<f64>)>,
    /// Standard deviation of each coefficient: relative, for a random factor, or absolute, for one
    /// that may be zero.
    pub(crate) spread: Vec<Spread>,
    /// The source of the numbers, in words.
    pub words: String,
    /// Relative standard deviation of thrust that motion does not reveal.
    pub thrust_part: f64,
}

/// The distribution of a coefficient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Spread {
    /// A factor e^(σ n).
    Factor(f64),
    /// An addend σ n.
    Amount(f64),
}

/// Relative spread of hull formulas: of effective mass, drag and righting moment.
const OF_FORMULAS: [f64; 3] = [0.25, 0.5, 0.4];
/// Relative spread of published tables, whose authors disagree.
const OF_TABLES: [f64; 3] = [0.15, 0.3, 0.3];
/// W − B of a trimmed vehicle, as a fraction of its weight.
const TRIM: f64 = 0.005;
/// Assumed lag of thrusters without a stated one, s.
const USUAL_LAG_S: f64 = 0.15;
/// Drag coefficient of a hull's box in a flow across one of its faces.
///
/// # Source
/// [Faltinsen1990, §7], for bluff bodies.
const DRAG_COEFFICIENT: f64 = 1.0;
/// Speed at which linear equals quadratic drag, m/s and rad/s.
const LINEAR_UP_TO: f64 = 0.1;
/// Fraction of the inertia of the water in the hull's volume that turns with the hull.
const TURNING_PART: f64 = 0.25;
/// Distance of the centre of gravity below that of buoyancy, as a fraction of the hull's height.
const RIGHTING_PART: f64 = 0.05;

impl Prior {
    /// Builds a prior by hull formulas from a vehicle's mass, size and thrusters.
    ///
    /// ```text
    /// m_i = m + k_i ρ V,   k of the ellipsoid in the hull's box,   V = √(m/ρ · π/6 L W H)
    /// d_Q = ½ ρ C_D A,   C_D = 1;   d_L = d_Q · 0.1 m/s
    /// ```
    ///
    /// Moments follow from strips of the box's faces. The plant has the axes with thrust, or
    /// `axes`.
    ///
    /// # Errors
    /// [`Error::Prior`] for a vehicle without mass or size, or with numbers that no vehicle has.
    ///
    /// # Source
    /// [Lamb1932, § 114 and 115] for added mass.
    ///
    /// # Example
    /// ```
    /// use seaplant::{Dof, QuadraticThrust, ThrustCurve, Thruster, ThrusterInput, Vehicle};
    /// use seaplant_plan::Prior;
    /// let law = QuadraticThrust { forward: 40.0, reverse: 30.0, ..QuadraticThrust::default() };
    /// let curve = ThrustCurve::Quadratic { input: ThrusterInput::Command, law };
    /// let main = Thruster::new("main", [0.0; 3], [1.0, 0.0, 0.0], curve)?;
    /// let vehicle = Vehicle {
    ///     name: "sled".to_owned(),
    ///     dry_mass_kg: Some(100.0),
    ///     size_m: Some([1.2, 0.5, 0.5]),
    ///     thrusters: vec![main],
    ///     ..Vehicle::default()
    /// };
    /// let prior = Prior::of_vehicle(&vehicle, &[])?;
    /// assert_eq!(prior.model.plant.axes(), [Dof::Surge]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of_vehicle(vehicle: &Vehicle, axes: &[Dof]) -> Result<Self, Error> {
        let hull = Hull::new(vehicle)?;
        let axes = if axes.is_empty() { hull.pushed_axes(vehicle) } else { axes.to_vec() };
        if axes.is_empty() {
            let reason = format!(
                "`{}` has no thrusters with a known curve; add [[thruster]] with position, direction and curve",
                vehicle.name
            );
            return Err(Error::NoMotion { reason });
        }
        let structure = Structure::of(&axes, Symmetry::PortStarboard)?;
        let value = |term: &Basis| hull.coefficient(term);
        let coefficients = structure.terms().iter().map(value).collect();
        let plant = Plant::new(structure, coefficients)?;
        let words = format!(
            "hull formulas for {} kg and {} × {} × {} m: masses are believed to {:.0} %, drag to {:.0} %",
            hull.mass,
            hull.size[0],
            hull.size[1],
            hull.size[2],
            100.0 * OF_FORMULAS[0],
            100.0 * OF_FORMULAS[1]
        );
        let model = PlantModel {
            name: vehicle.name.clone(),
            plant,
            covariance: None,
            intervals: BTreeMap::new(),
            rigid_body: vehicle.rigid_body,
            dry_mass_kg: Some(hull.mass),
            size_m: vehicle.size_m,
            buoyancy: vehicle.buoyancy,
            thrusters: vehicle.thrusters.clone(),
            max_rpm: None,
            actuation: BTreeMap::new(),
            driven: BTreeMap::new(),
            disturbances: BTreeMap::new(),
            origin: Origin::default(),
            judgements: Vec::new(),
            notes: Vec::new(),
        };
        Self::of_parts(model, words, OF_FORMULAS)
    }

    /// Builds a prior from a published table or plant file, or from results, whose covariance is
    /// the prior's.
    ///
    /// # Errors
    /// [`Error::Prior`] for a plant that reads rudders, fins or wind; [`Error::Axis`] for an axis
    /// that it lacks.
    pub fn of_model(model: &PlantModel, axes: &[Dof]) -> Result<Self, Error> {
        if !model.plant.structure().signals().is_empty() {
            return Err(Error::Prior {
                name: model.name.clone(),
                found: "its plant reads rudders, fins, wind or propellers of unknown strength"
                    .into(),
                advice: "plan for a plant that thrusters of known curves drive".to_owned(),
            });
        }
        if let Some(dof) = axes.iter().find(|dof| !model.plant.axes().contains(dof)) {
            let known: Vec<&str> = model.plant.axes().iter().map(|dof| dof.name()).collect();
            return Err(Error::Axis { dof: *dof, known: known.join(", ") });
        }
        let embedded = PlantModel { plant: fitted(&model.plant, axes)?, ..model.clone() };
        let source = &model.origin.source;
        match &model.covariance {
            Some(covariance) => {
                let words = format!("{source}: today's estimates with their covariance");
                let known = known(model, covariance);
                let model = PlantModel { covariance: None, ..embedded };
                let spread = spread_of_covariance(&model.plant, &known);
                let prior = Self::of_parts(model, words, OF_TABLES)?;
                Ok(Self { known: Some(known), spread, ..prior })
            }
            None => {
                let words = format!(
                    "{source}: masses are believed to {:.0} %, drag to {:.0} %",
                    100.0 * OF_TABLES[0],
                    100.0 * OF_TABLES[1]
                );
                Self::of_parts(embedded, words, OF_TABLES)
            }
        }
    }

    fn of_parts(mut model: PlantModel, words: String, parts: [f64; 3]) -> Result<Self, Error> {
        let has_lag = |a: &Actuation| a.lag.is_some() || a.force_lag.is_some();
        if !model.actuation.values().any(has_lag) {
            let lag = Parameter {
                value: USUAL_LAG_S,
                std: USUAL_LAG_S,
                low95: 0.0,
                high95: 3.0 * USUAL_LAG_S,
                unit: "s".to_owned(),
            };
            let of =
                |dof: &Dof| (*dof, Actuation { lag: Some(lag.clone()), ..Actuation::default() });
            model.actuation = model.plant.axes().iter().map(of).collect();
        }
        let weight = model.weight().unwrap_or(0.0);
        let spread = |(term, value): (&Basis, &f64)| match term {
            _ if *value == 0.0 && *term != Basis::WeightExcess => Spread::Amount(0.0),
            Basis::Mass(..) => Spread::Factor(parts[0]),
            Basis::Lever(_) => Spread::Factor(parts[2]),
            Basis::WeightExcess => Spread::Amount(TRIM * weight),
            _ => Spread::Factor(parts[1]),
        };
        let terms = model.plant.structure().terms().iter();
        let spread = terms.zip(model.plant.coefficients()).map(spread).collect();
        let off = |part: f64, thruster: &seaplant::Thruster| {
            part.max(thruster.uncertainty.forward).max(thruster.uncertainty.reverse)
        };
        let thrust_part = model.thrusters.iter().fold(0.0, off);
        Ok(Self { model, known: None, spread, words, thrust_part })
    }

    /// Returns plants drawn from the prior, its mean first.
    pub(crate) fn draws(&self, count: usize, seed: u64) -> Result<Vec<Plant>, Error> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let own = &self.model.plant;
        let mut plants = vec![own.clone()];
        let mut tries = 0;
        while plants.len() < count && tries < MOST_TRIES {
            tries += 1;
            plants.extend(self.drawn(own, &mut random));
        }
        Ok(plants)
    }

    /// Draws one plant, if it is physical; masses of two axes keep their correlation.
    fn drawn(&self, own: &Plant, random: &mut ChaCha8Rng) -> Option<Plant> {
        let structure = own.structure();
        let moves: Vec<f64> = self.spread.iter().map(|_| normal(random)).collect();
        let factor = |dof: Dof| {
            let k = structure.index_of(&Basis::Mass(dof, dof))?;
            let Spread::Factor(std) = self.spread[k] else { return Some(1.0) };
            Some((std * moves[k]).exp())
        };
        let of = |(k, term): (usize, &Basis)| {
            let value = own.coefficients()[k];
            match (term, self.spread[k]) {
                (Basis::Mass(i, j), Spread::Factor(_)) => {
                    Some(value * (factor(*i)? * factor(*j)?).sqrt())
                }
                (_, Spread::Factor(std)) => Some(value * (std * moves[k]).exp()),
                (_, Spread::Amount(std)) => Some(value + std * moves[k]),
            }
        };
        let coefficients: Option<Vec<f64>> = structure.terms().iter().enumerate().map(of).collect();
        let drawn = Plant::new(structure.clone(), coefficients?).ok()?;
        self.has_added_mass(&drawn).then_some(drawn)
    }

    /// Returns whether water adds to the stated mass in every direction, or takes no more from it than for the
    /// prior's mean: whether `M − M_RB ⪰ 0`.
    fn has_added_mass(&self, drawn: &Plant) -> bool {
        let axes = self.model.plant.axes();
        let rigid_body = self.model.rigid_body.map(|body| body.mass_matrix());
        let dry_mass_kg = self.model.dry_mass_kg.unwrap_or(0.0);
        let rigid = DMatrix::from_fn(axes.len(), axes.len(), |i, j| match rigid_body {
            Some(body) => body[(axes[i].index(), axes[j].index())],
            None if i == j && !axes[i].is_rotation() => dry_mass_kg,
            None => 0.0,
        });
        let least = |plant: &Plant| (plant.mass_matrix() - &rigid).symmetric_eigenvalues().min();
        least(drawn) >= least(&self.model.plant).min(0.0)
    }

    /// Returns draws, or for results draws by their covariance.
    pub(crate) fn plants(&self, draws: Draws) -> Result<Vec<Plant>, Error> {
        self.draws(draws.count.max(1), draws.seed)
    }
}

/// Maximum number of attempts for a physical draw.
const MOST_TRIES: usize = 1000;

/// Returns the plant with the default terms of a fit of its axes, in addition to its own.
fn fitted(plant: &Plant, axes: &[Dof]) -> Result<Plant, Error> {
    let axes = if axes.is_empty() { plant.axes() } else { axes };
    let own = plant.structure();
    let couples = |symmetry: Symmetry| {
        own.terms().iter().all(|term| match term {
            Basis::Mass(i, j) => symmetry.couples(*i, *j),
            _ => true,
        })
    };
    let symmetric = couples(Symmetry::PortStarboard);
    let symmetry = if symmetric { Symmetry::PortStarboard } else { Symmetry::None };
    let mut structure = Structure::of(axes, symmetry)?;
    for term in own.terms() {
        let stays = own.axes_of(term).iter().all(|dof| axes.contains(dof));
        if stays && structure.index_of(term).is_none() {
            structure = structure.with(*term)?;
        }
    }
    let value = |term: &Basis| plant.coefficient(term).unwrap_or(0.0);
    let coefficients = structure.terms().iter().map(value).collect();
    Ok(Plant::new(structure, coefficients)?)
}

fn known(model: &PlantModel, covariance: &DMatrix<f64>) -> (Vec<String>, DMatrix<f64>) {
    (model.plant.structure().names(), covariance.clone())
}

fn spread_of_covariance(
    plant: &Plant,
    (names, covariance): &(Vec<String>, DMatrix<f64>),
) -> Vec<Spread> {
    let std = |name: &String| {
        let k = names.iter().position(|own| own == name)?;
        Some(covariance[(k, k)].max(0.0).sqrt())
    };
    let structure = plant.structure();
    let of = |(term, value): (&Basis, &f64)| {
        let std = std(&structure.name_of(term)).unwrap_or(0.0);
        let is_own = matches!(term, Basis::Mass(i, j) if i == j)
            || matches!(term, Basis::Product(on, product)
                if [Product::linear(*on), Product::quadratic(*on)].contains(product));
        match is_own && *value > 0.0 {
            true => Spread::Factor((std / value).min(1.0)),
            false => Spread::Amount(if matches!(term, Basis::Mass(..)) { 0.0 } else { std }),
        }
    };
    structure.terms().iter().zip(plant.coefficients()).map(of).collect()
}

/// Hull data for the formulas.
struct Hull {
    mass: f64,
    size: [f64; 3],
    density: f64,
    rigid: nalgebra::Matrix6<f64>,
    /// Righting lever times weight, N m.
    righting: f64,
    weight_excess: f64,
}

impl Hull {
    fn new(vehicle: &Vehicle) -> Result<Self, Error> {
        let refuse = |found: &str, advice: &str| Error::Prior {
            name: vehicle.name.clone(),
            found: found.to_owned(),
            advice: advice.to_owned(),
        };
        let mass = vehicle.rigid_body.as_ref().map(RigidBody::mass_kg).or(vehicle.dry_mass_kg);
        let Some(mass) = mass.filter(|mass| *mass > 0.0 && mass.is_finite()) else {
            return Err(refuse("states no mass above zero", "give dry_mass_kg, its mass in air"));
        };
        let positive = |size: &[f64; 3]| size.iter().all(|x| *x > 0.0 && x.is_finite());
        let Some(size) = vehicle.size_m.filter(positive) else {
            return Err(refuse(
                "states no size",
                "give size_m = [length, width, height] of the hull, m, or plan from a published table",
            ));
        };
        let density = vehicle.water_density_kg_m3;
        let room = density * size.iter().product::<f64>();
        if mass > HEAVIEST * room || mass < LIGHTEST * room {
            return Err(refuse(
                &format!("weighs {mass} kg in a box that holds {} kg of water", spoken(room)),
                "check dry_mass_kg (kg, not g) and size_m (m, not mm)",
            ));
        }
        let [l, w, h] = size;
        let rigid = match &vehicle.rigid_body {
            Some(body) => body.mass_matrix(),
            None => {
                let inertia = Matrix3::from_diagonal(
                    &(nalgebra::Vector3::new(w * w + h * h, l * l + h * h, l * l + w * w)
                        * (mass / 12.0)),
                );
                let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| inertia[(i, j)]));
                RigidBody::new(mass, [0.0; 3], rows)?.mass_matrix()
            }
        };
        let (weight_excess, righting) = match (&vehicle.buoyancy, &vehicle.rigid_body) {
            (Some(buoyancy), Some(body)) => {
                let (excess, lever) = buoyancy.restoring(body);
                (excess, lever.z)
            }
            _ => (0.0, GRAVITY * mass * RIGHTING_PART * h),
        };
        Ok(Self { mass, size, density, rigid, righting, weight_excess })
    }

    /// Returns the axes that thrusters can drive separately: of six, or if they cannot control roll
    /// and pitch, of the other four, with these two held by the hull.
    fn pushed_axes(&self, vehicle: &Vehicle) -> Vec<Dof> {
        let tilts = [Dof::Roll, Dof::Pitch];
        let of_six = pushed_alone(vehicle, &Dof::ALL);
        if tilts.iter().all(|dof| of_six.contains(dof)) {
            return of_six;
        }
        pushed_alone(vehicle, &[Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw])
    }

    fn coefficient(&self, term: &Basis) -> f64 {
        match term {
            Basis::Mass(i, j) => {
                let own = self.rigid[(i.index(), j.index())];
                if i == j { own + self.added(*i) } else { own }
            }
            Basis::WeightExcess => self.weight_excess,
            Basis::Lever(2) => self.righting,
            Basis::Product(on, product) if *product == Product::quadratic(*on) => self.drag(*on),
            Basis::Product(on, product) if *product == Product::linear(*on) => {
                LINEAR_UP_TO * self.drag(*on)
            }
            _ => 0.0,
        }
    }

    /// Returns the volume of the hull and the water in it, m³: between the displaced volume and the
    /// ellipsoid in the box.
    fn volume(&self) -> f64 {
        let ellipsoid = std::f64::consts::PI / 6.0 * self.size.iter().product::<f64>();
        (self.mass / self.density * ellipsoid).sqrt()
    }

    fn added(&self, dof: Dof) -> f64 {
        let [a, b, c] = self.size.map(|x| 0.5 * x);
        let [alpha, beta, gamma] = ellipsoid_factors([a, b, c]);
        let water = self.density * self.volume();
        let along = |factor: f64| factor / (2.0 - factor) * water;
        let about = |(x, y): (f64, f64), (fx, fy): (f64, f64)| {
            let (minus, plus) = (x * x - y * y, x * x + y * y);
            let below = 2.0 * minus + plus * (fx - fy);
            let round = if below.abs() < 1e-9 * plus {
                0.0
            } else {
                0.2 * water * minus * minus * (fy - fx) / below
            };
            round + TURNING_PART * water * plus / 3.0
        };
        match dof {
            Dof::Surge => along(alpha),
            Dof::Sway => along(beta),
            Dof::Heave => along(gamma),
            Dof::Roll => about((b, c), (beta, gamma)),
            Dof::Pitch => about((a, c), (alpha, gamma)),
            Dof::Yaw => about((a, b), (alpha, beta)),
        }
    }

    /// Returns d_Q: of a face across a translation; of strips of two faces about an axis, `½ ρ C_D
    /// ∫|x|³ h dx = ½ ρ C_D h l⁴/32`.
    fn drag(&self, dof: Dof) -> f64 {
        let [l, w, h] = self.size;
        let of = 0.5 * self.density * DRAG_COEFFICIENT;
        let strips = |across: f64, long: f64| across * long.powi(4) / 32.0;
        of * match dof {
            Dof::Surge => w * h,
            Dof::Sway => l * h,
            Dof::Heave => l * w,
            Dof::Roll => strips(l, w) + strips(l, h),
            Dof::Pitch => strips(w, l) + strips(w, h),
            Dof::Yaw => strips(h, l) + strips(h, w),
        }
    }
}

/// Returns the axes among some that thrusters can drive without driving the others.
fn pushed_alone(vehicle: &Vehicle, among: &[Dof]) -> Vec<Dof> {
    let thrusters = &vehicle.thrusters;
    let wrenches = DMatrix::from_fn(among.len(), thrusters.len(), |row, k| {
        thrusters[k].unit_wrench()[among[row].index()]
    });
    let Ok(share) = wrenches.clone().pseudo_inverse(1e-6 * wrenches.amax().max(1e-12)) else {
        return Vec::new();
    };
    let made = wrenches * share;
    let alone = |(row, dof): (usize, &Dof)| ((made[(row, row)] - 1.0).abs() < 1e-3).then_some(*dof);
    among.iter().enumerate().filter_map(alone).collect()
}

/// Largest ratio of a vehicle's mass to that of the water in its box.
const HEAVIEST: f64 = 3.0;
/// The smallest: a glider in the box of its wings has some 0.05.
const LIGHTEST: f64 = 0.005;

/// Computes Lamb's α, β, γ of an ellipsoid: `a b c ∫₀^∞ ds / ((a² + s) Δ)`, Δ =
/// √((a²+s)(b²+s)(c²+s)).
///
/// With s = t²/(1 − t)² the integrand is smooth over 0 to 1; Simpson's rule with 400 panels is
/// accurate to 1e-6 for ratios of axes up to a hundred.
fn ellipsoid_factors(axes: [f64; 3]) -> [f64; 3] {
    const PANELS: usize = 400;
    let scale = axes.iter().copied().fold(0.0, f64::max);
    let square = axes.map(|x| (x / scale).powi(2));
    let volume: f64 = axes.iter().map(|x| x / scale).product();
    let integrand = |t: f64, k: usize| {
        let s = (t / (1.0 - t)).powi(2);
        let by = 2.0 * t / (1.0 - t).powi(3);
        let delta: f64 = square.iter().map(|x| x + s).product::<f64>().sqrt();
        by / ((square[k] + s) * delta)
    };
    [0, 1, 2].map(|k| {
        let h = 1.0 / PANELS as f64;
        let at = |i: usize| if i == PANELS { 0.0 } else { integrand(i as f64 * h, k) };
        let sum: f64 = (0..=PANELS)
            .map(|i| {
                let weight = if i == 0 || i == PANELS { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
                weight * at(i)
            })
            .sum();
        volume * sum * h / 3.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sphere has 2/3 each [Lamb1932, § 92], any ellipsoid 2 together [§ 114], and a long spheroid of
    /// 1 to 6 k = 0.045 and 0.918 [§ 115].
    #[test]
    fn factors_of_ellipsoids_are_those_of_lamb() {
        for factor in ellipsoid_factors([2.0; 3]) {
            assert!((factor - 2.0 / 3.0).abs() < 1e-6, "{factor}");
        }
        let long = ellipsoid_factors([6.0, 1.0, 1.0]);
        assert!((long.iter().sum::<f64>() - 2.0).abs() < 1e-6);
        let k = long.map(|factor| factor / (2.0 - factor));
        assert!((k[0] - 0.045).abs() < 5e-4 && (k[1] - 0.918).abs() < 1e-3, "{k:?}");
    }

    /// Of a box twice as long as it is wide, surge has a fifth of added mass: a quarter less of both is less than
    /// the vehicle weighs.
    #[test]
    fn a_drawn_vehicle_is_no_lighter_in_water_than_in_air() {
        let vehicle = Vehicle {
            name: "x".into(),
            dry_mass_kg: Some(250.0),
            size_m: Some([1.2, 0.6, 0.6]),
            ..Vehicle::default()
        };
        let axes = [Dof::Surge, Dof::Sway, Dof::Yaw];
        let prior = Prior::of_vehicle(&vehicle, &axes).expect("a prior");
        let draws = prior.draws(200, 1).expect("draws");
        assert_eq!(draws.len(), 200);
        for plant in &draws {
            let least = plant.mass_matrix().view((0, 0), (2, 2)).symmetric_eigenvalues().min();
            assert!(least >= 250.0, "{least}");
        }
        let heaviest = draws.iter().map(|plant| plant.mass_matrix()[(0, 0)]).fold(0.0, f64::max);
        assert!(heaviest > 1.5 * draws[0].mass_matrix()[(0, 0)], "{heaviest}");
    }

    #[test]
    fn a_vehicle_without_size_or_with_impossible_mass_is_refused() {
        let vehicle = Vehicle { name: "x".into(), dry_mass_kg: Some(10.0), ..Vehicle::default() };
        let error = Prior::of_vehicle(&vehicle, &[]).expect_err("no size").to_string();
        assert!(error.contains("size_m"), "{error}");
        let vehicle = Vehicle { size_m: Some([0.1; 3]), ..vehicle };
        let error = Prior::of_vehicle(&vehicle, &[]).expect_err("lead").to_string();
        assert!(error.contains("weighs 10 kg in a box that holds 1.03 kg of water"), "{error}");
        let vehicle = Vehicle { size_m: Some([400.0, 300.0, 200.0]), ..vehicle };
        let error = Prior::of_vehicle(&vehicle, &[]).expect_err("millimetres").to_string();
        assert!(error.contains("2.46e10 kg of water") && error.contains("m, not mm"), "{error}");
    }
}
