//! Piecewise-affine laws as tables of slopes and offsets, region by region.

use crate::element::Element;

/// A law between its breakpoints: f = slope x + offset.
#[derive(Debug, Clone)]
pub(crate) struct AffineLaw {
    /// Ascending.
    pub breakpoints: Vec<f64>,
    /// One more than breakpoints.
    pub slopes: Vec<f64>,
    /// One more than breakpoints.
    pub offsets: Vec<f64>,
    /// Flank in each region.
    pub flanks: Vec<i8>,
}

impl AffineLaw {
    /// Slopes and offsets read off the law inside each region.
    pub fn read(element: &dyn Element) -> AffineLaw {
        let breakpoints = element.breakpoints();
        let inside = |r: usize| match (r.checked_sub(1).map(|k| breakpoints[k]), breakpoints.get(r))
        {
            (None, None) => 0.0,
            (Some(left), None) => left + left.abs() + 1.0,
            (None, Some(right)) => right - right.abs() - 1.0,
            (Some(left), Some(right)) => 0.5 * (left + right),
        };
        let regions = breakpoints.len() + 1;
        let (mut slopes, mut offsets, mut flanks) = (Vec::new(), Vec::new(), Vec::new());
        for x in (0..regions).map(inside) {
            let response = element.eval(x, 0.0, 0.0);
            slopes.push(response.df_dq);
            offsets.push(response.f - response.df_dq * x);
            flanks.push(element.flank(x));
        }
        AffineLaw {
            breakpoints,
            slopes,
            offsets,
            flanks,
        }
    }
}
