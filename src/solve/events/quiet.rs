//! Proof that no multiplier passes the unit circle between two places.
//!
//! The multipliers are the zeros of P(z; x) = product of (z - mu_i(x)), which varies smoothly with the place x on the path even
//! where multipliers meet, become real, or part again: nothing has to be matched. P is interpolated in x through the places that
//! are known, p being the interpolant and e the last term of Newton's formula, a bound of its error. By Rouche's theorem the
//! number of zeros outside the circle is the same all the way if
//!
//! ```text
//! |p(z; x)| > |e(z; x)|   for all |z| = 1 and all x between the two places
//! ```
//!
//! A factor that does not depend on z moves no zero: P is divided by the moduli of the multipliers outside, which may change by
//! orders of magnitude where those near the circle hardly move.

pub use super::bound::MOST;
use super::bound::{Differences, Weights, differences, size_of};
use super::polynomial::CharacteristicPolynomial;
pub use super::polynomial::MultiplierSample;
use num_complex::Complex;
use std::f64::consts::PI;

/// Ratio on the grid of angles above which the circle between its points is not looked at.
const CLEAR: f64 = 8.0;
/// Share of the larger neighbour on the grid that a zero on the circle leaves at most, at the angle nearest to it: half a step away from
/// one, a whole step and more from the other. The parabola is not asked there: beside a second multiplier of nearly the same angle it is wrong.
const SHALLOW: f64 = 0.5;
/// Share of the way left out at both ends, whose multipliers are known.
const ENDS: f64 = 0.01;
/// Halvings of the way.
const MAX_HALVINGS: u32 = 9;
/// Angles on the upper half circle: a base number, and an additional number per multiplier.
const ANGLES: (usize, usize) = (24, 3);
/// Angles of a closer look between three on the grid.
const CLOSER: usize = 8;
/// Repetitions of the closer look.
const ROUNDS: usize = 3;
/// Share of the largest error nearby on the circle that is reckoned with: a single term of Newton's formula vanishes here and there.
const SHARED: f64 = 0.5;
/// What is nearby [rad].
const AROUND: f64 = 0.6;
/// Half width of the first parabola through the dip of a multiplier, in steps of the grid; each one is narrower by `NARROWER`.
const DIP: f64 = 0.125;
const NARROWER: f64 = 0.25;
/// Farthest way to the bottom of one parabola, in its half widths.
const FARTHEST: f64 = 4.0;
/// Parabolas through one dip, and their least half width [rad].
const DESCENTS: usize = 3;
const NARROWEST: f64 = 1e-6;
/// Rounding of one factor of P.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// P on the upper half circle, through some places; owns its buffers.
#[derive(Debug, Default)]
pub struct Quiet {
    places: [CharacteristicPolynomial; MOST],
    grid: Vec<(f64, Differences)>,
    ratios: Vec<f64>,
    /// Least size of the last divided difference that is reckoned with at every angle of the grid.
    least: Vec<f64>,
    /// Angles of complex multipliers at the first two places, each with the nearest one at the other.
    tracks: Vec<(f64, f64)>,
}

impl Quiet {
    /// Whether no multiplier passes the circle between the first two places; the others are neighbours, the nearest first.
    pub fn holds(&mut self, places: &[MultiplierSample<'_>]) -> bool {
        let size = places[0].list.len();
        if size == 0 || places.iter().any(|p| p.list.len() != size) {
            return false;
        }
        // Both sides of a tongue may look alike: without a third place nothing is known of what lies between two.
        if places.len() < 3 {
            return false;
        }
        let known = places.len().min(MOST);
        let outside = places[0].list.iter().filter(|mu| mu.norm() > 1.0).count();
        self.track(&places[0], &places[1]);
        let mut polynomials = std::mem::take(&mut self.places);
        let pairs = polynomials.iter_mut().zip(&places[..known]);
        let mut are_real = true;
        for (p, place) in pairs {
            are_real &= p.set(place, outside);
        }
        let holds = are_real
            && self.is_proved(
                &polynomials[..known],
                rounding(places, &polynomials[..known]),
            );
        self.places = polynomials;
        holds
    }

    /// Pairs the angles of complex multipliers at two places.
    fn track(&mut self, a: &MultiplierSample<'_>, b: &MultiplierSample<'_>) {
        let nearest = |angle: f64, place: &MultiplierSample<'_>| {
            let gap = |x: &f64| (x - angle).abs();
            angles(place.list).min_by(|x, y| gap(x).total_cmp(&gap(y)))
        };
        self.tracks.clear();
        let there = angles(a.list).filter_map(|x| Some((x, nearest(x, b)?)));
        self.tracks.extend(there);
        for y in angles(b.list) {
            if let Some(x) = nearest(y, a)
                && !self.tracks.contains(&(x, y))
            {
                self.tracks.push((x, y));
            }
        }
    }

    /// The same for places as polynomials. `rounding`: that of P.
    fn is_proved(&mut self, places: &[CharacteristicPolynomial], rounding: f64) -> bool {
        let count = ANGLES.0 + ANGLES.1 * places[0].degree();
        let step = PI / count as f64;
        self.grid.clear();
        self.grid.extend((0..=count).map(|k| {
            let angle = step * k as f64;
            (angle, differences(places, angle))
        }));
        let last = places.len() - 1;
        let sizes: Vec<f64> = self.grid.iter().map(|(_, d)| size_of(d[last])).collect();
        let reach = (AROUND / step) as usize;
        self.least.clear();
        self.least.extend((0..=count).map(|k| {
            let around = &sizes[k.saturating_sub(reach)..=(k + reach).min(count)];
            SHARED * around.iter().fold(0.0, |m, x| x.max(m))
        }));
        let (a, b) = (places[0].x, places[1].x);
        let inset = ENDS * (b - a);
        self.is_clear_between(places, (a + inset, b - inset), (rounding, 0))
    }

    /// Whether |p| exceeds |e| all round the circle at all x of an interval.
    fn is_clear_between(
        &mut self,
        places: &[CharacteristicPolynomial],
        (low, high): (f64, f64),
        (rounding, depth): (f64, u32),
    ) -> bool {
        let weights = Weights::new(places, (low, high), rounding);
        if self.is_clear(places, &weights) {
            return true;
        }
        let middle = 0.5 * (low + high);
        depth < MAX_HALVINGS
            && self.is_clear_between(places, (low, middle), (rounding, depth + 1))
            && self.is_clear_between(places, (middle, high), (rounding, depth + 1))
    }

    /// The same for an interval without halving it.
    fn is_clear(&mut self, places: &[CharacteristicPolynomial], weights: &Weights) -> bool {
        self.ratios.clear();
        for ((_, differences), least) in self.grid.iter().zip(&self.least) {
            let ratio = weights.ratio(differences, *least);
            if ratio.is_nan() || ratio <= 1.0 {
                return false;
            }
            self.ratios.push(ratio);
        }
        let last = self.ratios.len() - 1;
        let step = self.grid[1].0;
        let is_clear = (0..=last).all(|k| {
            let here = self.ratios[k];
            // The circle goes on beyond +-1 as a mirror image.
            let left = self.ratios[if k == 0 { 1 } else { k - 1 }];
            let right = self.ratios[if k == last { last - 1 } else { k + 1 }];
            let is_shallow = here > SHALLOW * left.max(right);
            here > left
                || here > right
                || is_shallow && bottom((left, here, right)) > CLEAR
                || closest(places, (self.grid[k].0, step), (weights, self.least[k])) > 1.0
        });
        is_clear && self.are_dips_clear(places, weights)
    }

    /// The same at the bottoms of the dips that the multipliers make, which the grid does not show where two of them are nearer to each
    /// other than its angles.
    fn are_dips_clear(&self, places: &[CharacteristicPolynomial], weights: &Weights) -> bool {
        let (step, last) = (self.grid[1].0, self.grid.len() - 1);
        let share = (weights.middle - places[0].x) / (places[1].x - places[0].x);
        self.tracks.iter().all(|(from, to)| {
            let expected = from + (to - from) * share;
            let bottom = dip(places, weights, (expected, DIP * step));
            let k = ((bottom / step).round().max(0.0) as usize).min(last);
            weights.ratio(&differences(places, bottom), self.least[k]) > 1.0
        })
    }
}

/// Angles of the multipliers on the upper half plane.
fn angles(list: &[Complex<f64>]) -> impl Iterator<Item = f64> {
    let upper = list.iter().filter(|mu| mu.im > 0.0);
    upper.map(|mu| mu.arg())
}

/// The angle at which |p| is smallest, near an expected one: beside a zero its square is a parabola.
fn dip(
    places: &[CharacteristicPolynomial],
    weights: &Weights,
    (expected, width): (f64, f64),
) -> f64 {
    let (mut angle, mut width) = (expected, width);
    let value = |angle: f64| weights.value(&differences(places, angle)).norm_sqr();
    for _ in 0..DESCENTS {
        let [left, here, right] = [angle - width, angle, angle + width].map(value);
        let bend = left + right - 2.0 * here;
        if bend <= 0.0 || !bend.is_finite() {
            break;
        }
        let shift = (0.5 * (left - right) / bend).clamp(-FARTHEST, FARTHEST) * width;
        angle += shift;
        width = (NARROWER * width).min(shift.abs()).max(NARROWEST);
    }
    angle
}

/// Smallest ratio near an angle, on ever finer grids, and between the angles of the last one: a multiplier on the circle beside another
/// one of the same angle makes a dip as narrow as its distance from the circle.
fn closest(
    places: &[CharacteristicPolynomial],
    (angle, step): (f64, f64),
    (weights, least_difference): (&Weights, f64),
) -> f64 {
    let (mut middle, mut width, mut least) = (angle, step, f64::INFINITY);
    let ratio = |angle: f64| weights.ratio(&differences(places, angle), least_difference);
    for _ in 0..ROUNDS {
        let from = middle - width;
        let spacing = 2.0 * width / CLOSER as f64;
        for k in 0..=CLOSER {
            let angle = from + spacing * k as f64;
            let here = ratio(angle);
            if here < least {
                (least, middle) = (here, angle);
            }
        }
        if least <= 1.0 {
            return least;
        }
        width = spacing;
    }
    least.min(bottom((
        ratio(middle - width),
        least,
        ratio(middle + width),
    )))
}

/// Lowest value of a function near a zero of P, whose square is a parabola there, from three equidistant values.
fn bottom((left, here, right): (f64, f64, f64)) -> f64 {
    let (l, h, r) = (left * left, here * here, right * right);
    let bend = l + r - 2.0 * h;
    if bend > 0.0 && bend.is_finite() {
        (h - (r - l).powi(2) / (8.0 * bend)).max(0.0).sqrt()
    } else {
        here
    }
}

/// Rounding of P on the circle.
fn rounding(places: &[MultiplierSample<'_>], polynomials: &[CharacteristicPolynomial]) -> f64 {
    let size = |(place, polynomial): (&MultiplierSample<'_>, &CharacteristicPolynomial)| {
        let factors = place.list.iter().map(|mu| 1.0 + mu.norm());
        factors.product::<f64>() / polynomial.scale
    };
    let sizes = places.iter().zip(polynomials).map(size);
    ROUNDING * sizes.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lightly damped oscillator whose frequency is varied with twice its own: mu + 1/mu in the undamped case is a parabola
    /// in x that passes -2 by `depth`.
    fn tongue(x: f64, depth: f64) -> Vec<Complex<f64>> {
        let (r, trace) = (0.98, -2.0 - depth + x * x);
        let root = Complex::new(trace * trace - 4.0, 0.0).sqrt();
        [1.0, -1.0].map(|s| 0.5 * r * (trace + s * root)).to_vec()
    }

    fn holds(xs: &[f64], depth: f64) -> bool {
        let lists: Vec<_> = xs.iter().map(|x| tongue(*x, depth)).collect();
        let places = xs.iter().zip(&lists);
        let places: Vec<_> = places
            .map(|(x, list)| MultiplierSample::new(*x, list))
            .collect();
        Quiet::default().holds(&places)
    }

    #[test]
    fn a_tongue_between_two_places_is_not_quiet() {
        // At both ends the pair is complex and inside the circle. (1 - r)^2 / r = 4e-4 is the depth at which it passes -1.
        assert!(!holds(&[-0.5, 0.5, -1.0, 1.5], 6e-4));
        assert!(!holds(&[-0.05, 0.05, -0.5, 0.5], 6e-4));
        assert!(holds(&[-0.05, 0.05, -0.5, 0.5], 0.5e-4));
        assert!(holds(&[0.2, 0.4, -0.3, 0.9], 6e-4));
        // Both ends inside the tongue of real multipliers, stable.
        assert!(!holds(&[-0.02, 0.03, -0.06, 0.07], 6e-4));
    }

    #[test]
    fn one_far_outside_does_not_hide_the_others() {
        // The tongue beside a multiplier that grows a thousandfold.
        let list = |x: f64, depth: f64| {
            let mut list = vec![Complex::new(-1e5 * (7.0 * x).exp(), 0.0)];
            list.extend(tongue(x, depth));
            list
        };
        let quiet = |xs: [f64; 4], depth: f64| {
            let lists = xs.map(|x| list(x, depth));
            let places: Vec<_> = (0..4)
                .map(|k| MultiplierSample::new(xs[k], &lists[k]))
                .collect();
            Quiet::default().holds(&places)
        };
        assert!(quiet([-0.05, 0.05, -0.5, 0.5], 0.5e-4));
        assert!(!quiet([-0.05, 0.05, -0.5, 0.5], 6e-4));
        assert!(!quiet([-0.5, 0.5, -1.0, 1.5], 6e-4));
    }

    /// Three meshes of varying stiffness: from 2.4834 to 2.4951 one pair is outside the circle, up to 1.0005, and another one of nearly the
    /// same angle inside. Multipliers at four frequencies by a Runge-Kutta rule of its own.
    #[test]
    fn a_pair_passes_beside_another_of_the_same_angle() {
        let places = [
            (
                2.5010204770607887,
                [
                    (-0.642448723018379, 0.713845763182551),
                    (-0.906526236761422, 0.418397410721033),
                    (-0.815106634259718, 0.371700409042152),
                ],
            ),
            (
                2.4760204770607883,
                [
                    (-0.659661540340258, 0.697620026565692),
                    (-0.905947738070287, 0.418375386520028),
                    (-0.810813921266259, 0.379425371604805),
                ],
            ),
            (
                2.4510204770607884,
                [
                    (-0.677243623135768, 0.680340838848948),
                    (-0.886213777750727, 0.402853380630583),
                    (-0.823412008657763, 0.402127423706450),
                ],
            ),
            (
                2.5510204770607885,
                [
                    (-0.608617495290172, 0.743701463424438),
                    (-0.849892095456979, 0.439825400714082),
                    (-0.875652617062063, 0.333076084248297),
                ],
            ),
        ];
        let lists = places.map(|(_, pairs)| {
            pairs
                .map(|(re, im)| [im, -im].map(|im| Complex::new(re, im)))
                .concat()
        });
        let places: Vec<_> = (0..4)
            .map(|k| MultiplierSample::new(places[k].0, &lists[k]))
            .collect();
        assert!(!Quiet::default().holds(&places));
    }

    /// A pair outside the circle by `height` at x = 0 and inside at the places around, beside a second one of nearly the same angle: their
    /// dips lie between the same angles of the grid.
    #[test]
    fn one_dip_does_not_hide_another() {
        // Angle, angle of the second pair from it, how both turn with x, height, curvature, modulus of the second pair, third pair.
        let cases = [
            [
                0.9382, 0.06835, 0.01731, -0.04168, 1.08e-4, 4.61e-4, 0.9748, 0.9239, 0.5493,
            ],
            [
                1.8563, -0.08705, -0.0038, -0.0488, 3.4e-4, 3e-3, 0.9685, 1.7142, 0.5504,
            ],
            [
                1.4584, 0.03265, -0.00333, -0.01268, 2.053e-4, 1.0605e-3, 0.9472, 1.0054, 0.5936,
            ],
            [
                1.0735, -0.07326, -0.00739, -0.01402, 7.868e-4, 4.4086e-3, 0.947, 2.736, 0.5035,
            ],
        ];
        for [
            angle,
            apart,
            turn,
            other_turn,
            height,
            bend,
            other,
            third_angle,
            third,
        ] in cases
        {
            let list = |x: f64| -> Vec<Complex<f64>> {
                let pairs = [
                    (1.0 + height - bend * x * x, angle + turn * x),
                    (other, angle + apart + other_turn * x),
                    (third, third_angle),
                ];
                let pairs =
                    pairs.map(|(r, angle)| [1.0, -1.0].map(|s| Complex::from_polar(r, s * angle)));
                pairs.concat()
            };
            let xs = [-0.489, 0.511, -1.489, 1.511];
            let lists = xs.map(list);
            assert!(lists.iter().flatten().all(|mu| mu.norm() < 1.0));
            let places: Vec<_> = (0..4)
                .map(|k| MultiplierSample::new(xs[k], &lists[k]))
                .collect();
            assert!(!Quiet::default().holds(&places), "angle {angle}");
        }
    }

    #[test]
    fn two_places_alone_prove_nothing() {
        assert!(!holds(&[-0.5, 0.5], 0.0));
        assert!(!holds(&[1.0, 1.02], 0.0));
        assert!(holds(&[1.0, 1.02, 0.9], 0.0));
    }
}
