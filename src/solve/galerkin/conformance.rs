//! The march of the Galerkin method along a law with memory as an executable check, for laws of this crate and of other crates.

use super::{Galerkin, GalerkinOptions};
use crate::element::conformance::Violations;
use crate::element::{Element, Linear};
use crate::error::SolveError;
use crate::numeric::periodic::{Harmonic, Periodic};
use crate::solve::family::FrequencyFamily;
use crate::solve::residual::{Linearisation, Residual};
use crate::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};

/// Frequency, harmonics and samples of the march.
const FREQUENCY: f64 = 0.7;
const HARMONICS: usize = 5;
const SAMPLES: usize = 1024;
/// Sizes of the motions: within the first region of most laws of order one, and far beyond it.
const SIZES: [f64; 3] = [0.3, 1.1, 3.0];
/// Difference step, and the difference allowed between partials relative to the sizes that occur: kinks that a step moves between
/// samples, and levels that a motion almost grazes, leave that much.
const STEP: f64 = 1e-5;
const TOLERANCE: f64 = 2e-4;

/// Checks the partials of a whole march around the period against differences: a law with memory, parameters of order one, beside a spring,
/// as the Galerkin method sees it. The partials are those of the harmonics of its force by the harmonics of the deformation and by the
/// frequency, by the chain rule along the march. Laws without memory and laws that the method refuses pass.
///
/// ```
/// use gearlash::element::Jenkins;
/// gearlash::solve::galerkin::conformance::check(&Jenkins { slip_force: 0.4 }).unwrap();
/// ```
///
/// # Errors
/// All partials at fault.
pub fn check(element: &dyn Element) -> Result<(), Violations> {
    if element.memory_count() == 0 || element.least_impact().is_some() {
        return Ok(());
    }
    let found = faults(element).unwrap_or_else(|error| vec![error.to_string()]);
    match found.is_empty() {
        true => Ok(()),
        false => Err(Violations(found)),
    }
}

fn faults(element: &dyn Element) -> Result<Vec<String>, SolveError> {
    let mounts = vec![
        Mount::new(Box::new(Linear {}) as Box<dyn Element>),
        Mount::new(element.clone_box()),
    ];
    let series = Periodic::Fourier {
        mean: 0.1,
        harmonics: vec![Harmonic {
            order: 1,
            cos: 1.0,
            sin: 0.0,
        }],
    };
    let load = LoadSource {
        direction: DVector::from_element(1, 1.0),
        series,
        kind: LoadKind::Value,
    };
    let one = |x: f64, count: usize| DMatrix::from_element(1, count, x);
    let map = DMatrix::from_element(2, 1, 1.0);
    let system = System::new(one(0.1, 1), one(1.0, 2), map, mounts, vec![load])?;
    let options = GalerkinOptions {
        harmonics: HARMONICS,
        samples: SAMPLES,
    };
    let problem = Galerkin::new(FrequencyFamily::new(system), FREQUENCY, options)?;
    // Automata in closed form; memories with a rate from sample to sample.
    let mut problem = match element.evolving() {
        Some(_) => problem,
        None => problem.with_exact_quadrature(FREQUENCY)?,
    };
    let mut found = Vec::new();
    for size in SIZES {
        compare(&mut problem, size, &mut found)?;
    }
    Ok(found)
}

/// A motion of a size: more than two extrema in a period, nothing symmetric.
fn motion(size: f64, count: usize) -> DVector<f64> {
    DVector::from_fn(count, |k, _| match k {
        0 => 0.13 * size,
        k => size * (1.0 + 1.7 * k as f64).sin() / (1.0 + (k * k) as f64 / 6.0),
    })
}

fn compare(
    problem: &mut Galerkin<FrequencyFamily>,
    size: f64,
    found: &mut Vec<String>,
) -> Result<(), SolveError> {
    let count = problem.dim();
    let u = motion(size, count);
    let [mut here, mut above, mut below] = [(); 3].map(|()| Linearisation::of(problem));
    problem.linearise(&u, FREQUENCY, &mut here)?;
    let jacobian = here.dr_du.to_dense();
    let mut compare = |name: String, exact: DVector<f64>, difference: DVector<f64>| {
        let gap = (&exact - &difference).amax();
        if gap > TOLERANCE * (1.0 + exact.amax()) {
            found.push(format!(
                "along a march of size {size} the harmonics of the force change with {name} by {:?}, their partials say {:?}",
                difference.as_slice(),
                exact.as_slice()
            ));
        }
    };
    for k in 0..count {
        let mut moved = u.clone();
        moved[k] = u[k] + STEP;
        problem.linearise(&moved, FREQUENCY, &mut above)?;
        moved[k] = u[k] - STEP;
        problem.linearise(&moved, FREQUENCY, &mut below)?;
        let name = match k {
            0 => "the mean".into(),
            k if k % 2 == 1 => format!("sin {}", k.div_ceil(2)),
            k => format!("cos {}", k / 2),
        };
        let difference = (&above.r - &below.r) / (2.0 * STEP);
        compare(name, jacobian.column(k).into_owned(), difference);
    }
    problem.linearise(&u, FREQUENCY + STEP, &mut above)?;
    problem.linearise(&u, FREQUENCY - STEP, &mut below)?;
    let difference = (&above.r - &below.r) / (2.0 * STEP);
    compare("the frequency".into(), here.dr_dlambda.clone(), difference);
    Ok(())
}
