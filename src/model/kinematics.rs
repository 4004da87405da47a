//! Mean motion of a train: speeds, ratios and tooth orders, from rows of lever arms without any compliance.
//!
//! ```text
//! B thdot = 0:  contact is kept on average in every connection
//! ```
//!
//! Rows of tooth numbers replace rows of base radii, so ratios are exact fractions.

use crate::numeric::fraction::{self, Fraction};
use num_traits::{One, Signed, Zero};
use std::collections::{BTreeMap, VecDeque};

/// One connection in rigid motion: the sum of arm times speed vanishes.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidRow {
    /// Bodies with their arms, in any common unit.
    pub arms: Vec<(usize, Fraction)>,
}

/// Reason why the given speeds do not determine all others.
#[derive(Debug, Clone, PartialEq)]
pub enum SpeedConflict {
    /// A connection contradicts the others.
    Locked {
        /// The connection.
        row: usize,
        /// A body in it that turns, and the arm that would close the row, as a multiple of the written one.
        closing: Option<(usize, f64)>,
    },
    /// A body turns as it likes.
    Undetermined {
        /// The body.
        body: usize,
    },
}

/// A sum of arms times speeds that vanishes to this share of its largest term closes: the rest is rounding of the arms.
const CLOSES: f64 = 1e-9;

/// Speeds of all bodies, from those given and the rows.
///
/// # Errors
/// The first connection that contradicts the others, or a body whose speed does not follow.
pub fn speeds(
    bodies: usize,
    rows: &[RigidRow],
    given: &[(usize, Fraction)],
) -> Result<Vec<Fraction>, SpeedConflict> {
    let mut motion = RigidMotion {
        rows,
        speeds: vec![None; bodies],
        rows_of: vec![Vec::new(); bodies],
        is_used: vec![false; rows.len()],
        due: VecDeque::new(),
    };
    for (k, row) in rows.iter().enumerate() {
        for (body, _) in &row.arms {
            motion.rows_of[*body].push(k);
        }
    }
    for (body, speed) in given {
        motion.set(*body, speed.clone());
    }
    motion.due.extend(0..rows.len());
    motion.propagate()?;
    motion.eliminate()?;
    let unknown = motion.speeds.iter().position(Option::is_none);
    match unknown {
        Some(body) => Err(SpeedConflict::Undetermined { body }),
        None => Ok(motion.speeds.into_iter().flatten().collect()),
    }
}

struct RigidMotion<'a> {
    rows: &'a [RigidRow],
    speeds: Vec<Option<Fraction>>,
    rows_of: Vec<Vec<usize>>,
    /// Rows that have given a speed or have been found to close.
    is_used: Vec<bool>,
    /// Rows to look at: one of their speeds has become known.
    due: VecDeque<usize>,
}

impl RigidMotion<'_> {
    fn set(&mut self, body: usize, speed: Fraction) {
        self.speeds[body] = Some(speed);
        self.due.extend(&self.rows_of[body]);
    }

    /// Takes the speed that every row with a single unknown one gives.
    fn propagate(&mut self) -> Result<(), SpeedConflict> {
        while let Some(k) = self.due.pop_front() {
            if self.is_used[k] {
                continue;
            }
            let arms = &self.rows[k].arms;
            let mut unknown = arms.iter().filter(|(b, _)| self.speeds[*b].is_none());
            let (first, second) = (unknown.next(), unknown.next());
            if second.is_some() {
                continue;
            }
            self.is_used[k] = true;
            match first {
                None => self.check(k)?,
                Some((body, arm)) => {
                    let (sum, largest) = self.sum(k);
                    let speed = if is_rounding(&sum, largest) {
                        Fraction::zero()
                    } else {
                        -sum / arm
                    };
                    self.set(*body, speed);
                }
            }
        }
        Ok(())
    }

    /// Sum of arms times known speeds, and its largest term.
    fn sum(&self, k: usize) -> (Fraction, f64) {
        let terms = self.rows[k].arms.iter();
        let terms = terms.filter_map(|(b, arm)| Some(arm * self.speeds[*b].as_ref()?));
        terms.fold((Fraction::zero(), 0.0), |(sum, largest), term| {
            let size = fraction::to_f64(&term).abs();
            (sum + term, f64::max(largest, size))
        })
    }

    /// Whether a row with known speeds closes.
    fn check(&self, k: usize) -> Result<(), SpeedConflict> {
        let (sum, largest) = self.sum(k);
        if is_rounding(&sum, largest) {
            return Ok(());
        }
        let turns = |(body, arm): &(usize, Fraction)| {
            let term = arm * self.speeds[*body].as_ref()?;
            let share = Fraction::one() - &sum / &term;
            (!term.is_zero()).then(|| (*body, fraction::to_f64(&share)))
        };
        let closing = self.rows[k].arms.iter().rev().find_map(turns);
        Err(SpeedConflict::Locked { row: k, closing })
    }

    /// Rows with several unknown speeds, such as those of planets: Gauss elimination, exact.
    fn eliminate(&mut self) -> Result<(), SpeedConflict> {
        let mut pivots: BTreeMap<usize, Equation> = BTreeMap::new();
        for k in (0..self.rows.len())
            .filter(|k| !self.is_used[*k])
            .collect::<Vec<_>>()
        {
            let mut equation = self.equation(k);
            for (body, pivot) in &pivots {
                equation.subtract(*body, pivot);
            }
            equation.drop_rounding();
            let Some(body) = equation.unknown.keys().next().copied() else {
                match equation.is_closed() {
                    true => continue,
                    false => {
                        return Err(SpeedConflict::Locked {
                            row: k,
                            closing: None,
                        });
                    }
                }
            };
            equation.normalise(body);
            for pivot in pivots.values_mut() {
                pivot.subtract(body, &equation);
            }
            pivots.insert(body, equation);
        }
        for (body, pivot) in pivots {
            if pivot.unknown.len() == 1 {
                self.speeds[body] = Some(-pivot.known);
            }
        }
        Ok(())
    }

    fn equation(&self, k: usize) -> Equation {
        let arms = self.rows[k].arms.iter();
        let unknown = arms.filter(|(b, _)| self.speeds[*b].is_none());
        let (known, largest) = self.sum(k);
        let unknown: BTreeMap<usize, Fraction> = unknown.cloned().collect();
        let sizes = unknown.values().map(|a| fraction::to_f64(a).abs());
        Equation {
            size: sizes.fold(largest, f64::max),
            known,
            unknown,
        }
    }
}

/// sum of unknown + known = 0
struct Equation {
    unknown: BTreeMap<usize, Fraction>,
    known: Fraction,
    /// Largest term that it was made of.
    size: f64,
}

impl Equation {
    /// Takes a body out of the equation by one in which it has the factor 1.
    fn subtract(&mut self, body: usize, pivot: &Equation) {
        let Some(factor) = self.unknown.remove(&body) else {
            return;
        };
        for (other, arm) in pivot.unknown.iter().filter(|(other, _)| **other != body) {
            let entry = self.unknown.entry(*other).or_insert_with(Fraction::zero);
            *entry -= &factor * arm;
        }
        self.known -= &factor * &pivot.known;
        self.unknown.retain(|_, arm| !arm.is_zero());
        self.size = self.size.max(fraction::to_f64(&factor).abs() * pivot.size);
    }

    fn normalise(&mut self, body: usize) {
        let factor = self.unknown[&body].clone();
        self.unknown.values_mut().for_each(|arm| *arm /= &factor);
        self.known /= &factor;
        self.size /= fraction::to_f64(&factor).abs();
    }

    /// Factors that only the rounding of the written arms has left.
    fn drop_rounding(&mut self) {
        let size = self.size;
        self.unknown.retain(|_, arm| !is_rounding(arm, size));
    }

    fn is_closed(&self) -> bool {
        is_rounding(&self.known, self.size)
    }
}

fn is_rounding(sum: &Fraction, largest: f64) -> bool {
    fraction::to_f64(&sum.abs()) <= CLOSES * largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use fraction::whole;

    fn row(arms: &[(usize, i64)]) -> RigidRow {
        RigidRow {
            arms: arms.iter().map(|(b, z)| (*b, whole(*z))).collect(),
        }
    }

    fn text(list: Result<Vec<Fraction>, SpeedConflict>) -> Vec<String> {
        list.expect("speeds")
            .iter()
            .map(Fraction::to_string)
            .collect()
    }

    #[test]
    fn a_planetary_set_follows_willis() {
        // S, R, C, P with 30, 72 and 21 teeth, the ring held.
        let rows = [
            row(&[(0, 30), (3, 21), (2, -51)]),
            row(&[(3, 21), (1, -72), (2, 51)]),
        ];
        let given = [(0, whole(1)), (1, whole(0))];
        assert_eq!(text(speeds(4, &rows, &given)), ["1", "0", "5/17", "-5/7"]);
        let fault = speeds(4, &rows, &given[..1]);
        assert!(
            matches!(fault, Err(SpeedConflict::Undetermined { .. })),
            "{fault:?}"
        );
    }

    #[test]
    fn a_loop_that_does_not_close_names_the_arm() {
        let rows = [row(&[(0, 1), (1, 1)]), row(&[(0, 2), (1, 3)])];
        let fault = speeds(2, &rows, &[(0, whole(1))]);
        let closing = Some((1, 2.0 / 3.0));
        assert_eq!(fault, Err(SpeedConflict::Locked { row: 1, closing }));
    }

    #[test]
    fn a_train_held_by_the_ground_rests() {
        let rows = [
            row(&[(0, 1), (1, -1)]),
            row(&[(1, 1), (2, 2)]),
            row(&[(2, 1)]),
        ];
        assert_eq!(text(speeds(3, &rows, &[])), ["0", "0", "0"]);
    }
}
