//! Breakpoints: all of them, and no others.

use super::{PHASES, VELOCITIES};
use crate::element::{Element, Response};

/// Cells of a region in which kinks are sought.
const CELLS: usize = 40;
/// Halvings of a cell in which something seems to change: its ends then differ by rounding, or by a jump.
const HALVINGS: usize = 34;
/// A change of force or slope over so small a cell that no smooth law of order one makes.
const JUMP: f64 = 1e-4;

/// The regions between breakpoints, the outer ones cut off at a size of order one.
pub(super) fn regions(breakpoints: &[f64]) -> Vec<(f64, f64)> {
    let (Some(first), Some(last)) = (breakpoints.first(), breakpoints.last()) else {
        return vec![(-4.0, 4.0)];
    };
    let mut list = vec![(first - 4.0, *first)];
    list.extend(breakpoints.windows(2).map(|w| (w[0], w[1])));
    list.push((*last, last + 4.0));
    list
}

pub(super) fn check(element: &dyn Element, found: &mut Vec<String>) {
    let list = element.breakpoints();
    if list.windows(2).any(|w| w[0] >= w[1]) || list.iter().any(|b| !b.is_finite()) {
        found.push(format!("breakpoints {list:?} are not finite and ascending"));
        return;
    }
    let mut is_jumping = false;
    for b in &list {
        is_jumping |= breakpoint(element, *b, found);
    }
    if is_jumping && !element.is_discontinuous() {
        found.push("the force jumps at a breakpoint, but is_discontinuous is false".into());
    }
    if element.has_hidden_jumps() && !element.is_discontinuous() {
        found.push("has_hidden_jumps is true, but is_discontinuous is false".into());
    }
    if element.is_discontinuous() && !is_jumping && !element.has_hidden_jumps() {
        found.push("is_discontinuous is true, but the force jumps at no breakpoint".into());
    }
    for region in regions(&list) {
        if !inside(element, region, found) {
            return;
        }
    }
}

fn states() -> impl Iterator<Item = (f64, f64)> {
    VELOCITIES
        .into_iter()
        .flat_map(|v| PHASES.map(|phase| (v, phase)))
}

/// Whether the force jumps there; a breakpoint where nothing at all changes is a violation.
fn breakpoint(element: &dyn Element, b: f64, found: &mut Vec<String>) -> bool {
    let (mut is_jumping, mut is_kink) = (false, false);
    for (v, phase) in states() {
        let at = |q: f64| element.eval(q, v, phase);
        let near = 1e-9 * (1.0 + b.abs());
        let (left, right) = (at(b - near), at(b + near));
        let slopes = left.df_dq.abs() + right.df_dq.abs();
        is_jumping |= (left.f - right.f).abs() > 4.0 * near * slopes + 1e-11;
        is_kink |= is_bent(at(b - near), at(b + near), 1e-7);
        // A bend of the slope: the root of a contact law, say.
        let far = 1e-3 * (1.0 + b.abs());
        let bend = |pick: fn(Response) -> f64| {
            (pick(at(b - far)) + pick(at(b + far)) - pick(left) - pick(right)).abs()
        };
        is_kink |= bend(|r| r.df_dq) > 1e-9 || bend(|r| r.df_dv) > 1e-9;
    }
    if !is_jumping && !is_kink {
        found.push(format!(
            "nothing changes at the breakpoint {b}: force and partials are smooth"
        ));
    }
    is_jumping
}

fn is_bent(a: Response, b: Response, tolerance: f64) -> bool {
    let gap = |x: f64, y: f64| (x - y).abs() > tolerance * (1.0 + x.abs());
    gap(a.df_dq, b.df_dq) || gap(a.df_dv, b.df_dv)
}

/// Smoothness and affinity between two breakpoints; false ends the search.
fn inside(element: &dyn Element, (low, high): (f64, f64), found: &mut Vec<String>) -> bool {
    let aside = 1e-9 * (1.0 + low.abs().max(high.abs()));
    let (low, high) = (low + aside, high - aside);
    let place = |k: usize| low + (high - low) * k as f64 / CELLS as f64;
    for (v, phase) in states() {
        let at = |q: f64| element.eval(q, v, phase);
        for k in 0..CELLS {
            let (a, b) = (place(k), place(k + 1));
            if !element.has_hidden_jumps()
                && let Some(q) = jump(&at, (a, b), |r| r.f)
            {
                found.push(format!(
                    "the force jumps at q = {q:.9}, v = {v}, which is no breakpoint, and has_hidden_jumps is false"
                ));
                return false;
            }
            // A law that cautions about itself may have kinks that it cannot place.
            let kink = jump(&at, (a, b), |r| r.df_dq).or_else(|| jump(&at, (a, b), |r| r.df_dv));
            if let (Some(q), true) = (kink, element.cautions().is_empty()) {
                found.push(format!(
                    "the slope jumps at q = {q:.9}, v = {v}, which is no breakpoint"
                ));
                return false;
            }
            let is_straight = !is_bent(at(a), at(b), 1e-12) && at(a).df_dv == 0.0;
            let is_steady = element.eval(a, v, phase + 0.7).f == at(a).f;
            if element.is_piecewise_affine() && !(is_straight && is_steady) {
                found.push(format!(
                    "not affine around q = {a}, v = {v}, but is_piecewise_affine is true"
                ));
                return false;
            }
        }
    }
    true
}

/// Where a quantity jumps within a cell: the half in which it changes more, again and again.
fn jump(
    at: &impl Fn(f64) -> Response,
    (mut a, mut b): (f64, f64),
    pick: fn(Response) -> f64,
) -> Option<f64> {
    let (mut left, mut right) = (pick(at(a)), pick(at(b)));
    let allowed = JUMP * (1.0 + left.abs().max(right.abs()));
    for _ in 0..HALVINGS {
        if (right - left).abs() <= allowed {
            return None;
        }
        let middle = 0.5 * (a + b);
        let value = pick(at(middle));
        if (value - left).abs() > (right - value).abs() {
            (b, right) = (middle, value);
        } else {
            (a, left) = (middle, value);
        }
    }
    Some(0.5 * (a + b))
}
