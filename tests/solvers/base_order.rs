//! Orders below 1: the period of the excitation is several revolutions of the reference.

use crate::texts::run;

/// A pair whose load has the order, analysed between two frequencies of the reference.
fn pair(order: &str, range: [f64; 3], size: [usize; 2]) -> String {
    let [from, to, mark] = range;
    let [harmonics, samples] = size;
    format!(
        "
bodies: {{A: {{inertia: 1e-3}}, B: {{inertia: 2e-3}}}}
connections:
  m:
    gear: {{A: 35 mm, B: 47 mm}}
    stiffness: 2e8
    element: {{type: backlash, gap: 80 um}}
damping: {{modal_ratio: 0.03}}
loads: {{A: {{mean: 100, harmonics: [{{order: {order}, amplitude: 60}}]}}, B: {{mean: 134.2857142857143}}}}
report: {{units: si}}
analyses:
  a:
    {{type: frequency_response, from: {from} Hz, to: {to} Hz, marks: [{mark} Hz], harmonics: {harmonics}, samples: {samples},
     quadrature: sampled, methods: [galerkin, shooting]}}
"
    )
}

#[test]
fn order_one_half_at_twice_the_speed_is_order_one() {
    let whole = run(&pair("1", [3200.0, 2600.0, 2900.0], [40, 2048]));
    let half = run(&pair("0.5", [6400.0, 5200.0, 5800.0], [20, 1024]));
    let (whole, half) = (&whole[0], &half[0]);
    let marked = |r: &crate::texts::Results| {
        let rows = (0..r.rows()).filter(|k| r.value("mark", *k) == 1.0);
        rows.collect::<Vec<_>>()
    };
    let (rows, others) = (marked(whole), marked(half));
    assert_eq!(rows.len(), others.len());
    assert!(rows.len() >= 2, "a mark per method");
    for (a, b) in rows.into_iter().zip(others) {
        for name in whole.names(&[
            "rms.",
            "mean.",
            "min.",
            "max.",
            "rms_velocity.",
            "contact_ratio.",
            "force_max.",
        ]) {
            let (x, y) = (whole.value(&name, a), half.value(&name, b));
            assert!((x - y).abs() <= 1e-9 * x.abs(), "{name}: {x} and {y}");
        }
        let (x, y) = (whole.value("impacts.m", a), half.value("impacts.m", b));
        assert!(x > 0.0, "the gears separate");
        assert_eq!(x, 2.0 * y, "impacts are counted per revolution");
        let (x, y) = (
            whole.value("frequency_hz", a),
            half.value("frequency_hz", b),
        );
        assert!((2.0 * x - y).abs() <= 1e-12 * y);
    }
}
