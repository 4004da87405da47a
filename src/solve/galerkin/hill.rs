//! F+ diag(g) F: multiplication by a periodic function, as a matrix on Fourier coefficients.

use nalgebra::DMatrix;

/// Fills (2H + 1) square matrices with F+ diag(g) F; owns its buffers.
#[derive(Debug)]
pub struct Hill {
    /// c_j and s_j for j = -H..2H: the first even, the second odd, so that differences of indices need no cases.
    cos: Vec<f64>,
    sin: Vec<f64>,
}

impl Hill {
    /// Buffers for H harmonics.
    pub fn new(harmonics: usize) -> Hill {
        let buffer = || vec![0.0; 3 * harmonics + 1];
        Hill {
            cos: buffer(),
            sin: buffer(),
        }
    }

    /// Fills `out` with F+ diag(g) F from the coefficients of g up to 2H (4H + 1 values: mean, sin 1, cos 1, ...).
    ///
    /// Toeplitz plus Hankel, block by block; c and s are cosine and sine coefficients of g, c_0 twice its mean:
    /// sin-sin (c_{k-l} - c_{k+l})/2, cos-cos (c_{k-l} + c_{k+l})/2, row sin k column cos l (s_{k+l} + s_{k-l})/2,
    /// row cos k column sin l (s_{k+l} - s_{k-l})/2; the mean row is half the mean column. THEORY of eq. (12).
    pub fn fill(&mut self, g: &[f64], out: &mut DMatrix<f64>) {
        let size = out.nrows();
        let harmonics = size / 2;
        self.extend(g, harmonics);
        let (mean, columns) = out.as_mut_slice().split_at_mut(size);
        mean.copy_from_slice(&g[..size]);
        for (l, columns) in (1..=harmonics).zip(columns.chunks_exact_mut(2 * size)) {
            let (by_sin, by_cos) = columns.split_at_mut(size);
            (by_sin[0], by_cos[0]) = (0.5 * g[2 * l - 1], 0.5 * g[2 * l]);
            let difference = harmonics + 1 - l..2 * harmonics + 1 - l;
            let sum = harmonics + 1 + l..2 * harmonics + 1 + l;
            let pairs = by_sin[1..]
                .chunks_exact_mut(2)
                .zip(by_cos[1..].chunks_exact_mut(2));
            let cos = self.cos[difference.clone()]
                .iter()
                .zip(&self.cos[sum.clone()]);
            let sin = self.sin[difference].iter().zip(&self.sin[sum]);
            for (((by_sin, by_cos), (c, c_sum)), (s, s_sum)) in pairs.zip(cos).zip(sin) {
                (by_sin[0], by_sin[1]) = (0.5 * (c - c_sum), 0.5 * (s_sum - s));
                (by_cos[0], by_cos[1]) = (0.5 * (s_sum + s), 0.5 * (c + c_sum));
            }
        }
    }

    fn extend(&mut self, g: &[f64], harmonics: usize) {
        (self.cos[harmonics], self.sin[harmonics]) = (2.0 * g[0], 0.0);
        for (k, pair) in g[1..].chunks_exact(2).enumerate() {
            let k = k + 1;
            (self.cos[harmonics + k], self.sin[harmonics + k]) = (pair[1], pair[0]);
            if k <= harmonics {
                (self.cos[harmonics - k], self.sin[harmonics - k]) = (pair[1], -pair[0]);
            }
        }
    }
}

/// Adds `scale` (G D) to `out`, D the differentiation matrix: column sin k <- k G cos k, column cos k <- -k G sin k.
pub(crate) fn add_differentiated(g: &DMatrix<f64>, scale: f64, out: &mut DMatrix<f64>) {
    for k in 1..=g.nrows() / 2 {
        let factor = scale * k as f64;
        for i in 0..g.nrows() {
            out[(i, 2 * k - 1)] += factor * g[(i, 2 * k)];
            out[(i, 2 * k)] -= factor * g[(i, 2 * k - 1)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::fourier::Fourier;
    use crate::numeric::trigonometric;

    #[test]
    fn equals_the_product_of_samples() {
        let (harmonics, samples) = (4, 64);
        let c = 2 * harmonics + 1;
        let g: Vec<f64> = (0..4 * harmonics + 1)
            .map(|k| (1.0 + k as f64).sin())
            .collect();
        let a: Vec<f64> = (0..c).map(|k| (2.0 + 3.0 * k as f64).cos()).collect();
        let mut fourier = Fourier::new(samples);
        let (mut x, mut y) = (vec![0.0; samples], vec![0.0; samples]);
        let mut matrix = DMatrix::zeros(c, c);
        Hill::new(harmonics).fill(&g, &mut matrix);
        let mut with_derivative = DMatrix::zeros(c, c);
        add_differentiated(&matrix, 1.0, &mut with_derivative);
        let mut derivative = vec![0.0; c];
        trigonometric::differentiate(&a, &mut derivative);
        for (matrix, signal) in [(&matrix, &a), (&with_derivative, &derivative)] {
            fourier.to_samples(&g, &mut x);
            fourier.to_samples(signal, &mut y);
            let product: Vec<f64> = x.iter().zip(&y).map(|(x, y)| x * y).collect();
            let mut expected = vec![0.0; c];
            fourier.to_coefficients(&product, &mut expected);
            let found = matrix * nalgebra::DVector::from_column_slice(&a);
            assert!(
                found
                    .iter()
                    .zip(&expected)
                    .all(|(f, e)| (f - e).abs() < 1e-13)
            );
        }
    }
}
