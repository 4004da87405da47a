//! Functions of one variable that are straight between given places and constant outside.

/// Places with values, ascending; a place that is repeated is a jump, of which the later value holds.
#[derive(Debug, Clone, PartialEq)]
pub struct BrokenLine {
    points: Vec<(f64, f64)>,
}

/// A straight piece: value at a place, and slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Straight {
    /// Value.
    pub value: f64,
    /// Slope.
    pub slope: f64,
}

impl BrokenLine {
    /// A line through points.
    ///
    /// # Errors
    /// The number of the first point whose place lies before that of its predecessor, or that is not finite; 0 where there
    /// is not a point.
    pub fn new(points: Vec<(f64, f64)>) -> Result<BrokenLine, usize> {
        if points.is_empty() {
            return Err(0);
        }
        let is_finite = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
        if let Some(k) = points.iter().position(|p| !is_finite(p)) {
            return Err(k);
        }
        match points.windows(2).position(|pair| pair[1].0 < pair[0].0) {
            Some(k) => Err(k + 1),
            None => Ok(BrokenLine { points }),
        }
    }

    /// The same value everywhere.
    pub fn constant(value: f64) -> BrokenLine {
        BrokenLine {
            points: vec![(0.0, value)],
        }
    }

    /// The points.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// Places of the points, ascending, with repetitions.
    pub fn places(&self) -> impl Iterator<Item = f64> + '_ {
        self.points.iter().map(|p| p.0)
    }

    /// Number of points at or before a place.
    pub fn rank(&self, x: f64) -> usize {
        self.points.partition_point(|p| p.0 <= x)
    }

    /// Value on the right of a place.
    pub fn value(&self, x: f64) -> f64 {
        self.on(x, x).value
    }

    /// The straight piece that holds `inside`, extended to x.
    pub(crate) fn on(&self, x: f64, inside: f64) -> Straight {
        let k = self.rank(inside);
        let level = |value| Straight { value, slope: 0.0 };
        match (k.checked_sub(1).map(|k| self.points[k]), self.points.get(k)) {
            (Some((x0, y0)), Some((x1, y1))) => {
                let slope = (y1 - y0) / (x1 - x0);
                let value = if x - x0 <= x1 - x {
                    y0 + slope * (x - x0)
                } else {
                    y1 - slope * (x1 - x)
                };
                Straight { value, slope }
            }
            (Some((_, y)), None) => level(y),
            (None, Some((_, y))) => level(*y),
            (None, None) => level(0.0),
        }
    }

    /// Largest modulus.
    pub fn largest(&self) -> f64 {
        self.points.iter().fold(0.0, |m, p| m.max(p.1.abs()))
    }

    /// The line with places and values multiplied.
    #[must_use]
    pub fn scaled(&self, place: f64, value: f64) -> BrokenLine {
        let points = self.points.iter().map(|p| (place * p.0, value * p.1));
        BrokenLine {
            points: points.collect(),
        }
    }

    /// Offers every value.
    pub(crate) fn visit_values(&mut self, visit: &mut dyn FnMut(&mut [f64])) {
        for (_, value) in &mut self.points {
            visit(std::slice::from_mut(value));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repeated_place_is_a_jump_and_ends_hold() {
        let line = BrokenLine::new(vec![(1.0, 2.0), (2.0, 4.0), (2.0, -1.0), (4.0, 0.0)]);
        let line = line.expect("ascending");
        for (x, y) in [(0.0, 2.0), (1.5, 3.0), (2.0, -1.0), (3.0, -0.5), (9.0, 0.0)] {
            assert_eq!(line.value(x), y, "{x}");
        }
        assert_eq!(line.on(2.0, 1.9).value, 4.0);
        assert_eq!(line.on(2.5, 3.0).slope, 0.5);
        assert_eq!(BrokenLine::new(vec![(1.0, 0.0), (0.5, 0.0)]), Err(1));
        assert_eq!(BrokenLine::new(vec![(1.0, f64::NAN)]), Err(0));
    }
}
