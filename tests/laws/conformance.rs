//! Every registered law keeps the contract, and the check notices laws that do not.

use gearlash::element::conformance::{check, check_registered};
use gearlash::element::{
    Backlash, Cubic, Dimension, Element, ImpactDampingLaw, Linear, OneSided, Parameter,
    PiecewiseLinear, Preloaded, Response, Side, TanhFriction,
};
use serde::{Deserialize, Serialize};

#[test]
fn registered_laws() {
    // The broken laws of this file are linked into the same registry of typetag, but not documented.
    check_registered().unwrap();
}

#[test]
fn laws_with_unusual_parameters() {
    let backlash = |half_gap, impact_damping, impact_damping_law| Backlash {
        half_gap,
        impact_damping,
        impact_damping_law,
        contact_damping: 0.0,
    };
    let laws: Vec<Box<dyn Element>> = vec![
        Box::new(Linear {}),
        Box::new(backlash(0.0, 0.0, ImpactDampingLaw::Dissipative)),
        Box::new(backlash(0.0, 0.3, ImpactDampingLaw::Dissipative)),
        Box::new(backlash(0.0, 0.3, ImpactDampingLaw::Literal)),
        Box::new(backlash(0.7, 0.0, ImpactDampingLaw::Literal)),
        Box::new(backlash(0.7, 0.2, ImpactDampingLaw::Literal)),
        Box::new(backlash(0.7, 0.2, ImpactDampingLaw::Dissipative)),
        Box::new(OneSided {
            gap: 0.0,
            side: Side::Positive,
            contact_damping: 0.0,
        }),
        Box::new(OneSided {
            gap: 0.8,
            side: Side::Negative,
            contact_damping: 0.0,
        }),
        Box::new(PiecewiseLinear {
            breakpoints: vec![],
            slopes: vec![2.0],
        }),
        Box::new(PiecewiseLinear {
            breakpoints: vec![-2.0, -1.0],
            slopes: vec![3.0, 1.0, 0.5],
        }),
        Box::new(PiecewiseLinear {
            breakpoints: vec![-1.0, 0.5, 1.0],
            slopes: vec![1.0, 0.0, 0.2, 1.0],
        }),
        Box::new(PiecewiseLinear {
            breakpoints: vec![-1.2, -0.4, 0.4, 1.2],
            slopes: vec![1.0, 0.3, 0.0, 0.3, 1.0],
        }),
        Box::new(PiecewiseLinear {
            breakpoints: vec![0.5, 0.9],
            slopes: vec![1.0, 1.0, 0.4],
        }),
        Box::new(Cubic { cubic: -0.01 }),
        Box::new(Cubic { cubic: 0.0 }),
        Box::new(Preloaded {
            half_gap: 0.0,
            preload: 0.3,
        }),
        Box::new(Preloaded {
            half_gap: 0.4,
            preload: 0.0,
        }),
        Box::new(Preloaded {
            half_gap: 0.0,
            preload: 0.0,
        }),
        Box::new(Preloaded {
            half_gap: 0.4,
            preload: 2.0,
        }),
        Box::new(TanhFriction {
            force: 0.01,
            velocity: 0.2,
        }),
        Box::new(TanhFriction {
            force: 3.0,
            velocity: 0.5,
        }),
    ];
    for law in laws {
        check(law.as_ref()).unwrap_or_else(|error| panic!("{law:?}: {error}"));
    }
}

/// A law with one fault at a time.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Faulty {
    fault: String,
    size: f64,
    #[serde(skip)]
    unwritten: f64,
    #[serde(skip)]
    is_copy: bool,
}

impl Faulty {
    fn new(fault: &str) -> Faulty {
        Faulty {
            fault: fault.into(),
            size: 0.5,
            unwritten: 0.25,
            is_copy: false,
        }
    }
}

#[typetag::serde(name = "faulty")]
impl Element for Faulty {
    fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
        let f = match self.fault.as_str() {
            "jump" | "hidden jump" if q > self.size => q + 0.1,
            "free" => 0.0,
            "kink" if q > self.size => 2.0 * q - self.size,
            "nan" if q > 40.0 => f64::NAN,
            "curved" => q + q * q,
            "velocity" => q + 0.1 * v,
            "forgetful" => q * (1.0 + self.unwritten),
            "copy" if self.is_copy => 2.0 * q,
            "dimension" => q + self.size,
            _ => q,
        };
        let df_dq = match self.fault.as_str() {
            "slope" => 1.5,
            "free" => 0.0,
            "kink" if q > self.size => 2.0,
            "curved" => 1.0 + 2.0 * q,
            "forgetful" => 1.0 + self.unwritten,
            "copy" if self.is_copy => 2.0,
            _ => 1.0,
        };
        Response {
            f,
            df_dq,
            df_dv: if self.fault == "velocity" { 0.1 } else { 0.0 },
        }
    }

    fn depends_on_velocity(&self) -> bool {
        false
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        let dimension = if self.fault == "dimension" {
            Dimension::NONE
        } else {
            Dimension::DISPLACEMENT
        };
        visit(Parameter {
            name: "size",
            index: None,
            dimension,
            value: &mut self.size,
        });
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(Faulty {
            is_copy: true,
            ..self.clone()
        })
    }

    fn breakpoints(&self) -> Vec<f64> {
        match self.fault.as_str() {
            "jump" | "superfluous" | "no jump" => vec![self.size],
            "order" => vec![self.size, -self.size],
            _ => Vec::new(),
        }
    }

    fn is_discontinuous(&self) -> bool {
        self.fault == "no jump"
    }

    fn flank(&self, q: f64) -> i8 {
        if self.fault == "flank" && q < 0.0 {
            0
        } else {
            1
        }
    }

    fn is_piecewise_affine(&self) -> bool {
        true
    }
}

#[test]
fn faults_are_noticed() {
    for (fault, says) in [
        (
            "jump",
            "jumps at a breakpoint, but is_discontinuous is false",
        ),
        ("hidden jump", "the force jumps at q = 0.5"),
        ("no jump", "the force jumps at no breakpoint"),
        ("kink", "the slope jumps at q = 0.5"),
        ("superfluous", "nothing changes at the breakpoint 0.5"),
        ("order", "ascending"),
        ("free", "flank says contact"),
        ("curved", "not affine"),
        ("velocity", "depends_on_velocity is false"),
        ("forgetful", "changes the law"),
        ("copy", "the copy says something else"),
        ("nan", "not finite"),
        ("slope", "df/dq"),
        ("dimension", "dimension is wrong"),
        ("flank", "flank changes"),
    ] {
        let law = Faulty::new(fault);
        let error = check(&law).expect_err(fault).to_string();
        assert!(error.contains(says), "{fault}: {error}");
    }
    check(&Faulty::new("none")).unwrap();
}
