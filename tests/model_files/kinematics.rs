//! Speeds, ratios, orders, drag and balance from tooth numbers, against values computed elsewhere from the same data.

use gearlash::model::Structure;
use gearlash::model::{Model, Train, read};
use gearlash::yaml;
use serde_json::Value;
use std::f64::consts::TAU;

fn model(text: &str) -> Result<Model, String> {
    let node = yaml::parse(text, "m.yaml").unwrap();
    read(&node).map_err(|list| {
        let list = list
            .iter()
            .map(|d| format!("{}: {} {:?}", d.path, d.message, d.help));
        list.collect::<Vec<_>>().join("\n")
    })
}

fn train(text: &str) -> Train {
    match model(text)
        .unwrap_or_else(|said| panic!("{said}\n{text}"))
        .structure
    {
        Structure::Train(train) => train,
        Structure::Reduced(_) => unreachable!("a train was written"),
    }
}

#[track_caller]
fn says(text: &str, wanted: &[&str]) {
    let said = model(text).expect_err("a mistake");
    for word in wanted {
        assert!(said.contains(word), "{said}\nlacks {word}");
    }
}

/// The model of a reference case.
fn written(case: &Value) -> String {
    let name = case["name"].as_str().unwrap();
    let speeds = case["speed_rpm"].as_object().unwrap();
    let is_planetary = name.starts_with("planetary");
    let also = match is_planetary {
        true => format!(", also: {{R: {} rpm}}", speeds["R"]),
        false => String::new(),
    };
    let reference = case["reference"].as_str().unwrap();
    let mut text = format!(
        "reference: {{body: {reference}, speed: {} rpm{also}}}\nbodies:\n",
        case["reference_speed_rpm"]
    );
    for body in speeds.keys() {
        let drag = case["drag"].get(body).map_or(String::new(), |d| {
            format!(
                ", drag: {{constant: {} N m, viscous: {} N m s/rad}}",
                d["constant"], d["per_rad_s"]
            )
        });
        text += &format!("  {body}: {{inertia: 1e-3{drag}}}\n");
    }
    let shape = format!(
        "module: {} m, pressure_angle: {} deg, helix_angle: {} deg",
        case["normal_module"], case["normal_pressure_angle_deg"], case["helix_angle_deg"]
    );
    text += "connections:\n";
    for (mesh, t) in case["teeth"].as_object().unwrap() {
        let wheel = |k: usize| (t[k][0].as_str().unwrap(), &t[k][1]);
        let ((a, za), (b, zb)) = (wheel(0), wheel(1));
        let teeth = format!("teeth: {{{a}: {za}, {b}: {zb}}}, {shape}");
        let is_external = t[2] == "external";
        let geometry = match (is_planetary, is_external) {
            (true, true) => format!("planet_gear: {{sun: {a}, planet: {b}, carrier: C, {teeth}}}"),
            (true, false) => {
                format!("planet_ring: {{ring: {b}, planet: {a}, carrier: C, {teeth}}}")
            }
            (false, true) => format!("gear: {{{teeth}}}"),
            (false, false) => format!("internal_gear: {{{teeth}}}"),
        };
        text += &format!("  {mesh}: {{{geometry}, stiffness: 2e8}}\n");
    }
    if is_planetary {
        text += &format!("balance: [{reference}, R]\n");
    } else {
        text += &format!("balance: {reference}\n");
    }
    text += "loads:\n";
    for (body, torque) in case["load"].as_object().unwrap() {
        text += &format!("  {body}: {{mean: {torque} N m}}\n");
    }
    text
}

#[test]
fn reference_trains() {
    let data: Value = serde_json::from_str(include_str!("../data/kinematics.json")).unwrap();
    let mut balanced = 0;
    for case in data["cases"].as_array().unwrap() {
        let name = &case["name"];
        let train = train(&written(case));
        let motion = train.mean_motion.as_ref().unwrap();
        for (k, body) in train.bodies.keys().enumerate() {
            let exact = &case["speed_ratio_exact"][body];
            assert_eq!(
                motion.ratios[k].to_string(),
                exact.as_str().unwrap(),
                "{name} {body}"
            );
            let (rpm, wanted) = (motion.speed_of(k) * 60.0 / TAU, &case["speed_rpm"][body]);
            let wanted = wanted.as_f64().unwrap();
            assert!(
                (rpm - wanted).abs() <= 1e-9 * (1.0 + wanted.abs()),
                "{name} {body}: {rpm}"
            );
        }
        for (mesh, wanted) in case["meshes"].as_object().unwrap() {
            let connection = &train.connections[mesh];
            let teeth = connection.teeth.as_ref().unwrap();
            let order = motion.order(teeth);
            let hunting = teeth.hunting_order(&order);
            assert_eq!(
                order.to_string(),
                wanted["order_of_reference"].as_str().unwrap()
            );
            assert_eq!(
                hunting.to_string(),
                wanted["hunting_order"].as_str().unwrap()
            );
            for (body, arm) in &connection.arms {
                let body = train.bodies.get_index(*body).unwrap().0;
                let wanted = wanted["lever_arms"][body].as_f64().unwrap();
                assert!(
                    (arm - wanted).abs() <= 1e-9 * wanted.abs(),
                    "{name} {mesh} {body}: {arm}"
                );
            }
        }
        if name != "planetary_ring_turning" {
            let reference = train.balanced[0];
            assert_eq!(reference.0, motion.reference);
            let wanted = case["input_torque"].as_f64().unwrap();
            assert!(
                (reference.1 - wanted).abs() <= 1e-8 * wanted.abs(),
                "{name}: {reference:?}"
            );
            balanced += 1;
        }
    }
    assert_eq!(balanced, 5);
}

/// A pair with teeth; `more` at the top level, `mesh` in the mesh, `load` in the load of A.
fn pair(more: &str, mesh: &str, load: &str) -> String {
    format!(
        "{more}
bodies: {{A: {{inertia: 1e-3}}, B: {{inertia: 2e-3}}}}
connections:
  m:
    gear: {{teeth: {{A: 35, B: 47}}, module: 2 mm, helix_angle: 15 deg}}
    stiffness: 2e8
    element: {{type: backlash, gap: 80 um}}
    {mesh}
damping: {{modal_ratio: 0.03}}
loads: {{A: {{mean: 100, {load}}}, B: {{mean: 134.2857142857143}}}}
"
    )
}

const REFERENCE: &str = "reference: {body: A, speed: 1000 rpm}";

#[test]
fn orders_have_a_common_base() {
    for (load, mesh, revolutions) in [
        ("", "", 1),
        ("harmonics: [{order: 0.5, amplitude: 1}]", "", 2),
        (
            "harmonics: [{order: 35/47, amplitude: 1}, {order: 3/2, amplitude: 1}]",
            "",
            94,
        ),
        ("harmonics: [{order: {shaft: B}, amplitude: 1}]", "", 47),
        (
            "",
            "transmission_error: {harmonics: [{order: mesh, amplitude: 1 um}]}",
            1,
        ),
        (
            "",
            "transmission_error: {harmonics: [{order: {shaft: B, times: 2}, amplitude: 1 um}]}",
            47,
        ),
    ] {
        let train = train(&pair(REFERENCE, mesh, load));
        assert_eq!(train.revolutions, revolutions, "{load} {mesh}");
    }
    let mesh =
        "order_unit: mesh\n    transmission_error: {harmonics: [{order: 2, amplitude: 1 um}]}";
    let train = train(&pair(REFERENCE, mesh, ""));
    let error = train.connections["m"].transmission_error.as_ref().unwrap();
    assert_eq!(error.highest_order(), Some(70));
}

#[test]
fn drawings_measure_backlash_in_three_ways() {
    let gap = |written: &str| {
        let text =
            pair(REFERENCE, "", "").replace("gap: 80 um", &format!("backlash: {{{written}}}"));
        let train = train(&text);
        let connection = &train.connections["m"];
        connection.element.breakpoints()[1]
    };
    let (alpha, beta) = (20.0_f64.to_radians(), 15.0_f64.to_radians());
    let alpha_t = (alpha.tan() / beta.cos()).atan();
    let beta_b = (beta.sin() * alpha.cos()).asin();
    let radius = 2e-3 * 35.0 * alpha_t.cos() / (2.0 * beta.cos());
    for (written, wanted) in [
        ("circumferential: 80 um", 40e-6 * alpha_t.cos()),
        ("normal: 80 um", 40e-6 / beta_b.cos()),
        ("angular: 0.1 deg", 0.05_f64.to_radians() * radius),
    ] {
        let found = gap(written);
        assert!(
            (found - wanted).abs() < 1e-12 * wanted.max(1e-3),
            "{written}: {found}"
        );
    }
}

#[test]
fn mistakes_say_what_is_wrong() {
    let with = |reference: &str| pair(reference, "", "");
    says(
        &with("reference: {body: A, speed: 0 rpm}"),
        &["reference.speed: found 0"],
    );
    says(
        &with("reference: {body: D, speed: 1 rpm}"),
        &["unknown body `D`"],
    );
    says(
        &pair(
            "",
            "transmission_error: {harmonics: [{order: mesh, amplitude: 1 um}]}",
            "",
        ),
        &["`mesh` is the tooth passing order", "reference"],
    );
    says(
        &pair(REFERENCE, "", "").replace("{inertia: 2e-3}", "{inertia: 2e-3, drag: -1}"),
        &["bodies.B.drag: found -1"],
    );
    says(
        &pair("", "", "").replace("{inertia: 2e-3}", "{inertia: 2e-3, drag: 1}"),
        &["bodies.B.drag: opposes the mean rotation", "reference"],
    );
    says(
        &pair("reference: {body: A, speed: 1 rpm}\nbalance: B", "", ""),
        &["loads.B.mean: `balance` computes"],
    );
    says(
        &pair(REFERENCE, "", "")
            .replace(
                "B: {inertia: 2e-3}}",
                "B: {inertia: 2e-3}, X: {inertia: 1}, Y: {inertia: 1}}",
            )
            .replace(
                "damping: {modal",
                "  x: {shaft: [X, Y], stiffness: 1}\ndamping: {modal",
            ),
        &["the speed of `X` does not follow", "also: {X: 0 rpm}"],
    );
    says(
        &pair(REFERENCE, "", "").replace(
            "damping: {modal",
            "  g: {ground: B, stiffness: 1}\ndamping: {modal",
        ),
        &["connections.", "locks the train"],
    );
    says(
        &pair("", "", "").replace(
            "gap: 80 um",
            "backlash: {circumferential: 1 um, normal: 1 um}",
        ),
        &["circumferential and normal"],
    );
}

#[test]
fn planets_of_other_centre_distances_are_named() {
    let text = |z: usize, a: &str| {
        format!(
            "reference: {{body: S, speed: 100 rpm, also: {{R: 0 rpm}}}}
bodies: {{S: {{inertia: 1}}, P: {{inertia: 1}}, R: {{inertia: 1}}, C: {{inertia: 1}}}}
connections:
  s: {{planet_gear: {{sun: S, planet: P, carrier: C, teeth: {{S: 30, P: 21}}, module: 2 mm{a}}}, stiffness: 1e8}}
  r: {{planet_ring: {{ring: R, planet: P, carrier: C, teeth: {{R: {z}, P: 21}}, module: 2 mm{a}}}, stiffness: 1e8}}
"
        )
    };
    assert!(model(&text(72, "")).unwrap().warnings.is_empty());
    let warnings = model(&text(73, "")).unwrap().warnings;
    assert!(
        warnings.iter().any(|w| w.contains("51.0000 mm")
            && w.contains("52.0000 mm")
            && w.contains("profile shifts")),
        "{warnings:?}"
    );
    let warnings = model(&text(73, ", centre_distance: 51.5 mm"))
        .unwrap()
        .warnings;
    assert!(warnings.is_empty(), "{warnings:?}");
}

/// Orders of loads without a common period are for motions over time: the period is that of all others.
#[test]
fn loads_may_have_orders_without_a_common_period() {
    let loads = "harmonics: [{order: 1/9973, amplitude: 1}, {order: 1/7, amplitude: 2}]";
    let train = train(&pair(REFERENCE, "", loads));
    assert_eq!(train.revolutions, 7);
    let free: Vec<f64> = train
        .loads
        .values()
        .flat_map(|load| load.free_orders())
        .collect();
    assert_eq!(free, [1.0 / 9973.0]);
}

/// `planets: 3` against the same set written out: phases of the meshes, and the planets' mass on the carrier.
#[test]
fn planets_are_copied_with_the_phases_of_their_meshes() {
    let head = "reference: {body: S, speed: 100 rad/s, also: {R: 0 rad/s}}\n";
    let geometry = |planet: &str, more: &str| {
        format!(
            "planet_gear: {{sun: S, planet: {planet}, carrier: C, teeth: {{S: 28, {planet}: 26}}, module: 2 mm{more}}}"
        )
    };
    let ring = |planet: &str, more: &str| {
        format!(
            "planet_ring: {{ring: R, planet: {planet}, carrier: C, teeth: {{R: 80, {planet}: 26}}, module: 2 mm{more}}}"
        )
    };
    let rest = |phase: f64| {
        format!(
            "stiffness: 1e8, transmission_error: {{harmonics: [{{order: mesh, amplitude: 1 um, phase: {phase} rad}}, {{order: mesh, amplitude: 2 um}}]}}, \
             stiffness_variation: {{table: [0.9, 1.1, 1.0], order_unit: mesh}}"
        )
    };
    let short = format!(
        "{head}bodies: {{S: {{inertia: 1e-3}}, P: {{inertia: 2e-4, mass: 0.5 kg}}, C: {{inertia: 5e-3}}, R: {{inertia: 1e-2}}}}\n\
         connections:\n  sun: {{{}, {}}}\n  ring: {{{}, {}}}\n  held: {{ground: R, stiffness: 1e5}}\nloads: {{P: {{mean: 0.1}}}}\n",
        geometry("P", ", planets: 3"),
        rest(0.3),
        ring("P", ", planets: 3"),
        rest(0.2),
    );
    let train = train(&short);
    let names: Vec<&str> = train.connections.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "sun_1", "sun_2", "sun_3", "ring_1", "ring_2", "ring_3", "held"
        ]
    );
    assert_eq!(train.loads.len(), 3);
    let radius = 0.5 * 2e-3 * 54.0;
    let carrier = 5e-3 + 3.0 * 0.5 * radius * radius;
    assert!((train.bodies["C"].inertia / carrier - 1.0).abs() < 1e-12);
    let order = train.revolutions as f64 * 28.0 * (1.0 - 28.0 / 108.0);
    for (name, teeth) in [("sun", 28.0), ("ring", 80.0)] {
        let first = &train.connections[&format!("{name}_1")];
        for planet in 1..=3 {
            let own = &train.connections[&format!("{name}_{planet}")];
            // One mesh period of the base phase, and the share that this mesh lags.
            let period = TAU / order;
            let lag = (f64::from(planet - 1) * teeth / 3.0_f64).fract() * period;
            for k in 0..40 {
                let phase = 0.013 * f64::from(k) * period;
                let pairs = [
                    (
                        own.transmission_error.as_ref(),
                        first.transmission_error.as_ref(),
                        1e-18,
                    ),
                    (
                        own.stiffness_variation.as_ref(),
                        first.stiffness_variation.as_ref(),
                        1e-9,
                    ),
                ];
                for (own, first, close) in pairs {
                    let (own, first) =
                        (own.unwrap().value(phase), first.unwrap().value(phase - lag));
                    assert!(
                        (own - first).abs() < close,
                        "{name}_{planet}: {own} {first}"
                    );
                }
            }
        }
    }
    says(
        &short.replace(
            "ring: {planet_ring",
            "also: {shaft: [P, S], stiffness: 10}\n  ring: {planet_ring",
        ),
        &["also", "`P`", "planets: 3"],
    );
    says(
        &short.replace("R: {inertia: 1e-2}", "R: {inertia: 1e-2, mass: 3}"),
        &["bodies.R.mass", "planet"],
    );
}
