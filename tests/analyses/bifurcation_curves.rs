//! Curves in two parameters against values of an independent program.

use crate::time_domain_support::*;
use gearlash::report::Report;

/// One mass behind a gap.
pub const ONE: &str = "
schema: 1
reduced:
  stiffness: [[1.0]]
  damping: {matrix: [[0.1]]}
  elements: {m: {type: backlash, half_gap: 1.0}}
  loads: {mean: [0.5], harmonics: [{order: 1, cos: [0.2], sin: [0]}]}
";
pub const QA: &str = "reduced.loads.harmonics.0.cos.0";

fn points(report: &Report) -> Vec<(f64, f64)> {
    let table = main_table(report);
    let (a, b) = (floats(table, "parameter_1"), floats(table, "parameter_2"));
    a.into_iter().zip(b).collect()
}

/// Places of the events of a kind.
pub fn events(report: &Report, kind: &str) -> Vec<(f64, f64)> {
    let table = report.table("events").unwrap();
    let (a, b) = (floats(table, "parameter_1"), floats(table, "parameter_2"));
    let kinds = texts(table, "kind");
    let own = (0..kinds.len()).filter(|k| kinds[*k] == kind);
    own.map(|k| (a[k], b[k])).collect()
}

fn has(list: &[(f64, f64)], at: (f64, f64), near: (f64, f64)) {
    let is_there = |p: &&(f64, f64)| (p.0 - at.0).abs() <= near.0 && (p.1 - at.1).abs() <= near.1;
    assert!(
        list.iter().any(|p| is_there(&p)),
        "{at:?} is not in {list:?}"
    );
}

#[test]
fn grazings_of_the_linear_response_have_a_closed_form() {
    let analysis = format!(
        "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.42, 1.8], [0.03, 1.1]], \
         start: {{kind: grazing, at: {{frequency: 0.7742, {QA}: 0.204}}}}, marks: [0.204, 0.078]}}"
    );
    let report = run(ONE, &analysis);
    let list = points(&report);
    // The amplitude of the linear response equals the mean compression.
    for (w, qa) in &list {
        let closed = 0.5 * ((1.0 - w * w).powi(2) + (0.1 * w).powi(2)).sqrt();
        assert!((qa - closed).abs() < 1e-10, "{w} {qa} {closed}");
    }
    has(&list, (0.77421773052, 0.204), (1e-9, 0.0));
    has(&list, (0.93550126145, 0.078), (1e-9, 0.0));
    let turns = events(&report, "turning_2");
    has(&turns, (0.997496867114, 0.049937460889), (1e-7, 1e-9));
    assert!(list.len() < 120, "{}", list.len());
}

#[test]
fn folds_meet_at_a_cusp() {
    let analysis = format!(
        "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.4, 2], [0.02, 1.2]], \
         start: {{kind: fold, at: {{frequency: 0.94, {QA}: 0.076}}}}}}"
    );
    let report = run(ONE, &analysis);
    has(
        &events(&report, "cusp"),
        (0.969082427114, 0.058611631589),
        (1e-7, 1e-7),
    );
    // The ends lie on the grazing curve of the far flank.
    has(
        &points(&report),
        (0.653340123068, 0.143772163829),
        (1e-5, 1e-5),
    );
    assert_eq!(events(&report, "meets_grazing").len(), 2);
    let confirmed = floats(main_table(&report), "confirmed");
    assert!(confirmed.contains(&1.0) && !confirmed.contains(&0.0));
}

/// From the other end: the same marks, cusps and ends.
#[test]
fn a_curve_started_at_both_ends_gives_the_same_points() {
    let from = |w: f64, qa: f64| {
        let analysis = format!(
            "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.4, 2], [0.02, 1.2]], marks: [0.61, 0.473, 0.3, 0.11], \
             start: {{kind: fold, at: {{frequency: {w}, {QA}: {qa}}}}}}}"
        );
        run(ONE, &analysis)
    };
    let (one, other) = (from(0.489395515049, 0.61), from(0.94, 0.076));
    let marked = |report: &Report| {
        let marks = floats(main_table(report), "mark");
        let all = points(report).into_iter().zip(marks);
        let mut list: Vec<(f64, f64)> = all.filter(|(_, m)| *m == 1.0).map(|(p, _)| p).collect();
        list.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.total_cmp(&b.0)));
        list
    };
    let (a, b) = (marked(&one), marked(&other));
    assert!(a.len() >= 5 && a.len() == b.len(), "{a:?} {b:?}");
    for (p, q) in a.iter().zip(&b) {
        assert!((p.0 - q.0).abs() < 1e-9 && p.1 == q.1, "{p:?} {q:?}");
    }
    for kind in ["cusp", "meets_grazing"] {
        let (a, b) = (events(&one, kind), events(&other, kind));
        assert_eq!(a.len(), b.len(), "{kind}: {a:?} {b:?}");
        let near = if kind == "cusp" { 1e-8 } else { 1e-4 };
        a.iter().for_each(|p| has(&b, *p, (near, near)));
    }
}

/// Beside a spring k = 0.5 whose slider never slips the mesh stays in contact, mean 1.8/1.5, up to an amplitude of 0.2.
#[test]
fn grazings_beside_a_slider_that_holds_have_a_closed_form() {
    let held = "
schema: 1
reduced:
  stiffness: [[1.0, 0.5]]
  damping: {matrix: [[0.1]]}
  elements: {m: {type: backlash, half_gap: 1.0}, s: {type: jenkins, slip_force: 10}}
  element_map: [[1], [1]]
  loads: {mean: [0.8], harmonics: [{order: 1, cos: [0.2], sin: [0]}]}
";
    let closed = |w: f64| 0.2 * ((1.5 - w * w).powi(2) + (0.1 * w).powi(2)).sqrt();
    let analysis = format!(
        "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.6, 2], [0.01, 0.5]], \
         start: {{kind: grazing, connection: m, at: {{frequency: 0.8, {QA}: {}}}}}}}",
        closed(0.8) + 1e-3
    );
    let report = run(held, &analysis);
    let list = points(&report);
    assert!(list.len() > 20, "{:?}", report.ended_early);
    for (w, qa) in &list {
        assert!((qa - closed(*w)).abs() < 1e-9, "{w} {qa} {}", closed(*w));
    }
    let confirmed = floats(main_table(&report), "confirmed");
    assert!(confirmed.contains(&1.0) && !confirmed.contains(&0.0));
}

/// Behind the touching of a stop the motion is another one; the curve is that of the motion before it.
#[test]
fn grazings_of_a_stop_have_a_closed_form() {
    for restitution in [0.7, 0.2] {
        let stop = format!(
            "
schema: 1
reduced:
  stiffness: [[1.0, 1.0]]
  damping: {{matrix: [[0.1]]}}
  elements: {{m: {{type: linear}}, s: {{type: rigid_stop, gap: 1, side: positive, restitution: {restitution}}}}}
  element_map: [[1], [1]]
  loads: {{mean: [0.2], harmonics: [{{order: 1, cos: [0.6], sin: [0]}}]}}
"
        );
        let closed = |w: f64| 0.8 * ((1.0 - w * w).powi(2) + (0.1 * w).powi(2)).sqrt();
        let analysis = format!(
            "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.7, 2], [0.02, 1.2]], \
             start: {{kind: grazing, connection: s, at: {{frequency: 1.5, {QA}: 1.0}}}}}}"
        );
        let report = run(&stop, &analysis);
        let list = points(&report);
        assert!(list.len() > 20, "{:?}", report.ended_early);
        for (w, qa) in &list {
            assert!((qa - closed(*w)).abs() < 1e-9, "{w} {qa} {}", closed(*w));
        }
    }
}

/// The frequency of a grazing curve that leaves the range downwards tends to 0, and its periods to infinity.
#[test]
fn a_curve_ends_before_its_periods_grow_without_bound() {
    let analysis = format!(
        "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.4, 2], [0.02, 1.2]], \
         start: {{kind: grazing, at: {{frequency: 0.499661707279, {QA}: 0.376}}}}}}"
    );
    let report = run(ONE, &analysis);
    assert_eq!(report.ended_early, None);
    has(
        &points(&report),
        (0.4, 0.5 * (0.84_f64.powi(2) + 0.04_f64.powi(2)).sqrt()),
        (1e-12, 1e-10),
    );
}

#[test]
fn isolated_branches_are_born_where_folds_turn() {
    let analysis = format!(
        "{{type: bifurcation_curve, subharmonic: 2, parameters: [frequency, {QA}], ranges: [[1.2, 2], [0.4, 1.6]], \
         start: {{kind: fold, at: {{frequency: 1.662922650572, {QA}: 0.533}}}}, marks: [0.812]}}"
    );
    let report = run(ONE, &analysis);
    has(&points(&report), (1.836239215568, 0.812), (1e-9, 0.0));
    has(
        &events(&report, "turning_2"),
        (1.385478462737, 0.459311514836),
        (1e-6, 1e-9),
    );
    let table = report.table("events").unwrap();
    let (meaning, b) = (texts(table, "meaning"), floats(table, "parameter_2"));
    let birth = (0..b.len()).find(|k| (b[*k] - 0.459311514836).abs() < 1e-6);
    assert_eq!(meaning[birth.unwrap()], "isola_birth");
}

#[test]
fn doublings_and_tori_of_the_pair() {
    let of = |kind: &str, at: (f64, f64), marks: &str| {
        let analysis = format!(
            "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.8, 2.4], [0.03, 0.6]], \
             start: {{kind: {kind}, at: {{frequency: {}, {QA}: {}}}}}, marks: [{marks}]}}",
            at.0, at.1
        );
        run(PAIR, &analysis)
    };
    let doubling = of("period_doubling", (1.95, 0.4), "");
    has(
        &events(&doubling, "turning_1"),
        (1.952327987843, 0.389459598705),
        (1e-9, 1e-6),
    );
    let torus = of("neimark_sacker", (1.2660751289, 0.25), "0.25");
    has(&points(&torus), (1.266075129, 0.25), (1e-8, 0.0));
    has(
        &events(&torus, "turning_1"),
        (1.300056004937, 0.199374067634),
        (1e-9, 1e-6),
    );
}

/// A Neimark-Sacker curve has a corner where mesh 2 touches its far flank: from both sides of it at one place, which is that of the grazing
/// curve. On one side of it the curve is a straight line, because the gap only shifts the deformation; on the other one the frequency
/// changes, and the curve does not go back on itself. The place is where the far flank is passed in the quiet range of an independent program.
#[test]
fn a_curve_meets_a_grazing_at_one_place_from_every_start() {
    let of = |gap: f64| {
        let analysis = format!(
            "{{type: bifurcation_curve, confirm: none, parameters: [frequency, reduced.elements.mesh_2.half_gap], \
             ranges: [[1.2, 1.35], [0.05, 0.3]], max_step: 0.1, \
             start: {{kind: neimark_sacker, at: {{frequency: 1.2660751289, reduced.elements.mesh_2.half_gap: {gap}}}}}}}"
        );
        run(PAIR, &analysis)
    };
    let mut places = Vec::new();
    for gap in [0.09, 0.25] {
        let report = of(gap);
        assert_eq!(report.ended_early, None);
        let all = points(&report);
        let (line, rest): (Vec<_>, Vec<_>) =
            all.iter().partition(|p| (p.0 - 1.2660751289).abs() < 1e-9);
        let is_monotone = |list: &[f64]| {
            let falls = list.windows(2).filter(|w| w[1] < w[0]).count();
            falls == 0 || falls + 1 == list.len()
        };
        let (gaps, frequencies): (Vec<f64>, Vec<f64>) = (
            line.iter().map(|p: &(f64, f64)| p.1).collect(),
            rest.iter().map(|p: &(f64, f64)| p.0).collect(),
        );
        assert!(gaps.len() > 3 && is_monotone(&gaps), "{gaps:?}");
        assert!(is_monotone(&frequencies), "{frequencies:?}");
        let list = events(&report, "meets_grazing");
        assert_eq!(list.len(), 1, "{list:?}");
        places.push(list[0]);
    }
    has(&places, (1.266075128924, 0.076065474044), (1e-9, 1e-9));
    let gap = (places[0].1 - places[1].1).abs();
    assert!(gap < 1e-10, "{places:?}");
}

/// A doubling and a grazing cross where branches at fixed loads beside it have both at one frequency: extrapolated from loads at which they
/// are apart, they meet at 0.15357367274.
#[test]
fn a_doubling_meets_a_grazing_where_branches_have_both() {
    let analysis = format!(
        "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {QA}], ranges: [[1.7, 2.0], [0.14, 0.2]], \
         start: {{kind: period_doubling, at: {{frequency: 1.7746641994, {QA}: 0.1538}}}}}}"
    );
    let report = run(PAIR, &analysis);
    let list = events(&report, "meets_grazing");
    assert_eq!(list.len(), 1, "{list:?}");
    assert!((list[0].1 - 0.15357367274).abs() < 1e-9, "{list:?}");
    assert!((list[0].0 - 1.77403595665).abs() < 1e-9, "{list:?}");
}

#[test]
fn a_curve_starts_at_an_event_of_an_analysis() {
    let analyses = format!(
        "  fr: {{type: frequency_response, method: shooting, from: 2.1, to: 1.7}}
  it: {{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[1.6, 2.4], [0.2, 0.3]], start: {{analysis: fr, kind: period_doubling, near: 1.92}}, marks: [0.25]}}"
    );
    let reports = run_with(PAIR, &analyses, 1, &Quiet);
    let report = reports.iter().find(|r| r.name == "it").unwrap();
    has(&points(report), (1.920117875889, 0.25), (1e-9, 0.0));
}

#[test]
fn a_number_that_only_shifts_a_coordinate_makes_a_straight_line() {
    let path = "reduced.elements.mesh_2.half_gap";
    let analysis = format!(
        "{{type: bifurcation_curve, parameters: [frequency, {path}], ranges: [[0.8, 2.4], [0.05, 0.486]], \
         start: {{kind: period_doubling, at: {{frequency: 1.920117875889, {path}: 0.05}}}}, marks: [0.274]}}"
    );
    let report = run(PAIR, &analysis);
    for (w, _) in points(&report) {
        assert!((w - 1.920117875889).abs() < 1e-9, "{w}");
    }
    has(&points(&report), (1.920117875889, 0.274), (1e-9, 0.0));
    assert_eq!(
        events(&report, "turning_1").len() + events(&report, "turning_2").len(),
        0
    );
}

#[test]
fn mistakes_are_named() {
    let of = |more: &str| {
        refusal(
            PAIR,
            &format!("{{type: bifurcation_curve, ranges: [[0.8, 2.4], [0.03, 0.6]], {more}}}"),
        )
    };
    let start = format!("start: {{kind: fold, at: {{frequency: 1.2, {QA}: 0.2}}}}");
    let same = of(&format!("parameters: [{QA}, {QA}], at: 1, {start}"));
    assert!(same.contains("are the same number"), "{same}");
    let far = of(&format!(
        "parameters: [frequency, {QA}], start: {{kind: fold, at: {{frequency: 3, {QA}: 0.2}}}}"
    ));
    assert!(far.contains("3 lies outside the range"), "{far}");
    let missing = of(&format!(
        "parameters: [frequency, {QA}], start: {{analysis: nope, kind: fold}}"
    ));
    assert!(
        missing.contains("no analysis is called `nope`"),
        "{missing}"
    );
    let gap = refusal(
        PAIR,
        &format!(
            "{{type: bifurcation_curve, parameters: [frequency, mesh_2.half_gap], ranges: [[0.8, 2.4], [-0.1, 0.6]], {start}}}"
        ),
    );
    assert!(gap.contains("ranges.1.0") && gap.contains(">= 0"), "{gap}");
}

#[test]
fn a_start_that_is_no_such_event_ends_early_with_the_reason() {
    let analysis = format!(
        "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[2.2, 2.4], [0.03, 0.1]], \
         start: {{kind: period_doubling, at: {{frequency: 2.3, {QA}: 0.05}}}}}}"
    );
    let report = run(PAIR, &analysis);
    let reason = report.ended_early.clone().unwrap();
    assert!(reason.contains("is near a period doubling"), "{reason}");
    assert_eq!(main_table(&report).rows(), 0);
}

/// At the grazing of the linear response another orbit rattles (a start in 21 of 22 ends there): `initial` tells them apart.
#[test]
fn a_state_says_which_orbit_has_the_event() {
    let (w, qa) = (0.77421773052_f64, 0.204);
    let curve = |initial: &str| {
        format!(
            "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.7, 0.85], [0.15, 0.25]], \
             start: {{kind: grazing, at: {{frequency: {w}, {QA}: {qa}}}, initial: {initial}}}}}"
        )
    };
    // q = b + mean + Qa Re(e^(iT) / (1 - w^2 + 0.1 i w)), a little beside it.
    let (real, imaginary) = (1.0 - w * w, 0.1 * w);
    let size = real * real + imaginary * imaginary;
    let (q, v) = (1.5 + qa * real / size, qa * w * imaginary / size);
    let touching = run(
        ONE,
        &curve(&format!("{{q: [{}], v: [{}]}}", q + 1e-3, v - 1e-3)),
    );
    has(&points(&touching), (w, qa), (1e-9, 1e-9));
    let rattling = run(ONE, &curve("{q: [-0.2645], v: [0.5846]}"));
    let reason = rattling.ended_early.clone().unwrap();
    assert!(reason.contains("none of 1 periodic orbits"), "{reason}");
    assert_eq!(main_table(&rattling).rows(), 0);
    let alone = refusal(
        ONE,
        &format!(
            "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.7, 0.85], [0.15, 0.25]], \
             start: {{analysis: other, kind: grazing, initial: {{q: [1], v: [0]}}}}}}"
        ),
    );
    assert!(
        alone.contains("start.initial") && alone.contains("`at`"),
        "{alone}"
    );
}

#[test]
fn a_curve_goes_on_from_a_saved_point() {
    let folder = tempfile::tempdir().unwrap();
    let first = format!(
        "  one: {{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.5, 1.4], [0.03, 0.3]], \
         start: {{kind: grazing, at: {{frequency: 0.7742, {QA}: 0.204}}}}}}"
    );
    let study = load(ONE, &first, folder.path()).unwrap();
    let settings = gearlash::study::RunSettings {
        out: folder.path().join("out"),
        figures: vec![],
        jobs: 1,
    };
    study.run(&settings, &Quiet).unwrap();
    let analysis = format!(
        "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.5, 1.4], [0.03, 0.3]], marks: [0.078], \
         start: {{results: \"{}\", analysis: one, point: 3, kind: grazing}}}}",
        settings.out.display()
    );
    let report = run(ONE, &analysis);
    has(&points(&report), (0.93550126145, 0.078), (1e-9, 0.0));
    let lost = refusal(ONE, &analysis.replace("point: 3", "point: 3000"));
    assert!(lost.contains("no point 3000 of branch 0"), "{lost}");
}
