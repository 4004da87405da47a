//! Coefficients of normal forms from derivatives of the transition matrix along its critical directions.
//!
//! ```text
//! fold             a = <p, B(q, q)> / 2
//! doubling         b = <p, C(q, q, q) + 3 B(q, (I - A)^-1 B(q, q))> / 6
//! Neimark-Sacker   d = Re e^(-i theta) [<p, C(q, q, q*)> + 2 <p, B(q, (I - A)^-1 B(q, q*))> + <p, B(q*, (e^(2 i theta) - A)^-1 B(q, q))>] / 2
//! ```
//!
//! Kuznetsov (2004), Elements of applied bifurcation theory, sections 4.4, 4.5 and 5.4.

use super::Defining;
use super::conditions::{Borders, sharpened, shifted};
use super::defining::Spot;
use super::shots::Passages;
use crate::error::SolveError;
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;
use std::f64::consts::TAU;

/// Step of the differences, in sizes of the state.
const STEP: f64 = 1.5e-3;

/// Weights of Phi at +-1, +-2, .. steps in central differences of the first and of the second order.
type Stencil = (&'static [f64], &'static [f64]);

/// Differences of sixth order, and of fourth where a passage comes or goes within them.
const STENCILS: [Stencil; 2] = [
    (&[0.75, -0.15, 1.0 / 60.0], &[1.5, -0.15, 1.0 / 90.0]),
    (&[2.0 / 3.0, -1.0 / 12.0], &[4.0 / 3.0, -1.0 / 12.0]),
];

/// First and second derivative of Phi along a direction.
struct Bend {
    first: DMatrix<f64>,
    second: DMatrix<f64>,
}

impl Defining<'_> {
    /// Phi over the response period at a spot, and the passages of breakpoints in the period of the orbit; `None` where there is no image.
    pub(super) fn transition(
        &mut self,
        spot: &Spot,
    ) -> Result<Option<(DMatrix<f64>, Passages)>, SolveError> {
        let n = spot.u.len();
        let (mut state, mut phi) = (spot.u.clone(), DMatrix::identity(n, n));
        let found = self.shots.whole(spot.p, &mut state, Some(&mut phi))?;
        let repeats = (TAU / self.shots.period()).round() as usize;
        let once = phi.clone();
        (1..repeats).for_each(|_| phi = &once * &phi);
        Ok(found.map(|passages| (phi, passages)))
    }

    /// Differences along a direction of unit length; `None` where a passage of a breakpoint comes or goes within them.
    fn bend(
        &mut self,
        spot: &Spot,
        direction: &DVector<f64>,
        whole: &(DMatrix<f64>, Passages),
    ) -> Result<Option<Bend>, SolveError> {
        for stencil in &STENCILS {
            if let Some(bend) = self.differences(spot, direction, (whole, stencil))? {
                return Ok(Some(bend));
            }
        }
        Ok(None)
    }

    fn differences(
        &mut self,
        spot: &Spot,
        direction: &DVector<f64>,
        ((phi, passages), (first, second)): (&(DMatrix<f64>, Passages), &Stencil),
    ) -> Result<Option<Bend>, SolveError> {
        let h = STEP * self.size;
        let mut bend = Bend {
            first: DMatrix::zeros(phi.nrows(), phi.ncols()),
            second: phi * (-2.0 * second.iter().sum::<f64>()),
        };
        for (k, (first, second)) in first.iter().zip(*second).enumerate() {
            for sign in [-1.0, 1.0] {
                let mut moved = spot.clone();
                for (u, d) in moved.u.iter_mut().zip(direction.iter()) {
                    *u += sign * (k + 1) as f64 * h * d;
                }
                match self.transition(&moved)? {
                    Some((matrix, found)) if found.is_like(passages) => {
                        bend.first += &matrix * (sign * first);
                        bend.second += &matrix * *second;
                    }
                    _ => return Ok(None),
                }
            }
        }
        bend.first /= h;
        bend.second /= h * h;
        Ok(Some(bend))
    }

    /// a of a fold, with vectors of unit length along those of the borders.
    pub(super) fn fold_coefficient(
        &mut self,
        spot: &Spot,
        whole: &(DMatrix<f64>, Passages),
    ) -> Result<f64, SolveError> {
        let Some((p, q)) = self.vectors(&shifted(&whole.0, -1.0)) else {
            return Ok(f64::NAN);
        };
        let bend = self.bend(spot, &q, whole)?;
        Ok(bend.map_or(f64::NAN, |bend| 0.5 * p.dot(&(bend.first * &q))))
    }

    /// b of a period doubling, <p, q> = 1.
    pub(super) fn doubling_coefficient(
        &mut self,
        spot: &Spot,
        whole: &(DMatrix<f64>, Passages),
    ) -> Result<f64, SolveError> {
        let Some((p, q)) = self.vectors(&shifted(&whole.0, 1.0)) else {
            return Ok(f64::NAN);
        };
        let Some(Bend { first, second }) = self.bend(spot, &q, whole)? else {
            return Ok(f64::NAN);
        };
        let square = &first * &q;
        let Some(inner) = (-shifted(&whole.0, -1.0)).lu().solve(&square) else {
            return Ok(f64::NAN);
        };
        let cubic = p.dot(&(second * &q)) + 3.0 * p.dot(&(first * inner));
        Ok(cubic / (6.0 * p.dot(&q)))
    }

    /// d of a Neimark-Sacker event, <p, q> = 1, |q| = 1.
    pub(super) fn torus_coefficient(
        &mut self,
        spot: &Spot,
        whole: &(DMatrix<f64>, Passages),
    ) -> Result<f64, SolveError> {
        let theta = spot.extra.clamp(-1.0, 1.0).acos();
        let mu = Complex::from_polar(1.0, theta);
        let a = whole.0.map(|x| Complex::new(x, 0.0));
        let Some((p, q)) = eigenvectors(&a, mu) else {
            return Ok(f64::NAN);
        };
        let (x, y) = (q.map(|z| z.re), q.map(|z| z.im));
        let (Some(along_x), Some(along_y)) =
            (self.bend(spot, &x, whole)?, self.bend(spot, &y, whole)?)
        else {
            return Ok(f64::NAN);
        };
        let complex = |re: DVector<f64>, im: DVector<f64>| re.zip_map(&im, Complex::new);
        // B(q, q*), B(q, q), C(q, q, q*).
        let mixed = complex(
            &along_x.first * &x + &along_y.first * &y,
            DVector::zeros(x.len()),
        );
        let square = complex(
            &along_x.first * &x - &along_y.first * &y,
            2.0 * (&along_x.first * &y),
        );
        let cubic = complex(
            &along_x.second * &x + &along_y.second * &x,
            &along_x.second * &y + &along_y.second * &y,
        );
        let one = DMatrix::identity(x.len(), x.len());
        let own = p.map(|z| z.conj()).dotc(&square);
        let (Some(first), Some(second)) = (
            (&one - &a).lu().solve(&mixed),
            without((&one * (mu * mu) - &a, &square), (&p, &q)),
        ) else {
            return Ok(f64::NAN);
        };
        let i = Complex::new(0.0, 1.0);
        let along = |sign: f64| {
            let (re, im) = (&along_x.first, &along_y.first);
            re.zip_map(im, |re, im| Complex::new(re, 0.0) + i * (sign * im))
        };
        let sum = cubic + along(1.0) * first * Complex::new(2.0, 0.0) + along(-1.0) * second;
        Ok(0.5 * ((mu.conj() * p.dotc(&sum)).re - 0.5 * own.norm_sqr()))
    }

    /// Left and right singular vector, oriented as the borders.
    pub(super) fn vectors(&self, m: &DMatrix<f64>) -> Option<(DVector<f64>, DVector<f64>)> {
        let borders = Borders::of(m, 1, self.borders.as_ref())?;
        Some(borders.vectors())
    }

    /// What a fold that turns in the second parameter means: true where an isolated branch is born, false where two branches join. The
    /// orbits at the same p2 lie on
    ///
    /// ```text
    /// a11 x^2 + 2 a12 x y + a22 y^2 = const,    phi(x, y) = <p, P(u + x q + y s; p1 + y) - u - x q - y s>
    /// ```
    pub(super) fn is_birth(&mut self, spot: &Spot) -> Result<Option<bool>, SolveError> {
        let Some((phi, _)) = self.transition(spot)? else {
            return Ok(None);
        };
        let m = shifted(&phi, -1.0);
        let Some((p, q)) = self.vectors(&m) else {
            return Ok(None);
        };
        let slope = self.slope(spot, 0)?;
        let Ok(inverse) = m.clone().pseudo_inverse(1e-7 * m.amax()) else {
            return Ok(None);
        };
        let s = -(inverse * slope);
        // Both directions of about unit length in sizes of the state and ranges of the parameter.
        let long = (s.norm() / self.size).max(1.0);
        let h = STEP;
        let mut value = |x: f64, y: f64| -> Result<f64, SolveError> {
            let (x, y) = (x * h * self.size, y * h / long);
            let mut moved = spot.clone();
            moved.p[0] += y;
            for (k, u) in moved.u.iter_mut().enumerate() {
                *u += x * q[k] + y * s[k];
            }
            let mut image = moved.u.clone();
            if !self.shots.map(moved.p, (0.0, TAU), (&mut image, None))? {
                return Ok(f64::NAN);
            }
            let parts = image.iter().zip(&moved.u).zip(p.iter());
            Ok(parts.map(|((a, b), p)| p * (a - b)).sum())
        };
        let middle = value(0.0, 0.0)?;
        let a11 = value(1.0, 0.0)? + value(-1.0, 0.0)? - 2.0 * middle;
        let a22 = value(0.0, 1.0)? + value(0.0, -1.0)? - 2.0 * middle;
        let a12 =
            0.25 * (value(1.0, 1.0)? + value(-1.0, -1.0)? - value(1.0, -1.0)? - value(-1.0, 1.0)?);
        let determinant = a11 * a22 - a12 * a12;
        Ok(determinant.is_finite().then_some(determinant > 0.0))
    }
}

type Vector = DVector<Complex<f64>>;

/// p and q with A q = mu q, p* A = mu p*, <p, q> = 1, |q| = 1.
fn eigenvectors(a: &DMatrix<Complex<f64>>, mu: Complex<f64>) -> Option<(Vector, Vector)> {
    let n = a.nrows();
    let shifted = a - DMatrix::identity(n, n) * mu;
    let svd = shifted.clone().svd(true, true);
    let values = svd.singular_values.iter().enumerate();
    let (k, _) = values.min_by(|a, b| a.1.total_cmp(b.1))?;
    let (u, v) = (svd.u?, svd.v_t?);
    let (left, right) = (u.column(k).into_owned(), v.row(k).adjoint());
    let (p, q) = sharpened(&shifted, &left, &right)?;
    let product = p.dotc(&q);
    (product.norm() > 1e-12).then(|| (p / product.conj(), q))
}

/// w without its part along q*, where m w = r and m q* = (e^(2 i theta) - e^(-i theta)) q*: the part that grows without bound towards the
/// resonance 1:3. In d its share has the real part -1/2 |<p*, r>|^2 for every theta.
fn without((m, r): (DMatrix<Complex<f64>>, &Vector), (p, q): (&Vector, &Vector)) -> Option<Vector> {
    let n = m.nrows();
    let (left, right) = (p.map(|z| z.conj()), q.map(|z| z.conj()));
    let mut bordered = DMatrix::zeros(n + 1, n + 1);
    bordered.view_mut((0, 0), (n, n)).copy_from(&m);
    bordered.view_mut((0, n), (n, 1)).copy_from(&right);
    (bordered.view_mut((n, 0), (1, n))).copy_from(&left.adjoint());
    let mut rhs = Vector::zeros(n + 1);
    rhs.rows_mut(0, n).copy_from(r);
    Some(bordered.lu().solve(&rhs)?.rows(0, n).into_owned())
}

impl Passages {
    /// Leaves out the passages of a touching, slow ones of a connection near its phase. It goes up and down again: of an odd number the fastest
    /// is another one, such as beside a touching where an extremum meets the next one.
    pub(super) fn forget_touching(
        &mut self,
        connection: usize,
        limit: f64,
        is_near: impl Fn(f64) -> bool,
    ) {
        let is_own = |(own, _, tau, rate): &(usize, usize, f64, f64)| {
            *own == connection && rate.abs() < limit && is_near(*tau)
        };
        let own = self.0.iter().filter(|p| is_own(p));
        let fastest = own.clone().map(|p| p.3.abs()).fold(0.0, f64::max);
        let is_odd = own.count() % 2 == 1;
        (self.0).retain(|p| !is_own(p) || is_odd && p.3.abs() == fastest);
    }

    /// Whether the same breakpoints are passed as often.
    pub(crate) fn is_like(&self, other: &Passages) -> bool {
        self.counts() == other.counts()
    }

    /// Number of passages of each breakpoint, in the order of connections.
    pub fn counts(&self) -> Vec<(usize, usize, usize)> {
        let mut list: Vec<(usize, usize)> = self.0.iter().map(|s| (s.0, s.1)).collect();
        list.sort_unstable();
        let mut counts: Vec<(usize, usize, usize)> = Vec::new();
        for (connection, level) in list {
            match counts.last_mut() {
                Some(last) if (last.0, last.1) == (connection, level) => last.2 += 1,
                _ => counts.push((connection, level, 1)),
            }
        }
        counts
    }
}
