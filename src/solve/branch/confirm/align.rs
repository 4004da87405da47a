//! Points of two polylines along one curve matched in order, where the arms of a fold may lie closer together than the lines apart.
//!
//! ```text
//! min over j_0 <= j_1 <= ... of the sum over k of |p_k - x_{j_k}|^2,    j_0 and the last j at the ends
//! ```
//!
//! by dynamic programming: the nearest point alone may lie on the other arm.

use nalgebra::DVector;

/// Position of every point along the path, in vertices of the path: ascending, from its first vertex to its last.
pub(super) fn align(
    points: &[DVector<f64>],
    path: &[DVector<f64>],
    dot: &dyn Fn(&DVector<f64>, &DVector<f64>) -> f64,
) -> Vec<f64> {
    let vertices = vertices(points, path, dot);
    let mut places: Vec<f64> = Vec::with_capacity(points.len());
    for (point, vertex) in points.iter().zip(vertices) {
        let earlier = places.last().copied().unwrap_or(0.0);
        places.push(beside(point, path, vertex, dot).max(earlier));
    }
    places
}

/// The vertex of every point.
fn vertices(
    points: &[DVector<f64>],
    path: &[DVector<f64>],
    dot: &dyn Fn(&DVector<f64>, &DVector<f64>) -> f64,
) -> Vec<usize> {
    let (rows, count) = (points.len(), path.len());
    // Least cost of the points so far with the last one at a vertex, and the vertex of the point before.
    let mut cost = vec![f64::INFINITY; count];
    let mut from = vec![0_u32; rows * count];
    let mut gap = path[0].clone();
    let mut squared = |p: &DVector<f64>, x: &DVector<f64>| {
        gap.copy_from(p);
        gap -= x;
        dot(&gap, &gap)
    };
    cost[0] = 0.0;
    for k in 1..rows {
        let mut best = (f64::INFINITY, 0);
        for j in 0..count {
            if cost[j] < best.0 {
                best = (cost[j], j);
            }
            from[k * count + j] = best.1 as u32;
            cost[j] = best.0 + squared(&points[k], &path[j]);
        }
    }
    let mut list = vec![count - 1; rows];
    for k in (1..rows).rev() {
        list[k - 1] = from[k * count + list[k]] as usize;
    }
    list
}

/// The place nearest to a point on the two segments at a vertex.
fn beside(
    point: &DVector<f64>,
    path: &[DVector<f64>],
    vertex: usize,
    dot: &dyn Fn(&DVector<f64>, &DVector<f64>) -> f64,
) -> f64 {
    let mut best = (f64::INFINITY, vertex as f64);
    let segments = vertex.saturating_sub(1)..(vertex + 1).min(path.len() - 1);
    for j in segments {
        let along = &path[j + 1] - &path[j];
        let gap = point - &path[j];
        let share = dot(&gap, &along) / dot(&along, &along).max(f64::MIN_POSITIVE);
        let share = share.clamp(0.0, 1.0);
        let aside = gap - along * share;
        let distance = dot(&aside, &aside);
        if distance < best.0 {
            best = (distance, j as f64 + share);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_stay_on_their_arm() {
        // A narrow turn at 1; the points lie nearer to the other arm than to their own.
        let at = |x: f64, y: f64| DVector::from_vec(vec![x, y]);
        let there = (0..=100).map(|k| at(0.01 * f64::from(k), 0.0));
        let back = (0..=100).map(|k| at(1.0 - 0.01 * f64::from(k), 1e-3));
        let path: Vec<_> = there.chain(back).collect();
        let points = [
            (0.0, 0.0),
            (0.5, 9e-4),
            (0.9, 9e-4),
            (0.95, 1e-4),
            (0.8, 1e-4),
            (0.0, 1e-3),
        ];
        let points = points.map(|(x, y)| at(x, y));
        let places = align(&points, &path, &|a, b| a.dot(b));
        let wanted = [0.0, 50.0, 90.0, 95.0, 121.0, 201.0];
        for (place, wanted) in places.iter().zip(wanted) {
            assert!((place - wanted).abs() < 1e-9, "{places:?}");
        }
    }
}
