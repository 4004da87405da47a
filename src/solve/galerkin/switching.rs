//! Switching instants of a law on a trigonometric polynomial, in buffers that are allocated once.

use crate::numeric::fourier::Fourier;
use crate::numeric::roots::newton_bracketed;
use crate::numeric::trigonometric;
use std::f64::consts::TAU;

/// Cells a period and harmonic: no cell holds two extrema of a polynomial that is worth solving for.
const CELLS_PER_HARMONIC: usize = 16;

/// Passage of a breakpoint.
#[derive(Debug, Clone, Copy)]
pub struct ForceSwitch {
    /// Its instant.
    pub tau: f64,
    /// Breakpoint, counted from below.
    pub level: usize,
    /// Region behind it: breakpoints below the deformation.
    pub region: usize,
    /// Derivative of the deformation with respect to tau.
    pub slope: f64,
}

/// Finds switches; owns its buffers.
pub(crate) struct Switching {
    fourier: Fourier,
    derivative: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
    list: Vec<ForceSwitch>,
    first_region: usize,
}

impl Switching {
    /// Buffers for polynomials with a number of harmonics.
    pub fn new(harmonics: usize) -> Switching {
        let cells = (CELLS_PER_HARMONIC * harmonics).next_power_of_two().max(64);
        Switching {
            fourier: Fourier::new(cells),
            derivative: vec![0.0; 2 * harmonics + 1],
            values: vec![0.0; cells],
            slopes: vec![0.0; cells],
            list: Vec::new(),
            first_region: 0,
        }
    }

    /// Makes room for another number of harmonics.
    pub(crate) fn resize(&mut self, harmonics: usize) {
        if self.derivative.len() != 2 * harmonics + 1 {
            *self = Switching::new(harmonics);
        }
    }

    /// Finds the passages of ascending breakpoints by the polynomial with coefficients mean, sin 1, cos 1, ...
    pub fn find(&mut self, breakpoints: &[f64], coefficients: &[f64]) {
        self.list.clear();
        self.first_region = 0;
        if breakpoints.is_empty() {
            return;
        }
        trigonometric::differentiate(coefficients, &mut self.derivative);
        self.fourier.to_samples(coefficients, &mut self.values);
        self.fourier.to_samples(&self.derivative, &mut self.slopes);
        let cells = self.values.len();
        let width = TAU / cells as f64;
        for (level, breakpoint) in breakpoints.iter().enumerate() {
            self.first_region += usize::from(self.values[0] > *breakpoint);
            for j in 0..cells {
                let (from, to) = (
                    self.values[j] - breakpoint,
                    self.values[(j + 1) % cells] - breakpoint,
                );
                let slopes = (self.slopes[j], self.slopes[(j + 1) % cells]);
                let begin = j as f64 * width;
                if (from > 0.0) != (to > 0.0) {
                    self.pass(
                        (level, *breakpoint),
                        coefficients,
                        (begin, from),
                        begin + width,
                    );
                } else if (slopes.0 > 0.0) != (slopes.1 > 0.0)
                    && from.abs() <= slopes.0.abs() * width
                    && (slopes.0 > 0.0) == (from < 0.0)
                {
                    // An extremum that may reach across the level.
                    let slope = |tau: f64| {
                        let [_, first, second] = trigonometric::evaluate(coefficients, tau);
                        (first, second)
                    };
                    let top = newton_bracketed(slope, (begin, slopes.0), begin + width);
                    let beyond = trigonometric::evaluate(coefficients, top)[0] - breakpoint;
                    if (beyond > 0.0) != (from > 0.0) {
                        self.pass((level, *breakpoint), coefficients, (begin, from), top);
                        self.pass(
                            (level, *breakpoint),
                            coefficients,
                            (top, beyond),
                            begin + width,
                        );
                    }
                }
            }
        }
        self.list.sort_unstable_by(|a, b| a.tau.total_cmp(&b.tau));
    }

    /// Notes the root between two instants.
    fn pass(
        &mut self,
        (level, breakpoint): (usize, f64),
        coefficients: &[f64],
        from: (f64, f64),
        end: f64,
    ) {
        let distance = |tau: f64| {
            let [value, slope, _] = trigonometric::evaluate(coefficients, tau);
            (value - breakpoint, slope)
        };
        let tau = newton_bracketed(distance, from, end);
        self.list.push(ForceSwitch {
            tau,
            level,
            region: if from.1 > 0.0 { level } else { level + 1 },
            slope: distance(tau).1,
        });
    }

    /// The switches in the order of time.
    pub fn list(&self) -> &[ForceSwitch] {
        &self.list
    }

    /// Region at tau = 0.
    pub(crate) fn first_region(&self) -> usize {
        self.first_region
    }
}
