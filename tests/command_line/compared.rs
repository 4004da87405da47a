//! Measured values over computed ones.

use crate::program::{Place, TRAIN};

fn place(compare: &str) -> Place {
    let text = TRAIN.replace(
        "marks: [8.5 kHz]}",
        &format!("marks: [8.5 kHz], compare: {compare}}}"),
    );
    let place = Place::with(&text);
    place.write(
        "test.csv",
        "speed;amplitude;bad\n510000;20,5;x\n520000;21,5;1\n",
    );
    place
}

#[test]
fn measured_values_lie_over_the_computed_curve() {
    let place = place(
        "{file: test.csv, x: speed, y: amplitude, over: rms.mesh, x_unit: rpm, y_unit: um, label: test bench}",
    );
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    let table = place.read("o/response.measured.csv");
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows[0].ends_with(",rms.mesh"), "{table}");
    let last: Vec<f64> = rows[2].split(',').map(|x| x.parse().unwrap()).collect();
    assert!((last[1] - 21.5e-6).abs() < 1e-18, "{table}");
    let before = place.read("o/response.svg");
    assert!(before.contains("test bench"));
    assert!(place.read("o/report.html").contains("test bench"));
    assert!(place.read("o/manifest.json").contains("test.csv"));
    // The folder holds what was measured.
    std::fs::remove_file(place.path("test.csv")).unwrap();
    place.run(&["plot", "o"]).ends_with(0);
    assert!(place.read("o/response.svg") == before);
}

#[test]
fn mistakes_in_comparisons_are_named() {
    for (compare, wanted) in [
        ("{file: no.csv, x: a, y: b}", "no.csv"),
        (
            "{file: test.csv, x: speed, y: nothing}",
            "no column `nothing`",
        ),
        ("{file: test.csv, x: speed, y: bad}", "row 2, column `bad`"),
        (
            "{file: test.csv, x: speed, y: amplitude, y_unit: parsec}",
            "parsec",
        ),
        ("{file: test.csv, x: speed}", "the key `y` is missing"),
    ] {
        let place = place(compare);
        let run = place.run(&["run", "m.yaml", "--out", "o"]);
        run.ends_with(2).says(&[wanted, "compare"]);
    }
}

#[test]
fn an_axis_shows_the_speed_of_any_shaft_and_a_run_up_its_spectra() {
    let place = Place::with(
        "schema: 1\nreference: {body: A, speed: 1000 rpm}\nbodies: {A: {inertia: 1.0e-3}, B: {inertia: 1.0e-3}}\n\
         connections: {mesh: {gear: {A: 20 mm, B: 50 mm}, stiffness: 1.0e6, damping: 20, element: {type: backlash, half_gap: 20 um}}}\n\
         loads: {A: {mean: 2 N m, harmonics: [{order: 2, amplitude: 1 N m}]}, B: {mean: 5 N m}}\nreport: {units: si}\n\
         analyses:\n  sweep: {type: frequency_response, from: 1000 rpm, to: 1100 rpm, harmonics: 4, plot: {x_unit: rpm of B}}\n  \
         up: {type: run_up, from: 900 rpm, to: 1200 rpm, duration: 2 s, orders: [2], spectrum_to: 24}\n",
    );
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    let text = place.read("o/sweep.svg");
    assert!(
        text.contains("speed of B [rpm]") && text.contains(">400<"),
        "{text}"
    );
    let text = place.read("o/up.spectra.svg");
    assert!(text.contains("dB re 1e-12 m") && text.contains("mode 1 in contact"));
    place
        .run(&["plot", "o", "--only", "sweep", "--plot", "x_unit=rpm of C"])
        .ends_with(2)
        .says(&["no shaft called `C`", "A, B"]);
}
