//! Points of a curve near spots, at the same value of a parameter.

use super::CurveKind;
use super::defining::{Defining, Spot};
use super::shots::Shots;
use super::walker::{NEWTON, PATH};
use crate::error::SolveError;
use crate::solve::continuation::Section;
use crate::solve::newton::Newton;
use crate::solve::residual::Residual;
use nalgebra::DVector;

/// The event to which the corrector leads from a spot at a fixed second parameter, and the flow back.
///
/// # Errors
/// An interruption, or errors of the flow.
pub(crate) fn corrected<'a>(
    shots: Shots<'a>,
    kind: CurveKind,
    spot: &Spot,
) -> Result<(Shots<'a>, Option<Spot>), SolveError> {
    corrected_at(shots, kind, spot, &[1])
}

/// The same at the first of some fixed parameters at which there is one: a curve may lead straight across a parameter.
///
/// # Errors
/// As above.
pub(super) fn corrected_at<'a>(
    shots: Shots<'a>,
    kind: CurveKind,
    spot: &Spot,
    parameters: &[usize],
) -> Result<(Shots<'a>, Option<Spot>), SolveError> {
    let mut problem = Defining::new(shots, kind, spot)?;
    let mut found = None;
    for parameter in parameters {
        if found.is_none() {
            found = match problem.at_parameter(spot, *parameter) {
                Err(SolveError::NoSystem { .. }) => None,
                found => found?,
            };
        }
    }
    let is_pair = |found: &Spot| kind != CurveKind::NeimarkSacker || found.extra.abs() < 1.0;
    Ok((problem.into_shots(), found.filter(is_pair)))
}

impl Defining<'_> {
    /// The point of the curve near a spot at the same value of a parameter.
    fn at_parameter(&mut self, spot: &Spot, parameter: usize) -> Result<Option<Spot>, SolveError> {
        let mut x = self.unknowns(spot);
        if parameter == 1 {
            let mut newton = Newton::new(&self.structure(), NEWTON);
            let outcome = newton.solve(self, &mut x, spot.p[1])?;
            let is_found = outcome.is_converged();
            return Ok(is_found.then(|| self.spot(&x, spot.p[1])));
        }
        let begin = (x, spot.p[1]);
        let mut across = DVector::zeros(begin.0.len());
        across[self.first_parameter()] = 1.0;
        let mut section = Section::new(self, begin, (across, 0.0), PATH)?;
        let point = section.at(self, 0.0)?;
        Ok(point.map(|point| self.spot(&point.u, point.lambda)))
    }
}
