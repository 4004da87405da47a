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

/// Coefficients of the derivative: sin parts <- -k cos, cos parts <- k sin. Rook & Singh (1995), D of eq. (10).
pub fn differentiate(coefficients: &[f64], out: &mut [f64]) {
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
pub fn mean_square_of_derivative(coefficients: &[f64]) -> f64 {
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
        assert!((mean_square_of_derivative(&a) - mean_square(&d)).abs() < 1e-14);
    }
}
