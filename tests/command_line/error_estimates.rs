//! `error_estimate`: r.m.s. values, peak forces and multipliers against exact values.

use crate::confirm::stiff_stop;
use crate::program::Place;

/// R.m.s. and peak force at a mark by the method `shooting`, which is exact.
fn exact(hardness: f64, marks: &str) -> Place {
    let place = Place::with(&stiff_stop(
        hardness,
        &format!("method: shooting, marks: {marks}, max_step: 0.02"),
    ));
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    place
}

/// Row of a frequency.
fn row(place: &Place, table: &str, omega: f64) -> usize {
    let list = place.column(table, "omega");
    list.iter().position(|w| *w == omega).unwrap()
}

#[test]
fn estimates_are_the_errors_along_stiff_stops() {
    let marks = [0.8, 0.9, 0.95, 0.985, 1.0, 1.1];
    let listed = format!("{marks:?}");
    for (hardness, harmonics) in [(1e4, 40), (1e4, 80), (100.0, 20)] {
        let keys = format!("harmonics: {harmonics}, marks: {listed}, error_estimate: true");
        let place = Place::with(&stiff_stop(hardness, &keys));
        let ended = place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
        assert!(
            ended.out.contains("Estimated relative errors"),
            "{}",
            ended.out
        );
        let flow = exact(hardness, &listed);
        for omega in marks {
            let (here, there) = (row(&place, "o/a.csv", omega), row(&flow, "o/a.csv", omega));
            let judged = row(&place, "o/a.accuracy.csv", omega);
            for name in ["rms.stop", "force_max.stop"] {
                let value = place.column("o/a.csv", name)[here];
                let error = (value - flow.column("o/a.csv", name)[there]).abs();
                let estimate = place.column("o/a.accuracy.csv", &format!("error_{name}"))[judged];
                let ratio = estimate / error;
                assert!(
                    (0.5..2.0).contains(&ratio) || error < 1e-9 * value,
                    "{hardness}, {harmonics}, {omega}, {name}: {estimate:e}, true {error:e}"
                );
            }
        }
    }
}

/// The exact orbit (DOP853 restarted at switches): r.m.s. 0.63830262 at 0.985, largest x - 1 0.0057647656642 at 0.9.
#[test]
fn values_from_an_independent_program() {
    let keys = "harmonics: 40, marks: [0.9, 0.985], error_estimate: true";
    let place = Place::with(&stiff_stop(1e4, keys));
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    for (omega, name, wanted) in [
        (0.985, "rms.stop", 0.63830262),
        (0.9, "force_max.stop", 0.0057647656642),
    ] {
        let value = place.column("o/a.csv", name)[row(&place, "o/a.csv", omega)];
        let judged = row(&place, "o/a.accuracy.csv", omega);
        let estimate = place.column("o/a.accuracy.csv", &format!("error_{name}"))[judged];
        let error = (value - wanted).abs();
        assert!(
            (estimate / error - 1.0).abs() < 1e-3,
            "{omega} {name}: {estimate:e}, true {error:e}"
        );
    }
    let multipliers = place.column("o/a.accuracy.csv", "error_multipliers");
    assert!(multipliers.iter().all(|e| e.is_finite()));
}

/// Without an exact flow twice the harmonics judge: for a smooth law they are exact.
#[test]
fn smooth_laws_are_judged_by_the_series() {
    let model = |keys: &str| {
        format!(
            "\
schema: 1
name: Duffing
reduced:
  stiffness: [[1]]
  damping: {{matrix: [[0.1]]}}
  elements: {{spring: {{type: cubic, cubic: 0.5}}}}
  loads: {{mean: [0.2], harmonics: [{{order: 1, cos: [0.4]}}]}}
analyses:
  a: {{type: frequency_response, from: 0.3, to: 0.8, marks: [0.4, 0.5, 0.6, 0.7], {keys}}}
"
        )
    };
    let few = Place::with(&model("harmonics: 3, error_estimate: true"));
    few.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    let many = Place::with(&model("harmonics: 24"));
    many.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    for omega in [0.4, 0.5, 0.6, 0.7] {
        let (here, there) = (row(&few, "o/a.csv", omega), row(&many, "o/a.csv", omega));
        let judged = row(&few, "o/a.accuracy.csv", omega);
        for name in ["rms.spring", "force_max.spring"] {
            let exact = many.column("o/a.csv", name)[there];
            let error = (few.column("o/a.csv", name)[here] - exact).abs();
            let estimate = few.column("o/a.accuracy.csv", &format!("error_{name}"))[judged];
            assert!(
                (0.5..2.0).contains(&(estimate / error)),
                "{omega} {name}: {estimate:e}, true {error:e}"
            );
        }
        let error = (few.column("o/a.csv", "multiplier_modulus")[here]
            - many.column("o/a.csv", "multiplier_modulus")[there])
            .abs();
        assert!(few.column("o/a.accuracy.csv", "error_multipliers")[judged] > 0.5 * error);
    }
}

/// Twice the harmonics do not see a contact shorter than their period: the series judges itself in many times the harmonics.
#[test]
fn estimates_of_the_series_alone_are_the_errors() {
    let marks = [0.8, 0.9, 0.95, 1.0, 1.1];
    let listed = format!("{marks:?}");
    for (hardness, harmonics) in [(1e3, 12), (1e3, 20), (1e4, 40)] {
        let keys =
            format!("harmonics: {harmonics}, marks: {listed}, error_estimate: true, confirm: none");
        let place = Place::with(&stiff_stop(hardness, &keys));
        place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
        let flow = exact(hardness, &listed);
        for omega in marks {
            let (here, there) = (row(&place, "o/a.csv", omega), row(&flow, "o/a.csv", omega));
            let judged = row(&place, "o/a.accuracy.csv", omega);
            for name in ["rms.stop", "force_max.stop"] {
                let value = place.column("o/a.csv", name)[here];
                let error = (value - flow.column("o/a.csv", name)[there]).abs();
                let estimate = place.column("o/a.accuracy.csv", &format!("error_{name}"))[judged];
                assert!(
                    (0.5..2.0).contains(&(estimate / error)),
                    "{hardness}, {harmonics}, {omega}, {name}: {estimate:e}, true {error:e}"
                );
            }
        }
    }
}
