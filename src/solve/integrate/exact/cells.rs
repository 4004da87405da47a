//! Regions of laws whose memory has a rate of its own: bounded by levels of deformation, rate and memory, the axes 0, 1 and 2.

use crate::numeric::bernstein::Direction;
use crate::numeric::taylor::Polynomial;

/// Regions between levels of three quantities: deformation, rate, memory.
#[derive(Debug, Clone)]
pub(crate) struct LawCells {
    pub(super) levels: [Vec<f64>; 3],
}

impl LawCells {
    /// How many they are.
    pub fn count(&self) -> usize {
        self.levels.iter().map(|l| l.len() + 1).product()
    }

    /// Numbers of a region along the axes.
    fn place(&self, region: usize) -> [usize; 3] {
        let [_, v, z] = self.strides();
        [region / (v * z), region / z % v, region % z]
    }

    fn strides(&self) -> [usize; 3] {
        let [q, v, z] = &self.levels;
        [q.len() + 1, v.len() + 1, z.len() + 1]
    }

    fn region(&self, [q, v, z]: [usize; 3]) -> usize {
        let [_, by_v, by_z] = self.strides();
        (q * by_v + v) * by_z + z
    }

    /// A point inside a region.
    pub fn inside(&self, region: usize) -> [f64; 3] {
        let place = self.place(region);
        std::array::from_fn(|axis| match self.levels[axis].is_empty() {
            // Off the zeros of rate and memory, where formulas may lose a factor.
            true => 0.3,
            false => inside(&self.levels[axis], place[axis]),
        })
    }

    /// Borders of a region along an axis.
    pub fn borders(&self, region: usize, axis: usize) -> (f64, f64) {
        let (levels, place) = (&self.levels[axis], self.place(region)[axis]);
        let low = place.checked_sub(1).map(|k| levels[k]);
        let high = levels.get(place).copied();
        (
            low.unwrap_or(f64::NEG_INFINITY),
            high.unwrap_or(f64::INFINITY),
        )
    }

    /// The region beside another one.
    pub fn beside(&self, region: usize, axis: usize, direction: Direction) -> usize {
        let mut place = self.place(region);
        match direction {
            Direction::Up => place[axis] += 1,
            Direction::Down => place[axis] -= 1,
        }
        self.region(place)
    }

    /// The region of deformation, rate and memory, on a level that below it; whether one of them is on a level.
    pub fn find(&self, at: [f64; 3], tolerance: impl Fn(usize, f64) -> f64) -> (usize, bool) {
        let (mut place, mut stands) = ([0; 3], false);
        for axis in 0..3 {
            for level in &self.levels[axis] {
                let distance = at[axis] - level;
                let tolerance = tolerance(axis, *level);
                place[axis] += usize::from(distance > tolerance);
                stands |= distance.abs() <= tolerance;
            }
        }
        (self.region(place), stands)
    }

    /// The region into which a motion on levels is about to move from the one below; `series`: of the three quantities.
    pub fn leave(
        &self,
        mut region: usize,
        series: [&Polynomial; 3],
        tolerance: impl Fn(usize, f64) -> f64,
    ) -> usize {
        for (axis, polynomial) in series.into_iter().enumerate() {
            let (_, high) = self.borders(region, axis);
            let tolerance = tolerance(axis, high);
            let stands = high.is_finite() && (polynomial[0] - high).abs() <= tolerance;
            if stands && departs(polynomial, tolerance, Direction::Up) {
                region = self.beside(region, axis, Direction::Up);
            }
        }
        region
    }
}

/// Whether a polynomial that starts on a level leaves the tolerance in a direction: the sign of the term that does it first (at rest
/// in the origin the tolerance is 0, and that is the lowest one).
pub(crate) fn departs(polynomial: &Polynomial, tolerance: f64, direction: Direction) -> bool {
    let terms = polynomial.iter().enumerate().skip(1);
    let terms = terms.filter(|(_, c)| **c != 0.0);
    let leaving = terms.map(|(k, c)| ((tolerance / c.abs()).powf(1.0 / k as f64), *c));
    let first = leaving.min_by(|a, b| a.0.total_cmp(&b.0));
    first.is_some_and(|(_, c)| c * direction.sign() > 0.0)
}

/// A displacement inside a region.
pub fn inside(breakpoints: &[f64], region: usize) -> f64 {
    let below = region.checked_sub(1).map(|k| breakpoints[k]);
    match (below, breakpoints.get(region)) {
        (None, None) => 0.0,
        (Some(below), None) => below + below.abs() + 1.0,
        (None, Some(above)) => above - above.abs() - 1.0,
        (Some(below), Some(above)) => 0.5 * (below + above),
    }
}
