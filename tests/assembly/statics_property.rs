//! Equilibria of random trains against the definition: forces in balance, each on the graph of its law.

use crate::assembly_support::*;
use gearlash::element::*;
use gearlash::model::*;
use gearlash::numeric::periodic::Periodic;
use gearlash::solve::equilibrium::{NoEquilibrium, equilibrium};

/// Random numbers of all sizes: the same trains every time.
struct Random(Seeded);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0.next()
    }

    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    /// 10^x, x evenly between two exponents.
    fn decades(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(low + (high - low) * self.unit())
    }

    fn sign(&mut self) -> f64 {
        if self.unit() < 0.5 { -1.0 } else { 1.0 }
    }
}

const GAP: f64 = 1e-3;

fn one_sided(side: Side) -> Box<dyn Element> {
    Box::new(OneSided {
        gap: GAP,
        side,
        contact_damping: 0.0,
    })
}

/// A law with the deformation at which it carries a force f (over K), in closed form; `None` where it never does.
type Inverse = fn(f64) -> Option<f64>;

fn law(kind: usize) -> (Box<dyn Element>, Inverse) {
    match kind {
        0 => (Box::new(Linear {}), |f| Some(f)),
        1 => (backlash(GAP), |f| {
            Some(if f == 0.0 { 0.0 } else { f + GAP.copysign(f) })
        }),
        2 => (one_sided(Side::Positive), |f| match f {
            f if f > 0.0 => Some(f + GAP),
            0.0 => Some(0.0),
            _ => None,
        }),
        3 => (one_sided(Side::Negative), |f| match f {
            f if f < 0.0 => Some(f - GAP),
            0.0 => Some(0.0),
            _ => None,
        }),
        4 => (Box::new(Cubic { cubic: 1e6 }), |f| {
            // Newton from above on x + 1e6 x^3 = f.
            let mut x = f.abs();
            for _ in 0..200 {
                x -= (x + 1e6 * x.powi(3) - f.abs()) / (1.0 + 3e6 * x * x);
            }
            Some(x.copysign(f))
        }),
        5 => {
            let law = PiecewiseLinear {
                breakpoints: vec![-2.0 * GAP, 3.0 * GAP],
                slopes: vec![5.0, 0.02, 1.0],
            };
            (Box::new(law), |f| {
                let (low, high) = (-0.04 * GAP, 0.06 * GAP);
                Some(match f {
                    f if f > high => 3.0 * GAP + (f - high),
                    f if f < low => -2.0 * GAP + (f - low) / 5.0,
                    f => f / 0.02,
                })
            })
        }
        _ => (
            Box::new(TanhFriction {
                force: 1.0,
                velocity: 1.0,
            }),
            |f| (f == 0.0).then_some(0.0),
        ),
    }
}

/// A train under mean torques.
fn loaded(inertia: &[f64], connections: Vec<Connection>, torque: &[f64]) -> Train {
    let mut train = train(inertia, connections);
    for (k, mean) in torque.iter().enumerate().filter(|(_, t)| **t != 0.0) {
        let series = Periodic::Fourier {
            mean: *mean,
            harmonics: vec![],
        };
        train.loads.insert(
            format!("B{k}"),
            Load {
                series,
                others: Vec::new(),
            },
        );
    }
    train.scaling.frequency = FrequencyScale::Value(100.0);
    train
}

/// Torques that forces put on the bodies.
fn torques(bodies: usize, connections: &[Connection], force: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; bodies];
    for (c, f) in connections.iter().zip(force) {
        c.arms.iter().for_each(|(body, arm)| out[*body] += arm * f);
    }
    out
}

#[test]
fn trees_rest_where_their_laws_carry_the_load() {
    let mut random = Random(Seeded(1));
    let mut denied = 0;
    for trial in 0..400 {
        let n = 1 + random.below(7);
        let inertia: Vec<f64> = (0..=n).map(|_| random.decades(-9.0, 3.0)).collect();
        let (mut connections, mut inverses, mut force) = (vec![], vec![], vec![]);
        for k in 1..=n {
            let (element, inverse) = law(random.below(7));
            let arms = [
                (random.below(k), random.decades(-2.0, 0.0)),
                (k, random.sign() * random.decades(-2.0, 0.0)),
            ];
            let stiffness = random.decades(2.0, 13.0);
            // Forces of any size, as long as they are forces beside the largest.
            force.push(match random.below(5) {
                0 => 0.0,
                _ => random.sign() * random.decades(-3.0, 3.0),
            });
            connections.push(connection(&arms, stiffness, element));
            inverses.push(inverse);
        }
        let torque = torques(n + 1, &connections, &force);
        let assembly = assembled(&loaded(&inertia, connections.clone(), &torque));
        let wanted: Vec<Option<f64>> = (0..n)
            .map(|j| inverses[j](force[j] / connections[j].stiffness))
            .collect();
        match equilibrium(&assembly.system) {
            Ok(rest) => {
                for j in 0..n {
                    let found = rest.deformation[j] * assembly.scales.displacement[j];
                    let wanted = wanted[j]
                        .unwrap_or_else(|| panic!("{trial} {j}: nothing carries {}", force[j]));
                    // Torques on a body are sums: small forces beside large ones have fewer digits.
                    let rounding =
                        1e-9 * wanted.abs() + 1e-9 * force[j].abs() / connections[j].stiffness;
                    let shared = 1e-10 * 1e3 / connections[j].stiffness;
                    assert!(
                        (found - wanted).abs() <= rounding + shared.max(0.0),
                        "{trial} {j}: {found} not {wanted}"
                    );
                }
            }
            Err(NoEquilibrium::NotCarried { connections }) => {
                let lost: Vec<usize> = (0..n).filter(|j| wanted[*j].is_none()).collect();
                assert_eq!(connections, lost, "{trial}");
                denied += 1;
            }
            Err(none) => panic!("{trial}: {none:?}"),
        }
    }
    assert!((50..350).contains(&denied), "{denied}");
}

/// Shafts between random bodies, with more of them than a tree has; the first body may be held.
fn meshed(random: &mut Random, bodies: usize, kinds: usize) -> Vec<Connection> {
    let mut list = Vec::new();
    for k in 0..bodies + 1 + random.below(4) {
        let stiffness = random.decades(2.0, 9.0);
        let element = law(random.below(kinds)).0;
        let first = if k + 1 < bodies {
            k + 1
        } else {
            random.below(bodies)
        };
        let second = (first + 1 + random.below(bodies - 1)) % bodies;
        let second = if k + 1 < bodies {
            random.below(k + 1)
        } else {
            second
        };
        list.push(connection(
            &[(first, 1.0), (second, -1.0)],
            stiffness,
            element,
        ));
    }
    if random.unit() < 0.5 {
        list.push(spring(&[(0, 1.0)], random.decades(2.0, 9.0)));
    }
    list
}

#[test]
fn loops_rest_in_balance() {
    let mut random = Random(Seeded(2));
    let mut shared = 0;
    for trial in 0..300 {
        let bodies = 2 + random.below(6);
        let inertia: Vec<f64> = (0..bodies).map(|_| random.decades(-9.0, 3.0)).collect();
        let connections = meshed(&mut random, bodies, 6);
        // A state that rests under the load that it makes.
        let state: Vec<f64> = (0..bodies)
            .map(|_| random.sign() * random.decades(-1.0, 1.0) * GAP)
            .collect();
        let force: Vec<f64> = (connections.iter())
            .map(|c| {
                let x: f64 = c.arms.iter().map(|(body, arm)| arm * state[*body]).sum();
                c.stiffness * c.element.eval(x, 0.0, 0.0).f
            })
            .collect();
        let torque = torques(bodies, &connections, &force);
        let assembly = assembled(&loaded(&inertia, connections.clone(), &torque));
        let rest = equilibrium(&assembly.system).unwrap_or_else(|none| panic!("{trial}: {none:?}"));
        let scales = &assembly.scales;
        let found: Vec<f64> = (0..connections.len())
            .map(|j| rest.force[j] * scales.stiffness[j] * scales.displacement[j])
            .collect();
        let left = torques(bodies, &connections, &found);
        let size = torque
            .iter()
            .chain(&found)
            .fold(0.0_f64, |m, x| m.max(x.abs()));
        for body in 0..bodies {
            assert!(
                (left[body] - torque[body]).abs() <= 1e-9 * size,
                "{trial}: {} not {}",
                left[body],
                torque[body]
            );
        }
        for (j, c) in connections.iter().enumerate() {
            let x = rest.deformation[j] * scales.displacement[j];
            let f = c.stiffness * c.element.eval(x, 0.0, 0.0).f;
            // What rounding of a deformation is worth in force.
            let rounding = 1e-14 * 5.0 * c.stiffness * (x.abs() + GAP);
            assert!(
                (f - found[j]).abs() <= 1e-9 * size + rounding,
                "{trial} {j}: {f} not {}",
                found[j]
            );
        }
        shared += usize::from(rest.is_unique);
    }
    assert!(shared > 100, "{shared}");
}

#[test]
fn nothing_carries_a_load_that_pulls_one_sided_connections_apart() {
    let mut random = Random(Seeded(3));
    for trial in 0..100 {
        // Two halves, each a spring chain, joined by several stops that all close in one direction.
        let half = 1 + random.below(3);
        let mut connections = Vec::new();
        for k in 1..half {
            connections.push(spring(&[(k - 1, 1.0), (k, -1.0)], random.decades(2.0, 9.0)));
            connections.push(spring(
                &[(half + k - 1, 1.0), (half + k, -1.0)],
                random.decades(2.0, 9.0),
            ));
        }
        let stops = 1 + random.below(3);
        for _ in 0..stops {
            let arms = [(random.below(half), 1.0), (half + random.below(half), -1.0)];
            connections.push(connection(
                &arms,
                random.decades(2.0, 9.0),
                one_sided(Side::Positive),
            ));
        }
        let inertia: Vec<f64> = (0..2 * half).map(|_| random.decades(-6.0, 2.0)).collect();
        let pull = random.decades(-3.0, 3.0);
        for side in [1.0, -1.0] {
            let mut torque = vec![0.0; 2 * half];
            torque[random.below(half)] = side * pull;
            torque[half + random.below(half)] = -side * pull;
            let assembly = assembled(&loaded(&inertia, connections.clone(), &torque));
            match (side > 0.0, equilibrium(&assembly.system)) {
                (true, Ok(_)) => {}
                (false, Err(NoEquilibrium::NotCarried { connections: apart })) => {
                    let all: Vec<usize> = (connections.len() - stops..connections.len()).collect();
                    assert_eq!(apart, all, "{trial}");
                }
                (_, other) => panic!("{trial} {side}: {other:?}"),
            }
        }
    }
}

#[test]
fn statics_know_no_inertia() {
    // The same train with any inertias, loaded in balance.
    for light in [1e-15, 1e-8, 1.0] {
        let connections = vec![
            connection(&[(0, 1.0), (1, -1.0)], 1e4, Box::new(Linear {})),
            connection(&[(1, 1.0), (2, -1.0)], 3e4, backlash(2e-3)),
        ];
        let assembly = assembled(&loaded(
            &[1.0, light, 5.0],
            connections,
            &[10.0, 0.0, -10.0],
        ));
        let rest = equilibrium(&assembly.system).unwrap();
        let found: Vec<f64> = (0..2)
            .map(|j| rest.deformation[j] * assembly.scales.displacement[j])
            .collect();
        assert!((found[0] / 1e-3 - 1.0).abs() < 1e-12, "{light}: {found:?}");
        assert!(
            (found[1] / (2e-3 + 10.0 / 3e4) - 1.0).abs() < 1e-12,
            "{light}: {found:?}"
        );
    }
}

#[test]
fn a_light_drag_decides_the_flank_of_a_hard_mesh() {
    for (drag, stiffness) in [(1e-6, 2.4e8), (1e-4, 1e16), (-1e-9, 2.4e8), (1e-6, 1e18)] {
        let connections = vec![
            spring(&[(0, 1.0), (1, -1.0)], 1e4),
            connection(&[(1, 0.05), (2, 0.05)], stiffness, backlash(5e-5)),
        ];
        let assembly = assembled(&loaded(&[1e-3; 3], connections, &[drag, 0.0, drag]));
        let rest = equilibrium(&assembly.system).unwrap();
        let l = &assembly.scales.displacement;
        let wanted = 5e-5_f64.copysign(drag) + drag / 0.05 / stiffness;
        assert!((rest.deformation[0] * l[0] / (drag / 1e4) - 1.0).abs() < 1e-12);
        assert!((rest.deformation[1] * l[1] / wanted - 1.0).abs() < 1e-12);
        assert_eq!(
            (rest.flank[1] as f64, rest.is_unique),
            (drag.signum(), true)
        );
        // Without drag none of them does.
        let assembly = assembled(&loaded(
            &[1e-3; 3],
            vec![
                spring(&[(0, 1.0), (1, -1.0)], 1e4),
                connection(&[(1, 0.05), (2, 0.05)], stiffness, backlash(5e-5)),
            ],
            &[0.0; 3],
        ));
        let rest = equilibrium(&assembly.system).unwrap();
        assert_eq!((rest.deformation[1], rest.is_unique), (0.0, false));
    }
}

#[test]
fn nothing_rests_where_a_law_falls() {
    let expression = |force: &str| -> Box<dyn Element> {
        let text = format!("{{type: expression, force: \"{force}\"}}");
        gearlash::yaml::parse(&text, "law")
            .unwrap()
            .read("")
            .unwrap()
    };
    let rest = |element, torque: f64| {
        let connections = vec![connection(&[(0, 1.0), (1, -1.0)], 1.0, element)];
        let assembly = assembled(&loaded(&[1.0, 2.0], connections, &[torque, -torque]));
        equilibrium(&assembly.system)
    };
    // Two wells at -1 and 1, none at 0.
    for torque in [0.0, 0.1, -0.1] {
        let x = rest(expression("-q + q^3"), torque).unwrap().deformation[0];
        assert!(
            (x * x * x - x - torque).abs() < 1e-12 && x.abs() > 0.9,
            "{x}"
        );
        assert!(torque == 0.0 || x * torque > 0.0, "{x}");
    }
    // It carries 1 at most: at q = 1.
    let found = rest(expression("1.5*q - 0.5*q^3"), 0.9).unwrap();
    assert!(found.deformation[0] > 0.0 && found.deformation[0] < 1.0);
    let lost = rest(expression("1.5*q - 0.5*q^3"), 1.1).unwrap_err();
    assert_eq!(
        lost,
        NoEquilibrium::NotCarried {
            connections: vec![0]
        }
    );
    // A smooth law that never reaches the load.
    assert!(rest(expression("tanh(q)"), 1.1).is_err());
    let x = rest(expression("tanh(q)"), 0.5).unwrap().deformation[0];
    assert!((x - 0.5_f64.atanh()).abs() < 1e-12);
    // Far softer than its reference stiffness.
    let x = rest(expression("1e-9*q + q^3"), 1e-3).unwrap().deformation[0];
    assert!((x - 0.1).abs() < 1e-7, "{x}");
}
