//! Trains of soft and stiff meshes: the rounding of the flow keeps the residual above the tolerance, the solutions are good all the
//! same.

use crate::texts::{Results, run};

/// A chain of four gears whose middle mesh is stiffer by `spread`.
fn chain(spread: f64, method: &str) -> String {
    format!(
        "\
bodies: {{B0: {{inertia: 1e-3}}, B1: {{inertia: 1.6e-3}}, B2: {{inertia: 2.2e-3}}, B3: {{inertia: 1.3e-3}}}}
connections:
  c0: {{gear: {{B0: 50 mm, B1: 40 mm}}, stiffness: 1e8, element: {{type: backlash, half_gap: 20 um}}}}
  c1: {{gear: {{B1: 50 mm, B2: 55 mm}}, stiffness: {:e}, element: {{type: backlash, half_gap: 30 um}}}}
  c2: {{gear: {{B2: 50 mm, B3: 50 mm}}, stiffness: 1e8, element: {{type: backlash, half_gap: 40 um}}}}
damping: {{modal_ratio: 0.03}}
loads:
  B0: {{mean: 100, harmonics: [{{order: 1, amplitude: 60}}]}}
  B3: {{mean: 100, harmonics: [{{order: 1, amplitude: 30}}]}}
scaling: {{length: 20 um}}
report: {{units: nondimensional}}
analyses:
  r: {{type: frequency_response, from: 0.5, to: 0.45, marks: [0.48], stability: false, method: {method}}}
",
        1e8 * spread
    )
}

/// All meshes stay in contact, so that the Galerkin solution is exact; a period of the excitation holds two thousand of the fastest
/// mode, and the flow over them is good to some 1e-12.
#[test]
fn shooting_ends_at_rounding() {
    let shooting = run(&chain(1e6, "shooting")).remove(0);
    let galerkin = run(&chain(1e6, "galerkin, harmonics: 3")).remove(0);
    let residuals: Vec<f64> = (0..shooting.rows())
        .map(|row| shooting.value("residual", row))
        .collect();
    let largest = residuals.iter().fold(0.0_f64, |m, r| m.max(*r));
    // The hundredth of `tolerance` that shooting holds itself to is not reached everywhere, which is said.
    assert!(largest > 1e-12 && largest < 1e-10, "{largest:e}");
    let last = |results: &Results| results.rows() - 1;
    for name in ["rms.c0", "rms.c2", "mean.c0", "mean.c2", "rms_velocity.c0"] {
        let [s, g] = [&shooting, &galerkin].map(|r| r.value(name, last(r)));
        assert!((s / g - 1.0).abs() < 1e-9, "{name}: {s} {g}");
    }
}
