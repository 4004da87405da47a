//! Bodies with measured motion: closed forms of base excitation, the same motion as a transmission error, both integrators.

use crate::response_support::marked;
use crate::time_domain_support::{floats, main_table, refusal, run};
use num_complex::Complex;
use std::f64::consts::{PI, TAU};

const SPEEDS: [f64; 6] = [780.0, 800.0, 830.0, 810.0, 790.0, 790.0];
const RPM: f64 = TAU / 60.0;

/// Order k of a broken line through uniform values, e^(i k phase): X_k/N sinc^2(k/N).
fn order(values: &[f64], k: usize) -> [f64; 2] {
    let n = values.len() as f64;
    let x = PI * k as f64 / n;
    let share = (x.sin() / x).powi(2) / n;
    let turn = |m: usize| TAU * (k * m) as f64 / n;
    let sum = |f: fn(f64) -> f64| -> f64 {
        let parts = values.iter().enumerate();
        parts.map(|(m, value)| value * f(turn(m))).sum()
    };
    [share * sum(f64::cos), -share * sum(f64::sin)]
}

/// Twist of a shaft over the angle of its driven end, |J s^2 / (J s^2 + c s + k)| at s = i w.
fn twist(w: f64) -> f64 {
    let (j, k, c) = (2e-2, 2e3, 0.3);
    let m = j * w * w;
    m / (k - m).hypot(c * w)
}

fn wheel(motion: &str) -> String {
    format!(
        "schema: 1\nreference: {{body: B, speed: 800 rpm}}\nbodies: {{B: {{motion: {motion}}}, W: {{inertia: 2.0e-2}}}}\n\
         connections: {{s: {{shaft: [B, W], stiffness: 2000, damping: 0.3}}}}\nreport: {{units: si}}\n"
    )
}

fn response(method: &str, harmonics: usize) -> String {
    format!(
        "{{type: frequency_response, from: 780 rpm, to: 820 rpm, method: {method}, harmonics: {harmonics}, marks: [800 rpm], tolerance: 1e-13, stability: false}}"
    )
}

fn rms_at_mark(model: &str, analysis: &str) -> f64 {
    let report = run(model, analysis);
    let table = main_table(&report);
    floats(table, "rms.s")[marked(table)[0]]
}

#[test]
fn a_measured_speed_excites_with_its_exact_orders() {
    let listed: Vec<String> = SPEEDS.iter().map(|w| format!("{w} rpm")).collect();
    let model = wheel(&format!(
        "{{values: [{}], revolutions: 2}}",
        listed.join(", ")
    ));
    let mean = SPEEDS.iter().sum::<f64>() / SPEEDS.len() as f64;
    let sum = |orders: usize| {
        let one = |k: usize| {
            let [re, im] = order(&SPEEDS, k);
            let o = k as f64 / 2.0;
            2.0 * (re.hypot(im) / mean / o * twist(o * 800.0 * RPM)).powi(2)
        };
        (1..=orders).map(one).sum::<f64>().sqrt()
    };
    let found = rms_at_mark(&model, &response("galerkin", 15));
    let wanted = sum(30);
    assert!((found / wanted - 1.0).abs() < 1e-11, "{found:e} {wanted:e}");
    let found = rms_at_mark(&model, &response("shooting", 15));
    let wanted = sum(2000);
    assert!((found / wanted - 1.0).abs() < 1e-9, "{found:e} {wanted:e}");
}

#[test]
fn a_measured_angle_excites_with_the_orders_that_its_samples_show() {
    let angles = [0.0, 0.3, -0.1, 0.2, 0.05, -0.4, 0.0, 0.1];
    let model = wheel(&format!("{{values: {angles:?}, unit: deg}}"));
    let one = |k: usize| {
        let [re, im] = order(&angles, k);
        2.0 * (re.hypot(im) * PI / 180.0 * twist(k as f64 * 800.0 * RPM)).powi(2)
    };
    let wanted = (1..=4).map(one).sum::<f64>().sqrt();
    for method in ["galerkin", "shooting"] {
        let found = rms_at_mark(&model, &response(method, 6));
        assert!(
            (found / wanted - 1.0).abs() < 1e-10,
            "{method}: {found:e} {wanted:e}"
        );
    }
}

/// Deformation of a shaft behind an angle x, over x: the other end is a wheel on a second shaft whose far end has the angle y x.
fn strained(w: f64, y: f64) -> Complex<f64> {
    let i = Complex::<f64>::i();
    let (j, a, b) = (2e-2, 2e3 + 0.3 * i * w, 1.5e3 + 0.2 * i * w);
    1.0 - (a + b * y) / (a + b - j * w * w)
}

/// Beside a ground: its shaft takes up the measured angle, with its mean.
#[test]
fn a_measured_angle_strains_a_grounded_train() {
    let angles = [0.3, 0.6, -0.1, 0.2, 0.05, -0.4];
    let grounded = "connections: {g: {ground: W, stiffness: 1500, damping: 0.2}, ";
    let model = wheel(&format!("{{values: {angles:?}, unit: deg}}"))
        .replace("connections: {", grounded)
        .replace("reference: {body: B, speed: 800 rpm}\n", "");
    let degree = PI / 180.0;
    let mean = angles.iter().sum::<f64>() / 6.0 * degree;
    let one = |k: usize| {
        let [re, im] = order(&angles, k);
        let x = re.hypot(im) * degree;
        2.0 * (x * strained(k as f64 * 800.0 * RPM, 0.0).norm()).powi(2)
    };
    // The deformation's own mean: the two shafts share the mean angle by their stiffness.
    let still = mean * 1500.0 / 3500.0;
    let wanted = (1..=3).map(one).sum::<f64>().sqrt();
    for method in ["galerkin", "shooting"] {
        let report = run(&model, &response(method, 4));
        let table = main_table(&report);
        let at = |column: &str| floats(table, column)[marked(table)[0]];
        let found = at("rms.s");
        assert!(
            (found / wanted - 1.0).abs() < 1e-9,
            "{method}: {found:e} {wanted:e}"
        );
        assert!((at("mean.s").abs() - still).abs() < 1e-12, "{method}");
        assert!(table.column("dte_rms.s").is_none());
    }
}

/// Both ends of a train on a test bench are measured: the second one strains it by what the first does not explain.
#[test]
fn two_measured_ends_strain_the_train_between_them() {
    let (first, second) = ([0.3, 0.6, -0.1, 0.2], [-0.15, -0.3, 0.05, -0.1]);
    let model = wheel(&format!("{{values: {first:?}, unit: deg}}"))
        .replace(
            "W: {",
            &format!("C: {{motion: {{values: {second:?}, unit: deg}}}}, W: {{"),
        )
        .replace(
            "connections: {",
            "connections: {t: {shaft: [W, C], stiffness: 1500, damping: 0.2}, ",
        );
    let one = |k: usize| {
        let [re, im] = order(&first, k);
        let x = re.hypot(im) * PI / 180.0;
        2.0 * (x * strained(k as f64 * 800.0 * RPM, -0.5).norm()).powi(2)
    };
    let wanted = (1..=2).map(one).sum::<f64>().sqrt();
    for method in ["galerkin", "shooting"] {
        let found = rms_at_mark(&model, &response(method, 4));
        assert!(
            (found / wanted - 1.0).abs() < 1e-9,
            "{method}: {found:e} {wanted:e}"
        );
    }
}

/// Measured rows say as many orders as half their number, and as many of the broken line as are wanted.
#[test]
fn an_angle_keeps_every_order_of_its_rows() {
    let angles: Vec<f64> = (0..180).map(|k| f64::from(k % 2) * 0.1).collect();
    let model = wheel(&format!("{{values: {angles:?}, unit: deg}}"));
    let [re, im] = order(&angles, 90);
    let wanted = 2.0_f64.sqrt() * re.hypot(im) * PI / 180.0 * twist(90.0 * 800.0 * RPM);
    let found = rms_at_mark(&model, &response("shooting", 6));
    assert!((found / wanted - 1.0).abs() < 1e-9, "{found:e} {wanted:e}");
    let few = wheel("{values: [0, 0.3, -0.1, 0.2], unit: deg, orders: 9}");
    let angles = [0.0, 0.3, -0.1, 0.2];
    let one = |k: usize| {
        let [re, im] = order(&angles, k);
        2.0 * (re.hypot(im) * PI / 180.0 * twist(k as f64 * 800.0 * RPM)).powi(2)
    };
    let wanted = (1..=9).map(one).sum::<f64>().sqrt();
    let found = rms_at_mark(&few, &response("galerkin", 10));
    assert!((found / wanted - 1.0).abs() < 1e-10, "{found:e} {wanted:e}");
}

/// A wheel with a given motion drives a loose gear; the same as a transmission error of a mesh to the frame.
#[test]
fn a_driving_wheel_is_a_transmission_error() {
    let angles = [0.0, 0.12, 0.3, 0.2, 0.05, -0.14, -0.3, -0.2];
    let mesh = "stiffness: 1.0e7, damping: 50, element: {type: backlash, half_gap: 40 um}";
    let moved = format!(
        "schema: 1\nreference: {{body: A, speed: 6000 rpm}}\nbodies: {{A: {{motion: {{values: {angles:?}, unit: mrad}}}}, B: {{inertia: 1.0e-3}}}}\n\
         connections: {{s: {{gear: {{A: 50 mm, B: 80 mm}}, {mesh}}}}}\nloads: {{B: {{mean: 0.1}}}}\nreport: {{units: si}}\n"
    );
    let harmonics: Vec<String> = (1..=4)
        .map(|k| {
            let [re, im] = order(&angles, k);
            let amplitude = -2.0 * re.hypot(im) * 1e-3 * 0.05;
            format!(
                "{{order: {k}, amplitude: {amplitude:e}, phase: {} rad}}",
                im.atan2(re)
            )
        })
        .collect();
    let still = format!(
        "schema: 1\nbodies: {{B: {{inertia: 1.0e-3}}}}\nconnections: {{s: {{acts_on: {{B: 80 mm}}, {mesh}, transmission_error: {{harmonics: [{}]}}}}}}\n\
         loads: {{B: {{mean: 0.1}}}}\nreport: {{units: si}}\n",
        harmonics.join(", ")
    );
    let analysis = "{type: frequency_response, from: 6000 rpm, to: 6200 rpm, method: shooting, marks: [6100 rpm], tolerance: 1e-13, stability: false}";
    let (a, b) = (run(&moved, analysis), run(&still, analysis));
    let (a, b) = (main_table(&a), main_table(&b));
    let (i, j) = (marked(a)[0], marked(b)[0]);
    for column in [
        "rms.s",
        "mean.s",
        "min.s",
        "max.s",
        "contact_ratio.s",
        "force_max.s",
    ] {
        let [x, y] = [floats(a, column)[i], floats(b, column)[j]];
        assert!(
            (x - y).abs() < 1e-9 * y.abs().max(1e-6),
            "{column}: {x:e} {y:e}"
        );
    }
    assert!(floats(a, "contact_ratio.s")[i] < 0.99);
}

#[test]
fn a_measured_run_up_drags_the_train_along() {
    let model = "schema: 1\nbodies: {B: {motion: {points: [[0 s, 0 rad/s], [1 s, 50 rad/s]]}}, W: {inertia: 2.0e-2}}\n\
                 connections: {s: {shaft: [B, W], stiffness: 2000}}\nreport: {units: si}\n";
    let instants = [0.01, 0.3, 0.9, 1.0];
    let report = run(
        model,
        &format!("{{type: time_history, duration: 1.2 s, samples: {instants:?}}}"),
    );
    let table = main_table(&report);
    let (w, reach) = ((2000.0_f64 / 2e-2).sqrt(), 50.0 * 2e-2 / 2000.0);
    for (k, t) in instants.iter().enumerate() {
        let wanted = reach * (1.0 - (w * t).cos());
        let found = floats(table, "q.s")[k];
        assert!(
            (found - wanted).abs() < 1e-10 * reach,
            "{t}: {found:e} {wanted:e}"
        );
        let wheel = floats(table, "acceleration.W")[k];
        assert!((wheel - 2000.0 * wanted / 2e-2).abs() < 1e-7, "{t}");
    }
    assert_eq!(floats(table, "acceleration.B")[1], 50.0);
    assert_eq!(floats(table, "acceleration.B")[3], 0.0);
    // The angle says the same; its difference quotients stand between the instants.
    let angles: Vec<String> = (0..=400)
        .map(|k| f64::from(k) / 400.0)
        .map(|t| format!("[{t} s, {} rad]", 25.0 * t * t))
        .collect();
    let model = model.replace("[0 s, 0 rad/s], [1 s, 50 rad/s]", &angles.join(", "));
    let report = run(
        &model,
        "{type: time_history, duration: 0.9 s, samples: [0.5]}",
    );
    let found = floats(main_table(&report), "acceleration.B")[0];
    assert!((found - 50.0).abs() < 1e-6, "{found}");
}

/// One end on the frame, the other one moved over time: one mass between two springs, with the load that it carries at the start.
#[test]
fn a_motion_over_time_strains_a_grounded_train() {
    let (j, k, g, w0): (f64, f64, f64, f64) = (2e-2, 2e3, 1.5e3, 3.0);
    let model = "schema: 1\nbodies: {B: {motion: {points: [[0 s, 3 rad/s], [1 s, 53 rad/s]]}}, W: {inertia: 2.0e-2}}\n\
                 connections: {g: {ground: W, stiffness: 1500}, s: {shaft: [B, W], stiffness: 2000}}\n\
                 loads: {W: {mean: 7}}\nreport: {units: si}\n";
    let instants = [0.004, 0.2, 0.9];
    // J z'' = 7 - g z + k (x - z), x = w0 t + 25 t^2: rest, the particular polynomial and what swings about it.
    let w = ((g + k) / j).sqrt();
    let (rest, share) = (7.0 / (g + k), k / (g + k));
    let (a, b) = (share * w0, share * 25.0);
    let even = -2.0 * b / (w * w);
    let z = |t: f64| rest + even + a * t + b * t * t - even * (w * t).cos() - a / w * (w * t).sin();
    for integrator in ["auto", "dopri5"] {
        let analysis = format!(
            "{{type: time_history, duration: 0.95 s, samples: {instants:?}, integrator: {integrator}}}"
        );
        let report = run(model, &analysis);
        assert_eq!(report.ended_early, None);
        let table = main_table(&report);
        for (n, t) in instants.iter().enumerate() {
            let x = w0 * t + 25.0 * t * t;
            for (column, wanted) in [("q.g", z(*t)), ("q.s", x - z(*t))] {
                let found = floats(table, column)[n].abs();
                assert!(
                    (found - wanted.abs()).abs() < 1e-9 * x,
                    "{integrator} {column} at {t}: {found:e} {wanted:e}"
                );
            }
        }
    }
    let lines = run(model, "{type: modes}");
    assert_eq!(lines.ended_early, None);
}

#[test]
fn the_measured_motion_is_the_course_of_speed() {
    let model = |motion: &str, reference: &str| {
        format!(
            "schema: 1\nreference: {{body: {reference}, speed: 300 rpm}}\nbodies: {{B: {{{motion}}}, W: {{inertia: 2.0e-2}}}}\n\
             connections: {{s: {{gear: {{B: 30 mm, W: 60 mm}}, stiffness: 1.0e6, damping: 100}}}}\n\
             loads: {{W: {{harmonics: [{{order: 2, amplitude: 1}}]}}}}\nreport: {{units: si}}\n"
        )
    };
    let analysis = "{type: time_history, duration: 0.3 s, points: 7, initial: {q: [0], v: [0]}}";
    let moved = run(
        &model("motion: {points: [[0 s, 600 rpm], [1 s, 600 rpm]]}", "W"),
        analysis,
    );
    // At an even speed the moving ground is a very heavy wheel.
    let heavy = run(
        &model("inertia: 1.0e6", "W"),
        &analysis.replace("{type: time_history", "{type: time_history, at: 300 rpm"),
    );
    let [a, b] = [&moved, &heavy].map(|r| floats(main_table(r), "q.s"));
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 1e-11, "{a:e} {b:e}");
    }
}

#[test]
fn both_integrators_follow_a_measured_cycle_along_a_run_up() {
    let model = "schema: 1\nreference: {body: A, speed: 1000 rpm}\n\
                 bodies: {A: {motion: {values: [980, 1000, 1040, 990], unit: rpm}}, B: {inertia: 1.0e-3, drag: 0.5}, C: {inertia: 2.0e-3, drag: {viscous: 1.0e-3}}}\n\
                 connections:\n  m: {gear: {A: 40 mm, B: 60 mm}, stiffness: 1.0e6, damping: 60, element: {type: backlash, half_gap: 30 um}}\n  \
                 s: {shaft: [B, C], stiffness: 800, damping: 0.1}\nreport: {units: si}\n";
    let track = |integrator: &str| {
        let analysis = format!(
            "{{type: run_up, integrator: {integrator}, from: 700 rpm, to: 900 rpm, duration: 1.2 s, orders: [1, 2], signals: [q.m, q.s, acceleration.B, acceleration.A], window: 4}}"
        );
        let report = run(model, &analysis);
        assert_eq!(report.ended_early, None);
        let table = report.table("orders").unwrap();
        ["amplitude.q.s", "amplitude.q.m", "amplitude.acceleration.A"]
            .map(|name| floats(table, name))
    };
    let (exact, stepped) = (track("auto"), track("dopri5"));
    for (a, b) in exact.iter().zip(&stepped) {
        let size = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-5 * size, "{a:e} {b:e}");
        }
    }
}

#[test]
fn mistakes_in_motions_are_named() {
    let analysis = "{type: frequency_response, from: 700 rpm, to: 800 rpm}";
    for (model, wanted) in [
        (wheel("{values: [800, 801], revolutions: 2}"), "its mean is"),
        (wheel("{values: [800 rpm]}"), "wanted at least 2"),
        (
            wheel("{points: [[0 s, 800 rpm], [1 s, 900 rpm]]}"),
            "function of time",
        ),
        (
            wheel("{values: [800 rpm, 801 rpm], column: a, speed: 3}"),
            "unknown key `speed`",
        ),
        (
            wheel("{points: [[0 s, 0], [0 s, 1 rad/s]]}"),
            "appears twice",
        ),
        (
            wheel("{values: [800 rpm, 801 rpm]}") + "loads: {B: {mean: 3}}\n",
            "moves nothing",
        ),
        (
            wheel("{values: [800 rpm, 801 rpm]}").replace(
                "connections: {",
                "connections: {g: {ground: W, stiffness: 5}, ",
            ),
            "locks the train",
        ),
        (
            wheel("{values: [800 rpm, 801 rpm]}")
                .replace(
                    "connections: {",
                    "connections: {g: {ground: W, stiffness: 5}, ",
                )
                .replace("reference: {body: B, speed: 800 rpm}\n", ""),
            "no angle follows from this speed",
        ),
        (
            wheel("{values: [1 deg, 2 deg]}")
                .replace(
                    "connections: {",
                    "connections: {g: {ground: B, stiffness: 5}, ",
                )
                .replace("reference: {body: B, speed: 800 rpm}\n", ""),
            "connections.g: lies between the frame and bodies with prescribed motion",
        ),
    ] {
        let said = refusal(&model, analysis);
        assert!(said.contains(wanted), "{said}\nwanted {wanted}");
    }
}
