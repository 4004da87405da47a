//! In which region of its law every connection is, and where it leaves it.

use super::laws::{Law, Piece};
use super::series::Series;
use crate::numeric::bernstein::{Direction, first_passage, hull};
use crate::numeric::taylor::{COUNT, Polynomial};
use std::cmp::Ordering;

/// Rounding of a deformation in units of what it is made of.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The first crossing on a step.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    pub theta: f64,
    pub connection: usize,
    pub direction: Direction,
}

/// Regions of all connections.
#[derive(Debug, Clone)]
pub struct Regions {
    connections: Vec<Connection>,
    /// theta^k of the step.
    powers: Polynomial,
}

#[derive(Debug, Clone)]
struct Connection {
    law: Law,
    region: usize,
    /// Sum of the moduli of W in its row.
    weight: f64,
    /// Bound on its transmission error and the slope of it.
    error: f64,
}

impl Connection {
    /// Distance from a level that rounding bridges, for a state of a size at a phase of the response.
    fn tolerance(&self, level: f64, size: f64, tau: f64) -> f64 {
        ROUNDING * (level.abs() + self.weight * size + self.error * (1.0 + tau.abs()))
    }
}

/// Largest coordinate or, in units of time of the series, rate.
fn size(series: &Series, state: &[f64]) -> f64 {
    let (q, v) = state.split_at(state.len() / 2);
    let rates = v.iter().map(|v| v.abs() * series.unit);
    q.iter().map(|q| q.abs()).chain(rates).fold(0.0, f64::max)
}

impl Regions {
    /// Every connection in the lowest region of its law.
    pub fn new(laws: Vec<Law>, series: &Series) -> Regions {
        let connection = |(k, law)| {
            let (weight, error) = series.sizes(k);
            Connection {
                law,
                region: 0,
                weight,
                error,
            }
        };
        Regions {
            connections: laws.into_iter().enumerate().map(connection).collect(),
            powers: [0.0; COUNT],
        }
    }

    /// The force of a connection in its region.
    #[inline]
    pub fn piece(&self, connection: usize) -> &Piece {
        let Connection { law, region, .. } = &self.connections[connection];
        &law.pieces[*region]
    }

    /// Moves a connection into the next region: the breakpoint passed, the flanks before and after.
    pub fn pass(&mut self, connection: usize, direction: Direction) -> (f64, i8, i8) {
        let Connection { law, region, .. } = &mut self.connections[connection];
        let before = *region;
        let level = match direction {
            Direction::Up => law.breakpoints[before],
            Direction::Down => law.breakpoints[before - 1],
        };
        *region = match direction {
            Direction::Up => before + 1,
            Direction::Down => before - 1,
        };
        (level, law.flanks[before], law.flanks[*region])
    }

    /// The earliest crossing of any connection within a step from a state.
    pub fn first_crossing(
        &mut self,
        series: &Series,
        (tau, state): (f64, &[f64]),
        step: f64,
    ) -> Option<Crossing> {
        fill_powers(&mut self.powers, step);
        let size = size(series, state);
        let mut first: Option<Crossing> = None;
        for (k, connection) in self.connections.iter().enumerate() {
            let (low, high) = connection.law.borders(connection.region);
            if low.is_infinite() && high.is_infinite() {
                continue;
            }
            let mut polynomial = *series.deformation(k);
            for (c, power) in polynomial.iter_mut().zip(&self.powers) {
                *c *= power;
            }
            let (least, largest) = hull(&polynomial);
            let borders = [(low, Direction::Down), (high, Direction::Up)];
            for (level, direction) in borders {
                if level.is_infinite() {
                    continue;
                }
                let tolerance = connection.tolerance(level, size, tau);
                let is_far = match direction {
                    Direction::Down => least > level - tolerance,
                    Direction::Up => largest < level + tolerance,
                };
                if is_far || goes_away(&polynomial, level, direction) {
                    continue;
                }
                let Some(x) = first_passage(&polynomial, level, direction, tolerance) else {
                    continue;
                };
                if first.is_none_or(|f| x * step < f.theta) {
                    first = Some(Crossing {
                        theta: x * step,
                        connection: k,
                        direction,
                    });
                }
            }
        }
        first
    }

    /// Puts every connection into the region of its deformation, on a breakpoint into the one below. Returns whether one of
    /// them stands on a breakpoint: [`Regions::leave`] decides there.
    pub fn place(
        &mut self,
        series: &Series,
        (tau, state): (f64, &[f64]),
        deformation: &[f64],
    ) -> bool {
        let size = size(series, state);
        let mut stands = false;
        for (connection, x) in self.connections.iter_mut().zip(deformation) {
            connection.region = 0;
            for level in &connection.law.breakpoints {
                let tolerance = connection.tolerance(*level, size, tau);
                connection.region += usize::from(x - level > tolerance);
                stands |= (x - level).abs() <= tolerance;
            }
        }
        stands
    }

    /// Moves connections that stand on a breakpoint and are about to rise into the region above.
    pub fn leave(&mut self, series: &Series, (tau, state): (f64, &[f64])) {
        let size = size(series, state);
        for (k, connection) in self.connections.iter_mut().enumerate() {
            let polynomial = series.deformation(k);
            loop {
                let (_, level) = connection.law.borders(connection.region);
                if level.is_infinite() {
                    break;
                }
                let tolerance = connection.tolerance(level, size, tau);
                let stands = (polynomial[0] - level).abs() <= tolerance;
                if !(stands && rises(polynomial, tolerance)) {
                    break;
                }
                connection.region += 1;
            }
        }
    }

    /// The breakpoint on which a connection stands and the flank of its region, if it is one in contact.
    pub fn begun(
        &self,
        series: &Series,
        (tau, state): (f64, &[f64]),
        connection: usize,
        deformation: f64,
    ) -> Option<(f64, i8)> {
        let connection = &self.connections[connection];
        let flank = connection.law.flanks[connection.region];
        let (low, high) = connection.law.borders(connection.region);
        let stands = |level: &f64| {
            let tolerance = connection.tolerance(*level, size(series, state), tau);
            (deformation - level).abs() <= tolerance
        };
        let level = [low, high].into_iter().filter(|x| x.is_finite());
        let level = level.into_iter().find(stands)?;
        (flank != 0).then_some((level, flank))
    }

    /// Copies the region of every connection.
    pub fn save(&self, list: &mut [usize]) {
        let regions = self.connections.iter().map(|c| c.region);
        list.iter_mut().zip(regions).for_each(|(l, r)| *l = r);
    }

    /// Exchanges the region of every connection.
    pub fn swap(&mut self, list: &mut [usize]) {
        let regions = self.connections.iter_mut().map(|c| &mut c.region);
        list.iter_mut()
            .zip(regions)
            .for_each(|(l, r)| std::mem::swap(l, r));
    }

    /// Which way a connection has to pass to come into a region.
    pub fn towards(&self, connection: usize, region: usize) -> Option<Direction> {
        match region.cmp(&self.connections[connection].region) {
            Ordering::Less => Some(Direction::Down),
            Ordering::Equal => None,
            Ordering::Greater => Some(Direction::Up),
        }
    }
}

/// Whether a polynomial that starts on a level leaves the tolerance upwards: the sign of the term that does it first (at rest
/// in the origin the tolerance is 0, and that is the lowest one).
fn rises(polynomial: &Polynomial, tolerance: f64) -> bool {
    let terms = polynomial.iter().enumerate().skip(1);
    let terms = terms.filter(|(_, c)| **c != 0.0);
    let leaving = terms.map(|(k, c)| ((tolerance / c.abs()).powf(1.0 / k as f64), *c));
    let first = leaving.min_by(|a, b| a.0.total_cmp(&b.0));
    first.is_some_and(|(_, c)| c > 0.0)
}

/// Whether a polynomial that starts on this side of a level keeps away from it: (p(x) - p(0)) / x has one sign.
fn goes_away(polynomial: &Polynomial, level: f64, direction: Direction) -> bool {
    let slope: [f64; COUNT - 1] = std::array::from_fn(|k| polynomial[k + 1]);
    let (least, largest) = hull(&slope);
    match direction {
        Direction::Up => polynomial[0] <= level && largest <= 0.0,
        Direction::Down => polynomial[0] >= level && least >= 0.0,
    }
}

/// theta^k, four at a time.
fn fill_powers(powers: &mut Polynomial, theta: f64) {
    let square = theta * theta;
    let mut four = [1.0, theta, square, square * theta];
    let factor = square * square;
    for part in powers.as_chunks_mut::<4>().0 {
        *part = four;
        four = four.map(|p| p * factor);
    }
}
