//! The contract of laws whose memory has a rate, on the worked example of docs/plugins.md and on laws that break it.

use gearlash::element::conformance::check;
use gearlash::element::evolving::{Evolution, Evolving, Kinks, first_loading};
use gearlash::element::{Dimension, Element, Parameter, Response};
use gearlash::solve::galerkin;
use serde::{Deserialize, Serialize};

#[path = "../../examples/custom_element/src/bouc_wen.rs"]
mod bouc_wen;
use bouc_wen::BoucWen;

fn law(exponent: f64, shape: f64, hardening: f64) -> BoucWen {
    BoucWen {
        yield_deformation: 0.7,
        hardening,
        exponent,
        shape,
    }
}

#[test]
fn the_example_keeps_the_contract() {
    for (n, shape, hardening) in [
        (1.0, 0.5, 0.1),
        (2.0, 0.6, 0.0),
        (3.0, 1.0, 0.3),
        (1.5, 0.7, 0.2),
    ] {
        let law = law(n, shape, hardening);
        check(&law).unwrap_or_else(|e| panic!("{law:?}: {e}"));
        galerkin::conformance::check(&law).unwrap_or_else(|e| panic!("{law:?}: {e}"));
    }
}

/// A steady loop with n = 1, s = 1/2: it unloads along the elastic line and loads along z = Y (1 - exp(-x/Y)).
#[test]
fn the_loop_has_its_closed_form() {
    let law = law(1.0, 0.5, 0.0);
    let (y, amplitude) = (0.7, 1.3);
    let mut top = 0.5;
    for _ in 0..200 {
        top = y * (1.0 - f64::exp(-(2.0 * amplitude - top) / y));
    }
    // Along q = A cos t from the top: z at the bottom is the opposite.
    let steps = 20_000;
    let h = std::f64::consts::PI / f64::from(steps);
    let rate = |t: f64, z: f64| {
        let (sin, cos) = t.sin_cos();
        law.evolve([amplitude * cos, -amplitude * sin, 0.0, z]).rate
    };
    let mut z = top;
    for k in 0..steps {
        let t = h * f64::from(k);
        let half = z + 0.5 * h * rate(t, z);
        z += h * rate(t + 0.5 * h, half);
    }
    assert!((z + top).abs() < 1e-6, "{z} {top}");
    // First loading.
    for q in [-2.0_f64, -0.3, 0.4, 3.0] {
        let exact = q.signum() * y * (1.0 - f64::exp(-q.abs() / y));
        assert!((law.loaded(q) - exact).abs() < 2e-12, "{q}");
    }
}

/// Hysteresis with one thing wrong.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Broken {
    fault: String,
    limit: f64,
}

impl Broken {
    fn is(&self, fault: &str) -> bool {
        self.fault == fault
    }
}

impl Evolving for Broken {
    fn evolve(&self, [q, v, _, z]: [f64; 4]) -> Evolution {
        let y = self.limit;
        let share = z.abs() / y;
        let both = if v * z > 0.0 { 1.0 } else { 0.0 };
        let sign = if self.is("energy") { -1.0 } else { 1.0 };
        let step = if self.is("jump") && v > 0.0 { 0.1 } else { 0.0 };
        let by_z = -v * both * z.signum() / y;
        Evolution {
            force: sign * z + 0.1 * q,
            force_by: [0.1, 0.0, sign],
            rate: v * (1.0 - share * both) + step,
            rate_by: [
                0.0,
                1.0 - share * both,
                if self.is("partial") { 0.5 * by_z } else { by_z },
            ],
        }
    }

    fn kinks(&self) -> Kinks {
        let zero = vec![0.0];
        Kinks {
            rate: zero.clone(),
            memory: if self.is("kink") { Vec::new() } else { zero },
            ..Kinks::default()
        }
    }
}

#[typetag::serde(name = "test_broken_hysteresis")]
impl Element for Broken {
    fn eval(&self, q: f64, v: f64, phase: f64) -> Response {
        first_loading(self, q, v, phase)
    }

    fn memory_count(&self) -> usize {
        if self.is("count") { 2 } else { 1 }
    }

    fn evolving(&self) -> Option<&dyn Evolving> {
        Some(self)
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        let wrong = self.is("scale");
        visit(Parameter {
            name: "limit",
            index: None,
            dimension: if wrong {
                Dimension::NONE
            } else {
                Dimension::DISPLACEMENT
            },
            value: &mut self.limit,
        });
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }
}

#[test]
fn every_fault_is_noticed() {
    let broken = |fault: &str| Broken {
        fault: fault.into(),
        limit: 0.8,
    };
    check(&broken("none")).unwrap();
    for (fault, said) in [
        ("energy", "gives the energy"),
        ("jump", "jumps at v = 0"),
        ("partial", "its partials say"),
        ("partial", "dg/dz"),
        ("kink", "a kink that is not listed"),
        ("count", "has one memory"),
        ("scale", "dimension is wrong"),
    ] {
        let error = check(&broken(fault)).unwrap_err().to_string();
        assert!(error.contains(said), "{fault}: {error}");
    }
}

/// A partial that is wrong by half shows along the march of the Galerkin method, too.
#[test]
fn a_wrong_partial_shows_around_the_period() {
    let broken = |fault: &str| Broken {
        fault: fault.into(),
        limit: 0.7,
    };
    galerkin::conformance::check(&broken("")).unwrap();
    let error = galerkin::conformance::check(&broken("partial")).unwrap_err();
    assert!(error.to_string().contains("along a march"), "{error}");
}
