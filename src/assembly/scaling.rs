//! Characteristic values, and the nondimensional matrices and loads.

use super::mass::Mass;
use super::moved::{Held, sources};
use super::torque::torques;
use super::{Coupling, ElasticModes, Scales, mistake};
use crate::element::{Units, nondimensional};
use crate::error::{Diagnostic, SolveError};
use crate::model::{Connection, FrequencyScale, Scaling, Train};
use crate::system::{Balance, LoadKind, LoadSource, Mount, System};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::borrow::Cow;

/// omega_c and one displacement scale a connection.
///
/// # Errors
/// Scales that are not positive and finite.
pub(super) fn scales(train: &Train, modes: &ElasticModes) -> Result<Scales, Vec<Diagnostic>> {
    let frequency = match train.scaling.frequency {
        FrequencyScale::FirstMode => modes.eigenvalues.iter().next().map_or(0.0, |x| x.sqrt()),
        FrequencyScale::FirstConnection => train.connections.values().next().map_or(0.0, |c| {
            let mut row = DMatrix::zeros(1, train.bodies.len());
            c.arms.iter().for_each(|(body, arm)| row[*body] += arm);
            let share = Mass::of(train).divided(&row).dot(&row);
            (c.contact_stiffness() * share).sqrt()
        }),
        FrequencyScale::Value(value) => value,
    };
    let is_scale = |x: f64| x > 0.0 && x.is_finite();
    let mut list = Vec::new();
    if !is_scale(frequency) {
        let message = format!("found {frequency} rad/s, must be > 0 and finite");
        list.push(mistake("scaling.frequency", message, None));
    }
    let mut displacement = Vec::with_capacity(train.connections.len());
    for (name, connection) in &train.connections {
        let l = length(connection, &train.scaling);
        if !is_scale(l) {
            let message = format!("displacement scale {l}, must be > 0 and finite");
            list.push(mistake(format!("connections.{name}.length"), message, None));
        }
        displacement.push(l);
    }
    if !list.is_empty() {
        return Err(list);
    }
    let stiffness = train.connections.values().map(|c| c.stiffness).collect();
    Ok(Scales {
        frequency,
        displacement,
        stiffness,
    })
}

/// l: own `length`, else that of the train, else the first nonzero breakpoint of the law, else 1.
fn length(connection: &Connection, scaling: &Scaling) -> f64 {
    let breakpoint = || {
        let list = connection.element.breakpoints();
        list.into_iter().map(f64::abs).find(|b| *b > 0.0)
    };
    let own = connection.length.or(scaling.length);
    own.or_else(breakpoint).unwrap_or(1.0)
}

/// The system of a train, nondimensional.
///
/// ```text
/// kappa = omega_c^-2 D_r^-1 P M^-1 B^T diag(K) D      (n x e)
/// Gam   = omega_c^-1 D_r^-1 P M^-1 C P^+ D_r          (n x n)
/// W*    = D^-1 W D_r                                  (e x n)
/// Q     = omega_c^-2 D_r^-1 P M^-1 F
/// ```
///
/// D = diag(l_j), D_r its rows of the accepted connections. `rates`: C P^+, n_b x n. A dashpot c_j parallel to a transmission error
/// e adds omega_c^-1 D_r^-1 P M^-1 B_j^T c_j de/dT to Q. Rook & Singh (1995), eq. (4b-e); loops and several scales beyond it.
pub(super) fn system(
    train: &Train,
    coupling: &Coupling,
    rates: &DMatrix<f64>,
    scales: &Scales,
) -> Result<System, SolveError> {
    let w_c = scales.frequency;
    let l = &scales.displacement;
    let l_r: Vec<f64> = coupling.coordinates.iter().map(|k| l[*k]).collect();
    let mut mobility = Mass::of(train).divided(&coupling.transform);
    for (mut row, l) in mobility.row_iter_mut().zip(&l_r) {
        row /= *l;
    }
    let drive = &mobility * coupling.incidence.transpose();
    let mut kappa = drive.clone();
    for (k, mut column) in kappa.column_iter_mut().enumerate() {
        column *= scales.stiffness[k] * l[k] / (w_c * w_c);
    }
    let mut gamma = &mobility * rates;
    for (mut column, l) in gamma.column_iter_mut().zip(&l_r) {
        column *= *l / w_c;
    }
    let w = DMatrix::from_fn(l.len(), l_r.len(), |k, i| {
        // The quotient first: accepted connections keep an exact 1.
        coupling.element_map[(k, i)] * (l_r[i] / l[k])
    });
    let mounts = mounts(train, scales);
    let mut loads = loads(train, &mobility, &drive, scales);
    loads.extend(sources(train, coupling, scales));
    let balance = balance(train, coupling, scales, loads.len());
    Ok(System::new(gamma, kappa, w, mounts, loads)?.with_balance(balance))
}

/// The balance of forces at rest; `loads`: how many the system has, those of the bodies first.
///
/// ```text
/// W*^T diag(K l^2) f = D_r g,    P^T g = F - M N (N^T M N)^-1 N^T F
/// ```
///
/// What the loads leave unbalanced accelerates the train as a whole: its inertia torques are taken off (d'Alembert), and no
/// inertia enters otherwise.
fn balance(train: &Train, coupling: &Coupling, scales: &Scales, loads: usize) -> Balance {
    let l = &scales.displacement;
    let l_r: Vec<f64> = coupling.coordinates.iter().map(|k| l[*k]).collect();
    let n = l_r.len();
    // Columns of unit size, so that lever arms of all sizes count alike.
    let size = DVector::from_iterator(n, coupling.transform.row_iter().map(|row| row.norm()));
    let mut arms = coupling.transform.transpose();
    for (mut column, size) in arms.column_iter_mut().zip(size.iter()) {
        column /= *size;
    }
    let factors = arms.qr();
    let (q, r) = (factors.q(), factors.r());
    let rigid = RigidBody::new(train, coupling);
    let forces = train.loads.iter().filter_map(|(name, load)| {
        let body = train.bodies.get_index_of(name)?;
        let mut torque = DVector::zeros(train.bodies.len());
        torque[body] = 1.0;
        rigid.take_inertia_off(&mut torque);
        let mut g = r.solve_upper_triangular(&q.tr_mul(&torque))?;
        g.component_div_assign(&size);
        let force = DVector::from_fn(n, |i, _| g[i] * l_r[i]);
        // One for each part of the load.
        Some(std::iter::repeat_n(force, 1 + load.others.len()))
    });
    let mut forces: Vec<DVector<f64>> = forces.flatten().collect();
    forces.resize(loads, DVector::zeros(n));
    Balance {
        stiffness: (l.iter().zip(&scales.stiffness))
            .map(|(l, k)| k * l * l)
            .collect(),
        loads: forces,
        weight: DVector::from_fn(n, |i, _| size[i] / l_r[i]),
    }
}

/// Motions of the train as a whole, with their inertias.
pub(super) struct RigidBody<'a> {
    /// Those in which bodies with prescribed motion rest, n_b x r.
    motions: Cow<'a, DMatrix<f64>>,
    /// M N, n_b x r.
    heavy: DMatrix<f64>,
    share: Option<Cholesky<f64, Dyn>>,
    held: Option<Held<'a>>,
}

impl<'a> RigidBody<'a> {
    pub(super) fn new(train: &Train, coupling: &'a Coupling) -> RigidBody<'a> {
        let held = (!train.motions.is_empty()).then(|| Held::new(train, coupling));
        let motions = match &held {
            Some(held) => Cow::Owned(&coupling.rigid_body * &held.free),
            None => Cow::Borrowed(&coupling.rigid_body),
        };
        let heavy = Mass::of(train).times(&motions);
        let share = motions.tr_mul(&heavy).cholesky();
        RigidBody {
            motions,
            heavy,
            share,
            held,
        }
    }

    /// N, n_b x r.
    pub(super) fn motions(&self) -> &DMatrix<f64> {
        &self.motions
    }

    /// Accelerations z'' = N (N^T M N)^-1 N^T F of all bodies under torques; `None` where inertias leave the range of numbers.
    pub(super) fn acceleration(&self, torque: &DVector<f64>) -> Option<DVector<f64>> {
        let share = self.share.as_ref()?;
        Some(self.motions.as_ref() * share.solve(&self.motions.tr_mul(torque)))
    }

    /// Takes off what accelerates the train as a whole, and adds the reactions of bodies with prescribed motion.
    fn take_inertia_off(&self, torque: &mut DVector<f64>) {
        if let Some(share) = &self.share {
            *torque -= &self.heavy * share.solve(&self.motions.tr_mul(torque));
        }
        if let Some(held) = &self.held {
            held.react(torque);
        }
    }
}

/// The laws in place.
pub(super) fn mounts(train: &Train, scales: &Scales) -> Vec<Mount> {
    let placed = train.connections.values().zip(&scales.displacement);
    placed
        .map(|(c, l)| mount(c, scales.frequency, *l))
        .collect()
}

fn mount(connection: &Connection, w_c: f64, l: f64) -> Mount {
    let units = Units {
        displacement: l,
        frequency: w_c,
        force: connection.stiffness * l,
    };
    let error = connection.transmission_error.as_ref();
    Mount {
        element: nondimensional(connection.element.as_ref(), &units),
        stiffness_variation: connection.stiffness_variation.clone(),
        transmission_error: error.map(|e| e.scaled(1.0 / l)),
    }
}

/// `mobility`: D_r^-1 P M^-1, n x n_b; `drive`: D_r^-1 P M^-1 B^T, n x e.
fn loads(
    train: &Train,
    mobility: &DMatrix<f64>,
    drive: &DMatrix<f64>,
    scales: &Scales,
) -> Vec<LoadSource> {
    let w_c = scales.frequency;
    let mut list = Vec::new();
    for (name, load) in &train.loads {
        let Some(body) = train.bodies.get_index_of(name) else {
            continue;
        };
        let direction: DVector<f64> = mobility.column(body) / (w_c * w_c);
        list.extend(
            torques(load, (w_c, train.revolutions)).map(|torque| LoadSource {
                direction: direction.clone(),
                series: torque.series,
                kind: torque.kind,
            }),
        );
    }
    for (k, connection) in train.connections.values().enumerate() {
        if let (Some(error), true) = (&connection.transmission_error, connection.damping > 0.0) {
            list.push(LoadSource {
                direction: drive.column(k) * (connection.damping / w_c),
                series: error.clone(),
                kind: LoadKind::Rate,
            });
        }
    }
    list
}
