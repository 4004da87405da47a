//! The contract of a law as an executable check, for laws of this crate and of users alike.

use super::{Dimension, Element, Units, nondimensional};

/// Displacements, velocities and phases of the grid.
const DISPLACEMENTS: [f64; 13] = [
    -50.0, -3.1, -1.7, -0.93, -0.41, -0.13, 0.0, 0.11, 0.37, 0.89, 1.3, 2.9, 60.0,
];
const VELOCITIES: [f64; 5] = [-7.0, -0.6, 0.0, 0.45, 5.0];
const PHASES: [f64; 3] = [0.0, 1.0, 4.4];
/// Difference step of the derivative test; central differences of smooth laws then agree to about 1e-9.
const STEP: f64 = 1e-5;
const DERIVATIVE_TOLERANCE: f64 = 1e-6;
const COVARIANCE_TOLERANCE: f64 = 1e-11;

/// Everything in which a law breaks the contract of [`Element`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the law breaks its contract:\n{}", .0.join("\n"))]
pub struct Violations(pub Vec<String>);

/// Checks a law, parameters nondimensional and of order one:
///
/// - parameters pass `validate`, are finite, and the copy is equal;
/// - force and partials are finite on a wide grid, and the partials equal central differences away from breakpoints;
/// - breakpoints are ascending, and force and partials are smooth elsewhere; the force is continuous there unless
///   `is_discontinuous`;
/// - `is_piecewise_affine`, `depends_on_velocity` and `is_passive` are honest;
/// - `flank` changes at breakpoints only, and an open flank carries no force;
/// - scaling displacement, time and force changes the law as its dimensions say:
///   f*(q / l, v / (l w)) = f(q, v) / l;
/// - the law survives a round trip through serde under its registered tag.
///
/// # Errors
/// All violations found.
pub fn check(element: &dyn Element) -> Result<(), Violations> {
    let mut found = Vec::new();
    if let Err(error) = element.validate() {
        found.push(format!("validate: {error}"));
    }
    breakpoints(element, &mut found);
    responses(element, &mut found);
    flanks(element, &mut found);
    for units in [
        Units {
            displacement: 0.37,
            frequency: 1.0,
            force: 0.37,
        },
        Units {
            displacement: 1.0,
            frequency: 12.5,
            force: 1.0,
        },
        Units {
            displacement: 4.1e-3,
            frequency: 0.2,
            force: 4.1e-3,
        },
    ] {
        covariance(element, &units, &mut found);
    }
    round_trip(element, &mut found);
    if found.is_empty() {
        Ok(())
    } else {
        Err(Violations(found))
    }
}

/// Checks every registered law, plugins included, on its documented example, and that the tags are unique.
///
/// # Errors
/// All violations found, with the tag in front.
pub fn check_registered() -> Result<(), Violations> {
    let mut found: Vec<String> = super::duplicate_tags()
        .iter()
        .map(|tag| format!("{tag}: registered more than once"))
        .collect();
    for info in super::registered() {
        let mut say = |what: String| found.push(format!("{}: {what}", info.tag));
        let node = crate::yaml::parse(info.example, info.tag).map_err(|e| e.to_string());
        let element = node.and_then(|n| n.read::<Box<dyn Element>>("").map_err(|e| e.to_string()));
        let element = match element {
            Ok(element) => element,
            Err(error) => {
                say(format!("the example cannot be read: {error}"));
                continue;
            }
        };
        if element.typetag_name() != info.tag {
            say(format!(
                "typetag knows the law as {}",
                element.typetag_name()
            ));
        }
        if let Err(violations) = check(element.as_ref()) {
            violations.0.into_iter().for_each(&mut say);
        }
        let mut copy = element.clone_box();
        copy.visit_parameters(&mut |p| {
            let documented = info
                .parameters
                .iter()
                .find(|i| i.name == p.name)
                .map(|i| i.dimension);
            // A law may keep a parameter in another form than it is written in; the name then is not documented.
            if documented.is_some_and(|d: Dimension| d != p.dimension) {
                say(format!(
                    "{}: the documented dimension is not the visited one",
                    p.name
                ));
            }
        });
    }
    if found.is_empty() {
        Ok(())
    } else {
        Err(Violations(found))
    }
}

fn is_near_breakpoint(element: &dyn Element, q: f64) -> bool {
    element
        .breakpoints()
        .iter()
        .any(|b| (q - b).abs() <= 3.0 * STEP)
}

fn breakpoints(element: &dyn Element, found: &mut Vec<String>) {
    let list = element.breakpoints();
    if list.windows(2).any(|w| w[0] >= w[1]) || list.iter().any(|b| !b.is_finite()) {
        found.push(format!("breakpoints {list:?} are not finite and ascending"));
    }
    for b in list {
        let offset = 1e-9 * (1.0 + b.abs());
        for v in VELOCITIES {
            let (left, right) = (
                element.eval(b - offset, v, 0.3),
                element.eval(b + offset, v, 0.3),
            );
            let jump = (left.f - right.f).abs();
            let allowed = 4.0 * offset * (left.df_dq.abs() + right.df_dq.abs()) + 1e-12;
            if jump > allowed && !element.is_discontinuous() {
                found.push(format!("the force jumps by {jump:e} at the breakpoint {b}, but is_discontinuous is false"));
            }
        }
    }
}

fn responses(element: &dyn Element, found: &mut Vec<String>) {
    for q in DISPLACEMENTS {
        for (v, phase) in VELOCITIES.iter().flat_map(|v| PHASES.map(|p| (*v, p))) {
            let at = |q: f64, v: f64| element.eval(q, v, phase);
            let r = at(q, v);
            if ![r.f, r.df_dq, r.df_dv].iter().all(|x| x.is_finite()) {
                found.push(format!(
                    "not finite at q = {q}, v = {v}, phase = {phase}: {r:?}"
                ));
                continue;
            }
            if !element.depends_on_velocity() && (r.df_dv != 0.0 || at(q, v + 1.0).f != r.f) {
                found.push(format!(
                    "depends on v at q = {q}, v = {v}, but depends_on_velocity is false"
                ));
            }
            if element.is_passive() && r.df_dv < 0.0 {
                found.push(format!(
                    "df/dv = {} at q = {q}, v = {v}, but is_passive is true",
                    r.df_dv
                ));
            }
            if is_near_breakpoint(element, q) {
                continue;
            }
            let h = STEP * (1.0 + q.abs());
            let hv = STEP * (1.0 + v.abs());
            let by_q = (at(q + h, v).f - at(q - h, v).f) / (2.0 * h);
            let by_v = (at(q, v + hv).f - at(q, v - hv).f) / (2.0 * hv);
            for (name, exact, difference) in [("df/dq", r.df_dq, by_q), ("df/dv", r.df_dv, by_v)] {
                if (exact - difference).abs()
                    > DERIVATIVE_TOLERANCE * (1.0 + exact.abs() + r.f.abs())
                {
                    found.push(format!(
                        "{name} at q = {q}, v = {v}, phase = {phase}: {exact} is not {difference}"
                    ));
                }
            }
            let curved = (at(q + h, v).df_dq - r.df_dq).abs() > 1e-12 * (1.0 + r.df_dq.abs())
                || r.df_dv != 0.0;
            if element.is_piecewise_affine()
                && (curved || at(q, v).f != element.eval(q, v, phase + 0.7).f)
            {
                found.push(format!(
                    "not affine around q = {q}, v = {v}, but is_piecewise_affine is true"
                ));
            }
        }
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
        let (flank, force) = (element.flank(q), element.eval(q, 0.0, 0.0).f);
        if flank == 0 && force != 0.0 {
            found.push(format!("open at q = {q}, but the force is {force}"));
        }
    }
}

fn covariance(element: &dyn Element, units: &Units, found: &mut Vec<String>) {
    let scaled = nondimensional(element, units);
    for (q, v) in DISPLACEMENTS
        .iter()
        .flat_map(|q| VELOCITIES.map(|v| (*q, v)))
    {
        if is_near_breakpoint(element, q) {
            continue;
        }
        let expected = element.eval(q, v, 0.3).f / units.displacement;
        let got = scaled
            .eval(
                q / units.displacement,
                v / (units.displacement * units.frequency),
                0.3,
            )
            .f;
        if (got - expected).abs()
            > COVARIANCE_TOLERANCE * (1.0 + expected.abs()) * (1.0 + v.abs() + q.abs())
        {
            found.push(format!(
                "scaling by {units:?} gives f = {got} at q = {q}, v = {v}, wanted {expected}: a parameter's dimension is wrong"
            ));
            return;
        }
    }
}

fn round_trip(element: &dyn Element, found: &mut Vec<String>) {
    let again = serde_json::to_string(element)
        .and_then(|text| serde_json::from_str::<Box<dyn Element>>(&text).map(|law| (text, law)));
    match again {
        Err(error) => found.push(format!("serde round trip: {error}")),
        Ok((text, law)) => {
            let differs = |q: &f64| law.eval(*q, 0.4, 0.2) != element.eval(*q, 0.4, 0.2);
            if DISPLACEMENTS.iter().any(differs) {
                found.push(format!("serde round trip through {text} changes the law"));
            }
        }
    }
}
