//! Piecewise-affine laws as tables of slopes and offsets, region by region.

use crate::element::Element;
use crate::error::SolveError;
use crate::numeric::periodic::Periodic;
use crate::system::{Mount, System};

/// A law between its breakpoints: f = slope x + offset.
#[derive(Debug, Clone)]
pub struct AffineLaw {
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
    fn read(element: &dyn Element) -> AffineLaw {
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

    /// Borders of a region.
    pub fn borders(&self, region: usize) -> (f64, f64) {
        let low = region
            .checked_sub(1)
            .map_or(f64::NEG_INFINITY, |k| self.breakpoints[k]);
        (
            low,
            self.breakpoints
                .get(region)
                .copied()
                .unwrap_or(f64::INFINITY),
        )
    }

    /// Region of a deformation; on a breakpoint the side to which it moves.
    pub fn region(&self, x: f64, rate: f64) -> usize {
        self.breakpoints
            .iter()
            .filter(|b| x > **b || (x == **b && rate > 0.0))
            .count()
    }
}

/// What keeps the exact flow from a connection, if anything does.
pub fn needs(mount: &Mount) -> Option<&'static str> {
    let is_fourier = |e: &Periodic| matches!(e, Periodic::Fourier { .. });
    let is_stepwise = |s: &Periodic| s.is_constant() || matches!(s, Periodic::Rectangular { .. });
    if !mount.element.is_piecewise_affine() {
        Some("exact integration needs a piecewise-affine law (and impact_damping 0)")
    } else if !mount.transmission_error.iter().all(is_fourier) {
        Some("exact integration needs a transmission error made of harmonics, not of a table")
    } else if !mount.stiffness_variation.iter().all(is_stepwise) {
        Some("exact integration needs a constant or rectangular stiffness variation")
    } else {
        None
    }
}

/// The tables of every connection.
///
/// # Errors
/// A law that is not piecewise affine, an excitation that is no Fourier series, or a stiffness variation that is neither
/// constant nor rectangular; the connection is named by its number.
pub fn read(system: &System) -> Result<Vec<AffineLaw>, SolveError> {
    for (connection, mount) in system.mounts().iter().enumerate() {
        if let Some(need) = needs(mount) {
            return Err(SolveError::Unsupported {
                connection,
                reason: need.into(),
            });
        }
    }
    Ok(system
        .mounts()
        .iter()
        .map(|m| AffineLaw::read(m.element.as_ref()))
        .collect())
}
