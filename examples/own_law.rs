//! A law of one's own in a program: a spring that stiffens, used like any other.
//!
//!     cargo run --release --example own_law
//!
//! What to look at: the r.m.s. deformation peaks above the linear natural frequency, 1 rad/s. `docs/plugins.md` makes the same into a crate.

use gearlash::element::derivatives::from_force;
use gearlash::element::{Dimension, Parameter, ParameterKind, Response};
use gearlash::prelude::*;
use gearlash::quantity::radians_per_second;
use serde::{Deserialize, Serialize};

/// f = q + share (q + q^3/6): the share is a pure number, q counts in displacement scales.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Stiffening {
    share: f64,
}

gearlash::register_element! {
    tag: "stiffening",
    doc: "f = q + share (q + q^3/6), q in displacement scales",
    parameters: [
        { name: "share", doc: "share of the stiffening part", kind: ParameterKind::Number, dimension: Dimension::NONE, default: None },
    ],
    example: "{type: stiffening, share: 0.5}",
}

#[typetag::serde(name = "stiffening")]
impl Element for Stiffening {
    fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
        // `Dual` numbers provide the derivatives.
        let share = self.share;
        from_force(q, v, |q, _v| q + (q + q * q * q * (1.0 / 6.0)) * share)
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        visit(Parameter {
            name: "share",
            index: None,
            dimension: Dimension::NONE,
            value: &mut self.share,
        });
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }
}

/// Prints the peak with and without stiffening.
pub fn main() -> Result<(), Error> {
    for share in [0.0, 0.5] {
        let model = Model::builder()
            .body("wheel", 1.0)
            .ground("spring", "wheel")
            .stiffness(1.0)
            .length(1.0)
            .law(Stiffening { share })
            .modal_damping(0.05)
            .load("wheel", Load::mean(0.0).harmonic(1, 0.1))
            .build()?;
        let range = (radians_per_second(0.6), radians_per_second(1.8));
        let response = FrequencyResponse::between(range.0, range.1)
            .harmonics(5)
            .run(&model)?;
        let peak = response
            .points()
            .max_by(|a, b| a.rms("spring").total_cmp(&b.rms("spring")));
        if let Some(peak) = peak {
            println!(
                "share {share}: {:.4} rad at {:.4} rad/s",
                peak.rms("spring"),
                peak.parameter()
            );
        }
    }
    Ok(())
}
