//! Distances in a record of points.

use super::record::RecordStretch;
use nalgebra::{DMatrix, DMatrixView};

/// The points of a record with what they are measured by.
pub(super) struct Cloud<'a> {
    pub points: &'a [f64],
    /// Derivatives of the map that lead to the last points, column by column.
    derivatives: &'a [f64],
    /// Values in a point.
    pub size: usize,
    /// Largest modulus of every coordinate, at least a thousandth of the largest of all.
    pub scale: Vec<f64>,
}

impl<'a> Cloud<'a> {
    pub fn new(stretch: &'a RecordStretch, size: usize) -> Cloud<'a> {
        let points = stretch.points.as_slice();
        let mut scale = vec![0.0_f64; size];
        for point in points.chunks_exact(size) {
            for (s, x) in scale.iter_mut().zip(point) {
                *s = s.max(x.abs());
            }
        }
        // A coordinate that nearly vanishes at this phase holds the errors of the others.
        let largest = scale.iter().fold(f64::MIN_POSITIVE, |m, s| m.max(*s));
        let scale = scale.iter().map(|s| s.max(1e-3 * largest)).collect();
        Cloud {
            points,
            derivatives: &stretch.derivatives,
            size,
            scale,
        }
    }

    /// The record without its last points.
    pub fn without(&self, last: usize) -> Cloud<'a> {
        let numbers = self.size * self.size;
        let kept = self.derivatives.len().saturating_sub(last * numbers);
        Cloud {
            points: &self.points[..self.points.len() - last * self.size],
            derivatives: &self.derivatives[..kept],
            size: self.size,
            scale: self.scale.clone(),
        }
    }

    pub fn count(&self) -> usize {
        self.points.len() / self.size
    }

    pub fn point(&self, k: usize) -> &'a [f64] {
        &self.points[k * self.size..(k + 1) * self.size]
    }

    pub fn last(&self) -> &'a [f64] {
        self.point(self.count() - 1)
    }

    /// Largest extent of a coordinate relative to its scale.
    pub fn extent(&self) -> f64 {
        let extent = |i: usize| {
            let series = self.points.iter().skip(i).step_by(self.size);
            let (low, high) = series.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
                (a.min(*x), b.max(*x))
            });
            (high - low) / self.scale[i]
        };
        (0..self.size).map(extent).fold(0.0, f64::max)
    }

    /// Distance of points n apart.
    pub fn lag(&self, k: usize, n: usize) -> f64 {
        distance(self.point(k), self.point(k + n), &self.scale)
    }

    /// Derivative of P^n from point k to point k + n; `None` where it has not been kept.
    pub fn derivative(&self, k: usize, n: usize) -> Option<DMatrix<f64>> {
        let numbers = self.size * self.size;
        let kept = self.derivatives.len() / numbers;
        // The derivative from point j to the next is number j + 1 + kept - count.
        let first = (k + 1 + kept).checked_sub(self.count())?;
        let mut product = DMatrix::identity(self.size, self.size);
        let mut next = product.clone();
        for derivative in (self.derivatives.chunks_exact(numbers)).skip(first).take(n) {
            let factor = DMatrixView::from_slice(derivative, self.size, self.size);
            factor.mul_to(&product, &mut next);
            std::mem::swap(&mut product, &mut next);
        }
        Some(product)
    }

    /// Largest distance of points n apart over the last n of them, at least four.
    pub(crate) fn end_recurrence(&self, n: usize) -> f64 {
        let pairs = self.count() - n;
        (pairs.saturating_sub(n.max(4))..pairs)
            .map(|k| self.lag(k, n))
            .fold(0.0, f64::max)
    }

    /// Largest distance of points n apart in each half of the record.
    pub(crate) fn recurrence_halves(&self, n: usize) -> (f64, f64) {
        let pairs = self.count() - n;
        let worst =
            |range: std::ops::Range<usize>| range.map(|k| self.lag(k, n)).fold(0.0, f64::max);
        (worst(0..pairs / 2), worst(pairs / 2..pairs))
    }
}

/// Largest difference of a coordinate relative to its scale.
pub(super) fn distance(a: &[f64], b: &[f64], scale: &[f64]) -> f64 {
    let parts = a.iter().zip(b).zip(scale);
    parts.fold(0.0, |m, ((a, b), s)| f64::max(m, (a - b).abs() / s))
}
