//! Trigonometric polynomials: values, derivatives, extrema.

/// Value, first and second derivative at tau of the polynomial with coefficients mean, sin 1, cos 1, sin 2, ...
pub fn evaluate(coefficients: &[f64], tau: f64) -> [f64; 3] {
    let (step_sin, step_cos) = tau.sin_cos();
    let (mut sin, mut cos) = (step_sin, step_cos);
    let mut sum = [coefficients[0], 0.0, 0.0];
    for (k, pair) in coefficients[1..].chunks_exact(2).enumerate() {
        let k = (k + 1) as f64;
        let value = pair[0] * sin + pair[1] * cos;
        sum[0] += value;
        sum[1] += k * (pair[0] * cos - pair[1] * sin);
        sum[2] -= k * k * value;
        (sin, cos) = (
            sin * step_cos + cos * step_sin,
            cos * step_cos - sin * step_sin,
        );
    }
    sum
}

/// First derivative at the abscissae 2 pi j / out.len(), an even number of them; good to a few digits less than [`evaluate`].
///
/// Clenshaw's recurrence for the even and the odd part on half the period, all abscissae side by side.
pub(crate) fn sample_derivative(coefficients: &[f64], out: &mut [f64]) {
    let half = out.len() / 2;
    let abscissa = |j: usize| std::f64::consts::PI * j as f64 / half as f64;
    let double_cos: Vec<f64> = (0..=half).map(|j| 2.0 * abscissa(j).cos()).collect();
    // Even part sum k s_k cos k tau, odd part -sum k c_k sin k tau; two levels of the recurrence each.
    let mut even = [vec![0.0; half + 1], vec![0.0; half + 1]];
    let mut odd = [vec![0.0; half + 1], vec![0.0; half + 1]];
    for (k, pair) in coefficients[1..].chunks_exact(2).enumerate().rev() {
        let k = (k + 1) as f64;
        for ([upper, lower], c) in [(&mut even, k * pair[0]), (&mut odd, -k * pair[1])] {
            // b_k = c_k + 2 cos(tau) b_k+1 - b_k+2: the older level is overwritten and the two change places.
            for ((old, young), x) in lower.iter_mut().zip(upper.iter()).zip(&double_cos) {
                *old = c + x * young - *old;
            }
            std::mem::swap(upper, lower);
        }
    }
    for j in 0..=half {
        let e = 0.5 * double_cos[j] * even[0][j] - even[1][j];
        let o = abscissa(j).sin() * odd[0][j];
        out[j % out.len()] = e + o;
        if j > 0 && j < half {
            out[2 * half - j] = e - o;
        }
    }
}

/// Coefficients of the derivative: sin parts <- -k cos, cos parts <- k sin. Rook & Singh (1995), D of eq. (10).
pub(crate) fn differentiate(coefficients: &[f64], out: &mut [f64]) {
    out[0] = 0.0;
    let pairs = coefficients[1..]
        .chunks_exact(2)
        .zip(out[1..].chunks_exact_mut(2));
    for (k, (a, d)) in pairs.enumerate() {
        let k = (k + 1) as f64;
        (d[0], d[1]) = (-k * a[1], k * a[0]);
    }
}

/// Mean of the square without the mean: (1/2) sum (sin_k^2 + cos_k^2). Rook & Singh (1995), eq. (15).
pub fn mean_square(coefficients: &[f64]) -> f64 {
    0.5 * coefficients[1..].iter().map(|a| a * a).sum::<f64>()
}

/// Mean of the square of the derivative: (1/2) sum k^2 (sin_k^2 + cos_k^2).
pub(crate) fn mean_square_of_derivative(coefficients: &[f64]) -> f64 {
    let pairs = coefficients[1..].chunks_exact(2).enumerate();
    0.5 * pairs
        .map(|(k, p)| ((k + 1) as f64).powi(2) * (p[0] * p[0] + p[1] * p[1]))
        .sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_differentiated_coefficients() {
        let a = [0.3, 1.0, -2.0, 0.5, 0.25];
        let (mut d, mut dd) = ([0.0; 5], [0.0; 5]);
        differentiate(&a, &mut d);
        differentiate(&d, &mut dd);
        for tau in [0.0, 1.0, 4.5] {
            let [_, first, second] = evaluate(&a, tau);
            assert!((first - evaluate(&d, tau)[0]).abs() < 1e-14);
            assert!((second - evaluate(&dd, tau)[0]).abs() < 1e-14);
        }
        for cells in [64, 66] {
            let mut slopes = vec![0.0; cells];
            sample_derivative(&a, &mut slopes);
            for (j, slope) in slopes.iter().enumerate() {
                let tau = std::f64::consts::TAU * j as f64 / cells as f64;
                assert!((slope - evaluate(&d, tau)[0]).abs() < 1e-13);
            }
        }
        assert!((mean_square_of_derivative(&a) - mean_square(&d)).abs() < 1e-14);
    }
}
