//! A study over two parameters: the largest response against gap and damping.
//!
//!     cargo run --release --example study
//!
//! What to look at: the peak depends on the damping, hardly on the gap once the teeth separate.

use gearlash::prelude::*;

/// Prints one row per run.
pub fn main() -> Result<(), Error> {
    let model = Model::builder()
        .body("A", 1e-3)
        .body("B", 1e-3)
        .gear("mesh", ("A", 0.05), ("B", 0.05))
        .stiffness(2e8)
        .law(Backlash::half_gap(50e-6))
        .modal_damping(0.05)
        .load("A", Load::mean(100.0).harmonic(1, 150.0))
        .load("B", Load::mean(100.0))
        .build()?;
    let response = FrequencyResponse::between(hertz(8000.0), hertz(4000.0)).harmonics(7);
    let study = ParameterStudy::of(response)
        .over("mesh.half_gap", [20e-6, 50e-6, 100e-6])
        .over("damping.modal_ratio", [0.05, 0.1])
        .collecting("peak", Collected::max("rms.mesh"));
    let report = study.run(&model)?;
    let column = |name: &str| {
        report
            .main()
            .and_then(|table| table.floats(name))
            .unwrap_or_default()
    };
    let values = column("mesh.half_gap")
        .iter()
        .zip(column("damping.modal_ratio"));
    for ((gap, ratio), peak) in values.zip(column("peak")) {
        println!("gap {gap:.0e} m, damping {ratio:.2}: {peak:.3e} m");
    }
    Ok(())
}
