//! What a whole analysis costs, counted in evaluations of laws.

use crate::time_domain_support::{floats, main_table, run};
use gearlash::element::{Backlash, Element, ImpactDampingLaw, Parameter, Response};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering};

static EVALUATIONS: AtomicU64 = AtomicU64::new(0);

/// Backlash, half gap 1 after scaling, that counts how often it is evaluated.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Counting {}

const BACKLASH: Backlash = Backlash {
    half_gap: 1.0,
    impact_damping: 0.0,
    impact_damping_law: ImpactDampingLaw::Dissipative,
    contact_damping: 0.0,
};

gearlash::register_element! {
    tag: "counting",
    doc: "backlash that counts its evaluations",
    parameters: [],
    example: "{type: counting}",
}

#[typetag::serde(name = "counting")]
impl Element for Counting {
    fn eval(&self, q: f64, v: f64, phase: f64) -> Response {
        EVALUATIONS.fetch_add(1, Ordering::Relaxed);
        BACKLASH.eval(q, v, phase)
    }

    fn visit_parameters(&mut self, _visit: &mut dyn FnMut(Parameter<'_>)) {}

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }

    fn breakpoints(&self) -> Vec<f64> {
        BACKLASH.breakpoints()
    }

    fn flank(&self, q: f64) -> i8 {
        BACKLASH.flank(q)
    }

    fn is_piecewise_affine(&self) -> bool {
        true
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }
}

/// A chain of discs on shafts with play, driven at its first disc.
fn chain(shafts: usize) -> String {
    let mut text = String::from("schema: 1\nbodies:\n");
    for k in 0..=shafts {
        writeln!(text, "  disc_{k}: {{inertia: 1e-3}}").unwrap();
    }
    text += "connections:\n";
    for k in 0..shafts {
        let next = k + 1;
        writeln!(
            text,
            "  shaft_{k}: {{shaft: [disc_{k}, disc_{next}], stiffness: 1e5, length: 1e-3, element: {{type: counting}}}}"
        )
        .unwrap();
    }
    writeln!(
        text,
        "damping: {{stiffness_proportional: 1e-5}}\nscaling: {{frequency: 1e4 rad/s}}\nreport: {{units: nondimensional}}\nloads:\n  \
         disc_0: {{mean: 130, harmonics: [{{order: 1, amplitude: 30}}]}}\n  disc_{shafts}: {{mean: -130}}"
    )
    .unwrap();
    text
}

/// Evaluations per connection and point of a frequency response with all its tables.
fn evaluations(shafts: usize, stability: bool) -> f64 {
    let before = EVALUATIONS.load(Ordering::Relaxed);
    let analysis = format!(
        "{{type: frequency_response, from: 2.4, to: 2.0, harmonics: 3, samples: 64, step: 0.05, stability: {stability}}}"
    );
    let report = run(&chain(shafts), &analysis);
    assert_eq!(report.ended_early, None);
    let rattle = report.table("rattle").unwrap();
    let peaks = floats(rattle, &format!("peak_acceleration.disc_{shafts}"));
    assert!(peaks.iter().all(|a| *a > 0.0));
    let points = floats(main_table(&report), "omega").len();
    assert!(points >= 4, "{points}");
    let count = EVALUATIONS.load(Ordering::Relaxed) - before;
    count as f64 / (points * shafts) as f64
}

#[test]
fn a_mesh_costs_as_much_in_a_long_train_as_in_a_short_one() {
    for stability in [false, true] {
        let (short, long) = (evaluations(16, stability), evaluations(96, stability));
        assert!(
            long < 1.4 * short,
            "stability {stability}: {short:.0} evaluations per connection and point for 16, {long:.0} for 96"
        );
    }
}
