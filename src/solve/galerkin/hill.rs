//! F+ diag(g) F: multiplication by a periodic function, as a matrix on Fourier coefficients.

use nalgebra::DMatrix;

/// Fills `out` ((2H + 1) square) with F+ diag(g) F from the coefficients of g up to 2H (4H + 1 values: mean, sin 1, cos 1, ...).
///
/// Toeplitz plus Hankel, block by block; c and s are cosine and sine coefficients of g, c_0 twice its mean:
/// sin-sin (c_{k-l} - c_{k+l})/2, cos-cos (c_{k-l} + c_{k+l})/2, row sin k column cos l (s_{k+l} + s_{k-l})/2,
/// row cos k column sin l (s_{k+l} - s_{k-l})/2; the mean row is half the mean column. THEORY of eq. (12).
pub fn fill(g: &[f64], out: &mut DMatrix<f64>) {
    let harmonics = out.nrows() / 2;
    let cos = |k: usize| if k == 0 { 2.0 * g[0] } else { g[2 * k] };
    let sin = |k: usize| if k == 0 { 0.0 } else { g[2 * k - 1] };
    out[(0, 0)] = g[0];
    for l in 1..=harmonics {
        out[(0, 2 * l - 1)] = 0.5 * sin(l);
        out[(0, 2 * l)] = 0.5 * cos(l);
        out[(2 * l - 1, 0)] = sin(l);
        out[(2 * l, 0)] = cos(l);
        for k in 1..=harmonics {
            let (difference, sum) = (k.abs_diff(l), k + l);
            let sin_difference = if k >= l {
                sin(difference)
            } else {
                -sin(difference)
            };
            out[(2 * k - 1, 2 * l - 1)] = 0.5 * (cos(difference) - cos(sum));
            out[(2 * k, 2 * l)] = 0.5 * (cos(difference) + cos(sum));
            out[(2 * k - 1, 2 * l)] = 0.5 * (sin(sum) + sin_difference);
            out[(2 * k, 2 * l - 1)] = 0.5 * (sin(sum) - sin_difference);
        }
    }
}

/// Adds `scale` (G D) to `out`, D the differentiation matrix: column sin k <- k G cos k, column cos k <- -k G sin k.
pub fn add_differentiated(g: &DMatrix<f64>, scale: f64, out: &mut DMatrix<f64>) {
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
        fill(&g, &mut matrix);
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
