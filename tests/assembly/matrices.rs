//! Parts given by matrices against the same trains written by hand, and against themselves in other coordinates.

use gearlash::assembly::{Assembly, assemble};
use gearlash::error::Error;
use gearlash::interrupt::Interrupt;
use gearlash::model::Model;
use nalgebra::DMatrix;

const ANALYSES: &str = "
analyses:
  fr: {type: frequency_response, from: 900 Hz, to: 700 Hz, harmonics: 5, max_points: 40, marks: [800 Hz], tables: all}
";

/// Motor, and a shaft with two wheels behind a mesh; K and C of the shaft as a chain, the last wheel held or free.
fn by_hand(ground: bool) -> String {
    let held = "  bush: {ground: rim, stiffness: 2.0e4, damping: 0.4}\n";
    format!(
        "bodies: {{motor: {{inertia: 1.0e-3}}, flange: {{inertia: 2.0e-3}}, rim: {{inertia: 3.0e-3}}}}\nconnections:\n\
         \x20 mesh: {{gear: {{motor: 50 mm, flange: 40 mm}}, stiffness: 2.0e8, damping: 200, element: {{type: backlash, half_gap: 20 um}}}}\n\
         \x20 shaft: {{shaft: [flange, rim], stiffness: 5.0e4, damping: 1.5}}\n{}{LOADS}{ANALYSES}",
        if ground { held } else { "" }
    )
}

const LOADS: &str = "loads: {motor: {mean: 100, harmonics: [{order: 1, amplitude: 40}]}, flange: {mean: 50}, rim: {mean: 30, harmonics: [{order: 1, amplitude: 5}]}}\n";

/// The same with the shaft as a part, in coordinates z = T y of which the first two are flange and rim where T says so.
fn by_matrices(ground: bool, t: &DMatrix<f64>, loads: &str) -> String {
    part(ground, t, loads, true)
}

fn part(ground: bool, t: &DMatrix<f64>, loads: &str, is_damped: bool) -> String {
    let (k_g, c_g) = if ground { (2.0e4, 0.4) } else { (0.0, 0.0) };
    let m = dmatrix![2.0e-3, 0.0; 0.0, 3.0e-3];
    let k = dmatrix![5.0e4, -5.0e4; -5.0e4, 5.0e4 + k_g];
    let c = dmatrix![1.5, -1.5; -1.5, 1.5 + c_g];
    let [m, k, c] = [m, k, c].map(|a| rows(&(t.transpose() * a * t)));
    let (c, dashpot) = match is_damped {
        true => (format!(", damping: {c}"), ", damping: 200"),
        false => (String::new(), ""),
    };
    format!(
        "bodies: {{motor: {{inertia: 1.0e-3}}}}\nmatrices:\n  disc: {{coordinates: [flange, rim], inertia: {m}, stiffness: {k}{c}}}\n\
         connections:\n  mesh: {{gear: {{motor: 50 mm, flange: 40 mm}}, stiffness: 2.0e8{dashpot}, element: {{type: backlash, half_gap: 20 um}}}}\n\
         {loads}{ANALYSES}"
    )
}

fn rows(matrix: &DMatrix<f64>) -> String {
    let row = |i: usize| {
        let list: Vec<String> = matrix.row(i).iter().map(|x| format!("{x:e}")).collect();
        format!("[{}]", list.join(", "))
    };
    let list: Vec<String> = (0..matrix.nrows()).map(row).collect();
    format!("[{}]", list.join(", "))
}

fn assembled(text: &str) -> (Model, Assembly) {
    let model = Model::from_yaml(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let assembly = assemble(&model).unwrap();
    (model, assembly)
}

/// Natural frequencies [rad/s], and columns of the response at the mark.
fn answers(text: &str, columns: &[&str]) -> (Vec<f64>, Vec<f64>) {
    let (model, assembly) = assembled(text);
    let lines = assembly
        .natural_frequencies
        .iter()
        .map(|w| w * assembly.scales.frequency);
    let lines = lines.collect();
    let report = model.run_observed("fr", &Interrupt::default()).unwrap();
    let main = report.main().unwrap();
    let marks = main
        .column("mark")
        .unwrap()
        .values
        .as_integers()
        .map(|list| list.to_vec());
    let marks = marks.unwrap_or_else(|| {
        main.floats("mark")
            .unwrap()
            .iter()
            .map(|x| *x as i64)
            .collect()
    });
    let row = marks.iter().position(|m| *m == 1).expect("a mark");
    let value = |name: &&str| {
        let table = report.tables.iter().find(|t| t.column(name).is_some());
        table
            .unwrap_or_else(|| panic!("no {name}"))
            .floats(name)
            .unwrap()[row]
    };
    (lines, columns.iter().map(value).collect())
}

fn compare(a: &(Vec<f64>, Vec<f64>), b: &(Vec<f64>, Vec<f64>), tolerance: f64) {
    for (a, b) in [(&a.0, &b.0), (&a.1, &b.1)] {
        assert_eq!(a.len(), b.len());
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= tolerance * a.abs().max(1e-12), "{a} {b}");
        }
    }
}

const COLUMNS: &[&str] = &[
    "rms.mesh",
    "mean.mesh",
    "force_max.mesh",
    "peak_acceleration.motor",
    "peak_acceleration.rim",
    "peak_acceleration.flange",
];

#[test]
fn a_part_is_the_train_that_it_was_made_from() {
    for ground in [false, true] {
        let hand = answers(&by_hand(ground), COLUMNS);
        let part = answers(
            &by_matrices(ground, &DMatrix::identity(2, 2), LOADS),
            COLUMNS,
        );
        // Newton's tolerance is 1e-10.
        compare(&hand, &part, 1e-8);
    }
}

#[test]
fn other_coordinates_change_nothing() {
    // The rim against the flange: M is full, the flange stays what the mesh acts on. F^T z = F^T T y.
    let t = dmatrix![1.0, 0.0; 0.7, 1.3];
    let loads = "loads: {motor: {mean: 100, harmonics: [{order: 1, amplitude: 40}]}, flange: {mean: 71, harmonics: [{order: 1, amplitude: 3.5}]}, \
                 rim: {mean: 39, harmonics: [{order: 1, amplitude: 6.5}]}}\n";
    let columns = &COLUMNS[..4];
    let with_flange = [columns, &["peak_acceleration.flange"]].concat();
    for ground in [false, true] {
        let plain = answers(
            &by_matrices(ground, &DMatrix::identity(2, 2), LOADS),
            &with_flange,
        );
        let other = answers(&by_matrices(ground, &t, loads), &with_flange);
        compare(&plain, &other, 1e-8);
    }
}

#[test]
fn speeds_go_through_a_free_part_as_if_it_were_rigid() {
    let text = by_matrices(false, &DMatrix::identity(2, 2), "").replace(
        "connections:",
        "reference: {body: motor, speed: 800 rpm}\nbalance: motor\nloads: {rim: {mean: 10}}\nconnections:",
    );
    let (model, assembly) = assembled(&text);
    assert_eq!(assembly.coupling.as_ref().unwrap().rigid_body.ncols(), 1);
    let gearlash::model::Structure::Train(train) = &model.structure else {
        panic!("a train");
    };
    let motion = train.mean_motion.as_ref().unwrap();
    let ratios: Vec<String> = motion.ratios.iter().map(ToString::to_string).collect();
    assert_eq!(ratios, ["1", "-5/4", "-5/4"]);
    assert!(
        (train.balanced[0].1 - 10.0 * 1.25).abs() < 1e-9,
        "{:?}",
        train.balanced
    );
}

#[test]
fn modal_damping_knows_the_matrix() {
    let text =
        part(true, &dmatrix![1.0, 0.0; 0.7, 1.3], "", false) + "damping: {modal_ratio: 0.03}\n";
    let (_, assembly) = assembled(&text);
    let (gamma, kappa_w) = (
        assembly.system.damping(),
        assembly.system.stiffness() * assembly.system.element_map(),
    );
    // Gam = 2 zeta (kappa W)^(1/2): its square is 4 zeta^2 kappa W.
    let miss = (gamma * gamma - kappa_w.clone() * (4.0 * 0.03 * 0.03)).norm();
    assert!(miss < 1e-10 * kappa_w.norm(), "{miss}");
}

#[test]
fn mistakes_say_what_was_wanted() {
    let sound = by_matrices(true, &DMatrix::identity(2, 2), LOADS);
    for (from, to, wanted) in [
        ("[flange, rim]", "[flange, rim, hub]", "wanted 3 x 3"),
        ("[flange, rim]", "[flange, flange]", "there twice"),
        ("[flange, rim]", "[motor, flange]", "the name of a body"),
        ("[[2e-3, 0e0]", "[[2e-3, 1e0]", "not symmetric"),
        ("[[2e-3, 0e0]", "[[-2e-3, 0e0]", "not positive definite"),
        ("[[5e4, -5e4]", "[[-5e4, -5e4]", "not positive semidefinite"),
        ("stiffness: [[5e4", "stiffness: [[5e4 N m/rad", "SI units"),
        (
            "stiffness: [[5e4",
            "stifness: [[5e4",
            "did you mean `stiffness`",
        ),
        (
            "gear: {motor: 50 mm, flange:",
            "gear: {motor: 50 mm, flang:",
            "did you mean `flange`",
        ),
    ] {
        let text = sound.replacen(from, to, 1);
        assert_ne!(text, sound, "{from}");
        match Model::from_yaml(&text) {
            Err(Error::Input(list)) => {
                let said: Vec<String> = list
                    .iter()
                    .map(|m| format!("{} {:?}", m.message, m.help))
                    .collect();
                assert!(said.iter().any(|s| s.contains(wanted)), "{to}: {said:?}");
            }
            other => panic!("{to}: {other:?}"),
        }
    }
    let free = by_matrices(false, &DMatrix::identity(2, 2), LOADS).replace("1.5e0]]", "1.9e0]]");
    assert!(format!("{:?}", Model::from_yaml(&free)).contains("leaves free"));
}

/// The motor with a measured angle instead of its inertia, over its own turn.
fn moved(text: &str) -> String {
    let motion =
        "motor: {motion: {values: [0, 0.12, 0.3, 0.2, 0.05, -0.14, -0.3, -0.2], unit: mrad}}";
    let text = text.replacen("motor: {inertia: 1.0e-3}", motion, 1);
    let text = text.replacen(
        "motor: {mean: 100, harmonics: [{order: 1, amplitude: 40}]}, ",
        "",
        1,
    );
    format!("reference: {{body: motor, speed: 800 Hz}}\n{text}")
}

#[test]
fn a_measured_motion_moves_a_part_like_its_bodies() {
    let columns = [
        "rms.mesh",
        "force_max.mesh",
        "peak_acceleration.motor",
        "peak_acceleration.rim",
    ];
    let hand = answers(&moved(&by_hand(false)), &columns);
    let text = by_matrices(false, &DMatrix::identity(2, 2), LOADS);
    compare(&hand, &answers(&moved(&text), &columns), 1e-8);
    // Full matrices: the second coordinate is the twist.
    let t = dmatrix![1.0, 0.0; 1.0, 1.0];
    let loads = LOADS.replace(
        "flange: {mean: 50}, rim: {mean: 30, harmonics: [{order: 1, amplitude: 5}]}",
        "flange: {mean: 80, harmonics: [{order: 1, amplitude: 5}]}, rim: {mean: 30, harmonics: [{order: 1, amplitude: 5}]}",
    );
    let other = answers(&moved(&by_matrices(false, &t, &loads)), &columns[..3]);
    let known = answers(&moved(&by_hand(false)), &columns[..3]);
    compare(&known, &other, 1e-8);
}

#[test]
fn a_coordinate_of_a_part_cannot_have_a_measured_motion() {
    let text = by_matrices(false, &DMatrix::identity(2, 2), LOADS).replace(
        "rim: {mean: 30, harmonics: [{order: 1, amplitude: 5}]}",
        "rim: {motion: {values: [0, 0.1, 0, -0.1], unit: mrad}}",
    );
    let text = format!("reference: {{body: motor, speed: 800 Hz}}\n{text}");
    let model = Model::from_yaml(&text).unwrap();
    let said = format!("{:?}", assemble(&model).unwrap_err());
    assert!(
        said.contains("loads.rim.motion") && said.contains("connect it"),
        "{said}"
    );
}

/// Entries are numbers by name; the other side of the diagonal moves along.
#[test]
fn entries_are_numbers_by_name() {
    let identity = DMatrix::identity(2, 2);
    let text = by_matrices(true, &identity, LOADS);
    let (mut model, _) = assembled(&text);
    let coupling = model.knob("disc.stiffness.0.1").unwrap();
    assert_eq!(model.get(&coupling), -5.0e4);
    assert!(
        model
            .numbers()
            .iter()
            .any(|n| n.name == "matrices.disc.inertia.1.1")
    );
    model.set(&coupling, -4.0e4).unwrap();
    for (name, value) in [
        ("disc.stiffness.1.0", -4.0e4),
        ("disc.stiffness.0.0", 5.0e4),
    ] {
        assert_eq!(model.get(&model.knob(name).unwrap()), value);
    }
    let varied = |parameter: &str, from: f64, to: f64| {
        let analysis = format!(
            "  x: {{type: parameter_response, at: 800 Hz, parameter: {parameter}, from: {from}, to: {to}, harmonics: 3, stability: false}}\n"
        );
        let model = Model::from_yaml(&(text.clone() + &analysis)).unwrap();
        model.run_observed("x", &Interrupt::default()).unwrap()
    };
    for (parameter, from, to) in [
        ("disc.inertia.1.1", 3.0e-3, 3.2e-3),
        ("disc.stiffness.0.1", -5.0e4, -4.9e4),
    ] {
        let report = varied(parameter, from, to);
        assert_eq!(report.ended_early, None, "{parameter}");
    }
    let study = "  y: {type: parameter_study, grid: {disc.stiffness.1.0: [-5.0e4, -4.0e4]}, \
         analysis: {type: modes}, collect: {w: {column: natural_frequency.3, reduce: max}}}\n";
    let model = Model::from_yaml(&(text + study)).unwrap();
    let report = model.run_observed("y", &Interrupt::default()).unwrap();
    let table = report.main().unwrap();
    let found = table
        .column("w")
        .unwrap()
        .values
        .as_floats()
        .unwrap()
        .to_vec();
    assert!(found.len() == 2 && found[0] != found[1], "{found:?}");
}
