//! The motion of a loose gear against time: every impact on either flank.
//!
//!     cargo run --release --example time_history
//!
//! What to look at: the deformation stays beyond half the gap, 25 um, only for a moment; the gear flies in between.

use gearlash::prelude::*;

/// Prints a period, and how often a flank is struck.
pub fn main() -> Result<(), Error> {
    let model = Model::builder()
        .body("driver", 2e-3)
        .body("loose", 5e-4)
        .gear("mesh", ("driver", 0.05), ("loose", 0.04))
        .stiffness(1e8)
        .law(Backlash::half_gap(25e-6).impact_damping(0.2))
        .load("driver", Load::mean(0.5).harmonic(1, 20.0))
        .load("loose", Load::mean(0.4))
        .build()?;
    let history = TimeHistory::at(hertz(60.0))
        .with(|settings| {
            settings.transient = 20;
            settings.periods = Some(1);
            settings.samples_per_period = 40;
        })
        .run(&model)?;
    let deformation = history.column("q.mesh").unwrap_or_default();
    for (t, q) in history.times().iter().zip(deformation) {
        println!("{t:.5} s  {:8.3} um", 1e6 * q);
    }
    let switches = history.switches().map_or(0, Table::rows);
    println!("{switches} passages of a flank");
    Ok(())
}
