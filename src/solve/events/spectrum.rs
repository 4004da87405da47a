//! The multipliers of one orbit as a set: how many lie outside the unit circle, and which pass it together.

use num_complex::Complex;

/// Width of the unit circle: a multiplier this near to it, as those of undamped systems are, lies on it and not outside.
const CIRCLE: f64 = 1e-9;
/// Imaginary part below which a multiplier is real, relative to its modulus; equal multipliers split by the root of rounding.
const REAL: f64 = 1e-6;
/// Distance from +1 or -1 of a multiplier that passes there.
const AT_ONE: f64 = 1e-3;
/// Largest difference of ln |mu| between multipliers that pass together.
const TOGETHER: f64 = 1e-7;
/// ln |mu| of a multiplier that is not listed.
const HIDDEN: f64 = -30.0;

/// Whether a multiplier lies outside the unit circle.
pub(crate) fn is_outside(mu: Complex<f64>) -> bool {
    mu.norm() > 1.0 + CIRCLE
}

/// Whether a multiplier counts as real.
pub(crate) fn is_real(mu: Complex<f64>) -> bool {
    mu.im.abs() <= REAL * mu.norm()
}

/// What one orbit's multipliers say: their number outside the circle, and whether the numbers beyond +1 and -1 are odd, which
/// changes only where an odd number passes there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Count {
    /// Multipliers outside the unit circle.
    pub outside: usize,
    is_odd_beyond_one: bool,
    is_odd_beyond_minus_one: bool,
}

impl Count {
    /// Of a list by falling modulus; `None` where nothing is known.
    pub fn of(list: &[Complex<f64>]) -> Option<Count> {
        (!list.is_empty()).then(|| Count::among(list.iter().filter(|mu| is_outside(**mu))))
    }

    fn among<'a>(outside: impl Iterator<Item = &'a Complex<f64>>) -> Count {
        let mut count = Count {
            outside: 0,
            is_odd_beyond_one: false,
            is_odd_beyond_minus_one: false,
        };
        for mu in outside {
            count.outside += 1;
            match () {
                _ if !is_real(*mu) => {}
                _ if mu.re > 0.0 => count.is_odd_beyond_one ^= true,
                _ => count.is_odd_beyond_minus_one ^= true,
            }
        }
        count
    }

    /// Whether an odd number of real multipliers has passed -1 on the way to another place.
    pub(crate) fn passes_minus_one(self, other: Count) -> bool {
        self.is_odd_beyond_minus_one != other.is_odd_beyond_minus_one
    }

    /// Events to search for between two places with different counts.
    pub(crate) fn sought(self, other: Count) -> Sought {
        match self.outside == other.outside {
            false => Sought::Rank(self.outside.min(other.outside)),
            true if self.is_odd_beyond_minus_one != other.is_odd_beyond_minus_one => {
                Sought::MinusOne
            }
            true => Sought::PlusOne,
        }
    }
}

/// A function of the whole set that changes its sign where multipliers pass the circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sought {
    /// ln |mu| of the multiplier with this number by falling modulus, from 0: continuous whatever meets, and the first inside
    /// becomes the last outside.
    Rank(usize),
    /// Product of (mu + 1): where as many come in as go out, one of them passes -1.
    MinusOne,
    /// Product of (mu - 1).
    PlusOne,
}

impl Sought {
    /// Value for a list by falling modulus.
    pub fn value(self, list: &[Complex<f64>]) -> f64 {
        let product = |at: f64| {
            let factors = list.iter().map(|mu| (mu - at) / (1.0 + mu.norm()));
            factors.product::<Complex<f64>>().re
        };
        match self {
            Sought::Rank(k) => list.get(k).map_or(HIDDEN, |mu| mu.norm().ln().max(HIDDEN)),
            Sought::MinusOne => product(-1.0),
            Sought::PlusOne => product(1.0),
        }
    }
}

/// Kind of passage of multipliers through the circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CirclePassage {
    /// Through +1.
    PlusOne,
    /// Through -1.
    MinusOne,
    /// As complex pairs.
    Pairs,
}

/// Equal multipliers that pass the circle together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MultiplierGroup {
    /// Place of the passage.
    pub gate: CirclePassage,
    /// Multipliers, or pairs.
    pub multiplicity: usize,
}

/// Multipliers that pass at one place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Passing {
    /// Groups; several where different things happen at one place.
    pub groups: Vec<MultiplierGroup>,
    /// Just before, along the path.
    pub before: Count,
    /// Just behind.
    pub behind: Count,
}

impl Passing {
    /// Multipliers that pass at a located place; `values`: test function at the ends of its bracket.
    pub fn at(list: &[Complex<f64>], values: (f64, f64), sought: Sought) -> Passing {
        let spread = values.0.abs() + values.1.abs();
        let width = match sought {
            Sought::Rank(_) => TOGETHER.max(4.0 * spread),
            Sought::MinusOne | Sought::PlusOne => TOGETHER,
        };
        let nearest = |at: f64| {
            let distances = list.iter().map(|mu| (mu - at).norm());
            distances.fold(f64::INFINITY, f64::min)
        };
        let is_passing = |mu: &Complex<f64>| match sought {
            Sought::Rank(_) => mu.norm().ln().abs() < width,
            Sought::MinusOne => (mu + 1.0).norm() <= nearest(-1.0),
            Sought::PlusOne => (mu - 1.0).norm() <= nearest(1.0),
        };
        let (passing, rest): (Vec<_>, Vec<_>) = list.iter().copied().partition(is_passing);
        let outside = || rest.iter().filter(|mu| is_outside(**mu));
        let (low, high) = (
            Count::among(outside()),
            Count::among(outside().chain(&passing)),
        );
        // A negative product tells of an odd number beyond.
        let is_rising = match sought {
            Sought::Rank(_) => values.0 < values.1,
            Sought::MinusOne => (values.0 < 0.0) == low.is_odd_beyond_minus_one,
            Sought::PlusOne => (values.0 < 0.0) == low.is_odd_beyond_one,
        };
        let (before, behind) = match is_rising {
            true => (low, high),
            false => (high, low),
        };
        Passing {
            groups: groups(&passing),
            before,
            behind,
        }
    }

    /// Multipliers, or pairs, that pass through a gate.
    pub fn number(&self, gate: CirclePassage) -> usize {
        let here = self.groups.iter().filter(|group| group.gate == gate);
        here.map(|group| group.multiplicity).sum()
    }
}

fn groups(passing: &[Complex<f64>]) -> Vec<MultiplierGroup> {
    let mut numbers = [
        (CirclePassage::PlusOne, 0_usize),
        (CirclePassage::MinusOne, 0),
        (CirclePassage::Pairs, 0),
    ];
    for mu in passing {
        let near = |at: f64| (mu - at).norm() < AT_ONE;
        let k = match () {
            _ if near(1.0) => 0,
            _ if near(-1.0) => 1,
            _ => 2,
        };
        numbers[k].1 += 1;
    }
    let found = numbers.iter().filter(|(_, number)| *number > 0);
    found
        .map(|(gate, number)| MultiplierGroup {
            gate: *gate,
            multiplicity: match gate {
                CirclePassage::Pairs => number.div_ceil(2),
                _ => *number,
            },
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(entries: &[(f64, f64)]) -> Vec<Complex<f64>> {
        entries
            .iter()
            .map(|(re, im)| Complex::new(*re, *im))
            .collect()
    }

    #[test]
    fn equal_multipliers_are_one_group() {
        let twins = list(&[(3.0, 0.0), (-1.0, 0.0), (-1.0, 0.0), (0.2, 0.0)]);
        let passing = Passing::at(&twins, (-1e-9, 1e-9), Sought::Rank(1));
        let group = MultiplierGroup {
            gate: CirclePassage::MinusOne,
            multiplicity: 2,
        };
        assert_eq!(passing.groups, [group]);
        assert_eq!((passing.before.outside, passing.behind.outside), (1, 3));
    }

    #[test]
    fn pairs_count_once() {
        let pair = list(&[(0.6, 0.8), (0.6, -0.8), (0.2, 0.0)]);
        let passing = Passing::at(&pair, (1e-9, -1e-9), Sought::Rank(0));
        let group = MultiplierGroup {
            gate: CirclePassage::Pairs,
            multiplicity: 1,
        };
        assert_eq!(passing.groups, [group]);
        assert_eq!((passing.before.outside, passing.behind.outside), (2, 0));
    }

    #[test]
    fn one_in_and_one_out_do_not_cancel() {
        let (a, b) = (
            list(&[(1.5, 0.0), (-0.5, 0.0)]),
            list(&[(-1.5, 0.0), (0.5, 0.0)]),
        );
        let (a, b) = (Count::of(&a).unwrap(), Count::of(&b).unwrap());
        assert_eq!(a.outside, b.outside);
        assert_ne!(a, b);
        assert_eq!(a.sought(b), Sought::MinusOne);
    }
}
