//! Models and analyses built by programs: the same results as from a file, the same sentences about mistakes.

use gearlash::element::registered;
use gearlash::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn pair() -> gearlash::model::ModelBuilder {
    Model::builder()
        .body("A", 1e-3)
        .body("B", 2e-3)
        .gear("mesh", ("A", 0.05), ("B", 0.06))
        .stiffness(2e8)
        .dashpot(20.0)
        .law(Backlash::half_gap(50e-6))
        .load("A", Load::mean(100.0).harmonic_at(1, 150.0, 0.3))
        .load("B", Load::mean(120.0))
}

const PAIR: &str = "
bodies: {A: {inertia: 1e-3}, B: {inertia: 2e-3}}
connections:
  mesh: {gear: {A: 50 mm, B: 60 mm}, stiffness: 2e8, damping: 20, element: {type: backlash, half_gap: 50 um}}
loads:
  A: {mean: 100, harmonics: [{order: 1, amplitude: 150, phase: 0.3}]}
  B: {mean: 120}
analyses:
  speed: {type: frequency_response, from: 6000 Hz, to: 5000 Hz, harmonics: 6}
  history: {type: time_history, at: 5500 Hz, periods: 2, transient: 3}
  map: {type: poincare_map, at: 5500 Hz, periods: 20, transient: 20}
  gap: {type: parameter_response, parameter: mesh.half_gap, from: 40 um, to: 60 um, at: 5500 Hz, harmonics: 6}
  modes: {type: modes}
";

#[test]
fn built_models_and_analyses_give_what_files_give() {
    let (built, written) = (pair().build().unwrap(), Model::from_yaml(PAIR).unwrap());
    let tables = |report: &Report| serde_json::to_string(&report.tables).unwrap();
    let of = |name: &str| tables(&written.run(name).unwrap());
    let f = hertz(5500.0);
    let speed = FrequencyResponse::between(hertz(6000.0), hertz(5000.0)).harmonics(6);
    let speed = speed.run(&written).unwrap();
    assert_eq!(tables(speed.report()), of("speed"));
    assert!(
        speed
            .points()
            .all(|p| p.rms("mesh") > 0.0 && p.rms("none").is_nan())
    );
    let history = TimeHistory::at(f.clone()).with(|s| (s.periods, s.transient) = (Some(2), 3));
    assert_eq!(
        tables(history.run(&written).unwrap().report()),
        of("history")
    );
    let map = PoincareMap::at(f.clone()).with(|s| (s.periods, s.transient) = (20, 20));
    let map = map.run(&written).unwrap();
    assert_eq!(tables(map.report()), of("map"));
    assert_eq!(map.labels().len(), 1);
    let gap = ParameterResponse::between("mesh.half_gap", 40e-6, 60e-6, f).harmonics(6);
    let gap = gap.run(&written).unwrap();
    let (a, b) = (gap.column("rms.mesh").unwrap(), of("gap"));
    let b: Vec<gearlash::report::Table> = serde_json::from_str(&b).unwrap();
    assert_eq!(a, b[0].floats("rms.mesh").unwrap());
    assert_eq!(
        tables(&Modes::default().run(&written).unwrap()),
        of("modes")
    );
    // Phases go through sine and cosine on their way.
    let system = |model: &Model| model.assemble().unwrap().system;
    let (one, other) = (system(&built), system(&written));
    assert!((one.stiffness() - other.stiffness()).amax() == 0.0);
    let value = |s: &gearlash::system::System| s.loads()[0].series.value(1.0);
    assert!((value(&one) - value(&other)).abs() < 1e-12 * value(&one).abs());
}

#[test]
fn every_law_goes_through_the_builder() {
    for info in registered() {
        let law = info.example_law().unwrap();
        let json = serde_json::to_value(&law).unwrap();
        let builder = Model::builder()
            .body("A", 1.0)
            .ground("c", "A")
            .stiffness(3.0);
        let built = builder.connection_key("element", &json).build();
        // Nulls of absent parameters are what the builder's own `law` leaves out.
        if let Ok(model) = built {
            assert_eq!(model.analyses(), Vec::<String>::new(), "{}", info.tag);
        }
    }
    let laws = Model::builder()
        .body("A", 1.0)
        .ground("a", "A")
        .stiffness(3.0)
        .law(Cubic { cubic: 2.0 })
        .ground("b", "A")
        .stiffness(1.0)
        .law(Backlash::half_gap(0.1).impact_damping(0.3));
    let model = laws.build().unwrap();
    for (name, value) in [
        ("a.cubic", 2.0),
        ("b.half_gap", 0.1),
        ("b.impact_damping", 0.3),
    ] {
        assert_eq!(model.get(&model.knob(name).unwrap()), value, "{name}");
    }
}

#[test]
fn mistakes_are_told_in_the_words_of_the_reader() {
    let said = |builder: gearlash::model::ModelBuilder| builder.build().unwrap_err().to_string();
    for (builder, wanted) in [
        (Model::builder(), "bodies"),
        (pair().body("A", 1.0), "bodies.A: is given twice"),
        (
            pair().stiffness(1.0),
            "connections.mesh.stiffness: is given twice",
        ),
        (Model::builder().stiffness(1.0), "add one first"),
        (pair().load("C", Load::mean(1.0)), "`C`"),
        (pair().shaft("s", "A", "b"), "did you mean `B`"),
        (pair().shaft("s", "A", "B"), "`stiffness` is missing"),
        (
            pair()
                .shaft("s", "A", "B")
                .stiffness(1.0)
                .law(Backlash::half_gap(-1.0)),
            "half_gap = -1",
        ),
        (
            pair().gear("same", ("A", 0.1), ("A", 0.2)).stiffness(1.0),
            "found 1 bodies",
        ),
        (pair().modal_damping(-0.1), "must be >= 0"),
        (
            pair().part("analysis", &serde_json::json!({})),
            "unknown key `analysis`",
        ),
    ] {
        let found = said(builder);
        assert!(found.contains(wanted), "{wanted}: {found}");
    }
    let model = pair().build().unwrap();
    let found = FrequencyResponse::default()
        .run(&model)
        .unwrap_err()
        .to_string();
    assert!(found.contains("analysis.from: missing"), "{found}");
    let found = TimeHistory::at(1.0).run(&model).unwrap_err().to_string();
    assert!(
        found.contains("analysis.at") && found.contains("ambiguous"),
        "{found}"
    );
    let error = TimeHistory::default().run(&model).unwrap_err();
    assert!(matches!(error, Error::Input(list) if list[0].path == "analysis.at"));
}

/// Numbers that programs make of wrong input.
const HOSTILE: [f64; 12] = [
    0.0,
    -0.0,
    -1.0,
    1e-320,
    1e308,
    -1e308,
    1e-9,
    1.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    1e160,
];
const NAMES: [&str; 9] = ["A", "B", "C", "", "a.b", "1", "x y", "ä", "connections"];

#[test]
fn hostile_values_make_errors_and_no_panics() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut built = 0;
    for _ in 0..3000 {
        // Mostly sound, so that some models come as far as the assembly.
        let mut number = || match random.random_range(0..3) {
            0 => HOSTILE[random.random_range(0..HOSTILE.len())],
            _ => 10f64.powi(random.random_range(-4..4)),
        };
        let numbers: Vec<f64> = (0..12).map(|_| number()).collect();
        let mut name = |usual: &'static str| match random.random_range(0..12) {
            0 => NAMES[random.random_range(0..NAMES.len())],
            _ => usual,
        };
        let mut builder = Model::builder()
            .body(name("A"), numbers[0])
            .body(name("B"), numbers[1])
            .gear(
                name("mesh"),
                (name("A"), numbers[2]),
                (name("B"), numbers[3]),
            )
            .stiffness(numbers[4])
            .law(Backlash::half_gap(numbers[5]).impact_damping(numbers[6]));
        if random.random_range(0..2) == 0 {
            builder = builder
                .ground(NAMES[random.random_range(0..3)], "A")
                .stiffness(numbers[7]);
        }
        let load = Load::mean(numbers[8]).harmonic(random.random_range(0..4), numbers[9]);
        let builder = builder.modal_damping(numbers[10]).load("A", load);
        match builder.build() {
            Err(Error::Input(list)) => assert!(!list.is_empty()),
            Err(other) => panic!("{other}"),
            Ok(mut model) => {
                built += 1;
                let gap = model.knob("mesh.half_gap");
                if let Ok(gap) = gap {
                    let _ = model.set(&gap, numbers[11]);
                }
                if let Ok(assembly) = model.assemble() {
                    assert!(assembly.system.stiffness().iter().all(|x| x.is_finite()));
                    let _ = Modes::default().with(|s| s.points = 3).run(&model);
                }
            }
        }
    }
    assert!(built > 100, "{built}");
}
