//! Whole processes on long trains of bodies and connections: what a user waits for.

use crate::program::Place;
use std::fmt::Write;

/// Gears of one size in a row, every mesh with backlash, driven at the first gear.
fn row(meshes: usize) -> String {
    let mut text = String::from("schema: 1\nname: row\nbodies:\n");
    for k in 0..=meshes {
        writeln!(text, "  gear_{k}: {{inertia: 1e-3}}").unwrap();
    }
    text += "connections:\n";
    for k in 0..meshes {
        let next = k + 1;
        writeln!(
            text,
            "  mesh_{k}: {{gear: {{gear_{k}: 50 mm, gear_{next}: 50 mm}}, stiffness: 1e8, element: {{type: backlash, half_gap: 20 um}}}}"
        )
        .unwrap();
    }
    // Torque from the first gear to the last one: every mesh carries it, in turns on either flank.
    let last = if meshes.is_multiple_of(2) { -100 } else { 100 };
    writeln!(
        text,
        "damping: {{stiffness_proportional: 2e-6}}\nscaling: {{frequency: 2e4 rad/s}}\nreport: {{units: nondimensional}}\nloads:\n  \
         gear_0: {{mean: 100, harmonics: [{{order: 1, amplitude: 60}}]}}\n  gear_{meshes}: {{mean: {last}}}\n\
         analyses:\n  response: {{type: frequency_response, from: 2.5, to: 2.0, harmonics: 3, samples: 64, stability: false, step: 0.05}}"
    )
    .unwrap();
    text
}

/// Products of whole matrices at every instant and for every body would take a minute.
#[cfg(unix)]
#[test]
fn a_long_train_takes_seconds_with_all_its_tables() {
    let place = Place::with(&row(200));
    let ended = place.run_after(
        "ulimit -t 10",
        &["run", "m.yaml", "--out", "out", "--quiet"],
    );
    ended.ends_with(0);
    let rows = place.table("out/response.rattle.csv");
    assert!(
        rows[0]
            .iter()
            .any(|name| name == "peak_acceleration.gear_200")
    );
    assert!(rows.len() > 5, "{}", rows.len());
}
