//! The law keeps the contract, and its model runs under every method through the crate's own binary.

mod support;

use custom_element::Hertz;
use gearlash::element::Element;
use gearlash::element::conformance::{check, check_registered};
use std::path::PathBuf;
use std::process::{Command, Output};
use support::table;

#[test]
fn the_law_keeps_the_contract() {
    for (half_gap, coefficient) in [(0.5, 1.2), (0.0, 1.0), (1.1, 0.4)] {
        let law = Hertz {
            half_gap,
            coefficient,
        };
        check(&law).unwrap_or_else(|error| panic!("{law:?}: {error}"));
    }
    // The table of every law in this binary, this one included.
    check_registered().unwrap();
}

#[test]
fn force_and_slope_have_their_closed_form() {
    let law = Hertz {
        half_gap: 0.5,
        coefficient: 2.0,
    };
    for (q, f, slope) in [
        (0.3, 0.0, 0.0),
        (0.5, 0.0, 0.0),
        (1.5, 2.0, 3.0),
        (-4.5, -16.0, 6.0),
    ] {
        let r = law.eval(q, 0.7, 0.0);
        assert!(
            (r.f - f).abs() < 1e-15 && (r.df_dq - slope).abs() < 1e-15,
            "{q}: {r:?}"
        );
        assert_eq!(r.df_dv, 0.0);
    }
}

fn program(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_custom_element"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .unwrap()
}

fn text(output: &[u8]) -> String {
    String::from_utf8_lossy(output).into_owned()
}

#[test]
fn the_model_runs_and_the_methods_agree() {
    let out = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("hertz_pair");
    let _ = std::fs::remove_dir_all(&out);
    let ended = program(&[
        "run",
        "hertz_pair.yaml",
        "--quiet",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(ended.status.code(), Some(0), "{}", text(&ended.stderr));

    // Galerkin and shooting at the mark.
    let rows = table(&out.join("resonance.csv"));
    let at_mark = |method: &str, column: &str| -> f64 {
        let row = rows
            .iter()
            .find(|r| r["mark"] == "1" && r["method"] == method)
            .unwrap();
        row[column].parse().unwrap()
    };
    for column in [
        "mean.mesh",
        "rms.mesh",
        "max.mesh",
        "rms_velocity.mesh",
        "force_mean.mesh",
        "multiplier_modulus",
    ] {
        let (galerkin, shooting) = (at_mark("galerkin", column), at_mark("shooting", column));
        // Contact is never lost there: 20 harmonics of a smooth motion are good to rounding of the branches' tolerances.
        assert!(
            (galerkin / shooting - 1.0).abs() < 1e-6,
            "{column}: {galerkin} {shooting}"
        );
    }
    let lifts = |method: &str| {
        let mut rows = rows.iter().filter(|r| r["method"] == method);
        rows.any(|r| r["contact_ratio.mesh"].parse::<f64>().unwrap() < 0.9)
    };
    assert!(
        lifts("galerkin") && lifts("shooting"),
        "the teeth lift off at resonance"
    );

    // The motion after a hundred periods is the same orbit.
    let motion = table(&out.join("motion.csv"));
    let q: Vec<f64> = motion
        .iter()
        .map(|r| r["q.mesh"].parse().unwrap())
        .collect();
    let q = &q[..q.len() - 1]; // the last row is the first of the next period
    let mean = q.iter().sum::<f64>() / q.len() as f64;
    let rms = (q.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / q.len() as f64).sqrt();
    for (column, found) in [("mean.mesh", mean), ("rms.mesh", rms)] {
        let expected = at_mark("shooting", column);
        assert!(
            (found / expected - 1.0).abs() < 1e-6,
            "{column}: {found} {expected}"
        );
    }
}

#[test]
fn the_command_line_knows_the_law() {
    let ended = program(&["elements"]);
    let list = text(&ended.stdout);
    assert!(list.contains("hertz\n    F = sign(q) c"), "{list}");
    assert!(
        list.contains("coefficient [force/displacement^(3/2)] > 0"),
        "{list}"
    );
    let ended = program(&["schema"]);
    let schema = text(&ended.stdout);
    assert!(
        schema.contains("\"hertz\"") && schema.contains("contact coefficient c"),
        "the schema has the law and its parameters"
    );
    let ended = program(&["check", "hertz_pair.yaml"]);
    assert_eq!(ended.status.code(), Some(0), "{}", text(&ended.stderr));
    let page = text(&ended.stdout);
    assert!(
        page.contains("exact flow, no: exact integration needs a piecewise-affine law"),
        "{page}"
    );
    let ended = program(&[
        "check",
        "hertz_pair.yaml",
        "--set",
        "connections.mesh.element.coefficient=1e10 N/m^2",
    ]);
    assert_eq!(ended.status.code(), Some(2));
    let said = text(&ended.stderr);
    assert!(
        said.contains("wanted a contact coefficient [N/m^1.5]"),
        "{said}"
    );
}
