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

/// Scales as they come, scales of nobody's choice, and connections with their own.
fn scalings(train: &Train, omega: f64, random: &mut ChaCha8Rng) -> Vec<String> {
    let mut power = |low: f64, high: f64| 10f64.powf(random.random_range(low..high));
    let lengths = train.connections.iter().map(|(_, is_length)| {
        let usual = if *is_length { 1e-5 } else { 1e-3 };
        Some(usual * power(-1.0, 1.0))
    });
    let own: Vec<Option<f64>> = lengths.collect();
    let every_other = own
        .iter()
        .enumerate()
        .map(|(k, l)| l.filter(|_| k % 2 == 0));
    let some: Vec<Option<f64>> = every_other.collect();
    let any = omega * power(-1.0, 1.0);
    let other = omega * power(-1.0, 1.0);
    vec![
        train.model("", &[]),
        train.model("scaling: {frequency: first_connection}", &[]),
        train.model(&format!("scaling: {{frequency: {any:?} rad/s}}"), &own),
        train.model(
            &format!("scaling: {{frequency: {other:?} rad/s, length: 1 mm}}"),
            &some,
        ),
    ]
}

/// Largest difference between results in SI units, relative to the largest value of a unit.
const SAME: f64 = 1e-9;

/// The same for DOPRI5, which takes laws that are not piecewise affine: it holds its own tolerance, in scaled units.
const STEPPED: f64 = 1e-6;

#[test]
fn any_scales_give_the_same_results() {
    let (mut loops, mut mixed, mut compared, mut lost) = (0, 0, 0, 0);
    for seed in 0..12 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let train = train(&mut random);
        let omega = first_frequency(&train.model("", &[]));
        let list = scalings(&train, omega, &mut random);
        let at = omega * [0.61, 1.31, 1.77][random.next_u32() as usize % 3];
        let meshes = train.connections.iter().filter(|c| c.1).count();
        loops += usize::from(train.connections.len() > train.bodies.lines().count());
        mixed += usize::from(meshes > 0 && meshes < train.connections.len());
        for (method, size) in [
            // Of the residual in scaled units.
            ("galerkin", "harmonics: 8, tolerance: 1e-12"),
            ("shooting", "harmonics: 8"),
            // Few periods: impacts multiply the rounding from one to the next.
            (
                "integration",
                "points: 2, transient: 0, periods: 2, extend: 1",
            ),
        ] {
            let text = format!(
                "{{type: frequency_response, method: {method}, from: {:?} rad/s, to: {:?} rad/s, marks: [{at:?} rad/s], {size}}}",
                1.001 * at,
                0.999 * at,
            );
            let reports: Vec<_> = list.iter().map(|model| run(model, &text)).collect();
            let tables: Vec<_> = reports.iter().map(main_table).collect();
            let rows: Vec<Option<usize>> =
                tables.iter().map(|t| marked(t).first().copied()).collect();
            for (table, row) in tables.iter().zip(&rows).skip(1) {
                let (Some(first), Some(here)) = (rows[0], *row) else {
                    lost += 1;
                    continue;
                };
                let (gap, what) = gap(&measures(tables[0], first), &measures(table, here));
                let is_stepped = method == "integration" && list[0].contains("cubic");
                let allowed = if is_stepped { STEPPED } else { SAME };
                assert!(gap < allowed, "seed {seed}, {method}: {gap:.1e} {what}");
                compared += 1;
            }
        }
    }
    assert!(
        loops >= 2 && mixed >= 6,
        "{loops} loops, {mixed} with metres beside radians"
    );
    // Newton's iteration may fail from one start; it must not be the rule.
    assert!(
        lost * 10 <= compared,
        "{lost} without a result, {compared} compared"
    );
}
