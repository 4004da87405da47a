//! Prescribed motions that the train cannot follow as a whole, because the frame or other prescribed motions hold it: they strain it,
//! like transmission errors.

use super::{Coupling, couple, mistake};
use crate::error::Diagnostic;
use crate::model::{BodyCourse, Connection, Train};
use crate::numeric::periodic::{Harmonic, Periodic};
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;
use std::ops::RangeInclusive;

/// Remainders of rows of N below this share of the largest row are rounding.
const ROUNDING: f64 = 1e-9;
/// Orders of a table of transmission errors beside a prescribed motion.
const TABLE_ORDERS: RangeInclusive<usize> = 512..=2048;

/// A body whose motion follows from others in every motion of the train as a whole.
struct Bound {
    /// Its place among the prescribed motions.
    motion: usize,
    /// Prescribed motions that carry it along, with their shares; none beside the frame.
    shares: Vec<(usize, f64)>,
}

/// A train with the motions that the frame or other motions bind.
pub(super) struct SettledTrain<'a> {
    /// Those over the cycle have become transmission errors.
    pub train: Cow<'a, Train>,
    /// Those over time, which stay: the coordinates beside them are bound.
    timed: Vec<Bound>,
}

/// The train with every motion over the cycle that strains it as a transmission error of the connections of its body.
///
/// ```text
/// z_j = sum of c_i z_i + d_j:    a_j z_j of a connection becomes sum of a_j c_i z_i - e,    e = -a_j d_j
/// ```
///
/// c: the share of each other prescribed motion in rigid-body motion, N_j = sum of c_i N_i; d_j: deviation of body j from it, made of
/// harmonics.
///
/// # Errors
/// Speeds of which no angle can be made; motions over time beside others over the cycle; connections between prescribed motions and
/// the frame alone.
pub(super) fn settled(train: &Train) -> Result<SettledTrain<'_>, Vec<Diagnostic>> {
    let bound = match train.motions.is_empty() {
        true => Vec::new(),
        false => bound(train, &couple(train)?),
    };
    let is_timed = |k: usize| matches!(train.motions[k].course, BodyCourse::Timed(_));
    let all_timed = |one: &Bound| is_timed(one.motion) && one.shares.iter().all(|s| is_timed(s.0));
    let (timed, bound): (Vec<Bound>, Vec<Bound>) = bound.into_iter().partition(all_timed);
    if bound.is_empty() {
        let train = Cow::Borrowed(train);
        return Ok(SettledTrain { train, timed });
    }
    let mut changed = train.clone();
    let mut list = Vec::new();
    for one in &bound {
        match deviation(train, one) {
            Ok(deviation) => strain(&mut changed, train, (one, &deviation)),
            Err(mistake) => list.push(mistake),
        }
    }
    for (name, connection) in &changed.connections {
        if connection.arms.is_empty() {
            let message =
                "lies between the frame and bodies with prescribed motion: no other body feels it";
            let help = "leave it out, or leave out a `motion`";
            list.push(mistake(
                format!("connections.{name}"),
                message,
                Some(help.into()),
            ));
        }
    }
    match list.is_empty() {
        true => Ok(SettledTrain {
            train: Cow::Owned(changed),
            timed,
        }),
        false => Err(list),
    }
}

impl SettledTrain<'_> {
    /// How many motions over time bind coordinates.
    pub(super) fn timed_count(&self) -> usize {
        self.timed.len()
    }

    /// The train whose bodies with motions over time rest; `None` where such motions bind nothing.
    pub(super) fn at_rest(&self) -> Option<Train> {
        let mut train = self.train.as_ref().clone();
        for motion in &mut train.motions {
            if let (BodyCourse::Timed(_), false) = (&motion.course, self.timed.is_empty()) {
                let (mean, harmonics) = (0.0, Vec::new());
                let slope = Periodic::Fourier { mean, harmonics };
                motion.course = BodyCourse::PerPhase { slope, offset: 0.0 };
            }
        }
        (!self.timed.is_empty()).then_some(train)
    }

    /// Rates of the deformations at time 0 \[m/s or rad/s\], e values: the speeds with which motions over time begin, beyond those in
    /// which the train moves as a whole.
    pub(super) fn rates(&self, coupling: &Coupling) -> DVector<f64> {
        let motions = &self.train.motions;
        let speed = |motion: usize| match &motions[motion].course {
            BodyCourse::Timed(line) => line.value(0.0),
            _ => 0.0,
        };
        let mut bodies = DVector::zeros(self.train.bodies.len());
        for one in &self.timed {
            let followed = one
                .shares
                .iter()
                .map(|(other, share)| share * speed(*other));
            bodies[motions[one.motion].body] += speed(one.motion) - followed.sum::<f64>();
        }
        &coupling.incidence * bodies
    }
}

/// The motions that others determine as far as the train moves as a whole: those behind the first independent ones.
fn bound(train: &Train, coupling: &Coupling) -> Vec<Bound> {
    let bodies: Vec<usize> = train.motions.iter().map(|motion| motion.body).collect();
    let rows = coupling.rigid_body.select_rows(&bodies);
    let largest = rows.row_iter().map(|row| row.norm()).fold(0.0, f64::max);
    let mut leading: Vec<usize> = Vec::new();
    let mut list = Vec::new();
    for motion in 0..bodies.len() {
        let row: DVector<f64> = rows.row(motion).transpose();
        let basis = rows.select_rows(&leading).transpose();
        let shares = least_squares(&basis, &row);
        let rest = &row - &basis * &shares;
        if rest.norm() > ROUNDING * largest {
            leading.push(motion);
            continue;
        }
        let shares = leading.iter().copied().zip(shares.iter().copied());
        let shares = shares.filter(|(_, share)| share.abs() > ROUNDING).collect();
        list.push(Bound { motion, shares });
    }
    list
}

/// x that makes |A x - b| least, for independent columns.
fn least_squares(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    if a.ncols() == 0 {
        return DVector::zeros(0);
    }
    let x = a.tr_mul(a).cholesky().map(|c| c.solve(&a.tr_mul(b)));
    x.unwrap_or_else(|| DVector::zeros(a.ncols()))
}

/// d_j over the phase.
fn deviation(train: &Train, bound: &Bound) -> Result<Periodic, Diagnostic> {
    let frequency = train
        .mean_motion
        .as_ref()
        .map(|mean| mean.speed.abs() / train.revolutions as f64);
    let one = |motion: usize| {
        let motion = &train.motions[motion];
        motion.course.deviation(frequency).ok_or_else(|| {
            let name = train.bodies.get_index(motion.body).map_or("", |(name, _)| name);
            let (message, help) = match motion.course {
                BodyCourse::Timed(_) => (
                    "a motion over time and one over the cycle bind each other",
                    "give both over time or both over the cycle, or leave out one of them",
                ),
                _ => (
                    "the frame, or another prescribed motion, holds the train on the way, and no angle follows from this speed without \
                     the frequency at which it was measured",
                    "give `reference: {body: .., speed: ..}`, or the angle instead of the speed",
                ),
            };
            mistake(format!("bodies.{name}.motion"), message, Some(help.into()))
        })
    };
    let mut parts = vec![(one(bound.motion)?, 1.0)];
    for (other, share) in &bound.shares {
        parts.push((one(*other)?, -share));
    }
    Ok(sum(&parts))
}

/// A sum of series.
fn sum(parts: &[(Periodic, f64)]) -> Periodic {
    let mut total = 0.0;
    let mut list: Vec<Harmonic> = Vec::new();
    for (series, factor) in parts {
        total += factor * series.mean();
        let Periodic::Fourier { harmonics, .. } = series.scaled(*factor) else {
            continue;
        };
        for own in harmonics {
            match list.iter_mut().find(|h| h.order == own.order) {
                Some(h) => (h.cos, h.sin) = (h.cos + own.cos, h.sin + own.sin),
                None => list.push(own),
            }
        }
    }
    Periodic::Fourier {
        mean: total,
        harmonics: list,
    }
}

/// Replaces a body in its connections.
fn strain(changed: &mut Train, train: &Train, (bound, deviation): (&Bound, &Periodic)) {
    let own = train.motions[bound.motion].body;
    for connection in changed.connections.values_mut() {
        let Some(place) = connection.arms.iter().position(|(body, _)| *body == own) else {
            continue;
        };
        let (_, arm) = connection.arms.remove(place);
        for (other, share) in &bound.shares {
            add_arm(connection, train.motions[*other].body, arm * share);
        }
        let error = deviation.scaled(-arm);
        connection.transmission_error = Some(match &connection.transmission_error {
            None => error,
            Some(known) => joined(known, error),
        });
    }
    if let BodyCourse::Speed(speed) = &train.motions[bound.motion].course
        && let Some(mean) = &train.mean_motion
    {
        let slope = speed.scaled(train.revolutions as f64 / mean.speed.abs());
        changed.motions[bound.motion].course = BodyCourse::PerPhase { slope, offset: 0.0 };
    }
}

fn add_arm(connection: &mut Connection, body: usize, arm: f64) {
    match connection.arms.iter().position(|(known, _)| *known == body) {
        None => connection.arms.push((body, arm)),
        Some(place) => {
            let total = connection.arms[place].1 + arm;
            match total.abs() <= ROUNDING * arm.abs() {
                true => drop(connection.arms.remove(place)),
                false => connection.arms[place].1 = total,
            }
        }
    }
}

/// The sum of a transmission error and one made of harmonics.
fn joined(known: &Periodic, error: Periodic) -> Periodic {
    let harmonics = known.harmonics(TABLE_ORDERS);
    let mean = known.mean();
    let known = Periodic::Fourier { mean, harmonics };
    sum(&[(known, 1.0), (error, 1.0)])
}
