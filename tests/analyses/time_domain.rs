//! Time histories from the model file to the tables.

use crate::time_domain_support::*;
use std::f64::consts::TAU;

/// Solution of LINEAR from q0, v0.
fn exact(t: f64, q0: f64, v0: f64) -> [f64; 2] {
    let (w, d, om) = (1.0_f64, 0.05, 0.8);
    let wd = (w - d * d).sqrt();
    let det = (w - om * om).powi(2) + (0.1 * om).powi(2);
    let (a, b) = (0.3 * (w - om * om) / det, 0.3 * 0.1 * om / det);
    let forced = |t: f64| {
        let (s, c) = (om * t).sin_cos();
        [0.5 + a * c + b * s, om * (b * c - a * s)]
    };
    let [f0, g0] = forced(0.0);
    let (x, y) = (q0 - f0, (v0 - g0 + d * (q0 - f0)) / wd);
    let (s, c) = (wd * t).sin_cos();
    let decay = (-d * t).exp();
    let [f, g] = forced(t);
    [
        f + decay * (x * c + y * s),
        g + decay * (-d * (x * c + y * s) + wd * (y * c - x * s)),
    ]
}

#[test]
fn a_linear_oscillator_follows_its_closed_form() {
    let report = run(
        LINEAR,
        "{type: time_history, at: 0.8, periods: 3, transient: 2, samples_per_period: 50, \
          initial: {q: [0.7], v: [-0.4]}}",
    );
    assert_eq!(report.ended_early, None);
    let table = main_table(&report);
    assert_eq!(names(table), ["T", "q.spring", "v.spring", "f.spring"]);
    let t = floats(table, "T");
    assert_eq!(t.len(), 151);
    let period = TAU / 0.8;
    // The transient is not written, the time goes on counting.
    assert!((t[0] - 2.0 * period).abs() < 1e-13);
    assert!((t[150] - 5.0 * period).abs() < 1e-13);
    let (q, v, f) = (
        floats(table, "q.spring"),
        floats(table, "v.spring"),
        floats(table, "f.spring"),
    );
    for k in 0..t.len() {
        let [x, y] = exact(t[k], 0.7, -0.4);
        assert!(
            (q[k] - x).abs() < 2e-9 && (v[k] - y).abs() < 2e-8,
            "row {k}: {} {x}, {} {y}",
            q[k],
            v[k]
        );
        assert_eq!(f[k], q[k]);
    }
    assert_eq!(report.table("switches").unwrap().rows(), 0);
    assert!(report.summary.contains_key("integrator"));
}

#[test]
fn the_last_row_is_the_state_of_the_integrator() {
    // The same motion sampled coarsely and finely: rows at the ends of periods are equal to the last bit.
    let at = |samples: usize| {
        let text = format!(
            "{{type: time_history, at: 1.1, periods: 4, transient: 1, samples_per_period: {samples}}}"
        );
        run(PAIR, &text)
    };
    let (coarse, fine) = (at(1), at(128));
    for name in ["T", "q.mesh_1", "v.mesh_2", "f.mesh_1"] {
        let (a, b) = (
            floats(main_table(&coarse), name),
            floats(main_table(&fine), name),
        );
        assert_eq!((a.len(), b.len()), (5, 513));
        for (k, x) in a.iter().enumerate() {
            assert_eq!(*x, b[128 * k], "{name} after {k} periods");
        }
    }
    // And the Poincaré map sees the same states.
    let map = run(
        PAIR,
        "{type: poincare_map, at: 1.1, transient: 1, periods: 4, lyapunov: false}",
    );
    let table = main_table(&map);
    assert_eq!(
        names(table),
        [
            "run", "period", "q.mesh_1", "q.mesh_2", "v.mesh_1", "v.mesh_2"
        ]
    );
    assert_eq!(floats(table, "period"), [2.0, 3.0, 4.0, 5.0]);
    assert_eq!(
        floats(table, "v.mesh_2"),
        floats(main_table(&coarse), "v.mesh_2")[1..]
    );
}

#[test]
fn the_default_start_is_the_static_equilibrium() {
    let report = run(LINEAR, "{type: time_history, at: 0.8, periods: 1}");
    let table = main_table(&report);
    assert_eq!(table.rows(), 201);
    assert!((floats(table, "q.spring")[0] - 0.5).abs() < 1e-12);
    assert_eq!(floats(table, "v.spring")[0], 0.0);
}

#[test]
fn si_and_nondimensional_columns_agree() {
    let of = |units: &str, at: &str, initial: &str| {
        let model = format!("{TRAIN}\nreport: {{units: {units}}}");
        let text = format!(
            "{{type: time_history, at: {at}, periods: 2, samples_per_period: 20, initial: {initial}}}"
        );
        run(&model, &text)
    };
    let start = "{q: [30 um, 0.5 mrad], v: [0.02 m/s, 3 rad/s]}";
    let si = of("si", "800 Hz", start);
    let bare = of("si", "800 Hz", "{q: [3e-5, 5e-4], v: [0.02, 3]}");
    let plain = of("nondimensional", "800 Hz", start);
    assert_eq!(si.tables, bare.tables);
    let w = si.summary["scales"]["omega_c"].as_f64().unwrap();
    let l = |c: &str| si.summary["scales"]["displacement"][c].as_f64().unwrap();
    let (a, b) = (main_table(&si), main_table(&plain));
    let expected = [
        ("t", "s", "T", "", 1.0 / w),
        ("q.mesh", "m", "q.mesh", "", l("mesh")),
        ("q.shaft", "rad", "q.shaft", "", l("shaft")),
        ("v.mesh", "m/s", "v.mesh", "", l("mesh") * w),
        ("v.shaft", "rad/s", "v.shaft", "", l("shaft") * w),
        ("f.mesh", "N", "f.mesh", "", 2.0e8 * l("mesh")),
        ("f.shaft", "N m", "f.shaft", "", 1.0e5 * l("shaft")),
        (
            "acceleration.A",
            "rad/s^2",
            "acceleration.A",
            "rad/T^2",
            w * w,
        ),
        (
            "acceleration.B",
            "rad/s^2",
            "acceleration.B",
            "rad/T^2",
            w * w,
        ),
    ];
    assert_eq!(names(a), expected.map(|e| e.0));
    assert_eq!(names(b), expected.map(|e| e.2));
    for (x, unit_x, y, unit_y, factor) in expected {
        assert_eq!(
            (
                a.column(x).unwrap().unit.as_str(),
                b.column(y).unwrap().unit.as_str()
            ),
            (unit_x, unit_y)
        );
        for (x, y) in floats(a, x).iter().zip(floats(b, y)) {
            assert!(
                (x - y * factor).abs() <= 1e-13 * (y * factor).abs(),
                "{x} {}",
                y * factor
            );
        }
    }
    assert!((floats(a, "q.mesh")[0] - 30e-6).abs() < 1e-18);
    assert!((floats(a, "v.shaft")[0] - 3.0).abs() < 1e-12);
    // t of the last row: two periods of 800 Hz.
    assert!((floats(a, "t")[40] - 2.0 / 800.0).abs() < 1e-17);
}

#[test]
fn the_absolute_accelerations_are_those_of_the_equation_of_motion() {
    let model =
        format!("{TRAIN}\nreport: {{units: si}}").replace("modal_ratio: 0.04", "modal_ratio: 0");
    let report = run(
        &model,
        "{type: time_history, at: 800 Hz, periods: 1, samples_per_period: 16}",
    );
    let table = main_table(&report);
    let (t, mesh, shaft) = (
        floats(table, "t"),
        floats(table, "f.mesh"),
        floats(table, "f.shaft"),
    );
    let (a, b) = (
        floats(table, "acceleration.A"),
        floats(table, "acceleration.B"),
    );
    for k in 0..t.len() {
        let torque = 100.0 + 60.0 * (TAU * 800.0 * t[k]).cos();
        let expected = [
            (torque - 0.05 * mesh[k]) / 2.0e-3,
            (-0.04 * mesh[k] - shaft[k]) / 1.0e-3,
        ];
        for (found, wanted) in [a[k], b[k]].iter().zip(expected) {
            assert!((found - wanted).abs() < 1e-9 * 1e5, "{found} {wanted}");
        }
    }
}

#[test]
fn switches_are_listed_in_order_where_the_deformation_passes_the_breakpoint() {
    let report = run(
        PAIR,
        "{type: time_history, at: 0.9, transient: 30, periods: 5, samples_per_period: 400}",
    );
    let (table, switches) = (main_table(&report), report.table("switches").unwrap());
    let expected = [
        "time",
        "connection",
        "from",
        "to",
        "direction",
        "rate",
        "level",
    ];
    assert_eq!(names(switches), expected);
    assert!(switches.rows() > 4);
    let (t, time) = (floats(table, "T"), floats(switches, "time"));
    assert!(time.windows(2).all(|w| w[0] <= w[1]));
    let of = |name| floats(switches, name);
    let (from, to, direction) = (of("from"), of("to"), of("direction"));
    let (rate, level) = (of("rate"), of("level"));
    let step = t[1] - t[0];
    for (k, connection) in texts(switches, "connection").iter().enumerate() {
        assert_eq!(direction[k], rate[k].signum());
        assert_eq!(to[k] - from[k], direction[k]);
        let row = ((time[k] - t[0]) / step).floor() as usize;
        let q = floats(table, &format!("q.{connection}"))[row];
        // Taylor from the row before, accelerations of order 1.
        let error = level[k] - q - rate[k] * (time[k] - t[row]);
        assert!(error.abs() < 2.0 * step * step, "{error}");
    }
}
