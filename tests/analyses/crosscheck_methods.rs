//! Every model in `models/` under the Galerkin method, shooting and integration: where a response of period 1 is stable, the
//! three give the same orbit.

use crate::response_support::*;
use crate::time_domain_support::*;
use gearlash::analysis::Control;
use gearlash::model::Structure;
use gearlash::numeric::periodic::Periodic;
use gearlash::report::{Report, Table};
use gearlash::study::Study;
use gearlash::system::System;
use std::path::{Path, PathBuf};

/// Frequencies over the first natural frequency: below, between and above resonances, no simple ratios.
const RATIOS: [f64; 5] = [0.37, 0.58, 0.83, 1.37, 2.3];
/// Agreements wanted of every model.
const WANTED: usize = 3;
/// Integration against shooting. Points of an attractor labelled `period 1` repeat to 1e-6, and the multipliers turn that
/// into a distance from the orbit of the same order; DOPRI5 keeps 1e-10 a step.
const INTEGRATED: f64 = 1e-6;
/// Galerkin against shooting: truncation. Forces with kinks converge like H^-2 in their extrema and contact ratios.
const TRUNCATED: f64 = 1e-2;
/// States further apart than this belong to attractors that coexist.
const ELSEWHERE: f64 = 3e-2;

/// Models of motions over time: torques that are functions of time, meshes that pass far above the firing order.
const TRANSIENT: [&str; 4] = [
    "idle_rattle",
    "idle_rattle_map",
    "planetary_hybrid",
    "tip_in",
];

fn models() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let entries = std::fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut list: Vec<PathBuf> = paths
        .filter(|p| p.extension().is_some_and(|e| e == "yaml"))
        .filter(|p| {
            TRANSIENT
                .iter()
                .all(|name| p.file_stem().is_some_and(|stem| stem != *name))
        })
        .collect();
    list.sort();
    list
}

/// Harmonics at most: a mode so much faster than the excitation does not ring to a visible degree.
const MOST: usize = 160;

/// Harmonics: two dozen of the fastest excitation, and enough for the ringing of the fastest mode after an impact.
fn harmonics(study: &Study, ratio: f64) -> usize {
    let system: &System = &study.assembly.system;
    let modes = &study.assembly.natural_frequencies;
    let ringing = 4.0 * modes[modes.len() - 1] / (ratio * modes[0]);
    let order = |series: &Periodic| match series {
        Periodic::Fourier { harmonics, .. } => harmonics.iter().map(|h| h.order).max().unwrap_or(1),
        Periodic::Table { base_order, .. }
        | Periodic::Uneven { base_order, .. }
        | Periodic::Rectangular { base_order, .. } => *base_order,
    };
    let mounts = system.mounts().iter();
    let own = mounts.flat_map(|m| m.stiffness_variation.iter().chain(&m.transmission_error));
    let all = own.chain(system.loads().iter().map(|l| &l.series));
    let forced = 24 * all.map(order).max().unwrap_or(1);
    forced.max((ringing.ceil() as usize).min(MOST))
}

fn response(path: &Path, study: &Study, ratio: f64) -> Report {
    let (unit, factor) = match study.model.structure {
        Structure::Train(_) => (" rad/s", study.assembly.scales.frequency),
        Structure::Reduced(_) => ("", 1.0),
    };
    let omega = ratio * study.assembly.natural_frequencies[0] * factor;
    let text = format!(
        "analyses.crosscheck={{type: frequency_response, methods: [galerkin, shooting, integration], \
         from: {:?}{unit}, to: {:?}{unit}, marks: [{omega:?}{unit}], points: 2, transient: 400, periods: 12, \
         harmonics: {}, orbits: marks}}",
        1.01 * omega,
        0.99 * omega,
        harmonics(study, ratio)
    );
    let study = Study::load(path, &[text], &["crosscheck".into()])
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    study.reports(&Quiet as &dyn Control).unwrap().remove(0)
}

/// Row of the mark by one method.
fn row(table: &Table, method: &str) -> Option<usize> {
    let methods = texts(table, "method");
    marked(table).into_iter().find(|k| methods[*k] == method)
}

/// What the three methods say at a mark: nothing where the response is not stable with period 1; else the gaps between
/// integration and shooting, and Galerkin and shooting.
fn compare(report: &Report) -> Option<[(f64, String); 2]> {
    let table = main_table(report);
    let [galerkin, shooting, integration] =
        ["galerkin", "shooting", "integration"].map(|m| row(table, m));
    let (galerkin, shooting, integration) = (galerkin?, shooting?, integration?);
    let is_stable = floats(table, "stable")[shooting] == 1.0;
    if !is_stable || texts(table, "label")[integration] != "period 1" {
        return None;
    }
    let of = |row: usize| measures(table, row);
    Some([
        gap(&of(integration), &of(shooting)),
        gap(&of(galerkin), &of(shooting)),
    ])
}

#[test]
fn the_three_methods_agree_on_every_model() {
    let list = models();
    assert!(list.len() >= 2, "{list:?}");
    for path in list {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let study = Study::load(&path, &[], &[]).unwrap();
        if study.assembly.natural_frequencies.is_empty() {
            // A train without springs: nothing to measure frequencies by.
            continue;
        }
        let mut agreed = 0;
        for ratio in RATIOS {
            let report = response(&path, &study, ratio);
            let Some([integrated, truncated]) = compare(&report) else {
                eprintln!(
                    "{name} {ratio}: no comparison {:?} {:?}",
                    report.ended_early,
                    texts(main_table(&report), "label").last()
                );
                continue;
            };
            eprintln!(
                "{name} {ratio}: {:.1e} {} | {:.1e} {}",
                integrated.0, integrated.1, truncated.0, truncated.1
            );
            if integrated.0 > ELSEWHERE {
                continue;
            }
            assert!(
                integrated.0 < INTEGRATED,
                "{name} at {ratio}: {}",
                integrated.1
            );
            assert!(
                truncated.0 < TRUNCATED,
                "{name} at {ratio}: {}",
                truncated.1
            );
            agreed += 1;
        }
        assert!(agreed >= WANTED, "{name}: {agreed} comparisons");
    }
}
