//! Polynomials through a few places.

use super::roots;

/// Weights of the values at `nodes` in the polynomial through them at x, into `weights`.
pub fn weights(nodes: &[f64], x: f64, weights: &mut [f64]) {
    for (k, weight) in weights.iter_mut().enumerate() {
        let others = nodes.iter().enumerate().filter(|(j, _)| *j != k);
        let shares = others.map(|(_, other)| (x - other) / (nodes[k] - other));
        *weight = shares.product();
    }
}

/// Zero of the cubic through four places between the middle two, whose values differ in sign.
pub fn root(nodes: &[f64; 4], values: &[f64; 4]) -> f64 {
    let mut share = [0.0; 4];
    let mut value = |x: f64| {
        weights(nodes, x, &mut share);
        Ok::<f64, std::convert::Infallible>(share.iter().zip(values).map(|(w, v)| w * v).sum())
    };
    let width = f64::EPSILON * (nodes[2] - nodes[1]).abs();
    let ends = ((nodes[1], values[1]), (nodes[2], values[2]));
    match roots::bracketed(&mut value, ends.0, ends.1, width) {
        Ok(found) => found.root,
        Err(never) => match never {},
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_met_exactly() {
        let cubic = |x: f64| (x - 0.3) * (x * x + 2.0);
        let nodes = [-2.0, -1.0, 1.0, 2.0];
        approx::assert_relative_eq!(root(&nodes, &nodes.map(cubic)), 0.3, max_relative = 1e-14);
        let mut share = [0.0; 4];
        weights(&nodes, 0.7, &mut share);
        let value: f64 = share.iter().zip(nodes.map(cubic)).map(|(w, v)| w * v).sum();
        approx::assert_relative_eq!(value, cubic(0.7), max_relative = 1e-14);
    }
}
