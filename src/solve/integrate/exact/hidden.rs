//! Exponentials too small for a series to see.
//!
//! Where tanh x is 1 to rounding its Taylor coefficients are 0: they say nothing of the turn that it takes around x = 0, and a step would
//! pass over it. The same holds for e^x far below rounding. A step that starts there ends where the argument comes back.

use crate::numeric::bernstein::{Direction, first_passage};
use crate::numeric::taylor::{COUNT, Function, Op, Polynomial, Program, Register};

/// An operation with an argument that is to be watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HiddenPart {
    argument: Register,
    kind: HiddenKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HiddenKind {
    /// tanh, sinh, cosh: constant, or a single exponential, on either side.
    TwoSided,
    /// e^x: nothing on the left.
    Left,
}

/// |x| beyond which tanh is constant within rounding, and the smaller one at which a step back ends: 1 - tanh 15 = 2e-13.
const SATURATED: (f64, f64) = (16.0, 15.0);
/// x below which e^x is below rounding, and the larger one at which a step back ends.
const VANISHED: (f64, f64) = (-36.0, -34.0);
/// Accuracy of a passage: the series itself is used on both sides.
const CLOSE: f64 = 1e-6;

/// Quantities to monitor in a program.
pub fn find(program: &Program) -> Vec<HiddenPart> {
    let watched = |op: &Op| match *op {
        Op::Integral {
            function: Function::Tanh | Function::Sinh | Function::Cosh,
            x,
            ..
        } => Some((x, HiddenKind::TwoSided)),
        Op::Exp(x) => Some((x, HiddenKind::Left)),
        _ => None,
    };
    let mut list: Vec<HiddenPart> = Vec::new();
    for (argument, kind) in program.ops.iter().filter_map(watched) {
        let hidden = HiddenPart { argument, kind };
        if !list.contains(&hidden) {
            list.push(hidden);
        }
    }
    list
}

impl HiddenPart {
    /// The first theta within a step at which the argument comes back, if it starts far out.
    pub fn end(&self, registers: &[Polynomial], count: usize, step: f64) -> Option<f64> {
        let argument = &registers[self.argument];
        let (level, direction) = match self.kind {
            HiddenKind::TwoSided if argument[0] > SATURATED.0 => (SATURATED.1, Direction::Down),
            HiddenKind::TwoSided if argument[0] < -SATURATED.0 => (-SATURATED.1, Direction::Up),
            HiddenKind::Left if argument[0] < VANISHED.0 => (VANISHED.1, Direction::Up),
            _ => return None,
        };
        let mut scaled = [0.0; COUNT];
        let mut power = 1.0;
        for (s, c) in scaled.iter_mut().zip(&argument[..count]) {
            *s = c * power;
            power *= step;
        }
        first_passage(&scaled, level, direction, CLOSE).map(|x| x * step)
    }
}
