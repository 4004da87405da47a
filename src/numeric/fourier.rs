//! Transforms between Fourier coefficients and equally spaced samples of one period.
//!
//! Coefficients are in the order of the paper: mean, sin 1, cos 1, sin 2, cos 2, ... Rook & Singh (1995), eq. (10).

use num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::sync::Arc;

/// Both transforms for a fixed number of samples; owns its buffers.
pub struct Fourier {
    samples: usize,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    spectrum: Vec<Complex<f64>>,
    signal: Vec<f64>,
    scratch: Vec<Complex<f64>>,
}

const LENGTHS_FIT: &str = "buffers are made for this length";

impl Fourier {
    /// Plans for `samples` values per period.
    pub fn new(samples: usize) -> Fourier {
        let mut planner = RealFftPlanner::new();
        let forward = planner.plan_fft_forward(samples);
        let inverse = planner.plan_fft_inverse(samples);
        let scratch = forward.get_scratch_len().max(inverse.get_scratch_len());
        Fourier {
            samples,
            spectrum: forward.make_output_vec(),
            signal: vec![0.0; samples],
            scratch: vec![Complex::default(); scratch],
            forward,
            inverse,
        }
    }

    /// Number of samples per period.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// x_j = a_0 + sum_k a_2k-1 sin(k tau_j) + a_2k cos(k tau_j), tau_j = 2 pi j / samples.
    ///
    /// `coefficients`: 2H + 1 values with 2H < samples; `out`: one value per sample.
    pub fn to_samples(&mut self, coefficients: &[f64], out: &mut [f64]) {
        self.spectrum.fill(Complex::default());
        self.spectrum[0].re = coefficients[0];
        for (x, pair) in self.spectrum[1..]
            .iter_mut()
            .zip(coefficients[1..].chunks_exact(2))
        {
            *x = Complex::new(0.5 * pair[1], -0.5 * pair[0]);
        }
        let length = self.inverse.get_scratch_len();
        self.inverse
            .process_with_scratch(&mut self.spectrum, out, &mut self.scratch[..length])
            .expect(LENGTHS_FIT);
    }

    /// The first coefficients of sampled values (trapezoidal rule, exact below the aliasing limit).
    ///
    /// `out`: 2H + 1 coefficients with 2H < samples.
    pub fn to_coefficients(&mut self, values: &[f64], out: &mut [f64]) {
        self.signal.copy_from_slice(values);
        let length = self.forward.get_scratch_len();
        let (signal, spectrum) = (&mut self.signal, &mut self.spectrum);
        self.forward
            .process_with_scratch(signal, spectrum, &mut self.scratch[..length])
            .expect(LENGTHS_FIT);
        let scale = 1.0 / self.samples as f64;
        out[0] = self.spectrum[0].re * scale;
        for (pair, x) in out[1..].chunks_exact_mut(2).zip(&self.spectrum[1..]) {
            pair[0] = -2.0 * scale * x.im;
            pair[1] = 2.0 * scale * x.re;
        }
    }
}

impl std::fmt::Debug for Fourier {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Fourier({})", self.samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        let a: Vec<f64> = (0..9).map(|k| 1.0 / (1.0 + k as f64)).collect();
        let mut fourier = Fourier::new(32);
        let (mut x, mut b) = (vec![0.0; 32], vec![0.0; 9]);
        fourier.to_samples(&a, &mut x);
        let direct = |tau: f64| {
            a[0] + (1..5)
                .map(|k| a[2 * k - 1] * (k as f64 * tau).sin() + a[2 * k] * (k as f64 * tau).cos())
                .sum::<f64>()
        };
        for (j, x) in x.iter().enumerate() {
            assert!((x - direct(std::f64::consts::TAU * j as f64 / 32.0)).abs() < 1e-14);
        }
        fourier.to_coefficients(&x, &mut b);
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-15));
    }
}
