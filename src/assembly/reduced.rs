//! The nondimensional front door: matrices as published, omega_c = 1.

use super::modes::symmetric_eigen;
use super::{Assembly, Scales, full_damping, mistake, refused};
use crate::error::Diagnostic;
use crate::model::{Reduced, ReducedDamping, ReducedElement};
use crate::numeric::periodic::Periodic;
use crate::numeric::symmetric::symmetriser;
use crate::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector, Schur};

/// Imaginary parts below this share of the largest eigenvalue are rounding.
const REAL: f64 = 1e-8;

/// The system of a reduced model; scales are 1.
pub(super) fn assemble(reduced: &Reduced) -> Result<Assembly, Vec<Diagnostic>> {
    let (n, e) = reduced.stiffness.shape();
    if n == 0 || e == 0 || reduced.element_map.shape() != (e, n) || reduced.elements.len() != e {
        let message = format!(
            "stiffness (kappa) is {n} x {e}, element_map (W) {} x {}, and there are {} elements: wanted n x e, e x n and e",
            reduced.element_map.nrows(),
            reduced.element_map.ncols(),
            reduced.elements.len()
        );
        return Err(vec![mistake("reduced", message, None)]);
    }
    let full_contact = full_contact(reduced);
    let mut warnings = Vec::new();
    if matches!(reduced.damping, ReducedDamping::ModalRatio(_)) {
        warnings.extend(full_damping(n));
    }
    let spectrum = SquaredFrequencies::new(&full_contact);
    let system = system_of(reduced, &full_contact, &|| spectrum.root(&full_contact))?;
    let squares = match &spectrum {
        SquaredFrequencies::Symmetric { values, .. } => values.iter().copied().collect(),
        SquaredFrequencies::Real(values) => values.clone(),
        SquaredFrequencies::None(reason) => {
            warnings.push(format!("natural frequencies are not listed: {reason}"));
            Vec::new()
        }
    };
    let elastic: Vec<f64> = squares.into_iter().filter(|x| *x > 0.0).collect();
    let connections: Vec<String> = reduced.elements.keys().cloned().collect();
    Ok(Assembly {
        system,
        coordinates: coordinate_names(&reduced.element_map, &connections),
        scales: Scales {
            frequency: 1.0,
            displacement: vec![1.0; e],
            stiffness: vec![1.0; e],
        },
        connections,
        coupling: None,
        anchor: None,
        natural_frequencies: DVector::from_vec(elastic).map(f64::sqrt),
        warnings,
    })
}

/// The system alone.
pub(super) fn system(reduced: &Reduced) -> Result<System, Vec<Diagnostic>> {
    let full_contact = full_contact(reduced);
    system_of(reduced, &full_contact, &|| {
        SquaredFrequencies::new(&full_contact).root(&full_contact)
    })
}

/// kappa W with the columns of springs only.
fn full_contact(reduced: &Reduced) -> DMatrix<f64> {
    let mut springs = reduced.stiffness.clone();
    for (mut column, law) in springs.column_iter_mut().zip(reduced.elements.values()) {
        if !law.element.is_spring() {
            column.fill(0.0);
        }
    }
    springs * &reduced.element_map
}

/// `root`: (kappa W)^(1/2), which modal damping alone asks for.
fn system_of(
    reduced: &Reduced,
    full_contact: &DMatrix<f64>,
    root: &dyn Fn() -> Result<DMatrix<f64>, String>,
) -> Result<System, Vec<Diagnostic>> {
    let gamma = match &reduced.damping {
        ReducedDamping::Matrix(gamma) => gamma.clone(),
        ReducedDamping::StiffnessProportional(c) => full_contact * *c,
        ReducedDamping::ModalRatio(ratio) => 2.0 * *ratio * root().map_err(refuse_modal)?,
    };
    let mut system = System::new(
        gamma,
        reduced.stiffness.clone(),
        reduced.element_map.clone(),
        mounts(reduced),
        loads(&reduced.loads),
    )
    .map_err(refused)?;
    system.set_revolutions(reduced.revolutions);
    Ok(system)
}

fn refuse_modal(reason: String) -> Vec<Diagnostic> {
    let message = format!("modal damping needs the square root of kappa W, but {reason}");
    let help = "give damping: {matrix: [[..]]}, or correct stiffness and element_map";
    vec![mistake("reduced.damping", message, Some(help.into()))]
}

/// The laws in place.
pub(super) fn mounts(reduced: &Reduced) -> Vec<Mount> {
    let mount = |law: &ReducedElement| Mount {
        element: law.element.clone(),
        stiffness_variation: law.stiffness_variation.clone(),
        transmission_error: law.transmission_error.clone(),
    };
    reduced.elements.values().map(mount).collect()
}

pub(super) fn loads(series: &[Periodic]) -> Vec<LoadSource> {
    let n = series.len();
    (series.iter().enumerate())
        .filter(|(_, s)| s.mean() != 0.0 || !s.is_constant())
        .map(|(i, s)| LoadSource {
            direction: DVector::from_fn(n, |j, _| if i == j { 1.0 } else { 0.0 }),
            series: s.clone(),
            kind: LoadKind::Value,
        })
        .collect()
}

/// Coordinate i is named after the first element whose row of W is the unit vector i, else `q<i>`, counted from 1.
fn coordinate_names(map: &DMatrix<f64>, elements: &[String]) -> Vec<String> {
    let is_unit = |k: usize, i: usize| {
        let wanted = |j: usize| if i == j { 1.0 } else { 0.0 };
        (0..map.ncols()).all(|j| map[(k, j)] == wanted(j))
    };
    let name = |i: usize| match (0..map.nrows()).find(|k| is_unit(*k, i)) {
        Some(k) => elements[k].clone(),
        None => format!("q{}", i + 1),
    };
    (0..map.ncols()).map(name).collect()
}

/// Eigenvalues of kappa W, the squares of the natural frequencies in full contact.
enum SquaredFrequencies {
    /// diag(scale) kappa W diag(scale)^-1 is symmetric, as for every train without loops.
    Symmetric {
        scale: Vec<f64>,
        values: DVector<f64>,
        vectors: DMatrix<f64>,
    },
    /// Real and not negative, ascending.
    Real(Vec<f64>),
    /// Why there is none.
    None(String),
}

impl SquaredFrequencies {
    fn new(matrix: &DMatrix<f64>) -> SquaredFrequencies {
        if matrix.iter().any(|x| !x.is_finite()) {
            return SquaredFrequencies::None("kappa W is not finite".into());
        }
        if let Some(scale) = symmetriser(matrix) {
            let n = matrix.nrows();
            let symmetric = DMatrix::from_fn(n, n, |i, j| {
                let at = |i: usize, j: usize| scale[i] * matrix[(i, j)] / scale[j];
                0.5 * (at(i, j) + at(j, i))
            });
            if let Some((values, vectors)) = symmetric_eigen(symmetric) {
                if values[0] < 0.0 {
                    return SquaredFrequencies::None(negative(values[0]));
                }
                return SquaredFrequencies::Symmetric {
                    scale,
                    values,
                    vectors,
                };
            }
        }
        general(matrix)
    }

    /// The principal square root, or why there is none.
    fn root(&self, matrix: &DMatrix<f64>) -> Result<DMatrix<f64>, String> {
        match self {
            SquaredFrequencies::None(reason) => Err(reason.clone()),
            SquaredFrequencies::Real(_) => square_root(matrix)
                .ok_or_else(|| "kappa W is singular or too close to it for a square root".into()),
            SquaredFrequencies::Symmetric {
                scale,
                values,
                vectors,
            } => {
                let mut scaled = vectors.clone();
                for (mut column, value) in scaled.column_iter_mut().zip(values.iter()) {
                    column *= value.sqrt();
                }
                let mut root = scaled * vectors.transpose();
                let n = scale.len();
                for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                    root[(i, j)] *= scale[j] / scale[i];
                }
                Ok(root)
            }
        }
    }
}

fn negative(value: f64) -> String {
    format!(
        "kappa W has the negative eigenvalue {value:.6}: the system is unstable in full contact"
    )
}

fn general(matrix: &DMatrix<f64>) -> SquaredFrequencies {
    let budget = 1000 + 100 * matrix.nrows();
    let Some(schur) = Schur::try_new(matrix.clone(), f64::EPSILON, budget) else {
        return SquaredFrequencies::None("the eigenvalues of kappa W could not be found".into());
    };
    let list = schur.complex_eigenvalues();
    let largest = list.iter().fold(0.0_f64, |m, x| m.max(x.norm()));
    if let Some(x) = list.iter().find(|x| x.im.abs() > REAL * largest) {
        let (re, im) = (x.re, x.im.abs());
        return SquaredFrequencies::None(format!(
            "kappa W has the complex eigenvalues {re:.6} +- {im:.6} i"
        ));
    }
    let mut values: Vec<f64> = list.iter().map(|x| x.re).collect();
    values.sort_by(f64::total_cmp);
    if values[0] < -REAL * largest {
        return SquaredFrequencies::None(negative(values[0]));
    }
    let floor = values.len() as f64 * f64::EPSILON * largest;
    for x in &mut values {
        *x = if *x < floor { 0.0 } else { *x };
    }
    SquaredFrequencies::Real(values)
}

/// Principal square root by the coupled Newton iteration of Denman and Beavers with determinantal scaling; `None` when it
/// does not converge (an eigenvalue on the closed negative axis).
///
/// ```text
/// Y <- (s Y + (s Z)^-1) / 2,    Z <- (s Z + (s Y)^-1) / 2,    Y -> A^(1/2), Z -> A^(-1/2)
/// ```
///
/// It needs no eigenvectors: repeated eigenvalues are not a special case.
fn square_root(a: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    let (mut y, mut z) = (a.clone(), DMatrix::identity(n, n));
    for _ in 0..60 {
        let (y_inv, z_inv) = (y.clone().try_inverse()?, z.clone().try_inverse()?);
        let size = |m: &DMatrix<f64>| m.norm();
        let s = ((size(&y_inv) * size(&z_inv)) / (size(&y) * size(&z))).powf(0.25);
        let next = (&y * s + &z_inv / s) * 0.5;
        z = (&z * s + &y_inv / s) * 0.5;
        let change = (&next - &y).norm();
        y = next;
        if change <= 1e-14 * y.norm() {
            break;
        }
    }
    let miss = (&y * &y - a).norm();
    (miss <= 1e-10 * a.norm()).then_some(y)
}
