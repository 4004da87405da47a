//! `confirm`: Galerkin branches judged by the flow.

use crate::program::Place;

/// x'' + 0.1 x' + x + `hardness` max(x - 1, 0) = 0.5 cos wt.
pub fn stiff_stop(hardness: f64, keys: &str) -> String {
    format!(
        "\
schema: 1
name: oscillator with a stiff stop
bodies: {{m1: {{inertia: 1 kg}}}}
connections:
  spring: {{ground: m1, stiffness: 1 N/m, damping: 0.1 N s/m}}
  stop: {{ground: m1, stiffness: {hardness} N/m, element: {{type: one_sided, gap: 1 m}}}}
loads: {{m1: {{harmonics: [{{order: 1, amplitude: 0.5}}]}}}}
scaling: {{frequency: 1 rad/s, length: 1 m}}
report: {{units: nondimensional}}
analyses:
  a: {{type: frequency_response, quadrature: exact, from: 0.4, to: 1.2, {keys}}}
"
    )
}

/// Two masses, a stop a hundred times stiffer than the springs.
fn two_masses(keys: &str) -> String {
    format!(
        "\
schema: 1
name: two masses, unilateral spring
bodies: {{m1: {{inertia: 1 kg}}, m2: {{inertia: 1 kg}}}}
connections:
  c12: {{acts_on: {{m1: 1, m2: -1}}, stiffness: 1 N/m, damping: 0.03 N s/m}}
  ground2: {{ground: m2, stiffness: 1 N/m, damping: 0.03 N s/m}}
  stop: {{ground: m1, stiffness: 100 N/m, element: {{type: one_sided, gap: 1 m}}}}
loads: {{m2: {{harmonics: [{{order: 1, amplitude: 0.1}}]}}}}
scaling: {{frequency: 1 rad/s, length: 1 m}}
report: {{units: nondimensional}}
analyses:
  a: {{type: frequency_response, quadrature: exact, from: 0.8, to: 0.5, {keys}}}
"
    )
}

/// Figure 11 with the keys of its response.
fn figure_11(keys: &str) -> String {
    format!(
        "\
schema: 1
name: figure 11
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {{modal_ratio: 0.05}}
  elements: {{mesh_1: {{type: backlash, half_gap: 1}}, mesh_2: {{type: backlash, half_gap: 0.1}}}}
  loads: {{mean: [0.5, 0.5], harmonics: [{{order: 1, cos: [0.25, 0]}}]}}
analyses:
  a: {{type: frequency_response, from: 2.5, to: 0.55, {keys}}}
"
    )
}

fn run(model: &str) -> Place {
    let place = Place::with(model);
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    place
}

/// Kind and parameter of the events that are located, by kind and parameter.
fn located(place: &Place) -> Vec<(String, f64)> {
    let table = place.table("o/a.events.csv");
    let (parameter, located) = (
        place.column("o/a.events.csv", "parameter"),
        place.column("o/a.events.csv", "located"),
    );
    let rows = (0..parameter.len()).filter(|k| located[*k] == 1.0);
    let mut list: Vec<(String, f64)> = rows
        .map(|k| (table[k + 1][0].clone(), parameter[k]))
        .collect();
    list.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    list
}

#[track_caller]
fn assert_same(found: &[(String, f64)], wanted: &[(String, f64)], tolerance: f64) {
    assert_eq!(found.len(), wanted.len(), "{found:?}\n{wanted:?}");
    for (a, b) in found.iter().zip(wanted) {
        assert!(
            a.0 == b.0 && (a.1 / b.1 - 1.0).abs() < tolerance,
            "{a:?}, wanted {b:?}"
        );
    }
}

/// Multipliers along the exact orbit by matrix exponentials between its switches, and by DOP853 restarted at them: 11 digits.
#[test]
fn stability_at_a_stiff_stop_is_that_of_the_flow() {
    let exact = [
        (0.9, 1.5434516),
        (0.95, 1.2824355),
        (0.97, 1.1206622),
        (1.0, 0.7304027),
        (1.1, 0.7515637),
    ];
    for harmonics in ["40", "{tolerance: 1.0e-3, most: 200}"] {
        let keys = format!("harmonics: {harmonics}, marks: [0.9, 0.95, 0.97, 1.0, 1.1]");
        let place = run(&stiff_stop(1e4, &keys));
        let column = |name: &str| place.column("o/a.csv", name);
        let (omega, stable) = (column("omega"), column("stable"));
        for (at, modulus) in exact {
            let row = omega.iter().position(|w| *w == at).unwrap();
            let found = column("multiplier_modulus")[row];
            assert!((found - modulus).abs() < 1e-6, "{at}: {found}");
            assert_eq!(stable[row], f64::from(u8::from(modulus < 1.0)), "{at}");
        }
        let doublings = located(&place);
        let doublings = doublings
            .iter()
            .filter(|e| e.0 == "period_doubling" && e.1 > 0.72);
        let doublings: Vec<f64> = doublings.map(|e| e.1).collect();
        assert!(doublings.len() == 1 && (doublings[0] - 0.9813869647).abs() < 1e-9);
    }
}

/// DOP853 restarted at switches, with its own variational equation: 12 digits.
#[test]
fn events_of_a_soft_stop_are_those_of_the_flow() {
    for harmonics in [20, 40] {
        let place = run(&two_masses(&format!("harmonics: {harmonics}")));
        let events = located(&place);
        for (kind, low, high, wanted) in [
            (
                "period_doubling",
                0.7,
                0.8,
                vec![0.7387830253732, 0.7555861593561],
            ),
            ("neimark_sacker", 0.6, 0.66, vec![0.6186068742671]),
        ] {
            let here = events
                .iter()
                .filter(|e| e.0 == kind && e.1 > low && e.1 < high);
            let here: Vec<f64> = here.map(|e| e.1).collect();
            assert_eq!(here.len(), wanted.len(), "{harmonics}: {kind} {here:?}");
            for (found, wanted) in here.iter().zip(wanted) {
                assert!((found - wanted).abs() < 1e-9, "{harmonics}: {kind} {found}");
            }
        }
        let omega = place.column("o/a.events.csv", "omega_method");
        let confirmed = place.column("o/a.events.csv", "confirmed");
        // Those that only the flow has stand nowhere on the series' branch.
        for (own, confirmed) in omega.iter().zip(&confirmed) {
            assert!(own.is_finite() || *confirmed == 1.0);
        }
    }
}

/// Whatever the number of harmonics, the events are those of the flow's own branch.
#[test]
fn events_of_figure_11_equal_those_of_shooting() {
    let exact = located(&run(&figure_11("method: shooting, max_step: 0.02")));
    assert!(exact.len() >= 16);
    for keys in ["", "harmonics: 8", "harmonics: 20, quadrature: exact"] {
        let place = run(&figure_11(keys));
        assert_same(&located(&place), &exact, 1e-7);
        let confirmed = place.column("o/a.events.csv", "confirmed");
        assert!(confirmed.iter().all(|c| *c == 1.0) || !keys.is_empty());
        let own = place.column("o/a.events.csv", "omega_method");
        let best = place.column("o/a.events.csv", "omega");
        assert!(own.iter().zip(&best).any(|(a, b)| (a - b).abs() > 1e-7));
    }
}

/// The number of multipliers outside the circle changes where an event is listed, by as much as it says, and nowhere else.
#[test]
fn counts_and_events_agree() {
    for model in [
        figure_11(""),
        figure_11("harmonics: 8"),
        two_masses("harmonics: 20"),
    ] {
        let place = run(&model);
        let points = place.table("o/a.multipliers.csv").len() - 1;
        let counts: Vec<i64> = (0..points)
            .map(|row| {
                let outside = (1..).map_while(|k| {
                    let name = format!("re.{k}");
                    let has = place.table("o/a.multipliers.csv")[0].contains(&name);
                    has.then(|| {
                        let part =
                            |p: &str| place.column("o/a.multipliers.csv", &format!("{p}.{k}"))[row];
                        i64::from(part("re").hypot(part("im")) > 1.0)
                    })
                });
                outside.sum()
            })
            .collect();
        let kinds = place.table("o/a.events.csv");
        let after = place.column("o/a.events.csv", "after_point");
        let located = place.column("o/a.events.csv", "located");
        for k in 1..points {
            let here = (0..after.len()).filter(|e| {
                after[*e] as usize == k - 1 && located[*e] == 1.0 && kinds[e + 1][0] != "grazing"
            });
            let here = here.count();
            let change = (counts[k] - counts[k - 1]).unsigned_abs() as usize;
            assert!(change <= 2 * here, "point {k}: {change} for {here} events");
        }
    }
}

#[test]
fn what_is_confirmed() {
    for (keys, points) in [
        ("", false),
        ("confirm: events", false),
        ("confirm: none", false),
        ("confirm: all", true),
        ("confirm: 4", true),
    ] {
        let place = run(&figure_11(keys));
        let confirmed = place.column("o/a.events.csv", "confirmed");
        assert_eq!(
            confirmed.iter().all(|c| c.is_nan()),
            keys == "confirm: none",
            "{keys}"
        );
        assert_eq!(place.path("o/a.verify.csv").exists(), points, "{keys}");
        let summary = &place.json("o/a.json")["verify"];
        assert_eq!(summary.is_null(), keys == "confirm: none", "{keys}");
        if keys.is_empty() {
            assert!(summary["points"].as_u64().unwrap() >= 10);
        }
    }
    for (keys, part) in [
        ("confirm: all, verify: true", "exclude each other"),
        ("confirm: 0", "every k-th point"),
        ("confirm: every", "every k-th point"),
        (
            "confirm: all, method: shooting",
            "`confirm` confirms points",
        ),
    ] {
        let place = Place::with(&figure_11(keys));
        let ended = place.run(&["run", "m.yaml", "--out", "o"]).ends_with(2);
        ended.says(&["analyses.a", part]);
    }
}

/// A contact that rings at sqrt(400) = 20 above all harmonics.
#[test]
fn too_few_harmonics_are_warned_of() {
    let model = |harmonics: usize| stiff_stop(400.0, &format!("harmonics: {harmonics}"));
    let place = Place::with(&model(12));
    let ended = place.run(&["run", "m.yaml", "--out", "o", "--quiet"]);
    let mut lines = ended.err.lines();
    let warning = lines.find(|l| l.starts_with("warning") && l.contains("too few harmonics"));
    // Twice 20 over the lowest frequency with impacts, about 1/sqrt 2.
    let wanted: f64 = warning
        .and_then(|l| l.split("about ").nth(1))
        .and_then(|l| l.split(' ').next())
        .map(|n| n.parse().unwrap())
        .unwrap_or_else(|| panic!("{}", ended.err));
    assert!((54.0..=58.0).contains(&wanted), "{wanted}");
    let said = "too few harmonics";
    assert!(
        place.json("o/a.json")["warnings"]
            .to_string()
            .contains(said)
    );
    assert!(place.read("o/report.html").contains(said));
    let enough = Place::with(&model(60));
    let ended = enough.run(&["run", "m.yaml", "--out", "o", "--quiet"]);
    assert!(!ended.err.contains(said), "{}", ended.err);
}

/// Nothing is taken through a flow that costs too much, or that is not exact, and the program says so.
#[test]
fn what_is_not_confirmed_says_why() {
    let costly = run(&figure_11("max_steps: 10"));
    let refined = run(&figure_11("integrator: dopri5"));
    for (place, part) in [(&costly, "raise `max_steps`"), (&refined, "dopri5")] {
        let confirmed = place.column("o/a.events.csv", "confirmed");
        assert!(!confirmed.is_empty() && confirmed.iter().all(|c| c.is_nan()));
        for file in ["o/a.json", "o/report.html"] {
            assert!(place.read(file).contains(part), "{file}: {part}");
        }
    }
}
