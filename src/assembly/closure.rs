//! Loops of lever arms that do not close: which arm would close them.

use crate::model::{DeformationUnit, Motion, Train};
use nalgebra::DMatrix;
use std::fmt::Write;

/// Singular value of the rows without one body, relative to the largest, at which they are dependent.
const DEPENDENT: f64 = 1e-9;
/// Largest change of an arm that is suggested, relative to it.
const FARTHEST: f64 = 0.2;
/// Lever arms that differ by less are the same.
const SAME: f64 = 1e-6;
/// Suggestions in a message.
const SHOWN: usize = 3;

/// One lever arm, and the value of it that closes the loop.
struct LeverArm {
    connection: usize,
    body: usize,
    found: f64,
    wanted: f64,
    /// How well the value agrees with the rest of the train.
    score: i64,
}

/// The lever arms of which another value closes the loop of these connections, as the end of a sentence; those first whose
/// value occurs elsewhere in the train.
pub(super) fn suggestion(train: &Train, involved: &[usize]) -> String {
    let mut list = candidates(train, involved);
    list.sort_by_key(|arm| -arm.score);
    if let Some(best) = list.first().map(|arm| arm.score).filter(|score| *score > 0) {
        list.retain(|arm| arm.score == best);
    }
    let mut text = String::new();
    for (k, arm) in list.iter().take(SHOWN).enumerate() {
        let joint = if k == 0 {
            "; to close the loop, use"
        } else {
            ", or"
        };
        let (connection, _) = train.connections.get_index(arm.connection).unzip();
        let (body, _) = train.bodies.get_index(arm.body).unzip();
        let _ = write!(
            text,
            "{joint} {} in place of {} as the lever arm of {} in {} ({:.2} % off)",
            length(train, arm, arm.wanted),
            length(train, arm, arm.found),
            body.map_or("", String::as_str),
            connection.map_or("", String::as_str),
            100.0 * (arm.wanted / arm.found - 1.0).abs()
        );
    }
    text
}

/// A train that nothing holds and that cannot turn as a whole.
pub(super) fn locked(train: &Train) -> Option<String> {
    let is_held = train.connections.values().any(|c| c.arms.len() == 1);
    (!is_held).then(|| {
        "the train is not connected to ground, but has no rigid-body mode: its ratios lock it; check the lever arms \
         around its loops"
            .into()
    })
}

/// Arms of a loop that can close it alone: without their body the rows are dependent, y R = 0, and the entries of the body
/// must follow, sum of y_i R_i = 0.
fn candidates(train: &Train, involved: &[usize]) -> Vec<LeverArm> {
    let arms = |c: usize| train.connections[c].arms.iter().copied();
    let mut bodies: Vec<usize> = (involved.iter())
        .flat_map(|c| arms(*c).map(|(body, _)| body))
        .collect();
    bodies.sort_unstable();
    bodies.dedup();
    let arm = |c: usize, body: usize| arms(c).find(|a| a.0 == body).map_or(0.0, |a| a.1);
    let size: Vec<f64> = (involved.iter())
        .map(|c| arms(*c).fold(0.0_f64, |m, a| m.max(a.1.abs())))
        .collect();
    let rows = involved.len();
    let mut list = Vec::new();
    for body in &bodies {
        let others: Vec<usize> = bodies.iter().copied().filter(|b| b != body).collect();
        // One column of zeros at least, so that there are as many singular vectors as rows.
        let matrix = DMatrix::from_fn(rows.max(others.len()), rows, |j, i| match others.get(j) {
            Some(other) => arm(involved[i], *other) / size[i],
            None => 0.0,
        });
        let svd = matrix.svd(false, true);
        let (Some(v), largest) = (svd.v_t, svd.singular_values.amax()) else {
            continue;
        };
        let least = svd.singular_values.imin();
        if svd.singular_values[least] > DEPENDENT * largest {
            continue;
        }
        let y = |i: usize| v[(least, i)] / size[i];
        for (i, connection) in involved.iter().enumerate() {
            let found = arm(*connection, *body);
            let rest = (0..rows).filter(|k| *k != i);
            let rest: f64 = rest.map(|k| y(k) * arm(involved[k], *body)).sum();
            let wanted = -rest / y(i);
            let is_near = (wanted / found - 1.0).abs() < FARTHEST;
            if found != 0.0 && v[(least, i)].abs() > DEPENDENT && is_near && wanted != found {
                let score = score(train, *body, found, wanted);
                list.push(LeverArm {
                    connection: *connection,
                    body: *body,
                    found,
                    wanted,
                    score,
                });
            }
        }
    }
    list
}

/// How many arms of a body have the wanted value, less how many have the one found.
fn score(train: &Train, body: usize, found: f64, wanted: f64) -> i64 {
    let like = |value: f64| {
        let arms = train.connections.values().flat_map(|c| c.arms.iter());
        let own = arms.filter(|(b, _)| *b == body);
        own.filter(|(_, x)| (x.abs() / value.abs() - 1.0).abs() < SAME)
            .count() as i64
    };
    like(wanted) - like(found)
}

/// A lever arm for people: in mm where it is a length.
fn length(train: &Train, arm: &LeverArm, value: f64) -> String {
    let is_length = train.connections[arm.connection].unit == DeformationUnit::Metre
        && train.bodies[arm.body].motion == Motion::Rotation;
    let digits = |x: f64| -> f64 { format!("{x:.6e}").parse().unwrap_or(x) };
    if is_length {
        format!("{} mm", digits(1e3 * value.abs()))
    } else {
        format!("{}", digits(value.abs()))
    }
}
