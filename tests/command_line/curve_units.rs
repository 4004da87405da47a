//! Curves of bifurcations in the units in which their ranges are written.

use crate::program::Place;

/// One body on a spring with backlash: contact is lost where the amplitude exceeds the mean load times |1 - r^2 + 2 i zeta r|.
#[test]
fn a_curve_is_drawn_in_the_units_of_its_ranges() {
    let place = Place::with(
        "schema: 1
bodies: {A: {inertia: 1e-3}}
connections: {spring: {ground: A, stiffness: 400, element: {type: backlash, half_gap: 1 mrad}}}
damping: {modal_ratio: 0.05}
loads: {A: {mean: 1, harmonics: [{order: 1, amplitude: 0.7}]}}
analyses:
  border:
    type: bifurcation_curve
    parameters: [frequency, loads.A.harmonics.0.amplitude]
    ranges: [[2500 rpm, 3500 rpm], [600 N mm, 0.9 N m]]
    start: {kind: grazing, connection: spring, at: {frequency: 3000 rpm, loads.A.harmonics.0.amplitude: 0.755}}
",
    );
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    let table = place.read("o/border.csv");
    let mut rows = table
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let names = rows.next().unwrap();
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let [omega, torque, x, y] = ["parameter_1", "parameter_2", "x", "y"].map(column);
    let mut count = 0;
    for row in rows {
        let [omega, torque, x, y] = [omega, torque, x, y].map(|k| row[k].parse::<f64>().unwrap());
        let r = omega / (400.0_f64 / 1e-3).sqrt();
        let border = (1.0 - r * r).hypot(2.0 * 0.05 * r);
        assert!(
            (torque - border).abs() < 1e-9 * border,
            "{omega}: {torque} {border}"
        );
        assert!(
            (x - omega * 30.0 / std::f64::consts::PI).abs() < 1e-9 * x,
            "{x}"
        );
        assert!((y - 1e3 * torque).abs() < 1e-9 * y, "{y}");
        count += 1;
    }
    assert!(count > 10, "{count}");
    let figure = place.read("o/border.svg");
    assert!(figure.contains("[rpm]") && figure.contains("[N mm]") && !figure.contains("[rad/s]"));
}
