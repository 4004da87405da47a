//! From relative coordinates back to the bodies: absolute accelerations, Rook & Singh (1995), eq. (6a).

use super::mass::Mass;
use super::scaling::RigidBody;
use super::torque::{Torque, course, torques};
use super::{Assembly, Coupling, inertias};
use crate::model::Train;
use crate::numeric::fraction;
use crate::numeric::nonzeros::Nonzeros;
use crate::numeric::periodic::Periodic;
use crate::system::{Scratch, System};
use nalgebra::{DMatrix, DVector};

/// Remainder of the mean loads, relative to the largest of them, that counts as balanced: torques rounded to a few digits.
const BALANCED: f64 = 1e-4;
/// The same relative to all loads, alternating parts included.
const NOTICEABLE: f64 = 1e-5;

/// Data of (6a) besides the motion, in SI units, stored per body: the rows of a train have two or three entries.
#[derive(Debug, Clone)]
pub(crate) struct Anchor {
    /// Names of the bodies, n_b.
    pub bodies: Vec<String>,
    inertia: DVector<f64>,
    /// Bodies whose forces accelerate each body, with factors: itself, or all coordinates of its part.
    partners: Vec<Vec<(usize, f64)>>,
    /// Columns of B: the connections of each body with their lever arms.
    arms: Nonzeros,
    /// Rows of C P^+, n_b x n.
    rates: Nonzeros,
    /// Loads of each body.
    loads: Vec<Vec<Torque>>,
    /// Dashpots parallel to a transmission error, of each body: arm, c, e.
    dashpots: Vec<Vec<(f64, f64, Periodic)>>,
    /// Accelerations that are prescribed.
    prescribed: Vec<Option<Torque>>,
    /// Mean speeds over that of the excitation phase, with their signs; 0 where nothing is known of them.
    ratios: Vec<f64>,
}

/// Forces on a body, in SI units.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Action<'a> {
    /// Its load [N m or N].
    Load(&'a Torque),
    /// The rate of a relative coordinate [m/s or rad/s].
    Rate(usize),
    /// The force of a connection without its dashpot, K_j f_j [N or N m].
    Force(usize),
    /// The dashpot c of a connection with a transmission error e: c de/dt [N or N m].
    Dashpot(f64, &'a Periodic),
}

impl Anchor {
    /// `rates`: C P^+, n_b x n; `w_c`: omega_c [rad/s].
    pub(super) fn new(
        train: &Train,
        coupling: &Coupling,
        rates: &DMatrix<f64>,
        w_c: f64,
    ) -> Anchor {
        let mut loads = vec![Vec::new(); train.bodies.len()];
        let mut prescribed = vec![None; train.bodies.len()];
        for motion in &train.motions {
            prescribed[motion.body] = course(&motion.course, w_c);
        }
        for (name, load) in &train.loads {
            if let Some(body) = train.bodies.get_index_of(name) {
                loads[body].extend(torques(load, (w_c, train.revolutions)));
            }
        }
        let arms = Nonzeros::of_columns(&coupling.incidence);
        let dashpot = |(connection, arm): &(usize, f64)| {
            let c = &train.connections[*connection];
            let error = c.transmission_error.as_ref().filter(|_| c.damping > 0.0)?;
            Some((*arm, c.damping, error.clone()))
        };
        let of_body = |body| arms.line(body).iter().filter_map(dashpot).collect();
        Anchor {
            bodies: train.bodies.keys().cloned().collect(),
            inertia: inertias(train),
            partners: Mass::of(train).partners(),
            dashpots: (0..train.bodies.len()).map(of_body).collect(),
            arms,
            rates: Nonzeros::of_rows(rates),
            loads,
            prescribed,
            ratios: mean_ratios(train),
        }
    }

    /// What acts on a body, each with its factor; their sum over the inertia is the absolute acceleration.
    ///
    /// ```text
    /// z'' = M^-1 (F - C P^+ r' - B^T diag(K_j) f_j + B^T diag(c) e')
    /// ```
    ///
    /// Exact for trees and loops and for any damping. Rook & Singh (1995), eq. (6a). A body with prescribed motion has the one that is
    /// prescribed.
    pub fn actions(&self, body: usize) -> impl Iterator<Item = (f64, Action<'_>)> {
        let own = self.prescribed[body].as_ref();
        let own_action = own.map(|course| (self.inertia[body], Action::Load(course)));
        let scaled = |(other, share): &(usize, f64)| {
            let share = *share;
            let own = self.own_actions(*other);
            own.map(move |(factor, action)| (share * factor, action))
        };
        let partners = self.partners[body].iter().filter(move |_| own.is_none());
        own_action.into_iter().chain(partners.flat_map(scaled))
    }

    /// What acts on a body that is free to move.
    fn own_actions(&self, body: usize) -> impl Iterator<Item = (f64, Action<'_>)> {
        let loads = self.loads[body]
            .iter()
            .map(|load| (1.0, Action::Load(load)));
        let rates = self.rates.line(body).iter();
        let forces = self.arms.line(body).iter();
        let dashpots = self.dashpots[body].iter();
        loads
            .chain(rates.map(|(i, c)| (-c, Action::Rate(*i))))
            .chain(forces.map(|(k, arm)| (-arm, Action::Force(*k))))
            .chain(dashpots.map(|(arm, c, error)| (*arm, Action::Dashpot(*c, error))))
    }

    /// Inertia of a body [kg m^2; kg for translating masses].
    pub fn inertia(&self, body: usize) -> f64 {
        self.inertia[body]
    }

    /// Absolute acceleration of one body [rad/s^2; m/s^2 for translating masses] from the values of what acts on it.
    pub fn acceleration(&self, body: usize, value: impl Fn(Action<'_>) -> f64) -> f64 {
        let forces = self
            .actions(body)
            .map(|(factor, action)| factor * value(action));
        forces.fold(0.0, |sum, force| sum + force) / self.inertia[body]
    }
}

/// Mean speeds over the rate of the base phase.
fn mean_ratios(train: &Train) -> Vec<f64> {
    let Some(motion) = &train.mean_motion else {
        return vec![0.0; train.bodies.len()];
    };
    let turns = motion.speed.signum() * train.revolutions as f64;
    let ratios = motion.ratios.iter().map(fraction::to_f64);
    ratios.map(|ratio| ratio * turns).collect()
}

impl Assembly {
    /// Absolute accelerations of the bodies at a nondimensional state, n_b values [rad/s^2; m/s^2 for translating masses];
    /// `None` for reduced systems.
    ///
    /// `system`: this assembly's, at its frequency; `state` = [q; v], 2n values. The responses stay in `scratch`.
    pub fn body_accelerations(
        &self,
        system: &System,
        tau: f64,
        state: &[f64],
        scratch: &mut Scratch,
    ) -> Option<Vec<f64>> {
        self.anchor.as_ref()?;
        system.respond(tau, state, scratch);
        self.body_accelerations_under(system, tau, state, scratch)
    }

    /// The same from responses at hand in `scratch`.
    pub(crate) fn body_accelerations_under(
        &self,
        system: &System,
        tau: f64,
        state: &[f64],
        scratch: &Scratch,
    ) -> Option<Vec<f64>> {
        let anchor = self.anchor.as_ref()?;
        let v = &state[system.dof()..];
        let at = system.moment(tau);
        let value = |action: Action<'_>| match action {
            Action::Load(torque) => system.load_value((&torque.series, &torque.kind), tau, &at),
            Action::Rate(i) => self.rate_scale(i) * v[i],
            Action::Force(k) => self.force_scale(k) * scratch.response[k].f,
            Action::Dashpot(c, error) => {
                c * self.scales.frequency * at.frequency * error.derivative(at.phase)
            }
        };
        let w_c = self.scales.frequency;
        let follows = system.course().is_some_and(|course| course.is_followed());
        let mean = |body: usize| match follows && anchor.prescribed[body].is_none() {
            true => anchor.ratios[body] * at.change * w_c * w_c,
            false => 0.0,
        };
        let bodies = 0..anchor.bodies.len();
        let list = bodies.map(|body| anchor.acceleration(body, value) + mean(body));
        Some(list.collect())
    }

    /// SI rate of a relative coordinate of rate 1, d/d(omega_c t).
    pub(crate) fn rate_scale(&self, coordinate: usize) -> f64 {
        let measured = self.coupling.as_ref().map(|c| c.coordinates[coordinate]);
        measured.map_or(1.0, |k| self.scales.displacement[k]) * self.scales.frequency
    }

    /// SI force of a connection of force 1.
    pub(crate) fn force_scale(&self, connection: usize) -> f64 {
        self.scales.stiffness[connection] * self.scales.displacement[connection]
    }

    /// Excitation frequency of a system [rad/s].
    pub(crate) fn si_frequency(&self, system: &System) -> f64 {
        self.scales.frequency * system.excitation_frequency()
    }
}

/// A warning when the mean loads accelerate a rigid-body motion, with the acceleration and the torque that is missing.
///
/// ```text
/// z'' = N (N^T M N)^-1 N^T F
/// ```
///
/// Torques are compared as they act on each rigid-body motion: the remainder N^T F with the largest mean load in it, and with
/// all that the loads do, alternating parts included.
pub(super) fn unbalanced_mean_load(train: &Train, coupling: &Coupling) -> Option<String> {
    let rigid = RigidBody::new(train, coupling);
    let motions = rigid.motions();
    let mut force = DVector::zeros(train.bodies.len());
    let mut swing = DVector::<f64>::zeros(train.bodies.len());
    for (name, load) in &train.loads {
        if let Some(body) = train.bodies.get_index_of(name) {
            force[body] += load.mean_torque();
            swing[body] += load.mean_torque().abs() + load.swing();
        }
    }
    let is_unbalanced = motions.column_iter().any(|motion| {
        let remainder = motion.dot(&force).abs();
        let parts = motion.component_mul(&force);
        let all = motion.component_mul(&swing).map(f64::abs).sum();
        remainder > BALANCED * parts.amax() && remainder > NOTICEABLE * all
    });
    if !is_unbalanced {
        return None;
    }
    let acceleration = rigid.acceleration(&force)?;
    let largest = acceleration.amax();
    let list: Vec<String> = (train.bodies.keys().zip(acceleration.iter()))
        .filter(|(_, a)| a.abs() > 1e-6 * largest)
        .take(4)
        .map(|(name, a)| format!("{name} {a:.4e}"))
        .collect();
    Some(format!(
        "the mean loads do not balance: rigid-body motion accelerates ({}, in rad/s^2, m/s^2 for translating masses); \
         relative motion is not affected",
        list.join(", ")
    ))
}
