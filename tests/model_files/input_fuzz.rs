//! The builder and the tables beside model files on hostile input: a model or a list of mistakes, never a panic. Seeded and bounded.

use gearlash::error::{Colour, Error, render};
use gearlash::model::{Model, ModelBuilder};
use gearlash::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng as Random;
use serde_json::json;
use std::panic::{AssertUnwindSafe, catch_unwind};

const CASES: u64 = 1500;
const NAMES: &[&str] = &[
    "A",
    "B",
    "C",
    "",
    "mesh",
    "a.b",
    "nü",
    "\u{1b}[31m",
    "y",
    "0",
    "x y",
];
const NUMBERS: &[f64] = &[
    1e-3,
    0.05,
    1.0,
    2e8,
    0.0,
    -0.0,
    -1.0,
    1e308,
    -1e308,
    5e-324,
    1e-200,
    1e200,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    3.0,
];

fn of<T: Copy>(list: &[T], random: &mut Random) -> T {
    // The first entries are sensible: most models get further than their first mistake.
    let most = if random.random_range(0..4) > 0 {
        3.min(list.len())
    } else {
        list.len()
    };
    list[random.random_range(0..most)]
}

/// One step of a program that nobody has thought through.
fn step(builder: ModelBuilder, random: &mut Random) -> ModelBuilder {
    let (a, b) = (of(NAMES, random), of(NAMES, random));
    let (x, y) = (of(NUMBERS, random), of(NUMBERS, random));
    match random.random_range(0..19) {
        0 => builder.body(a, x),
        1 => builder.mass(a, x),
        2 => builder.gear(b, (a, x), (b, y)),
        3 => builder.internal_gear(a, (a, x), (b, y)),
        4 => builder.shaft(a, a, b),
        5 => builder.ground(a, b),
        6 => builder.acts_on(a, &[(a, x), (b, y), (a, y)]),
        7 => builder.stiffness(x),
        8 => builder.dashpot(x),
        9 => builder.length(x),
        10 => builder.law(Backlash::half_gap(x)),
        11 => builder.connection_key(a, &json!({"type": a, "gap": x})),
        12 => builder.modal_damping(x),
        13 => builder.modal_ratios(&[x, y]),
        14 => builder.stiffness_proportional_damping(x),
        15 => {
            let load = Load::mean(x).harmonic(random.random_range(0..3), y);
            builder.load(a, load.harmonic_at(usize::MAX, x, y))
        }
        16 => builder.part(a, &json!([x, {"a": y}])),
        17 => builder.part("reference", &json!({"body": a, "speed": x})),
        _ => builder.name(a),
    }
}

/// A sound train, or nothing, and steps on top of it.
fn built(random: &mut Random) -> Result<Model, Error> {
    let mut builder = Model::builder();
    if random.random_range(0..3) > 0 {
        builder = builder.body("A", 1e-3).body("B", 1e-3);
        builder = builder
            .gear("mesh", ("A", 0.05), ("B", 0.05))
            .stiffness(2e8);
        builder = builder
            .load("A", Load::mean(10.0))
            .load("B", Load::mean(10.0));
    }
    for _ in 0..random.random_range(0..7) {
        builder = step(builder, random);
    }
    builder.build()
}

/// Runs `take` on every seed; how many were taken without a mistake.
fn count(cases: u64, take: impl Fn(&mut Random) -> Result<Model, Error>) -> usize {
    let mut sound = 0;
    for seed in 0..cases {
        let taken = catch_unwind(AssertUnwindSafe(|| {
            match take(&mut Random::seed_from_u64(seed)) {
                Ok(model) => {
                    let names: Vec<String> =
                        model.numbers().iter().map(|n| n.name.clone()).collect();
                    assert!(!names.is_empty());
                    assert!(Model::from_tree(&model.to_tree()).is_ok(), "not read again");
                    true
                }
                Err(Error::Input(list)) => {
                    assert!(!list.is_empty() && !render(&list, Colour::Plain).contains('\u{1b}'));
                    false
                }
                Err(other) => panic!("{other}"),
            }
        }));
        sound += usize::from(taken.unwrap_or_else(|_| panic!("seed {seed}")));
    }
    sound
}

#[test]
fn builders_without_a_plan_give_models_or_mistakes() {
    let sound = count(CASES, built);
    assert!(sound as u64 > CASES / 20, "{sound} models only");
}

const TABLE: &str = "angle,torque,t\n0,1.5,0\n90,-2,0.01\n180,3e1,0.02\n270,0,0.03\n";
const CELLS: &[&str] = &[
    "",
    "NaN",
    "inf",
    "1e999",
    "-1e308",
    "1,5",
    "\"",
    "\"\"",
    ";",
    "\t",
    "\r\n",
    "\n",
    "\0",
    "\u{feff}",
    "\u{1b}[2J",
    "0x10",
    "1_0",
    "torque",
    "angle",
    ",,,",
    "999999999999999999999999",
    "-0",
    "1e-320",
    "\u{2028}",
];

/// A table with some of its characters changed, moved or missing; not always text.
fn damaged(random: &mut Random) -> Vec<u8> {
    let mut bytes = TABLE.as_bytes().to_vec();
    for _ in 0..random.random_range(0..5) {
        let at = random.random_range(0..=bytes.len());
        let end = (at + random.random_range(0..6)).min(bytes.len());
        match random.random_range(0..6) {
            0 => bytes.truncate(at),
            1 => drop(bytes.splice(at..end, [])),
            2 => bytes.insert(at, random.random_range(0..=255)),
            3 => {
                let copy = bytes[at..].to_vec();
                bytes.extend(copy);
            }
            _ => {
                let cell = CELLS[random.random_range(0..CELLS.len())];
                drop(bytes.splice(at..end, cell.bytes()));
            }
        }
    }
    bytes
}

#[test]
fn damaged_tables_give_loads_or_mistakes() {
    let loads = [
        "cycle: {file: a.csv, column: torque, revolutions: 2}",
        "cycle: {file: a.csv, column: torque, angle: angle, angle_unit: deg, revolutions: 1}",
        "profile: {file: a.csv, time: t, column: torque}",
    ];
    let folder = tempfile::tempdir().unwrap();
    let (file, table) = (folder.path().join("m.yaml"), folder.path().join("a.csv"));
    let sound = count(CASES / 2, |random| {
        let load = loads[random.random_range(0..loads.len())];
        std::fs::write(&table, damaged(random)).unwrap();
        let text = format!(
            "bodies: {{A: {{inertia: 1.0e-3}}, B: {{inertia: 2.0e-3}}}}\nconnections: {{s: {{shaft: [A, B], stiffness: 1.0e3}}}}\n\
             loads: {{A: {{{load}}}}}\nreference: {{body: A, speed: 600 rpm}}\n"
        );
        std::fs::write(&file, text).unwrap();
        Model::load(&file)
    });
    assert!(sound > 50, "{sound} tables only");
}
