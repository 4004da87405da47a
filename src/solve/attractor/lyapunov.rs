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
    /// ln|R_ii|, one row of values per counted period.
    logarithms: Vec<f64>,
}

/// Lyapunov exponents with what the data say about the largest.
#[derive(Debug, Clone, PartialEq)]
pub struct Exponents {
    /// Exponents in units of 1/time, falling; minus infinity where a deviation is forgotten within a period (held contact, a slider that
    /// slips): its multiplier is 0.
    pub values: Vec<f64>,
    /// Standard error of the largest one, from means over batches of successive periods; infinite for short records.
    pub error: f64,
    /// Time over which the means were taken.
    pub span: f64,
    /// The largest one over each third of the record.
    pub thirds: [f64; 3],
}

/// Stretching below which a deviation is forgotten.
pub(super) const FORGOTTEN: f64 = f64::MIN_POSITIVE;
/// Standard errors that make an exponent significant.
const SIGMAS: f64 = 3.0;
/// Logarithm of the stretching over the record: at least that of a chaotic attractor, at most that of a torus.
const STRETCH: f64 = 3.0;

impl Exponents {
    /// Whether neighbours separate: the largest exponent is more than `SIGMAS` standard errors above 0, has stretched deviations
    /// by more than e^`STRETCH`, and is positive in each third of the record.
    pub(crate) fn is_stretching(&self) -> bool {
        let largest = self.values[0];
        let is_steady = self.thirds.iter().all(|x| *x > 0.0);
        largest > SIGMAS * self.error && largest * self.span > STRETCH && is_steady
    }

    /// Whether neighbours keep their distance on the whole: nothing is stretched by more than e^`STRETCH`, and the largest exponent
    /// is within `SIGMAS` standard errors of 0 or has changed deviations by less than a factor e.
    pub(crate) fn is_neutral(&self) -> bool {
        let largest = self.values[0];
        let is_small = largest.abs() <= (SIGMAS * self.error).max(1.0 / self.span);
        self.error.is_finite() && is_small && largest * self.span <= STRETCH
    }

    /// Whether everything but the direction of the largest exponent contracts over the record, by a factor of which this is the logarithm.
    pub(crate) fn contracts_across(&self, logarithm: f64) -> bool {
        self.values
            .get(1)
            .is_none_or(|second| second * self.span < -logarithm)
    }
}

impl Lyapunov {
    /// A frame of directions: 2n for n coordinates.
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

    /// Forgets the counted periods and keeps the frame.
    pub fn restart(&mut self) {
        self.logarithms.clear();
    }

    fn orthonormalise(&mut self) -> Vec<f64> {
        let size = self.frame.nrows();
        let frame = std::mem::replace(&mut self.frame, DMatrix::zeros(0, 0));
        let (q, r) = frame.qr().unpack();
        self.frame = q;
        // A frame that is not known (NaN) stays so.
        let stretch = |i: usize| match r[(i, i)].abs() {
            tiny if tiny < FORGOTTEN => FORGOTTEN.ln(),
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
        let sum = |i: usize| -> f64 {
            let own = || self.logarithms.iter().skip(i).step_by(size);
            match own().any(|x| *x <= FORGOTTEN.ln()) {
                true => f64::NEG_INFINITY,
                false => own().sum(),
            }
        };
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
            thirds: thirds(&largest).map(|mean| mean / period),
        })
    }
}

/// Mean over each third of a series; what is left over belongs to the last.
fn thirds(series: &[f64]) -> [f64; 3] {
    let length = series.len() / 3;
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1) as f64;
    [
        mean(&series[..length]),
        mean(&series[length..2 * length]),
        mean(&series[2 * length..]),
    ]
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
