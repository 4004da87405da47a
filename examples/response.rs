//! The response of a gear pair against the excitation frequency: where the teeth separate, and which part is stable.
//!
//!     cargo run --release --example response
//!
//! What to look at: the response bends to lower frequencies as soon as the teeth separate.

use gearlash::prelude::*;

/// Prints the response and what happens on it.
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
    let response = FrequencyResponse::between(hertz(8000.0), hertz(3000.0))
        .harmonics(12)
        .run(&model)?;
    for point in response.points() {
        println!(
            "{:8.1} Hz  {:.3e} m  {}",
            point.frequency_hz(),
            point.rms("mesh"),
            if point.is_stable() { "stable" } else { "" }
        );
    }
    for event in response.events() {
        println!("{} at {:.4} omega_c", event.kind(), event.omega());
    }
    Ok(())
}
