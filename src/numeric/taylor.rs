//! Taylor series of what a program of elementary functions makes of two series, coefficient by coefficient.
//!
//! A program is a list of operations on registers, each of which holds a series. Coefficient k of every register follows from
//! coefficients up to k of the registers it reads, so that a program runs alongside a recursion that makes its inputs:
//!
//! ```text
//! (x y)_k = sum x_j y_(k-j)        k (exp x)_k = sum j x_j (exp x)_(k-j)        x (x^n)' = n x' x^n        ...
//! ```

use super::bernstein::evaluate;

/// Coefficients of a series: degree + 1, a multiple of four.
pub const COUNT: usize = 24;
/// Taylor coefficients of one quantity.
pub(crate) type Polynomial = [f64; COUNT];

/// A number of a register in a program.
pub(crate) type Register = usize;

/// One operation; its result has the register of its place in the program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Op {
    /// Constant + q x + v y of the two inputs x, y.
    Affine(Affine),
    /// The third input, of degree two: a phase.
    Phase,
    /// The fourth input: what a law remembers.
    Memory,
    /// x + constant.
    Offset(Register, f64),
    /// constant x.
    Scale(Register, f64),
    /// x + y.
    Add(Register, Register),
    /// x - y.
    Subtract(Register, Register),
    /// x y.
    Multiply(Register, Register),
    /// x / y.
    Divide(Register, Register),
    /// x^n for a constant n.
    Power(Register, f64),
    /// e^x.
    Exp(Register),
    /// Natural logarithm of x.
    Log(Register),
    /// Arc tangent of x; `slope_below` holds 1 + x^2.
    Atan {
        /// The argument.
        x: Register,
        /// 1 + x^2.
        slope_below: Register,
    },
    /// A function of x whose derivative is another register: `rate` times x'.
    Integral {
        /// The function, which gives the first coefficient.
        function: Function,
        /// The argument.
        x: Register,
        /// The derivative with respect to x, without the sign.
        slope: Register,
        /// Sign of the derivative.
        sign: f64,
    },
    /// 1 + sign y^2, the derivative of tan (+) or tanh (-).
    Slope {
        /// tan or tanh of something.
        y: Register,
        /// +1 or -1.
        sign: f64,
    },
}

/// Functions that come with a partner which is their derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Function {
    /// Sine, with the cosine.
    Sin,
    /// Cosine, with the sine.
    Cos,
    /// Hyperbolic sine, with the cosine.
    Sinh,
    /// Hyperbolic cosine, with the sine.
    Cosh,
    /// Tangent, with 1 + tan^2.
    Tan,
    /// Hyperbolic tangent, with 1 - tanh^2.
    Tanh,
}

impl Function {
    /// Value at a number.
    pub fn of(self, x: f64) -> f64 {
        match self {
            Function::Sin => x.sin(),
            Function::Cos => x.cos(),
            Function::Sinh => x.sinh(),
            Function::Cosh => x.cosh(),
            Function::Tan => x.tan(),
            Function::Tanh => x.tanh(),
        }
    }
}

/// constant + q x + v y of two inputs x, y.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Affine {
    /// The constant.
    pub constant: f64,
    /// Factor of the first input.
    pub q: f64,
    /// Factor of the second input.
    pub v: f64,
}

impl Affine {
    /// Coefficient k.
    #[inline]
    fn coefficient(&self, k: usize, inputs: &Inputs<'_>) -> f64 {
        let constant = if k == 0 { self.constant } else { 0.0 };
        constant + self.q * inputs.x[k] + self.v * inputs.y[k]
    }

    /// Whether it depends on nothing.
    pub(crate) fn is_constant(&self) -> bool {
        self.q == 0.0 && self.v == 0.0
    }
}

/// Result of a program: a register, or a value that needs none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProgramOutput {
    /// An affine function of the inputs.
    Affine(Affine),
    /// A register.
    Register(Register),
}

/// The inputs of a program.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inputs<'a> {
    /// First series.
    pub x: &'a Polynomial,
    /// Second series.
    pub y: &'a Polynomial,
    /// Coefficients of the third one.
    pub phase: [f64; 3],
    /// Fourth series.
    pub memory: &'a Polynomial,
}

/// Operations in an order in which they can be evaluated, and which registers they are for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Program {
    /// The operations.
    pub(crate) ops: Vec<Op>,
    /// Result.
    pub outputs: Vec<ProgramOutput>,
}

impl Program {
    /// Writes coefficient k of every register; those below k are there.
    #[inline]
    pub(crate) fn step(&self, k: usize, inputs: &Inputs<'_>, registers: &mut [Polynomial]) {
        for (place, op) in self.ops.iter().enumerate() {
            registers[place][k] = coefficient(op, place, k, inputs, registers);
        }
    }

    /// Coefficient k of an output.
    #[inline]
    pub(crate) fn output(
        &self,
        index: usize,
        k: usize,
        inputs: &Inputs<'_>,
        registers: &[Polynomial],
    ) -> f64 {
        match &self.outputs[index] {
            ProgramOutput::Affine(affine) => affine.coefficient(k, inputs),
            ProgramOutput::Register(place) => registers[*place][k],
        }
    }

    /// Whether a phase enters.
    pub(crate) fn reads_phase(&self) -> bool {
        self.ops.contains(&Op::Phase)
    }

    /// Whether every coefficient is finite along x + x' t, y + y' t, z + z' t and an even phase.
    pub(crate) fn is_analytic_along(&self, [x, y, memory, phase]: [(f64, f64); 4]) -> bool {
        let line = |(value, slope): (f64, f64)| {
            let mut series = [0.0; COUNT];
            (series[0], series[1]) = (value, slope);
            series
        };
        let (x, y) = (line(x), line(y));
        let inputs = Inputs {
            x: &x,
            y: &y,
            phase: [phase.0, phase.1, 0.0],
            memory: &line(memory),
        };
        let mut registers = vec![[0.0; COUNT]; self.ops.len()];
        (0..COUNT).for_each(|k| self.step(k, &inputs, &mut registers));
        registers.as_flattened().iter().all(|c| c.is_finite())
    }

    /// Values of the outputs at numbers x, y, z and a phase instead of series.
    pub fn values(&self, [x, y, memory, phase]: [f64; 4]) -> Vec<f64> {
        let constant = |value: f64| {
            let mut series = [0.0; COUNT];
            series[0] = value;
            series
        };
        let (x, y) = (constant(x), constant(y));
        let inputs = Inputs {
            x: &x,
            y: &y,
            phase: [phase, 0.0, 0.0],
            memory: &constant(memory),
        };
        let mut registers = vec![[0.0; COUNT]; self.ops.len()];
        self.step(0, &inputs, &mut registers);
        let outputs = 0..self.outputs.len();
        outputs
            .map(|index| self.output(index, 0, &inputs, &registers))
            .collect()
    }
}

#[inline]
fn coefficient(
    op: &Op,
    place: usize,
    k: usize,
    inputs: &Inputs<'_>,
    registers: &[Polynomial],
) -> f64 {
    match *op {
        Op::Affine(affine) => affine.coefficient(k, inputs),
        Op::Phase => match k {
            0..3 => inputs.phase[k],
            _ => 0.0,
        },
        Op::Memory => inputs.memory[k],
        Op::Offset(x, constant) => registers[x][k] + if k == 0 { constant } else { 0.0 },
        Op::Scale(x, constant) => constant * registers[x][k],
        Op::Add(x, y) => registers[x][k] + registers[y][k],
        Op::Subtract(x, y) => registers[x][k] - registers[y][k],
        Op::Multiply(x, y) => convolve(&registers[x], &registers[y], k),
        Op::Divide(x, y) => {
            let (above, below) = (&registers[x], &registers[y]);
            // A quotient that has vanished, as 1/cosh x far out, stays so.
            if below[0].is_infinite() && above[k].is_finite() {
                return 0.0;
            }
            (above[k] - partial(below, &registers[place], 1, k)) / below[0]
        }
        Op::Power(x, n) => power(&registers[x], &registers[place], n, k),
        Op::Exp(x) if k == 0 => registers[x][0].exp(),
        Op::Exp(x) => weighted(&registers[x], &registers[place], 1, k) / k as f64,
        Op::Log(x) if k == 0 => registers[x][0].ln(),
        Op::Log(x) => integral(&registers[x], &registers[x], &registers[place], k),
        Op::Atan { x, .. } if k == 0 => registers[x][0].atan(),
        Op::Atan { x, slope_below } => {
            integral(&registers[x], &registers[slope_below], &registers[place], k)
        }
        Op::Integral { function, x, .. } if k == 0 => function.of(registers[x][0]),
        Op::Integral { x, slope, sign, .. } => {
            sign * weighted(&registers[x], &registers[slope], 1, k) / k as f64
        }
        Op::Slope { y, sign } => {
            let square = convolve(&registers[y], &registers[y], k);
            sign * square + if k == 0 { 1.0 } else { 0.0 }
        }
    }
}

/// sum_(j=0..k) a_j b_(k-j)
#[inline]
pub(crate) fn convolve(a: &Polynomial, b: &Polynomial, k: usize) -> f64 {
    partial(a, b, 0, k)
}

/// sum_(j=from..k) a_j b_(k-j), in two chains.
#[inline]
fn partial(a: &Polynomial, b: &Polynomial, from: usize, k: usize) -> f64 {
    if from > k {
        return 0.0;
    }
    let (a, b) = (&a[from..=k], &b[..=k - from]);
    let (mut even, mut odd) = (0.0, 0.0);
    let (pairs, last) = a.as_chunks::<2>();
    for ([a0, a1], [b1, b0]) in pairs.iter().zip(b.as_rchunks::<2>().1.iter().rev()) {
        even += a0 * b0;
        odd += a1 * b1;
    }
    if let Some(a) = last.first() {
        even += a * b[0];
    }
    even + odd
}

/// sum_(j=from..k) j a_j b_(k-j)
#[inline]
fn weighted(a: &Polynomial, b: &Polynomial, from: usize, k: usize) -> f64 {
    (from..=k).fold(0.0, |sum, j| sum + j as f64 * a[j] * b[k - j])
}

/// Coefficient k of y with y' = x' / d:   k y_k d_0 = k x_k - sum_(j=1..k-1) j y_j d_(k-j)
#[inline]
fn integral(x: &Polynomial, d: &Polynomial, y: &Polynomial, k: usize) -> f64 {
    let rest = (1..k).fold(0.0, |sum, j| sum + j as f64 * y[j] * d[k - j]);
    (x[k] - rest / k as f64) / d[0]
}

/// Coefficient k of y = x^n:   k x_0 y_k = sum_(j=1..k) (n j - (k - j)) x_j y_(k-j)
#[inline]
fn power(x: &Polynomial, y: &Polynomial, n: f64, k: usize) -> f64 {
    if k == 0 {
        return x[0].powf(n);
    }
    let order = k as f64;
    let sum = (1..=k).fold(0.0, |sum, j| {
        sum + ((n + 1.0) * j as f64 - order) * x[j] * y[k - j]
    });
    sum / (order * x[0])
}

/// Value of a series at theta.
pub fn value(series: &Polynomial, theta: f64) -> f64 {
    evaluate(series, theta).0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Series of x = 0.4 + 0.3 t - 0.2 t^2, y = 0.7 - 0.1 t, and a phase 0.5 + 0.2 t.
    fn check(ops: Vec<Op>, function: impl Fn(f64, f64, f64) -> f64) {
        let (mut x, mut y) = ([0.0; COUNT], [0.0; COUNT]);
        x[..3].copy_from_slice(&[0.4, 0.3, -0.2]);
        y[..2].copy_from_slice(&[0.7, -0.1]);
        let last = ops.len() - 1;
        let program = Program {
            outputs: vec![ProgramOutput::Register(last)],
            ops,
        };
        let inputs = Inputs {
            x: &x,
            y: &y,
            phase: [0.5, 0.2, 0.0],
            memory: &[0.0; COUNT],
        };
        let mut registers = vec![[0.0; COUNT]; last + 1];
        (0..COUNT).for_each(|k| program.step(k, &inputs, &mut registers));
        for t in [0.0, 0.05, -0.1, 0.2] {
            let exact = function(evaluate(&x, t).0, evaluate(&y, t).0, 0.5 + 0.2 * t);
            let found = value(&registers[last], t);
            assert!(
                (found - exact).abs() < 1e-13 * exact.abs().max(1.0),
                "{:?} at {t}: {found} is not {exact}",
                program.ops
            );
        }
    }

    #[test]
    fn series_of_every_operation() {
        let q = Op::Affine(Affine {
            constant: 0.0,
            q: 1.0,
            v: 0.0,
        });
        let v = Op::Affine(Affine {
            constant: 0.2,
            q: 0.0,
            v: 2.0,
        });
        check(vec![v], |_, y, _| 0.2 + 2.0 * y);
        check(vec![q, v, Op::Multiply(0, 1)], |x, y, _| {
            x * (0.2 + 2.0 * y)
        });
        check(vec![q, v, Op::Divide(0, 1)], |x, y, _| x / (0.2 + 2.0 * y));
        check(
            vec![q, v, Op::Add(0, 1), Op::Subtract(2, 0), Op::Scale(3, 3.0)],
            |_, y, _| 3.0 * (0.2 + 2.0 * y),
        );
        check(vec![q, Op::Offset(0, 1.5), Op::Exp(1)], |x, _, _| {
            (x + 1.5).exp()
        });
        check(vec![q, Op::Log(0)], |x, _, _| x.ln());
        check(vec![q, Op::Power(0, 1.5)], |x, _, _| x.powf(1.5));
        check(vec![q, Op::Power(0, -2.0)], |x, _, _| x.powi(-2));
        check(vec![Op::Phase, Op::Power(0, 0.5)], |_, _, p| p.sqrt());
        let square = [q, Op::Multiply(0, 0), Op::Offset(1, 1.0)];
        let atan = Op::Atan {
            x: 0,
            slope_below: 2,
        };
        check([&square[..], &[atan]].concat(), |x, _, _| x.atan());
    }

    #[test]
    fn series_of_functions_with_a_partner() {
        let q = Op::Affine(Affine {
            constant: 0.1,
            q: 2.0,
            v: 0.0,
        });
        let pair = |function, partner, sign, back| {
            let first = Op::Integral {
                function,
                x: 0,
                slope: 2,
                sign,
            };
            let second = Op::Integral {
                function: partner,
                x: 0,
                slope: 1,
                sign: back,
            };
            vec![q, first, second]
        };
        use Function::{Cos, Cosh, Sin, Sinh, Tan, Tanh};
        check(pair(Sin, Cos, 1.0, -1.0), |x, _, _| (0.1 + 2.0 * x).cos());
        check(pair(Cos, Sin, -1.0, 1.0), |x, _, _| (0.1 + 2.0 * x).sin());
        check(pair(Sinh, Cosh, 1.0, 1.0), |x, _, _| (0.1 + 2.0 * x).cosh());
        for (function, sign) in [(Tan, 1.0), (Tanh, -1.0)] {
            let first = Op::Integral {
                function,
                x: 0,
                slope: 2,
                sign: 1.0,
            };
            let ops = vec![q, first, Op::Slope { y: 1, sign }, Op::Scale(1, 1.0)];
            check(ops, |x, _, _| function.of(0.1 + 2.0 * x));
        }
    }
}
