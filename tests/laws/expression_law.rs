//! Laws typed as formulas: how they read, their exact derivatives, where they switch, what they admit about themselves.

use gearlash::element::conformance::check;
use gearlash::element::derivatives::{Dual, from_force};
use gearlash::element::number::Number;
use gearlash::element::{
    Backlash, Cubic, Element, Expression, ImpactDampingLaw, OneSided, PiecewiseLinear, Preloaded,
    Side, TanhFriction, Units, nondimensional,
};
use std::f64::consts::{PI, TAU};

fn law(force: &str, parameters: &[(&str, f64)]) -> Expression {
    let law = Expression::new(force, parameters).unwrap_or_else(|e| panic!("{force}: {e}"));
    law.validate().unwrap_or_else(|e| panic!("{force}: {e}"));
    law
}

fn value(force: &str) -> f64 {
    law(force, &[]).eval(3.0, 0.5, 1.0).f
}

#[test]
fn formulas_read_as_everyone_expects() {
    for (force, expected) in [
        ("1e5", 1e5),
        (".5", 0.5),
        ("2.", 2.0),
        ("1e-3*q", 3e-3),
        ("2.5E+2", 250.0),
        ("-q^2", -9.0),
        ("(-q)^2", 9.0),
        ("2^3^2", 512.0),
        ("(2^3)^2", 64.0),
        ("2^-1", 0.5),
        ("-2^-2", -0.25),
        ("2*-q", -6.0),
        ("--q", 3.0),
        ("+q - +1", 2.0),
        ("1 - 2 - 3", -4.0),
        ("24/4/3", 2.0),
        ("24/4*3", 18.0),
        ("2 + 3*4^2", 50.0),
        ("-3*2 + 1", -5.0),
        ("q*(v + 1)", 4.5),
        ("2·3×4", 24.0),
        ("pi", PI),
        ("sin(phase)^2 + cos(phase)^2", 1.0),
        ("tan(1) - sin(1)/cos(1)", 0.0),
        ("log(exp(q))", 3.0),
        ("sqrt(q*q)", 3.0),
        ("tanh(v) - (exp(v) - exp(-v))/(exp(v) + exp(-v))", 0.0),
        ("sinh(v)/cosh(v) - tanh(v)", 0.0),
        ("4*atan(1) - pi", 0.0),
        ("abs(-q) + sign(-q)", 2.0),
        ("min(q, 1, 2) + max(q, 1)", 4.0),
        ("max(1, 2, 5, q)", 5.0),
        ("if(q > 2, 10, 20)", 10.0),
        ("if(q > 2 and v > 2, 10, 20)", 20.0),
        ("if(q > 2 or v > 2, 10, 20)", 10.0),
        ("if(not q > 2, 10, 20)", 20.0),
        ("if(not (q > 2) or 1 < 2, 10, 20)", 10.0),
        ("if(q == 3, 1, 0) + if(q != 3, 10, 0)", 1.0),
        ("if(q <= 3 and q >= 3, 1, 0)", 1.0),
        ("(q > 1)*(q - 1)", 2.0),
        ("q^if(v > 0, 2, 3)", 9.0),
        ("if(v > 0, if(q > 5, 1, 2), 3)", 2.0),
        // The branch that does not count may be anything.
        ("if(q > -1, q, log(-1))", 3.0),
        ("  q\n +\t1 ", 4.0),
        ("\u{a0}q", 3.0),
    ] {
        let found = value(force);
        assert!(
            (found - expected).abs() <= 1e-15 * expected.abs() + 4e-16,
            "{force}: {found}, wanted {expected}"
        );
    }
}

/// Central differences of the formula itself.
#[test]
fn derivatives_are_exact() {
    let parameters = [("k", 2.3), ("b", 0.4), ("n", 1.5)];
    for force in [
        "k*q^3 - v^2*q",
        "k*max(abs(q) - b, 0)^n*sign(q)",
        "q^q + 2^v + abs(q)^v",
        "tanh(v/b)*exp(-q^2)",
        "sin(k*q)*cos(v)/(2 + tan(q/4))",
        "sqrt(1 + q^2)*log(2 + v^2)",
        "atan(q*v) + sinh(q)/cosh(v)",
        "min(q, v)*max(q^2, v^2)",
        "if(q > v, q*v, q/v)",
        "q/(1 + abs(q))^n - 1/(v - 7)",
        "-(q - v)^-2",
        "q^2*phase + sin(3*phase)*v",
    ] {
        let law = law_unchecked(force, &parameters);
        for (q, v) in [(0.7, 0.3), (1.9, 0.55), (0.35, 1.2)] {
            let (h, at) = (1e-5, |q, v| law.eval(q, v, 0.8));
            let r = at(q, v);
            let by_q = (at(q + h, v).f - at(q - h, v).f) / (2.0 * h);
            let by_v = (at(q, v + h).f - at(q, v - h).f) / (2.0 * h);
            let near = |a: f64, b: f64| (a - b).abs() < 1e-8 * (1.0 + a.abs() + r.f.abs());
            assert!(
                near(r.df_dq, by_q),
                "{force} at {q}, {v}: {} {by_q}",
                r.df_dq
            );
            assert!(
                near(r.df_dv, by_v),
                "{force} at {q}, {v}: {} {by_v}",
                r.df_dv
            );
        }
    }
}

/// Not finite at rest, which `validate` refuses.
fn law_unchecked(force: &str, parameters: &[(&str, f64)]) -> Expression {
    Expression::new(force, parameters).unwrap_or_else(|e| panic!("{force}: {e}"))
}

#[test]
fn duals_for_laws_of_ones_own() {
    let (k, c) = (2.0, 0.3);
    let force = |q: Dual, v: Dual| {
        let p = if q > 0.5 {
            q - 0.5
        } else {
            Dual::constant(0.0)
        };
        k * p.powf(1.5) * (1.0 + c * v) - v.tanh() / 2.0 + (q.clamp(-1.0, 1.0)).powi(3)
    };
    for (q, v) in [(0.9, 0.2), (-0.4, -1.0), (2.0, 0.7)] {
        let r = from_force(q, v, force);
        let plain = |q: f64, v: f64| {
            let p: f64 = if q > 0.5 { q - 0.5 } else { 0.0 };
            k * p.powf(1.5) * (1.0 + c * v) - v.tanh() / 2.0 + q.clamp(-1.0, 1.0).powi(3)
        };
        let h = 1e-6;
        assert!((r.f - plain(q, v)).abs() < 1e-15);
        let by_q = (plain(q + h, v) - plain(q - h, v)) / (2.0 * h);
        let by_v = (plain(q, v + h) - plain(q, v - h)) / (2.0 * h);
        assert!((r.df_dq - by_q).abs() < 1e-9 && (r.df_dv - by_v).abs() < 1e-9);
    }
    // Finite where contact begins: num-dual's powf(1.5), for one, is not a number at 0.
    let r = from_force(0.5, 0.0, |q, _| (q - 0.5).max(0.0).powf(1.5));
    assert_eq!((r.f, r.df_dq, r.df_dv), (0.0, 0.0, 0.0));
    // What does not vary stays constant, also where a slope is infinite.
    let r = from_force(0.0, 1.0, |q, v| Dual::constant(0.0).sqrt() + q * v);
    assert_eq!((r.f, r.df_dq, r.df_dv), (0.0, 1.0, 0.0));
}

#[test]
fn switches_on_the_displacement_are_placed() {
    let p = [("b", 0.3), ("c", 0.8), ("k", 2.0)];
    for (force, expected) in [
        ("sign(q)*max(abs(q) - b, 0)", vec![-0.3, 0.3]),
        ("q - min(max(q, -b), b)", vec![-0.3, 0.3]),
        ("if(q > b, q - b, if(q < -b, q + b, 0))", vec![-0.3, 0.3]),
        ("(q > b)*(q - b) + (q < -b)*(q + b)", vec![-0.3, 0.3]),
        ("if(q > b or q < -b, k*q, 0)", vec![-0.3, 0.3]),
        ("if(abs(q) > b and not q > c, q, 0)", vec![-0.3, 0.3, 0.8]),
        ("max(abs(2*q - 1) - b, 0)", vec![0.35, 0.65]),
        (
            "abs(abs(abs(q) - c) - b)",
            vec![-1.1, -0.8, -0.5, 0.0, 0.5, 0.8, 1.1],
        ),
        ("min(q, 2*q, 3*q + b)", vec![-0.3, 0.0]),
        ("max((q - b)/k, 0)^1.5", vec![0.3]),
        ("max(k*v, 0)*0 + max(q - b, 0)", vec![0.3]),
        ("v*max(q - b, 0)", vec![0.3]),
        ("sign(b)*q + max(b, c) + abs(k)", vec![]),
        ("k*q^3", vec![]),
        // Switches of which nothing is left.
        ("abs(q) - abs(q) + if(q > b, q, q)", vec![]),
        ("max(q, q)", vec![]),
        ("if(q > 0, abs(q + c), q + c)", vec![]),
    ] {
        let law = law_unchecked(force, &p);
        let found = law.breakpoints();
        let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-15;
        assert!(
            found.len() == expected.len() && found.iter().zip(&expected).all(close),
            "{force}: {found:?}, wanted {expected:?}"
        );
    }
}

#[test]
fn laws_say_what_they_are() {
    // formula, piecewise affine, jumps, hidden jumps, depends on v, cautions
    for (force, affine, jumps, hidden, velocity, cautions) in [
        ("2*q", true, false, false, false, 0),
        ("sign(q)*max(abs(q) - 0.3, 0)", true, false, false, false, 0),
        ("if(q > 0.3, q - 0.3, 0)", true, false, false, false, 0),
        ("if(q > 0.3, q, 0)", true, true, false, false, 0),
        ("q + sign(q)", true, true, false, false, 0),
        ("q + 0.1*v", false, false, false, true, 0),
        ("q^2", false, false, false, false, 0),
        ("q^1 + q/2 - (1 + 2)*q", true, false, false, false, 0),
        ("q*sin(phase)", false, false, false, false, 0),
        ("q*phase", false, true, true, false, 1),
        ("q + abs(v)", false, false, false, true, 1),
        ("q + sign(v)", false, true, true, true, 1),
        ("max(q^2 - 1, 0)", false, false, false, false, 1),
        ("if(q^2 > 1, q, 0)", false, true, true, false, 1),
        ("max(sin(phase), 0)*q", false, false, false, false, 1),
        ("q + log(q + 1)", false, false, false, false, 1),
    ] {
        let law = law(force, &[]);
        let found = (
            law.is_piecewise_affine(),
            law.is_discontinuous(),
            law.has_hidden_jumps(),
            law.depends_on_velocity(),
        );
        assert_eq!(found, (affine, jumps, hidden, velocity), "{force}");
        assert_eq!(
            law.cautions().len(),
            cautions,
            "{force}: {:?}",
            law.cautions()
        );
    }
    let unused = law("k*q", &[("k", 1.0), ("b", 2.0)]);
    assert_eq!(
        unused.cautions(),
        ["parameters.b: the force does not use it"]
    );
}

#[test]
fn open_stretches_are_open() {
    let flanks = |force: &str| {
        let law = law(force, &[]);
        [-2.0, -0.5, 0.0, 0.5, 2.0].map(|q| law.flank(q))
    };
    assert_eq!(flanks("sign(q)*max(abs(q) - 0.3, 0)"), [-1, -1, 0, 1, 1]);
    assert_eq!(flanks("max(q - 0.3, 0)"), [0, 0, 0, 1, 1]);
    assert_eq!(flanks("min(q + 0.3, 0)"), [-1, -1, 0, 0, 0]);
    assert_eq!(flanks("max(q - 0.3, 0)*(1 + v)"), [0, 0, 0, 1, 1]);
    assert_eq!(flanks("2*q"), [1; 5]);
    assert_eq!(flanks("abs(q)"), [1; 5]);
    assert_eq!(flanks("max(q - 0.3, 0) + 0.1*v"), [1; 5]);
}

/// A builtin law and the same as a formula: force, slopes, breakpoints, flanks, before and after scaling.
#[test]
fn formulas_equal_the_laws_they_spell_out() {
    let b = 0.37;
    let beta = 0.2;
    let dissipative = ImpactDampingLaw::Dissipative;
    let pairs: Vec<(Box<dyn Element>, Expression)> = vec![
        (
            Box::new(Backlash {
                half_gap: b,
                impact_damping: 0.0,
                impact_damping_law: dissipative,
                contact_damping: 0.0,
            }),
            law("sign(q)*max(abs(q) - b, 0)", &[("b", b)]),
        ),
        (
            Box::new(Backlash {
                half_gap: b,
                impact_damping: beta,
                impact_damping_law: dissipative,
                contact_damping: 0.0,
            }),
            law(
                "if(q > b, (q - b)*(1 + beta*v), if(q < -b, (q + b)*(1 - beta*v), 0))",
                &[("b", b), ("beta", beta)],
            ),
        ),
        (
            Box::new(Preloaded {
                half_gap: b,
                preload: 0.15,
            }),
            law(
                "if(q > b, q - b + P, if(q < -b, q + b - P, 0))",
                &[("b", b), ("P", 0.15)],
            ),
        ),
        (
            Box::new(OneSided {
                gap: b,
                side: Side::Negative,
                contact_damping: 0.0,
            }),
            law("min(q + b, 0)", &[("b", b)]),
        ),
        (
            Box::new(PiecewiseLinear {
                breakpoints: vec![-b, b, 1.0],
                slopes: vec![0.8, 0.0, 0.3, 1.0],
            }),
            law(
                "0.8*min(q + b, 0) + 0.3*max(q - b, 0) + 0.7*max(q - 1, 0)",
                &[("b", b)],
            ),
        ),
        (
            Box::new(Cubic { cubic: 0.4 }),
            law("q + c*q^3", &[("c", 0.4)]),
        ),
        (
            Box::new(TanhFriction {
                force: 0.3,
                velocity: 0.05,
            }),
            law("F*tanh(v/w)", &[("F", 0.3), ("w", 0.05)]),
        ),
    ];
    let units = Units {
        displacement: 3e-5,
        frequency: 4e4,
        force: 3e-5,
    };
    for (builtin, typed) in pairs {
        let scaled = [&builtin as &dyn Element2, &typed].map(|law| law.scaled(&units));
        for (a, b, l, w) in [
            (builtin.as_ref(), &typed as &dyn Element, 1.0, 1.0),
            (
                scaled[0].as_ref(),
                scaled[1].as_ref(),
                units.displacement,
                units.frequency,
            ),
        ] {
            assert_eq!(a.is_discontinuous(), b.is_discontinuous(), "{typed:?}");
            assert_eq!(a.is_piecewise_affine(), b.is_piecewise_affine());
            assert_eq!(a.depends_on_velocity(), b.depends_on_velocity());
            let (p, r) = (a.breakpoints(), b.breakpoints());
            assert_eq!(p.len(), r.len(), "{typed:?}");
            assert!(
                p.iter()
                    .zip(&r)
                    .all(|(p, r)| (p - r).abs() <= 4e-16 * p.abs()),
                "{p:?} {r:?}"
            );
            for q in [-2.0, -0.9, -0.2, 0.0, 0.1, 0.6, 1.7].map(|q| q / l) {
                for v in [-0.3, 0.0, 0.02].map(|v| v / (l * w)) {
                    let (x, y) = (a.eval(q, v, 0.0), b.eval(q, v, 0.0));
                    let near =
                        |x: f64, y: f64, size: f64| (x - y).abs() <= 1e-14 * (x.abs() + size);
                    assert!(near(x.f, y.f, 0.1 / l), "{typed:?} {q} {v}: {x:?} {y:?}");
                    assert!(
                        near(x.df_dq, y.df_dq, 1.0),
                        "{typed:?} {q} {v}: {x:?} {y:?}"
                    );
                    assert!(near(x.df_dv, y.df_dv, w), "{typed:?} {q} {v}: {x:?} {y:?}");
                    assert_eq!(a.flank(q), b.flank(q), "{typed:?} {q}");
                }
            }
        }
    }
}

/// Scaling of laws behind different pointers.
trait Element2 {
    fn scaled(&self, units: &Units) -> Box<dyn Element>;
}

impl Element2 for Box<dyn Element> {
    fn scaled(&self, units: &Units) -> Box<dyn Element> {
        nondimensional(self.as_ref(), units)
    }
}

impl Element2 for Expression {
    fn scaled(&self, units: &Units) -> Box<dyn Element> {
        nondimensional(self, units)
    }
}

#[test]
fn formulas_keep_the_contract() {
    for force in [
        "sign(q)*max(abs(q) - 0.6, 0)",
        "if(q > 0.6, q - 0.4, 0)",
        "max(q - 0.6, 0)^1.5*(1 + 0.1*v)",
        "q + 0.1*tanh(v/0.5)*(1 + 0.2*cos(phase))",
        "q + 0.1*q^3 - 0.01*q^5*exp(-q^2)",
        "0.2*sign(q)*log(1 + abs(q)) + q",
    ] {
        check(&law(force, &[])).unwrap_or_else(|error| panic!("{force}: {error}"));
    }
}

#[test]
fn parameters_may_change_and_take_their_breakpoints_with_them() {
    let mut law = law("k*max(q - b, 0)", &[("k", 2.0), ("b", 0.5)]);
    law.visit_parameters(&mut |p| {
        if p.index == Some(1) {
            *p.value = 0.25;
        }
    });
    assert_eq!(law.breakpoints(), [0.25]);
    assert_eq!(law.eval(1.0, 0.0, 0.0).f, 1.5);
    assert_eq!((law.flank(0.2), law.flank(0.3)), (0, 1));
}

#[test]
fn the_phase_counts_from_0_to_a_turn() {
    let law = law("if(phase < pi, 1, -1)*sin(phase) + 0*q", &[]);
    for phase in [0.3, 4.0, 5.9] {
        let at = |turns: f64| law.eval(0.0, 0.0, phase + TAU * turns).f;
        assert!((at(0.0) - at(3.0)).abs() < 1e-14);
        assert!((at(0.0) - phase.sin().abs()).abs() < 1e-14);
    }
}
