//! The one system that every solver sees, nondimensional, in relative coordinates.
//!
//! ```text
//! Om^2 q'' + Om Gam q' + kappa f(W q - e, Om (W q' - nu de/dphase), phase) = Q(tau),    phase = nu tau
//! ```
//!
//! n coordinates, e connections. tau in [0, 2 pi) is the phase of the response, Om = omega / (nu omega_c), velocities are
//! v = Om q' = dq/d(omega_c t). Rook & Singh (1995), eq. (4a) multiplied by Om^2; loops and transmission error beyond it.

mod alike;
mod course;
mod evaluate;
mod memory;
mod mount;
mod stops;

pub use course::{Course, Moment};
pub use evaluate::Scratch;
pub use mount::Mount;
pub use stops::Stops;

use crate::element::Element;
use crate::error::SolveError;
use crate::numeric::broken_line::BrokenLine;
use crate::numeric::fraction::gcd;
use crate::numeric::growth::Growth;
use crate::numeric::nonzeros::{Nonzeros, sparse_dot};
use crate::numeric::periodic::Periodic;
use nalgebra::{DMatrix, DVector};

/// Relation of a load to its series.
#[derive(Debug, Clone, PartialEq)]
pub enum LoadKind {
    /// Q += direction series(phase).
    Value,
    /// Q += direction nu Om d(series)/dphase: a dashpot parallel to a transmission error.
    Rate,
    /// Q += direction d(frequency series)/d(omega_c t): an acceleration, from an angle per phase.
    Acceleration,
    /// Q += direction growth(speed of the reference) series(ratio phase).
    Orders {
        /// 1 for whole multiples of the base order; anything where no period is needed.
        ratio: f64,
        /// Amplitude against the speed of the reference over omega_c.
        growth: Growth,
    },
    /// Q += direction line(omega_c t) along a course; elsewhere its value at time 0, which is the mean of the series.
    Timed(BrokenLine),
}

impl LoadKind {
    /// Whether nothing of it acts at rest, whatever the mean of the series.
    pub fn is_free_of_rest(&self) -> bool {
        matches!(self, LoadKind::Rate | LoadKind::Acceleration)
    }
}

/// One excitation: a direction in relative coordinates and its series.
#[derive(Debug, Clone)]
pub struct LoadSource {
    /// n values.
    pub direction: DVector<f64>,
    /// Periodic in the excitation phase.
    pub series: Periodic,
    /// Value or rate.
    pub kind: LoadKind,
}

/// The balance of forces in which a train rests, free of inertias.
///
/// ```text
/// W^T diag(k) f(W q - mean(e)) = sum over loads of mean F
/// ```
///
/// The equation of motion says the same multiplied by the inverse of the generalised masses, kappa = A W^T diag(k) and Q = A F:
/// a nearly massless body then takes digits away that the balance has.
#[derive(Debug, Clone)]
pub struct Balance {
    /// k, e values: K l^2 \[J\].
    pub stiffness: Vec<f64>,
    /// F of a unit of every load, n values each: those of rates, which rest does not know, are 0.
    pub loads: Vec<DVector<f64>>,
    /// Size of the torques on bodies per F, n values: what rounding of F is judged by.
    pub weight: DVector<f64>,
}

/// Where a train begins that motions over time strain: the same train while these bodies rest at 0.
#[derive(Debug, Clone)]
pub struct Still {
    /// Its system, in coordinates of its own; connections in the same order, with the same scales.
    pub system: Box<System>,
    /// Connection whose W q is each relative coordinate.
    pub connections: Vec<usize>,
    /// Rates of the relative coordinates at time 0, d/d(omega_c t).
    pub rates: Vec<f64>,
}

/// The system (4a). Shapes and finiteness are checked once, in `new`.
#[derive(Debug, Clone)]
pub struct System {
    damping: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    element_map: DMatrix<f64>,
    mounts: Vec<Mount>,
    loads: Vec<LoadSource>,
    balance: Option<Balance>,
    still: Option<Still>,
    omega: f64,
    subharmonic: usize,
    revolutions: usize,
    memory_count: usize,
    /// W is the identity: deformations are coordinates.
    is_tree: bool,
    course: Option<Course>,
    /// The same matrices without their zeros.
    damping_columns: Nonzeros,
    stiffness_columns: Nonzeros,
    map_rows: Nonzeros,
}

impl System {
    /// A system at Om = 1, nu = 1.
    ///
    /// `damping`: Gam, n x n; `stiffness`: kappa, n x e; `element_map`: W, e x n; e mounts; loads with n directions.
    ///
    /// # Errors
    /// Shapes that do not fit, or entries that are not finite.
    pub fn new(
        damping: DMatrix<f64>,
        stiffness: DMatrix<f64>,
        element_map: DMatrix<f64>,
        mounts: Vec<Mount>,
        loads: Vec<LoadSource>,
    ) -> Result<System, SolveError> {
        let (n, e) = (damping.nrows(), mounts.len());
        for (what, matrix, rows, columns) in [
            ("damping (Gam)", &damping, n, n),
            ("stiffness (kappa)", &stiffness, n, e),
            ("element_map (W)", &element_map, e, n),
        ] {
            if matrix.shape() != (rows, columns) {
                let found = format!("{} x {}", matrix.nrows(), matrix.ncols());
                return Err(SolveError::Shape {
                    what: what.into(),
                    found,
                    wanted: format!("{rows} x {columns}"),
                });
            }
            if matrix.iter().any(|x| !x.is_finite()) {
                return Err(SolveError::NotFinite { what: what.into() });
            }
        }
        for load in &loads {
            if load.direction.len() != n {
                let found = format!("{} values", load.direction.len());
                return Err(SolveError::Shape {
                    what: "load direction".into(),
                    found,
                    wanted: format!("{n} values"),
                });
            }
        }
        let mut system = System {
            damping_columns: Nonzeros::default(),
            stiffness_columns: Nonzeros::default(),
            map_rows: Nonzeros::default(),
            damping,
            stiffness,
            element_map,
            mounts,
            loads,
            balance: None,
            still: None,
            omega: 1.0,
            subharmonic: 1,
            revolutions: 1,
            memory_count: 0,
            is_tree: false,
            course: None,
        };
        system.index();
        Ok(system)
    }

    /// The same system with the balance of forces at rest.
    #[must_use]
    pub fn with_balance(self, balance: Balance) -> System {
        System {
            balance: Some(balance),
            ..self
        }
    }

    /// The same system with the train as it begins.
    #[must_use]
    pub fn with_still(self, still: Still) -> System {
        System {
            still: Some(still),
            ..self
        }
    }

    /// The train as it begins, where motions over time strain it: its coordinates are then bound by them.
    pub fn still(&self) -> Option<&Still> {
        self.still.as_ref()
    }

    /// The balance of forces at rest, where the system comes from a train.
    pub fn balance(&self) -> Option<&Balance> {
        self.balance.as_ref()
    }

    /// Finds the nonzero entries of the matrices again: due after every change of them.
    fn index(&mut self) {
        let (n, e) = (self.dof(), self.mounts.len());
        self.memory_count = self.mounts.iter().map(|m| m.element.memory_count()).sum();
        self.is_tree = n == e && self.element_map == DMatrix::identity(n, n);
        self.damping_columns = Nonzeros::of_columns(&self.damping);
        self.stiffness_columns = Nonzeros::of_columns(&self.stiffness);
        self.map_rows = Nonzeros::of_rows(&self.element_map);
    }

    /// n, number of relative coordinates.
    pub fn dof(&self) -> usize {
        self.damping.nrows()
    }

    /// e, number of connections.
    pub fn element_count(&self) -> usize {
        self.mounts.len()
    }

    /// Om = omega / (nu omega_c).
    pub fn omega(&self) -> f64 {
        self.omega
    }

    /// nu, periods of the excitation in one period of the response.
    pub fn subharmonic(&self) -> usize {
        self.subharmonic
    }

    /// nu Om = omega / omega_c of the base order: the rate of the phase of all series.
    pub fn excitation_frequency(&self) -> f64 {
        self.omega * self.subharmonic as f64
    }

    /// Revolutions of the reference shaft in one period of everything that excites: 1 over the base order.
    pub fn revolutions(&self) -> usize {
        self.revolutions
    }

    /// Greatest common divisor of the orders of everything that excites; 1 without excitation.
    pub fn common_order(&self) -> usize {
        let loads = self.loads.iter().map(|load| &load.series);
        let varied = self
            .mounts
            .iter()
            .filter_map(|m| m.stiffness_variation.as_ref());
        let wrong = self
            .mounts
            .iter()
            .filter_map(|m| m.transmission_error.as_ref());
        let orders = loads.chain(varied).chain(wrong).map(Periodic::common_order);
        orders.fold(0, gcd).max(1)
    }

    /// Equal parts of the response period in each of which everything that excites is the same.
    pub fn repetitions(&self) -> usize {
        self.subharmonic * self.common_order()
    }

    /// Frequency of the reference shaft over omega_c: the excitation frequency of the user.
    pub fn reference_frequency(&self) -> f64 {
        self.excitation_frequency() * self.revolutions as f64
    }

    /// Gam, n x n.
    pub fn damping(&self) -> &DMatrix<f64> {
        &self.damping
    }

    /// kappa, n x e.
    pub fn stiffness(&self) -> &DMatrix<f64> {
        &self.stiffness
    }

    /// W, e x n.
    pub fn element_map(&self) -> &DMatrix<f64> {
        &self.element_map
    }

    /// Column of Gam without its zeros: row and value.
    pub fn damping_column(&self, j: usize) -> &[(usize, f64)] {
        self.damping_columns.line(j)
    }

    /// Column of kappa without its zeros: the coordinates that a connection drives, and how.
    pub fn stiffness_column(&self, e: usize) -> &[(usize, f64)] {
        self.stiffness_columns.line(e)
    }

    /// Row of W without its zeros: the coordinates that deform a connection, and how.
    pub fn element_map_row(&self, e: usize) -> &[(usize, f64)] {
        self.map_rows.line(e)
    }

    /// (W kappa)_ab: acceleration of the deformation of connection a per force of connection b.
    pub(crate) fn mobility(&self, a: usize, b: usize) -> f64 {
        sparse_dot(self.element_map_row(a), self.stiffness_column(b))
    }

    /// Pairs of coordinates (i, j) such that coordinate j enters equation i, with repetitions.
    pub fn coupled_pairs(&self) -> Vec<(usize, usize)> {
        let mut pairs = Vec::new();
        for j in 0..self.dof() {
            pairs.extend(self.damping_column(j).iter().map(|(i, _)| (*i, j)));
        }
        for e in 0..self.element_count() {
            for (j, _) in self.element_map_row(e) {
                pairs.extend(self.stiffness_column(e).iter().map(|(i, _)| (*i, *j)));
            }
        }
        pairs
    }

    /// Whether W is the identity, as in every train without loops.
    pub fn is_tree(&self) -> bool {
        self.is_tree
    }

    /// Laws in place, one per connection.
    pub fn mounts(&self) -> &[Mount] {
        &self.mounts
    }

    /// Breakpoints of every law, ascending.
    pub fn breakpoints(&self) -> Vec<Vec<f64>> {
        let mounts = self.mounts.iter();
        mounts.map(|m| m.element.breakpoints()).collect()
    }

    /// Excitations.
    pub fn loads(&self) -> &[LoadSource] {
        &self.loads
    }

    /// Sets the excitation frequency omega / omega_c; Om follows.
    pub fn set_excitation_frequency(&mut self, frequency: f64) {
        self.omega = frequency / self.subharmonic as f64;
    }

    /// Sets the frequency of the reference shaft over omega_c; Om follows.
    pub fn set_reference_frequency(&mut self, frequency: f64) {
        self.set_excitation_frequency(frequency / self.revolutions as f64);
    }

    /// Sets the revolutions of the reference shaft in one period; the excitation frequency stays.
    pub fn set_revolutions(&mut self, revolutions: usize) {
        self.revolutions = revolutions.max(1);
    }

    /// Sets nu and keeps the excitation frequency.
    pub fn set_subharmonic(&mut self, subharmonic: usize) {
        let frequency = self.excitation_frequency();
        self.subharmonic = subharmonic.max(1);
        self.set_excitation_frequency(frequency);
    }

    /// The system with every alternating part (loads, transmission error, stiffness variation) multiplied by `share`.
    pub fn with_excitation_share(&self, share: f64) -> System {
        let mut copy = self.clone();
        let shrink = |series: &Periodic| series.scaled(share).plus((1.0 - share) * series.mean());
        for load in &mut copy.loads {
            load.series = shrink(&load.series);
        }
        for mount in &mut copy.mounts {
            for series in [
                &mut mount.stiffness_variation,
                &mut mount.transmission_error,
            ]
            .into_iter()
            .flatten()
            {
                *series = shrink(series);
            }
        }
        copy
    }

    /// The system without transmission errors: deformations are W q.
    pub fn without_transmission_errors(&self) -> System {
        let mut copy = self.clone();
        for mount in &mut copy.mounts {
            mount.transmission_error = None;
        }
        copy
    }

    /// The system with other laws in place, one per connection.
    pub fn with_mounts(&self, mounts: Vec<Mount>) -> System {
        debug_assert_eq!(mounts.len(), self.mounts.len());
        System {
            mounts,
            ..self.clone()
        }
    }

    /// The system with other excitations, whose directions have n values.
    pub fn with_loads(&self, loads: Vec<LoadSource>) -> System {
        System {
            loads,
            ..self.clone()
        }
    }

    /// The system with every law replaced by one, except those that are not springs.
    pub fn with_laws(&self, law: &dyn Element) -> System {
        let mut copy = self.clone();
        (copy.mounts.iter_mut())
            .filter(|m| m.element.is_spring())
            .for_each(|m| m.element = law.clone_box());
        copy.index();
        copy
    }

    /// The same system with one law replaced.
    pub fn with_law(&self, connection: usize, law: Box<dyn Element>) -> System {
        let mut copy = self.clone();
        copy.mounts[connection].element = law;
        copy.index();
        copy
    }

    /// Slopes of the laws in full contact, e values: 1, and 0 of those that are not springs.
    pub fn contact_slopes(&self) -> Vec<f64> {
        let slope = |m: &Mount| if m.element.is_spring() { 1.0 } else { 0.0 };
        self.mounts.iter().map(slope).collect()
    }

    /// Mean load, n values.
    pub fn mean_load(&self) -> DVector<f64> {
        let zero = DVector::zeros(self.dof());
        let values = self.loads.iter().filter(|l| !l.kind.is_free_of_rest());
        values.fold(zero, |sum, l| sum + &l.direction * l.series.mean())
    }
}
