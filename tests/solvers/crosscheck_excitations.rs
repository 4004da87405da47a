//! Torque harmonics, transmission errors and stiffness variations of every kind: Galerkin, shooting and integration agree.

use crate::texts::{Results, run};

/// Two meshes; `excitation` belongs to the first.
fn train(excitation: &str, loads: &str) -> String {
    let method = |name: &str, method: &str| {
        format!(
            "  {name}: {{type: frequency_response, method: {method}, from: 2800 Hz, to: 2780 Hz{}}}\n",
            match method {
                "galerkin" => ", harmonics: 80, samples: 8192, marks: [2800 Hz]",
                "shooting" => ", marks: [2800 Hz]",
                _ => ", points: 2, transient: 600, periods: 8",
            }
        )
    };
    format!(
        "\
bodies: {{A: {{inertia: 1e-3}}, B: {{inertia: 2e-3}}, C: {{inertia: 1.5e-3}}}}
connections:
  first: {{gear: {{A: 50 mm, B: 40 mm}}, stiffness: 1.5e8, damping: 400, element: {{type: backlash, half_gap: 20 um}}{excitation}}}
  second: {{gear: {{B: 40 mm, C: 60 mm}}, stiffness: 2e8, element: {{type: backlash, half_gap: 5 um}}}}
damping: {{modal_ratio: 0.04}}
loads: {{A: {{mean: 50{loads}}}, C: {{mean: 60}}, B: {{mean: 80}}}}
scaling: {{length: 20 um}}
analyses:
{}{}{}",
        method("g", "galerkin"),
        method("s", "shooting"),
        method("i", "integration"),
    )
}

const RIPPLE: &str =
    ", harmonics: [{order: 1, amplitude: 20}, {order: 3, amplitude: 8, phase: 40 deg}]";
const KINDS: [&str; 5] = [
    "mean.",
    "rms.",
    "rms_velocity.",
    "force_mean.",
    "force_std.",
];

/// Largest distance of two results at 2800 Hz, each kind of column relative to its largest value.
fn apart(a: &Results, b: &Results) -> f64 {
    let at = |r: &Results| {
        (0..r.rows())
            .find(|i| (r.value("frequency_hz", *i) - 2800.0).abs() < 1e-6)
            .unwrap()
    };
    let mut worst = 0.0_f64;
    for kind in KINDS {
        let names = a.names(&[kind]);
        assert_eq!(names.len(), 2, "{names:?}");
        let [a, b] = [a, b].map(|r| {
            names
                .iter()
                .map(|n| r.value(n, at(r)))
                .collect::<Vec<f64>>()
        });
        let scale = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let distances = a.iter().zip(&b).map(|(a, b)| (a - b).abs() / scale);
        worst = distances.fold(worst, f64::max);
    }
    worst
}

/// Galerkin's coefficients decay like k^-4 beyond the kinks of the laws, like k^-3 where the stiffness jumps: what 80 of them leave
/// out is far below 1e-5. Shooting and integration solve the same equation to rounding and to what the transient leaves.
#[test]
fn three_methods_agree_under_every_excitation() {
    for (name, excitation, loads, tolerance) in [
        ("torque harmonics", "", RIPPLE, 1e-5),
        (
            "transmission error",
            ", transmission_error: {harmonics: [{order: 1, amplitude: 3 um}, {order: 2, amplitude: 1 um, phase: 1.0}]}",
            "",
            1e-5,
        ),
        (
            "table of transmission errors",
            ", transmission_error: {table: [0 um, 2 um, 3 um, 1 um, -2 um, -3 um, -1 um]}",
            "",
            1e-5,
        ),
        (
            "stiffness harmonics",
            ", stiffness_variation: {harmonics: [{order: 1, amplitude: 0.2}, {order: 2, amplitude: 0.05}]}",
            RIPPLE,
            1e-5,
        ),
        (
            "rectangular stiffness",
            ", stiffness_variation: {rectangular: {high: 1.15, low: 0.85, duty: 0.5, phase: 20 deg}}",
            RIPPLE,
            1e-5,
        ),
        (
            "rectangular stiffness of order 3",
            ", stiffness_variation: {rectangular: {high: 1.15, low: 0.85, duty: 0.5, phase: 20 deg}, base_order: 3}",
            RIPPLE,
            1e-5,
        ),
        (
            "table of stiffnesses",
            ", stiffness_variation: {table: [1.2, 1.1, 0.9, 0.8, 0.9, 1.1]}",
            RIPPLE,
            1e-5,
        ),
        (
            "all at once",
            ", transmission_error: {harmonics: [{order: 2, amplitude: 2 um}]}, stiffness_variation: {harmonics: [{order: 1, amplitude: 0.2}]}",
            RIPPLE,
            1e-5,
        ),
    ] {
        let results = run(&train(excitation, loads));
        let [galerkin, shooting, integration] = results.as_slice() else {
            panic!("{} results", results.len());
        };
        let (g, i) = (apart(galerkin, shooting), apart(integration, shooting));
        let moves = shooting.value("rms.first", 0) > 1e-7;
        println!("{name}: Galerkin {g:.1e}, integration {i:.1e}");
        assert!(moves && g < tolerance && i < 1e-7, "{name}: {g:e} {i:e}");
    }
}
