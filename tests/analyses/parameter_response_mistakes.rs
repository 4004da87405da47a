//! What `parameter_response` refuses, and how its branches end where the model does.

use crate::time_domain_support::*;

fn refused(model: &str, keys: &str, wanted: &[&str]) {
    let message = refusal(model, &format!("{{type: parameter_response, {keys}}}"));
    for part in wanted {
        assert!(
            message.contains(part),
            "{keys}: wanted {part:?} in\n{message}"
        );
    }
}

#[test]
fn paths_that_lead_nowhere() {
    let values = "at: 2, from: 0.1, to: 0.2";
    for (path, wanted) in [
        (
            "mesh_2.half_gab",
            "it.parameter: `mesh_2.half_gab` is neither `frequency` nor a path of the model; did you mean `mesh_2.half_gap`?",
        ),
        (
            "half_gap",
            "it.parameter: `half_gap` could be any of 2 numbers of the model (reduced.elements.mesh_1.half_gap, reduced.elements.mesh_2.half_gap)",
        ),
        (
            "reduced.elements.mesh_3.half_gap",
            "it.parameter: reduced.elements.mesh_3.half_gap: `reduced.elements` has no entry `mesh_3`; did you mean `mesh_1`?",
        ),
        (
            "reduced.elements.mesh_2.half_gab",
            "it.parameter: reduced.elements.mesh_2.half_gab: law `backlash` has no parameter `half_gab`",
        ),
        (
            "reduced.elements.mesh_2",
            "it.parameter: reduced.elements.mesh_2 is a map, wanted the path of a number",
        ),
        (
            "reduced.loads.harmonics.0.cos",
            "it.parameter: reduced.loads.harmonics.0.cos is a list, wanted the path of a number",
        ),
        (
            "reduced.elements.mesh_2.type",
            "it.parameter: reduced.elements.mesh_2.type is the text `backlash`, wanted the path of a number",
        ),
        (
            "frequency",
            "it.parameter: the excitation frequency is what the type `frequency_response` varies",
        ),
        (
            "at",
            "it.parameter: the excitation frequency is what the type `frequency_response` varies",
        ),
    ] {
        refused(PAIR, &format!("parameter: {path}, {values}"), &[wanted]);
    }
    refused(
        PAIR,
        &format!("parameter: order, {values}"),
        &["cannot be varied continuously"],
    );
    // Whole numbers at both ends do not make a path.
    refused(
        PAIR,
        "parameter: order, at: 2, from: 1, to: 3",
        &["it.parameter: ", "order cannot be varied continuously: "],
    );
    let scaled = TRAIN.replace("stiffness: 1.0e5", "stiffness: 1.0e5, length: 0.001");
    refused(
        &scaled,
        "parameter: shaft.length, at: 2 kHz, from: 0.001, to: 0.002",
        &["it.parameter: connections.shaft.length changes nothing"],
    );
}

#[test]
fn values_that_do_not_fit() {
    let gap = "parameter: mesh.half_gap, at: 2 kHz";
    for (keys, wanted) in [
        (
            "from: 10 um, to: 10 um",
            "it.to: 0.00001 must be finite and different from `from`",
        ),
        (
            "from: 10 N, to: 20 um",
            "it.from: connections.mesh.element.half_gap: `10 N` is a force [N]; wanted a length [m], for example `50 um`",
        ),
        (
            "from: 10 um, to: 20 deg",
            "it.to: connections.mesh.element.half_gap: `20 deg` is an angle [rad]; wanted a length [m]",
        ),
        (
            "from: 10 um, to: -20 um",
            "it.to: connections.mesh.element.half_gap: ",
        ),
        (
            "from: 10 um, to: 20 um, marks: [30 um]",
            "it.marks.0: 30 um lies outside the range from 10 um to 20 um",
        ),
        (
            "from: 10 um, to: 20 um, marks: [15 um, 12 s]",
            "it.marks.1: connections.mesh.element.half_gap: `12 s` is a time [s]",
        ),
        ("from: 10 um", "the range needs `to`"),
        (
            "from: 10 um, to: 20 um, frm: 3",
            "it.frm: unknown key `frm`; did you mean `from`?",
        ),
        (
            "from: 10 um, to: 20 um, harmonics: 0",
            "it.harmonics: 0 must be at least 1",
        ),
        (
            "from: 10 um, to: 20 um, points: 3",
            "it.points: `points` belongs to the method `integration`",
        ),
    ] {
        refused(TRAIN, &format!("{gap}, {keys}"), &[wanted]);
    }
    refused(
        TRAIN,
        "parameter: mesh.half_gap, at: 2, from: 1 um, to: 2 um",
        &["it.at: the bare number 2 is ambiguous"],
    );
    refused(
        TRAIN,
        "parameter: mesh.half_gap, from: 1 um, to: 2 um",
        &["the key `at` is missing"],
    );
    // Everything at once.
    refused(
        TRAIN,
        "parameter: mesh.half_gap, at: -1 Hz, from: 1 N, to: 2 s, subharmonic: 0",
        &["it.at: ", "it.from: ", "it.to: ", "it.subharmonic: "],
    );
    // What the law is at the beginning decides about the integrator.
    let damped = TRAIN.replace("half_gap: 20 um", "half_gap: 20 um, impact_damping: 0.1");
    refused(
        &damped,
        "parameter: impact_damping, at: 2 kHz, from: 0.1, to: 0, method: shooting, integrator: exact",
        &["it.integrator: mesh: "],
    );
}

/// The end of the range may be the end of what exists: half gaps are not negative.
#[test]
fn the_border_of_the_model_is_reached_exactly() {
    for method in ["galerkin", "shooting", "integration"] {
        let extra = match method {
            "integration" => ", points: 5, transient: 100, periods: 4",
            _ => "",
        };
        for (from, to) in [("20 um", "0"), ("0", "20 um")] {
            let text = format!(
                "{{type: parameter_response, parameter: mesh.half_gap, at: 2 kHz, from: {from}, to: {to}, method: {method}{extra}}}"
            );
            let report = run(TRAIN, &text);
            assert_eq!(report.ended_early, None);
            let values = floats(main_table(&report), "parameter");
            let ends = if from == "0" {
                (0.0, 2e-5)
            } else {
                (2e-5, 0.0)
            };
            assert_eq!((values[0], values[values.len() - 1]), ends, "{method}");
            let contact = floats(main_table(&report), "contact_ratio.mesh");
            let closed = if from == "0" {
                contact[0]
            } else {
                contact[contact.len() - 1]
            };
            assert_eq!(closed, 1.0, "always in contact without a gap");
        }
    }
}

/// A loop that closes somewhere inside the range: the train is another one there.
#[test]
fn a_branch_ends_where_the_model_does() {
    let model = "
schema: 1
bodies: {A: {inertia: 1.0e-3}, B: {inertia: 1.0e-3}, C: {inertia: 1.0e-3}}
connections:
  ab: {gear: {A: 50 mm, B: 50 mm}, stiffness: 2.0e8, element: {type: backlash, half_gap: 20 um}}
  bc: {gear: {B: 50 mm, C: 50 mm}, stiffness: 2.0e8}
  ac: {acts_on: {A: 50 mm, C: -60 mm}, stiffness: 1.0e8}
damping: {modal_ratio: 0.05}
loads: {A: {mean: 100, harmonics: [{order: 1, amplitude: 20}]}}
";
    let nearly = "connections.ac: nearly closes a loop with ab, bc";
    // Integration steps from value to value and meets the loop where it closes.
    let closed = "the relative coordinates change from (ab, bc, ac) to (ab, bc)";
    let values = ", points: 101, transient: 2, periods: 2";
    for (method, extra, reason) in [
        ("galerkin", "", nearly),
        ("shooting", "", nearly),
        ("integration", values, closed),
    ] {
        let text = format!(
            "{{type: parameter_response, parameter: ac.C, at: 3 kHz, from: -60 mm, to: -40 mm, method: {method}{extra}}}"
        );
        let report = run(model, &text);
        let end = &report.summary["branches"][0]["end"];
        assert_eq!(end["reason"], "no_model", "{method}: {end}");
        let message = report.ended_early.clone().unwrap();
        for part in [reason, "at ac.C = -5.0", " m after "] {
            assert!(message.contains(part), "{method}: {message}");
        }
        let values = floats(main_table(&report), "parameter");
        let last = values[values.len() - 1];
        // Loops that miss by 1e-3 to 1e-10 of their row are refused; integration stops a whole step before.
        let expected = if method == "integration" { 2e-4 } else { 1e-5 };
        assert!(
            last < -0.05 && last > -0.0502 - expected,
            "{method}: {last}"
        );
    }
}

#[test]
fn an_interruption_keeps_what_is_finished() {
    struct Impatient(std::sync::atomic::AtomicUsize);
    impl gearlash::analysis::Control for Impatient {
        fn is_interrupted(&self) -> bool {
            let order = std::sync::atomic::Ordering::Relaxed;
            self.0
                .fetch_update(order, order, |n| Some(n.saturating_sub(1)))
                == Ok(0)
        }
    }
    let text = "  it: {type: parameter_response, parameter: cos.0, at: 2.2, from: 0.1, to: 0.3}";
    let report = run_with(PAIR, text, 1, &Impatient(4.into())).remove(0);
    assert_eq!(
        report.summary["branches"][0]["end"]["reason"],
        "interrupted"
    );
    assert!(
        report
            .ended_early
            .unwrap()
            .starts_with("interrupted at cos.0 = ")
    );
    assert!(!report.tables[0].columns[0].values.is_empty());
}
