//! Default runs list the events of the flow, which shooting in small steps finds without the series: none is missing on either side.

use crate::time_domain_support::{floats, texts};
use gearlash::model::Model;
use gearlash::report::Report;
use gearlash::serde_json::{Value, json};

/// Largest difference of an event, relative to its place.
const SAME: f64 = 1e-6;

/// Located events: kind with connection, multiplicity, and parameter; nothing may be unresolved.
fn located(report: &Report) -> Vec<(String, f64, f64)> {
    let table = report.table("events").unwrap();
    let (kinds, connections) = (texts(table, "kind"), texts(table, "connection"));
    let [at, located, multiplicity] =
        ["parameter", "located", "multiplicity"].map(|name| floats(table, name));
    assert!(!kinds.contains(&"unresolved".to_string()), "{kinds:?}");
    let rows = (0..kinds.len()).filter(|k| located[*k] == 1.0);
    rows.map(|k| {
        let kind = format!("{} {}", kinds[k], connections[k]);
        (kind, multiplicity[k], at[k])
    })
    .collect()
}

/// Compares the two runs of a response of a model; returns the number of events.
fn compare(model: &Model, analysis: &str) -> usize {
    let mut tree = model.to_tree();
    let settings = tree["analyses"][analysis].as_object_mut().unwrap();
    settings.remove("methods");
    let run = |tree: &Value| Model::from_tree(tree).unwrap().run(analysis).unwrap();
    let by_default = located(&run(&tree));
    let settings = tree["analyses"][analysis].as_object_mut().unwrap();
    for (key, value) in [
        ("method", json!("shooting")),
        ("max_step", json!(0.005)),
        ("max_points", json!(100_000)),
    ] {
        settings.insert(key.into(), value);
    }
    let mut left = located(&run(&tree));
    for (kind, multiplicity, at) in &by_default {
        let gap = |other: f64| (other / at - 1.0).abs();
        let alike = (0..left.len()).filter(|k| (&left[*k].0, left[*k].1) == (kind, *multiplicity));
        let nearest = alike.min_by(|i, j| gap(left[*i].2).total_cmp(&gap(left[*j].2)));
        let nearest = nearest.filter(|k| gap(left[*k].2) <= SAME);
        let k = nearest.unwrap_or_else(|| panic!("{analysis}: only by default: {kind} at {at}"));
        left.remove(k);
    }
    assert!(left.is_empty(), "{analysis}: only by shooting: {left:?}");
    by_default.len()
}

fn shipped(file: &str, analysis: &str, events: usize) {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let model = Model::load(folder.join(file)).unwrap();
    assert_eq!(compare(&model, analysis), events);
}

/// Makes a model of the mechanics, with a response.
fn complete(tree: &mut Value, (from, to): (f64, f64)) {
    tree["schema"] = json!(1);
    tree["name"] = json!("response");
    tree["analyses"] = json!({ "a": { "type": "frequency_response", "from": from, "to": to } });
}

fn response(mut tree: Value, range: (f64, f64), least: usize) {
    complete(&mut tree, range);
    let count = compare(&Model::from_tree(&tree).unwrap(), "a");
    assert!(count >= least, "{count} events");
}

/// A default run lists an event.
fn has(tree: &Value, analysis: &str, (kind, at): (&str, f64)) {
    let found = located(&Model::from_tree(tree).unwrap().run(analysis).unwrap());
    let is_it = |e: &(String, f64, f64)| e.0 == kind && (e.2 / at - 1.0).abs() <= SAME;
    assert!(found.iter().any(is_it), "{found:?}");
}

/// Two meshes with clearances 1 and b_2, the first one loaded.
fn pair(zeta: f64, gap: f64, mean: [f64; 2], (order, cos): (usize, f64)) -> Value {
    json!({ "reduced": {
        "stiffness": [[2, 1], [1, 2]],
        "damping": { "modal_ratio": zeta },
        "elements": {
            "mesh_1": { "type": "backlash", "half_gap": 1.0 },
            "mesh_2": { "type": "backlash", "half_gap": gap },
        },
        "loads": { "mean": mean, "harmonics": [{ "order": order, "cos": [cos, 0], "sin": [0, 0] }] },
    } })
}

#[test]
fn of_shipped_models() {
    shipped("grounded_oscillator.yaml", "response", 4);
    shipped("bilinear_stop.yaml", "resonance", 10);
    shipped("rack_drive.yaml", "light_cut", 4);
}

/// A fold 1.4e-5 behind a grazing: its two arms lie closer together than the series and the flow. Its place is that of shooting with
/// `max_step: 0.005`.
#[test]
fn behind_a_grazing() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let model = Model::load(folder.join("reverse_idler.yaml")).unwrap();
    let mut tree = model.to_tree();
    tree["analyses"]["fig_12"]["to"] = json!(0.415);
    has(&tree, "fig_12", ("fold ", 0.419_121_549_332_9));
}

/// A period doubling and a fold 3e-5 apart behind a grazing: the counts beside them are those of no event at all.
#[test]
fn that_cancel_between_two_points() {
    let model = pair(0.0397, 0.3117, [0.365, 0.628], (1, 0.1963));
    response(model, (2.5, 0.45), 33);
}

/// A load of order 2: the orbit of half the period loses its stability beside folds of the same multiplier. The place is that of
/// shooting with `max_step: 0.005`.
#[test]
fn of_a_load_of_order_two() {
    let mut tree = pair(0.049, 0.4746, [0.567, 0.357], (2, 0.1522));
    complete(&mut tree, (1.25, 0.2495));
    has(&tree, "a", ("branch_point ", 0.249_733_163_312_58));
}

/// A stop so stiff that twelve harmonics show events that are not there, at points without an orbit.
#[test]
fn where_the_series_is_poor() {
    let stop = json!({ "ground": "m1", "stiffness": "143.05 N/m", "element": { "type": "one_sided", "gap": "0.726 m" } });
    let spring = json!({ "ground": "m1", "stiffness": "1 N/m", "damping": "0.1466 N s/m" });
    let model = json!({
        "bodies": { "m1": { "inertia": "1 kg" } },
        "connections": { "spring": spring, "stop": stop },
        "loads": { "m1": { "harmonics": [{ "order": 1, "amplitude": 0.462 }] } },
        "scaling": { "frequency": "1 rad/s", "length": "1 m" },
        "report": { "units": "nondimensional" },
    });
    response(model, (2.061, 0.698), 3);
}

/// Events of a response to a load of an order, none of them refuted, with that order times their parameter; branch points of an even
/// order are the period doublings of the first one.
fn events_of_order(
    model: &dyn Fn(usize) -> Value,
    order: usize,
    method: &str,
) -> Vec<(String, f64)> {
    let (mut tree, scale) = (model(order), order as f64);
    complete(&mut tree, (2.5 / scale, 0.45 / scale));
    tree["analyses"]["a"]["method"] = json!(method);
    let report = Model::from_tree(&tree).unwrap().run("a").unwrap();
    let known = floats(report.table("events").unwrap(), "located");
    assert!(known.iter().all(|x| *x == 1.0), "order {order}, {method}");
    let mut list: Vec<(String, f64)> = located(&report)
        .into_iter()
        .map(|(kind, _, at)| match order % 2 {
            0 => (kind.replace("branch_point", "period_doubling"), at * scale),
            _ => (kind, at * scale),
        })
        .collect();
    list.sort_by(|a, b| a.1.total_cmp(&b.1));
    list
}

/// The order in which an excitation is given changes nothing: the orbit repeats itself as often as the load does, and where others
/// branch off the response to orders 2 and 3 is as regular as that to order 1. Events by shooting, the series and the flow behind it.
#[test]
fn of_every_order() {
    type Cases<'c> = (&'c dyn Fn(usize) -> Value, &'c [(usize, &'c str)]);
    let folds = |order| pair(0.0529, 0.2556, [0.531, 0.382], (order, 0.3127));
    let pairs = |order| pair(0.049, 0.4746, [0.567, 0.357], (order, 0.1522));
    let cases: [Cases<'_>; 2] = [
        (&folds, &[(1, "galerkin"), (2, "galerkin"), (3, "shooting")]),
        (&pairs, &[(1, "galerkin"), (2, "shooting")]),
    ];
    for (model, others) in cases {
        let first = events_of_order(model, 1, "shooting");
        assert!(first.len() > 40, "{first:?}");
        for (order, method) in others {
            let list = events_of_order(model, *order, method);
            let kinds =
                |list: &[(String, f64)]| list.iter().map(|e| e.0.clone()).collect::<Vec<_>>();
            assert_eq!(kinds(&list), kinds(&first), "order {order}, {method}");
            for (a, b) in list.iter().zip(&first) {
                assert!(
                    (a.1 / b.1 - 1.0).abs() <= SAME,
                    "order {order}, {method}: {a:?} {b:?}"
                );
            }
        }
    }
}

/// Two folds 6e-8 apart, with a grazing between them.
#[test]
fn nearer_to_each_other_than_the_methods() {
    let model = pair(0.0331, 0.1427, [0.421, 0.66], (1, 0.2493));
    response(model, (2.5, 0.45), 63);
}

/// A branch point of the halves of the period beside a fold, whose multiplier is near 1: one event of both methods.
#[test]
fn beside_another_multiplier_near_one() {
    let model = pair(0.0532, 0.1396, [0.557, 0.679], (2, 0.1582));
    response(model, (1.25, 0.38), 8);
}

/// A branch of orbits of half the response period, begun where orbits of the whole one have branched off: it does not begin with an event.
#[test]
fn behind_the_first_point() {
    let mut tree = pair(0.0461, 0.4857, [0.688, 0.316], (1, 0.2519));
    complete(&mut tree, (0.696, 1.2));
    tree["analyses"]["a"]["subharmonic"] = json!(2);
    for method in ["galerkin", "shooting"] {
        tree["analyses"]["a"]["method"] = json!(method);
        let found = located(&Model::from_tree(&tree).unwrap().run("a").unwrap());
        assert!(
            found.len() > 3 && found.iter().all(|e| e.2 > 0.697),
            "{method}: {found:?}"
        );
    }
}

/// Two equal meshes that do not act on each other turn together.
#[test]
fn of_equal_parts() {
    let unit = json!([[1, 0], [0, 1]]);
    let mesh = json!({ "type": "backlash", "half_gap": 1.0 });
    let mut tree = json!({ "reduced": {
        "stiffness": unit,
        "damping": { "matrix": [[0.064, 0], [0, 0.064]] },
        "elements": { "mesh_1": mesh, "mesh_2": mesh },
        "loads": { "mean": [0.333, 0.333], "harmonics": [{ "order": 1, "cos": [0.154, 0.154], "sin": [0, 0] }] },
    } });
    complete(&mut tree, (2.3, 0.45));
    assert_eq!(compare(&Model::from_tree(&tree).unwrap(), "a"), 12);
}

/// Two period doublings that only the series has are no events: they are listed apart, with a warning.
#[test]
fn refuted_by_the_flow() {
    let mut tree = pair(0.0599, 0.1385, [0.382, 0.54], (1, 0.1614));
    complete(&mut tree, (2.5, 0.45));
    let model = Model::from_tree(&tree).unwrap();
    assert_eq!(compare(&model, "a"), 51);
    let report = model.run("a").unwrap();
    let of = |table: &str, column: &str| floats(report.table(table).unwrap(), column);
    assert!(of("events", "confirmed").iter().all(|x| *x == 1.0));
    assert_eq!(of("refuted", "confirmed"), [0.0, 0.0]);
    assert_eq!(report.summary["refuted"].as_array().map(Vec::len), Some(2));
    let is_told = |w: &String| w.contains("the flow refutes 2 of 53 events (2 period_doubling)");
    assert!(report.warnings.iter().any(is_told), "{:?}", report.warnings);
}
