//! A number of a law that is being recorded: the arithmetic that writes to the [`Tape`].

use super::derivatives::Dual;
use super::number::Number;
use super::tape::Tape;
use crate::numeric::taylor::{Affine, Function, Op, ProgramOutput, Register};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that records, with its partial derivatives.
pub type Symbol<'t> = Dual<Traced<'t>>;

/// A number at one place, and how it follows from displacement, velocity and phase.
#[derive(Debug, Clone, Copy)]
pub struct Traced<'t> {
    tape: Option<&'t Tape>,
    value: f64,
    form: ProgramOutput,
}

impl Tape {
    /// Displacement, velocity and phase at a place, with their partial derivatives.
    pub fn inputs(&self, q: f64, v: f64, phase: f64) -> [Symbol<'_>; 3] {
        let affine = |value, q, v| {
            let constant = 0.0;
            Traced::new(
                self,
                value,
                ProgramOutput::Affine(Affine { constant, q, v }),
            )
        };
        let phase = Traced::new(
            self,
            phase,
            ProgramOutput::Register(self.register(Op::Phase)),
        );
        [
            Dual::displacement(affine(q, 1.0, 0.0)),
            Dual::velocity(affine(v, 0.0, 1.0)),
            Dual::constant(phase),
        ]
    }

    /// Displacement, velocity, phase and memory at a place, with their partial derivatives by displacement and velocity.
    pub fn inputs_with_memory(&self, [q, v, phase, z]: [f64; 4]) -> [Symbol<'_>; 4] {
        let [q, v, phase] = self.inputs(q, v, phase);
        [q, v, phase, Dual::constant(self.memory(z))]
    }

    /// The same with the partial derivative by the memory in place of that by the displacement, and none by the velocity.
    pub fn inputs_by_memory(&self, [q, v, phase, z]: [f64; 4]) -> [Symbol<'_>; 4] {
        let motion = self.inputs(q, v, phase).map(|x| Dual::constant(x.value));
        let [q, v, phase] = motion;
        [q, v, phase, Dual::displacement(self.memory(z))]
    }

    fn memory(&self, z: f64) -> Traced<'_> {
        Traced::new(self, z, ProgramOutput::Register(self.register(Op::Memory)))
    }
}

impl<'t> Traced<'t> {
    /// A number of a tape.
    pub(super) fn new(tape: &'t Tape, value: f64, form: ProgramOutput) -> Traced<'t> {
        Traced {
            tape: Some(tape),
            value,
            form,
        }
    }

    /// Where it is.
    pub fn form(&self) -> ProgramOutput {
        self.form
    }

    fn constant(value: f64) -> Traced<'t> {
        let constant = Affine {
            constant: value,
            ..Affine::default()
        };
        Traced {
            tape: None,
            value,
            form: ProgramOutput::Affine(constant),
        }
    }

    /// Coefficients of displacement and velocity, if it is affine in them.
    pub fn affine(&self) -> Option<Affine> {
        match self.form {
            ProgramOutput::Affine(affine) => Some(affine),
            ProgramOutput::Register(_) => None,
        }
    }

    fn as_constant(&self) -> Option<f64> {
        let affine = self.affine().filter(Affine::is_constant)?;
        Some(affine.constant)
    }

    fn with_affine(self, value: f64, affine: Affine) -> Traced<'t> {
        Traced {
            value,
            form: ProgramOutput::Affine(affine),
            ..self
        }
    }

    /// The tape, and a register that holds the number.
    fn placed(&self) -> Option<(&'t Tape, Register)> {
        let tape = self.tape?;
        let register = match self.form {
            ProgramOutput::Register(register) => register,
            ProgramOutput::Affine(affine) => tape.register(Op::Affine(affine)),
        };
        Some((tape, register))
    }

    /// A function of a number: of a constant a constant, else an operation.
    fn apply(
        self,
        function: impl Fn(f64) -> f64,
        record: impl FnOnce(&'t Tape, Register) -> Register,
    ) -> Traced<'t> {
        let value = function(self.value);
        if let Some(constant) = self.as_constant() {
            return Traced::constant(function(constant));
        }
        match self.placed() {
            None => Traced::constant(value),
            Some((tape, x)) => Traced::new(tape, value, ProgramOutput::Register(record(tape, x))),
        }
    }

    /// An operation on two numbers that both vary.
    fn combine(
        self,
        other: Traced<'t>,
        value: f64,
        op: impl FnOnce(Register, Register) -> Op,
    ) -> Traced<'t> {
        let tape = self.tape.or(other.tape);
        let both = [self, other].map(|t| Traced { tape, ..t }.placed());
        let [Some((tape, x)), Some((_, y))] = both else {
            return Traced::constant(value);
        };
        Traced::new(
            tape,
            value,
            ProgramOutput::Register(tape.register(op(x, y))),
        )
    }

    fn scaled(self, factor: f64) -> Traced<'t> {
        let value = factor * self.value;
        match (self.form, factor) {
            (_, 0.0) => Traced::constant(0.0),
            (_, 1.0) => self,
            (ProgramOutput::Affine(a), _) => {
                let Affine { constant, q, v } = a;
                let affine = Affine {
                    constant: factor * constant,
                    q: factor * q,
                    v: factor * v,
                };
                self.with_affine(value, affine)
            }
            _ => self.apply(
                |x| factor * x,
                |tape, x| tape.register(Op::Scale(x, factor)),
            ),
        }
    }

    fn sum(self, other: Traced<'t>, sign: f64) -> Traced<'t> {
        let value = self.value + sign * other.value;
        if let (Some(a), Some(b)) = (self.affine(), other.affine()) {
            let affine = Affine {
                constant: a.constant + sign * b.constant,
                q: a.q + sign * b.q,
                v: a.v + sign * b.v,
            };
            let tape = self.tape.or(other.tape);
            return Traced { tape, ..self }.with_affine(value, affine);
        }
        let offset = |x: Traced<'t>, constant: f64| match constant {
            0.0 => x,
            c => x.apply(|x| x + c, |tape, x| tape.register(Op::Offset(x, c))),
        };
        match (self.as_constant(), other.as_constant()) {
            (Some(a), _) => offset(other.scaled(sign), a),
            (_, Some(b)) => offset(self, sign * b),
            _ if sign < 0.0 => self.combine(other, value, Op::Subtract),
            _ => self.combine(other, value, Op::Add),
        }
    }

    /// x^n for n >= 1 by squaring.
    fn whole_power(self, n: u32) -> Traced<'t> {
        match n {
            0 => Traced::constant(1.0),
            1 => self,
            n if n % 2 == 0 => {
                let half = self.whole_power(n / 2);
                half * half
            }
            n => self * self.whole_power(n - 1),
        }
    }
}

/// Largest whole exponent that becomes products.
const LARGEST_WHOLE: f64 = 64.0;

impl Number for Traced<'_> {
    fn value(self) -> f64 {
        self.value
    }

    fn is_zero(self) -> bool {
        self.as_constant() == Some(0.0)
    }

    fn powi(self, n: i32) -> Self {
        let power = self.whole_power(n.unsigned_abs());
        if n < 0 {
            Traced::constant(1.0) / power
        } else {
            power
        }
    }

    fn powf(self, n: f64) -> Self {
        if n.fract() == 0.0 && n.abs() <= LARGEST_WHOLE {
            return self.powi(n as i32);
        }
        self.apply(|x| x.powf(n), |tape, x| tape.register(Op::Power(x, n)))
    }

    fn pow(self, y: Self) -> Self {
        match y.as_constant() {
            Some(n) => self.powf(n),
            None => (y * self.ln()).exp(),
        }
    }

    fn sqrt(self) -> Self {
        self.apply(f64::sqrt, |tape, x| tape.register(Op::Power(x, 0.5)))
    }

    fn exp(self) -> Self {
        self.apply(f64::exp, |tape, x| tape.register(Op::Exp(x)))
    }

    fn ln(self) -> Self {
        self.apply(f64::ln, |tape, x| tape.register(Op::Log(x)))
    }

    fn sin(self) -> Self {
        let pair = [Function::Sin, Function::Cos];
        self.apply(f64::sin, |tape, x| tape.pair(pair, x, [1.0, -1.0])[0])
    }

    fn cos(self) -> Self {
        let pair = [Function::Sin, Function::Cos];
        self.apply(f64::cos, |tape, x| tape.pair(pair, x, [1.0, -1.0])[1])
    }

    fn tan(self) -> Self {
        let tan = Function::Tan;
        self.apply(f64::tan, |tape, x| tape.with_slope(tan, x, 1.0))
    }

    fn atan(self) -> Self {
        let below = self * self + 1.0;
        self.apply(f64::atan, |tape, x| match below.placed() {
            Some((_, slope_below)) => tape.register(Op::Atan { x, slope_below }),
            None => x,
        })
    }

    fn sinh(self) -> Self {
        let pair = [Function::Sinh, Function::Cosh];
        self.apply(f64::sinh, |tape, x| tape.pair(pair, x, [1.0, 1.0])[0])
    }

    fn cosh(self) -> Self {
        let pair = [Function::Sinh, Function::Cosh];
        self.apply(f64::cosh, |tape, x| tape.pair(pair, x, [1.0, 1.0])[1])
    }

    fn tanh(self) -> Self {
        let tanh = Function::Tanh;
        self.apply(f64::tanh, |tape, x| tape.with_slope(tanh, x, -1.0))
    }
}

impl From<f64> for Traced<'_> {
    fn from(value: f64) -> Self {
        Traced::constant(value)
    }
}

impl PartialEq for Traced<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl PartialOrd for Traced<'_> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl PartialEq<f64> for Traced<'_> {
    fn eq(&self, other: &f64) -> bool {
        self.value == *other
    }
}

impl PartialOrd<f64> for Traced<'_> {
    fn partial_cmp(&self, other: &f64) -> Option<Ordering> {
        self.value.partial_cmp(other)
    }
}

impl Neg for Traced<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        self.scaled(-1.0)
    }
}

impl Add for Traced<'_> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.sum(other, 1.0)
    }
}

impl Sub for Traced<'_> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.sum(other, -1.0)
    }
}

impl Mul for Traced<'_> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        match (self.as_constant(), other.as_constant()) {
            (Some(a), _) => other.scaled(a),
            (_, Some(b)) => self.scaled(b),
            _ => self.combine(other, self.value * other.value, Op::Multiply),
        }
    }
}

impl Div for Traced<'_> {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        match (self.as_constant(), other.as_constant()) {
            (Some(a), Some(b)) => Traced::constant(a / b),
            (Some(0.0), _) => Traced::constant(0.0),
            (_, Some(b)) => self.scaled(1.0 / b),
            _ => self.combine(other, value, Op::Divide),
        }
    }
}

/// The operators with a plain number on the right.
macro_rules! with_numbers {
    ($($operator:ident $method:ident)*) => { $(
        impl $operator<f64> for Traced<'_> {
            type Output = Self;

            fn $method(self, other: f64) -> Self {
                $operator::$method(self, Traced::from(other))
            }
        }
    )* };
}

with_numbers!(Add add Sub sub Mul mul Div div);
