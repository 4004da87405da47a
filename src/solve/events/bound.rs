//! The interpolated characteristic polynomial over a bound of its error.

use super::polynomial::CharacteristicPolynomial;
use num_complex::Complex;

/// Places through which P is interpolated at most.
pub const MOST: usize = 4;
/// Factor on the estimated error.
const SAFETY: f64 = 2.5;
/// Share of the term before the last one that counts as error: the last one may be small by chance.
const CHANCE: f64 = 0.1;
/// Error in the last stretch: half the surprise in its middle.
const UNKNOWN: f64 = 2.0;

/// Divided differences of P at one z.
pub(super) type Differences = [Complex<f64>; MOST];

/// Quantities shared by all z at an interval of x.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weights {
    count: usize,
    /// Middle of the interval.
    pub middle: f64,
    /// Half of it.
    half: f64,
    /// Products of middle - x_i in Newton's formula: in the value, the slope, the curvature.
    value: [f64; MOST],
    slope: [f64; MOST],
    curvature: [f64; MOST],
    /// Factor of the last divided difference in the error.
    error: f64,
    /// That of the one before.
    error_before: f64,
    rounding: f64,
}

impl Weights {
    /// For an interval between the first two of some places, or a part of it. `rounding`: that of P.
    pub fn new(
        places: &[CharacteristicPolynomial],
        (low, high): (f64, f64),
        rounding: f64,
    ) -> Weights {
        let count = places.len();
        let x = 0.5 * (low + high);
        let mut u = [0.0; MOST];
        u.iter_mut().zip(places).for_each(|(u, p)| *u = x - p.x);
        let error = [low, x, high].map(|x| error(places, x));
        let bend = |x: f64| ((x - places[0].x) * (x - places[1].x)).abs();
        let bend = bend(low).max(bend(x)).max(bend(high));
        Weights {
            count,
            middle: x,
            half: 0.5 * (high - low),
            value: [1.0, u[0], u[0] * u[1], u[0] * u[1] * u[2]],
            slope: [
                0.0,
                1.0,
                u[0] + u[1],
                u[0] * u[1] + u[0] * u[2] + u[1] * u[2],
            ],
            curvature: [0.0, 0.0, 1.0, u[0] + u[1] + u[2]],
            error: SAFETY * error.into_iter().fold(0.0, f64::max),
            error_before: match count {
                MOST => CHANCE * bend,
                _ => 0.0,
            },
            rounding,
        }
    }

    /// |p| in the middle over a bound of what it may lose from there to the ends of the interval, error included.
    /// `least`: of the last divided difference.
    pub fn ratio(&self, d: &Differences, least: f64) -> f64 {
        let sum = |weights: &[f64; MOST]| self.sum(weights, d);
        let h = self.half;
        let cubic = match self.count {
            MOST => size_of(d[MOST - 1]) * h.powi(3),
            _ => 0.0,
        };
        let drift = size_of(sum(&self.slope)) * h + size_of(sum(&self.curvature)) * h * h + cubic;
        let error = self.error * size_of(d[self.count - 1]).max(least)
            + self.error_before * size_of(d[self.count - 2]);
        size_of(sum(&self.value)) / (drift + error + self.rounding)
    }

    /// p in the middle.
    pub fn value(&self, d: &Differences) -> Complex<f64> {
        self.sum(&self.value, d)
    }

    fn sum(&self, weights: &[f64; MOST], d: &Differences) -> Complex<f64> {
        let terms = weights.iter().zip(d).take(self.count);
        terms.map(|(w, d)| d * *w).sum()
    }
}

/// Factor of the last divided difference in the error of p at x.
fn error(places: &[CharacteristicPolynomial], x: f64) -> f64 {
    let (a, b) = (places[0].x, places[1].x);
    let others = &places[2..];
    if others.is_empty() {
        // A straight line may be wrong by all of its rise.
        return (b - a).abs();
    }
    let but_last = &places[..places.len() - 1];
    let term = but_last.iter().map(|p| x - p.x).product::<f64>().abs();
    let is_end = |end: f64, far: f64| others.iter().all(|o| (o.x - end) * (far - end) > 0.0);
    let end = match () {
        _ if is_end(b, a) => b,
        _ if is_end(a, b) => a,
        _ => return term,
    };
    // At the last stretch nothing is known of what comes: the error with which its end was to be expected from the places behind
    // tells more.
    let surprise = others.iter().map(|o| end - o.x).product::<f64>() * (b - a);
    let share = (x - a) / (b - a);
    term.max(UNKNOWN * share * (1.0 - share) * surprise.abs())
}

/// Modulus, of numbers whose squares neither overflow nor vanish beside the rounding of P.
pub(super) fn size_of(z: Complex<f64>) -> f64 {
    z.norm_sqr().sqrt()
}

/// Newton's divided differences of P at e^(i angle).
pub(super) fn differences(places: &[CharacteristicPolynomial], angle: f64) -> Differences {
    let z = Complex::from_polar(1.0, angle);
    let mut d = [Complex::new(0.0, 0.0); MOST];
    for (d, place) in d.iter_mut().zip(places) {
        *d = place.at(z);
    }
    for order in 1..places.len() {
        for k in (order..places.len()).rev() {
            d[k] = (d[k] - d[k - 1]) / (places[k].x - places[k - order].x);
        }
    }
    d
}
