//! Lyapunov exponents by QR of the state-transition matrices, period after period.

use nalgebra::DMatrix;

/// Counted periods below which no statistical error is given.
const LEAST: usize = 20;
/// Batches over which the error of the largest exponent is estimated.
const BATCHES: usize = 10;

/// Accumulates the stretching of a moving orthonormal frame.
///
/// With Phi_k the transition matrix of period k: Z = Phi_k Q_(k-1), Q_k R_k = Z, and the exponents are the means of
/// ln|diag R_k| over the period. (Benettin's method.)
#[derive(Debug, Clone)]
pub struct Lyapunov {
    frame: DMatrix<f64>,
    /// ln|R_ii|, one row of values a counted period.
    logarithms: Vec<f64>,
}

/// Lyapunov exponents with what the data say about the largest.
#[derive(Debug, Clone, PartialEq)]
pub struct Exponents {
    /// Exponents in units of 1/time, falling.
    pub values: Vec<f64>,
    /// Standard error of the largest one, from means over batches of successive periods; infinite for short records.
    pub error: f64,
    /// Time over which the means were taken.
    pub span: f64,
}

impl Lyapunov {
    /// A frame of so many directions: 2n for n coordinates.
    pub fn new(size: usize) -> Lyapunov {
        Lyapunov {
            frame: DMatrix::identity(size, size),
            logarithms: Vec::new(),
        }
    }

    /// The frame, to be multiplied from the left by the transition matrix of the next period.
    pub fn frame_mut(&mut self) -> &mut DMatrix<f64> {
        &mut self.frame
    }

    /// Makes the frame orthonormal again without counting the period: the directions are still turning into place.
    pub fn skip(&mut self) {
        self.orthonormalise();
    }

    /// Makes the frame orthonormal again and counts the period.
    pub fn count(&mut self) {
        let stretch = self.orthonormalise();
        self.logarithms.extend(stretch);
    }

    fn orthonormalise(&mut self) -> Vec<f64> {
        let size = self.frame.nrows();
        let frame = std::mem::replace(&mut self.frame, DMatrix::zeros(0, 0));
        let (q, r) = frame.qr().unpack();
        self.frame = q;
        // A frame that is not known (NaN) stays so.
        let stretch = |i: usize| match r[(i, i)].abs() {
            tiny if tiny < f64::MIN_POSITIVE => f64::MIN_POSITIVE.ln(),
            stretch => stretch.ln(),
        };
        (0..size).map(stretch).collect()
    }

    /// Exponents over the counted periods of that length; `None` when nothing finite was counted.
    pub fn exponents(&self, period: f64) -> Option<Exponents> {
        let size = self.frame.nrows();
        let count = self.logarithms.len() / size.max(1);
        if count == 0 || self.logarithms.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let span = period * count as f64;
        let sum = |i: usize| self.logarithms.iter().skip(i).step_by(size).sum::<f64>();
        let mut order: Vec<(usize, f64)> = (0..size).map(|i| (i, sum(i) / span)).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        let largest: Vec<f64> = (self.logarithms.iter())
            .skip(order[0].0)
            .step_by(size)
            .copied()
            .collect();
        Some(Exponents {
            values: order.into_iter().map(|(_, value)| value).collect(),
            error: standard_error(&largest) / period,
            span,
        })
    }
}

/// Standard error of the mean of a correlated series: spread of the means of successive batches.
fn standard_error(series: &[f64]) -> f64 {
    if series.len() < LEAST {
        return f64::INFINITY;
    }
    let length = series.len() / BATCHES;
    let means: Vec<f64> = (series.chunks_exact(length).take(BATCHES))
        .map(|batch| batch.iter().sum::<f64>() / length as f64)
        .collect();
    let count = means.len() as f64;
    let mean = means.iter().sum::<f64>() / count;
    let spread = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>();
    (spread / (count * (count - 1.0))).sqrt()
}
