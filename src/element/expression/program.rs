//! Evaluation of a formula: instructions on a stack of numbers of any kind, without allocation.

use super::MAX_STACK;
use super::formula::{Binary, Formula, FormulaNode, Instruction, Unary, Variable};
use crate::element::derivatives::Dual;
use crate::element::number::Number;

/// Arguments of a formula.
#[derive(Debug, Clone, Copy)]
pub(super) struct FormulaArguments<N> {
    pub(super) q: N,
    pub(super) v: N,
    pub(super) phase: N,
}

impl<N: Number> FormulaArguments<N> {
    fn variable(&self, variable: Variable) -> N {
        match variable {
            Variable::Displacement => self.q,
            Variable::Velocity => self.v,
            Variable::Phase => self.phase,
        }
    }
}

impl FormulaArguments<Dual> {
    /// At a displacement, at rest and at phase 0.
    pub(super) fn at_rest(q: f64) -> FormulaArguments<Dual> {
        FormulaArguments {
            q: Dual::displacement(q),
            v: Dual::velocity(0.0),
            phase: Dual::constant(0.0),
        }
    }
}

/// Most formulas need no more values at once; a small stack is quicker to lay out.
const SMALL_STACK: usize = 8;

/// Value of a formula.
#[inline]
pub(super) fn run<N: Number>(formula: &Formula, parameters: &[f64], at: FormulaArguments<N>) -> N {
    if formula.stack <= SMALL_STACK {
        run_on::<SMALL_STACK, N>(&formula.code, parameters, at)
    } else {
        run_on::<MAX_STACK, N>(&formula.code, parameters, at)
    }
}

fn run_on<const SIZE: usize, N: Number>(
    code: &[Instruction],
    parameters: &[f64],
    at: FormulaArguments<N>,
) -> N {
    let mut stack = [N::from(0.0); SIZE];
    let (mut count, mut next) = (0, 0);
    while let Some(op) = code.get(next) {
        next += 1;
        match *op {
            Instruction::Binary(operator) => {
                count -= 1;
                stack[count - 1] = binary(operator, stack[count - 1], stack[count]);
            }
            Instruction::Unary(operator) => stack[count - 1] = unary(operator, stack[count - 1]),
            Instruction::Power(n) => stack[count - 1] = stack[count - 1].powi(n),
            Instruction::Skip(to) => next = to,
            Instruction::SkipUnless(to) => {
                count -= 1;
                if stack[count] == 0.0 {
                    next = to;
                }
            }
            Instruction::Number(value) => (stack[count], count) = (N::from(value), count + 1),
            Instruction::Variable(variable) => {
                (stack[count], count) = (at.variable(variable), count + 1)
            }
            Instruction::Parameter(k) => {
                (stack[count], count) = (N::from(parameters[k]), count + 1)
            }
        }
    }
    stack[0]
}

/// Values of the first nodes, those of branches that do not count included.
pub(super) fn values(
    nodes: &[FormulaNode],
    parameters: &[f64],
    at: FormulaArguments<Dual>,
) -> Vec<Dual> {
    let mut list: Vec<Dual> = Vec::with_capacity(nodes.len());
    for node in nodes {
        list.push(match *node {
            FormulaNode::Number(value) => Dual::constant(value),
            FormulaNode::Variable(variable) => at.variable(variable),
            FormulaNode::Parameter(k) => Dual::constant(parameters[k]),
            FormulaNode::Unary(operator, x) => unary(operator, list[x]),
            FormulaNode::Binary(operator, a, b) => binary(operator, list[a], list[b]),
            FormulaNode::If(condition, a, b) => {
                list[if list[condition].value == 0.0 { b } else { a }]
            }
        });
    }
    list
}

fn unary<N: Number>(operator: Unary, x: N) -> N {
    match operator {
        Unary::Negative => -x,
        Unary::Not => truth(x == 0.0),
        Unary::Abs => x.abs(),
        Unary::Sign => x.sign(),
        Unary::Sqrt => x.sqrt(),
        Unary::Exp => x.exp(),
        Unary::Log => x.ln(),
        Unary::Sin => x.sin(),
        Unary::Cos => x.cos(),
        Unary::Tan => x.tan(),
        Unary::Atan => x.atan(),
        Unary::Sinh => x.sinh(),
        Unary::Cosh => x.cosh(),
        Unary::Tanh => x.tanh(),
    }
}

fn binary<N: Number>(operator: Binary, a: N, b: N) -> N {
    match operator {
        Binary::Add => a + b,
        Binary::Subtract => a - b,
        Binary::Multiply => a * b,
        Binary::Divide => a / b,
        Binary::Power => a.pow(b),
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
        Binary::Less => truth(a < b),
        Binary::LessEqual => truth(a <= b),
        Binary::Greater => truth(a > b),
        Binary::GreaterEqual => truth(a >= b),
        Binary::Equal => truth(a == b),
        Binary::NotEqual => truth(a != b),
        Binary::And => truth(a != 0.0 && b != 0.0),
        Binary::Or => truth(a != 0.0 || b != 0.0),
    }
}

fn truth<N: Number>(holds: bool) -> N {
    N::from(f64::from(u8::from(holds)))
}
