//! Laws with memory and rigid stops through the real binary: what is refused and why, and what the tables hold.

use crate::program::Place;

fn model(element: &str, analysis: &str) -> String {
    format!(
        "schema: 1\nreduced:\n  stiffness: [[1, 0.5]]\n  damping: {{matrix: [[0.06]]}}\n  elements:\n    base: {{type: linear}}\n    \
         law: {element}\n  element_map: [[1], [1]]\n  loads: {{mean: [0.2], harmonics: [{{order: 1, cos: [0.25], sin: [0]}}]}}\nanalyses:\n  \
         it: {analysis}\n"
    )
}

const HISTORY: &str = "{type: time_history, at: 0.9, periods: 2, samples_per_period: 8}";

#[test]
fn mistakes_are_named_at_their_place() {
    for (element, parts) in [
        (
            "{type: jenkins, slip_force: -0.1}",
            &["slip_force", ">= 0"][..],
        ),
        ("{type: jenkins}", &["slip_force"]),
        (
            "{type: rigid_stop, half_gap: 1, restitution: 1.2}",
            &["restitution", "0 (plastic) to 1 (elastic)"],
        ),
        (
            "{type: rigid_stop, half_gap: 1, side: positive, restitution: 0.5}",
            &["write `gap` with `side`"],
        ),
        ("{type: rigid_stop, half_gap: 1}", &["restitution"]),
        (
            "{type: clutch, stages: [{to: 0.5, stiffness: 0.1}, {to: 0.4, stiffness: 1}]}",
            &["stages[1].to = 0.4", "stages ascend"],
        ),
        (
            "{type: clutch, stages: [{to: 0.5, stifness: 0.1}, {stiffness: 1}]}",
            &["stages.0", "stifness"],
        ),
        (
            "{type: clutch, drive: [{stiffness: 1}]}",
            &["drive and coast"],
        ),
    ] {
        let place = Place::with(&model(element, HISTORY));
        let ended = place.run(&["check", "m.yaml"]).ends_with(2);
        for part in parts {
            let told = format!("{}{}", ended.out, ended.err);
            assert!(told.contains(part), "{element}: {part} in {told}");
        }
    }
}

#[test]
fn galerkin_refuses_a_stop_and_takes_a_slider() {
    let response = "{type: frequency_response, from: 1.2, to: 1.19}";
    let stop = model(
        "{type: rigid_stop, half_gap: 0.5, restitution: 0.6}",
        response,
    );
    let place = Place::with(&stop);
    place
        .run(&["run", "m.yaml", "--out", "out"])
        .ends_with(2)
        .says(&["law: the velocity jumps at its impacts", "shooting"]);
    let slider = model("{type: jenkins, slip_force: 0.6}", response);
    let place = Place::with(&slider);
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    assert!(place.column("out/it.csv", "energy_lost.law")[0] > 0.0);
}

#[test]
fn initial_memory_is_read_and_wrong_lengths_are_named() {
    let slider = "{type: jenkins, slip_force: 0.6}";
    let with = |memory: &str| {
        HISTORY.replace(
            "at: 0.9",
            &format!("at: 0.9, initial: {{q: [0.1], v: [0], memory: {memory}}}"),
        )
    };
    let place = Place::with(&model(slider, &with("[0.25]")));
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    assert_eq!(place.column("out/it.csv", "z.law")[0], 0.25);
    let place = Place::with(&model(slider, &with("[0.25, 0.1]")));
    let ended = place.run(&["check", "m.yaml"]).ends_with(2);
    assert!(format!("{}{}", ended.out, ended.err).contains("z.law"));
}

#[test]
fn shooting_tells_neutral_multipliers_and_what_impacts_do() {
    let response = "{type: frequency_response, method: shooting, from: 0.4, to: 0.41, tables: all, max_points: 3}";
    let place = Place::with(&model("{type: jenkins, slip_force: 0.6}", response));
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    assert_eq!(place.column("out/it.csv", "neutral")[0], 1.0);
    assert_eq!(place.column("out/it.csv", "stable")[0], 1.0);
    assert!(place.column("out/it.csv", "multiplier_modulus")[0] < 1.0);
    assert_eq!(place.column("out/it.multipliers.csv", "re.1")[0], 1.0);
    let response = response.replace("0.4, to: 0.41", "0.9, to: 0.91");
    let stop = "{type: rigid_stop, gap: 0.5, side: positive, restitution: 0.7}";
    let place = Place::with(&model(stop, &response));
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    assert_eq!(place.column("out/it.csv", "impacts.law")[0], 1.0);
    // The mean of everything that pushes is the load: 0.2 = mean of the spring + 0.5 mean of the stop.
    let [base, law] =
        ["force_mean.base", "force_mean.law"].map(|c| place.column("out/it.csv", c)[0]);
    assert!(
        (base + 0.5 * law - 0.2).abs() < 1e-12 && law > 0.0,
        "{base} {law}"
    );
}

/// A stop that is held carries what the equation of motion leaves: 1 + 0.9 cos 2T for the loose gear on its flank. At rest there are no
/// impacts, and a gear that rattles is not in contact between them.
#[test]
fn held_stops_have_a_force_and_impacts_end_at_once() {
    let gear = |start: &str| {
        format!(
            "schema: 1\nreduced:\n  stiffness: [[1]]\n  damping: {{matrix: [[0]]}}\n  elements:\n    flank: {{type: rigid_stop, gap: 2, side: positive, \
             restitution: 0.7}}\n  loads: {{mean: [1], harmonics: [{{order: 1, cos: [0.9], sin: [0]}}]}}\nanalyses:\n  it: {{type: time_history, at: 2, \
             periods: 4, {start}}}\n"
        )
    };
    let place = Place::with(&gear("initial: {q: [2], v: [0]}"));
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    let times = place.column("out/it.csv", "T");
    let forces = place.column("out/it.csv", "f.flank");
    assert_eq!(times.len(), 801);
    for (t, f) in times.iter().zip(&forces) {
        assert!((f - 1.0 - 0.9 * (2.0 * t).cos()).abs() < 1e-12, "{t} {f}");
    }
    assert_eq!(place.column("out/it.rattle.csv", "impacts"), [0.0]);
    assert_eq!(place.column("out/it.rattle.csv", "contact_ratio"), [1.0]);
    assert_eq!(place.column("out/it.switches.csv", "to"), [1.0]);
    let place = Place::with(&gear("transient: 100, initial: {q: [0.35], v: [0.5]}"));
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    assert!(
        place
            .column("out/it.csv", "f.flank")
            .iter()
            .all(|f| *f == 0.0)
    );
    assert_eq!(place.column("out/it.rattle.csv", "impacts"), [4.0]);
    assert_eq!(place.column("out/it.rattle.csv", "contact_ratio"), [0.0]);
}

/// Stick and slip are switches, not impacts.
#[test]
fn sliders_make_no_impacts() {
    let place = Place::with(&model("{type: jenkins, slip_force: 0.1}", HISTORY));
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    assert!(place.column("out/it.switches.csv", "to").len() > 3);
    assert!(place.column("out/it.impacts.csv", "speed").is_empty());
}

/// Impacts below `least_impact` count neither in a history nor in a run-up, and sums over none are 0.
#[test]
fn faint_impacts_do_not_count() {
    let text = |least: &str, analysis: &str| {
        format!(
            "schema: 1\nbodies:\n  a: {{inertia: 1e-2 kg m^2}}\n  b: {{inertia: 1e-3 kg m^2}}\n  c: {{inertia: 1e-2 kg m^2}}\nconnections:\n  \
             shaft: {{shaft: [a, c], stiffness: 100 N m/rad, damping: 0.05}}\n  stop: {{shaft: [a, b], element: {{type: rigid_stop, half_gap: 2 deg, \
             restitution: 0.8{least}}}}}\nloads:\n  a: {{mean: -0.2 N m, harmonics: [{{order: 1, amplitude: 8 N m}}]}}\n  b: {{mean: 0.2 \
             N m}}\nreference: {{body: a, speed: 60 rad/s}}\nanalyses:\n  it: {analysis}\n"
        )
    };
    let analyses = [
        (
            "{type: time_history, at: 10 Hz, periods: 12}",
            "rattle",
            "impacts_per_s",
            "impact_energy",
        ),
        (
            "{type: run_up, from: 60 rad/s, to: 90 rad/s, duration: 2 s, orders: [1], window: 2}",
            "it",
            "impacts_per_s.stop",
            "impact_energy_per_s.stop",
        ),
    ];
    for (analysis, table, count, energy) in analyses {
        let counts: Vec<[f64; 2]> = ["", ", least_impact: 0.5", ", least_impact: 1e3"]
            .into_iter()
            .map(|least| {
                let place = Place::with(&text(least, analysis));
                place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
                let file = match table {
                    "it" => "out/it.csv".to_owned(),
                    table => format!("out/it.{table}.csv"),
                };
                let total = |name: &str| place.column(&file, name).iter().sum::<f64>();
                assert!(!place.read(&file).contains("-0.0,"), "{analysis}");
                [total(count), total(energy)]
            })
            .collect();
        let [all, some, none] = [counts[0], counts[1], counts[2]];
        assert!(all[0] > some[0] && some[0] > 0.0, "{analysis}: {counts:?}");
        assert!(all[1] > some[1] && some[1] > 0.5 * all[1], "{counts:?}");
        assert_eq!(none, [0.0, 0.0], "{analysis}");
    }
}

/// Also a law without memory has its force curve beside the motion, with names and units; a linear train has nothing to show.
#[test]
fn force_curves_of_clearances_are_drawn() {
    let place = Place::with(&model("{type: backlash, half_gap: 0.2}", HISTORY));
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    let [x, f] = ["q.law", "f.law"].map(|c| place.column("out/it.loops.csv", c));
    for (x, f) in x.iter().zip(&f) {
        let curve = x - x.clamp(-0.2, 0.2);
        assert!((f - curve).abs() < 1e-14, "{x} {f}");
    }
    assert!(f.iter().any(|f| *f != 0.0));
    let panels = &place.json("out/it.json")["drawing"]["figure"]["panels"];
    assert_eq!(panels.as_array().unwrap().len(), 2);
    assert!(place.names("out").contains(&"it.loops.svg".to_owned()));
    let place = Place::with(&model("{type: linear}", HISTORY));
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    assert!(!place.names("out").contains(&"it.loops.csv".to_owned()));
}

/// A slow cycle over the range of a motion has the loop of the closed form, 4 F (A - F/k), and a law without memory none.
#[test]
fn slow_loops_stand_beside_those_in_motion() {
    let place = Place::with(&model("{type: jenkins, slip_force: 0.1}", HISTORY));
    place.run(&["run", "m.yaml", "--out", "out"]).ends_with(0);
    let area = |connection: &str| {
        let [x, f] =
            ["q", "f"].map(|c| place.column("out/it.loops.csv", &format!("{c}.{connection}")));
        let pairs = x.windows(2).zip(f.windows(2));
        let area: f64 = pairs
            .map(|(x, f)| 0.5 * (x[1] - x[0]) * (f[0] + f[1]))
            .sum();
        let (low, high) = x
            .iter()
            .fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
        (area, 0.5 * (high - low))
    };
    let (area_of_law, amplitude) = area("law");
    let expected = 4.0 * 0.1 * (amplitude - 0.1);
    // A corner of the loop lies between two of the 200 steps.
    assert!(
        (area_of_law / expected - 1.0).abs() < 1e-3 && amplitude > 0.2,
        "{area_of_law} {expected}"
    );
    assert!(area("base").0.abs() < 1e-14);
    let panels = &place.json("out/it.json")["drawing"]["figure"]["panels"];
    let curves = |p: &serde_json::Value| p["curves"].as_array().unwrap().len();
    let counts: Vec<usize> = panels.as_array().unwrap().iter().map(curves).collect();
    assert_eq!(counts, [1, 1, 2, 2]);
}
