//! Contact made at the very start of a motion: once, by both integrators.

use crate::time_domain_support::*;

/// Times and flanks of the switches of one oscillator that starts on the edge of a gap.
fn switches(load: &str, damping: f64, q: f64, v: f64, integrator: &str) -> Vec<(f64, i64, i64)> {
    let model = format!(
        "schema: 1\nreduced:\n  stiffness: [[1]]\n  damping: {{matrix: [[{damping}]]}}\n  elements: {{g: {{type: backlash, half_gap: 1.0}}}}\n  loads: {load}\n"
    );
    let report = run(
        &model,
        &format!(
            "{{type: time_history, at: 0.7, periods: 10, samples_per_period: 10, initial: {{q: [{q}], v: [{v}]}}, integrator: {integrator}}}"
        ),
    );
    let table = &report.tables[1];
    let (from, to) = (floats(table, "from"), floats(table, "to"));
    (floats(table, "time").into_iter().zip(from.iter().zip(&to)))
        .map(|(t, (from, to))| (t, *from as i64, *to as i64))
        .collect()
}

const SINE: &str = "{mean: [0], harmonics: [{order: 1, cos: [0], sin: [0.5]}]}";
const MINUS_SINE: &str = "{mean: [0], harmonics: [{order: 1, cos: [0], sin: [-0.5]}]}";
const ONE_MINUS_COSINE: &str = "{mean: [0.5], harmonics: [{order: 1, cos: [-0.5], sin: [0]}]}";

#[test]
fn a_load_that_grows_from_zero_closes_the_contact_once() {
    for integrator in ["exact", "dopri5"] {
        let list = switches(SINE, 0.1, 1.0, 0.0, integrator);
        assert_eq!((list[0].1, list[0].2), (0, 1), "{integrator}");
        assert!(list[0].0.abs() < 1e-9, "{integrator}: {list:?}");
        // DOP853 restarted at the switches.
        assert!((list[1].0 - 5.3909649150).abs() < 2e-8, "{integrator}");
        assert_eq!((list[1].1, list[1].2), (1, 0));
        // The same on the other side.
        let mirrored = switches(MINUS_SINE, 0.1, -1.0, 0.0, integrator);
        assert_eq!((mirrored[0].1, mirrored[0].2), (0, -1), "{integrator}");
        assert!((mirrored[1].0 - list[1].0).abs() < 1e-9);
        // q - 1 grows like t^4: nothing else before 7.66.
        let list = switches(ONE_MINUS_COSINE, 0.0, 1.0, 0.0, integrator);
        assert_eq!((list[0].1, list[0].2), (0, 1), "{integrator}");
        assert!(
            list[0].0.abs() < 1e-9 && list[1].0 > 7.6,
            "{integrator}: {list:?}"
        );
    }
}

#[test]
fn a_start_into_the_gap_makes_no_contact() {
    for integrator in ["exact", "dopri5"] {
        for (load, v) in [(MINUS_SINE, 0.0), (SINE, -0.3)] {
            let list = switches(load, 0.1, 1.0, v, integrator);
            assert!(list[0].0 > 0.1, "{integrator}: {list:?}");
        }
        // A rate outwards closes the contact whatever the load does.
        let list = switches(MINUS_SINE, 0.1, 1.0, 0.3, integrator);
        assert_eq!(
            (list[0].0, list[0].1, list[0].2),
            (0.0, 0, 1),
            "{integrator}"
        );
    }
}
