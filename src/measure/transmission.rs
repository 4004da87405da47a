//! Dynamic transmission error of connections with a static one.

use super::{ColumnHeading, Measure, ReportedUnits, Solved};
use crate::postprocess::measures::Meter;
use crate::solve::orbit::Orbit;

/// Samples per Fourier coefficient of a coordinate at least.
const SAMPLES_PER_COEFFICIENT: usize = 8;

/// `dte_rms.c, dte_peak_to_peak.c`: r.m.s. without mean and range of the deformation plus the static transmission error, the
/// relative motion W q of the bodies.
#[derive(Debug)]
pub(crate) struct TransmissionErrors {
    /// Buffers, made where they are wanted first.
    meter: Option<Meter>,
    samples: usize,
    /// Connections with a transmission error.
    connections: Vec<usize>,
}

impl TransmissionErrors {
    /// For orbits with `samples` samples and these connections.
    pub fn new(samples: usize, connections: Vec<usize>) -> TransmissionErrors {
        TransmissionErrors {
            meter: None,
            samples,
            connections,
        }
    }
}

impl Measure for TransmissionErrors {
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let names = units.connections();
        let one = |k: &usize| {
            [
                units.displacement(format!("dte_rms.{}", names[*k]), *k),
                units.displacement(format!("dte_peak_to_peak.{}", names[*k]), *k),
            ]
        };
        self.connections.iter().flat_map(one).collect()
    }

    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        if self.connections.is_empty() {
            return;
        }
        if let Orbit::Fourier(orbit) = at.orbit {
            let coefficients = orbit.coefficients.first().map_or(0, Vec::len);
            let samples = (SAMPLES_PER_COEFFICIENT * coefficients).next_power_of_two();
            if samples > self.samples {
                (self.meter, self.samples) = (None, samples);
            }
        }
        let relative = at.system.without_transmission_errors();
        let meter = self.meter.get_or_insert_with(|| Meter::new(self.samples));
        let measures = meter.measure(&relative, at.orbit);
        for k in &self.connections {
            out.extend([measures[*k].rms, measures[*k].max - measures[*k].min]);
        }
    }
}
