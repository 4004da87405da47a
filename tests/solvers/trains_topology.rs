//! Trains of every topology, written in YAML, against closed forms; answers in SI units that no choice of scales changes.

use crate::texts::{Results, load, run};
use gearlash::error::Error;
use gearlash::study::Study;
use std::f64::consts::TAU;

/// Elastic natural frequencies [rad/s], ascending, of bodies and connections.
fn frequencies(text: &str) -> Vec<f64> {
    let study = load(text);
    let list = study.assembly.natural_frequencies.iter();
    list.map(|w| w * study.assembly.scales.frequency).collect()
}

#[track_caller]
fn close(found: &[f64], wanted: &[f64]) {
    assert_eq!(found.len(), wanted.len(), "{found:?}");
    for (f, w) in found.iter().zip(wanted) {
        assert!((f / w - 1.0).abs() < 1e-12, "{found:?}, wanted {wanted:?}");
    }
}

#[test]
fn pairs_of_every_geometry() {
    // omega^2 = K sum(arm^2/inertia), whatever the signs of the arms.
    let mesh = f64::sqrt(2e8 * (0.05 * 0.05 / 1e-3 + 0.08 * 0.08 / 4e-3));
    let bodies = "bodies: {A: {inertia: 1e-3}, B: {inertia: 4e-3}}\n";
    for (connection, wanted) in [
        ("gear: {A: 50 mm, B: 80 mm}, stiffness: 200 N/um", mesh),
        (
            "internal_gear: {A: 50 mm, B: 80 mm}, stiffness: 200 N/um",
            mesh,
        ),
        ("acts_on: {A: 5 cm, B: -0.08}, stiffness: 2e8", mesh),
        (
            "shaft: [A, B], stiffness: 30 kN m/rad",
            (3e4f64 * 1250.0).sqrt(),
        ),
        (
            "acts_on: {A: 1, B: 2}, stiffness: 3e4 N m/rad",
            (3e4f64 * 2000.0).sqrt(),
        ),
    ] {
        close(
            &frequencies(&format!("{bodies}connections: {{c: {{{connection}}}}}\n")),
            &[wanted],
        );
    }
    let grounded =
        "bodies: {A: {inertia: 0.05}}\nconnections: {c: {ground: A, stiffness: 2000 N m/rad}}\n";
    close(&frequencies(grounded), &[200.0]);
    let sliding =
        "bodies: {x: {inertia: 5 kg}}\nconnections: {c: {ground: x, stiffness: 2 kN/m}}\n";
    close(&frequencies(sliding), &[20.0]);
    let masses = "bodies: {x: {inertia: 5 kg}, y: {inertia: 20 kg}}\nconnections: {c: {shaft: [x, y], stiffness: 1 kN/m}}\n";
    close(&frequencies(masses), &[250f64.sqrt()]);
    // A rack: the mass slides, the pinion turns; radians beside metres.
    let rack = "bodies: {p: {inertia: 4e-3}, x: {inertia: 250 kg}}\nconnections: {c: {acts_on: {p: 40 mm, x: -1}, stiffness: 90 N/um}}\n";
    close(
        &frequencies(rack),
        &[(9e7f64 * (0.04 * 0.04 / 4e-3 + 1.0 / 250.0)).sqrt()],
    );
}

/// One wheel, n equal branches: n - 1 modes in which the wheel stands still, one in which all swing against it.
#[test]
fn branches_have_modes_of_their_own() {
    let n = 5;
    let mut text = String::from("bodies:\n  wheel: {inertia: 0.02}\n");
    for i in 0..n {
        text += &format!("  B{i}: {{inertia: 1e-3}}\n");
    }
    text += "connections:\n";
    for i in 0..n {
        text += &format!("  m{i}: {{gear: {{wheel: 0.1, B{i}: 0.05}}, stiffness: 1e8}}\n");
    }
    let alone = 1e8 * 0.05 * 0.05 / 1e-3;
    let all = alone + 1e8 * f64::from(n) * 0.1 * 0.1 / 0.02;
    let mut wanted = vec![f64::sqrt(alone); 4];
    wanted.push(f64::sqrt(all));
    close(&frequencies(&text), &wanted);
}

/// Sun, ring and n planets about fixed axes: n - 1 modes of the planets alone, the rest of a three-body chain.
#[test]
fn a_planetary_set_has_the_modes_of_its_symmetry() {
    let (ks, kr, rs, rp, rr) = (6e8, 7e8, 0.03, 0.025, 0.08);
    let mut text = String::from("bodies:\n  sun: {inertia: 4e-4}\n  ring: {inertia: 0.02}\n");
    for i in 0..3 {
        text += &format!("  p{i}: {{inertia: 3e-4}}\n");
    }
    text += "connections:\n";
    for i in 0..3 {
        text += &format!("  s{i}: {{gear: {{sun: {rs}, p{i}: {rp}}}, stiffness: {ks}}}\n");
        text +=
            &format!("  r{i}: {{internal_gear: {{p{i}: {rp}, ring: {rr}}}, stiffness: {kr}}}\n");
    }
    let study = load(&text);
    assert_eq!(study.assembly.system.dof(), 4);
    assert_eq!(study.assembly.connections.len(), 6);
    let planet = rp * rp * (ks + kr) / 3e-4;
    // The set in step is a chain sun - planets - ring of three: trace and sum of principal minors of its two elastic modes.
    let (a, b) = (3.0 * ks * rs * rs / 4e-4, 3.0 * kr * rr * rr / 0.02);
    let trace = a + planet + b;
    let couples = 3.0 * ks * ks * rs * rs * rp * rp / (4e-4 * 3e-4);
    let couples = couples + 3.0 * kr * kr * rp * rp * rr * rr / (3e-4 * 0.02);
    let minors = a * planet + planet * b + a * b - couples;
    let root = f64::sqrt(trace * trace / 4.0 - minors);
    let mut wanted = vec![planet, planet, trace / 2.0 - root, trace / 2.0 + root];
    wanted.sort_by(f64::total_cmp);
    let found: Vec<f64> = frequencies(&text).iter().map(|w| w * w).collect();
    // The smaller root of the quadratic loses digits to cancellation.
    for (f, w) in found.iter().zip(&wanted) {
        assert!((f / w - 1.0).abs() < 1e-11, "{found:?} {wanted:?}");
    }
}

fn refusal(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.yaml");
    std::fs::write(&path, text).unwrap();
    match Study::load(&path, &[], &[]) {
        Err(Error::Input(list)) => list.iter().map(|d| format!("{d}\n")).collect(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_cannot_be_reduced_is_refused_with_the_reason() {
    let nearly = "bodies: {A: {inertia: 1}, B: {inertia: 1}, C: {inertia: 1}}\nconnections:\n  \
                  ab: {internal_gear: {A: 0.03, B: 0.06}, stiffness: 1e8}\n  \
                  bc: {internal_gear: {B: 0.0333, C: 0.05}, stiffness: 1e8}\n  \
                  ac: {internal_gear: {A: 0.01667, C: 0.05}, stiffness: 1e8}\n";
    let text = refusal(nearly);
    assert!(
        text.contains("m.yaml:5:7: connections.ac: nearly closes a loop with ab, bc"),
        "{text}"
    );
    let unheld = "bodies: {A: {inertia: 1}, B: {inertia: 1}, C: {inertia: 1}}\nconnections: {c: {shaft: [A, B], stiffness: 1e4}}\nloads: {C: {mean: 3}}\n";
    let text = refusal(unheld);
    assert!(text.contains("bodies.C: nothing holds it"), "{text}");
    assert!(
        text.contains("loads.C: acts on `C`, which no connection holds"),
        "{text}"
    );
    let mixed = "bodies: {A: {inertia: 1}, x: {inertia: 1 kg}}\nconnections: {c: {shaft: [A, x], stiffness: 1e4}}\n";
    assert!(refusal(mixed).contains("joins a turning body and a translating mass"));
    let wheel = "bodies: {A: {inertia: 1}, x: {inertia: 1 kg}}\nconnections: {c: {gear: {A: 0.1, x: 0.1}, stiffness: 1e4}}\n";
    assert!(refusal(wheel).contains("use acts_on with lever arm 1"));
}

/// A motor against a brake that is too weak: the train accelerates, which is said, and the deformation is that of the
/// balanced part.
#[test]
fn unbalanced_mean_loads_accelerate_the_train() {
    let text = "\
bodies: {motor: {inertia: 2e-3}, brake: {inertia: 6e-3}}
connections: {shaft: {shaft: [motor, brake], stiffness: 1 kN m/rad, damping: 1 N m s/rad}}
loads: {motor: {mean: 12 N m}, brake: {mean: -4 N m}}
analyses: {th: {type: time_history, at: 10 Hz, periods: 3}}
";
    let study = load(text);
    // 8 N m on 8e-3 kg m^2.
    let warning = &study.assembly.warnings[0];
    assert!(
        warning.contains("accelerates (motor 1.0000e3, brake 1.0000e3, in rad/s^2"),
        "{warning}"
    );
    let results = run(text).remove(0);
    let last = results.rows() - 1;
    for body in ["motor", "brake"] {
        let found = results.value(&format!("acceleration.{body}"), last);
        assert!((found - 1000.0).abs() < 1e-6, "{body}: {found}");
    }
    // The brake's 6 N m of inertia and its 4 N m pass through the shaft: 10 N m.
    assert!((results.value("f.shaft", last) - 10.0).abs() < 1e-9);
}

/// Two trains side by side in one file do not know each other.
#[test]
fn disconnected_parts_answer_as_if_alone() {
    let train = |n: usize, amplitude: f64| {
        let part = |i: usize, inertia: f64, stiffness: f64, amplitude: f64| {
            let bodies = format!("  A{i}: {{inertia: {inertia}}}\n  B{i}: {{inertia: 2e-3}}\n");
            let mesh = format!(
                "  m{i}: {{gear: {{A{i}: 0.05, B{i}: 0.04}}, stiffness: {stiffness}, damping: 300, element: {{type: backlash, half_gap: 20 um}}, length: 20 um}}\n"
            );
            let loads = format!(
                "  A{i}: {{mean: 20, harmonics: [{{order: 1, amplitude: {amplitude}}}]}}\n  B{i}: {{mean: 16}}\n"
            );
            [bodies, mesh, loads]
        };
        let parts = [part(0, 1e-3, 1e8, amplitude), part(1, 3e-3, 1.7e8, 9.0)];
        let text = |k: usize| parts[..n].iter().map(|p| p[k].as_str()).collect::<String>();
        format!(
            "bodies:\n{}connections:\n{}loads:\n{}scaling: {{frequency: 20000 rad/s}}\nanalyses:\n  fr: {{type: frequency_response, method: shooting, from: 2400 Hz, to: 2300 Hz, marks: [2350 Hz]}}\n",
            text(0),
            text(1),
            text(2)
        )
    };
    let (alone, both) = (
        run(&train(1, 15.0)).remove(0),
        run(&train(2, 15.0)).remove(0),
    );
    let marked = |r: &Results| (0..r.rows()).find(|i| r.value("mark", *i) == 1.0).unwrap();
    for column in ["rms.m0", "mean.m0", "force_max.m0", "contact_ratio.m0"] {
        let [a, b] = [&alone, &both].map(|r| r.value(column, marked(r)));
        assert!((a - b).abs() < 1e-9 * a.abs(), "{column}: {a} {b}");
    }
}

/// Scales make numbers handy; they are no part of the answer.
#[test]
fn scales_never_change_an_answer() {
    let text = |scaling: &str, method: &str| {
        format!(
            "\
bodies: {{A: {{inertia: 1e-3}}, B: {{inertia: 3e-3}}, C: {{inertia: 2.5e-3}}, D: {{inertia: 4e-3}}}}
connections:
  c0: {{gear: {{A: 0.03, B: 0.06}}, stiffness: 2e8, element: {{type: backlash, half_gap: 40 um}}}}
  c1: {{gear: {{A: 0.03, C: 0.06}}, stiffness: 1.6e8, element: {{type: backlash, half_gap: 50 um}}}}
  c2: {{gear: {{B: 0.025, D: 0.05}}, stiffness: 1.8e8, transmission_error: {{harmonics: [{{order: 2, amplitude: 1 um}}]}}}}
  c3: {{gear: {{C: 0.025, D: 0.05}}, stiffness: 1.4e8, damping: 200, element: {{type: backlash, half_gap: 30 um}}}}
  s: {{ground: D, stiffness: 2e5 N m/rad}}
damping: {{modal_ratio: 0.04}}
loads: {{A: {{mean: 100, harmonics: [{{order: 1, amplitude: 30}}]}}, D: {{mean: 20}}}}
{scaling}
analyses:
  fr: {{type: frequency_response, method: {method}, from: 2000 Hz, to: 1980 Hz, marks: [1990 Hz], harmonics: 20}}
"
        )
    };
    for method in ["galerkin", "shooting"] {
        let scalings = [
            "scaling: {frequency: first_mode, length: 50 um}",
            "scaling: {frequency: first_connection}",
            "scaling: {frequency: 3000 rad/s, length: 1 mm}",
            "scaling: {frequency: 1 kHz, length: 1 um}",
        ];
        let all: Vec<Results> = scalings.map(|s| run(&text(s, method)).remove(0)).into();
        let kinds = [
            "mean.",
            "rms.",
            "min.",
            "max.",
            "rms_velocity.",
            "force_",
            "contact_ratio.",
            "effective_frequency.",
        ];
        let names = all[0].names(&kinds);
        assert!(names.len() > 40, "{names:?}");
        let marked = |r: &Results| (0..r.rows()).find(|i| r.value("mark", *i) == 1.0).unwrap();
        for (results, scaling) in all.iter().zip(scalings) {
            let frequency = results.value("frequency_hz", marked(results)) * TAU;
            assert!((frequency / (TAU * 1990.0) - 1.0).abs() < 1e-12);
            for name in &names {
                let [wanted, found] = [&all[0], results].map(|r| r.value(name, marked(r)));
                // Columns that vanish by symmetry or carry rounding alone have no relative error.
                let scale = wanted.abs().max(size(&all[0], name, marked(&all[0])));
                assert!(
                    (found - wanted).abs() <= 1e-9 * scale,
                    "{scaling} {method} {name}: {found} {wanted}"
                );
            }
        }
    }
}

/// The largest value of a kind among the connections.
fn size(results: &Results, name: &str, row: usize) -> f64 {
    let kind = name.split('.').next().unwrap();
    let own = results.names(&[&format!("{kind}.")]);
    own.iter()
        .map(|n| results.value(n, row).abs())
        .fold(0.0, f64::max)
}
