//! A fault of the program, here of a law: it costs the analysis that meets it, and nothing else.

use crate::program::Place;
use gearlash::element::{Element, InvalidParameter, Parameter, Response};
use gearlash::interrupt::Interrupt;
use gearlash::serde::{Deserialize, Serialize};
use gearlash::study::{RunSettings, Study};
use gearlash::typetag;

/// A linear spring with a bug.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(crate = "gearlash::serde", deny_unknown_fields)]
struct Faulty {}

/// Where the bug is.
const FAR: f64 = 50.0;

gearlash::register_element! {
    tag: "faulty",
    doc: "f = q, with a bug far out",
    parameters: [],
    example: "{type: faulty}",
}

#[typetag::serde(name = "faulty")]
impl Element for Faulty {
    fn eval(&self, q: f64, _v: f64, phase: f64) -> Response {
        // Statics, which looks far out, reads laws at phase 0.
        assert!(q.abs() < FAR || phase == 0.0, "a bug far out");
        Response {
            f: q,
            df_dq: 1.0,
            df_dv: 0.0,
        }
    }

    fn visit_parameters(&mut self, _visit: &mut dyn FnMut(Parameter<'_>)) {}

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(*self)
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        Ok(())
    }
}

#[test]
fn a_panic_costs_one_analysis_and_one_run() {
    let place = Place::with(
        "schema: 1
reduced:
  stiffness: [[1]]
  damping: {modal_ratio: 0.05}
  elements: {spring: {type: faulty}}
  loads: {mean: [0.5], harmonics: [{order: 1, cos: [0.3]}]}
analyses:
  good: {type: frequency_response, from: 2.0, to: 1.8, harmonics: 3}
  bad: {type: time_history, at: 1.0, periods: 3, initial: {q: [100]}}
  study:
    type: parameter_study
    grid: {loads.mean.0: [0.5, 200]}
    analysis: {type: poincare_map, at: 1.5, transient: 0, periods: 1}
    collect: {last: {column: q.spring, reduce: last}}
",
    );
    let study = Study::load(&place.path("m.yaml"), &[], &[]).unwrap();
    let settings = RunSettings {
        out: place.path("out"),
        figures: vec![],
        jobs: 2,
    };
    let outcome = study.run(&settings, &Interrupt::default()).unwrap();
    let ends: Vec<&Option<String>> = outcome.reports.iter().map(|r| &r.ended_early).collect();
    assert_eq!(*ends[0], None);
    let told = ends[1].as_deref().unwrap();
    assert!(told.starts_with("internal error: a bug far out"), "{told}");
    assert!(ends[2].as_deref().unwrap().contains("1 of 2 runs failed"));
    for name in [
        "good.csv",
        "bad.json",
        "study.csv",
        "report.html",
        "manifest.json",
    ] {
        assert!(place.path("out").join(name).exists(), "{name}");
    }
    let rows = place.table("out/study.csv");
    assert_eq!(rows[1][3], "complete");
    assert_eq!(rows[2][3], "refused");
    assert!(rows[2][4].contains("internal error"), "{:?}", rows[2]);
}
