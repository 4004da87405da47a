//! Whether the recorded force of a law is its force.

use super::grid;
use crate::element::Element;
use crate::element::tape::Tape;
use crate::numeric::taylor::Program;

/// Difference allowed between the recorded and the plain computation, relative to the sizes that occur.
const TOLERANCE: f64 = 1e-12;

/// Follows the law once in every region and compares with `eval` all over the region: force and partials.
pub(super) fn check(element: &dyn Element, found: &mut Vec<String>) {
    let breakpoints = element.breakpoints();
    let mut ends = vec![f64::NEG_INFINITY];
    ends.extend(&breakpoints);
    ends.push(f64::INFINITY);
    for pair in ends.windows(2) {
        let is_inside = |q: f64| q > pair[0] && q < pair[1];
        let mut places = grid().filter(|(q, ..)| is_inside(*q));
        let Some((q, v, phase)) = places.next() else {
            continue;
        };
        let program = match record(element, (q, v, phase)) {
            Ok(program) => program,
            // A law may have no series.
            Err(_) => return,
        };
        for (q, v, phase) in places {
            let plain = element.eval(q, v, phase);
            let plain = [plain.f, plain.df_dq, plain.df_dv];
            let recorded = program.values([q, v, 0.0, phase]);
            let size = plain.iter().fold(1.0 + q.abs(), |m, x| m.max(x.abs()));
            let is_far = |(a, b): (&f64, &f64)| (a - b).abs() > TOLERANCE * size;
            if plain.iter().zip(&recorded).any(is_far) {
                found.push(format!(
                    "trace gives {recorded:?} at q = {q}, v = {v}, phase = {phase}, eval {plain:?}"
                ));
                return;
            }
        }
    }
}

/// Force and partials as a program, recorded at a place.
fn record(element: &dyn Element, (q, v, phase): (f64, f64, f64)) -> Result<Program, String> {
    let tape = Tape::default();
    let [q, v, phase] = tape.inputs(q, v, phase);
    let force = element.trace(q, v, phase)?;
    Ok(tape.program(&[force.value, force.dq, force.dv].map(|traced| traced.form())))
}
