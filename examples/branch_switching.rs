//! Branches that begin at period doublings, followed by themselves.
//!
//!     cargo run --release --example branch_switching
//!
//! What to look at: the primary branch loses its stability at a period doubling, where a branch of twice the period begins.

use gearlash::prelude::*;

/// Two meshes with concurrent clearances, nondimensional.
const MODEL: &str = "
reduced:
  stiffness: [[2, -1], [-1, 2]]
  damping: {modal_ratio: 0.05}
  elements:
    mesh_1: {type: backlash, half_gap: 1}
    mesh_2: {type: backlash, half_gap: 0.1}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.25, 0]}]}
analyses:
  response: {type: frequency_response, from: 1.15, to: 1.0, harmonics: 8, branches: all}
";

/// Prints the bifurcations, then each branch with its ends.
pub fn main() -> Result<(), Error> {
    let model = Model::from_yaml(MODEL)?;
    let curves = ResponseCurves::from(model.run("response")?);
    for event in curves.events() {
        println!("{} at {:.5}", event.kind(), event.omega());
    }
    let branches = curves
        .points()
        .map(|point| point.branch())
        .max()
        .unwrap_or(0);
    for branch in 0..=branches {
        let points: Vec<_> = curves
            .points()
            .filter(|point| point.branch() == branch)
            .collect();
        if let [first, .., last] = points.as_slice() {
            let stable = points.iter().filter(|point| point.is_stable()).count();
            println!(
                "branch {branch}: {:.4} to {:.4}, {stable} of {} points stable",
                first.omega(),
                last.omega(),
                points.len()
            );
        }
    }
    Ok(())
}
