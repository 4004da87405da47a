//! Describing functions and the natural frequencies that follow: closed forms of the backlash and the cubic spring, means that
//! carry a force, figures 3 and 4 of Rook & Singh (1995).

use crate::time_domain_support::*;
use gearlash::element::{Backlash, Cubic, Element, ImpactDampingLaw, OneSided, Side};
use gearlash::postprocess::describing_function::{describing_function, mean_for_force};
use std::f64::consts::PI;

fn backlash(half_gap: f64) -> Backlash {
    Backlash {
        half_gap,
        impact_damping: 0.0,
        impact_damping_law: ImpactDampingLaw::Dissipative,
        contact_damping: 0.0,
    }
}

/// (2/pi)(asin x + x sqrt(1 - x^2)), saturated.
fn arc(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    2.0 / PI * (x.asin() + x * (1.0 - x * x).sqrt())
}

#[test]
fn backlash_has_its_classical_describing_function() {
    for amplitude in [0.3, 1.0, 1.0001, 1.5, 7.0, 200.0] {
        // Around the middle: N = 1 - (2/pi)(asin(b/a) + (b/a) sqrt(1 - (b/a)^2)).
        let wanted = 1.0 - arc(1.0 / amplitude);
        let found = describing_function(&backlash(1.0), 0.0, amplitude);
        assert!(
            (found.stiffness.unwrap() - wanted).abs() < 1e-13,
            "{amplitude}"
        );
        assert!(found.mean_force.abs() < 1e-13 * amplitude);
        for mean in [0.5, 1.5, 2.0, -1.2] {
            let flank = |level: f64| (level - mean) / amplitude;
            let wanted = 1.0 - 0.5 * (arc(flank(1.0)) - arc(flank(-1.0)));
            let found = describing_function(&backlash(1.0), mean, amplitude);
            let k = found.stiffness.unwrap();
            assert!(
                (k - wanted).abs() < 1e-13,
                "{amplitude} around {mean}: {k} {wanted}"
            );
            // Share of the time in contact, (21).
            let open = |level: f64| flank(level).clamp(-1.0, 1.0).asin() / PI;
            let contact = 1.0 - (open(1.0) - open(-1.0));
            assert!((found.mean_slope - contact).abs() < 1e-13);
        }
    }
    let still = describing_function(&backlash(1.0), 1.5, 0.0);
    assert_eq!((still.stiffness, still.mean_slope), (None, 1.0));
    assert!((still.mean_force - 0.5).abs() < 1e-14);
}

#[test]
fn a_cubic_spring_has_three_quarters() {
    let (cubic, mean, a) = (0.4, 0.7, 1.3);
    let found = describing_function(&Cubic { cubic }, mean, a);
    let wanted = 1.0 + 3.0 * cubic * mean * mean + 0.75 * cubic * a * a;
    assert!((found.stiffness.unwrap() - wanted).abs() < 1e-14);
    let force = mean + cubic * (mean.powi(3) + 1.5 * mean * a * a);
    assert!((found.mean_force - force).abs() < 1e-14);
}

#[test]
fn impact_damping_has_no_share() {
    let damped = Backlash {
        impact_damping: 0.2,
        ..backlash(1.0)
    };
    let of = |law: &dyn Element| describing_function(law, 0.8, 1.7);
    assert_eq!(of(&damped), of(&backlash(1.0)));
}

#[test]
fn a_mean_that_carries_a_force() {
    let law = backlash(1.0);
    for amplitude in [0.0, 0.2, 0.9, 1.1, 5.0] {
        for force in [0.3, -2.0, 1e-3, 40.0] {
            let mean = mean_for_force(&law, amplitude, force).unwrap();
            let carried = describing_function(&law, mean, amplitude).mean_force;
            assert!(
                (carried - force).abs() < 1e-12 * (force.abs() + amplitude),
                "{amplitude} {force}"
            );
        }
    }
    // In the gap every mean carries nothing: its middle. A stop has no middle: the motion just touches.
    assert!(mean_for_force(&law, 0.4, 0.0).unwrap().abs() < 1e-6);
    let stop = OneSided {
        gap: 0.5,
        side: Side::Positive,
        contact_damping: 0.0,
    };
    assert!((mean_for_force(&stop, 0.2, 0.0).unwrap() - 0.3).abs() < 1e-6);
    assert_eq!(mean_for_force(&stop, 0.2, -0.1), None);
}

#[test]
fn natural_frequencies_of_case_1_follow_the_describing_function() {
    let report = run(
        PAIR,
        "{type: effective_frequencies, amplitude: [0, 4], points: 9, mean_displacement: {mesh_1: 0, mesh_2: 2}}",
    );
    let table = main_table(&report);
    assert_eq!(
        names(table),
        [
            "amplitude",
            "mean.mesh_1",
            "mean.mesh_2",
            "force_mean.mesh_1",
            "force_mean.mesh_2",
            "effective_stiffness.mesh_1",
            "effective_stiffness.mesh_2",
            "effective_frequency.1",
            "effective_frequency.2",
        ]
    );
    let (k1, k2) = (
        floats(table, "effective_stiffness.mesh_1"),
        floats(table, "effective_stiffness.mesh_2"),
    );
    assert!(
        k1[0].is_nan() && k2[0].is_nan(),
        "nothing moves at amplitude 0"
    );
    for (row, a) in floats(table, "amplitude").into_iter().enumerate() {
        let wanted = match a {
            0.0 => (0.0, 1.0),
            _ => (
                1.0 - arc(1.0 / a),
                1.0 - 0.5 * (arc(-1.9 / a) - arc(-2.1 / a)),
            ),
        };
        if a > 0.0 {
            assert!((k1[row] - wanted.0).abs() < 1e-13 && (k2[row] - wanted.1).abs() < 1e-13);
        }
        // kappa diag(k) = [[2 k1, k2], [k1, 2 k2]].
        let (trace, det) = (2.0 * (wanted.0 + wanted.1), 3.0 * wanted.0 * wanted.1);
        let root = (0.25 * trace * trace - det).sqrt();
        for (i, square) in [0.5 * trace - root, 0.5 * trace + root]
            .into_iter()
            .enumerate()
        {
            let found = floats(table, &format!("effective_frequency.{}", i + 1))[row];
            assert!((found * found - square).abs() < 1e-12, "{found}");
        }
    }
}

#[test]
fn units_and_a_force_out_of_reach() {
    let si = format!("{TRAIN}report: {{units: si}}");
    let analysis = "{type: effective_frequencies, amplitude: [0 um, 100 um], points: 5, mean_force: 2 kN, vary: [mesh]}";
    let of = |model: &str, analysis: &str| run(model, analysis);
    let report = of(&si, analysis);
    let table = main_table(&report);
    let unit = |name: &str| table.column(name).unwrap().unit.as_str();
    assert_eq!(
        [
            unit("amplitude"),
            unit("mean.mesh"),
            unit("force_mean.mesh"),
            unit("effective_frequency.1")
        ],
        ["m", "m", "N", "Hz"]
    );
    for force in floats(table, "force_mean.mesh") {
        assert!((force / 2000.0 - 1.0).abs() < 1e-12, "{force}");
    }
    assert!((floats(table, "mean.mesh")[0] / 30e-6 - 1.0).abs() < 1e-12);
    assert!(
        floats(table, "mean.shaft")[0].is_nan(),
        "the shaft does not move"
    );
    let scaled = format!("{TRAIN}report: {{units: nondimensional}}");
    let plain = of(&scaled, &analysis.replace("[0 um, 100 um]", "[0, 5]"));
    let frequencies = floats(main_table(&plain), "effective_frequency.2");
    let w_c = plain.summary["scales"]["omega_c"].as_f64().unwrap();
    for (hertz, w) in floats(table, "effective_frequency.2")
        .into_iter()
        .zip(frequencies)
    {
        assert!((hertz * 2.0 * PI / (w * w_c) - 1.0).abs() < 1e-12);
    }

    let stop = PAIR.replace(
        "{type: backlash, half_gap: 0.1}",
        "{type: one_sided, gap: 0.1}",
    );
    let report = of(
        &stop,
        "{type: effective_frequencies, amplitude: [0, 1], points: 3, mean_force: -0.2}",
    );
    assert_eq!(report.warnings.len(), 1, "{:?}", report.warnings);
    assert!(report.warnings[0].contains("mesh_2") && report.warnings[0].contains("3 of 3"));
    assert!(floats(main_table(&report), "effective_frequency.1")[1].is_nan());
}

#[test]
fn mistakes_are_named() {
    for (model, text, parts) in [
        (
            PAIR,
            "amplitude: [0, 1]",
            vec!["one of mean_displacement or mean_force is required"],
        ),
        (
            PAIR,
            "amplitude: [0, 1], mean_force: 0, mean_displacement: 0",
            vec!["exclude each other"],
        ),
        (
            PAIR,
            "amplitude: [0, 1 um], points: 1, mean_displacement: {mesh_3: 1}, vary: [mesh1]",
            vec!["points", "`mesh_3`; did you mean", "`mesh1`; did you mean"],
        ),
        (
            PAIR,
            "amplitude: [0, 1 um], mean_force: 1",
            vec!["amplitude.1", "nondimensional"],
        ),
        (
            PAIR,
            "amplitude: [-1, 1], mean_displacement: {mesh_1: 0}",
            vec!["amplitude.0", "must be >= 0", "mesh_2 moves"],
        ),
        (
            TRAIN,
            "amplitude: [0 um, 9 um], mean_force: 0",
            vec!["shaft: `0 um` is a length", "wanted an angle"],
        ),
    ] {
        let message = refusal(model, &format!("{{type: effective_frequencies, {text}}}"));
        for part in parts {
            assert!(
                message.contains(part),
                "{text}: {part} is not in\n{message}"
            );
        }
    }
}
