//! Basins against labels of an independent program, and the same bits for any number of threads.

use crate::common::reference;
use crate::time_domain_support::*;
use gearlash::analysis::Control;
use std::sync::atomic::{AtomicUsize, Ordering};

fn model(p: &serde_json::Value) -> String {
    let number = |key: &str| p[key].as_f64().unwrap();
    format!(
        "
schema: 1
reduced:
  stiffness: [[1.0]]
  damping: {{matrix: [[{}]]}}
  elements: {{m: {{type: backlash, half_gap: {}}}}}
  loads: {{mean: [{}], harmonics: [{{order: 1, cos: [{}], sin: [0]}}]}}
",
        2.0 * number("zeta"),
        number("b"),
        number("Qm"),
        number("Qa")
    )
}

#[test]
fn labels_and_shares_are_those_of_an_independent_program() {
    for case in reference("basins_one_dof")["cases"].as_array().unwrap() {
        let p = &case["parameters"];
        let (x, v) = (&case["box"]["x"], &case["box"]["v"]);
        let analysis = format!(
            "{{type: basins, at: {}, grid: {{q.m: {{from: {}, to: {}, points: 41}}, v.m: {{from: {}, to: {}, points: 41}}}}}}",
            p["omega"], x[0], x[1], v[0], v[1]
        );
        let report = run(&model(p), &analysis);
        let attractors = report.table("attractors").unwrap();
        let (q, v) = (floats(attractors, "q.m"), floats(attractors, "v.m"));
        let shares = floats(attractors, "share");
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        // Numbers of the independent program.
        let wanted: Vec<i64> = (q.iter().zip(&v))
            .map(|(q, v)| {
                let own = case["attractors"].as_array().unwrap().iter().find(|a| {
                    a["fixed_point"].as_array().unwrap().iter().any(|x| {
                        (x[0].as_f64().unwrap() - q).abs() + (x[1].as_f64().unwrap() - v).abs()
                            < 1e-9
                    })
                });
                own.unwrap()["label"].as_i64().unwrap()
            })
            .collect();
        assert_eq!(wanted.len(), case["attractors"].as_array().unwrap().len());
        let cells = floats(main_table(&report), "attractor");
        let mut compared = 0;
        for (i, row) in case["rows"].as_array().unwrap().iter().enumerate() {
            for (j, label) in row.as_str().unwrap().chars().enumerate() {
                let doubt = case["uncertain"][i]
                    .as_str()
                    .map(|r| r.as_bytes()[j] == b'1');
                let doubt = doubt.unwrap_or_else(|| case["uncertain"][i][j] == 1);
                if !doubt {
                    let own = wanted[cells[41 * i + j] as usize - 1];
                    assert_eq!(own, label.to_digit(10).unwrap() as i64, "{i} {j}");
                    compared += 1;
                }
            }
        }
        assert!(compared > 600, "{compared}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let analysis = "  it: {type: basins, at: 1.03, transient: 60, periods: 60, limit: 400, grid: {q.mesh_1: {from: -1, to: 2, points: 7}, v.mesh_2: {from: -1, to: 1, points: 6}}, box: {q.mesh_1: [0, 1]}}";
    let one = run_with(PAIR, analysis, 1, &Quiet).remove(0);
    let three = run_with(PAIR, analysis, 3, &Quiet).remove(0);
    for (a, b) in one.tables.iter().zip(&three.tables) {
        assert_eq!(format!("{a:?}"), format!("{b:?}"));
    }
    assert_eq!(main_table(&one).rows(), 42);
    let labels = texts(one.table("attractors").unwrap(), "label");
    assert!(labels.iter().all(|l| l != "undecided"), "{labels:?}");
}

/// Distances and shares in the box, made again from the grid and the points of the attractors.
#[test]
fn integrity_is_that_of_the_grid() {
    let cases = reference("basins_one_dof");
    let several = |c: &&serde_json::Value| c["attractors"].as_array().unwrap().len() > 1;
    let case = cases["cases"].as_array().unwrap().iter().find(several);
    let p = &case.unwrap()["parameters"];
    let (low, high) = (-0.5, 1.6);
    let analysis = format!(
        "{{type: basins, at: {}, grid: {{q.m: {{from: -4, to: 4, points: 31}}, v.m: {{from: -4, to: 4, points: 29}}}}, \
         box: {{q.m: [{low}, {high}]}}}}",
        p["omega"]
    );
    let report = run(&model(p), &analysis);
    let cells = main_table(&report);
    let (q, v, own) = (
        floats(cells, "q.m"),
        floats(cells, "v.m"),
        floats(cells, "attractor"),
    );
    let points = report.table("points").unwrap();
    let (pq, pv) = (floats(points, "q.m"), floats(points, "v.m"));
    let number = floats(points, "attractor");
    let attractors = report.table("attractors").unwrap();
    let (distance, share) = (
        floats(attractors, "distance"),
        floats(attractors, "share_in_box"),
    );
    assert!(distance.len() > 1);
    for k in 0..distance.len() {
        let is_own = |n: f64| n == (k + 1) as f64;
        let nearest = (0..number.len())
            .filter(|p| is_own(number[*p]))
            .flat_map(|p| {
                let others = (0..own.len()).filter(|c| !is_own(own[*c]));
                others.map(move |c| (p, c))
            });
        let gaps = nearest.map(|(p, c)| (pq[p] - q[c]).hypot(pv[p] - v[c]));
        let least = gaps.fold(f64::INFINITY, f64::min);
        assert!(
            (distance[k] - least).abs() < 1e-12,
            "{k}: {} {least}",
            distance[k]
        );
        let inside: Vec<usize> = (0..q.len())
            .filter(|c| (low..=high).contains(&q[*c]))
            .collect();
        let mine = inside.iter().filter(|c| is_own(own[**c])).count();
        assert!(
            (share[k] - mine as f64 / inside.len() as f64).abs() < 1e-12,
            "{k}"
        );
    }
}

struct After(AtomicUsize);

impl Control for After {
    fn is_interrupted(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed) > 3000
    }
}

#[test]
fn an_interruption_keeps_the_starts_that_were_followed() {
    let analysis = "  it: {type: basins, at: 1.03, grid: {q.mesh_1: {from: -1, to: 2, points: 40}, v.mesh_1: {from: -1, to: 1, points: 40}}}";
    let report = run_with(PAIR, analysis, 1, &After(AtomicUsize::new(0))).remove(0);
    let rows = main_table(&report).rows();
    assert!(rows < 1600);
    assert_eq!(
        report.ended_early.unwrap(),
        format!("interrupted after {rows} of 1600 starts")
    );
}
