//! Error control of the series flow.

use crate::numeric::taylor::COUNT;
use crate::solve::integrate::MAX_SWITCHES;

/// Error control and limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesOptions {
    /// Error of a step allowed relative to the motion, where the flow is not a closed form.
    pub tolerance: f64,
    /// Taylor coefficients at most, 6 to 24, where the flow is not a closed form.
    pub terms: usize,
    /// Switches allowed in one response period.
    pub max_switches: usize,
    /// Steps allowed in a period of the response besides fifty for every oscillation of the fastest mode: a motion that takes more ends
    /// with [`MaxSteps`](crate::solve::integrate::IntegrationEnd::MaxSteps).
    pub spare_steps: usize,
    /// A coordinate or velocity beyond this has diverged, where the flow is not a closed form.
    pub bound: f64,
}

impl Default for SeriesOptions {
    fn default() -> Self {
        SeriesOptions {
            tolerance: 1e-12,
            terms: COUNT,
            max_switches: MAX_SWITCHES,
            spare_steps: 100_000,
            bound: 1e12,
        }
    }
}
