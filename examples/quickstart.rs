//! Loads a model, prints its natural frequencies, runs one analysis and reads the result.
//!
//!     cargo run --release --example quickstart
//!
//! What to look at: the unstable part of the branch lies between the bifurcations; no experiment follows it.

use gearlash::error::Error;
use gearlash::output::FigureFormat;
use gearlash::report::{Table, Values};
use gearlash::study::{RunSettings, Study};
use std::path::Path;
use std::sync::atomic::AtomicBool;

fn main() -> Result<(), Error> {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/reverse_idler.yaml");
    let overrides = ["connections.mesh_1.element.half_gap=40 um".to_string()];
    let study = Study::load(&model, &overrides, &["fig_11".to_string()])?;
    let frequencies = study.assembly.natural_frequencies.as_slice();
    println!("natural frequencies over omega_c: {frequencies:.4?}");

    let settings = RunSettings {
        out: std::env::temp_dir().join("gearlash-quickstart"),
        figures: vec![FigureFormat::Svg],
        jobs: 1,
    };
    let never_interrupted = AtomicBool::new(false);
    let outcome = study.run(&settings, &never_interrupted)?;
    for report in &outcome.reports {
        let points = report.table("");
        let rms = points.map_or(&[][..], |table| floats(table, "rms.mesh_1"));
        let largest = rms.iter().copied().fold(0.0, f64::max);
        println!(
            "{}: {} points, largest r.m.s. of mesh_1 {largest:.4}",
            report.title,
            rms.len()
        );
        println!("ended early: {:?}", report.ended_early);
    }
    println!(
        "{} files in {}",
        outcome.files.len(),
        settings.out.display()
    );
    Ok(())
}

/// A column of real numbers.
fn floats<'a>(table: &'a Table, name: &str) -> &'a [f64] {
    match table.column(name).map(|column| &column.values) {
        Some(Values::Float(values)) => values,
        _ => &[],
    }
}
