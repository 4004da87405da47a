//! Scales never change an answer: random trains, any characteristic frequency and lengths, the same results in SI units.

use crate::response_support::*;
use crate::time_domain_support::*;
use gearlash::study::Study;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;

/// A random train: trees and parallel paths, meshes beside shafts, grounded or free. `lengths`: own scales of connections.
struct Train {
    bodies: String,
    /// A connection without its closing brace, and whether its deformation is in m.
    connections: Vec<(String, bool)>,
    rest: String,
}

fn train(random: &mut ChaCha8Rng) -> Train {
    let mut between = |low: f64, high: f64| random.random_range(low..high);
    let count = between(3.0, 5.99) as usize;
    let mut bodies = String::new();
    for i in 0..count {
        writeln!(
            bodies,
            "  b{i}: {{inertia: {:?}}}",
            10f64.powf(between(-3.3, -2.3))
        )
        .unwrap();
    }
    let mut connections = Vec::new();
    for i in 1..count {
        let parent = between(0.0, i as f64) as usize;
        let is_mesh = between(0.0, 1.0) < 0.7;
        let (a, b) = (between(0.03, 0.08), between(0.03, 0.08));
        let law = match between(0.0, 4.0) as usize {
            0 => "linear".into(),
            1 => format!(
                "cubic, cubic: {:?}",
                between(0.1, 1.0) * if is_mesh { 1e8 } else { 1e2 }
            ),
            _ => format!(
                "backlash, half_gap: {:?}",
                between(1.0, 5.0) * if is_mesh { 1e-5 } else { 5e-4 }
            ),
        };
        let error = match between(0.0, 1.0) < 0.4 {
            true => format!(
                ", transmission_error: {{harmonics: [{{order: 2, amplitude: {:?}, phase: 0.5}}]}}",
                between(0.5, 2.0) * if is_mesh { 1e-6 } else { 2e-5 }
            ),
            false => String::new(),
        };
        let dashpot = if between(0.0, 1.0) < 0.3 {
            ", damping: 0.1"
        } else {
            ""
        };
        if !is_mesh {
            let k = between(2e4, 1e5);
            let text = format!(
                "{{shaft: [b{parent}, b{i}], stiffness: {k:?}, element: {{type: {law}}}{error}{dashpot}"
            );
            connections.push((text, false));
            continue;
        }
        let kind = if between(0.0, 1.0) < 0.3 {
            "internal_gear"
        } else {
            "gear"
        };
        let mesh = |f: f64, k: f64, law: &str| {
            format!(
                "{{{kind}: {{b{parent}: {:?}, b{i}: {:?}}}, stiffness: {k:?}, element: {{type: {law}}}{error}{dashpot}",
                f * a,
                f * b
            )
        };
        connections.push((mesh(1.0, between(5e7, 2e8), &law), true));
        // A second mesh between the same wheels closes a loop.
        if between(0.0, 1.0) < 0.4 {
            connections.push((mesh(between(0.5, 1.5), between(5e7, 2e8), "linear"), true));
        }
    }
    if between(0.0, 1.0) < 0.5 {
        connections.push((
            format!("{{ground: b0, stiffness: {:?}", between(1e4, 1e5)),
            false,
        ));
    }
    let mut rest = format!(
        "damping: {{modal_ratio: {:?}}}\nreport: {{units: si}}\nloads:\n  b0: {{mean: {:?}, harmonics: \
         [{{order: 1, amplitude: {:?}}}, {{order: 3, amplitude: {:?}, phase: 1}}]}}\n",
        between(0.05, 0.1),
        between(50.0, 150.0),
        between(30.0, 90.0),
        between(1.0, 9.0)
    );
    // Every gap has a load that decides on which flank it rests.
    for i in 1..count {
        writeln!(rest, "  b{i}: {{mean: {:?}}}", between(5.0, 50.0)).unwrap();
    }
    Train {
        bodies,
        connections,
        rest,
    }
}

impl Train {
    /// The model with its own length of every connection where there is one.
    fn model(&self, scaling: &str, lengths: &[Option<f64>]) -> String {
        let mut text = format!("schema: 1\nbodies:\n{}connections:\n", self.bodies);
        for (k, (connection, _)) in self.connections.iter().enumerate() {
            let length = lengths.get(k).copied().flatten();
            let length = length.map_or(String::new(), |l| format!(", length: {l:?}"));
            writeln!(text, "  c{k}: {connection}{length}}}").unwrap();
        }
        text + &self.rest + scaling
    }
}

/// First natural frequency [rad/s].
fn first_frequency(model: &str) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let study: Study = load(model, "  it: {type: modes}", folder.path()).unwrap();
    study.assembly.natural_frequencies[0] * study.assembly.scales.frequency
}

/// Scales as they come, scales of nobody's choice, and every connection with its own.
fn scalings(train: &Train, omega: f64, random: &mut ChaCha8Rng) -> Vec<String> {
    let mut power = |low: f64, high: f64| 10f64.powf(random.random_range(low..high));
    let own: Vec<Option<f64>> = train
        .connections
        .iter()
        .map(|_| Some(power(-6.0, -2.0)))
        .collect();
    let some: Vec<Option<f64>> = own
        .iter()
        .enumerate()
        .map(|(k, l)| l.filter(|_| k % 2 == 0))
        .collect();
    let mut list = vec![
        train.model("", &[]),
        train.model("scaling: {frequency: first_connection}", &[]),
    ];
    list.push(train.model(
        &format!(
            "scaling: {{frequency: {:?} rad/s}}",
            omega * power(-1.0, 1.0)
        ),
        &own,
    ));
    list.push(train.model(
        &format!(
            "scaling: {{frequency: {:?} rad/s, length: 1 mm}}",
            omega * power(-1.0, 1.0)
        ),
        &some,
    ));
    list
}

#[test]
fn any_scales_give_the_same_results() {
    let (mut loops, mut mixed, mut compared) = (0, 0, 0);
    for seed in 0..12 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let train = train(&mut random);
        let omega = first_frequency(&train.model("", &[]));
        let list = scalings(&train, omega, &mut random);
        let at = omega * [0.61, 1.31, 1.77][random.next_u32() as usize % 3];
        let meshes = train.connections.iter().filter(|c| c.1).count();
        loops += usize::from(train.connections.len() > train.bodies.lines().count());
        mixed += usize::from(meshes > 0 && meshes < train.connections.len());
        for method in ["galerkin", "shooting", "integration"] {
            let text = format!(
                "{{type: frequency_response, method: {method}, from: {:?} rad/s, to: {:?} rad/s, marks: [{at:?} rad/s]{}}}",
                1.001 * at,
                0.999 * at,
                if method == "integration" {
                    ", points: 2, transient: 6, periods: 4"
                } else {
                    ", harmonics: 8"
                }
            );
            let reports: Vec<_> = list.iter().map(|model| run(model, &text)).collect();
            let tables: Vec<_> = reports.iter().map(main_table).collect();
            let first = marked(tables[0]);
            for (k, table) in tables.iter().enumerate().skip(1) {
                let here = marked(table);
                if first.is_empty() || here.is_empty() {
                    eprintln!(
                        "{seed} {method} {k}: {:?} / {:?}",
                        reports[0].ended_early, reports[k].ended_early
                    );
                    continue;
                }
                let (gap, what) = gap(&measures(tables[0], first[0]), &measures(table, here[0]));
                eprintln!("{seed} {method} {k}: {gap:.1e} {what}");
                compared += 1;
            }
        }
    }
    eprintln!("{loops} {mixed} {compared}");
}
