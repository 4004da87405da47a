//! Numbers that record what is done with them: the force of a law becomes a program, and the program has Taylor series.
//!
//! A law is followed once in each region between its breakpoints, at one place; the operations it goes through there are the
//! same everywhere in the region. What is affine in displacement and velocity stays a number triple and needs no operation.

use crate::numeric::taylor::{Function, Op, Program, ProgramOutput, Register};
use std::cell::RefCell;
use std::collections::HashMap;

/// Operations recorded so far, every one once.
///
/// Numbers are copied freely and all write to one tape: the one place with shared ownership.
#[derive(Debug, Default)]
pub struct Tape {
    ops: RefCell<Vec<Op>>,
    known: RefCell<HashMap<[u64; 4], Register>>,
}

impl Tape {
    /// The operations required for some numbers, without all others.
    pub fn program(&self, outputs: &[ProgramOutput]) -> Program {
        let ops = self.ops.borrow();
        let mut is_needed = vec![false; ops.len()];
        let register = |output: &ProgramOutput| match output {
            ProgramOutput::Register(register) => Some(*register),
            ProgramOutput::Affine(_) => None,
        };
        let mut waiting: Vec<Register> = outputs.iter().filter_map(register).collect();
        while let Some(register) = waiting.pop() {
            if !std::mem::replace(&mut is_needed[register], true) {
                reads(&ops[register], |r| waiting.push(r));
            }
        }
        let mut next = 0;
        let mut places = vec![0; ops.len()];
        for (place, needed) in places.iter_mut().zip(&is_needed) {
            *place = next;
            next += usize::from(*needed);
        }
        let kept = ops.iter().zip(&is_needed).filter(|(_, needed)| **needed);
        let form = |output: &ProgramOutput| match output {
            ProgramOutput::Register(register) => ProgramOutput::Register(places[*register]),
            affine => *affine,
        };
        Program {
            ops: kept.map(|(op, _)| moved(op, |r| places[r])).collect(),
            outputs: outputs.iter().map(form).collect(),
        }
    }

    /// The register of an operation, which is recorded unless it is known.
    pub(super) fn register(&self, op: Op) -> Register {
        let mut ops = self.ops.borrow_mut();
        let mut known = self.known.borrow_mut();
        *known.entry(key(&op)).or_insert_with(|| {
            ops.push(op);
            ops.len() - 1
        })
    }

    /// Registers of two functions of x that are each other's derivative.
    pub(super) fn pair(
        &self,
        [first, second]: [Function; 2],
        x: Register,
        signs: [f64; 2],
    ) -> [Register; 2] {
        let op = |function, slope, sign| Op::Integral {
            function,
            x,
            slope,
            sign,
        };
        // The place of the next operation, unless the pair is known.
        let known = self.known.borrow().get(&function_key(first, x)).copied();
        let begin = known.unwrap_or(self.ops.borrow().len());
        let a = self.register(op(first, begin + 1, signs[0]));
        let b = self.register(op(second, begin, signs[1]));
        [a, b]
    }

    /// The register of tan x or tanh x, followed by that of its derivative.
    pub(super) fn with_slope(&self, function: Function, x: Register, sign: f64) -> Register {
        let known = self.known.borrow().get(&function_key(function, x)).copied();
        let begin = known.unwrap_or(self.ops.borrow().len());
        let y = self.register(Op::Integral {
            function,
            x,
            slope: begin + 1,
            sign: 1.0,
        });
        self.register(Op::Slope { y, sign });
        y
    }
}

/// Calls back with every register that an operation reads.
fn reads(op: &Op, mut read: impl FnMut(Register)) {
    match *op {
        Op::Affine(_) | Op::Phase | Op::Memory => {}
        Op::Offset(x, _) | Op::Scale(x, _) | Op::Power(x, _) | Op::Exp(x) | Op::Log(x) => read(x),
        Op::Add(x, y) | Op::Subtract(x, y) | Op::Multiply(x, y) | Op::Divide(x, y) => {
            read(x);
            read(y);
        }
        Op::Atan { x, slope_below } => {
            read(x);
            read(slope_below);
        }
        Op::Integral { x, slope, .. } => {
            read(x);
            read(slope);
        }
        Op::Slope { y, .. } => read(y),
    }
}

/// The same operation with other registers.
fn moved(op: &Op, to: impl Fn(Register) -> Register) -> Op {
    match *op {
        Op::Affine(_) | Op::Phase | Op::Memory => *op,
        Op::Offset(x, c) => Op::Offset(to(x), c),
        Op::Scale(x, c) => Op::Scale(to(x), c),
        Op::Power(x, n) => Op::Power(to(x), n),
        Op::Exp(x) => Op::Exp(to(x)),
        Op::Log(x) => Op::Log(to(x)),
        Op::Add(x, y) => Op::Add(to(x), to(y)),
        Op::Subtract(x, y) => Op::Subtract(to(x), to(y)),
        Op::Multiply(x, y) => Op::Multiply(to(x), to(y)),
        Op::Divide(x, y) => Op::Divide(to(x), to(y)),
        Op::Atan { x, slope_below } => Op::Atan {
            x: to(x),
            slope_below: to(slope_below),
        },
        Op::Integral {
            function,
            x,
            slope,
            sign,
        } => Op::Integral {
            function,
            x: to(x),
            slope: to(slope),
            sign,
        },
        Op::Slope { y, sign } => Op::Slope { y: to(y), sign },
    }
}

/// Key of a function with a partner: its argument alone decides.
fn function_key(function: Function, x: Register) -> [u64; 4] {
    [12, function as u64, x as u64, 0]
}

/// Equal for equal operations.
fn key(op: &Op) -> [u64; 4] {
    let pair = |kind, x: Register, y: Register| [kind, x as u64, y as u64, 0];
    match *op {
        Op::Affine(a) => [0, a.constant.to_bits(), a.q.to_bits(), a.v.to_bits()],
        Op::Phase => [1, 0, 0, 0],
        Op::Memory => [14, 0, 0, 0],
        Op::Offset(x, c) => [2, x as u64, c.to_bits(), 0],
        Op::Scale(x, c) => [3, x as u64, c.to_bits(), 0],
        Op::Power(x, n) => [4, x as u64, n.to_bits(), 0],
        Op::Exp(x) => pair(5, x, 0),
        Op::Log(x) => pair(6, x, 0),
        Op::Add(x, y) => pair(7, x, y),
        Op::Subtract(x, y) => pair(8, x, y),
        Op::Multiply(x, y) => pair(9, x, y),
        Op::Divide(x, y) => pair(10, x, y),
        Op::Atan { x, slope_below } => pair(11, x, slope_below),
        Op::Integral { function, x, .. } => function_key(function, x),
        Op::Slope { y, sign } => [13, y as u64, sign.to_bits(), 0],
    }
}
