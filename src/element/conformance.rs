//! The contract of a law as an executable check, for laws of this crate and of other crates.

mod automata;
mod evolving;
mod series;
mod smoothness;
mod table;

use super::{Element, Parameter, Response, ResponseSeries, Units, nondimensional};
pub use table::check_registered;

/// Displacements, velocities and phases of the grid.
const DISPLACEMENTS: [f64; 13] = [
    -50.0, -3.1, -1.7, -0.93, -0.41, -0.13, 0.0, 0.11, 0.37, 0.89, 1.3, 2.9, 60.0,
];
const VELOCITIES: [f64; 5] = [-7.0, -0.6, 0.0, 0.45, 5.0];
const PHASES: [f64; 3] = [0.0, 1.0, 4.4];
/// Sizes at which a law must be finite, with either sign.
const SIZES: [f64; 8] = [0.0, 1e-12, 1e-8, 1e-4, 1e-2, 1.0, 30.0, 300.0];
/// Difference step of the derivative test; central differences of smooth laws then agree to about 1e-9.
const STEP: f64 = 1e-5;
const DERIVATIVE_TOLERANCE: f64 = 1e-6;
const COVARIANCE_TOLERANCE: f64 = 1e-11;

/// Violations of the contract of [`Element`] by a law.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the law breaks its contract:\n{}", .0.join("\n"))]
pub struct Violations(pub Vec<String>);

impl Violations {
    fn conclude(found: Vec<String>) -> Result<(), Violations> {
        if found.is_empty() {
            Ok(())
        } else {
            Err(Violations(found))
        }
    }
}

/// Checks a law, parameters nondimensional and of order one:
///
/// - parameters pass `validate`, are finite, and are visited in a fixed order;
/// - force and partials are finite on a wide grid, and the partials equal central differences away from breakpoints;
/// - breakpoints are ascending; f and its partials are smooth elsewhere and not there; a force jumps if and only if the
///   law declares it, at a breakpoint (`is_discontinuous`) or elsewhere (`has_hidden_jumps`);
/// - `is_piecewise_affine`, `depends_on_velocity` and `is_passive` are true statements;
/// - `flank` changes at breakpoints only, an open flank carries no force, and an interval with zero force is open;
/// - scaling displacement, time and force changes the law, its breakpoints and its flanks according to its dimensions:
///   f*(q / l, v / (l w)) = f(q, v) / l;
/// - automata: guards and resets lead to regions that exist, memories are counted; along a path through the regions `respond`
///   agrees with them, including partials; a closed loop of a passive law adds no energy; levels and forces scale according
///   to their dimensions;
/// - laws whose memory has a rate: force, rate and their partials against differences, at instants and along a march; kinks are
///   listed, force and rate continuous there; the recorded programs, first loading, scaling and the energy of a closed loop;
/// - the force recorded by `trace`, if any, equals that of `eval` in each region between breakpoints;
/// - `eval_many`, the copy, and the law after a round trip through serde under its tag agree with `eval`.
///
/// # Errors
/// All violations found.
pub fn check(element: &dyn Element) -> Result<(), Violations> {
    let mut found = Vec::new();
    if let Err(error) = element.validate() {
        found.push(format!("validate: {error}"));
    }
    finiteness(element, &mut found);
    if !found.is_empty() {
        // What is not finite would be reported again by every check below.
        return Violations::conclude(found);
    }
    parameters(element, &mut found);
    if element.automata().is_some() {
        automata::check(element, &mut found);
        copies(element, &mut found);
        return Violations::conclude(found);
    }
    if let Some(law) = element.evolving() {
        evolving::check(element, law, &mut found);
        copies(element, &mut found);
        return Violations::conclude(found);
    }
    smoothness::check(element, &mut found);
    partials(element, &mut found);
    velocity(element, &mut found);
    flanks(element, &mut found);
    for (displacement, frequency) in [(0.37, 1.0), (1.0, 12.5), (4.1e-3, 0.2)] {
        let units = Units {
            displacement,
            frequency,
            force: displacement,
        };
        covariance(element, &units, &mut found);
    }
    copies(element, &mut found);
    series::check(element, &mut found);
    Violations::conclude(found)
}

fn grid() -> impl Iterator<Item = (f64, f64, f64)> {
    let places = DISPLACEMENTS.into_iter();
    let places = places.flat_map(|q| VELOCITIES.map(|v| (q, v)));
    places.flat_map(|(q, v)| PHASES.map(|phase| (q, v, phase)))
}

fn finiteness(element: &dyn Element, found: &mut Vec<String>) {
    let sizes = || SIZES.into_iter().flat_map(|x| [x, -x]);
    let wide = sizes().flat_map(|q| sizes().map(move |v| (q, v, 0.7)));
    for (q, v, phase) in wide.chain(grid()) {
        let r = element.eval(q, v, phase);
        if ![r.f, r.df_dq, r.df_dv].iter().all(|x| x.is_finite()) {
            found.push(format!(
                "not finite at q = {q}, v = {v}, phase = {phase}: {r:?}"
            ));
            return;
        }
    }
}

fn parameters(element: &dyn Element, found: &mut Vec<String>) {
    let mut law = element.clone_box();
    let mut visit = || {
        let mut list: Vec<(String, Option<usize>, f64)> = Vec::new();
        law.visit_parameters(&mut |p: Parameter<'_>| {
            list.push((p.name.to_owned(), p.index, *p.value));
        });
        list
    };
    let (first, second) = (visit(), visit());
    if first != second {
        found.push(format!(
            "parameters are visited as {first:?}, then as {second:?}"
        ));
    }
    for (k, (name, index, value)) in first.iter().enumerate() {
        if !value.is_finite() {
            found.push(format!("parameter {name} is {value}"));
        }
        if first[..k].iter().any(|p| (&p.0, p.1) == (name, *index)) {
            found.push(format!("parameter {name} is visited twice"));
        }
    }
}

fn is_near_breakpoint(element: &dyn Element, q: f64) -> bool {
    let reach = 3.0 * STEP * (1.0 + q.abs());
    let list = element.breakpoints();
    list.iter().any(|b| (q - b).abs() <= reach)
}

fn partials(element: &dyn Element, found: &mut Vec<String>) {
    for (q, v, phase) in grid().filter(|(q, ..)| !is_near_breakpoint(element, *q)) {
        let at = |q: f64, v: f64| element.eval(q, v, phase);
        let r = at(q, v);
        let (h, hv) = (STEP * (1.0 + q.abs()), STEP * (1.0 + v.abs()));
        let by_q = (at(q + h, v).f - at(q - h, v).f) / (2.0 * h);
        let by_v = (at(q, v + hv).f - at(q, v - hv).f) / (2.0 * hv);
        for (name, exact, difference) in [("df/dq", r.df_dq, by_q), ("df/dv", r.df_dv, by_v)] {
            let size = 1.0 + exact.abs() + r.f.abs();
            if (exact - difference).abs() > DERIVATIVE_TOLERANCE * size {
                found.push(format!(
                    "{name} at q = {q}, v = {v}, phase = {phase}: {exact} is not {difference}"
                ));
            }
        }
    }
}

fn velocity(element: &dyn Element, found: &mut Vec<String>) {
    let undamps = |(q, v, phase): &(f64, f64, f64)| element.eval(*q, *v, *phase).df_dv < 0.0;
    if let Some((q, v, _)) = grid().find(undamps).filter(|_| element.is_passive()) {
        found.push(format!(
            "df/dv < 0 at q = {q}, v = {v}, but is_passive is true"
        ));
    }
    if element.depends_on_velocity() {
        return;
    }
    let depends = |(q, v, phase): &(f64, f64, f64)| {
        let r = element.eval(*q, *v, *phase);
        r.df_dv != 0.0 || element.eval(*q, v + 1.0, *phase).f != r.f
    };
    if let Some((q, v, _)) = grid().find(depends) {
        found.push(format!(
            "depends on v at q = {q}, v = {v}, but depends_on_velocity is false"
        ));
    }
}

fn flanks(element: &dyn Element, found: &mut Vec<String>) {
    let list = element.breakpoints();
    for pair in DISPLACEMENTS.windows(2) {
        let separated = list.iter().any(|b| *b >= pair[0] && *b <= pair[1]);
        if element.flank(pair[0]) != element.flank(pair[1]) && !separated {
            found.push(format!(
                "flank changes between {} and {} without a breakpoint",
                pair[0], pair[1]
            ));
        }
    }
    for q in DISPLACEMENTS {
        let forces = VELOCITIES.map(|v| PHASES.map(|phase| element.eval(q, v, phase).f));
        let loaded = forces.as_flattened().iter().find(|f| **f != 0.0);
        if let (0, Some(force)) = (element.flank(q), loaded) {
            found.push(format!("open at q = {q}, but the force is {force}"));
        }
    }
    for region in smoothness::regions(&list) {
        let inside = |share: f64| region.0 + share * (region.1 - region.0);
        let places = [0.2, 0.45, 0.7].map(inside);
        let is_free = |q: &f64| {
            let responses = VELOCITIES.map(|v| PHASES.map(|phase| element.eval(*q, v, phase)));
            let mut responses = responses.as_flattened().iter();
            responses.all(|r| *r == Response::default())
        };
        if places.iter().all(is_free) && element.flank(places[1]) != 0 {
            found.push(format!(
                "no force around q = {}, but flank says contact",
                places[1]
            ));
        }
    }
}

fn covariance(element: &dyn Element, units: &Units, found: &mut Vec<String>) {
    let scaled = nondimensional(element, units);
    let Units {
        displacement: l,
        frequency: w,
        ..
    } = *units;
    let mut say = |what: String| {
        found.push(format!(
            "scaling by {units:?} {what}: a parameter's dimension is wrong"
        ));
    };
    let pairs = scaled.breakpoints().into_iter().zip(element.breakpoints());
    for (got, expected) in pairs {
        if (got - expected / l).abs() > COVARIANCE_TOLERANCE * (expected / l).abs() {
            return say(format!(
                "moves the breakpoint {expected} to {got}, wanted {}",
                expected / l
            ));
        }
    }
    for (q, v, phase) in grid().filter(|(q, ..)| !is_near_breakpoint(element, *q)) {
        let own = element.eval(q, v, phase);
        let got = scaled.eval(q / l, v / (l * w), phase);
        let size = (1.0 + own.f.abs()) * (1.0 + v.abs() + q.abs());
        let gaps = [
            ("f", got.f, own.f / l, 1.0),
            ("df/dq", got.df_dq, own.df_dq, 1.0 + own.df_dq.abs()),
            (
                "df/dv",
                got.df_dv,
                own.df_dv * w,
                w * (1.0 + own.df_dv.abs()),
            ),
        ];
        for (name, got, expected, factor) in gaps {
            let allowed = COVARIANCE_TOLERANCE * size * factor * (1.0 + expected.abs());
            if (got - expected).abs() > allowed {
                return say(format!(
                    "gives {name} = {got} at q = {q}, v = {v}, wanted {expected}"
                ));
            }
        }
        if scaled.flank(q / l) != element.flank(q) {
            return say(format!("changes the flank at q = {q}"));
        }
    }
}

/// Series, copy and round trip against the law itself.
fn copies(element: &dyn Element, found: &mut Vec<String>) {
    if let Some((q, v, phase)) = first_difference(element, element.clone_box().as_ref()) {
        found.push(format!(
            "the copy says something else at q = {q}, v = {v}, phase = {phase}"
        ));
    }
    let (mut q, mut v, mut phase) = (Vec::new(), Vec::new(), Vec::new());
    for point in grid() {
        q.push(point.0);
        v.push(point.1);
        phase.push(point.2);
    }
    let mut out = [vec![0.0; q.len()], vec![0.0; q.len()], vec![0.0; q.len()]];
    let [f, df_dq, df_dv] = &mut out;
    element.eval_many(&q, &v, &phase, ResponseSeries { f, df_dq, df_dv });
    let series = (0..q.len()).find(|k| {
        let r = element.eval(q[*k], v[*k], phase[*k]);
        [r.f, r.df_dq, r.df_dv] != [out[0][*k], out[1][*k], out[2][*k]]
    });
    if let Some(k) = series {
        found.push(format!(
            "eval_many differs from eval at q = {}, v = {}, phase = {}",
            q[k], v[k], phase[k]
        ));
    }
    let again = serde_json::to_string(element)
        .and_then(|text| serde_json::from_str::<Box<dyn Element>>(&text).map(|law| (text, law)));
    match again {
        Err(error) => found.push(format!("serde round trip: {error}")),
        Ok((text, law)) => {
            if first_difference(element, law.as_ref()).is_some() {
                found.push(format!("serde round trip through {text} changes the law"));
            }
        }
    }
}

/// The first point of the grid at which two laws differ.
fn first_difference(a: &dyn Element, b: &dyn Element) -> Option<(f64, f64, f64)> {
    if a.breakpoints() != b.breakpoints() || a.typetag_name() != b.typetag_name() {
        return Some((f64::NAN, f64::NAN, f64::NAN));
    }
    grid().find(|(q, v, phase)| a.eval(*q, *v, *phase) != b.eval(*q, *v, *phase))
}
